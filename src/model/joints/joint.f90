!> A joint of a linkage: a point that earlier joints and the crank angle determine.
module gestell_model_joints_joint
  use gestell_math_jet, only: jet
  use gestell_base_kinds, only: dp
  use gestell_model_joints_path, only: batch, path_type
  implicit none (type, external)
  private

  public :: greatest_change

  !> A point of the mechanism's x-y plane with its derivatives with respect to the crank angle (m).
  type, public :: point_type
    type(jet) :: x, y
  end type point_type

  !> Bounds on motions are taken this much longer, so that rounding cannot prove what does not hold.
  real(dp), parameter, public :: slack = 1.01_dp

  !> Within an interval the sine of a transmission angle keeps this part of what it is in the middle: so the least of the
  !> sines in the middles is nearly the least of all.
  real(dp), parameter, public :: steady = 0.8_dp

  !> What holds for a joint over an interval of the crank angle, proved from its middle.
  type, public :: reach_type
    !> Whether the joint can be assembled, without a dead point, in the whole interval.
    logical :: assembled = .true.
    !> Bounds on the joint's speed |dr / dphi| and acceleration |d2r / dphi2| in the interval (m).
    real(dp) :: speed = 0, acceleration = 0
    !> Crank angle over which the motion changes in earnest here (rad).
    real(dp) :: feature = 1
  end type reach_type

  !> How well a joint is placed at one crank angle, with derivatives with respect to it.
  type, public :: fitness_type
    !> Sine of the transmission angle: 1 at best, 0 at a dead point.
    type(jet) :: transmission = jet(v=1.0_dp)
    !> Change of one of the joint's lengths that would bring it to a dead point (m); huge where no length can.
    type(jet) :: margin = jet(v=huge(1.0_dp))
    !> Whether the joint slides on a guide, and how far from the guide's point (m).
    logical :: slides = .false.
    type(jet) :: travel
  end type fitness_type

  !> Joints refer to earlier ones by their place in the list.
  type, abstract, public :: joint_type
  contains
    procedure(place_joint), deferred :: place
    procedure(reach_joint), deferred :: reach
    procedure :: trace
    procedure :: fitness
    procedure :: explain
  end type joint_type

  type, public :: named_joint_type
    character(len=:), allocatable :: name
    class(joint_type), allocatable :: joint
  end type named_joint_type

  abstract interface
    !> The joint's point at a crank angle (rad), from the points of the earlier joints. It must be assembled there.
    pure subroutine place_joint(self, crank_angle, points, here)
      import :: joint_type, point_type, dp
      implicit none (type, external)
      class(joint_type), intent(in) :: self
      real(dp), intent(in) :: crank_angle
      type(point_type), intent(in) :: points(:)
      type(point_type), intent(out) :: here
    end subroutine place_joint

    !> What holds while the crank turns by at most `half_width` (rad) to either side, given the earlier joints' points
    !> in the middle and bounds on their speeds and accelerations.
    pure function reach_joint(self, points, speeds, accelerations, half_width) result(reach)
      import :: joint_type, point_type, reach_type, dp
      implicit none (type, external)
      class(joint_type), intent(in) :: self
      type(point_type), intent(in) :: points(:)
      real(dp), intent(in) :: speeds(:), accelerations(:), half_width
      type(reach_type) :: reach
    end function reach_joint
  end interface

contains

  !> By how much a length changes at most within `half_width` (rad) of the crank angle: by its greatest speed there, or by its
  !> speed in the middle and its greatest second derivative, whichever is less. Near a dead point the second lets go: the
  !> length is extreme there.
  pure real(dp) function greatest_change(speed, speed_in_middle, second_derivative, half_width) result(change)
    real(dp), intent(in) :: speed, speed_in_middle, second_derivative, half_width

    change = slack * half_width * min(speed, abs(speed_in_middle) + second_derivative * half_width / 2)
  end function greatest_change

  !> The joint's path over a batch of crank angles (rad), from those of the earlier joints: `place` at each of them.
  !> Override it by straight loops over the batch where speed matters.
  pure subroutine trace(self, angles, points, here)
    class(joint_type), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(point_type) :: at(size(points)), point
    integer :: i, k

    do k = 1, batch
      do i = 1, size(points)
        associate (p => points(i))
          at(i) = point_type(jet(p%x(k), p%vx(k), p%ax(k)), jet(p%y(k), p%vy(k), p%ay(k)))
        end associate
      end do
      call self%place(angles(k), at, point)
      here%x(k) = point%x%v
      here%y(k) = point%y%v
      here%vx(k) = point%x%d
      here%vy(k) = point%y%d
      here%ax(k) = point%x%dd
      here%ay(k) = point%y%dd
    end do
  end subroutine trace

  !> Fitness of the joint among all joints at `points`, itself among them at `here`.
  pure function fitness(self, points, here)
    class(joint_type), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(fitness_type) :: fitness

    associate (unused_self => self, unused_points => points, unused_here => here)
    end associate
    fitness = fitness_type()
  end function fitness

  !> Why the joint cannot be assembled with the earlier ones at these points, for a message. (No function: gfortran keeps
  !> the length of a text that a function allocates in static memory, which threads share.)
  pure subroutine explain(self, points, text)
    class(joint_type), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text

    associate (unused_self => self, unused_points => points)
    end associate
    text = "it has no place there"
  end subroutine explain

end module gestell_model_joints_joint
