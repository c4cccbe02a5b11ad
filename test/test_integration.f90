!> Single steps, the predicted effort, and that claimed errors stay within the requested tolerance.
module test_integration
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_period_map, only: period_map, trajectory
  use gestell_floquet_integrator_method, only: method_type, name_length
  use gestell_floquet_choice_methods, only: method_names, new_method
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_period_periodic_solution, only: follow, periodic_solution_type, solve_periodic
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  use systems, only: constant_type, diagonal, mathieu_type, meissner_type, scalar_type, vinograd_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
  implicit none (type, external)
  private

  public :: collect_integration

  !> x' = f alone.
  type, extends(periodic_system) :: quadrature_type
  contains
    procedure :: matrix => quadrature_matrix
    procedure :: forcing => quadrature_forcing
  end type quadrature_type

  !> q'' + q = 0, without a declared load.
  type, extends(second_order_system) :: unloaded_type
  contains
    procedure :: matrices => unloaded_matrices
  end type unloaded_type

contains

  subroutine collect_integration(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("predicted numbers of steps and evaluations equal those carried out", test_steps), &
      & new_unittest("claimed errors never exceed the requested tolerance", test_requested_tolerance), &
      & new_unittest("results do not depend on the unit of time", test_units), &
      & new_unittest("a step of rk4 equals its four-slope formula", test_runge_kutta), &
      & new_unittest("the maximum within the period and the trace survive uneven steps", test_mid_period), &
      & new_unittest("the weight of rounding errors in mid-turn agrees with the closed form", test_mid_turn), &
      & new_unittest("every listed method name creates a method", test_names), &
      & new_unittest("a body without mass is an error", test_massless), &
      & new_unittest("overflow within the period is an error", test_overflow)]
  end subroutine collect_integration

  subroutine unloaded_matrices(self, t, m, b, c)
    class(unloaded_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    associate (unused_self => self, unused_time => t)
    end associate
    m = 1
    b = 0
    c = 1
  end subroutine unloaded_matrices

  subroutine quadrature_matrix(self, t, p)
    class(quadrature_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    associate (unused_self => self, unused_time => t)
    end associate
    p = 0
  end subroutine quadrature_matrix

  subroutine quadrature_forcing(self, t, f)
    class(quadrature_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    associate (unused => self)
    end associate
    f = exp(2 * sin(t)) * exp(sin(7 * t))
  end subroutine quadrature_forcing

  !> The predicted effort equals the actual one, and no effort is spent on forcing if there is none.
  subroutine test_steps(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    type(scalar_type) :: jump
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: x(:, :)

    system = constant_type(states=2, period=1.0_dp, m=diagonal([1.0_dp, 1.0_dp]), c=diagonal([1.0_dp, 1.0_dp]))
    system%states = 4
    system%least_steps = 100
    call solve_monodromy(system, accuracy_type(tolerance=1.0e-3_dp), .false., monodromy, failure)
    ! As many nodes as so many steps with six stages have.
    call check_that(error, monodromy%steps * monodromy%method%stages, ">=", 600, "nodes of the least steps")
    if (allocated(error)) return
    system%least_steps = 8
    call solve_monodromy(system, accuracy_type(steps=5, method="gauss3"), .false., monodromy, failure)
    call check(error, monodromy%steps, 5)
    if (allocated(error)) return
    ! 2, 5 and 10 steps, three stages.
    call check(error, monodromy%evaluations, 51)
    if (allocated(error)) return
    ! A segment between breaks has a step at least: 5 become 6.
    jump = scalar_type(states=1, period=2.0_dp, breaks=[0.2_dp, 0.3_dp], c=-1.0_dp)
    call solve_monodromy(jump, accuracy_type(steps=1, method="gauss2"), .false., monodromy, failure)
    call check(error, monodromy%steps, 3, more="steps between breaks")
    if (allocated(error)) return
    call solve_monodromy(system, accuracy_type(steps=4194305), .false., monodromy, failure)
    call check_failure(error, failure, what="too many steps")
    if (allocated(error)) return

    call solve_monodromy(system, accuracy_type(), .true., monodromy, failure)
    call check(error, maxval(abs(monodromy%xp)), 0.0_dp, more="second order, no load")
    if (allocated(error)) return
    call check(error, monodromy%xp_error, 0.0_dp)
    if (allocated(error)) return
    call solve_periodic(monodromy, solution, failure)
    call check(error, maxval(abs(solution%x0)), 0.0_dp)
    if (allocated(error)) return
    call check(error, maxval(abs(solution%error)), 0.0_dp)
    if (allocated(error)) return
    call follow(system, monodromy, solution, [0.0_dp, 0.5_dp], x, failure)
    call check(error, maxval(abs(x)), 0.0_dp)
    if (allocated(error)) return
    call solve_monodromy(unloaded_type(states=2, period=1.0_dp), accuracy_type(), .true., monodromy, failure)
    call check(error, maxval(abs(monodromy%xp)), 0.0_dp, more="second order, load by default")
    if (allocated(error)) return
    call solve_monodromy(meissner_type(states=2, period=3.0_dp), accuracy_type(steps=10), .true., monodromy, failure)
    call check(error, maxval(abs(monodromy%xp)), 0.0_dp, more="first order, forcing by default")
  end subroutine test_steps

  !> x' = f: Phi = E is exact at once, x_p(T) needs more steps. The claimed error stays within the requested tolerance, here and
  !> for Mathieu's equation, for many tolerances.
  subroutine test_requested_tolerance(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=6), parameter :: methods(4) = [character(len=6) :: "rk4", "gauss2", "gauss3", "gauss6"]
    integer, parameter :: order(4) = [4, 4, 6, 12], stages(4) = [2, 2, 3, 6], points = 4000
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: tolerance, sum_of_samples, f(1)
    integer :: i, k

    ! The trapezoidal rule converges exponentially for periodic functions.
    sum_of_samples = 0
    do k = 1, points
      call quadrature_forcing(quadrature_type(), 2 * pi * k / points, f)
      sum_of_samples = sum_of_samples + f(1) * 2 * pi / points
    end do
    do i = 1, size(methods)
      call solve_monodromy(quadrature_type(states=1, period=2 * pi), accuracy_type(tolerance=1.0e-8_dp, method=trim(methods(i))), &
        & .true., monodromy, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, abs(monodromy%xp(1) - sum_of_samples), "<=", monodromy%xp_error, methods(i) // ": claim")
      call check_that(error, monodromy%xp_error, "<=", 1.0e-8_dp * sum_of_samples, methods(i) // ": order")
      if (allocated(error)) return
      call check(error, monodromy%method%name, trim(methods(i)))
      if (allocated(error)) return
      call check(error, monodromy%method%order, order(i))
      if (allocated(error)) return
      call check(error, monodromy%method%stages, stages(i))
      if (allocated(error)) return
      call solve_monodromy(mathieu_type(states=2, period=pi, a=30.0_dp, q=4.0_dp), accuracy_type(steps=60, method="gauss6"), &
        & .false., monodromy, failure)
      ! Those of two states and six stages in each of sixty steps, and of 19 radians: 520 at most.
      call check_that(error, monodromy%roundoff, "<=", 1.2e-13_dp * monodromy%norm, "roundoff")
      if (allocated(error)) return
      ! exp(-10 pi): tolerance and claimed error are relative to Phi.
      call solve_monodromy(scalar_type(states=1, period=2 * pi, c=-5.0_dp), accuracy_type(tolerance=1.0e-8_dp, &
        & method=trim(methods(i))), .false., monodromy, failure)
      call check_that(error, abs(monodromy%phi(1, 1) - exp(-10 * pi)), "<=", monodromy%error, methods(i) // ": damped")
      call check_that(error, monodromy%error, "<=", 1.0e-8_dp * exp(-10 * pi), methods(i) // ": damped")
      if (allocated(error)) return
      do k = 4, 36
        tolerance = 10.0_dp**(-k / 4.0_dp)
        call solve_monodromy(mathieu_type(states=2, period=pi, a=30.0_dp, q=4.0_dp, d=0.1_dp, h=1.0_dp), &
          & accuracy_type(tolerance=tolerance, method=trim(methods(i))), .true., monodromy, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        ! Ten times the evaluations of the finest solution are too many.
        call check_that(error, monodromy%error, "<=", tolerance * monodromy%norm, methods(i) // ": ordered")
        call check_that(error, monodromy%evaluations, "<=", 10 * monodromy%steps * stages(i), methods(i) // ": ordered")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_requested_tolerance

  !> Changing the unit of time changes only the units of the results.
  subroutine test_units(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    type(monodromy_type) :: here, there
    type(gestell_error), allocatable :: failure
    real(dp) :: unit
    integer :: i

    system = constant_type(states=4, period=1.0_dp, m=diagonal([1.0_dp, 2.0_dp]), b=diagonal([0.5_dp, 0.25_dp]), &
      & c=diagonal([200.0_dp, 900.0_dp]), amplitude=[1.0_dp, 1.0_dp])
    call solve_monodromy(system, accuracy_type(), .true., here, failure)
    do i = -1, 1, 2
      unit = 2.0_dp**(20 * i)
      system%period = unit
      system%b = diagonal([0.5_dp, 0.25_dp]) / unit
      system%c = diagonal([200.0_dp, 900.0_dp]) / unit**2
      if (.not. allocated(failure)) call solve_monodromy(system, accuracy_type(), .true., there, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check(error, there%steps, here%steps)
      if (allocated(error)) return
      call check(error, maxval(abs(there%phi(:2, :2) - here%phi(:2, :2)) + abs(there%phi(3:, :2) * unit - here%phi(3:, :2))), &
        & 0.0_dp)
      if (allocated(error)) return
    end do
  end subroutine test_units

  !> One step of the classical method, by its four slopes.
  subroutine test_runge_kutta(error)
    type(error_type), allocatable, intent(out) :: error
    type(vinograd_type) :: system
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: from = 0.2_dp, to = 0.45_dp
    real(dp) :: a(1, 2, 2), forced_map(1, 1, 2), h
    integer :: i

    system = vinograd_type(states=2, period=2.0_dp)
    h = (to - from) * system%period
    call new_method("rk4", method, failure)
    call method%maps(system, [from], [to], a, failure)
    do i = 1, 2
      ! The ends of the step are taken 2e-15 inside, times derivatives of some hundred.
      call check_that(error, maxval(abs(a(1, :, i) - stepped(merge([1.0_dp, 0.0_dp], [0.0_dp, 1.0_dp], i == 1)))), "<", &
        & 1.0e-11_dp, "columns of the step")
      if (allocated(error)) return
    end do
    call method%maps(scalar_type(states=1, period=2.0_dp, c=1.0_dp), [from], [to], forced_map, failure)
    call check(error, forced_map(1, 1, 2), forced(), thr=1.0e-13_dp)

  contains

    function slope(t, x)
      real(dp), intent(in) :: t, x(2)
      real(dp) :: slope(2), p(2, 2)

      call system%matrix(t, p)
      slope = matmul(p, x)
    end function slope

    function stepped(x) result(next)
      real(dp), intent(in) :: x(2)
      real(dp) :: next(2), k(2, 4), t

      t = from * system%period
      k(:, 1) = slope(t, x)
      k(:, 2) = slope(t + h / 2, x + h / 2 * k(:, 1))
      k(:, 3) = slope(t + h / 2, x + h / 2 * k(:, 2))
      k(:, 4) = slope(t + h, x + h * k(:, 3))
      next = x + h / 6 * (k(:, 1) + 2 * k(:, 2) + 2 * k(:, 3) + k(:, 4))
    end function stepped

    !> x' = (1 + cos t) x + exp(sin t) from 0.
    real(dp) function forced()
      real(dp) :: k(4), t

      t = from * system%period
      k(1) = exp(sin(t))
      k(2) = (1 + cos(t + h / 2)) * h / 2 * k(1) + exp(sin(t + h / 2))
      k(3) = (1 + cos(t + h / 2)) * h / 2 * k(2) + exp(sin(t + h / 2))
      k(4) = (1 + cos(t + h)) * h * k(3) + exp(sin(t + h))
      forced = h / 6 * (k(1) + 2 * k(2) + 2 * k(3) + k(4))
    end function forced

  end subroutine test_runge_kutta

  !> The maximum of x_p within the period, in balanced units, is not its last value; the trace is integrated in uneven steps
  !> too.
  subroutine test_mid_period(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: nodes(9) = [0.0_dp, 0.1_dp, 0.25_dp, 0.4_dp, 0.5_dp, 0.6_dp, 0.7_dp, 0.9_dp, 1.0_dp]
    real(dp), parameter :: scale(4) = [1.0_dp, 0.5_dp, 32.0_dp, 64.0_dp]
    type(constant_type) :: system
    class(method_type), allocatable :: method
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    type(scalar_type) :: jumping
    real(dp) :: phi(4, 4), xp(4), x(4, 9), reach, defect

    system = constant_type(states=4, period=1.0_dp, m=diagonal([1.0_dp, 2.0_dp]), b=diagonal([0.5_dp, 0.25_dp]), &
      & c=diagonal([90.0_dp, 60.0_dp]), amplitude=[1.0_dp, 1.0_dp])
    call new_method("gauss3", method, failure)
    call period_map(system, method, nodes, scale, phi, failure, xp, reach)
    call trajectory(system, method, nodes, [0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp], nodes, x, failure)
    call check_that(error, maxval(abs(x(:, 9) - xp)), "<", 1.0e-15_dp, "end of the period")
    if (allocated(error)) return
    call check(error, reach, maxval(norm2(x / spread(scale, 2, 9), dim=1)), thr=1.0e-15_dp)
    if (allocated(error)) return
    call check_that(error, reach, ">", 1.1_dp * norm2(xp / scale), "the maximum is not at the end")
    if (allocated(error)) return

    jumping = scalar_type(states=1, period=2 * pi, breaks=[1.0_dp], c=-0.5_dp)
    call solve_monodromy(jumping, accuracy_type(steps=20), .false., monodromy, failure)
    call monodromy%liouville_defect(jumping, defect, failure)
    ! Gauss' rule of order 8 with steps of 0.3: 1e-10.
    call check(error, defect, 0.0_dp, thr=1.0e-9_dp)
  end subroutine test_mid_period

  !> At critical damping, d = B / 2, Phi(t) = exp(-tau) [1 + tau, tau; -tau, 1 - tau] over the velocity d, tau = d t, of the norm
  !> exp(-tau) sqrt(2 + 4 tau^2): a rounding in mid-turn, tau = a, counts |Phi(T / 2)|^2 / (sqrt 2 |Phi(T)|), 7.1 times.
  subroutine test_mid_turn(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: a = 10
    type(constant_type) :: system
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(4, 4), growth
    integer :: k

    ! Two alike, x and v of each.
    system = constant_type(states=4, period=1.0_dp, m=diagonal([1.0_dp, 1.0_dp]), b=diagonal([4 * a, 4 * a]), &
      & c=diagonal([4 * a**2, 4 * a**2]), amplitude=[0.0_dp, 0.0_dp])
    call new_method("gauss8", method, failure)
    if (.not. allocated(failure)) call period_map(system, method, [(k / 40.0_dp, k = 0, 40)], &
      & [1.0_dp, 1.0_dp, 2 * a, 2 * a], phi, failure, transient_growth=growth)
    call check_success(error, failure)
    if (allocated(error)) return
    ! The inverse of Phi(T / 2) has a condition of 400.
    call check(error, growth, (2 + 4 * a**2) / (sqrt(2.0_dp) * sqrt(2 + 16 * a**2)), thr=1.0e-9_dp)
  end subroutine test_mid_turn

  subroutine test_names(error)
    type(error_type), allocatable, intent(out) :: error
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    type(accuracy_type) :: accuracy
    character(len=name_length), allocatable :: names(:)
    integer :: i

    allocate(names, source=method_names())
    call check(error, size(names), 14)
    if (allocated(error)) return
    do i = 1, size(names)
      call new_method(trim(names(i)), method, failure)
      call check_success(error, failure, names(i))
      if (allocated(error)) return
    end do
    call check(error, accuracy%tolerance, 1.0e-9_dp, thr=0.0_dp, more="default tolerance of the manual")
  end subroutine test_names

  subroutine test_massless(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure

    system = constant_type(states=4, period=1.0_dp, m=diagonal([1.0_dp, 0.0_dp]), c=diagonal([1.0_dp, 1.0_dp]))
    call solve_monodromy(system, accuracy_type(), .false., monodromy, failure)
    call check_failure(error, failure, "mass matrix is singular")
  end subroutine test_massless

  !> exp(1600) overflows, which is reported as an error. The overflow is intended: traps are off.
  subroutine test_overflow(error)
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    logical :: traps(size(ieee_usual))

    call ieee_get_halting_mode(ieee_usual, traps)
    call ieee_set_halting_mode(ieee_usual, .false.)
    call solve_monodromy(scalar_type(states=1, period=1.0_dp, c=1600.0_dp), accuracy_type(method="gauss2", steps=1600), .false., &
      & monodromy, failure)
    call ieee_set_flag(ieee_usual, .false.)
    call ieee_set_halting_mode(ieee_usual, traps)
    call check_failure(error, failure, "overflows double precision")
  end subroutine test_overflow

end module test_integration
