!> Where a joint that cannot be assembled at every crank angle can be: for the message that refuses the mechanism.
module gestell_model_linkage_closure
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, fixed
  use gestell_model_joints_joint, only: named_joint_type, point_type, reach_type
  use gestell_model_joints_types_crank, only: crank_joint
  use gestell_model_joints_types_ground, only: ground_joint
  use gestell_model_joints_types_rrr, only: rrr_joint
  implicit none (type, external)
  private

  public :: explain_closure

  !> Angles of the turn at which it is tried, every 4 deg; halvings that refine the ends of intervals; intervals that are listed.
  integer, parameter :: samples = 90, halvings = 24, most_listed = 3

contains

  !> Between which crank angles joint number `bad` can be assembled, and what kind of four-bar it belongs to; starts with "; ". The
  !> drive turns `turns` times in the turn.
  subroutine explain_closure(joints, bad, turns, words)
    type(named_joint_type), intent(in) :: joints(:)
    integer, intent(in) :: bad, turns
    character(len=:), allocatable, intent(out) :: words
    real(dp), parameter :: step = 2 * pi / samples, aside = 0.37_dp
    logical :: closes(0:samples)
    real(dp) :: from, to
    integer :: first, k, found

    ! Aside of round angles, where dead points lie.
    closes = [(assembled(joints, bad, (k + aside) * step), k = 0, samples)]
    if (.not. any(closes)) then
      words = "; it closes at no crank angle" // four_bar(joints, bad)
      return
    else if (all(closes)) then
      words = "; elsewhere it closes, but for gaps of less than 4 deg" // four_bar(joints, bad)
      return
    end if
    words = "; it closes"
    ! From an angle at which it does not close once round.
    first = findloc(closes, .false., dim=1) - 1
    found = 0
    do k = first + 1, first + samples
      if (closes(modulo(k, samples)) .and. .not. closes(modulo(k - 1, samples))) then
        from = end_of(k - 1, k)
      else if (closes(modulo(k - 1, samples)) .and. .not. closes(modulo(k, samples))) then
        to = end_of(k, k - 1)
        found = found + 1
        if (found > 1 .and. found <= most_listed) words = words // ","
        if (found <= most_listed) words = words // " from " // degrees(from) // " to " // degrees(to)
        if (found == most_listed + 1) words = words // ", ..."
      end if
    end do
    words = words // " deg" // four_bar(joints, bad)

  contains

    !> The angle between an open sample and a closing one beside it at which it begins to close.
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

    pure function degrees(angle) result(number)
      real(dp), intent(in) :: angle
      character(len=:), allocatable :: number

      number = fixed(modulo(angle * turns * 180 / pi, 360.0_dp * turns), 2)
    end function degrees

  end subroutine explain_closure

  !> Whether all joints up to number `bad` can be assembled at a crank angle.
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
      reach = joints(i)%joint%reach(at(:i - 1), still(:i - 1), still(:i - 1), 0.0_dp)
      assembled = reach%assembled
      if (.not. assembled) return
      call joints(i)%joint%locate(angle, at(:i - 1), at(i))
    end do
  end function assembled

  !> Of a dyad between the crank and the ground: that it is a parallelogram, or no Grashof linkage; else empty.
  function four_bar(joints, bad) result(words)
    type(named_joint_type), intent(in) :: joints(:)
    integer, intent(in) :: bad
    character(len=:), allocatable :: words
    real(dp), parameter :: rounding = 1.0e-9_dp
    type(point_type) :: at(bad)
    real(dp) :: bars(4)
    integer :: i, crank, ground, pivot

    words = ""
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
      words = "; it is a parallelogram: describe its second arm by another joint of type 'crank', with the same radius and phase " &
        & // "about its own pivot"
    else if (minval(bars) + maxval(bars) > (sum(bars) - minval(bars) - maxval(bars)) * (1 + rounding)) then
      words = "; no Grashof linkage: the shortest and the longest bar, " // concise(minval(bars) + maxval(bars), 6) &
        & // " m together, are longer than the other two, " // concise(sum(bars) - minval(bars) - maxval(bars), 6) // " m"
    end if
  end function four_bar

end module gestell_model_linkage_closure
