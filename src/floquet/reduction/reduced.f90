!> Multipliers and periodic motion of a system that was taken apart into groups of modes (gestell_floquet_reduction).
module gestell_floquet_reduction_reduced
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: inverse
  use gestell_floquet_reduction_conjugates, only: complex_columns
  use gestell_floquet_period_convergence, only: safety
  use gestell_floquet_factors_factored, only: factored_errors, factored_periodic, follow_factored
  use gestell_floquet_period_period_map, only: trajectory
  use gestell_floquet_reduction_mode_group, only: blocks, group_amplification, group_multipliers, group_type, least_size, mirror, &
    & solve_group, take_rates
  use gestell_floquet_reduction_modes, only: columns_of, modes_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: append, arrange, disc_bounds, multipliers_type, no_multipliers
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, solve_periodic, take_errors
  use gestell_floquet_reduction, only: reduction_type
  use gestell_floquet_reduction_trigonometric, only: interpolation
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: follow_reduced, reduced_errors, reduced_multipliers, reduced_periodic, solve_reduced

  type, public :: reduced_type
    type(reduction_type) :: reduction
    !> Of two conjugate groups one; the slow group, if there is one, stands first.
    type(group_type), allocatable :: groups(:)
    logical :: has_slow = .false.
    !> Units of the states, shape (n), and the period.
    real(dp), allocatable :: scale(:)
    real(dp) :: period = 0
    !> Sum of ln |rho| - integral of tr P.
    real(dp) :: liouville_defect = 0
  end type reduced_type

