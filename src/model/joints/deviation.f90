!> Bounds on the change of a joint's acceleration within an interval of the crank angle, (25) of doc/theory.md. The deviation of the
!> acceleration from its value in the middle of the interval lies in a parallelogram, because each bar and each guide bounds the
!> component of the deviation along itself. If the bounds were discs, they would grow by 1 / sin mu from dyad to dyad (mu:
!> transmission angle). As parallelograms, they grow only as much as the motions themselves.
module gestell_model_joints_deviation
  use gestell_base_kinds, only: dp
  use gestell_math_ball, only: ball, operator(*), operator(+), operator(-), operator(/)
  use gestell_model_joints_path, only: point_type, slack
  implicit none (type, external)
  private

  public :: along_bar, disc, of_body, parallelogram

  !> The parallelogram of all vectors s a + t b with |s|, |t| <= 1 (m).
  type, public :: deviation_type
    real(dp) :: a(2) = 0, b(2) = 0
  contains
    procedure :: along, radius
  end type deviation_type

contains

  !> Maximum component of the vectors in the parallelogram along a unit direction.
  pure real(dp) function along(self, direction)
    class(deviation_type), intent(in) :: self
    real(dp), intent(in) :: direction(2)

    along = abs(dot_product(self%a, direction)) + abs(dot_product(self%b, direction))
  end function along

  !> Maximum length of the vectors in the parallelogram.
  pure real(dp) function radius(self)
    class(deviation_type), intent(in) :: self

    radius = max(norm2(self%a + self%b), norm2(self%a - self%b))
  end function radius

  !> A square that contains the disc with the given radius (m).
  pure type(deviation_type) function disc(radius)
    real(dp), intent(in) :: radius

    disc = deviation_type([radius, 0.0_dp], [0.0_dp, radius])
  end function disc

  !> Parallelogram of all vectors whose components along two unit directions are at most `bounds` in modulus.
  pure type(deviation_type) function parallelogram(directions, bounds)
    real(dp), intent(in) :: directions(2, 2), bounds(2)
    real(dp) :: sine

    associate (p => directions(:, 1), q => directions(:, 2))
      sine = p(1) * q(2) - p(2) * q(1)
      parallelogram = deviation_type(bounds(1) / sine * [q(2), -q(1)], bounds(2) / sine * [-p(2), p(1)])
    end associate
  end function parallelogram

  !> Bounds the deviation of the acceleration of joint `to` along a bar p of constant length, which leads from joint `from` to joint
  !> `to`. Returns the bar's `direction` in the middle of the interval and the `bound`. `deviation`: deviation of joint `from`. At
  !> all crank angles p . p'' = -|p'|^2. With index 0 for values in the middle and |p''| <= b in the interval,
  !>
  !>     |p0 . (p'' - p0'')| = ||p0'|^2 - |p'|^2 - (p - p0) . p''| <= b w (3 |p0'| + 2 b w)
  !>
  !> within the half width w of the interval.
  pure subroutine along_bar(from, to, deviation, radius, half_width, direction, bound)
    type(point_type), intent(in) :: from, to
    class(deviation_type), intent(in) :: deviation
    !> `radius`: bound on the deviation of the acceleration of joint `to` (m). `half_width`: half the width of the interval (rad)
    real(dp), intent(in) :: radius, half_width
    real(dp), intent(out) :: direction(2), bound
    real(dp) :: length, change

    direction = [to%x%v - from%x%v, to%y%v - from%y%v]
    length = norm2(direction)
    direction = direction / length
    change = half_width * (hypot(to%x%dd - from%x%dd, to%y%dd - from%y%dd) + radius + deviation%radius())
    bound = deviation%along(direction) + slack * change * (3 * hypot(to%x%d - from%x%d, to%y%d - from%y%d) + 2 * change) / length
  end subroutine along_bar

  !> Computes the deviation for a point of a body that carries the joints `from` and `to`. The point is at the distance `arm(1)`
  !> from joint `from` toward joint `to`, and at the distance `arm(2)` to the left (m). The vector s = to - from has the length L
  !> and the unit direction u. Since the middle of the interval u has rotated by theta; its rate of rotation is omega:
  !>
  !>     u'' = omega' u_perp - omega^2 u,   omega' = (u_perp . s'' - 2 omega L') / L,   L'' = u . s'' + omega^2 L.
  !>
  !> Components along the directions that u and u_perp have in the middle are bounded separately. If L is constant, the bound
  !> perpendicular to the bar therefore grows from body to body only by terms in theta^2.
  pure type(deviation_type) function of_body(from, to, deviations, arm, half_width, largest) result(deviation)
    type(point_type), intent(in) :: from, to
    !> Deviations of the accelerations of the two joints from their values in the middle of the interval
    type(deviation_type), intent(in) :: deviations(2)
    !> `largest`: bound on the magnitude of the deviation, which applies if the two joints may coincide
    real(dp), intent(in) :: arm(2), half_width, largest
    real(dp) :: u(2), s1(2), s2(2), length, most, bend, change, curve
    type(ball) :: along, across, cosine, sine, omega, slope, apart, turning, bending, dd(2)
    integer :: round

    u = [to%x%v - from%x%v, to%y%v - from%y%v]
    s1 = [to%x%d - from%x%d, to%y%d - from%y%d]
    s2 = [to%x%dd - from%x%dd, to%y%dd - from%y%dd]
    length = norm2(u)
    u = u / length
    along = ball(dot_product(s2, u), deviations(1)%along(u) + deviations(2)%along(u))
    across = ball(dot_product(s2, left(u)), deviations(1)%along(left(u)) + deviations(2)%along(left(u)))
    bend = hypot(along%maximum(), across%maximum())
    most = norm2(s1) + half_width * bend
    deviation = disc(largest)
    if (.not. length > slack * most * half_width) return
    apart = ball(length, most * half_width)
    ! Bounds on omega' and L'' yield better ones in the next round.
    change = (bend + 2 * most**2 / (length - apart%radius)) / (length - apart%radius)
    curve = bend + most**2 / (length - apart%radius)
    do round = 1, 2
      omega = ball(dot_product(s1, left(u)) / length, half_width * change)
      sine = ball(0.0_dp, half_width * omega%maximum())
      cosine = ball(1.0_dp, sine%radius**2 / 2)
      slope = ball(dot_product(s1, u), half_width * curve)
      apart%radius = half_width * min(most, slope%maximum())
      bending = cosine * along + sine * across + omega * omega * apart
      turning = (cosine * across - sine * along - ball(2.0_dp) * omega * slope) / apart
      curve = min(curve, bending%maximum())
      change = min(change, turning%maximum())
    end do
    dd = [ball() - sine * turning - cosine * omega * omega, cosine * turning - sine * omega * omega]
    deviation%a = dd(1)%radius * (arm(1) * u + arm(2) * left(u))
    deviation%b = dd(2)%radius * (arm(1) * left(u) - arm(2) * u)
    deviation = minkowski_sum(deviation, deviations(1))
  end function of_body

  !> A rectangle that contains all sums of a vector of `one` and a vector of `two`. One side of the rectangle is parallel to the
  !> longest side of the two parallelograms.
  pure type(deviation_type) function minkowski_sum(one, two)
    class(deviation_type), intent(in) :: one, two
    real(dp) :: sides(2, 4), directions(2, 2)
    integer :: k

    sides = reshape([one%a, one%b, two%a, two%b], [2, 4])
    k = maxloc(norm2(sides, dim=1), dim=1)
    if (.not. norm2(sides(:, k)) > 0) return
    directions(:, 1) = sides(:, k) / norm2(sides(:, k))
    directions(:, 2) = left(directions(:, 1))
    minkowski_sum = parallelogram(directions, [(one%along(directions(:, k)) + two%along(directions(:, k)), k = 1, 2)])
  end function minkowski_sum

  !> The vector v rotated by 90 degrees to the left.
  pure function left(v)
    real(dp), intent(in) :: v(2)
    real(dp) :: left(2)

    left = [-v(2), v(1)]
  end function left

end module gestell_model_joints_deviation
