!> Solves a system that gestell_floquet_reduction has decoupled into groups of modes ("Reduction" in doc/theory.md).
module gestell_floquet_solution_reduced
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: inverse
  use gestell_floquet_reduction_conjugates, only: complex_columns
  use gestell_floquet_period_convergence, only: safety
  use gestell_floquet_solution_mode_group, only: blocks, group_amplification, group_multipliers, group_type, min_size, mirror, &
    & solve_group, bound_rates
  use gestell_floquet_reduction_modes, only: columns_of
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: append, arrange, disc_bounds, multipliers_type, empty_multipliers, pair_conjugates
  use gestell_floquet_solution_part_solution, only: part_solution_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_reduction, only: reduction_type
  use gestell_floquet_reduction_trigonometric, only: interpolation
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: solve_reduced

  !> Solution by reduction to groups of modes.
  type, extends(part_solution_type), public :: reduced_type
    !> The decoupled groups
    type(reduction_type) :: reduction
    !> Solutions of the groups, one for each pair of conjugate groups. If there is a slow group, it comes first.
    type(group_type), allocatable :: groups(:)
    !> True if a slow group exists
    logical :: has_slow = .false.
    !> Period T (s)
    real(dp) :: period = 0
  contains
    procedure :: multipliers => part_multipliers, start => part_start, follow => part_motion
    procedure :: errors => part_errors, liouville_defect => part_liouville_defect
  end type reduced_type

