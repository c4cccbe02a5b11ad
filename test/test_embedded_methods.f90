!> A method with its two embedded methods: the basis in which one elimination serves all of them, and their estimate of the
!> error.
module test_embedded_methods
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: text
  use gestell_floquet_integrator_gauss, only: gauss_method
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_methods, only: new_method
  use gestell_floquet_integrator_pace, only: pace_of
  use gestell_floquet_integrator_step_coefficients, only: coefficients_type, sample_coefficients
  use gestell_floquet_integrator_nested, only: embedded_phase_error, nested_tableau, nested_type
  use gestell_floquet_integrator_tableau, only: find_legendre, gauss_tableau
  use gestell_floquet_period_trial, only: level_type, solve_level
  use gestell_floquet_period_period_map, only: period_map_type
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, solve_periodic
  use gestell_math_matrix, only: balanced, unit_matrix
  use gestell_system_periodic, only: periodic_system
  use systems, only: mathieu_type, oscillators_type, plain_type
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_embedded_methods

contains

  subroutine collect_embedded_methods(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("embedded methods share the unknowns and equations of the full method", test_nested), &
      & new_unittest("phase errors of fitted and embedded methods agree with closed forms", test_phase), &
      & new_unittest("the frequency of the fastest motion agrees with closed forms", test_fastest_frequency), &
      & new_unittest("fitted steps do not hide the errors of slower motions", test_not_fitted), &
      & new_unittest("a motion that decays below the smallest number stays within its bound", test_decaying), &
      & new_unittest("errors of Mathieu's equation lie within bounds that are not wide", test_mathieu), &
      & new_unittest("error bounds hold if all embedded methods sample the load alike", test_load)]
  end subroutine collect_embedded_methods

  !> Polynomials of degree s - 2 have a zero last unknown, those of degree s - 3 two zero last unknowns. Residuals along P_s-1
  !> do not enter the equations of the others, along P_s-2 not those before the last two. The tails are Legendre's coefficients
  !> over the roots of 2 k + 1.
  subroutine test_nested(error)
    type(error_type), allocatable, intent(out) :: error
    !> Sums of up to ten terms of size 1.
    real(dp), parameter :: rounding = 40 * epsilon(1.0_dp)
    type(nested_type) :: nested
    real(dp), allocatable :: v(:), p(:, :)
    real(dp) :: worst
    integer :: s, k, j

    do s = 6, 10
      nested = nested_tableau(gauss_tableau(s))
      worst = 0
      do k = 0, s - 2
        v = nested%c**k
        ! v = X u with u_s = 0, and u_s-1 = 0 below degree s - 2.
        worst = max(worst, abs(v(s) - dot_product(nested%values(2, :s - 2), v(:s - 2)) - nested%values(2, s - 1) &
          & * (v(s - 1) - dot_product(nested%values(1, :s - 2), v(:s - 2)))))
        if (k < s - 2) worst = max(worst, abs(v(s - 1) - dot_product(nested%values(1, :s - 2), v(:s - 2))))
      end do
      if (allocated(p)) deallocate(p)
      allocate(p(s, s))
      call find_legendre(s - 1, 2 * nested%c - 1, p)
      associate (of_high => p(:, s), of_next => p(:, s - 1), sums => nested%sums)
        worst = max(worst, maxval(abs(of_high(:s - 1) + sums(:s - 1, 1) * of_high(s - 1) + sums(:s - 1, 2) * of_high(s))))
        worst = max(worst, maxval(abs(of_next(:s - 2) + sums(:s - 2, 1) * of_next(s - 1) + sums(:s - 2, 2) * of_next(s))))
      end associate
      do k = 1, 4
        do j = 0, s - 1
          worst = max(worst, abs(dot_product(nested%tails(:, k), p(:, j + 1)) * sqrt(2 * j + 1.0_dp) &
            & - merge(1, 0, j == s - 5 + k)))
        end do
      end do
      call check_that(error, worst, "<=", rounding, "stages " // text(s))
      if (allocated(error)) return
    end do
  end subroutine test_nested

  !> Two oscillators, with positions or as x' = P x. A method with s stages is fitted to the faster one and follows it without
  !> error. The slower one is 0.9 times as fast; in N steps, with the angle z per step, its phase error is 1 / 0.81 - 1 times
  !> the error c_s z^(2 s + 1) of Gauss' method, from the Pade approximation. The embedded method has the error of s - 1 stages
  !> for the faster oscillator, half of it with positions; Gauss' method itself has the one of s stages. Oracle: closed forms.
  !> In units of 1 and the frequency an error d of the phase is sqrt(2) d in Phi(T).
  subroutine test_phase(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: slower = 0.9_dp, frequencies(2) = 128 * [1.0_dp, slower], period = pi / 1.1_dp, &
      & scale(4) = [1.0_dp, 1.0_dp, frequencies]
    integer, parameter :: of(2, 2) = reshape([1, 3, 2, 4], [2, 2])
    !> The terms of the series that follow, where z is half of s; roundings of the phase, which grow as it does.
    real(dp), parameter :: leading = 0.6_dp, rounding = 8 * epsilon(1.0_dp) * frequencies(1) * period
    type(oscillators_type) :: oscillators
    type(plain_type) :: plain
    class(periodic_system), allocatable :: system
    class(method_type), allocatable :: method
    type(level_type) :: level
    type(period_map_type) :: lower(2)
    type(gestell_error), allocatable :: failure
    real(dp) :: exact(4, 4), missed(2, 2)
    integer :: s, k, form, steps

    oscillators = oscillators_type(states=4, period=period, square=frequencies**2, damping=[0.0_dp, 0.0_dp], &
      & amplitude=[0.0_dp, 0.0_dp], sharpness=0.0_dp)
    plain%states = 4
    plain%period = period
    allocate(plain%system, source=oscillators)
    exact = 0
    do k = 1, 2
      associate (w => frequencies(k), angle => frequencies(k) * period)
        exact(of(:, k), of(:, k)) = reshape([cos(angle), -w * sin(angle), sin(angle) / w, cos(angle)], [2, 2])
      end associate
    end do
    do form = 1, 2
      if (form == 1) allocate(system, source=oscillators)
      if (form == 2) allocate(system, source=plain)
      do s = 6, 10
        steps = 8 * ceiling(frequencies(1) * period / (4 * s))
        call new_method("gauss" // text(s), method, failure)
        call solve_level(system, method, scale, steps, .false., level, failure, lower)
        call check_success(error, failure)
        if (allocated(error)) return
        missed(:, 1) = missed_by(level%phi)
        missed(:, 2) = missed_by(lower(1)%phi)
        call check_that(error, missed(1, 1), "<=", rounding, "fitted, stages " // text(s))
        call check_that(error, abs(missed(2, 1) / (phase_error(s, 2) * (1 / slower**2 - 1)) - 1), "<=", leading, &
          & "another, stages " // text(s))
        call check_that(error, abs(missed(1, 2) / (phase_error(s - 1, 1) * embedded_phase_error(form == 1)) - 1), "<=", leading, &
          & "embedded, stages " // text(s))
        call check_that(error, abs(sqrt(level%unresolved%fitted(1) / level%unresolved%steps) * steps / (frequencies(1) * period) &
          & - 1), &
          & "<=", rounding, "angle, stages " // text(s))
        if (allocated(error)) return
        select type (method)
        class is (gauss_method)
          method%fitted = .false.
        end select
        call solve_level(system, method, scale, steps, .false., level, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        missed(:, 1) = missed_by(level%phi)
        call check_that(error, abs(missed(1, 1) / phase_error(s, 1) - 1), "<=", leading, "not fitted, stages " // text(s))
        if (allocated(error)) return
      end do
      deallocate(system)
    end do

  contains

    !> Errors of the two oscillators.
    pure function missed_by(phi) result(missed)
      real(dp), intent(in) :: phi(:, :)
      real(dp) :: missed(2)
      integer :: i

      missed = [(norm2(balanced(phi(of(:, i), of(:, i)) - exact(of(:, i), of(:, i)), scale(of(:, i)))), i = 1, 2)]
    end function missed_by

    !> Phase error of all steps with so many stages, for one of the oscillators.
    pure real(dp) function phase_error(stages, which)
      integer, intent(in) :: stages, which
      integer :: i

      associate (angle => frequencies(which) * period)
        phase_error = sqrt(2.0_dp) * angle * product([((angle / steps)**2 / (4 * (4 * i**2 - 1)), i = 1, stages)])
      end associate
    end function phase_error

  end subroutine test_phase

  !> The pace v of a damped oscillator is that of z = -d + i w, v^2 = -Re z^2, and zero if it does not oscillate. For Mathieu's
  !> equation it is the mean of powers of the coefficient, for coupled oscillators the pace of the fastest. Oracle: closed forms
  !> and sums.
  subroutine test_fastest_frequency(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: frequency = 50, damping = 0.2_dp, q = 300, rounding = 1.0e-12_dp
    integer, parameter :: points = 16
    type(oscillators_type) :: oscillators
    type(mathieu_type) :: mathieu
    type(plain_type) :: plain
    real(dp) :: square(points), phases(points), mean
    integer :: k

    phases = [(real(k, dp) / points, k = 1, points)]
    oscillators = oscillators_type(states=4, period=2.0_dp, square=[frequency**2, 1.0_dp], &
      & damping=[2 * damping * frequency, 0.1_dp], amplitude=[1.0_dp, 1.0_dp], sharpness=1.0_dp)
    plain%states = 4
    plain%period = 2
    plain%system = oscillators
    call check_that(error, abs([pace(oscillators), pace(plain)] / (frequency * sqrt(1 - 2 * damping**2)) - 1), "<=", rounding, &
      & "damped")
    if (allocated(error)) return
    oscillators%damping(1) = 3 * frequency
    plain%system = oscillators
    call check_that(error, [pace(oscillators), pace(plain)], "<=", 0.0_dp, "without a turn")
    if (allocated(error)) return
    oscillators%square = 0
    plain%system = oscillators
    call check_that(error, [pace(oscillators), pace(plain)], "<=", 0.0_dp, "without stiffness")
    if (allocated(error)) return

    mathieu = mathieu_type(states=2, period=pi, a=frequency**2, q=q)
    square = frequency**2 - 2 * q * cos(2 * pi * phases)
    mean = sqrt(sum(square**8.5_dp) / sum(square**7.5_dp))
    call check_that(error, abs(pace(mathieu) / mean - 1), "<=", rounding, "Mathieu")
    if (allocated(error)) return
    plain%states = 2
    plain%period = pi
    plain%system = mathieu
    call check_that(error, abs(pace(plain) / mean - 1), "<=", rounding, "Mathieu, without positions")
    call check_that(error, pace_of(circulatory()), "<=", 0.0_dp, "circulatory")
    call check_that(error, abs(coupled() / (frequency * sqrt(1 - 2 * damping**2)) - 1), "<=", rounding, "coupled")

  contains

    !> q'' + b q' / 2 + [1 b; -b 1] q = 0, whose M^-1 C has the conjugate pair 1 +- i b.
    type(coefficients_type) function circulatory() result(at)
      real(dp), parameter :: b = 0.15_dp

      at = coefficients_type(f=2, positions=2, states=4, m=spread(unit_matrix(2), 1, points))
      at%b = b / 2 * at%m
      at%c = at%m + spread(reshape([0.0_dp, -b, b, 0.0_dp], [2, 2]), 1, points)
      at%lengths = [(1.0_dp / points, k = 1, points)]
    end function circulatory

    !> Nine coupled oscillators, C = M X K X^-1, B = M X D X^-1, where M needs exchanges of rows and X = E + x y.
    real(dp) function coupled()
      integer, parameter :: f = 9, fastest = 5
      type(coefficients_type) :: at
      real(dp), dimension(f, f) :: unit, m, left, right
      real(dp) :: x(f), y(f), k(f), d(f)
      integer :: i

      unit = unit_matrix(f)
      x = [(1 / real(i, dp), i = 1, f)]
      y = [(cos(real(i, dp)), i = 1, f)]
      m = cshift(unit + 0.3_dp * spread(y, 2, f) * spread(x, 1, f), 1, dim=1)
      left = matmul(m, unit + spread(x, 2, f) * spread(y, 1, f))
      right = unit - spread(x, 2, f) * spread(y, 1, f) / (1 + dot_product(x, y))
      ! The others are slow: their 16th powers vanish.
      k = [(frequency**2 / (20 * i), i = 1, f)]
      d = 0.1_dp * sqrt(k)
      k(fastest) = frequency**2
      d(fastest) = 2 * damping * frequency
      at = coefficients_type(f=f, positions=f, states=2 * f, m=spread(m, 1, points))
      at%b = spread(matmul(left * spread(d, 1, f), right), 1, points)
      at%c = spread(matmul(left * spread(k, 1, f), right), 1, points)
      at%lengths = [(1.0_dp / points, i = 1, points)]
      coupled = pace_of(at)
    end function coupled

    real(dp) function pace(system)
      class(periodic_system), intent(in) :: system
      type(coefficients_type) :: at
      real(dp) :: units(system%states)

      call sample_coefficients(system, phases, .false., at, units)
      at%lengths = [(system%period / points, k = 1, points)]
      pace = pace_of(at)
    end function pace

  end subroutine test_fastest_frequency

  !> If the fastest motion dies out, the error of Phi(T) is that of a slower one, to which no steps are fitted. If both change
  !> during the turn, their errors have both signs and need not cancel, although the mean suggests it. Oracle: plain Gauss'
  !> method with ten stages and at least four times as many steps.
  subroutine test_not_fitted(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: systems = 24
    type(oscillators_type) :: system
    type(monodromy_type) :: monodromy
    type(level_type) :: exact
    class(method_type), allocatable :: method
    type(accuracy_type) :: accuracy
    type(gestell_error), allocatable :: failure
    real(dp) :: square
    integer :: i

    call new_method("gauss10", method, failure)
    select type (method)
    class is (gauss_method)
      method%fitted = .false.
    end select
    do i = 1, systems
      square = (100 + 8.0_dp * i)**2
      system = oscillators_type(states=4, period=2 * pi, square=square * [1.0_dp, modulo(0.618_dp * i, 0.5_dp) + 0.5_dp], &
        & damping=[(0.1_dp + modulo(0.3_dp * i, 0.5_dp)) * sqrt(square), 0.02_dp], amplitude=[1.0_dp, 1.0_dp], sharpness=1.0_dp, &
        & modulation=[modulo(0.414_dp * i, 0.6_dp), modulo(0.732_dp * i, 1.4_dp) - 0.7_dp])
      accuracy = accuracy_type(tolerance=10.0_dp**(-5 - 2 * modulo(i, 3)), method="gauss8")
      call solve_monodromy(system, accuracy, .false., monodromy, failure)
      if (.not. allocated(failure)) call solve_level(system, method, monodromy%scale, 4 * monodromy%steps + 32, .false., exact, &
        & failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, norm2(balanced(monodromy%phi - exact%phi, monodromy%scale)), "<=", monodromy%error, &
        & "system " // text(i))
      if (allocated(error)) return
    end do
  end subroutine test_not_fitted

  !> An oscillator whose motion decays below the smallest number, in any units. The differences of such maps carry no
  !> information and must not be taken for lack of convergence.
  subroutine test_decaying(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: frequencies(2) = [500.0_dp, 600.0_dp]
    type(oscillators_type) :: system
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    type(accuracy_type) :: accuracy
    integer :: k, stages

    accuracy%tolerance = 1.0e-8_dp
    do k = 1, size(frequencies)
      system = oscillators_type(states=2, period=1.0_dp, square=[frequencies(k)**2], damping=[1.8_dp * frequencies(k)], &
        & amplitude=[1.0_dp], sharpness=1.0_dp)
      do stages = 6, 10
        accuracy%method = "gauss" // text(stages)
        call solve_monodromy(system, accuracy, .false., monodromy, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call check_that(error, norm2(monodromy%phi), "<=", monodromy%error, "Phi, stages " // text(stages))
        if (allocated(error)) return
      end do
    end do
  end subroutine test_decaying

  !> Phi(T) of Mathieu's equation, from slow to fast, by every method with embedded methods. The error lies within its bound,
  !> the bound within the tolerance, and the bound is less than 1000 times the error where that is above rounding. Oracle: a
  !> solution with ten times the digits.
  subroutine test_mathieu(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: turns(3) = [1.0_dp, 12.0_dp, 70.0_dp], tolerances(3) = [1.0e-4_dp, 1.0e-7_dp, 1.0e-10_dp]
    type(mathieu_type) :: system
    type(monodromy_type) :: exact, monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: missed
    type(accuracy_type) :: accuracy
    integer :: i, k, stages

    do i = 1, size(turns)
      system = mathieu_type(states=2, period=pi, a=(turns(i) / pi)**2, q=0.2_dp * (turns(i) / pi)**2)
      call solve_monodromy(system, accuracy_type(tolerance=1.0e-13_dp, method="gauss5"), .false., exact, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      do k = 1, size(tolerances)
        do stages = 6, 10
          accuracy%tolerance = tolerances(k)
          accuracy%method = "gauss" // text(stages)
          call solve_monodromy(system, accuracy, .false., monodromy, failure)
          call check_success(error, failure)
          if (allocated(error)) return
          missed = norm2(balanced(monodromy%phi - exact%phi, monodromy%scale))
          call check_that(error, missed, "<=", monodromy%error + exact%error, "error, stages " // text(stages))
          call check_that(error, monodromy%error, "<=", tolerances(k) * monodromy%norm, "bound")
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_mathieu

  !> The start of a slow oscillator's motion under a load with many harmonics. All methods sample the load at the same nodes and
  !> hardly differ; the error must be estimated nevertheless. Oracle: the series of the motion.
  subroutine test_load(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: sharpness(3) = [1.0_dp, 0.3_dp, 0.1_dp]
    type(oscillators_type) :: system
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: periodic
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: missed(:)
    type(accuracy_type) :: accuracy
    integer :: i, k, stages

    do i = 1, size(sharpness)
      system = oscillators_type(states=2, period=1.0_dp, square=[0.2_dp], damping=[0.1_dp], amplitude=[1.0_dp], &
        & sharpness=sharpness(i))
      do stages = 6, 10
        do k = 2, 10, 4
          accuracy%tolerance = 10.0_dp**(-k)
          accuracy%method = "gauss" // text(stages)
          call solve_monodromy(system, accuracy, .true., monodromy, failure)
          if (.not. allocated(failure)) call solve_periodic(monodromy, periodic, failure)
          call check_success(error, failure)
          if (allocated(error)) return
          missed = abs(periodic%x0 - system%start())
          call check_that(error, maxval(missed / periodic%error), "<=", 1.0_dp, "error over bound, stages " // text(stages))
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_load

end module test_embedded_methods
