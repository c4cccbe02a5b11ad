!> Borders in the plane of two parameters at which a measured quantity crosses a level. Each border has a direction: the region in
!> which the quantity is above the level lies to the left of the border.
module gestell_task_boundary_level_plane
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: has_vibration, impossible, operator(==), state_words
  use gestell_base_kinds, only: dp
  use gestell_study_speed_point, only: speed_options, speed_point_type
  use gestell_task_boundary_level_line, only: level_line_type
  use gestell_task_boundary_level_search, only: find_levels, level_results_type, side_of
  use gestell_task_boundary_line, only: line_type
  use gestell_task_boundary_line_search_result, only: crossing_type, open_part_type, search_type
  use gestell_task_boundary_map_vertex, only: plane_type
  implicit none (type, external)
  private

  !> Kinds of borders: "level" and "jump", each four times, once for each state of the machine in `level_states`.
  character(len=15), parameter, public :: level_kinds(8) = [character(len=15) :: "level", "level", "level", "level", &
    & "jump", "jump", "jump", "jump"]
  !> State of the machine that belongs to each element of `level_kinds`.
  character(len=15), parameter, public :: level_states(8) = [character(len=15) :: state_words(1:4), state_words(1:4)]

  !> Plane of two parameters, in which the region where a measured quantity is above its level is sought.
  type, extends(plane_type), public :: level_plane_type
    !> The measured quantity, its measure (peak, rms or band), and how it is computed.
    type(speed_options) :: options
    !> Level of the quantity, in its unit.
    real(dp) :: level = 0
    !> Number of the axis along which the speed varies; 0 if the speed does not vary.
    integer :: speed_axis = 0
  contains
    procedure :: probe, search, find_side_at_centre
  end type level_plane_type

contains

  !> Sets up `curve`: the measured quantity along the line `along`.
  subroutine set_up_curve(plane, along, curve)
    class(level_plane_type), intent(in) :: plane
    type(line_type), intent(in) :: along
    type(level_line_type), intent(out) :: curve
    !> If only the speed varies along a line, resonances are sought on the line if its length, relative to the speed range, is at
    !> least this.
    real(dp), parameter :: long = 1.0e-3_dp

    curve%line_type = along
    curve%options = plane%options
    curve%level = plane%level
    if (plane%speed_axis > 0) curve%over_speed = abs(along%direction(plane%speed_axis)) >= long .and. &
      & .not. abs(along%direction(3 - plane%speed_axis)) > 0
  end subroutine set_up_curve

  !> Solves the machine at the coordinates `u`. On return `point%values(1, 1)` contains the measured quantity and `point%values(2,
  !> 1)` its error. Fails if the parameters are invalid.
  subroutine solve_at(plane, u, point, error)
    class(level_plane_type), intent(in) :: plane
    real(dp), intent(in) :: u(2)
    type(speed_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error
    type(line_type) :: along
    type(level_line_type) :: curve

    call plane%line(u, [1.0_dp, 0.0_dp], along)
    call set_up_curve(plane, along, curve)
    call curve%solve(curve%at(0.0_dp), point, error)
  end subroutine solve_at

  !> Determines whether the quantity at the coordinates `u` is certainly above the level (`inside`), and whether no vibration exists
  !> there (`missing`). Fails if the parameters are invalid.
  subroutine probe(self, u, inside, missing, error)
    class(level_plane_type), intent(in) :: self
    real(dp), intent(in) :: u(2)
    logical, intent(out) :: inside, missing
    type(error_type), allocatable, intent(out) :: error
    type(speed_point_type) :: point

    call solve_at(self, u, point, error)
    inside = side_of(point, self%level) == "above"
    missing = .not. has_vibration(point%state)
  end subroutine probe

  !> Finds the borders along a line. A crossing of the level is a border if the quantity is certainly above the level on one side
  !> and certainly below it on the other. Other crossings, and parts of the line without a vibration, are listed in
  !> `found%open_parts`. Fails if the parameters are invalid.
  subroutine search(self, along, nodes, found, error)
    class(level_plane_type), intent(in) :: self
    type(line_type), intent(in) :: along
    real(dp), intent(in) :: nodes(:)
    type(search_type), intent(out) :: found
    type(error_type), allocatable, intent(out) :: error
    type(level_line_type) :: curve
    type(level_results_type) :: results
    integer :: k

    call set_up_curve(self, along, curve)
    call find_levels(curve, curve%at(nodes), results, error)
    if (allocated(error)) return
    call found%initialise()
    if (.not. results%curve%complete) found%open_parts = [open_part_type(0.5_dp, 1.0_dp)]
    do k = 1, size(results%crossings)
      associate (here => results%crossings(k), t => curve%position(results%crossings(k)%x))
        if (any([here%below, here%above] == "undecided")) then
          found%open_parts = [found%open_parts, open_part_between(here%ends)]
        else
          found%borders = [found%borders, crossing_type(t=t, error=maxval(abs(curve%position(here%ends) - t)), &
            & kind=here%verdict%ordinal() + merge(size(level_kinds) / 2, 0, here%jumps), enters=here%rises)]
        end if
      end associate
    end do
    found%open_parts = [found%open_parts, (open_part_between(results%places(k)%ends), k = 1, size(results%places))]
    call found%sort_borders(2 * along%step())

  contains

    pure type(open_part_type) function open_part_between(ends) result(open_part)
      real(dp), intent(in) :: ends(2)

      associate (t => curve%position(ends))
        open_part = open_part_type(sum(t) / 2, abs(t(2) - t(1)))
      end associate
    end function open_part_between

  end subroutine search

  !> Determines whether the quantity at the centre of the plane is above its level. `side` is "above", "within" (not above) or
  !> "undecided". If no vibration was found, `side` is "impossible" or "failed". Fails if the parameters are invalid.
  subroutine find_side_at_centre(self, side, error)
    class(level_plane_type), intent(in) :: self
    character(len=10), intent(out) :: side
    type(error_type), allocatable, intent(out) :: error
    type(speed_point_type) :: point

    call solve_at(self, [0.5_dp, 0.5_dp], point, error)
    side = side_of(point, self%level)
    if (.not. has_vibration(point%state)) side = merge("impossible", "failed    ", point%state == impossible)
  end subroutine find_side_at_centre

end module gestell_task_boundary_level_plane
