!> Evaluates the columns of a sweep at the points of a cell, from the expansion over this cell.
module gestell_task_sweep_expansion_evaluation
  use gestell_math_lanes_products, only: combine
  use gestell_math_lanes, only: lanes, vector_border
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: stable_number, undamped_number, undecided_number, unstable_number
  use gestell_floquet_multipliers_spectra, only: lane_spectra_type, is_undamped, spectra_of_eight
  use gestell_task_sweep_expansion, only: expansion_type
  use gestell_task_sweep_expansion_cell, only: problem_type
  use gestell_study_grid, only: tile_type
  use gestell_task_sweep_expansion_peaks, only: peaks_of_motion
  use gestell_study_point, only: peak_limit, sweep_options
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  use gestell_study_tile_results, only: last_peak, log_rho_max, rho_error, rho_max, sweep_columns, verdict, xi_peak
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: evaluate

contains

  !> Computes the results at the points of `cell` from the expansion. Near a resonance the expansion may not give the vibration
  !> accurately enough. Points without an accurate vibration are solved separately. Fails if a separate solution fails.
  subroutine evaluate(problem, cell, sampler, expansion, perturbations, error)
    !> The tile that contains the cell, and its results
    type(problem_type), intent(in) :: problem
    !> The cell, whose points are computed
    type(tile_type), intent(in) :: cell
    !> Sampler that has integrated all machines of the cell with the same method
    type(sampler_type), intent(in) :: sampler
    !> Chebyshev series over the cell
    type(expansion_type), intent(in) :: expansion
    !> Bounds on the error norms of Phi(T) (element 1) and of [Phi(T) x_p(T)] (element 2), where Phi(T) is the monodromy matrix
    !> and x_p the motion forced from rest
    real(dp), intent(in) :: perturbations(2)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: lines(:, :, :), points(:, :, :), blocks(:, :, :), eight(:, :, :), columns(:, :)
    integer :: along(2), first(2), ordered(count(problem%options%columns)), last, i, j, k, lane

    ordered = problem%options%ordered()
    along = cell%last - cell%first + 1
    first = cell%first - problem%tile%first + 1
    associate (grid => problem%grid, axes => size(problem%grid%axes), values => problem%results%values)
      ! If there is a single axis, it is the second axis of the expansion.
      if (axes == 1) along = [1, along(1)]
      lines = expansion%factors(1, grid%axes(1)%value([(cell%first(1) + i, i = 0, along(1) - 1)]))
      points = expansion%factors(2, grid%axes(axes)%value([(cell%first(axes) + i, i = 0, along(2) - 1)]))
      blocks = expansion%blocks()
      allocate(eight(expansion%points(2), size(expansion%values, 2), lanes), columns(along(2), sweep_columns))
      do i = 1, along(1)
        lane = 1 + mod(i - 1, lanes)
        if (lane == 1) call expansion%lines(blocks, lines(:, :, 1 + (i - 1) / lanes), eight)
        call set_columns(problem%options, sampler, points, eight(:, :, lane), perturbations, columns)
        do k = 1, size(ordered)
          if (axes == 1) values(k, 1, first(1):first(1) + along(2) - 1) = columns(:, ordered(k))
          if (axes == 2) values(k, first(2):first(2) + along(2) - 1, first(1) + i - 1) = columns(:, ordered(k))
        end do
      end do
      if (.not. sampler%parts%forced) return
      ! Solve those points separately at which the expansion gave no peak.
      last = findloc(ordered >= xi_peak, .true., dim=1, back=.true.)
      do i = cell%first(1), cell%last(1)
        do j = cell%first(2), cell%last(2)
          if (.not. ieee_is_nan(values(last, first(2) + j - cell%first(2), first(1) + i - cell%first(1)))) cycle
          call problem%solve_single(i, j, error)
          if (allocated(error)) return
        end do
      end do
    end associate
  end subroutine evaluate

  !> Computes the columns of the sweep at the points along a line through the cell, shape (points, columns). `line`: expanded
  !> numbers at the Chebyshev points on this line. `factors`: factors for the interpolation between the Chebyshev points.
  subroutine set_columns(options, sampler, factors, line, perturbations, columns)
    type(sweep_options), intent(in) :: options
    type(sampler_type), intent(in) :: sampler
    real(dp), contiguous, intent(in) :: factors(:, :, :), line(:, :)
    real(dp), intent(in) :: perturbations(2)
    real(dp), contiguous, intent(inout) :: columns(:, :)
    ! Memory with the alignment that vector instructions need: the numbers of eight points, and their motions.
    real(dp), allocatable, target :: room(:)
    integer :: numbers, border

    numbers = size(line, 2)
    associate (parts => sampler%parts)
      allocate(room(lanes * (numbers + parts%states * parts%columns() * (parts%parts + 1) + 1)))
      border = vector_border(room)
      call set_eight_by_eight(options, sampler, factors, line, perturbations, parts%states, parts%columns(), parts%parts, numbers, &
        & room(border), room(border + lanes * numbers), columns)
    end associate
  end subroutine set_columns

  subroutine set_eight_by_eight(options, sampler, factors, line, perturbations, n, width, parts, numbers, values, motion, columns)
    type(sweep_options), intent(in) :: options
    type(sampler_type), intent(in) :: sampler
    real(dp), contiguous, intent(in) :: factors(:, :, :), line(:, :)
    real(dp), intent(in) :: perturbations(2)
    integer, intent(in) :: n, width, parts, numbers
    real(dp), intent(inout) :: values(lanes, numbers), motion(lanes, n, width, 0:parts)
    real(dp), contiguous, intent(inout) :: columns(:, :)
    type(lane_spectra_type) :: found
    real(dp) :: peaks(lanes, n / 2)
    logical :: known(lanes), spectra, bounds
    integer :: group, first, last, filled, alone, i

    bounds = any(options%columns([rho_error, verdict]))
    spectra = bounds .or. options%columns(rho_max) .or. options%columns(log_rho_max)
    if (sampler%parts%forced) columns(:, xi_peak:last_peak) = 0
    do group = 1, size(factors, 3)
      first = lanes * (group - 1) + 1
      last = min(first + lanes - 1, size(columns, 1))
      filled = last - first + 1
      call combine(size(line, 1), size(line, 2), factors(:, :, group), line, values)
      call sampler%parts%compose(values, motion)
      if (spectra) then
        call spectra_of_eight(n, motion(:, :, :, parts), filled, perturbations(1), bounds, found, alone)
        columns(first:last, rho_max) = found%radius(:filled)
        columns(first:last, log_rho_max) = found%log_radius(:filled)
        columns(first:last, rho_error) = found%bound(:filled)
        columns(first:last, verdict) = merge(stable_number, merge(unstable_number, undecided_number, found%unstable(:filled)), &
          & found%stable(:filled))
        do i = 1, merge(filled, 0, bounds .and. sampler%conserves)
          if (found%stable(i) .or. found%unstable(i)) cycle
          if (is_undamped(motion(i, :, :, parts), perturbations(1))) columns(first + i - 1, verdict) = undamped_number
        end do
      end if
      if (.not. sampler%parts%forced) cycle
      call peaks_of_motion(sampler, values, motion, filled, perturbations(2), peak_limit(options), peaks, known)
      do i = 1, filled
        if (.not. known(i)) then
          ! Peaks that could not be computed, and those of locked degrees of freedom, which are at rest, are marked as unknown.
          columns(first + i - 1, xi_peak:last_peak) = ieee_value(1.0_dp, ieee_quiet_nan)
        else
          columns(first + i - 1, xi_peak - 1 + sampler%free) = peaks(i, :)
        end if
      end do
    end do
  end subroutine set_eight_by_eight

end module gestell_task_sweep_expansion_evaluation
