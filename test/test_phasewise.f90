!> Building blocks of the reduction: matrices at many phases at once, conjugate modes in real arithmetic, trigonometric
!> interpolation, against scalar, complex and closed-form computations.
module test_phasewise
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_reduction_conjugates, only: add_coordinate, add_entry, complex_columns, coordinate, counts, entry, &
    & real_columns, weights
  use gestell_floquet_reduction_decoupling, only: motion_type
  use gestell_floquet_reduction_modes, only: modes_type
  use gestell_floquet_reduction_phasewise, only: along_phases, inverses, multiply, solve
  use gestell_floquet_reduction_residuals, only: measure, measure_forcing, residuals_type
  use gestell_floquet_reduction_resolution, only: phases_needed
  use gestell_floquet_reduction_trigonometric, only: differentiation, equidistant, interpolation, middle_differentiation, &
    & middle_interpolation
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
  use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
  implicit none (type, external)
  private

  public :: collect_phasewise

  !> Rounding of sums of about ten products of numbers up to 1.
  real(dp), parameter :: roundoff = 1.0e-14_dp

contains

  subroutine collect_phasewise(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("products at any number of phases agree with single products", test_products), &
      & new_unittest("inverses are correct even if a pivot vanishes", test_inverses), &
      & new_unittest("a matrix singular at one phase is reported", test_singular), &
      & new_unittest("NaN at one phase never yields a finite result", test_no_number), &
      & new_unittest("conjugate modes in real arithmetic agree with complex arithmetic", test_conjugates), &
      & new_unittest("trigonometric interpolation and its derivative are exact for all harmonics", test_harmonics), &
      & new_unittest("the predicted number of phases agrees with geometric decay", test_predicted_phases), &
      & new_unittest("residual, condition and effort of a reduction agree with hand calculation", test_residuals)]
  end subroutine collect_phasewise

  !> Pseudo-random numbers in (-1, 1), the same in every run.
  pure function scattered(phases, n, seed) result(a)
    integer, intent(in) :: phases, n, seed
    real(dp) :: a(phases, n, n)
    integer :: i, j, k

    do k = 1, n
      do j = 1, n
        a(:, j, k) = [(2 * modulo(sqrt(2.0_dp) * (i + 7 * j**2 + 31 * k**3 + seed) * i, 1.0_dp) - 1, i = 1, phases)]
      end do
    end do
  end function scattered

  subroutine test_products(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: numbers(5) = [1, 7, 8, 19, 40]
    real(dp), allocatable :: a(:, :, :), b(:, :, :), c(:, :, :), v(:, :), constant(:, :)
    integer :: i, n, k

    do i = 1, size(numbers)
      do n = 1, 7
        allocate(a, source=scattered(numbers(i), n, 1))
        allocate(b, source=scattered(numbers(i), n, 2))
        allocate(c, mold=a)
        allocate(v, mold=a(:, :, 1))
        call multiply(a, b, c)
        call multiply(a, b(:, :, 1), v)
        call check_that(error, maxval([(maxval(abs(c(k, :, :) - matmul(a(k, :, :), b(k, :, :)))), k = 1, numbers(i))]), "<", &
          & roundoff, "product of all phases")
        if (.not. allocated(error)) call check_that(error, maxval(abs(v - c(:, :, 1))), "<", roundoff, "with a vector")
        if (allocated(error)) return
        constant = a(1, :, :)
        call multiply(constant, b, c)
        call check_that(error, maxval([(maxval(abs(c(k, :, :) - matmul(a(1, :, :), b(k, :, :)))), k = 1, numbers(i))]), "<", &
          & roundoff, "constant first factor")
        if (allocated(error)) return
        constant = b(1, :, :)
        call multiply(a, constant, c)
        call check_that(error, maxval([(maxval(abs(c(k, :, :) - matmul(a(k, :, :), b(1, :, :)))), k = 1, numbers(i))]), "<", &
          & roundoff, "constant second factor")
        if (allocated(error)) return
        deallocate(a, b, c, v)
      end do
    end do
  end subroutine test_products

  !> Zeros on the diagonal are no pivots, but the matrix is its own inverse.
  subroutine test_inverses(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: phases = 11, n = 4
    real(dp), dimension(phases, n, n) :: a, inverted, product
    real(dp) :: right(phases, n), expected(phases, n)
    type(gestell_error), allocatable :: failure
    integer :: k

    a = 0.2_dp * scattered(phases, n, 3)
    do k = 1, n
      a(:, k, k) = a(:, k, k) + 1
    end do
    a(5, :, :) = reshape([0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, &
      & 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp], [n, n])
    call inverses(a, inverted, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call multiply(a, inverted, product)
    do k = 1, n
      product(:, k, k) = product(:, k, k) - 1
    end do
    ! The condition of these matrices is below 10.
    call check_that(error, maxval(abs(product)), "<", 10 * roundoff, "inverse")
    call check_that(error, maxval(abs(inverted(5, :, :) - a(5, :, :))), "<", roundoff, "inverse of a phase")
    if (allocated(error)) return
    expected = a(:, :, 1)
    call multiply(a, expected, right)
    call solve(a, right, failure)
    call check_that(error, maxval(abs(right - expected)), "<", 10 * roundoff, "solution")
  end subroutine test_inverses

  subroutine test_singular(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: a(9, 2, 2), inverted(9, 2, 2)
    type(gestell_error), allocatable :: failure

    a(:, 1, 1) = 1
    a(:, 1, 2) = 2
    a(:, 2, 1) = 2
    a(:, 2, 2) = 1
    a(3, 2, 2) = 4
    call inverses(a, inverted, failure)
    call check_failure(error, failure)
  end subroutine test_singular

  !> NaN must not come out as a finite number. (Traps are off because NaN is intended.)
  subroutine test_no_number(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: a(9, 2, 2), inverted(9, 2, 2)
    type(gestell_error), allocatable :: failure
    logical :: traps(size(ieee_usual))

    call ieee_get_halting_mode(ieee_usual, traps)
    call ieee_set_halting_mode(ieee_usual, .false.)
    a = 0
    a(:, 1, 1) = 1
    a(:, 2, 2) = 1
    a(4, 1, 1) = ieee_value(1.0_dp, ieee_quiet_nan)
    call inverses(a, inverted, failure)
    if (.not. allocated(failure)) call check(error, any(ieee_is_nan(inverted(4, :, :))), more="a singular matrix has an inverse")
    call ieee_set_flag(ieee_usual, .false.)
    call ieee_set_halting_mode(ieee_usual, traps)
  end subroutine test_no_number

  !> D = K^-1 G K and y = K^-1 w with K written out, a pair whose columns are not neighbours among the others.
  subroutine test_conjugates(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 5, conjugate(n) = [4, 2, 5, 1, 3]
    real(dp) :: g(3, n, n), again(3, n, n), w(3, n), w_again(3, n), re(3), im(3), r(n, n)
    complex(dp) :: to(n, n), from(n, n), d(n, n), s(n, n), y(n)
    integer :: k, l

    to = 0
    from = 0
    do k = 1, n
      if (conjugate(k) == k) then
        to(k, k) = 1
        from(k, k) = 1
      else if (conjugate(k) > k) then
        l = conjugate(k)
        to([k, l], k) = [(1.0_dp, 0.0_dp), (0.0_dp, 1.0_dp)]
        to([k, l], l) = [(1.0_dp, 0.0_dp), (0.0_dp, -1.0_dp)]
        from(k, [k, l]) = [(0.5_dp, 0.0_dp), (0.0_dp, -0.5_dp)]
        from(l, [k, l]) = [(0.5_dp, 0.0_dp), (0.0_dp, 0.5_dp)]
      end if
    end do
    g = scattered(3, n, 4)
    w = g(:, :, 1)
    d = matmul(from, matmul(g(2, :, :), to))
    y = matmul(from, w(2, :))
    again = 0
    w_again = 0
    do k = 1, n
      call coordinate(w, conjugate, k, re, im)
      if (k <= conjugate(k)) call add_coordinate(re, im, conjugate, k, w_again)
      call check_that(error, abs(cmplx(re(2), im(2), dp) - y(k)), "<", roundoff, "coordinate")
      if (allocated(error)) return
      do l = 1, n
        call entry(g, conjugate, k, l, re, im)
        call check_that(error, abs(cmplx(re(2), im(2), dp) - d(k, l)), "<", roundoff, "entry")
        if (allocated(error)) return
        if (counts(conjugate, k, l)) call add_entry(re, im, conjugate, k, l, again)
      end do
    end do
    call check_that(error, maxval(abs(again - g)), "<", roundoff, "transformed back")
    call check_that(error, maxval(abs(w_again - w)), "<", roundoff, "transformed back")
    if (allocated(error)) return
    r = g(2, :, :)
    s = complex_columns(r, conjugate)
    call check_that(error, maxval(abs(s - matmul(r, to))), "<", roundoff, "columns")
    call check_that(error, maxval(abs(real_columns(s, conjugate) - r)), "<", roundoff, "columns")
    call check_that(error, abs(norm2(abs(s))**2 - sum(spread(weights(conjugate), 1, n) * r**2)), "<", 10 * roundoff, "norm")
  end subroutine test_conjugates

  !> exp(2 pi i k phase) for all orders that N phases resolve, and the cosine of order N / 2.
  subroutine test_harmonics(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 16
    real(dp), parameter :: elsewhere(5) = [0.0_dp, 0.1_dp, 0.25_dp, 0.999_dp, 1.0_dp]
    real(dp) :: cosine(n), sine(n), middle(n)
    integer :: k

    middle = equidistant(n, 0.5_dp)
    do k = 0, n / 2
      cosine = cos(2 * pi * k * equidistant(n))
      sine = sin(2 * pi * k * equidistant(n))
      ! Sums of n terms up to n pi.
      call check_that(error, maxval(abs(matmul(differentiation(n), cosine) + 2 * pi * k * sine)), "<", 100 * roundoff, &
        & "derivative of the cosine")
      if (.not. allocated(error)) call check_that(error, &
        & maxval(abs(matmul(middle_interpolation(n), cosine) - cos(2 * pi * k * middle))), "<", 10 * roundoff, &
        & "cosine in the middle")
      if (.not. allocated(error)) call check_that(error, &
        & maxval(abs(matmul(middle_differentiation(n), cosine) + 2 * pi * k * sin(2 * pi * k * middle))), "<", 100 * roundoff, &
        & "derivative in the middle")
      if (.not. allocated(error)) call check_that(error, &
        & maxval(abs(matmul(interpolation(n, elsewhere), cosine) - cos(2 * pi * k * elsewhere))), "<", 10 * roundoff, &
        & "cosine elsewhere")
      if (allocated(error)) return
      if (k == n / 2) cycle
      call check_that(error, maxval(abs(matmul(differentiation(n), sine) - 2 * pi * k * cosine)), "<", 100 * roundoff, &
        & "derivative of the sine")
      if (.not. allocated(error)) call check_that(error, &
        & maxval(abs(matmul(interpolation(n, elsewhere), sine) - sin(2 * pi * k * elsewhere))), "<", 10 * roundoff, &
        & "sine elsewhere")
      if (allocated(error)) return
    end do
  end subroutine test_harmonics

  !> 1 / (1 - q cos) has harmonics that fall by the same factor from one to the next.
  subroutine test_predicted_phases(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 32, most = 128
    real(dp), parameter :: factors(4) = [0.1_dp, 0.4_dp, 0.6_dp, 0.9_dp], allowed = 1.0e-10_dp
    real(dp) :: a(n, 1, 1), q
    integer :: i, expected

    do i = 1, size(factors)
      ! sum of 2 r^k cos(k x) / (1 - r^2) is 1 / (1 + r^2 - 2 r cos x).
      q = factors(i)
      a(:, 1, 1) = (1 - q**2) / (1 + q**2 - 2 * q * cos(2 * pi * equidistant(n)))
      expected = 8 * ceiling(2 * log(allowed / 2) / log(q) / 8)
      if (expected >= most) expected = n
      call check_that(error, abs(phases_needed(a, allowed, most) - max(n, expected)), "<=", 8, "phases")
      if (allocated(error)) return
    end do
    ! Even harmonics only, 0.1^j of order 2 j: from order 20.6 on they are below 1e-10. Those foretold from are up to an order
    ! nearer to each other than counted.
    a(:, 1, 1) = 0.99_dp / (1.01_dp - 0.2_dp * cos(4 * pi * equidistant(n)))
    call check_that(error, phases_needed(a, allowed, most), ">=", 41, "even harmonics")
    call check_that(error, phases_needed(a, allowed, most), "<=", 56, "even harmonics")
    if (allocated(error)) return
    ! Straight lines are foretold exactly, to the next multiple of 8: order 33.2 for 0.5.
    a(:, 1, 1) = 0.75_dp / (1.25_dp - cos(2 * pi * equidistant(n)))
    call check(error, phases_needed(a, 2 * 0.5_dp**33.2_dp, most), 72, more="the next multiple")
    if (allocated(error)) return
    ! Harmonics that do not decay allow no prediction.
    a = 0
    a(1, 1, 1) = 1
    call check(error, phases_needed(a, allowed, most), n, more="a peak")
  end subroutine test_predicted_phases

  !> cos(12 pi phase) on 8 phases looks like cos(4 pi phase); in the middle between them the two have opposite signs and the
  !> size sqrt(1/2).
  subroutine test_residuals(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 8
    real(dp), dimension(n, 2, 2) :: a, s, d
    real(dp) :: start(2, 2), start_inverse(2, 2), f(n, 2), p(n, 2), g(n, 2)
    type(modes_type) :: modes
    type(motion_type) :: between
    type(residuals_type) :: residuals
    type(gestell_error), allocatable :: failure

    allocate(modes%group, modes%conjugate, source=[1, 2])
    s = 0
    s(:, 1, 1) = 1
    s(:, 2, 2) = 1
    a = 0
    a(:, 1, 1) = cos(12 * pi * equidistant(n, 0.5_dp))
    d = 0
    d(:, 1, 1) = cos(12 * pi * equidistant(n))
    start = reshape([1.0_dp, 0.0_dp, 3.0_dp, 1.0_dp], [2, 2])
    start_inverse = reshape([1.0_dp, 0.0_dp, -3.0_dp, 1.0_dp], [2, 2])
    call measure(a, s, d, modes, start, start_inverse, residuals, between, failure)
    call check_that(error, abs(residuals%residual - sqrt(2.0_dp)), "<", 100 * roundoff, "residual")
    ! The norms of the columns `start` and of their inverse are sqrt(1 + 9 + 1).
    call check_that(error, abs(residuals%condition - 11), "<", 100 * roundoff, "condition")
    if (allocated(error)) return
    ! Without a response the load is all there is: (1 3; 0 1) (1, 4) = (13, 4); half its fast part is not removed.
    f(:, 1) = 1
    f(:, 2) = 4
    p = 0
    g = 0.5_dp * f
    call measure_forcing(a, f, p, g, between, modes, start, 2.0_dp, residuals)
    call check_that(error, abs(residuals%effort - sqrt(185.0_dp)), "<", 100 * roundoff, "effort")
    call check_that(error, abs(residuals%forcing_residual - 6), "<", 100 * roundoff, "residual of the load")
  end subroutine test_residuals

end module test_phasewise
