!> What the points of a sweep tell together.
module gestell_task_sweep_summary
  use gestell_base_kinds, only: dp
  use gestell_study_vibration_small_motion, only: small_turn
  use gestell_study_tile_results, only: psi_peak, rho_max, sweep_columns, tile_results_type, verdict_column, verdict_names
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  type, public :: summary_type
    integer(int64) :: points = 0
    !> Points of each verdict, as numbered in gestell_study_tile_results; zeros where the column was not ordered.
    integer(int64) :: verdicts(0:size(verdict_names) - 1) = 0
    !> Range of rho_max and the point of the greatest, on each axis; nothing was found while least > most.
    real(dp) :: least = huge(1.0_dp), most = -huge(1.0_dp)
    integer :: where(2) = 0
    !> Points at which psi turns too far for linear equations, and the greatest of all (rad).
    integer(int64) :: turned = 0
    real(dp) :: greatest_turn = 0
    !> As in tile_results_type, of all tiles.
    integer(int64) :: solutions = 0, checks = 0
    real(dp) :: deviation = 0
  contains
    procedure :: add_tile
    procedure :: add_points
  end type summary_type

contains

  !> How a tile was computed.
  pure subroutine add_tile(self, results)
    class(summary_type), intent(inout) :: self
    type(tile_results_type), intent(in) :: results

    self%solutions = self%solutions + results%solutions
    self%checks = self%checks + results%checks
    self%deviation = max(self%deviation, results%deviation)
  end subroutine add_tile

  !> Points, values of shape (ordered columns, points of the second axis, points of the first), of which the first is
  !> point `first` on the axes.
  pure subroutine add_points(self, columns, first, values)
    class(summary_type), intent(inout) :: self
    logical, intent(in) :: columns(sweep_columns)
    integer, intent(in) :: first(2)
    real(dp), intent(in) :: values(:, :, :)
    integer :: i, j, column, word

    self%points = self%points + size(values, 2, kind=int64) * size(values, 3)
    column = verdict_column(columns)
    if (column > 0) then
      do i = 1, size(values, 3)
        do j = 1, size(values, 2)
          word = nint(values(column, j, i))
          self%verdicts(word) = self%verdicts(word) + 1
        end do
      end do
    end if
    if (columns(psi_peak)) then
      column = count(columns(:psi_peak))
      do i = 1, size(values, 3)
        do j = 1, size(values, 2)
          if (ieee_is_nan(values(column, j, i))) cycle
          if (values(column, j, i) > small_turn) self%turned = self%turned + 1
          self%greatest_turn = max(self%greatest_turn, values(column, j, i))
        end do
      end do
    end if
    if (.not. columns(rho_max)) return
    column = count(columns(:rho_max))
    do i = 1, size(values, 3)
      do j = 1, size(values, 2)
        ! a comparison with NaN would raise a floating-point exception
        if (ieee_is_nan(values(column, j, i))) cycle
        if (values(column, j, i) < self%least) self%least = values(column, j, i)
        if (.not. values(column, j, i) > self%most) cycle
        self%most = values(column, j, i)
        self%where = first + [i - 1, j - 1]
      end do
    end do
  end subroutine add_points

end module gestell_task_sweep_summary
