!> Finds the results of the task `boundary`: stability borders in one or two parameters and, if the given machine is unstable, the
!> nearest machine that is not unstable.
module gestell_task_boundary_solution
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_grid, only: grid_type
  use gestell_system_family, only: family_type
  use gestell_task_boundary_branches, only: find_branch_borders
  use gestell_task_boundary_line_borders, only: border_accuracy, border_rest_type, border_type, find_borders, nearest_stable, &
    & nearest_type
  use gestell_task_boundary_line, only: border_options, default_tolerance
  use gestell_task_boundary_map, only: border_map_type, trace_borders
  use gestell_task_resonance_curve, only: resonance_curve_type
  implicit none (type, external)
  private

  public :: solve_borders

  !> Results of the task `boundary`, for one or two parameters.
  type, public :: border_results_type
    !> If there is one parameter: its critical values, or its values at the crossings of a level.
    type(border_type), allocatable :: values(:)
    type(border_rest_type) :: rest
    !> If there are two parameters: the border curves in their plane.
    type(border_map_type), allocatable :: map
    !> For each parameter, the nearest system that is not unstable. Not allocated if no machine is given, or if the given machine
    !> itself is not unstable.
    type(nearest_type), allocatable :: nearest(:)
    !> If there are a level and one parameter: the curve of the measured quantity. In its points, `speed` is the parameter,
    !> `values(1, 1)` the quantity and `values(2, 1)` its error.
    type(resonance_curve_type), allocatable :: curve
    !> If crossings of a level in two parameters were sought, but no curve was found: side of the level on which the quantity lies
    !> at the centre of the ranges.
    character(len=10) :: side_at_centre = ""
  end type border_results_type

contains

  !> Finds the stability borders within the ranges of `grid` and, if `base` is not empty, the nearest systems that are not unstable.
  !> Fails if the parameters are invalid.
  subroutine solve_borders(family, grid, options, base, results, error, bare)
    !> Family of systems that depend on the parameters
    class(family_type), intent(in), target :: family
    !> Ranges of the parameters (one or two), and number of values at which the search starts
    type(grid_type), intent(in) :: grid
    !> Accuracy, tolerance of the borders, and the executor that distributes the work
    type(border_options), intent(in) :: options
    !> Parameters of the given machine; empty if no machine is given
    real(dp), intent(in) :: base(:)
    type(border_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error
    !> Frames that are not yet linearised about a vibration. If present, borders in one parameter are found on each branch of
    !> vibrations of the exact frame
    class(family_type), intent(in), optional, target :: bare
    type(border_options) :: fine
    logical :: followed
    integer :: k

    ! Narrow tongues are found only with this accuracy, even if the user requests less.
    fine = options
    fine%accuracy%tolerance = min(fine%accuracy%tolerance, border_accuracy)
    followed = .false.
    if (size(grid%axes) == 2) then
      allocate(results%map)
      call trace_borders(family, grid, fine%accuracy, fine%tolerance, results%map, error, fine%executor)
    else
      if (present(bare)) call find_branch_borders(bare, grid%axes(1), fine, results%values, error, results%rest, followed)
      if (.not. (followed .or. allocated(error))) call find_borders(family, grid%axes(1), fine%accuracy, fine%tolerance, &
        & results%values, error, results%rest, fine%executor)
    end if
    if (allocated(error) .or. size(base) == 0) return
    allocate(results%nearest(size(base)))
    do k = 1, size(base)
      call nearest_stable(family, base, k, grid%axes, fine%accuracy, min(options%tolerance, default_tolerance), &
        & results%nearest(k), error, fine%executor)
      if (allocated(error)) return
    end do
    if (results%nearest(1)%found .and. .not. abs(results%nearest(1)%distance) > 0) deallocate(results%nearest)
  end subroutine solve_borders

end module gestell_task_boundary_solution
