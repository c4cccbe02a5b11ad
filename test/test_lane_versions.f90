!> The versions of the inner loops for processors with longer vectors than a portable program takes for granted.
module test_lane_versions
  use checks, only: check_that
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: has_versions, vector_length
  use gestell_math_lanes_versions, only: block, four_columns, lanes, most_rows, solve_with_lower, solve_with_upper, &
    & subtract_product
  use gestell_math_lanes, only: vector_border
  use testdrive, only: error_type, new_unittest, unittest_type
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  implicit none (type, external)
  private

  public :: collect_lane_versions

  !> Lengths of vectors, none first.
  integer, parameter :: lengths(3) = [0, 4, 8]

contains

  subroutine collect_lane_versions(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("blocks by registers of every length", test_blocks), &
      & new_unittest("sums by registers of every length", test_sums), &
      & new_unittest("room on the border of a vector", test_border)]
  end subroutine collect_lane_versions

  !> Numbers of size 1 that are not all of one sign.
  pure function numbers(n, step)
    integer, intent(in) :: n
    real(dp), intent(in) :: step
    real(dp) :: numbers(n)
    integer :: i

    numbers = [(sin(step * i), i = 1, n)]
  end function numbers

  !> C - R S, L^-1 W and W U^-1 against the compiler's own products, lane by lane, with what the processor has; beside the block
  !> nothing changes.
  subroutine test_blocks(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: terms = 20
    ! As great as a matrix, the heap's part.
    real(dp), allocatable, dimension(:, :, :) :: c, before, r, s
    real(dp) :: t(block, block), multiplier(lanes)
    integer :: k, lane, i

    allocate(c(lanes, most_rows, block), r(lanes, most_rows, terms), s(lanes, most_rows, block))
    do k = 1, size(lengths)
      if (lengths(k) > vector_length()) cycle
      c = reshape(numbers(size(c), 1.3_dp), shape(c))
      r = reshape(numbers(size(r), 2.1_dp), shape(r))
      s = reshape(numbers(size(s), 3.7_dp), shape(s))
      before = c
      call subtract_product(lengths(k), terms, c, r, s)
      do lane = 1, lanes
        t = before(lane, :block, :) - matmul(r(lane, :block, :), s(lane, :terms, :))
        ! Roundings of twenty terms below 1.
        call check_that(error, maxval(abs(c(lane, :block, :) - t)), "<", 2.0e-14_dp, "C - R S")
      end do
      call check_that(error, maxval(abs(c(:, block + 1:, :) - before(:, block + 1:, :))), "<=", 0.0_dp, "below the block")
      if (allocated(error)) return

      c = before
      call solve_with_lower(lengths(k), c, s)
      do lane = 1, lanes
        t = s(lane, :block, :)
        do i = 1, block
          t(i, i:) = 0
          t(i, i) = 1
        end do
        call check_that(error, maxval(abs(matmul(t, c(lane, :block, :)) - before(lane, :block, :))), "<", 1.0e-14_dp, "L^-1 W")
        if (allocated(error)) return
      end do

      c = before
      multiplier = 0.5_dp
      call solve_with_upper(lengths(k), c, s, multiplier)
      do lane = 1, lanes
        t = s(lane, :block, :)
        do i = 1, block
          t(i, :i - 1) = 0
          ! Reciprocals are kept.
          t(i, i) = 1 / t(i, i)
        end do
        ! Of a diagonal as great as 1 / 0.01.
        call check_that(error, maxval(abs(matmul(c(lane, :block, :), t) - before(lane, :block, :))), "<", 1.0e-12_dp, "W U^-1")
        call check_that(error, abs(multiplier(lane) - max(0.5_dp, maxval(abs(c(lane, :block, :))))), "<=", 0.0_dp, "multiplier")
        if (allocated(error)) return
      end do
    end do
    ! A build that could have versions on such a processor has them.
    if (.not. has_versions) call check_that(error, vector_length(), "==", 0, "no versions")
  end subroutine test_blocks

  subroutine test_sums(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: terms = 33
    real(dp) :: a(lanes, terms), b(terms, 4), c(lanes, 4)
    integer :: k

    a = reshape(numbers(size(a), 1.9_dp), shape(a))
    b = reshape(numbers(size(b), 2.3_dp), shape(b))
    do k = 1, size(lengths)
      if (lengths(k) > vector_length()) cycle
      c = 0
      call four_columns(lengths(k), terms, a, b, c)
      ! Roundings of 33 terms below 1.
      call check_that(error, maxval(abs(c - matmul(a, b))), "<", 4.0e-14_dp, "A B")
    end do
  end subroutine test_sums

  !> Wherever an array begins, the number that is told lies at a multiple of 64 bytes, and is one of the first eight.
  subroutine test_border(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), target :: room(40)
    integer :: from, border

    room = 0
    do from = 1, 9
      border = vector_border(room(from:))
      call check_that(error, border, ">", 0, "first number")
      call check_that(error, border, "<=", lanes, "one of the first")
      call check_that(error, int(modulo(transfer(c_loc(room(from + border - 1)), 0_c_intptr_t), 64_c_intptr_t)), "==", 0, "address")
      if (allocated(error)) return
    end do
  end subroutine test_border

end module test_lane_versions
