!> Turns a linkage once and proves that it can be assembled at every crank angle, not only at sampled ones.
module gestell_model_assembly
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: fixed
  use gestell_model_joints_driven, only: crank_joint
  use gestell_model_joints_joint, only: point_type, reach_type
  use gestell_model_linkage, only: linkage_type
  implicit none (type, external)
  private

  public :: turn_once

  !> A joint that cannot be secured over this angle (rad) stands at a dead point: near one the proof needs ever shorter
  !> intervals. About the angle between its links (rad) squared.
  real(dp), parameter :: narrowest = 1.0e-9_dp

contains

  !> Marches over the whole turn in intervals that are each proved from their middle: bounds on the joints' speeds pass
  !> from joint to joint and limit how far each can move within the interval. Sets the linkage's `feature`.
  !> Errors: no crank, or more than one; no links; a joint that cannot be assembled or reaches a dead point; a link
  !> whose two joints meet. Joint and angle are named.
  subroutine turn_once(linkage, error)
    type(linkage_type), intent(inout) :: linkage
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: angle, width, feature
    integer :: bad_joint, bad_link

    call check_parts(linkage, error)
    if (allocated(error)) return

    linkage%feature = 1
    angle = 0
    width = pi / 4
    do while (angle < 2 * pi)
      width = min(2 * width, 2 * pi - angle)
      do
        call secure(linkage, angle + width / 2, width / 2, feature, bad_joint, bad_link)
        if (bad_joint == 0 .and. bad_link == 0) exit
        width = width / 2
        if (width < narrowest) then
          call report(linkage, angle, bad_joint, bad_link, error)
          return
        end if
      end do
      linkage%feature = min(linkage%feature, feature)
      angle = angle + max(width, spacing(angle))
    end do
  end subroutine turn_once

  subroutine check_parts(linkage, error)
    type(linkage_type), intent(in) :: linkage
    type(error_type), allocatable, intent(out) :: error
    integer :: i, cranks

    cranks = 0
    if (allocated(linkage%joints)) then
      do i = 1, size(linkage%joints)
        select type (joint => linkage%joints(i)%joint)
        type is (crank_joint)
          cranks = cranks + 1
        end select
      end do
    end if
    if (cranks /= 1) then
      call fatal_error(error, "a mechanism needs one joint of type 'crank', not " // achar(iachar("0") + min(cranks, 9)), &
        & invalid_input)
    else if (.not. allocated(linkage%links)) then
      call fatal_error(error, "a mechanism needs at least one link", invalid_input)
    end if
  end subroutine check_parts

  !> Tries to prove that all joints and links are sound within `half_width` of the crank angle `middle`. The place of
  !> the first joint or link for which that fails, else 0.
  subroutine secure(linkage, middle, half_width, feature, bad_joint, bad_link)
    type(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: middle, half_width
    real(dp), intent(out) :: feature
    integer, intent(out) :: bad_joint, bad_link
    type(point_type) :: at(size(linkage%joints))
    type(reach_type) :: reach
    real(dp) :: speeds(size(linkage%joints))
    integer :: i

    feature = huge(1.0_dp)
    bad_joint = 0
    bad_link = 0
    do i = 1, size(linkage%joints)
      reach = linkage%joints(i)%joint%reach(at(:i - 1), speeds(:i - 1), half_width)
      if (.not. reach%assembled) then
        bad_joint = i
        return
      end if
      speeds(i) = reach%speed
      feature = min(feature, reach%feature)
      call linkage%joints(i)%joint%place(middle, at(:i - 1), at(i))
    end do
    do i = 1, size(linkage%links)
      associate (link => linkage%links(i))
        if (link%to == 0) cycle
        if (hypot(at(link%to)%x%v - at(link%from)%x%v, at(link%to)%y%v - at(link%from)%y%v) &
          & > (speeds(link%from) + speeds(link%to)) * half_width) cycle
        bad_link = i
        return
      end associate
    end do
  end subroutine secure

  subroutine report(linkage, angle, bad_joint, bad_link, error)
    type(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: angle
    integer, intent(in) :: bad_joint, bad_link
    type(error_type), allocatable, intent(out) :: error
    type(point_type) :: at(size(linkage%joints))
    character(len=:), allocatable :: place, subject
    integer :: i

    place = " at a crank angle of " // fixed(angle * 180 / pi, 3) // " deg"
    if (bad_link > 0) then
      subject = "link '" // linkage%links(bad_link)%name // "'"
      call fatal_error(error, subject // ": its joints meet" // place, impossible_mechanism, subject)
      return
    end if
    do i = 1, bad_joint - 1
      call linkage%joints(i)%joint%place(angle, at(:i - 1), at(i))
    end do
    associate (bad => linkage%joints(bad_joint))
      subject = "joint '" // bad%name // "'"
      call fatal_error(error, subject // " cannot be assembled or stands at a dead point" // place // ": " &
        & // bad%joint%explain(at(:bad_joint - 1)), impossible_mechanism, subject)
    end associate
  end subroutine report

end module gestell_model_assembly
