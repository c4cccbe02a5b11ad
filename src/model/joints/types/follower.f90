!> The follower of a cam: a slider whose position on its guide the cam determines.
module gestell_model_joints_types_follower
  use gestell_base_key, only: integer_key, key_type, of_angle, of_length, positive, range_type, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_math_dft, only: dft
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-), operator(/), sqrt
  use gestell_model_joints_data, only: check_coordinates, check_finite, joint_data_type
  use gestell_model_joints_guide, only: guide_keys, guide_motion_type, guide_type
  use gestell_model_joints_joint, only: form_type, itself, guided_joint, point_type, reach_type, transmission_type
  use gestell_model_joints_law, only: law_names, law_type, new_law
  use gestell_model_joints_pairs, only: contact, pair_type, slide
  use gestell_model_joints_path, only: batch, cross, direction, dot, path_type
  implicit none (type, external)
  private

  public :: lift_through

  !> Maximum number of values that describe a lift.
  integer, parameter :: most = 1001
  !> Maximum number of segments of a law.
  integer, parameter :: most_segments = 24

  type(key_type), parameter :: keys(*) = [ &
    & key_type("joint", "cam", text_key, "two joints of the cam; the first is its centre", 1, 2, 2, required=.true.), &
    & key_type("joint", "lift", real_key, "Fourier coefficients of the lift as a function of the cam's angle theta: the mean, " // &
    &   "then the factors of cos theta, sin theta, cos 2 theta, sin 2 theta, ...", 1, 1, most, unit=of_length, otherwise="none"), &
    & key_type("joint", "lift_table", real_key, "replaces `lift`: values of the lift at equally spaced angles of the cam, the " // &
    &   "first at the angle 0", 1, 3, most, unit=of_length, otherwise="none"), &
    & key_type("joint", "harmonics", integer_key, "highest order of the lift that is taken from `lift_table`", &
    &   otherwise="all orders of the table", range=range_type(least=1.0_dp, most=500.0_dp)), &
    & key_type("joint", "law", text_key, "replaces `lift`: law of each segment of the turn, from the cam's angle 0 on", 1, 2, &
    &   most_segments, otherwise="none", words=law_names), &
    & key_type("joint", "law_angle", real_key, "width of each segment of `law`; the sum is 360 deg", 1, 2, most_segments, &
    &   unit=of_angle, otherwise="required by `law`", range=positive), &
    & key_type("joint", "law_lift", real_key, "lift at the end of each segment of `law` that is not a dwell", 1, 2, &
    &   most_segments, unit=of_length, otherwise="required by `law`"), &
    & key_type("joint", "lift_phase", real_key, "constant angle that is added to the cam's angle", unit=of_angle, default=0.0_dp)]

  !> The joint lies on `guide`. Its distance L from the guide's point is the lift:
  !>
  !>     r = g + L(theta) u,   L = lift(1) + sum over k of lift(2 k) cos(k theta) + lift(2 k + 1) sin(k theta)   (m),
  !>
  !> where theta is the angle from the guide's direction u to the direction of the line `cam`, which two joints of the cam carry:
  !> its angle is the constant that is added to the cam's angle (rad). If `law` is allocated, it determines L instead of `lift`.
  type, extends(guided_joint), public :: follower_joint
    type(guide_type) :: cam
    real(dp), allocatable :: lift(:)
    !> Number of harmonics that a table of lifts determines; 0 if the lift is given by its harmonics.
    integer :: table_orders = 0
    type(law_type), allocatable :: law
  contains
    procedure :: describe, carriers, define, check, locate, trace, reach, transmission, cam_angle, pairs
  end type follower_joint

