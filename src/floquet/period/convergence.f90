!> Estimates errors of Phi(T) and x_p(T) from the differences between solutions with several numbers of steps, equation (62) of
!> doc/theory.md, or between a method and its embedded methods, equation (61).
module gestell_floquet_period_convergence
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_floquet_integrator_method, only: unseen_type
  use gestell_floquet_choice_methods, only: begun, pair_begun
  implicit none (type, external)
  private

  public :: detect_rounding, left_by_pair, left_unseen, more_steps, next_steps, promised, remaining, too_many_steps

  !> The first solution whose Phi(T) had converged to the tolerance
  type, public :: begin_type
    !> Its number of steps; 0 if there is none yet
    integer :: steps = 0
    !> Change of x_p(T) at this number of steps, relative to the largest x_p(t)
    real(dp) :: change = 0
  end type begin_type

  !> Maximum number of steps per period: more would take a minute.
  integer, parameter, public :: most_steps = 2**19
  !> Safety factor: an error bound is this factor times the error estimate.
  real(dp), parameter, public :: safety = 4

contains

  !> Reports that more than `most_steps` steps would be needed.
  pure subroutine too_many_steps(error)
    type(error_type), allocatable, intent(out) :: error

    call fatal_error(error, "more than " // text(most_steps) // " steps per turn would be required: the fastest " // &
      & "free vibration is too fast for the crank speed (increase the tolerance, or check stiffness, damping and mass)", &
      & failed_computation)
  end subroutine too_many_steps

  !> Number of steps to try after `n1` and `n2` steps. It doubles until the method has begun to converge; after that it is the
  !> number that the method's order predicts for the allowed error, with a margin.
  pure integer function next_steps(n1, n2, d12, order, allowed) result(steps)
    !> The last two numbers of steps, and the order of the method
    integer, intent(in) :: n1, n2, order
    !> Difference of the two solutions, and the allowed error; both relative
    real(dp), intent(in) :: d12, allowed
    real(dp) :: error, factor

    factor = 2
    if (d12 < begun) then
      error = d12 * promised(n1, n2, order)
      factor = 1.1_dp * (2 * safety * error / allowed)**(1.0_dp / order)
      factor = min(max(factor, 1.25_dp), 16.0_dp)
    end if
    steps = ceiling(n2 * factor)
  end function next_steps

  !> Number of steps (not rounded) to try after `n` steps with a method that contains an embedded method.
  pure real(dp) function more_steps(n, change, order, allowed) result(steps)
    !> Last number of steps, and order of the embedded method
    integer, intent(in) :: n, order
    !> Difference between the solutions of the method and of its embedded method, and the allowed error; both relative
    real(dp), intent(in) :: change, allowed
    real(dp) :: factor

    factor = 2
    if (change < begun) factor = min(max((2 * safety * change / allowed)**(1.0_dp / order), 1.1_dp), 16.0_dp)
    steps = n * factor
  end function more_steps

  !> Estimates the relative errors of Phi(T), 1, and x_p(T), 2, for a method that is fitted to a motion and contains two embedded
  !> methods.
  !>
  !> Until the second difference is below `pair_begun` the methods have not begun to converge: the estimate is then the whole
  !> change. Afterwards it is a sum, the larger of `rest` and a part of the change, plus a fiftieth of the change. The sum is
  !> multiplied by twice change / next, but by no less than 1/32 (1/16 where `rest` is the whole change). The part that the fitting
  !> misses is added.
  !>
  !> x_p(T) is not assumed to converge faster than Phi(T), nor to have a smaller relative rest: its change and its rest may be small
  !> by chance.
  pure function left_by_pair(change, next, rest, missed) result(left)
    !> `change`: difference between the method and the first embedded one; `next`: between the first and the second embedded one;
    !> `rest`: part of the change that the leading term does not explain; `missed`: part of the change by which the method misses a
    !> motion that it is not fitted to (all relative, see gestell_floquet_period_pair)
    real(dp), intent(in) :: change(2), next(2), rest(2), missed
    real(dp) :: left(2), contraction(2), whole(2), part

    left = change
    if (next(1) >= pair_begun) return
    contraction = change / max(next, tiny(next))
    contraction(2) = maxval(contraction)
    whole = max(change, contraction * next)
    part = min(rest(1) / max(change(1), tiny(part)), 1.0_dp)
    left = min(max(rest, part * whole) + whole / 50, whole) * min(max(2 * contraction, (1 + part) / 32), 1.0_dp) &
      & + whole * min(missed, 1.0_dp)
  end function left_by_pair

  !> Estimates the relative errors of Phi(T), 1, and x_p(T), 2, from variations of coefficients and loads between the nodes. The
  !> embedded methods use the same nodes, so comparing them does not reveal these errors.
  !>
  !> The part of the coefficients counts 24 times: this covers a change that takes no longer than a step. For the loads the largest
  !> of three estimates counts, but at most the whole load:
  !> - the error of the loads, times 2 + turns / 4;
  !> - the interpolation error between the s nodes times (z / 2)^s / (1 3 ... (2 s - 1)), where the fastest motion turns by z in a
  !>   step. The factor bounds the part of cos(z t) along the Legendre polynomial P_s. A fast motion does not average this error
  !>   out;
  !> - half of the changes of velocity by the error of the loads, relative to the largest x_p. This matters where a small load
  !>   moves the system most.
  !>
  !> With the safety factor each estimate is at least 1.5 times what random machines need.
  pure function left_unseen(unseen, scale, peak, angle, stages) result(left)
    !> Variations between the nodes, summed over the steps
    type(unseen_type), intent(in) :: unseen
    !> Units of the states, shape (n); largest norm of x_p / scale; angle (radians) by which the fastest motion turns in a step
    real(dp), intent(in) :: scale(:), peak, angle
    !> Number of stages s
    integer, intent(in) :: stages
    real(dp) :: left(2), loads, part
    integer :: k

    left(1) = 24 * unseen%coefficients
    part = min(product([(min(angle, 100.0_dp) / (4 * k - 2), k = 1, stages)]), 1.0_dp)
    loads = max((2 + unseen%turns / 4) * unseen%loads, part * unseen%missed) / max(unseen%load, tiny(left))
    if (allocated(unseen%kicks)) loads = max(loads, norm2(unseen%kicks / scale(size(scale) - size(unseen%kicks) + 1:)) &
      & / max(2 * peak, tiny(peak)))
    left(2) = left(1) + min(loads, 1.0_dp)
  end function left_unseen

  !> Detects whether x_p(T) is limited by rounding, as happens where the forces cancel. This is so if there are at least 4096 steps,
  !> Phi(T) had converged with a 64th of them, and the change of x_p(T) has since fallen more slowly than the number of steps has
  !> grown.
  pure subroutine detect_rounding(change, steps, allowed, begin, rounding)
    !> Changes of Phi(T) and of x_p(T) by the last number of steps; and the tolerance, all relative
    real(dp), intent(in) :: change(2), allowed
    !> Last number of steps
    integer, intent(in) :: steps
    !> The first solution whose Phi(T) had converged; set here when the change first falls to the tolerance
    type(begin_type), intent(inout) :: begin
    !> True if more steps do not make x_p(T) more accurate
    logical, intent(out) :: rounding
    integer, parameter :: long = 64, many = 4096

    if (begin%steps == 0 .and. change(1) <= allowed) begin = begin_type(steps, change(2))
    rounding = .false.
    if (begin%steps == 0 .or. steps < max(long * begin%steps, many)) return
    rounding = change(2) * steps > begin%change * begin%steps
  end subroutine detect_rounding

  !> Estimated error of the finest of three solutions with n1 < n2 < n3 steps, in the units of d12 and d23.
  !>
  !> The observed order p follows from (n1^-p - n2^-p) / (n2^-p - n3^-p) = d12 / d23 and is never taken above the method's order.
  !> The error is d23 c / (1 - c) with c = (n2 / n3)^p, times `unevenness`. Errors change sign now and then, so a difference can be
  !> small by chance: the estimate is at least the error that d12 and the method's order predict.
  elemental real(dp) function remaining(d12, d23, n1, n2, n3, order) result(left)
    !> Differences between solutions 1 and 2, and between solutions 2 and 3
    real(dp), intent(in) :: d12, d23
    !> Numbers of steps, and order of the method
    integer, intent(in) :: n1, n2, n3, order
    real(dp) :: contraction

    contraction = (real(n2, dp) / n3)**measured_order(d12, d23, n1, n2, n3, order)
    left = max(d23 * unevenness(order) * contraction / (1 - contraction), d12 * promised(n1, n3, order))
  end function remaining

  !> Factor by which the method's order promises to reduce the error from `steps` to `finer` steps, times `unevenness`.
  elemental real(dp) function promised(steps, finer, order)
    integer, intent(in) :: steps, finer, order

    promised = unevenness(order) * (real(steps, dp) / finer)**order
  end function promised

  !> Margin for the uneven convergence of methods of high order. Their error falls as if a step were now and then a tenth longer
  !> than its number says. Up to order four the safety factor covers this.
  elemental real(dp) function unevenness(order)
    integer, intent(in) :: order

    unevenness = max(1.0_dp, 1.1_dp**(order - 4))
  end function unevenness

  !> Observed order p from (n1^-p - n2^-p) / (n2^-p - n3^-p) = d12 / d23, by bisection between 1/2 and the method's order.
  elemental real(dp) function measured_order(d12, d23, n1, n2, n3, order) result(p)
    real(dp), intent(in) :: d12, d23
    integer, intent(in) :: n1, n2, n3, order
    real(dp) :: low, high
    integer :: halving

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
  end function measured_order

end module gestell_floquet_period_convergence
