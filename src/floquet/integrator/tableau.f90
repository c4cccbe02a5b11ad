!> Coefficients of Gauss-Legendre collocation with any number of stages s, order 2 s.
module gestell_floquet_integrator_tableau
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: gauss_tableau

  !> On the unit step: nodes c, weights b of the quadrature, A with A(i, j) = integral of the j-th Lagrange
  !> polynomial from 0 to c(i), and what integrating twice needs: A A and b A. Of the embedded method: `last`, Legendre's
  !> polynomial of degree s - 1 at the nodes, and `part`, the weights of the sum that is what slopes have of it.
  type, public :: tableau_type
    real(dp), allocatable :: c(:), b(:), a(:, :), aa(:, :), ba(:), last(:), part(:)
  end type tableau_type

contains

  !> The tableau of `stages` stages. Nodes by Newton's iteration on Legendre's polynomial P_s; A = W X W^T diag(b) with
  !> the values W(i, k) of the orthonormal polynomials on [0, 1] and their integrals X (E. Hairer, G. Wanner, Solving
  !> Ordinary Differential Equations II, section IV.5, the W-transformation).
  pure function gauss_tableau(stages) result(tableau)
    integer, intent(in) :: stages
    type(tableau_type) :: tableau
    real(dp) :: w(stages, stages), weighted(stages, stages)
    integer :: i, k

    allocate(tableau%c(stages), tableau%b(stages))
    do i = 1, (stages + 1) / 2
      call node(stages, i, tableau%c(i), tableau%b(i))
      tableau%c(stages + 1 - i) = 1 - tableau%c(i)
      tableau%b(stages + 1 - i) = tableau%b(i)
    end do

    do i = 1, stages
      w(i, :) = legendre(stages - 1, 2 * tableau%c(i) - 1)
      do k = 1, stages
        w(i, k) = sqrt(2 * k - 1.0_dp) * w(i, k)
        weighted(k, i) = w(i, k) * tableau%b(i)
      end do
    end do
    weighted = integrals(weighted)
    tableau%a = matmul(w, weighted)
    tableau%aa = matmul(w, integrals(weighted))
    tableau%ba = matmul(tableau%b, tableau%a)
    tableau%last = w(:, stages) / sqrt(2 * stages - 1.0_dp)
    tableau%part = (2 * stages - 1) * tableau%b * tableau%last
  end function gauss_tableau

  !> X Y; X has 1/2 in its corner, and beside its diagonal xi_k = 1 / (2 sqrt(4 k^2 - 1)), below it, and -xi_k.
  pure function integrals(y) result(xy)
    real(dp), intent(in) :: y(:, :)
    real(dp) :: xy(size(y, 1), size(y, 2)), xi
    integer :: k

    xy = 0
    xy(1, :) = y(1, :) / 2
    do k = 1, size(y, 1) - 1
      xi = 1 / (2 * sqrt(4.0_dp * k**2 - 1))
      xy(k + 1, :) = xy(k + 1, :) + xi * y(k, :)
      xy(k, :) = xy(k, :) - xi * y(k + 1, :)
    end do
  end function integrals

  !> The i-th node of s on [0, 1], ascending, and its weight. The estimate from which Newton's iteration starts is good to
  !> two digits; each iteration doubles them.
  pure subroutine node(s, i, c, b)
    integer, intent(in) :: s, i
    real(dp), intent(out) :: c, b
    real(dp) :: z, slope, p(0:s)
    integer :: iteration

    z = -cos(pi * (i - 0.25_dp) / (s + 0.5_dp))
    do iteration = 1, 6
      p = legendre(s, z)
      slope = s * (z * p(s) - p(s - 1)) / (z**2 - 1)
      if (iteration < 6) z = z - p(s) / slope
    end do
    c = (1 + z) / 2
    b = 1 / ((1 - z**2) * slope**2)
  end subroutine node

  !> Legendre's polynomials of degree 0 to s at z, by their recurrence.
  pure function legendre(s, z) result(p)
    integer, intent(in) :: s
    real(dp), intent(in) :: z
    real(dp) :: p(0:s)
    integer :: j

    p(0) = 1
    if (s > 0) p(1) = z
    do j = 2, s
      p(j) = ((2 * j - 1) * z * p(j - 1) - (j - 1) * p(j - 2)) / j
    end do
  end function legendre

end module gestell_floquet_integrator_tableau
