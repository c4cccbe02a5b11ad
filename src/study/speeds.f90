!> Checks lists of crank speeds and numbers of orders.
module gestell_study_speeds
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: check_orders, check_speeds

  !> Largest number of orders of the crank that can be requested.
  integer, parameter :: max_orders = 8000

contains

  !> Checks a list of speeds (1/min). Fails if it is empty or contains values that are not finite, if the signs differ, or if the
  !> speeds are not strictly ascending or descending.
  pure subroutine check_speeds(speeds, error)
    real(dp), intent(in) :: speeds(:)
    type(error_type), allocatable, intent(out) :: error
    logical :: sound
    integer :: n

    n = size(speeds)
    sound = n > 0 .and. all(ieee_is_finite(speeds)) .and. (all(speeds > 0) .or. all(speeds < 0))
    if (sound .and. n > 1) sound = all(speeds(2:) > speeds(:n - 1)) .or. all(speeds(2:) < speeds(:n - 1))
    if (.not. sound) call fatal_error(error, "at least one speed is required; all speeds must be finite, have the same sign, " // &
      &   "and be in ascending or descending order", &
      & invalid_input)
  end subroutine check_speeds

  !> Checks a number of orders. Fails if it is negative or too large.
  pure subroutine check_orders(orders, error)
    integer, intent(in) :: orders
    type(error_type), allocatable, intent(out) :: error

    if (orders < 0 .or. orders > max_orders) call fatal_error(error, "the number of orders must lie between 0 and 8000", &
      & invalid_input)
  end subroutine check_orders

end module gestell_study_speeds
