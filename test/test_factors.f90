!> Multipliers and periodic motion of systems for which the product of the period's maps would lose them.
module test_factors
  use boundary_oracles, only: mathieu_trace
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: evidence, evidence_type, floquet_type, follow, solve_floquet, solve_multipliers, &
    & solve_periodic
  use gestell_system_periodic, only: periodic_system
  use systems, only: mathieu_type, oscillators_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use turning_system, only: turning_type
  implicit none (type, external)
  private

  public :: collect_factors

  !> x' = [0 1; -10 cos t, -24 - 10 sin t] x (Colaneri): exponents 0 and -24, T = 2 pi.
  type, extends(periodic_system) :: colaneri_type
  contains
    procedure :: matrix => colaneri_matrix
  end type colaneri_type

  !> x' = rate (1 + share cos(2 pi t / T)) x + 1; declared jumps have no height.
  type, extends(periodic_system) :: single_type
    real(dp) :: rate = 0, share = 0
  contains
    procedure :: matrix => single_matrix
    procedure :: forcing => single_forcing
  end type single_type

  !> x' = Q diag(d) Q^T x with a rotation Q and d = low until `breaks(1)`, high afterwards; f = -P v for the motion x = v.
  type, extends(periodic_system) :: jumping_type
    real(dp) :: low(2) = 0, high(2) = 0, v(2) = [1.0_dp, -2.0_dp]
  contains
    procedure :: matrix => jumping_matrix
    procedure :: forcing => jumping_forcing
  end type jumping_type

