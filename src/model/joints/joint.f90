!> A joint of a linkage: a point whose position follows from the crank angle and from the joints before it in the list.
module gestell_model_joints_joint
  use gestell_base_key, only: integer_key, key_type, of_length, one_or_minus_one, positive, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_math_jet, only: jet
  use gestell_model_joints_data, only: joint_data_type
  use gestell_model_joints_deviation, only: deviation_type, disc
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_pairs, only: pair_type, pin, slide
  use gestell_model_joints_path, only: batch, path_type, point_type, slack
  use gestell_model_joints_placement, only: placement_type
  implicit none (type, external)
  private

  public :: largest_change, point_type, slack

  !> An interval of the crank angle is accepted only if the sine of the transmission angle does not fall below this fraction of
  !> its value in the middle of the interval. The minimum over all middles is then nearly the minimum over the turn.
  real(dp), parameter, public :: steady = 0.8_dp

  !> Bounds on the motion of a joint over an interval of the crank angle, proved from the position in the middle of the interval.
  type, public :: reach_type
    !> True if the joint can be assembled in the whole interval without a dead point.
    logical :: assembled = .true.
    !> Bounds on the joint's speed |dr / dphi| and acceleration |d2r / dphi2| in the interval (m).
    real(dp) :: speed = 0, acceleration = 0
    !> Crank angle over which the joint's motion changes noticeably (rad).
    real(dp) :: angle_scale = 1
  end type reach_type

  !> Quality of the transmission of motion at a joint at one crank angle, with derivatives with respect to the crank angle.
  type, public :: transmission_type
    !> Sine of the transmission angle: 1 is the best value, 0 is a dead point.
    type(jet) :: sine = jet(v=1.0_dp)
    !> Smallest change of one of the joint's lengths that would lead to a dead point (m); huge if no change of length can.
    type(jet) :: margin = jet(v=huge(1.0_dp))
    !> True if the joint slides on a guide.
    logical :: slides = .false.
    !> Distance of the joint along the guide from the guide's point (m).
    type(jet) :: travel = jet()
  end type transmission_type

  !> Description of a joint, part of which applies to all joints of its type.
  type, public :: form_type
    !> Name of the type in an input.
    character(len=8) :: name
    !> Position of the joint, described in a sentence.
    character(len=320) :: meaning
    !> Number of links, and number of pairs with one degree of freedom, that the joint adds to Gruebler's count.
    integer :: links, pairs
    !> Number of pairs with two degrees of freedom that the joint adds to Gruebler's count; cams have such pairs.
    integer :: higher_pairs = 0
    !> Keys of the joint in an input, required ones first.
    type(key_type), allocatable :: keys(:)
    !> Bars to be drawn, as a list of joint indices with two indices for each bar.
    integer, allocatable :: bars(:)
    !> Guides on which the joint slides.
    type(guide_type), allocatable :: guides(:)
    !> Reason, for an error message, why the joint cannot be assembled at some crank angle.
    character(len=80) :: obstacle = "no position satisfies its lengths and guides"
  end type form_type

  !> Index by which a joint denotes itself in the list of its bars.
  integer, parameter, public :: itself = 0

  !> Descriptions of keys that several types of joints share.
  character(len=*), parameter :: of_ends = "joints that determine the position of this joint: the other ends of its links, " // &
    &   "or two joints of the body that carries it", of_lengths = "distances of this joint from the joints `ends` (the " // &
    &   "lengths of its links)"
  type(key_type), parameter, public :: one_end = key_type("joint", "ends", text_key, of_ends, 1, 1, 1, required=.true.)
  type(key_type), parameter, public :: two_ends = key_type("joint", "ends", text_key, of_ends, 1, 2, 2, required=.true.)
  type(key_type), parameter, public :: one_length = key_type("joint", "lengths", real_key, of_lengths, 1, 1, 1, required=.true., &
    & unit=of_length, range=positive)
  type(key_type), parameter, public :: two_lengths = key_type("joint", "lengths", real_key, of_lengths, 1, 2, 2, &
    & required=.true., unit=of_length, range=positive)
  type(key_type), parameter, public :: branch_key = key_type("joint", "branch", integer_key, &
    & "selects one of the two possible positions of the joint; the meaning of `1` and `-1` depends on `type`", required=.true., &
    & range=one_or_minus_one)

  !> A joint. It refers to earlier joints by their indices in the list.
  type, abstract, public :: joint_type
  contains
    procedure(describe_joint), deferred :: describe
    procedure(locate_joint), deferred :: locate
    procedure(reach_joint), deferred :: reach
    procedure :: deviation, trace, transmission, explain, define, check, carriers, move, pairs, reach_at
  end type joint_type

  !> A joint on a guide. If the guide is fixed to the frame, the joint moves with it.
  type, abstract, extends(joint_type), public :: guided_joint
    type(guide_type) :: guide
  contains
    procedure :: move => move_guide
  end type guided_joint

  !> A joint together with its name in the input.
  type, public :: named_joint_type
    character(len=:), allocatable :: name
    class(joint_type), allocatable :: joint
  end type named_joint_type

  abstract interface
    !> Describes the joint and its type. Before `define` has been called, the description contains only what all joints of this type
    !> share.
    pure subroutine describe_joint(self, form)
      import :: form_type, joint_type
      implicit none (type, external)
      class(joint_type), intent(in) :: self
      type(form_type), intent(out) :: form
    end subroutine describe_joint

    !> Computes the joint's point at a crank angle (rad) from the points of the earlier joints. It must be possible to assemble the
    !> joint at this angle.
    pure subroutine locate_joint(self, crank_angle, points, here)
      import :: joint_type, point_type, dp
      implicit none (type, external)
      class(joint_type), intent(in) :: self
      real(dp), intent(in) :: crank_angle
      type(point_type), intent(in) :: points(:)
      type(point_type), intent(out) :: here
    end subroutine locate_joint

    !> Bounds on the joint's motion while the crank turns by at most `half_width` (rad) to either side of the middle of an interval.
    !> `points`: positions of the earlier joints in the middle. `speeds`, `accelerations`: bounds for the earlier joints.
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

  !> Bound on the change of a length (m) while the crank angle changes by at most `half_width`. It is the smaller of two bounds.
  !> The first uses the maximum speed. The second uses the speed in the middle of the interval and a bound on the second
  !> derivative. Near a dead point, where the length has an extremum, the second bound is much smaller.
  pure real(dp) function largest_change(speed, speed_in_middle, second_derivative, half_width) result(change)
    !> `speed`: maximum rate of change of the length (m per rad). `speed_in_middle`: its rate of change in the middle of the
    !> interval. `second_derivative`: bound on its second derivative (m per rad^2). `half_width`: half the width of the interval
    !> (rad)
    real(dp), intent(in) :: speed, speed_in_middle, second_derivative, half_width

    change = slack * half_width * min(speed, abs(speed_in_middle) + second_derivative * half_width / 2)
  end function largest_change

  !> Bounds on the joint's motion near a crank angle (rad), like `reach`. Types of joints that the drive moves by a given law
  !> override this function, because their bounds depend on the crank angle.
  pure function reach_at(self, crank_angle, points, speeds, accelerations, half_width) result(reach)
    class(joint_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused => crank_angle)
    end associate
    reach = self%reach(points, speeds, accelerations, half_width)
  end function reach_at

  !> Set that contains the deviation of the joint's acceleration within an interval from the acceleration in the middle. `here`:
  !> position of the joint in the middle. By default the set is a disc that follows from `acceleration`, the bound on the joint's
  !> acceleration. Types of joints that form long chains override this function to use the deviations of the earlier joints.
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

  !> Computes the joint's path over a batch of crank angles (rad) from the paths of the earlier joints: calls `locate` at each
  !> angle. Types of joints override this procedure by loops over the batch, which are faster.
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

  !> Quality of the transmission at the joint; by default that of a perfect transmission. `points`: positions of all joints at one
  !> crank angle. `here`: position of this joint.
  pure function transmission(self, points, here)
    class(joint_type), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(transmission_type) :: transmission

    associate (unused_self => self, unused_points => points, unused_here => here)
    end associate
    transmission = transmission_type()
  end function transmission

  !> Returns the reason, for an error message, why the joint cannot be assembled with the earlier joints at `points`; by default the
  !> `obstacle` of its description. This is a subroutine, because a function would not be thread-safe: gfortran keeps the length of
  !> an allocatable text result in static memory.
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

  !> Defines the joint by the values of its keys in an input, among them all required keys. If the values do not define a joint,
  !> stores the reason in `data`.
  pure subroutine define(self, data)
    class(joint_type), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    associate (unused_self => self)
    end associate
    data%reason = "a joint of this type cannot be read from an input file"
  end subroutine define

  !> Checks the numbers of the joint. Sets `reason`, which is empty on entry, if one of them is invalid.
  pure subroutine check(self, reason)
    class(joint_type), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    associate (unused_self => self, unused => reason)
    end associate
  end subroutine check

  !> Transforms the joint from the mechanism's axes to the machine's axes. Only cranks, and joints and guides that are fixed to the
  !> frame, require this; all other joints follow from the joints that carry them.
  pure subroutine move(self, placement)
    class(joint_type), intent(inout) :: self
    type(placement_type), intent(in) :: placement

    associate (unused_self => self, unused_placement => placement)
    end associate
  end subroutine move

  pure subroutine move_guide(self, placement)
    class(guided_joint), intent(inout) :: self
    type(placement_type), intent(in) :: placement

    call self%guide%move(placement)
  end subroutine move_guide

  !> Returns the pairs by which the joint holds its new bodies. `number`: index of this joint. By default, each bar and each slider
  !> is a new body: a bar has pins at both ends, a slider has a pin at the joint and its guide. A joint without links adds no body.
  pure subroutine pairs(self, number, list)
    class(joint_type), intent(in) :: self
    integer, intent(in) :: number
    type(pair_type), allocatable, intent(out) :: list(:)
    type(form_type) :: form
    integer :: bars, i

    call self%describe(form)
    allocate(list(0))
    if (form%links == 0) return
    bars = 0
    if (allocated(form%bars)) bars = size(form%bars) / 2
    do i = 1, bars
      list = [list, pair_type(pin, i, form%bars(2 * i - 1)), pair_type(pin, i, number)]
    end do
    if (.not. allocated(form%guides)) return
    do i = 1, size(form%guides)
      list = [list, pair_type(pin, bars + i, number), pair_type(slide, bars + i, number, form%guides(i))]
    end do
  end subroutine pairs

  !> Returns the indices of the earlier joints from which this joint is built, according to its bars and guides.
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
