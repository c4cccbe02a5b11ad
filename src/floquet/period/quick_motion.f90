!> Computes the periodic motion at equidistant phases by a single integration whose steps end at these phases. This takes a tenth
!> of the time of a solution with error bounds. The procedures are meant for computing a correction of a motion, because relative
!> errors of a correction are of little importance.
!>
!> A periodic motion without high harmonics requires far fewer stages than Phi(T). With s stages a step of length h has the error
!> h^(s+1) times the derivative of order s + 1 of the motion, times (h |P|)^s. The matrix (E - Phi)^-1 of the discrete solution
!> propagates this error over the period. So the error contains 2 s + 1 factors h: s + 1 of them are multiplied by frequencies of
!> the motion, the other s by the frequency of the fastest vibration.
!>
!> The first step length is chosen from assumed harmonics of the motion. If the harmonics of the result show that its error is too
!> large, the motion is computed again with shorter steps.
module gestell_floquet_period_quick_motion
  use gestell_math_dft, only: dft
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: inverse
  use gestell_math_matrix, only: balanced, unit_matrix
  use gestell_floquet_period_period_map, only: motions
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_floquet_integrator_gauss, only: gauss, gauss_method
  use gestell_floquet_period_turn_errors, only: relative_rounding
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: solve_quickly

  !> Amplification of errors that is assumed before it has been computed; typical if no multiplier is near 1
  real(dp), parameter :: usual_amplification = 7

  type, public :: quick_motion_type
    !> `x`: states at the phases (k - 1)/phases, shape (n, phases). `scale`: units that make the states comparable, shape (n).
    real(dp), allocatable :: x(:, :), scale(:)
    !> Estimated errors relative to the motion. `rounding`: due to rounding. `truncation`: due to the length of the steps
    real(dp) :: rounding = 0, truncation = 0
    !> `phase_advance`: phase advance (radians) of the fastest vibration within the period. `amplification`: factor by which the
    !> periodic motion amplifies errors of the steps.
    real(dp) :: phase_advance = 0, amplification = usual_amplification
    !> Norm of each harmonic (order 0, 1, ...) relative to the norm of the whole motion, in units of `scale`
    real(dp), allocatable :: spectrum(:)
    !> If true, also store the maps [Phi(t) x_p(t)] at the phases k/phases, k = 1 ... phases, in `maps`, shape (n, n + 1, phases).
    !> The caller sets this.
    logical :: keeps = .false.
    real(dp), allocatable :: maps(:, :, :)
  end type quick_motion_type

  !> Largest phase advance (radians per period) of the fastest vibration for which this method is used. For larger phase advances,
  !> reduction to slowly varying modes is faster.
  real(dp), parameter :: max_turns = 700
  !> `usual_ratio`: ratio of successive harmonics that is assumed before they have been computed. `reserve`: factor by which the
  !> amplification may grow without loss of accuracy. `slack`: ratio of the estimated to the allowed error above which a motion
  !> is computed again.
  real(dp), parameter :: usual_ratio = 0.5_dp, reserve = 1.5_dp, slack = 100
  !> `max_between`: maximum number of steps between two phases. `max_trials`: maximum number of solutions.
  integer, parameter :: max_between = 8, max_trials = 4

