!> Products of maps over a turn, against quadruple precision, and products that overflow double precision.
module test_composition
  use checks, only: check_that
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_composition, only: follow_maps, multiply_maps, transient_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: iso_fortran_env, only: qp => real128
  implicit none (type, external)
  private

  public :: collect_composition

contains

  subroutine collect_composition(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("products of random maps agree with quadruple precision", test_products), &
      & new_unittest("maps from the start to mid-turn and their maximum norm agree with quadruple precision", test_transient), &
      & new_unittest("products that overflow double precision are detected", test_range)]
  end subroutine collect_composition

  !> Random maps in blocks as they come in a turn: against the products of all from the first, in quadruple precision.
  subroutine test_transient(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 4, steps = 70, middle = 45, ends(0:3) = [0, 16, 50, steps]
    real(dp), parameter :: scale(n) = [1.0_dp, 2.0_dp, 0.5_dp, 4.0_dp]
    real(dp) :: a(steps, n, n), phi(n, n)
    real(qp) :: exact(n, n, 0:steps), norms(steps)
    type(transient_type) :: transient
    logical :: fits
    integer :: i, j, k

    call random_number(a)
    a = 0.3_dp * (a - 0.5_dp)
    exact = 0
    do j = 1, n
      ! they grow at first and then die out: the largest lies in the second block
      a(:, j, j) = a(:, j, j) + 1 + [(0.2_dp * (30 - k) / 30, k = 1, steps)]
      exact(j, j, 0) = 1
    end do
    phi = real(exact(:, :, 0), dp)
    do k = 1, steps
      exact(:, :, k) = matmul(real(a(k, :, :), qp), exact(:, :, k - 1))
      norms(k) = norm2(exact(:, :, k) * spread(real(scale, qp), 1, n) / spread(real(scale, qp), 2, n))
    end do
    transient = transient_type(peak=phi, halfway=phi, peak_norm=2.0_dp, middle=middle)
    do i = 1, size(ends) - 1
      call multiply_maps(ends(i) - ends(i - 1), a(ends(i - 1) + 1:, :, :), scale, phi, fits, transient=transient)
      call check(error, fits, more="the product overflows")
      if (allocated(error)) return
    end do
    k = maxloc(norms, dim=1)
    call check_that(error, abs(transient%peak_norm - norms(k)), "<", 1.0e-13_qp * norms(k), "largest norm")
    ! 70 products of at most 4 terms: their roundings.
    call check_that(error, maxval(abs(transient%peak - exact(:, :, k))), "<", 1.0e-13_qp * norms(k), "where it is largest")
    call check_that(error, maxval(abs(transient%halfway - exact(:, :, middle))), "<", 1.0e-13_qp * norms(k), "in mid-turn")
  end subroutine test_transient

  !> 1 to 70 random maps, against their product in quadruple precision.
  subroutine test_products(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: orders(3) = [1, 2, 6]
    real(dp), parameter :: scale(6) = [1.0_dp, 2.0_dp, 0.5_dp, 4.0_dp, 1.0_dp, 8.0_dp]
    real(dp), allocatable :: maps(:, :, :), phi(:, :), xp(:), free(:, :), both(:, :), start(:)
    real(qp), allocatable :: exact(:, :), forced(:)
    real(qp) :: farthest
    real(dp) :: reach
    logical :: fits
    integer :: i, steps, k, j

    do i = 1, size(orders)
      associate (n => orders(i))
        do steps = 1, 70
          if (allocated(maps)) deallocate(maps, phi, xp)
          ! The room beyond the given steps is not used.
          allocate(maps(steps + 2, n, n + 1), phi(n, n), xp(n))
          call random_number(maps)
          call random_number(phi)
          call random_number(xp)
          maps(:, :, :n) = 0.2_dp * (maps(:, :, :n) - 0.5_dp)
          do j = 1, n
            maps(:, j, j) = maps(:, j, j) + 1
          end do
          exact = real(phi, qp)
          free = phi
          start = xp
          if (allocated(both)) deallocate(both)
          allocate(both(n, n + 1))
          forced = real(xp, qp)
          farthest = 0.7_qp
          reach = 0.7_dp
          do k = 1, steps
            exact = matmul(real(maps(k, :, :n), qp), exact)
            forced = matmul(real(maps(k, :, :n), qp), forced) + maps(k, :, n + 1)
            farthest = max(farthest, norm2(forced / scale(:n)))
          end do
          call multiply_maps(steps, maps, scale(:n), phi, fits, xp, reach)
          call check(error, fits, more="the product overflows")
          if (allocated(error)) return
          ! 70 products of at most 6 terms: their roundings.
          call check_that(error, maxval(abs(phi - exact)), "<", 1.0e-13_qp * maxval(abs(exact)), "Phi")
          call check_that(error, maxval(abs(xp - forced)), "<", 1.0e-13_qp * maxval(abs(forced)), "x_p")
          call check_that(error, abs(reach - farthest), "<", 1.0e-13_qp * farthest, "reach")
          if (allocated(error)) return
          ! The last two thirds, after the first third.
          both(:, :n) = free
          both(:, n + 1) = start
          call follow_maps(1, steps / 3, maps, both, fits)
          call follow_maps(1 + steps / 3, steps - steps / 3, maps, both, fits)
          call check_that(error, maxval(abs(both - reshape([phi, xp], [n, n + 1]))), "<", 1.0e-13_dp * maxval(abs(phi)), "pieces")
          if (allocated(error)) return
          call multiply_maps(steps, maps(:, :, :n), scale(:n), free, fits)
          call check_that(error, maxval(abs(free - phi)), "<", 1.0e-13_dp * maxval(abs(phi)), "unforced")
          if (allocated(error)) return
        end do
      end associate
    end do
  end subroutine test_products

  !> A segment whose own product overflows although that of all steps does not; products that overflow; NaN.
  subroutine test_range(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: steps = 64
    real(dp) :: a(steps, 2, 2), phi(2, 2)
    logical :: fits
    integer :: k

    a = 0
    do k = 1, steps
      a(k, 1, 1) = merge(1.0e-20_dp, 1.0e20_dp, k <= 8)
      if (k > 16) a(k, 1, 1) = 1
      a(k, 2, 2) = 1
    end do
    phi = a(steps, :, :)
    call multiply_maps(steps, a, [1.0_dp, 1.0_dp], phi, fits)
    call check(error, fits, more="the product overflows")
    if (allocated(error)) return
    call check_that(error, maxval(abs(phi - a(steps, :, :))), "<", 1.0e-14_dp, "decay and growth")
    if (allocated(error)) return

    a(17, 1, 1) = 1.0e151_dp
    call multiply_maps(steps, a, [1.0_dp, 1.0_dp], phi, fits)
    call check(error, .not. fits, more="too large")
    if (allocated(error)) return
    call multiply_maps(17, a, [1.0_dp, 1.0_dp], phi, fits)
    call check(error, .not. fits, more="too large in few steps")
  end subroutine test_range

end module test_composition
