!> The periodic motion by harmonic balance: manufactured solutions, the trajectories of the same machine, spectral convergence, and
!> cases in which it must decline.
module test_balanced_motion
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_balance_coupled_harmonics, only: coupled_type, couple_harmonics
  use gestell_floquet_balance_harmonic_balance, only: balance_to_rounding, balance_type
  use gestell_floquet_balance_periodic_motion, only: motion_type, solve_motion
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_floquet_solution, only: balance_motion, balanced_motion_type, bound_motion_errors, floquet_type, follow, &
    & solve_floquet, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_system_second_order, only: second_order_system
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_balanced_motion

  !> Two coupled oscillators with periodic coefficients, and a load under which q(theta) of `exact_motion` is the periodic motion
  type, extends(second_order_system) :: manufactured
    !> `stiffness`: mean stiffness, in units of the crank speed squared. `damping`: mean damping. `variation`: amplitude of the
    !> variations of mass, damping and stiffness. `width`: the harmonics of the motion fall like exp(-k width). `hidden`: amplitude
    !> of an additional load of order `order`
    real(dp) :: stiffness = 20, damping = 0.1_dp, variation = 0.3_dp, width = 1, hidden = 0
    integer :: order = 48
  contains
    procedure :: matrices => manufactured_matrices, load => manufactured_load
  end type manufactured

  !> Linear congruential generator of Park and Miller.
  integer, parameter :: long = selected_int_kind(12)

