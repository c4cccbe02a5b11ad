!> Proves that a linkage can be assembled at every crank angle, and not only at sampled angles; see the section "Assembly over the
!> whole turn" in doc/theory.md.
module gestell_model_linkage_assembly
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, fixed, text
  use gestell_model_linkage_bodies, only: link_type
  use gestell_model_joints_deviation, only: deviation_type, disc
  use gestell_model_joints_path, only: turning_scale
  use gestell_model_joints_joint, only: named_joint_type, point_type, reach_type, slack
  use gestell_model_joints_types_crank, only: crank_joint
  use gestell_model_joints_types_ground, only: ground_joint
  use gestell_model_joints_types_rrr, only: rrr_joint
  implicit none (type, external)
  private

  public :: prove_assembly

  !> Shortest interval of the crank angle (rad) that the proof tries. If the proof fails even in this interval, the joint is
  !> reported to be at a dead point, because near a dead point the proof needs ever shorter intervals. The angle between the joint's
  !> links is then about the square root of the interval (rad).
  real(dp), parameter :: narrowest = 1.0e-9_dp
  !> Maximum number of intervals of the crank angle over one turn.
  integer, parameter :: max_intervals = 1000000
  !> Limits for messages about a joint that cannot turn. `samples`: number of crank angles that are tried, one every 4 deg.
  !> `halvings`: number of bisections for each end of a range in which the joint can be assembled. `max_listed`: maximum number of
  !> these ranges that are listed.
  integer, parameter :: samples = 90, halvings = 24, max_listed = 3

