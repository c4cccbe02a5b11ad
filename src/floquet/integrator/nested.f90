!> Gauss-Legendre collocation with two embedded methods, arranged so that a single elimination gives the maps of all three
!> methods.
!>
!> Collocation at the Gauss nodes is a Galerkin method for accelerations v of degree s - 1 whose integrals are computed by Gauss
!> quadrature. The embedded methods are Galerkin methods for v of degree s - 2 and s - 3, of orders 2 s - 2 and 2 s - 4. In the
!> first embedded method v has no part along the Legendre polynomial P_s-1, and the residual has a part along P_s-1 only. In the
!> second embedded method v has no parts along P_s-1 and P_s-2, and the residual has parts along these two only.
!>
!> Two middle nodes, called p and q, are moved to the end of the list of nodes. The unknowns of these nodes are
!>
!>     u_q = v_q - sum over j of e_j v_j,    u_p = v_p - sum over j of e'_j v_j:
!>
!> u_q is the difference between v_q and the polynomial of degree s - 2 through all nodes except q, and u_p is the difference
!> between v_p and the polynomial of degree s - 3 through all nodes except p and q. So u_q is zero in both embedded methods, and
!> u_p is zero in the second one.
!>
!> With v = X u the matrix K of the equations becomes (B^-1 X^T B) K X, B = diag(b). The transformed equations of all nodes
!> except q contain no residuals along P_s-1, and those of all nodes except p and q contain none along P_s-2 either. The reason
!> is that, with the weights b_j, these polynomials are orthogonal to all polynomials of lower degree. The leading blocks of the
!> transformed matrix are therefore the matrices of the embedded methods. In gestell_floquet_integrator_gauss_steps, the matrix S
!> holds the map of the second embedded method before the unknowns of p and q are eliminated, and the map of the first one before
!> those of q alone are eliminated.
module gestell_floquet_integrator_nested
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_tableau, only: add_tail, find_legendre, product_of, tableau_type
  implicit none (type, external)
  private

  public :: phase_error_ratio, embedded_phase_error, nested_tableau

  !> Gauss tableau with reordered nodes. Its unknowns u are related to the accelerations v at the nodes by v = X u. The
  !> components inherited from `tableau_type` hold transformed coefficients: `b` holds b X, `ba` holds b A X and, after fitting,
  !> `a` holds A X and `aa` holds A A X.
  type, extends(tableau_type), public :: nested_type
    !> `values`: last two rows of X, which give the accelerations at the last two nodes, shape (2, s). `sums`: factors with
    !> which the last two equations are added to each equation, shape (s, 2). `tails`: factors that convert values at the nodes
    !> to the rms of their parts along the Legendre polynomials P_s-4 to P_s-1, shape (s, 4). `weights`: weights b, shape (s).
    real(dp), allocatable :: values(:, :), sums(:, :), tails(:, :), weights(:)
  contains
    procedure :: fit => fit_nested
  end type nested_type

contains

  !> Ratio of the phase errors of the Gauss methods with s - 1 and with s stages, multiplied by z^2. Here z is the phase advance
  !> (radians) of the motion in a step.
  elemental real(dp) function phase_error_ratio(s)
    integer, intent(in) :: s

    phase_error_ratio = 4 * (4 * real(s, dp)**2 - 1)
  end function phase_error_ratio

  !> Phase error of an embedded method relative to that of Gauss' method of the same order: 1/2 for systems with positions, 1 for
  !> other systems. gestell_floquet_period_embedded_error contains the derivation.
  pure real(dp) function embedded_phase_error(positions) result(part)
    logical, intent(in) :: positions

    part = merge(0.5_dp, 1.0_dp, positions)
  end function embedded_phase_error

  !> Returns the nested tableau that corresponds to the Gauss tableau `rule`, which must have at least four stages.
  pure type(nested_type) function nested_tableau(rule) result(nested)
    type(tableau_type), intent(in) :: rule
    ! Rows b and b A
    real(dp) :: factors(2, size(rule%c)), p(size(rule%c), 0:size(rule%c) - 1), next(size(rule%c))
    integer :: order(size(rule%c)), s, i, j

    s = size(rule%c)
    next = 2 * rule%c - 1
    call find_legendre(s - 1, next, p)
    allocate(nested%c(s), nested%weights(s), nested%a(s, s), nested%high(s), nested%next(s))
    allocate(nested%tails(s, 4), nested%values(2, s), nested%sums(s, 2))
    ! For P_s-1, and for the part of P_s-2 in the equations without P_s-1, put the node with the largest value times b last.
    order = [(i, i = 1, s)]
    associate (high => p(:, s - 1), b => nested%weights, v => nested%values)
      call move_last(rule%b * abs(high), order)
      next = p(:, s - 2) - p(order(s), s - 2) / high(order(s)) * high
      call move_last(rule%b * abs(next), order(:s - 1))

      ! Element by element: sections with index lists would allocate memory.
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
    call transform_unknowns(nested%values, factors)
    nested%b = factors(1, :)
    nested%ba = factors(2, :)
  end function nested_tableau

  !> Fits the method to a motion whose phase advances by `turn` radians in a step. Its embedded methods are not fitted, and `b` and
  !> `ba` do not change.
  pure subroutine fit_nested(self, turn)
    class(nested_type), intent(inout) :: self
    real(dp), intent(in) :: turn
    real(dp) :: slopes(size(self%c), size(self%c))

    call add_tail(self%high, self%next, self%weights, turn, self%a)
    slopes = self%a
    call transform_unknowns(self%values, self%a)
    self%aa = product_of(slopes, self%a)
  end subroutine fit_nested

  !> Replaces the factors Z of the accelerations v at the nodes, shape (rows, s), by the factors Z X of the unknowns u, where v =
  !> X u. `values`: last two rows of X.
  pure subroutine transform_unknowns(values, z)
    real(dp), intent(in) :: values(:, :)
    real(dp), intent(inout) :: z(:, :)
    integer :: s, k

    s = size(z, 2)
    do k = 1, s - 2
      z(:, k) = z(:, k) + z(:, s - 1) * values(1, k) + z(:, s) * values(2, k)
    end do
    z(:, s - 1) = z(:, s - 1) + z(:, s) * values(2, s - 1)
  end subroutine transform_unknowns

  !> Moves the index of the node with the largest weight to the end of `order`.
  pure subroutine move_last(weights, order)
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
  end subroutine move_last

end module gestell_floquet_integrator_nested
