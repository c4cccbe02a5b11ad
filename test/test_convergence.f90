!> Orders of convergence, and errors against the quadruple-precision reference.
module test_convergence
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: multipliers_type, solve_multipliers
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, solve_periodic
  use gestell_model_frame, only: frame_type
  use machines, only: frame_of_machine
  use reference_cases, only: random_machine
  use reference_frame, only: frame_of, frame_period
  use reference_linear, only: eigenvalues, qp
  use reference_machine, only: khang_machine, machine_data
  use slow_tests, only: new_slow
  use systems, only: meissner_type
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  implicit none (type, external)
  private

  public :: collect_convergence

contains

  subroutine collect_convergence(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("every method converges with its stated order", test_every_method), &
      & new_unittest("results of the paper's machine agree with its converged values", test_converged_values), &
      & new_unittest("tolerances from 1e-4 to 1e-12 are met for the paper's machine", test_tolerances), &
      & new_unittest("all methods meet tolerances with ten times the masses", test_other_methods), &
      & new_unittest("claimed errors hold for any given number of steps", test_given_steps), &
      & new_slow("claimed errors of random machines bound the true errors", test_random), &
      & new_slow("error bounds hold if one estimate is small by coincidence", test_by_chance), &
      & new_unittest("error bounds hold across a jump that was not declared", test_undeclared_jump)]
  end subroutine collect_convergence

  !> Phi(T), x_p(T) and x0 of the reference, rounded to double precision, and its multipliers.
  subroutine reference(machine, phi, xp, x0, rho)
    type(machine_data), intent(in) :: machine
    real(dp), intent(out) :: phi(6, 6), xp(6), x0(6)
    complex(dp), intent(out) :: rho(6)
    real(qp) :: phi_q(6, 6), xp_q(6), x0_q(6)
    complex(qp) :: rho_q(6)

    call frame_period(frame_of(machine), 1.0e-22_qp, phi_q, xp_q, x0_q)
    call eigenvalues(phi_q, rho_q)
    phi = real(phi_q, dp)
    xp = real(xp_q, dp)
    x0 = real(x0_q, dp)
    rho = cmplx(rho_q, kind=dp)
  end subroutine reference

  !> |D^-1 A D|, the norm of the library's claims.
  pure real(dp) function scaled_norm(a, d)
    real(dp), intent(in) :: a(:, :), d(:)

    scaled_norm = norm2(a * spread(d, 1, size(d)) / spread(d, 2, size(d)))
  end function scaled_norm

  subroutine test_every_method(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=9), parameter :: methods(13) = [character(len=9) :: "rk4", "explicit8", "magnus4", "magnus6", "gauss2", &
      & "gauss3", "gauss4", "gauss5", "gauss6", "gauss7", "gauss8", "gauss9", "gauss10"]
    integer, parameter :: order(13) = [4, 8, 4, 6, 4, 6, 8, 10, 12, 14, 16, 18, 20]
    ! Fast oscillations (82 radians) need some steps before the order shows; rounding ends it at 1e-13.
    integer, parameter :: steps(13) = [2000, 300, 400, 200, 800, 200, 100, 64, 32, 20, 16, 14, 12]
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(6, 6), xp(6), x0(6), phi_error(2), xp_error(2), higher
    complex(dp) :: rho(6)
    integer :: i, k

    machine = khang_machine(240.0_dp, 10.0_dp)
    call reference(machine, phi, xp, x0, rho)
    call frame_of_machine(machine, frame, failure)
    do i = 1, size(methods)
      do k = 1, 2
        if (.not. allocated(failure)) call solve_monodromy(frame, &
          & accuracy_type(method=trim(methods(i)), steps=steps(i) * (1 + k) / 2), .true., monodromy, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        phi_error(k) = scaled_norm(monodromy%phi - phi, monodromy%scale)
        xp_error(k) = norm2((monodromy%xp - xp) / monodromy%scale)
      end do
      ! A method fitted to the fastest vibration has almost none of its first error term, so the next order matters too.
      higher = 0
      if (monodromy%method%lower_order > 0) higher = 1
      call check(error, log(phi_error(1) / phi_error(2)) / log(1.5_dp), order(i) + higher, thr=0.1_dp * order(i) + higher, &
        & more="Phi by " // methods(i))
      if (allocated(error)) return
      call check(error, log(xp_error(1) / xp_error(2)) / log(1.5_dp), real(order(i), dp), thr=0.15_dp * order(i), &
        & more="x_p by " // methods(i))
      if (allocated(error)) return
    end do
  end subroutine test_every_method

  subroutine test_converged_values(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: rpm(2) = [240.0_dp, 360.0_dp], rho_max(2) = [0.996775_dp, 0.997849_dp]
    ! Units of the last digit given: half of one is allowed.
    real(dp), parameter :: x0(6, 2) = reshape([ &
      & 0.000223724_dp, -0.000001189_dp, -0.000728151_dp, 0.002650688_dp, -0.00002744_dp, -0.010141786_dp, &
      & 0.000500408_dp, -0.000000018_dp, -0.001633654_dp, 0.01154895_dp, -0.00019804_dp, -0.04208608_dp], [6, 2])
    real(dp), parameter :: unit(6, 2) = reshape([ &
      & 1e-9_dp, 1e-9_dp, 1e-9_dp, 1e-9_dp, 1e-8_dp, 1e-9_dp, 1e-9_dp, 1e-9_dp, 1e-9_dp, 1e-8_dp, 1e-8_dp, 1e-8_dp], [6, 2])
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    integer :: i

    do i = 1, 2
      call frame_of_machine(khang_machine(rpm(i)), frame, failure)
      if (.not. allocated(failure)) call solve_monodromy(frame, accuracy_type(), .true., monodromy, failure)
      if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., multipliers, failure)
      if (.not. allocated(failure)) call solve_periodic(monodromy, solution, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, abs(solution%x0 - x0(:, i)), "<=", unit(:, i) / 2, "x0")
      if (allocated(error)) return
      call check(error, abs(multipliers%rho(1)), rho_max(i), thr=0.5e-6_dp)
      if (allocated(error)) return
      call check(error, multipliers%verdict(), "stable")
      if (allocated(error)) return
    end do
  end subroutine test_converged_values

  !> Solves to a tolerance and compares all claims with the truth. `needed`: the tolerance that must be met.
  subroutine check_claims(frame, accuracy, phi, xp, x0, rho, needed, label, error)
    type(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in) :: phi(6, 6), xp(6), x0(6), needed
    complex(dp), intent(in) :: rho(6)
    character(len=*), intent(in) :: label
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp) :: true_error
    integer :: k

    call solve_monodromy(frame, accuracy, .true., monodromy, failure)
    if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., multipliers, failure)
    if (allocated(failure)) then
      call test_failed(error, label // ": " // failure%message)
      return
    end if
    true_error = scaled_norm(monodromy%phi - phi, monodromy%scale)
    call check_that(error, true_error, "<=", monodromy%error, label // ": claimed error of Phi")
    call check_that(error, true_error, "<=", max(needed * monodromy%norm, monodromy%roundoff), label // ": tolerance")
    call check_that(error, norm2((monodromy%xp - xp) / monodromy%scale), "<=", monodromy%xp_error, label &
      & // ": claimed error of x_p")
    if (allocated(error)) return
    do k = 1, 6
      call check_that(error, minval(abs(rho - multipliers%rho(k))) / abs(multipliers%rho(k)), "<=", multipliers%error(k), label &
        & // ": claimed error of a multiplier")
      if (allocated(error)) return
    end do
    if (multipliers%verdict() == "stable") call check_that(error, maxval(abs(rho)), "<=", 1.0_dp, label // ": false stable")
    if (multipliers%verdict() == "unstable") call check_that(error, maxval(abs(rho)), ">", 1.0_dp, label // ": false unstable")
    if (allocated(error)) return

    call solve_periodic(monodromy, solution, failure)
    if (allocated(failure)) return
    call check_that(error, abs(solution%x0 - x0), "<=", solution%error, label // ": claimed error of x0")
  end subroutine check_claims

  subroutine test_tolerances(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tolerance(5) = [1e-2_dp, 1e-4_dp, 1e-6_dp, 1e-9_dp, 1e-12_dp], rpm(2) = [240.0_dp, 360.0_dp]
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(6, 6), xp(6), x0(6)
    complex(dp) :: rho(6)
    integer :: i, k

    do i = 1, 2
      call reference(khang_machine(rpm(i)), phi, xp, x0, rho)
      call frame_of_machine(khang_machine(rpm(i)), frame, failure)
      do k = 1, size(tolerance)
        call check_claims(frame, accuracy_type(tolerance=tolerance(k)), phi, xp, x0, rho, tolerance(k), "gauss6", error)
        if (allocated(error)) return
      end do
      ! A tolerance below the limit of double precision: only the claim must hold.
      call check_claims(frame, accuracy_type(tolerance=1e-15_dp), phi, xp, x0, rho, 1e-15_dp, "to the floor", error)
      if (allocated(error)) return
    end do
  end subroutine test_tolerances

  subroutine test_other_methods(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=9), parameter :: methods(9) = [character(len=9) :: "rk4", "explicit8", "magnus4", "magnus6", "gauss2", &
      & "gauss3", "gauss4", "gauss8", "gauss10"]
    real(dp), parameter :: tolerance(3) = [1e-3_dp, 1e-6_dp, 1e-8_dp]
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(6, 6), xp(6), x0(6)
    complex(dp) :: rho(6)
    integer :: i, k

    machine = khang_machine(300.0_dp, 10.0_dp)
    call reference(machine, phi, xp, x0, rho)
    call frame_of_machine(machine, frame, failure)
    do i = 1, size(methods)
      do k = 1, size(tolerance)
        call check_claims(frame, accuracy_type(tolerance=tolerance(k), method=trim(methods(i))), phi, xp, x0, rho, &
          & tolerance(k), methods(i), error)
        if (allocated(error)) return
      end do
    end do
  end subroutine test_other_methods

  !> Claims hold for any number of steps; with too few steps nothing is certain.
  subroutine test_given_steps(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: steps(6) = [1, 2, 5, 12, 30, 75]
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(6, 6), xp(6), x0(6)
    complex(dp) :: rho(6)
    integer :: i

    call reference(khang_machine(360.0_dp), phi, xp, x0, rho)
    call frame_of_machine(khang_machine(360.0_dp), frame, failure)
    do i = 1, size(steps)
      call check_claims(frame, accuracy_type(steps=steps(i)), phi, xp, x0, rho, 1.0e30_dp, "gauss6", error)
      if (allocated(error)) return
      call check_claims(frame, accuracy_type(steps=8 * steps(i), method="rk4"), phi, xp, x0, rho, 1.0e30_dp, "rk4", error)
      if (allocated(error)) return
    end do
  end subroutine test_given_steps

  subroutine test_random(error)
    type(error_type), allocatable, intent(out) :: error
    ! The last eight are unstable over the generator's whole range of speeds.
    integer, parameter :: numbers(32) = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, &
      & 240, 261, 448, 499, 523, 554, 669, 922]
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(6, 6), xp(6), x0(6), tolerance
    complex(dp) :: rho(6)
    character(len=24) :: label
    integer :: i

    do i = 1, size(numbers)
      machine = random_machine(numbers(i))
      call reference(machine, phi, xp, x0, rho)
      call frame_of_machine(machine, frame, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      tolerance = 10.0_dp**(-3 - modulo(i, 10))
      write (label, "(a, i0, a, es8.1)") "machine ", numbers(i), " to", tolerance
      call check_claims(frame, accuracy_type(tolerance=tolerance), phi, xp, x0, rho, tolerance, trim(label), error)
      if (allocated(error)) return
    end do
  end subroutine test_random

  !> Machines whose x_p is accurate by coincidence with the second number of steps: its difference from the third is small, the
  !> error of the third is not.
  subroutine test_by_chance(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(6, 6), xp(6), x0(6)
    complex(dp) :: rho(6)
    integer, parameter :: numbers(5) = [17, 4, 11, 12, 5]
    character(len=6), parameter :: methods(5) = ["gauss4", "gauss5", "gauss4", "gauss7", "gauss7"]
    integer :: i

    do i = 1, size(numbers)
      machine = random_machine(numbers(i), 1.0_dp, 60.0_dp)
      if (i > 1) machine%foundation_damping = machine%foundation_damping &
        & + [300.0_dp, 600.0_dp, 300.0_dp] * machine%frame_mass
      call reference(machine, phi, xp, x0, rho)
      call frame_of_machine(machine, frame, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_claims(frame, accuracy_type(tolerance=1.0e-8_dp, method=methods(i)), phi, xp, x0, rho, 1.0e-8_dp, &
        & methods(i), error)
      if (allocated(error)) return
    end do
  end subroutine test_by_chance

  !> Meissner's equation with an undeclared jump: methods converge with order 1, and the claimed errors must reflect this. Trace
  !> of Phi from the closed form, y(T) of two harmonic pieces with frequencies sqrt(a - 2 q) and sqrt(a + 2 q).
  subroutine test_undeclared_jump(error)
    type(error_type), allocatable, intent(out) :: error
    type(meissner_type) :: system
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: trace, w(2), c(2), s(2)
    integer :: i, wrong

    wrong = 0
    do i = 1, 60
      system = meissner_type(states=2, period=pi, a=0.5_dp + 0.02_dp * i, q=0.1_dp)
      w = sqrt(system%a + [-0.2_dp, 0.2_dp])
      c = cos(w * [pi / 3, 2 * pi / 3])
      s = sin(w * [pi / 3, 2 * pi / 3])
      trace = 2 * c(1) * c(2) - (w(1) / w(2) + w(2) / w(1)) * s(1) * s(2)
      call solve_monodromy(system, accuracy_type(tolerance=1.0e-3_dp, method="gauss2"), .false., monodromy, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      ! The trace is off by at most sqrt(2) times the norm of the error.
      if (abs(monodromy%phi(1, 1) + monodromy%phi(2, 2) - trace) > sqrt(2.0_dp) * monodromy%error) wrong = wrong + 1
    end do
    ! Whether the jump falls within a step is a matter of chance: an estimate from three solutions may miss it occasionally.
    call check_that(error, wrong, "<=", 3, "wrong estimates")
  end subroutine test_undeclared_jump

end module test_convergence