contains

  !> Computes the periodic motion at equidistant phases.
  subroutine solve_quickly(system, phases, of_motion, motion, fits)
    class(periodic_system), intent(in) :: system
    !> Number of phases
    integer, intent(in) :: phases
    !> Allowed error relative to the motion
    real(dp), intent(in) :: of_motion
    !> The periodic motion. On input it is empty or holds the motion of a similar system, whose units, phase advance, amplification
    !> and harmonics are then used.
    type(quick_motion_type), intent(inout) :: motion
    !> False if this method is unsuitable or fails. It is unsuitable if the coefficients jump, if the phase advance of the fastest
    !> vibration exceeds `max_turns`, or if a multiplier is so near 1 that rounding exceeds the allowed error.
    logical, intent(out) :: fits
    class(method_type), allocatable :: method
    type(survey_type) :: survey
    type(error_type), allocatable :: error
    real(dp) :: maps(system%states, system%states + 1, phases)
    !> (E - Phi)^-1 in balanced units
    real(dp), allocatable :: inverted(:, :)
    integer :: n, between, trial, k

    fits = .false.
    if (allocated(system%breaks)) return
    if (.not. allocated(motion%scale)) then
      call survey_system(system, survey, error)
      if (allocated(error)) return
      motion%scale = survey%scale
      motion%phase_advance = survey%phase_advance
    end if
    if (motion%phase_advance > max_turns) return
    n = system%states
    if (.not. allocated(motion%spectrum)) motion%spectrum = [(usual_ratio**k, k = 0, phases / 2)]
    do trial = 1, max_trials
      call choose_steps(system, phases, motion, of_motion / (reserve * motion%amplification), method, between)
      if (between == 0) return
      call motions(system, method, [(real(k, dp) / (between * phases), k = 0, between * phases)], 1, maps, error)
      if (allocated(error)) return
      call inverse(unit_matrix(n) - balanced(maps(:, :n, phases), motion%scale), inverted, error)
      if (allocated(error)) return
      ! If Phi is large (E - Phi)^-1 is small, and it is lost in rounding unless all multipliers are large.
      motion%amplification = max(norm2(inverted), 1.0_dp)
      motion%rounding = motion%amplification * (1 + norm2(balanced(maps(:, :n, phases), motion%scale))) &
        & * relative_rounding(system, between * phases, motion%phase_advance)
      if (.not. motion%rounding < of_motion) return
      call move(maps, matmul(inverted, maps(:, n + 1, phases) / motion%scale), motion)
      if (.not. all(ieee_is_finite(motion%x))) return
      motion%truncation = motion%amplification * error_of(system, motion, method, between * phases)
      fits = motion%truncation <= slack * of_motion
      if (fits .and. motion%keeps) motion%maps = maps
      if (fits) return
    end do
  end subroutine solve_quickly

  !> Computes the motion and its harmonics from the initial state `start`, given in units of `scale`.
  subroutine move(maps, start, motion)
    real(dp), intent(in) :: maps(:, :, :), start(:)
    type(quick_motion_type), intent(inout) :: motion
    complex(dp) :: z(size(maps, 3))
    real(dp) :: maximum
    integer :: n, j, k

    n = size(start)
    if (allocated(motion%x)) deallocate(motion%x)
    allocate(motion%x(n, size(maps, 3)))
    motion%x(:, 1) = motion%scale * start
    do k = 1, size(maps, 3) - 1
      motion%x(:, k + 1) = matmul(maps(:, :n, k), motion%x(:, 1)) + maps(:, n + 1, k)
    end do
    ! Two states a and b share one transform: for a + i b, |A_k|^2 + |B_k|^2 follows from z_k and z_-k together.
    maximum = maxval(abs(motion%x / spread(motion%scale, 2, size(z))))
    deallocate(motion%spectrum)
    allocate(motion%spectrum(size(z) / 2 + 1), source=0.0_dp)
    if (.not. maximum > 0) return
    do j = 1, n, 2
      associate (a => motion%x(j, :) / motion%scale(j), b => motion%x(min(j + 1, n), :) / motion%scale(min(j + 1, n)))
        z = dft(cmplx(a / maximum, b / maximum, dp))
      end associate
      motion%spectrum(1) = motion%spectrum(1) + abs(z(1))**2
      do k = 1, size(z) / 2
        motion%spectrum(k + 1) = motion%spectrum(k + 1) + 2 * (abs(z(k + 1))**2 + abs(z(size(z) + 1 - k))**2)
      end do
    end do
    motion%spectrum = sqrt(motion%spectrum / sum(motion%spectrum))
  end subroutine move

  !> Estimated error of a motion computed with `steps` Gauss steps, relative to the motion and before amplification; equation (38)
  !> of doc/theory.md.
  real(dp) function error_of(system, motion, method, steps)
    class(periodic_system), intent(in) :: system
    type(quick_motion_type), intent(in) :: motion
    class(method_type), intent(in) :: method
    integer, intent(in) :: steps
    real(dp) :: angle
    integer :: stages, k

    stages = method%order / 2
    angle = (0.8_dp * motion%phase_advance + method%order * system%least_steps / 8.0_dp) / steps
    error_of = method%error_constant * steps * angle**stages &
      & * sum([(motion%spectrum(k + 1) * (2 * pi * k / steps)**(stages + 1), k = 1, size(motion%spectrum) - 1)])
  end function error_of

  !> Chooses the number of Gauss stages and the number of steps between two phases, `between`, that reach `tolerance` with the least
  !> work. `between` is zero if `tolerance` cannot be reached.
  subroutine choose_steps(system, phases, motion, tolerance, method, between)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: phases
    type(quick_motion_type), intent(in) :: motion
    real(dp), intent(in) :: tolerance
    class(method_type), allocatable, intent(out) :: method
    integer, intent(out) :: between
    type(gauss_method) :: candidate
    real(dp) :: work, min_work
    integer :: stages, steps, fewest

    between = 0
    min_work = huge(min_work)
    fewest = 1
    do while (fewest * phases < system%least_steps .and. fewest <= max_between)
      fewest = 2 * fewest
    end do
    do stages = 2, 10
      candidate = gauss(stages)
      steps = fewest
      do while (steps <= max_between)
        if (error_of(system, motion, candidate, steps * phases) <= tolerance) exit
        steps = 2 * steps
      end do
      if (steps > max_between) cycle
      work = candidate%work(system%states, .true.) * steps
      if (work < min_work) then
        min_work = work
        method = candidate
        between = steps
      end if
      ! More stages would only cost more.
      if (steps == fewest) exit
    end do
    if (between > 0) call method%prepare()
  end subroutine choose_steps

end module gestell_floquet_period_quick_motion
