!> Coefficients of Gauss-Legendre collocation with any number of stages s, order 2 s.
module gestell_floquet_tableau
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: gauss_tableau

  !> On the unit step: nodes c, weights b of the quadrature, A with A(i, j) = integral of the j-th Lagrange
  !> polynomial from 0 to c(i), and what integrating twice needs: A A and b A.
  type, public :: tableau_type
    real(dp), allocatable :: c(:), b(:), a(:, :), aa(:, :), ba(:)
  end type tableau_type

contains

  !> The tableau of `stages` stages. Nodes by Newton's iteration on Legendre's polynomial P_s; A = W X W^T diag(b) with
  !> the values W(i, k) of the orthonormal polynomials on [0, 1] and their integrals X (E. Hairer, G. Wanner, Solving
  !> Ordinary Differential Equations II, section IV.5, the W-transformation).
  pure function gauss_tableau(stages) result(tableau)
    integer, intent(in) :: stages
    type(tableau_type) :: tableau
    real(dp) :: w(stages, stages), x(stages, stages), weighted(stages, stages)
    integer :: i, k

    allocate(tableau%c(stages), tableau%b(stages))
    do i = 1, stages
      call node(stages, i, tableau%c(i), tableau%b(i))
    end do

    do k = 1, stages
      do i = 1, stages
        w(i, k) = sqrt(2 * k - 1.0_dp) * legendre(k - 1, 2 * tableau%c(i) - 1)
        weighted(k, i) = w(i, k) * tableau%b(i)
      end do
    end do
    x = 0
    x(1, 1) = 0.5_dp
    do k = 1, stages - 1
      x(k + 1, k) = 1 / (2 * sqrt(4.0_dp * k**2 - 1))
      x(k, k + 1) = -x(k + 1, k)
    end do
    tableau%a = matmul(w, matmul(x, weighted))
    tableau%aa = matmul(w, matmul(matmul(x, x), weighted))
    tableau%ba = matmul(tableau%b, tableau%a)
  end function gauss_tableau

  !> The i-th node of s on [0, 1], ascending, and its weight.
  pure subroutine node(s, i, c, b)
    integer, intent(in) :: s, i
    real(dp), intent(out) :: c, b
    real(dp) :: z, slope
    integer :: iteration

    z = -cos(pi * (i - 0.25_dp) / (s + 0.5_dp))
    do iteration = 1, 8
      slope = s * (z * legendre(s, z) - legendre(s - 1, z)) / (z**2 - 1)
      z = z - legendre(s, z) / slope
    end do
    slope = s * (z * legendre(s, z) - legendre(s - 1, z)) / (z**2 - 1)
    c = (1 + z) / 2
    b = 1 / ((1 - z**2) * slope**2)
  end subroutine node

  !> Legendre's polynomial of degree k at z, by its recurrence.
  pure function legendre(k, z) result(p)
    integer, intent(in) :: k
    real(dp), intent(in) :: z
    real(dp) :: p, previous, next
    integer :: j

    previous = 0
    p = 1
    do j = 1, k
      next = ((2 * j - 1) * z * p - (j - 1) * previous) / j
      previous = p
      p = next
    end do
  end function legendre

end module gestell_floquet_tableau
