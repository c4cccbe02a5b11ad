!> The periodic solution against closed forms, and close to a resonance.
module test_periodic
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_series_trigonometric, only: series_through
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_period_periodic_solution, only: follow, periodic_solution_type, solve_periodic
  use gestell_floquet_period_quick_motion, only: quick_motion_type, solve_quickly
  use gestell_system_corrected, only: corrected_system
  use systems, only: constant_type, scalar_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_periodic

contains

  subroutine collect_periodic(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the response with constant coefficients agrees with the transfer function", test_transfer), &
      & new_unittest("multiplier and forced solution of a scalar system agree with closed forms", test_scalar), &
      & new_unittest("an exact resonance is an error", test_resonance), &
      & new_unittest("the claimed error grows near resonance and covers the true one", test_near_resonance), &
      & new_unittest("correcting a quick solution doubles its number of digits", test_quick), &
      & new_unittest("a quick solution at resonance is refused", test_no_quick)]
  end subroutine collect_periodic

  !> q = Re [(C - W^2 M + i W B)^-1 h exp(i W t)].
  subroutine test_transfer(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: x(:, :)
    complex(dp) :: q(2)
    real(dp) :: w, t
    integer :: k
    integer, parameter :: points = 7

    system = shaken()
    call solve_monodromy(system, accuracy_type(tolerance=1.0e-12_dp), .true., monodromy, failure)
    if (.not. allocated(failure)) call solve_periodic(monodromy, solution, failure)
    if (.not. allocated(failure)) call follow(system, monodromy, solution, [(real(k, dp) / points, k = 0, points)], x, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    w = 2 * pi / system%period
    q = response(system)
    do k = 0, points
      t = system%period * k / points
      ! Condition of E - Phi is below 100 here: 1e-12 becomes at most 1e-10 of the motion's size 0.06.
      call check_that(error, maxval(abs(x(:2, k + 1) - real(q * exp(cmplx(0, w * t, dp))))), "<", 1.0e-11_dp, "displacement")
      call check_that(error, maxval(abs(x(3:, k + 1) - real(cmplx(0, w, dp) * q * exp(cmplx(0, w * t, dp))))), "<", 1.0e-10_dp, &
        & "velocity")
      if (allocated(error)) return
    end do
  end subroutine test_transfer

  !> Two degrees of freedom with constant coefficients.
  function shaken() result(system)
    type(constant_type) :: system

    system = constant_type(states=4, period=0.7_dp, m=reshape([2.0_dp, 0.3_dp, 0.3_dp, 1.0_dp], [2, 2]), &
      & b=reshape([0.2_dp, 0.1_dp, -0.1_dp, 0.3_dp], [2, 2]), c=reshape([90.0_dp, -20.0_dp, -20.0_dp, 50.0_dp], [2, 2]), &
      & amplitude=[3.0_dp, -1.0_dp])
  end function shaken

  !> (C - W^2 M + i W B)^-1 h.
  pure function response(system) result(q)
    type(constant_type), intent(in) :: system
    complex(dp) :: q(2), z(2, 2)
    real(dp) :: w

    w = 2 * pi / system%period
    z = cmplx(system%c - w**2 * system%m, w * system%b, dp)
    q = [z(2, 2) * system%amplitude(1) - z(1, 2) * system%amplitude(2), &
      & z(1, 1) * system%amplitude(2) - z(2, 1) * system%amplitude(1)] / (z(1, 1) * z(2, 2) - z(1, 2) * z(2, 1))
  end function response

  !> The motion by a quick solution, then corrected by a second one, against the transfer function. The map has a tolerance of
  !> 1e-6; the condition of E - Phi is below 100.
  subroutine test_quick(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: phases = 8
    real(dp), parameter :: rough = 1.0e-4_dp
    type(constant_type), target :: system
    type(quick_motion_type) :: motion
    complex(dp) :: q(2)
    real(dp) :: found(phases, 2), exact(phases, 2), off(2)
    logical :: fits
    integer :: k

    system = shaken()
    q = response(system)
    do k = 1, phases
      exact(k, :) = real(q * exp(cmplx(0, 2 * pi * (k - 1) / phases, dp)))
    end do
    call solve_quickly(system, phases, 1.0e-3_dp, motion, fits)
    call check(error, fits, more="the first solution")
    if (allocated(error)) return
    found = transpose(motion%x(:2, :))
    off(1) = maxval(abs(found - exact)) / maxval(abs(exact))
    call solve_quickly(corrected_system(system, series_through(found), [1, 2]), phases, 1.0e-3_dp, motion, fits)
    call check(error, fits, more="the second solution")
    if (allocated(error)) return
    off(2) = maxval(abs(found + transpose(motion%x(:2, :)) - exact)) / maxval(abs(exact))
    print "(a, 2es9.1)", "         errors of the motion, and corrected:", off
    ! Beside the square of the first error, its rounding times the condition.
    call check_that(error, off(1), ">", 1.0e-12_dp, "errors")
    call check_that(error, off(1), "<", rough, "errors")
    call check_that(error, off(2), "<", rough * off(1) + 1.0e-13_dp, "errors")
  end subroutine test_quick

  !> Undamped oscillators at twice the frequency of the excitation: no digits.
  subroutine test_no_quick(error)
    type(error_type), allocatable, intent(out) :: error
    type(quick_motion_type) :: motion
    logical :: fits

    call solve_quickly(oscillators(4.0_dp), 16, 1.0e-3_dp, motion, fits)
    call check(error, .not. fits, more="resonance must be refused")
    if (allocated(error)) return
    call solve_quickly(oscillators(3.5_dp), 16, 1.0e-3_dp, motion, fits)
    call check(error, fits, more="near resonance")
    if (allocated(error)) return
    ! q = 1 / (c - 1), and 1e-3 of it is aimed at
    call check(error, motion%x(1, 1), 1 / 2.5_dp, thr=1.0e-3_dp / 2.5_dp)
  end subroutine test_no_quick

  subroutine test_scalar(error)
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure

    call solve_monodromy(scalar_type(states=1, period=2 * pi, c=0.0_dp), accuracy_type(tolerance=1.0e-12_dp), .true., &
      & monodromy, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    ! Phi(t) = exp(sin t), so x_p(T) is the integral of exp(-sin s) exp(sin s) = T.
    call check(error, monodromy%phi(1, 1), 1.0_dp, thr=1.0e-12_dp)
    if (allocated(error)) return
    call check(error, monodromy%xp(1), 2 * pi, thr=1.0e-11_dp)
    if (allocated(error)) return

    ! x0 = integral of exp(-c s) ds / (exp(-c T) - 1) = -1 / c, at t = 0.
    call solve_monodromy(scalar_type(states=1, period=2 * pi, c=-0.5_dp), accuracy_type(tolerance=1.0e-12_dp), .true., &
      & monodromy, failure)
    if (.not. allocated(failure)) call solve_periodic(monodromy, solution, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, solution%x0(1), 2.0_dp, thr=1.0e-11_dp)
    if (allocated(error)) return
    call check_that(error, abs(solution%x0(1) - 2), "<=", solution%error(1), "claimed error holds")
  end subroutine test_scalar

  !> An undamped oscillator of exactly twice the frequency of its excitation: rho = 1.
  subroutine test_resonance(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure

    system = oscillators(4.0_dp)
    call solve_monodromy(system, accuracy_type(tolerance=1.0e-13_dp), .true., monodromy, failure)
    if (.not. allocated(failure)) call solve_periodic(monodromy, solution, failure)
    call check_failure(error, failure, "resonance")
    if (allocated(error)) return
    call check(error, failure%code, 4)
  end subroutine test_resonance

  !> Two equal undamped oscillators with stiffness c under unit load, T = 2 pi.
  function oscillators(c) result(system)
    real(dp), intent(in) :: c
    type(constant_type) :: system
    integer :: i

    system = constant_type(states=4, period=2 * pi, amplitude=[1.0_dp, 1.0_dp])
    do i = 1, 2
      system%m(i, i) = 1
      system%c(i, i) = c
    end do
  end function oscillators

  !> q = 1 / (c - 1) near c = 1: the claimed error grows with the condition and covers the true one.
  subroutine test_near_resonance(error)
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp) :: gap, exact
    integer :: i

    do i = 1, 4
      gap = 10.0_dp**(-2 * i)
      call solve_monodromy(oscillators(1 + gap), accuracy_type(tolerance=1.0e-13_dp), .true., monodromy, failure)
      if (.not. allocated(failure)) call solve_periodic(monodromy, solution, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      exact = 1 / ((1 + gap) - 1)
      call check_that(error, abs(solution%x0(1) - exact), "<=", solution%error(1), "claimed error holds")
      ! E - Phi has the smallest singular value pi gap and the largest 2 pi gap: but its norm is E's and Phi's.
      call check_that(error, solution%error(1), "<", 1.0e-10_dp * exact / gap, "claimed error is not absurd")
      if (allocated(error)) return
    end do
  end subroutine test_near_resonance

end module test_periodic
