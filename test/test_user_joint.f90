!> A joint of a user's own type is counted, drawn and assembled from its own description.
module test_user_joint
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_diagnosis, only: diagnose, diagnosis_type
  use gestell_model_linkage_diagram, only: diagram_type, trace_diagram
  use machines, only: new_crank
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use user_mechanisms, only: midpoint_joint, tappet_joint
  implicit none (type, external)
  private

  public :: collect_user_joint

contains

  subroutine collect_user_joint(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a user's cam joint enters the mobility with two degrees of freedom", test_count), &
      & new_unittest("the stroke of a user's tappet on its guide is correct", test_stroke), &
      & new_unittest("a user's joint is drawn with its bars and sliders", test_drawing), &
      & new_unittest("invalid references and coordinates of a user's joint are refused", test_refused)]
  end subroutine collect_user_joint

  !> A crank O-A, and a tappet on a guide along y, which a cam on the crank's shaft lifts by 2 + cos phi.
  subroutine new_cam_drive(linkage, failure)
    type(linkage_type), intent(out) :: linkage
    type(gestell_error), allocatable, intent(out) :: failure

    call new_crank(linkage, failure)
    call linkage%add_joint("T", tappet_joint(guide_type(point=[0.5_dp, 0.0_dp], angle=pi / 2), 1.0_dp), failure)
    call linkage%link("tappet", "T", "", 1.0_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
  end subroutine new_cam_drive

  !> Frame, cam and tappet; two pairs of one degree of freedom and the cam's of two: 3 (3 - 1) - 2 2 - 1 = 1. A midpoint adds
  !> none.
  subroutine test_count(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(diagnosis_type) :: diagnosis
    type(gestell_error), allocatable :: failure

    call new_cam_drive(linkage, failure)
    call linkage%add_joint("M", midpoint_joint([2, 3]), failure)
    call linkage%prepare(failure)
    call check(error, .not. allocated(failure), "assembled")
    if (allocated(error)) return
    call diagnose(linkage, diagnosis, failure)
    call check(error, diagnosis%links, 3)
    if (.not. allocated(error)) call check(error, diagnosis%pairs, 2)
    if (.not. allocated(error)) call check(error, diagnosis%higher_pairs, 1)
    if (.not. allocated(error)) call check(error, diagnosis%mobility, 1)
    if (.not. allocated(error)) call check(error, diagnosis%grashof, "")
  end subroutine test_count

  !> It goes from 1 to 3 along the guide.
  subroutine test_stroke(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(diagnosis_type) :: diagnosis
    type(gestell_error), allocatable :: failure

    call new_cam_drive(linkage, failure)
    call linkage%prepare(failure)
    call diagnose(linkage, diagnosis, failure)
    call check(error, diagnosis%joints(3)%y(1), 1.0_dp, thr=1.0e-12_dp)
    if (.not. allocated(error)) call check(error, diagnosis%joints(3)%y(2), 3.0_dp, thr=1.0e-12_dp)
    if (.not. allocated(error)) call check(error, diagnosis%joints(3)%x(2), 0.5_dp, thr=1.0e-12_dp)
  end subroutine test_stroke

  !> The crank is drawn as a bar, the tappet as a slider with its travel. A midpoint of two points of the frame lies on the
  !> frame, and no bars are drawn along the frame. A midpoint with one end on the crank does not, and its bars belong to the
  !> crank.
  subroutine test_drawing(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(diagram_type) :: diagram
    type(gestell_error), allocatable :: failure
    integer :: i

    call new_cam_drive(linkage, failure)
    call linkage%ground("P", [2.0_dp, 0.0_dp], failure)
    call linkage%add_joint("F", midpoint_joint([1, 4]), failure)
    call linkage%add_joint("M", midpoint_joint([1, 2]), failure)
    call linkage%prepare(failure)
    call trace_diagram(linkage, [(i * pi / 8, i = 0, 15)], diagram)
    call check(error, all(diagram%grounded .eqv. [.true., .false., .false., .true., .true., .false.]), "points on the frame")
    if (allocated(error)) return
    call check(error, size(diagram%bars), 3)
    if (allocated(error)) return
    call check(error, all(diagram%bars(1)%joints == [1, 2]) .and. all(diagram%bars(2)%joints == [1, 6]) &
      & .and. all(diagram%bars(3)%joints == [2, 6]), "bars")
    if (allocated(error)) return
    call check(error, all(diagram%bars%link == 1), "the crank's bars")
    if (allocated(error)) return
    call check(error, size(diagram%sliders), 1)
    if (allocated(error)) return
    call check(error, diagram%sliders(1)%joint, 3)
    if (.not. allocated(error)) call check(error, diagram%sliders(1)%travel(1), 1.0_dp, thr=1.0e-12_dp)
    if (.not. allocated(error)) call check(error, diagram%sliders(1)%travel(2), 3.0_dp, thr=1.0e-12_dp)
  end subroutine test_drawing

  subroutine test_refused(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure

    call new_crank(linkage, failure)
    call linkage%add_joint("M", midpoint_joint([2, 3]), failure)
    call check(error, allocated(failure), "built on itself")
    if (allocated(error)) return
    call check(error, failure%message, "joint 'M': the joint refers to joints that do not exist")
    if (allocated(error)) return
    call linkage%add_joint("T", tappet_joint(guide_type(point=[huge(1.0_dp), 0.0_dp]), 1.0_dp), failure)
    call check(error, allocated(failure), "too far")
    if (allocated(error)) return
    call check(error, failure%message, "joint 'T': coordinates must lie between -1e100 m and 1e100 m")
  end subroutine test_refused

end module test_user_joint
