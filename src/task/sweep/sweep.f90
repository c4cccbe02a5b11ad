!> Solves a tile (a rectangle of grid points) of a sweep. Parts of the tile (cells) in which Chebyshev series in the parameters
!> (expansions) are faster are solved by them, all other points one by one.
module gestell_task_sweep
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_floquet_period_monodromy, only: check_accuracy
  use gestell_task_sweep_expansion_cell, only: cell_points, expand_it, halves, plan_cell, problem_type, random_points, solve_it
  use gestell_task_sweep_expansion_evaluation, only: evaluate
  use gestell_task_sweep_expansion, only: expand, expansion_type
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: check_grid, check_tile, grid_type, tile_type
  use gestell_task_sweep_expansion_peaks, only: peaks_of_motion
  use gestell_study_point, only: peak_limit, solve_point, sweep_options
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  use gestell_study_tile_results, only: sweep_columns, tile_results_type, xi_peak
  use gestell_task_sweep_expansion_variable, only: variable_type
  implicit none (type, external)
  private

  public :: solve_tile

  !> An expansion is planned only for cells with at least this number of points, because planning takes as long as several hundred
  !> solutions.
  integer, parameter :: least_points = 400
  !> Number of points of each expanded cell at which the expansion is compared with a separate solution.
  integer, parameter :: checked_points = 3

  character(len=*), parameter :: engines(3) = [character(len=9) :: "auto", "expansion", "direct"]

