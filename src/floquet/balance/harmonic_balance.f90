!> Solves for the periodic motion of M q'' + B q' + C q = h by harmonic balance: the harmonics satisfy the equations at
!> equidistant phases. Nothing is integrated, and the coefficients are evaluated at these phases only.
!>
!> If M, B, C were replaced by their means over the turn, there would be a separate equation A_k x_k = h_k for each harmonic k.
!> Let A be the matrix with the blocks A_k. The periodic parts of M, B, C couple the harmonics weakly. With A^-1 as preconditioner
!> GMRES therefore needs few iterations (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7, 1986, 856-869), even where a
!> resonance of the averaged equations makes one or two couplings large. The error of the computed harmonics is estimated by the
!> residual times an estimate of the norm of the inverse. Harmonics that the phases do not resolve appear as lower harmonics
!> (doc/theory.md, equation 37).
module gestell_floquet_balance_harmonic_balance
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_floquet_period_turn_errors, only: relative_rounding
  use gestell_floquet_balance_coupled_harmonics, only: coupled_type, couple_harmonics
  use gestell_floquet_balance_gmres, only: gmres_type
  use gestell_floquet_balance_harmonic_means, only: begin_means, means_type, solve_means
  use gestell_system_second_order, only: sample_in_units, second_order_system
  use gestell_system_mass, only: solve_mass
  implicit none (type, external)
  private

  public :: balance_harmonics, balance_to_rounding

  !> A periodic motion computed by harmonic balance, with estimates of its errors.
  type, public :: balance_type
    !> Harmonics of the degrees of freedom, shape (0:phases - 1, dofs): first the cosines of the orders below half the number of
    !> phases, then the sines
    real(dp), allocatable :: harmonics(:, :)
    !> Estimated relative errors of motion and velocity. `rounding`: error caused by rounding. `truncation`: error caused by the
    !> remaining residual and by missing harmonics
    real(dp) :: rounding = 0, truncation = 0
    !> The part of `truncation` that could be reduced by more phases
    real(dp) :: left_out = 0
    !> Units of the states, and phase advance of the free vibrations. They are kept and used again for similar systems. The
    !> component `scale` is unallocated before the first use
    type(survey_type) :: survey
    !> Means of C and M over the turn with theta as independent variable, in the units of the states; shape (dofs, dofs, 2)
    real(dp), allocatable :: energy(:, :, :)
    !> The preconditioner, which is kept and used again for similar systems
    type(means_type) :: means
  contains
    procedure :: at_phases
  end type balance_type

  !> Coefficients B and C of the equations q'' + B q' + C q = h at all phases, each of shape (phases, degrees of freedom, degrees of
  !> freedom).
  type :: coefficients_type
    real(dp), allocatable, dimension(:, :, :) :: b, c
  end type coefficients_type

  !> Maximum number of GMRES iterations.
  integer, parameter :: max_iterations = 16
  !> Safety factor on the residual. It allows for the ratio of peak to rms error, and for the part of the error that the iterations
  !> have not yet removed.
  real(dp), parameter :: reserve = 10
  !> Minimum number of phases, divided by the system's minimum number of integration steps `least_steps`.
  integer, parameter :: phases_in_step = 4
  !> Maximum phase advance of the free vibrations (rad) for which harmonic balance is tried.
  real(dp), parameter :: max_turns = 700

