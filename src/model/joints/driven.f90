!> The joints that need no assembly: fixed to the frame, and carried by the crank.
module gestell_model_joints_driven
  use gestell_base_jet, only: cos, jet, operator(*), operator(+), sin
  use gestell_base_kinds, only: dp
  use gestell_model_joints_joint, only: joint_type, point_type, reach_type
  implicit none (type, external)
  private

  !> A point fixed to the frame.
  type, extends(joint_type), public :: ground_joint
    real(dp) :: position(2) = 0
  contains
    procedure :: place => place_ground
    procedure :: reach => reach_ground
  end type ground_joint

  !> A point that turns about the joint `pivot`, at `radius` (m) and the crank angle + `phase` (rad).
  type, extends(joint_type), public :: crank_joint
    integer :: pivot = 0
    real(dp) :: radius = 0, phase = 0
  contains
    procedure :: place => place_crank
    procedure :: reach => reach_crank
  end type crank_joint

contains

  pure subroutine place_ground(self, crank_angle, points, here)
    class(ground_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here

    associate (unused_angle => crank_angle, unused_points => points)
    end associate
    here = point_type(jet(self%position(1)), jet(self%position(2)))
  end subroutine place_ground

  pure subroutine place_crank(self, crank_angle, points, here)
    class(crank_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(jet) :: angle

    angle = jet(crank_angle + self%phase, 1.0_dp, 0.0_dp)
    here%x = points(self%pivot)%x + self%radius * cos(angle)
    here%y = points(self%pivot)%y + self%radius * sin(angle)
  end subroutine place_crank

  pure function reach_ground(self, points, speeds, accelerations, half_width) result(reach)
    class(ground_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_self => self, unused_points => points, unused_speeds => speeds, &
      & unused_accelerations => accelerations, unused_width => half_width)
    end associate
    reach = reach_type()
  end function reach_ground

  pure function reach_crank(self, points, speeds, accelerations, half_width) result(reach)
    class(crank_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_points => points, unused_width => half_width)
    end associate
    reach%speed = speeds(self%pivot) + self%radius
    reach%acceleration = accelerations(self%pivot) + self%radius
  end function reach_crank

end module gestell_model_joints_driven
