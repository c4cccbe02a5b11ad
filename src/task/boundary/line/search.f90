!> Searches for all stability borders along a line from t = 0 to t = 1 by following the multipliers along the line.
module gestell_task_boundary_line_search
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_sorting, only: ascending
  use gestell_task_boundary_line, only: line_type, probe_type, skewed
  use gestell_task_boundary_line_crossing, only: add_classified, find_borders_between, verify
  use gestell_task_boundary_line_follow, only: follow_multipliers, chain_type
  use gestell_task_boundary_line_search_result, only: crossing_type, open_part_type, search_type, searches_type
  use gestell_task_boundary_line_meeting, only: meeting_type, open_question, search_meeting, thin, tongue, tongue_end
  use gestell_task_boundary_line_pair, only: pair_path_type
  use gestell_task_boundary_line_places, only: meetings_on, place_type, places_type
  use gestell_task_common_executor, only: distribute_over
  implicit none (type, external)
  private

  public :: merged, range_nodes, search_line

  !> Parallel work: each piece searches the neighbourhood of one position where two multipliers meet.
  type, extends(searches_type) :: meetings_type
    type(line_type), pointer :: line => null()
    type(chain_type), pointer :: chain => null()
    type(place_type), allocatable :: places(:)
  contains
    procedure :: compute => search_place
  end type meetings_type

  !> Parallel work: each piece searches for borders between two neighbouring solved systems (marks) on the line.
  type, extends(searches_type) :: gaps_type
    type(line_type), pointer :: line => null()
    type(probe_type), pointer :: marks(:) => null()
    !> For each gap: number of the mark (solved system) at which the gap begins.
    integer, allocatable :: gaps(:)
  contains
    procedure :: compute => close_gap
  end type gaps_type

  !> Initial nodes of a search on a short line. They are deliberately not symmetric about the middle of the line.
  real(dp), parameter, public :: short_nodes(5) = [0.0_dp, 0.27_dp, 0.5_dp, 0.74_dp, 1.0_dp]

