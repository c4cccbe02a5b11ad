!> Coefficients of Gauss-Legendre collocation with any number of stages s, order 2 s, also fitted to a motion.
!>
!> In Legendre's polynomials A is tridiagonal (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Section
!> IV.5): of P_k-1 and P_k each has the part xi_k in the integral of the other, xi_k^2 = 1 / (4 (4 k^2 - 1)), and the step
!> multiplies the solution of x' = l x, z = h l, by (1 + Psi / 2) / (1 - Psi / 2) with the continued fraction
!>
!>     Psi = z / (1 + xi_1^2 z^2 / (1 + xi_2^2 z^2 / (1 + ... + xi_s-1^2 z^2))),
!>
!> which is that of exp(z) as far as it goes. What it leaves off, the tail g = 1 + xi_s^2 z^2 / (1 + xi_s+1^2 z^2 / (1 + ...)), is
!> a number for the motion that turns by `turn` radians in a step, z = i turn: with xi_s-1^2 / g for xi_s-1^2 the method follows
!> that one motion exactly, symmetric and symplectic as it is. Another, which turns by z, has the phase error c_s z^(2 s - 1) (z^2
!> - turn^2), a slow one more than before, but from six stages on never more than a fifteenth of what that one motion had.
module gestell_floquet_integrator_tableau
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: add_tail, find_legendre, gauss_tableau, product_of

  !> On the unit step: nodes c, weights b of the quadrature, A with A(i, j) = integral of the j-th Lagrange
  !> polynomial from 0 to c(i), and what integrating twice needs: b A, and A A once it is fitted. Legendre's polynomials of the two
  !> highest degrees in A, s - 1 and s - 2, at the nodes.
  type, public :: tableau_type
    real(dp), allocatable :: c(:), b(:), a(:, :), aa(:, :), ba(:), high(:), next(:)
  contains
    procedure :: fit => fit_tableau
  end type tableau_type

  !> With fewer stages slow motions would lose more. A polynomial of degree s - 2 or s - 1 is not integrated exactly any more.
  integer, parameter :: fewest_to_fit = 6

contains

  !> The tableau of `stages` stages. Lagrange's polynomial of node j is b_j (2 k + 1) P_k(z_j) along Legendre's P_k, whose integral
  !> from 0 to c is (P_k+1 - P_k-1) / (2 (2 k + 1)) at z = 2 c - 1, with P_-1 = -1. P_s vanishes at the nodes.
  pure function gauss_tableau(stages) result(tableau)
    integer, intent(in) :: stages
    type(tableau_type) :: tableau
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

  !> A tableau of Gauss' fitted to a motion that turns by `turn` radians in a step, where its stages are enough.
  pure subroutine fit_tableau(self, turn)
    class(tableau_type), intent(inout) :: self
    real(dp), intent(in) :: turn

    if (size(self%c) >= fewest_to_fit) call add_tail(self%high, self%next, self%b, turn, self%a)
    self%aa = product_of(self%a, self%a)
  end subroutine fit_tableau

  !> To A, of nodes with weights `b` where Legendre's polynomials P_s-1 and P_s-2 are `high` and `next`, what xi_s-1 is more if the
  !> tail g of the continued fraction, between 1/2 and 1, is in it. Where the motion turns by more than 2 s radians in a step, which
  !> no method with s stages follows, g is that of 2 s.
  pure subroutine add_tail(high, next, b, turn, a)
    real(dp), intent(in) :: high(:), next(:), b(:), turn
    real(dp), intent(inout) :: a(:, :)
    !> Terms that count: each next one falls as (turn / (4 k))^2.
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

  !> Of small matrices.
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

  !> The nodes of s stages on [0, 1], ascending, and their weights, by Halley's iteration on Legendre's polynomial P_s, all nodes at
  !> once, with (1 - z^2) P_s'' = 2 z P_s' - s (s + 1) P_s; `p`: the polynomials of degree 0 to s there. The estimate from which it
  !> starts (F. G. Tricomi, Ann. Mat. Pura Appl. 31 (1950), 93-97) is good to three digits or more; each iteration trebles them.
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
    ! All steps would add up what roundings leave of 1: those in the middle take it.
    i = s / 2
    if (s > 2 * i) then
      b(i + 1) = 1 - 2 * sum(b(:i))
    else
      b(i:i + 1) = 0.5_dp - sum(b(:i - 1))
    end if
  end subroutine find_nodes

  !> Legendre's polynomials of degree 0 to s at points z, by their recurrence: `p`, shape (points, 0:s).
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
