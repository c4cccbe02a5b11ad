!> The dyad RPR, with a slider between two turning pairs: a slotted lever.
module gestell_model_joints_types_rpr
  use gestell_base_kinds, only: dp
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-), sqrt
  use gestell_model_joints_data, only: check_lengths, joint_data_type
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: branch_key, form_type, itself, one_length, point_type, transmission_type, two_ends
  use gestell_model_joints_pairs, only: pair_type, pin, slot
  use gestell_model_joints_types_rigid, only: rigid_joint
  implicit none (type, external)
  private

  !> A point of the lever, which is a body that turns about joint `ends(1)` and points to joint `ends(2)` in its slot. The joint is
  !> at the distance `length` (m) from `ends(1)`. It lies toward `ends(2)` if `branch` = 1, and on the opposite side if `branch` =
  !> -1. In an input, and for the function `rpr_joint`, the joint in the slot is the first one.
  type, extends(rigid_joint), public :: rpr_joint
    real(dp) :: length = 0
    integer :: branch = 1
  contains
    procedure :: describe, define, check, transmission, pairs
  end type rpr_joint

  interface rpr_joint
    procedure :: new_rpr
  end interface rpr_joint

contains

  !> A point of a lever that turns about joint `ends(2)` and whose slot passes through joint `ends(1)`, at the distance `length` (m)
  !> from `ends(2)`.
  pure type(rpr_joint) function new_rpr(ends, length, branch) result(joint)
    integer, intent(in) :: ends(2), branch
    real(dp), intent(in) :: length

    joint%ends = ends(2:1:-1)
    joint%offset = [branch * length, 0.0_dp]
    joint%length = length
    joint%branch = branch
  end function new_rpr

  pure subroutine describe(self, form)
    class(rpr_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("RPR", "point of a slotted lever. The lever turns about `ends(2)`; its slot passes through `ends(1)`. " // &
      &   "The joint is at the distance `lengths(1)` from `ends(2)`, on the same side as `ends(1)` (`branch = 1`) or on the " // &
      &   "opposite side (`-1`)", links=2, pairs=3, &
      & keys=[two_ends, one_length, branch_key], bars=[self%ends(1), itself, self%ends(1), self%ends(2)], &
      & obstacle="the joint in the slot coincides with the lever's pivot")
  end subroutine describe

  !> The new bodies are the lever, and the block on the pin `ends(2)` in its slot.
  pure subroutine pairs(self, number, list)
    class(rpr_joint), intent(in) :: self
    integer, intent(in) :: number
    type(pair_type), allocatable, intent(out) :: list(:)

    associate (unused => number)
    end associate
    list = [pair_type(pin, 1, self%ends(1)), pair_type(pin, 2, self%ends(2)), &
      & pair_type(slot, 2, self%ends(2), guide_type(carriers=self%ends), against=1)]
  end subroutine pairs

  pure subroutine define(self, data)
    class(rpr_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    self%ends(2:1:-1) = data%joints("ends")
    self%length = data%number("lengths")
    self%branch = nint(data%number("branch"))
    self%offset = [self%branch * self%length, 0.0_dp]
  end subroutine define

  pure subroutine check(self, reason)
    class(rpr_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call check_lengths([self%length], self%branch, reason)
  end subroutine check

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
