!> Checks lists of crank speeds, and defines the options that all computations over a range of speeds share.
module gestell_study_speeds
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type, check_accuracy
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: check_harmonic_options, check_speeds

  !> Accuracy of the solutions at each speed, and the harmonics of the period that are considered.
  type, public :: harmonic_options
    type(accuracy_type) :: accuracy
    !> The harmonics 1 to `orders` of the period are considered. If the crank makes one turn in the period, these harmonics are
    !> orders of the crank
    integer :: orders = 6
    !> If allocated, the harmonics with these numbers are considered instead
    integer, allocatable :: harmonics(:)
  contains
    procedure :: requested_harmonics
    !> Name of `requested_harmonics` for users of the library, in options for resonance curves
    procedure :: reported_harmonics => requested_harmonics
  end type harmonic_options

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
      & "and be in ascending or descending order", invalid_input)
  end subroutine check_speeds

  !> Checks the options. Fails if the number of an order is negative or too large, or if the accuracy is out of range.
  pure subroutine check_harmonic_options(options, error)
    class(harmonic_options), intent(in) :: options
    type(error_type), allocatable, intent(out) :: error
    integer :: highest

    highest = options%orders
    if (allocated(options%harmonics)) highest = merge(maxval([0, options%harmonics]), -1, all(options%harmonics > 0))
    if (highest < 0 .or. highest > max_orders) then
      call fatal_error(error, "the number of orders must lie between 0 and 8000", invalid_input)
    else
      call check_accuracy(options%accuracy, error)
    end if
  end subroutine check_harmonic_options

  !> Numbers of the harmonics that are considered.
  pure function requested_harmonics(self) result(harmonics)
    class(harmonic_options), intent(in) :: self
    integer, allocatable :: harmonics(:)
    integer :: k

    harmonics = [(k, k = 1, self%orders)]
    if (allocated(self%harmonics)) harmonics = self%harmonics
  end function requested_harmonics

end module gestell_study_speeds
