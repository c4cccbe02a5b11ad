!> A point of the body that carries two earlier joints.
module gestell_model_joints_types_rigid
  use gestell_base_key, only: key_type, of_length, real_key
  use gestell_base_kinds, only: dp
  use gestell_model_joints_data, only: check_coordinates, joint_data_type
  use gestell_model_joints_deviation, only: deviation_type, of_body
  use gestell_model_joints_joint, only: form_type, itself, joint_type, point_type, reach_type, slack, two_ends
  use gestell_model_joints_path, only: batch, carried, carry, direction, find_direction, path_type
  implicit none (type, external)
  private

  type(key_type), parameter :: offset_key = key_type("joint", "offset", real_key, "two distances from `ends(1)`: along the " // &
    &   "line to `ends(2)`, and perpendicular to it (positive to the left)", 1, 2, 2, required=.true., unit=of_length)

  !> A point of the body that carries joints `ends(1)` and `ends(2)`. The point is at the distance `offset(1)` from `ends(1)` toward
  !> `ends(2)`, and at the distance `offset(2)` to the left of this line (m).
  type, extends(joint_type), public :: rigid_joint
    integer :: ends(2) = 0
    real(dp) :: offset(2) = 0
  contains
    procedure :: describe, define, check, locate, trace, reach, deviation
  end type rigid_joint

contains

  pure subroutine describe(self, form)
    class(rigid_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("rigid", "point of the body that carries both joints `ends`: from `ends(1)` go `offset(1)` toward " // &
      &   "`ends(2)`, then `offset(2)` perpendicular to this line (positive to the left)", links=0, pairs=0, keys=[two_ends, &
      &   offset_key], bars=[self%ends(1), itself, self%ends(2), itself], obstacle="the two joints 'ends' of the body coincide")
  end subroutine describe

  pure subroutine define(self, data)
    class(rigid_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    self%ends = data%joints("ends")
    self%offset = data%numbers("offset")
  end subroutine define

  pure subroutine check(self, reason)
    class(rigid_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call check_coordinates(self%offset, reason)
  end subroutine check

  pure subroutine locate(self, crank_angle, points, here)
    class(rigid_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: e

    associate (unused => crank_angle)
    end associate
    e = direction(points(self%ends(1)), points(self%ends(2)))
    here = carried(points(self%ends(1)), e, self%offset(1), self%offset(2))
  end subroutine locate

  pure subroutine trace(self, angles, points, here)
    class(rigid_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: u

    associate (unused => angles)
    end associate
    call find_direction(points(self%ends(1)), points(self%ends(2)), u)
    call carry(points(self%ends(1)), u, self%offset(1), self%offset(2), here)
  end subroutine trace

  !> Bounds on the joint's motion. The body's angular velocity omega is at most the sum of the ends' speeds divided by their
  !> distance d, which must not vanish. With the ends' accelerations a1, a2 and the unit vector e from `ends(1)` to `ends(2)`,
  !> omega' = e_perp . (a2 - a1) / d - 2 omega d' / d.
  pure function reach(self, points, speeds, accelerations, half_width)
    class(rigid_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach
    real(dp) :: apart, turning, change

    associate (one => points(self%ends(1)), two => points(self%ends(2)), v => sum(speeds(self%ends)))
      apart = hypot(two%x%v - one%x%v, two%y%v - one%y%v)
      reach%assembled = apart > slack * v * half_width
      if (.not. reach%assembled) return
      turning = v / (apart - slack * v * half_width)
      change = (sum(accelerations(self%ends)) + 2 * turning * v) / (apart - slack * v * half_width)
      reach%speed = speeds(self%ends(1)) + norm2(self%offset) * turning
      reach%acceleration = accelerations(self%ends(1)) + norm2(self%offset) * (change + turning**2)
      if (v > 0) reach%angle_scale = apart / v
    end associate
  end function reach

  pure function deviation(self, points, here, deviations, acceleration, half_width)
    class(rigid_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(deviation_type), intent(in) :: deviations(:)
    real(dp), intent(in) :: acceleration, half_width
    type(deviation_type) :: deviation

    deviation = of_body(points(self%ends(1)), points(self%ends(2)), deviations(self%ends), self%offset, half_width, &
      & acceleration + hypot(here%x%dd, here%y%dd))
  end function deviation

end module gestell_model_joints_types_rigid
