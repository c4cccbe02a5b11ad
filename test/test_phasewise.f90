!> What the reduction is made of: matrices at many phases at once, conjugate modes in real numbers, trigonometric
!> interpolation, against the same one by one, in complex numbers, in closed form.
module test_phasewise
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_conjugates, only: add_coordinate, add_entry, complex_columns, coordinate, counts, entry, real_columns, &
    & weights
  use gestell_floquet_phasewise, only: along_phases, inverses, multiply, solve
  use gestell_floquet_resolution, only: phases_needed
  use gestell_floquet_trigonometric, only: differentiation, equidistant, interpolation, middle_differentiation, &
    & middle_interpolation
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_phasewise

  !> Of sums of about ten products of numbers up to 1.
  real(dp), parameter :: roundoff = 1.0e-14_dp

contains

  subroutine collect_phasewise(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("products, any number of phases", test_products), &
      & new_unittest("inverses, also where a pivot vanishes", test_inverses), &
      & new_unittest("a matrix that is singular at one phase", test_singular), &
      & new_unittest("conjugate modes in real numbers", test_conjugates), &
      & new_unittest("interpolation and derivatives of harmonics", test_harmonics), &
      & new_unittest("the number of phases foretold", test_foretold)]
  end subroutine collect_phasewise

  !> Numbers in (-1, 1) that look like random ones, the same in every run.
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
        call check(error, maxval([(maxval(abs(c(k, :, :) - matmul(a(k, :, :), b(k, :, :)))), k = 1, numbers(i))]) < roundoff)
        if (.not. allocated(error)) call check(error, maxval(abs(v - c(:, :, 1))) < roundoff)
        if (allocated(error)) return
        constant = a(1, :, :)
        call multiply(constant, b, c)
        call check(error, maxval([(maxval(abs(c(k, :, :) - matmul(a(1, :, :), b(k, :, :)))), k = 1, numbers(i))]) < roundoff)
        if (allocated(error)) return
        constant = b(1, :, :)
        call multiply(a, constant, c)
        call check(error, maxval([(maxval(abs(c(k, :, :) - matmul(a(k, :, :), b(1, :, :)))), k = 1, numbers(i))]) < roundoff)
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
    call check(error, .not. allocated(failure))
    if (allocated(error)) return
    call multiply(a, inverted, product)
    do k = 1, n
      product(:, k, k) = product(:, k, k) - 1
    end do
    ! The condition of these matrices is below 10.
    call check(error, maxval(abs(product)) < 10 * roundoff)
    if (allocated(error)) return
    call check(error, maxval(abs(inverted(5, :, :) - a(5, :, :))) < roundoff)
    if (allocated(error)) return
    expected = a(:, :, 1)
    call multiply(a, expected, right)
    call solve(a, right, failure)
    call check(error, maxval(abs(right - expected)) < 10 * roundoff)
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
    call check(error, allocated(failure))
  end subroutine test_singular

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
      call check(error, abs(cmplx(re(2), im(2), dp) - y(k)) < roundoff, more="coordinate")
      if (allocated(error)) return
      do l = 1, n
        call entry(g, conjugate, k, l, re, im)
        call check(error, abs(cmplx(re(2), im(2), dp) - d(k, l)) < roundoff, more="entry")
        if (allocated(error)) return
        if (counts(conjugate, k, l)) call add_entry(re, im, conjugate, k, l, again)
      end do
    end do
    call check(error, maxval(abs(again - g)) < roundoff .and. maxval(abs(w_again - w)) < roundoff, more="back again")
    if (allocated(error)) return
    r = g(2, :, :)
    s = complex_columns(r, conjugate)
    call check(error, maxval(abs(s - matmul(r, to))) < roundoff .and. maxval(abs(real_columns(s, conjugate) - r)) < roundoff, &
      & more="columns")
    if (allocated(error)) return
    call check(error, abs(norm2(abs(s))**2 - sum(spread(weights(conjugate), 1, n) * r**2)) < 10 * roundoff, more="norm")
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
      call check(error, maxval(abs(matmul(differentiation(n), cosine) + 2 * pi * k * sine)) < 100 * roundoff)
      if (.not. allocated(error)) call check(error, &
        & maxval(abs(matmul(middle_interpolation(n), cosine) - cos(2 * pi * k * middle))) < 10 * roundoff)
      if (.not. allocated(error)) call check(error, &
        & maxval(abs(matmul(middle_differentiation(n), cosine) + 2 * pi * k * sin(2 * pi * k * middle))) < 100 * roundoff)
      if (.not. allocated(error)) call check(error, &
        & maxval(abs(matmul(interpolation(n, elsewhere), cosine) - cos(2 * pi * k * elsewhere))) < 10 * roundoff)
      if (allocated(error)) return
      if (k == n / 2) cycle
      call check(error, maxval(abs(matmul(differentiation(n), sine) - 2 * pi * k * cosine)) < 100 * roundoff)
      if (.not. allocated(error)) call check(error, &
        & maxval(abs(matmul(interpolation(n, elsewhere), sine) - sin(2 * pi * k * elsewhere))) < 10 * roundoff)
      if (allocated(error)) return
    end do
  end subroutine test_harmonics

  !> 1 / (1 - q cos) has harmonics that fall by the same factor from one to the next.
  subroutine test_foretold(error)
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
      call check(error, abs(phases_needed(a, allowed, most) - max(n, expected)) <= 8)
      if (allocated(error)) return
    end do
  end subroutine test_foretold

end module test_phasewise
