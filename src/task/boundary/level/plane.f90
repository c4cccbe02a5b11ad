!> Where a number of the vibration crosses its level in the plane of two parameters: its borders have on their left what is above.
module gestell_task_boundary_level_plane
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: failed, has_vibration, impossible, operator(==), stable, state_words, undecided, unstable
  use gestell_base_kinds, only: dp
  use gestell_study_speed_point, only: speed_options, speed_point_type
  use gestell_task_boundary_level_crossing, only: side_of
  use gestell_task_boundary_level_line, only: level_line_type
  use gestell_task_boundary_level_search, only: find_levels, level_results_type
  use gestell_task_boundary_line, only: line_type, probe_type
  use gestell_task_boundary_line_crossing, only: crossing_type
  use gestell_task_boundary_line_found, only: doubt_type, search_type
  use gestell_task_boundary_map_vertex, only: plane_type
  implicit none (type, external)
  private

  !> What a border of a level is, and whether the machine keeps to its vibration there.
  character(len=15), parameter, public :: level_kinds(8) = [character(len=15) :: "level", "level", "level", "level", &
    & "jump", "jump", "jump", "jump"]
  character(len=15), parameter, public :: level_states(8) = [character(len=15) :: state_words(1:4), state_words(1:4)]

  type, extends(plane_type), public :: level_plane_type
    !> The quantity, and what is measured of it; the level of that.
    type(speed_options) :: options
    real(dp) :: level = 0
    !> The axis that is the speed, 0 if none is.
    integer :: speed_axis = 0
  contains
    procedure :: probe
    procedure :: search
    procedure :: in_the_middle
  end type level_plane_type

  !> Parts of the speed's range that are shorter hold so little of it that no resonance needs to be sought by the speed.
  real(dp), parameter :: long = 1.0e-3_dp

contains

  !> The number's curve along a line.
  subroutine number_along(plane, along, curve)
    class(level_plane_type), intent(in) :: plane
    type(line_type), intent(in) :: along
    type(level_line_type), intent(out) :: curve

    curve%line = along
    curve%options = plane%options
    curve%level = plane%level
    if (plane%speed_axis > 0) curve%over_speed = abs(along%way(plane%speed_axis)) >= long .and. &
      & .not. abs(along%way(3 - plane%speed_axis)) > 0
  end subroutine number_along

  !> The map traces where verdicts change, so that a number above the level counts as unstable. Error: the parameters make no sense.
  subroutine probe(self, along, t, found, error)
    class(level_plane_type), intent(in) :: self
    type(line_type), intent(in) :: along
    real(dp), intent(in) :: t
    type(probe_type), intent(out) :: found
    type(error_type), allocatable, intent(out) :: error
    type(level_line_type) :: curve
    type(speed_point_type) :: point

    call number_along(self, along, curve)
    curve%over_speed = .false.
    call curve%solve(curve%at(t), point, error)
    if (allocated(error)) return
    found%t = t
    select case (side_of(point, self%level))
    case ("above")
      found%verdict = unstable
    case ("within")
      found%verdict = stable
    case default
      found%verdict = undecided
      if (.not. has_vibration(point%state)) found%verdict = merge(impossible, failed, point%state == impossible)
    end select
  end subroutine probe

  !> The crossings whose sides are known for certain; the others are open, as are places where there is no vibration. Error: the
  !> parameters make no sense.
  subroutine search(self, along, nodes, found, error)
    class(level_plane_type), intent(in) :: self
    type(line_type), intent(in) :: along
    real(dp), intent(in) :: nodes(:)
    type(search_type), intent(out) :: found
    type(error_type), allocatable, intent(out) :: error
    type(level_line_type) :: curve
    type(level_results_type) :: results
    type(crossing_type) :: crossing
    integer :: k

    call number_along(self, along, curve)
    call find_levels(curve, curve%at(nodes), results, error)
    if (allocated(error)) return
    allocate(found%doubts(0), found%marks(0))
    if (.not. results%complete) found%doubts = [doubt_type(0.5_dp, 1.0_dp)]
    do k = 1, size(results%crossings)
      associate (here => results%crossings(k))
        if (any([here%below, here%above] == "undecided")) then
          call doubt(here%ends)
          cycle
        end if
        crossing%t = curve%position(here%x)
        crossing%error = maxval(abs(curve%position(here%ends) - crossing%t))
        crossing%kind = here%state%ordinal() + merge(size(level_kinds) / 2, 0, here%jumps)
        crossing%unstable_above = here%rises
        call found%found%add(crossing)
      end associate
    end do
    do k = 1, size(results%places)
      call doubt(results%places(k)%ends)
    end do
    call found%found%sort(2 * along%step())

  contains

    subroutine doubt(ends)
      real(dp), intent(in) :: ends(2)

      associate (t => curve%position(ends))
        found%doubts = [found%doubts, doubt_type(sum(t) / 2, abs(t(2) - t(1)))]
      end associate
    end subroutine doubt

  end subroutine search

  !> "within" the level or "above" it, in the middle of the ranges; or another verdict. Error: the parameters make no sense.
  subroutine in_the_middle(self, side, error)
    class(level_plane_type), intent(in) :: self
    character(len=10), intent(out) :: side
    type(error_type), allocatable, intent(out) :: error
    type(line_type) :: along
    type(probe_type) :: found

    call self%line([0.5_dp, 0.5_dp], [1.0_dp, 0.0_dp], along)
    call self%probe(along, 0.0_dp, found, error)
    side = found%verdict%word()
    if (found%verdict == stable) side = "within"
    if (found%verdict == unstable) side = "above"
  end subroutine in_the_middle

end module gestell_task_boundary_level_plane