contains

  !> Solves all points of `tile`. Fails if the grid, the tile, the solution method (`engine`), the accuracy, or the parameters of a
  !> point are invalid.
  subroutine solve_tile(family, grid, tile, options, results, error)
    !> Family of machines that depend on the parameters of the grid
    class(family_type), intent(in), target :: family
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile
    !> Solution method (`engine`), columns, measures and accuracy of the sweep
    type(sweep_options), intent(in) :: options
    !> Results at the points, number of solutions, and largest deviation that the checks have found
    type(tile_results_type), intent(out), target :: results
    type(error_type), allocatable, intent(out) :: error
    type(problem_type) :: problem

    call check_grid(grid, error)
    if (.not. allocated(error)) call check_tile(grid, tile, error)
    if (.not. allocated(error)) call check_accuracy(options%accuracy, error)
    if (allocated(error)) return
    if (.not. any(options%engine == engines)) then
      call fatal_error(error, "the engine must be 'auto', 'expansion' or 'direct', not '" // trim(options%engine) // "'", &
        & invalid_input)
      return
    end if
    allocate(results%values(options%numbers(), tile%last(2) - tile%first(2) + 1, tile%last(1) - tile%first(1) + 1))
    problem%family => family
    problem%grid = grid
    problem%tile = tile
    problem%options = options
    problem%results => results
    call solve_cell(problem, tile, error)
  end subroutine solve_tile

  recursive subroutine solve_cell(problem, cell, error)
    type(problem_type), intent(in) :: problem
    type(tile_type), intent(in) :: cell
    type(error_type), allocatable, intent(out) :: error
    type(sampler_type) :: sampler
    type(variable_type), allocatable :: variables(:)
    type(tile_type) :: parts(2)
    integer :: points(2), plan, i, j, k

    plan = solve_it
    associate (options => problem%options)
      if (.not. options%one_by_one() .and. cell_points(cell) >= merge(2, least_points, options%engine == "expansion")) then
        call plan_cell(problem, cell, sampler, variables, points, plan)
        if (plan == expand_it) call expand_cell(problem, cell, variables, points, sampler, plan, error)
        if (allocated(error)) return
        problem%results%solutions = problem%results%solutions + sampler%solutions
      end if
    end associate
    select case (plan)
    case (expand_it)
      return
    case (solve_it)
      do i = cell%first(1), cell%last(1)
        do j = cell%first(2), cell%last(2)
          call problem%solve_single(i, j, error)
          if (allocated(error)) return
        end do
      end do
    case default
      parts = halves(cell, plan)
      do k = 1, 2
        call solve_cell(problem, parts(k), error)
        if (allocated(error)) return
      end do
    end select
  end subroutine solve_cell

  !> Solves a cell by an expansion. If the expansion is not accurate enough, `plan` is set to the axis along which to split the
  !> cell.
  subroutine expand_cell(problem, cell, variables, points, sampler, plan, error)
    type(problem_type), intent(in) :: problem
    type(tile_type), intent(in) :: cell
    type(variable_type), intent(in) :: variables(:)
    integer, intent(in) :: points(2)
    type(sampler_type), intent(inout) :: sampler
    integer, intent(inout) :: plan
    type(error_type), allocatable, intent(out) :: error
    type(expansion_type) :: expansion
    real(dp) :: perturbations(2), deviation
    logical :: fits

    plan = maxloc(points, dim=1)
    call expand(expansion, sampler, variables, points, fits)
    if (.not. fits .or. .not. expansion%rest <= problem%options%accuracy%tolerance * expansion%least) return
    perturbations = expansion%rest + sampler%error * expansion%maximum
    call check_cell(problem, cell, expansion, perturbations, sampler, deviation, fits)
    if (.not. fits) return
    plan = expand_it
    problem%results%checks = problem%results%checks + checked_points
    problem%results%deviation = max(problem%results%deviation, deviation)
    call evaluate(problem, cell, sampler, expansion, perturbations, error)
  end subroutine expand_cell

  !> Compares the expansion over a cell with separate solutions at random points. Compared are the monodromy matrix Phi(T) alone,
  !> and [Phi(T) x_p(T)], where x_p is the motion forced from rest. `fits`: true if no deviation exceeds the sum of two bounds:
  !> its bound in `perturbations`, and the error bound of the separate solution. `deviation`: largest deviation, relative to the
  !> separate solution.
  subroutine check_cell(problem, cell, expansion, perturbations, sampler, deviation, fits)
    type(problem_type), intent(in) :: problem
    type(tile_type), intent(in) :: cell
    type(expansion_type), intent(in) :: expansion
    real(dp), intent(in) :: perturbations(2)
    type(sampler_type), intent(inout) :: sampler
    real(dp), intent(out) :: deviation
    logical, intent(out) :: fits
    integer :: points(2, checked_points), ends(2), k, part
    real(dp) :: parameters(size(problem%grid%axes)), own(sampler%parts%numbers_of_period()), expanded(size(own)), bound, difference
    real(dp), allocatable :: numbers(:)

    deviation = 0
    ! Compares Phi(T) alone, and then together with x_p(T).
    ends = [size(sampler%scale)**2, size(own)]
    points = random_points(cell, checked_points)
    do k = 1, checked_points
      parameters = problem%grid%parameters(points(1, k), points(2, k))
      call sampler%check(parameters, problem%options%accuracy, own, bound, fits)
      if (.not. fits) return
      numbers = expansion%point(parameters)
      expanded = sampler%parts%period(numbers)
      do part = 1, 2
        difference = norm2(expanded(:ends(part)) - own(:ends(part)))
        deviation = max(deviation, difference / norm2(own(:ends(part))))
        fits = fits .and. difference <= perturbations(part) + bound * norm2(own(:ends(part)))
      end do
      if (fits .and. sampler%parts%forced) call check_peaks(problem, parameters, sampler, numbers, perturbations(2), fits)
      if (.not. fits) return
    end do
  end subroutine check_cell

  !> Compares the peaks that the expansion gives with those of a separate solution. `fits`: true if they agree, or if the expansion
  !> gives no peaks.
  subroutine check_peaks(problem, parameters, sampler, numbers, perturbation, fits)
    type(problem_type), intent(in) :: problem
    real(dp), intent(in) :: parameters(:), numbers(:), perturbation
    type(sampler_type), intent(inout) :: sampler
    logical, intent(out) :: fits
    type(error_type), allocatable :: error
    real(dp) :: own(sweep_columns), peaks(size(sampler%free)), there(size(sampler%free)), &
      & side_by_side(lanes, size(sampler%free)), eight(lanes, size(numbers)), &
      & motion(lanes, sampler%parts%states, sampler%parts%columns(), 0:sampler%parts%parts)
    logical :: known(lanes)

    eight = spread(numbers, 1, lanes)
    call sampler%parts%compose(eight, motion)
    call peaks_of_motion(sampler, eight, motion, 1, perturbation, peak_limit(problem%options), side_by_side, known)
    fits = .true.
    if (.not. known(1)) return
    peaks = side_by_side(1, :)
    call solve_point(problem%family, parameters, problem%options, own, error)
    sampler%solutions = sampler%solutions + 1
    fits = .not. allocated(error)
    if (.not. fits) return
    there = own(xi_peak - 1 + sampler%free)
    fits = all(abs(peaks - there) <= peak_limit(problem%options) &
      & * maxval(peaks / sampler%scale(:size(peaks))) * sampler%scale(:size(peaks)))
  end subroutine check_peaks

end module gestell_task_sweep