contains

  subroutine collect_balanced_motion(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("manufactured motions lie within their bounds, which are not too wide", test_manufactured), &
      & new_unittest("the motion and the trajectories of a machine agree within their bounds", test_trajectories), &
      & new_unittest("the error falls exponentially with the number of phases", test_convergence), &
      & new_unittest("a load that the phases do not see is detected between them", test_hidden_load), &
      & new_unittest("motions are integrated where harmonic balance does not apply", test_declined), &
      & new_unittest("neighbouring harmonics are solved exactly", test_coupled), &
      & new_unittest("the maps of the segments multiply to Phi(T)", test_segments)]
  end subroutine collect_balanced_motion

  !> q(theta) and its first two derivatives: the functions (1 - r^2)/(1 - 2 r cos x + r^2) = 1 + 2 sum r^k cos k x, r = exp(-width),
  !> with x = theta and x = theta - 1.
  pure function exact_motion(width, theta) result(q)
    real(dp), intent(in) :: width, theta
    real(dp) :: q(2, 0:2), r, x, below
    integer :: i

    r = exp(-width)
    do i = 1, 2
      x = theta - (i - 1)
      below = 1 - 2 * r * cos(x) + r**2
      q(i, 0) = (1 - r**2) / below
      q(i, 1) = -(1 - r**2) * 2 * r * sin(x) / below**2
      q(i, 2) = (1 - r**2) * (8 * r**2 * sin(x)**2 / below**3 - 2 * r * cos(x) / below**2)
    end do
  end function exact_motion

  subroutine manufactured_matrices(self, t, m, b, c)
    class(manufactured), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    real(dp) :: theta

    theta = 2 * pi * t / self%period
    associate (part => self%variation, omega => 2 * pi / self%period)
      m = reshape([1 + part * cos(theta), part * sin(theta), part * sin(theta), 2 - part * cos(2 * theta)], [2, 2])
      b = self%damping * omega * reshape([1.0_dp, part * cos(theta), -part * cos(theta), 2 + part * sin(theta)], [2, 2])
      c = self%stiffness * omega**2 * reshape([1 + part * sin(2 * theta), 0.2_dp, 0.2_dp, 3 + part * cos(theta)], [2, 2])
    end associate
  end subroutine manufactured_matrices

  subroutine manufactured_load(self, t, h)
    class(manufactured), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)
    real(dp), dimension(2, 2) :: m, b, c
    real(dp) :: q(2, 0:2), omega

    omega = 2 * pi / self%period
    call self%matrices(t, m, b, c)
    q = exact_motion(self%width, omega * t)
    h = omega**2 * matmul(m, q(:, 2)) + omega * matmul(b, q(:, 1)) + matmul(c, q(:, 0))
    h(1) = h(1) + self%hidden * cos(self%order * omega * t)
  end subroutine manufactured_load

  type(manufactured) function new_system(stiffness, damping, variation, width) result(system)
    real(dp), intent(in) :: stiffness, damping, variation, width

    system%states = 4
    system%period = 0.3_dp
    system%stiffness = stiffness
    system%damping = damping
    system%variation = variation
    system%width = width
  end function new_system

  !> Solves the system over its period and its motion by harmonic balance.
  subroutine solve(system, tolerance, motion, fits, error)
    class(manufactured), intent(in) :: system
    real(dp), intent(in) :: tolerance
    type(motion_type), intent(out) :: motion
    logical, intent(out) :: fits
    type(error_type), allocatable, intent(out) :: error
    type(survey_type) :: survey
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure

    fits = .false.
    call survey_system(system, survey, failure, .true.)
    if (.not. allocated(failure)) call solve_monodromy(system, accuracy_type(tolerance=tolerance), .true., monodromy, failure, &
      & survey)
    call check_success(error, failure)
    if (allocated(error)) return
    call solve_motion(system, survey, monodromy, tolerance, motion, fits)
  end subroutine solve

  !> Largest error of the states at many phases relative to the bounds `motion%error`, and largest bound relative to the motion.
  subroutine measure(system, motion, used, bound)
    class(manufactured), intent(in) :: system
    type(motion_type), intent(in) :: motion
    real(dp), intent(out) :: used, bound
    integer, parameter :: points = 500
    real(dp) :: x(4, points), q(2, 0:2), exact(4, points)
    integer :: k

    call motion%states([((k - 0.5_dp) / points, k = 1, points)], x)
    do k = 1, points
      q = exact_motion(system%width, 2 * pi * (k - 0.5_dp) / points)
      exact(:2, k) = q(:, 0)
      exact(3:, k) = 2 * pi / system%period * q(:, 1)
    end do
    used = maxval(maxval(abs(x - exact), dim=2) / motion%error)
    bound = maxval(motion%error / maxval(abs(exact), dim=2))
  end subroutine measure

  !> Random systems: from soft to stiff, damped between 1e-5 and 1, variations up to 40 %, harmonics that fall fast and slowly.
  subroutine test_manufactured(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: systems = 300
    type(manufactured) :: system
    type(motion_type) :: motion
    integer(long) :: state
    real(dp) :: used, most, bound
    integer :: i, solved
    logical :: fits

    state = 1
    solved = 0
    most = 0
    do i = 1, systems
      system = new_system(10.0_dp**draw(0.0_dp, 2.5_dp), 10.0_dp**draw(-5.0_dp, 0.0_dp), draw(0.0_dp, 0.4_dp), draw(0.3_dp, 3.0_dp))
      call solve(system, 1.0e-9_dp, motion, fits, error)
      if (allocated(error)) return
      if (.not. fits) cycle
      solved = solved + 1
      call measure(system, motion, used, bound)
      call check_that(error, used, "<=", 1.0_dp, "error relative to the bound")
      if (.not. allocated(error)) call check_that(error, bound, "<=", 1.0e-6_dp, "bound relative to the motion")
      if (allocated(error)) return
      most = max(most, used)
    end do
    call check_that(error, solved, ">", systems / 2, "solved")
    call check_that(error, most, ">", 1.0e-3_dp, "bounds are not too wide")

  contains

    !> Uniformly in [low, high].
    real(dp) function draw(low, high)
      real(dp), intent(in) :: low, high

      state = modulo(48271_long * state, 2147483647_long)
      draw = low + (high - low) * real(state, dp) / 2147483647
    end function draw

  end subroutine test_manufactured

  !> The paper's machine, by harmonic balance and by trajectories.
  subroutine test_trajectories(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: speeds(*) = [120.0_dp, 240.0_dp, 243.0_dp, 287.0_dp, 900.0_dp]
    integer, parameter :: points = 50
    type(frame_type) :: frame
    type(floquet_type) :: floquet
    type(periodic_solution_type) :: start, same
    type(balanced_motion_type) :: motion
    type(turn_errors_type) :: errors, bounds
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: x(:, :), y(:, :), phases(:)
    integer :: i, k

    phases = [(real(k, dp) / points, k = 0, points)]
    do i = 1, size(speeds)
      call frame_of_machine(khang_machine(speeds(i)), frame, failure)
      if (.not. allocated(failure)) call solve_floquet(frame, accuracy_type(), .true., floquet, failure)
      if (.not. allocated(failure)) call solve_periodic(floquet, start, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      same = start
      call balance_motion(frame, floquet, same, motion)
      call check(error, motion%everywhere(), more="harmonic balance applies")
      if (allocated(error)) return
      call follow(frame, floquet, start, phases, x, failure)
      if (.not. allocated(failure)) call bound_motion_errors(frame, floquet, phases, x, errors, failure)
      if (.not. allocated(failure)) call follow(frame, floquet, same, phases, y, failure, motion)
      if (.not. allocated(failure)) call bound_motion_errors(frame, floquet, phases, y, bounds, failure, motion)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, maxval(maxval(abs(x - y), dim=2) / (errors%bounds() + bounds%bounds())), "<=", 1.0_dp, "difference")
      if (allocated(error)) return
      call check_that(error, maxval(abs(y(:, 1) - same%x0) / floquet%scale), "<=", 0.0_dp, "start")
      call check_that(error, maxval(bounds%bounds() / maxval(abs(y), dim=2)), "<=", 1.0e-6_dp, "bound")
      if (allocated(error)) return
    end do
  end subroutine test_trajectories

  !> Harmonics of order k that fall like r^k leave an error of order N/2: from 32 to 64 phases it falls by r^16.
  subroutine test_convergence(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: width = 0.7_dp
    integer, parameter :: phases(3) = [32, 64, 96], points = 200
    type(manufactured) :: system
    type(balance_type) :: balance
    type(gestell_error), allocatable :: failure
    real(dp) :: errors(3), q(2, 0:2), sums(2), theta
    integer :: i, j, k
    logical :: fits

    system = new_system(20.0_dp, 0.1_dp, 0.3_dp, width)
    errors = 0
    do i = 1, 3
      balance = balance_type()
      call survey_system(system, balance%survey, failure)
      call balance_to_rounding(system, phases(i), 1.0_dp, balance, fits)
      call check(error, fits, more="harmonic balance converges")
      if (allocated(error)) return
      do j = 1, points
        theta = 2 * pi * j / points
        q = exact_motion(width, theta)
        sums = 0
        do k = 0, phases(i) / 2 - 1
          sums = sums + balance%harmonics(k + 1, :) * cos(k * theta) + balance%harmonics(phases(i) / 2 + k + 1, :) * sin(k * theta)
        end do
        errors(i) = max(errors(i), maxval(abs(sums - q(:, 0))))
      end do
    end do
    do i = 2, 3
      call check_that(error, log(errors(i - 1) / errors(i)), ">", 0.8_dp * 16 * width, "decay")
      call check_that(error, log(errors(i - 1) / errors(i)), "<", 1.2_dp * 16 * width, "decay")
      if (allocated(error)) return
    end do
  end subroutine test_convergence

  !> A load of the order of the number of phases, or of its double, is constant at all phases.
  subroutine test_hidden_load(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: orders(*) = [48, 96, 144, 192]
    type(manufactured) :: system
    type(motion_type) :: motion
    logical :: fits
    integer :: i

    do i = 1, size(orders)
      system = new_system(20.0_dp, 0.1_dp, 0.3_dp, 2.0_dp)
      system%order = orders(i)
      call solve(system, 1.0e-9_dp, motion, fits, error)
      if (allocated(error)) return
      call check(error, fits, more="without the load")
      if (allocated(error)) return
      system%hidden = 1.0e-3_dp * (2 * pi / system%period)**2
      call solve(system, 1.0e-9_dp, motion, fits, error)
      if (allocated(error)) return
      call check(error, .not. fits, more="a hidden load is detected")
      if (allocated(error)) return
    end do
  end subroutine test_hidden_load

  !> Given steps or methods, jumps, and free directions: there `motion` must be integrated.
  subroutine test_declined(error)
    type(error_type), allocatable, intent(out) :: error
    type(manufactured) :: system
    type(motion_type) :: motion
    type(floquet_type) :: floquet
    type(periodic_solution_type) :: start
    type(balanced_motion_type) :: balanced
    type(accuracy_type) :: accuracy
    type(gestell_error), allocatable :: failure
    logical :: fits
    integer :: i

    system = new_system(20.0_dp, 0.1_dp, 0.3_dp, 2.0_dp)
    do i = 1, 3
      accuracy = accuracy_type()
      if (i == 2) accuracy%steps = 40
      if (i == 3) accuracy%method = "gauss10"
      call solve_floquet(system, accuracy, .true., floquet, failure)
      if (.not. allocated(failure)) call solve_periodic(floquet, start, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call balance_motion(system, floquet, start, balanced)
      call check(error, balanced%everywhere() .eqv. i == 1, more="given steps and methods are integrated")
      if (allocated(error)) return
    end do
    system%breaks = [0.1_dp]
    call solve(system, 1.0e-9_dp, motion, fits, error)
    if (.not. allocated(error)) call check(error, .not. fits, more="jumps")
    if (allocated(error)) return
    deallocate(system%breaks)
    ! Negative stiffness: the energy does not bound the motion.
    system%stiffness = -1
    call solve(system, 1.0e-9_dp, motion, fits, error)
    if (.not. allocated(error)) call check(error, .not. fits, more="negative stiffness")
  end subroutine test_declined

  !> Coefficients with mean and first harmonic: the load of known harmonics below the highest order gives these harmonics.
  subroutine test_coupled(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: half = 16, n = 2 * half, f = 3
    type(coupled_type) :: coupled
    real(dp) :: b(n, f, f), c(n, f, f), x(0:n - 1, f), load(0:n - 1, f), values(n, f), theta(n)
    integer :: i, j, k
    logical :: fits

    theta = [(2 * pi * k / n, k = 0, n - 1)]
    do j = 1, f
      do i = 1, f
        b(:, i, j) = 0.1_dp * i - 0.2_dp * j + 0.3_dp * cos(theta + i * j)
        c(:, i, j) = merge(30.0_dp * i, 1.0_dp * (i - 2 * j), i == j) + 2 * cos(theta - i + 2 * j)
      end do
    end do
    x = 0
    do i = 1, f
      do k = 0, half - 2
        x(k, i) = cos(real(i + k**2, dp))
        if (k > 0) x(half + k, i) = sin(real(i * k, dp))
      end do
    end do
    values = 0
    do j = 1, f
      do k = 0, half - 2
        associate (wave => x(k, j) * cos(k * theta) + x(half + k, j) * sin(k * theta), &
          & slope => k * (x(half + k, j) * cos(k * theta) - x(k, j) * sin(k * theta)))
          values(:, j) = values(:, j) - k**2 * wave
          do i = 1, f
            values(:, i) = values(:, i) + c(:, i, j) * wave + b(:, i, j) * slope
          end do
        end associate
      end do
    end do
    do i = 1, f
      do k = 0, half - 1
        load(k, i) = sum(values(:, i) * cos(k * theta)) / half
        load(half + k, i) = sum(values(:, i) * sin(k * theta)) / half
      end do
      load(0, i) = load(0, i) / 2
    end do
    call couple_harmonics(b, c, coupled, fits)
    call check(error, fits, more="factors exist")
    if (allocated(error)) return
    call coupled%solve(load)
    call check_that(error, maxval(abs(load - x)), "<=", 1.0e-11_dp, "harmonics")
  end subroutine test_coupled

  subroutine test_segments(error)
    type(error_type), allocatable, intent(out) :: error
    type(manufactured) :: system
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: whole(4, 4)
    integer :: i, k

    do i = 1, 3
      system = new_system(10.0_dp**i, 0.1_dp, 0.3_dp, 2.0_dp)
      call solve_monodromy(system, accuracy_type(), .true., monodromy, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      whole = monodromy%segments%maps(:, :, 1)
      do k = 2, size(monodromy%segments%maps, 3)
        whole = matmul(monodromy%segments%maps(:, :, k), whole)
      end do
      call check_that(error, maxval(abs(whole - monodromy%phi)), "<=", 1.0e-12_dp * maxval(abs(monodromy%phi)), "product")
      call check_that(error, abs(monodromy%segments%ends(0)), "<=", 0.0_dp, "first end")
      call check_that(error, abs(monodromy%segments%ends(size(monodromy%segments%ends) - 1) - 1), "<=", 0.0_dp, "last end")
      if (allocated(error)) return
    end do
  end subroutine test_segments

end module test_balanced_motion
