!> Basic operations on small matrices.
module gestell_math_matrix
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: balanced, solve_semidefinite, solve_small, unit_matrix

contains

  !> Matrix D^-1 A D with D = diag(d). This is A if the states are measured in the units `d`.
  pure function balanced(a, d)
    real(dp), intent(in) :: a(:, :), d(:)
    real(dp) :: balanced(size(d), size(d))
    integer :: j

    do j = 1, size(d)
      balanced(:, j) = a(:, j) * d(j) / d
    end do
  end function balanced

  !> Unit matrix, shape (n, n).
  pure function unit_matrix(n) result(e)
    integer, intent(in) :: n
    real(dp) :: e(n, n)
    integer :: i

    e = 0
    do i = 1, n
      e(i, i) = 1
    end do
  end function unit_matrix

  !> Solves A X = B by elimination with partial pivoting: for small systems most of whose coefficients are zero, where a call of
  !> LAPACK would cost more. Zero coefficients are skipped.
  pure subroutine solve_small(rows, singular)
    !> Column i contains the coefficients of equation i, row i of A, and then its right-hand sides, row i of B. The coefficients
    !> are destroyed; row i of B becomes row i of X
    real(dp), contiguous, intent(inout) :: rows(:, :)
    !> True if a pivot is 0; X is then undefined
    logical, intent(out) :: singular
    real(dp) :: largest, swapped, top
    integer :: i, j, k, n, last, pivot

    n = size(rows, 2)
    last = size(rows, 1)
    singular = .true.
    do k = 1, n
      pivot = k
      largest = abs(rows(k, k))
      do i = k + 1, n
        if (.not. abs(rows(k, i)) > largest) cycle
        pivot = i
        largest = abs(rows(k, i))
      end do
      if (.not. largest > 0) return
      if (pivot /= k) then
        do j = k, last
          swapped = rows(j, k)
          rows(j, k) = rows(j, pivot)
          rows(j, pivot) = swapped
        end do
      end if
      do i = k + 1, n
        if (abs(rows(k, i)) > 0) call subtract(last - k, rows(k, i) / rows(k, k), rows(k + 1:last, k), rows(k + 1:last, i))
      end do
    end do
    do k = n, 1, -1
      do i = n, k + 1, -1
        if (abs(rows(i, k)) > 0) call subtract(last - n, rows(i, k), rows(n + 1:last, i), rows(n + 1:last, k))
      end do
      top = rows(k, k)
      rows(n + 1:last, k) = rows(n + 1:last, k) / top
    end do
    singular = .false.

  contains

    !> Subtracts `factor` times the numbers `row` from the numbers `from`.
    pure subroutine subtract(m, factor, row, from)
      integer, intent(in) :: m
      real(dp), intent(in) :: factor, row(m)
      real(dp), intent(inout) :: from(m)

      from = from - factor * row
    end subroutine subtract

  end subroutine solve_small

  !> Solves C q = load for a positive semi-definite C, by elimination with full pivoting, in units in which the diagonal is 1.
  !> Components of q that the equations do not determine are set to 0.
  pure subroutine solve_semidefinite(c, load, sizes, q, unsupported)
    !> `c`: matrix C, shape (n, n). `load`: right-hand side, shape (n). `sizes`: size of the terms that were summed to obtain each
    !> element of `load`, shape (n).
    real(dp), intent(in) :: c(:, :), load(:), sizes(:)
    !> Solution q, shape (n); zero if C cannot balance the load
    real(dp), intent(out) :: q(:)
    !> Number of a row in which C cannot balance the load to within 1e-9 of the sum of `sizes` (in units in which the diagonal of
    !> C is 1); 0 if there is no such row
    integer, intent(out) :: unsupported
    real(dp), parameter :: singular = 1.0e-12_dp, negligible = 1.0e-9_dp
    real(dp) :: a(size(load), size(load)), b(size(load)), x(size(load)), unit(size(load)), maximum
    integer :: row(size(load)), column(size(load)), at(2), i, k, n, rank

    n = size(load)
    unit = sqrt([(abs(c(i, i)), i = 1, n)])
    where (.not. unit > 0) unit = max(1.0_dp, maxval(unit))
    a = c / (spread(unit, 2, n) * spread(unit, 1, n))
    b = load / unit
    maximum = sum(sizes / unit)
    row = [(i, i = 1, n)]
    column = row
    rank = n
    do k = 1, n
      at = k - 1 + maxloc(abs(a(row(k:), column(k:))))
      row([k, at(1)]) = row([at(1), k])
      column([k, at(2)]) = column([at(2), k])
      if (.not. abs(a(row(k), column(k))) > singular) then
        rank = k - 1
        exit
      end if
      do i = k + 1, n
        associate (factor => a(row(i), column(k)) / a(row(k), column(k)))
          b(row(i)) = b(row(i)) - factor * b(row(k))
          a(row(i), column(k + 1:)) = a(row(i), column(k + 1:)) - factor * a(row(k), column(k + 1:))
        end associate
      end do
    end do
    q = 0
    unsupported = 0
    do i = rank + 1, n
      if (abs(b(row(i))) <= negligible * maximum) cycle
      unsupported = row(i)
      return
    end do
    x = 0
    do k = rank, 1, -1
      x(column(k)) = (b(row(k)) - dot_product(a(row(k), column(k + 1:rank)), x(column(k + 1:rank)))) / a(row(k), column(k))
    end do
    q = x / unit
  end subroutine solve_semidefinite

end module gestell_math_matrix