contains

  !> Computes the periodic motion by harmonic balance. Sets `fits` to false if the method does not work: because the coefficients
  !> jump, the free vibrations are too fast, the iterations do not converge, harmonics are missing, or rounding exceeds the allowed
  !> error.
  subroutine balance_harmonics(system, phases, of_motion, motion, fits)
    !> The system whose periodic motion is computed
    class(second_order_system), intent(in) :: system
    !> Number of phases: a multiple of twice the number of phases that are processed together (`lanes`)
    integer, intent(in) :: phases
    !> Allowed error, relative to the size of the motion
    real(dp), intent(in) :: of_motion
    !> The computed motion. On entry it may hold units and preconditioner of a similar system
    type(balance_type), intent(inout) :: motion
    !> False if harmonic balance does not work for this system
    logical, intent(out) :: fits
    type(coefficients_type) :: at
    type(error_type), allocatable :: error
    type(gmres_type) :: krylov
    real(dp), allocatable :: h(:, :), x(:, :)
    real(dp) :: size_of_motion
    integer :: i

    fits = .false.
    motion%left_out = 0
    if (.not. is_suitable(system, phases)) return
    if (.not. allocated(motion%survey%scale)) then
      call survey_system(system, motion%survey, error)
      if (allocated(error)) return
    end if
    if (motion%survey%fastest > max_turns) return
    call sample(system, phases, motion%survey%scale, at, h, motion%energy)
    if (motion%means%half /= phases / 2) then
      call solve_means(at%b, at%c, 2 * pi / system%period, motion%survey, motion%means, fits)
      if (.not. fits) return
    end if
    associate (means => motion%means)
      x = means%weighted(means%waves%harmonics(h))
      call krylov%begin(reshape(x, [size(x)]), max_iterations)
      do i = 0, max_iterations
        fits = reserve * krylov%residual() <= of_motion
        if (fits) then
          x = reshape(krylov%solution(), shape(x))
          motion%truncation = reserve * krylov%residual() * krylov%amplification() * norm2(x)
          x = x / means%weights
          size_of_motion = max(sqrt(sum(x(1, :)**2) + sum(x(2:, :)**2) / 2), tiny(size_of_motion))
          fits = motion%truncation <= of_motion * size_of_motion
        end if
        if (fits .or. i == max_iterations) exit
        x = means%weighted(applied(means, at, reshape(krylov%last(), shape(x))))
        call krylov%extend(reshape(x, [size(x)]))
      end do
      if (.not. fits) then
        motion%means%half = 0
        return
      end if
      motion%rounding = max(1.0_dp, means%amplification * krylov%amplification()) * (1 + sqrt(real(system%states, dp))) &
        & * relative_rounding(system, phases, motion%survey%phase_advance)
      motion%left_out = means%left_out(x) / size_of_motion
      motion%truncation = motion%truncation / size_of_motion + motion%left_out
      fits = motion%truncation <= of_motion .and. motion%rounding < of_motion
      motion%harmonics = x * spread(motion%survey%scale(:means%f), 1, phases)
    end associate
  end subroutine balance_harmonics

  !> Computes the periodic motion until the residual at the phases is of the size of rounding errors. The errors of the result are
  !> not estimated: the caller bounds them by the residual between the phases (gestell_floquet_balance_periodic_motion).
  subroutine balance_to_rounding(system, phases, of_load, motion, fits)
    !> `system`, `phases`: those of `balance_harmonics`
    class(second_order_system), intent(in) :: system
    integer, intent(in) :: phases
    !> Largest harmonic in the highest sixth of the orders, relative to the largest of the load, with which a solution is useful
    real(dp), intent(in) :: of_load
    !> The computed motion. `left_out` is the harmonic that is compared with `of_load`. On entry the motion holds the units of the
    !> states
    type(balance_type), intent(inout) :: motion
    !> False if harmonic balance does not work for this system, `left_out` exceeds `of_load`, or the iterations do not converge
    logical, intent(out) :: fits
    !> `goal`: residual, relative to the motion, at which the iterations end. `enough`: largest residual that is accepted.
    real(dp), parameter :: goal = 16 * epsilon(goal), enough = 1.0e-10_dp
    integer, parameter :: most = 40
    type(coefficients_type) :: at
    type(coupled_type) :: coupled
    type(gmres_type) :: krylov
    real(dp), allocatable :: h(:, :), x(:, :)
    integer :: i

    motion%left_out = 0
    fits = is_suitable(system, phases) .and. motion%survey%fastest <= max_turns
    if (.not. fits) return
    call sample(system, phases, motion%survey%scale, at, h, motion%energy)
    call begin_means(at%b, at%c, 2 * pi / system%period, motion%survey, motion%means)
    associate (means => motion%means)
      x = means%waves%harmonics(h)
      motion%left_out = highest_sixth(x)
      fits = motion%left_out <= of_load
      if (fits) call couple_harmonics(at%b, at%c, coupled, fits)
      if (.not. fits) return
      call coupled%solve(x)
      x = x * means%weights
      call krylov%begin(reshape(x, [size(x)]), most)
      do i = 1, most
        if (krylov%residual() <= goal) exit
        x = applied(means, at, reshape(krylov%last(), shape(x)))
        call coupled%solve(x)
        x = x * means%weights
        call krylov%extend(reshape(x, [size(x)]))
      end do
      fits = krylov%residual() <= enough
      motion%harmonics = reshape(krylov%solution(), shape(x)) / means%weights &
        & * spread(motion%survey%scale(:means%f), 1, phases)
    end associate
  end subroutine balance_to_rounding

  !> Largest amplitude in the highest sixth of the orders, relative to the largest of all. The harmonics `x`, shape (phases,
  !> functions), are cosines followed by sines.
  pure real(dp) function highest_sixth(x)
    real(dp), intent(in) :: x(:, :)
    integer :: half

    half = size(x, 1) / 2
    highest_sixth = max(maxval(abs(x(half - half / 6 + 1:half, :))), maxval(abs(x(2 * half - half / 6 + 1:, :)))) &
      & / max(maxval(abs(x)), tiny(1.0_dp))
  end function highest_sixth

  !> True if the coefficients do not jump and there are enough phases.
  pure logical function is_suitable(system, phases)
    class(second_order_system), intent(in) :: system
    integer, intent(in) :: phases

    is_suitable = .not. allocated(system%breaks) .and. phases >= phases_in_step * system%least_steps
  end function is_suitable

  !> Samples the equations q'' + B q' + C q = h at equidistant phases, with theta = 2 pi t/T as independent variable and in the
  !> units `units` of the states: B, C and h are those of the system, multiplied by M^-1. Without a variable mass matrix the highest
  !> derivative does not couple the harmonics, and GMRES needs fewer iterations. `energy`: means over the turn of C and M before the
  !> multiplication, which measure the potential and the kinetic energy, shape (f, f, 2).
  subroutine sample(system, phases, units, at, h, energy)
    class(second_order_system), intent(in) :: system
    integer, intent(in) :: phases
    real(dp), intent(in) :: units(:)
    type(coefficients_type), intent(out) :: at
    real(dp), allocatable, intent(out) :: h(:, :), energy(:, :, :)
    real(dp), allocatable :: m(:, :, :), right(:, :, :)
    real(dp) :: of_mass(size(units) / 2), omega
    integer :: f, i, j

    f = system%states / 2
    omega = 2 * pi / system%period
    allocate(m(phases, f, f), right(phases, f, 2 * f + 1), energy(f, f, 2))
    allocate(at%b(phases, f, f), at%c(phases, f, f), h(phases, f))
    call sample_in_units(system, [(real(i, dp) / phases, i = 0, phases - 1)], m, right(:, :, f + 1:2 * f), right(:, :, :f), &
      & of_mass, right(:, :, 2 * f + 1))
    energy(:, :, 1) = sum(right(:, :, :f), dim=1) / phases
    energy(:, :, 2) = sum(m, dim=1) / phases * omega**2
    call solve_mass(m, right)
    associate (unit => units(:f) / of_mass)
      do j = 1, f
        do i = 1, f
          at%c(:, i, j) = right(:, i, j) * (unit(j) / unit(i) / omega**2)
          at%b(:, i, j) = right(:, i, f + j) * (unit(j) / unit(i) / omega)
          energy(i, j, :) = energy(i, j, :) * unit(i) * unit(j)
        end do
        h(:, j) = right(:, j, 2 * f + 1) / (unit(j) * omega**2)
      end do
    end associate
  end subroutine sample

  !> Applies the operator q'' + B q' + C q to the harmonics of a motion q. `v`: these harmonics multiplied by `means%weights`.
  pure function applied(means, at, v) result(x)
    type(means_type), intent(in) :: means
    type(coefficients_type), intent(in) :: at
    real(dp), intent(in) :: v(0:, :)
    real(dp) :: x(0:2 * means%half - 1, means%f)
    real(dp), dimension(0:2 * means%half - 1, 2 * means%f) :: harmonics, moved
    real(dp) :: load(2 * means%half, means%f)
    integer :: i, j, k

    associate (half => means%half, f => means%f)
      do j = 1, f
        harmonics(:, j) = v(:, j) / means%weights(:, j)
        do k = 0, half - 1
          harmonics(k, f + j) = k * harmonics(half + k, j)
          harmonics(half + k, f + j) = -k * harmonics(k, j)
        end do
      end do
      moved = means%waves%values(harmonics)
      load = 0
      do j = 1, f
        do i = 1, f
          load(:, i) = load(:, i) + at%c(:, i, j) * moved(:, j) + at%b(:, i, j) * moved(:, f + j)
        end do
      end do
      x = means%waves%harmonics(load)
      do j = 1, f
        do k = 0, half - 1
          x(k, j) = x(k, j) - real(k, dp)**2 * harmonics(k, j)
          x(half + k, j) = x(half + k, j) - real(k, dp)**2 * harmonics(half + k, j)
        end do
      end do
    end associate
  end function applied

  !> Evaluates functions at all phases from their harmonics. Both `harmonics` and the result have the shape (phases, functions).
  pure function at_phases(self, harmonics) result(values)
    class(balance_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: harmonics(:, :)
    real(dp) :: values(size(harmonics, 1), size(harmonics, 2))

    values = self%means%waves%values(harmonics)
  end function at_phases

end module gestell_floquet_balance_harmonic_balance
