!> Solves small systems of linear equations, eight side by side as in gestell_math_lanes, by Householder reflections. Elimination
!> would need different row exchanges in each lane; reflections need no exchanges.
module gestell_math_lanes_equations
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  implicit none (type, external)
  private

  public :: solve_equations

  !> Minimum length of a column; the procedures treat a shorter column as zero.
  real(dp), parameter :: nothing = 1.0e-100_dp

contains

  !> Solves A x = b and computes the Frobenius norm of A^-1. With A = Q R this norm equals the norm of R^-1. The norm is 1e100 or
  !> more if A is singular.
  pure subroutine solve_equations(n, equations, x, inverse_norm)
    !> Number of unknowns
    integer, intent(in) :: n
    !> [A b], shape (lanes, n, n + 1); overwritten
    real(dp), intent(inout) :: equations(lanes, n, n + 1)
    !> `x`: solution, shape (lanes, n). `inverse_norm`: Frobenius norm of A^-1 in each lane.
    real(dp), intent(out) :: x(lanes, n), inverse_norm(lanes)
    real(dp) :: pivot(lanes, n), column(lanes, n)
    integer :: k

    do k = 1, n
      call reflect(n, k, equations, pivot(:, k))
    end do
    pivot = 1 / sign(max(abs(pivot), nothing), pivot)
    inverse_norm = 0
    do k = 1, n
      column = 0
      column(:, k) = 1
      call substitute(n, k, equations, pivot, column)
      inverse_norm = inverse_norm + sum(column**2, dim=2)
    end do
    inverse_norm = sqrt(inverse_norm)
    x = equations(:, :, n + 1)
    call substitute(n, n, equations, pivot, x)
  end subroutine solve_equations

  !> Applies the Householder reflection E - beta u u' that reduces rows `k` to `n` of column `k` to `pivot` in row `k` and zeros
  !> below it. Afterwards the vector u is stored in these rows of the column.
  pure subroutine reflect(n, k, a, pivot)
    integer, intent(in) :: n, k
    real(dp), intent(inout) :: a(lanes, n, n + 1)
    real(dp), intent(out) :: pivot(lanes)
    real(dp) :: beta(lanes), share(lanes), length, sum
    integer :: lane, i, j

    !GCC$ ivdep
    do lane = 1, lanes
      sum = 0
      i = k
      do
        sum = sum + a(lane, i, k)**2
        i = i + 1
        if (i > n) exit
      end do
      length = max(sqrt(sum), nothing)
      beta(lane) = 1 / (length * (length + abs(a(lane, k, k))))
      pivot(lane) = -sign(length, a(lane, k, k))
      a(lane, k, k) = a(lane, k, k) - pivot(lane)
    end do
    do j = k + 1, n + 1
      !GCC$ ivdep
      do lane = 1, lanes
        sum = 0
        i = k
        do
          sum = sum + a(lane, i, k) * a(lane, i, j)
          i = i + 1
          if (i > n) exit
        end do
        share(lane) = sum * beta(lane)
      end do
      do i = k, n
        !GCC$ unroll 1
        do lane = 1, lanes
          a(lane, i, j) = a(lane, i, j) - share(lane) * a(lane, i, k)
        end do
      end do
    end do
  end subroutine reflect

  !> Replaces x by R^-1 x. R is the upper triangle of the first `rows` rows and columns of `r`. `pivot`: reciprocals of the
  !> diagonal elements of R.
  pure subroutine substitute(n, rows, r, pivot, x)
    integer, intent(in) :: n, rows
    real(dp), intent(in) :: r(lanes, n, n + 1), pivot(lanes, n)
    real(dp), intent(inout) :: x(lanes, n)
    integer :: lane, i, k

    do k = rows, 1, -1
      x(:, k) = x(:, k) * pivot(:, k)
      do i = 1, k - 1
        !GCC$ unroll 1
        do lane = 1, lanes
          x(lane, i) = x(lane, i) - r(lane, i, k) * x(lane, k)
        end do
      end do
    end do
  end subroutine substitute

end module gestell_math_lanes_equations
