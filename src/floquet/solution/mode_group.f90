!> Solves one group of modes of a reduction: computes its map over the period, its multipliers, and bounds on its response to
!> disturbances.
module gestell_floquet_solution_mode_group
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: eigensystem, inverse
  use gestell_floquet_reduction_conjugates, only: entry
  use gestell_floquet_solution_factored, only: factored_type, solve_factored
  use gestell_floquet_solution_part_solution, only: part_solution_type
  use gestell_floquet_solution_integrated, only: integrate, integrated_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multiplier, multipliers_type, set_multipliers
  use gestell_floquet_period_periodic_solution, only: raise_resonance
  use gestell_floquet_reduction, only: reduction_type
  use gestell_floquet_solution_sampled, only: complex_system, real_system, sampled_system
  implicit none (type, external)
  private

  public :: blocks, group_amplification, group_multipliers, min_size, mirror, solve_group, bound_rates

  !> Group of m modes. Over a period their motion is multiplied by the matrix exp(shift) Phi.
  type, public :: group_type
    !> `columns`: columns of the basis that belong to the group. `conjugates`: columns of the conjugate group; equal to `columns`
    !> for a real group. Shapes (m).
    integer, allocatable :: columns(:), conjugates(:)
    !> Exponent of the factor exp(shift), which is common to all modes of the group.
    complex(dp) :: shift = 0
    !> Matrix Phi, shape (m, m); unallocated if the solution of the group keeps Phi as a product of factors.
    complex(dp), allocatable :: phi(:, :)
    !> Bound on the norm of the error of the matrix Phi.
    real(dp) :: error = 0
    !> The group as a system of its own, without the factor exp(shift). Unallocated for a single mode without forcing.
    type(sampled_system), allocatable :: system
    class(part_solution_type), allocatable :: solution
  end type group_type

