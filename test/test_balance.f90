!> Complete balance against closed forms and published numbers, and shaking forces of linkages that have counterweights as links.
module test_balance
  use balance_linkages, only: four_bar, examine_linkage, prepared, shake, skew_four_bar, slider_crank, speed
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism_shaking, only: shaking_type
  use gestell_study_balance, only: examine, residual_shaking_type, measure_residual, rigid_ground_type
  use gestell_study_balance_bodies, only: counterweight_type, with_counterweights
  use gestell_study_balance_least_squares, only: least_squares_type
  use gestell_study_balance_complete, only: balance_force, balanced, balanced_already, no_pivots, not_balanced
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_balance

  character(len=*), parameter :: weight_names(2) = [character(len=16) :: "first weight", "second weight"]

contains

  subroutine collect_balance(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("counterweights of a four-bar agree with Berkof and Lowen (1969)", test_four_bar), &
      & new_unittest("counterweights of a slider-crank agree with a calculation by hand", test_slider_crank), &
      & new_unittest("a Watt six-bar is force-balanced by three counterweights", test_six_bar), &
      & new_unittest("a Scotch yoke has no complete balance; half its mass is balanced", test_impossible_balance), &
      & new_unittest("reported residual forces agree with a linkage that carries the counterweights", test_residual_forces), &
      & new_unittest("links that form one rigid body receive one counterweight", test_bodies), &
      & new_unittest("the lexicographic least-squares solution satisfies its optimality conditions", test_least_squares)]
  end subroutine collect_balance

  !> Berkof, Lowen, J. Eng. Ind. 91, 1969, 21-26: with the coupler's centre at s from A on its length l the crank needs m (1 -
  !> s/l) r in addition to its own moment, the rocker m s/l l_4: 0.6 (0.19/0.37) 0.07 + 0.5 0.03 and 0.6 (0.18/0.37) 0.16 + 0.25
  !> 0.08 kg m.
  subroutine test_four_bar(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(rigid_ground_type) :: rigid
    type(shaking_type) :: found
    type(counterweight_type), allocatable :: weights(:), none(:)
    type(gestell_error), allocatable :: failure
    class(linkage_type), allocatable :: other
    type(residual_shaking_type) :: left
    integer :: state

    call four_bar(linkage, error)
    call examine_linkage(linkage, rigid, error)
    if (allocated(error)) return
    call balance_force(rigid, weights, state)
    call check_that(error, state, "==", balanced, "complete balance")
    call check_that(error, size(weights), "==", 2, "counterweights")
    call check_that(error, abs(weights%unbalance - [0.0365675675675676_dp, 0.0667027027027027_dp]), "<", 1.0e-15_dp * 10, &
      & "crank and rocker")
    call check_that(error, abs(abs(weights%angle) - pi), "<", 1.0e-12_dp, "opposite to their links")
    call shake(linkage, rigid, weights, found, error)
    if (allocated(error)) return
    ! terms of 0.1 kg m cancel to their roundings
    call check_that(error, found%peak(4) / speed**2, "<", 1.0e-15_dp, "no force")
    call measure_residual(rigid, weights, speed, left)
    call check_that(error, left%rms(1), "==", 0.0_dp, "reported as exactly zero")
    call with_counterweights(linkage, rigid%bodies, weights, weight_names, other, failure)
    call check_success(error, failure, "with counterweights")
    if (allocated(error)) return
    call other%prepare(failure)
    call examine(other, .false., [0.0_dp, 0.0_dp], rigid, failure)
    call balance_force(rigid, none, state)
    call check_that(error, state, "==", balanced_already, "balanced with the counterweights")
    call skew_four_bar(linkage, error)
    call examine_linkage(linkage, rigid, error)
    call balance_force(rigid, weights, state)
    call shake(linkage, rigid, weights, found, error)
    if (allocated(error)) return
    call check_that(error, size(weights), "==", 2, "skew, counterweights")
    call check_that(error, found%peak(4) / speed**2, "<", 1.0e-14_dp, "skew, no force")
  end subroutine test_four_bar

  !> The rod must carry its common centre with the piston in A: -(0.6 (0.065 + 0.02 i) + 0.5 0.2) kg m; the crank must carry
  !> everything in A: -(2 0.01 + (0.6 + 0.5 + m) 0.05), where m is the rod's counterweight at its radius, the rod's length 0.2
  !> m.
  subroutine test_slider_crank(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(rigid_ground_type) :: rigid
    type(shaking_type) :: found
    type(counterweight_type), allocatable :: weights(:)
    type(gestell_error), allocatable :: failure
    complex(dp), parameter :: rod = -(0.6_dp * (0.065_dp, 0.02_dp) + 0.5_dp * 0.2_dp)
    complex(dp), allocatable :: u(:)
    real(dp) :: radius
    integer :: state, k

    call slider_crank(linkage, error)
    if (allocated(error)) return
    do k = 1, 2
      radius = merge(0.2_dp, 0.03_dp, k == 1)
      if (k == 1) call examine(linkage, .false., [0.0_dp, 0.0_dp], rigid, failure)
      if (k == 2) call examine(linkage, .false., [0.0_dp, 0.0_dp], rigid, failure, radii=[radius])
      call check_success(error, failure, "bodies")
      if (allocated(error)) return
      call balance_force(rigid, weights, state)
      call check_that(error, state, "==", balanced, "complete balance")
      call check_that(error, size(weights), "==", 2, "counterweights")
      if (allocated(error)) return
      u = weights%unbalance * exp(cmplx(0, weights%angle, dp))
      call check_that(error, abs(u(2) - rod), "<", 1.0e-14_dp, "rod")
      call check_that(error, abs(u(1) + 0.02_dp + (1.1_dp + abs(rod) / radius) * 0.05_dp), "<", 1.0e-14_dp, "crank")
      call shake(linkage, rigid, weights, found, error)
      if (allocated(error)) return
      call check_that(error, found%peak(4) / speed**2, "<", 1.0e-14_dp, "no force")
    end do
    ! about the pivot alone only the first order that turns with the crank can be removed
    call examine(linkage, .false., [0.0_dp, 0.0_dp], rigid, failure, links=[1])
    call balance_force(rigid, weights, state)
    call check_that(error, state, "==", not_balanced, "by the crank alone")
    call shake(linkage, rigid, weights, found, error)
    if (allocated(error)) return
    call check_that(error, abs(found%unbalance(1)), "<", 1.0e-15_dp * 10, "no forward first order")
    call examine(linkage, .false., [0.0_dp, 0.0_dp], rigid, failure, links=[2])
    call balance_force(rigid, weights, state)
    call check_that(error, state, "==", no_pivots, "by the rod alone")
  end subroutine test_slider_crank

  !> A Watt six-bar needs three counterweights for six links, according to Lowen and Tepper.
  subroutine test_six_bar(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(rigid_ground_type) :: rigid
    type(shaking_type) :: before, found
    type(counterweight_type), allocatable :: weights(:)
    type(gestell_error), allocatable :: failure
    integer :: state

    call linkage%ground("A0", [0.0_dp, 0.0_dp], failure)
    call linkage%ground("B0", [0.22_dp, 0.0_dp], failure)
    call linkage%crank("A", "A0", 0.08_dp, 0.0_dp, failure)
    call linkage%rrr("B", ["A ", "B0"], [0.24_dp, 0.18_dp], 1, failure)
    call linkage%rigid("C", ["A", "B"], [0.12_dp, 0.10_dp], failure)
    call linkage%rigid("E", ["B0", "B "], [0.18_dp, -0.12_dp], failure)
    call linkage%rrr("D", ["C", "E"], [0.22_dp, 0.20_dp], 1, failure)
    call linkage%link("crank", "A0", "A", 0.9_dp, 0.0015_dp, [0.02_dp, 0.0_dp], failure)
    call linkage%link("coupler", "A", "B", 1.4_dp, 0.011_dp, [0.12_dp, 0.033_dp], failure)
    call linkage%link("rocker", "B0", "B", 1.2_dp, 0.008_dp, [0.12_dp, -0.04_dp], failure)
    call linkage%link("arm", "C", "D", 0.7_dp, 0.003_dp, [0.11_dp, 0.0_dp], failure)
    call linkage%link("fold", "E", "D", 1.0_dp, 0.006_dp, [0.10_dp, 0.0_dp], failure)
    call prepared(linkage, error)
    call examine_linkage(linkage, rigid, error)
    if (allocated(error)) return
    call balance_force(rigid, weights, state)
    call check_that(error, state, "==", balanced, "complete balance")
    call check_that(error, size(weights), "==", 3, "counterweights")
    if (allocated(error)) return
    call shake(linkage, rigid, [counterweight_type ::], before, error)
    call shake(linkage, rigid, weights, found, error)
    if (allocated(error)) return
    call check_that(error, found%peak(4) / before%peak(4), "<", 1.0e-13_dp, "no force")
  end subroutine test_six_bar

  !> A yoke translates, so no rotating link can balance its mass; the crank can balance half of it.
  subroutine test_impossible_balance(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: yoke = 3, radius = 0.1_dp
    type(linkage_type) :: linkage
    type(rigid_ground_type) :: rigid
    type(counterweight_type), allocatable :: weights(:)
    type(gestell_error), allocatable :: failure
    integer :: state

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", radius, 0.0_dp, failure)
    call linkage%rpp("Y", "A", guide_type(point=[0.0_dp, 0.0_dp]), pi / 2, failure)
    call linkage%link("crank", "O", "A", 0.0_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    call linkage%link("yoke", "Y", "", yoke, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    call prepared(linkage, error)
    call examine_linkage(linkage, rigid, error)
    if (allocated(error)) return
    call balance_force(rigid, weights, state)
    call check_that(error, state, "==", not_balanced, "no complete balance")
    call check_that(error, size(weights), "==", 1, "counterweights")
    call check_that(error, abs(weights(1)%unbalance - yoke * radius / 2), "<", 1.0e-14_dp, "half of the yoke's mass")
  end subroutine test_impossible_balance

  !> Force and moment, as peak and rms, of several counterweights together, with the speed held by motor and flywheel.
  subroutine test_residual_forces(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(rigid_ground_type) :: rigid
    type(shaking_type) :: found
    type(counterweight_type) :: weights(3)
    type(gestell_error), allocatable :: failure
    type(residual_shaking_type) :: left
    integer :: k

    weights = [(counterweight_type(k, 0.02_dp * k, 0.7_dp * k), k = 1, 3)]
    call skew_four_bar(linkage, error)
    if (allocated(error)) return
    do k = 1, 2
      call examine(linkage, k == 2, [0.0_dp, 0.0_dp], rigid, failure)
      call check_success(error, failure, "bodies")
      call shake(linkage, rigid, weights, found, error, k == 2)
      if (allocated(error)) return
      call measure_residual(rigid, weights, speed, left)
      call check_that(error, abs(left%rms / found%rms([4, 3]) - 1), "<", 1.0e-11_dp, "rms")
      call check_that(error, abs(left%peak / found%peak([4, 3]) - 1), "<", 1.0e-9_dp, "peak")
      call check_that(error, abs(left%order_rms(2, 2) * sqrt(2.0_dp) / found%series(3)%amplitude(2) - 1), "<", 1.0e-11_dp, &
        & "second order of the moment")
    end do
  end subroutine test_residual_forces

  !> The rocker's link described from B to B0, a second link on the crank by one of its joints, and a body whose pivot is no
  !> joint of its axes: each body is found once, with its counterweight at the same place.
  subroutine test_bodies(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage, other
    type(rigid_ground_type) :: rigid, turned
    type(counterweight_type), allocatable :: weights(:), again(:)
    type(shaking_type) :: found
    type(gestell_error), allocatable :: failure
    integer :: state

    call four_bar(linkage, error)
    call examine_linkage(linkage, rigid, error)
    call balance_force(rigid, weights, state)
    if (allocated(error)) return
    call check_that(error, (rigid%bodies%pivoted), "==", [.true., .false., .true.], "pivots")
    call check_that(error, abs(rigid%bodies%length - [0.07_dp, 0.37_dp, 0.16_dp]), "<", 1.0e-14_dp, "lengths")

    call other%ground("A0", [0.0_dp, 0.0_dp], failure)
    call other%ground("B0", [0.4_dp, 0.0_dp], failure)
    call other%crank("A", "A0", 0.07_dp, 0.0_dp, failure)
    call other%rrr("B", ["A ", "B0"], [0.37_dp, 0.16_dp], 1, failure)
    call other%rigid("P", ["A0", "A "], [0.02_dp, 0.03_dp], failure)
    ! on the crank, from the joint P along its own axes: 0.5 kg at (0.03, 0)
    call other%link("plate", "P", "A", 0.5_dp, 0.0035_dp, plate([0.03_dp, 0.0_dp]), failure)
    call other%link("coupler", "A", "B", 0.6_dp, 0.007_dp, [0.18_dp, 0.0_dp], failure)
    call other%link("rocker", "B", "B0", 0.25_dp, 0.006_dp, [0.08_dp, 0.0_dp], failure)
    call other%link("nothing on it", "A0", "P", 0.0_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    call prepared(other, error)
    call examine_linkage(other, turned, error)
    if (allocated(error)) return
    call check_that(error, size(turned%bodies), "==", 3, "bodies")
    call check_that(error, (turned%bodies%link), "==", [1, 2, 3], "their first links")
    call check_that(error, (turned%bodies%pivoted), "==", [.true., .false., .true.], "pivots")
    call check_that(error, abs(turned%bodies(3)%pivot - 0.16_dp), "<", 1.0e-14_dp, "B0 on the link from B")
    call check_that(error, abs(turned%bodies(1)%pivot - pivot_of_plate()), "<", 1.0e-14_dp, "A0 on the plate")
    call balance_force(turned, again, state)
    call check_that(error, size(again), "==", 2, "counterweights")
    call check_that(error, abs(again%unbalance - weights%unbalance), "<", 1.0e-14_dp, "unbalances")
    call shake(other, turned, again, found, error)
    if (allocated(error)) return
    call check_that(error, found%peak(4) / speed**2, "<", 1.0e-14_dp, "no force")

  contains

    !> A place on the crank in the axes from P = (0.02, 0.03) to A = (0.07, 0).
    pure function plate(place)
      real(dp), intent(in) :: place(2)
      real(dp) :: plate(2)
      complex(dp) :: c

      c = (cmplx(place(1), place(2), dp) - (0.02_dp, 0.03_dp)) / axis()
      plate = [real(c, dp), aimag(c)]
    end function plate

    pure complex(dp) function pivot_of_plate()
      real(dp) :: c(2)

      c = plate([0.0_dp, 0.0_dp])
      pivot_of_plate = cmplx(c(1), c(2), dp)
    end function pivot_of_plate

    pure complex(dp) function axis()
      axis = (0.05_dp, -0.03_dp) / abs((0.05_dp, -0.03_dp))
    end function axis

  end subroutine test_bodies

  !> Eight unknowns. The last four affect the force like sums of the first four; the residual of the moment is orthogonal to the
  !> changes that leave the force unchanged. The last two unknowns affect both alike and must be equal.
  subroutine test_least_squares(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: kinds(6) = [1, 1, 1, 2, 2, 2], angles = 20
    type(least_squares_type) :: least
    real(dp) :: effects(6, angles, 8), wanted(6, angles), left(6, angles), x(8), none(8, 4)
    complex(dp) :: u(4)
    integer :: i, j, k

    effects = reshape([(sin(0.7_dp * i**2), i = 1, size(effects))], shape(effects))
    wanted = reshape([(cos(0.3_dp * i**2), i = 1, size(wanted))], shape(wanted))
    associate (force => effects(:3, :, :))
      effects(:3, :, 5) = force(:, :, 1) + 2 * force(:, :, 2)
      effects(:3, :, 6) = force(:, :, 3) - force(:, :, 4)
      effects(:3, :, 7) = force(:, :, 1)
    end associate
    effects(:, :, 8) = effects(:, :, 7)
    none = 0
    none([1, 2, 5], 1) = [-1, -2, 1]
    none([3, 4, 6], 2) = [-1, 1, 1]
    none([1, 7], 3) = [-1, 1]
    none([7, 8], 4) = [-1, 1]
    call least%prepare(effects, kinds)
    call least%solve(wanted, u)
    x(1::2) = real(u, dp)
    x(2::2) = aimag(u)
    left = -wanted
    do k = 1, 8
      left = left + x(k) * effects(:, :, k)
    end do
    ! sums of 60 terms of about 1
    do k = 1, 8
      call check_that(error, abs(sum(effects(:3, :, k) * left(:3, :))), "<", 1.0e-13_dp, "force")
    end do
    do k = 1, 4
      call check_that(error, abs(sum([(none(j, k) * sum(effects(4:, :, j) * left(4:, :)), j = 1, 8)])), "<", 1.0e-12_dp, "moment")
    end do
    call check_that(error, abs(x(7) - x(8)), "<", 1.0e-14_dp, "the shortest")
    call check_that(error, norm2(left(4:, :)), "<", norm2(wanted(4:, :)) * 10, "error bound is not too wide")
  end subroutine test_least_squares

end module test_balance