contains

  pure subroutine describe(self, form)
    class(follower_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("follower", "cam follower on a guide; its distance from `guide_point` is the lift. The cam's angle is " // &
      &   "measured counter-clockwise from the guide to the line from `cam(1)` to `cam(2)`, plus `lift_phase`. Give one of " // &
      &   "`lift`, `lift_table`, `law`", &
      & links=1, pairs=1, higher_pairs=1, keys=[keys, guide_keys], bars=[self%cam%carriers(1), itself], guides=[self%guide], &
      & obstacle="the two joints of the cam, or the two joints that carry the guide, coincide")
  end subroutine describe

  pure subroutine carriers(self, joints)
    class(follower_joint), intent(in) :: self
    integer, allocatable, intent(out) :: joints(:)

    joints = self%cam%carriers
    if (any(self%guide%carriers /= 0)) joints = [joints, self%guide%carriers]
  end subroutine carriers

  !> The follower is one body, on its guide. The cam pushes it at the joint, which is the centre of its roller.
  pure subroutine pairs(self, number, list)
    class(follower_joint), intent(in) :: self
    integer, intent(in) :: number
    type(pair_type), allocatable, intent(out) :: list(:)

    list = [pair_type(slide, 1, number, self%guide), pair_type(contact, 1, number, self%cam)]
  end subroutine pairs

  pure subroutine define(self, data)
    class(follower_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    self%cam%carriers = data%joints("cam")
    self%cam%angle = data%number("lift_phase")
    call self%guide%define(data, "guide")
    if (data%reason /= "") return
    if (count([data%has("lift"), data%has("lift_table"), data%has("law")]) /= 1) then
      data%reason = "give one of 'lift' (harmonics), 'lift_table' and 'law'"
    else if (data%has("harmonics") .and. .not. data%has("lift_table")) then
      data%reason = "'harmonics' limits the orders of 'lift_table' only"
    else if (any([data%has("law_angle"), data%has("law_lift")] .neqv. data%has("law"))) then
      data%reason = "'law', 'law_angle' and 'law_lift' belong together"
    else if (data%has("law")) then
      allocate(self%law)
      call new_law(self%law, data%joints("law"), data%numbers("law_angle"), data%numbers("law_lift"), data%key, data%reason)
    else if (data%has("lift")) then
      self%lift = data%numbers("lift")
      if (modulo(size(self%lift), 2) == 0) then
        data%key = "lift"
        data%reason = "must have an odd number of values: the mean, then one cosine and one sine coefficient for each order"
      end if
    else
      self%lift = lift_through(data%numbers("lift_table"))
      self%table_orders = size(data%numbers("lift_table")) / 2
      if (data%has("harmonics")) self%lift = self%lift(:min(size(self%lift), 1 + 2 * nint(data%number("harmonics"))))
    end if
  end subroutine define

  !> Harmonics of the lift through values at equal steps of the angle over a turn, starting at 0. For an even number n of values the
  !> last term is cos(n theta/2). The highest orders are omitted if they are only rounding errors.
  pure function lift_through(table) result(lift)
    real(dp), intent(in) :: table(:)
    real(dp), allocatable :: lift(:)
    complex(dp) :: y(size(table))
    integer :: k, n

    n = size(table)
    y = dft(cmplx(table, 0, dp)) / n
    allocate(lift(1 + 2 * (n / 2)))
    lift(1) = real(y(1))
    do k = 1, n / 2
      lift(2 * k:2 * k + 1) = [2 * real(y(k + 1)), -2 * aimag(y(k + 1))]
    end do
    if (modulo(n, 2) == 0) lift(n:) = [real(y(n / 2 + 1)), 0.0_dp]
    do k = size(lift) / 2, 1, -1
      if (norm2(lift(2 * k:2 * k + 1)) > 16 * epsilon(lift) * maxval(abs(table))) exit
    end do
    lift = lift(:2 * k + 1)
  end function lift_through

  pure subroutine check(self, reason)
    class(follower_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call self%guide%check(reason)
    call check_finite([self%cam%angle], reason)
    if (reason /= "") return
    if (self%cam%carriers(1) == self%cam%carriers(2)) reason = "the cam must refer to two different joints"
    if (allocated(self%law)) then
      call check_coordinates(self%law%lifts, reason)
    else if (.not. allocated(self%lift)) then
      reason = "it has no lift"
    else if (modulo(size(self%lift), 2) == 0) then
      reason = "the lift must have an odd number of values: the mean, then one cosine and one sine coefficient for each order"
    else
      call check_coordinates(self%lift, reason)
    end if
  end subroutine check

  !> Computes the lift L and its first three derivatives with respect to theta; `f` has the shape (angles, 0:3). `c`, `s`:
  !> cos(theta) and sin(theta).
  pure subroutine follow(self, c, s, f)
    class(follower_joint), intent(in) :: self
    real(dp), intent(in) :: c(:), s(:)
    real(dp), intent(out) :: f(:, 0:)
    real(dp) :: ck(size(c)), sk(size(c)), turned(size(c))
    integer :: k

    if (allocated(self%law)) then
      call self%law%follow(atan2(s, c), f)
      return
    end if
    f = 0
    f(:, 0) = self%lift(1)
    ck = 1
    sk = 0
    do k = 1, size(self%lift) / 2
      turned = ck * c - sk * s
      sk = sk * c + ck * s
      ck = turned
      associate (along => self%lift(2 * k) * ck + self%lift(2 * k + 1) * sk, &
        & across => self%lift(2 * k + 1) * ck - self%lift(2 * k) * sk, n => real(k, dp))
        f(:, 0) = f(:, 0) + along
        f(:, 1) = f(:, 1) + n * across
        f(:, 2) = f(:, 2) - n**2 * along
        f(:, 3) = f(:, 3) - n**3 * across
      end associate
    end do
  end subroutine follow

  !> Computes the point and direction of the guide, the lift, and the slope dL/dtheta at one crank angle. The rate theta' = c s' - s
  !> c' follows from c = cos(theta) and s = sin(theta).
  pure subroutine lift_here(self, points, g, u, lift, slope)
    class(follower_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: g, u
    type(jet), intent(out) :: lift, slope
    type(point_type) :: center, e
    type(jet) :: c, s
    real(dp) :: f(1, 0:3), w, w1, w2

    call self%guide%line(points, g, u)
    call self%cam%line(points, center, e)
    c = dot(u, e)
    s = cross(u, e)
    call follow(self, [c%v], [s%v], f)
    w = c%v * s%d - s%v * c%d
    w1 = c%v * s%dd - s%v * c%dd
    w2 = c%v * s%ddd - s%v * c%ddd + c%d * s%dd - s%d * c%dd
    associate (l => f(1, :))
      lift = jet(l(1), l(2) * w, l(3) * w**2 + l(2) * w1, l(4) * w**3 + 3 * l(3) * w * w1 + l(2) * w2)
      slope = jet(l(2), l(3) * w, l(4) * w**2 + l(3) * w1)
    end associate
  end subroutine lift_here

  !> The cam's angle theta at one crank angle, and its rate dtheta/dphi.
  pure subroutine cam_angle(self, points, theta, rate)
    class(follower_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(out) :: theta, rate
    type(point_type) :: origin, u, e
    type(jet) :: c, s

    call self%guide%line(points, origin, u)
    call self%cam%line(points, origin, e)
    c = dot(u, e)
    s = cross(u, e)
    theta = atan2(s%v, c%v)
    rate = c%v * s%d - s%v * c%d
  end subroutine cam_angle

  pure subroutine locate(self, crank_angle, points, here)
    class(follower_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: g, u
    type(jet) :: lift, slope

    associate (unused => crank_angle)
    end associate
    call lift_here(self, points, g, u, lift, slope)
    here = point_type(g%x + lift * u%x, g%y + lift * u%y)
  end subroutine locate

  !> Computes the path: r' = g' + L u' + L' u, r'' = g'' + L u'' + 2 L' u' + L'' u.
  pure subroutine trace(self, angles, points, here)
    class(follower_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: g, u, center, e
    real(dp), dimension(batch) :: c, s, w, w1, l1, l2
    real(dp) :: f(batch, 0:3)

    associate (unused => angles)
    end associate
    call self%guide%trace(points, g, u)
    call self%cam%trace(points, center, e)
    c = u%x * e%x + u%y * e%y
    s = u%x * e%y - u%y * e%x
    ! Both directions turn, hence theta' = e x e' - u x u'.
    w = e%x * e%vy - e%y * e%vx - (u%x * u%vy - u%y * u%vx)
    w1 = e%x * e%ay - e%y * e%ax - (u%x * u%ay - u%y * u%ax)
    call follow(self, c, s, f)
    l1 = f(:, 1) * w
    l2 = f(:, 2) * w**2 + f(:, 1) * w1
    here%x = g%x + f(:, 0) * u%x
    here%y = g%y + f(:, 0) * u%y
    here%vx = g%vx + f(:, 0) * u%vx + l1 * u%x
    here%vy = g%vy + f(:, 0) * u%vy + l1 * u%y
    here%ax = g%ax + f(:, 0) * u%ax + 2 * l1 * u%vx + l2 * u%x
    here%ay = g%ay + f(:, 0) * u%ay + 2 * l1 * u%vy + l2 * u%y
  end subroutine trace

  !> Bounds on the joint's motion. The follower can be assembled if guide and cam each have a direction. With the amplitude A_k of
  !> order k
  !>
  !>     |L| <= |lift(1)| + sum of A_k,   |dL/dtheta| <= sum of k A_k,   |d2L/dtheta2| <= sum of k^2 A_k.
  !>
  !> A law has bounds of its own. |theta'| is at most the sum of the angular velocities of cam and guide. The sums of the absolute
  !> values of the terms of r' and r'' in `trace` bound speed and acceleration.
  pure function reach(self, points, speeds, accelerations, half_width)
    class(follower_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach
    type(guide_motion_type) :: guide, body
    type(point_type) :: center, u, e
    real(dp) :: bound(0:2), amplitude, turning, change, rate, order
    integer :: k

    guide = self%guide%motion(points, speeds, accelerations, half_width)
    body = self%cam%motion(points, speeds, accelerations, half_width)
    reach%assembled = guide%sound .and. body%sound
    if (.not. reach%assembled) return
    if (allocated(self%law)) then
      order = self%law%order()
      bound = self%law%bounds()
    else
      order = size(self%lift) / 2
      bound = [abs(self%lift(1)), 0.0_dp, 0.0_dp]
      do k = 1, size(self%lift) / 2
        amplitude = norm2(self%lift(2 * k:2 * k + 1))
        bound = bound + amplitude * [1.0_dp, real(k, dp), real(k, dp)**2]
      end do
    end if
    turning = guide%turning + body%turning
    change = guide%turning_change + body%turning_change
    reach%speed = guide%speed + bound(0) * guide%turning + bound(1) * turning
    reach%acceleration = guide%acceleration + bound(0) * (guide%turning_change + guide%turning**2) &
      & + 2 * bound(1) * turning * guide%turning + bound(2) * turning**2 + bound(1) * change
    reach%angle_scale = min(guide%angle_scale, body%angle_scale)
    call self%guide%line(points, center, u)
    e = direction(points(self%cam%carriers(1)), points(self%cam%carriers(2)))
    rate = abs(e%x%v * e%y%d - e%y%v * e%x%d - (u%x%v * u%y%d - u%y%v * u%x%d))
    if (order * rate > 1) reach%angle_scale = min(reach%angle_scale, 1 / (order * rate))
  end function reach

  !> Quality of the transmission. The sine of the transmission angle is the cosine of the pressure angle between the guide and the
  !> common normal of cam and follower. The normal passes through the instantaneous centre of their relative motion. This centre is
  !> at the distance dL/dtheta, perpendicular to the guide, from the cam's centre of rotation `cam(1)`.
  pure function transmission(self, points, here)
    class(follower_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(transmission_type) :: transmission
    type(point_type) :: g, u, normal
    type(jet) :: lift, slope, square

    call lift_here(self, points, g, u, lift, slope)
    normal = point_type(here%x - points(self%cam%carriers(1))%x - slope * u%y, &
      & here%y - points(self%cam%carriers(1))%y + slope * u%x)
    transmission = transmission_type(sine=jet(), slides=.true., travel=lift)
    square = dot(normal, normal)
    if (.not. square%v > 0) return
    transmission%sine = dot(normal, u) / sqrt(square)
    transmission%sine = sign(1.0_dp, transmission%sine%v) * transmission%sine
  end function transmission

end module gestell_model_joints_types_follower
