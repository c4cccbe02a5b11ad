!> The elimination alone, gestell_math_lanes, for the steps of Gauss' methods with three degrees of freedom:
!>
!>     kernel PEAK       the core's peak in 1e9 operations/s (bench/peak.c)
!>
!> Markdown on standard output: operations by formula (of the unpadded matrices, a division counts once), shortest time for
!> eight matrices, filled anew from a copy whose time is taken off (that into panels counts), and the share of the peak.
program kernel
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes, padded_to_block, schur_complement
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)

  integer, parameter :: f = 3, repeats = 200, rounds = 500
  real(dp), allocatable :: original(:, :, :), w(:, :, :)
  real(dp) :: multiplier(lanes), peak, copying, both, rate, operations
  character(len=40) :: argument
  integer :: stages, n, columns, i

  call get_command_argument(1, argument)
  read (argument, *) peak
  print "(a)", "| method | rows and columns | operations | time of eight, us | 1e9 operations/s | share of the peak |", &
    & "|---|--:|--:|--:|--:|--:|"
  do stages = 4, 10
    n = padded_to_block(stages * f)
    columns = n + padded_to_block(2 * f + 1)
    if (allocated(w)) deallocate(original, w)
    allocate(original(lanes, n + 2 * f, columns), w(lanes, n + 2 * f, columns))
    call random_number(original)
    do i = 1, n
      original(:, i, i) = original(:, i, i) + 10
    end do
    copying = time(.false.)
    both = time(.true.)
    operations = lanes * sum([(count_of(stages * f + 2 * f - i, stages * f + 2 * f + 1 - i), i = 1, stages * f)])
    rate = operations / (both - copying) * 1.0e-9_dp
    print "(a, i0, a, i0, a, i0, a, i0, a, f0.2, a, f0.1, a, i0, a)", "| gauss", stages, " | ", stages * f + 2 * f, " x ", &
      & stages * f + 2 * f + 1, " | ", nint(operations), " | ", (both - copying) * 1.0e6_dp, " | ", rate, " | ", &
      & nint(100 * rate / peak), "% |"
  end do

contains

  !> Operations of eliminating one unknown: a reciprocal, factors of `below` rows, and their rows in `right` columns.
  pure real(dp) function count_of(below, right) result(count)
    integer, intent(in) :: below, right

    count = 1.0_dp + below + 2.0_dp * below * right
  end function count_of

  !> Shortest time of a copy, and where asked for of its elimination.
  real(dp) function time(eliminating)
    logical, intent(in) :: eliminating
    integer(int64) :: start, finish, ticks
    integer :: round, k

    time = huge(time)
    do round = 1, rounds
      call system_clock(start, ticks)
      do k = 1, repeats
        w = original
        if (eliminating) call schur_complement(w, n, multiplier)
        ! Nothing may be left out because nothing is read.
        original(1, 1, columns) = original(1, 1, columns) + 1.0e-300_dp * w(1, 2, 2)
      end do
      call system_clock(finish)
      time = min(time, real(finish - start, dp) / ticks / repeats)
    end do
  end function time

end program kernel
