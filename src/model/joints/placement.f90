!> Placement of a mechanism in the whole machine: its x-y axes, and the motion of its crank with the drive.
module gestell_model_joints_placement
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> Position of a mechanism in the machine, and the rotation of its crank relative to the rotation of the drive.
  type, public :: placement_type
    !> `origin`: origin of the mechanism (m). `angle`: angle of its x-axis (rad). `phase`: angle added to its crank angle (rad).
    !> `z`: only for a frame in space, position along the normal of the mechanism's plane (m).
    real(dp) :: origin(2) = 0, angle = 0, phase = 0, z = 0
    !> `ratio`/`denominator`: turns of the crank per turn of the drive. `plane`: number of the mechanism's plane; 0 is the plane of
    !> the frame.
    integer :: ratio = 1, denominator = 1, plane = 0
    !> Whole turns of the crank that are added to the crank angle of loads that repeat only after several turns.
    integer :: load_turns = 0
  contains
    procedure :: point, vector
  end type placement_type

contains

  !> Position, in the machine's axes, of a point of the mechanism (m).
  pure function point(self, p)
    class(placement_type), intent(in) :: self
    real(dp), intent(in) :: p(2)
    real(dp) :: point(2)

    point = self%origin + self%vector(p)
  end function point

  !> Components, in the machine's axes, of a vector of the mechanism. Rotations by multiples of 90 degrees are free of rounding
  !> errors.
  pure function vector(self, v)
    class(placement_type), intent(in) :: self
    real(dp), intent(in) :: v(2)
    real(dp) :: vector(2), c, s

    c = cos(self%angle)
    s = sin(self%angle)
    if (abs(c) < 4 * epsilon(c)) c = 0
    if (abs(s) < 4 * epsilon(s)) s = 0
    vector = [c * v(1) - s * v(2), s * v(1) + c * v(2)]
  end function vector

end module gestell_model_joints_placement
