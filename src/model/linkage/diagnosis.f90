!> Kinematic diagnosis of a linkage: mobility, Grashof's class, ranges of motion, strokes and transmission angles. It does not
!> depend on masses.
module gestell_model_linkage_diagnosis
  use gestell_base_error, only: error_type
  use gestell_math_jet, only: jet
  use gestell_base_kinds, only: dp, pi
  use gestell_model_linkage_bodies, only: link_type
  use gestell_model_linkage_extremes, only: extremes_type
  use gestell_model_joints_driven, only: driven_joint
  use gestell_model_joints_path, only: direction
  use gestell_model_joints_joint, only: form_type, named_joint_type, point_type, transmission_type
  use gestell_model_linkage, only: linkage_type
  implicit none (type, external)
  private

  public :: diagnose, diagnose_joints, shaft_of

  !> Range and quality of the motion of one joint over a turn.
  type, public :: joint_report_type
    !> Minimum and maximum (m) of x and of y. `travel`: for a slider, minimum and maximum of its distance along the guide from the
    !> guide's point.
    real(dp) :: x(2) = 0, y(2) = 0, travel(2) = 0
    logical :: slides = .false.
    !> `rate`: maximum speed along the guide, divided by the crank speed (m). `second_rate`: maximum magnitude of the acceleration
    !> along the guide, divided by the square of the crank speed (m).
    real(dp) :: rate = 0, second_rate = 0
    !> Crank angle through which the slider moves forward on its guide (rad). It is 0 unless the slider moves forward once and back
    !> once per turn.
    real(dp) :: forward = 0
    !> Minimum transmission angle (rad, at most pi/2) and the crank angle at which it occurs (rad).
    real(dp) :: transmission = pi / 2, transmission_at = 0
    !> Minimum over the turn of the change of one of the joint's lengths that would lead to a dead point (m); huge if no change of
    !> length can.
    real(dp) :: margin = huge(1.0_dp)
  end type joint_report_type

  !> Results of the kinematic diagnosis of a linkage.
  type, public :: diagnosis_type
    !> Gruebler's count. `links`: number of links including the frame. `pairs`: number of pairs with one degree of freedom.
    !> `higher_pairs`: number of pairs with two degrees of freedom. `mobility` = 3 (links - 1) - 2 pairs - higher_pairs.
    integer :: links = 0, pairs = 0, higher_pairs = 0, mobility = 0
    !> Grashof's class of a four-bar linkage; empty for other mechanisms.
    character(len=40) :: grashof = ""
    type(joint_report_type), allocatable :: joints(:)
    !> True for each link that rotates through full turns.
    logical, allocatable :: turns(:)
    !> Angle of the range within which each link swings (rad).
    real(dp), allocatable :: swing(:)
    !> Computing cost: number of times that the position of a joint was computed.
    integer :: placements = 0
  end type diagnosis_type

  !> State of a joint at the last crank angle, and the extremes of its motion over all crank angles so far.
  type :: joint_track_type
    type(point_type) :: here
    type(transmission_type) :: transmission
    type(extremes_type) :: x, y, travel, rate, second_rate, sine, margin
    !> Speed of the joint along its guide at the last crank angle at which it moved; its sign is the direction.
    real(dp) :: direction = 0
    !> Number of times that the joint has reversed its direction on the guide.
    integer :: reversals = 0
  end type joint_track_type

  !> Direction of a link at the last crank angle, and the extremes of its angle over all crank angles so far.
  type :: link_track_type
    type(point_type) :: direction
    !> Angle through which the link has rotated since the first crank angle (rad).
    type(jet) :: angle
    type(extremes_type) :: swing
  end type link_track_type

  interface
    !> Index of the earliest crank pin on the shaft of joint `i`, if joint `i` is a later crank pin on it: both have the same
    !> position of the pivot and the same ratio. Otherwise 0.
    pure module function shaft_of(linkage, at, i) result(first)
      implicit none (type, external)
      class(linkage_type), intent(in) :: linkage
      !> Points of all joints at one crank angle
      type(point_type), intent(in) :: at(:)
      integer, intent(in) :: i
      integer :: first
    end function shaft_of

    !> Grashof's class of a four-bar linkage, in which an RRR dyad connects the crank pin to a ground joint. Because the crank can
    !> turn, the sum of the shortest and the longest link is less than the sum of the other two (Grashof's rule); the shortest link
    !> determines the class. Empty for other mechanisms.
    module function grashof_class(linkage)
      implicit none (type, external)
      class(linkage_type), intent(in) :: linkage
      character(len=40) :: grashof_class
    end function grashof_class
  end interface

contains

  !> Computes the diagnosis of a linkage. Fails if the linkage has no joints or no links.
  subroutine diagnose(linkage, diagnosis, error)
    class(linkage_type), intent(in) :: linkage
    type(diagnosis_type), intent(out) :: diagnosis
    type(error_type), allocatable, intent(out) :: error

    call linkage%check(error)
    if (allocated(error)) return
    call count_links(linkage, diagnosis)
    diagnosis%grashof = grashof_class(linkage)
    call turn_once(linkage, linkage%links, diagnosis)
  end subroutine diagnose

  !> Computes the part of the diagnosis that concerns the joints.
  subroutine diagnose_joints(linkage, diagnosis)
    class(linkage_type), intent(in) :: linkage
    type(diagnosis_type), intent(out) :: diagnosis

    call turn_once(linkage, linkage%links(:0), diagnosis)
  end subroutine diagnose_joints

  !> Follows all joints and `links` through one turn. The steps are half a degree, or less if the linkage's `angle_scale` requires
  !> it.
  subroutine turn_once(linkage, links, diagnosis)
    class(linkage_type), intent(in) :: linkage
    type(link_type), intent(in) :: links(:)
    type(diagnosis_type), intent(inout) :: diagnosis
    integer, parameter :: least = 720, most = 8192
    type(point_type) :: at(size(linkage%joints))
    type(joint_track_type) :: joints(size(linkage%joints))
    type(link_track_type) :: bodies(size(links))
    real(dp) :: step
    integer :: steps, k

    steps = max(least, ceiling(min(real(most, dp), 32 * pi / linkage%angle_scale)))
    step = 2 * pi / steps
    do k = 0, steps
      call linkage%points(k * step, at)
      call follow_joints(linkage%joints, at, k * step, step, k == 0, joints)
      call follow_links(links, at, k * step, step, k == 0, bodies)
    end do
    diagnosis%placements = (steps + 1) * size(at)
    diagnosis%joints = joint_report(joints)
    diagnosis%turns = links%to > 0 .and. abs(bodies%angle%v) > pi
    diagnosis%swing = merge(bodies%swing%maximum - bodies%swing%least, 0.0_dp, links%to > 0)
  end subroutine turn_once

  !> Updates the joints' extremes after the step that ends at `angle`. `first`: true at the first angle, where no step has been made
  !> yet.
  subroutine follow_joints(joints, at, angle, step, first, tracks)
    type(named_joint_type), intent(in) :: joints(:)
    type(point_type), intent(in) :: at(:)
    real(dp), intent(in) :: angle, step
    logical, intent(in) :: first
    type(joint_track_type), intent(inout) :: tracks(:)
    type(transmission_type) :: transmission
    real(dp) :: fourth
    integer :: i

    do i = 1, size(joints)
      transmission = joints(i)%joint%transmission(at, at(i))
      associate (track => tracks(i), from => angle - step)
        if (.not. first) then
          call track%x%take(track%here%x, at(i)%x, from, step)
          call track%y%take(track%here%y, at(i)%y, from, step)
          call track%travel%take(track%transmission%travel, transmission%travel, from, step)
          ! The fourth derivative, with which the second is interpolated, is the mean over the step.
          associate (old => track%transmission%travel, new => transmission%travel)
            fourth = (new%ddd - old%ddd) / step
            call track%rate%take(jet(old%d, old%dd, old%ddd), jet(new%d, new%dd, new%ddd), from, step)
            call track%second_rate%take(jet(old%dd, old%ddd, fourth), jet(new%dd, new%ddd, fourth), from, step)
            if (track%direction * new%d < 0) track%reversals = track%reversals + 1
            if (abs(new%d) > 0) track%direction = new%d
          end associate
          call track%sine%take(track%transmission%sine, transmission%sine, from, step)
          call track%margin%take(track%transmission%margin, transmission%margin, from, step)
        end if
        track%here = at(i)
        track%transmission = transmission
      end associate
    end do
  end subroutine follow_joints

  !> Updates the links' extremes after the step that ends at `angle`. The direction u = (cos phi, sin phi) of a link rotates with
  !> phi' = u x u', phi'' = u x u''.
  subroutine follow_links(links, at, angle, step, first, tracks)
    type(link_type), intent(in) :: links(:)
    type(point_type), intent(in) :: at(:)
    real(dp), intent(in) :: angle, step
    logical, intent(in) :: first
    type(link_track_type), intent(inout) :: tracks(:)
    type(point_type) :: u
    type(jet) :: turned
    integer :: i

    do i = 1, size(links)
      if (links(i)%to == 0) cycle
      u = direction(at(links(i)%from), at(links(i)%to))
      associate (track => tracks(i), before => tracks(i)%direction)
        turned = jet(0.0_dp, u%x%v * u%y%d - u%y%v * u%x%d, u%x%v * u%y%dd - u%y%v * u%x%dd)
        if (.not. first) then
          turned%v = track%angle%v + atan2(before%x%v * u%y%v - before%y%v * u%x%v, before%x%v * u%x%v + before%y%v * u%y%v)
          call track%swing%take(track%angle, turned, angle - step, step)
        end if
        track%angle = turned
        track%direction = u
      end associate
    end do
  end subroutine follow_links

  elemental type(joint_report_type) function joint_report(track) result(report)
    type(joint_track_type), intent(in) :: track

    report%x = [track%x%least, track%x%maximum]
    report%y = [track%y%least, track%y%maximum]
    report%slides = track%transmission%slides
    if (report%slides) report%travel = [track%travel%least, track%travel%maximum]
    report%rate = max(track%rate%maximum, -track%rate%least, 0.0_dp)
    report%second_rate = max(track%second_rate%maximum, -track%second_rate%least, 0.0_dp)
    if (report%slides .and. any(track%reversals == [1, 2])) report%forward = modulo(track%travel%maximum_at &
      & - track%travel%least_at, 2 * pi)
    report%transmission = asin(min(1.0_dp, track%sine%least))
    report%transmission_at = modulo(track%sine%least_at, 2 * pi)
    report%margin = track%margin%least
  end function joint_report

  !> Computes Gruebler's count. The frame counts as one link, the links and pairs of all joints are added, and each shaft or
  !> cylinder after the first adds a pair of gears.
  subroutine count_links(linkage, diagnosis)
    class(linkage_type), intent(in) :: linkage
    type(diagnosis_type), intent(inout) :: diagnosis
    type(point_type) :: at(size(linkage%joints))
    type(form_type) :: form
    integer :: i, shafts

    call linkage%points(0.0_dp, at)
    diagnosis%links = 1
    shafts = 0
    do i = 1, size(linkage%joints)
      if (shaft_of(linkage, at, i) > 0) cycle
      select type (joint => linkage%joints(i)%joint)
      class is (driven_joint)
        shafts = shafts + 1
      end select
      call linkage%joints(i)%joint%describe(form)
      diagnosis%links = diagnosis%links + form%links
      diagnosis%pairs = diagnosis%pairs + form%pairs
      diagnosis%higher_pairs = diagnosis%higher_pairs + form%higher_pairs
    end do
    ! each shaft that turns with the drive, except the first, is joined to another by a pair of gears
    diagnosis%higher_pairs = diagnosis%higher_pairs + shafts - 1
    diagnosis%mobility = 3 * (diagnosis%links - 1) - 2 * diagnosis%pairs - diagnosis%higher_pairs
  end subroutine count_links

end module gestell_model_linkage_diagnosis