contains

  !> Initial nodes of a search over a whole range. `count`: number of values at which the search starts.
  pure function range_nodes(count) result(nodes)
    integer, intent(in) :: count
    real(dp), allocatable :: nodes(:)
    integer, parameter :: least_nodes = 9

    nodes = merged(skewed(least_nodes), skewed(count))
  end function range_nodes

  !> Finds all stability borders along a line from t = 0 to t = 1. `nodes`: initial nodes, ascending from 0 to 1. Fails if the
  !> parameters are invalid.
  subroutine search_line(line, nodes, search, error)
    type(line_type), intent(in), target :: line
    real(dp), intent(in) :: nodes(:)
    type(search_type), intent(out), target :: search
    type(error_type), allocatable, intent(out) :: error
    type(meetings_type) :: work
    type(chain_type), target :: chain
    type(places_type), allocatable :: on_stretch(:)
    type(place_type), allocatable :: places(:)
    real(dp), allocatable :: rates(:)
    real(dp) :: largest_rate
    integer :: i

    call search%initialise()
    call follow_multipliers(line, nodes, chain, error)
    if (allocated(error)) return
    allocate(on_stretch(chain%count))
    do i = 1, chain%count
      associate (stretch => chain%list(i))
        call search%add_mark(stretch%ends(1))
        call search%add_mark(stretch%ends(2))
        if (stretch%rough) search%open_parts = [search%open_parts, open_part_type(sum(stretch%ends%t) / 2, stretch%length())]
        on_stretch(i)%list = meetings_on(stretch, i)
      end associate
    end do
    places = [(on_stretch(i)%list, i = 1, chain%count)]
    ! If there are too many meetings, those with the highest rates are left out. If the speed varies, low rates belong to low orders
    ! and therefore to the widest tongues.
    largest_rate = huge(largest_rate)
    if (size(places) > line%most_meetings) then
      rates = abs(places%rate)
      rates = rates(ascending(rates))
      largest_rate = maxval(rates, mask=rates < rates(line%most_meetings + 1))
    end if
    work%line => line
    work%chain => chain
    work%places = pack(places, .not. abs(places%rate) > largest_rate)
    allocate(work%found(size(work%places)))
    call distribute_over(work, size(work%places), error, line%executor)
    if (allocated(error)) return
    do i = 1, size(work%found)
      call search%append(work%found(i))
    end do
    call list_skipped(places, largest_rate, chain, search)
    call search%sort_marks()
    call close_gaps(line, search, error)
    if (allocated(error)) return
    ! Parts of the line in which systems could not be solved remain undecided.
    search%open_parts = [search%open_parts, (open_part_type(sum(chain%holes(:, i)) / 2, chain%holes(2, i) - chain%holes(1, i)), &
      & i = 1, size(chain%holes, 2))]
    ! Borders of regions narrower than the resolution are removed last, because they also explain changes of the verdict.
    call search%sort_borders(0.0_dp)
    call search%list_unexplained()
    call search%sort_borders(2 * line%step())
  end subroutine search_line

  !> Adds to `search%open_parts` each group of neighbouring intervals that contain meetings left out of the search.
  pure subroutine list_skipped(places, largest_rate, chain, search)
    type(place_type), intent(in) :: places(:)
    real(dp), intent(in) :: largest_rate
    type(chain_type), intent(in) :: chain
    type(search_type), intent(inout) :: search
    type(open_part_type), allocatable :: own(:)
    logical :: left(0:chain%count + 1)
    integer :: i, first

    allocate(own(0))
    left = .false.
    do i = 1, size(places)
      if (abs(places(i)%rate) <= largest_rate) cycle
      search%left_out = search%left_out + 1
      left(places(i)%stretch) = .true.
    end do
    first = 0
    do i = 1, chain%count
      if (left(i) .and. .not. left(i - 1)) first = i
      if (.not. left(i) .or. left(i + 1)) cycle
      associate (from => chain%list(first)%ends(1)%t, to => chain%list(i)%ends(2)%t)
        own = [own, open_part_type((from + to) / 2, to - from)]
      end associate
    end do
    search%open_parts = [own, search%open_parts]
  end subroutine list_skipped

  !> Union of two ascending lists, in which equal values occur only once.
  pure function merged(a, b) result(all)
    real(dp), intent(in) :: a(:), b(:)
    real(dp), allocatable :: all(:)
    real(dp), parameter :: same = 1.0e-9_dp

    all = [a, b]
    all = all(ascending(all))
    all = pack(all, [.true., all(2:) - all(:size(all) - 1) > same])
  end function merged

  !> Searches for a tongue at position number `k`, where two multipliers meet.
  recursive subroutine search_place(self, k, error)
    class(meetings_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    type(pair_path_type) :: path
    type(meeting_type) :: meeting

    associate (search => self%found(k), place => self%places(k))
      call search%initialise()
      search%meetings = 1
      path = pair_path_type(self%line, self%chain%list(place%stretch), place%name)
      call search_meeting(path, path%stretch%ends(1)%t + place%x * path%stretch%length(), place%rate, meeting, error)
      if (allocated(error)) return
      if (meeting%outcome == tongue) call add_tongue(path, meeting, search, error)
      if (meeting%outcome == thin) search%thin = 1
      if (meeting%outcome == open_question) search%open_parts = [open_part_type(meeting%t, meeting%width)]
    end associate
  end subroutine search_place

  !> Adds to `search` the borders at both ends of a tongue, and systems inside the tongue and on both sides of it.
  subroutine add_tongue(path, meeting, search, error)
    type(pair_path_type), intent(in) :: path
    type(meeting_type), intent(in) :: meeting
    type(search_type), intent(inout) :: search
    type(error_type), allocatable, intent(out) :: error
    type(crossing_type) :: crossing
    type(probe_type) :: below, above
    real(dp) :: t
    logical :: missing, success
    integer :: side

    call search%add_mark(meeting%strongest%at)
    do side = 1, 2
      if (.not. meeting%outside(side)) cycle
      call search%add_mark(meeting%sides(side)%at)
      call tongue_end(path, meeting%sides(side), meeting%strongest, t, missing, error)
      if (allocated(error)) return
      if (missing) cycle
      if (side == 1) call verify(path%line, meeting%sides(1)%at, meeting%strongest%at, t, crossing, below, above, success, error)
      if (side == 2) call verify(path%line, meeting%strongest%at, meeting%sides(2)%at, t, crossing, below, above, success, error)
      if (allocated(error)) return
      call search%add_mark(below)
      call search%add_mark(above)
      if (success) call add_classified(search, crossing, below, above)
    end do
  end subroutine add_tongue

  !> Searches for borders that were missed between neighbouring solved systems (marks). If exactly one of two marks is unstable,
  !> the number of borders between them must be odd, otherwise even. If there is no border between two marks, no border function
  !> of the multipliers may change its sign.
  subroutine close_gaps(line, search, error)
    type(line_type), intent(in), target :: line
    type(search_type), intent(inout), target :: search
    type(error_type), allocatable, intent(out) :: error
    type(gaps_type) :: work
    integer :: i

    call search%sort_borders(0.0_dp)
    work%line => line
    work%marks => search%marks
    work%gaps = pack([(i, i = 1, size(search%marks) - 1)], [(is_open(i), i = 1, size(search%marks) - 1)])
    allocate(work%found(size(work%gaps)))
    call distribute_over(work, size(work%gaps), error, line%executor)
    if (allocated(error)) return
    do i = 1, size(work%found)
      call search%append(work%found(i))
    end do

  contains

    !> True if borders must be sought between mark number `i` (a solved system) and the following mark.
    pure logical function is_open(i)
      integer, intent(in) :: i
      integer :: n

      associate (l => search%marks(i), r => search%marks(i + 1))
        n = count(search%borders%t > l%t .and. search%borders%t < r%t)
        is_open = n == 0 .or. (mod(n, 2) == 1 .neqv. (l%is_unstable() .neqv. r%is_unstable()))
      end associate
    end function is_open

  end subroutine close_gaps

  !> Searches for borders in gap number `k`, which lies between two neighbouring marks (solved systems).
  recursive subroutine close_gap(self, k, error)
    class(gaps_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    !> Depth of the recursion. Up to 2**depth borders in one gap can be separated.
    integer, parameter :: depth = 6

    call self%found(k)%initialise()
    call find_borders_between(self%line, self%marks(self%gaps(k)), self%marks(self%gaps(k) + 1), depth, self%found(k), error)
  end subroutine close_gap

end module gestell_task_boundary_line_search
