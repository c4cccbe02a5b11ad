!> The dyad RRP of a rod and a slider: the joint on a guide, at a given distance from an earlier joint.
module gestell_model_joints_types_rrp
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-), sqrt
  use gestell_model_joints_data, only: check_lengths, joint_data_type
  use gestell_model_joints_deviation, only: along_bar, deviation_type, disc, parallelogram
  use gestell_model_joints_guide, only: guide_keys, guide_motion_type, guide_type
  use gestell_model_joints_joint, only: branch_key, form_type, largest_change, itself, guided_joint, one_end, one_length, &
    & point_type, reach_type, steady, transmission_type
  use gestell_model_joints_path, only: batch, cross, dot, path_type
  implicit none (type, external)
  private

  !> A joint on `guide`, at the distance `length` (m) from joint `end`. Two points of the guide have this distance: `branch` = 1 is
  !> the point farther along the guide, `branch` = -1 the other point.
  type, extends(guided_joint), public :: rrp_joint
    integer :: end = 0
    real(dp) :: length = 0
    integer :: branch = 1
  contains
    procedure :: describe, define, check, locate, trace, reach, deviation, transmission, explain
  end type rrp_joint

contains

  pure subroutine describe(self, form)
    class(rrp_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("RRP", "slider on a guide, at the distance `lengths(1)` from `ends(1)`. `branch = 1` selects the " // &
      &   "position farther along the guide's direction, `-1` the other one", links=2, pairs=3, keys=[one_end, one_length, &
      &   branch_key, guide_keys], bars=[self%end, itself], guides=[self%guide])
  end subroutine describe

  pure subroutine define(self, data)
    class(rrp_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    self%end = sum(data%joints("ends"))
    self%length = data%number("lengths")
    self%branch = nint(data%number("branch"))
    call self%guide%define(data, "guide")
  end subroutine define

  pure subroutine check(self, reason)
    class(rrp_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call check_lengths([self%length], self%branch, reason)
    call self%guide%check(reason)
  end subroutine check

  !> Computes the joint's position on the guide g + s u: with r = end - g, s = r . u +- sqrt(l^2 - (r x u)^2).
  pure subroutine locate(self, crank_angle, points, here)
    class(rrp_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: g, u, r
    type(jet) :: off, s

    associate (unused => crank_angle)
    end associate
    call self%guide%line(points, g, u)
    r = point_type(points(self%end)%x - g%x, points(self%end)%y - g%y)
    off = cross(r, u)
    s = dot(r, u) + real(self%branch, dp) * sqrt((-1.0_dp) * (off + (-self%length)) * (off + self%length))
    here = point_type(g%x + s * u%x, g%y + s * u%y)
  end subroutine locate

  pure subroutine trace(self, angles, points, here)
    class(rrp_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: g, u

    associate (unused => angles)
    end associate
    call self%guide%trace(points, g, u)
    call hold_on_guide(points(self%end), self%length, g, u, self%branch, here)
  end subroutine trace

  !> Computes the path of the joint; `locate` gives its position. The joint moves along the guide, and the rod b = r - r_end keeps
  !> its length:
  !>
  !>     r' = g' + s u' + s' u,                 b . (r' - r_end') = 0,
  !>     r'' = g'' + s u'' + 2 s' u' + s'' u,   b . (r'' - r_end'') = -|r' - r_end'|^2,
  !>
  !> where b . u is the square root in the formula of `locate`, with its sign.
  pure subroutine hold_on_guide(end, length, g, u, branch, here)
    type(path_type), intent(in) :: end, g, u
    real(dp), intent(in) :: length
    integer, intent(in) :: branch
    type(path_type), intent(out) :: here
    real(dp) :: rx, ry, off, root, bx, by, s, s1, s2, vx, vy, ax, ay
    integer :: k

    do k = 1, batch
      rx = end%x(k) - g%x(k)
      ry = end%y(k) - g%y(k)
      off = rx * u%y(k) - ry * u%x(k)
      root = branch * sqrt((length - off) * (length + off))
      bx = root * u%x(k) - off * u%y(k)
      by = root * u%y(k) + off * u%x(k)
      s = rx * u%x(k) + ry * u%y(k) + root
      vx = g%vx(k) + s * u%vx(k)
      vy = g%vy(k) + s * u%vy(k)
      s1 = (bx * (end%vx(k) - vx) + by * (end%vy(k) - vy)) / root
      vx = vx + s1 * u%x(k)
      vy = vy + s1 * u%y(k)
      ax = g%ax(k) + s * u%ax(k) + 2 * s1 * u%vx(k)
      ay = g%ay(k) + s * u%ay(k) + 2 * s1 * u%vy(k)
      s2 = (bx * (end%ax(k) - ax) + by * (end%ay(k) - ay) - (vx - end%vx(k))**2 - (vy - end%vy(k))**2) / root
      here%x(k) = g%x(k) + s * u%x(k)
      here%y(k) = g%y(k) + s * u%y(k)
      here%vx(k) = vx
      here%vy(k) = vy
      here%ax(k) = ax + s2 * u%x(k)
      here%ay(k) = ay + s2 * u%y(k)
    end do
  end subroutine hold_on_guide

  !> Bounds on the joint's motion. The speed of the guide's point is at most v_g, and the rate of rotation of the guide at most
  !> omega; r leads from this point to `end`. The distance of `end` from the guide changes by at most v_end + v_g + omega |r| per
  !> radian. A second bound is lower if the derivative of the distance is small in the middle of the interval: the second
  !> derivative is at most a_end + a_g + 2 (v_end + v_g) omega + |r| (omega' + omega^2). The joint can be assembled if the
  !> distance remains below the length of the rod. Then the cosine c of the angle between rod and guide is positive. The rod
  !> limits the component of the slider's velocity along the rod. Hence the slider moves along the guide with a speed of at most
  !> (v_end + v_guide) / c, where v_guide is the speed of the guide at the slider.
  pure function reach(self, points, speeds, accelerations, half_width)
    class(rrp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach
    type(guide_motion_type) :: motion
    type(point_type) :: g, u, r
    type(jet) :: off
    real(dp) :: apart, rate, bend, farthest, cosine, carried, sliding, dragged

    motion = self%guide%motion(points, speeds, accelerations, half_width)
    reach%assembled = motion%sound
    if (.not. reach%assembled) return
    call self%guide%line(points, g, u)
    r = point_type(points(self%end)%x - g%x, points(self%end)%y - g%y)
    off = cross(r, u)
    apart = hypot(r%x%v, r%y%v) + (speeds(self%end) + motion%speed) * half_width
    rate = speeds(self%end) + motion%speed + motion%turning * apart
    bend = accelerations(self%end) + motion%acceleration + 2 * (speeds(self%end) + motion%speed) * motion%turning &
      & + apart * (motion%turning_change + motion%turning**2)
    farthest = abs(off%v) + largest_change(rate, off%d, bend, half_width)
    reach%assembled = farthest < self%length
    if (.not. reach%assembled) return
    cosine = cosine_at(farthest)
    ! Closer to a dead point `locate` loses half its digits.
    reach%assembled = cosine > max(1.0e-6_dp, steady * cosine_at(abs(off%v)))
    if (.not. reach%assembled) return
    carried = motion%speed + motion%turning * (apart + self%length)
    sliding = (speeds(self%end) + carried) / cosine
    reach%speed = carried + sliding
    dragged = motion%acceleration + 2 * sliding * motion%turning &
      & + (apart + self%length) * (motion%turning_change + motion%turning**2)
    reach%acceleration = dragged + (accelerations(self%end) + dragged + (reach%speed + speeds(self%end))**2 / self%length) / cosine
    reach%angle_scale = motion%angle_scale
    if (rate > 0) reach%angle_scale = min(motion%angle_scale, cosine_at(abs(off%v)) * sqrt(self%length / rate))

  contains

    pure real(dp) function cosine_at(distance)
      real(dp), intent(in) :: distance

      cosine_at = sqrt((1 - distance / self%length) * (1 + distance / self%length))
    end function cosine_at

  end function reach

  !> Deviation of the acceleration. On a fixed guide it has no component perpendicular to the guide. It is computed twice: first
  !> with the bound on the acceleration as radius, then with the smaller radius that results.
  pure function deviation(self, points, here, deviations, acceleration, half_width)
    class(rrp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(deviation_type), intent(in) :: deviations(:)
    real(dp), intent(in) :: acceleration, half_width
    type(deviation_type) :: deviation
    real(dp) :: radius, directions(2, 2), bounds(2)
    integer :: round

    radius = acceleration + hypot(here%x%dd, here%y%dd)
    deviation = disc(radius)
    if (any(self%guide%carriers /= 0)) return
    directions(:, 2) = [-sin(self%guide%angle), cos(self%guide%angle)]
    bounds(2) = 0
    do round = 1, 2
      call along_bar(points(self%end), here, deviations(self%end), radius, half_width, directions(:, 1), bounds(1))
      deviation = parallelogram(directions, bounds)
      radius = min(radius, deviation%radius())
    end do
  end function deviation

  !> Quality of the transmission. At a dead point the rod is perpendicular to the guide.
  pure function transmission(self, points, here)
    class(rrp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(transmission_type) :: transmission
    type(point_type) :: g, u, r
    type(jet) :: off, square

    call self%guide%line(points, g, u)
    r = point_type(points(self%end)%x - g%x, points(self%end)%y - g%y)
    off = cross(r, u)
    transmission = transmission_type(sine=jet(), margin=(-sign(1.0_dp, off%v)) * off + self%length, slides=.true., &
      & travel=dot(point_type(here%x - g%x, here%y - g%y), u))
    ! the cosine of the angle between rod and guide; zero if the rod does not reach the guide
    square = transmission%margin * (sign(1.0_dp, off%v) * off + self%length)
    if (square%v > 0) transmission%sine = (1 / self%length) * sqrt(square)
  end function transmission

  pure subroutine explain(self, points, text)
    class(rrp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text
    type(guide_motion_type) :: motion
    type(point_type) :: g, u
    type(jet) :: off

    motion = self%guide%motion(points, spread(0.0_dp, 1, size(points)), spread(0.0_dp, 1, size(points)), 0.0_dp)
    text = "the two joints that carry the guide coincide"
    if (.not. motion%sound) return
    call self%guide%line(points, g, u)
    off = cross(point_type(points(self%end)%x - g%x, points(self%end)%y - g%y), u)
    text = "the joint 'ends(1)' is " // concise(abs(off%v)) // " m away from the guide; the link's length of " // &
      & concise(self%length) // " m must exceed this distance"
  end subroutine explain

end module gestell_model_joints_types_rrp