contains

  !> Proves interval by interval that the linkage can turn. In each interval, bounds on the speeds are passed from joint to joint.
  !> The bounds limit the distance of each joint from its position in the middle. Fails if a joint cannot be assembled or reaches a
  !> dead point, if the two joints of a link coincide, or if too many intervals are needed. Error messages give the angle of the
  !> drive.
  subroutine prove_assembly(joints, links, angle_scale, intervals, error, turns)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    !> Crank angle over which the motion changes noticeably (rad)
    real(dp), intent(out) :: angle_scale
    !> Number of intervals in which the proof was tried
    integer, intent(out) :: intervals
    type(error_type), allocatable, intent(out) :: error
    !> Number of turns of the drive while the crank angle grows by 2 pi; 1 by default
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
        call prove_interval(joints, links, angle + width / 2, width / 2, local, bad_joint, bad_link)
        if (bad_joint == 0 .and. bad_link == 0) exit
        width = width / 2
        if (intervals >= max_intervals .or. width < narrowest) then
          call report(joints, links, angle, of_drive, bad_joint, bad_link, intervals >= max_intervals, error)
          return
        end if
      end do
      angle_scale = min(angle_scale, local)
      angle = angle + max(width, spacing(angle))
    end do
  end subroutine prove_assembly

  !> Tries to prove two statements for crank angles within `half_width` of `middle` (rad): every joint can be assembled, and the two
  !> joints of each link do not coincide. Returns the index of the first joint or link for which the proof fails, or 0.
  subroutine prove_interval(joints, links, middle, half_width, angle_scale, bad_joint, bad_link)
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
      reach = joints(i)%joint%reach_at(middle, at(:i - 1), speeds(:i - 1), accelerations(:i - 1), half_width)
      if (.not. reach%assembled) then
        bad_joint = i
        return
      end if
      angle_scale = min(angle_scale, reach%angle_scale)
      call joints(i)%joint%locate(middle, at(:i - 1), at(i))
      ! Acceleration and speed in the middle are known, so that bounds over short intervals do not grow along a chain.
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
  end subroutine prove_interval

  !> Composes the error message about a joint or a link at a crank angle. `intervals_used_up`: true if the permitted number of
  !> intervals is exhausted; the message then says that nothing is proved.
  subroutine report(joints, links, angle, turns, bad_joint, bad_link, intervals_used_up, error)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    real(dp), intent(in) :: angle
    integer, intent(in) :: turns, bad_joint, bad_link
    logical, intent(in) :: intervals_used_up
    type(error_type), allocatable, intent(out) :: error
    type(point_type) :: at(size(joints))
    character(len=:), allocatable :: there, subject, reason, closure
    integer :: i

    there = " a crank angle of " // fixed(angle * turns * 180 / pi, 3) // " deg"
    if (bad_joint > 0) then
      subject = "joint '" // joints(bad_joint)%name // "'"
    else
      subject = "link '" // links(bad_link)%name // "'"
    end if
    if (intervals_used_up) then
      reason = ": " // text(max_intervals) // " intervals of the crank angle are not enough to prove that it can be assembled " // &
        &   "at" // there // ": it comes too close to a dead point, or the chain of joints is too long"
    else if (bad_joint == 0) then
      reason = ": the link's two joints coincide at" // there
    else
      do i = 1, bad_joint - 1
        call joints(i)%joint%locate(angle, at(:i - 1), at(i))
      end do
      call joints(bad_joint)%joint%explain(at(:bad_joint - 1), reason)
      call explain_closure(joints, bad_joint, turns, closure)
      reason = " cannot be assembled or is at a dead point at" // there // ": " // reason // closure
    end if
    call fatal_error(error, subject // reason, impossible_mechanism, subject)
  end subroutine report

  !> Describes, for an error message, the crank angles at which joint number `bad` can be assembled. If the joint belongs to a
  !> four-bar linkage, also describes this linkage. The text starts with "; ". The drive turns `turns` times while the crank angle
  !> grows by 2 pi.
  subroutine explain_closure(joints, bad, turns, words)
    type(named_joint_type), intent(in) :: joints(:)
    integer, intent(in) :: bad, turns
    character(len=:), allocatable, intent(out) :: words
    real(dp), parameter :: step = 2 * pi / samples, aside = 0.37_dp
    logical :: closes(0:samples)
    real(dp) :: from, to
    integer :: first, k, range_count

    ! Samples avoid round angles, where dead points often lie.
    closes = [(assembled(joints, bad, (k + aside) * step), k = 0, samples)]
    if (.not. any(closes)) then
      words = "; it cannot be assembled at any crank angle"
    else if (all(closes)) then
      words = "; it can be assembled at all other angles that were tested; gaps narrower than 4 deg may have been missed"
    else
      words = "; it can be assembled"
      ! Goes through one turn, from an angle at which the joint cannot be assembled.
      first = findloc(closes, .false., dim=1) - 1
      range_count = 0
      do k = first + 1, first + samples
        if (closes(modulo(k, samples)) .and. .not. closes(modulo(k - 1, samples))) then
          from = end_of(k - 1, k)
        else if (closes(modulo(k - 1, samples)) .and. .not. closes(modulo(k, samples))) then
          to = end_of(k, k - 1)
          range_count = range_count + 1
          if (range_count > 1 .and. range_count <= max_listed) words = words // ","
          if (range_count <= max_listed) words = words // " from " // fixed(degrees(from), 2) // " to " // fixed(degrees(to), 2)
          if (range_count == max_listed + 1) words = words // ", ..."
        end if
      end do
      words = words // " deg"
    end if
    call add_four_bar(joints, bad, words)

  contains

    !> Crank angle (rad) at the end of a range in which the joint can be assembled. It is found by bisection between two
    !> neighbouring samples: at `open` the joint cannot be assembled, at `closed` it can.
    real(dp) function end_of(open, closed) result(angle)
      integer, intent(in) :: open, closed
      real(dp) :: outside
      integer :: i

      outside = (open + aside) * step
      angle = (closed + aside) * step
      do i = 1, halvings
        if (assembled(joints, bad, (outside + angle) / 2)) then
          angle = (outside + angle) / 2
        else
          outside = (outside + angle) / 2
        end if
      end do
    end function end_of

    pure real(dp) function degrees(angle)
      real(dp), intent(in) :: angle

      degrees = modulo(angle * turns * 180 / pi, 360.0_dp * turns)
    end function degrees

  end subroutine explain_closure

  !> True if all joints up to number `bad` can be assembled at this crank angle (rad).
  logical function assembled(joints, bad, angle)
    type(named_joint_type), intent(in) :: joints(:)
    integer, intent(in) :: bad
    real(dp), intent(in) :: angle
    type(point_type) :: at(bad)
    type(reach_type) :: reach
    real(dp) :: still(bad)
    integer :: i

    still = 0
    assembled = .true.
    do i = 1, bad
      reach = joints(i)%joint%reach_at(angle, at(:i - 1), still(:i - 1), still(:i - 1), 0.0_dp)
      assembled = reach%assembled
      if (.not. assembled) return
      call joints(i)%joint%locate(angle, at(:i - 1), at(i))
    end do
  end function assembled

  !> If the joint is a dyad between the crank and the ground, adds to the message that the linkage is a parallelogram or not a
  !> Grashof linkage.
  subroutine add_four_bar(joints, bad, words)
    type(named_joint_type), intent(in) :: joints(:)
    integer, intent(in) :: bad
    character(len=:), allocatable, intent(inout) :: words
    real(dp), parameter :: rounding = 1.0e-9_dp
    type(point_type) :: at(bad)
    real(dp) :: bars(4)
    integer :: i, crank, ground, pivot

    select type (dyad => joints(bad)%joint)
    class is (rrr_joint)
      crank = 0
      ground = 0
      do i = 1, 2
        select type (joint => joints(dyad%ends(i))%joint)
        class is (crank_joint)
          crank = i
          pivot = joint%pivot
          bars(1) = joint%radius
        class is (ground_joint)
          ground = i
        end select
      end do
      if (crank == 0 .or. ground == 0) return
      do i = 1, bad - 1
        call joints(i)%joint%locate(0.0_dp, at(:i - 1), at(i))
      end do
      associate (foot => at(dyad%ends(ground)), centre => at(pivot))
        bars(2:) = [dyad%lengths(crank), dyad%lengths(ground), hypot(foot%x%v - centre%x%v, foot%y%v - centre%y%v)]
      end associate
    class default
      return
    end select
    if (all(abs(bars(:2) - bars([3, 4])) <= rounding * maxval(bars))) then
      words = words // "; it belongs to a parallelogram linkage: describe the second arm by another joint of type 'crank', " // &
        &   "with the same radius and phase, about the arm's own pivot"
    else if (minval(bars) + maxval(bars) > (sum(bars) - minval(bars) - maxval(bars)) * (1 + rounding)) then
      words = words // "; the four-bar linkage is not a Grashof linkage: the shortest and the longest bar, together " &
        & // concise(minval(bars) + maxval(bars), 6) // " m, are longer than the other two, together " &
        & // concise(sum(bars) - minval(bars) - maxval(bars), 6) // " m"
    end if
  end subroutine add_four_bar

end module gestell_model_linkage_assembly
