!> The columns of a sweep at the points of a cell, from the expansion over it.
module gestell_task_sweep_expansion_evaluation
  use gestell_math_blas, only: multiply
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers_spectra, only: spectral_radii
  use gestell_task_sweep_expansion, only: expansion_type, interpolation
  use gestell_study_family, only: family_type
  use gestell_study_grid, only: grid_type, tile_type
  use gestell_task_sweep_expansion_peaks, only: peaks_of_numbers
  use gestell_study_point, only: peak_limit, solve_point, sweep_order_type
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  use gestell_study_tile_results, only: last_peak, log_rho_max, rho_error, rho_max, stable, sweep_columns, tile_results_type, &
    & undecided, unstable, verdict, verdict_behind, xi_peak
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: evaluate

contains

  !> Sets the results in `cell`, a part of `tile`; `perturbations` bound the errors of Phi(T) and of all numbers in norm. A
  !> point whose vibration is not known, beside a resonance, gets a solution of its own. Error: that of a point.
  !> Ten arguments: the cell with its tile, grid and order, the expansion with its errors.
  subroutine evaluate(family, grid, tile, cell, order, sampler, expansion, perturbations, results, error)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile, cell
    type(sweep_order_type), intent(in) :: order
    type(sampler_type), intent(in) :: sampler
    type(expansion_type), intent(in) :: expansion
    real(dp), intent(in) :: perturbations(2)
    type(tile_results_type), intent(inout) :: results
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: lines(:, :, :), to_points(:, :), numbers(:, :), columns(:, :)
    integer :: along(2), first(2), ordered(count(order%columns)), i, k

    ordered = pack([(k, k = 1, sweep_columns)], order%columns)
    along = cell%last - cell%first + 1
    first = cell%first - tile%first + 1
    call expansion%lines(grid%axes(1)%value([(i, i = cell%first(1), cell%last(1))]), lines)
    if (size(grid%axes) == 1) then
      ! One line, of all points.
      numbers = transpose(lines(1, :, :))
      allocate(columns(along(1), sweep_columns))
      call set_columns(order, sampler, numbers, perturbations, columns)
      do k = 1, size(ordered)
        results%values(k, 1, first(1):first(1) + along(1) - 1) = columns(:, ordered(k))
      end do
    else
      to_points = interpolation(expansion%variables(2), &
        & grid%axes(2)%value([(i, i = cell%first(2), cell%last(2))]), expansion%points(2))
      allocate(numbers(along(2), expansion%numbers), columns(along(2), sweep_columns))
      do i = 1, along(1)
        call multiply(along(2), expansion%numbers, expansion%points(2), to_points, lines(:, :, i), numbers)
        call set_columns(order, sampler, numbers, perturbations, columns)
        do k = 1, size(ordered)
          results%values(k, first(2):first(2) + along(2) - 1, first(1) + i - 1) = columns(:, ordered(k))
        end do
      end do
    end if
    if (sampler%times > 0) call solve_doubtful(family, grid, tile, cell, order, results, error)
  end subroutine evaluate

  !> Solutions of their own for the points of a cell without a peak.
  subroutine solve_doubtful(family, grid, tile, cell, order, results, error)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile, cell
    type(sweep_order_type), intent(in) :: order
    type(tile_results_type), intent(inout) :: results
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: all(sweep_columns)
    integer :: last, i, j

    last = count(order%columns(:last_peak))
    do i = cell%first(1), cell%last(1)
      do j = cell%first(2), cell%last(2)
        associate (values => results%values(:, j - tile%first(2) + 1, i - tile%first(1) + 1))
          if (.not. ieee_is_nan(values(last))) cycle
          call solve_point(family, grid%parameters(i, j), order, all, error)
          if (allocated(error)) return
          values = pack(all, order%columns)
          results%solutions = results%solutions + 1
        end associate
      end do
    end do
  end subroutine solve_doubtful

  !> The columns, shape (points, columns), from the numbers, shape (points, numbers).
  subroutine set_columns(order, sampler, numbers, perturbations, columns)
    type(sweep_order_type), intent(in) :: order
    type(sampler_type), intent(in) :: sampler
    real(dp), contiguous, intent(in) :: numbers(:, :)
    real(dp), intent(in) :: perturbations(2)
    real(dp), contiguous, intent(inout) :: columns(:, :)
    logical :: inside(size(numbers, 1)), outside(size(numbers, 1)), known
    real(dp) :: peaks(sampler%states / 2)
    integer :: n2, k

    n2 = sampler%states**2
    if (any(order%columns([rho_error, verdict, verdict_behind]))) then
      call spectral_radii(numbers(:, :n2), perturbations(1), columns(:, rho_max), columns(:, log_rho_max), &
        & columns(:, rho_error), inside, outside)
      columns(:, verdict) = merge(stable, merge(unstable, undecided, outside), inside)
      columns(:, verdict_behind) = columns(:, verdict)
    else if (order%columns(rho_max) .or. order%columns(log_rho_max)) then
      call spectral_radii(numbers(:, :n2), perturbations(1), columns(:, rho_max), columns(:, log_rho_max))
    end if
    if (sampler%times == 0) return
    columns(:, xi_peak:last_peak) = 0
    do k = 1, size(numbers, 1)
      call peaks_of_numbers(sampler, numbers(k, :), perturbations(2), peak_limit(order), peaks, known)
      if (.not. known) peaks = ieee_value(1.0_dp, ieee_quiet_nan)
      columns(k, xi_peak - 1 + sampler%free) = peaks
      ! A degree of freedom that is locked rests, but is as little known.
      if (.not. known) columns(k, xi_peak:last_peak) = peaks(1)
    end do
  end subroutine set_columns

end module gestell_task_sweep_expansion_evaluation
