!> The dyad RPP: a yoke that slides on a guide while a joint slides in its slot.
module gestell_model_joints_types_rpp
  use gestell_base_key, only: key_type, of_angle, real_key
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: fixed
  use gestell_math_jet, only: jet, operator(-)
  use gestell_model_joints_data, only: check_finite, joint_data_type
  use gestell_model_joints_guide, only: crossing, guide_keys, guide_motion_type, guide_type, intersect_lines, parallel
  use gestell_model_joints_joint, only: form_type, itself, guided_joint, one_end, point_type, reach_type, transmission_type
  use gestell_model_joints_pairs, only: pair_type, pin, slide, slot
  use gestell_model_joints_path, only: batch, carried, dot, path_type, turn
  implicit none (type, external)
  private

  type(key_type), parameter :: slot_key = key_type("joint", "slot_angle", real_key, "angle from the guide to the yoke's slot", &
    & required=.true., unit=of_angle)

  !> The yoke slides along `guide`. Joint `end` slides in its straight slot, which makes the angle `slot_angle` (rad) with the
  !> guide's direction. The joint is the point of the yoke where slot and guide intersect.
  type, extends(guided_joint), public :: rpp_joint
    integer :: end = 0
    real(dp) :: slot_angle = 0
  contains
    procedure :: describe, define, check, locate, trace, reach, transmission, explain, pairs
  end type rpp_joint

contains

  pure subroutine describe(self, form)
    class(rpp_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("RPP", "yoke on a guide. The joint `ends(1)` slides in the yoke's slot; the angle from guide to slot is " // &
      &   "`slot_angle` (90 deg for a Scotch yoke). The joint is the intersection of slot and guide", &
      & links=2, pairs=3, keys=[one_end, slot_key, guide_keys], bars=[self%end, itself], guides=[self%guide])
  end subroutine describe

  !> The new bodies are the yoke on its guide, and the block on the pin `end` in its slot.
  pure subroutine pairs(self, number, list)
    class(rpp_joint), intent(in) :: self
    integer, intent(in) :: number
    type(pair_type), allocatable, intent(out) :: list(:)

    list = [pair_type(slide, 1, number, self%guide), pair_type(pin, 2, self%end), &
      & pair_type(slot, 2, self%end, guide_type(self%guide%carriers, self%guide%point, self%guide%angle + self%slot_angle), &
      & against=1)]
  end subroutine pairs

  pure subroutine define(self, data)
    class(rpp_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    self%end = sum(data%joints("ends"))
    self%slot_angle = data%number("slot_angle")
    call self%guide%define(data, "guide")
    if (data%reason /= "" .or. .not. parallel(self%slot_angle)) return
    data%key = "slot_angle"
    data%reason = "the slot is parallel to the guide"
  end subroutine define

  pure subroutine check(self, reason)
    class(rpp_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call self%guide%check(reason)
    call check_finite([self%slot_angle], reason)
  end subroutine check

  !> Computes the joint's position as the intersection of guide and slot. The slot is a line through `end` at a fixed angle to the
  !> guide.
  pure subroutine locate(self, crank_angle, points, here)
    class(rpp_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: g, u

    associate (unused => crank_angle)
    end associate
    call self%guide%line(points, g, u)
    here = crossing(g, u, points(self%end), carried(point_type(), u, cos(self%slot_angle), sin(self%slot_angle)))
  end subroutine locate

  pure subroutine trace(self, angles, points, here)
    class(rpp_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: g, u, slot

    associate (unused => angles)
    end associate
    call self%guide%trace(points, g, u)
    call turn(u, self%slot_angle, slot)
    call intersect_lines(g, u, points(self%end), slot, here)
  end subroutine trace

  !> Bounds on the joint's motion. Relative to the guide, the speed of the yoke is at most the speed of `end` divided by the sine of
  !> the slot's angle.
  pure function reach(self, points, speeds, accelerations, half_width)
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
    dragged = motion%acceleration + 2 * sliding * motion%turning + apart / sine * (motion%turning_change + motion%turning**2)
    in_slot = speeds(self%end) + reach%speed + motion%turning * apart / sine
    reach%acceleration = dragged + (accelerations(self%end) + dragged + 2 * in_slot * motion%turning &
      & + apart / sine * motion%turning_change) / sine
    reach%angle_scale = motion%angle_scale
  end function reach

  !> Quality of the transmission. The transmission angle is the angle between slot and guide.
  pure function transmission(self, points, here)
    class(rpp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(transmission_type) :: transmission
    type(point_type) :: g, u

    call self%guide%line(points, g, u)
    transmission = transmission_type(sine=jet(v=abs(sin(self%slot_angle))), slides=.true., &
      & travel=dot(point_type(here%x - g%x, here%y - g%y), u))
  end function transmission

  pure subroutine explain(self, points, text)
    class(rpp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text

    associate (unused => points)
    end associate
    text = "the slot, at " // fixed(self%slot_angle * 180 / pi, 3) // " deg to the guide, is parallel to the guide, or the " &
      & // "two joints that carry the guide coincide"
  end subroutine explain

end module gestell_model_joints_types_rpp
