!> Elimination in eight small matrices side by side. The lane, the number of the matrix, is the first index of all arrays:
!> a processor's vector registers hold one element of several matrices each, and do the same arithmetic for all of them.
!>
!> How to read it: forget the loops over `lane`, and it is elimination by blocks of 3 x 3. The sums of a block stay in nine
!> scalars while they run over all eliminated unknowns; this, and that nothing depends on the lane but the data, is what
!> lets a compiler keep the registers full. The inner loop ends at its foot since a test at its head would be control flow
!> in a lane. `!GCC$ ivdep` tells gfortran that lanes do not depend on each other; without it the results are the same.
module gestell_math_lanes
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: padded, schur_complement

  !> Matrices side by side, rows of a block, and the most rows that a matrix can have: columns lie so far apart in memory whatever
  !> its rows, a vectorised loop cannot do with less. (Ten stages of six degrees of freedom with the embedded method; 36 would be as
  !> fast for three.)
  integer, parameter, public :: lanes = 8, block = 3, most_rows = 78
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

  !> With A of `n` rows and columns in its upper left, the matrix
  !>
  !>     [ A  R ]
  !>     [ G  S ]      of `rows` rows and `columns` columns becomes      [ L\U  ... ;  ...  S - G A^-1 R ].
  !>
  !> All numbers are multiples of `block`, rows <= most_rows; A is in units in which its diagonal is about 1. There is no
  !> exchange of rows: `multiplier`, shape (lanes), is the greatest factor by which a row of A was subtracted from another,
  !> huge where a pivot vanished. Elimination is as safe as with exchanges while it is not far above 1. Where the first rows and
  !> columns have been eliminated before, those `from` one on follow.
  pure subroutine schur_complement(w, n, rows, columns, multiplier, from)
    integer, intent(in) :: n, rows, columns
    real(dp), intent(inout) :: w(lanes, most_rows, columns)
    real(dp), intent(out) :: multiplier(lanes)
    integer, intent(in), optional :: from
    real(dp) :: unused(lanes)
    integer :: first, i, j

    first = 1
    if (present(from)) first = from
    multiplier = 0
    unused = 0
    do j = first, columns, block
      do i = first, rows, block
        call subtract_product(w, columns, i, j, first, min(i, j, n + 1) - 1)
        if (i > n .and. j > n) cycle
        if (i < j) then
          call solve_with_lower(w, columns, i, j)
        else if (i == j) then
          call factorise_block(w, columns, i, multiplier)
        else if (i <= n) then
          call solve_with_upper(w, columns, i, j, multiplier)
        else
          call solve_with_upper(w, columns, i, j, unused)
        end if
      end do
    end do
  end subroutine schur_complement

  !> W_ij <- W_ij - sum over k = first ... last of W_ik W_kj for the block whose first element is (i, j).
  pure subroutine subtract_product(w, columns, i, j, first, last)
    integer, intent(in) :: columns, i, j, first, last
    real(dp), intent(inout) :: w(lanes, most_rows, columns)
    real(dp) :: c11, c21, c31, c12, c22, c32, c13, c23, c33, r1, r2, r3, s1, s2, s3
    integer :: lane, k

    if (last < first) return
    !GCC$ ivdep
    do lane = 1, lanes
      c11 = w(lane, i, j)
      c21 = w(lane, i + 1, j)
      c31 = w(lane, i + 2, j)
      c12 = w(lane, i, j + 1)
      c22 = w(lane, i + 1, j + 1)
      c32 = w(lane, i + 2, j + 1)
      c13 = w(lane, i, j + 2)
      c23 = w(lane, i + 1, j + 2)
      c33 = w(lane, i + 2, j + 2)
      k = first
      do
        r1 = w(lane, i, k)
        r2 = w(lane, i + 1, k)
        r3 = w(lane, i + 2, k)
        s1 = w(lane, k, j)
        s2 = w(lane, k, j + 1)
        s3 = w(lane, k, j + 2)
        c11 = c11 - r1 * s1
        c21 = c21 - r2 * s1
        c31 = c31 - r3 * s1
        c12 = c12 - r1 * s2
        c22 = c22 - r2 * s2
        c32 = c32 - r3 * s2
        c13 = c13 - r1 * s3
        c23 = c23 - r2 * s3
        c33 = c33 - r3 * s3
        k = k + 1
        if (k > last) exit
      end do
      w(lane, i, j) = c11
      w(lane, i + 1, j) = c21
      w(lane, i + 2, j) = c31
      w(lane, i, j + 1) = c12
      w(lane, i + 1, j + 1) = c22
      w(lane, i + 2, j + 1) = c32
      w(lane, i, j + 2) = c13
      w(lane, i + 1, j + 2) = c23
      w(lane, i + 2, j + 2) = c33
    end do
  end subroutine subtract_product

  !> W_kk = L U with unit L; in place of the pivots their reciprocals are kept.
  pure subroutine factorise_block(w, columns, k, multiplier)
    integer, intent(in) :: columns, k
    real(dp), intent(inout) :: w(lanes, most_rows, columns), multiplier(lanes)
    real(dp) :: p1, p2, p3, u12, u13, u23, l21, l31, l32
    integer :: lane

    !GCC$ ivdep
    do lane = 1, lanes
      p1 = w(lane, k, k)
      w(lane, k, k) = 1 / merge(p1, 1.0_dp, abs(p1) > least_pivot)
      u12 = w(lane, k, k + 1)
      u13 = w(lane, k, k + 2)
      l21 = w(lane, k + 1, k) * w(lane, k, k)
      l31 = w(lane, k + 2, k) * w(lane, k, k)
      p2 = w(lane, k + 1, k + 1) - l21 * u12
      w(lane, k + 1, k + 1) = 1 / merge(p2, 1.0_dp, abs(p2) > least_pivot)
      u23 = w(lane, k + 1, k + 2) - l21 * u13
      l32 = (w(lane, k + 2, k + 1) - l31 * u12) * w(lane, k + 1, k + 1)
      p3 = w(lane, k + 2, k + 2) - l31 * u13 - l32 * u23
      w(lane, k + 2, k + 2) = 1 / merge(p3, 1.0_dp, abs(p3) > least_pivot)
      w(lane, k + 1, k) = l21
      w(lane, k + 2, k) = l31
      w(lane, k + 1, k + 2) = u23
      w(lane, k + 2, k + 1) = l32
      multiplier(lane) = max(multiplier(lane), abs(l21), abs(l31), abs(l32))
      ! One by one: the least of several numbers loses one that is none.
      multiplier(lane) = merge(multiplier(lane), huge(1.0_dp), &
        & abs(p1) > least_pivot .and. abs(p2) > least_pivot .and. abs(p3) > least_pivot)
    end do
  end subroutine factorise_block

  !> W_kj <- L_kk^-1 W_kj.
  pure subroutine solve_with_lower(w, columns, k, j)
    integer, intent(in) :: columns, k, j
    real(dp), intent(inout) :: w(lanes, most_rows, columns)
    integer :: lane, c

    do c = j, j + block - 1
      !GCC$ ivdep
      do lane = 1, lanes
        w(lane, k + 1, c) = w(lane, k + 1, c) - w(lane, k + 1, k) * w(lane, k, c)
        w(lane, k + 2, c) = w(lane, k + 2, c) - w(lane, k + 2, k) * w(lane, k, c) - w(lane, k + 2, k + 1) * w(lane, k + 1, c)
      end do
    end do
  end subroutine solve_with_lower

  !> W_ik <- W_ik U_kk^-1.
  pure subroutine solve_with_upper(w, columns, i, k, multiplier)
    integer, intent(in) :: columns, i, k
    real(dp), intent(inout) :: w(lanes, most_rows, columns), multiplier(lanes)
    real(dp) :: l1, l2, l3
    integer :: lane, r

    do r = i, i + block - 1
      !GCC$ ivdep
      do lane = 1, lanes
        l1 = w(lane, r, k) * w(lane, k, k)
        l2 = (w(lane, r, k + 1) - l1 * w(lane, k, k + 1)) * w(lane, k + 1, k + 1)
        l3 = (w(lane, r, k + 2) - l1 * w(lane, k, k + 2) - l2 * w(lane, k + 1, k + 2)) * w(lane, k + 2, k + 2)
        w(lane, r, k) = l1
        w(lane, r, k + 1) = l2
        w(lane, r, k + 2) = l3
        multiplier(lane) = max(multiplier(lane), abs(l1), abs(l2), abs(l3))
      end do
    end do
  end subroutine solve_with_upper

end module gestell_math_lanes
