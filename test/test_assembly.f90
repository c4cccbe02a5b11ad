!> Linkages that cannot be assembled are refused with joint and angle, and invalid parts are refused.
module test_assembly
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_linkage, only: linkage_type
  use machines, only: linkage_of_machine, new_crank
  use reference_machine, only: khang_machine
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: collect_assembly

contains

  subroutine collect_assembly(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a linkage that comes apart over part of the turn is refused", test_partial_turn), &
      & new_unittest("a linkage that comes apart between all samples is refused", test_narrow_gap), &
      & new_unittest("a parallelogram is refused at its change point, a dead point", test_change_point), &
      & new_unittest("a linkage that only just clears its dead point is accepted", test_nearly_dead), &
      & new_unittest("the angle scale is the distance to the nearest dead point", test_angle_scales), &
      & new_unittest("the error names the second dyad if that one locks", test_second_dyad), &
      & new_unittest("a link whose two joints coincide at some angle is refused", test_coinciding_joints), &
      & new_unittest("the error gives the angle of the dead point for every joint type", test_dead_points), &
      & new_unittest("links, joints and frames with invalid data are refused", test_refused)]
  end subroutine collect_assembly

  !> Turns a four-bar with crank a, coupler b, rocker c, ground d.
  subroutine turn_four_bar(a, b, c, d, failure)
    real(dp), intent(in) :: a, b, c, d
    type(gestell_error), allocatable, intent(out) :: failure
    type(linkage_type) :: linkage

    call linkage%ground("A0", [0.0_dp, 0.0_dp], failure)
    call linkage%ground("B0", [d, 0.0_dp], failure)
    call linkage%crank("A", "A0", a, 0.0_dp, failure)
    call linkage%rrr("B", ["A ", "B0"], [b, c], 1, failure)
    call linkage%link("coupler", "A", "B", 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
    call linkage%prepare(failure)
  end subroutine turn_four_bar

  !> The ends drift apart to b + c where cos phi = (a^2 + d^2 - (b + c)^2) / (2 a d): at 104.478 deg here.
  subroutine test_partial_turn(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call turn_four_bar(0.2_dp, 0.25_dp, 0.25_dp, 0.4_dp, failure)
    call check_failure(error, failure)
    if (allocated(error)) return
    call check(error, failure%code, 3)
    if (allocated(error)) return
    call check(error, failure%subject, "joint 'B'")
    if (allocated(error)) return
    ! (0.04 + 0.16 - 0.25) / 0.16 = -0.3125: 108.210 deg.
    call check_that(error, failure%message, "contains", "108.210 deg")
  end subroutine test_partial_turn

  !> At 180 deg the ends are 1e-9 m too far apart, over 0.004 deg of the turn.
  subroutine test_narrow_gap(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call turn_four_bar(0.2_dp, 0.35_dp, 0.25_dp - 1.0e-9_dp, 0.4_dp, failure)
    call check_failure(error, failure, "179.9")
  end subroutine test_narrow_gap

  !> A parallelogram: all four joints on a line at 0 and 180 deg.
  subroutine test_change_point(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call turn_four_bar(0.2_dp, 0.4_dp, 0.2_dp, 0.4_dp, failure)
    call check_failure(error, failure, " 0.000 deg")
    if (allocated(error)) return
    call check_that(error, failure%message, "contains", &
      & "ends are 0.2 m apart; lengths of 0.4 m and 0.2 m allow 0.2 m to 0.6 m")
  end subroutine test_change_point

  !> With a length 1e-6 (relative) short of a change point the linkage still turns, and the angle scale reflects how fine its
  !> motion is there.
  subroutine test_nearly_dead(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call turn_four_bar(0.2_dp, 0.35_dp, 0.25_dp + 1.0e-6_dp, 0.4_dp, failure)
    call check_success(error, failure)
  end subroutine test_nearly_dead

  !> The angle scale of the whole turn is the distance to the nearest dead point, real or complex. It is no bound: its size
  !> determines the number of steps, and a factor of two is allowed.
  subroutine test_angle_scales(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: r = 0.2_dp, l = 0.35_dp, d = 0.4_dp, gaps(3) = [1.0e-2_dp, 1.0e-4_dp, 1.0e-6_dp]
    type(linkage_type) :: linkage
    type(guide_type) :: moving
    type(gestell_error), allocatable :: failure
    integer :: i

    do i = 1, size(gaps)
      ! (l1 + l2)^2 = r^2 + d^2 + 2 r d cosh at the stretched position, then |l1 - l2| at the folded one.
      call start()
      call linkage%rrr("B", ["A", "D"], [l, r + d - l + gaps(i)], 1, failure)
      call linkage%ground("far", [9.0_dp, 9.0_dp], failure)
      call compare(acosh(((r + d + gaps(i))**2 - r**2 - d**2) / (2 * r * d)), "stretched")
      if (allocated(error)) return
      call start()
      call linkage%rrr("B", ["A", "D"], [0.5_dp, 0.5_dp + d - r - gaps(i)], 1, failure)
      call compare(acosh((r**2 + d**2 - (d - r - gaps(i))**2) / (2 * r * d)), "folded")
      if (allocated(error)) return
      ! l = 1.8 + r cosh at right angles to a guide 1.8 below.
      call start()
      call linkage%rrp("B", "A", 1.8_dp + r + gaps(i), guide_type(point=[0.0_dp, -1.8_dp]), 1, failure)
      call compare(acosh((r + gaps(i)) / r), "slider-crank")
      if (allocated(error)) return
      ! A pivot outside the crank's circle: r exp = r + gap.
      call start()
      call linkage%ground("P", [0.0_dp, r + gaps(i)], failure)
      call linkage%rpr("B", ["A", "P"], 0.1_dp, 1, failure)
      call compare(log(1 + gaps(i) / r), "slotted lever")
      if (allocated(error)) return
    end do

    ! A guide along the rocker, which swings between 78 and 143 deg (at an angle of asin / acos of the closed triangle).
    call start()
    call linkage%rrr("B", ["A", "D"], [0.5_dp, 0.5_dp], 1, failure)
    call linkage%moving_guide(["D", "B"], [0.0_dp, 0.0_dp], 0.0_dp, moving, failure)
    call linkage%prp("C", [guide_type(angle=0.0_dp), moving], failure)
    call linkage%prepare(failure)
    call check_success(error, failure, "a rocker that never lies along the ground link")
    if (allocated(error)) return
    call linkage%prp("E", [guide_type(angle=1.8_dp), moving], failure)
    call linkage%prepare(failure)
    call check_failure(error, failure, what="a guide that the rocker passes")
    if (allocated(error)) return
    call check(error, failure%subject, "joint 'E'")

  contains

    subroutine start()
      type(linkage_type) :: empty

      linkage = empty
      call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
      call linkage%ground("D", [d, 0.0_dp], failure)
      call linkage%crank("A", "O", r, 0.3_dp, failure)
      call linkage%link("crank", "O", "A", 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
    end subroutine start

    subroutine compare(distance, what)
      real(dp), intent(in) :: distance
      character(len=*), intent(in) :: what

      if (.not. allocated(failure)) call linkage%prepare(failure)
      if (allocated(failure)) then
        call test_failed(error, what // ": " // failure%message)
        return
      end if
      call check_that(error, linkage%angle_scale, ">", distance / 2, what)
      call check_that(error, linkage%angle_scale, "<", 2 * distance, what)
    end subroutine compare

  end subroutine test_angle_scales

  !> A dyad on the paper's rocker that cannot follow the rocker.
  subroutine test_second_dyad(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure

    call linkage_of_machine(khang_machine(240.0_dp), linkage, failure)
    call linkage%ground("C0", [0.8_dp, 0.1_dp], failure)
    call linkage%rrr("C", ["j4", "C0"], [0.2_dp, 0.17_dp], 1, failure)
    call linkage%prepare(failure)
    call check_failure(error, failure)
    if (allocated(error)) return
    call check(error, failure%subject, "joint 'C'")
  end subroutine test_second_dyad

  !> A link from the crank's joint to a fixed joint on the crank's circle, at 90 deg.
  subroutine test_coinciding_joints(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%ground("P", [0.0_dp, 0.1_dp], failure)
    call linkage%crank("A", "O", 0.1_dp, 0.0_dp, failure)
    call linkage%link("rod", "P", "A", 1.0_dp, 0.1_dp, [0.05_dp, 0.0_dp], failure)
    call linkage%prepare(failure)
    call check_failure(error, failure)
    if (allocated(error)) return
    call check(error, failure%message, "link 'rod': the link's two joints coincide at a crank angle of 90.000 deg")
  end subroutine test_coinciding_joints

  subroutine test_refused(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    integer, parameter :: all_free(3) = [1, 2, 3]
    real(dp) :: zero(3, 3), data(8)
    integer :: i

    call linkage%prepare(failure)
    call check_failure(error, failure, what="no such point")
    if (allocated(error)) return
    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "P", 0.1_dp, 0.0_dp, failure)
    call check_failure(error, failure, what="unknown pivot")
    if (allocated(error)) return
    call linkage%crank("A", "O", -0.1_dp, 0.0_dp, failure)
    call check_failure(error, failure, what="negative radius")
    if (allocated(error)) return
    call linkage%crank("A", "O", 0.1_dp, 0.0_dp, failure)
    call linkage%ground("A", [0.0_dp, 0.0_dp], failure)
    call check_failure(error, failure, what="name taken")
    if (allocated(error)) return
    call linkage%rrr("B", ["A", "A"], [1.0_dp, 1.0_dp], 1, failure)
    call check_failure(error, failure, what="same ends")
    if (allocated(error)) return
    call linkage%rrr("B", ["A", "O"], [1.0_dp, 1.0_dp], 0, failure)
    call check_failure(error, failure, what="branch")
    if (allocated(error)) return
    call linkage%link("rod", "O", "A", -1.0_dp, 0.1_dp, [0.05_dp, 0.0_dp], failure)
    call check_failure(error, failure, what="negative mass")
    if (allocated(error)) return
    call linkage%prepare(failure)
    call check_failure(error, failure, what="no link")
    if (allocated(error)) return
    call linkage%link("rod", "O", "A", 1.0_dp, 0.1_dp, [0.05_dp, 0.0_dp], failure)
    zero = 0
    call new_frame(frame, linkage, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], zero, zero, 0.0_dp, failure)
    call check_failure(error, failure, what="speed zero")
    if (allocated(error)) return
    call new_frame(frame, linkage, -1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], zero, zero, 1.0_dp, failure)
    call check_failure(error, failure, what="negative frame mass")
    if (allocated(error)) return
    call new_frame(frame, linkage, 1.0_dp, -1.0_dp, [0.0_dp, 0.0_dp], zero, zero, 1.0_dp, failure)
    call check_failure(error, failure, what="negative frame inertia")
    if (allocated(error)) return
    call new_frame(frame, linkage, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], zero, zero, 1.0_dp, failure, [0, 1])
    call check_failure(error, failure, what="degree of freedom 0")
    if (allocated(error)) return
    call new_frame(frame, linkage, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], zero, zero, 1.0_dp, failure, all_free(1:0))
    call check_failure(error, failure, what="no degree of freedom")
    if (allocated(error)) return
    call new_frame(frame, linkage, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], zero, zero, 1.0_dp, failure, [1, 4])
    call check_failure(error, failure, what="degree of freedom 4")
    if (allocated(error)) return
    do i = 1, 8
      data = 1
      data(i) = ieee_value(1.0_dp, ieee_positive_inf)
      if (modulo(i, 2) == 0) data(i) = ieee_value(1.0_dp, ieee_quiet_nan)
      call new_frame(frame, linkage, data(1), data(2), data(3:4), zero + data(5), zero + data(6), data(7), failure)
      call check_that(error, allocated(failure), "==", i < 8, "data that are not finite")
      if (allocated(error)) return
    end do

    ! The number of steps resolves the mechanism's angle scale; an excessive number is refused.
    call linkage%prepare(failure)
    linkage%angle_scale = 0.01_dp
    call new_frame(frame, linkage, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], zero, zero, 1.0_dp, failure)
    call check(error, frame%least_steps, 629)
    if (allocated(error)) return
    linkage%angle_scale = 1.0e-8_dp
    call new_frame(frame, linkage, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], zero, zero, 1.0_dp, failure)
    call check_failure(error, failure, what="too close to a dead point")
    if (allocated(error)) return
    call check(error, failure%code, 3)
    if (allocated(error)) return

    ! a second crank pin on the shaft
    call linkage%crank("A2", "O", 0.1_dp, 0.0_dp, failure)
    if (.not. allocated(failure)) call linkage%prepare(failure)
    call check_success(error, failure)
  end subroutine test_refused

  subroutine test_dead_points(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(guide_type) :: carried
    type(gestell_error), allocatable :: failure
    integer :: i
    character(len=12) :: expected

    do i = 1, 6
      call new_crank(linkage, failure)
      call linkage%ground("P", [0.0_dp, -1.0_dp], failure)
      select case (i)
      case (1) ! the rod reaches the guide y = -1.5 only while sin phi < 0.5
        call linkage%rrp("X", "A", 2.0_dp, guide_type(point=[0.0_dp, -1.5_dp]), 1, failure)
        expected = " 30.000 deg"
      case (2) ! the crank's joint passes through the lever's pivot
        call linkage%rpr("X", ["A", "P"], 2.0_dp, 1, failure)
        expected = " 270.000 deg"
      case (3) ! so does it through a body's joint
        call linkage%rigid("X", ["A", "P"], [1.0_dp, 1.0_dp], failure)
        expected = " 270.000 deg"
      case (4) ! the crank's line becomes parallel to the y-axis
        call linkage%moving_guide(["O", "A"], [0.0_dp, 0.0_dp], 0.0_dp, carried, failure)
        call linkage%prp("X", [carried, guide_type(point=[3.0_dp, 0.0_dp], angle=pi / 2)], failure)
        expected = " 90.000 deg"
      case (5) ! a slot along its own guide
        call linkage%rpp("X", "A", guide_type(), 0.0_dp, failure)
        expected = " 0.000 deg"
      case default ! a guide between joints that meet
        call linkage%moving_guide(["P", "A"], [0.0_dp, 0.0_dp], 0.0_dp, carried, failure)
        call linkage%rrp("X", "O", 5.0_dp, carried, 1, failure)
        expected = " 270.000 deg"
      end select
      call linkage%prepare(failure)
      call check_failure(error, failure, what=expected)
      if (allocated(error)) return
      call check(error, failure%subject, "joint 'X'")
      if (allocated(error)) return
      call check_that(error, failure%message, "contains", trim(expected))
      if (allocated(error)) return
    end do
  end subroutine test_dead_points

end module test_assembly
