!> Largest multipliers of eight matrices at once, with eigenvalues that are close, far apart, on the border of a verdict, or
!> not finite.
module test_spectra_edges
  use checks, only: check_that
  use gestell_base_kinds, only: dp
  use many_spectra, only: spectral_radii
  use reference_random, only: random_type
  use test_spectra, only: compare, disc_apart, set_diagonal, turn
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_positive_inf, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: collect_spectra_edges

contains

  subroutine collect_spectra_edges(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("close and double eigenvalues have correct bounds", test_close), &
      & new_unittest("eigenvalues over sixteen decades are found", test_spread), &
      & new_unittest("verdicts are correct on both sides of one", test_verdict), &
      & new_unittest("every disc that may reach the unit circle enters the verdict", test_discs), &
      & new_unittest("scaling a matrix scales its spectral radius and keeps relative bounds", test_units), &
      & new_unittest("decoupled and weakly coupled states agree with LAPACK", test_decoupled), &
      & new_unittest("nonfinite, zero and extreme matrices yield correct radii and verdicts", test_extreme), &
      & new_unittest("results do not depend on the neighbouring matrices", test_independence), &
      & new_unittest("a mean eigenvalue equal to an eigenvalue does not disturb the search", test_mean)]
  end subroutine collect_spectra_edges

  !> [0.9 c; 0 0.9 + d], and the same with a rotation in place of 0.9, among other eigenvalues and rotated.
  subroutine test_close(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: d(8) = [0.0_dp, 1.0e-15_dp, 1.0e-12_dp, 1.0e-9_dp, 1.0e-7_dp, 1.0e-5_dp, 1.0e-3_dp, 1.0e-1_dp]
    real(dp), parameter :: c(2) = [0.0_dp, 1.0_dp], perturbation = 1.0e-11_dp
    real(dp), dimension(size(d)) :: radius, log_radius, bound, quick, exact, roundoff
    real(dp) :: phi(size(d), 36), a(6, 6)
    integer :: i, k, pairs, singly, singly_quick

    do pairs = 0, 1
      do i = 1, size(c)
        do k = 1, size(d)
          a = 0
          call set_diagonal(a, 0.1_dp)
          if (pairs == 0) then
            a(2, 2) = 0.9_dp + d(k)
            a(1, 1) = 0.9_dp
            a(1, 2) = c(i)
          else
            a(1:2, 1:2) = reshape([0.6_dp, 0.7_dp, -0.7_dp, 0.6_dp], [2, 2])
            a(3:4, 3:4) = a(1:2, 1:2) * (1 + d(k))
            a(1, 3) = c(i)
            a(2, 4) = c(i)
          end if
          exact(k) = merge(0.9_dp + d(k), sqrt(0.85_dp) * (1 + d(k)), pairs == 0)
          call turn(a)
          phi(k, :) = reshape(a, [36])
        end do
        call spectral_radii(phi, perturbation, radius, log_radius, bound, singly=singly)
        call spectral_radii(phi, perturbation, quick, log_radius, singly=singly_quick)
        call check_that(error, abs(radius - exact), "<", bound * exact, "bound")
        if (allocated(error)) return
        ! A hundred roundings times the condition c / d, but not more than the root of them.
        roundoff = 100 * epsilon(1.0_dp) * 2
        if (c(i) > 0) roundoff = max(roundoff, min(sqrt(roundoff), roundoff / max(d, tiny(1.0_dp))))
        call check_that(error, abs(quick - exact), "<", roundoff, "radius alone")
        call check_that(error, abs(radius - exact), "<", roundoff, "radius")
        if (allocated(error)) return
        ! Discs touch where 2 n 1e-11 max(1, c / d) > d.
        call check(error, singly, merge(6, 3, c(i) > 0), more="touching discs")
        if (allocated(error)) return
        ! Roots cannot be distinguished if their rounding errors are a part of d: 1e-16 max(1, c / d) > 1e-4 d, about.
        call check_that(error, singly_quick, ">", 0, "singly")
        call check_that(error, singly_quick, "<=", merge(6, 3, c(i) > 0), "singly")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_close

  subroutine test_spread(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: decades(6) = [8.0_dp, -8.0_dp, 3.0_dp, -3.0_dp, 0.5_dp, -0.5_dp]
    real(dp) :: phi(9, 36), a(6, 6), radius(9), log_radius(9), bound(9)
    logical :: stable(9), unstable(9)
    integer :: i, k

    do k = 1, 9
      a = 0
      do i = 1, 6
        a(i, i) = 10.0_dp**(decades(i) - merge(8.5_dp, 0.0_dp, k > 6))
        if (k > 3) a(max(i - 1, 1), i) = a(i, i) * merge(k, 1, i > 1)
      end do
      call turn(a)
      phi(k, :) = reshape(a, [36])
    end do
    call spectral_radii(phi, 0.0_dp, radius, log_radius, bound, stable, unstable)
    ! A normal or nearly normal matrix: roundings of turning and of finding, some of each.
    call check_that(error, abs(radius - 10.0_dp**[(merge(-0.5_dp, 8.0_dp, k > 6), k = 1, 9)]), "<", 1.0e-14_dp * radius, "radius")
    call check_that(error, bound, "<", 1.0e-13_dp, "bound")
    call check_that(error, unstable, "/=", [(k > 6, k = 1, 9)], "unstable")
    call check_that(error, stable, "==", [(k > 6, k = 1, 9)], "stable")
    call check_that(error, maxval(abs(log_radius - log(10.0_dp) * [(merge(-0.5_dp, 8.0_dp, k > 6), k = 1, 9)])), "<", 1.0e-13_dp, &
      & "logarithm")
  end subroutine test_spread

  !> A rotation times a number near 1: normal, so its discs have the radius perturbation.
  subroutine test_verdict(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: perturbation = 1.0e-6_dp, part(6) = [-2.0_dp, -1.01_dp, -0.99_dp, 0.99_dp, 1.01_dp, 2.0_dp]
    integer, parameter :: sizes(4) = [2, 4, 6, 12]
    real(dp), allocatable :: phi(:, :), a(:, :)
    real(dp), dimension(6) :: radius, log_radius, bound
    logical :: stable(6), unstable(6)
    integer :: i, k, l, n, singly

    do l = 1, size(sizes)
      n = sizes(l)
      allocate(phi(6, n * n), a(n, n))
      do k = 1, 6
        a = 0
        do i = 1, n, 2
          a(i:i + 1, i:i + 1) = reshape([cos(0.4_dp * i), sin(0.4_dp * i), -sin(0.4_dp * i), cos(0.4_dp * i)], [2, 2])
        end do
        a = a * (1 + part(k) * perturbation)
        call turn(a)
        phi(k, :) = reshape(a, [n * n])
      end do
      call spectral_radii(phi, perturbation, radius, log_radius, bound, stable, unstable, singly)
      call check_that(error, stable, "==", [.true., .true., .false., .false., .false., .false.], "stable")
      call check_that(error, unstable, "==", [.false., .false., .false., .false., .true., .true.], "unstable")
      ! The nearest two of 12 are 0.12 apart: to second order 11 e / 0.12.
      call check_that(error, abs(bound * radius - perturbation), "<", 2.0e-5_dp * n * perturbation, "bound")
      if (allocated(error)) return
      call check(error, singly, 0, more="singly")
      if (allocated(error)) return
      ! The bound or one verdict alone is as good.
      call spectral_radii(phi, perturbation, radius, log_radius, stable=stable)
      call check(error, count(stable), 2, more="stable alone")
      if (allocated(error)) return
      call spectral_radii(phi, perturbation, radius, log_radius, unstable=unstable)
      call check(error, count(unstable), 2, more="unstable alone")
      if (allocated(error)) return
      ! A double eigenvalue 1 with only one eigenvector.
      phi(1, :) = 0
      phi(1, [1, n + 1, n + 2]) = 1
      call spectral_radii(phi(:1, :), perturbation, radius(:1), log_radius(:1), bound(:1), stable(:1), unstable(:1), singly)
      call check_that(error, singly, "==", 1, "double")
      call check_that(error, stable(1), "==", .false., "double")
      call check_that(error, unstable(1), "==", .false., "double")
      call check_that(error, bound(1), ">", 1.0e-3_dp, "double")
      if (allocated(error)) return
      deallocate(phi, a)
    end do
  end subroutine test_verdict

  !> A well conditioned pair +-i r and two other eigenvalues, u and -v, whose discs are large.
  subroutine test_discs(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: r(2) = [0.95_dp, 1.2_dp], u(2) = [0.75_dp, 1.25_dp], v(2) = [0.8_dp, 1.3_dp], c(2) = [100.0_dp, 300.0_dp]
    real(dp), parameter :: perturbation = 2.4e-3_dp
    real(dp) :: phi(2, 16), a(4, 4), radius(2), log_radius(2), bound(2), disc(4, 2), condition
    complex(dp) :: rho(4)
    logical :: stable(2), unstable(2)
    integer :: i, k, singly

    do k = 1, 2
      a = 0
      a(1, 2) = -r(k)
      a(2, 1) = r(k)
      a(3, 3) = u(k)
      a(4, 4) = -v(k)
      a(3, 4) = c(k)
      condition = sqrt(1 + (c(k) / (u(k) + v(k)))**2)
      rho = [cmplx(0, r(k), dp), cmplx(0, -r(k), dp), cmplx(u(k), 0, dp), cmplx(-v(k), 0, dp)]
      disc(:, k) = [(disc_apart(rho, [1.0_dp, 1.0_dp, condition, condition], perturbation, i), i = 1, 4)]
      call turn(a)
      phi(k, :) = reshape(a, [16])
    end do
    call spectral_radii(phi, perturbation, radius, log_radius, bound, stable, unstable, singly)
    ! The intended case: 0.95 certainly inside, 0.75 possibly outside; 1.3 possibly inside, 1.2 certainly outside.
    call check_that(error, r(1) + disc(1, 1), "<", 1.0_dp, "intended case")
    call check_that(error, u(1) + disc(3, 1), ">", 1.0_dp, "intended case")
    call check_that(error, v(2) - disc(4, 2), "<", 1.0_dp, "intended case")
    call check_that(error, r(2) - disc(1, 2), ">", 1.0_dp, "intended case")
    call check_that(error, singly, "==", 0, "intended case")
    call check_that(error, abs(radius(1) - r(1)), "<", 1.0e-12_dp, "radius")
    call check_that(error, abs(radius(2) - v(2)), "<", 1.0e-11_dp, "radius")
    call check_that(error, abs(bound(1) * r(1) - disc(1, 1)), "<", 1.0e-9_dp, "bound")
    call check_that(error, abs(bound(2) * v(2) - disc(4, 2)), "<", 1.0e-7_dp, "bound")
    call check_that(error, [stable, unstable], "==", [.false., .false., .false., .true.], "verdicts")
  end subroutine test_discs

  !> A matrix in other units has the same bounds.
  subroutine test_units(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: units(8) = [1.0_dp, 1.5_dp, 1.0e-30_dp, 1.0e30_dp, 1.0e-99_dp, 1.0e98_dp, 1.0e-101_dp, 1.0e101_dp]
    real(dp) :: phi(1, 36), radius(1, 8), log_radius(1, 8), bound(1, 8)
    type(random_type) :: random
    integer :: k, singly(8)

    call random%start(4, 1)
    phi(1, :) = [(random%about_zero(1.0_dp), k = 1, 36)]
    do k = 1, 8
      call spectral_radii(phi * units(k), 1.0e-8_dp * units(k), radius(:, k), log_radius(:, k), bound(:, k), singly=singly(k))
    end do
    call check_that(error, singly, "==", [0, 0, 0, 0, 0, 0, 1, 1], "singly")
    ! The elements are rounded in other units: 36 roundings times a condition of a few.
    call check_that(error, abs(radius(1, :) / units - radius(1, 1)), "<", 1.0e-13_dp, "radius")
    call check_that(error, abs(bound(1, :) - bound(1, 1)), "<", 1.0e-5_dp * bound(1, 1), "bound")
    call check_that(error, abs(log_radius(1, :) - log(units) - log_radius(1, 1)), "<", 1.0e-13_dp, "logarithm")
    if (allocated(error)) return
    ! A disproportionate error.
    call spectral_radii(phi * 1.0e-90_dp, 1.0e250_dp, radius(:, 1), log_radius(:, 1), bound(:, 1), singly=singly(1))
    call check_that(error, singly(1), "==", 1, "out of proportion")
    call check_that(error, bound(1, 1), ">", 1.0e299_dp, "out of proportion")
  end subroutine test_units

  !> Blocks without coupling, with coupling to one side, and with weak coupling: Hessenberg matrices with vanishing
  !> subdiagonals.
  subroutine test_decoupled(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: sizes(5) = [2, 3, 6, 8, 12], count = 34
    real(dp), allocatable :: phi(:, :), a(:, :)
    real(dp) :: radius(count), log_radius(count)
    type(random_type) :: random
    integer :: i, k, l, n, singly

    call random%start(5, 1)
    do l = 1, size(sizes)
      n = sizes(l)
      allocate(phi(count, n * n), a(n, n))
      do k = 1, count
        a = reshape([(random%about_zero(1.0_dp), i = 1, n * n)], [n, n])
        i = 1 + mod(k, n - 1)
        a(i + 1:, :i) = 10.0_dp**(-k) * merge(1, 0, k < 20) * a(i + 1:, :i)
        if (k > 25) a(:i, i + 1:) = 0
        if (k == count) then
          a = 0
          call set_diagonal(a, 0.1_dp)
        end if
        phi(k, :) = reshape(a, [n * n])
      end do
      call compare(phi, 1.0e-10_dp, count, error)
      if (allocated(error)) return
      ! The radius alone needs no eigenvectors but one; a diagonal of 12 goes through too many vanishing elements.
      call spectral_radii(phi, 1.0e-10_dp, radius, log_radius, singly=singly)
      call check(error, singly, merge(1, 0, n > 6), more="singly")
      if (allocated(error)) return
      deallocate(phi, a)
    end do
  end subroutine test_decoupled

  subroutine test_extreme(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 4, count = 11
    real(dp) :: phi(count, n * n), sound(4, n * n), radius(count), log_radius(count), bound(count)
    real(dp), dimension(4) :: sound_radius, sound_log, sound_bound
    logical :: stable(count), unstable(count)
    type(random_type) :: random
    integer :: k, l, singly

    call random%start(6, 1)
    phi = 0
    do k = 1, 7, 2
      phi(k, :) = [(random%about_zero(1.0_dp), l = 1, n * n)]
    end do
    sound = phi(1:7:2, :)
    phi(4, :) = phi(3, :)
    phi(4, 7) = ieee_value(1.0_dp, ieee_quiet_nan)
    phi(6, :) = phi(3, :)
    phi(6, 16) = ieee_value(1.0_dp, ieee_positive_inf)
    phi(8, [1, 6, 11, 16]) = [-3.0e200_dp, 1.0e200_dp, 2.0e200_dp, 1.0_dp]
    phi(9, [1, 6, 11, 16]) = [-3.0e-200_dp, 1.0e-200_dp, 2.0e-200_dp, 0.0_dp]
    phi(10, [1, 6, 11, 16]) = 0.5_dp
    phi(11, [1, 6, 11, 16]) = [0.5_dp, 0.0_dp, 0.0_dp, 0.0_dp]
    call spectral_radii(phi, 0.0_dp, radius, log_radius, bound, stable, unstable, singly)
    call check_that(error, ieee_is_nan([radius([4, 6]), log_radius([4, 6])]), "==", spread(.true., 1, 4), "not finite")
    call check_that(error, bound([4, 6]), ">", 1.0e299_dp, "not finite")
    call check_that(error, [stable([4, 6]), unstable([4, 6])], "==", spread(.false., 1, 4), "not finite")
    ! n epsilon norm / |rho| of a diagonal.
    call check_that(error, abs(radius(8) / 3.0e200_dp - 1), "<", 1.0e-15_dp, "great")
    call check_that(error, unstable(8), "==", .true., "great")
    call check_that(error, abs(log_radius(8) - log(3.0e200_dp)), "<", 1.0e-12_dp, "great")
    call check_that(error, abs(bound(8) / (n * epsilon(1.0_dp) * sqrt(14.0_dp) / 3) - 1), "<", 0.01_dp, "great")
    call check_that(error, abs(radius(9) / 3.0e-200_dp - 1), "<", 1.0e-15_dp, "small")
    call check_that(error, stable(9), "==", .true., "small")
    call check_that(error, abs(radius(2)), "<=", 0.0_dp, "zero")
    call check_that(error, stable(2), "==", .true., "zero")
    call check_that(error, log_radius(2), "<", -700.0_dp, "zero")
    call check_that(error, abs(radius(10:11) - 0.5_dp), "<", 1.0e-14_dp, "multiples")
    call check_that(error, stable(10:11), "==", [.true., .true.], "multiples")
    if (allocated(error)) return
    call spectral_radii(sound, 0.0_dp, sound_radius, sound_log, sound_bound)
    call check_that(error, maxval(abs([radius(1:7:2) - sound_radius, log_radius(1:7:2) - sound_log, bound(1:7:2) - sound_bound])), &
      & "<=", 0.0_dp, "finite matrices")
    call check_that(error, singly, "==", 7, "finite matrices")
  end subroutine test_extreme

  !> Results are the same bit for bit in another order, alone, in columns of any length, and a second time.
  subroutine test_independence(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 6, count = 37
    real(dp) :: phi(count, n * n), one(1, n * n)
    real(dp), dimension(count) :: radius, log_radius, bound, other, other_log, other_bound
    type(random_type) :: random
    integer :: i, k

    call random%start(7, 1)
    do k = 1, count
      phi(k, :) = [(10.0_dp**mod(k, 5) * random%about_zero(1.0_dp), i = 1, n * n)]
      ! Some that take longer.
      if (mod(k, 6) == 0) phi(k, 2:n) = 0
      if (mod(k, 7) == 0) phi(k, :) = 0.01_dp * phi(k, :) + [((merge(1, 0, mod(i - 1, n + 1) == 0)), i = 1, n * n)]
      if (mod(k, 9) == 0) phi(k, :n) = phi(k, n + 1:2 * n)
    end do
    call spectral_radii(phi, 1.0e-10_dp, radius, log_radius, bound)
    call spectral_radii(phi(count:1:-1, :), 1.0e-10_dp, other, other_log, other_bound)
    call check_that(error, maxval(abs([radius - other(count:1:-1), log_radius - other_log(count:1:-1), bound &
      & - other_bound(count:1:-1)])), "<=", 0.0_dp, "backwards")
    if (allocated(error)) return
    do k = 1, count
      one(1, :) = phi(k, :)
      call spectral_radii(one, 1.0e-10_dp, other(1:1), other_log(1:1), other_bound(1:1))
      call check_that(error, maxval(abs([radius(k) - other(1), log_radius(k) - other_log(1), bound(k) - other_bound(1)])), "<=", &
        & 0.0_dp, "alone")
      if (allocated(error)) return
    end do
    call spectral_radii(phi(3:, :), 1.0e-10_dp, other(3:), other_log(3:))
    ! If only one of them was solved by LAPACK: rounding, a part of the bound.
    call check_that(error, maxval(abs(radius(3:) - other(3:)) / (bound(3:) * radius(3:))), "<", 0.5_dp, "without bounds")
  end subroutine test_independence

  !> Eigenvalues 0.5, 0, -0.5 and so on, from elements without rounding errors.
  subroutine test_mean(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: phi(1, 25), radius(1), log_radius(1)
    integer :: singly

    phi = 0
    phi(1, [2, 6]) = 0.5_dp
    phi(1, [14, 18]) = 0.25_dp
    call spectral_radii(phi, 1.0e-10_dp, radius, log_radius, singly=singly)
    ! A few roundings.
    call check_that(error, abs(radius(1) - 0.5_dp), "<", 1.0e-14_dp, "radius")
    call check_that(error, singly, "==", 0, "singly")
    if (allocated(error)) return
    phi = 0
    phi(1, [2, 4]) = 0.5_dp
    call spectral_radii(phi(:, :9), 1.0e-10_dp, radius, log_radius, singly=singly)
    call check_that(error, abs(radius(1) - 0.5_dp), "<", 1.0e-14_dp, "radius of nine")
    call check_that(error, singly, "==", 0, "singly, of nine")
    if (allocated(error)) return
    ! All eigenvalues zero, one eigenvector: no more than the cube root of roundoff.
    phi = 0
    phi(1, [4, 8]) = 1
    call spectral_radii(phi(:, :9), 0.0_dp, radius, log_radius)
    call check_that(error, radius(1), "<", 1.0e-5_dp, "nilpotent")
  end subroutine test_mean

end module test_spectra_edges
