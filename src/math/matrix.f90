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

  !> Solves A X = B by elimination with partial pivoting: for systems so small that a call of LAPACK would cost more. A is the upper
  !> left part of `a`, shape (n, n), which is destroyed; the first n rows of `b` become X. `singular`: true if a pivot is 0; X is
  !> then undefined.
  pure subroutine solve_small(n, a, b, singular)
    integer, intent(in) :: n
    real(dp), contiguous, intent(inout) :: a(:, :), b(:, :)
    logical, intent(out) :: singular
    real(dp) :: factors(n), top
    integer :: i, j, k, pivot

    singular = .true.
    do k = 1, n
      pivot = k
      do i = k + 1, n
        if (abs(a(i, k)) > abs(a(pivot, k))) pivot = i
      end do
      top = a(pivot, k)
      if (.not. abs(top) > 0) return
      a(pivot, k) = a(k, k)
      a(k, k) = top
      factors(k + 1:) = a(k + 1:n, k) / top
      do j = k + 1, n
        top = a(pivot, j)
        a(pivot, j) = a(k, j)
        a(k, j) = top
        if (abs(top) > 0) a(k + 1:n, j) = a(k + 1:n, j) - factors(k + 1:) * top
      end do
      do j = 1, size(b, 2)
        top = b(pivot, j)
        b(pivot, j) = b(k, j)
        b(k, j) = top
        if (abs(top) > 0) b(k + 1:n, j) = b(k + 1:n, j) - factors(k + 1:) * top
      end do
    end do
    do j = 1, size(b, 2)
      do k = n, 1, -1
        b(k, j) = b(k, j) / a(k, k)
        if (abs(b(k, j)) > 0) b(:k - 1, j) = b(:k - 1, j) - a(:k - 1, k) * b(k, j)
      end do
    end do
    singular = .false.
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
