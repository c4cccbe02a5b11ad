!> What the differences between solutions with several numbers of steps tell about their errors.
module gestell_floquet_period_convergence
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_floquet_integrator_method, only: unseen_type
  use gestell_floquet_choice_methods, only: begun, pair_begun
  implicit none (type, external)
  private

  public :: detect_rounding, left_by_pair, left_unseen, more_steps, next_steps, promised, remaining, too_many_steps

  !> The number of steps with which Phi(T) was known, 0: not yet, and by how much x_p(T) changed there.
  type, public :: begin_type
    integer :: steps = 0
    real(dp) :: change = 0
  end type begin_type

  !> More steps than this are not tried: they would take a minute.
  integer, parameter, public :: most_steps = 2**19
  !> The estimate of an error, times this, is called a bound.
  real(dp), parameter, public :: safety = 4

contains

  pure subroutine too_many_steps(error)
    type(error_type), allocatable, intent(out) :: error

    call fatal_error(error, "more than " // text(most_steps) // " steps per turn would be needed: the fastest free " // &
      & "vibration is too fast for the crank speed (allow a greater tolerance, or check stiffness, damping and mass)", &
      & failed_computation)
  end subroutine too_many_steps

  !> How many steps are to be tried after `n1` and `n2`, whose solutions differ by `d12`: twice as many as long as the
  !> method has not begun to converge, then what its order promises, with a margin, for the error allowed.
  pure integer function next_steps(n1, n2, d12, order, allowed) result(steps)
    integer, intent(in) :: n1, n2, order
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

  !> How many steps are to be tried after `n`, with which the solution differs by `change` from that of an embedded method of this
  !> order, for the error allowed.
  pure real(dp) function more_steps(n, change, order, allowed) result(steps)
    integer, intent(in) :: n, order
    real(dp), intent(in) :: change, allowed
    real(dp) :: factor

    factor = 2
    if (change < begun) factor = min(max((2 * safety * change / allowed)**(1.0_dp / order), 1.1_dp), 16.0_dp)
    steps = n * factor
  end function more_steps

  !> The errors of Phi(T) and x_p(T) by a method that is fitted to a motion, from the `change` that it makes of those of the one
  !> embedded in it, that of the one embedded in that, `next`, what these tell of the method wrongly, `rest`, and the part of the
  !> change by which it misses a motion that it is not fitted to, `missed`: where both have begun to converge the rest and a
  !> fiftieth of the change, times twice change / next, which counts a 32nd at least, a 16th where all is rest, and what is missed;
  !> else the change. x_p(T) is not taken to converge faster than Phi(T), nor to be told more exactly, from which it has
  !> what it does not have from the load: its change and its rest may be small by chance.
  pure function left_by_pair(change, next, rest, missed) result(left)
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

  !> The errors of Phi(T) and x_p(T) by what the nodes do not tell, which all embedded methods share. A coefficient's part counts
  !> 24 times, as where a change takes no longer than a step; a load's part of its error twice, and a quarter for each radian, or
  !> half of the changes of velocity by all that is missed beside the greatest size `peak` of x_p, in units `scale`, where that is
  !> more, as where one of the loads is small and moves most; or, where the fastest motion turns far in
  !> a step, z = `angle`, what interpolation between s nodes, `stages`, misses, times the part of cos(z t) along the same
  !> polynomial P_s, at most (z / 2)^s / (1 3 ... (2 s - 1)): such a motion does not average it; up to all of it. (With the safety
  !> all are at least one and a half times what random machines need.)
  pure function left_unseen(unseen, scale, peak, angle, stages) result(left)
    type(unseen_type), intent(in) :: unseen
    real(dp), intent(in) :: scale(:), peak, angle
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

  !> Whether `change`, that of Phi(T) and x_p(T) by the last number of `steps`, shows that x_p is as exact as rounding lets it
  !> be, as where the forces cancel: Phi(T) was known to within `allowed` with a 64th of the steps, and x_p came nearer by less
  !> than their number since. `begin`: where Phi(T) was known first.
  pure subroutine detect_rounding(change, steps, allowed, begin, rounding)
    real(dp), intent(in) :: change(2), allowed
    integer, intent(in) :: steps
    type(begin_type), intent(inout) :: begin
    logical, intent(out) :: rounding
    integer, parameter :: long = 64, many = 4096

    if (begin%steps == 0 .and. change(1) <= allowed) begin = begin_type(steps, change(2))
    rounding = .false.
    if (begin%steps == 0 .or. steps < max(long * begin%steps, many)) return
    rounding = change(2) * steps > begin%change * begin%steps
  end subroutine detect_rounding

  !> The error left in the finest of three solutions:
  !> d12 and d23 are the differences between solutions with n1 < n2 < n3 steps; they give the order p that the convergence
  !> really has, (n1^-p - n2^-p) / (n2^-p - n3^-p) = d12 / d23, never taken above the method's, and the error
  !> d23 c / (1 - c) with c = (n2 / n3)^p. Errors change their sign now and then, and a
  !> difference is small by chance: so at least what the first difference and the method's order leave. Times the unevenness.
  elemental real(dp) function remaining(d12, d23, n1, n2, n3, order) result(left)
    real(dp), intent(in) :: d12, d23
    integer, intent(in) :: n1, n2, n3, order
    real(dp) :: contraction

    contraction = (real(n2, dp) / n3)**measured_order(d12, d23, n1, n2, n3, order)
    left = max(d23 * unevenness(order) * contraction / (1 - contraction), d12 * promised(n1, n3, order))
  end function remaining

  !> What the method's order leaves, at `finer` steps, of the error with `steps`.
  elemental real(dp) function promised(steps, finer, order)
    integer, intent(in) :: steps, finer, order

    promised = unevenness(order) * (real(steps, dp) / finer)**order
  end function promised

  !> The error of a method of high order falls unevenly with the number of steps, as if each were now and then longer by a tenth
  !> than the number says; up to order four the safety covers that.
  elemental real(dp) function unevenness(order)
    integer, intent(in) :: order

    unevenness = max(1.0_dp, 1.1_dp**(order - 4))
  end function unevenness

  !> p of (N1^-p - N2^-p) / (N2^-p - N3^-p) = d12 / d23 by bisection, between 1/2 and the method's order.
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
