!> Computes all modes of a system with periodic coefficients at one speed (doc/theory.md, "Modes over the speed").
module gestell_study_mode_solution
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_math_sorting, only: ascending
  use gestell_floquet_solution_constant, only: constant_type, solve_constant
  use gestell_floquet_multipliers, only: lie_on_circle
  use gestell_floquet_period_monodromy, only: accuracy_type, check_accuracy
  use gestell_study_mode_components, only: find_components, append_component
  use gestell_study_mode_motion, only: motions_type, solve_motions
  use gestell_study_mode, only: assurance, mode_type, max_dofs
  use gestell_system_averaged, only: averaged_system
  use gestell_system_subsystem, only: find_subsystems, extract_subsystem
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: solve_modes

contains

  !> Computes the modes of `system`, one for each degree of freedom, in ascending order of frequency. Uncoupled parts of the
  !> system are solved separately. If a mode cannot be identified, or if its part of the system cannot be solved, it comes last
  !> and `identified` is false. Fails if the system or the accuracy is invalid, or if the system has more than `max_dofs` degrees
  !> of freedom.
  subroutine solve_modes(system, accuracy, modes, mass, error)
    !> A system with f degrees of freedom
    class(second_order_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    !> The modes, one for each degree of freedom, shape (f)
    type(mode_type), allocatable, intent(out) :: modes(:)
    !> Mean of M over the period, shape (f, f)
    real(dp), allocatable, intent(out) :: mass(:, :)
    type(error_type), allocatable, intent(out) :: error
    class(periodic_system), allocatable :: part
    integer, allocatable :: numbers(:), states(:), chosen(:)
    integer :: f, i, k

    call system%check(error)
    if (.not. allocated(error)) call check_accuracy(accuracy, error)
    if (.not. allocated(error)) call find_subsystems(system, numbers, error)
    if (allocated(error)) return
    f = system%states / 2
    if (f > max_dofs) then
      call fatal_error(error, "modes are computed for at most six degrees of freedom", failed_computation)
      return
    end if
    allocate(modes(f), mass(f, f))
    mass = mean_mass(system)
    select type (system)
    type is (averaged_system)
      call constant_modes(system, mass, modes)
    class default
      if (maxval(numbers) == 1) then
        call periodic_modes(system, accuracy, mass, modes)
      else
        do k = 1, maxval(numbers)
          chosen = pack([(i, i = 1, f)], numbers == k)
          call extract_subsystem(system, chosen, part, states)
          call embed(part, accuracy, mass, chosen, modes)
        end do
      end if
    end select
    ! modes that are not identified come last
    modes = modes(ascending(merge(modes%frequency(), huge(1.0_dp), modes%identified)))
  end subroutine solve_modes

  !> Computes the modes of an uncoupled part of the system. Extends their shapes from the part's degrees of freedom `chosen` to
  !> those of the whole system.
  subroutine embed(part, accuracy, mass, chosen, modes)
    class(periodic_system), intent(in) :: part
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in) :: mass(:, :)
    integer, intent(in) :: chosen(:)
    type(mode_type), intent(inout) :: modes(:)
    type(mode_type) :: own(size(chosen))
    integer :: i

    call periodic_modes(part, accuracy, mass(chosen, chosen), own)
    do i = 1, size(chosen)
      modes(chosen(i)) = own(i)
      modes(chosen(i))%shapes = 0
      modes(chosen(i))%shapes(chosen, :) = own(i)%shapes(:size(chosen), :)
    end do
  end subroutine embed

  !> Mean of the mass matrix over the period, by the trapezoidal rule.
  function mean_mass(system) result(mean)
    class(second_order_system), intent(in) :: system
    real(dp) :: mean(system%states / 2, system%states / 2)
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
    integer :: samples, k

    samples = 4 * system%least_steps
    allocate(m(samples, size(mean, 1), size(mean, 1)))
    allocate(b, c, mold=m)
    call system%sample_second_order([((k - 1.0_dp) / samples, k = 1, samples)], m, b, c)
    mean = sum(m, dim=1) / samples
  end function mean_mass

  !> Computes the modes of a system with constant coefficients from its eigenvalues. The imaginary parts of the eigenvalues are
  !> the frequencies. Multipliers, by contrast, determine frequencies only up to multiples of 2 pi / T.
  subroutine constant_modes(system, mass, modes)
    type(averaged_system), intent(in) :: system
    real(dp), intent(in) :: mass(:, :)
    type(mode_type), intent(out) :: modes(:)
    type(constant_type) :: constant
    type(error_type), allocatable :: failure
    type(mode_type) :: single(system%states)
    integer :: f, i

    call solve_constant(system, .false., constant, failure)
    if (allocated(failure)) return
    f = size(modes)
    do i = 1, size(single)
      single(i)%identified = .true.
      single(i)%growth = real(constant%values(i))
      single(i)%error = constant%radius(i)
      call append_component(aimag(constant%values(i)), constant%vectors(:f, i) * constant%scale(:f), 1.0_dp, mass, single(i))
    end do
    call pair(constant%values, constant%radius, 0.0_dp, mass, single, modes)
  end subroutine constant_modes

  !> Computes modes from the free vibrations of a system with periodic coefficients.
  subroutine periodic_modes(system, accuracy, mass, modes)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in) :: mass(:, :)
    type(mode_type), intent(out) :: modes(:)
    type(motions_type) :: motions
    type(error_type), allocatable :: failure
    type(mode_type) :: single(system%states)
    real(dp) :: error(system%states)
    real(dp), parameter :: lost_fraction = 0.5_dp
    integer :: i

    call solve_motions(system, accuracy, motions, failure)
    if (allocated(failure)) return
    error = -log(1 - min(motions%error, lost_fraction)) / system%period
    if (allocated(motions%signs)) single%neutral = motions%signs /= 0 .or. lie_on_circle(real(motions%exponent) * system%period, &
      & aimag(motions%exponent) * system%period, motions%error)
    single%identified = motions%error < lost_fraction
    single%growth = real(motions%exponent)
    single%error = error
    call settle(system%period, motions%exponent)
    do i = 1, size(single)
      call find_components(motions%positions(:, :, i), aimag(motions%exponent(i)), system%period, mass, single(i))
    end do
    call pair(motions%exponent, error, system%period, mass, single, modes)
  end subroutine periodic_modes

  !> Removes rounding errors from real exponents. An exponent is real if no other exponent is nearer to its conjugate (multiples of
  !> i 2 pi / T are ignored). The imaginary part of a real exponent is rounded to a multiple of pi / T.
  pure subroutine settle(period, z)
    real(dp), intent(in) :: period
    complex(dp), intent(inout) :: z(:)
    logical :: paired(size(z))
    integer :: i, partner

    paired = .false.
    do i = 1, size(z)
      if (paired(i)) cycle
      partner = partner_of(z, period, paired, i)
      paired([i, partner]) = .true.
      if (partner == i) z(i) = cmplx(real(z(i)), pi / period * anint(aimag(z(i)) * period / pi), dp)
    end do
  end subroutine settle

  !> Index of the exponent, not yet paired, that is nearest to the conjugate of the i-th exponent. Multiples of i 2 pi / T are
  !> ignored unless `period` is 0.
  pure integer function partner_of(z, period, paired, i) result(partner)
    complex(dp), intent(in) :: z(:)
    real(dp), intent(in) :: period
    logical, intent(in) :: paired(:)
    integer, intent(in) :: i
    complex(dp) :: difference(size(z))

    difference = z - conjg(z(i))
    if (period > 0) difference = cmplx(real(difference), aimag(difference) &
      & - 2 * pi / period * anint(aimag(difference) * period / (2 * pi)), dp)
    partner = minloc(abs(difference), dim=1, mask=.not. paired)
  end function partner_of

  !> Pairs exponents to form modes. Conjugate exponents are paired first. Then real exponents are paired in order of similarity:
  !> preferably their multipliers have the same sign and their shapes and frequencies are similar.
  subroutine pair(z, error, period, mass, single, modes)
    complex(dp), intent(in) :: z(:)
    real(dp), intent(in) :: error(:), period, mass(:, :)
    type(mode_type), intent(in) :: single(:)
    type(mode_type), intent(inout) :: modes(:)
    logical :: paired(size(z)), real_ones(size(z))
    real(dp) :: match, best
    integer :: i, k, partner, mode_count, two(2)

    paired = .false.
    real_ones = .false.
    mode_count = 0
    do i = 1, size(z)
      if (paired(i)) cycle
      partner = partner_of(z, period, paired, i)
      paired([i, partner]) = .true.
      if (partner == i) then
        real_ones(i) = .true.
      else if (mode_count < size(modes)) then
        mode_count = mode_count + 1
        modes(mode_count) = merge_pair(i, partner)
      end if
    end do
    do while (count(real_ones) > 1 .and. mode_count < size(modes))
      best = -huge(best)
      two = 0
      do i = 1, size(z)
        do k = 1, i - 1
          if (.not. (real_ones(i) .and. real_ones(k))) cycle
          match = similarity(i, k)
          if (match <= best) cycle
          best = match
          two = [i, k]
        end do
      end do
      real_ones(two) = .false.
      mode_count = mode_count + 1
      modes(mode_count) = merge_pair(two(1), two(2))
      modes(mode_count)%real_pair = .true.
    end do

  contains

    !> Similarity of two real exponents. It is large if shapes and frequencies are similar and the multipliers have the same sign.
    pure real(dp) function similarity(i, k)
      integer, intent(in) :: i, k
      real(dp), parameter :: other_sign = 10

      similarity = assurance(single(i)%shape(), single(k)%shape(), mass) &
        & - period / (2 * pi) * abs(single(i)%frequencies(1) - single(k)%frequencies(1))
      if (period > 0) similarity = similarity - other_sign * abs(anint(aimag(z(i) - z(k)) * period / (2 * pi)) &
        & - aimag(z(i) - z(k)) * period / (2 * pi))
    end function similarity

    !> Creates the mode of two paired exponents. Its frequency and shape are those of the exponent with the larger growth rate.
    pure type(mode_type) function merge_pair(i, k) result(mode)
      integer, intent(in) :: i, k

      mode = single(merge(i, k, single(i)%growth >= single(k)%growth))
      mode%partner_growth = min(single(i)%growth, single(k)%growth)
      mode%error = max(error(i), error(k))
      mode%identified = single(i)%identified .and. single(k)%identified
      mode%neutral = single(i)%neutral .and. single(k)%neutral
    end function merge_pair

  end subroutine pair

end module gestell_study_mode_solution