contains

  !> The maps of all groups over the period. Errors: those of `solve_monodromy` for groups of several modes.
  subroutine solve_reduced(system, reduction, scale, accuracy, reduced, error)
    class(periodic_system), intent(in) :: system
    type(reduction_type), intent(in) :: reduction
    real(dp), intent(in) :: scale(:)
    type(accuracy_type), intent(in) :: accuracy
    type(reduced_type), intent(out) :: reduced
    type(error_type), allocatable, intent(out) :: error
    integer, allocatable :: chosen(:)
    integer :: k

    reduced%reduction = reduction
    reduced%period = system%period
    reduced%scale = scale
    reduced%has_slow = any(reduction%modes%group == 0)
    allocate(chosen, source=groups_to_solve(reduction%modes))
    allocate(reduced%groups(size(chosen)))
    do k = 1, size(chosen)
      associate (group => reduced%groups(k))
        allocate(group%columns, source=columns_of(reduction%modes%group, chosen(k)))
        group%conjugates = reduction%modes%conjugate(group%columns)
        call solve_group(reduction, chosen(k) == 0 .and. allocated(reduction%response), accuracy, group, error)
        if (allocated(error)) return
      end associate
    end do
    call check_liouville(reduced, error)
  end subroutine solve_reduced

  !> The numbers of all groups that are not the conjugate of one before.
  pure function groups_to_solve(modes) result(numbers)
    type(modes_type), intent(in) :: modes
    integer, allocatable :: numbers(:)
    integer :: g

    allocate(numbers, source=pack([(g, g = 0, size(modes%group))], [(stands_first(g), g = 0, size(modes%group))]))

  contains

    pure logical function stands_first(g)
      integer, intent(in) :: g
      integer, allocatable :: columns(:)

      columns = columns_of(modes%group, g)
      stands_first = .false.
      if (size(columns) > 0) stands_first = minval(columns) <= minval(modes%conjugate(columns))
    end function stands_first

  end function groups_to_solve

  subroutine check_liouville(reduced, error)
    type(reduced_type), intent(inout) :: reduced
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: multipliers

    call reduced_multipliers(reduced, .false., multipliers, error)
    if (.not. allocated(error)) reduced%liouville_defect = sum(multipliers%log_abs) - reduced%reduction%trace
  end subroutine check_liouville

  !> All multipliers; what the groups still do to each other is within the bounds.
  !> Error: LAPACK found no eigenvalues.
  subroutine reduced_multipliers(reduced, vectors, multipliers, error)
    type(reduced_type), intent(in) :: reduced
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: one
    integer :: g, n

    n = size(reduced%scale)
    multipliers = no_multipliers(merge(n, 0, vectors))
    do g = 1, size(reduced%groups)
      associate (group => reduced%groups(g), start => complex_columns(reduced%reduction%basis(1, :, :), &
        & reduced%reduction%modes%conjugate))
        call group_multipliers(group, vectors, one, error)
        if (allocated(error)) return
        if (vectors) one%vectors = matmul(start(:, group%columns), one%vectors) &
          & * spread(reduced%scale, 2, size(group%columns))
        call append(multipliers, one)
        if (all(group%conjugates == group%columns)) cycle
        call mirror(one)
        call append(multipliers, one)
      end associate
    end do
    multipliers%error = disc_bounds(multipliers%exponent, max(multipliers%error, reduced%reduction%residual))
    multipliers%exponent = multipliers%exponent / reduced%period
    call arrange(multipliers)
  end subroutine reduced_multipliers

  !> x(0) of the periodic motion: that of the slow group, and the response p of the fast ones. Error: resonance within the
  !> errors.
  subroutine reduced_periodic(reduced, solution, error)
    type(reduced_type), intent(in) :: reduced
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    type(periodic_solution_type) :: slow
    real(dp) :: within(size(reduced%scale)), slow_size
    real(dp), allocatable :: start(:)

    slow_size = 0
    associate (r => reduced%reduction, group => reduced%groups(1))
      start = r%response(1, :)
      if (reduced%has_slow) then
        if (allocated(group%factors)) then
          call factored_periodic(group%factors, slow, error)
        else
          call solve_periodic(group%monodromy, slow, error)
        end if
        if (allocated(error)) return
        start = start + matmul(r%basis(1, :, group%columns), slow%x0)
        slow_size = maxval(abs(slow%x0))
      end if
      call fast_errors(reduced, slow_size, within, solution%condition, error)
      if (allocated(error)) return
      if (reduced%has_slow) then
        within(group%columns) = slow%error + safety * size(group%columns) * slow%condition * r%slow_residual
        solution%condition = max(solution%condition, slow%condition)
      end if
      solution%x0 = start * reduced%scale
      solution%error = matmul(abs(complex_columns(r%basis(1, :, :), r%modes%conjugate)), within) * reduced%scale &
        & + rounding_of(reduced)
    end associate
  end subroutine reduced_periodic

  !> What rounding leaves of p, in the units of the states.
  pure function rounding_of(reduced) result(rounding)
    type(reduced_type), intent(in) :: reduced
    real(dp) :: rounding(size(reduced%scale))

    associate (r => reduced%reduction)
      rounding = size(reduced%scale) * epsilon(1.0_dp) * r%condition * maxval(abs(r%response)) * reduced%scale
    end associate
  end function rounding_of

  !> Bounds on the error of the fast groups' coordinates, shape (n), zero in the slow ones, whose motion is as large as `slow_size`.
  !> They hold at all times. `condition`: the greatest |(E - Phi)^-1| of a group.
  !>
  !> What p leaves over, r, disturbs a fast group in two ways. Its harmonics k that the N phases resolve, k < N / 2, meet a
  !> group with |D| > 2 pi k: at most |r| / (|D| - pi N). Those near resonance, k = |D| / 2 pi, are at most as large as
  !> the ones that are resolved foretell, when they go on to fall as they do until N / 2, |r| (|r| / |A p|)^(2 k / N - 1),
  !> and are amplified by |(E - Phi)^-1| and the growth within the period. What decays (or grows) throughout with a rate of at
  !> least lambda is nowhere greater than |r| / lambda. Error: resonance within the errors.
  subroutine fast_errors(reduced, slow_size, within, condition, error)
    type(reduced_type), intent(in) :: reduced
    real(dp), intent(in) :: slow_size
    real(dp), intent(out) :: within(:), condition
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: amplification, disturbance, peak, resonant, slowest, growth, rate, skew, bound
    integer :: g

    within = 0
    condition = 0
    associate (r => reduced%reduction)
      disturbance = r%forcing_residual + r%residual * slow_size
      peak = r%forcing_peak + r%residual_peak * slow_size
      do g = merge(2, 1, reduced%has_slow), size(reduced%groups)
        associate (group => reduced%groups(g))
          call group_amplification(group, amplification, error)
          if (allocated(error)) return
          slowest = least_size(blocks(r%generator, r, group))
          call take_rates(blocks(r%generator, r, group), growth, rate, skew)
          resonant = log(min(max(disturbance, tiny(1.0_dp)) / max(r%effort, tiny(1.0_dp)), 1.0_dp)) &
            & * max(slowest / (pi * r%angles) - 1, 0.0_dp)
          bound = disturbance / max(slowest - pi * r%angles, 1.0_dp) + amplification * disturbance * exp(growth + resonant)
          if (rate > 0) bound = min(bound, skew * peak / rate)
          within(group%columns) = safety * bound
          within(group%conjugates) = safety * bound
          condition = max(condition, amplification)
        end associate
      end do
    end associate
  end subroutine fast_errors

  !> The periodic motion that starts with `x0`, at `phases` (ascending, in [0, 1]); x has the shape (n, points).
  subroutine follow_reduced(reduced, x0, phases, x, error)
    type(reduced_type), intent(in) :: reduced
    real(dp), intent(in) :: x0(:), phases(:)
    real(dp), intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: shapes(:, :, :), y(:, :)
    integer :: k

    x = transpose(matmul(interpolation(reduced%reduction%angles, phases), reduced%reduction%response))
    if (reduced%has_slow) then
      call follow_slow(reduced, x0, phases, y, error)
      if (allocated(error)) return
      call slow_shapes(reduced, phases, shapes)
      do k = 1, size(phases)
        x(:, k) = x(:, k) + matmul(shapes(k, :, :), y(:, k))
      end do
    end if
    x = x * spread(reduced%scale, 2, size(phases))
  end subroutine follow_reduced

  !> The errors of the motion `x` that `follow_reduced` found at `phases`, shape (n, phases), the first 0 and the last 1. Errors:
  !> overflow; resonance within the errors.
  subroutine reduced_errors(reduced, phases, x, errors, error)
    type(reduced_type), intent(in) :: reduced
    real(dp), intent(in) :: phases(:), x(:, :)
    type(turn_errors_type), intent(out) :: errors
    type(error_type), allocatable, intent(out) :: error
    type(turn_errors_type) :: slow
    real(dp) :: within(size(reduced%scale)), slow_size, condition
    real(dp), allocatable :: y(:, :), shapes(:, :, :)
    integer :: k

    slow_size = 0
    associate (r => reduced%reduction, group => reduced%groups(1))
      allocate(errors%differences(size(x, 1), 2 * size(phases)), source=0.0_dp)
      if (reduced%has_slow) then
        call follow_slow(reduced, x(:, 1), phases, y, error)
        if (allocated(error)) return
        if (allocated(group%factors)) then
          call factored_errors(group%system, group%factors, phases, y, slow, error, safety * r%slow_residual)
        else
          call take_errors(group%system, group%monodromy, phases, y, slow, error, safety * r%slow_residual)
        end if
        if (allocated(error)) return
        slow_size = maxval(abs(y))
        call slow_shapes(reduced, phases, shapes)
        do k = 1, size(phases)
          associate (both => [k, size(phases) + k])
            errors%differences(:, both) = matmul(shapes(k, :, :), slow%differences(:, both)) * spread(reduced%scale, 2, 2)
          end associate
        end do
      end if
      call fast_errors(reduced, slow_size, within, condition, error)
      if (allocated(error)) return
      if (reduced%has_slow) within(group%columns) = slow%rounding
      allocate(errors%rounding(size(x, 1)), source=0.0_dp)
      do k = 1, r%angles
        errors%rounding = max(errors%rounding, matmul(abs(complex_columns(r%basis(k, :, :), r%modes%conjugate)), within))
      end do
      errors%rounding = errors%rounding * reduced%scale + rounding_of(reduced)
    end associate
  end subroutine reduced_errors

  !> The slow group's motion, shape (m, phases), that starts with the state x0 of all.
  subroutine follow_slow(reduced, x0, phases, y, error)
    type(reduced_type), intent(in) :: reduced
    real(dp), intent(in) :: x0(:), phases(:)
    real(dp), allocatable, intent(out) :: y(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: inverted(:, :), y0(:)

    associate (r => reduced%reduction, group => reduced%groups(1))
      call inverse(r%basis(1, :, :), inverted, error)
      if (allocated(error)) return
      y0 = matmul(inverted(group%columns, :), x0 / reduced%scale - r%response(1, :))
      allocate(y(size(group%columns), size(phases)))
      if (allocated(group%factors)) then
        call follow_factored(group%system, group%factors, phases, y, error)
      else
        call trajectory(group%system, group%monodromy%method, group%monodromy%nodes, y0, phases, y, error)
      end if
    end associate
  end subroutine follow_slow

  !> The columns of S that belong to the slow group, shape (phases, n, m).
  pure subroutine slow_shapes(reduced, phases, shapes)
    type(reduced_type), intent(in) :: reduced
    real(dp), intent(in) :: phases(:)
    real(dp), allocatable, intent(out) :: shapes(:, :, :)
    integer :: n, m

    n = size(reduced%scale)
    associate (r => reduced%reduction, group => reduced%groups(1))
      m = size(group%columns)
      shapes = reshape(matmul(interpolation(r%angles, phases), reshape(r%basis(:, :, group%columns), [r%angles, n * m])), &
        & [size(phases), n, m])
    end associate
  end subroutine slow_shapes

end module gestell_floquet_reduction_reduced
