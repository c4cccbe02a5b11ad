!> The best single counterweight on a body.
!>
!> With the rows of what shakes weighted by w, the mean square over the turn is by an unbalance rho at the angle alpha
!>
!>     J = J_0 + 2 rho B(alpha) + rho^2 A(alpha),   B = b . v,   A = v . G v,   v = (1, cos alpha, sin alpha),
!>
!> b and G the means of products of what shakes and of the effects of the counterweight. At given alpha rho = -B / A is best where
!> B < 0, else none is; it takes B^2 / A away, which never exceeds J_0. This is greatest where 2 B' A - B A', of the third degree in
!> cos alpha and sin alpha, vanishes: it has six zeros at the most, three of them greatest values. They are found between places
!> half a degree apart: all of them, but for pairs that lie closer, between which B^2 / A hardly changes.
module gestell_study_balance_single
  use gestell_base_kinds, only: dp, pi
  use gestell_math_root_search, only: root_search_type
  use gestell_study_balance, only: rigid_ground_type
  use gestell_study_balance_bodies, only: counterweight_type
  implicit none (type, external)
  private

  public :: best_single

contains

  !> The counterweight on body number `body` by which the mean square of what shakes, its rows times `weights`, shape (rows), is
  !> least; its unbalance is zero where none makes it less.
  subroutine best_single(rigid, body, weights, best)
    type(rigid_ground_type), intent(in) :: rigid
    integer, intent(in) :: body
    real(dp), intent(in) :: weights(:)
    type(counterweight_type), intent(out) :: best
    integer, parameter :: places = 720
    !> Of an angle (rad); what is rounding of an effect, of a mean square that is taken away.
    real(dp), parameter :: sharp = 4.0e-15_dp, rounding = 1.0e-12_dp, nothing = 1.0e-13_dp
    type(root_search_type) :: search
    real(dp) :: b(3), g(3, 3), least, whole, greatest, alpha, taken, slope(0:places)
    integer :: k, l, n

    best%body = body
    n = size(rigid%found, 2)
    associate (effect => rigid%bodies(body)%effect, r => rigid%bodies(body)%radius)
      do k = 1, 3
        b(k) = sum(weights**2 * sum(rigid%found * effect(:, :, k), dim=2)) / n
        do l = 1, 3
          g(l, k) = sum(weights**2 * sum(effect(:, :, l) * effect(:, :, k), dim=2)) / n
        end do
      end do
      least = sum((rounding * weights * merge(1.0_dp, r, rigid%kinds() == 1))**2)
    end associate
    whole = sum(weights**2 * sum(rigid%found**2, dim=2)) / n
    if (whole <= sum((weights * rigid%rounding(rigid%kinds()))**2)) return
    greatest = nothing * whole
    slope = [(stationary(2 * pi * k / places), k = 0, places)]
    do k = 0, places - 1
      ! a rise of B^2 / A that ends, with B < 0
      if (slope(k) > 0 .eqv. slope(k + 1) > 0) cycle
      call search%start(2 * pi * k / places, slope(k), 2 * pi * (k + 1) / places, slope(k + 1))
      do while (.not. search%found(sharp))
        alpha = search%next(sharp)
        call search%take(alpha, stationary(alpha))
      end do
      alpha = search%root()
      associate (v => vector(alpha))
        if (dot_product(b, v) >= 0 .or. dot_product(v, matmul(g, v)) <= least) cycle
        taken = dot_product(b, v)**2 / dot_product(v, matmul(g, v))
        if (taken <= greatest) cycle
        greatest = taken
        best%angle = alpha
        best%unbalance = -dot_product(b, v) / dot_product(v, matmul(g, v))
      end associate
    end do
    if (best%angle > pi) best%angle = best%angle - 2 * pi

  contains

    !> 2 B' A - B A'.
    pure real(dp) function stationary(alpha)
      real(dp), intent(in) :: alpha
      real(dp) :: v(3), along(3)

      v = vector(alpha)
      along = [0.0_dp, -sin(alpha), cos(alpha)]
      stationary = 2 * dot_product(v, matmul(g, dot_product(b, along) * v - dot_product(b, v) * along))
    end function stationary

    pure function vector(alpha) result(v)
      real(dp), intent(in) :: alpha
      real(dp) :: v(3)

      v = [1.0_dp, cos(alpha), sin(alpha)]
    end function vector

  end subroutine best_single

end module gestell_study_balance_single
