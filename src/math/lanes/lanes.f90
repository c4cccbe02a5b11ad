!> Elimination in eight small matrices side by side. The first index of every array is the lane, the number of the matrix. A
!> vector register of the processor holds one element of several matrices and applies the same arithmetic to all of them.
!>
!> Within each lane this is elimination by blocks of 3 x 3 from left to right, in panels of three or six columns. To eliminate a
!> panel, only the multipliers of the columns to its left are needed: the factor L of A = L U. They are stored block row by block
!> row: l(:, :, k, i) is column k in the rows of block i. U is not stored, because only the Schur complement is needed. The matrix
!> itself need not be stored either: the caller can fill each panel just before its elimination.
!>
!> The sums of a block stay in registers during the loop over all eliminated unknowns (gestell_math_lanes_versions). The compiler
!> can do this because the flow of control is the same in all lanes; only the data differ. The inner loop tests its end at the
!> bottom, because a test at the top would be control flow within a lane. With `!GCC$ ivdep` gfortran assumes that lanes do not
!> depend on each other; results are the same without it.
module gestell_math_lanes
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: has_long_vectors, vector_length
  use gestell_math_lanes_six, only: divide_six, reduce_six, subtract_six
  use gestell_math_lanes_versions, only: block, lanes, solve_with_lower, solve_with_upper, subtract_column, subtract_product, width
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  implicit none (type, external)
  private

  !> `block`: number of rows of a block. `width`: maximum number of columns of a panel. `lanes`: number of matrices side by side
  public :: block, columns_at_once, columns_of_panel, eliminate, lanes, padded_to_block, reduce, schur_complement, vector_border, &
    & width
  !> Largest multiplier for which elimination without exchanges loses no significant digits. For comparison, threshold pivoting in
  !> sparse elimination allows 10 to 100 (I. S. Duff, A. M. Erisman, J. K. Reid, Direct Methods for Sparse Matrices, section 5).
  real(dp), parameter, public :: safe_multiplier = 16
  !> Minimum absolute value of a pivot; the procedures treat a smaller pivot as zero.
  real(dp), parameter :: min_pivot = 1.0e-8_dp

