!> The follower of a cam against closed forms, a yoke, and differences of its own positions.
module test_follower
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_types_follower, only: follower_joint, lift_through
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_diagnosis, only: diagnose, diagnosis_type
  use gestell_model_mechanism, only: a1_dd, a2_dd, a3_dd, a4_v, mass_functions_type, table_columns
  use machines, only: new_crank
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_follower

  real(dp), parameter :: tiny_part = 1.0e-14_dp

contains

  subroutine collect_follower(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a harmonic lift has the closed form's position, derivatives and inertia force", test_harmonic), &
      & new_unittest("an eccentric cam is equivalent to a Scotch yoke", test_yoke), &
      & new_unittest("a table reproduces its values and the harmonics that generated it", test_table), &
      & new_unittest("derivatives with cam and guide on moving links agree with differences", test_carried), &
      & new_unittest("the diagnosis reports a follower's mobility, stroke and pressure angle", test_diagnosis), &
      & new_unittest("followers are proved to turn or refused with a reason", test_refused)]
  end subroutine collect_follower

  !> A crank O-A of 1 m, and a follower T of mass 3 by this lift.
  subroutine new_cam(linkage, guide, lift, phase, failure)
    type(linkage_type), intent(out) :: linkage
    type(guide_type), intent(in) :: guide
    real(dp), intent(in) :: lift(:), phase
    type(gestell_error), allocatable, intent(out) :: failure

    call new_crank(linkage, failure)
    call linkage%add_joint("T", follower_joint(guide, guide_type([1, 2], angle=phase), lift), failure)
    if (.not. allocated(failure)) call linkage%link("tappet", "T", "", 3.0_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
  end subroutine new_cam

  !> s = h (1 - cos(theta))/2, theta = phi + phase less the guide's angle.
  subroutine test_harmonic(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(3)
    type(mass_functions_type) :: a
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: h = 0.4_dp, turned = 0.7_dp, phase = -0.3_dp, from(2) = [0.2_dp, 1.5_dp]
    real(dp) :: theta, phi, along(2)
    integer :: k

    call new_cam(linkage, guide_type(point=from, angle=turned), [h / 2, -h / 2, 0.0_dp], phase, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    along = [cos(turned), sin(turned)]
    do k = 0, 12
      phi = 0.5_dp * k
      theta = phi + phase - turned
      call linkage%points(phi, at)
      call check_that(error, norm2([at(3)%x%v, at(3)%y%v] - from - h / 2 * (1 - cos(theta)) * along), "<", tiny_part, "place")
      call check_that(error, norm2([at(3)%x%d, at(3)%y%d] - h / 2 * sin(theta) * along), "<", tiny_part, "speed")
      call check_that(error, norm2([at(3)%x%dd, at(3)%y%dd] - h / 2 * cos(theta) * along), "<", tiny_part, "acceleration")
      call check_that(error, norm2([at(3)%x%ddd, at(3)%y%ddd] + h / 2 * sin(theta) * along), "<", tiny_part, "third derivative")
      if (allocated(error)) return
      ! The crank's centre of mass rests, so m s'' is the whole force.
      call linkage%mass_functions(phi, a)
      call check_that(error, norm2([a%a1%dd, a%a2%dd] - 3 * h / 2 * cos(theta) * along), "<", 3 * tiny_part, "m s''")
      if (allocated(error)) return
    end do
  end subroutine test_harmonic

  !> A round cam whose centre lies 1 m off its shaft lifts by cos(theta), like the slot of a yoke.
  subroutine test_yoke(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(4)
    type(guide_type) :: guide
    type(gestell_error), allocatable :: failure
    integer :: k

    guide = guide_type(point=[0.0_dp, 0.0_dp], angle=1.1_dp)
    call new_cam(linkage, guide, [0.0_dp, 1.0_dp, 0.0_dp], 0.0_dp, failure)
    call linkage%rpp("Y", "A", guide, pi / 2, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 0, 12
      call linkage%points(0.5_dp * k, at)
      call check_that(error, maxval(abs([at(3)%x%v - at(4)%x%v, at(3)%y%v - at(4)%y%v, at(3)%x%d - at(4)%x%d, at(3)%y%d &
        & - at(4)%y%d, at(3)%x%dd - at(4)%x%dd, at(3)%y%dd - at(4)%y%dd])), "<", tiny_part, "two descriptions")
      if (allocated(error)) return
    end do
  end subroutine test_yoke

  !> Orders 0, 1 and 3 from 7, 8 and 24 values; of 6 values the third order is the one that alternates.
  subroutine test_table(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: lift(7) = [0.5_dp, -0.2_dp, 0.1_dp, 0.0_dp, 0.0_dp, 0.03_dp, 0.04_dp]
    integer, parameter :: counts(3) = [7, 8, 24]
    real(dp), allocatable :: found(:), table(:)
    integer :: i, k

    do i = 1, size(counts)
      allocate(table, source=[(lift_at(lift, 2 * pi * (k - 1) / counts(i)), k = 1, counts(i))])
      found = lift_through(table)
      deallocate(table)
      call check(error, size(found), size(lift))
      if (allocated(error)) return
      call check_that(error, maxval(abs(found - lift)), "<", 1.0e-15_dp, "harmonics of a table")
      if (allocated(error)) return
    end do
    table = [0.1_dp, 0.3_dp, 0.2_dp, 0.9_dp, 0.4_dp, 0.6_dp]
    found = lift_through(table)
    call check(error, size(found), 7)
    if (allocated(error)) return
    call check_that(error, abs(found(7)), "<", tiny_part, "an alternating term is a cosine")
    if (allocated(error)) return
    do k = 1, 6
      call check_that(error, abs(lift_at(found, pi * (k - 1) / 3) - table(k)), "<", 1.0e-15_dp, "a value of the table")
      if (allocated(error)) return
    end do
    call check(error, size(lift_through([0.3_dp, 0.3_dp, 0.3_dp, 0.3_dp])), 1, more="a constant lift")
  end subroutine test_table

  pure real(dp) function lift_at(lift, theta)
    real(dp), intent(in) :: lift(:), theta
    integer :: k

    lift_at = lift(1) + sum([(lift(2 * k) * cos(k * theta) + lift(2 * k + 1) * sin(k * theta), k = 1, size(lift) / 2)])
  end function lift_at

  !> A four-bar O-A-B-P: the rocker is the cam, the coupler carries the guide. The derivatives are compared with central
  !> differences of fourth order of the positions, the angles with the closed form of `locate`, by atan2.
  subroutine test_carried(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(guide_type) :: guide
    type(point_type) :: at(5)
    type(mass_functions_type) :: a
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: lift(5) = [0.3_dp, 0.1_dp, -0.2_dp, 0.05_dp, 0.02_dp], phase = 0.4_dp
    real(dp), parameter :: step = 1.0e-2_dp, fourth(-2:2) = [1, -8, 0, 8, -1] / 12.0_dp
    real(dp) :: places(2, -2:2), speeds(2, -2:2), phi(32), table(32, table_columns), theta, along(2)
    integer :: i, k

    call new_crank(linkage, failure)
    call linkage%ground("P", [4.0_dp, 0.5_dp], failure)
    call linkage%rrr("B", ["A", "P"], [4.2_dp, 3.2_dp], -1, failure)
    call linkage%moving_guide(["A", "B"], [0.2_dp, 0.1_dp], 0.6_dp, guide, failure)
    call linkage%add_joint("T", follower_joint(guide, guide_type([3, 4], angle=phase), lift), failure)
    call linkage%link("tappet", "T", "B", 3.0_dp, 0.5_dp, [0.1_dp, 0.2_dp], failure)
    if (.not. allocated(failure)) call linkage%prepare(failure)
    call check_success(error, failure)
    if (allocated(error)) return
    phi = [(0.2_dp * k, k = 1, 32)]
    call linkage%tabulate(phi, table)
    do k = 1, 32
      do i = -2, 2
        call linkage%points(phi(k) + i * step, at)
        places(:, i) = [at(5)%x%v, at(5)%y%v]
        speeds(:, i) = [at(5)%x%d, at(5)%y%d]
      end do
      call linkage%points(phi(k), at)
      along = [cos(0.6_dp + angle(at(2), at(4))), sin(0.6_dp + angle(at(2), at(4)))]
      theta = angle(at(3), at(4)) - atan2(along(2), along(1)) + phase
      associate (e => angle(at(2), at(4)))
        call check_that(error, norm2(places(:, 0) - [at(2)%x%v + 0.2_dp * cos(e) - 0.1_dp * sin(e), at(2)%y%v + 0.2_dp * sin(e) &
          & + 0.1_dp * cos(e)] - lift_at(lift, theta) * along), "<", tiny_part, "place")
      end associate
      if (allocated(error)) return
      ! h^4/30 times a fifth derivative of less than 10.
      call check_that(error, norm2(matmul(places, fourth) / step - speeds(:, 0)), "<", 1.0e-8_dp, "speed")
      call check_that(error, norm2(matmul(speeds, fourth) / step - [at(5)%x%dd, at(5)%y%dd]), "<", 1.0e-7_dp, "acceleration")
      if (allocated(error)) return
      call linkage%mass_functions(phi(k), a)
      call check_that(error, maxval(abs(table(k, [a1_dd, a2_dd, a3_dd, a4_v]) - [a%a1%dd, a%a2%dd, a%a3%dd, a%a4])), "<", &
        & 1.0e-12_dp, "in a batch")
      if (allocated(error)) return
    end do

  contains

    pure real(dp) function angle(from, to)
      type(point_type), intent(in) :: from, to

      angle = atan2(to%y%v - from%y%v, to%x%v - from%x%v)
    end function angle

  end subroutine test_carried

  !> A guide that passes the cam's centre at e = 1/2: tan(pressure angle) = |s' - e|/(d + s), here d + s = 5 - cos(theta) and
  !> s' = sin(theta): on the way out the offset helps, on the way back it harms.
  subroutine test_diagnosis(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(diagnosis_type) :: diagnosis
    type(gestell_error), allocatable :: failure
    integer, parameter :: samples = 100000
    real(dp) :: tangents(samples)
    integer :: k

    do k = 1, samples
      tangents(k) = abs(sin(2 * pi * k / samples) - 0.5_dp) / (5 - cos(2 * pi * k / samples))
    end do
    call new_cam(linkage, guide_type(point=[0.5_dp, 4.0_dp], angle=pi / 2), [1.0_dp, -1.0_dp, 0.0_dp], 0.0_dp, failure)
    call linkage%prepare(failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call diagnose(linkage, diagnosis, failure)
    call check(error, all([diagnosis%links, diagnosis%pairs, diagnosis%higher_pairs, diagnosis%mobility] == [3, 2, 1, 1]), &
      & "Gruebler's count")
    if (allocated(error)) return
    call check(error, diagnosis%joints(3)%y(1), 4.0_dp, thr=1.0e-12_dp)
    if (allocated(error)) return
    call check(error, diagnosis%joints(3)%travel(2) - diagnosis%joints(3)%travel(1), 2.0_dp, thr=1.0e-12_dp, more="stroke")
    if (allocated(error)) return
    call check(error, diagnosis%joints(3)%transmission, pi / 2 - atan(maxval(tangents)), thr=1.0e-8_dp, more="pressure angle")
    if (allocated(error)) return
    ! An extreme is flat.
    call check(error, diagnosis%joints(3)%transmission_at, modulo(2 * pi * maxloc(tangents, dim=1) / samples + pi / 2, 2 * pi), &
      & thr=1.0e-3_dp, more="where")
  end subroutine test_diagnosis

  subroutine test_refused(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure

    ! The proof takes no more intervals than the crank alone, however high the orders, because a follower cannot come apart.
    call new_cam(linkage, guide_type(), [1.0_dp, spread(1.0e-3_dp, 1, 40)], 0.0_dp, failure)
    call linkage%prepare(failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, real(linkage%intervals, dp), "<", 20.0_dp, "intervals of the proof")
    call check_that(error, abs(20 * linkage%angle_scale - 1), "<", 1.0e-12_dp, "order 20 is the finest")
    if (allocated(error)) return
    call refused([1.0_dp, 2.0_dp], [1, 2], &
      & "joint 'T': the lift must have an odd number of values: the mean, then one cosine and one sine coefficient for each order")
    if (allocated(error)) return
    call refused([huge(1.0_dp)], [1, 2], "joint 'T': coordinates must lie between -1e100 m and 1e100 m")
    if (allocated(error)) return
    call refused([1.0_dp], [2, 2], "joint 'T': the cam must refer to two different joints")
    if (allocated(error)) return
    call refused([1.0_dp], [2, 3], "joint 'T': the joint refers to joints that do not exist")

  contains

    subroutine refused(lift, cam, message)
      real(dp), intent(in) :: lift(:)
      integer, intent(in) :: cam(2)
      character(len=*), intent(in) :: message
      type(linkage_type) :: other
      type(gestell_error), allocatable :: reason

      call new_crank(other, reason)
      call other%add_joint("T", follower_joint(guide_type(), guide_type(cam), lift), reason)
      call check(error, allocated(reason), "refused")
      if (.not. allocated(error)) call check(error, reason%message, message)
    end subroutine refused

  end subroutine test_refused

end module test_follower
