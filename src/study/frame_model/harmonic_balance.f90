!> Solves for the periodic motion of M q'' + B q' + C q = h by harmonic balance: the harmonics satisfy the equations at
!> equidistant phases. Nothing is integrated, and the coefficients are evaluated at these phases only.
!>
!> If M, B, C were replaced by their means over the turn, there would be a separate equation A_k x_k = h_k for each harmonic k.
!> Let A be the matrix with the blocks A_k. The periodic parts of M, B, C couple the harmonics weakly. With A^-1 as preconditioner
!> GMRES therefore needs few iterations (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7, 1986, 856-869), even where a
!> resonance of the averaged equations makes one or two couplings large. The error of the computed harmonics is estimated by the
!> residual times an estimate of the norm of the inverse. Harmonics that the phases do not resolve appear as lower harmonics
!> (doc/theory.md, equation 37).
module gestell_study_frame_model_harmonic_balance
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_floquet_period_turn_errors, only: relative_rounding
  use gestell_study_frame_model_gmres, only: gmres_type
  use gestell_study_frame_model_harmonic_means, only: means_type, solve_means
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: balance_harmonics

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
    !> The preconditioner, which is kept and used again for similar systems
    type(means_type), private :: means
  contains
    procedure :: at_phases
  end type balance_type

  !> Coefficients M, B, C of the equations at all phases, each of shape (phases, degrees of freedom, degrees of freedom).
  type :: coefficients_type
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
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
    if (allocated(system%breaks) .or. phases < phases_in_step * system%least_steps) return
    if (.not. allocated(motion%survey%scale)) then
      call survey_system(system, motion%survey, error)
      if (allocated(error)) return
    end if
    if (motion%survey%fastest > max_turns) return
    call sample(system, phases, motion%survey%scale, at, h)
    if (motion%means%half /= phases / 2) then
      call solve_means(at%m, at%b, at%c, 2 * pi / system%period, motion%survey, motion%means, fits)
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
        x = applied(means, at, reshape(krylov%last(), shape(x)))
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

  !> Samples the coefficients M, B, C of the equations, with theta = 2 pi t/T as independent variable, and the load h at
  !> equidistant phases. All are in the units `units` of the states.
  subroutine sample(system, phases, units, at, h)
    class(second_order_system), intent(in) :: system
    integer, intent(in) :: phases
    real(dp), intent(in) :: units(:)
    type(coefficients_type), intent(out) :: at
    real(dp), allocatable, intent(out) :: h(:, :)
    real(dp) :: omega
    integer :: f, i, j

    f = system%states / 2
    omega = 2 * pi / system%period
    allocate(at%m(phases, f, f), at%b(phases, f, f), at%c(phases, f, f), h(phases, f))
    call system%sample_second_order([(real(i, dp) / phases, i = 0, phases - 1)], at%m, at%b, at%c, h)
    do j = 1, f
      do i = 1, f
        at%m(:, i, j) = at%m(:, i, j) * (units(i) * units(j) * omega**2)
        at%b(:, i, j) = at%b(:, i, j) * (units(i) * units(j) * omega)
        at%c(:, i, j) = at%c(:, i, j) * (units(i) * units(j))
      end do
      h(:, j) = h(:, j) * units(j)
    end do
  end subroutine sample

  !> Applies the operator M q'' + B q' + C q to the harmonics of a motion q, and then the preconditioner. `v` and the result are
  !> harmonics multiplied by `means%weights`.
  pure function applied(means, at, v) result(x)
    type(means_type), intent(in) :: means
    type(coefficients_type), intent(in) :: at
    real(dp), intent(in) :: v(0:, :)
    real(dp) :: x(0:2 * means%half - 1, means%f)
    real(dp), dimension(0:2 * means%half - 1, 3 * means%f) :: harmonics, moved
    real(dp) :: load(2 * means%half, means%f)
    integer :: i, j, k

    associate (half => means%half, f => means%f)
      do j = 1, f
        harmonics(:, j) = v(:, j) / means%weights(:, j)
        do k = 0, half - 1
          harmonics(k, f + j) = k * harmonics(half + k, j)
          harmonics(half + k, f + j) = -k * harmonics(k, j)
          harmonics(k, 2 * f + j) = -real(k, dp)**2 * harmonics(k, j)
          harmonics(half + k, 2 * f + j) = -real(k, dp)**2 * harmonics(half + k, j)
        end do
      end do
      moved = means%waves%values(harmonics)
      load = 0
      do j = 1, f
        do i = 1, f
          load(:, i) = load(:, i) + at%c(:, i, j) * moved(:, j) + at%b(:, i, j) * moved(:, f + j) &
            & + at%m(:, i, j) * moved(:, 2 * f + j)
        end do
      end do
    end associate
    x = means%weighted(means%waves%harmonics(load))
  end function applied

  !> Evaluates functions at all phases from their harmonics. Both `harmonics` and the result have the shape (phases, functions).
  pure function at_phases(self, harmonics) result(values)
    class(balance_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: harmonics(:, :)
    real(dp) :: values(size(harmonics, 1), size(harmonics, 2))

    values = self%means%waves%values(harmonics)
  end function at_phases

end module gestell_study_frame_model_harmonic_balance
