!> All borders along a line, from 0 to 1, found from the multipliers that are followed along it.
module gestell_task_boundary_line_search
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_task_boundary_line_crossing, only: add_named, crossing_type, crossings_type, separate, verify
  use gestell_task_boundary_line_found, only: doubt_type, search_type
  use gestell_task_boundary_line_exponents, only: stretch_type
  use gestell_task_boundary_line_follow, only: follow_multipliers, way_type
  use gestell_task_boundary_line, only: line_type, probe_type, skewed
  use gestell_task_boundary_line_meeting, only: meeting_type, open_question, search_meeting, thin, tongue, tongue_end
  use gestell_task_boundary_line_pair, only: pair_name_type
  use gestell_task_boundary_line_places, only: fastest_within, find_meetings, place_type, places_type
  use gestell_task_common_executor, only: spread_over, work_type
  use gestell_task_common_record, only: record_type
  implicit none (type, external)
  private

  public :: merged, range_nodes, search_line

  !> A piece is a place where multipliers meet.
  type, extends(work_type) :: meetings_type
    type(line_type), pointer :: line => null()
    type(way_type), pointer :: way => null()
    type(place_type), allocatable :: places(:)
    type(search_type), allocatable :: found(:)
  contains
    procedure :: compute => look_at
    procedure :: exchange => exchange_place
  end type meetings_type

  !> A piece is a gap between the marks `gaps` and the next ones.
  type, extends(work_type) :: gaps_type
    type(line_type), pointer :: line => null()
    type(probe_type), pointer :: marks(:) => null()
    integer, allocatable :: gaps(:)
    type(crossings_type), allocatable :: found(:)
  contains
    procedure :: compute => close_gap
    procedure :: exchange => exchange_gap
  end type gaps_type

  !> Where the search of short lines begins; of symmetry nothing is wanted.
  real(dp), parameter, public :: short_nodes(5) = [0.0_dp, 0.27_dp, 0.5_dp, 0.74_dp, 1.0_dp]
  !> Points at least at which the search of a whole range begins.
  integer, parameter :: least_nodes = 9
  !> So many borders are told apart between two of the marks, as a power of two.
  integer, parameter :: usual_depth = 6

