!> Jets, cosines, Fourier series and the LAPACK gateway by closed forms.
module test_base
  use checks, only: check_failure, check_success, check_that
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_base_error, only: fatal_error, gestell_error => error_type
  use gestell_math_series_fourier, only: find_series, fourier_series, fourier_type
  use gestell_math_jet, only: cos, jet, operator(*), operator(+), operator(-), operator(/), sin, sqrt
  use gestell_base_kinds, only: dp, pi
  use gestell_base_words, only: character_count
  use gestell_math_lapack, only: eigensystem, inverse, log_abs_determinant, symmetric_pencil
  use gestell_math_series_trigonometric, only: series_through, series_type
  use reference_linear, only: qp
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_base

contains

  subroutine collect_base(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("every error message is one line of bounded length", test_messages), &
      & new_unittest("every operation on jets yields the derivatives computed by hand", test_jets), &
      & new_unittest("cosine and sine are accurate to the last digit", test_circle), &
      & new_unittest("Fourier series reproduce every order below half the number of samples", test_orders), &
      & new_unittest("derivatives of Fourier series agree with closed forms", test_derivatives), &
      & new_unittest("the tail of a Fourier series is its upper third relative to the maximum", test_tail), &
      & new_unittest("the estimated size of the omitted Fourier orders covers the next order", test_beyond), &
      & new_unittest("Fourier series find maxima of either sign between the samples", test_peaks), &
      & new_unittest("Taylor coefficients sum series of up to 1023 orders to rounding accuracy", test_tabulated), &
      & new_unittest("eigenvalues of a diagonal symmetric pencil are the quotients, in ascending order", test_pencil), &
      & new_unittest("the inversion of a singular matrix fails", test_singular), &
      & new_unittest("right and left eigenvectors of a nonsymmetric matrix satisfy their defining equations", test_eigenvectors)]
  end subroutine collect_base

  !> Any text: ends of lines and control characters, long words, many words, characters cut in the middle.
  subroutine test_messages(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    character(len=*), parameter :: newline = new_line("a")
    integer, parameter :: longest = 970
    integer :: i, k

    call fatal_error(failure, "a" // newline // "b" // achar(27) // "c: there is no such file", 2)
    call check_that(error, failure%message, "==", "a?b?c: there is no such file", "two lines")
    do i = 0, 3
      ! é has two bytes: the preceding text shifts the place where the text is cut
      call fatal_error(failure, repeat("x", i) // repeat("é", 50000) // repeat(" é", 50000), 2)
      call check_that(error, len(failure%message), "<=", longest, "a long message")
      call check_that(error, verify(failure%message, "xé. "), "==", 0, "no character is cut")
      call check_that(error, character_count(failure%message), "==", (len(failure%message) + count([(failure%message(k:k) == " " &
        & .or. failure%message(k:k) == "." .or. failure%message(k:k) == "x", k = 1, len(failure%message))])) / 2, "characters")
    end do
  end subroutine test_messages

  !> t = 3 as values, with first derivatives 1 and second derivatives zero or not: f(t) = t, g(t) = t^2 / 4.
  subroutine test_jets(error)
    type(error_type), allocatable, intent(out) :: error
    type(jet), parameter :: f = jet(3.0_dp, 1.0_dp, 0.0_dp), g = jet(2.25_dp, 1.5_dp, 0.5_dp)

    call compare(f + g, 5.25_dp, 2.5_dp, 0.5_dp, "sum")
    call compare(g + 2.0_dp, 4.25_dp, 1.5_dp, 0.5_dp, "sum with a constant")
    call compare(f - g, 0.75_dp, -0.5_dp, -0.5_dp, "difference")
    call compare(g - 2.0_dp, 0.25_dp, 1.5_dp, 0.5_dp, "difference with a constant")
    call compare(-g, -2.25_dp, -1.5_dp, -0.5_dp, "negative")
    ! t^3 / 4, 3 t^2 / 4, 3 t / 2.
    call compare(f * g, 6.75_dp, 6.75_dp, 4.5_dp, "product")
    call compare(2.0_dp * g, 4.5_dp, 3.0_dp, 1.0_dp, "product with a constant")
    ! 4 / t, -4 / t^2, 8 / t^3.
    call compare(f / g, 4 / 3.0_dp, -4 / 9.0_dp, 8 / 27.0_dp, "quotient")
    ! t / 2; and sqrt(t).
    call compare(sqrt(g), 1.5_dp, 0.5_dp, 0.0_dp, "root of a square")
    call compare(sqrt(f), sqrt(3.0_dp), 0.5_dp / sqrt(3.0_dp), -0.25_dp / sqrt(27.0_dp), "root")
    ! (sin g)'' = cos(g) g'' - sin(g) g'^2, (cos g)'' = -sin(g) g'' - cos(g) g'^2.
    call compare(sin(g), sin(2.25_dp), 1.5_dp * cos(2.25_dp), 0.5_dp * cos(2.25_dp) - 2.25_dp * sin(2.25_dp), "sine")
    call compare(cos(g), cos(2.25_dp), -1.5_dp * sin(2.25_dp), -0.5_dp * sin(2.25_dp) - 2.25_dp * cos(2.25_dp), "cosine")

  contains

    !> A few roundings of numbers below 10.
    subroutine compare(a, v, d, dd, what)
      type(jet), intent(in) :: a
      real(dp), intent(in) :: v, d, dd
      character(len=*), intent(in) :: what

      if (allocated(error)) return
      call check_that(error, maxval(abs([a%v - v, a%d - d, a%dd - dd])), "<", 1.0e-14_dp, what)
    end subroutine compare

  end subroutine test_jets

  subroutine test_circle(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: reach(6) = [1.0e-9_dp, 1.0_dp, 10.0_dp, 1.0e3_dp, 0.999e6_dp, 1.0e9_dp]
    real(dp) :: angles(101), c(101), s(101), defect
    integer :: i, k

    do i = 1, size(reach)
      angles = [(reach(i) * (k - 51) / 50.0_dp, k = 1, 101)]
      call compare()
      if (allocated(error)) return
    end do
    ! Angles where the sine or the cosine vanishes, half way between, and close to these.
    do i = -2, 2
      angles = [((k - 51) * pi / 4 + i * 1.0e-8_dp, k = 1, 101)]
      call compare()
      if (allocated(error)) return
    end do
    ! Where the series are longest, rounding errors change sign from angle to angle; a missing term would not.
    angles = [(pi / 4 - k * 1.0e-5_dp / 3, k = 1, 101)]
    call cosine_sine(angles, c, s)
    defect = real(abs(sum(c - cos(real(angles, qp)))) + abs(sum(s - sin(real(angles, qp)))), dp) / 101
    call check_that(error, defect, "<", 0.12_dp * epsilon(1.0_dp), "on average")

  contains

    subroutine compare()
      call cosine_sine(angles, c, s)
      defect = real(max(maxval(abs(c - cos(real(angles, qp)))), maxval(abs(s - sin(real(angles, qp))))), dp)
      ! Rounding of the reduced angle, of the last sum and of its terms.
      call check_that(error, defect, "<", 0.8_dp * epsilon(1.0_dp), "defect at most")
    end subroutine compare

  end subroutine test_circle

  !> Three series of 64, 200 and 1023 orders, whose amplitudes stay, fall like 1/k and fall fast: with the Taylor coefficients they
  !> have the values and derivatives of the sum over the orders, in quadruple precision, and no error of a derivative is more than
  !> some roundings of the sum of its terms' sizes. Phases at places, halfway between them, at and beyond the ends of the turn.
  subroutine test_tabulated(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: orders(3) = [64, 200, 1023]
    real(dp), parameter :: phases(*) = [0.0_dp, 0.25_dp, 1 / 3.0_dp, 0.1_dp, 0.4995_dp, 0.5_dp + 1 / 8192.0_dp, 0.77777_dp, &
      & 1 - epsilon(1.0_dp), 1.0_dp, -0.3_dp, 1.3_dp]
    real(dp), dimension(size(phases), 3) :: f, f_d, f_dd
    type(series_type) :: series
    real(qp) :: angle, along, exact(0:2), terms(0:2)
    real(dp) :: off(0:2), maximum
    integer :: i, j, k, p

    do i = 1, size(orders)
      if (allocated(series%cosine)) deallocate(series%cosine, series%sine)
      allocate(series%cosine(0:orders(i), 3), series%sine(0:orders(i), 3))
      do k = 0, orders(i)
        series%cosine(k, :) = [cos(0.7_dp * k), cos(1.3_dp * k) / (k + 1), exp(-0.1_dp * k)]
        series%sine(k, :) = [sin(0.4_dp * k**2), sin(2.1_dp * k) / (k + 1), -exp(-0.1_dp * k)]
      end do
      series%sine(0, :) = 0
      call series%tabulate()
      call series%values(phases, f, f_d, f_dd)
      maximum = 0
      do j = 1, 3
        do p = 1, size(phases)
          exact = 0
          terms = 0
          do k = 0, orders(i)
            angle = k * 2 * acos(-1.0_qp) * phases(p)
            along = series%cosine(k, j) * cos(angle) + series%sine(k, j) * sin(angle)
            exact = exact + [along, k * (series%sine(k, j) * cos(angle) - series%cosine(k, j) * sin(angle)), &
              & -real(k, qp)**2 * along]
            terms = terms + hypot(series%cosine(k, j), series%sine(k, j)) * [1.0_qp, real(k, qp), real(k, qp)**2]
          end do
          off = real(abs([f(p, j), f_d(p, j), f_dd(p, j)] - exact) / terms, dp)
          maximum = max(maximum, maxval(off))
        end do
      end do
      ! A phase is rounded by epsilon/2 of a turn; for order k this error counts k times.
      call check_that(error, maximum, "<", (8 + 2 * orders(i)) * epsilon(1.0_dp), "error over the sum of the terms")
      if (allocated(error)) return
    end do
  end subroutine test_tabulated

  !> cos(k t + 0.3) sampled n times, for every order k that n samples can distinguish, all orders together and each by itself.
  subroutine test_orders(error)
    type(error_type), allocatable, intent(out) :: error
    type(fourier_type), allocatable :: together(:)
    real(dp), allocatable :: samples(:, :)
    integer :: n, k, i

    do n = 3, 24
      samples = reshape([((cos(k * 2 * pi * (i - 1) / n + 0.3_dp), k = 0, (n - 1) / 2), i = 1, n)], [(n + 1) / 2, n])
      allocate(together(0:(n - 1) / 2))
      call find_series(samples, together)
      do k = 0, (n - 1) / 2
        call check_order(error, together(k), n, k)
        if (.not. allocated(error)) call check_order(error, fourier_series(samples(k + 1, :)), n, k)
        if (allocated(error)) return
      end do
      deallocate(together)
    end do

  contains

    subroutine check_order(error, series, n, k)
      type(error_type), allocatable, intent(out) :: error
      type(fourier_type), intent(in) :: series
      integer, intent(in) :: n, k

      call check(error, size(series%amplitude), (n - 1) / 2)
      if (.not. allocated(error)) call check(error, size(series%phase), (n - 1) / 2)
      ! Sums of n roundings
      if (.not. allocated(error)) call check(error, series%mean, merge(cos(0.3_dp), 0.0_dp, k == 0), thr=1.0e-14_dp)
      if (.not. allocated(error)) call check_that(error, maxval(abs([(series%amplitude(i) - merge(1.0_dp, 0.0_dp, i == k), &
        & i = 1, (n - 1) / 2)])), "<", 1.0e-14_dp, "amplitudes")
      if (.not. allocated(error) .and. k > 0) call check(error, series%phase(k), 0.3_dp, thr=1.0e-13_dp)
    end subroutine check_order

  end subroutine test_orders

  subroutine test_derivatives(error)
    type(error_type), allocatable, intent(out) :: error
    type(fourier_type) :: series
    real(dp) :: f(3)
    real(dp), parameter :: t = 0.9_dp

    series%mean = 0.2_dp
    series%amplitude = [1.0_dp, 0.0_dp, 2.0_dp]
    series%phase = [0.0_dp, 0.0_dp, 0.4_dp]
    f = series%value(t)
    call check(error, f(1), 0.2_dp + cos(t) + 2 * cos(3 * t + 0.4_dp), thr=1.0e-14_dp)
    if (allocated(error)) return
    call check(error, f(2), -sin(t) - 6 * sin(3 * t + 0.4_dp), thr=1.0e-14_dp)
    if (allocated(error)) return
    call check(error, f(3), -cos(t) - 18 * cos(3 * t + 0.4_dp), thr=1.0e-13_dp)
  end subroutine test_derivatives

  !> The upper third of nine orders is 7 to 9; sizes are relative to the largest, the mean included.
  subroutine test_tail(error)
    type(error_type), allocatable, intent(out) :: error
    type(fourier_type) :: series

    series%phase = [0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp]
    series%mean = -8.0e-6_dp
    series%amplitude = 1.0e-6_dp * [4.0_dp, 3.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 2.0_dp, 1.0_dp, 0.0_dp, 0.5_dp]
    call check(error, series%tail(), 1 / 8.0_dp, thr=1.0e-15_dp)
    if (allocated(error)) return
    series%mean = 0
    call check(error, series%tail(), 1 / 4.0_dp, thr=1.0e-15_dp)
    if (allocated(error)) return
    series%amplitude = 0
    call check(error, series%tail(), 0.0_dp)
  end subroutine test_tail

  !> 1/(1 - r e^it) = sum of r^k e^ikt: the first order omitted after order 23 is r^24. It is estimated as the maximum of the
  !> last three, r^21, times their ratio to the four before, r^4, or a tenth.
  subroutine test_beyond(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: samples = 48
    real(dp), parameter :: ratios(3) = [0.5_dp, 0.6_dp, 0.7_dp], expected(3) = [0.1_dp * 0.5_dp**21, 0.6_dp**25, 0.7_dp**25]
    complex(dp) :: f(samples)
    type(series_type) :: series
    real(dp) :: beyond(2)
    integer :: i, k

    do i = 1, size(ratios)
      f = 1 / (1 - ratios(i) * exp([(cmplx(0, 2 * pi * k / samples, dp), k = 0, samples - 1)]))
      series = series_through(reshape([real(f), aimag(f)], [samples, 2]))
      beyond = series%beyond()
      print "(a, 4es10.2)", "         next order, expected estimate, estimates: ", ratios(i)**24, expected(i), beyond
      ! Orders 25 to 27 alias to 23 to 21: r^27 is added to r^21, an eighth of it at most, in both ranges.
      call check_that(error, abs(beyond / expected(i) - 1), "<", 0.6_dp, "estimate")
      call check_that(error, beyond, ">", 0.5_dp * ratios(i)**24, "estimate below half of the omitted order")
      if (allocated(error)) return
    end do
  end subroutine test_beyond

  !> The maximum size of cos(t - shift) with a mean lies between samples, above or below zero. The series of a step function
  !> oscillates, but its peak remains near the largest sample.
  subroutine test_peaks(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 16
    type(fourier_type) :: series
    real(dp) :: samples(n), fine(3)
    integer :: i, k

    do k = 1, 20
      samples = [(0.3_dp * (-1)**k + 2 * (-1)**k * cos(2 * pi * (i - 1) / n - 0.31_dp * k), i = 1, n)]
      series = fourier_series(samples)
      call check(error, series%peak(samples), 2.3_dp, thr=1.0e-14_dp, more="one wave")
      if (allocated(error)) return
    end do

    samples = 0
    samples(3) = 1
    series = fourier_series(samples)
    fine = series%value(2 * pi * 2 / n)
    call check_that(error, series%peak(samples), ">=", 1.0_dp, "not below the samples")
    call check_that(error, series%peak(samples), "<=", maxval([(abs(value_at(2 * pi * i / 5000)), i = 1, 5000)]) + 1.0_dp / n, &
      & "pulse")
    if (allocated(error)) return
    ! Alternating signs belong to no order below half the number of samples, so the sample itself counts.
    samples = [(0.1_dp - (-1)**i * 0.5_dp, i = 1, n)]
    samples(2) = -1
    series = fourier_series(samples)
    call check_that(error, series%peak(samples), ">=", 1.0_dp, "negative")
    if (allocated(error)) return
    samples = 0
    series = fourier_series(samples)
    call check(error, series%peak(samples), 0.0_dp, more="zero")
    if (allocated(error)) return
    samples = -3
    series = fourier_series(samples)
    call check(error, series%peak(samples), 3.0_dp, thr=1.0e-14_dp, more="constant")

  contains

    real(dp) function value_at(t)
      real(dp), intent(in) :: t
      real(dp) :: f(3)

      f = series%value(t)
      value_at = f(1)
    end function value_at

  end subroutine test_peaks

  !> Diagonal matrices: the quotients of their entries, ascending.
  subroutine test_pencil(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: values(:)

    call symmetric_pencil(reshape([8.0_dp, 0.0_dp, 0.0_dp, 3.0_dp], [2, 2]), reshape([2.0_dp, 0.0_dp, 0.0_dp, 3.0_dp], [2, 2]), &
      & values, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, maxval(abs(values - [1.0_dp, 4.0_dp])), "<", 1.0e-14_dp, "eigenvalues")
    if (allocated(error)) return
    call symmetric_pencil(reshape([8.0_dp, 0.0_dp, 0.0_dp, 3.0_dp], [2, 2]), reshape([2.0_dp, 0.0_dp, 0.0_dp, -3.0_dp], [2, 2]), &
      & values, failure)
    call check_failure(error, failure, "positive definite")
  end subroutine test_pencil

  subroutine test_singular(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: inverted(:, :)
    real(dp) :: a(2, 2), value

    a = reshape([1.0_dp, 2.0_dp, 2.0_dp, 4.0_dp], [2, 2])
    call inverse(a, inverted, failure)
    call check_failure(error, failure)
    if (allocated(error)) return
    call log_abs_determinant(a, value, failure)
    call check_failure(error, failure)
    if (allocated(error)) return
    a(2, 2) = -1
    call inverse(a, inverted, failure)
    call check_that(error, maxval(abs(inverted - reshape([1.0_dp, 2.0_dp, 2.0_dp, -1.0_dp], [2, 2]) / 5)), "<", 1.0e-15_dp, &
      & "inverse")
    if (allocated(error)) return
    call log_abs_determinant(a, value, failure)
    call check(error, value, log(5.0_dp), thr=1.0e-15_dp)
  end subroutine test_singular

  !> A x = lambda x and y* A = lambda y*, for a matrix with a complex pair and a real value, far from symmetric.
  subroutine test_eigenvectors(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    complex(dp), allocatable :: values(:), right(:, :), left(:, :)
    real(dp) :: a(3, 3)
    integer :: k

    a = reshape([1.0_dp, 4.0_dp, 0.5_dp, -3.0_dp, 2.0_dp, 7.0_dp, 1.0_dp, 0.0_dp, -2.0_dp], [3, 3])
    call eigensystem(a, values, right, left, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, count(abs(aimag(values)) > 1), 2, more="a pair")
    if (allocated(error)) return
    do k = 1, 3
      ! Roundings of a matrix of norm 9.
      call check_that(error, maxval(abs(matmul(a, right(:, k)) - values(k) * right(:, k))), "<", 1.0e-13_dp, "right")
      call check_that(error, maxval(abs(matmul(conjg(left(:, k)), a) - values(k) * conjg(left(:, k)))), "<", 1.0e-13_dp, "left")
      if (allocated(error)) return
    end do
  end subroutine test_eigenvectors

end module test_base
