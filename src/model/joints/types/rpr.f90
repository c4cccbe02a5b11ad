!> The dyad RPR, with a slider between two turning pairs: a slotted lever.
module gestell_model_joints_types_rpr
  use gestell_base_kinds, only: dp
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-), sqrt
  use gestell_model_joints_data, only: check_lengths, joint_data_type
  use gestell_model_joints_deviation, only: deviation_type, of_body
  use gestell_model_joints_joint, only: branch_key, form_type, itself, joint_type, one_length, point_type, reach_body, &
    & reach_type, transmission_type, two_ends
  use gestell_model_joints_path, only: batch, carried, carry, direction, find_direction, path_type
  implicit none (type, external)
  private

  !> The lever turns about joint `ends(2)`; its slot passes through joint `ends(1)`. The joint is a point of the lever at the
  !> distance `length` (m) from `ends(2)`. It lies toward `ends(1)` if `branch` = 1, and on the opposite side if `branch` = -1.
  type, extends(joint_type), public :: rpr_joint
    integer :: ends(2) = 0
    real(dp) :: length = 0
    integer :: branch = 1
  contains
    procedure :: describe, define, check, locate, trace, reach, deviation, transmission
  end type rpr_joint

contains

  pure subroutine describe(self, form)
    class(rpr_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("RPR", "point of a slotted lever. The lever turns about `ends(2)`; its slot passes through `ends(1)`. " // &
      &   "The joint is at the distance `lengths(1)` from `ends(2)`, on the same side as `ends(1)` (`branch = 1`) or on the " // &
      &   "opposite side (`-1`)", links=2, pairs=3, &
      & keys=[two_ends, one_length, branch_key], bars=[self%ends(2), itself, self%ends(2), self%ends(1)], &
      & obstacle="the joint in the slot coincides with the lever's pivot")
  end subroutine describe

  pure subroutine define(self, data)
    class(rpr_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    self%ends = data%joints("ends")
    self%length = data%number("lengths")
    self%branch = nint(data%number("branch"))
  end subroutine define

  pure subroutine check(self, reason)
    class(rpr_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call check_lengths([self%length], self%branch, reason)
  end subroutine check

  pure subroutine locate(self, crank_angle, points, here)
    class(rpr_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: e

    associate (unused => crank_angle)
    end associate
    e = direction(points(self%ends(2)), points(self%ends(1)))
    here = carried(points(self%ends(2)), e, self%branch * self%length, 0.0_dp)
  end subroutine locate

  pure subroutine trace(self, angles, points, here)
    class(rpr_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: u

    associate (unused => angles)
    end associate
    call find_direction(points(self%ends(2)), points(self%ends(1)), u)
    call carry(points(self%ends(2)), u, self%branch * self%length, 0.0_dp, here)
  end subroutine trace

  pure function reach(self, points, speeds, accelerations, half_width)
    class(rpr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    reach = reach_body(points(self%ends), speeds(self%ends), accelerations(self%ends), half_width, 2, self%length)
  end function reach

  pure function deviation(self, points, here, deviations, acceleration, half_width)
    class(rpr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(deviation_type), intent(in) :: deviations(:)
    real(dp), intent(in) :: acceleration, half_width
    type(deviation_type) :: deviation

    deviation = of_body(points(self%ends(2)), points(self%ends(1)), deviations(self%ends(2:1:-1)), &
      & [self%branch * self%length, 0.0_dp], half_width, acceleration + hypot(here%x%dd, here%y%dd))
  end function deviation

  !> Quality of the transmission. At a dead point the joint in the slot coincides with the lever's pivot.
  pure function transmission(self, points, here)
    class(rpr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(transmission_type) :: transmission
    type(jet) :: ex, ey

    associate (unused => here, one => points(self%ends(1)), two => points(self%ends(2)))
      ex = two%x - one%x
      ey = two%y - one%y
      transmission%margin = sqrt(ex * ex + ey * ey)
    end associate
  end function transmission

end module gestell_model_joints_types_rpr
