!> Multipliers and periodic motion of a system that was taken apart into groups of modes (gestell_floquet_reduction).
module gestell_floquet_reduced
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_base_lapack, only: eigensystem, inverse
  use gestell_floquet_convergence, only: safety
  use gestell_floquet_factored, only: factored_multipliers, factored_periodic, follow_factored
  use gestell_floquet_factors, only: factors_type, solve_factors
  use gestell_floquet_flow, only: trajectory
  use gestell_floquet_modes, only: columns_of, modes_type
  use gestell_floquet_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: append, arrange, disc_bounds, multiplier, multipliers_type, &
    & no_multipliers, set_multipliers
  use gestell_floquet_periodic_solution, only: periodic_solution_type, resonance, solve_periodic
  use gestell_floquet_reduction, only: reduction_type
  use gestell_floquet_sampled, only: complex_system, real_system, sampled_system
  use gestell_floquet_trace, only: trace_integral
  use gestell_floquet_trigonometric, only: interpolation
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: follow_reduced, reduced_multipliers, reduced_periodic, solve_reduced

  !> One group of modes: over the period its motion is multiplied by exp(shift) Phi.
  type :: group_type
    !> Columns of the basis, those of the conjugate group (the same for a real group).
    integer, allocatable :: columns(:), conjugates(:)
    !> The common factor's logarithm, and the rest with a bound on its error; shape (m, m).
    complex(dp) :: shift = 0
    complex(dp), allocatable :: phi(:, :)
    real(dp) :: error = 0
    !> Only for more than one mode: the rest as a system of its own, its map, and where that loses modes its factors.
    type(sampled_system), allocatable :: system
    type(monodromy_type), allocatable :: monodromy
    type(factors_type), allocatable :: factors
  end type group_type

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
    call check_liouville(system, reduced, error)
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

  subroutine solve_group(reduction, forced, accuracy, group, error)
    type(reduction_type), intent(in) :: reduction
    logical, intent(in) :: forced
    type(accuracy_type), intent(in) :: accuracy
    type(group_type), intent(inout) :: group
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: d(:, :, :)
    complex(dp) :: centre
    integer :: m, i, k

    m = size(group%columns)
    d = reduction%generator(group%columns, group%columns, :)
    if (.not. forced) then
      do k = 1, reduction%angles
        centre = sum([(d(i, i, k), i = 1, m)]) / m
        group%shift = group%shift + centre / reduction%angles
        do i = 1, m
          d(i, i, k) = d(i, i, k) - centre
        end do
      end do
    end if
    if (all(group%conjugates == group%columns)) group%shift = real(group%shift)

    associate (rounding => reduction%residual)
      if (m == 1 .and. .not. forced) then
        allocate(group%phi(1, 1), source=(1.0_dp, 0.0_dp))
        group%error = rounding
        return
      end if
      allocate(group%monodromy)
      if (any(group%conjugates /= group%columns)) then
        group%system = complex_system(d, rounding)
        call solve_monodromy(group%system, accuracy, .false., group%monodromy, error)
        if (allocated(error)) return
        group%phi = cmplx(group%monodromy%phi(:m, :m), group%monodromy%phi(m + 1:, :m), dp)
      else
        if (forced) then
          group%system = real_system(real(d), real(reduction%forcing(group%columns, :)), rounding)
        else
          group%system = real_system(real(d), 0 * real(d(:, 1, :)), rounding)
        end if
        call solve_monodromy(group%system, accuracy, forced, group%monodromy, error)
        if (allocated(error)) return
        group%phi = group%monodromy%phi
      end if
      group%error = group%monodromy%error
    end associate
    if (.not. group%monodromy%loses_modes()) return
    if (any(group%conjugates /= group%columns)) then
      call fatal_error(error, "the modes of a group differ too much", failed_computation)
    else
      allocate(group%factors)
      call solve_factors(group%system, accuracy, forced, group%factors, error)
    end if
  end subroutine solve_group

  subroutine check_liouville(system, reduced, error)
    class(periodic_system), intent(in) :: system
    type(reduced_type), intent(inout) :: reduced
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: multipliers
    real(dp) :: integral
    integer :: k

    call trace_integral(system, [(real(k, dp) / reduced%reduction%angles, k = 0, reduced%reduction%angles)], integral, error)
    if (.not. allocated(error)) call reduced_multipliers(reduced, .false., multipliers, error)
    if (.not. allocated(error)) reduced%liouville_defect = sum(multipliers%log_abs) - integral
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
      associate (group => reduced%groups(g), start => reduced%reduction%basis(:, :, 1))
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

  !> The multipliers of one group, for the period 1; with `vectors` the eigenvectors in the group's columns too.
  subroutine group_multipliers(group, vectors, multipliers, error)
    type(group_type), intent(in) :: group
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)

    if (allocated(group%factors)) then
      call factored_multipliers(group%factors, vectors, multipliers, error)
      if (allocated(error)) return
    else
      call eigensystem(group%phi, rho, right, left, error)
      if (allocated(error)) return
      call set_multipliers(rho, right, left, group%error + size(rho) * epsilon(1.0_dp) * norm2(abs(group%phi)), multipliers)
      if (vectors) multipliers%vectors = right
    end if
    call multiply(multipliers, group%shift)
  end subroutine group_multipliers

  !> The multipliers times exp(shift).
  pure subroutine multiply(multipliers, shift)
    type(multipliers_type), intent(inout) :: multipliers
    complex(dp), intent(in) :: shift

    multipliers%log_abs = multipliers%log_abs + real(shift)
    multipliers%arg = multipliers%arg + aimag(shift)
    multipliers%arg = multipliers%arg - 2 * pi * anint(multipliers%arg / (2 * pi))
    multipliers%exponent = cmplx(multipliers%log_abs, multipliers%arg, dp)
    multipliers%rho = multiplier(multipliers%exponent)
  end subroutine multiply

  pure subroutine mirror(multipliers)
    type(multipliers_type), intent(inout) :: multipliers

    multipliers%arg = -multipliers%arg
    multipliers%rho = conjg(multipliers%rho)
    multipliers%exponent = conjg(multipliers%exponent)
    if (allocated(multipliers%vectors)) multipliers%vectors = conjg(multipliers%vectors)
  end subroutine mirror

  !> x(0) of the periodic motion: that of the slow group, and the response p of the fast ones.
  !>
  !> What p leaves over, r, disturbs a fast group in two ways. Its harmonics k that the N phases resolve, k < N / 2, meet a
  !> group with |D| > 2 pi k: at most |r| / (|D| - pi N). Those near resonance, k = |D| / 2 pi, are at most as large as
  !> the ones that are resolved foretell, when they go on to fall as they do until N / 2, |r| (|r| / |A p|)^(2 k / N - 1),
  !> and are amplified by |(E - Phi)^-1| and the growth within the period.
  !> Error: resonance within the errors.
  subroutine reduced_periodic(reduced, solution, error)
    type(reduced_type), intent(in) :: reduced
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    type(periodic_solution_type) :: slow
    complex(dp), allocatable :: start(:)
    real(dp), allocatable :: within(:)
    real(dp) :: amplification, disturbance, resonant, slowest
    integer :: g, n

    n = size(reduced%scale)
    allocate(within(n), source=0.0_dp)
    associate (r => reduced%reduction)
      start = r%response(:, 1)
      disturbance = r%forcing_residual
      do g = 1, size(reduced%groups)
        associate (group => reduced%groups(g))
          if (g == 1 .and. reduced%has_slow) then
            if (allocated(group%factors)) then
              call factored_periodic(group%factors, slow, error)
            else
              call solve_periodic(group%monodromy, slow, error)
            end if
            if (allocated(error)) return
            start = start + matmul(r%basis(:, group%columns, 1), slow%x0)
            within(group%columns) = slow%error + safety * size(group%columns) * slow%condition * r%slow_residual
            disturbance = disturbance + r%residual * maxval(abs(slow%x0))
            solution%condition = max(solution%condition, slow%condition)
            cycle
          end if
          call group_amplification(group, amplification, error)
          if (allocated(error)) return
          slowest = least_size(r%generator(group%columns, group%columns, :))
          resonant = disturbance * exp(log_growth(r%generator(group%columns, group%columns, :)) &
            & + log(min(max(disturbance, tiny(1.0_dp)) / max(r%effort, tiny(1.0_dp)), 1.0_dp)) &
            & * max(slowest / (pi * r%angles) - 1, 0.0_dp))
          within(group%columns) = safety * (disturbance / max(slowest - pi * r%angles, 1.0_dp) + amplification * resonant)
          within(group%conjugates) = within(group%columns)
          solution%condition = max(solution%condition, amplification)
        end associate
      end do
      solution%x0 = real(start) * reduced%scale
      solution%error = (matmul(abs(r%basis(:, :, 1)), within) + n * epsilon(1.0_dp) * r%condition * maxval(abs(r%response))) &
        & * reduced%scale
    end associate
  end subroutine reduced_periodic

  !> A bound on |(E - Phi)^-1| of a group, by its multipliers. Error: resonance within their errors.
  subroutine group_amplification(group, amplification, error)
    type(group_type), intent(in) :: group
    real(dp), intent(out) :: amplification
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: multipliers
    real(dp), allocatable :: distance(:)
    integer :: k

    amplification = 0
    call group_multipliers(group, .false., multipliers, error)
    if (allocated(error)) return
    ! |1 - rho|, at the least. Where rho is lost, |rho| is small.
    allocate(distance(size(multipliers%rho)))
    do k = 1, size(distance)
      associate (z => multipliers%log_abs(k), e => multipliers%error(k))
        if (z + log(1 + e) <= -1) then
          distance(k) = 1 - exp(-1.0_dp)
        else if (z > 1) then
          distance(k) = merge(0.5_dp * exp(1.0_dp) - 1, 0.0_dp, e < 0.5_dp)
        else
          distance(k) = abs(1 - multipliers%rho(k)) - e * abs(multipliers%rho(k))
        end if
      end associate
    end do
    if (any(distance <= 0)) then
      call fatal_error(error, resonance, failed_computation)
      return
    end if
    amplification = size(distance) * maxval(multipliers%condition / distance)
  end subroutine group_amplification

  !> The least |D y| / |y| at any phase.
  real(dp) function least_size(d)
    complex(dp), intent(in) :: d(:, :, :)
    complex(dp), allocatable :: inverted(:, :)
    type(error_type), allocatable :: error
    integer :: k

    least_size = huge(least_size)
    do k = 1, size(d, 3)
      call inverse(d(:, :, k), inverted, error)
      if (allocated(error)) then
        least_size = 0
      else
        least_size = min(least_size, 1 / norm2(abs(inverted)))
      end if
    end do
  end function least_size

  !> How much more than over the whole period a group grows within it, at the most: the logarithm.
  pure real(dp) function log_growth(d)
    complex(dp), intent(in) :: d(:, :, :)
    real(dp) :: rates(size(d, 3))
    integer :: i

    log_growth = 0
    do i = 1, size(d, 1)
      rates = real(d(i, i, :))
      log_growth = max(log_growth, sum(abs(rates - sum(rates) / size(rates))) / size(rates))
    end do
  end function log_growth

  !> The periodic motion that starts with `x0`, at `phases` (ascending, in [0, 1]); x has the shape (n, points).
  subroutine follow_reduced(reduced, x0, phases, x, error)
    type(reduced_type), intent(in) :: reduced
    real(dp), intent(in) :: x0(:), phases(:)
    real(dp), intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: inverted(:, :), shapes(:, :, :)
    real(dp), allocatable :: y(:, :), y0(:), weights(:, :)
    integer :: n, m, k

    n = size(x0)
    allocate(weights, source=transpose(interpolation(reduced%reduction%angles, phases)))
    associate (r => reduced%reduction, group => reduced%groups(1))
      x = matmul(real(r%response), weights)
      if (reduced%has_slow) then
        m = size(group%columns)
        call inverse(r%basis(:, :, 1), inverted, error)
        if (allocated(error)) return
        y0 = real(matmul(inverted(group%columns, :), x0 / reduced%scale - r%response(:, 1)))
        allocate(y(m, size(phases)))
        if (allocated(group%factors)) then
          call follow_factored(group%system, group%factors, phases, y, error)
        else
          call trajectory(group%system, group%monodromy%method, group%monodromy%nodes, y0, phases, y, error)
        end if
        if (allocated(error)) return
        shapes = reshape(matmul(reshape(r%basis(:, group%columns, :), [n * m, r%angles]), weights), [n, m, size(phases)])
        do k = 1, size(phases)
          x(:, k) = x(:, k) + real(matmul(shapes(:, :, k), y(:, k)))
        end do
      end if
      x = x * spread(reduced%scale, 2, size(phases))
    end associate
  end subroutine follow_reduced

end module gestell_floquet_reduced
