!> Elimination in eight small matrices side by side. The lane, the number of the matrix, is the first index of all arrays:
!> a processor's vector registers hold one element of several matrices each, and do the same arithmetic for all of them.
!>
!> How to read it: forget the lanes, and it is elimination by blocks of 3 x 3 from left to right, in panels of three or six columns.
!> What the columns of a panel need of those before are their multipliers alone, L of A = L U, block row after block row:
!> l(:, :, k, i) is column k in the rows of block i. U is nowhere kept, since what is sought is the Schur complement. So the matrix
!> needs no place of its own: a panel is filled when its turn has come, and what is read again lies in the order in which it is
!> read.
!> The sums of a block stay in registers while they run over all eliminated unknowns (gestell_math_lanes_versions); this, and that
!> nothing depends on the lane but the data, is what lets a compiler keep the registers full. The inner loop ends at its foot since
!> a test at its head would be control flow in a lane. `!GCC$ ivdep` tells gfortran that lanes do not depend on each other; without
!> it the results are the same.
module gestell_math_lanes
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: has_long_vectors, vector_length
  use gestell_math_lanes_six, only: divide_six, reduce_six, subtract_six
  use gestell_math_lanes_versions, only: block, lanes, solve_with_lower, solve_with_upper, subtract_column, subtract_product, width
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  implicit none (type, external)
  private

  !> Rows of a block, columns that a panel has room for, matrices side by side.
  public :: block, columns_at_once, columns_of_panel, eliminate, lanes, padded, reduce, schur_complement, vector_border, width
  !> Below this multiplier no digits that matter are lost (threshold pivoting in sparse elimination allows 10 to 100; I. S.
  !> Duff, A. M. Erisman, J. K. Reid, Direct Methods for Sparse Matrices, section 5).
  real(dp), parameter, public :: safe_multiplier = 16
  !> A smaller pivot has vanished.
  real(dp), parameter :: least_pivot = 1.0e-8_dp