contains

  !> Computes the map of one group over the period. Fails if `solve_monodromy` fails, or if the multipliers of a group that
  !> does not contain its complex conjugate modes differ too much in modulus.
  subroutine solve_group(reduction, forced, accuracy, group, error)
    type(reduction_type), intent(in) :: reduction
    !> If true, also compute the forced motion that starts from zero
    logical, intent(in) :: forced
    type(accuracy_type), intent(in) :: accuracy
    !> The group. On entry it contains its columns and the columns of its conjugate; the procedure computes the other components.
    type(group_type), intent(inout) :: group
    type(error_type), allocatable, intent(out) :: error
    type(integrated_type), allocatable :: integrated
    type(factored_type), allocatable :: factored
    complex(dp), allocatable :: d(:, :, :)
    complex(dp) :: centre
    integer :: m, i, k

    m = size(group%columns)
    d = blocks(reduction%generator, reduction, group)
    if (m == 1 .and. .not. forced) then
      group%shift = (sum(d) + sum(blocks(reduction%generator_between, reduction, group))) / (2 * reduction%angles)
    else if (.not. forced) then
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
      allocate(integrated)
      if (any(group%conjugates /= group%columns)) then
        group%system = complex_system(d, rounding)
      else if (forced) then
        group%system = real_system(real(d), transpose(reduction%forcing(:, group%columns)), rounding)
      else
        group%system = real_system(real(d), 0 * real(d(:, 1, :)), rounding)
      end if
    end associate
    call integrate(group%system, accuracy, forced, integrated, error)
    if (allocated(error)) return
    associate (monodromy => integrated%monodromy)
      if (.not. monodromy%loses_modes()) then
        group%phi = monodromy%phi(:m, :m)
        if (any(group%conjugates /= group%columns)) group%phi = cmplx(monodromy%phi(:m, :m), monodromy%phi(m + 1:, :m), dp)
        group%error = monodromy%error
      end if
    end associate
    if (allocated(group%phi)) then
      call move_alloc(integrated, group%solution)
    else if (any(group%conjugates /= group%columns)) then
      call fatal_error(error, "the multipliers of a group of modes differ too much in magnitude", failed_computation)
    else
      allocate(factored)
      call solve_factored(group%system, accuracy, forced, factored, error)
      call move_alloc(factored, group%solution)
    end if
  end subroutine solve_group

  !> Block of the generator D that belongs to a group, at all phases, shape (m, m, N). `generator`: generator D of all modes, shape
  !> (N, n, n).
  pure function blocks(generator, reduction, group) result(d)
    real(dp), contiguous, intent(in) :: generator(:, :, :)
    type(reduction_type), intent(in) :: reduction
    type(group_type), intent(in) :: group
    complex(dp) :: d(size(group%columns), size(group%columns), reduction%angles)
    real(dp), dimension(reduction%angles) :: re, im
    integer :: i, j

    do j = 1, size(group%columns)
      do i = 1, size(group%columns)
        call entry(generator, reduction%modes%conjugate, group%columns(i), group%columns(j), re, im)
        d(i, j, :) = cmplx(re, im, dp)
      end do
    end do
  end function blocks

  !> Computes the multipliers of one group for the period 1. With `vectors` it also computes the eigenvectors, as combinations of
  !> the columns of the group.
  subroutine group_multipliers(group, vectors, multipliers, error)
    type(group_type), intent(in) :: group
    !> If true, also compute the eigenvectors
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)

    if (.not. allocated(group%phi)) then
      call group%solution%multipliers(vectors, multipliers, error)
      if (allocated(error)) return
    else
      if (size(group%phi) == 1) then
        rho = group%phi(:, 1)
        right = reshape([(1.0_dp, 0.0_dp)], [1, 1])
        left = right
      else
        call eigensystem(group%phi, rho, right, left, error)
        if (allocated(error)) return
      end if
      call set_multipliers(rho, right, left, group%error + size(rho) * epsilon(1.0_dp) * norm2(abs(group%phi)), multipliers)
      if (vectors) multipliers%vectors = right
    end if
    ! Multiply by exp(shift).
    multipliers%log_abs = multipliers%log_abs + real(group%shift)
    multipliers%arg = multipliers%arg + aimag(group%shift)
    multipliers%arg = multipliers%arg - 2 * pi * anint(multipliers%arg / (2 * pi))
    multipliers%exponent = cmplx(multipliers%log_abs, multipliers%arg, dp)
    multipliers%rho = multiplier(multipliers%exponent)
  end subroutine group_multipliers

  !> Replaces multipliers and eigenvectors by their complex conjugates.
  pure subroutine mirror(multipliers)
    type(multipliers_type), intent(inout) :: multipliers

    multipliers%arg = -multipliers%arg
    multipliers%rho = conjg(multipliers%rho)
    multipliers%exponent = conjg(multipliers%exponent)
    if (allocated(multipliers%vectors)) multipliers%vectors = conjg(multipliers%vectors)
  end subroutine mirror

  !> Computes `amplification`, a bound on |(E - Phi)^-1| of a group, from the multipliers of the group. Fails if a multiplier equals
  !> 1 within its error (resonance).
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
    ! Lower bounds on |1 - rho|. A multiplier without a correct digit may still be proved to be small.
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
      call raise_resonance(error)
      return
    end if
    amplification = size(distance) * maxval(multipliers%condition / distance)
  end subroutine group_amplification

  !> Lower bound on |D y| / |y| over all vectors y and all phases; `d` has the shape (m, m, phases).
  real(dp) function min_size(d)
    complex(dp), intent(in) :: d(:, :, :)
    complex(dp), allocatable :: inverted(:, :)
    type(error_type), allocatable :: error
    integer :: k

    if (size(d, 1) == 1) then
      min_size = minval(abs(d))
      return
    end if
    min_size = huge(min_size)
    do k = 1, size(d, 3)
      call inverse(d(:, :, k), inverted, error)
      if (allocated(error)) then
        min_size = 0
      else
        min_size = min(min_size, 1 / norm2(abs(inverted)))
      end if
    end do
  end function min_size

  !> Computes bounds on the growth and decay of a group's motion during the period.
  !>
  !> The motion is followed forward or backward in time, whichever makes it grow less. The bounds are valid in the group's own
  !> coordinates, or in coordinates whose basis is the eigenvectors of the group's mean D.
  subroutine bound_rates(d, growth, rate, condition)
    !> Generator D of the group at all phases, shape (m, m, phases)
    complex(dp), intent(in) :: d(:, :, :)
    !> `growth`: logarithm of the maximum size of the motion relative to its size at the ends of the period. `rate`: lower
    !> bound on the rate of decay if the motion decays at all phases, or on the rate of growth if it grows at all phases; otherwise
    !> zero. `condition`: condition number of the coordinates.
    real(dp), intent(out) :: growth, rate, condition
    type(error_type), allocatable :: error
    complex(dp), allocatable :: values(:), right(:, :), left(:, :), inverted(:, :)
    complex(dp) :: turned(size(d, 1), size(d, 1), size(d, 3))
    real(dp) :: other_growth, other_rate
    integer :: k

    condition = 1
    call rates_of(d, growth, rate)
    if (size(d, 1) == 1 .or. rate > 0) return
    call eigensystem(sum(d, dim=3) / size(d, 3), values, right, left, error)
    if (.not. allocated(error)) call inverse(right, inverted, error)
    if (allocated(error)) return
    do k = 1, size(d, 3)
      turned(:, :, k) = matmul(inverted, matmul(d(:, :, k), right))
    end do
    call rates_of(turned, other_growth, other_rate)
    associate (both => norm2(abs(right)) * norm2(abs(inverted)))
      if (other_growth + log(both) >= growth) return
      condition = both
      growth = other_growth + log(both)
      rate = other_rate
    end associate
  end subroutine bound_rates

  !> Computes `growth` and `rate` of `bound_rates` in the coordinates of `d`. The rate of change of ln |y|, the logarithm of the
  !> motion's size, lies between the extreme eigenvalues of the Hermitian part of D, which Gershgorin's discs bound. A motion
  !> that decays over the period is followed forward, a motion that grows is followed backward.
  pure subroutine rates_of(d, growth, rate)
    complex(dp), intent(in) :: d(:, :, :)
    real(dp), intent(out) :: growth, rate
    real(dp), dimension(size(d, 3)) :: fastest, slowest
    real(dp) :: coupling
    integer :: i, k

    fastest = -huge(fastest)
    slowest = huge(slowest)
    do k = 1, size(d, 3)
      do i = 1, size(d, 1)
        coupling = (sum(abs(d(i, :, k) + conjg(d(:, i, k)))) - 2 * abs(real(d(i, i, k)))) / 2
        fastest(k) = max(fastest(k), real(d(i, i, k)) + coupling)
        slowest(k) = min(slowest(k), real(d(i, i, k)) - coupling)
      end do
    end do
    growth = min(sum(max(fastest, 0.0_dp)), sum(max(-slowest, 0.0_dp))) / size(d, 3)
    rate = max(0.0_dp, -maxval(fastest), minval(slowest))
  end subroutine rates_of

end module gestell_floquet_solution_mode_group
