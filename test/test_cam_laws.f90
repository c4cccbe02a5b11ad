!> Cam laws by segments against closed forms: the laws themselves, followers that obey them, and the steps of the integration.
module test_cam_laws
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_law, only: dwell, harmonic, law_type, modified_sine, modified_trapezoid, new_law, normalised, &
    & polynomial_345, polynomial_4567
  use gestell_model_joints_types_follower, only: follower_joint
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: a2_d, a2_dd, table_columns
  use machines, only: new_crank
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_cam_laws

  integer, parameter :: laws(5) = [harmonic, polynomial_345, polynomial_4567, modified_sine, modified_trapezoid]
  !> Maxima of |f'| and |f''|: VDI 2143; R. L. Norton, Cam Design and Manufacturing Handbook.
  real(dp), parameter :: speeds(5) = [1.5707963267949_dp, 1.875_dp, 2.1875_dp, 1.75960338595377_dp, 2.0_dp], &
    & accelerations(5) = [4.93480220054468_dp, 5.7735026918963_dp, 7.5131884043993_dp, 5.52795707054409_dp, 4.88812376281326_dp]
  real(dp), parameter :: degree = pi / 180

contains

  subroutine collect_cam_laws(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("each law has the peaks of its published closed form", test_peaks), &
      & new_unittest("derivatives of the laws agree with differences and are continuous", test_derivatives), &
      & new_unittest("a follower with dwells moves by the closed form, alone and in a batch", test_follower), &
      & new_unittest("kinks lie where a rocking cam passes from part to part", test_kinks), &
      & new_unittest("accelerations jump only where harmonic laws meet other laws", test_jumps), &
      & new_unittest("steps end at kinks at every speed, in both directions", test_breaks), &
      & new_unittest("segments that do not define a cam are refused", test_refused)]
  end subroutine collect_cam_laws

  subroutine test_peaks(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: samples = 20000
    real(dp) :: f(0:3, 0:samples), bounds(0:2)
    type(law_type) :: law
    character(len=16) :: key
    character(len=200) :: reason
    integer :: i, k

    do i = 1, size(laws)
      f = reshape([(normalised(laws(i), real(k, dp) / samples), k = 0, samples)], shape(f))
      ! Near an interior maximum of f'' samples miss it by less than 1e-7.
      call check_that(error, abs(maxval(abs(f(1, :))) - speeds(i)), "<", 1.0e-12_dp, "speed")
      call check_that(error, abs(maxval(abs(f(2, :))) - accelerations(i)), "<", 1.0e-6_dp, "acceleration")
      call check_that(error, maxval(abs(f(:2, 0) - [0.0_dp, 0.0_dp, f(2, 0)])), "<", 1.0e-15_dp, "start")
      call check_that(error, abs(f(0, samples) - 1) + abs(f(1, samples)), "<", 1.0e-15_dp, "end")
      call new_law(law, [laws(i), dwell, laws(i)], [60, 180, 120] * degree, [0.03_dp, 0.01_dp], key, reason)
      bounds = law%bounds()
      ! 20 mm in 60 deg exceed 20 mm in 120 deg.
      call check_that(error, abs(bounds - [0.03_dp, speeds(i) * 0.02_dp * 3 / pi, accelerations(i) * 0.02_dp * (3 / pi)**2]), &
        & "<", 1.0e-12_dp, "bounds")
      if (allocated(error)) return
    end do
  end subroutine test_peaks

  !> Central differences of fourth order inside the parts, and both sides of each place where parts may meet.
  subroutine test_derivatives(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: step = 1.0e-3_dp, fourth(-2:2) = [1, -8, 0, 8, -1] / (12 * step), close = 1.0e-9_dp
    real(dp) :: f(0:3, -2:2), z
    integer :: i, k, n

    do i = 1, size(laws)
      do k = 1, 79
        z = (k + 0.5_dp) / 80
        f = reshape([(normalised(laws(i), z + n * step), n = -2, 2)], shape(f))
        ! step^4/30 times a fifth derivative of f'' of less than (4 pi)^5 5 is 5e-8.
        call check_that(error, abs(matmul(f(:2, :), fourth) - f(1:, 0)), "<", 1.0e-6_dp, "difference")
      end do
      do k = 1, 7
        f(:, 1:2) = reshape([normalised(laws(i), k / 8.0_dp - close), normalised(laws(i), k / 8.0_dp + close)], [4, 2])
        call check_that(error, abs(f(:2, 2) - f(:2, 1)), "<", 200 * close, "continuity")
      end do
      if (allocated(error)) return
    end do
  end subroutine test_derivatives

  !> A vertical follower of 3 kg with the law `law` on the crank O-A. The cam's angle is the crank angle.
  subroutine new_cam(linkage, law, failure)
    type(linkage_type), intent(out) :: linkage
    type(law_type), intent(in) :: law
    type(gestell_error), allocatable, intent(out) :: failure
    type(follower_joint) :: follower

    call new_crank(linkage, failure)
    follower%guide = guide_type(point=[0.2_dp, 1.5_dp], angle=pi / 2)
    follower%cam = guide_type([1, 2], angle=pi / 2)
    follower%law = law
    call linkage%add_joint("T", follower, failure)
    if (.not. allocated(failure)) call linkage%link("tappet", "T", "", 3.0_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    if (.not. allocated(failure)) call linkage%prepare(failure)
  end subroutine new_cam

  !> Rise of 0.4 m in 60 deg by 3-4-5, dwell of 40 deg, return in 200 deg by 4-5-6-7, dwell.
  subroutine test_follower(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(law_type) :: law
    type(point_type) :: at(3)
    type(gestell_error), allocatable :: failure
    character(len=16) :: key
    character(len=200) :: reason
    real(dp), parameter :: h = 0.4_dp, tiny_part = 1.0e-13_dp
    real(dp) :: phi(72), table(72, table_columns), crank(72, table_columns), s(0:3), z
    type(linkage_type) :: bare
    integer :: k

    call new_law(law, [polynomial_345, dwell, polynomial_4567, dwell], [60, 40, 200, 60] * degree, [0.1_dp + h, 0.1_dp], key, &
      & reason)
    call check_that(error, trim(reason), "==", "", "law")
    call new_cam(linkage, law, failure)
    call check_success(error, failure)
    call new_crank(bare, failure)
    if (allocated(error)) return
    call check_that(error, abs(linkage%angle_scale - 1 / 6.0_dp), "<", 1.0e-12_dp, "60 deg are a sixth of a turn")
    phi = [(5 * (k - 0.5_dp) * degree, k = 1, 72)]
    call linkage%tabulate(phi, table)
    call bare%tabulate(phi, crank)
    do k = 1, 72
      s = 0
      if (phi(k) < 60 * degree) then
        z = phi(k) / (60 * degree)
        s = h * [z**3 * (10 - 15 * z + 6 * z**2), 30 * z**2 - 60 * z**3 + 30 * z**4, 60 * z - 180 * z**2 + 120 * z**3, &
          & 60 - 360 * z + 360 * z**2] * (3 / pi)**[0, 1, 2, 3]
      else if (phi(k) < 100 * degree) then
        s(0) = h
      else if (phi(k) < 300 * degree) then
        z = (phi(k) - 100 * degree) / (200 * degree)
        s = [h, 0.0_dp, 0.0_dp, 0.0_dp] - h * [35 * z**4 - 84 * z**5 + 70 * z**6 - 20 * z**7, 140 * z**3 - 420 * z**4 + 420 * z**5 &
          & - 140 * z**6, 420 * z**2 - 1680 * z**3 + 2100 * z**4 - 840 * z**5, 840 * z - 5040 * z**2 + 8400 * z**3 &
          & - 4200 * z**4] * (0.9_dp / pi)**[0, 1, 2, 3]
      end if
      call linkage%points(phi(k), at)
      associate (y => at(3)%y)
        call check_that(error, abs([y%v - 1.6_dp, y%d, y%dd, y%ddd] - s), "<", 50 * tiny_part, "motion")
      end associate
      call check_that(error, abs((table(k, [a2_d, a2_dd]) - crank(k, [a2_d, a2_dd])) - 3 * s(1:2)), "<", 50 * tiny_part, "batch")
      if (allocated(error)) return
    end do
  end subroutine test_follower

  !> A rocker of a four-bar is the cam: its angle, by atan2, equals the law's parts at all kinks, and each is passed both ways.
  subroutine test_kinks(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(law_type) :: law
    type(follower_joint) :: follower
    type(point_type) :: at(5)
    type(gestell_error), allocatable :: failure
    character(len=16) :: key
    character(len=200) :: reason
    !> Ends of the parts in two segments of 120 deg, and of the dwell
    integer, parameter :: parts(*) = [15, 45, 75, 105, 120, 135, 165, 195, 225, 240, 360]
    real(dp), allocatable :: passed(:)
    real(dp) :: angle, least, maximum
    integer :: k

    call new_law(law, [modified_trapezoid, modified_trapezoid, dwell], [120, 120, 120] * degree, [0.4_dp, 0.1_dp], key, reason)
    call new_crank(linkage, failure)
    call linkage%ground("P", [4.0_dp, 0.5_dp], failure)
    call linkage%rrr("B", ["A", "P"], [4.0_dp, 1.6_dp], -1, failure)
    follower%guide = guide_type(point=[5.0_dp, 0.0_dp], angle=0.0_dp)
    follower%cam = guide_type([3, 4], angle=-2.0_dp)
    follower%law = law
    call linkage%add_joint("T", follower, failure)
    call linkage%link("tappet", "T", "", 3.0_dp, 0.5_dp, [0.1_dp, 0.2_dp], failure)
    if (.not. allocated(failure)) call linkage%prepare(failure)
    call check_success(error, failure)
    if (allocated(error)) return
    passed = law%kinks()
    call check_that(error, size(passed), "==", size(parts), "number of parts")
    call check_that(error, [(minval(abs(passed - parts(k) * degree)), k = 1, size(parts))], "<", 1.0e-12_dp, "ends of parts")
    least = huge(least)
    maximum = -huge(maximum)
    do k = 0, 3600
      angle = cam_angle(0.1_dp * k * degree)
      least = min(least, angle)
      maximum = max(maximum, angle)
    end do
    passed = pack(parts * degree, parts * degree > least .and. parts * degree < maximum)
    call check_that(error, size(passed), ">", 1, "parts that the rocker reaches")
    call check_that(error, size(linkage%kinks), "==", 2 * size(passed), "number of kinks")
    do k = 1, size(linkage%kinks)
      call check_that(error, minval(abs(cam_angle(linkage%kinks(k)) - passed)), "<", 1.0e-12_dp, "kink")
    end do
    call check_that(error, linkage%kinks(2:), ">", linkage%kinks(:size(linkage%kinks) - 1), "ascending")

  contains

    !> Angle of the cam, which is keyed 2 rad behind its line, from 0 to 2 pi.
    real(dp) function cam_angle(phi)
      real(dp), intent(in) :: phi

      call linkage%points(phi, at)
      cam_angle = modulo(atan2(at(4)%y%v - at(3)%y%v, at(4)%x%v - at(3)%x%v) - 2, 2 * pi)
    end function cam_angle

  end subroutine test_kinks

  subroutine test_jumps(error)
    type(error_type), allocatable, intent(out) :: error
    type(law_type) :: law
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    type(frame_type) :: frame
    character(len=16) :: key
    character(len=200) :: reason
    real(dp), parameter :: a = pi**2 / 2 * 0.3_dp
    integer :: i

    do i = 2, size(laws)
      call new_law(law, [laws(i), dwell, laws(i)], [60, 180, 120] * degree, [0.4_dp, 0.1_dp], key, reason)
      call check_that(error, any(abs(law%jumps()) > 0), "==", .false., "smooth acceleration")
    end do
    ! Rise in 90 deg, dwell of 90 deg, return in 180 deg that ends where the rise starts.
    call new_law(law, [harmonic, dwell, harmonic], [90, 90, 180] * degree, [0.4_dp, 0.1_dp], key, reason)
    call check_that(error, abs(law%jumps() - [a * (2 / pi)**2, -a / pi**2, a * (2 / pi)**2 - a / pi**2]), "<", 1.0e-14_dp, "jumps")
    call new_cam(linkage, law, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, linkage%jumps, "==", .true., "the linkage knows")
    call new_frame(frame, linkage, 50.0_dp, 5.0_dp, [0.0_dp, 0.0_dp], spread([1.0e5_dp, 0.0_dp, 0.0_dp], 2, 3), &
      & spread([0.0_dp, 0.0_dp, 0.0_dp], 2, 3), 10.0_dp, failure, held_by="outside")
    call check_failure(error, failure, "held_by = 'outside' requires cam laws without jumps of the acceleration")
    ! An eccentric.
    call new_law(law, [harmonic, harmonic], [180, 180] * degree, [0.4_dp, 0.1_dp], key, reason)
    call check_that(error, any(abs(law%jumps()) > 0), "==", .false., "a cosine")
  end subroutine test_jumps

  subroutine test_breaks(error)
    type(error_type), allocatable, intent(out) :: error
    type(law_type) :: law
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    type(frame_type) :: frame
    character(len=16) :: key
    character(len=200) :: reason
    real(dp), parameter :: expected(3) = [60, 100, 300] / 360.0_dp
    real(dp) :: stiffness(3, 3)
    integer :: k

    call new_law(law, [polynomial_345, dwell, polynomial_4567, dwell], [60, 40, 200, 60] * degree, [0.4_dp, 0.1_dp], key, reason)
    call new_cam(linkage, law, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, abs(linkage%kinks / (2 * pi) - expected), "<", 1.0e-14_dp, "kinks")
    stiffness = 0
    do k = 1, 3
      stiffness(k, k) = 1.0e5_dp
    end do
    do k = 1, 2
      call new_frame(frame, linkage, 50.0_dp, 50.0_dp, [0.0_dp, 0.0_dp], stiffness, stiffness / 1000, 7.0_dp * (3 - 2 * k), failure)
      call check_success(error, failure)
      if (allocated(error)) return
      if (k == 2) call frame%run_at(-19.0_dp)
      call frame%remember([0.1_dp, 0.2_dp])
      call frame%run_at(2 * frame%speed)
      call check_that(error, abs(frame%breaks / frame%period - merge(expected, 1 - expected(3:1:-1), k == 1)), "<", 1.0e-14_dp, &
        & "breaks")
      call check_that(error, abs(frame%period * frame%speed) - 2 * pi, "<", 1.0e-13_dp, "period")
    end do
  end subroutine test_breaks

  subroutine test_refused(error)
    type(error_type), allocatable, intent(out) :: error

    call refused([harmonic, harmonic], [180, 90, 90] * degree, [0.1_dp, 0.2_dp], "law_angle", &
      & "must have one value for each segment of 'law'")
    call refused([harmonic, harmonic], [180, 179] * degree, [0.1_dp, 0.2_dp], "law_angle", "must add up to 360 deg")
    call refused([harmonic, dwell], [180, 180] * degree, [0.1_dp], "law", &
      & "must have at least two segments that are not 'dwell': the follower must return")
    call refused([harmonic, harmonic, dwell], [120, 120, 120] * degree, [0.1_dp, 0.2_dp, 0.2_dp], "law_lift", &
      & "must have one value for each segment of 'law' that is not 'dwell'")

  contains

    subroutine refused(segments, widths, lifts, key, reason)
      integer, intent(in) :: segments(:)
      real(dp), intent(in) :: widths(:), lifts(:)
      character(len=*), intent(in) :: key, reason
      type(law_type) :: law
      character(len=16) :: found_key
      character(len=200) :: found

      call new_law(law, segments, widths, lifts, found_key, found)
      call check_that(error, trim(found_key) // ": " // trim(found), "==", key // ": " // reason)
    end subroutine refused

  end subroutine test_refused

end module test_cam_laws
