!> The averaged model against closed forms, quadruple precision and the general integrator.
module test_averaged
  use checks, only: check_failure, check_that
  use gestell_base_error, only: failed_computation, gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: floquet_type, follow, solve_floquet, solve_multipliers, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_system_averaged, only: average, averaged_system
  use gestell_system_second_order, only: second_order_system
  use machines, only: frame_of_machine
  use reference_averaged, only: solve_averaged
  use reference_cases, only: random_machine
  use reference_frame, only: frame_of
  use reference_linear, only: qp
  use reference_machine, only: khang_machine, machine_data
  use slow_tests, only: new_slow
  use systems, only: cancelling_type, constant_type, diagonal, jumping_type, mathieu_type
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  implicit none (type, external)
  private

  public :: collect_averaged

contains

  subroutine collect_averaged(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("with constant coefficients multipliers and motion agree with the closed form", test_constant), &
      & new_unittest("defective, overdamped and underflowing multipliers stay within their error bounds", test_extremes), &
      & new_unittest("averaging removes Mathieu's parametric excitation; an error at resonance names the harmonic", &
        & test_resonance), &
      & new_slow("error bounds hold for averages of coefficients that jump", test_jumps), &
      & new_slow("error bounds of averaged random machines hold against quadruple precision", test_bounds), &
      & new_unittest("the general integrator agrees with the closed form of the averaged model", test_integrator), &
      & new_unittest("averages of coefficients that cancel need no more samples than others", test_cancelling)]
  end subroutine collect_averaged

  !> In data/inline_twin.nml the masses are balanced. Their contributions to B and C cancel except for rounding, which no number
  !> of samples changes.
  subroutine test_cancelling(error)
    type(error_type), allocatable, intent(out) :: error
    type(cancelling_type) :: system
    type(averaged_system) :: model

    system%states = 4
    system%period = 2 * pi
    system%least_steps = 8
    system%rounding = epsilon(1.0_dp)
    call average(system, model)
    call check_that(error, real(model%evaluations, dp), "<=", 128.0_dp, "samples")
    if (.not. allocated(error)) call check_that(error, abs(model%b(1, 2)), "<=", 1.0e-14_dp, "mean of cancelling terms")
  end subroutine test_cancelling

  !> Multipliers, start and motion at `phases` of the averaged model of `system`.
  subroutine solve(system, phases, multipliers, solution, x, error)
    class(second_order_system), intent(in) :: system
    real(dp), intent(in) :: phases(:)
    type(multipliers_type), intent(out) :: multipliers
    type(periodic_solution_type), intent(out) :: solution
    real(dp), allocatable, intent(out) :: x(:, :)
    type(gestell_error), allocatable, intent(out) :: error
    type(averaged_system) :: model
    type(floquet_type) :: floquet

    select type (system)
    type is (frame_type)
      call system%averaged(model)
    class default
      call average(system, model)
    end select
    call solve_floquet(model, accuracy_type(), .true., floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .true., multipliers, error)
    if (.not. allocated(error)) call solve_periodic(floquet, solution, error)
    if (.not. allocated(error)) call follow(model, floquet, solution, phases, x, error)
  end subroutine solve

  !> Two equal masses between walls, coupled: the modes (1, 1) and (1, -1) with w^2 = 9 and 25, damping 2 d = 0.2 and 0.6.
  subroutine test_constant(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: w2(2) = [9.0_dp, 25.0_dp], d(2) = [0.1_dp, 0.3_dp], phases(3) = [0.0_dp, 0.3_dp, 0.85_dp]
    type(constant_type) :: system
    type(multipliers_type) :: m
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    complex(dp) :: lambda(2), modal(2), q(2)
    real(dp), allocatable :: x(:, :)
    real(dp) :: rate
    integer :: k

    system%states = 4
    system%period = 1.7_dp
    system%m = 3 * diagonal([1.0_dp, 1.0_dp])
    system%b = 3 * both_modes(2 * d)
    system%c = 3 * both_modes(w2)
    system%amplitude = [6.0_dp, 1.5_dp]
    call solve(system, phases, m, solution, x, failure)
    if (failed(failure, error)) return
    lambda = cmplx(-d, sqrt(w2 - d**2), dp)
    ! The lightly damped mode first. Roundings of a matrix of size 25 in a period of 1.7.
    do k = 1, 2
      call check_that(error, min(abs(m%rho(2 * k - 1) - exp(lambda(k) * system%period)), &
        & abs(m%rho(2 * k - 1) - exp(conjg(lambda(k)) * system%period))), "<", 1.0e-13_dp, "rho")
      if (allocated(error)) return
      call check(error, m%log_abs(2 * k), -d(k) * system%period, thr=1.0e-14_dp, more="log_abs")
      if (allocated(error)) return
      call check_that(error, abs(m%rho(2 * k - 1) - conjg(m%rho(2 * k))), "<", tiny(1.0_dp), "pairs")
      if (allocated(error)) return
    end do
    call check_that(error, m%error, "<", 1.0e-12_dp, "bounds of multipliers are not too wide")
    call check_that(error, abs(m%exponent - log(m%rho) / system%period), "<", 1.0e-14_dp, "exponents")
    if (allocated(error)) return
    call check(error, m%verdict(), "stable")
    if (allocated(error)) return

    rate = 2 * pi / system%period
    modal = [sum(system%amplitude), system%amplitude(1) - system%amplitude(2)] / (2 * 3) &
      & / cmplx(w2 - rate**2, 2 * d * rate, dp)
    q = [sum(modal), modal(1) - modal(2)]
    call check_that(error, abs(solution%x0 - [real(q), -rate * aimag(q)]), "<=", solution%error, "x0")
    call check_that(error, solution%error, "<", 1.0e-12_dp, "bounds of x0 are not too wide")
    if (allocated(error)) return
    do k = 1, 3
      associate (turn => exp(cmplx(0, 2 * pi * phases(k), dp)))
        call check_that(error, abs(x(:, k) - [real(q * turn), -rate * aimag(q * turn)]), "<=", solution%error, "motion")
      end associate
      if (allocated(error)) return
    end do
  end subroutine test_constant

  !> The symmetric matrix with the eigenvalues v(1) for (1, 1) and v(2) for (1, -1).
  pure function both_modes(v) result(a)
    real(dp), intent(in) :: v(2)
    real(dp) :: a(2, 2)

    a = (v(1) - v(2)) / 2
    a(1, 1) = sum(v) / 2
    a(2, 2) = a(1, 1)
  end function both_modes

  !> q'' + 2 d q' + d^2 q: lambda = -d twice, in a chain. q'' + (a + b) q' + a b q: -a and -b.
  subroutine test_extremes(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    type(multipliers_type) :: m
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: x(:, :)

    system%states = 4
    system%period = 1
    system%m = diagonal([1.0_dp, 1.0_dp])
    system%b = diagonal([1.0e4_dp + 2, 1.5_dp])
    system%c = diagonal([2.0e4_dp, 0.5625_dp])
    call solve(system, [0.0_dp], m, solution, x, failure)
    if (failed(failure, error)) return
    ! In the order -3/4 (twice), -2, -1e4. A defective eigenvalue moves by the square root of the whole matrix's rounding error.
    call check_that(error, abs(m%log_abs(:2) + 0.75_dp), "<", m%error(:2), "defective, within the bound")
    call check_that(error, m%error(:2), "<", 0.1_dp, "defective, bound not too wide")
    if (allocated(error)) return
    call check(error, m%log_abs(3), -2.0_dp, thr=1.0e-10_dp)
    if (allocated(error)) return
    call check(error, m%log_abs(4), -1.0e4_dp, thr=1.0e-10_dp)
    if (allocated(error)) return
    call check_that(error, abs(m%rho(4)), "<=", 0.0_dp, "underflow")
    call check_that(error, m%error(4), "<", 1.0e-7_dp, "underflow")
    if (allocated(error)) return
    call check(error, m%verdict(), "stable")
    if (allocated(error)) return
    ! Without a load the motion is rest.
    call check_that(error, maxval(abs(solution%x0)), "<=", 0.0_dp, "rest")
    call check_that(error, maxval(abs(x)), "<=", 0.0_dp, "rest")
    if (allocated(error)) return

    ! A negative spring: exp(1e3) overflows.
    system%b = 0
    system%c = diagonal([-1.0e6_dp, 4.0_dp])
    call solve(system, [0.0_dp], m, solution, x, failure)
    if (failed(failure, error)) return
    call check(error, m%log_abs(1), 1.0e3_dp, thr=1.0e-10_dp, more="overflow")
    if (allocated(error)) return
    call check(error, m%verdict(), "unstable")
    if (allocated(error)) return
    ! Undamped: on the border. With a period of 1e10 the bound exceeds the modulus by far.
    system%c = diagonal([1.0_dp, 4.0_dp])
    system%period = 1
    call solve(system, [0.0_dp], m, solution, x, failure)
    call check(error, m%verdict(), "undecided")
    if (allocated(error)) return
    system%b = diagonal([1.0e-20_dp, 1.0_dp])
    system%period = 1.0e20_dp
    call solve(system, [0.0_dp], m, solution, x, failure)
    call check(error, m%verdict(), "undecided", more="long period")
  end subroutine test_extremes

  !> y'' + d y' + (a - 2 q cos 2 t) y = h cos 2 t becomes by averaging y'' + d y' + a y = h cos 2 t, for any q.
  subroutine test_resonance(error)
    type(error_type), allocatable, intent(out) :: error
    type(mathieu_type) :: mathieu
    type(averaged_system) :: model
    type(floquet_type) :: floquet
    type(multipliers_type) :: m
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: x(:, :)
    complex(dp) :: y

    mathieu%states = 2
    mathieu%period = pi
    mathieu%a = 3.9_dp
    mathieu%q = 0.7_dp
    mathieu%d = 0.02_dp
    mathieu%h = 0.3_dp
    call solve(mathieu, [0.0_dp], m, solution, x, failure)
    if (failed(failure, error)) return
    y = mathieu%h / cmplx(mathieu%a - 4, 2 * mathieu%d, dp)
    call check_that(error, abs(solution%x0 - [real(y), -2 * aimag(y)]), "<=", solution%error, "x0")
    if (allocated(error)) return
    ! |4 + 2 i d| + a over |Z|: 7.9 / 0.108.
    call check(error, solution%condition, (4 + 0.04_dp + 3.9_dp) / abs(cmplx(0.1_dp, 0.04_dp, dp)), thr=1.0e-9_dp)
    if (allocated(error)) return
    call check_that(error, solution%error, "<", 1.0e-11_dp, "bounds are not too wide")
    if (allocated(error)) return

    mathieu%d = 0
    mathieu%a = 36
    call expect("harmonic 3")
    mathieu%a = 0
    mathieu%d = 0.1_dp
    call expect("harmonic 0")
    ! Far beyond the harmonics of the load.
    mathieu%d = 0
    mathieu%a = (2 * 123456.0_dp)**2
    call expect("harmonic 123456")

  contains

    !> Checks that there is no periodic motion, but that there are multipliers.
    subroutine expect(words)
      character(len=*), intent(in) :: words

      if (allocated(error)) return
      call average(mathieu, model)
      call solve_floquet(model, accuracy_type(), .true., floquet, failure)
      if (.not. allocated(failure)) call solve_multipliers(floquet, .false., m, failure)
      if (failed(failure, error)) return
      call solve_periodic(floquet, solution, failure)
      call check_failure(error, failure, words)
      if (allocated(error)) return
      call check_that(error, failure%code, "==", failed_computation, failure%message)
    end subroutine expect

  end subroutine test_resonance

  !> Jumps reduce the quadrature to first order; the stated errors must hold nevertheless. Means and Fourier coefficients of
  !> steps are known in closed form.
  subroutine test_jumps(error)
    type(error_type), allocatable, intent(out) :: error
    type(jumping_type) :: system
    type(averaged_system) :: model
    type(multipliers_type) :: m
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: x(:, :)
    real(dp) :: mean, start(2)
    complex(dp) :: y, h
    integer :: i, k

    system%states = 2
    system%period = 2 * pi
    do i = 1, 6
      system%edge = 0.05_dp + 0.1426_dp * i
      system%step = merge(2, 0, i > 3)
      system%breaks = [system%edge * system%period]
      call average(system, model)
      mean = 5 + system%step * system%edge
      call check_that(error, abs(model%c(1, 1) - mean), "<=", model%c_error(1, 1), "mean of C")
      call check_that(error, model%c_error(1, 1), "<", 1.0e-3_dp, "mean of C, bound not too wide")
      call check_that(error, model%m_error(1, 1), "<", 1.0e-14_dp, "mean of M")
      if (allocated(error)) return
      call solve(system, [0.0_dp], m, solution, x, failure)
      if (failed(failure, error)) return
      ! h = 1 up to the edge, then 0. 20000 orders leave 2 / (pi k) / k^2 each: 1e-9 of the position, 4e-5 of the velocity.
      start = [system%edge / mean, 0.0_dp]
      do k = 20000, 1, -1
        h = (1 - exp(cmplx(0, -2 * pi * k * system%edge, dp))) / cmplx(0, pi * k, dp)
        y = h / cmplx(mean - real(k, dp)**2, 0.1_dp * k, dp)
        start = start + [real(y), -k * aimag(y)]
      end do
      call check_that(error, abs(solution%x0 - start), "<=", solution%error + [1.0e-9_dp, 4.0e-5_dp], "x0")
      call check_that(error, solution%error, "<", [2.0e-3_dp, 1.0e-2_dp], "x0, bound not too wide")
      if (allocated(error)) return
    end do
  end subroutine test_jumps

  !> Multipliers, start and motion of the averaged models of the paper's and of random machines.
  subroutine test_bounds(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: machines = 24
    real(dp), parameter :: phases(2) = [0.0_dp, 0.37_dp]
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(multipliers_type) :: m
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    complex(qp) :: lambda(6)
    real(qp) :: x_q(6, 2)
    real(dp), allocatable :: x(:, :)
    real(dp) :: width(machines), width_x(machines), true_error(6), x_error(6)
    integer :: i, k

    do i = 1, machines
      machine = random_machine(i)
      if (i == 1) machine = khang_machine(240.0_dp)
      if (i == 2) machine = khang_machine(-360.0_dp, 10.0_dp)
      call frame_of_machine(machine, frame, failure)
      if (.not. allocated(failure)) call solve(frame, phases, m, solution, x, failure)
      if (failed(failure, error)) return
      call solve_averaged(frame_of(machine), 384, real(phases, qp), lambda, x_q)
      associate (rho => exp(lambda * frame%period))
        true_error = [(real(minval(abs(rho - m%rho(k)) / abs(rho)), dp), k = 1, 6)]
      end associate
      call check_that(error, true_error, "<=", m%error, "multipliers")
      if (allocated(error)) return
      x_error = maxval(abs(real(x - x_q, dp)), dim=2)
      call check_that(error, x_error, "<=", solution%error, "motion")
      if (allocated(error)) return
      width(i) = maxval(m%error) / maxval(true_error)
      width_x(i) = maxval(solution%error) / maxval(x_error)
    end do
    ! Half of the bounds are at most a thousand times the true error.
    call check_that(error, count(width < 1000), ">", machines / 2, "bounds of multipliers are not too wide")
    call check_that(error, count(width_x < 1000), ">", machines / 2, "bounds of the motion are not too wide")
  end subroutine test_bounds

  !> A second method for the same model.
  subroutine test_integrator(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(averaged_system) :: model
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: m, integrated
    type(periodic_solution_type) :: solution, start
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: x(:, :), y(:, :)
    real(dp), parameter :: phases(4) = [0.0_dp, 0.21_dp, 0.5_dp, 0.93_dp]
    integer :: i, k

    do i = 1, 2
      call frame_of_machine(khang_machine(merge(240.0_dp, -360.0_dp, i == 1)), frame, failure)
      if (.not. allocated(failure)) call solve(frame, phases, m, solution, x, failure)
      if (failed(failure, error)) return
      call frame%averaged(model)
      call solve_monodromy(model, accuracy_type(tolerance=1.0e-13_dp), .true., monodromy, failure)
      if (.not. allocated(failure)) call solve_multipliers(monodromy, .true., integrated, failure)
      if (.not. allocated(failure)) call solve_periodic(monodromy, start, failure)
      if (.not. allocated(failure)) call follow(model, monodromy, start, phases, y, failure)
      if (failed(failure, error)) return
      do k = 1, 6
        call check_that(error, minval(abs(m%rho - integrated%rho(k))), "<=", m%error(k) * abs(m%rho(k)) + integrated%error(k) &
          & * abs(integrated%rho(k)), "multipliers")
        ! Unit vectors, the largest component real and positive.
        call check_that(error, minval(maxval(abs(m%vectors - spread(integrated%vectors(:, k), 2, 6)), dim=1)), "<", 1.0e-10_dp, &
          & "vectors")
        if (allocated(error)) return
      end do
      ! Factor 8: the error of the start may grow during the turn, as the scale of the modes allows.
      call check_that(error, [abs(x - y)], "<=", &
        & [spread(solution%error + 8 * maxval(start%error / monodromy%scale) * monodromy%scale, 2, 4)], "motion")
      if (allocated(error)) return
    end do
  end subroutine test_integrator

  logical function failed(failure, error)
    type(gestell_error), allocatable, intent(in) :: failure
    type(error_type), allocatable, intent(out) :: error

    failed = allocated(failure)
    if (failed) call test_failed(error, failure%message)
  end function failed

end module test_averaged
