!> The reference without integration, against the integrating one, closed forms, and its own second route.
module test_hill
  use checks, only: check_that
  use reference_cases, only: random_machine
  use reference_flow, only: flow_map, flow_system, periodic_start, system_of
  use reference_frame, only: frame_of
  use reference_hill, only: hill_solution, solve_hill
  use reference_linear, only: eigenvalues, qp
  use reference_machine, only: dp, khang_machine, machine_data, period, pi_qp
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_hill

contains

  subroutine collect_hill(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_slow("Hill's determinant agrees with the integrated reference", test_flow), &
      & new_slow("Hill's determinant agrees with the integrated reference on random machines", test_random), &
      & new_slow("Hill's determinant and the Riccati equation agree at slow speeds", test_routes), &
      & new_unittest("the reference's results for constant coefficients agree with closed forms", test_constant), &
      & new_unittest("the reference finds Colaneri's exponents 0 and -24", test_colaneri), &
      & new_unittest("the reference finds the published exponent of Mathieu's equation", test_mathieu), &
      & new_unittest("the reference is visibly inaccurate if the coefficients jump", test_jumping_coefficients)]
  end subroutine collect_hill

  !> Largest distance of ln(rho), taken in their common order, imaginary parts modulo 2 pi.
  pure function distance(a, b)
    complex(qp), intent(in) :: a(:), b(:)
    real(qp) :: distance
    complex(qp) :: d(size(a))

    d = a - b
    d = cmplx(real(d), aimag(d) - 2*pi_qp*anint(aimag(d)/(2*pi_qp)), qp)
    distance = maxval(abs(d))
  end function distance

  subroutine compare(error, system, time, tolerance, allowed, more)
    type(error_type), allocatable, intent(out) :: error
    class(flow_system), intent(in) :: system
    real(qp), intent(in) :: time, tolerance, allowed
    character(len=*), intent(in) :: more
    type(hill_solution) :: hill
    real(qp) :: phi(system%n, system%n), particular(system%n), x0(system%n)
    complex(qp) :: rho(system%n)

    call solve_hill(system, time, hill)
    call check(error, size(hill%log_rho), system%n, more=more)
    if (allocated(error)) return
    call check(error, allocated(hill%x0), more=more // ": x0")
    if (allocated(error)) return
    call flow_map(system, 0.0_qp, time, tolerance, phi, particular)
    call eigenvalues(phi, rho)
    x0 = periodic_start(phi, particular)
    call check_that(error, distance(hill%log_rho, log(rho)), "<=", allowed, more // ": ln(rho)")
    call check_that(error, maxval(abs(hill%x0 - x0)), "<=", allowed*maxval(abs(x0)), more // ": x0")
  end subroutine compare

  subroutine test_flow(error)
    type(error_type), allocatable, intent(out) :: error
    ! The integration takes longest at slow speeds, for which Riccati's equation checks Hill's determinant (`test_routes`).
    real(dp), parameter :: rpm(3) = [360.0_dp, -1300.0_dp, 100000.0_dp]
    type(machine_data) :: machine
    character(len=12) :: name
    integer :: i

    do i = 1, size(rpm)
      machine = khang_machine(rpm(i))
      write (name, '(i0, a)') nint(rpm(i)), ' rpm'
      ! The integration is good to its tolerance, times some 100 steps and the conditions of the results.
      call compare(error, frame_of(machine), period(machine), 1.0e-24_qp, 1.0e-20_qp, trim(name))
      if (allocated(error)) return
    end do
  end subroutine test_flow

  subroutine test_random(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    character(len=12) :: name
    integer :: i

    do i = 1, 4
      machine = random_machine(i, 1.0_dp, 20.0_dp)
      write (name, '(a, i0)') 'machine ', i
      call compare(error, frame_of(machine), period(machine), 1.0e-20_qp, 1.0e-14_qp, trim(name))
      if (allocated(error)) return
    end do
  end subroutine test_random

  !> Hill's determinant and the Riccati equation share the table of the coefficients, but neither unknowns nor equations.
  subroutine test_routes(error)
    type(error_type), allocatable, intent(out) :: error
    type(hill_solution) :: direct, followed
    type(machine_data) :: machine

    machine = khang_machine(20.0_dp)
    call solve_hill(frame_of(machine), period(machine), direct, 'direct')
    call solve_hill(frame_of(machine), period(machine), followed, 'followed')
    call check_that(error, size(direct%log_rho), "==", 6, "exponents, direct")
    call check_that(error, size(followed%log_rho), "==", 6, "exponents, followed")
    call check_that(error, max(direct%change_rho, followed%change_rho), "<=", 1.0e-22_qp, "change")
    ! 1e-22 each, and the rounding of 2 pi lambda.
    call check_that(error, distance(direct%log_rho, followed%log_rho), "<=", 1.0e-21_qp, "distance")
    call check_that(error, max(direct%liouville, followed%liouville), "<=", 1.0e-25_qp, "Liouville's defect")
  end subroutine test_routes

  subroutine test_constant(error)
    type(error_type), allocatable, intent(out) :: error
    type(hill_solution) :: hill

    ! lambda = -1/2 +- 50 i, ln(rho) = lambda T; x = (1/a, 0) for a constant force 1 on a spring a = 2500.25
    call solve_hill(system_of(2, oscillator), 7.0_qp, hill)
    call check(error, size(hill%log_rho), 2)
    if (allocated(error)) return
    call check_that(error, min(distance(hill%log_rho, [(-3.5_qp, 350.0_qp), (-3.5_qp, -350.0_qp)]), &
      & distance(hill%log_rho, [(-3.5_qp, -350.0_qp), (-3.5_qp, 350.0_qp)])), "<=", 1.0e-28_qp, "exponents in either order")
    if (allocated(error)) return
    call check(error, allocated(hill%x0), more="no x0")
    if (allocated(error)) return
    call check_that(error, abs(hill%x0(1) - 1/2500.25_qp), "<=", 1.0e-33_qp, "displacement")
    call check_that(error, abs(hill%x0(2)), "<=", 1.0e-30_qp, "velocity")
  end subroutine test_constant

  subroutine test_colaneri(error)
    type(error_type), allocatable, intent(out) :: error
    type(hill_solution) :: hill

    call solve_hill(system_of(2, colaneri), 2*pi_qp, hill)
    call check(error, size(hill%log_rho), 2)
    if (allocated(error)) return
    call check_that(error, distance(hill%log_rho, [(0.0_qp, 0.0_qp), (-48.0_qp, 0.0_qp)*pi_qp]), "<=", 1.0e-22_qp, "exponents")
  end subroutine test_colaneri

  !> x'' + (1 - 0.4 cos 2 t) x = 0: exponent 0.0995364372755138 + i.
  subroutine test_mathieu(error)
    type(error_type), allocatable, intent(out) :: error
    type(hill_solution) :: hill

    call solve_hill(system_of(2, mathieu), pi_qp, hill)
    call check(error, size(hill%log_rho), 2)
    if (allocated(error)) return
    ! All printed digits.
    call check_that(error, abs(real(hill%log_rho(1))/pi_qp - 0.0995364372755138_qp), "<=", 1.0e-15_qp, "known exponent")
    call check_that(error, abs(real(sum(hill%log_rho))), "<=", 1.0e-25_qp, "sum of exponents")
  end subroutine test_mathieu

  !> Coefficients that jump are no trigonometric polynomials.
  subroutine test_jumping_coefficients(error)
    type(error_type), allocatable, intent(out) :: error
    type(hill_solution) :: hill

    call solve_hill(system_of(2, meissner), 2*pi_qp, hill)
    call check_that(error, hill%change_rho, ">", 1.0e-6_qp, "change")
  end subroutine test_jumping_coefficients

  subroutine oscillator(n, t, p, f)
    integer, intent(in) :: n
    real(qp), intent(in) :: t
    real(qp), intent(out) :: p(n, n), f(n)

    associate (unused => t)
    end associate
    p = reshape([0.0_qp, -2500.25_qp, 1.0_qp, -1.0_qp], [2, 2])
    f = [0.0_qp, 1.0_qp]
  end subroutine oscillator

  subroutine colaneri(n, t, p, f)
    integer, intent(in) :: n
    real(qp), intent(in) :: t
    real(qp), intent(out) :: p(n, n), f(n)

    p = reshape([0.0_qp, -10*cos(t), 1.0_qp, -24 - 10*sin(t)], [2, 2])
    f = 0
  end subroutine colaneri

  subroutine mathieu(n, t, p, f)
    integer, intent(in) :: n
    real(qp), intent(in) :: t
    real(qp), intent(out) :: p(n, n), f(n)

    p = reshape([0.0_qp, -1 + 0.4_qp*cos(2*t), 1.0_qp, 0.0_qp], [2, 2])
    f = 0
  end subroutine mathieu

  subroutine meissner(n, t, p, f)
    integer, intent(in) :: n
    real(qp), intent(in) :: t
    real(qp), intent(out) :: p(n, n), f(n)

    p = reshape([0.0_qp, merge(-2.0_qp, -0.5_qp, t < pi_qp), 1.0_qp, -0.1_qp], [2, 2])
    f = 0
  end subroutine meissner

end module test_hill
