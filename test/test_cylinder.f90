!> Cylinders against the law of cosines, cranks that move alike, and differences of their own positions.
module test_cylinder
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_placement, only: placement_type
  use gestell_model_joints_types_cylinder, only: cylinder_joint
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_diagnosis, only: diagnose, diagnosis_type
  use gestell_model_linkage_gearing, only: gear
  use gestell_model_mechanism, only: drive_columns, energy_d, energy_v, spin_v
  use machines, only: new_crank
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_cylinder

  !> A lever of the length l about O, a cylinder of the length L0 + a cos(phi) on P, which is d to the right of O (m).
  real(dp), parameter :: l = 1.2_dp, d = 2.0_dp, mean = 1.6_dp, a = 0.3_dp
  real(dp), parameter :: inertia = 0.7_dp

contains

  subroutine collect_cylinder(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a lever on a cylinder turns as the law of cosines says, with three derivatives", test_lever), &
      & new_unittest("power and angular momentum of a lever on a cylinder have their closed forms", test_power), &
      & new_unittest("a slider moved along a guide equals a Scotch yoke of its crank", test_slider), &
      & new_unittest("derivatives of cylinders on moving links agree with differences", test_carried), &
      & new_unittest("a cylinder of constant length equals a dyad of three turning pairs", test_dyad), &
      & new_unittest("the angle scale follows from the highest order of the stroke", test_angle_scale), &
      & new_unittest("phase and gear ratio of a mechanism shift and scale the angle of a cylinder", test_gear), &
      & new_unittest("the diagnosis reports mobility, stroke, transmission angle and dead points", test_diagnosis), &
      & new_unittest("strokes beyond the dead points and invalid cylinders are refused with a reason", test_refused)]
  end subroutine collect_cylinder

  !> Joints O, P, B; the lever's mass is in the pin B.
  subroutine new_lever(linkage, stroke, failure)
    type(linkage_type), intent(out) :: linkage
    real(dp), intent(in) :: stroke(:)
    type(gestell_error), allocatable, intent(out) :: failure

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%ground("P", [d, 0.0_dp], failure)
    call linkage%add_joint("B", cylinder_joint(stroke=stroke, ends=[1, 2], lever=l), failure)
    if (.not. allocated(failure)) call linkage%link("lever", "O", "B", 3.0_dp, inertia, [l, 0.0_dp], failure)
    if (.not. allocated(failure)) call linkage%prepare(failure)
  end subroutine new_lever

  !> Angle of the lever and three derivatives: cos(beta) = (l^2 + d^2 - L^2)/(2 l d), and derivatives of l d cos(beta) = -L^2/2.
  pure function lever_angle(phi) result(beta)
    real(dp), intent(in) :: phi
    real(dp) :: beta(0:3), length(0:3)

    length = [mean + a * cos(phi), -a * sin(phi), -a * cos(phi), a * sin(phi)]
    beta(0) = acos((l**2 + d**2 - length(0)**2) / (2 * l * d))
    associate (c => cos(beta(0)), s => sin(beta(0)))
      beta(1) = length(0) * length(1) / (l * d * s)
      beta(2) = ((length(1)**2 + length(0) * length(2)) / (l * d) - c * beta(1)**2) / s
      beta(3) = ((3 * length(1) * length(2) + length(0) * length(3)) / (l * d) + s * beta(1)**3 - 3 * c * beta(1) * beta(2)) / s
    end associate
  end function lever_angle

  subroutine test_lever(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(3)
    type(gestell_error), allocatable :: failure
    complex(dp) :: place(0:3)
    real(dp) :: beta(0:3)
    integer :: k

    call new_lever(linkage, [mean, a, 0.0_dp], failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 0, 12
      call linkage%points(0.5_dp * k, at)
      beta = lever_angle(0.5_dp * k)
      place(0) = l * exp(cmplx(0, beta(0), dp))
      place(1) = place(0) * cmplx(0, beta(1), dp)
      place(2) = place(0) * cmplx(-beta(1)**2, beta(2), dp)
      place(3) = place(0) * cmplx(-3 * beta(1) * beta(2), beta(3) - beta(1)**3, dp)
      ! Roundings, which the transmission angle of 50 deg hardly amplifies.
      call check_that(error, abs(cmplx(at(3)%x%v, at(3)%y%v, dp) - place(0)), "<", 1.0e-14_dp, "place")
      call check_that(error, abs(cmplx(at(3)%x%d, at(3)%y%d, dp) - place(1)), "<", 1.0e-14_dp, "speed")
      call check_that(error, abs(cmplx(at(3)%x%dd, at(3)%y%dd, dp) - place(2)), "<", 1.0e-14_dp, "acceleration")
      call check_that(error, abs(cmplx(at(3)%x%ddd, at(3)%y%ddd, dp) - place(3)), "<", 1.0e-13_dp, "third derivative")
      if (allocated(error)) return
    end do
  end subroutine test_lever

  !> H = J beta', K = J beta'^2, K' = 2 J beta' beta'', where J includes the mass at the pin. The torque at the imaginary crank is
  !> K'/2, so that the cylinder's force K'/(2 L') has the lever arm beta'/L' about O: J beta'' = force * L'/beta'.
  subroutine test_power(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(12), table(12, drive_columns), beta(0:3), j
    logical :: known
    integer :: k

    call new_lever(linkage, [mean, a, 0.0_dp], failure)
    call check_success(error, failure)
    if (allocated(error)) return
    j = inertia + 3 * l**2
    phi = [(0.5_dp * k, k = 1, 12)]
    call linkage%tabulate_drive(phi, table, known)
    do k = 1, 12
      beta = lever_angle(phi(k))
      call check_that(error, abs(table(k, spin_v) - j * beta(1)), "<", 1.0e-13_dp, "angular momentum")
      call check_that(error, abs(table(k, energy_v) - j * beta(1)**2), "<", 1.0e-13_dp, "energy")
      call check_that(error, abs(table(k, energy_d) - 2 * j * beta(1) * beta(2)), "<", 1.0e-13_dp, "twice the torque")
      if (allocated(error)) return
    end do
  end subroutine test_power

  !> The slot at a right angle to the guide passes through the crank pin: the yoke is at cos(phi - angle) along the guide.
  subroutine test_slider(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(4)
    type(guide_type) :: guide
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: turned = 1.1_dp
    integer :: k

    guide = guide_type(point=[0.0_dp, 0.0_dp], angle=turned)
    call new_crank(linkage, failure)
    call linkage%rpp("Y", "A", guide, pi / 2, failure)
    call linkage%add_joint("S", cylinder_joint(stroke=[0.0_dp, 1.0_dp, 0.0_dp], guide=guide, phase=-turned), failure)
    if (.not. allocated(failure)) call linkage%prepare(failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 0, 12
      call linkage%points(0.5_dp * k, at)
      call check_that(error, maxval(abs([at(3)%x%v - at(4)%x%v, at(3)%y%v - at(4)%y%v, at(3)%x%d - at(4)%x%d, at(3)%y%d &
        & - at(4)%y%d, at(3)%x%dd - at(4)%x%dd, at(3)%y%dd - at(4)%y%dd])), "<", 1.0e-14_dp, "two descriptions")
      if (allocated(error)) return
    end do
  end subroutine test_slider

  !> A cylinder on a crank pin, and a slider on the lever that it moves: the constraints hold, and the derivatives agree with
  !> central differences of fourth order.
  subroutine test_carried(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(guide_type) :: guide
    type(point_type) :: at(5)
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: stroke(5) = [4.0_dp, 0.3_dp, -0.2_dp, 0.1_dp, 0.05_dp], lift(3) = [1.0_dp, 0.0_dp, 0.4_dp]
    real(dp), parameter :: step = 1.0e-2_dp, fourth(-2:2) = [1, -8, 0, 8, -1] / 12.0_dp
    real(dp) :: places(4, -2:2), speeds(4, -2:2), accelerations(4, -2:2), phi
    integer :: i, k

    call new_crank(linkage, failure)
    call linkage%ground("P", [4.0_dp, 0.5_dp], failure)
    call linkage%add_joint("B", cylinder_joint(stroke=stroke, ends=[3, 2], lever=3.0_dp, branch=-1, phase=0.4_dp), failure)
    call linkage%moving_guide(["P", "B"], [0.2_dp, 0.1_dp], 0.6_dp, guide, failure)
    call linkage%add_joint("S", cylinder_joint(stroke=lift, guide=guide), failure)
    if (.not. allocated(failure)) call linkage%prepare(failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 1, 32
      phi = 0.2_dp * k
      do i = 2, -2, -1
        call linkage%points(phi + i * step, at)
        places(:, i) = [at(4)%x%v, at(4)%y%v, at(5)%x%v, at(5)%y%v]
        speeds(:, i) = [at(4)%x%d, at(4)%y%d, at(5)%x%d, at(5)%y%d]
        accelerations(:, i) = [at(4)%x%dd, at(4)%y%dd, at(5)%x%dd, at(5)%y%dd]
      end do
      call linkage%points(phi, at)
      associate (alpha => phi + 0.4_dp, way => places(:2, 0) - [at(2)%x%v, at(2)%y%v], arm => places(:2, 0) - [4.0_dp, 0.5_dp], &
        & ride => places(3:, 0) - [4.0_dp, 0.5_dp])
        call check_that(error, abs(norm2(arm) - 3), "<", 1.0e-14_dp, "length of the lever")
        call check_that(error, abs(norm2(way) - dot_product(stroke, [1.0_dp, cos(alpha), sin(alpha), cos(2 * alpha), &
          & sin(2 * alpha)])), "<", 1.0e-14_dp, "length of the cylinder")
        ! branch -1: on the right of the line from the lever's pivot to the crank pin
        call check_that(error, arm(1) * way(2) - arm(2) * way(1), "<", 0.0_dp, "branch")
        call check_that(error, abs(dot_product(ride, arm) / 3 - 0.2_dp - (1 + 0.4_dp * sin(phi)) * cos(0.6_dp)), "<", 1.0e-14_dp, &
          & "slider along the lever")
      end associate
      if (allocated(error)) return
      ! h^4/30 times a fifth derivative of less than 100.
      call check_that(error, norm2(matmul(places, fourth) / step - speeds(:, 0)), "<", 1.0e-7_dp, "speed")
      call check_that(error, norm2(matmul(speeds, fourth) / step - accelerations(:, 0)), "<", 1.0e-6_dp, "acceleration")
      call check_that(error, norm2(matmul(accelerations, fourth) / step - [at(4)%x%ddd, at(4)%y%ddd, at(5)%x%ddd, at(5)%y%ddd]), &
        & "<", 1.0e-5_dp, "third derivative")
      if (allocated(error)) return
    end do
  end subroutine test_carried

  !> The proof of assembly takes the same intervals and finds the same angle scale.
  subroutine test_dyad(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkages(2)
    type(diagnosis_type) :: diagnoses(2)
    type(point_type) :: at(4), there(4)
    type(gestell_error), allocatable :: failure
    integer :: k

    do k = 1, 2
      call new_crank(linkages(k), failure)
      call linkages(k)%ground("P", [4.5_dp, 0.0_dp], failure)
      if (k == 1) call linkages(k)%rrr("B", ["P", "A"], [2.5_dp, 4.0_dp], 1, failure)
      if (k == 2) call linkages(k)%add_joint("B", cylinder_joint(stroke=[4.0_dp, 0.0_dp, 0.0_dp], ends=[3, 2], lever=2.5_dp), &
        & failure)
      if (.not. allocated(failure)) call linkages(k)%prepare(failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call diagnose(linkages(k), diagnoses(k), failure)
    end do
    call linkages(1)%points(0.7_dp, at)
    call linkages(2)%points(0.7_dp, there)
    call check_that(error, hypot(at(4)%x%dd - there(4)%x%dd, at(4)%y%dd - there(4)%y%dd), "<", 1.0e-14_dp, "acceleration")
    call check_that(error, abs(linkages(1)%angle_scale - linkages(2)%angle_scale), "<", 1.0e-12_dp, "angle scale")
    call check_that(error, linkages(2)%intervals, "==", linkages(1)%intervals, "intervals of the proof")
    call check_that(error, abs(diagnoses(1)%joints(4)%transmission - diagnoses(2)%joints(4)%transmission), "<", 1.0e-9_dp, &
      & "transmission angle")
    call check_that(error, abs(diagnoses(1)%joints(4)%margin - diagnoses(2)%joints(4)%margin), "<", 1.0e-12_dp, "dead point")
  end subroutine test_dyad

  !> Sliders of the orders 1 to 20, also with 3 turns per turn of the drive.
  subroutine test_angle_scale(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    integer, parameter :: ratios(2) = [1, -3]
    integer :: k

    do k = 1, 2
      call new_crank(linkage, failure)
      call linkage%add_joint("S", cylinder_joint(stroke=[1.0_dp, spread(1.0e-3_dp, 1, 40)], ratio=ratios(k)), failure)
      if (.not. allocated(failure)) call linkage%prepare(failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, abs(20 * abs(ratios(k)) * linkage%angle_scale - 1), "<", 1.0e-12_dp, "order 20 is the finest")
      if (allocated(error)) return
    end do
  end subroutine test_angle_scale

  !> -3/2 turns per turn of the drive: the period is 2 turns, in which the cylinder makes -3 of its own.
  subroutine test_gear(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage, geared
    type(cylinder_joint) :: joint
    type(point_type) :: at(3), there(3)
    type(gestell_error), allocatable :: failure
    integer, allocatable :: crank_turns(:)
    integer :: k, turns, bad

    call new_lever(linkage, [mean, a, 0.0_dp], failure)
    call geared%ground("O", [0.0_dp, 0.0_dp], failure)
    call geared%ground("P", [d, 0.0_dp], failure)
    joint = cylinder_joint(stroke=[mean, a, 0.0_dp], ends=[1, 2], lever=l, phase=0.2_dp)
    call joint%move(placement_type(phase=0.3_dp, ratio=-3, denominator=2))
    call geared%add_joint("B", joint, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    allocate(geared%loads(0))
    call gear(geared%joints, geared%loads, turns, crank_turns, bad)
    call check(error, all([turns, crank_turns, bad] == [2, 3, 0]), "turns of drive and cylinder")
    if (allocated(error)) return
    do k = 0, 12
      call linkage%points(-3 * 0.5_dp * k + 0.5_dp, at)
      call geared%points(0.5_dp * k, there)
      call check_that(error, hypot(at(3)%x%v - there(3)%x%v, at(3)%y%v - there(3)%y%v), "<", 1.0e-14_dp, "place")
      call check_that(error, hypot(-3 * at(3)%x%d - there(3)%x%d, -3 * at(3)%y%d - there(3)%y%d), "<", 1.0e-14_dp, "speed")
      call check_that(error, hypot(9 * at(3)%x%dd - there(3)%x%dd, 9 * at(3)%y%dd - there(3)%y%dd), "<", 1.0e-13_dp, &
        & "acceleration")
      if (allocated(error)) return
    end do
  end subroutine test_gear

  !> The angle mu between lever and cylinder satisfies d^2 = l^2 + L^2 - 2 l L cos(mu).
  subroutine test_diagnosis(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(diagnosis_type) :: diagnosis
    type(gestell_error), allocatable :: failure
    integer, parameter :: samples = 5000
    real(dp) :: lengths(0:samples)
    integer :: k

    call new_lever(linkage, [mean, a, 0.0_dp], failure)
    call diagnose(linkage, diagnosis, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, all([diagnosis%links, diagnosis%pairs, diagnosis%higher_pairs, diagnosis%mobility] == [4, 4, 0, 1]), &
      & "Gruebler's count")
    if (allocated(error)) return
    lengths = [(mean + a * (2.0_dp * k / samples - 1), k = 0, samples)]
    associate (report => diagnosis%joints(3))
      call check(error, report%travel(2) - report%travel(1), 2 * a, thr=1.0e-12_dp, more="stroke")
      if (allocated(error)) return
      call check(error, report%rate, a, thr=1.0e-12_dp, more="speed of the cylinder")
      if (allocated(error)) return
      call check(error, sin(report%transmission), minval(sqrt(1 - ((l**2 + lengths**2 - d**2) / (2 * l * lengths))**2)), &
        & thr=1.0e-9_dp, more="transmission angle")
      if (allocated(error)) return
      call check(error, report%margin, minval([l + lengths - d, d - abs(lengths - l)]), thr=1.0e-12_dp, more="dead point")
    end associate
    if (allocated(error)) return
    ! a second cylinder is coupled to the first, as a second shaft is
    call linkage%add_joint("S", cylinder_joint(stroke=[0.0_dp, 1.0_dp, 0.0_dp]), failure)
    call diagnose(linkage, diagnosis, failure)
    call check(error, all([diagnosis%links, diagnosis%pairs, diagnosis%higher_pairs, diagnosis%mobility] == [5, 5, 1, 1]), &
      & "Gruebler's count of two cylinders")
  end subroutine test_diagnosis

  subroutine test_refused(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    character(len=*), parameter :: reach = "its ends are 2 m apart; the lever is 1.2 m long, the cylinder "

    ! L = d - l = 0.8 and L = d + l = 3.2 are dead points.
    call new_lever(linkage, [1.2_dp, 0.399_dp, 0.0_dp], failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call impossible([1.2_dp, 0.401_dp, 0.0_dp], reach // "0.799 m to 1.601 m; it can be assembled from")
    call impossible([3.0_dp, 0.2_dp, 0.0_dp], reach // "2.8 m to 3.2 m; it can be assembled")
    call impossible([0.2_dp, 0.0_dp, 0.4_dp], reach // "-0.2 m to 0.6 m; it cannot be assembled at any crank angle")
    if (allocated(error)) return
    call refused(cylinder_joint(stroke=[1.0_dp, 2.0_dp], ends=[1, 2], lever=1.0_dp), "joint 'T': the stroke must have an odd " // &
      & "number of values: the mean, then one cosine and one sine coefficient for each order")
    call refused(cylinder_joint(ends=[1, 2], lever=1.0_dp), "joint 'T': it has no stroke")
    call refused(cylinder_joint(stroke=[1.0_dp], ends=[1, 2]), "joint 'T': lengths must be positive")
    call refused(cylinder_joint(stroke=[1.0e101_dp]), "joint 'T': coordinates must lie between -1e100 m and 1e100 m")
    call refused(cylinder_joint(stroke=[1.0_dp], ends=[1, 3], lever=1.0_dp), &
      & "joint 'T': the joint refers to joints that do not exist")

  contains

    subroutine impossible(stroke, message)
      real(dp), intent(in) :: stroke(:)
      character(len=*), intent(in) :: message

      if (allocated(error)) return
      call new_lever(linkage, stroke, failure)
      call check(error, allocated(failure), "impossible")
      if (.not. allocated(error)) call check_that(error, index(failure%message, message), ">", 0, failure%message)
    end subroutine impossible

    subroutine refused(joint, message)
      type(cylinder_joint), intent(in) :: joint
      character(len=*), intent(in) :: message
      type(linkage_type) :: other
      type(gestell_error), allocatable :: reason

      if (allocated(error)) return
      call new_crank(other, reason)
      call other%add_joint("T", joint, reason)
      call check(error, allocated(reason), "refused")
      if (.not. allocated(error)) call check(error, reason%message, message)
    end subroutine refused

  end subroutine test_refused

end module test_cylinder
