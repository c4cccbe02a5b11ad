!> Sensitivity of peaks: closed forms of a mass on a spring, with one harmonic and with two whose peaks are equal.
module test_sensitivity
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_system_family, only: family_type
  use gestell_task_sensitivity, only: sensitivity_base_type, sensitivity_type, solve_sensitivity
  use gestell_study_speed_point, only: speed_options
  use gestell_system_periodic, only: periodic_system
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_sensitivity

  real(dp), parameter :: frame_mass = 18, total = 20, stiffness = 5.0e4_dp

  !> A frame that moves along xi alone; parameters: relative changes of speed, frame's mass, stiffness, damping.
  type, extends(family_type) :: relative_family
    real(dp) :: speed = 0, damping = 0
    type(harmonic_mechanism_type) :: mechanism
    !> Counts the created members.
    integer, pointer :: members => null()
  contains
    procedure :: member
  end type relative_family

contains

  subroutine collect_sensitivity(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("sensitivities of an unbalanced rotor agree with the closed form", test_closed_form), &
      & new_unittest("no more solutions are computed than the tolerance requires", test_solutions), &
      & new_unittest("two equal peaks make the sensitivity one-sided and are reported", test_equal_peaks), &
      & new_unittest("zero quantities and resonances are reported without sensitivity", test_zero_and_resonance)]
  end subroutine collect_sensitivity

  subroutine member(self, parameters, system, error)
    class(relative_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(gestell_error), allocatable, intent(out) :: error
    type(frame_type), allocatable :: frame
    real(dp) :: c(3, 3), b(3, 3)

    if (associated(self%members)) self%members = self%members + 1
    c = 0
    b = 0
    c(1, 1) = stiffness * (1 + parameters(3))
    b(1, 1) = self%damping * (1 + parameters(4))
    allocate(frame)
    call new_frame(frame, self%mechanism, frame_mass * (1 + parameters(2)), 1.0_dp, [0.0_dp, 0.0_dp], c, b, &
      & self%speed * (1 + parameters(1)), error, free=[1])
    call move_alloc(frame, system)
  end subroutine member

  !> With the load Re(sum of h_k exp(i k Omega t)), h_k = D_k x_k, at the speed r sqrt(c / M).
  subroutine new_family(r, ratio, x, family, error)
    real(dp), intent(in) :: r, ratio
    complex(dp), intent(in) :: x(:)
    type(relative_family), intent(out) :: family
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    real(dp) :: a1(1 + 2 * size(x))
    complex(dp) :: a
    integer :: k

    family%speed = r * sqrt(stiffness / total)
    family%damping = 2 * ratio * sqrt(stiffness * total)
    a1 = 0
    do k = 1, size(x)
      ! h = -Omega^2 a1''
      a = dynamic(family, k) * x(k) / (k * family%speed)**2
      a1(2 * k:2 * k + 1) = [real(a), -aimag(a)]
    end do
    call new_harmonic_mechanism(family%mechanism, total - frame_mass, 0.0_dp, a1, [0.0_dp], [10.0_dp], [0.0_dp], failure)
    call check_success(error, failure)
  end subroutine new_family

  !> D_k = c - M k^2 Omega^2 + i b k Omega.
  complex(dp) function dynamic(family, k)
    type(relative_family), intent(in) :: family
    integer, intent(in) :: k

    dynamic = cmplx(stiffness - total * (k * family%speed)**2, family%damping * k * family%speed, dp)
  end function dynamic

  !> d ln(x_k) / d ln of speed, frame's mass, stiffness, damping; x_k = h_k / D_k, h_k like Omega^2.
  function slopes(family, k) result(g)
    type(relative_family), intent(in) :: family
    integer, intent(in) :: k
    complex(dp) :: g(4), i_b_omega
    real(dp) :: m_omega_2

    i_b_omega = cmplx(0.0_dp, family%damping * k * family%speed, dp)
    m_omega_2 = (k * family%speed)**2
    g = -[-2 * total * m_omega_2 + i_b_omega, cmplx(-frame_mass * m_omega_2, 0.0_dp, dp), cmplx(stiffness, 0.0_dp, dp), &
      & i_b_omega] / dynamic(family, k)
    g(1) = g(1) + 2
  end function slopes

  pure type(speed_options) function order_of(name)
    character(len=*), intent(in) :: name

    allocate(order_of%names(1), order_of%probes(0))
    order_of%names(1) = name
  end function order_of

  !> Four parameters, each evaluated at three distances on both sides, or at seven if more digits are requested than available.
  subroutine test_solutions(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tolerances(2) = [1.0e-6_dp, 1.0e-15_dp]
    type(relative_family) :: family
    type(speed_options) :: options
    type(sensitivity_base_type) :: base
    type(sensitivity_type), allocatable :: found(:)
    type(gestell_error), allocatable :: failure
    complex(dp) :: g(4)
    integer, target :: members
    integer :: i, k

    call new_family(0.6_dp, 0.1_dp, [(1.0e-3_dp, 0.0_dp)], family, error)
    if (allocated(error)) return
    family%members => members
    g = slopes(family, 1)
    options = order_of("xi")
    do i = 1, size(tolerances)
      members = 0
      options%accuracy%tolerance = tolerances(i)
      call solve_sensitivity(family, 4, options, base, found, failure)
      call check_success(error, failure)
      if (.not. allocated(error)) call check(error, members, 1 + 4 * 2 * merge(3, 7, i == 1), more="solutions")
      do k = 1, 4
        if (allocated(error)) return
        call check_that(error, abs(found(k)%slope(1, 1) - real(g(k))), "<=", found(k)%error(1, 1), "beyond the error")
      end do
      if (.not. allocated(error)) call check_that(error, [(found(k)%error(1, 1), k = 1, 4)], "<", 1.0e-6_dp, "the error")
      if (allocated(error)) return
    end do
  end subroutine test_solutions

  subroutine solve(family, name, base, found, error)
    type(relative_family), intent(in) :: family
    character(len=*), intent(in) :: name
    type(sensitivity_base_type), intent(out) :: base
    type(sensitivity_type), allocatable, intent(out) :: found(:)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call solve_sensitivity(family, 4, order_of(name), base, found, failure)
    call check_success(error, failure)
  end subroutine solve

  !> F = (c + i b Omega) x on the ground, below, at and above the resonance; peak and root of the mean square alike.
  subroutine test_closed_form(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: ratios(*) = [0.5_dp, 0.9997_dp, 1.0003_dp, 3.0_dp], dampings(*) = [0.2_dp, 1.0e-3_dp, 1.0e-5_dp]
    type(relative_family) :: family
    type(sensitivity_base_type) :: base
    type(sensitivity_type), allocatable :: found(:)
    complex(dp) :: g(4), force
    integer :: i, j, k

    do i = 1, size(ratios)
      do j = 1, size(dampings)
        call new_family(ratios(i), dampings(j), [(1.0e-3_dp, 0.0_dp)], family, error)
        if (.not. allocated(error)) call solve(family, "fx", base, found, error)
        if (allocated(error)) return
        force = cmplx(stiffness, family%damping * family%speed, dp)
        g = slopes(family, 1) + [cmplx(0.0_dp, aimag(force), dp), (0.0_dp, 0.0_dp), cmplx(stiffness, 0.0_dp, dp), &
          & cmplx(0.0_dp, aimag(force), dp)] / force
        ! Phi is accurate to 1e-12, x0 to that over |1 - rho|, 2 pi times the damping or the detuning
        call check(error, base%values(1, 1), 1.0e-3_dp * abs(force), thr=1.0e-3_dp * abs(force) * 1.0e-8_dp)
        do k = 1, 4
          if (allocated(error)) return
          ! within the claimed error, which is small: rounding over a step, which is a small part of that |1 - rho|
          call check_that(error, abs(found(k)%slope(:, 1) - real(g(k))), "<", found(k)%error(:, 1), "error exceeds its bound")
          call check_that(error, [found(k)%error], "<", 1.0e-4_dp * max(1.0_dp, maxval(abs(g))), &
            & "claimed error is too wide")
          ! with much damping the step is 1e-2, rounding 1e-13 over a few hundredths of it; no difference alone comes so far
          if (j == 1) call check_that(error, [found(k)%error], "<", 1.0e-9_dp, "not extrapolated")
          call check_that(error, found(k)%state(1), "==", "ok", "state")
        end do
        if (allocated(error)) return
      end do
    end do
  end subroutine test_closed_form

  !> cos(theta) + sin(2 theta) / 2 has equal peaks at 30 and 150 deg, positive and negative. Each depends on a parameter in its
  !> own way (envelope theorem) and the greater one counts, so the slopes differ on both sides of the machine.
  subroutine test_equal_peaks(error)
    type(error_type), allocatable, intent(out) :: error
    complex(dp), parameter :: x(2) = [(1.0e-3_dp, 0.0_dp), (0.0_dp, -0.5e-3_dp)]
    real(dp), parameter :: theta(2) = [pi / 6, 5 * pi / 6]
    type(relative_family) :: family
    type(sensitivity_base_type) :: base
    type(sensitivity_type), allocatable :: found(:)
    complex(dp) :: g(4, 2)
    real(dp) :: slope(2), mean_square
    integer :: k, i

    call new_family(0.8_dp, 0.05_dp, x, family, error)
    if (.not. allocated(error)) call solve(family, "xi", base, found, error)
    if (.not. allocated(error)) call check(error, base%values(1, 1), 0.75e-3_dp * sqrt(3.0_dp), thr=1.0e-12_dp)
    if (allocated(error)) return
    g(:, 1) = slopes(family, 1)
    g(:, 2) = slopes(family, 2)
    do k = 1, 4
      slope = [(sum([real(x(1) * g(k, 1) * exp(cmplx(0.0_dp, theta(i), dp))), real(x(2) * g(k, 2) &
        & * exp(cmplx(0.0_dp, 2 * theta(i), dp)))]) / sign(0.75e-3_dp * sqrt(3.0_dp), cos(theta(i))), i = 1, 2)]
      call check_that(error, found(k)%bend(1, 1), "==", .true., "bend")
      call check_that(error, found(k)%state(1), "==", "undecided", "state")
      ! the mean of both, except for the error due to their curvature at the smallest step, 1e-2 / 64
      if (.not. allocated(error)) call check(error, found(k)%slope(1, 1), sum(slope) / 2, thr=1.0e-3_dp * maxval(abs(slope)))
      if (.not. allocated(error)) call check(error, found(k)%error(1, 1), abs(slope(1) - slope(2)) / 2, &
        & thr=0.01_dp * abs(slope(1) - slope(2)))
      mean_square = sum(abs(x)**2 * real(g(k, :))) / sum(abs(x)**2)
      call check_that(error, abs(found(k)%slope(2, 1) - mean_square), "<", found(k)%error(2, 1), "slope of the mean square")
      call check_that(error, found(k)%bend(2, 1), "==", .false., "bend of the mean square")
      if (allocated(error)) return
    end do
  end subroutine test_equal_peaks

  !> A quantity at rest has no derivative; at an undamped resonance there is no vibration.
  subroutine test_zero_and_resonance(error)
    type(error_type), allocatable, intent(out) :: error
    type(relative_family) :: family
    type(sensitivity_base_type) :: base
    type(sensitivity_type), allocatable :: found(:)
    type(gestell_error), allocatable :: failure

    call new_family(0.8_dp, 0.05_dp, [(1.0e-3_dp, 0.0_dp)], family, error)
    if (.not. allocated(error)) call solve(family, "eta", base, found, error)
    if (.not. allocated(error)) call check_that(error, found(1)%state(1), "==", "zero", "state")
    if (allocated(error)) return
    family%damping = 0
    family%speed = sqrt(stiffness / total)
    call solve_sensitivity(family, 4, order_of("xi"), base, found, failure)
    call check_failure(error, failure)
  end subroutine test_zero_and_resonance

end module test_sensitivity
