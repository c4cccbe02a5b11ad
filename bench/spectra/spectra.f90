!> Largest multipliers of many small matrices, gestell_floquet_multipliers_spectra, compared with LAPACK's dgeev one by one:
!>
!>     fpm run --directory bench/spectra --profile release [--flag "-march=native -mprefer-vector-width=512"]
!>
!> Markdown on standard output: millions of matrices per second in the shortest of several rounds, radius alone and with error
!> bounds and verdicts; how many of the matrices these give to LAPACK; eigenvalues alone from dgeev; the largest difference of
!> the radii relative to the error bound. Random: elements even in (-1/2, 1/2). Undamped: products of shears, symplectic, all
!> multipliers of modulus 1. Damped: rotations times 0.99 coupled by a fixed matrix, a smooth family as in a chart.
program spectra
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers_spectra, only: lane_spectra_type, spectra_of_eight
  use gestell_math_lanes, only: lanes
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)

  interface
    subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: jobvl, jobvr
      integer, intent(in) :: n, lda, ldvl, ldvr, lwork
      real(dp), intent(inout) :: a(lda, n)
      real(dp), intent(out) :: wr(n), wi(n), vl(ldvl, 1), vr(ldvr, 1), work(lwork)
      integer, intent(out) :: info
    end subroutine dgeev
  end interface

  integer, parameter :: count = 10000, rounds = 7, sizes(4) = [2, 4, 6, 12]
  character(len=*), parameter :: kinds(3) = [character(len=8) :: "random", "undamped", "damped"]
  real(dp), parameter :: perturbation = 1.0e-10_dp
  real(dp), allocatable :: phi(:, :)
  real(dp), dimension(count) :: radius, bound, expected
  real(dp) :: alone, bounds, lapack
  integer(int64) :: ticks(4), rate
  integer :: i, k, round, singly

  call random_init(repeatable=.true., image_distinct=.false.)
  print "(a)", "| matrices | rows | radius, 1e6/s | with bounds, 1e6/s | to LAPACK | dgeev, 1e6/s | difference / bound |", &
    & "|---|--:|--:|--:|--:|--:|--:|"
  do i = 1, size(sizes)
    allocate(phi(count, sizes(i)**2))
    do k = 1, size(kinds)
      call fill(kinds(k), sizes(i))
      alone = huge(alone)
      bounds = huge(bounds)
      lapack = huge(lapack)
      do round = 1, rounds
        call system_clock(ticks(1), rate)
        call solve_in_lanes(sizes(i), .false.)
        call system_clock(ticks(2))
        call solve_in_lanes(sizes(i), .true.)
        call system_clock(ticks(3))
        call solve_singly(sizes(i))
        call system_clock(ticks(4))
        alone = min(alone, real(ticks(2) - ticks(1), dp) / rate)
        bounds = min(bounds, real(ticks(3) - ticks(2), dp) / rate)
        lapack = min(lapack, real(ticks(4) - ticks(3), dp) / rate)
      end do
      print "(a, i0, 2(a, f0.2), a, i0, a, f0.2, a, es7.1, a)", "| " // trim(kinds(k)) // " | ", sizes(i), " | ", &
        & count / alone * 1.0e-6_dp, " | ", count / bounds * 1.0e-6_dp, " | ", singly, " | ", count / lapack * 1.0e-6_dp, &
        & " | ", maxval(abs(radius - expected) / (bound * radius)), " |"
    end do
    deallocate(phi)
  end do

contains

  subroutine solve_in_lanes(n, bounds)
    integer, intent(in) :: n
    logical, intent(in) :: bounds
    real(dp) :: eight(lanes, n, n)
    type(lane_spectra_type) :: found
    integer :: first, lane, alone

    singly = 0
    do first = 1, count, lanes
      do lane = 1, lanes
        eight(lane, :, :) = reshape(phi(first + lane - 1, :), [n, n])
      end do
      call spectra_of_eight(n, eight, lanes, perturbation, bounds, found, alone)
      singly = singly + alone
      radius(first:first + lanes - 1) = found%radius
      bound(first:first + lanes - 1) = found%bound
    end do
  end subroutine solve_in_lanes

  subroutine solve_singly(n)
    integer, intent(in) :: n
    real(dp) :: a(n, n), re(n), im(n), none(1, 1), work(10 * n)
    integer :: j, info

    do j = 1, count
      a = reshape(phi(j, :), [n, n])
      call dgeev("N", "N", n, a, n, re, im, none, 1, none, 1, work, size(work), info)
      expected(j) = maxval(hypot(re, im))
    end do
  end subroutine solve_singly

  subroutine fill(kind, n)
    character(len=*), intent(in) :: kind
    integer, intent(in) :: n
    real(dp) :: a(n, n), s(n / 2, n / 2)
    integer :: j, l, m

    do j = 1, count
      select case (kind)
      case ("random")
        call random_number(a)
        a = a - 0.5_dp
      case ("undamped")
        a = identity(n)
        do l = 1, 6
          call random_number(s)
          s = 0.3_dp * (s + transpose(s)) + 0.25_dp * identity(n / 2)
          a(n / 2 + 1:, :) = a(n / 2 + 1:, :) - matmul(s, a(:n / 2, :))
          a(:n / 2, :) = a(:n / 2, :) + a(n / 2 + 1:, :)
        end do
      case default
        a = 0
        do l = 1, n, 2
          associate (c => cos(l * (1 + 1.0e-4_dp * j)), s => sin(l * (1 + 1.0e-4_dp * j)))
            a(l:l + 1, l:l + 1) = 0.99_dp * reshape([c, s, -s, c], [2, 2])
          end associate
        end do
        a = matmul(a, identity(n) + 0.1_dp * reshape([((sin(3.0_dp * l + 5.0_dp * m), l = 1, n), m = 1, n)], [n, n]))
      end select
      phi(j, :) = reshape(a, [n * n])
    end do
  end subroutine fill

  pure function identity(n) result(e)
    integer, intent(in) :: n
    real(dp) :: e(n, n)
    integer :: l

    e = 0
    do l = 1, n
      e(l, l) = 1
    end do
  end function identity

end program spectra
