!> The guide of a slider: a directed line that is fixed to the frame or carried by the body between two joints.
module gestell_model_joints_guide
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-), operator(/)
  use gestell_base_key, only: key_type, of_angle, of_length, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_model_joints_data, only: check_coordinates, check_finite, joint_data_type
  use gestell_model_joints_path, only: batch, carried, carry, cross, direction, find_direction, set_fixed, path_type, point_type, &
    & slack, turn, turning_scale
  use gestell_model_joints_placement, only: placement_type
  implicit none (type, external)
  private

  public :: crossing, intersect_lines, parallel

  !> A guide: the line through `point` (m) at `angle` (rad) to the x-axis. If two joints P and Q carry the guide, `carriers` are the
  !> indices of P and Q; `point` and `angle` then refer to axes with origin P whose first axis points to Q.
  type, public :: guide_type
    integer :: carriers(2) = 0
    real(dp) :: point(2) = 0, angle = 0
  contains
    procedure :: line, trace, motion, define, check, move
  end type guide_type

  !> `of_guide`, `of_point`, `of_angle_there`: descriptions of the keys of a guide. `guide_keys`, `second_guide_keys`: keys of a
  !> guide, and of the second guide of a dyad PRP.
  character(len=*), parameter :: of_guide = "two joints of the body that carries the guide; without this key the guide is " // &
    &   "fixed to the frame", &
    & of_point = "coordinates x and y of a point on the guide; if a body carries the guide, coordinates in axes whose origin " // &
    &   "is `guide(1)` and whose first axis points to `guide(2)`", of_angle_there = "direction of the guide: its angle from " // &
    &   "the x-axis; if a body carries the guide, its angle from the line `guide(1)` to `guide(2)`"
  type(key_type), parameter, public :: guide_keys(*) = [ &
    & key_type("joint", "guide", text_key, of_guide, 1, 2, 2, otherwise="none"), &
    & key_type("joint", "guide_point", real_key, of_point, 1, 2, 2, unit=of_length, otherwise="`0, 0` if a body carries the " // &
    &   "guide"), &
    & key_type("joint", "guide_angle", real_key, of_angle_there, unit=of_angle, otherwise="`0` if a body carries the guide")]
  type(key_type), parameter, public :: second_guide_keys(*) = [ &
    & key_type("joint", "guide2", text_key, "two joints of the body that carries the second guide of a `PRP`; without this " // &
    &   "key this guide is fixed to the frame", 1, 2, 2, otherwise="none"), &
    & key_type("joint", "guide2_point", real_key, "coordinates of a point on the second guide of a `PRP`, given like " // &
    &   "`guide_point`", 1, 2, 2, unit=of_length, otherwise="`0, 0` if a body carries the guide"), &
    & key_type("joint", "guide2_angle", real_key, "direction of the second guide of a `PRP`, given like `guide_angle`", &
    &   unit=of_angle, otherwise="`0` if a body carries the guide")]

  !> Bounds on the motion of a guide over an interval of the crank angle.
  type, public :: guide_motion_type
    !> True if the two carriers cannot coincide, so that the guide has a definite direction.
    logical :: sound = .true.
    !> `speed`: bound on the speed of the guide's point (m per rad of the crank angle). `turning`: bound on the guide's rate of
    !> rotation (rad per rad of the crank angle).
    real(dp) :: speed = 0, turning = 0
    !> `acceleration`: bound on the acceleration of the guide's point (m per rad^2 of the crank angle). `turning_change`: bound on
    !> the derivative of the guide's rate of rotation (rad per rad^2).
    real(dp) :: acceleration = 0, turning_change = 0
    !> Crank angle over which the guide's direction changes noticeably (rad).
    real(dp) :: angle_scale = 1
  end type guide_motion_type

