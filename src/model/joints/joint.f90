!> A joint of a linkage: a point that earlier joints and the crank angle determine.
module gestell_model_joints_joint
  use gestell_base_key, only: integer_key, key_type, of_length, one_or_minus_one, positive, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_math_jet, only: jet
  use gestell_model_joints_data, only: joint_data_type
  use gestell_model_joints_deviation, only: deviation_type, disc
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_path, only: batch, path_type, point_type, slack
  use gestell_model_joints_placement, only: placement_type
  implicit none (type, external)
  private

  public :: greatest_change, point_type, reach_body, slack

  !> Within an interval the sine of a transmission angle keeps this part of what it is in the middle: so the least of the
  !> sines in the middles is nearly the least of all.
  real(dp), parameter, public :: steady = 0.8_dp

  !> What holds for a joint over an interval of the crank angle, proved from its middle.
  type, public :: reach_type
    !> Whether the joint can be assembled, without a dead point, in the whole interval.
    logical :: assembled = .true.
    !> Bounds on the joint's speed |dr / dphi| and acceleration |d2r / dphi2| in the interval (m).
    real(dp) :: speed = 0, acceleration = 0
    !> Crank angle over which the motion changes noticeably here (rad).
    real(dp) :: angle_scale = 1
  end type reach_type

  !> How well a joint is placed at one crank angle, with derivatives with respect to it.
  type, public :: transmission_type
    !> Sine of the transmission angle: 1 at best, 0 at a dead point.
    type(jet) :: sine = jet(v=1.0_dp)
    !> Change of one of the joint's lengths that would bring it to a dead point (m); huge where no length can.
    type(jet) :: margin = jet(v=huge(1.0_dp))
    !> Whether the joint slides on a guide, and how far from the guide's point (m).
    logical :: slides = .false.
    type(jet) :: travel = jet()
  end type transmission_type

  !> What a joint is: the name of its type in an input and a sentence that says where such a joint lies; the links and the pairs of
  !> one degree of freedom that it adds to Gruebler's count, and pairs of two (as cams have); the keys of an input, those that are
  !> `required` first; of this one the bars that are drawn, pairs of joints in a row, and the guides on which it slides.
  type, public :: form_type
    character(len=8) :: name
    character(len=320) :: meaning
    integer :: links, pairs
    integer :: higher_pairs = 0
    type(key_type), allocatable :: keys(:)
    integer, allocatable :: bars(:)
    type(guide_type), allocatable :: guides(:)
    !> Why it cannot be assembled where it cannot, for a message.
    character(len=80) :: obstacle = "it has no place there"
  end type form_type

  !> Stands for the joint itself in its bars.
  integer, parameter, public :: itself = 0

  !> Keys that several types have.
  character(len=*), parameter :: of_ends = "the earlier joints that the dyad hangs on, or whose body carries the joint", &
    & of_lengths = "lengths of the dyad's links"
  type(key_type), parameter, public :: one_end = key_type("joint", "ends", text_key, of_ends, 1, 1, 1, required=.true.)
  type(key_type), parameter, public :: two_ends = key_type("joint", "ends", text_key, of_ends, 1, 2, 2, required=.true.)
  type(key_type), parameter, public :: one_length = key_type("joint", "lengths", real_key, of_lengths, 1, 1, 1, required=.true., &
    & unit=of_length, range=positive)
  type(key_type), parameter, public :: two_lengths = key_type("joint", "lengths", real_key, of_lengths, 1, 2, 2, &
    & required=.true., unit=of_length, range=positive)
  type(key_type), parameter, public :: branch_key = key_type("joint", "branch", integer_key, &
    & "which of the two ways to assemble the dyad", required=.true., range=one_or_minus_one)

  !> Joints refer to earlier ones by their index in the list.
  type, abstract, public :: joint_type
  contains
    procedure(describe_joint), deferred :: describe
    procedure(locate_joint), deferred :: locate
    procedure(reach_joint), deferred :: reach
    procedure :: deviation
    procedure :: trace
    procedure :: transmission
    procedure :: explain
    procedure :: define
    procedure :: check
    procedure :: carriers
    procedure :: move
  end type joint_type

  type, public :: named_joint_type
    character(len=:), allocatable :: name
    class(joint_type), allocatable :: joint
  end type named_joint_type

  abstract interface
    !> What the joint is; before its data are there, what holds for its type.
    pure subroutine describe_joint(self, form)
      import :: form_type, joint_type
      implicit none (type, external)
      class(joint_type), intent(in) :: self
      type(form_type), intent(out) :: form
    end subroutine describe_joint

    !> The joint's point at a crank angle (rad), from the points of the earlier joints. It must be assembled there.
    pure subroutine locate_joint(self, crank_angle, points, here)
      import :: joint_type, point_type, dp
      implicit none (type, external)
      class(joint_type), intent(in) :: self
      real(dp), intent(in) :: crank_angle
      type(point_type), intent(in) :: points(:)
      type(point_type), intent(out) :: here
    end subroutine locate_joint

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
    if (sum(speeds) > 0) reach%angle_scale = apart / sum(speeds)
  end function reach_body

  !> How far the joint's acceleration lies at most from that in the middle, where the joint is `here`, within `half_width` (rad):
  !> from how far those of the earlier joints do, and from a bound on its own `acceleration`, which alone makes a disc. Override it
  !> where long chains are made of such joints.
  pure function deviation(self, points, here, deviations, acceleration, half_width)
    class(joint_type), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(deviation_type), intent(in) :: deviations(:)
    real(dp), intent(in) :: acceleration, half_width
    type(deviation_type) :: deviation

    associate (unused => self, unused_points => points, unused_deviations => deviations, unused_width => half_width)
    end associate
    deviation = disc(acceleration + hypot(here%x%dd, here%y%dd))
  end function deviation

  !> The joint's path over a batch of crank angles (rad), from those of the earlier joints: `locate` at each of them.
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
      call self%locate(angles(k), at, point)
      here%x(k) = point%x%v
      here%y(k) = point%y%v
      here%vx(k) = point%x%d
      here%vy(k) = point%y%d
      here%ax(k) = point%x%dd
      here%ay(k) = point%y%dd
    end do
  end subroutine trace

  !> How well the joint transmits motion. Default: nothing is reported. `points`: all joints at one crank angle; `here`: this one.
  pure function transmission(self, points, here)
    class(joint_type), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(transmission_type) :: transmission

    associate (unused_self => self, unused_points => points, unused_here => here)
    end associate
    transmission = transmission_type()
  end function transmission

  !> Why the joint cannot be assembled with the earlier ones at these points, for a message: its form's `obstacle`. (No function:
  !> gfortran keeps the length of a text that a function allocates in static memory, which threads share.)
  pure subroutine explain(self, points, text)
    class(joint_type), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text
    type(form_type) :: form

    associate (unused_points => points)
    end associate
    call self%describe(form)
    text = trim(form%obstacle)
  end subroutine explain

  !> Takes what an input gives for the keys of the joint's form; they are all there that it requires. If they make no joint, `data`
  !> gets the reason.
  pure subroutine define(self, data)
    class(joint_type), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    associate (unused_self => self)
    end associate
    data%reason = "no joint of this type can be read from an input"
  end subroutine define

  !> `reason`, empty before: why one of the joint's numbers makes no sense.
  pure subroutine check(self, reason)
    class(joint_type), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    associate (unused_self => self, unused => reason)
    end associate
  end subroutine check

  !> Puts what is fixed to the frame, and the crank, where the mechanism stands. Joints that earlier ones carry have nothing to
  !> move.
  pure subroutine move(self, placement)
    class(joint_type), intent(inout) :: self
    type(placement_type), intent(in) :: placement

    associate (unused_self => self, unused_placement => placement)
    end associate
  end subroutine move

  !> The earlier joints that this one is built on, as its bars and guides name them.
  pure subroutine carriers(self, joints)
    class(joint_type), intent(in) :: self
    integer, allocatable, intent(out) :: joints(:)
    type(form_type) :: form
    integer :: i

    call self%describe(form)
    allocate(joints(0))
    if (allocated(form%bars)) joints = form%bars
    if (allocated(form%guides)) joints = [joints, (form%guides(i)%carriers, i = 1, size(form%guides))]
    joints = pack(joints, joints /= itself)
  end subroutine carriers

end module gestell_model_joints_joint
