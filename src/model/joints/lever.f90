!> Joints on a body whose direction two earlier joints give: the slotted lever and the rigid body's point.
module gestell_model_joints_lever
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-), sqrt
  use gestell_base_kinds, only: dp
  use gestell_model_joints_guide, only: direction
  use gestell_model_joints_joint, only: fitness_type, joint_type, point_type, reach_type, slack
  use gestell_model_joints_path, only: batch, carry, find_direction, path_type
  implicit none (type, external)
  private

  !> The dyad of turning pair, slider and turning pair: the lever turns about joint `ends(2)`, its slot passes through
  !> joint `ends(1)`. The joint lies on it at `length` (m) from `ends(2)`, toward `ends(1)` (`branch` = 1) or away (-1).
  type, extends(joint_type), public :: rpr_joint
    integer :: ends(2) = 0
    real(dp) :: length = 0
    integer :: branch = 1
  contains
    procedure :: place => place_rpr
    procedure :: trace => trace_rpr
    procedure :: reach => reach_rpr
    procedure :: fitness => fitness_rpr
    procedure :: explain => explain_rpr
  end type rpr_joint

  !> A point of the body that carries joints `ends(1)` and `ends(2)`: from `ends(1)` by `offset(1)` (m) toward `ends(2)`
  !> and by `offset(2)` across, to the left.
  type, extends(joint_type), public :: rigid_joint
    integer :: ends(2) = 0
    real(dp) :: offset(2) = 0
  contains
    procedure :: place => place_rigid
    procedure :: trace => trace_rigid
    procedure :: reach => reach_rigid
    procedure :: explain => explain_rigid
  end type rigid_joint

contains

  pure subroutine place_rpr(self, crank_angle, points, here)
    class(rpr_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: e

    associate (unused => crank_angle)
    end associate
    e = direction(points(self%ends(2)), points(self%ends(1)))
    here%x = points(self%ends(2))%x + self%branch * self%length * e%x
    here%y = points(self%ends(2))%y + self%branch * self%length * e%y
  end subroutine place_rpr

  pure subroutine place_rigid(self, crank_angle, points, here)
    class(rigid_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: e

    associate (unused => crank_angle)
    end associate
    e = direction(points(self%ends(1)), points(self%ends(2)))
    here%x = points(self%ends(1))%x + self%offset(1) * e%x - self%offset(2) * e%y
    here%y = points(self%ends(1))%y + self%offset(1) * e%y + self%offset(2) * e%x
  end subroutine place_rigid

  pure subroutine trace_rpr(self, angles, points, here)
    class(rpr_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: u

    associate (unused => angles)
    end associate
    call find_direction(points(self%ends(2)), points(self%ends(1)), u)
    call carry(points(self%ends(2)), u, self%branch * self%length, 0.0_dp, here)
  end subroutine trace_rpr

  pure subroutine trace_rigid(self, angles, points, here)
    class(rigid_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: u

    associate (unused => angles)
    end associate
    call find_direction(points(self%ends(1)), points(self%ends(2)), u)
    call carry(points(self%ends(1)), u, self%offset(1), self%offset(2), here)
  end subroutine trace_rigid

  pure function reach_rpr(self, points, speeds, accelerations, half_width) result(reach)
    class(rpr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    reach = reach_body(points(self%ends), speeds(self%ends), accelerations(self%ends), half_width, 2, self%length)
  end function reach_rpr

  pure function reach_rigid(self, points, speeds, accelerations, half_width) result(reach)
    class(rigid_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    reach = reach_body(points(self%ends), speeds(self%ends), accelerations(self%ends), half_width, 1, norm2(self%offset))
  end function reach_rigid

  !> A point at `arm` from end number `base`. The direction turns with at most the sum of the ends' speeds over their
  !> distance d, which must not vanish; its turning omega changes by e_perp . (a2 - a1) / d - 2 omega d' / d.
  pure function reach_body(ends, speeds, accelerations, half_width, base, arm) result(reach)
    type(point_type), intent(in) :: ends(2)
    real(dp), intent(in) :: speeds(2), accelerations(2), half_width, arm
    integer, intent(in) :: base
    type(reach_type) :: reach
    real(dp) :: apart, turning, change

    apart = hypot(ends(2)%x%v - ends(1)%x%v, ends(2)%y%v - ends(1)%y%v)
    reach%assembled = apart > slack * sum(speeds) * half_width
    if (.not. reach%assembled) return
    turning = sum(speeds) / (apart - slack * sum(speeds) * half_width)
    change = (sum(accelerations) + 2 * turning * sum(speeds)) / (apart - slack * sum(speeds) * half_width)
    reach%speed = speeds(base) + arm * turning
    reach%acceleration = accelerations(base) + arm * (change + turning**2)
    if (sum(speeds) > 0) reach%feature = apart / sum(speeds)
  end function reach_body

  !> A dead point is where the joint in the slot meets the lever's pivot.
  pure function fitness_rpr(self, points, here) result(fitness)
    class(rpr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(fitness_type) :: fitness
    type(jet) :: ex, ey

    associate (unused => here, one => points(self%ends(1)), two => points(self%ends(2)))
      ex = two%x - one%x
      ey = two%y - one%y
      fitness%margin = sqrt(ex * ex + ey * ey)
    end associate
  end function fitness_rpr

  pure subroutine explain_rpr(self, points, text)
    class(rpr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text

    associate (unused_self => self, unused_points => points)
    end associate
    text = "the joint in the slot meets the lever's pivot"
  end subroutine explain_rpr

  pure subroutine explain_rigid(self, points, text)
    class(rigid_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text

    associate (unused_self => self, unused_points => points)
    end associate
    text = "the two joints of its body meet"
  end subroutine explain_rigid

end module gestell_model_joints_lever
