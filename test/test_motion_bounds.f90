!> Bounds that joints state for an interval of the crank angle hold in it, however their earlier joints move.
module test_motion_bounds
  use checks, only: check_that
  use gestell_math_jet, only: jet
  use gestell_base_kinds, only: dp
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: joint_type, point_type, reach_type
  use gestell_model_joints_types_crank, only: crank_joint
  use gestell_model_joints_types_cylinder, only: cylinder_joint
  use gestell_model_joints_types_follower, only: follower_joint
  use gestell_model_joints_types_prp, only: prp_joint
  use gestell_model_joints_types_rigid, only: rigid_joint
  use gestell_model_joints_types_rpp, only: rpp_joint
  use gestell_model_joints_types_rpr, only: rpr_joint
  use gestell_model_joints_types_rrp, only: rrp_joint
  use gestell_model_joints_types_rrr, only: rrr_joint
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: collect_motion_bounds

  !> Earlier joints that move along straight lines with known speeds.
  integer, parameter :: earlier = 5

  !> Linear congruential generator of Park and Miller.
  integer, parameter :: long = selected_int_kind(12)
  type :: random_type
    integer(long) :: state = 1
  end type random_type

contains

  subroutine collect_motion_bounds(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("bounds on the motion of a dyad of three turning pairs hold", test_rrr), &
      & new_unittest("bounds on the motion of a slider on a fixed guide hold", test_fixed_rrp), &
      & new_unittest("bounds on the motion of a slider on a carried guide hold", test_moving_rrp), &
      & new_unittest("bounds on the motion of a slotted lever hold", test_rpr), &
      & new_unittest("bounds on the motion of a point of a rigid body hold", test_rigid), &
      & new_unittest("bounds on the motion of two sliders hold", test_prp), &
      & new_unittest("bounds on the motion of yokes hold", test_rpp), &
      & new_unittest("bounds on the motion of cam followers hold", test_follower), &
      & new_unittest("bounds on the motion of a crank on a moving pivot hold", test_crank), &
      & new_unittest("bounds on the motion of cylinders hold", test_cylinder)]
  end subroutine collect_motion_bounds

  !> Uniformly in [low, high].
  real(dp) function draw(random, low, high)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: low, high

    random%state = modulo(48271_long * random%state, 2147483647_long)
    draw = low + (high - low) * real(random%state, dp) / 2147483647
  end function draw

  !> Positions and velocities of the earlier joints. In every other case the first two approach each other.
  subroutine scatter(random, number, places, velocities)
    type(random_type), intent(inout) :: random
    integer, intent(in) :: number
    real(dp), intent(out) :: places(2, earlier), velocities(2, earlier)
    real(dp) :: when
    integer :: i, k

    do k = 1, earlier
      do i = 1, 2
        places(i, k) = draw(random, -1.0_dp, 1.0_dp)
        velocities(i, k) = draw(random, -1.0_dp, 1.0_dp)
      end do
      velocities(:, k) = velocities(:, k) * merge(0.0_dp, 1.0_dp, draw(random, 0.0_dp, 1.0_dp) < 0.3_dp)
    end do
    if (modulo(number, 2) == 1) return
    when = draw(random, 0.05_dp, 0.5_dp)
    velocities(:, 2) = velocities(:, 1) - (places(:, 2) - places(:, 1)) / when
    velocities(1, 2) = velocities(1, 2) + draw(random, -0.1_dp, 0.1_dp)
  end subroutine scatter

  !> Checks the bounds of `joint` for earlier joints that start from `places` with the constant `velocities`. `tightest`: the
  !> largest observed speed relative to its bound, `proved`: number of bounds that were given.
  subroutine check_claims(joint, places, velocities, half_width, tightest, proved, error)
    class(joint_type), intent(in) :: joint
    real(dp), intent(in) :: places(2, earlier), velocities(2, earlier), half_width
    real(dp), intent(inout) :: tightest
    integer, intent(inout) :: proved
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: samples = 40
    type(point_type) :: here
    type(reach_type) :: claim
    real(dp) :: speed
    integer :: k

    claim = joint%reach_at(0.0_dp, moved(0.0_dp), norm2(velocities, dim=1), spread(0.0_dp, 1, earlier), half_width)
    if (.not. claim%assembled) return
    proved = proved + 1
    call check_that(error, claim%angle_scale, ">", 0.0_dp, "angle scale")
    if (allocated(error)) return
    do k = -samples, samples
      call joint%locate(half_width * k / samples, moved(half_width * k / samples), here)
      speed = hypot(here%x%d, here%y%d)
      call check_that(error, hypot(here%x%dd, here%y%dd), "<=", claim%acceleration * (1 + 1.0e-9_dp) + 1.0e-9_dp, "acceleration")
      if (allocated(error)) return
      call check(error, ieee_is_finite(speed), more="claimed to be assembled")
      if (allocated(error)) return
      ! Rounding errors of a few epsilon, amplified close to a dead point.
      call check_that(error, speed, "<=", claim%speed * (1 + 1.0e-9_dp) + 1.0e-12_dp, "claimed speed")
      if (allocated(error)) return
      if (claim%speed > 0) tightest = max(tightest, speed / claim%speed)
    end do

  contains

    function moved(angle) result(points)
      real(dp), intent(in) :: angle
      type(point_type) :: points(earlier)
      integer :: i

      do i = 1, earlier
        points(i) = point_type(jet(places(1, i) + angle * velocities(1, i), velocities(1, i), 0.0_dp), &
          & jet(places(2, i) + angle * velocities(2, i), velocities(2, i), 0.0_dp))
      end do
    end function moved

  end subroutine check_claims

  !> Intervals from wide ones down to single points, in turn.
  pure real(dp) function width(number)
    integer, intent(in) :: number
    real(dp), parameter :: widths(0:4) = [0.5_dp, 0.2_dp, 0.05_dp, 1.0e-2_dp, 1.0e-6_dp]

    width = widths(modulo(number / 2, 5))
  end function width

  !> Bounds that are always far above the speeds, or never given, would prove nothing.
  subroutine check_use(tightest, least, proved, error)
    real(dp), intent(in) :: tightest, least
    integer, intent(in) :: proved
    type(error_type), allocatable, intent(out) :: error

    call check_that(error, tightest, ">", least, "bounds are not too wide")
    call check_that(error, proved, ">", 100, "bounds were given")
  end subroutine check_use

  subroutine test_rrr(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest, lengths(2)
    integer :: i, proved

    tightest = 0
    proved = 0
    do i = 1, 4000
      call scatter(random, i, places, velocities)
      ! Lengths of all sizes, and every third time close to one of the dead points.
      lengths = [draw(random, 0.3_dp, 1.0_dp), draw(random, 0.3_dp, 1.0_dp)]
      if (modulo(i, 3) == 0) lengths = norm2(places(:, 2) - places(:, 1)) * (0.5_dp + draw(random, 0.0_dp, 0.05_dp))
      if (modulo(i, 3) == 1) lengths(1) = lengths(2) + norm2(places(:, 2) - places(:, 1)) * draw(random, 0.9_dp, 1.0_dp)
      if (modulo(i, 6) == 1) lengths = lengths(2:1:-1)
      call check_claims(rrr_joint([1, 2], lengths, merge(1, -1, modulo(i, 4) < 2)), places, velocities, width(i), tightest, &
        & proved, error)
      if (allocated(error)) return
    end do
    ! |v| = (v1 + v2) / sin mu where both ends move along the other's link.
    call check_use(tightest, 0.95_dp, proved, error)
  end subroutine test_rrr

  subroutine test_fixed_rrp(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest, length
    integer :: i, proved

    tightest = 0
    proved = 0
    do i = 1, 3000
      call scatter(random, i, places, velocities)
      length = draw(random, 0.2_dp, 1.5_dp)
      call check_claims(rrp_joint(guide_type(angle=draw(random, 0.0_dp, 6.3_dp)), 3, length, merge(1, -1, modulo(i, 4) < 2)), &
        & places, velocities, width(i), tightest, proved, error)
      if (allocated(error)) return
    end do
    ! |v| = v_end / c where the end moves along its rod.
    call check_use(tightest, 0.9_dp, proved, error)
  end subroutine test_fixed_rrp

  !> A guide on the body of the first two joints, in any place and direction.
  type(guide_type) function carried(random) result(guide)
    type(random_type), intent(inout) :: random

    guide = guide_type([1, 2], [draw(random, -1.0_dp, 1.0_dp), draw(random, -1.0_dp, 1.0_dp)], draw(random, 0.0_dp, 6.3_dp))
    if (draw(random, 0.0_dp, 1.0_dp) < 0.3_dp) guide%point = 0
  end function carried

  subroutine test_moving_rrp(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest, length
    integer :: i, proved

    tightest = 0
    proved = 0
    do i = 1, 6000
      call scatter(random, i, places, velocities)
      length = draw(random, 0.2_dp, 2.5_dp)
      call check_claims(rrp_joint(carried(random), 3, length, merge(1, -1, modulo(i, 4) < 2)), places, velocities, width(i), &
        & tightest, proved, error)
      if (allocated(error)) return
    end do
    ! The parts of the bound rarely reach their limits at once.
    call check_use(tightest, 0.3_dp, proved, error)
  end subroutine test_moving_rrp

  subroutine test_rpr(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest
    integer :: i, proved

    tightest = 0
    proved = 0
    do i = 1, 4000
      call scatter(random, i, places, velocities)
      call check_claims(rpr_joint([1, 2], draw(random, 0.1_dp, 2.0_dp), merge(1, -1, modulo(i, 4) < 2)), places, velocities, &
        & width(i), tightest, proved, error)
      if (allocated(error)) return
    end do
    ! An end that moves across the lever turns it as fast as is bounded.
    call check_use(tightest, 0.95_dp, proved, error)
  end subroutine test_rpr

  subroutine test_rigid(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest
    integer :: i, proved

    tightest = 0
    proved = 0
    do i = 1, 4000
      call scatter(random, i, places, velocities)
      call check_claims(rigid_joint([1, 2], [draw(random, -1.0_dp, 1.0_dp), draw(random, -1.0_dp, 1.0_dp)]), places, velocities, &
        & width(i), tightest, proved, error)
      if (allocated(error)) return
    end do
    call check_use(tightest, 0.95_dp, proved, error)
  end subroutine test_rigid

  !> One guide fixed and one carried, or both carried by bodies that share a joint.
  subroutine test_prp(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    type(guide_type) :: guides(2)
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest
    integer :: i, proved

    tightest = 0
    proved = 0
    do i = 1, 6000
      call scatter(random, i, places, velocities)
      guides = [carried(random), guide_type(angle=draw(random, 0.0_dp, 6.3_dp))]
      if (modulo(i, 5) < 2) guides(2) = guide_type([3, 2], [0.3_dp, 0.0_dp], draw(random, 0.0_dp, 6.3_dp))
      if (modulo(i, 3) == 0) guides = guides(2:1:-1)
      call check_claims(prp_joint(guides), places, velocities, width(i), tightest, proved, error)
      if (allocated(error)) return
    end do
    call check_use(tightest, 0.3_dp, proved, error)
  end subroutine test_prp

  subroutine test_rpp(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    type(guide_type) :: guide
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest
    integer :: i, proved

    tightest = 0
    proved = 0
    do i = 1, 6000
      call scatter(random, i, places, velocities)
      guide = carried(random)
      if (modulo(i, 3) == 0) guide%carriers = 0
      call check_claims(rpp_joint(guide, 3, draw(random, -3.0_dp, 3.0_dp)), places, velocities, width(i), tightest, proved, error)
      if (allocated(error)) return
    end do
    ! With a fixed guide |v| = v_end / sin where the end moves across the slot.
    call check_use(tightest, 0.9_dp, proved, error)
    if (allocated(error)) return

    ! A slot along its guide meets it nowhere.
    call scatter(random, 1, places, velocities)
    proved = 0
    call check_claims(rpp_joint(guide_type(), 3, 0.0_dp), places, velocities, 0.1_dp, tightest, proved, error)
    if (allocated(error)) return
    call check(error, proved, 0, more="a slot along its guide")
  end subroutine test_rpp

  subroutine test_follower(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    type(guide_type) :: guide
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest, lift(7)
    integer :: i, k, proved

    tightest = 0
    proved = 0
    do i = 1, 6000
      call scatter(random, i, places, velocities)
      guide = carried(random)
      if (modulo(i, 3) == 0) guide%carriers = 0
      lift = [(draw(random, -1.0_dp, 1.0_dp), k = 1, 7)]
      ! Every other lift has one order alone.
      if (modulo(i, 4) < 2) lift(4:) = 0
      call check_claims(follower_joint(guide, guide_type([3, 4], angle=draw(random, -3.0_dp, 3.0_dp)), lift), places, &
        & velocities, width(i), tightest, proved, error)
      if (allocated(error)) return
    end do
    ! With a fixed guide |v| = A omega where the slope of a lift of one order is steepest and the cam's joints move in opposite
    ! directions.
    call check_use(tightest, 0.9_dp, proved, error)
  end subroutine test_follower

  !> The crank turns with unit rate about a pivot that may move.
  subroutine test_crank(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest
    integer :: i, proved

    tightest = 0
    proved = 0
    do i = 1, 1000
      call scatter(random, i, places, velocities)
      call check_claims(crank_joint(pivot=3, radius=draw(random, 0.1_dp, 1.0_dp), phase=draw(random, 0.0_dp, 6.3_dp)), &
        & places, velocities, width(i), tightest, proved, error)
      if (allocated(error)) return
    end do
    call check_use(tightest, 0.95_dp, proved, error)
  end subroutine test_crank

  !> Levers with lengths of all sizes or close to a dead point, and sliders on fixed and carried guides.
  subroutine test_cylinder(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    type(guide_type) :: guide
    real(dp) :: places(2, earlier), velocities(2, earlier), tightest(2), stroke(5), lever, phase
    integer :: i, k, proved(2)

    tightest = 0
    proved = 0
    do i = 1, 8000
      call scatter(random, i, places, velocities)
      stroke = [draw(random, 0.3_dp, 1.0_dp), (draw(random, -0.2_dp, 0.2_dp), k = 2, 5)]
      lever = draw(random, 0.3_dp, 1.0_dp)
      phase = draw(random, 0.0_dp, 6.3_dp)
      if (modulo(i, 3) == 0) stroke(4:) = 0
      if (modulo(i, 5) == 0) stroke(1) = norm2(places(:, 2) - places(:, 1)) - lever
      if (modulo(i, 5) == 1) stroke(1) = norm2(places(:, 2) - places(:, 1)) + lever
      guide = carried(random)
      if (modulo(i, 3) == 0) guide%carriers = 0
      if (modulo(i, 4) < 3) then
        call check_claims(cylinder_joint(stroke=stroke, ends=[1, 2], lever=lever, branch=merge(1, -1, modulo(i, 2) == 0), &
          & phase=phase), places, velocities, width(i), tightest(1), proved(1), error)
      else
        call check_claims(cylinder_joint(stroke=stroke, guide=guide, phase=phase, ratio=2), places, velocities, width(i), &
          & tightest(2), proved(2), error)
      end if
      if (allocated(error)) return
    end do
    ! |v| = |L'| / sin mu where both ends rest and L changes fastest; on a fixed guide |v| = |L'|.
    do k = 1, 2
      call check_use(tightest(k), 0.9_dp, proved(k), error)
      if (allocated(error)) return
    end do
  end subroutine test_cylinder

end module test_motion_bounds
