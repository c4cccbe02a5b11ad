!> Coefficients of Gauss-Legendre collocation with any number of stages s, order 2 s.
module gestell_floquet_integrator_tableau
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: gauss_tableau, legendre

  !> On the unit step: nodes c, weights b of the quadrature, A with A(i, j) = integral of the j-th Lagrange
  !> polynomial from 0 to c(i), and what integrating twice needs: A A and b A.
  type, public :: tableau_type
    real(dp), allocatable :: c(:), b(:), a(:, :), aa(:, :), ba(:)
  end type tableau_type

contains

  !> The tableau of `stages` stages. A = W X W^T diag(b) with the values W(i, k) of the orthonormal polynomials on [0, 1] and
  !> their integrals X (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.5, the W-transformation).
  pure function gauss_tableau(stages) result(tableau)
    integer, intent(in) :: stages
    type(tableau_type) :: tableau
    real(dp) :: p(stages, 0:stages), w(stages, stages), weighted(stages, stages)
    integer :: k

    allocate(tableau%c(stages), tableau%b(stages))
    call find_nodes(stages, tableau%c, tableau%b, p)
    do k = 1, stages
      w(:, k) = sqrt(2 * k - 1.0_dp) * p(:, k - 1)
      weighted(k, :) = w(:, k) * tableau%b
    end do
    weighted = integrals(weighted)
    tableau%a = matmul(w, weighted)
    tableau%aa = matmul(w, integrals(weighted))
    tableau%ba = matmul(tableau%b, tableau%a)
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

  !> The nodes of s stages on [0, 1], ascending, and their weights, by Newton's iteration on Legendre's polynomial P_s, all nodes at
  !> once; `p`: the polynomials of degree 0 to s there. The estimate from which it starts (F. G. Tricomi, Ann. Mat. Pura Appl. 31
  !> (1950), 93-97) is good to three digits or more; each iteration doubles them.
  pure subroutine find_nodes(s, c, b, p)
    integer, intent(in) :: s
    real(dp), intent(out) :: c(s), b(s), p(s, 0:s)
    integer, parameter :: iterations = 4
    real(dp) :: z(s), slope(s)
    integer :: iteration, i

    do i = 1, (s + 1) / 2
      z(i) = -(1 - (s - 1) / (8 * real(s, dp)**3)) * cos(pi * (4 * i - 1) / (4 * s + 2))
      z(s + 1 - i) = -z(i)
    end do
    do iteration = 1, iterations
      p = legendre(s, z)
      slope = s * (z * p(:, s) - p(:, s - 1)) / (z**2 - 1)
      if (iteration < iterations) z = z - p(:, s) / slope
    end do
    c = (1 + z) / 2
    do i = 1, s / 2
      c(s + 1 - i) = 1 - c(i)
    end do
    b = 1 / ((1 - z**2) * slope**2)
    ! All steps would add up what roundings leave of 1: those in the middle take it.
    i = s / 2
    if (s > 2 * i) then
      b(i + 1) = 1 - 2 * sum(b(:i))
    else
      b(i:i + 1) = 0.5_dp - sum(b(:i - 1))
    end if
  end subroutine find_nodes

  !> Legendre's polynomials of degree 0 to s at points z, by their recurrence; shape (points, 0:s).
  pure function legendre(s, z) result(p)
    integer, intent(in) :: s
    real(dp), intent(in) :: z(:)
    real(dp) :: p(size(z), 0:s)
    integer :: j

    p(:, 0) = 1
    p(:, 1) = z
    do j = 2, s
      p(:, j) = z * p(:, j - 1) + (j - 1) / real(j, dp) * (z * p(:, j - 1) - p(:, j - 2))
    end do
  end function legendre

end module gestell_floquet_integrator_tableau
