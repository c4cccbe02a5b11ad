!> A directed line that a slider follows: fixed to the frame, or carried by the body between two joints.
module gestell_model_joints_guide
  use gestell_math_jet, only: cos, jet, operator(*), operator(+), operator(-), operator(/), sin, sqrt
  use gestell_base_kinds, only: dp
  use gestell_model_joints_joint, only: point_type, slack
  use gestell_model_joints_path, only: carry, find_direction, keep, path_type, turn
  implicit none (type, external)
  private

  public :: cross, direction, dot, turning_feature

  !> The line through `point` (m) at `angle` (rad), in x-y or, with `carriers` P and Q (places of joints), in the system
  !> with its origin at P and its first axis toward Q.
  type, public :: guide_type
    integer :: carriers(2) = 0
    real(dp) :: point(2) = 0, angle = 0
  contains
    procedure :: line
    procedure :: trace
    procedure :: motion
  end type guide_type

  !> Bounds on a guide's motion over an interval of the crank angle.
  type, public :: guide_motion_type
    !> Whether the carriers keep apart, so that the guide has a direction.
    logical :: sound = .true.
    !> On the speed of its point (m) and on its turning (rad), both per radian of the crank.
    real(dp) :: speed = 0, turning = 0
    !> On the point's acceleration (m) and on the change of its turning, both per radian squared.
    real(dp) :: acceleration = 0, turning_change = 0
    !> Crank angle over which its direction changes in earnest (rad).
    real(dp) :: feature = 1
  end type guide_motion_type

contains

  !> The guide's point and its unit direction.
  pure subroutine line(self, points, origin, along)
    class(guide_type), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: origin, along
    type(point_type) :: e

    if (all(self%carriers == 0)) then
      origin = point_type(jet(self%point(1)), jet(self%point(2)))
      along = point_type(jet(cos(self%angle)), jet(sin(self%angle)))
      return
    end if
    e = direction(points(self%carriers(1)), points(self%carriers(2)))
    origin%x = points(self%carriers(1))%x + self%point(1) * e%x - self%point(2) * e%y
    origin%y = points(self%carriers(1))%y + self%point(1) * e%y + self%point(2) * e%x
    along%x = cos(self%angle) * e%x - sin(self%angle) * e%y
    along%y = cos(self%angle) * e%y + sin(self%angle) * e%x
  end subroutine line

  !> The same along the paths of the joints.
  pure subroutine trace(self, points, origin, along)
    class(guide_type), intent(in) :: self
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: origin, along
    type(path_type) :: e

    if (all(self%carriers == 0)) then
      call keep(self%point, origin)
      call keep([cos(self%angle), sin(self%angle)], along)
      return
    end if
    call find_direction(points(self%carriers(1)), points(self%carriers(2)), e)
    call carry(points(self%carriers(1)), e, self%point(1), self%point(2), origin)
    call turn(e, self%angle, along)
  end subroutine trace

  !> Bounds while the crank turns by at most `half_width` (rad) from the middle, where the joints are at `points`.
  pure function motion(self, points, speeds, accelerations, half_width)
    class(guide_type), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(guide_motion_type) :: motion
    real(dp) :: apart

    if (all(self%carriers == 0)) return
    associate (one => points(self%carriers(1)), two => points(self%carriers(2)), v => sum(speeds(self%carriers)))
      apart = hypot(two%x%v - one%x%v, two%y%v - one%y%v) - slack * v * half_width
      motion%sound = apart > 0
      if (.not. motion%sound) return
      motion%turning = v / apart
      motion%feature = turning_feature(one, two)
      motion%speed = speeds(self%carriers(1)) + norm2(self%point) * motion%turning
      motion%turning_change = (sum(accelerations(self%carriers)) + 2 * motion%turning * v) / apart
      motion%acceleration = accelerations(self%carriers(1)) &
        & + norm2(self%point) * (motion%turning_change + motion%turning**2)
    end associate
  end function motion

  !> The unit vector from one point to another.
  pure type(point_type) function direction(from, to)
    type(point_type), intent(in) :: from, to
    type(jet) :: length

    direction = point_type(to%x - from%x, to%y - from%y)
    length = sqrt(dot(direction, direction))
    direction = point_type(direction%x / length, direction%y / length)
  end function direction

  !> Crank angle over which the direction from one point to another changes in earnest (rad): where they come close to
  !> each other it turns fast.
  pure real(dp) function turning_feature(from, to) result(feature)
    type(point_type), intent(in) :: from, to
    real(dp) :: apart, rate

    apart = hypot(to%x%v - from%x%v, to%y%v - from%y%v)
    rate = hypot(to%x%d - from%x%d, to%y%d - from%y%d)
    feature = 1
    if (rate > apart) feature = apart / rate
  end function turning_feature

  pure type(jet) function dot(a, b)
    type(point_type), intent(in) :: a, b

    dot = a%x * b%x + a%y * b%y
  end function dot

  pure type(jet) function cross(a, b)
    type(point_type), intent(in) :: a, b

    cross = a%x * b%y - a%y * b%x
  end function cross

end module gestell_model_joints_guide
