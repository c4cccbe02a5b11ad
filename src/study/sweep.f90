!> A tile of a sweep.
module gestell_study_sweep
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_family, only: family_type
  use gestell_study_grid, only: grid_type, tile_type
  use gestell_study_point, only: solve_point, sweep_order_type
  use gestell_study_tile_results, only: sweep_columns, tile_results_type
  implicit none (type, external)
  private

  public :: solve_tile

contains

  !> The points of `tile`. Error: the parameters of a point make no sense.
  subroutine solve_tile(family, grid, tile, order, results, error)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile
    type(sweep_order_type), intent(in) :: order
    type(tile_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: all(sweep_columns)
    integer :: i, j

    allocate(results%values(count(order%columns), tile%last(2) - tile%first(2) + 1, tile%last(1) - tile%first(1) + 1))
    do i = tile%first(1), tile%last(1)
      do j = tile%first(2), tile%last(2)
        call solve_point(family, grid%parameters(i, j), order, all, error)
        if (allocated(error)) return
        results%values(:, j - tile%first(2) + 1, i - tile%first(1) + 1) = pack(all, order%columns)
        results%solutions = results%solutions + 1
      end do
    end do
  end subroutine solve_tile

end module gestell_study_sweep
