!> A tile of a sweep: by expansions over cells where that pays, else point by point.
module gestell_task_sweep
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_floquet_period_monodromy, only: check_accuracy
  use gestell_task_sweep_expansion_cell, only: cell_points, expand_it, halves, plan_cell, random_points, solve_it
  use gestell_task_sweep_expansion_evaluation, only: evaluate
  use gestell_task_sweep_expansion, only: expand, expansion_type
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: check_grid, check_tile, grid_type, tile_type
  use gestell_task_sweep_expansion_peaks, only: peaks_of_numbers
  use gestell_study_point, only: peak_limit, solve_point, sweep_options
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  use gestell_study_tile_results, only: sweep_columns, tile_results_type, xi_peak
  use gestell_task_sweep_expansion_variable, only: variable_type
  implicit none (type, external)
  private

  public :: solve_tile

  !> Cells with fewer points are not worth a plan: it takes some hundred solutions.
  integer, parameter :: least_points = 400
  !> Points of a cell that are compared with solutions of their own.
  integer, parameter :: checked_points = 3

  character(len=*), parameter :: engines(3) = [character(len=9) :: "auto", "expansion", "direct"]

contains

  !> The points of `tile`. Errors: a grid, tile, engine or accuracy that makes no sense, or the parameters of a point.
  subroutine solve_tile(family, grid, tile, options, results, error)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile
    type(sweep_options), intent(in) :: options
    type(tile_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error

    call check_grid(grid, error)
    if (.not. allocated(error)) call check_tile(grid, tile, error)
    if (.not. allocated(error)) call check_accuracy(options%accuracy, error)
    if (allocated(error)) return
    if (.not. any(options%engine == engines)) then
      call fatal_error(error, "there is no engine '" // trim(options%engine) // "'", invalid_input)
      return
    end if
    allocate(results%values(options%numbers(), tile%last(2) - tile%first(2) + 1, tile%last(1) - tile%first(1) + 1))
    call solve_cell(family, grid, tile, tile, options, results, error)
  end subroutine solve_tile

  recursive subroutine solve_cell(family, grid, tile, cell, options, results, error)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile, cell
    type(sweep_options), intent(in) :: options
    type(tile_results_type), intent(inout) :: results
    type(error_type), allocatable, intent(out) :: error
    type(sampler_type) :: sampler
    type(variable_type), allocatable :: variables(:)
    type(tile_type) :: parts(2)
    integer :: points(2), plan, k

    plan = solve_it
    if (can_expand(options, cell)) then
      call plan_cell(family, grid, cell, options, sampler, variables, points, plan)
      if (plan == expand_it) then
        call expand_cell(family, grid, tile, cell, options, variables, points, sampler, results, plan, error)
        if (allocated(error)) return
      end if
      results%solutions = results%solutions + sampler%solutions
    end if
    select case (plan)
    case (expand_it)
      return
    case (solve_it)
      call solve_points(family, grid, tile, cell, options, results, error)
    case default
      parts = halves(cell, plan)
      do k = 1, 2
        call solve_cell(family, grid, tile, parts(k), options, results, error)
        if (allocated(error)) return
      end do
    end select
  end subroutine solve_cell

  !> Whether an expansion can give what is ordered, and a cell is large enough for one.
  pure logical function can_expand(options, cell)
    type(sweep_options), intent(in) :: options
    type(tile_type), intent(in) :: cell

    can_expand = .not. options%one_by_one() .and. cell_points(cell) >= merge(2, least_points, options%engine == "expansion")
  end function can_expand

  !> Point by point.
  subroutine solve_points(family, grid, tile, cell, options, results, error)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile, cell
    type(sweep_options), intent(in) :: options
    type(tile_results_type), intent(inout) :: results
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: all(sweep_columns), measures(2, options%measured())
    integer :: i, j

    do i = cell%first(1), cell%last(1)
      do j = cell%first(2), cell%last(2)
        call solve_point(family, grid%parameters(i, j), options, all, error, measures)
        if (allocated(error)) return
        results%values(:, j - tile%first(2) + 1, i - tile%first(1) + 1) = [pack(all, options%columns), measures]
        results%solutions = results%solutions + 1
      end do
    end do
  end subroutine solve_points

  !> By an expansion. `plan` becomes the axis to split where the expansion does not hold.
  subroutine expand_cell(family, grid, tile, cell, options, variables, points, sampler, results, plan, error)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile, cell
    type(sweep_options), intent(in) :: options
    type(variable_type), intent(in) :: variables(:)
    integer, intent(in) :: points(2)
    type(sampler_type), intent(inout) :: sampler
    type(tile_results_type), intent(inout) :: results
    integer, intent(inout) :: plan
    type(error_type), allocatable, intent(out) :: error
    type(expansion_type) :: expansion
    real(dp) :: perturbations(2), deviation
    logical :: fits

    plan = maxloc(points, dim=1)
    call expand(expansion, sampler, family, variables, points, fits)
    if (.not. fits .or. .not. expansion%rest <= options%accuracy%tolerance * expansion%least) return
    perturbations = expansion%rest + sampler%error * expansion%greatest
    call check_cell(family, grid, cell, options, expansion, perturbations, sampler, deviation, fits)
    if (.not. fits) return
    plan = expand_it
    results%checks = results%checks + checked_points
    results%deviation = max(results%deviation, deviation)
    call evaluate(family, grid, tile, cell, options, sampler, expansion, perturbations, results, error)
  end subroutine expand_cell

  !> Compares the expansion with solutions of their own at points drawn at random. `fits`: none deviates by more than
  !> `perturbations` (of Phi(T), of all numbers) and its own bound; `deviation`: the greatest one, relative to Phi.
  subroutine check_cell(family, grid, cell, options, expansion, perturbations, sampler, deviation, fits)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: cell
    type(sweep_options), intent(in) :: options
    type(expansion_type), intent(in) :: expansion
    real(dp), intent(in) :: perturbations(2)
    type(sampler_type), intent(inout) :: sampler
    real(dp), intent(out) :: deviation
    logical, intent(out) :: fits
    integer :: points(2, checked_points), k
    real(dp) :: parameters(size(grid%axes)), own(sampler%parts%numbers_of_period()), expanded(size(own)), bound, difference
    real(dp), allocatable :: numbers(:)
    integer :: ends(2), part

    deviation = 0
    ! Phi(T) by itself, and with x_p(T).
    ends = [size(sampler%scale)**2, size(own)]
    points = random_points(cell, checked_points)
    do k = 1, checked_points
      parameters = grid%parameters(points(1, k), points(2, k))
      call sampler%check(family, parameters, options%accuracy, own, bound, fits)
      if (.not. fits) return
      numbers = expansion%point(parameters)
      expanded = sampler%parts%period(numbers)
      do part = 1, 2
        difference = norm2(expanded(:ends(part)) - own(:ends(part)))
        deviation = max(deviation, difference / norm2(own(:ends(part))))
        fits = fits .and. difference <= perturbations(part) + bound * norm2(own(:ends(part)))
      end do
      if (fits .and. sampler%parts%forced) call check_peaks(family, parameters, options, sampler, numbers, perturbations(2), fits)
      if (.not. fits) return
    end do
  end subroutine check_cell

  !> Compares the peaks, where the expansion has them, with those of a solution of their own.
  subroutine check_peaks(family, parameters, options, sampler, numbers, perturbation, fits)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:), numbers(:), perturbation
    type(sweep_options), intent(in) :: options
    type(sampler_type), intent(inout) :: sampler
    logical, intent(out) :: fits
    type(error_type), allocatable :: error
    real(dp) :: own(sweep_columns), peaks(size(sampler%free)), there(size(sampler%free)), &
      & side_by_side(lanes, size(sampler%free))
    logical :: known(lanes)

    call peaks_of_numbers(sampler, spread(numbers, 1, lanes), 1, perturbation, peak_limit(options), side_by_side, known)
    fits = .true.
    if (.not. known(1)) return
    peaks = side_by_side(1, :)
    call solve_point(family, parameters, options, own, error)
    sampler%solutions = sampler%solutions + 1
    fits = .not. allocated(error)
    if (.not. fits) return
    there = own(xi_peak - 1 + sampler%free)
    fits = all(abs(peaks - there) <= peak_limit(options) &
      & * maxval(peaks / sampler%scale(:size(peaks))) * sampler%scale(:size(peaks)))
  end subroutine check_peaks

end module gestell_task_sweep