contains

  !> The next multiple of `block`.
  pure integer function padded(n)
    integer, intent(in) :: n

    padded = block * ((n + block - 1) / block)
  end function padded

  !> How many columns of a panel are best treated together: eighteen sums need more than sixteen registers.
  pure integer function columns_at_once()
    columns_at_once = merge(width, block, has_long_vectors())
  end function columns_at_once

  !> How many of the next columns of a map are treated together, where so many are left: six or three, or the last one alone.
  pure integer function columns_of_panel(left) result(columns)
    integer, intent(in) :: left

    columns = merge(block, 1, left > 1)
    if (left >= columns_at_once()) columns = columns_at_once()
  end function columns_of_panel

  !> The first of these numbers that lies on the border of a vector of eight: one that does not costs two pieces of the cache.
  integer function vector_border(numbers)
    real(dp), contiguous, target, intent(in) :: numbers(:)

    associate (address => transfer(c_loc(numbers), 0_c_intptr_t))
      vector_border = int(1 + modulo(-address / (storage_size(numbers) / 8), int(lanes, c_intptr_t)))
    end associate
  end function vector_border

  !> With A of `n` rows and columns in its upper left, the matrix `w`, shape (lanes, rows, columns),
  !>
  !>     [ A  R ]
  !>     [ G  S ]      becomes      [ ...  ... ;  ...  S - G A^-1 R ].
  !>
  !> All numbers are multiples of `block`; A is in units in which its diagonal is about 1. There is no
  !> exchange of rows: `multiplier`, shape (lanes), is the greatest factor by which a row of A was subtracted from another,
  !> huge where a pivot vanished. Elimination is as safe as with exchanges while it is not far above 1.
  pure subroutine schur_complement(w, n, multiplier)
    real(dp), contiguous, intent(inout) :: w(:, :, :)
    integer, intent(in) :: n
    real(dp), intent(out) :: multiplier(lanes)
    !> On the heap: threads have small stacks.
    real(dp), allocatable :: panel(:, :, :), l(:, :, :, :)
    integer :: rows, first, last, count, c, row, lane

    rows = size(w, 2)
    allocate(panel(lanes, width, rows), l(lanes, block, n, rows / block))
    multiplier = 0
    first = 1
    do while (first <= size(w, 3))
      last = merge(n, size(w, 3), first <= n)
      count = min(columns_at_once(), last - first + 1)
      do c = 1, count
        do row = 1, rows
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, c, row) = w(lane, row, first + c - 1)
          end do
        end do
      end do
      if (first <= n) then
        call eliminate(first, count, n, rows, panel, l, multiplier)
      else
        call reduce(1, n, count, n, rows, panel, l)
        do c = 1, count
          w(:, n + 1:, first + c - 1) = panel(:, c, n + 1:)
        end do
      end if
      first = first + count
    end do
  end subroutine schur_complement

  !> The next unknowns: three or six columns of A and G from `first` on, where those before have been eliminated and `l` has their
  !> multipliers, to which those of these come. `multiplier` becomes the greatest in the rows of A, if that is greater.
  pure subroutine eliminate(first, columns, n, rows, panel, l, multiplier)
    integer, intent(in) :: first, columns, n, rows
    real(dp), intent(inout) :: panel(lanes, width, rows), l(lanes, block, n, rows / block), multiplier(lanes)
    real(dp) :: unused(lanes)
    integer :: through, row, c

    unused = 0
    through = rows
    if (columns == width .and. first > 1) through = first + columns - 1
    call reduce(1, first - 1, columns, n, through, panel, l)
    do c = 1, columns, block
      call divide(first, c, columns, n, through, panel, l, multiplier)
    end do
    do row = through + 1, rows, block
      associate (i => (row + 2) / block)
        if (row <= n) then
          call divide_six(first - 1, panel(1, 1, row), l(1, 1, 1, i), panel, panel(1, 1, first), l(1, 1, first, i), multiplier)
        else
          call divide_six(first - 1, panel(1, 1, row), l(1, 1, 1, i), panel, panel(1, 1, first), l(1, 1, first, i), unused)
        end if
      end associate
    end do
  end subroutine eliminate

  !> A panel of one, three or six columns after the elimination of the unknowns `from` to `to`, up to row `rows`.
  pure subroutine reduce(from, to, columns, n, rows, panel, l)
    integer, intent(in) :: from, to, columns, n, rows
    real(dp), intent(inout) :: panel(lanes, width, rows)
    real(dp), intent(in) :: l(lanes, block, n, rows / block)
    integer :: length, row, terms, i, c
    logical :: six

    length = vector_length()
    six = columns == width
    do row = from, rows, block
      i = (row + 2) / block
      terms = min(row, to + 1) - from
      if (six .and. terms > 0) then
        if (row <= to) then
          call reduce_six(terms, panel(1, 1, row), l(1, 1, from, i), panel(1, 1, from), l(1, 1, row, i))
        else
          call subtract_six(terms, panel(1, 1, row), l(1, 1, from, i), panel(1, 1, from))
        end if
      else if (columns == 1) then
        if (terms > 0) call subtract_column(length, terms, panel(1, 1, row), l(1, 1, from, i), panel(1, 1, from))
        if (row <= to) call solve_for_column(panel(1, 1, row), l(1, 1, row, i))
      else
        do c = 1, columns, block
          if (terms > 0) call subtract_product(length, terms, panel(1, c, row), l(1, 1, from, i), panel(1, c, from))
          if (row <= to) call solve_with_lower(length, panel(1, c, row), l(1, 1, row, i))
        end do
      end if
    end do
  end subroutine reduce

  !> W <- L^-1 W for the first column of W.
  pure subroutine solve_for_column(w, l)
    real(dp), intent(inout) :: w(lanes, width, block)
    real(dp), intent(in) :: l(lanes, block, block)
    integer :: lane

    !GCC$ ivdep
    do lane = 1, lanes
      w(lane, 1, 2) = w(lane, 1, 2) - l(lane, 2, 1) * w(lane, 1, 1)
      w(lane, 1, 3) = w(lane, 1, 3) - l(lane, 3, 1) * w(lane, 1, 1) - l(lane, 3, 2) * w(lane, 1, 2)
    end do
  end subroutine solve_for_column

  !> Three unknowns, columns `c` to c + 2 of a panel that begins with column `first`: their multipliers in the rows below them, up
  !> to `rows`, and what their elimination makes of the columns to their right. Eight arguments: as `eliminate`, and which columns.
  pure subroutine divide(first, c, columns, n, rows, panel, l, multiplier)
    integer, intent(in) :: first, c, columns, n, rows
    real(dp), intent(inout) :: panel(lanes, width, rows), l(lanes, block, n, rows / block), multiplier(lanes)
    real(dp) :: unused(lanes)
    integer :: length, pivot, row, i
    logical :: others

    length = vector_length()
    unused = 0
    pivot = first + c - 1
    others = c + block <= columns
    i = (pivot + 2) / block
    call factorise_block(panel(1, c, pivot), l(1, 1, pivot, i), multiplier)
    if (others) call solve_with_lower(length, panel(1, c + block, pivot), l(1, 1, pivot, i))
    do row = pivot + block, rows, block
      i = (row + 2) / block
      if (row <= n) then
        call solve_with_upper(length, panel(1, c, row), panel(1, c, pivot), l(1, 1, pivot, i), multiplier)
      else
        call solve_with_upper(length, panel(1, c, row), panel(1, c, pivot), l(1, 1, pivot, i), unused)
      end if
      if (others) call subtract_product(length, block, panel(1, c + block, row), l(1, 1, pivot, i), panel(1, c + block, pivot))
    end do
  end subroutine divide

  !> W = L U with unit L; in place of the pivots their reciprocals are kept.
  pure subroutine factorise_block(w, l, multiplier)
    real(dp), intent(inout) :: w(lanes, width, block), l(lanes, block, block), multiplier(lanes)
    real(dp) :: p1, p2, p3, u12, u13, u23, l21, l31, l32
    integer :: lane

    !GCC$ ivdep
    do lane = 1, lanes
      p1 = w(lane, 1, 1)
      w(lane, 1, 1) = 1 / merge(p1, 1.0_dp, abs(p1) > least_pivot)
      u12 = w(lane, 2, 1)
      u13 = w(lane, 3, 1)
      l21 = w(lane, 1, 2) * w(lane, 1, 1)
      l31 = w(lane, 1, 3) * w(lane, 1, 1)
      p2 = w(lane, 2, 2) - l21 * u12
      w(lane, 2, 2) = 1 / merge(p2, 1.0_dp, abs(p2) > least_pivot)
      u23 = w(lane, 3, 2) - l21 * u13
      l32 = (w(lane, 2, 3) - l31 * u12) * w(lane, 2, 2)
      p3 = w(lane, 3, 3) - l31 * u13 - l32 * u23
      w(lane, 3, 3) = 1 / merge(p3, 1.0_dp, abs(p3) > least_pivot)
      w(lane, 3, 2) = u23
      l(lane, 2, 1) = l21
      l(lane, 3, 1) = l31
      l(lane, 3, 2) = l32
      multiplier(lane) = max(multiplier(lane), abs(l21), abs(l31), abs(l32))
      ! One by one: the least of several numbers loses one that is none.
      multiplier(lane) = merge(multiplier(lane), huge(1.0_dp), &
        & abs(p1) > least_pivot .and. abs(p2) > least_pivot .and. abs(p3) > least_pivot)
    end do
  end subroutine factorise_block

end module gestell_math_lanes
