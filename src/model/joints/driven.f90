!> The joints that need no assembly: fixed to the frame, and carried by the crank.
module gestell_model_joints_driven
  use gestell_math_circle, only: circle
  use gestell_math_jet, only: cos, jet, operator(*), operator(+), sin
  use gestell_base_kinds, only: dp
  use gestell_model_joints_joint, only: joint_type, point_type, reach_type
  use gestell_model_joints_path, only: batch, keep, path_type
  implicit none (type, external)
  private

  !> A point fixed to the frame.
  type, extends(joint_type), public :: ground_joint
    real(dp) :: position(2) = 0
  contains
    procedure :: place => place_ground
    procedure :: trace => trace_ground
    procedure :: reach => reach_ground
  end type ground_joint

  !> A point that turns about the joint `pivot`, at `radius` (m) and the crank angle + `phase` (rad).
  type, extends(joint_type), public :: crank_joint
    integer :: pivot = 0
    real(dp) :: radius = 0, phase = 0
  contains
    procedure :: place => place_crank
    procedure :: trace => trace_crank
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

  pure subroutine trace_ground(self, angles, points, here)
    class(ground_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here

    associate (unused_angles => angles, unused_points => points)
    end associate
    call keep(self%position, here)
  end subroutine trace_ground

  pure subroutine trace_crank(self, angles, points, here)
    class(crank_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    real(dp) :: c(batch), s(batch)

    call circle(angles + self%phase, c, s)
    call turn_about(points(self%pivot), self%radius, c, s, here)
  end subroutine trace_crank

  pure subroutine turn_about(pivot, radius, c, s, here)
    type(path_type), intent(in) :: pivot
    real(dp), intent(in) :: radius, c(batch), s(batch)
    type(path_type), intent(out) :: here
    integer :: k

    do k = 1, batch
      here%x(k) = pivot%x(k) + radius * c(k)
      here%y(k) = pivot%y(k) + radius * s(k)
      here%vx(k) = pivot%vx(k) - radius * s(k)
      here%vy(k) = pivot%vy(k) + radius * c(k)
      here%ax(k) = pivot%ax(k) - radius * c(k)
      here%ay(k) = pivot%ay(k) - radius * s(k)
    end do
  end subroutine turn_about

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
