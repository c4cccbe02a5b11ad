!> What --check reports about sliders and shaking forces, against closed forms.
module test_shaking
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_diagnosis, only: diagnose_joints, diagnosis_type
  use gestell_model_mechanism_shaking, only: shaking, shaking_type
  use gestell_output_picture_marks, only: apart, choose_spaced
  use gestell_output_picture_regions, only: left_side
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_shaking

  !> A slider-crank with the crank's radius 1.
  real(dp), parameter :: rod = 4, speed = -30

contains

  subroutine collect_shaking(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("shaking force and moment of an unbalanced crank agree with closed forms", test_crank), &
      & new_unittest("a slider-crank's first order follows the textbook rule for its masses", test_masses), &
      & new_unittest("stroke, speed and acceleration of a central slider-crank agree with closed forms", test_central), &
      & new_unittest("stroke and time ratio of an offset slider-crank agree with closed forms", test_offset), &
      & new_unittest("labels in a picture are placed apart from each other", test_label_places), &
      & new_unittest("the left side of a curve is determined correctly", test_left_side)]
  end subroutine collect_shaking

  !> The centre of mass turns with the crank at the angle 0.5 before it.
  subroutine test_crank(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: mass = 3, radius = 0.2_dp, ahead = 0.5_dp, force = mass * radius * speed**2
    real(dp), parameter :: exact = 1.0e-12_dp
    type(linkage_type) :: linkage
    type(shaking_type) :: found
    type(gestell_error), allocatable :: failure

    call linkage%ground("O", [0.3_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 1.0_dp, 0.0_dp, failure)
    call linkage%link("crank", "O", "A", mass, 1.0_dp, radius * [cos(ahead), sin(ahead)], failure)
    call linkage%prepare(failure)
    call check_success(error, failure, "linkage")
    call shaking(linkage, speed, found, failure)
    call check_success(error, failure, "shaking forces")
    if (allocated(error)) return
    call check_that(error, abs(found%peak([1, 2, 4]) / force - 1), "<", exact, "peaks of the force")
    call check_that(error, abs(found%rms([1, 2, 4]) / force - [sqrt(0.5_dp), sqrt(0.5_dp), 1.0_dp]), "<", exact, "rms of the force")
    ! the pivot's arm times the force along y
    call check_that(error, abs(found%peak(3) / (0.3_dp * force) - 1), "<", exact, "peak of the moment")
    call check_that(error, abs(found%series(1)%phase(1) - ahead), "<", exact, "phase of fx: cos(phi + ahead)")
    call check_that(error, abs(found%series(2)%phase(1) - (ahead - pi / 2)), "<", exact, "phase of fy: sin(phi + ahead)")
    call check_that(error, abs(found%unbalance(1) - mass * radius * exp((0.0_dp, 1.0_dp) * ahead)), "<", exact, "with the crank")
    call check_that(error, abs(found%unbalance(2)), "<", exact, "against the crank")
  end subroutine test_crank

  !> Masses on the pin and on the slider: the first order is m_pin + m / 2 and m / 2, the textbook rule, because the root in the
  !> slider's position has even orders only.
  subroutine test_masses(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: pin = 2, slider = 5
    type(linkage_type) :: linkage
    type(shaking_type) :: found
    type(gestell_error), allocatable :: failure

    call slider_crank(0.0_dp, linkage, error)
    call linkage%link("crank", "O", "A", pin, 0.0_dp, [1.0_dp, 0.0_dp], failure)
    call linkage%link("piston", "B", "", slider, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    call linkage%prepare(failure)
    call check_success(error, failure, "linkage")
    call shaking(linkage, speed, found, failure)
    call check_success(error, failure, "shaking forces")
    if (allocated(error)) return
    call check_that(error, abs(found%unbalance - [pin + slider / 2, slider / 2]), "<", 1.0e-12_dp, "with and against the crank")
    ! at the outer dead centre all the force is along the guide; the slider's is (1 + r / l) times its first order
    call check_that(error, abs(found%peak([1, 4]) / (speed**2 * (pin + slider * (1 + 1 / rod))) - 1), "<", 1.0e-12_dp, "peak")
    call check_that(error, abs(found%peak(2) / (speed**2 * pin) - 1), "<", 1.0e-12_dp, "peak across")
  end subroutine test_masses

  subroutine test_central(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: many = 200000
    type(linkage_type) :: linkage
    type(diagnosis_type) :: diagnosis
    real(dp) :: phi, fastest
    integer :: i

    call slider_crank(0.0_dp, linkage, error)
    if (allocated(error)) return
    call diagnose_joints(linkage, diagnosis)
    ! x' = -sin phi (1 + cos phi / sqrt(l^2 - sin^2 phi))
    fastest = 0
    do i = 1, many
      phi = pi * i / many
      fastest = max(fastest, sin(phi) * (1 + cos(phi) / sqrt(rod**2 - sin(phi)**2)))
    end do
    associate (slider => diagnosis%joints(3))
      call check_that(error, abs(slider%travel(2) - slider%travel(1) - 2), "<", 1.0e-13_dp, "stroke 2 r")
      call check_that(error, abs(slider%rate - fastest), "<", 1.0e-9_dp, "maximum speed")
      call check_that(error, abs(slider%second_rate - (1 + 1 / rod)), "<", 1.0e-9_dp, "maximum acceleration")
      call check_that(error, abs(slider%forward - pi), "<", 1.0e-9_dp, "half the turn each way")
    end associate
  end subroutine test_central

  !> The dead centres are where crank and rod lie in one line: sin beta = e / (l + r) and e / (l - r); between them the crank turns
  !> through 180 deg + alpha and 180 deg - alpha.
  subroutine test_offset(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: offset = 1.5_dp
    type(linkage_type) :: linkage
    type(diagnosis_type) :: diagnosis
    real(dp) :: alpha, back

    call slider_crank(offset, linkage, error)
    if (allocated(error)) return
    call diagnose_joints(linkage, diagnosis)
    alpha = asin(offset / (rod - 1)) - asin(offset / (rod + 1))
    associate (slider => diagnosis%joints(3))
      back = 2 * pi - slider%forward
      call check_that(error, abs(slider%travel(2) - slider%travel(1) - (sqrt((rod + 1)**2 - offset**2) - sqrt((rod - 1)**2 &
        & - offset**2))), "<", 1.0e-13_dp, "stroke")
      call check_that(error, abs(max(back, slider%forward) / min(back, slider%forward) - (pi + alpha) / (pi - alpha)), "<", &
        & 1.0e-8_dp, "time ratio")
      ! above the crank's axis the slider goes out while the crank turns through less
      call check_that(error, slider%forward, "<", pi, "the way out is the quick one")
    end associate
  end subroutine test_offset

  !> O, A on the crank of radius 1, B on a guide along x.
  subroutine slider_crank(offset, linkage, error)
    real(dp), intent(in) :: offset
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 1.0_dp, 0.0_dp, failure)
    call linkage%rrp("B", "A", rod, guide_type(point=[0.0_dp, offset]), 1, failure)
    call linkage%link("rod", "A", "B", 0.0_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    call check_success(error, failure, "slider-crank")
  end subroutine slider_crank

  subroutine test_label_places(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: exact = 1.0e-14_dp

    call check_that(error, abs(apart([5.0_dp, 1.0_dp, 3.0_dp], 1.0_dp, [0.0_dp, 9.0_dp]) - [5, 1, 3]), "<", exact, "room enough")
    ! two at one place part equally, the third stays
    call check_that(error, abs(apart([4.0_dp, 4.0_dp, 8.0_dp], 2.0_dp, [0.0_dp, 9.0_dp]) - [3, 5, 8]), "<", exact, "a pair")
    call check_that(error, abs(apart([4.0_dp, 5.0_dp, 6.0_dp], 2.0_dp, [0.0_dp, 9.0_dp]) - [3, 5, 7]), "<", exact, "three")
    call check_that(error, abs(apart([8.0_dp, 9.0_dp, 1.0_dp], 2.0_dp, [9.0_dp, 0.0_dp]) - [7, 9, 1]), "<", exact, "at the rim")
    call check_that(error, choose_spaced([3.0_dp, 3.5_dp, 4.0_dp, 4.2_dp, 1.0_dp], 1.0_dp), "==", [.true., .false., .true., &
      & .false., &
      & .true.], "the first have room")
  end subroutine test_label_places

  !> A circle that is followed with its inside on the left, and in reverse; an open curve from edge to edge.
  subroutine test_left_side(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 200
    real(dp), parameter :: radius = 0.3_dp
    real(dp) :: circle(2, 0:n)
    integer :: k

    circle = reshape([(0.5_dp + radius * cos(2 * pi * k / n), 0.5_dp + radius * sin(2 * pi * k / n), k = 0, n)], [2, n + 1])
    call check_that(error, covers(circle, [0.5_dp, 0.5_dp]), "==", .true., "inside")
    call check_that(error, covers(circle, [0.5_dp, 0.81_dp]), "==", .false., "outside")
    call check_that(error, covers(circle, [0.72_dp, 0.72_dp]), "==", .false., "outside of the arc, inside of the box")
    call check_that(error, covers(circle(:, n:0:-1), [0.5_dp, 0.5_dp]), "==", .false., "the other way round, inside")
    call check_that(error, covers(circle(:, n:0:-1), [0.5_dp, 0.95_dp]), "==", .true., "the other way round, outside")
    call check_that(error, covers(reshape([0.0_dp, 0.2_dp, 1.0_dp, 0.4_dp], [2, 2]), [0.9_dp, 0.99_dp]), "==", .true., "above")
    call check_that(error, covers(reshape([0.0_dp, 0.2_dp, 1.0_dp, 0.4_dp], [2, 2]), [0.1_dp, 0.1_dp]), "==", .false., "below")
  end subroutine test_left_side

  !> True if a point lies on the left of a curve.
  pure logical function covers(points, place)
    real(dp), intent(in) :: points(:, :), place(2)
    real(dp), allocatable :: boxes(:, :)
    integer :: k

    boxes = left_side(points, [(1, k = 1, size(points, 2))])
    covers = any(boxes(1, :) <= place(1) .and. place(1) <= boxes(2, :) .and. boxes(3, :) <= place(2) .and. place(2) <= boxes(4, :))
  end function covers

end module test_shaking
