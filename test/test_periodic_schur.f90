!> Multipliers from factors whose product is never formed.
module test_periodic_schur
  use checks, only: check_failure, check_success, check_that
  use factor_sequences, only: distances, hidden, outcome_type, random_matrix, reflected, solve
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: eigensystem, log_abs_determinant
  use gestell_floquet_period_period_map, only: period_map
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_methods, only: new_method
  use gestell_floquet_factors_periodic_schur, only: periodic_multipliers, periodic_schur
  use gestell_system_periodic, only: periodic_system
  use reference_linear, only: eigenvalues, qp
  use reference_random, only: random_type
  use testdrive, only: error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: collect_periodic_schur

  !> x' = [0 1; -10 cos t, -24 - 10 sin t] x, T = 2 pi (Colaneri): exponents 0 and -24.
  type, extends(periodic_system) :: colaneri_type
  contains
    procedure :: matrix => colaneri_matrix
  end type colaneri_type

contains

  subroutine collect_periodic_schur(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("multipliers of up to 1000 equal factors are powers of eigenvalues", test_powers), &
      & new_unittest("powers of a Jordan block stay within bounds of the right size", test_jordan_powers), &
      & new_unittest("Colaneri's exponents 0 and -24 follow from the factors", test_colaneri), &
      & new_unittest("moduli from 1e-300 to 1e300 of disguised triangular factors are found", test_hidden), &
      & new_unittest("multipliers of one factor agree with LAPACK's eigenvalues", test_one_factor), &
      & new_unittest("multipliers of random factors agree with quadruple precision", test_quadruple), &
      & new_unittest("multipliers of 1 to 12 states satisfy pairing, cyclic and determinant laws", test_invariants), &
      & new_unittest("the iteration converges even for difficult sequences of factors", test_convergence), &
      & new_unittest("factors with NaN or infinity are refused", test_refused)]
  end subroutine collect_periodic_schur

  subroutine colaneri_matrix(self, t, p)
    class(colaneri_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    associate (unused => self)
    end associate
    p = reshape([0.0_dp, -10 * cos(t), 1.0_dp, -24 - 10 * sin(t)], [2, 2])
  end subroutine colaneri_matrix

  !> Eigenvalues 1, 0.5 exp(+-0.7 i), 0.1 and 1e-3, to the power of K.
  subroutine test_powers(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: counts(7) = [1, 2, 3, 18, 64, 100, 1000]
    real(dp), parameter :: angle = 0.7_dp, moduli(5) = [1.0_dp, 0.5_dp, 0.5_dp, 0.1_dp, 1.0e-3_dp]
    real(dp) :: t(5, 5), off(5)
    type(outcome_type) :: o
    integer :: i

    t = 0
    t(1, 1) = 1
    t(2:3, 2:3) = reshape(0.5_dp * [cos(angle), -sin(angle), sin(angle), cos(angle)], [2, 2])
    t(4, 4) = 0.1_dp
    t(5, 5) = 1.0e-3_dp
    do i = 1, size(counts)
      associate (k => counts(i))
        call solve(spread(cmplx(reflected(t), kind=dp), 3, k), o, error)
        if (allocated(error)) return
        ! Rounding of the entries moves the smallest by 1e-13, K times.
        off = abs(o%log_abs - k * log(moduli))
        call check_that(error, off, "<=", 1.0e-10_dp * max(1.0_dp, k * abs(log(moduli))), "modulus")
        if (allocated(error)) return
        off = abs(abs(exp(cmplx(0, o%arg, dp))) - 1)
        call check_that(error, abs(cos(o%arg(2)) - cos(k * angle)) + abs(sin(abs(o%arg(2))) - abs(sin(k * angle))), "<", &
          & 1.0e-10_dp, "argument")
        call check_that(error, abs(sin(o%arg(1))) + abs(sin(o%arg(4))), "<", 1.0e-10_dp, "real ones")
        ! n eps |y| |x| |A| / |lambda| a factor, with |y| |x| = 1, and as much of residuals some times over.
        call check_that(error, o%bound, "<", k * 1.0e-13_dp / moduli, "bound")
        if (allocated(error)) return
        off = distances(o%log_abs, o%arg, k * log(moduli), [0.0_dp, k * angle, -k * angle, 0.0_dp, 0.0_dp])
        call check_that(error, off, "<=", o%bound, "within the bound")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_powers

  !> [1/2 1; 0 1/2] and 0.9: the double multiplier is accurate only to the root of rounding, and its bound shows this.
  subroutine test_jordan_powers(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: counts(5) = [1, 2, 3, 18, 100]
    real(dp), parameter :: t(3, 3) = reshape([0.5_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.5_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.9_dp], [3, 3])
    real(dp) :: truth(3), a(3, 3)
    type(outcome_type) :: o
    integer :: i

    a = reflected(t)
    do i = 1, size(counts)
      associate (k => counts(i))
        call solve(spread(cmplx(a, kind=dp), 3, k), o, error, spread(1.0e-15_dp, 1, k))
        if (allocated(error)) return
        truth = k * log([0.9_dp, 0.5_dp, 0.5_dp])
        call check_that(error, abs(o%log_abs(1) - truth(1)), "<", k * 1.0e-14_dp, "single one")
        ! sqrt(1e-15) a factor.
        call check_that(error, maxval(abs(o%log_abs(2:) - truth(2:))), "<", k * 4.0e-7_dp, "double one")
        call check_that(error, distances(o%log_abs, o%arg, truth, [0.0_dp, 0.0_dp, 0.0_dp]), "<=", o%bound, "within the bound")
        call check_that(error, o%most, ">=", truth, "most")
        call check_that(error, o%bound(1), "<", k * 1.0e-12_dp, "bounds are not too wide")
        call check_that(error, o%bound(2:), "<", k * 4.0e-6_dp, "bounds are not too wide")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_jordan_powers

  subroutine test_colaneri(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: counts(4) = [64, 100, 360, 1000], steps = 8
    type(colaneri_type) :: system
    type(outcome_type) :: o
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    complex(dp), allocatable :: factors(:, :, :)
    real(dp) :: phi(2, 2)
    integer :: i, j, k

    call new_method("gauss8", method, failure)
    system%states = 2
    system%period = 2 * pi
    do i = 1, size(counts)
      allocate(factors(2, 2, counts(i)))
      do k = 1, counts(i)
        call period_map(system, method, [((k - 1 + real(j, dp) / steps) / counts(i), j = 0, steps)], [1.0_dp, 1.0_dp], phi, &
          & failure)
        call check_success(error, failure)
        if (allocated(error)) return
        factors(:, :, k) = phi
      end do
      call solve(factors, o, error)
      if (allocated(error)) return
      call check_that(error, abs(o%log_abs(1) / system%period), "<", 1.0e-10_dp, "exponent 0")
      call check_that(error, abs(o%log_abs(2) / system%period + 24), "<", 1.0e-10_dp, "exponent -24")
      call check_that(error, maxval(abs(o%arg)), "<", 1.0e-10_dp, "positive multipliers")
      if (allocated(error)) return
      deallocate(factors)
    end do
    call check_that(error, abs(exp(o%log_abs(2)) / 3.2355e-66_dp - 1), "<", 1.0e-4_dp, "published multiplier")
  end subroutine test_colaneri

  !> Moduli 1e300, ..., 1e-300 of the product, in every order along the diagonal; neighbours 120 decades apart.
  subroutine test_hidden(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 6, length = 400
    type(random_type) :: random
    type(outcome_type) :: o
    complex(dp), allocatable :: t(:, :, :)
    real(dp) :: log_abs(n), arg(n), decades(n)
    integer :: i, j, k

    call random%start(1, 41)
    allocate(t(n, n, length))
    do i = 1, 4
      decades = [300, 180, 60, -60, -180, -300]
      if (i == 2) decades = decades(n:1:-1)
      if (i > 2) decades = cshift(decades([1, 4, 2, 6, 3, 5]), i)
      do k = 1, length
        t(:, :, k) = 0.2_dp * random_matrix(random, n, n)
        do j = 1, n
          t(j + 1:, j, k) = 0
          t(j, j, k) = 10.0_dp**(decades(j) / length) * exp(cmplx(0, 2 * pi * random%draw(), dp))
        end do
      end do
      call periodic_multipliers(t, log_abs, arg)
      call check_that(error, maxval(abs(log_abs - decades * log(10.0_dp))), "<", 1.0e-10_dp, "what is hidden")
      if (allocated(error)) return
      call solve(hidden(random, t), o, error)
      if (allocated(error)) return
      ! The smallest grows by 0.18 a factor of norm 10: an error of 1e-14 each, 400 times.
      call check_that(error, maxval(abs(o%log_abs - log(10.0_dp) * [300, 180, 60, -60, -180, -300])), "<", 1.0e-10_dp, "moduli")
      call check_that(error, distances(o%log_abs, o%arg, log_abs, arg), "<", 1.0e-10_dp, "arguments")
      call check_that(error, o%bound, "<", 1.0e-8_dp, "bounds")
      if (allocated(error)) return
    end do
  end subroutine test_hidden

  subroutine test_one_factor(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    type(outcome_type) :: o
    type(gestell_error), allocatable :: failure
    complex(dp), allocatable :: values(:), right(:, :), left(:, :), a(:, :)
    integer :: n, i

    call random%start(1, 42)
    do n = 1, 12
      do i = 1, 10
        a = cmplx(real(random_matrix(random, n, n)), 0, dp)
        call eigensystem(real(a), values, right, left, failure)
        call solve(reshape(a, [n, n, 1]), o, error)
        if (allocated(error)) return
        ! Both are wrong by roundoff times the condition, which the bound knows.
        call check_that(error, distances(o%log_abs, o%arg, log(abs(values)), atan2(aimag(values), real(values))), "<=", o%bound, &
          & "in LAPACK's")
        ! Conditions of 1e4 occur.
        call check_that(error, o%bound, "<", 1.0e-9_dp, "the bound is not too wide")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_one_factor

  subroutine test_quadruple(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 4, length = 12
    type(random_type) :: random
    type(outcome_type) :: o
    complex(dp) :: factors(n, n, length)
    complex(qp) :: rho(n)
    real(qp) :: product(n, n)
    real(dp) :: off(n)
    integer :: i, k

    call random%start(1, 43)
    do i = 1, 60
      product = 0
      do k = 1, n
        product(k, k) = 1
      end do
      do k = 1, length
        factors(:, :, k) = real(random_matrix(random, n, n))
        product = matmul(real(real(factors(:, :, k)), qp), product)
      end do
      call eigenvalues(product, rho)
      call solve(factors, o, error)
      if (allocated(error)) return
      off = distances(o%log_abs, o%arg, real(log(abs(rho)), dp), real(atan2(rho%im, rho%re), dp))
      call check_that(error, off, "<=", o%bound, "within the bound")
      ! Products of random matrices are well conditioned, now and then by 1e4 worse.
      call check_that(error, off, "<", 1.0e-10_dp, "accuracy")
      if (allocated(error)) return
    end do
  end subroutine test_quadruple

  subroutine test_invariants(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: counts(4) = [1, 2, 7, 40]
    type(random_type) :: random
    type(outcome_type) :: o, turned
    type(gestell_error), allocatable :: failure
    complex(dp), allocatable :: factors(:, :, :)
    real(dp) :: log_det, part
    integer :: n, i, k

    call random%start(1, 44)
    do n = 1, 12
      do i = 1, size(counts)
        allocate(factors(n, n, counts(i)))
        log_det = 0
        do k = 1, counts(i)
          factors(:, :, k) = real(random_matrix(random, n, n))
          call log_abs_determinant(real(factors(:, :, k)), part, failure)
          log_det = log_det + part
        end do
        call solve(factors, o, error)
        if (allocated(error)) return
        ! Some factors are close to singular; their roundoff is inside the bounds.
        call check_that(error, abs(sum(o%log_abs) - log_det), "<", min(1.0e-6_dp, 1.0e-13_dp + sum(o%bound)), "Liouville")
        call check_that(error, o%log_abs(2:), "<=", o%log_abs(:n - 1) + 1.0e-7_dp, "descending")
        call check_that(error, distances(o%log_abs, -o%arg, o%log_abs, o%arg), "<=", 2 * o%bound, "conjugate pairs")
        if (allocated(error)) return
        call solve(cshift(factors, counts(i) / 3 + 1, dim=3), turned, error)
        if (allocated(error)) return
        call check_that(error, distances(o%log_abs, o%arg, turned%log_abs, turned%arg), "<=", 2 * o%bound, "cyclic start")
        if (allocated(error)) return
        deallocate(factors)
      end do
    end do
  end subroutine test_invariants

  !> Small integers, many of the products singular; permutations, on which plain sweeps cycle; disguised nilpotent factors;
  !> growth by 1e400 and back. The residuals show that the decomposition is correct.
  subroutine test_convergence(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: samples = 1500
    type(random_type) :: random
    type(outcome_type) :: o
    complex(dp), allocatable :: t(:, :, :)
    integer :: i, j, k, n

    call random%start(1, 49)
    do i = 1, samples
      n = 1 + random%pick(5)
      allocate(t(n, n, random%pick(20)))
      do k = 1, size(t, 3)
        t(:, :, k) = random_matrix(random, n, n)
        select case (modulo(i, 8))
        case (0)
          t(:, :, k) = 0
          do j = 1, n
            t(modulo(j, n) + 1, j, k) = 1
          end do
        case (1)
          do j = 1, n
            t(j:, j, k) = 0
          end do
        case default
          t(:, :, k) = nint(2 * real(t(:, :, k)))
        end select
      end do
      if (modulo(i, 8) == 1) t = hidden(random, t)
      call solve(t, o, error)
      if (allocated(error)) return
      deallocate(t)
    end do

    allocate(t(3, 3, 800))
    do k = 1, 800
      t(:, :, k) = 0.1_dp * random_matrix(random, 3, 3)
      do j = 1, 3
        t(j + 1:, j, k) = 0
        t(j, j, k) = 10.0_dp**(merge(1, -1, k <= 400) * (0.5_dp * j))
      end do
    end do
    call solve(hidden(random, t), o, error)
  end subroutine test_convergence

  subroutine test_refused(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    complex(dp), dimension(2, 2, 3) :: factors, q, r

    factors = 1
    factors(2, 1, 2) = cmplx(0, ieee_value(1.0_dp, ieee_quiet_nan), dp)
    call periodic_schur(factors, q, r, failure)
    call check_failure(error, failure, "not finite")
  end subroutine test_refused

end module test_periodic_schur
