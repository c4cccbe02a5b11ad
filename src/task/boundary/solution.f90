!> The task `boundary`: borders over one or two parameters, and the way from an unstable machine to the nearest stable one.
module gestell_task_boundary_solution
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_task_boundary, only: border_accuracy, border_type, border_rest_type, find_nearest, nearest_type, search_borders
  use gestell_task_boundary_branches, only: find_branch_borders
  use gestell_task_boundary_order, only: border_order_type, usual_tolerance
  use gestell_task_boundary_map, only: border_line_type, border_map_type, search_border_line, trace_borders
  use gestell_study_family, only: family_type
  use gestell_study_grid, only: grid_type
  implicit none (type, external)
  private

  public :: search_line_of, solve_borders

  type, public :: border_results_type
    !> One parameter: its critical values.
    type(border_type), allocatable :: values(:)
    type(border_rest_type) :: rest
    !> Two: the curves.
    type(border_map_type), allocatable :: map
    !> From the base along each parameter; unallocated without a base, and where it is not unstable.
    type(nearest_type), allocatable :: nearest(:)
  end type border_results_type

contains

  !> Searches line `number` of the grid of two parameters (gestell_task_boundary_map): for `solve_borders`, by as many threads
  !> as there are lines if `member` of the family may be called so. Error: the parameters make no sense.
  subroutine search_line_of(family, grid, order, number, line, error)
    class(family_type), intent(in), target :: family
    type(grid_type), intent(in) :: grid
    type(border_order_type), intent(in) :: order
    integer, intent(in) :: number
    type(border_line_type), intent(out) :: line
    type(error_type), allocatable, intent(out) :: error

    call search_border_line(family, grid, fine_of(order%accuracy), order%tolerance, number, line, error)
  end subroutine search_line_of

  !> Borders within the ranges of `grid`; with `base` (all parameters) also what is stable nearest to it. `lines`: those of the
  !> grid, searched already; `bare`: the frames that no model has settled, where the borders over one parameter are those of the
  !> exact one's vibrations, branch by branch. Error: the parameters make no sense.
  subroutine solve_borders(family, grid, order, results, error, base, lines, bare)
    class(family_type), intent(in), target :: family
    type(grid_type), intent(in) :: grid
    type(border_order_type), intent(in) :: order
    type(border_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: base(:)
    type(border_line_type), intent(in), optional :: lines(:)
    class(family_type), intent(in), optional, target :: bare
    type(border_order_type) :: fine
    logical :: followed
    integer :: k

    fine = order
    fine%accuracy = fine_of(order%accuracy)
    followed = .false.
    if (size(grid%axes) == 1 .and. present(bare)) call find_branch_borders(bare, grid%axes(1), fine, results%values, error, &
      & results%rest, followed)
    if (allocated(error)) return
    if (size(grid%axes) == 1) then
      if (.not. followed) call search_borders(family, grid%axes(1), fine, results%values, error, results%rest)
    else
      allocate(results%map)
      call trace_borders(family, grid, fine%accuracy, fine%tolerance, results%map, error, lines)
    end if
    if (allocated(error) .or. .not. present(base)) return
    allocate(results%nearest(size(base)))
    fine%tolerance = min(order%tolerance, usual_tolerance)
    do k = 1, size(base)
      call find_nearest(family, base, k, grid%axes, fine, results%nearest(k), error)
      if (allocated(error)) return
    end do
    if (results%nearest(1)%found .and. .not. abs(results%nearest(1)%distance) > 0) deallocate(results%nearest)
  end subroutine solve_borders

  !> What is ordered, but not coarser than narrow tongues want it.
  pure type(accuracy_type) function fine_of(accuracy) result(fine)
    type(accuracy_type), intent(in) :: accuracy

    fine = accuracy
    fine%tolerance = min(fine%tolerance, border_accuracy)
  end function fine_of

end module gestell_task_boundary_solution
