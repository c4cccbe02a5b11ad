!> The joint type ground: a joint that is fixed to the frame.
module gestell_model_joints_types_ground
  use gestell_base_key, only: key_type, of_length, real_key
  use gestell_base_kinds, only: dp
  use gestell_math_jet, only: jet
  use gestell_model_joints_data, only: check_coordinates, joint_data_type
  use gestell_model_joints_joint, only: form_type, joint_type, point_type, reach_type
  use gestell_model_joints_path, only: batch, set_fixed, path_type
  use gestell_model_joints_placement, only: placement_type
  implicit none (type, external)
  private

  type(key_type), parameter :: keys(*) = [key_type("joint", "position", real_key, "position of the joint on the frame; " // &
    &   "coordinates x and y", 1, 2, 2, required=.true., unit=of_length)]

  !> A joint at a point that is fixed to the frame.
  type, extends(joint_type), public :: ground_joint
    real(dp) :: position(2) = 0
  contains
    procedure :: describe, define, check, move, locate, trace, reach
  end type ground_joint

contains

  pure subroutine describe(self, form)
    class(ground_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("ground", "joint fixed to the frame", links=0, pairs=0, keys=keys)
    associate (unused => self)
    end associate
  end subroutine describe

  pure subroutine define(self, data)
    class(ground_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    self%position = data%numbers("position")
  end subroutine define

  pure subroutine check(self, reason)
    class(ground_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call check_coordinates(self%position, reason)
  end subroutine check

  pure subroutine move(self, placement)
    class(ground_joint), intent(inout) :: self
    type(placement_type), intent(in) :: placement

    self%position = placement%point(self%position)
  end subroutine move

  pure subroutine locate(self, crank_angle, points, here)
    class(ground_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here

    associate (unused_angle => crank_angle, unused_points => points)
    end associate
    here = point_type(jet(self%position(1)), jet(self%position(2)))
  end subroutine locate

  pure subroutine trace(self, angles, points, here)
    class(ground_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here

    associate (unused_angles => angles, unused_points => points)
    end associate
    call set_fixed(self%position, here)
  end subroutine trace

  pure function reach(self, points, speeds, accelerations, half_width)
    class(ground_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_self => self, unused_points => points, unused_speeds => speeds, &
      & unused_accelerations => accelerations, unused_width => half_width)
    end associate
    reach = reach_type()
  end function reach

end module gestell_model_joints_types_ground
