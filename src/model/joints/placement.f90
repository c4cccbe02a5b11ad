!> Placement of a mechanism: its x-y axes in those of the whole machine, and the motion of its crank with the drive.
module gestell_model_joints_placement
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> Origin of the mechanism (m), angle of its x-axis (rad), phase added to its crank's angle (rad), and turns of its crank per turn
  !> of the drive, ratio/denominator. In space also the position `z` along the plane's normal (m) and the number of its plane, 0 for
  !> the plane of the frame.
  type, public :: placement_type
    real(dp) :: origin(2) = 0, angle = 0, phase = 0, z = 0
    integer :: ratio = 1, denominator = 1, plane = 0
  contains
    procedure :: point
    procedure :: vector
  end type placement_type

contains

  !> Position of a point of the mechanism in the machine's axes (m).
  pure function point(self, p)
    class(placement_type), intent(in) :: self
    real(dp), intent(in) :: p(2)
    real(dp) :: point(2)

    point = self%origin + self%vector(p)
  end function point

  !> A vector of the mechanism in the machine's axes. Quarter turns are free of rounding errors.
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
