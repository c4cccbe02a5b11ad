!> Fourier coefficients of a periodic function that is smooth between given break points, such as an interpolated table or a
!> function with kinks.
module gestell_math_series_piecewise
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: harmonics_of, quadrature_nodes, trimmed

  !> Gauss-Legendre rule with 8 points on (-1, 1): positive abscissas and their weights.
  real(dp), parameter :: abscissas(4) = [0.18343464249564980494_dp, 0.52553240991632898582_dp, 0.79666647741362673959_dp, &
    & 0.96028985649753623168_dp], &
    & factors(4) = [0.36268378337836198297_dp, 0.31370664587788728734_dp, 0.22238103445337447054_dp, 0.10122853629037625915_dp]

contains

  !> Nodes and weights for integrals over a period. Between break points the highest harmonic advances by at most 2 rad from one
  !> part to the next, so that 8 points for each part integrate it to rounding errors.
  pure subroutine quadrature_nodes(breaks, orders, nodes, weights)
    !> Ascending angles (rad) at which the function may have a kink, within one period
    real(dp), intent(in) :: breaks(:)
    !> Highest order of the coefficients
    integer, intent(in) :: orders
    real(dp), allocatable, intent(out) :: nodes(:), weights(:)
    real(dp) :: ends(2), half
    integer :: i, k, parts, n

    allocate(nodes(0), weights(0))
    n = size(breaks)
    do i = 1, n
      ends = [breaks(i), breaks(1) + 2 * pi]
      if (i < n) ends(2) = breaks(i + 1)
      parts = max(1, ceiling((ends(2) - ends(1)) * orders / 2))
      half = (ends(2) - ends(1)) / (2 * parts)
      do k = 1, parts
        nodes = [nodes, ends(1) + half * (2 * k - 1 + [-abscissas, abscissas])]
        weights = [weights, half * factors, half * factors]
      end do
    end do
  end subroutine quadrature_nodes

  !> Fourier coefficients of a function with the `values` at the nodes: mean, cosine and sine of order 1, 2, ....
  pure function harmonics_of(values, nodes, weights, orders) result(coefficients)
    real(dp), intent(in) :: values(:), nodes(:), weights(:)
    integer, intent(in) :: orders
    real(dp) :: coefficients(1 + 2 * orders)
    complex(dp) :: turn(size(nodes)), turned(size(nodes))
    integer :: k

    turn = cmplx(cos(nodes), sin(nodes), dp)
    turned = weights * values / pi
    coefficients(1) = sum(real(turned)) / 2
    do k = 1, orders
      turned = turned * turn
      coefficients(2 * k:2 * k + 1) = [sum(real(turned)), sum(aimag(turned))]
    end do
  end function harmonics_of

  !> Coefficients without the highest orders that are only rounding errors.
  pure function trimmed(coefficients) result(kept)
    real(dp), intent(in) :: coefficients(:)
    real(dp), allocatable :: kept(:)
    integer :: n

    n = size(coefficients)
    do while (n > 1)
      if (any(abs(coefficients(n - 1:n)) > 16 * epsilon(1.0_dp) * maxval(abs(coefficients)))) exit
      n = n - 2
    end do
    kept = coefficients(:n)
  end function trimmed

end module gestell_math_series_piecewise
