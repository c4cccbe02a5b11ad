!> Coefficients of Gauss-Legendre collocation with s stages, order 2 s. They can be fitted to a motion, equation (59) of
!> doc/theory.md.
!>
!> In a basis of Legendre polynomials A is tridiagonal (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed.,
!> Section IV.5). Its elements couple P_k-1 and P_k by +-xi_k with xi_k^2 = 1 / (4 (4 k^2 - 1)). The step multiplies the solution of
!> x' = l x, with z = h l, by (1 + Psi / 2) / (1 - Psi / 2) with the continued fraction
!>
!>     Psi = z / (1 + xi_1^2 z^2 / (1 + xi_2^2 z^2 / (1 + ... + xi_s-1^2 z^2))).
!>
!> This is the continued fraction of exp(z), truncated. The omitted tail is g = 1 + xi_s^2 z^2 / (1 + xi_s+1^2 z^2 / (1 + ...)). For
!> a motion whose phase advances by `turn` radians in a step, z = i turn, the tail is a real number. If xi_s-1^2 is replaced by
!> xi_s-1^2 / g, the method follows this motion exactly. It remains symmetric and symplectic.
!>
!> A motion whose phase advances by z then has the phase error c_s z^(2 s - 1) (z^2 - turn^2). For slow motions this exceeds the
!> error without fitting. With six or more stages it is never more than a fifteenth of the error that the fitted motion has without
!> fitting.
module gestell_floquet_integrator_tableau
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: add_tail, find_legendre, gauss_tableau, product_of

  !> Coefficients of a collocation method for a step of length 1
  type, public :: tableau_type
    !> `c`, `b`: nodes and weights, shape (s). `a`: A(i, j) = integral of the j-th Lagrange polynomial from 0 to c(i), shape (s, s).
    !> `aa`: A A, set by `fit`. `ba`: b A. `high`, `next`: Legendre polynomials of degree s - 1 and s - 2 at the nodes, shape (s).
    real(dp), allocatable :: c(:), b(:), a(:, :), aa(:, :), ba(:), high(:), next(:)
  contains
    procedure :: fit => fit_tableau
  end type tableau_type

  !> Minimum number of stages for fitting. With fewer stages slow motions would lose too much accuracy, because a fitted method no
  !> longer integrates polynomials of degree s - 2 and s - 1 exactly.
  integer, parameter :: min_to_fit = 6

