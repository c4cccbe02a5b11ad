!> Elimination in eight small matrices side by side. The lane, the number of the matrix, is the first index of all arrays:
!> a processor's vector registers hold one element of several matrices each, and do the same arithmetic for all of them.
!>
!> How to read it: forget the loops over `lane`, and it is elimination by blocks of 3 x 3. The sums of a block stay in nine
!> scalars while they run over all eliminated unknowns (gestell_math_lanes_versions); this, and that nothing depends on the lane but
!> the data, is what lets a compiler keep the registers full. The inner loop ends at its foot since a test at its head would be
!> control flow in a lane. `!GCC$ ivdep` tells gfortran that lanes do not depend on each other; without it the results are the same.
module gestell_math_lanes
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: vector_length
  use gestell_math_lanes_versions, only: block, lanes, most_rows, solve_with_lower, solve_with_upper, &
    & subtract_product
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  implicit none (type, external)
  private

  !> Rows of a block, matrices side by side, and the most rows that a matrix can have: columns lie so far apart in memory whatever
  !> its rows, a vectorised loop cannot do with less. (Ten stages of six degrees of freedom; 36 would be as fast for three.)
  public :: block, lanes, most_rows, padded, schur_complement, vector_border
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

  !> The first of these numbers that lies on the border of a vector of eight: one that does not costs two pieces of the cache.
  integer function vector_border(numbers)
    real(dp), contiguous, target, intent(in) :: numbers(:)

    associate (address => transfer(c_loc(numbers), 0_c_intptr_t))
      vector_border = int(1 + modulo(-address / (storage_size(numbers) / 8), int(lanes, c_intptr_t)))
    end associate
  end function vector_border

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
    integer :: first, length, last, i, j

    first = 1
    if (present(from)) first = from
    length = vector_length()
    multiplier = 0
    unused = 0
    do j = first, columns, block
      do i = first, rows, block
        ! W_ij <- W_ij - sum over k = first ... last of W_ik W_kj.
        last = min(i, j, n + 1) - 1
        if (last >= first) call subtract_product(length, last - first + 1, w(1, i, j), w(1, i, first), w(1, first, j))
        if (i > n .and. j > n) cycle
        if (i < j) then
          call solve_with_lower(length, w(1, i, j), w(1, i, i))
        else if (i == j) then
          call factorise_block(w, columns, i, multiplier)
        else if (i <= n) then
          call solve_with_upper(length, w(1, i, j), w(1, j, j), multiplier)
        else
          call solve_with_upper(length, w(1, i, j), w(1, j, j), unused)
        end if
      end do
    end do
  end subroutine schur_complement

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

end module gestell_math_lanes
