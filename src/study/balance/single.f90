!> Finds the best counterweight on a single body (doc/theory.md, "Balancing").
!>
!> Each row of the shaking, which is a component of force or moment, is multiplied by a weight. With a counterweight of unbalance
!> rho at the angle alpha, the mean square of the weighted rows is
!>
!>     J = J_0 + 2 rho B(alpha) + rho^2 A(alpha),   B = b . v,   A = v . G v,   v = (1, cos alpha, sin alpha).
!>
!> The vector b contains the means of the products of the linkage's shaking with the effects of the counterweight. The matrix G
!> contains the means of the products of the effects with each other.
!>
!> For given alpha the best unbalance is rho = -B / A if B < 0, otherwise 0. It reduces J by B^2 / A, which never exceeds J_0. The
!> reduction is largest at a zero of 2 B' A - B A', a polynomial of third degree in cos alpha and sin alpha. At most three of its
!> six zeros are maxima. Each zero is located between two angles half a degree apart. If two zeros lie between the same two
!> angles, both are missed, but B^2 / A hardly changes between them.
module gestell_study_balance_single
  use gestell_base_kinds, only: dp, pi
  use gestell_math_root_search, only: root_search_type
  use gestell_study_balance, only: rigid_ground_type
  use gestell_study_balance_bodies, only: counterweight_type
  implicit none (type, external)
  private

  public :: best_single

contains

  !> Finds the counterweight on body number `body` that minimises the weighted mean square of shaking forces and moments. Its
  !> unbalance is zero if no counterweight on this body reduces the mean square.
  subroutine best_single(rigid, body, weights, best)
    !> Shaking forces and moments of the linkage and the effects of counterweights on its bodies
    type(rigid_ground_type), intent(in) :: rigid
    integer, intent(in) :: body
    !> Factor by which each row of the shaking is multiplied, shape (rows)
    real(dp), intent(in) :: weights(:)
    type(counterweight_type), intent(out) :: best
    integer, parameter :: places = 720
    !> `sharp`: tolerance of the angle (rad). `rounding`: relative rounding error of an effect. `nothing`: a counterweight is
    !> omitted if it reduces the mean square by a smaller fraction than this.
    real(dp), parameter :: sharp = 4.0e-15_dp, rounding = 1.0e-12_dp, nothing = 1.0e-13_dp
    type(root_search_type) :: search
    real(dp) :: b(3), g(3, 3), least, whole, maximum, alpha, trial_angle, slope(0:places)
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
    maximum = nothing * whole
    slope = [(stationary(2 * pi * k / places), k = 0, places)]
    do k = 0, places - 1
      ! B^2 / A has a maximum where its slope changes from positive to negative; the maximum counts only if B < 0
      if (slope(k) > 0 .eqv. slope(k + 1) > 0) cycle
      call search%start(2 * pi * k / places, slope(k), 2 * pi * (k + 1) / places, slope(k + 1))
      do while (.not. search%found(sharp))
        alpha = search%next(sharp)
        call search%take(alpha, stationary(alpha))
      end do
      alpha = search%root()
      associate (v => vector(alpha))
        if (dot_product(b, v) >= 0 .or. dot_product(v, matmul(g, v)) <= least) cycle
        trial_angle = dot_product(b, v)**2 / dot_product(v, matmul(g, v))
        if (trial_angle <= maximum) cycle
        maximum = trial_angle
        best%angle = alpha
        best%unbalance = -dot_product(b, v) / dot_product(v, matmul(g, v))
      end associate
    end do
    if (best%angle > pi) best%angle = best%angle - 2 * pi

  contains

    !> The function 2 B' A - B A' of the angle `alpha`. Its zeros are the stationary points of B^2 / A, the reduction of the mean
    !> square by a counterweight at this angle (see the head of the module).
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
