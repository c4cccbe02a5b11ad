!> Error discs around eigenvalues of eight matrices at once.
module test_discs
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: vector_length
  use gestell_floquet_multipliers_gershgorin, only: discs_type, find_discs
  use gestell_floquet_multipliers_small_eigensystem, only: small_eigensystem
  use gestell_math_batch_characteristic_roots, only: find_roots, guess_roots
  use gestell_math_batch_hessenberg, only: hessenberg_type, max_states, new_hessenberg
  use gestell_math_lanes, only: lanes
  use gestell_math_lapack, only: eigensystem
  use many_spectra, only: spectral_radii
  use reference_random, only: random_type
  use testdrive, only: error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: collect_discs

contains

  subroutine collect_discs(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("eigenvalues of perturbed matrices lie within the discs", test_perturbed), &
      & new_unittest("missed and inaccurate roots are detected or corrected", test_missed), &
      & new_unittest("the eigensystem of one matrix agrees with its definition and LAPACK", test_one), &
      & new_unittest("close conjugate pairs beside real eigenvalues keep correct discs and verdicts", test_pairs_near_real_values)]
  end subroutine collect_discs

  !> LAPACK's eigenvalues of matrices perturbed along the eigenvectors of one of them lie in the discs, and reach their borders.
  !> With a small coupling back, eigenvectors are the less accurate the smaller it is. Every second time the roots are found as
  !> accurately as possible.
  subroutine test_perturbed(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: couplings(4) = [1.0_dp, 1.0e-3_dp, 1.0e-7_dp, 1.0e-11_dp]
    integer, parameter :: trials = 300
    real(dp) :: a(lanes, max_states, max_states), before(lanes, max_states, max_states), perturbation(lanes), converged(lanes)
    real(dp), dimension(lanes, max_states) :: z_re, z_im
    real(dp) :: change, reach(4), distance, rounding
    logical :: conjugate(max_states)
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
    real(dp), allocatable :: d(:, :)
    type(gestell_error), allocatable :: failure
    type(hessenberg_type) :: h
    type(discs_type) :: discs
    type(random_type) :: random
    integer :: separate(4), trial, kind, n, i, j, k, lane

    call random%start(11, 1)
    separate = 0
    reach = 0
    do trial = 1, trials
      kind = 1 + mod(trial, 4)
      n = 2 + int(11 * random%draw())
      change = 10.0_dp**(-13 + 10 * random%draw())
      do j = 1, n
        do i = 1, n
          do lane = 1, lanes
            a(lane, i, j) = random%about_zero(1.0_dp / n)
            if (i > n / 2 .and. j <= n / 2) a(lane, i, j) = a(lane, i, j) * couplings(kind)
          end do
        end do
      end do
      before = a
      call new_hessenberg(vector_length(), a, n, h)
      call guess_roots(vector_length(), h, z_re, z_im, conjugate, converged)
      if (mod(trial / 4, 2) == 1) then
        converged = 0
        call find_roots(vector_length(), h, conjugate, z_re, z_im, converged)
      end if
      perturbation = change + n * epsilon(1.0_dp) * h%norm
      call find_discs(vector_length(), h, conjugate, perturbation, z_re, z_im, discs)
      do lane = 1, lanes
        if (.not. discs%separate(lane) > 0) cycle
        separate(kind) = separate(kind) + 1
        call eigensystem(before(lane, :n, :n), rho, right, left, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        k = 1 + int(n * random%draw())
        d = real(spread(left(:, k), 2, n) * conjg(spread(right(:, k), 1, n)) * exp(cmplx(0, 6.2_dp * random%draw(), dp)))
        call eigensystem(before(lane, :n, :n) + d * (change / norm2(d)), rho, right, left, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        do k = 1, n
          i = minloc(abs(rho - cmplx(z_re(lane, k), z_im(lane, k), dp)), dim=1)
          distance = abs(rho(i) - cmplx(z_re(lane, k), z_im(lane, k), dp))
          ! The rounding of LAPACK, and that of the perturbation.
          rounding = n * epsilon(1.0_dp) * h%norm(lane) * discs%condition(lane, k)
          call check_that(error, distance, "<=", discs%radius(lane, k) + rounding, "outside")
          if (allocated(error)) return
          if (rounding < 1.0e-3_dp * discs%radius(lane, k)) reach(kind) = max(reach(kind), distance / discs%radius(lane, k))
        end do
      end do
    end do
    call check_that(error, reach, ">", 0.95_dp, "the disc is needed")
    ! Most of 75 times eight matrices, with couplings far above the root of roundoff at least.
    call check_that(error, separate(:2), ">", 300, "lanes with discs")
  end subroutine test_perturbed

  !> A root that is found twice in place of another one; a root that is inaccurate.
  subroutine test_missed(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: found(lanes)
    type(discs_type) :: discs, displaced
    real(dp) :: a(lanes, max_states, max_states), before(lanes, 6, 6)
    real(dp), dimension(lanes, max_states) :: z_re, z_im, w_re, w_im
    real(dp), parameter :: perturbation(lanes) = 1.0e-12_dp, displacement = 1.0e-10_dp
    logical :: conjugate(max_states)
    type(hessenberg_type) :: h
    type(random_type) :: random
    integer :: i, j, lane

    call random%start(8, 1)
    do j = 1, 6
      do i = 1, 6
        a(:, i, j) = [(random%about_zero(1.0_dp), lane = 1, lanes)]
      end do
    end do
    before = a(:, :6, :6)
    call new_hessenberg(vector_length(), a, 6, h)
    call check_that(error, maxval(abs(h%norm - [(norm2(before(lane, :, :)), lane = 1, lanes)])), "<", 1.0e-14_dp, "norm")
    if (allocated(error)) return
    call guess_roots(vector_length(), h, z_re, z_im, conjugate, found)
    found = 0
    call find_roots(vector_length(), h, conjugate, z_re, z_im, found)
    call check_that(error, found, ">", 0.0_dp, "found")
    if (allocated(error)) return
    conjugate = .false.
    call find_discs(vector_length(), h, conjugate, perturbation, z_re, z_im, discs)
    call check_that(error, sum(discs%separate), ">", 6.0_dp, "lanes with discs")
    call check_that(error, discs%sharp, ">=", discs%separate, "sharp")
    if (allocated(error)) return
    ! Newton's step corrects a small displacement, except for its square over distances of a tenth and conditions of ten.
    w_re = z_re
    w_im = z_im
    w_im(:, 2) = w_im(:, 2) + displacement
    call find_discs(vector_length(), h, conjugate, perturbation, w_re, w_im, displaced)
    call check_that(error, displaced%separate, "==", discs%separate, "displaced, separate")
    call check_that(error, displaced%sharp, ">=", discs%separate, "displaced, sharp")
    if (allocated(error)) return
    do j = 1, 6
      call check_that(error, merge(hypot(w_re(:, j) - z_re(:, j), w_im(:, j) - z_im(:, j)), 0.0_dp, discs%separate > 0), "<=", &
        & displaced%radius(:, j), "displaced")
      call check_that(error, merge(displaced%radius(:, j), 0.0_dp, discs%separate > 0), "<=", 1.01_dp * discs%radius(:, j), &
        & "displaced, discs")
      if (allocated(error)) return
    end do
    ! A larger displacement is reported, and its correction is left to other methods.
    w_re = z_re
    w_im = z_im
    w_im(:, 2) = w_im(:, 2) + 1.0e4_dp * displacement
    call find_discs(vector_length(), h, conjugate, perturbation, w_re, w_im, displaced)
    call check_that(error, displaced%separate + displaced%sharp, "<=", 0.0_dp, "displaced further")
    call check_that(error, abs(w_im(:, 2) - z_im(:, 2)), ">", 0.9e4_dp * displacement, "no step")
    if (allocated(error)) return
    ! The first root is given again as second root.
    w_re = z_re
    w_im = z_im
    w_re(:, 2) = w_re(:, 1)
    w_im(:, 2) = w_im(:, 1)
    call find_discs(vector_length(), h, conjugate, perturbation, w_re, w_im, displaced)
    call check_that(error, displaced%separate, "<=", 0.0_dp, "twice")
  end subroutine test_missed

  !> The eigensystem of one matrix, against its definition and LAPACK's eigenvalues. With a small coupling back Hyman's vectors
  !> are poor; what cannot be proved is left to LAPACK.
  subroutine test_one(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: couplings(4) = [1.0_dp, 1.0e-3_dp, 1.0e-6_dp, 1.0e-12_dp]
    integer, parameter :: trials = 800
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :), known(:), x(:, :), y(:, :)
    real(dp), allocatable :: a(:, :)
    type(gestell_error), allocatable :: failure
    type(random_type) :: random
    real(dp) :: rounding, condition
    integer :: found(4), trial, kind, n, i, j, k

    call random%start(12, 1)
    found = 0
    do trial = 1, trials
      kind = 1 + mod(trial, 4)
      n = 2 * (1 + int(4 * random%draw()))
      allocate(a(n, n))
      do j = 1, n
        do i = 1, n
          a(i, j) = random%about_zero(10.0_dp**mod(trial, 7))
          if (i > n / 2 .and. j <= n / 2) a(i, j) = a(i, j) * couplings(kind)
        end do
      end do
      call small_eigensystem(a, rho, right, left)
      if (allocated(rho)) then
        found(kind) = found(kind) + 1
        call eigensystem(a, known, x, y, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        rounding = n * epsilon(1.0_dp) * norm2(a)
        do k = 1, n
          condition = 1 / abs(dot_product(left(:, k), right(:, k)))
          ! Both are within some roundings of n states; of residuals the vectors' own count too.
          call check_that(error, minval(abs(known - rho(k))), "<=", 10 * rounding * condition, "eigenvalue")
          call check_that(error, norm2(abs(matmul(a, right(:, k)) - rho(k) * right(:, k))), "<=", 20 * rounding, &
            & "right eigenvectors")
          call check_that(error, norm2(abs(matmul(transpose(a), left(:, k)) - conjg(rho(k)) * left(:, k))), "<=", 20 * rounding, &
            & "left eigenvectors")
          call check_that(error, abs(norm2(abs(right(:, k))) - 1) + abs(norm2(abs(left(:, k))) - 1), "<", 1.0e-14_dp, "unit")
          if (aimag(rho(k)) < 0) call check_that(error, abs(rho(k) - conjg(rho(k - 1))), "<=", 0.0_dp, "conjugates")
          if (.not. abs(aimag(rho(k))) > 0) call check_that(error, sign(1.0_dp, aimag(rho(k))), ">", 0.0_dp, "sign of zero")
          if (allocated(error)) return
        end do
      end if
      deallocate(a)
    end do
    ! Most of two hundred each.
    call check_that(error, found(:2), ">", 140, "found")
    if (allocated(error)) return
    ! One eigenvector for two eigenvalues; NaN; the zero matrix.
    a = reshape([1.0_dp, 0.0_dp, 1.0_dp, 1.0_dp], [2, 2])
    call small_eigensystem(a, rho, right, left)
    call check_that(error, allocated(rho), "==", .false., "defective")
    a = ieee_value(1.0_dp, ieee_quiet_nan)
    call small_eigensystem(a, rho, right, left)
    call check_that(error, allocated(rho), "==", .false., "none")
    a = 0
    call small_eigensystem(a, rho, right, left)
    call check_that(error, allocated(rho), "==", .false., "zero")
  end subroutine test_one

  !> Two close conjugate pairs, one of which takes the place where other matrices have two real eigenvalues. R(theta) x N with N
  !> = [top - g / 2, 1; g^2 / 4, top - g / 2] has the eigenvalues exp(+-i theta) (top - g / 2 +- g / 2). A perturbation of the
  !> norm 1e-7, R(theta) x [0, 0; -1e-7, 0], moves the larger ones below 1: the verdict "unstable" would be wrong.
  subroutine test_pairs_near_real_values(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: theta = 2, g = 1.0e-3_dp, change = 1.0e-7_dp, top = 1 + 1.05_dp * change / g
    real(dp), parameter :: turn(2, 2) = reshape([cos(theta), sin(theta), -sin(theta), cos(theta)], [2, 2])
    real(dp), parameter :: other(16) = [0.4_dp, 0.5_dp, 0.05_dp, 0.0_dp, -0.5_dp, 0.4_dp, 0.0_dp, 0.03_dp, &
      & 0.1_dp, 0.0_dp, -0.3_dp, 0.0_dp, 0.07_dp, 0.2_dp, 0.0_dp, -0.8_dp]
    real(dp) :: phi(8, 16), a(4, 4), changed(2, 2), n(2, 2)
    real(dp), dimension(8) :: radius, log_radius, bound, alone
    logical, dimension(8) :: stable, unstable
    integer :: i, j

    n = reshape([top - g / 2, g**2 / 4, 1.0_dp, top - g / 2], [2, 2])
    changed = n
    changed(2, 1) = changed(2, 1) - change
    ! Its largest eigenvalue: half the trace, and the root of the contribution of the off-diagonal elements.
    call check_that(error, changed(1, 1) + sqrt(changed(2, 1) * changed(1, 2)), "<", 1.0_dp, "the changed matrix")
    if (allocated(error)) return
    do j = 1, 2
      do i = 1, 2
        a(2 * i - 1:2 * i, 2 * j - 1:2 * j) = turn(i, j) * n
      end do
    end do
    phi = spread(other, 1, 8)
    phi(1, :) = reshape(a, [16])
    call spectral_radii(phi, change, radius, log_radius, bound, stable, unstable)
    call check_that(error, unstable(1), "==", .false., "unstable")
    if (allocated(error)) return
    phi = spread(phi(1, :), 1, 8)
    call spectral_radii(phi, change, radius, log_radius, alone, stable, unstable)
    ! Roundings of sums in another order.
    call check_that(error, abs(bound(1) / alone(1) - 1), "<", 1.0e-9_dp, "bound")
  end subroutine test_pairs_near_real_values

end module test_discs
