!> Curves on which a quantity of the vibration crosses its level in the plane of two parameters, against a closed form.
module test_boundary_level
  use checks, only: check_success, check_that
  use families, only: machine_family
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: new_frame
  use gestell_model_linkage, only: linkage_type
  use gestell_study_grid, only: axis_type, grid_type
  use gestell_study_measure, only: measure_type
  use gestell_study_speed_point, only: speed_options
  use gestell_task_boundary_level_plane, only: level_kinds, level_plane_type, level_states
  use gestell_task_boundary_map, only: border_map_type, trace_curves
  use slow_tests, only: new_slow
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_boundary_level

  !> A mass on spring and damper with an unbalance; its level is the peak of the force on the ground.
  real(dp), parameter :: total = 20.0_dp, unbalance = 0.1_dp, stiffness = 8.0e4_dp, level = 1.0e3_dp
  !> Over the speed (1/min) and a factor of the stiffness.
  type(axis_type), parameter :: axes(2) = [axis_type(300.0_dp, 900.0_dp, 4), axis_type(0.5_dp, 2.5_dp, 4)]

contains

  subroutine collect_boundary_level(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the level curve of an unbalanced rotor agrees with its closed form", test_closed_form), &
      & new_slow("two level curves enclose an undamped resonance, whose ridge is reported as open", test_undamped)]
  end subroutine collect_boundary_level

  !> Peak of the force.
  elemental real(dp) function force(damping, rpm, factor)
    real(dp), intent(in) :: damping, rpm, factor
    complex(dp) :: spring
    real(dp) :: w

    w = rpm * 2 * pi / 60
    spring = cmplx(factor * stiffness, damping * w, dp)
    force = unbalance * w**2 * abs(spring / (spring - total * w**2))
  end function force

  subroutine trace(damping, deviation, map, error)
    real(dp), intent(in) :: damping, deviation
    type(border_map_type), intent(out) :: map
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(machine_family), target :: family
    type(level_plane_type) :: plane
    type(linkage_type) :: linkage
    real(dp) :: c(3, 3), b(3, 3)

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 1.0_dp, 0.0_dp, failure)
    call linkage%link("crank", "O", "A", 2.0_dp, 1.0_dp, [unbalance / 2, 0.0_dp], failure)
    c = 0
    b = 0
    c(1, 1) = stiffness
    b(1, 1) = damping
    call new_frame(family%frame, linkage, total - 2, 1.0_dp, [0.0_dp, 0.0_dp], c, b, 1.0_dp, failure, free=[1])
    call check_success(error, failure)
    if (allocated(error)) return
    plane%family => family
    plane%accuracy = accuracy_type(tolerance=1.0e-9_dp)
    plane%tolerance = deviation
    plane%kinds = level_kinds
    plane%states = level_states
    plane%options%names = ["fx"]
    plane%options%measures = [measure_type(quantity="fx", unit="N")]
    plane%options%orders = 0
    plane%options%accuracy = plane%accuracy
    plane%level = level
    plane%speed_axis = 1
    call trace_curves(plane, grid_type(axes), map, failure)
    call check_success(error, failure)
    if (.not. allocated(error)) call check_vertices(damping, map, error)
  end subroutine trace

  !> The curve passes within the error of each vertex: the square about it has both sides of the level.
  subroutine check_vertices(damping, map, error)
    real(dp), intent(in) :: damping
    type(border_map_type), intent(in) :: map
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: corners(4)
    integer :: i

    do i = 1, size(map%vertices)
      associate (v => map%vertices(i))
        corners = force(damping, v%parameters(1) + 1.01_dp * v%error(1) * [-1, -1, 1, 1], &
          & v%parameters(2) + 1.01_dp * v%error(2) * [-1, 1, -1, 1])
        call check_that(error, minval(corners), "<=", level, "least about a vertex")
        call check_that(error, maxval(corners), ">=", level, "maximum around a vertex")
        call check_that(error, v%kind, "==", "level", "kind")
        if (allocated(error)) return
      end associate
    end do
  end subroutine check_vertices

  !> Checks the vertices, and points at one and a half times the deviation to either side of the lines between them: the side
  !> above the level is on the left. The tip of the region lies close to a line of the cells.
  subroutine test_closed_form(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: damping = 200.0_dp, deviation = 1.0e-4_dp
    integer, parameter :: parts = 8
    type(border_map_type) :: map
    real(dp) :: ranges(2), way(2), left(2), here(2), beside(2, 2)
    integer :: i, k

    call trace(damping, deviation, map, error)
    if (allocated(error)) return
    call check_that(error, map%curves, "==", 1, "curves")
    call check_that(error, size(map%places), "==", 0, "open places")
    call check_that(error, size(map%vertices), ">", 30, "vertices")
    if (allocated(error)) return
    ranges = axes%to - axes%from
    do i = 2, size(map%vertices)
      associate (v => map%vertices(i - 1), w => map%vertices(i))
        way = (w%parameters - v%parameters) / ranges
        left = 1.5_dp * deviation * [-way(2), way(1)] / norm2(way) * ranges
        do k = 1, parts - 1
          here = v%parameters + (w%parameters - v%parameters) * k / parts
          beside = reshape([here + left, here - left], [2, 2])
          if (any(beside < spread(axes%from, 2, 2) .or. beside > spread(axes%to, 2, 2))) cycle
          call check_that(error, force(damping, beside(1, 1), beside(2, 1)), ">", level, "on the left")
          call check_that(error, force(damping, beside(1, 2), beside(2, 2)), "<", level, "on the right")
          if (allocated(error)) return
        end do
      end associate
    end do
  end subroutine test_closed_form

  !> On the ridge, where a multiplier is 1 within rounding, the quantity has no value. The ridge is no border, but it is
  !> reported.
  subroutine test_undamped(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_map_type) :: map

    call trace(0.0_dp, 1.0e-3_dp, map, error)
    if (allocated(error)) return
    call check_that(error, map%curves, "==", 2, "curves")
    call check_that(error, size(map%places), ">", 0, "open places")
    call check_that(error, (map%vertices%state), "==", "undamped", "state")
  end subroutine test_undamped

end module test_boundary_level
