!> Crank angles at which the motion of a linkage is not smooth: those at which a cam passes from one part of its law to the next.
module gestell_model_linkage_kinks
  use gestell_base_kinds, only: dp, pi
  use gestell_math_sorting, only: ascending
  use gestell_model_joints_joint, only: named_joint_type, point_type
  use gestell_model_joints_types_follower, only: follower_joint
  implicit none (type, external)
  private

  public :: find_kinks

contains

  !> Finds the kinks of all cams. Between samples of the crank angle, which lie closer than a quarter of `angle_scale`, each cam's
  !> angle is assumed to change its direction at most where the cam nearly rests.
  pure subroutine find_kinks(joints, angle_scale, kinks, jumps)
    type(named_joint_type), intent(in) :: joints(:)
    !> Crank angle over which the motion changes noticeably (rad)
    real(dp), intent(in) :: angle_scale
    !> Crank angles (rad), ascending and strictly between 0 and 2 pi; not allocated if there are none
    real(dp), allocatable, intent(out) :: kinks(:)
    !> True if accelerations jump
    logical, intent(out) :: jumps
    !> Kinks closer to each other (rad) than the rounding errors of angles are one: several cams on a shaft may have the same law
    real(dp), parameter :: apart = 1.0e-10_dp
    real(dp), allocatable :: marks(:), found(:)
    real(dp) :: before, now, rate, step
    integer :: i, k, m

    jumps = .false.
    allocate(found(0))
    step = 2 * pi / ceiling(max(64.0_dp, 8 * pi / angle_scale))
    do i = 1, size(joints)
      select type (joint => joints(i)%joint)
      class is (follower_joint)
        if (.not. allocated(joint%law)) cycle
        jumps = jumps .or. any(abs(joint%law%jumps()) > 0)
        marks = joint%law%kinks()
        call turn_cam(joints(:i - 1), joint, 0.0_dp, before, rate)
        do k = 1, nint(2 * pi / step)
          call turn_cam(joints(:i - 1), joint, k * step, now, rate)
          do m = 1, size(marks)
            if (max(abs(beyond(before, marks(m))), abs(beyond(now, marks(m)))) > pi / 2) cycle
            if ((beyond(before, marks(m)) > 0) .neqv. (beyond(now, marks(m)) > 0)) found = [found, &
              & crossing(joints(:i - 1), joint, marks(m), (k - 1) * step, k * step)]
          end do
          before = now
        end do
      end select
    end do
    if (size(found) == 0) return
    found = found(ascending(found))
    kinks = pack(found, found - [0.0_dp, found(:size(found) - 1)] > apart .and. found < 2 * pi - apart)
  end subroutine find_kinks

  !> Computes a cam's angle (rad) and its rate at a crank angle. `joints`: the joints before the follower.
  pure subroutine turn_cam(joints, follower, crank_angle, theta, rate)
    type(named_joint_type), intent(in) :: joints(:)
    type(follower_joint), intent(in) :: follower
    real(dp), intent(in) :: crank_angle
    real(dp), intent(out) :: theta, rate
    type(point_type) :: at(size(joints))
    integer :: i

    do i = 1, size(joints)
      call joints(i)%joint%locate(crank_angle, at(:i - 1), at(i))
    end do
    call follower%cam_angle(at, theta, rate)
  end subroutine turn_cam

  !> Angle of a cam minus `mark`, between -pi and pi.
  pure real(dp) function beyond(angle, mark)
    real(dp), intent(in) :: angle, mark

    beyond = angle - mark - 2 * pi * anint((angle - mark) / (2 * pi))
  end function beyond

  !> Crank angle between `from` and `to` at which the cam's angle is `mark`, by Newton's method, confined by bisection.
  pure real(dp) function crossing(joints, follower, mark, from, to) result(angle)
    type(named_joint_type), intent(in) :: joints(:)
    type(follower_joint), intent(in) :: follower
    real(dp), intent(in) :: mark, from, to
    real(dp) :: low, high, theta, rate, next
    logical :: starts_beyond
    integer :: iteration

    call turn_cam(joints, follower, from, theta, rate)
    starts_beyond = beyond(theta, mark) > 0
    low = from
    high = to
    angle = (from + to) / 2
    do iteration = 1, 60
      call turn_cam(joints, follower, angle, theta, rate)
      if ((beyond(theta, mark) > 0) .eqv. starts_beyond) then
        low = angle
      else
        high = angle
      end if
      next = (low + high) / 2
      if (abs(rate) * (high - low) > abs(beyond(theta, mark))) next = angle - beyond(theta, mark) / rate
      if (.not. (next > low .and. next < high)) next = (low + high) / 2
      if (abs(next - angle) <= 2 * epsilon(angle) * to) return
      angle = next
    end do
  end function crossing

end module gestell_model_linkage_kinks
