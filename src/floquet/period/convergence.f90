!> Estimates errors of Phi(T) and x_p(T). It compares solutions with several numbers of steps, equation (62) of doc/theory.md, or a
!> method with its embedded methods, equation (61).
module gestell_floquet_period_convergence
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_floquet_integrator_method, only: unresolved_type
  use gestell_floquet_choice_methods, only: begun, pair_begun
  implicit none (type, external)
  private

  public :: check_steps, detect_rounding, pair_errors, unresolved_errors, more_steps, next_steps, predicted_reduction, &
    & extrapolated_error

  !> Describes the first solution in which Phi(T) had converged to the tolerance.
  type, public :: begin_type
    !> Number of steps of the first solution that has converged; 0 if no solution has converged yet
    integer :: steps = 0
    !> Change of x_p(T) in the first solution that has converged, relative to the largest x_p(t)
    real(dp) :: change = 0
  end type begin_type

  !> Maximum number of steps per period; a solution with more steps would take a minute or longer.
  integer, parameter :: max_steps = 2**19
  !> Safety factor: an error bound is this factor times the error estimate.
  real(dp), parameter, public :: safety = 4

contains

  !> Fails if a solution would require more than `max_steps` steps.
  pure subroutine check_steps(steps, error)
    real(dp), intent(in) :: steps
    type(error_type), allocatable, intent(out) :: error

    if (.not. steps <= max_steps) call fatal_error(error, "more than " // text(max_steps) // " steps per turn would be required: " &
      & // "the fastest free vibration is too fast for the crank speed (increase the tolerance, or check stiffness, damping and " &
      & // "mass)", failed_computation)
  end subroutine check_steps

  !> Number of steps to try after solutions with `n1` and `n2` steps. As long as the method does not converge, the number is
  !> doubled. Then the number is chosen for which the method's order predicts the allowed error, with a margin.
  pure integer function next_steps(n1, n2, d12, order, allowed) result(steps)
    !> `n1`, `n2`: numbers of steps of the last two solutions. `order`: order of the method.
    integer, intent(in) :: n1, n2, order
    !> `d12`: relative difference between the last two solutions. `allowed`: allowed relative error.
    real(dp), intent(in) :: d12, allowed
    real(dp) :: error, factor

    factor = 2
    if (d12 < begun) then
      error = d12 * predicted_reduction(n1, n2, order)
      factor = 1.1_dp * (2 * safety * error / allowed)**(1.0_dp / order)
      factor = min(max(factor, 1.25_dp), 16.0_dp)
    end if
    steps = ceiling(n2 * factor)
  end function next_steps

  !> Number of steps, not yet rounded, to try after `n` steps with a method that has embedded methods.
  pure real(dp) function more_steps(n, change, order, allowed) result(steps)
    !> `n`: number of steps of the last solution. `order`: order of the method.
    integer, intent(in) :: n, order
    !> `change`: estimated relative error of the last solution. `allowed`: allowed relative error.
    real(dp), intent(in) :: change, allowed
    real(dp) :: factor

    factor = 2
    if (change < begun) factor = min(max((2 * safety * change / allowed)**(1.0_dp / order), 1.1_dp), 16.0_dp)
    steps = n * factor
  end function more_steps

  !> Estimates the relative errors of Phi(T), index 1, and x_p(T), index 2, of a fitted method with two embedded methods:
  !>
  !>     error = min(max(rest, part change) + change / 50, change) min(max(2 c, (1 + part) / 32), 1) + change missed,
  !>     c = change / next,   part = rest / change of Phi(T).
  !>
  !> The last term, change missed, is the leading error term. The product before it has two factors. The first factor is the part
  !> of `change` that the leading term does not explain. The second factor bounds the ratio of the error of the method to the
  !> error of the first embedded method. As long as `next` exceeds `pair_begun`, the methods do not converge yet, and the
  !> estimate is `change` itself.
  !>
  !> For x_p(T), `change` or `rest` may be small by chance. Therefore c and part of x_p(T) are at least as large as those of
  !> Phi(T), and its `change` counts as at least c next.
  pure function pair_errors(change, next, rest, missed) result(estimated_error)
    !> Relative differences (see gestell_floquet_period_embedded_error). `change`: difference between the method and the first
    !> embedded method. `next`: difference between the first and the second embedded method. `rest`: part of `change` that the
    !> leading error term does not explain. `missed`: error in motions to which the method is not fitted, as a fraction of `change`.
    real(dp), intent(in) :: change(2), next(2), rest(2), missed
    real(dp) :: estimated_error(2), contraction(2), whole(2), part

    estimated_error = change
    if (next(1) >= pair_begun) return
    contraction = change / max(next, tiny(next))
    contraction(2) = maxval(contraction)
    whole = max(change, contraction * next)
    part = min(rest(1) / max(change(1), tiny(part)), 1.0_dp)
    estimated_error = min(max(rest, part * whole) + whole / 50, whole) * min(max(2 * contraction, (1 + part) / 32), 1.0_dp) &
      & + whole * min(missed, 1.0_dp)
  end function pair_errors

  !> Estimates the relative errors of Phi(T), index 1, and x_p(T), index 2, that arise from variations of coefficients and loads
  !> between the nodes. Comparing the embedded methods does not reveal these errors, because they use the same nodes.
  !>
  !> The estimate for the coefficients is multiplied by 24, which is sufficient for a change that takes no longer than a step.
  !> The estimate for the loads is the largest of three values, but at most the size of the loads themselves:
  !> - the quadrature error of the loads, multiplied by (2 + turns / 4);
  !> - the interpolation error of the loads between the s nodes, multiplied by (z / 2)^s / (1 3 ... (2 s - 1)), where the phase
  !>   of the fastest motion advances by z in a step. This factor bounds the part of cos(z t) along the Legendre polynomial P_s.
  !>   The oscillation of a fast motion does not average the interpolation error out;
  !> - half of the changes of velocity due to the error of the loads, relative to the largest x_p. This value is the largest of
  !>   the three if a small load causes the largest motion.
  !>
  !> With the safety factor each estimate is at least 1.5 times the error observed for random machines.
  pure function unresolved_errors(unresolved, scale, peak, angle, stages) result(estimated_error)
    !> Effects of variations of the coefficients and loads between the nodes, summed over the steps
    type(unresolved_type), intent(in) :: unresolved
    !> `scale`: units of the states, shape (n). `peak`: largest norm of x_p / scale. `angle`: phase advance (radians) of the fastest
    !> motion in a step.
    real(dp), intent(in) :: scale(:), peak, angle
    !> Number of stages s
    integer, intent(in) :: stages
    real(dp) :: estimated_error(2), loads, part
    integer :: k

    estimated_error(1) = 24 * unresolved%coefficients
    part = min(product([(min(angle, 100.0_dp) / (4 * k - 2), k = 1, stages)]), 1.0_dp)
    loads = max((2 + unresolved%turns / 4) * unresolved%loads, part * unresolved%missed) / max(unresolved%load, &
      & tiny(estimated_error))
    if (allocated(unresolved%velocity_errors)) loads = max(loads, norm2(unresolved%velocity_errors &
      & / scale(size(scale) - size(unresolved%velocity_errors) + 1:)) / max(2 * peak, tiny(peak)))
    estimated_error(2) = estimated_error(1) + min(loads, 1.0_dp)
  end function unresolved_errors

  !> Detects whether rounding errors limit the accuracy of x_p(T), as happens where forces cancel. Three conditions must hold:
  !>
  !> - the solution has at least 4096 steps,
  !> - Phi(T) had already converged with a 64th of these steps,
  !> - since that solution the change of x_p(T) has fallen by a smaller factor than the number of steps has grown.
  pure subroutine detect_rounding(change, steps, allowed, begin, rounding)
    !> `change`: relative changes of Phi(T) and x_p(T) at the last increase of the number of steps. `allowed`: relative tolerance.
    real(dp), intent(in) :: change(2), allowed
    !> Number of steps of the last solution
    integer, intent(in) :: steps
    !> The first solution in which Phi(T) had converged; set here when the change of Phi(T) first falls to the tolerance
    type(begin_type), intent(inout) :: begin
    !> True if a larger number of steps does not make x_p(T) more accurate
    logical, intent(out) :: rounding
    integer, parameter :: long = 64, many = 4096

    if (begin%steps == 0 .and. change(1) <= allowed) begin = begin_type(steps, change(2))
    rounding = .false.
    if (begin%steps == 0 .or. steps < max(long * begin%steps, many)) return
    rounding = change(2) * steps > begin%change * begin%steps
  end subroutine detect_rounding

  !> Estimated error of the finest of three solutions with n1 < n2 < n3 steps, in the units of `d12` and `d23`.
  !>
  !> The observed order p follows from (n1^-p - n2^-p) / (n2^-p - n3^-p) = d12 / d23; it is limited to the method's order. The
  !> error is d23 c / (1 - c) with c = (n2 / n3)^p, times `convergence_margin`. Because errors occasionally change sign, a
  !> difference may be small by chance. The estimate is therefore never below the error that `d12` and the method's order
  !> predict.
  elemental real(dp) function extrapolated_error(d12, d23, n1, n2, n3, order) result(estimated_error)
    !> `d12`: difference between solutions 1 and 2. `d23`: difference between solutions 2 and 3.
    real(dp), intent(in) :: d12, d23
    !> Numbers of steps of the three solutions, and order of the method
    integer, intent(in) :: n1, n2, n3, order
    real(dp) :: low, high, p, contraction
    integer :: halving

    ! Bisection for p between 1/2 and the method's order.
    low = 0.5_dp
    high = order
    do halving = 1, 30
      p = (low + high) / 2
      if (d12 * (1 - (real(n2, dp) / n3)**p) > d23 * ((real(n2, dp) / n1)**p - 1)) then
        low = p
      else
        high = p
      end if
    end do
    contraction = (real(n2, dp) / n3)**p
    estimated_error = max(d23 * convergence_margin(order) * contraction / (1 - contraction), d12 * predicted_reduction(n1, n3, &
      & order))
  end function extrapolated_error

  !> Ratio of the error with `finer` steps to the error with `steps` steps: the ratio that the method's order predicts, times
  !> `convergence_margin`.
  elemental real(dp) function predicted_reduction(steps, finer, order)
    integer, intent(in) :: steps, finer, order

    predicted_reduction = convergence_margin(order) * (real(steps, dp) / finer)**order
  end function predicted_reduction

  !> Margin for the uneven convergence of methods of high order: their error is sometimes as large as that of steps that are
  !> longer by a tenth. Methods up to order four need no margin besides the safety factor.
  elemental real(dp) function convergence_margin(order)
    integer, intent(in) :: order

    convergence_margin = max(1.0_dp, 1.1_dp**(order - 4))
  end function convergence_margin

end module gestell_floquet_period_convergence
