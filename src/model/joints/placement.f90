!> Where a mechanism stands: its x-y system in that of the whole machine, and how its crank turns with the drive.
module gestell_model_joints_placement
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> The mechanism's origin (m), the angle of its x-axis (rad), what is added to its crank's angle (rad), and the turns of its crank
  !> in one of the drive's, `ratio` over `denominator`.
  !> In space also where along the plane's normal (m), and the number of its plane, 0: the frame's own.
  type, public :: placement_type
    real(dp) :: origin(2) = 0, angle = 0, phase = 0, z = 0
    integer :: ratio = 1, denominator = 1, plane = 0
  contains
    procedure :: point
    procedure :: vector
  end type placement_type

contains

  !> Where a point of the mechanism is (m).
  pure function point(self, p)
    class(placement_type), intent(in) :: self
    real(dp), intent(in) :: p(2)
    real(dp) :: point(2)

    point = self%origin + self%vector(p)
  end function point

  !> What becomes of its vectors. Quarter turns leave no roundings.
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
