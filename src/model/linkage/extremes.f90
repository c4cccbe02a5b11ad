!> Minimum and maximum of a function over the turn. The function is given at successive crank angles by jets, which contain its
!> value and derivatives.
module gestell_model_linkage_extremes
  use gestell_math_jet, only: jet
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> Minimum and maximum of a function over all crank angles so far.
  type, public :: extremes_type
    real(dp) :: least = huge(1.0_dp), maximum = -huge(1.0_dp)
    !> Crank angles at which the minimum and the maximum occur (rad).
    real(dp) :: least_at = 0, maximum_at = 0
  contains
    procedure :: take
  end type extremes_type

contains

  !> Updates the extremes after a step of the crank angle from `from` to `from` + `step`. The function has the jet `before` at the
  !> start of the step and `now` at its end. If the derivative changes sign, the extremum is computed from the polynomial of degree
  !> five with the values and first two derivatives of both jets. The error of this extremum is step^6/46080 times the sixth
  !> derivative.
  pure subroutine take(self, before, now, from, step)
    class(extremes_type), intent(inout) :: self
    type(jet), intent(in) :: before, now
    real(dp), intent(in) :: from, step
    real(dp) :: c(0:5), reach, t

    call keep(self, before%v, from)
    call keep(self, now%v, from + step)
    if (before%d * now%d >= 0) return
    ! Between the two angles the function hardly changes by more than this. Most sign changes due to rounding return here.
    reach = step * (abs(before%d) + abs(now%d))
    if (max(before%v, now%v) + reach <= self%maximum .and. min(before%v, now%v) - reach >= self%least) return
    c = coefficients(before, now, step)
    t = turning_point(c)
    call keep(self, c(0) + t * (c(1) + t * (c(2) + t * (c(3) + t * (c(4) + t * c(5))))), from + t * step)
  end subroutine take

  pure subroutine keep(self, value, angle)
    class(extremes_type), intent(inout) :: self
    real(dp), intent(in) :: value, angle

    if (value > self%maximum) self%maximum_at = angle
    self%maximum = max(self%maximum, value)
    if (value < self%least) self%least_at = angle
    self%least = min(self%least, value)
  end subroutine keep

  !> Coefficients of 1, t, ... t^5 in the interpolating polynomial, where t runs from 0 to 1 over the step.
  pure function coefficients(before, now, step) result(c)
    type(jet), intent(in) :: before, now
    real(dp), intent(in) :: step
    real(dp) :: c(0:5), rise, slope, bend

    c(0) = before%v
    c(1) = step * before%d
    c(2) = step**2 * before%dd / 2
    ! Remainders at t = 1 of the function and its derivatives after these three terms.
    rise = (now%v - before%v) - c(1) - c(2)
    slope = step * now%d - c(1) - 2 * c(2)
    bend = step**2 * now%dd - 2 * c(2)
    c(3) = 10 * rise - 4 * slope + bend / 2
    c(4) = -15 * rise + 7 * slope - bend
    c(5) = 6 * rise - 3 * slope + bend / 2
  end function coefficients

  !> The t at which the polynomial's derivative is zero, found by bisection. The derivative has different signs at 0 and 1.
  pure real(dp) function turning_point(c) result(t)
    real(dp), intent(in) :: c(0:5)
    !> Number of bisections. Near an extremum the function is flat: half of the digits of t suffice for all digits of the extremum.
    integer, parameter :: halvings = 30
    real(dp) :: left, right
    integer :: i

    left = 0
    right = 1
    do i = 1, halvings
      t = (left + right) / 2
      if ((c(1) + t * (2 * c(2) + t * (3 * c(3) + t * (4 * c(4) + t * 5 * c(5))))) * c(1) > 0) then
        left = t
      else
        right = t
      end if
    end do
  end function turning_point

end module gestell_model_linkage_extremes
