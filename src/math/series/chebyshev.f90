!> Chebyshev series on [-1, 1], the sum over k = 0 ... n - 1 of c_k T_k(x). It interpolates a function at the points x_j = cos(pi j
!> / (n - 1)), j = 0 ... n - 1 (x_0 = 0 for n = 1), the extreme points of T_(n-1). See L. N. Trefethen, Approximation Theory and
!> Approximation Practice, SIAM 2013, chapters 2 to 4.
module gestell_math_series_chebyshev
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: chebyshev_coefficients, chebyshev_points, chebyshev_values

contains

  !> Interpolation points of a series with n terms, descending from 1 to -1 and exactly symmetric; shape (n).
  pure function chebyshev_points(n) result(x)
    integer, intent(in) :: n
    real(dp) :: x(n)
    integer :: j

    x = 0
    do j = 1, n / 2
      x(j) = sin(pi * (n + 1 - 2 * j) / (2 * (n - 1)))
      if (j == 1) x(j) = 1
      x(n + 1 - j) = -x(j)
    end do
  end function chebyshev_points

  !> Matrix, shape (n, n), that maps values at the interpolation points to coefficients of the series.
  pure function chebyshev_coefficients(n) result(matrix)
    integer, intent(in) :: n
    real(dp) :: matrix(n, n)
    integer :: j, k

    matrix = 1
    if (n == 1) return
    do j = 0, n - 1
      do k = 0, n - 1
        ! The product is reduced modulo the period 2 (n - 1) of the cosine: large angles would lose digits.
        matrix(k + 1, j + 1) = 2 * cos(pi * mod(j * k, 2 * (n - 1)) / (n - 1)) / (n - 1)
      end do
    end do
    matrix([1, n], :) = matrix([1, n], :) / 2
    matrix(:, [1, n]) = matrix(:, [1, n]) / 2
  end function chebyshev_coefficients

  !> Chebyshev polynomials T_0 ... T_(n-1) at `x`, shape (size(x), n).
  pure function chebyshev_values(x, n) result(t)
    real(dp), intent(in) :: x(:)
    integer, intent(in) :: n
    real(dp) :: t(size(x), n)
    integer :: k

    t(:, 1) = 1
    if (n > 1) t(:, 2) = x
    do k = 3, n
      t(:, k) = 2 * x * t(:, k - 1) - t(:, k - 2)
    end do
  end function chebyshev_values

end module gestell_math_series_chebyshev
