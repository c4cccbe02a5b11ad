!> A joint and a mechanism as a user writes them: with what they must have, and nothing for speed.
module user_mechanisms
  use gestell_math_jet, only: cos, jet, operator(*), operator(+), sin
  use gestell_base_kinds, only: dp
  use gestell_model_joints_joint, only: joint_type, point_type, reach_type
  use gestell_model_mechanism, only: mass_functions_type, mechanism_type
  implicit none (type, external)
  private

  !> A point that turns with the crank about another joint.
  type, extends(joint_type), public :: handle_joint
    integer :: pivot = 0
    real(dp) :: radius = 0
  contains
    procedure :: place
    procedure :: reach
  end type handle_joint

  !> A point that stands still and is sure of it within this angle (rad) only.
  type, extends(joint_type), public :: timid_joint
    real(dp) :: sure = 0
  contains
    procedure :: place => place_timid
    procedure :: reach => reach_timid
  end type timid_joint

  !> a1 = cos phi, a2 = 2 sin phi, a3 = 5 + cos 2 phi, a4 = sin 3 phi.
  type, extends(mechanism_type), public :: pendulum_type
  contains
    procedure :: mass_functions
  end type pendulum_type

contains

  pure subroutine place(self, crank_angle, points, here)
    class(handle_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here

    here%x = points(self%pivot)%x + self%radius * cos(jet(crank_angle, 1.0_dp, 0.0_dp))
    here%y = points(self%pivot)%y + self%radius * sin(jet(crank_angle, 1.0_dp, 0.0_dp))
  end subroutine place

  pure function reach(self, points, speeds, accelerations, half_width)
    class(handle_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_points => points, unused_width => half_width)
    end associate
    reach%speed = speeds(self%pivot) + self%radius
    reach%acceleration = accelerations(self%pivot) + self%radius
  end function reach

  pure subroutine place_timid(self, crank_angle, points, here)
    class(timid_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here

    associate (unused => self, unused_angle => crank_angle, unused_points => points)
      here = point_type()
    end associate
  end subroutine place_timid

  pure function reach_timid(self, points, speeds, accelerations, half_width) result(reach)
    class(timid_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_points => points, unused_speeds => speeds, unused => accelerations)
      reach%assembled = half_width < self%sure
    end associate
  end function reach_timid

  subroutine mass_functions(self, crank_angle, a)
    class(pendulum_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(mass_functions_type), intent(out) :: a

    associate (unused => self, phi => crank_angle)
      a%a1 = jet(cos(phi), -sin(phi), -cos(phi))
      a%a2 = jet(2 * sin(phi), 2 * cos(phi), -2 * sin(phi))
      a%a3 = jet(5 + cos(2 * phi), -2 * sin(2 * phi), -4 * cos(2 * phi))
      a%a4 = sin(3 * phi)
    end associate
  end subroutine mass_functions

end module user_mechanisms
