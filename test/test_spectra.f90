!> Largest multipliers of matrices, eight at a time, against eigenvalues known by construction and LAPACK one by one.
module test_spectra
  use checks, only: check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: eigensystem
  use gestell_floquet_multipliers, only: arrange, multipliers_type, pair_conjugates, set_multipliers
  use many_spectra, only: spectral_radii
  use reference_linear, only: qp, solve
  use reference_random, only: random_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: by_lapack, collect_spectra, compare, disc_apart, set_diagonal, turn

  integer, parameter :: sizes(6) = [2, 3, 4, 6, 8, 12]

contains

  subroutine collect_spectra(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("largest multipliers of random matrices agree with LAPACK", test_random), &
      & new_unittest("error bounds cover a perturbation of known norm and are not wide", test_known), &
      & new_unittest("eigenvalue conditions of triangular matrices agree with the closed form", test_condition), &
      & new_unittest("multipliers of undamped systems lie on the unit circle", test_circle), &
      & new_unittest("multipliers of a real system are exactly conjugate", test_conjugates)]
  end subroutine collect_spectra

  !> LAPACK finds the same, with the same bounds.
  subroutine test_random(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: count = 203
    type(random_type) :: random
    real(dp), allocatable :: phi(:, :)
    integer :: i, k, l

    call random%start(1, 1)
    do i = 1, size(sizes)
      allocate(phi(count, sizes(i)**2))
      do l = 1, sizes(i)**2
        do k = 1, count
          phi(k, l) = 2 * random%draw() - 1
        end do
      end do
      ! One in a thousand or fewer is close to a double eigenvalue.
      call compare(phi, 1.0e-10_dp, 2, error)
      if (allocated(error)) return
      deallocate(phi)
    end do
  end subroutine test_random

  !> Radius, bound and verdict of all `phi` against LAPACK's; at most `most` go to LAPACK themselves.
  subroutine compare(phi, perturbation, most, error)
    real(dp), intent(in) :: phi(:, :), perturbation
    integer, intent(in) :: most
    type(error_type), allocatable, intent(out) :: error
    real(dp), dimension(size(phi, 1)) :: radius, log_radius, bound, quick, log_quick
    logical, dimension(size(phi, 1)) :: stable, unstable
    type(multipliers_type) :: expected
    integer :: k, singly, singly_quick

    call spectral_radii(phi, perturbation, radius, log_radius, bound, stable, unstable, singly)
    call spectral_radii(phi, perturbation, quick, log_quick, singly=singly_quick)
    call check_that(error, singly, "<=", most, "too many singly")
    call check_that(error, singly_quick, "<=", singly, "too many singly")
    if (allocated(error)) return
    do k = 1, size(phi, 1)
      expected = by_lapack(phi(k, :), perturbation)
      ! Each is within the rounding part of the bounds, n^2 epsilon norm condition, of the eigenvalue it represents.
      call check_that(error, abs(radius(k) - abs(expected%rho(1))), "<=", 1.0e-3_dp * bound(k) * radius(k), "radius")
      call check_that(error, abs(quick(k) - radius(k)), "<=", 1.0e-3_dp * bound(k) * radius(k), "radius alone")
      ! The logarithm has a rounding of its argument.
      call check_that(error, abs(log_radius(k) - log(radius(k))), "<=", 1.0e-15_dp * max(1.0_dp, abs(log_radius(k))), "logarithm")
      call check_that(error, abs(log_quick(k) - log(quick(k))), "<=", 1.0e-15_dp * max(1.0_dp, abs(log_quick(k))), "logarithm")
      ! Two of equal modulus may stand in either order. The residual counts, but no more than roundoff.
      call check_that(error, minval(abs(bound(k) - expected%error), abs(expected%log_abs - expected%log_abs(1)) < 1.0e-6_dp), "<", &
        & 0.02_dp * bound(k), "bound")
      if (allocated(error)) return
      call check(error, merge("stable   ", merge("unstable ", "undecided", unstable(k)), stable(k)), expected%verdict(), &
        & more="verdict")
      if (allocated(error)) return
    end do
  end subroutine compare

  !> Multipliers of one matrix as solve_multipliers has them.
  function by_lapack(elements, perturbation) result(multipliers)
    real(dp), intent(in) :: elements(:), perturbation
    type(multipliers_type) :: multipliers
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
    type(gestell_error), allocatable :: failure
    integer :: n

    n = nint(sqrt(real(size(elements), dp)))
    call eigensystem(reshape(elements, [n, n]), rho, right, left, failure)
    call set_multipliers(rho, right, left, perturbation + n * epsilon(1.0_dp) * norm2(elements), multipliers)
    call arrange(multipliers)
  end function by_lapack

  !> X B X^-1 where B has pairs re +- i im on its diagonal, X is random about `skew` away from the unit matrix.
  function matrix_with(values, skew, random) result(a)
    complex(dp), intent(in) :: values(:)
    real(dp), intent(in) :: skew
    type(random_type), intent(inout) :: random
    real(qp), allocatable :: a(:, :)
    real(qp) :: b(size(values), size(values)), x(size(values), size(values))
    integer :: i, k

    b = 0
    do k = 1, size(values)
      if (aimag(values(k)) < 0) cycle
      b(k, k) = real(values(k), qp)
      if (aimag(values(k)) > 0) b(k:k + 1, k:k + 1) = real(reshape([values(k)%re, -values(k)%im, values(k)%im, values(k)%re], &
        & [2, 2]), qp)
    end do
    do k = 1, size(values)
      do i = 1, size(values)
        x(i, k) = skew * (2 * random%draw() - 1)
      end do
      x(k, k) = x(k, k) + 1
    end do
    ! A = X B X^-1 is the solution of X' A' = (X B)'.
    a = transpose(solve(transpose(x), transpose(matmul(x, b))))
  end function matrix_with

  !> The bound covers the effect of a perturbation of that norm on a multiplier, and is not far above it.
  subroutine test_known(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: count = 60
    complex(dp), parameter :: values(6) = [(-0.9_dp, 0.3_dp), (-0.9_dp, -0.3_dp), (0.7_dp, 0.2_dp), (0.7_dp, -0.2_dp), &
      & (0.5_dp, 0.0_dp), (-0.2_dp, 0.0_dp)]
    real(dp), parameter :: changes(3) = [0.0_dp, 1.0e-9_dp, 1.0e-5_dp], skews(3) = [0.05_dp, 0.4_dp, 1.0_dp]
    type(random_type) :: random
    real(dp) :: phi(count, 36), radius(count), log_radius(count), bound(count), deviation, e(36)
    real(qp) :: exact
    logical :: unstable(count)
    integer :: i, j, k, l, singly

    call random%start(2, 1)
    exact = abs(cmplx(values(1), kind=qp))
    do i = 1, size(skews)
      do j = 1, size(changes)
        do k = 1, count
          e = [(2 * random%draw() - 1, l = 1, 36)]
          phi(k, :) = real(reshape(matrix_with(values, skews(i), random), [36]), dp) + changes(j) * e / norm2(e)
        end do
        call spectral_radii(phi, changes(j), radius, log_radius, bound, unstable=unstable, singly=singly)
        deviation = real(maxval(abs(radius - exact) / (bound * exact)), dp)
        call check_that(error, deviation, "<", 1.0_dp, "outside")
        ! n |E| / |y' x| is 6 times what one direction of E can do; a random one in 36 dimensions does about a sixth of that.
        if (j > 1) call check_that(error, deviation, ">", 0.005_dp, "bounds are not too wide")
        if (allocated(error)) return
        ! X is nearly the unit matrix the first time, so that it contains only a few rounding errors.
        if (i == 1 .and. j == 1) call check_that(error, maxval(abs(radius - exact)), "<", 5.0e-15_qp, "roundoff")
        if (allocated(error)) return
        call check(error, .not. any(unstable), more="verdict")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_known

  !> [a c; 0 b] has the condition sqrt(1 + (c / (a - b))^2), turned in the planes of its states too.
  subroutine test_condition(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: c(5) = [0.0_dp, 0.1_dp, 1.0_dp, 10.0_dp, 1000.0_dp], perturbation = 1.0e-7_dp
    real(dp), allocatable :: a(:, :), phi(:, :)
    real(dp), dimension(size(c)) :: radius, log_radius, bound, expected
    real(dp) :: conditions(maxval(sizes))
    integer :: i, k, l, n, singly

    do i = 1, size(sizes)
      n = sizes(i)
      allocate(phi(size(c), n * n))
      do k = 1, size(c)
        allocate(a(n, n), source=0.0_dp)
        call set_diagonal(a, 0.05_dp)
        a(1, 1) = 0.9_dp
        a(1, n) = c(k)
        call turn(a)
        phi(k, :) = reshape(a, [n * n])
        deallocate(a)
      end do
      call spectral_radii(phi, perturbation, radius, log_radius, bound, singly=singly)
      ! The eigenvalue 0.9 next to 0.05 n. Roundoff: n^2 / 2 turns of the norm 1 + c times the condition.
      call check_that(error, abs(radius - 0.9_dp), "<", n**2 * epsilon(1.0_dp) * (1 + c) &
        & * sqrt(1 + (c / (0.9_dp - 0.05_dp * n))**2), "radius")
      if (allocated(error)) return
      conditions = 1
      do k = 1, size(c)
        conditions([1, n]) = sqrt(1 + (c(k) / (0.9_dp - 0.05_dp * n))**2)
        expected(k) = disc_apart(cmplx([0.9_dp, (0.05_dp * l, l = 2, n)], 0, dp), conditions(:n), perturbation, 1)
      end do
      ! n epsilon norm against 1e-7; inaccurate vectors may add a hundredth.
      call check_that(error, bound * 0.9_dp - expected, ">", -1.0e-4_dp * bound, "bound")
      call check_that(error, bound * 0.9_dp - expected, "<", merge(1.0e-4_dp, 1.0e-2_dp, c < 10) * bound, "bound")
      ! Of twelve the last one has residuals of 1e-10 in units of its norm, a condition of 3000, and distances of 1e-4.
      call check_that(error, singly, "<=", merge(1, 0, n == 12), "singly")
      if (allocated(error)) return
      ! If no bound is requested, rounding may be 1e-10, which n^2 epsilon norm condition exceeds only for the last one, or the
      ! effect of the perturbation.
      call spectral_radii(phi, 0.0_dp, radius, log_radius, singly=singly)
      call check(error, singly, 1, more="radius alone, exact matrix")
      if (allocated(error)) return
      call spectral_radii(phi, perturbation, radius, log_radius, singly=singly)
      call check(error, singly, 0, more="radius alone, changed matrix")
      if (allocated(error)) return
      deallocate(phi)
    end do
  end subroutine test_condition

  !> The disc of the k-th of eigenvalues with these conditions, so far from each other that the others' discs may be enlarged
  !> until one touches it; the matrix is known to `perturbation`.
  pure real(dp) function disc_apart(rho, condition, perturbation, k) result(radius)
    complex(dp), intent(in) :: rho(:)
    real(dp), intent(in) :: condition(:), perturbation
    integer, intent(in) :: k
    real(dp) :: enlarged(size(rho))
    integer :: n

    n = size(rho)
    ! The reciprocals of the factors, 1 at most.
    enlarged = perturbation * condition / (abs(rho - rho(k)) - perturbation * ((n - 1) * condition + n * condition(k)))
    enlarged(k) = 0
    radius = perturbation * condition(k) * (1 + (n - 1) * maxval(enlarged))
  end function disc_apart

  !> step, 2 step, ... on the diagonal.
  subroutine set_diagonal(a, step)
    real(dp), intent(inout) :: a(:, :)
    real(dp), intent(in) :: step
    integer :: k

    do k = 1, size(a, 1)
      a(k, k) = k * step
    end do
  end subroutine set_diagonal

  !> Q A Q' by a rotation in each plane of two states.
  subroutine turn(a)
    real(dp), intent(inout) :: a(:, :)
    real(dp) :: row(size(a, 1))
    integer :: i, k

    do k = 2, size(a, 1)
      do i = 1, k - 1
        associate (c => cos(real(i + k, dp)), s => sin(real(i + k, dp)))
          row = c * a(i, :) - s * a(k, :)
          a(k, :) = s * a(i, :) + c * a(k, :)
          a(i, :) = row
          row = c * a(:, i) - s * a(:, k)
          a(:, k) = s * a(:, i) + c * a(:, k)
          a(:, i) = row
        end associate
      end do
    end do
  end subroutine turn

  !> Undamped: products of shears in positions and velocities, which are symplectic, and of rotations.
  subroutine test_circle(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: count = 400
    type(random_type) :: random
    real(dp), allocatable :: a(:, :), s(:, :), phi(:, :)
    real(dp), dimension(count) :: radius, log_radius, bound
    logical :: stable(count), unstable(count)
    integer :: i, k, l, n, singly

    call random%start(3, 1)
    do n = 2, 12, 2
      allocate(phi(count, n * n), s(n / 2, n / 2), a(n, n))
      do k = 1, count
        a = 0
        do i = 1, n
          a(i, i) = 1
        end do
        ! Steps of an oscillation about a minimum, together less than half a turn: the pairs cannot leave the circle.
        do l = 1, 5
          s = reshape([(0.1_dp * (random%draw() - 0.5_dp), i = 1, n**2 / 4)], [n / 2, n / 2])
          s = s + transpose(s)
          do i = 1, n / 2
            s(i, i) = s(i, i) + 0.4_dp * i * (2.0_dp / n) + 0.3_dp
          end do
          a(n / 2 + 1:, :) = a(n / 2 + 1:, :) - 0.5_dp * matmul(s, a(:n / 2, :))
          a(:n / 2, :) = a(:n / 2, :) + 0.5_dp * a(n / 2 + 1:, :)
        end do
        phi(k, :) = reshape(a, [n * n])
      end do
      call spectral_radii(phi, 1.0e-12_dp, radius, log_radius, bound, stable, unstable, singly)
      call check_that(error, abs(radius - 1), "<", bound, "off the circle")
      if (allocated(error)) return
      call check(error, .not. any(stable .or. unstable), more="verdict")
      if (allocated(error)) return
      call check_that(error, singly, "<=", count / 50, "singly")
      if (allocated(error)) return
      call compare(phi, 1.0e-9_dp, count, error)
      if (allocated(error)) return
      deallocate(phi, s, a)
    end do
  end subroutine test_circle

  !> Two pairs of nearly equal modulus, one negative and one positive number, all accurate to rounding in complex arithmetic.
  !> For any rounding, pairs are adjacent, +im first. If the errors of a pair differ, the larger one holds for both.
  subroutine test_conjugates(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 6
    type(multipliers_type) :: m
    complex(dp) :: z(n)
    real(dp) :: off
    integer :: k, sides

    z = [cmplx(-0.1_dp, 2.5_dp, dp), cmplx(-0.1_dp, -2.5_dp, dp), cmplx(-0.1_dp, 0.3_dp, dp), cmplx(-0.1_dp, -0.3_dp, dp), &
      & cmplx(-0.5_dp, pi, dp), cmplx(-0.7_dp, 0.0_dp, dp)]
    do sides = 0, 2**n - 1
      m%exponent = z
      do k = 1, n
        off = 1.0e-14_dp * merge(1, -1, btest(sides, k - 1))
        m%exponent(k) = z(k) + cmplx(off, 2 * off, dp)
      end do
      m%error = [(k * 1.0e-12_dp, k = 1, n)]
      m%condition = [(1.0_dp, k = 1, n)]
      m%vectors = reshape([(cmplx(k, -k, dp), k = 1, n**2)], [n, n])
      call pair_conjugates(m)
      call check_that(error, abs(m%rho - exp(z)), "<", 1.0e-13_dp, "moved by more than rounding")
      call check_that(error, m%error, "==", [2, 2, 4, 4, 5, 6] * 1.0e-12_dp, "error")
      call check_that(error, maxval(abs(m%vectors(:, 2) - conjg(m%vectors(:, 1)))), "==", 0.0_dp, "vectors")
      call arrange(m)
      do k = 1, 3, 2
        call check_that(error, abs(m%rho(k) - conjg(m%rho(k + 1))), "==", 0.0_dp, "a pair")
        call check_that(error, m%arg(k), ">", 0.0_dp, "+im first")
        call check_that(error, m%log_abs(k + 1), "==", m%log_abs(k), "ln |rho| of a pair")
      end do
      call check_that(error, m%arg(5:), "==", [pi, 0.0_dp], "real numbers")
      if (allocated(error)) return
    end do
  end subroutine test_conjugates

end module test_spectra