contains

  subroutine collect_factors(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("Colaneri's system has the exponents 0 and -24", test_colaneri), &
      & new_unittest("multipliers and motion are accurate if growth and decay coexist", test_turning), &
      & new_unittest("multipliers from 1e-600 to 1e400 are within their bounds despite jumps", test_jumping), &
      & new_unittest("the start vector's bound holds for loose tolerances", test_loose_tolerances), &
      & new_unittest("two equal vibrations beside a fast decay are resolved", test_equal), &
      & new_unittest("a scalar system has multipliers from 1e-650 to 1e650", test_single), &
      & new_unittest("a system that never moves has the multiplier one", test_no_motion), &
      & new_unittest("a given number of steps is not changed", test_given), &
      & new_unittest("growth within the period that vanishes at its end enters the bounds", test_detour)]
  end subroutine collect_factors

  !> Mathieu's equation at q = 25 close to its border at a0: Phi(t) grows a thousandfold and is about 1 in the end, so that
  !> rounding errors on the way are amplified. Compared with the trace in quadruple precision; Phi(T) is a product here, or
  !> factors.
  subroutine test_detour(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: a0 = -40.256779546566_dp, beside(6) = [-1.0e-3_dp, -1.0e-4_dp, -1.1e-5_dp, -1.0e-5_dp, -2.0e-6_dp, &
      & 1.0e-5_dp]
    type(gestell_error), allocatable :: failure
    type(mathieu_type) :: system
    type(floquet_type) :: floquet
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    real(dp) :: right
    integer :: k, way

    do k = 1, size(beside)
      system = mathieu_type(states=2, period=pi, a=a0 + beside(k), q=25.0_dp)
      right = log_largest(real(mathieu_trace(system%a, system%q), dp))
      do way = 1, 2
        if (way == 1) then
          call solve_floquet(system, accuracy_type(tolerance=1.0e-12_dp), .false., floquet, failure)
          if (.not. allocated(failure)) call solve_multipliers(floquet, .false., multipliers, failure)
        else
          call solve_monodromy(system, accuracy_type(tolerance=1.0e-9_dp), .false., monodromy, failure)
          if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., multipliers, failure)
        end if
        call check_success(error, failure)
        if (allocated(error)) return
        call check_that(error, abs(multipliers%log_abs(1) - right), "<=", multipliers%error(1), "the error exceeds its bound")
        call check_that(error, multipliers%error(1), "<", 1.0e-5_dp, "the bound is not too wide")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_detour

  !> ln |rho| of the greater one of two multipliers whose product is 1.
  pure real(dp) function log_largest(trace)
    real(dp), intent(in) :: trace

    log_largest = acosh(max(1.0_dp, abs(trace) / 2))
  end function log_largest

  !> Pairs of conjugates that are equal, or nearly.
  subroutine test_equal(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: apart(3) = [0.0_dp, 1.0e-15_dp, 1.0e-9_dp]
    type(oscillators_type) :: system
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    integer :: i, k

    do i = 1, size(apart)
      system = oscillators_type(states=6, period=1.0_dp, square=[1.0_dp, 1 + apart(i), 1.0_dp], &
        & damping=[0.1_dp, 0.1_dp, 30.0_dp], amplitude=[1.0_dp, 1.0_dp, 1.0_dp])
      call solve_floquet(system, accuracy_type(), .true., floquet, failure)
      if (.not. allocated(failure)) call solve_multipliers(floquet, .true., multipliers, failure)
      if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check(error, factors_of(floquet) > 0, more="no factors")
      if (allocated(error)) return
      ! The moduli: -15 + sqrt(224), four times -0.05, -15 - sqrt(224).
      do k = 2, 5
        call check_that(error, abs(multipliers%log_abs(k) + 0.05_dp), "<=", multipliers%error(k), "modulus")
        call check_that(error, abs(abs(multipliers%arg(k)) - sqrt(1 - 0.05_dp**2)), "<=", multipliers%error(k) + apart(i), &
          & "argument")
        if (allocated(error)) return
      end do
      call check_that(error, count(multipliers%arg > 0.5_dp), "==", 2, "pairs")
      call check_that(error, count(multipliers%arg < -0.5_dp), "==", 2, "pairs")
      call check_that(error, abs(solution%x0 - system%start()), "<=", solution%error, "x0")
      if (allocated(error)) return
    end do
  end subroutine test_equal

  !> ln rho = rate, whether it is reduced or not, however slow the slowest phase is.
  subroutine test_single(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: rates(7) = [-1500.0_dp, -1000.0_dp, -800.0_dp, -600.0_dp, 600.0_dp, 800.0_dp, 1500.0_dp]
    type(single_type) :: system
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(gestell_error), allocatable :: failure
    integer :: i, k

    do i = 1, size(rates)
      do k = 1, 3
        system = single_type(states=1, period=1.0_dp, rate=rates(i), share=merge(0.95_dp, 0.0_dp, k == 2))
        if (k == 3) system%breaks = [0.5_dp]
        call solve_floquet(system, accuracy_type(), .true., floquet, failure)
        if (.not. allocated(failure)) call solve_multipliers(floquet, .false., multipliers, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call check_that(error, abs(multipliers%log_abs(1) - rates(i)), "<=", multipliers%error(1), "ln |rho|")
        call check_that(error, multipliers%error(1), "<", 1.0e-6_dp, "bound")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_single

  !> P = 0: the solutions with all numbers of steps are the same.
  subroutine test_no_motion(error)
    type(error_type), allocatable, intent(out) :: error
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(gestell_error), allocatable :: failure

    call solve_floquet(single_type(states=1, period=1.0_dp), accuracy_type(), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_multipliers(floquet, .false., multipliers, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, abs(multipliers%rho(1) - 1), "<=", multipliers%error(1), "rho")
    call check_that(error, multipliers%error(1), "<", 1.0e-12_dp, "bound")
  end subroutine test_no_motion

  subroutine single_matrix(self, t, p)
    class(single_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    p = self%rate * (1 + self%share * cos(2 * pi * t / self%period))
  end subroutine single_matrix

  subroutine single_forcing(self, t, f)
    class(single_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    associate (unused_system => self, unused_time => t)
    end associate
    f = 1
  end subroutine single_forcing

  subroutine test_colaneri(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tolerances(3) = [1.0e-6_dp, 1.0e-9_dp, 1.0e-12_dp]
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(gestell_error), allocatable :: failure
    integer :: i

    do i = 1, size(tolerances)
      call solve_floquet(colaneri_type(states=2, period=2 * pi), accuracy_type(tolerance=tolerances(i)), .false., floquet, failure)
      if (.not. allocated(failure)) call solve_multipliers(floquet, .false., multipliers, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      associate (found => multipliers%log_abs, exact => 2 * pi * [0.0_dp, -24.0_dp])
        call check_that(error, abs(found - exact), "<=", multipliers%error, "bound")
        ! What a mode of the segment's size may lose relative to the largest, 30, and a factor for its condition.
        call check_that(error, multipliers%error, "<=", 3.0e3_dp * tolerances(i), "the bound is too wide")
        if (allocated(error)) return
      end associate
    end do
    call check_that(error, maxval(abs(real(multipliers%exponent) - [0.0_dp, -24.0_dp])), "<", 1.0e-10_dp, "to 1e-10")
    call check_that(error, abs(real(multipliers%rho(2)) / 3.2355e-66_dp - 1), "<", 1.0e-4_dp, "multiplier")
  end subroutine test_colaneri

  !> The bound of x0 if errors are not tiny: tolerances from 1e-2 to 1e-8, methods of low and high order.
  subroutine test_loose_tolerances(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: methods(4) = [character(len=7) :: "gauss2", "gauss3", "magnus4", "gauss6"]
    real(dp), parameter :: tolerances(3) = [1.0e-2_dp, 1.0e-5_dp, 1.0e-8_dp]
    type(turning_type) :: system
    type(floquet_type) :: floquet
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp) :: ratio, least
    integer :: i, k

    system = turning_type(states=6, period=2 * pi, rate=[3.0_dp, -2.5_dp, -0.2_dp], frequency=[3.3_dp, 0.0_dp, 7.1_dp], &
      & real_block=[.false., .true., .false.])
    least = huge(least)
    do i = 1, size(methods)
      do k = 1, size(tolerances)
        call solve_floquet(system, accuracy_type(tolerance=tolerances(k), method=trim(methods(i))), .true., floquet, failure)
        if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call check(error, factors_of(floquet) > 0, more="no factors")
        if (allocated(error)) return
        ratio = minval(solution%error / max(abs(solution%x0 - system%motion(0.0_dp)), tiny(1.0_dp)))
        least = min(least, ratio)
        call check_that(error, ratio, ">=", 1.0_dp, trim(methods(i)) // ": bound of x0")
        if (allocated(error)) return
      end do
    end do
    ! Not too wide: the narrowest of all bounds is at most this factor too wide.
    call check_that(error, least, "<", 1.0e3_dp, "bounds too wide")
  end subroutine test_loose_tolerances

  !> The method is given, so that the system is integrated and not reduced.
  subroutine test_turning(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 40
    type(turning_type) :: system
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    complex(dp) :: exact(6), difference
    real(dp), allocatable :: x(:, :)
    real(dp) :: nearest
    integer :: i, k

    system = turning_type(states=6, period=2 * pi, rate=[9.0_dp, -8.0_dp, -0.2_dp], frequency=[3.3_dp, 0.0_dp, 7.1_dp], &
      & real_block=[.false., .true., .false.])
    call solve_floquet(system, accuracy_type(method="gauss8"), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_multipliers(floquet, .true., multipliers, failure)
    if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
    if (.not. allocated(failure)) call follow(system, floquet, solution, [(real(k, dp) / points, k = 0, points)], x, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, factors_of(floquet) > 0, more="no factors")
    if (allocated(error)) return
    exact = system%logarithms()
    do i = 1, 6
      nearest = huge(nearest)
      do k = 1, 6
        difference = cmplx(multipliers%log_abs(i) - real(exact(k)), multipliers%arg(i) - aimag(exact(k)), dp)
        nearest = min(nearest, abs(cmplx(real(difference), aimag(difference) - 2 * pi * anint(aimag(difference) / (2 * pi)), dp)))
      end do
      call check_that(error, nearest, "<=", multipliers%error(i), "a multiplier's bound")
      call check_that(error, multipliers%error(i), "<", 1.0e-6_dp, "the bound is too wide")
      if (allocated(error)) return
    end do
    call check_that(error, abs(solution%x0 - system%motion(0.0_dp)), "<=", solution%error, "bound of x0")
    call check_that(error, maxval(solution%error), "<", 1.0e-6_dp, "the bound of x0 is too wide")
    ! Integrated from its start to the end it would be amplified by exp(18 pi).
    call check_that(error, maxval([(abs(x(:, k + 1) - system%motion(2 * pi * k / points)), k = 0, points)]), "<", 1.0e-7_dp, &
      & "motion")
    call check_that(error, maxval(abs(multipliers%rho(::2) - conjg(multipliers%rho(2::2))), &
      & mask=abs(aimag(multipliers%rho(::2))) > 0), "<=", 0.0_dp, "conjugate pairs")
  end subroutine test_turning

  subroutine test_jumping(error)
    type(error_type), allocatable, intent(out) :: error
    type(jumping_type) :: system
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure

    system = jumping_type(states=2, period=1.0_dp, breaks=[0.25_dp], low=[-2000.0_dp, 100.0_dp], high=[-1175.0_dp, 1195.0_dp])
    call solve_floquet(system, accuracy_type(), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_multipliers(floquet, .false., multipliers, failure)
    if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    associate (exact => 0.25_dp * [100.0_dp, -2000.0_dp] + 0.75_dp * [1195.0_dp, -1175.0_dp])
      call check_that(error, abs(multipliers%log_abs - exact), "<=", multipliers%error, "bound")
      call check_that(error, multipliers%error, "<", 1.0e-6_dp, "the bound is too wide")
      if (allocated(error)) return
    end associate
    call check(error, multipliers%verdict(), "unstable")
    if (allocated(error)) return
    call check_that(error, abs(solution%x0 - system%v), "<=", solution%error, "bound of x0")
    call check_that(error, solution%error, "<", 1.0e-6_dp, "the bound of x0 is too wide")
  end subroutine test_jumping

  subroutine test_given(error)
    type(error_type), allocatable, intent(out) :: error
    type(floquet_type) :: floquet
    type(evidence_type) :: found
    type(gestell_error), allocatable :: failure

    call solve_floquet(colaneri_type(states=2, period=2 * pi), accuracy_type(steps=300), .false., floquet, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call evidence(floquet, found)
    call check(error, found%steps, 300)
  end subroutine test_given

  subroutine colaneri_matrix(self, t, p)
    class(colaneri_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    associate (unused => self)
    end associate
    p = reshape([0.0_dp, -10 * cos(t), 1.0_dp, -24 - 10 * sin(t)], [2, 2])
  end subroutine colaneri_matrix

  subroutine jumping_matrix(self, t, p)
    class(jumping_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp), parameter :: q(2, 2) = reshape([0.6_dp, 0.8_dp, -0.8_dp, 0.6_dp], [2, 2])
    real(dp) :: d(2)

    d = merge(self%low, self%high, t < self%breaks(1))
    p = matmul(q, matmul(reshape([d(1), 0.0_dp, 0.0_dp, d(2)], [2, 2]), transpose(q)))
  end subroutine jumping_matrix

  subroutine jumping_forcing(self, t, f)
    class(jumping_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)
    real(dp) :: p(2, 2)

    call self%matrix(t, p)
    f = -matmul(p, self%v)
  end subroutine jumping_forcing

  !> Number of factors of Phi(T) that a solution keeps.
  integer function factors_of(floquet)
    type(floquet_type), intent(in) :: floquet
    type(evidence_type) :: found

    call evidence(floquet, found)
    factors_of = found%factors
  end function factors_of

end module test_factors
