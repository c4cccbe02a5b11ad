!> Long chains of joints: how far accelerations deviate, that the proof of assembly succeeds, and its cost.
module test_chains
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_jet, only: jet
  use gestell_model_joints_deviation, only: deviation_type
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: joint_type, point_type, reach_type
  use gestell_model_joints_types_crank, only: crank_joint
  use gestell_model_joints_types_cylinder, only: cylinder_joint
  use gestell_model_joints_types_rigid, only: rigid_joint
  use gestell_model_joints_types_rpr, only: rpr_joint
  use gestell_model_joints_types_rrp, only: rrp_joint
  use gestell_model_joints_types_rrr, only: rrr_joint
  use gestell_model_linkage, only: linkage_type
  use reference_random, only: random_type
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_chains

  !> The paper's four-bar (m).
  real(dp), parameter :: crank = 0.07_dp, coupler = 0.37_dp, rocker = 0.16_dp, ground = 0.40_dp

contains

  subroutine collect_chains(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("accelerations along joint chains deviate by no more than their bound", test_deviations), &
      & new_unittest("a dead point behind thirty rockers is found", test_far_dead_point), &
      & new_unittest("random chains are proved to turn exactly if a fine grid confirms it", test_random), &
      & new_unittest("the number of proof intervals does not grow with the chain's length", test_intervals)]
  end subroutine collect_chains

  !> Joints built on earlier ones that move along cubics, whose accelerations deviate linearly at a known rate.
  subroutine test_deviations(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: cases = 4000
    real(dp), parameter :: widths(0:3) = [0.3_dp, 0.1_dp, 0.02_dp, 0.004_dp]
    character(len=8), parameter :: names(7) = [character(len=8) :: "rrr", "rrp", "rigid", "rpr", "crank", "cylinder", "ram"]
    type(random_type) :: random
    class(joint_type), allocatable :: joint
    type(cylinder_joint) :: cylinder
    real(dp) :: places(2, 0:3, 2), tightest(7), length, stroke(5)
    integer :: i, k, n, kind, proved(7)

    tightest = 0
    proved = 0
    do i = 1, cases
      call random%start(i, 1)
      places = reshape([(random%between(-1.0_dp, 1.0_dp), k = 1, size(places))], shape(places))
      ! some stand still, some move steadily
      do n = 1, 2
        k = merge(4, random%pick(4), random%chance(0.6_dp))
        if (k < 4) places(:, k:, n) = 0
      end do
      kind = 1 + modulo(i, size(names))
      ! in gfortran 12 assignments between types with and without allocatable components corrupt memory
      if (allocated(joint)) deallocate(joint)
      select case (kind)
      case (1)
        joint = rrr_joint([1, 2], [random%between(0.3_dp, 1.5_dp), random%between(0.3_dp, 1.5_dp)], 1)
      case (2)
        length = random%between(0.3_dp, 1.5_dp)
        joint = rrp_joint(guide_type(angle=random%between(0.0_dp, 6.0_dp)), 2, length, -1)
      case (3)
        joint = rigid_joint([1, 2], [random%between(-1.0_dp, 1.0_dp), random%between(-1.0_dp, 1.0_dp)])
      case (4)
        joint = rpr_joint([1, 2], random%between(0.3_dp, 1.5_dp), 1)
      case (5)
        length = random%between(0.1_dp, 1.0_dp)
        joint = crank_joint(pivot=1, radius=length, phase=0.3_dp, ratio=random%pick(3))
      case default
        stroke = [random%between(0.3_dp, 1.5_dp), (random%between(-0.1_dp, 0.1_dp), k = 1, 4)]
        length = random%between(0.3_dp, 1.5_dp)
        cylinder = cylinder_joint(stroke=stroke, ends=[1, 2], lever=length, branch=-1)
        if (kind == 7) cylinder = cylinder_joint(stroke=stroke, ratio=2)
        allocate(joint, source=cylinder)
      end select
      call check_deviation(joint, places, widths(modulo(i, 4)), tightest(kind), proved(kind), error)
      if (allocated(error)) return
    end do
    do kind = 1, size(names)
      call check_that(error, proved(kind), ">", 100, "bounds were proved for " // trim(names(kind)))
      call check_that(error, tightest(kind), ">", 0.5_dp, "the bound is not too wide for " // trim(names(kind)))
      if (allocated(error)) return
    end do
  end subroutine test_deviations

  !> `places`: coefficients of t^k / k! of the earlier joints.
  subroutine check_deviation(joint, places, half_width, tightest, proved, error)
    class(joint_type), intent(in) :: joint
    real(dp), intent(in) :: places(2, 0:3, 2), half_width
    real(dp), intent(inout) :: tightest
    integer, intent(inout) :: proved
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: samples = 20, directions = 24
    type(deviation_type) :: earlier(2), deviation
    type(point_type) :: here, there
    type(reach_type) :: reach
    real(dp) :: speeds(2), accelerations(2), n(2, directions + 2), off, bound
    integer :: i, k

    do i = 1, 2
      accelerations(i) = norm2(places(:, 2, i)) + half_width * norm2(places(:, 3, i))
      speeds(i) = norm2(places(:, 1, i)) + half_width * accelerations(i)
      earlier(i)%b = half_width * places(:, 3, i)
    end do
    reach = joint%reach_at(0.0_dp, moved(0.0_dp), speeds, accelerations, half_width)
    if (.not. reach%assembled) return
    proved = proved + 1
    call joint%locate(0.0_dp, moved(0.0_dp), here)
    deviation = joint%deviation(moved(0.0_dp), here, earlier, reach%acceleration, half_width)
    ! across the sides of the parallelogram, and all around
    n = reshape([([cos(pi * k / directions), sin(pi * k / directions)], k = 1, directions + 2)], shape(n))
    if (norm2(deviation%a) > 0) n(:, 1) = [-deviation%a(2), deviation%a(1)] / norm2(deviation%a)
    if (norm2(deviation%b) > 0) n(:, 2) = [-deviation%b(2), deviation%b(1)] / norm2(deviation%b)
    do i = -samples, samples
      call joint%locate(half_width * i / samples, moved(half_width * i / samples), there)
      do k = 1, size(n, 2)
        off = abs(dot_product([there%x%dd - here%x%dd, there%y%dd - here%y%dd], n(:, k)))
        bound = deviation%along(n(:, k))
        ! roundings of the second derivatives
        call check_that(error, off, "<=", bound + 1.0e-10_dp * (1 + reach%acceleration), "deviation")
        if (allocated(error)) return
        if (bound > 1.0e-6_dp) tightest = max(tightest, off / bound)
      end do
    end do

  contains

    function moved(t) result(points)
      real(dp), intent(in) :: t
      type(point_type) :: points(2)
      integer :: j

      do j = 1, 2
        points(j) = point_type(along(places(1, :, j), t), along(places(2, :, j), t))
      end do
    end function moved

  end subroutine check_deviation

  pure type(jet) function along(c, t)
    real(dp), intent(in) :: c(0:), t

    along = jet(c(0) + t * (c(1) + t * (c(2) / 2 + t * c(3) / 6)), c(1) + t * (c(2) + t * c(3) / 2), c(2) + t * c(3), c(3))
  end function along

  !> Adds rockers to a four-bar, each forming a parallelogram with the one before; `last`: the last rocker's joint.
  subroutine add_rockers(linkage, count, last, failure)
    type(linkage_type), intent(out) :: linkage
    integer, intent(in) :: count
    character(len=8), intent(out) :: last
    type(gestell_error), allocatable, intent(out) :: failure
    character(len=8) :: pivot
    integer :: k

    call add_four_bar(linkage, failure)
    last = "B"
    do k = 1, count
      write (pivot, "('G', i0)") k
      if (.not. allocated(failure)) call linkage%ground(pivot, [ground + 0.2_dp * k, 0.0_dp], failure)
      if (.not. allocated(failure)) call linkage%rrr("P" // pivot(2:), [character(len=8) :: last, pivot], [0.2_dp, rocker], 1, &
        & failure)
      last = "P" // pivot(2:)
    end do
  end subroutine add_rockers

  subroutine add_four_bar(linkage, failure)
    type(linkage_type), intent(out) :: linkage
    type(gestell_error), allocatable, intent(out) :: failure

    call linkage%ground("A0", [0.0_dp, 0.0_dp], failure)
    call linkage%ground("B0", [ground, 0.0_dp], failure)
    call linkage%crank("A", "A0", crank, 0.0_dp, failure)
    call linkage%rrr("B", ["A ", "B0"], [coupler, rocker], 1, failure)
    call linkage%link("coupler", "A", "B", 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
  end subroutine add_four_bar

  !> All rockers are farthest back where crank and coupler fold; there the last dyad is stretched: cos of the rocker's angle is
  !> -(c^2 + d^2 - (b - a)^2) / (2 c d).
  subroutine test_far_dead_point(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: count = 30
    real(dp), parameter :: away = 0.3_dp, gaps(4) = [-1.0e-3_dp, -1.0e-9_dp, 1.0e-6_dp, 1.0e-2_dp]
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    character(len=8) :: last
    real(dp) :: cosine, farthest
    integer :: i

    cosine = -(rocker**2 + ground**2 - (coupler - crank)**2) / (2 * rocker * ground)
    farthest = sqrt(rocker**2 + away**2 - 2 * rocker * away * cosine)
    do i = 1, size(gaps)
      call add_rockers(linkage, count, last, failure)
      if (.not. allocated(failure)) call linkage%ground("Q", [ground + 0.2_dp * count + away, 0.0_dp], failure)
      if (.not. allocated(failure)) call linkage%rrr("C", [character(len=8) :: last, "Q"], &
        & [0.2_dp, farthest - 0.2_dp + gaps(i)], 1, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call linkage%prepare(failure)
      if (gaps(i) > 0) then
        call check_success(error, failure)
      else
        call check_failure(error, failure, "joint 'C'")
      end if
      if (allocated(error)) return
    end do
  end subroutine test_far_dead_point

  !> Chains of rockers of all lengths. A fine grid shows whether they turn, except where the smallest margin of their dyads is
  !> less than its possible change between two angles.
  subroutine test_random(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: chains = 150, dyads = 8
    real(dp), parameter :: open = 2.0e-3_dp
    type(random_type) :: random
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    real(dp) :: pivots(2, dyads), lengths(2, dyads), margin
    character(len=8) :: last, pivot
    integer :: i, k, turning, stopped

    turning = 0
    stopped = 0
    do i = 1, chains
      call random%start(i, 2)
      call add_four_bar(linkage, failure)
      last = "B"
      do k = 1, dyads
        pivots(:, k) = [ground + 0.2_dp * k + random%between(-0.01_dp, 0.01_dp), random%between(-0.01_dp, 0.01_dp)]
        lengths(:, k) = [random%between(0.19_dp, 0.21_dp), random%between(0.15_dp, 0.18_dp)]
        write (pivot, "('G', i0)") k
        call linkage%ground(pivot, pivots(:, k), failure)
        call linkage%rrr("P" // pivot(2:), [character(len=8) :: last, pivot], lengths(:, k), 1, failure)
        last = "P" // pivot(2:)
      end do
      call linkage%prepare(failure)
      margin = least_margin(pivots, lengths)
      if (margin < 0) call check_failure(error, failure, what="no place in the chain")
      if (margin > open) call check_success(error, failure)
      if (allocated(error)) return
      if (margin < 0) stopped = stopped + 1
      if (margin > open) turning = turning + 1
    end do
    call check_that(error, stopped, ">", 20, "chains that cannot turn")
    call check_that(error, turning, ">", 20, "chains that turn")
  end subroutine test_random

  !> The smallest distance (m) of the dyads' ends from stretching and folding them; negative if they cannot be assembled.
  real(dp) function least_margin(pivots, lengths) result(margin)
    real(dp), intent(in) :: pivots(:, :), lengths(:, :)
    integer, parameter :: angles = 20000
    real(dp) :: phi, at(2)
    integer :: i, k

    margin = huge(margin)
    do i = 1, angles
      phi = 2 * pi * i / angles
      at = closed(crank * [cos(phi), sin(phi)], [ground, 0.0_dp], [coupler, rocker])
      do k = 1, size(lengths, 2)
        associate (d => norm2(pivots(:, k) - at), l => lengths(:, k))
          margin = min(margin, sum(l) - d, d - abs(l(1) - l(2)))
        end associate
        if (margin < 0) return
        at = closed(at, pivots(:, k), lengths(:, k))
      end do
    end do
  end function least_margin

  !> The joint of a dyad to the left of the line between its ends, by the law of cosines.
  pure function closed(one, two, l) result(here)
    real(dp), intent(in) :: one(2), two(2), l(2)
    real(dp) :: here(2), d, angle

    d = norm2(two - one)
    angle = atan2(two(2) - one(2), two(1) - one(1)) + acos((l(1)**2 + d**2 - l(2)**2) / (2 * l(1) * d))
    here = one + l(1) * [cos(angle), sin(angle)]
  end function closed

  !> Chains of equal members: their motion is no finer the longer they are. With bounds that ignore directions 32 rockers would
  !> need 65 times as many intervals, and 32 pins on rockers more than 3000 times as many.
  subroutine test_intervals(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: counts(2) = [8, 64]
    character(len=20), parameter :: names(3) = [character(len=20) :: "rockers", "pins on rockers", "sliders"]
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    integer :: intervals(2), i, kind

    do kind = 1, size(names)
      do i = 1, size(counts)
        call build(kind, counts(i), linkage, failure)
        if (.not. allocated(failure)) call linkage%prepare(failure)
        call check_success(error, failure, trim(names(kind)))
        if (allocated(error)) return
        intervals(i) = linkage%intervals
      end do
      ! The error of a bound grows with the number of members, its effect with its third root.
      call check_that(error, intervals(2), "<=", 5 * intervals(1) / 2, trim(names(kind)))
      if (allocated(error)) return
    end do
  end subroutine test_intervals

  !> (Names joined within a list of texts come out wrong of gfortran 12 with -O3: `rod` is joined before.)
  subroutine build(kind, count, linkage, failure)
    integer, intent(in) :: kind, count
    type(linkage_type), intent(out) :: linkage
    type(gestell_error), allocatable, intent(out) :: failure
    character(len=8) :: last, pivot, before, rod
    character(len=4) :: number
    integer :: k

    if (kind == 1) then
      call add_rockers(linkage, count, last, failure)
      return
    end if
    call add_four_bar(linkage, failure)
    last = "B"
    before = "B0"
    do k = 1, count
      write (number, "(i0)") k
      pivot = "G" // trim(number)
      rod = "R" // trim(number)
      if (kind == 2) then
        ! the next coupler hangs on a pin off the rocker's line
        call linkage%rigid(rod, [before, last], [0.15_dp, 0.02_dp], failure)
        call linkage%ground(pivot, [ground + 0.2_dp * k, 0.02_dp], failure)
        call linkage%rrr("P" // number, [rod, pivot], [0.2_dp, rocker], 1, failure)
      else
        ! a rod to a slider, another one to a rocker
        call linkage%rrp(rod, last, 0.3_dp, guide_type(point=[0.0_dp, 0.1_dp]), 1, failure)
        call linkage%ground(pivot, [ground + 0.05_dp + 0.3_dp * k, 0.0_dp], failure)
        call linkage%rrr("P" // number, [rod, pivot], [0.16_dp, rocker], -1, failure)
      end if
      if (allocated(failure)) return
      before = pivot
      last = "P" // trim(number)
    end do
  end subroutine build

end module test_chains
