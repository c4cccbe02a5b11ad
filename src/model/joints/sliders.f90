!> The dyads with two sliding pairs: two sliders that turn against each other, and the yoke.
module gestell_model_joints_sliders
  use gestell_math_jet, only: cos, jet, operator(*), operator(+), operator(-), operator(/), sin
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: fixed
  use gestell_model_joints_guide, only: cross, dot, guide_motion_type, guide_type
  use gestell_model_joints_joint, only: fitness_type, greatest_change, joint_type, point_type, reach_type, steady
  use gestell_model_joints_path, only: batch, path_type, turn
  implicit none (type, external)
  private

  !> The joint of two sliders, each on its guide: where the guides cross.
  type, extends(joint_type), public :: prp_joint
    type(guide_type) :: guides(2)
  contains
    procedure :: place => place_prp
    procedure :: trace => trace_prp
    procedure :: reach => reach_prp
    procedure :: fitness => fitness_prp
    procedure :: explain => explain_prp
  end type prp_joint

  !> The yoke: it slides along `guide` and has a straight slot at `slot_angle` (rad) to the guide's direction, in which
  !> joint `end` slides. The joint is the point of the yoke where the slot crosses the guide.
  type, extends(joint_type), public :: rpp_joint
    integer :: end = 0
    type(guide_type) :: guide
    real(dp) :: slot_angle = 0
  contains
    procedure :: place => place_rpp
    procedure :: trace => trace_rpp
    procedure :: reach => reach_rpp
    procedure :: fitness => fitness_rpp
    procedure :: explain => explain_rpp
  end type rpp_joint

