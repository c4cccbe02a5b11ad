!> Products, linear equations, factors of polynomials, pairs of eigenvalues and maxima in eight lanes, against scalar versions
!> in quadruple precision and closed forms.
module test_lane_numerics
  use checks, only: check_that
  use gestell_base_processor, only: vector_length
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_multipliers_gershgorin, only: discs_type, find_discs
  use gestell_math_batch_characteristic_roots, only: find_roots, guess_roots
  use gestell_math_batch_hessenberg, only: hessenberg_type, max_states, new_hessenberg
  use gestell_math_lanes, only: lanes
  use gestell_math_lanes_equations, only: solve_equations
  use gestell_math_lanes_peaks, only: largest_values
  use gestell_math_lanes_products, only: multiply
  use gestell_math_batch_quadratic_factors, only: find_factors
  use reference_linear, only: qp, solve
  use reference_random, only: random_type
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_lane_numerics

contains

  subroutine collect_lane_numerics(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("vectorised matrix products agree with quadruple precision", test_products), &
      & new_unittest("vectorised linear equations and inverse norms agree with quadruple precision", test_equations), &
      & new_unittest("singular equations in one lane are reported and affect no other lane", test_singular), &
      & new_unittest("quadratic factors of conjugate roots are found", test_conjugate), &
      & new_unittest("quadratic factors of real roots are correct or marked as not found", test_real), &
      & new_unittest("error discs of conjugate pairs hold for both members", test_pairs), &
      & new_unittest("maxima of trigonometric functions agree with closed forms", test_largest)]
  end subroutine collect_lane_numerics

  function draw(random, n) result(values)
    type(random_type), intent(inout) :: random
    integer, intent(in) :: n
    real(dp) :: values(n)
    integer :: i

    do i = 1, n
      values(i) = 2 * random%draw() - 1
    end do
  end function draw

  subroutine test_products(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp), allocatable :: rows(:, :, :), b(:, :, :), c(:, :, :)
    real(qp), allocatable :: exact(:, :)
    integer :: n, columns, lane

    call random%start(11, 1)
    do n = 1, 7
      do columns = n, n + 1
        rows = reshape(draw(random, lanes * columns * n), [lanes, columns, n])
        b = reshape(draw(random, lanes * n * columns), [lanes, n, columns])
        allocate(c(lanes, n, columns))
        call multiply(vector_length(), n, columns, 0.5_dp, rows, b, c)
        do lane = 1, lanes
          ! A rounding for each of n terms below 1.
          exact = matmul(real(transpose(rows(lane, :n, :)), qp), real(b(lane, :, :), qp)) / 2
          call check_that(error, maxval(abs(c(lane, :, :) - exact)), "<=", real(n**2 * epsilon(1.0_dp), qp), "product")
          if (allocated(error)) return
        end do
        deallocate(c)
      end do
    end do
  end subroutine test_products

  subroutine test_equations(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp), allocatable :: equations(:, :, :), before(:, :, :), x(:, :)
    real(dp) :: inverse_norm(lanes), roundoff
    real(qp), allocatable :: exact(:, :), right(:, :)
    integer :: n, lane, i

    call random%start(12, 1)
    do n = 1, 12
      equations = reshape(draw(random, lanes * n * (n + 1)), [lanes, n, n + 1])
      ! Zeros on the diagonal: without exchanges elimination would divide by zero.
      if (n > 1) then
        do i = 1, n
          equations(:, i, i) = 0
        end do
      end if
      before = equations
      allocate(x(lanes, n), right(n, n + 1))
      call solve_equations(n, equations, x, inverse_norm)
      do lane = 1, lanes
        right = 0
        do i = 1, n
          right(i, i) = 1
        end do
        right(:, n + 1) = before(lane, :, n + 1)
        exact = solve(real(before(lane, :, :n), qp), right)
        ! Reflections change a matrix by n^2 roundings of its norm at most, as a rule by few; a pivot, its reciprocal and the
        ! products with it have a rounding each.
        roundoff = (n**2 + 4) * epsilon(1.0_dp) * norm2(before(lane, :, :)) * real(norm2(exact(:, :n)), dp)
        call check_that(error, norm2(x(lane, :) - exact(:, n + 1)), "<=", roundoff * norm2(exact(:, n + 1)), "solution")
        call check_that(error, abs(inverse_norm(lane) - norm2(exact(:, :n))), "<=", roundoff * norm2(exact(:, :n)), "norm")
        if (allocated(error)) return
      end do
      deallocate(x, right)
    end do
  end subroutine test_equations

  !> The equations are singular in one lane only; the results of the other lanes do not change.
  subroutine test_singular(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: equations(lanes, 2, 3), x(lanes, 2), inverse_norm(lanes)

    equations = 0
    equations(:, 1, 1) = 2
    equations(:, 2, 2) = 4
    equations(:, :, 3) = 1
    equations(3, :, :2) = 0
    call solve_equations(2, equations, x, inverse_norm)
    call check_that(error, inverse_norm(3), ">=", 1.0e100_dp, "singular")
    ! The inverse is diag(1/2, 1/4), and no step of it leaves more than a rounding.
    call check_that(error, abs(inverse_norm([1, 2, 4]) - sqrt(5.0_dp) / 4), "<=", 4 * epsilon(1.0_dp), "norm in the other lanes")
    call check_that(error, abs(x(4, :) - [0.5_dp, 0.25_dp]), "<=", 4 * epsilon(1.0_dp), "solution in the other lanes")
  end subroutine test_singular

  !> The coefficients of the product of factors, c_0 first.
  pure function product_of(s, q) result(c)
    real(dp), intent(in) :: s(:), q(:)
    real(dp) :: c(0:2 * size(s))
    integer :: k

    c = 0
    c(0) = 1
    do k = 1, size(s)
      c = q(k) * c - s(k) * eoshift(c, -1) + eoshift(c, -2)
    end do
  end function product_of

  !> Pairs near the unit circle, like multipliers: their grouping into factors is unique.
  subroutine test_conjugate(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp) :: coefficients(0:6), c(lanes, 0:5), s(lanes, 6), q(lanes, 6), found(lanes), known_s(3, lanes), known_q(3, lanes)
    integer :: lane, k, trial

    call random%start(13, 1)
    do trial = 1, 50
      do lane = 1, lanes
        do k = 1, 3
          associate (modulus => 0.95_dp + 0.1_dp * random%draw(), angle => pi * (k - 0.8_dp + 0.6_dp * random%draw()) / 3)
            known_s(k, lane) = 2 * modulus * cos(angle)
            known_q(k, lane) = modulus**2
          end associate
        end do
        coefficients = product_of(known_s(:, lane), known_q(:, lane))
        c(lane, :) = coefficients(:5)
      end do
      call start_on_circle(3, s, q)
      call find_factors(vector_length(), 3, c, spread(1.0_dp, 1, lanes), spread(2.0_dp, 1, lanes), s, q, found)
      call check_that(error, found, ">", 0.0_dp, "converged")
      if (allocated(error)) return
      do lane = 1, lanes
        do k = 1, 3
          ! The last step was 1e-5 and convergence is quadratic, with roots a quarter apart at least.
          call check_that(error, minval(abs(s(lane, :3) - known_s(k, lane)) + abs(q(lane, :3) - known_q(k, lane))), "<", &
            & 1.0e-8_dp, "factor")
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_conjugate

  !> Circles of pairs without symmetry.
  pure subroutine start_on_circle(m, s, q)
    integer, intent(in) :: m
    real(dp), intent(out) :: s(:, :), q(:, :)
    integer :: k

    do k = 1, m
      s(:, k) = 2 * cos(pi * (k - 0.6_dp) / m)
      q(:, k) = 1
    end do
  end subroutine start_on_circle

  !> Real roots, from a start with conjugate ones. Factors are not unique, but their product is; failure is reported.
  subroutine test_real(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: trials = 50
    type(random_type) :: random
    real(dp) :: coefficients(0:4), c(lanes, 0:3), s(lanes, 4), q(lanes, 4), found(lanes), roots(4)
    integer :: lane, trial, successes

    call random%start(14, 1)
    successes = 0
    do trial = 1, trials
      do lane = 1, lanes
        ! 0.1 apart at least.
        roots = [-1.2_dp, -0.4_dp, 0.4_dp, 1.2_dp] + 0.35_dp * draw(random, 4)
        coefficients = product_of(roots(:2) + roots(3:), roots(:2) * roots(3:))
        c(lane, :) = coefficients(:3)
      end do
      call start_on_circle(2, s, q)
      call find_factors(vector_length(), 2, c, spread(1.0_dp, 1, lanes), spread(2.0_dp, 1, lanes), s, q, found)
      do lane = 1, lanes
        if (found(lane) <= 0) cycle
        successes = successes + 1
        coefficients = product_of(s(lane, :2), q(lane, :2))
        ! As above.
        call check_that(error, maxval(abs(coefficients(:3) - c(lane, :))), "<", 1.0e-7_dp, "product")
        if (allocated(error)) return
      end do
    end do
    ! Most succeed; the others would be restarted from a circle of their own.
    call check_that(error, successes, ">", trials * lanes / 2, "number of successes")
  end subroutine test_real

  !> Rotations coupled by random elements: all eigenvalues are found in pairs, and the disc computed for one member of a pair is
  !> that of both.
  subroutine test_pairs(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: a(lanes, max_states, max_states), converged(lanes)
    real(dp), dimension(lanes, max_states) :: z_re, z_im, w_re, w_im
    type(discs_type) :: found, singly
    real(dp), parameter :: perturbation(lanes) = 1.0e-9_dp
    logical :: conjugate(max_states)
    type(hessenberg_type) :: h
    type(random_type) :: random
    integer :: i, j, lane

    call random%start(9, 1)
    do j = 1, 6
      do i = 1, 6
        do lane = 1, lanes
          a(lane, i, j) = random%about_zero(0.05_dp)
        end do
      end do
    end do
    do j = 1, 6, 2
      a(:, j, j) = a(:, j, j) + cos(0.8_dp * j)
      a(:, j + 1, j + 1) = a(:, j + 1, j + 1) + cos(0.8_dp * j)
      a(:, j, j + 1) = a(:, j, j + 1) - sin(0.8_dp * j)
      a(:, j + 1, j) = a(:, j + 1, j) + sin(0.8_dp * j)
    end do
    call new_hessenberg(vector_length(), a, 6, h)
    call guess_roots(vector_length(), h, z_re, z_im, conjugate, converged)
    converged = 0
    call find_roots(vector_length(), h, conjugate, z_re, z_im, converged)
    call check_that(error, conjugate(:6), "==", [(mod(j, 2) == 0, j = 1, 6)], "pairs")
    call check_that(error, converged, ">", 0.0_dp, "converged")
    if (allocated(error)) return
    do j = 2, 6, 2
      call check_that(error, abs(z_re(:, j) - z_re(:, j - 1)) + abs(z_im(:, j) + z_im(:, j - 1)), "<=", 0.0_dp, "conjugates")
      if (allocated(error)) return
    end do
    w_re = z_re
    w_im = z_im
    call find_discs(vector_length(), h, conjugate, perturbation, z_re, z_im, found)
    conjugate = .false.
    call find_discs(vector_length(), h, conjugate, perturbation, w_re, w_im, singly)
    call check_that(error, found%separate, ">", 0.0_dp, "separate")
    call check_that(error, singly%separate, ">", 0.0_dp, "separate, one by one")
    ! Sums in another order, about twenty terms.
    call check_that(error, maxval(abs(found%radius(:, :6) / singly%radius(:, :6) - 1)), "<", 20 * epsilon(1.0_dp), "discs")
  end subroutine test_pairs

  !> mean + a cos(theta - phi) + b cos 2 (theta - phi), with the maximum mean + a + b at phi, with either sign; cos 2 theta plus
  !> a small cos theta, where two places compete; a constant.
  subroutine test_largest(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: counts(4) = [8, 9, 16, 40]
    type(random_type) :: random
    real(dp), allocatable :: samples(:, :), harmonics(:, :)
    real(dp) :: maximum(lanes), wanted(lanes), drawn(4)
    integer :: i, k, n, orders, lane, trial

    call random%start(15, 1)
    do i = 1, size(counts)
      n = counts(i)
      orders = (n - 1) / 2
      allocate(samples(lanes, n), harmonics(lanes, 2 * orders + 3))
      do trial = 1, 40
        harmonics = 0
        harmonics(:, 2 * orders + 1:) = huge(1.0_dp)
        do lane = 1, lanes
          drawn = abs(draw(random, 4))
          if (lane == 2) drawn(:2) = [0.0_dp, 1.0e-3_dp]
          if (lane == 3) drawn(2:3) = 0
          if (lane == 4) drawn = 0
          associate (mean => drawn(1), a => drawn(2), b => drawn(3), phi => 2 * pi * drawn(4), sign => (-1)**lane)
            samples(lane, :) = sign * [(mean + a * cos(2 * pi * k / n - phi) + b * cos(2 * (2 * pi * k / n - phi)), k = 0, n - 1)]
            harmonics(lane, 1:2) = sign * [a * cos(phi), b * cos(2 * phi)]
            harmonics(lane, orders + 1:orders + 2) = sign * [a * sin(phi), b * sin(2 * phi)]
            wanted(lane) = mean + a + b
          end associate
        end do
        call largest_values(samples, harmonics, maximum)
        ! Some roundings in sums of two terms and a mean over n samples, each 3 at most.
        call check_that(error, maxval(abs(maximum - wanted)), "<", 20 * epsilon(1.0_dp), "largest value")
        if (allocated(error)) return
      end do
      deallocate(samples, harmonics)
    end do
  end subroutine test_largest

end module test_lane_numerics
