!> Fourier coefficients of a periodic function that is smooth between given break points, such as an interpolated table or a
!> function with kinks.
module gestell_math_series_piecewise
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: harmonics_of, interpolate, quadrature_nodes, trimmed

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
    real(dp) :: lengths(size(breaks)), half
    integer :: parts(size(breaks)), i, k, n

    lengths = cshift(breaks, 1) - breaks
    lengths(size(breaks)) = lengths(size(breaks)) + 2 * pi
    parts = max(1, ceiling(lengths * orders / 2))
    allocate(nodes(8 * sum(parts)), weights(8 * sum(parts)))
    n = 0
    do i = 1, size(breaks)
      half = lengths(i) / (2 * parts(i))
      do k = 1, parts(i)
        nodes(n + 1:n + 8) = breaks(i) + half * (2 * k - 1 + [-abscissas, abscissas])
        weights(n + 1:n + 8) = half * [factors, factors]
        n = n + 8
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

  !> Values, at `nodes` from `quadrature_nodes` with the breaks x, of the periodic function through (x, y): a cubic spline or, if
  !> `linear` is true, straight lines.
  pure function interpolate(x, y, nodes, linear) result(values)
    real(dp), intent(in) :: x(:), y(:), nodes(:)
    logical, intent(in) :: linear
    real(dp) :: values(size(nodes)), h(size(x)), slope(size(x)), bend(size(x)), s
    integer :: i, k, next

    h = cshift(x, 1) - x
    h(size(x)) = h(size(x)) + 2 * pi
    slope = (cshift(y, 1) - y) / h
    bend = 0
    if (.not. linear) bend = solve_cyclic(cshift(h, -1), h, 6 * (slope - cshift(slope, -1)))
    i = 1
    do k = 1, size(nodes)
      if (i < size(x)) then
        if (nodes(k) > x(i + 1)) i = i + 1
      end if
      next = 1 + modulo(i, size(x))
      s = nodes(k) - x(i)
      values(k) = y(i) + s * (slope(i) - (h(i) - s) / 6 * ((2 * h(i) - s) * bend(i) + (h(i) + s) * bend(next)) / h(i))
    end do
  end function interpolate

  !> Second derivatives m of a periodic spline: before(i) m(i-1) + 2 (before(i) + after(i)) m(i) + after(i) m(i+1) = right(i), by
  !> elimination; the corners of the matrix are a change of rank 1 (Sherman and Morrison).
  pure function solve_cyclic(before, after, right) result(m)
    real(dp), intent(in) :: before(:), after(:), right(:)
    real(dp) :: m(size(right)), u(size(right)), pivot(size(right)), corner
    integer :: i, n

    n = size(right)
    corner = before(1)
    pivot = 2 * (before + after)
    pivot([1, n]) = pivot([1, n]) - corner
    m = right
    u = 0
    u([1, n]) = corner
    do i = 2, n
      associate (factor => after(i - 1) / pivot(i - 1))
        pivot(i) = pivot(i) - factor * after(i - 1)
        m(i) = m(i) - factor * m(i - 1)
        u(i) = u(i) - factor * u(i - 1)
      end associate
    end do
    do i = n, 1, -1
      if (i < n) then
        m(i) = m(i) - after(i) * m(i + 1)
        u(i) = u(i) - after(i) * u(i + 1)
      end if
      m(i) = m(i) / pivot(i)
      u(i) = u(i) / pivot(i)
    end do
    m = m - u * (m(1) + m(n)) / (1 + u(1) + u(n))
  end function solve_cyclic

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
