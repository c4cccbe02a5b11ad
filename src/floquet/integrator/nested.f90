!> Gauss-Legendre collocation with the two methods embedded in it, so that one elimination gives the maps of all three.
!>
!> Collocation at Gauss' nodes is Galerkin's method for accelerations v of degree s - 1 whose integrals are taken by Gauss'
!> quadrature. Galerkin's methods for v of degree s - 2 and s - 3, of order 2 s - 2 and 2 s - 4, have no part of v along
!> Legendre's P_s-1 (and P_s-2), and residuals along these only. Two nodes of the middle, p and q, come last, and the unknowns
!>
!>     u_q = v_q - sum over j of e_j v_j,    u_p = v_p - sum over j of e'_j v_j
!>
!> are what v has there beyond a polynomial of degree s - 2 through all nodes but q, and v beyond one of degree s - 3 through all
!> but p and q: zero in the embedded methods. With v = X u the matrix K of the equations becomes (B^-1 X^T B) K X, B = diag(b), in
!> whose first rows residuals along P_s-1 (and P_s-2) are not seen: b_j times these sum to zero against polynomials of less degree.
!> Its leading parts are the matrices of the embedded methods, so what elimination leaves in the corner before the unknowns of q,
!> and before those of p and q, are their maps.
module gestell_floquet_integrator_nested
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_tableau, only: add_tail, find_legendre, product_of, tableau_type
  implicit none (type, external)
  private

  public :: fall_over, left_by_embedded, nested_tableau

  !> The tableau in this order of the nodes, with b X, b A X in the places of b, b A, and once it is fitted A X, A A X in those of
  !> A, A A. `values`, shape (2, s): the last two rows of X, the slopes in the last two nodes. `sums`, shape (s, 2): how much of
  !> the last two equations is added to each. `tails`, shape (s, 4): what of values at the nodes makes the rms of their parts along
  !> P_s-4 to P_s-1. `weights`: b itself.
  type, extends(tableau_type), public :: nested_type
    real(dp), allocatable :: values(:, :), sums(:, :), tails(:, :), weights(:)
  contains
    procedure :: fit => fit_nested
  end type nested_type

contains

  !> z^2 over e_s / e_(s-1), the phase errors of Gauss' methods with s and with s - 1 stages, of a motion that turns by z in a step.
  elemental real(dp) function fall_over(s)
    integer, intent(in) :: s

    fall_over = 4 * (4 * real(s, dp)**2 - 1)
  end function fall_over

  !> How much of the phase error of Gauss' methods of their orders the embedded methods leave (derived in
  !> gestell_floquet_period_pair).
  pure real(dp) function left_by_embedded(positions) result(part)
    logical, intent(in) :: positions

    part = merge(0.5_dp, 1.0_dp, positions)
  end function left_by_embedded

  !> Of a tableau of four stages at least.
  pure function nested_tableau(rule) result(nested)
    type(tableau_type), intent(in) :: rule
    type(nested_type) :: nested
    ! b and b A below each other.
    real(dp) :: factors(2, size(rule%c)), p(size(rule%c), 0:size(rule%c) - 1), next(size(rule%c))
    integer :: order(size(rule%c)), s, i, j

    s = size(rule%c)
    next = 2 * rule%c - 1
    call find_legendre(s - 1, next, p)
    allocate(nested%c(s), nested%weights(s), nested%a(s, s), nested%high(s), nested%next(s))
    allocate(nested%tails(s, 4), nested%values(2, s), nested%sums(s, 2))
    ! P_s-1, and what P_s-2 is in the equations that do not see P_s-1; each is greatest, b included, at the node that stands for it.
    order = [(i, i = 1, s)]
    associate (high => p(:, s - 1), b => nested%weights, v => nested%values)
      call put_last(rule%b * abs(high), order)
      next = p(:, s - 2) - p(order(s), s - 2) / high(order(s)) * high
      call put_last(rule%b * abs(next), order(:s - 1))

      ! Node by node: each section by a list of indices would be a piece of memory.
      do i = 1, s
        nested%c(i) = rule%c(order(i))
        b(i) = rule%b(order(i))
        do j = 1, 4
          nested%tails(i, j) = sqrt(2 * (s - 5 + j) + 1.0_dp) * b(i) * p(order(i), s - 5 + j)
        end do
        do j = 1, s
          nested%a(i, j) = rule%a(order(i), order(j))
        end do
        nested%high(i) = rule%high(order(i))
        nested%next(i) = rule%next(order(i))
        factors(:, i) = [b(i), rule%ba(order(i))]
      end do
      do i = 1, s
        v(1, i) = -(b(i) * next(order(i))) / (b(s - 1) * next(order(s - 1)))
        v(2, i) = -(b(i) * high(order(i))) / (b(s) * high(order(s)))
      end do
      v(:, s) = [0, 1]
      v(1, s - 1) = 1
      v(2, :s - 2) = v(2, :s - 2) + v(2, s - 1) * v(1, :s - 2)
      nested%sums = 0
      nested%sums(:s - 2, 1) = v(1, :s - 2) * b(s - 1) / b(:s - 2)
      nested%sums(:s - 1, 2) = v(2, :s - 1) * b(s) / b(:s - 1)
    end associate
    call take_unknowns(nested%values, factors)
    nested%b = factors(1, :)
    nested%ba = factors(2, :)
  end function nested_tableau

  !> The method, not the embedded ones, fitted to a motion that turns by `turn` radians in a step: b A X does not change.
  pure subroutine fit_nested(self, turn)
    class(nested_type), intent(inout) :: self
    real(dp), intent(in) :: turn
    real(dp) :: slopes(size(self%c), size(self%c))

    call add_tail(self%high, self%next, self%weights, turn, self%a)
    slopes = self%a
    call take_unknowns(self%values, self%a)
    self%aa = product_of(slopes, self%a)
  end subroutine fit_nested

  !> Factors of the slopes in the nodes, shape (rows, s), become those of the unknowns, Z X.
  pure subroutine take_unknowns(values, z)
    real(dp), intent(in) :: values(:, :)
    real(dp), intent(inout) :: z(:, :)
    integer :: s, k

    s = size(z, 2)
    do k = 1, s - 2
      z(:, k) = z(:, k) + z(:, s - 1) * values(1, k) + z(:, s) * values(2, k)
    end do
    z(:, s - 1) = z(:, s - 1) + z(:, s) * values(2, s - 1)
  end subroutine take_unknowns

  !> Of the nodes in order the one that has the greatest of these weights becomes the last.
  pure subroutine put_last(weights, order)
    real(dp), intent(in) :: weights(:)
    integer, intent(inout) :: order(:)
    integer :: place, last, i

    place = 1
    do i = 2, size(order)
      if (weights(order(i)) > weights(order(place))) place = i
    end do
    last = order(place)
    do i = place, size(order) - 1
      order(i) = order(i + 1)
    end do
    order(size(order)) = last
  end subroutine put_last

end module gestell_floquet_integrator_nested
