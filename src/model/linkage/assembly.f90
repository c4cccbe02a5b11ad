!> Proves that a linkage can be assembled at every crank angle, not only at sampled ones.
module gestell_model_linkage_assembly
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: fixed, text
  use gestell_model_linkage_bodies, only: link_type
  use gestell_model_linkage_closure, only: explain_closure
  use gestell_model_joints_deviation, only: deviation_type, disc
  use gestell_model_joints_path, only: turning_scale
  use gestell_model_joints_joint, only: named_joint_type, point_type, reach_type, slack
  implicit none (type, external)
  private

  public :: prove_assembly

  !> A joint that cannot be secured over this angle (rad) stands at a dead point: near one the proof needs ever shorter
  !> intervals. About the angle between its links (rad) squared.
  real(dp), parameter :: narrowest = 1.0e-9_dp
  !> Intervals over the turn, at the most.
  integer, parameter :: most_intervals = 1000000

contains

  !> Marches over the whole turn in intervals that are each proved from their middle: bounds on the joints' speeds pass
  !> from joint to joint and limit how far each can move within the interval. `angle_scale`: the crank angle (rad) over which
  !> the motion changes noticeably; `intervals`: how many were tried.
  !> Errors: a joint that cannot be assembled or reaches a dead point; a link whose two joints meet; too many intervals. They
  !> are named with the angle of the drive, which turns `turns` times, else once.
  subroutine prove_assembly(joints, links, angle_scale, intervals, error, turns)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    real(dp), intent(out) :: angle_scale
    integer, intent(out) :: intervals
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: turns
    real(dp) :: angle, width, local
    integer :: bad_joint, bad_link, of_drive

    of_drive = 1
    if (present(turns)) of_drive = turns
    angle_scale = 1
    intervals = 0
    angle = 0
    width = pi / 4
    do while (angle < 2 * pi)
      width = min(2 * width, 2 * pi - angle)
      do
        intervals = intervals + 1
        call secure(joints, links, angle + width / 2, width / 2, local, bad_joint, bad_link)
        if (bad_joint == 0 .and. bad_link == 0) exit
        width = width / 2
        if (intervals >= most_intervals) then
          call give_up(joints, links, angle * of_drive, bad_joint, bad_link, error)
          return
        else if (width < narrowest) then
          call report(joints, links, angle, of_drive, bad_joint, bad_link, error)
          return
        end if
      end do
      angle_scale = min(angle_scale, local)
      angle = angle + max(width, spacing(angle))
    end do
  end subroutine prove_assembly

  !> Tries to prove that all joints and links are sound within `half_width` of the crank angle `middle`. The index of
  !> the first joint or link for which that fails, else 0.
  subroutine secure(joints, links, middle, half_width, angle_scale, bad_joint, bad_link)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    real(dp), intent(in) :: middle, half_width
    real(dp), intent(out) :: angle_scale
    integer, intent(out) :: bad_joint, bad_link
    type(point_type) :: at(size(joints))
    type(reach_type) :: reach
    type(deviation_type) :: deviations(size(joints)), beyond
    real(dp) :: speeds(size(joints)), accelerations(size(joints))
    integer :: i

    angle_scale = huge(1.0_dp)
    bad_joint = 0
    bad_link = 0
    do i = 1, size(joints)
      reach = joints(i)%joint%reach(at(:i - 1), speeds(:i - 1), accelerations(:i - 1), half_width)
      if (.not. reach%assembled) then
        bad_joint = i
        return
      end if
      angle_scale = min(angle_scale, reach%angle_scale)
      call joints(i)%joint%locate(middle, at(:i - 1), at(i))
      ! Acceleration and speed in the middle are known, so in short intervals bounds do not pile up along a chain.
      deviations(i) = joints(i)%joint%deviation(at(:i - 1), at(i), deviations(:i - 1), reach%acceleration, half_width)
      beyond = disc(reach%acceleration + hypot(at(i)%x%dd, at(i)%y%dd))
      if (.not. deviations(i)%radius() < beyond%radius()) deviations(i) = beyond
      accelerations(i) = min(reach%acceleration, hypot(at(i)%x%dd, at(i)%y%dd) + slack * deviations(i)%radius())
      speeds(i) = min(reach%speed, hypot(at(i)%x%d, at(i)%y%d) + slack * accelerations(i) * half_width)
    end do
    do i = 1, size(links)
      associate (link => links(i))
        if (link%to == 0) cycle
        if (.not. hypot(at(link%to)%x%v - at(link%from)%x%v, at(link%to)%y%v - at(link%from)%y%v) &
          & > slack * (speeds(link%from) + speeds(link%to)) * half_width) then
          bad_link = i
          return
        end if
        angle_scale = min(angle_scale, turning_scale(at(link%from), at(link%to)))
      end associate
    end do
  end subroutine secure

  subroutine give_up(joints, links, angle, bad_joint, bad_link, error)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    real(dp), intent(in) :: angle
    integer, intent(in) :: bad_joint, bad_link
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: subject

    if (bad_joint > 0) then
      subject = "joint '" // joints(bad_joint)%name // "'"
    else
      subject = "link '" // links(bad_link)%name // "'"
    end if
    call fatal_error(error, subject // ": that it passes a crank angle of " // fixed(angle * 180 / pi, 3) // " deg is not " &
      & // "proved within " // text(most_intervals) // " intervals of the turn: too close to a dead point, or too long a chain", &
      & impossible_mechanism, subject)
  end subroutine give_up

  subroutine report(joints, links, angle, turns, bad_joint, bad_link, error)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    real(dp), intent(in) :: angle
    integer, intent(in) :: turns, bad_joint, bad_link
    type(error_type), allocatable, intent(out) :: error
    type(point_type) :: at(size(joints))
    character(len=:), allocatable :: there, subject, reason, closure
    integer :: i

    there = " at a crank angle of " // fixed(angle * turns * 180 / pi, 3) // " deg"
    if (bad_link > 0) then
      subject = "link '" // links(bad_link)%name // "'"
      call fatal_error(error, subject // ": its joints meet" // there, impossible_mechanism, subject)
      return
    end if
    do i = 1, bad_joint - 1
      call joints(i)%joint%locate(angle, at(:i - 1), at(i))
    end do
    associate (bad => joints(bad_joint))
      subject = "joint '" // bad%name // "'"
      call bad%joint%explain(at(:bad_joint - 1), reason)
      call explain_closure(joints, bad_joint, turns, closure)
      call fatal_error(error, subject // " cannot be assembled or stands at a dead point" // there // ": " // reason // closure, &
        & impossible_mechanism, subject)
    end associate
  end subroutine report

end module gestell_model_linkage_assembly
