!> Invalid arguments to the procedures that study families of systems.
module invalid_study_arguments
  use checks, only: check_that
  use gestell_api_numerics, only: accuracy_type, axis_type, border_accuracy, border_map_type, border_type, campbell_options, &
    & campbell_type, critical_type, crossing_type, dp, error_type, find_borders, find_critical, find_crossings, grid_type, &
    & invalid_input, nearest_stable, nearest_type, new_axis, new_grid, resonance_curve_type, sensitivity_base_type, &
    & sensitivity_type, solve_base, solve_campbell, solve_curve, solve_parameter, solve_point, solve_sensitivity, &
    & solve_speed_point, solve_tile, speed_options, speed_point_type, start_curve, sweep_columns, sweep_options, &
    & tile_results_type, tile_type, trace_borders, verdict_failed, verdict_impossible
  use faulty_systems, only: check_answer, faulty_family, infinite, nan, expect
  use testdrive, only: check, test_error => error_type
  implicit none (type, external)
  private

  public :: test_axes, test_borders, test_families, test_speeds, test_tiles

  type(axis_type), parameter :: axis = axis_type(0.5_dp, 3.0_dp, 9), other = axis_type(0.0_dp, 1.0_dp, 9)

contains

  subroutine test_axes(error)
    type(test_error), allocatable, intent(out) :: error
    type(axis_type) :: made
    type(grid_type) :: grid, unset
    type(tile_type) :: tile
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: complaints

    complaints = ""
    call new_axis(made, 0.0_dp, 1.0_dp, 0, .false., failure)
    call expect(failure, invalid_input, "no values", complaints)
    call new_axis(made, 0.0_dp, 1.0_dp, -3, .false., failure)
    call expect(failure, invalid_input, "values below 0", complaints)
    call new_axis(made, nan(), 1.0_dp, 3, .false., failure)
    call expect(failure, invalid_input, "from nan", complaints)
    call new_axis(made, nan(), nan(), 1, .true., failure)
    call expect(failure, invalid_input, "both nan", complaints)
    call new_axis(made, -huge(1.0_dp), huge(1.0_dp), 3, .false., failure)
    call expect(failure, invalid_input, "too wide", complaints)
    call new_axis(made, 1.0_dp, infinite(), 3, .true., failure)
    call expect(failure, invalid_input, "to infinity", complaints)
    call new_axis(made, 0.0_dp, 1.0_dp, huge(1), .false., failure)
    call check_answer(failure, "huge(1) values", complaints)
    call new_grid(grid, [axis_type ::], failure)
    call expect(failure, invalid_input, "no axes", complaints)
    call new_grid(grid, [axis, axis, axis], failure)
    call expect(failure, invalid_input, "three axes", complaints)
    call new_grid(grid, [axis_type(0.0_dp, 1.0_dp, 0)], failure)
    call expect(failure, invalid_input, "axis without values", complaints)
    call check(error, complaints, "")
    if (allocated(error)) return
    call check_that(error, unset%tiles(), "==", 0, "an uninitialised grid has no tiles")
    call check_that(error, int(unset%points()), "==", 0, "an uninitialised grid has no tiles")
    if (allocated(error)) return
    tile = unset%tile(1)
    call check_that(error, tile%number, "==", 0, "an uninitialised grid has an empty first tile")
    call check_that(error, tile%last(1), "<", tile%first(1), "an uninitialised grid has an empty first tile")
    if (allocated(error)) return
    call new_grid(grid, [axis], failure)
    tile = grid%tile(0)
    call check_that(error, tile%number, "==", 0, "tile 0")
    call check_that(error, tile%last(1), "<", tile%first(1), "tile 0")
    if (allocated(error)) return
    tile = grid%tile(99)
    call check_that(error, tile%number, "==", 0, "tile 99")
    call check_that(error, tile%last(1), "<", tile%first(1), "tile 99")
  end subroutine test_axes

  subroutine test_tiles(error)
    type(test_error), allocatable, intent(out) :: error
    type(grid_type) :: grid, unset
    type(sweep_options) :: options, bad
    type(tile_results_type) :: results
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: complaints

    complaints = ""
    call new_grid(grid, [axis], failure)
    options%columns(5:) = .false.
    call solve_tile(faulty_family(), unset, tile_type(), options, results, failure)
    call expect(failure, invalid_input, "grid not made", complaints)
    call solve_tile(faulty_family(), grid, grid%tile(0), options, results, failure)
    call expect(failure, invalid_input, "tile 0", complaints)
    call solve_tile(faulty_family(), grid, tile_type(1, [1, 1], [10**9, 1]), options, results, failure)
    call expect(failure, invalid_input, "tile beyond the grid", complaints)
    bad = options
    bad%engine = "x"
    call solve_tile(faulty_family(), grid, grid%tile(1), bad, results, failure)
    call expect(failure, invalid_input, "engine", complaints)
    bad = options
    bad%accuracy%tolerance = 0
    call solve_tile(faulty_family(), grid, grid%tile(1), bad, results, failure)
    call expect(failure, invalid_input, "tolerance", complaints)
    bad = options
    bad%columns = .false.
    call solve_tile(faulty_family(), grid, grid%tile(1), bad, results, failure)
    call check_answer(failure, "no columns", complaints)
    call solve_tile(faulty_family(), grid, grid%tile(1), sweep_options(), results, failure)
    call check_answer(failure, "peaks of a system that is no frame", complaints)
    call check(error, complaints, "")
  end subroutine test_tiles

  !> Families that return invalid systems: any error of the family other than an impossible mechanism ends every study.
  subroutine test_families(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=*), parameter :: refused(5) = [character(len=16) :: "no states", "odd states", "negative period", &
      & "nothing at all", "strange code"]
    character(len=*), parameter :: tolerated(4) = [character(len=16) :: "", "impossible", "nan", "changing states"]
    character(len=:), allocatable :: complaints
    integer :: i

    complaints = ""
    do i = 1, size(refused)
      call study(faulty_family(fault=refused(i)), merge(77, invalid_input, refused(i) == "strange code"), complaints)
    end do
    do i = 1, size(tolerated)
      call study(faulty_family(fault=tolerated(i)), 0, complaints)
    end do
    call check(error, complaints, "")
  end subroutine test_families

  !> Runs all studies of a family. `code` is the code of the error that each must return; with 0 any answer is accepted.
  subroutine study(family, code, complaints)
    type(faulty_family), intent(in) :: family
    integer, intent(in) :: code
    character(len=:), allocatable, intent(inout) :: complaints
    type(grid_type) :: line, plane
    type(sweep_options) :: options
    type(tile_results_type) :: results
    type(border_type), allocatable :: borders(:)
    type(border_map_type) :: map
    type(nearest_type) :: nearest
    type(campbell_type) :: campbell
    type(resonance_curve_type) :: curve
    type(speed_point_type) :: point
    type(sensitivity_base_type) :: base
    type(sensitivity_type), allocatable :: found(:)
    type(error_type), allocatable :: failure
    real(dp) :: values(sweep_columns)

    call new_grid(line, [axis], failure)
    call new_grid(plane, [axis, other], failure)
    options%columns(5:) = .false.
    call solve_point(family, [1.0_dp], options, values, failure)
    call check_code(failure, code, "solve_point: " // family%fault, complaints)
    if (family%fault == "impossible" .and. nint(values(4)) /= verdict_impossible .or. family%fault == "nan" &
      & .and. nint(values(4)) /= verdict_failed) complaints = complaints &
      & // "verdict of " // trim(family%fault) // "; "
    call solve_tile(family, line, line%tile(1), options, results, failure)
    call check_code(failure, code, "solve_tile: " // family%fault, complaints)
    options%engine = "expansion"
    call solve_tile(family, plane, plane%tile(1), options, results, failure)
    call check_code(failure, code, "solve_tile by expansion: " // family%fault, complaints)
    call find_borders(family, axis, accuracy_type(tolerance=border_accuracy), 1.0e-8_dp, borders, failure)
    call check_code(failure, code, "find_borders: " // family%fault, complaints)
    call trace_borders(family, plane, accuracy_type(), 1.0e-2_dp, map, failure)
    call check_code(failure, code, "trace_borders: " // family%fault, complaints)
    call nearest_stable(family, [1.0_dp], 1, [axis], accuracy_type(), 1.0e-6_dp, nearest, failure)
    call check_code(failure, code, "nearest_stable: " // family%fault, complaints)
    call solve_campbell(family, [1.0_dp, 2.0_dp], campbell_options(), campbell, failure)
    call check_code(failure, code, "solve_campbell: " // family%fault, complaints)
    call solve_curve(family, speed_options(names=[character(len=80) :: "f"]), [1.0_dp, 2.0_dp], curve, failure)
    call check_code(failure, code, "solve_curve: " // family%fault, complaints)
    call solve_speed_point(family, 1.0_dp, speed_options(names=[character(len=80) :: "f"]), point, failure)
    call check_code(failure, code, "solve_speed_point: " // family%fault, complaints)
    call solve_sensitivity(family, 1, speed_options(names=[character(len=80) :: "f"]), base, found, failure)
    call check_code(failure, code, "solve_sensitivity: " // family%fault, complaints)
  end subroutine study

  subroutine check_code(failure, code, what, complaints)
    type(error_type), allocatable, intent(in) :: failure
    integer, intent(in) :: code
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(inout) :: complaints

    if (code > 0) then
      call expect(failure, code, what, complaints)
    else
      call check_answer(failure, what, complaints)
    end if
  end subroutine check_code

  subroutine test_borders(error)
    type(test_error), allocatable, intent(out) :: error
    real(dp) :: tolerances(6)
    type(border_type), allocatable :: borders(:)
    type(border_map_type) :: map
    type(nearest_type) :: nearest
    type(grid_type) :: line, plane, unset
    type(faulty_family) :: family
    type(accuracy_type) :: order
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: complaints
    integer :: i

    complaints = ""
    tolerances = [0.0_dp, -1.0_dp, nan(), infinite(), 1.0_dp, 1.0e-300_dp]
    call new_grid(line, [axis], failure)
    call new_grid(plane, [axis, other], failure)
    do i = 1, size(tolerances)
      call find_borders(family, axis, order, tolerances(i), borders, failure)
      call expect(failure, invalid_input, "borders: tolerance", complaints)
      call trace_borders(family, plane, order, tolerances(i), map, failure)
      call expect(failure, invalid_input, "map: deviation", complaints)
      call nearest_stable(family, [1.0_dp], 1, [axis], order, tolerances(i), nearest, failure)
      call expect(failure, invalid_input, "nearest: tolerance", complaints)
    end do
    call find_borders(family, axis_type(1.0_dp, 1.0_dp, 1), order, 1.0e-8_dp, borders, failure)
    call expect(failure, invalid_input, "borders: no range", complaints)
    call find_borders(family, axis_type(nan(), nan(), 5), order, 1.0e-8_dp, borders, failure)
    call expect(failure, invalid_input, "borders: axis nan", complaints)
    call find_borders(family, axis_type(0.0_dp, 1.0_dp, huge(1)), order, 1.0e-8_dp, borders, failure)
    call expect(failure, invalid_input, "borders: too many points", complaints)
    call find_borders(family, axis, accuracy_type(tolerance=0.0_dp), 1.0e-8_dp, borders, failure)
    call expect(failure, invalid_input, "borders: accuracy", complaints)
    call trace_borders(family, line, order, 0.1_dp, map, failure)
    call expect(failure, invalid_input, "map: one axis", complaints)
    call trace_borders(family, unset, order, 0.1_dp, map, failure)
    call expect(failure, invalid_input, "map: no grid", complaints)
    call nearest_stable(family, [1.0_dp], 9, [axis], order, 1.0e-6_dp, nearest, failure)
    call expect(failure, invalid_input, "nearest: along parameter 9", complaints)
    call nearest_stable(family, [1.0_dp], 0, [axis], order, 1.0e-6_dp, nearest, failure)
    call expect(failure, invalid_input, "nearest: along parameter 0", complaints)
    call nearest_stable(family, [real(dp) ::], 1, [axis_type ::], order, 1.0e-6_dp, nearest, failure)
    call expect(failure, invalid_input, "nearest: no parameters", complaints)
    call nearest_stable(family, [1.0_dp, 2.0_dp], 1, [axis], order, 1.0e-6_dp, nearest, failure)
    call expect(failure, invalid_input, "nearest: more values than axes", complaints)
    call nearest_stable(family, [nan()], 1, [axis], order, 1.0e-6_dp, nearest, failure)
    call expect(failure, invalid_input, "nearest: from nan", complaints)
    call check(error, complaints, "")
  end subroutine test_borders

  !> Studies over the speed, and those that use their results.
  subroutine test_speeds(error)
    type(test_error), allocatable, intent(out) :: error
    type(faulty_family) :: family
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: crossings(:)
    type(critical_type), allocatable :: critical(:)
    type(resonance_curve_type) :: curve
    type(speed_point_type) :: point
    type(sensitivity_base_type) :: base
    type(sensitivity_type) :: one
    type(sensitivity_type), allocatable :: found(:)
    type(speed_options) :: options, bad
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: complaints

    complaints = ""
    options%names = [character(len=80) :: "f"]
    call wrong_speeds([real(dp) ::], "none", complaints)
    call wrong_speeds([nan(), 1.0_dp], "nan", complaints)
    call wrong_speeds([1.0_dp, infinite()], "infinite", complaints)
    call wrong_speeds([0.0_dp, 1.0_dp], "zero", complaints)
    call wrong_speeds([-1.0_dp, 1.0_dp], "through zero", complaints)
    call wrong_speeds([1.0_dp, 1.0_dp], "twice", complaints)
    call wrong_speeds([1.0_dp, 3.0_dp, 2.0_dp], "to and fro", complaints)

    call solve_campbell(family, [1.0_dp, 2.0_dp], campbell_options(orders=-1), campbell, failure)
    call expect(failure, invalid_input, "campbell: orders", complaints)
    call find_crossings(family, campbell_options(orders=huge(1)), campbell, crossings, failure)
    call expect(failure, invalid_input, "crossings: orders", complaints)
    call find_crossings(family, campbell_options(), campbell, crossings, failure)
    call expect(failure, invalid_input, "crossings without modes", complaints)
    call find_critical(family, campbell_options(), [crossing_type()], critical, failure)
    call expect(failure, invalid_input, "critical: crossing not set", complaints)
    call find_critical(family, campbell_options(), [crossing_type(mode=1, order=1.0_dp, speed=nan())], critical, failure)
    call expect(failure, invalid_input, "critical: speed nan", complaints)
    call find_critical(family, campbell_options(), [crossing_type ::], critical, failure)
    call check_answer(failure, "critical: no crossings", complaints)

    bad = options
    bad%orders = -1
    call solve_curve(family, bad, [1.0_dp, 2.0_dp], curve, failure)
    call expect(failure, invalid_input, "curve: orders", complaints)
    bad = options
    bad%accuracy%steps = -1
    call solve_speed_point(family, 1.0_dp, bad, point, failure)
    call expect(failure, invalid_input, "point: steps", complaints)
    deallocate(bad%names)
    call solve_speed_point(family, 1.0_dp, bad, point, failure)
    call expect(failure, invalid_input, "point: no names", complaints)
    call solve_base(family, 1, bad, base, failure)
    call expect(failure, invalid_input, "sensitivity: no names", complaints)
    call solve_sensitivity(family, 0, options, base, found, failure)
    call expect(failure, invalid_input, "sensitivity: no parameters", complaints)
    call solve_sensitivity(family, -7, options, base, found, failure)
    call expect(failure, invalid_input, "sensitivity: parameters below 0", complaints)
    call solve_parameter(family, base, 1, one, failure)
    call expect(failure, invalid_input, "sensitivity: no base", complaints)
    call check(error, complaints, "")

  contains

    subroutine wrong_speeds(speeds, what, complaints)
      real(dp), intent(in) :: speeds(:)
      character(len=*), intent(in) :: what
      character(len=:), allocatable, intent(inout) :: complaints

      call solve_campbell(family, speeds, campbell_options(), campbell, failure)
      call expect(failure, invalid_input, "campbell: speeds " // what, complaints)
      call start_curve(curve, options, speeds, failure)
      call expect(failure, invalid_input, "start_curve: speeds " // what, complaints)
      call solve_curve(family, options, speeds, curve, failure)
      call expect(failure, invalid_input, "solve_curve: speeds " // what, complaints)
    end subroutine wrong_speeds

  end subroutine test_speeds

end module invalid_study_arguments
