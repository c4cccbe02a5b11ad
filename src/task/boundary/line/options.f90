!> Options of a search for borders.
module gestell_task_boundary_line_options
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type, check_accuracy
  use gestell_study_grid, only: axis_type, check_axis
  use gestell_task_common_executor, only: executor_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: check_search

  !> Tolerance of borders along one parameter, relative to the range.
  real(dp), parameter, public :: usual_tolerance = 1.0e-10_dp

  type, public :: border_options
    type(accuracy_type) :: accuracy
    !> Error of borders over one parameter, and deviation of curves over two from the border, relative to the ranges.
    real(dp) :: tolerance = usual_tolerance
    !> Spreads the work over threads, where several of them may ask for members of the family.
    class(executor_type), pointer :: executor => null()
  end type border_options

  !> Maximum number of search points; limits of the tolerance.
  integer(int64), parameter, public :: most_searched = 10_int64**7
  real(dp), parameter, public :: least_tolerance = 1.0e-13_dp, greatest_tolerance = 0.1_dp

contains

  !> Errors: an axis that is none or has no length, too many search points, a tolerance or an accuracy out of range.
  pure subroutine check_search(axes, accuracy, tolerance, error)
    type(axis_type), intent(in) :: axes(:)
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in) :: tolerance
    type(error_type), allocatable, intent(out) :: error
    integer :: k

    call check_accuracy(accuracy, error)
    do k = 1, size(axes)
      if (.not. allocated(error)) call check_axis(axes(k), error)
    end do
    if (allocated(error)) return
    if (any(axes%count < 2)) then
      call fatal_error(error, "borders are sought in a range: two values at least", invalid_input)
    else if (product(real(axes%count, dp)) > most_searched) then
      call fatal_error(error, "there are more than 1e7 points to search", invalid_input)
    else if (.not. (tolerance >= least_tolerance .and. tolerance <= greatest_tolerance)) then
      call fatal_error(error, "the tolerance of borders must lie between 1e-13 and 0.1", invalid_input)
    end if
  end subroutine check_search

end module gestell_task_boundary_line_options