contains

  !> Smallest multiple of `block` that is not below n.
  pure integer function padded_to_block(n)
    integer, intent(in) :: n

    padded_to_block = block * ((n + block - 1) / block)
  end function padded_to_block

  !> Best number of columns of a panel: six if the processor has 32 vector registers, which can hold eighteen sums, and three if it
  !> has fewer.
  pure integer function columns_at_once()
    columns_at_once = merge(width, block, has_long_vectors())
  end function columns_at_once

  !> Number of columns of the next panel if `left` columns remain: six or three, or one for a last single column.
  pure integer function columns_of_panel(left) result(columns)
    integer, intent(in) :: left

    columns = merge(block, 1, left > 1)
    if (left >= columns_at_once()) columns = columns_at_once()
  end function columns_of_panel

  !> Index of the first element of `numbers` whose address is a multiple of 64 bytes (eight elements). A vector of eight elements
  !> that begins at another address occupies two cache lines.
  integer function vector_border(numbers)
    real(dp), contiguous, target, intent(in) :: numbers(:)

    associate (address => transfer(c_loc(numbers), 0_c_intptr_t))
      vector_border = int(1 + modulo(-address / (storage_size(numbers) / 8), int(lanes, c_intptr_t)))
    end associate
  end function vector_border

  !> Computes the Schur complement of A, which has `n` rows and columns, in the matrix `w`, shape (lanes, rows, columns). It
  !> replaces
  !>
  !>     [ A  R ]
  !>     [ G  S ]      by      [ ...  ... ;  ...  S - G A^-1 R ].
  !>
  !> All numbers of rows and columns are multiples of `block`. A must be in units in which its diagonal is about 1. Rows are not
  !> exchanged. `multiplier`, shape (lanes), is the largest factor by which a row of A was subtracted from another one; it is huge
  !> if a pivot is zero. Elimination is as accurate as with exchanges if `multiplier` is not far above 1.
  pure subroutine schur_complement(w, n, multiplier)
    real(dp), contiguous, intent(inout) :: w(:, :, :)
    integer, intent(in) :: n
    real(dp), intent(out) :: multiplier(lanes)
    !> Allocated on the heap, because threads have small stacks
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

  !> Eliminates the three or six unknowns of a panel. The columns of a panel contain the rows of A and, below them, the rows of G
  !> (see `schur_complement`). All columns before `first` have already been eliminated.
  pure subroutine eliminate(first, columns, n, rows, panel, l, multiplier)
    !> `first`: first column of the panel. `columns`: number of columns of the panel. `n`: number of unknowns. `rows`: number of
    !> rows.
    integer, intent(in) :: first, columns, n, rows
    !> `panel`: panel to be eliminated. `l`: multipliers L, to which the multipliers of this panel are added. `multiplier`: largest
    !> multiplier in the rows of A in all panels so far.
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

  !> Applies the elimination of the unknowns `from` to `to` to a panel of one, three or six columns, up to row `rows`.
  pure subroutine reduce(from, to, columns, n, rows, panel, l)
    !> `from`, `to`: first and last unknown to be eliminated. `columns`: number of columns of the panel. `n`: number of unknowns.
    !> `rows`: number of rows.
    integer, intent(in) :: from, to, columns, n, rows
    !> The panel
    real(dp), intent(inout) :: panel(lanes, width, rows)
    !> Multipliers L of the eliminated unknowns
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

  !> Replaces the first column of the block W by L^-1 times this column.
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

  !> Eliminates three unknowns: columns `c` to c + 2 of a panel whose first column is column `first` of the matrix. Stores their
  !> multipliers for all rows below, up to `rows`, and updates the panel's columns to the right.
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

  !> Factorises the block W = L U; the diagonal of L is 1. The reciprocals of the pivots are stored in place of the pivots.
  pure subroutine factorise_block(w, l, multiplier)
    real(dp), intent(inout) :: w(lanes, width, block), l(lanes, block, block), multiplier(lanes)
    real(dp) :: p1, p2, p3, u12, u13, u23, l21, l31, l32
    integer :: lane

    !GCC$ ivdep
    do lane = 1, lanes
      p1 = w(lane, 1, 1)
      w(lane, 1, 1) = 1 / merge(p1, 1.0_dp, abs(p1) > min_pivot)
      u12 = w(lane, 2, 1)
      u13 = w(lane, 3, 1)
      l21 = w(lane, 1, 2) * w(lane, 1, 1)
      l31 = w(lane, 1, 3) * w(lane, 1, 1)
      p2 = w(lane, 2, 2) - l21 * u12
      w(lane, 2, 2) = 1 / merge(p2, 1.0_dp, abs(p2) > min_pivot)
      u23 = w(lane, 3, 2) - l21 * u13
      l32 = (w(lane, 2, 3) - l31 * u12) * w(lane, 2, 2)
      p3 = w(lane, 3, 3) - l31 * u13 - l32 * u23
      w(lane, 3, 3) = 1 / merge(p3, 1.0_dp, abs(p3) > min_pivot)
      w(lane, 3, 2) = u23
      l(lane, 2, 1) = l21
      l(lane, 3, 1) = l31
      l(lane, 3, 2) = l32
      multiplier(lane) = max(multiplier(lane), abs(l21), abs(l31), abs(l32))
      ! Pivots are tested one by one: min over several numbers would lose a NaN.
      multiplier(lane) = merge(multiplier(lane), huge(1.0_dp), &
        & abs(p1) > min_pivot .and. abs(p2) > min_pivot .and. abs(p3) > min_pivot)
    end do
  end subroutine factorise_block

end module gestell_math_lanes