contains

  !> Computes the maps of all groups over the period. Fails if `solve_monodromy` fails for a group of several modes.
  subroutine solve_reduced(system, reduction, scale, accuracy, reduced, error)
    class(periodic_system), intent(in) :: system
    type(reduction_type), intent(in) :: reduction
    !> Units that make the states comparable, shape (n)
    real(dp), intent(in) :: scale(:)
    type(accuracy_type), intent(in) :: accuracy
    type(reduced_type), intent(out) :: reduced
    type(error_type), allocatable, intent(out) :: error
    integer, allocatable :: chosen(:), columns(:)
    integer :: g, k

    reduced%reduction = reduction
    reduced%period = system%period
    reduced%scale = scale
    reduced%evidence%evaluations = reduction%evaluations
    reduced%evidence%error = reduction%residual
    reduced%evidence%angles = reduction%angles
    reduced%has_slow = any(reduction%modes%group == 0)
    allocate(chosen(0))
    do g = 0, size(reduction%modes%group)
      columns = columns_of(reduction%modes%group, g)
      if (size(columns) == 0) cycle
      ! Solve the first of two conjugate groups.
      if (minval(columns) <= minval(reduction%modes%conjugate(columns))) chosen = [chosen, g]
    end do
    allocate(reduced%groups(size(chosen)))
    do k = 1, size(chosen)
      associate (group => reduced%groups(k))
        allocate(group%columns, source=columns_of(reduction%modes%group, chosen(k)))
        group%conjugates = reduction%modes%conjugate(group%columns)
        call solve_group(reduction, chosen(k) == 0 .and. allocated(reduction%response), accuracy, group, error)
        if (allocated(error)) return
      end associate
    end do
  end subroutine solve_reduced

  !> Implements `multipliers` of part_solution_type. The error bounds include the remaining coupling between groups.
  subroutine part_multipliers(self, vectors, multipliers, error)
    class(reduced_type), intent(in) :: self
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: one
    integer :: g

    multipliers = empty_multipliers(merge(size(self%scale), 0, vectors))
    do g = 1, size(self%groups)
      associate (group => self%groups(g), start => complex_columns(self%reduction%basis(1, :, :), self%reduction%modes%conjugate))
        call group_multipliers(group, vectors, one, error)
        if (allocated(error)) return
        if (vectors) one%vectors = matmul(start(:, group%columns), one%vectors) * spread(self%scale, 2, size(group%columns))
        call append(multipliers, one)
        if (all(group%conjugates == group%columns)) cycle
        call mirror(one)
        call append(multipliers, one)
      end associate
    end do
    call pair_conjugates(multipliers)
    multipliers%error = disc_bounds(multipliers%exponent, max(multipliers%error, self%reduction%residual))
    multipliers%exponent = multipliers%exponent / self%period
    call arrange(multipliers)
  end subroutine part_multipliers

  !> Implements `start` of part_solution_type. The initial state is the sum of the slow group's initial state and the response of
  !> the fast groups.
  subroutine part_start(self, solution, error)
    class(reduced_type), intent(in) :: self
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    type(periodic_solution_type) :: slow
    real(dp) :: within(size(self%scale)), slow_size
    real(dp), allocatable :: start(:)

    slow_size = 0
    associate (r => self%reduction, group => self%groups(1))
      start = r%response(1, :)
      if (self%has_slow) then
        call group%solution%start(slow, error)
        if (allocated(error)) return
        start = start + matmul(r%basis(1, :, group%columns), slow%x0)
        slow_size = maxval(abs(slow%x0))
      end if
      call fast_errors(self, slow_size, within, solution%condition, error)
      if (allocated(error)) return
      if (self%has_slow) then
        within(group%columns) = slow%error + safety * size(group%columns) * slow%condition * r%slow_residual
        solution%condition = max(solution%condition, slow%condition)
      end if
      solution%x0 = start * self%scale
      solution%error = matmul(abs(complex_columns(r%basis(1, :, :), r%modes%conjugate)), within) * self%scale + rounding_of(self)
    end associate
  end subroutine part_start

  !> Bound on the rounding error of the response p, in the units of the states; shape (n).
  pure function rounding_of(reduced) result(rounding)
    class(reduced_type), intent(in) :: reduced
    real(dp) :: rounding(size(reduced%scale))

    associate (r => reduced%reduction)
      rounding = size(reduced%scale) * epsilon(1.0_dp) * r%condition * maxval(abs(r%response)) * reduced%scale
    end associate
  end function rounding_of

  !> Computes bounds `within` on the errors of the fast groups' coordinates, shape (n), valid at all times; zero for slow
  !> coordinates. `slow_size`: maximum of the slow motion. `condition`: maximum of |(E - Phi)^-1| over the groups.
  !>
  !> The remainder r of the forcing disturbs a fast group with the generator D in two ways. Harmonics of order k < N / 2, which N
  !> phases resolve, cause an error of at most |r| / (|D| - pi N) in a group with |D| > 2 pi k. Harmonics near resonance, k = |D|
  !> / 2 pi, are not resolved. They are estimated from the decay of the resolved harmonics: at most |r| (|r| / |A p|)^(2 k / N -
  !> 1). The factor |(E - Phi)^-1| and the growth within the period amplify them. If the motion decays (or grows) at all phases
  !> at a rate of at least lambda, its error never exceeds |r| / lambda. Fails if a multiplier equals 1 within its error
  !> (resonance).
  subroutine fast_errors(reduced, slow_size, within, condition, error)
    class(reduced_type), intent(in) :: reduced
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
          slowest = min_size(blocks(r%generator, r, group))
          call bound_rates(blocks(r%generator, r, group), growth, rate, skew)
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

  !> Implements `follow` of part_solution_type.
  subroutine part_motion(self, system, x0, phases, x, error)
    class(reduced_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: x0(:), phases(:)
    real(dp), intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: shapes(:, :, :), y(:, :)
    integer :: k

    associate (unused_system => system)
    end associate
    x = transpose(matmul(interpolation(self%reduction%angles, phases), self%reduction%response))
    if (self%has_slow) then
      call follow_slow(self, x0, phases, y, error)
      if (allocated(error)) return
      call slow_shapes(self, phases, shapes)
      do k = 1, size(phases)
        x(:, k) = x(:, k) + matmul(shapes(k, :, :), y(:, k))
      end do
    end if
    x = x * spread(self%scale, 2, size(phases))
  end subroutine part_motion

  !> Implements `errors` of part_solution_type.
  subroutine part_errors(self, system, phases, x, errors, error, disturbance)
    class(reduced_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: phases(:), x(:, :)
    type(turn_errors_type), intent(out) :: errors
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: disturbance
    type(turn_errors_type) :: slow
    real(dp) :: within(size(self%scale)), slow_size, condition
    real(dp), allocatable :: y(:, :), shapes(:, :, :)
    integer :: k

    associate (unused_system => system, unused_disturbance => present(disturbance))
    end associate
    slow_size = 0
    associate (r => self%reduction, group => self%groups(1))
      allocate(errors%differences(size(x, 1), 2 * size(phases)), source=0.0_dp)
      if (self%has_slow) then
        call follow_slow(self, x(:, 1), phases, y, error)
        if (allocated(error)) return
        call group%solution%errors(group%system, phases, y, slow, error, safety * r%slow_residual)
        if (allocated(error)) return
        slow_size = maxval(abs(y))
        call slow_shapes(self, phases, shapes)
        do k = 1, size(phases)
          associate (both => [k, size(phases) + k])
            errors%differences(:, both) = matmul(shapes(k, :, :), slow%differences(:, both)) * spread(self%scale, 2, 2)
          end associate
        end do
      end if
      call fast_errors(self, slow_size, within, condition, error)
      if (allocated(error)) return
      if (self%has_slow) within(group%columns) = slow%rounding
      allocate(errors%rounding(size(x, 1)), source=0.0_dp)
      do k = 1, r%angles
        errors%rounding = max(errors%rounding, matmul(abs(complex_columns(r%basis(k, :, :), r%modes%conjugate)), within))
      end do
      errors%rounding = errors%rounding * self%scale + rounding_of(self)
    end associate
  end subroutine part_errors

  !> Implements `liouville_defect` of part_solution_type.
  subroutine part_liouville_defect(self, system, defect, error)
    class(reduced_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(out) :: defect
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: multipliers

    associate (unused_system => system)
    end associate
    defect = 0
    call self%multipliers(.false., multipliers, error)
    if (.not. allocated(error)) defect = sum(multipliers%log_abs) - self%reduction%trace
  end subroutine part_liouville_defect

  !> Computes the slow group's motion `y`, shape (m, phases). `x0`: initial state of the whole system.
  subroutine follow_slow(reduced, x0, phases, y, error)
    class(reduced_type), intent(in) :: reduced
    real(dp), intent(in) :: x0(:), phases(:)
    real(dp), allocatable, intent(out) :: y(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: inverted(:, :), y0(:)

    associate (r => reduced%reduction, group => reduced%groups(1))
      call inverse(r%basis(1, :, :), inverted, error)
      if (allocated(error)) return
      y0 = matmul(inverted(group%columns, :), x0 / reduced%scale - r%response(1, :))
      allocate(y(size(group%columns), size(phases)))
      call group%solution%follow(group%system, y0, phases, y, error)
    end associate
  end subroutine follow_slow

  !> Interpolates the slow group's columns of S at `phases`; `shapes` has the shape (phases, n, m).
  subroutine slow_shapes(reduced, phases, shapes)
    class(reduced_type), intent(in) :: reduced
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

end module gestell_floquet_solution_reduced