contains

  !> Where the search of a whole range begins that has `count` search points.
  pure function range_nodes(count) result(nodes)
    integer, intent(in) :: count
    real(dp), allocatable :: nodes(:)

    nodes = merged(skewed(least_nodes), skewed(count))
  end function range_nodes

  !> All borders along the line from 0 to 1; `nodes`: where the search begins, ascending from 0 to 1. Error: the parameters make
  !> no sense.
  subroutine search_line(line, nodes, search, error)
    type(line_type), intent(in), target :: line
    real(dp), intent(in) :: nodes(:)
    type(search_type), intent(out), target :: search
    type(error_type), allocatable, intent(out) :: error
    type(meetings_type) :: work
    type(way_type), target :: way
    type(places_type) :: places
    real(dp) :: fastest
    integer :: i

    allocate(search%doubts(0), search%marks(0))
    call follow_multipliers(line, nodes, way, error)
    if (allocated(error)) return
    do i = 1, way%count
      associate (stretch => way%list(i))
        call search%add_mark(stretch%ends(1))
        call search%add_mark(stretch%ends(2))
        if (stretch%rough) search%doubts = [search%doubts, doubt_type(sum(stretch%ends%t) / 2, stretch%length())]
        call find_meetings(stretch, i, places)
      end associate
    end do
    fastest = fastest_within(places, line%most_meetings)
    if (places%count > 0) then
      work%line => line
      work%way => way
      work%places = pack(places%list(:places%count), .not. abs(places%list(:places%count)%rate) > fastest)
      allocate(work%found(size(work%places)))
      call spread_over(work, size(work%places), error, line%executor)
      if (allocated(error)) return
      do i = 1, size(work%found)
        call search%take(work%found(i))
      end do
    end if
    call name_left_out(places, fastest, way, search)
    call search%sort_marks()
    call close_gaps(line, search, error)
    if (allocated(error)) return
    call name_unsolved(way, search)
    ! Borders narrower than the resolution are removed afterwards, because they also explain changes of verdict.
    call search%found%sort(0.0_dp)
    call search%name_unexplained()
    call search%found%sort(2 * line%step())
  end subroutine search_line

  !> Where systems could not be solved nothing is known.
  pure subroutine name_unsolved(way, search)
    type(way_type), intent(in) :: way
    type(search_type), intent(inout) :: search
    integer :: i

    do i = 1, size(way%holes, 2)
      search%doubts = [search%doubts, doubt_type(sum(way%holes(:, i)) / 2, way%holes(2, i) - way%holes(1, i))]
    end do
  end subroutine name_unsolved

  !> The stretches with places that were left out, neighbours together, are doubts.
  pure subroutine name_left_out(places, fastest, way, search)
    type(places_type), intent(in) :: places
    real(dp), intent(in) :: fastest
    type(way_type), intent(in) :: way
    type(search_type), intent(inout) :: search
    type(doubt_type), allocatable :: own(:)
    logical :: left(0:way%count + 1)
    integer :: i, first

    allocate(own(0))
    left = .false.
    do i = 1, places%count
      if (abs(places%list(i)%rate) <= fastest) cycle
      search%left_out = search%left_out + 1
      left(places%list(i)%stretch) = .true.
    end do
    first = 0
    do i = 1, way%count
      if (left(i) .and. .not. left(i - 1)) first = i
      if (.not. left(i) .or. left(i + 1)) cycle
      associate (from => way%list(first)%ends(1)%t, to => way%list(i)%ends(2)%t)
        own = [own, doubt_type((from + to) / 2, to - from)]
      end associate
    end do
    search%doubts = [own, search%doubts]
  end subroutine name_left_out

  !> Both lists, ascending, in one, what is the same left once.
  pure function merged(a, b) result(all)
    real(dp), intent(in) :: a(:), b(:)
    real(dp), allocatable :: all(:)
    real(dp), parameter :: same = 1.0e-9_dp
    real(dp) :: both(size(a) + size(b))
    integer :: i, j, k

    i = 1
    j = 1
    do k = 1, size(both)
      if (j > size(b)) then
        both(k) = a(i)
        i = i + 1
      else if (i > size(a)) then
        both(k) = b(j)
        j = j + 1
      else if (a(i) <= b(j)) then
        both(k) = a(i)
        i = i + 1
      else
        both(k) = b(j)
        j = j + 1
      end if
    end do
    all = pack(both, [.true., both(2:) - both(:size(both) - 1) > same])
  end function merged

  recursive subroutine look_at(self, k, error)
    class(meetings_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    associate (part => self%found(k), place => self%places(k))
      part%doubts = [doubt_type ::]
      part%marks = [probe_type ::]
      call look(self%line, self%way%list(place%stretch), place, part, error)
    end associate
  end subroutine look_at

  subroutine exchange_place(self, k, record)
    class(meetings_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call self%found(k)%exchange(record)
  end subroutine exchange_place

  !> Searches for a tongue where two multipliers meet.
  subroutine look(line, stretch, place, search, error)
    type(line_type), intent(in) :: line
    type(stretch_type), intent(in) :: stretch
    type(place_type), intent(in) :: place
    type(search_type), intent(inout) :: search
    type(error_type), allocatable, intent(out) :: error
    type(meeting_type) :: meeting

    search%meetings = search%meetings + 1
    associate (start => stretch%ends(1)%t + place%x * stretch%length())
      call search_meeting(line, stretch, place%name, start, place%rate, meeting, error)
    end associate
    if (allocated(error)) return
    select case (meeting%outcome)
    case (tongue)
      call add_tongue(line, stretch, place%name, meeting, search, error)
    case (thin)
      search%thin = search%thin + 1
    case (open_question)
      search%doubts = [search%doubts, doubt_type(meeting%t, meeting%width)]
    case default
      ! no tongue
    end select
  end subroutine look

  !> The borders at both ends of a tongue, and systems in it and beside it.
  subroutine add_tongue(line, stretch, name, meeting, search, error)
    type(line_type), intent(in) :: line
    type(stretch_type), intent(in) :: stretch
    type(pair_name_type), intent(in) :: name
    type(meeting_type), intent(in) :: meeting
    type(search_type), intent(inout) :: search
    type(error_type), allocatable, intent(out) :: error
    type(crossing_type) :: crossing
    type(probe_type) :: below, above
    real(dp) :: t
    logical :: missing, success
    integer :: side

    call search%add_mark(meeting%top%at)
    do side = 1, 2
      if (.not. meeting%outside(side)) cycle
      call search%add_mark(meeting%sides(side)%at)
      call tongue_end(line, stretch, name, meeting%sides(side), meeting%top, t, missing, error)
      if (allocated(error)) return
      if (missing) cycle
      if (side == 1) call verify(line, meeting%sides(1)%at, meeting%top%at, t, crossing, below, above, success, error)
      if (side == 2) call verify(line, meeting%top%at, meeting%sides(2)%at, t, crossing, below, above, success, error)
      if (allocated(error)) return
      call search%add_mark(below)
      call search%add_mark(above)
      if (success) call add_named(search%found, crossing, below, above)
    end do
  end subroutine add_tongue

  !> Between neighbouring marks the number of borders that were found must be even if the verdict is the same, odd if not; and
  !> where none was found, no function may change its sign: else borders are sought there.
  subroutine close_gaps(line, search, error)
    type(line_type), intent(in), target :: line
    type(search_type), intent(inout), target :: search
    type(error_type), allocatable, intent(out) :: error
    type(gaps_type) :: work
    integer :: i, k

    call search%found%sort(0.0_dp)
    work%line => line
    work%marks => search%marks
    work%gaps = pack([(i, i = 1, size(search%marks) - 1)], [(is_open(search, i), i = 1, size(search%marks) - 1)])
    allocate(work%found(size(work%gaps)))
    call spread_over(work, size(work%gaps), error, line%executor)
    if (allocated(error)) return
    do i = 1, size(work%found)
      if (.not. allocated(work%found(i)%list)) cycle
      do k = 1, size(work%found(i)%list)
        call search%found%add(work%found(i)%list(k))
      end do
    end do
  end subroutine close_gaps

  !> Whether borders are to be sought between mark `i` and the next one.
  pure logical function is_open(search, i)
    type(search_type), intent(in) :: search
    integer, intent(in) :: i
    integer :: n

    associate (l => search%marks(i), r => search%marks(i + 1))
      n = count(search%found%list%t > l%t .and. search%found%list%t < r%t)
      is_open = n == 0 .or. (mod(n, 2) == 1 .neqv. (l%is_unstable() .neqv. r%is_unstable()))
    end associate
  end function is_open

  recursive subroutine close_gap(self, k, error)
    class(gaps_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    associate (i => self%gaps(k))
      call separate(self%line, self%marks(i), self%marks(i + 1), usual_depth, self%found(k), error)
    end associate
  end subroutine close_gap

  subroutine exchange_gap(self, k, record)
    class(gaps_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call self%found(k)%exchange(record)
  end subroutine exchange_gap

end module gestell_task_boundary_line_search