contains

  !> Returns the tableau with `stages` stages. The Lagrange polynomial of node j has the coefficient b_j (2 k + 1) P_k(z_j) of the
  !> Legendre polynomial P_k. The integral of P_k from 0 to c is (P_k+1 - P_k-1) / (2 (2 k + 1)) at z = 2 c - 1, with P_-1 = -1. P_s
  !> vanishes at the nodes.
  pure type(tableau_type) function gauss_tableau(stages) result(tableau)
    integer, intent(in) :: stages
    real(dp) :: p(stages, -1:stages)
    integer :: j, k

    allocate(tableau%c(stages), tableau%b(stages), tableau%a(stages, stages))
    call find_nodes(stages, tableau%c, tableau%b, p(:, 0:))
    p(:, -1) = -1
    p(:, stages) = 0
    associate (b => tableau%b, a => tableau%a)
      a = 0
      do j = 1, stages
        do k = 0, stages - 1
          a(:, j) = a(:, j) + b(j) / 2 * p(j, k) * (p(:, k + 1) - p(:, k - 1))
        end do
      end do
    end associate
    tableau%high = p(:, stages - 1)
    tableau%next = p(:, stages - 2)
    tableau%ba = [(dot_product(tableau%b, tableau%a(:, j)), j = 1, stages)]
  end function gauss_tableau

  !> Fits a Gauss tableau to a motion whose phase advances by `turn` radians in a step, if it has enough stages, and computes A A.
  pure subroutine fit_tableau(self, turn)
    class(tableau_type), intent(inout) :: self
    real(dp), intent(in) :: turn

    if (size(self%c) >= min_to_fit) call add_tail(self%high, self%next, self%b, turn, self%a)
    self%aa = product_of(self%a, self%a)
  end subroutine fit_tableau

  !> Changes xi_s-1 in A so that the continued fraction includes its tail g, which is between 1/2 and 1. No method with s stages can
  !> follow a motion whose phase advances by more than 2 s radians in a step; for such a motion the procedure uses the tail g for 2
  !> s radians.
  pure subroutine add_tail(high, next, b, turn, a)
    !> `high`, `next`: Legendre polynomials P_s-1 and P_s-2 at the nodes, shape (s). `b`: weights of the nodes, shape (s). `turn`:
    !> phase advance (radians) of the motion in a step.
    real(dp), intent(in) :: high(:), next(:), b(:), turn
    !> A, shape (s, s)
    real(dp), intent(inout) :: a(:, :)
    !> Number of terms of the tail that are computed. The k-th term is smaller than its predecessor by the factor (turn / (4 k))^2.
    integer, parameter :: terms = 20
    real(dp) :: g, more
    integer :: s, j, k

    s = size(b)
    g = 1
    do k = s + terms, s, -1
      g = 1 - min(turn, 2 * real(s, dp))**2 / (4 * (4 * real(k, dp)**2 - 1)) / g
    end do
    more = (1 / sqrt(g) - 1) / 2
    do j = 1, s
      a(:, j) = a(:, j) + more * b(j) * (next(j) * high - high(j) * next)
    end do
  end subroutine add_tail

  !> Matrix product of `a` and `b`, for small matrices.
  pure function product_of(a, b) result(product)
    real(dp), intent(in) :: a(:, :), b(:, :)
    real(dp) :: product(size(a, 1), size(b, 2))
    integer :: j, k

    product = 0
    do j = 1, size(b, 2)
      do k = 1, size(b, 1)
        product(:, j) = product(:, j) + a(:, k) * b(k, j)
      end do
    end do
  end function product_of

  !> Computes the nodes of s stages on [0, 1], ascending, and their weights. Halley's iteration is applied to the Legendre
  !> polynomial P_s for all nodes at once, with (1 - z^2) P_s'' = 2 z P_s' - s (s + 1) P_s. The initial estimate (F. G. Tricomi,
  !> Ann. Mat. Pura Appl. 31 (1950), 93-97) has three correct digits or more; each iteration triples their number. `p`: Legendre
  !> polynomials of degree 0 to s at the nodes.
  pure subroutine find_nodes(s, c, b, p)
    integer, intent(in) :: s
    real(dp), intent(out) :: c(s), b(s), p(s, 0:s)
    integer, parameter :: iterations = 3
    real(dp) :: change(s)
    integer :: iteration, i

    associate (z => c, slope => b)
      do i = 1, (s + 1) / 2
        z(i) = -(1 - (s - 1) / (8 * real(s, dp)**3)) * cos(pi * (4 * i - 1) / (4 * s + 2))
        z(s + 1 - i) = -z(i)
      end do
      do iteration = 1, iterations
        call find_legendre(s, z, p)
        slope = s * (z * p(:, s) - p(:, s - 1)) / (z**2 - 1)
        if (iteration == iterations) exit
        change = p(:, s) / slope
        z = z - change / (1 - change * (2 * z - s * (s + 1) * change) / (2 * (1 - z**2)))
      end do
      b = 1 / ((1 - z**2) * slope**2)
      c = (1 + z) / 2
    end associate
    do i = 1, s / 2
      c(s + 1 - i) = 1 - c(i)
    end do
    ! The weights must sum to 1, because the error would add up over all steps: the middle weights absorb the rounding error.
    i = s / 2
    if (s > 2 * i) then
      b(i + 1) = 1 - 2 * sum(b(:i))
    else
      b(i:i + 1) = 0.5_dp - sum(b(:i - 1))
    end if
  end subroutine find_nodes

  !> Computes the Legendre polynomials of degree 0 to s at points z by their recurrence; the result `p` has the shape (points, 0:s).
  pure subroutine find_legendre(s, z, p)
    integer, intent(in) :: s
    real(dp), contiguous, intent(in) :: z(:)
    real(dp), intent(out) :: p(size(z), 0:s)
    integer :: j

    p(:, 0) = 1
    if (s > 0) p(:, 1) = z
    do j = 2, s
      p(:, j) = z * p(:, j - 1) + (j - 1) / real(j, dp) * (z * p(:, j - 1) - p(:, j - 2))
    end do
  end subroutine find_legendre

end module gestell_floquet_integrator_tableau