contains

  !> Defines the guide by the keys NAME, NAME_point and NAME_angle, where NAME stands for `name`. If these keys do not define a
  !> guide, stores the reason in `data`.
  pure subroutine define(self, data, name)
    class(guide_type), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data
    character(len=*), intent(in) :: name

    if (data%has(name)) then
      self%carriers = data%joints(name)
    else if (.not. (data%has(name // "_point") .and. data%has(name // "_angle"))) then
      data%reason = "give '" // name // "_point' and '" // name // "_angle' for a guide that is fixed to the frame, or '" // name &
        & // "' for a guide that two joints carry"
      return
    end if
    if (data%has(name // "_point")) self%point = data%numbers(name // "_point")
    if (data%has(name // "_angle")) self%angle = data%number(name // "_angle")
  end subroutine define

  !> Sets `reason` if a number of the guide is invalid or if its two carriers are the same joint. A `reason` that is already set is
  !> kept.
  pure subroutine check(self, reason)
    class(guide_type), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    if (reason /= "") return
    call check_finite([self%angle], reason)
    call check_coordinates(self%point, reason)
    if (all(self%carriers == 0)) return
    if (reason /= "") reason = "a guide: " // reason
    if (self%carriers(1) == self%carriers(2)) reason = "the guide must be carried by two different joints"
  end subroutine check

  !> Transforms a guide that is fixed to the frame from the mechanism's axes to the machine's axes.
  pure subroutine move(self, placement)
    class(guide_type), intent(inout) :: self
    type(placement_type), intent(in) :: placement

    if (any(self%carriers /= 0)) return
    self%point = placement%point(self%point)
    self%angle = self%angle + placement%angle
  end subroutine move

  !> Computes the guide's point and its unit direction at one crank angle, from the points of the joints.
  pure subroutine line(self, points, origin, along)
    class(guide_type), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: origin, along
    type(point_type) :: e

    if (all(self%carriers == 0)) then
      origin = point_type(jet(self%point(1)), jet(self%point(2)))
      along = point_type(jet(cos(self%angle)), jet(sin(self%angle)))
      return
    end if
    e = direction(points(self%carriers(1)), points(self%carriers(2)))
    origin = carried(points(self%carriers(1)), e, self%point(1), self%point(2))
    along = carried(point_type(), e, cos(self%angle), sin(self%angle))
  end subroutine line

  !> Computes the guide's point and its unit direction at a batch of crank angles, from the paths of the joints.
  pure subroutine trace(self, points, origin, along)
    class(guide_type), intent(in) :: self
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: origin, along
    type(path_type) :: e

    if (all(self%carriers == 0)) then
      call set_fixed(self%point, origin)
      call set_fixed([cos(self%angle), sin(self%angle)], along)
      return
    end if
    call find_direction(points(self%carriers(1)), points(self%carriers(2)), e)
    call carry(points(self%carriers(1)), e, self%point(1), self%point(2), origin)
    call turn(e, self%angle, along)
  end subroutine trace

  !> Bounds on the guide's motion while the crank turns by at most `half_width` (rad) to either side of the middle of an interval.
  !> `points`: positions of the joints in the middle. `speeds`, `accelerations`: bounds for the joints.
  pure function motion(self, points, speeds, accelerations, half_width)
    class(guide_type), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(guide_motion_type) :: motion
    real(dp) :: apart

    if (all(self%carriers == 0)) return
    associate (one => points(self%carriers(1)), two => points(self%carriers(2)), v => sum(speeds(self%carriers)))
      apart = hypot(two%x%v - one%x%v, two%y%v - one%y%v) - slack * v * half_width
      motion%sound = apart > 0
      if (.not. motion%sound) return
      motion%turning = v / apart
      motion%angle_scale = turning_scale(one, two)
      motion%speed = speeds(self%carriers(1)) + norm2(self%point) * motion%turning
      motion%turning_change = (sum(accelerations(self%carriers)) + 2 * motion%turning * v) / apart
      motion%acceleration = accelerations(self%carriers(1)) + norm2(self%point) * (motion%turning_change + motion%turning**2)
    end associate
  end function motion

  !> Intersection of the lines g1 + s u1 and g2 + t u2, with s = (g2 - g1) x u2 / (u1 x u2).
  pure type(point_type) function crossing(g1, u1, g2, u2)
    !> A point g and the unit direction u of each line
    type(point_type), intent(in) :: g1, u1, g2, u2
    type(jet) :: s

    s = cross(point_type(g2%x - g1%x, g2%y - g1%y), u2) / cross(u1, u2)
    crossing = point_type(g1%x + s * u1%x, g1%y + s * u1%y)
  end function crossing

  !> Computes the intersection r = g + s u of two moving lines g + s u and h + t w at a batch of crank angles. s, s' and s'' follow
  !> from (r - h) x w = 0 and its derivatives,
  !>
  !>     r' = g' + s u' + s' u,                 (r' - h') x w + (r - h) x w' = 0,
  !>     r'' = g'' + s u'' + 2 s' u' + s'' u,   (r'' - h'') x w + 2 (r' - h') x w' + (r - h) x w'' = 0.
  pure subroutine intersect_lines(g, u, h, w, here)
    !> A point (`g`, `h`) and the unit direction (`u`, `w`) of each line
    type(path_type), intent(in) :: g, u, h, w
    type(path_type), intent(out) :: here
    real(dp) :: sine, s, s1, s2, x, y, vx, vy, ax, ay
    integer :: k

    do k = 1, batch
      sine = u%x(k) * w%y(k) - u%y(k) * w%x(k)
      s = ((h%x(k) - g%x(k)) * w%y(k) - (h%y(k) - g%y(k)) * w%x(k)) / sine
      x = g%x(k) + s * u%x(k)
      y = g%y(k) + s * u%y(k)
      vx = g%vx(k) + s * u%vx(k)
      vy = g%vy(k) + s * u%vy(k)
      s1 = ((h%vx(k) - vx) * w%y(k) - (h%vy(k) - vy) * w%x(k) + (h%x(k) - x) * w%vy(k) - (h%y(k) - y) * w%vx(k)) / sine
      vx = vx + s1 * u%x(k)
      vy = vy + s1 * u%y(k)
      ax = g%ax(k) + s * u%ax(k) + 2 * s1 * u%vx(k)
      ay = g%ay(k) + s * u%ay(k) + 2 * s1 * u%vy(k)
      s2 = ((h%ax(k) - ax) * w%y(k) - (h%ay(k) - ay) * w%x(k) + 2 * ((h%vx(k) - vx) * w%vy(k) - (h%vy(k) - vy) * w%vx(k)) &
        & + (h%x(k) - x) * w%ay(k) - (h%y(k) - y) * w%ax(k)) / sine
      here%x(k) = x
      here%y(k) = y
      here%vx(k) = vx
      here%vy(k) = vy
      here%ax(k) = ax + s2 * u%x(k)
      here%ay(k) = ay + s2 * u%y(k)
    end do
  end subroutine intersect_lines

  !> True if two lines at this angle (rad) to each other count as parallel: the sine of the angle is below 1e-9 in modulus.
  pure logical function parallel(angle)
    real(dp), intent(in) :: angle

    parallel = abs(sin(angle)) < 1.0e-9_dp
  end function parallel

end module gestell_model_joints_guide
