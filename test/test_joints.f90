!> All joints against closed forms, and random linkages of all joints against the reference.
module test_joints
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_math_series_fourier, only: fourier_series, fourier_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_linkage_diagnosis, only: diagnose, diagnosis_type
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: mass_functions_type
  use machines, only: linkage_of_machine, new_crank
  use reference_cases, only: random_linkage
  use reference_linear, only: qp
  use reference_linkage, only: motion_type, move, reference_functions => mass_functions, &
    & reference_functions_type => mass_functions_type
  use reference_machine, only: machine_data
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_joints

contains

  subroutine collect_joints(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the piston's acceleration has the harmonics published by Taylor", test_piston), &
      & new_unittest("both branches of an offset slider-crank agree with the closed form", test_slider_branches), &
      & new_unittest("a Scotch yoke moves as a pure cosine", test_yoke), &
      & new_unittest("a slotted lever's stroke and directions agree with the closed form", test_lever), &
      & new_unittest("two sliders with fixed and carried guides agree with the closed form", test_trammel), &
      & new_unittest("a slider on a guide carried by the crank remains at rest there", test_moving_guide), &
      & new_unittest("three descriptions of one dyad yield the same motion", test_two_ways), &
      & new_slow("positions, derivatives and mass functions of random linkages agree with the reference", test_random), &
      & new_slow("bounds on the speeds of random linkages' joints hold", test_speed_bounds), &
      & new_unittest("diagnosed ranges, swings and transmission angles agree with closed forms", test_diagnosis)]
  end subroutine collect_joints

  !> r/l = 1/4: the piston's acceleration over r Omega^2 is -(cos phi + A2 cos 2 phi + A4 cos 4 phi + ...) with published
  !> A2, A4, A6 (C. F. Taylor, The Internal Combustion Engine in Theory and Practice, vol. 2, gives the series).
  subroutine test_piston(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: known(4) = [1.0_dp, 0.2540250423_dp, -0.0040981112_dp, 7.4379e-5_dp]
    real(dp), parameter :: digit(4) = [1.0e-13_dp, 1.0e-10_dp, 1.0e-10_dp, 1.0e-9_dp]
    integer, parameter :: order(4) = [1, 2, 4, 6]
    type(linkage_type) :: linkage
    type(point_type) :: at(3)
    type(fourier_type) :: series
    type(gestell_error), allocatable :: failure
    real(dp) :: samples(64)
    integer :: i

    call new_crank(linkage, failure)
    call linkage%rrp("B", "A", 4.0_dp, guide_type(), 1, failure)
    do i = 1, 64
      call linkage%points(2 * pi * (i - 1) / 64, at)
      samples(i) = -at(3)%x%dd
    end do
    series = fourier_series(samples)
    do i = 1, 4
      call check(error, series%amplitude(order(i)) * cos(series%phase(order(i))), known(i), thr=digit(i))
      if (allocated(error)) return
    end do
  end subroutine test_piston

  !> x = s along the guide: |(x, e) - (cos, sin)| = l for a guide at height e.
  subroutine test_slider_branches(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(4)
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: l = 3.0_dp, e = 0.4_dp, turn = 0.7_dp
    real(dp) :: phi, x, along
    integer :: k

    call new_crank(linkage, failure)
    call linkage%rrp("B", "A", l, guide_type(point=[7.0_dp, e]), -1, failure)
    ! The same machine turned by an angle, the crank's phase; the guide's direction and point turn with it.
    call linkage%rrp("C", "A", l, guide_type(point=[-e * sin(turn), e * cos(turn)], angle=turn), 1, failure)
    do k = 0, 12
      phi = 0.5_dp * k
      call linkage%points(phi, at)
      x = cos(phi) - sqrt(l**2 - (sin(phi) - e)**2)
      call check_that(error, abs(at(3)%x%v - x) + abs(at(3)%y%v - e), "<", 1.0e-14_dp, "branch -1")
      if (allocated(error)) return
      along = cos(phi - turn) + sqrt(l**2 - (sin(phi - turn) - e)**2)
      call check_that(error, abs(at(4)%x%v - (along * cos(turn) - e * sin(turn))) &
        & + abs(at(4)%y%v - (along * sin(turn) + e * cos(turn))), "<", 1.0e-14_dp, "turned")
      if (allocated(error)) return
    end do
  end subroutine test_slider_branches

  subroutine test_yoke(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(4)
    type(gestell_error), allocatable :: failure
    real(dp) :: phi
    integer :: k

    call new_crank(linkage, failure)
    call linkage%rpp("Y", "A", guide_type(), pi / 2, failure)
    call linkage%rpp("Z", "A", guide_type(), pi / 4, failure)
    do k = 0, 12
      phi = 0.5_dp * k
      call linkage%points(phi, at)
      call check_that(error, abs(at(3)%x%v - cos(phi)) + abs(at(3)%x%d + sin(phi)) + abs(at(3)%x%dd + cos(phi)) + abs(at(3)%y%v), &
        & "<", 1.0e-15_dp * 10, "on a circle")
      if (allocated(error)) return
      ! The slot at 45 deg through the pin meets the x-axis at cos - sin.
      call check(error, at(4)%x%v, cos(phi) - sin(phi), thr=1.0e-14_dp)
      if (allocated(error)) return
    end do
  end subroutine test_yoke

  !> A lever of length 5 whose pivot lies 2.5 below the crank's: it swings by asin(1 / 2.5) to both sides.
  subroutine test_lever(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(diagnosis_type) :: diagnosis
    type(point_type) :: at(5)
    type(gestell_error), allocatable :: failure

    call new_crank(linkage, failure)
    call linkage%ground("P", [0.0_dp, -2.5_dp], failure)
    call linkage%rpr("C", ["A", "P"], 5.0_dp, 1, failure)
    call linkage%rpr("D", ["A", "P"], 2.0_dp, -1, failure)
    call linkage%link("lever", "P", "C", 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
    call linkage%points(pi / 2, at)
    call check_that(error, abs(at(4)%x%v) + abs(at(4)%y%v - 2.5_dp) + abs(at(5)%x%v) + abs(at(5)%y%v + 4.5_dp), "<", 1.0e-14_dp, &
      & "places of the joints")
    if (allocated(error)) return
    call diagnose(linkage, diagnosis, failure)
    call check(error, diagnosis%joints(4)%x(2) - diagnosis%joints(4)%x(1), 2 * 5 / 2.5_dp, thr=1.0e-12_dp, more="stroke")
    if (allocated(error)) return
    call check(error, diagnosis%swing(2), 2 * asin(1 / 2.5_dp), thr=1.0e-4_dp, more="swing, of sampled angles")
    if (allocated(error)) return
    call check(error, diagnosis%joints(4)%margin, 1.5_dp, thr=1.0e-12_dp, more="nearest dead point")
  end subroutine test_lever

  !> Sliders on the x-axis and on a line carried from O to A: their crossing is O's; through A at a right angle: the yoke.
  subroutine test_trammel(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(5)
    type(guide_type) :: carried, upright
    type(gestell_error), allocatable :: failure
    real(dp) :: phi
    integer :: k

    call new_crank(linkage, failure)
    call linkage%ground("N", [0.0_dp, 3.0_dp], failure)
    ! A line through A, parallel to the one from A to N turned by 90 deg, and the line x = 3.
    call linkage%moving_guide(["A", "N"], [0.0_dp, 0.0_dp], pi / 2, carried, failure)
    upright = guide_type(point=[3.0_dp, 0.0_dp], angle=pi / 2)
    call linkage%prp("S", [upright, carried], failure)
    call linkage%prp("T", [carried, upright], failure)
    do k = 0, 12
      phi = 0.5_dp * k
      call linkage%points(phi, at)
      ! (S - A) . (N - A) = 0 with S = (3, y).
      call check(error, at(4)%y%v, sin(phi) - (3 - cos(phi)) * (-cos(phi)) / (3 - sin(phi)), thr=1.0e-13_dp)
      if (allocated(error)) return
      call check_that(error, abs(at(4)%x%v - 3) + abs(at(5)%x%v - 3) + abs(at(4)%y%dd - at(5)%y%dd), "<", 1.0e-12_dp, &
        & "places on the slide")
      if (allocated(error)) return
    end do
  end subroutine test_trammel

  !> On a guide that the crank itself carries, a rod from the crank's pivot keeps its slider at rest on it.
  subroutine test_moving_guide(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(4)
    type(guide_type) :: guide
    type(gestell_error), allocatable :: failure
    integer :: k

    call new_crank(linkage, failure)
    call linkage%moving_guide(["O", "A"], [0.0_dp, 0.6_dp], 0.0_dp, guide, failure)
    call linkage%rrp("S", "O", 1.0_dp, guide, 1, failure)
    call linkage%rigid("R", ["O", "A"], [0.8_dp, 0.6_dp], failure)
    do k = 0, 12
      call linkage%points(0.5_dp * k, at)
      call check_that(error, maxval(abs([at(3)%x%v - at(4)%x%v, at(3)%y%v - at(4)%y%v, at(3)%x%d - at(4)%x%d, at(3)%y%d &
        & - at(4)%y%d, at(3)%x%dd - at(4)%x%dd, at(3)%y%dd - at(4)%y%dd])), "<", 1.0e-14_dp, "two descriptions")
      if (allocated(error)) return
    end do
  end subroutine test_moving_guide

  !> The joint of an RRR dyad, described again by a slider on the line of one link, and by the intersection of both links'
  !> lines.
  subroutine test_two_ways(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(6)
    type(guide_type) :: one, two
    type(gestell_error), allocatable :: failure
    integer :: k

    call new_crank(linkage, failure)
    call linkage%ground("P", [4.0_dp, 0.5_dp], failure)
    call linkage%rrr("B", ["A", "P"], [4.2_dp, 3.2_dp], -1, failure)
    call linkage%moving_guide(["A", "B"], [1.0_dp, 0.0_dp], 0.0_dp, one, failure)
    call linkage%moving_guide(["P", "B"], [0.0_dp, 0.0_dp], pi, two, failure)
    call linkage%rrp("C", "P", 3.2_dp, one, 1, failure)
    call linkage%prp("D", [one, two], failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 0, 12
      call linkage%points(0.5_dp * k, at)
      ! The slider's solutions lie on both sides of P's foot on the line; B is the farther one as long as mu < 90 deg.
      call check_that(error, maxval(abs([at(4)%x%v - at(5)%x%v, at(4)%y%v - at(5)%y%v, at(4)%x%d - at(5)%x%d, at(4)%y%dd &
        & - at(5)%y%dd, at(4)%x%v - at(6)%x%v, at(4)%y%v - at(6)%y%v, at(4)%y%d - at(6)%y%d, at(4)%x%dd - at(6)%x%dd])), "<", &
        & 1.0e-12_dp, "three descriptions")
      if (allocated(error)) return
    end do
  end subroutine test_two_ways

  subroutine random_pair(number, machine, linkage, error)
    integer, intent(in) :: number
    type(machine_data), intent(out) :: machine
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    machine = random_linkage(number)
    call linkage_of_machine(machine, linkage, failure)
    call check_success(error, failure)
  end subroutine random_pair

  !> Both checks use the same linkages, because finding one that turns takes longer than following it.
  subroutine test_random(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(linkage_type) :: linkage
    integer :: i

    do i = 1, 1000
      call random_pair(i, machine, linkage, error)
      if (allocated(error)) return
      call check_motion(machine, linkage, error)
      if (allocated(error)) return
      call check_masses(machine, linkage, 0.01_dp * i, error)
      if (allocated(error)) return
    end do
  end subroutine test_random

  subroutine check_motion(machine, linkage, error)
    type(machine_data), intent(in) :: machine
    type(linkage_type), intent(in) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(motion_type) :: motion
    type(point_type) :: at(size(machine%joints))
    real(dp) :: angle, defect
    integer :: k, j

    do k = 1, 3
      angle = 2.1_dp * k
      motion = move(machine, real(angle, qp))
      call linkage%points(angle, at)
      do j = 1, size(at)
        defect = real(max(maxval(abs([at(j)%x%v, at(j)%y%v] - motion%joint(:, 0, j))), &
          & maxval(abs([at(j)%x%d, at(j)%y%d] - motion%joint(:, 1, j))), &
          & maxval(abs([at(j)%x%dd, at(j)%y%dd] - motion%joint(:, 2, j)))), dp)
        ! Sizes of 1 m; up to four dyads with a sine of the transmission angle above 0.3 amplify rounding.
        call check_that(error, defect, "<", 1.0e-11_dp, "lengths")
        if (allocated(error)) return
      end do
    end do
  end subroutine check_motion

  subroutine check_masses(machine, linkage, angle, error)
    type(machine_data), intent(in) :: machine
    type(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: angle
    type(error_type), allocatable, intent(out) :: error
    type(mass_functions_type) :: a
    type(reference_functions_type) :: r
    real(dp) :: defect, size

    call linkage%mass_functions(angle, a)
    r = reference_functions(machine, real(angle, qp))
    defect = real(maxval(abs([a%a1%v - r%a1(0), a%a2%v - r%a2(0), a%a3%v - r%a3(0), a%a1%d - r%a1(1), &
      & a%a2%d - r%a2(1), a%a3%d - r%a3(1), a%a1%dd - r%a1(2), a%a2%dd - r%a2(2), a%a4 - r%a4])), dp)
    size = real(maxval(abs([r%a1, r%a2, r%a3, r%a4])), dp)
    call check_that(error, defect, "<=", 1.0e-11_dp * size, "derivatives")
  end subroutine check_masses

  !> The proof of assembly rests on bounds of the joints' speeds over an interval: they hold at sampled angles within.
  subroutine test_speed_bounds(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(linkage_type) :: linkage
    type(point_type), allocatable :: middle(:), at(:)
    real(dp), allocatable :: speeds(:), accelerations(:)
    real(dp) :: angle
    real(dp), parameter :: half_width = 0.01_dp
    integer :: i, j, k

    do i = 1, 100
      call random_pair(i, machine, linkage, error)
      if (allocated(error)) return
      if (allocated(at)) deallocate(at, middle, speeds, accelerations)
      allocate(at(size(machine%joints)), middle(size(machine%joints)), speeds(size(machine%joints)), &
        & accelerations(size(machine%joints)))
      angle = 0.37_dp * i
      call linkage%points(angle, middle)
      do j = 1, size(at)
        associate (reach => linkage%joints(j)%joint%reach(middle(:j - 1), speeds(:j - 1), &
          & accelerations(:j - 1), half_width))
          if (.not. reach%assembled) exit
          speeds(j) = reach%speed
          accelerations(j) = reach%acceleration
        end associate
        do k = -5, 5
          call linkage%points(angle + half_width * k / 5, at)
          call check_that(error, hypot(at(j)%x%d, at(j)%y%d), "<=", speeds(j) + 1.0e-12_dp, "speed")
          call check_that(error, hypot(at(j)%x%dd, at(j)%y%dd), "<=", accelerations(j) + 1.0e-12_dp, "acceleration")
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_speed_bounds

  !> The paper-like crank-rocker 1, 4, 2, 4.5: angles at the ends of its swing from the triangles with sides b +- a, c, d.
  subroutine test_diagnosis(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(diagnosis_type) :: diagnosis
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: a = 1, b = 4, c = 2.5_dp, d = 4.5_dp

    call new_crank(linkage, failure)
    call linkage%ground("P", [d, 0.0_dp], failure)
    call linkage%rrr("B", ["A", "P"], [b, c], 1, failure)
    call linkage%link("rocker", "P", "B", 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
    call diagnose(linkage, diagnosis, failure)
    call check(error, diagnosis%mobility, 1)
    if (allocated(error)) return
    call check(error, diagnosis%links, 4)
    if (allocated(error)) return
    call check_that(error, index(diagnosis%grashof, "crank-rocker"), "==", 1, "place of 'crank-rocker'")
    call check_that(error, diagnosis%turns(1), "==", .true., "the first turns")
    call check_that(error, diagnosis%turns(2), "==", .false., "the second turns")
    if (allocated(error)) return
    ! Angles are sampled: an extreme is found within a quarter of a degree, where the curve is flat.
    call check(error, diagnosis%swing(2), angle_at(c, d, b + a) - angle_at(c, d, b - a), thr=1.0e-5_dp)
    if (allocated(error)) return
    ! mu is extreme where crank and ground are in line.
    call check(error, diagnosis%joints(4)%transmission, min(angle_at(b, c, d - a), pi - angle_at(b, c, d + a)), thr=1.0e-9_dp)
    if (allocated(error)) return
    call check(error, diagnosis%joints(4)%margin, min(b + c - d - a, d - a - (b - c)), thr=1.0e-12_dp)

  contains

    !> The angle between the sides p and q of a triangle with the third side r.
    pure real(dp) function angle_at(p, q, r)
      real(dp), intent(in) :: p, q, r

      angle_at = acos((p**2 + q**2 - r**2) / (2 * p * q))
    end function angle_at

  end subroutine test_diagnosis

end module test_joints