contains

  !> g1 + s u1 = g2 + t u2: s = (g2 - g1) x u2 / (u1 x u2).
  pure subroutine place_prp(self, crank_angle, points, here)
    class(prp_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: g1, u1, g2, u2

    associate (unused => crank_angle)
    end associate
    call self%guides(1)%line(points, g1, u1)
    call self%guides(2)%line(points, g2, u2)
    here = crossing(g1, u1, g2, u2)
  end subroutine place_prp

  pure type(point_type) function crossing(g1, u1, g2, u2)
    type(point_type), intent(in) :: g1, u1, g2, u2
    type(jet) :: s

    s = cross(point_type(g2%x - g1%x, g2%y - g1%y), u2) / cross(u1, u2)
    crossing = point_type(g1%x + s * u1%x, g1%y + s * u1%y)
  end function crossing

  !> The slot is a line through `end` at a fixed angle to the guide.
  pure subroutine place_rpp(self, crank_angle, points, here)
    class(rpp_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: g, u, w

    associate (unused => crank_angle)
    end associate
    call self%guide%line(points, g, u)
    associate (c => cos(self%slot_angle), s => sin(self%slot_angle))
      w = point_type(c * u%x - s * u%y, c * u%y + s * u%x)
    end associate
    here = crossing(g, u, points(self%end), w)
  end subroutine place_rpp

  pure subroutine trace_prp(self, angles, points, here)
    class(prp_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: g1, u1, g2, u2

    associate (unused => angles)
    end associate
    call self%guides(1)%trace(points, g1, u1)
    call self%guides(2)%trace(points, g2, u2)
    call meet(g1, u1, g2, u2, here)
  end subroutine trace_prp

  pure subroutine trace_rpp(self, angles, points, here)
    class(rpp_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: g, u, slot

    associate (unused => angles)
    end associate
    call self%guide%trace(points, g, u)
    call turn(u, self%slot_angle, slot)
    call meet(g, u, points(self%end), slot, here)
  end subroutine trace_rpp

  !> The crossing r = g + s u of two lines: s, s' and s'' from (r - h) x w = 0, differentiated,
  !>
  !>     r' = g' + s u' + s' u,                 (r' - h') x w + (r - h) x w' = 0,
  !>     r'' = g'' + s u'' + 2 s' u' + s'' u,   (r'' - h'') x w + 2 (r' - h') x w' + (r - h) x w'' = 0.
  pure subroutine meet(g, u, h, w, here)
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
  end subroutine meet

  !> The sine of the guides' angle loses at most (omega_1 + omega_2) half_width, or less where its derivative in the middle is
  !> small: its second is at most omega_1' + omega_2' + (omega_1 + omega_2)^2. Each guide fixes the joint's velocity
  !> across itself to v_g + omega |r - g|, where |r - g| grows while the joint moves with at most V: what bounds V is
  !>
  !>     V sin <= sum over the guides of v_g + omega (|r - g| + (V + v_g) half_width).
  pure function reach_prp(self, points, speeds, accelerations, half_width) result(reach)
    class(prp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach
    type(guide_motion_type) :: motion
    type(point_type) :: g(2), u(2), here
    type(jet) :: sine
    real(dp) :: turning, bend, left, across, distance
    integer :: i

    turning = 0
    bend = 0
    do i = 1, 2
      motion = self%guides(i)%motion(points, speeds, accelerations, half_width)
      reach%assembled = motion%sound
      if (.not. reach%assembled) return
      turning = turning + motion%turning
      bend = bend + motion%turning_change
      call self%guides(i)%line(points, g(i), u(i))
    end do
    sine = cross(u(1), u(2))
    left = abs(sine%v) - 2 * greatest_change(turning, sine%d, bend + turning**2, half_width)
    ! Closer to parallel `crossing` has lost half its digits.
    reach%assembled = left > max(sqrt(epsilon(left)), steady * abs(sine%v))
    if (.not. reach%assembled) return
    here = crossing(g(1), u(1), g(2), u(2))
    across = 0
    do i = 1, 2
      motion = self%guides(i)%motion(points, speeds, accelerations, half_width)
      across = across + motion%speed &
        & + motion%turning * (hypot(here%x%v - g(i)%x%v, here%y%v - g(i)%y%v) + motion%speed * half_width)
    end do
    reach%speed = across / left
    across = 0
    do i = 1, 2
      motion = self%guides(i)%motion(points, speeds, accelerations, half_width)
      distance = hypot(here%x%v - g(i)%x%v, here%y%v - g(i)%y%v) + (reach%speed + motion%speed) * half_width
      across = across + motion%acceleration + distance * motion%turning_change &
        & + 2 * motion%turning * (reach%speed + motion%speed + motion%turning * distance)
    end do
    reach%acceleration = across / left
    if (turning > 0) reach%feature = abs(sine%v) / turning
  end function reach_prp

  !> In the guide's own system the slot hands `end`'s velocity on, divided by the sine of the slot's angle.
  pure function reach_rpp(self, points, speeds, accelerations, half_width) result(reach)
    class(rpp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach
    type(guide_motion_type) :: motion
    type(point_type) :: g, u
    real(dp) :: apart, sine, sliding, dragged, in_slot

    motion = self%guide%motion(points, speeds, accelerations, half_width)
    sine = abs(sin(self%slot_angle))
    reach%assembled = motion%sound .and. sine > sqrt(epsilon(sine))
    if (.not. reach%assembled) return
    call self%guide%line(points, g, u)
    associate (end => points(self%end))
      apart = hypot(end%x%v - g%x%v, end%y%v - g%y%v) + (speeds(self%end) + motion%speed) * half_width
    end associate
    sliding = (speeds(self%end) + motion%speed + motion%turning * apart) / sine
    reach%speed = motion%speed + motion%turning * apart / sine + sliding
    dragged = motion%acceleration + 2 * sliding * motion%turning &
      & + apart / sine * (motion%turning_change + motion%turning**2)
    in_slot = speeds(self%end) + reach%speed + motion%turning * apart / sine
    reach%acceleration = dragged + (accelerations(self%end) + dragged + 2 * in_slot * motion%turning &
      & + apart / sine * motion%turning_change) / sine
    reach%feature = motion%feature
  end function reach_rpp

  !> The transmission angle is the one between the guides; the travel that on the first.
  pure function fitness_prp(self, points, here) result(fitness)
    class(prp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(fitness_type) :: fitness
    type(point_type) :: g1, u1, g2, u2
    type(jet) :: sine, s

    call self%guides(1)%line(points, g1, u1)
    call self%guides(2)%line(points, g2, u2)
    sine = cross(u1, u2)
    s = dot(point_type(here%x - g1%x, here%y - g1%y), u1)
    fitness = fitness_type(transmission=sign(1.0_dp, sine%v) * sine, slides=.true., travel=s)
  end function fitness_prp

  !> The transmission angle is that of the slot.
  pure function fitness_rpp(self, points, here) result(fitness)
    class(rpp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(fitness_type) :: fitness
    type(point_type) :: g, u
    type(jet) :: s

    call self%guide%line(points, g, u)
    s = dot(point_type(here%x - g%x, here%y - g%y), u)
    fitness = fitness_type(transmission=jet(v=abs(sin(self%slot_angle))), slides=.true., travel=s)
  end function fitness_rpp

  pure subroutine explain_prp(self, points, text)
    class(prp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text

    associate (unused_self => self, unused_points => points)
    end associate
    text = "its guides become parallel, or the joints that carry one of them meet"
  end subroutine explain_prp

  pure subroutine explain_rpp(self, points, text)
    class(rpp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text

    associate (unused => points)
    end associate
    text = "its slot, at " // fixed(self%slot_angle * 180 / pi, 3) // " deg to the guide, is parallel to it, or the " &
      & // "joints that carry the guide meet"
  end subroutine explain_rpp

end module gestell_model_joints_sliders
