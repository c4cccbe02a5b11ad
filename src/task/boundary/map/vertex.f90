!> Points of borders in the plane of two parameters, measured by u (gestell_task_boundary_line), and the plane itself.
module gestell_task_boundary_map_vertex
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_task_boundary_line_crossing, only: crossing_type
  use gestell_task_boundary_line, only: line_type, probe_line, probe_type
  use gestell_task_boundary_line_found, only: search_type
  use gestell_task_boundary_line_search, only: search_line
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type
  use gestell_task_common_executor, only: executor_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: vertex_of

  !> How exactly borders are found on lines, at least, in u: whatever the curves are to be, narrow tongues must not be lost.
  real(dp), parameter, public :: finest_lines = 1.0e-8_dp

  type, public :: vertex_type
    real(dp) :: u(2) = 0
    !> Unit vector of the line on which it was found, toward the unstable side.
    real(dp) :: unstable_side(2) = 0
    integer :: kind = 0
    real(dp) :: arg = 0, error = 0
    !> The next vertex of the curve: the unstable side lies on the left of the way there; 0: none.
    integer :: next = 0
  end type vertex_type

  !> A place on a line where a border could not be excluded, and how wide it is along the line, in u.
  type, public :: open_spot_type
    real(dp) :: u(2) = 0, width(2) = 0
  end type open_spot_type

  type, public :: vertices_type
    integer :: count = 0
    type(vertex_type), allocatable :: list(:)
    !> What the lines that were searched leave open; places without damping whose tongues are thinner than they resolve; meetings
    !> of multipliers that were not looked at; stretches between vertices that could not be refined.
    type(open_spot_type), allocatable :: open(:)
    integer :: thin = 0, left_out = 0, rough = 0
  contains
    procedure :: add
    procedure :: add_search
    procedure :: exchange
  end type vertices_type

  !> What is sought, and where: borders of stability, or what an extension seeks by its own `probe` and `search`; it calls unstable
  !> what its curves have on their left.
  type, public :: plane_type
    class(family_type), pointer :: family => null()
    type(axis_type) :: axes(2)
    !> Names of the kinds of borders, and what else is told of each.
    character(len=15), allocatable :: kinds(:), states(:)
    type(accuracy_type) :: accuracy
    !> How far curves may pass by the border, in u.
    real(dp) :: deviation = 1.0e-3_dp
    !> Who searches lines, cells and stretches of curves, where members of the family may be asked for by several threads.
    class(executor_type), pointer :: executor => null()
  contains
    procedure :: line
    procedure :: probe
    procedure :: search
    procedure :: precision => precision_of_lines
  end type plane_type

contains

  pure subroutine add(self, vertex)
    class(vertices_type), intent(inout) :: self
    type(vertex_type), intent(in) :: vertex
    type(vertex_type), allocatable :: longer(:)

    if (.not. allocated(self%list)) allocate(self%list(64))
    if (self%count == size(self%list)) then
      allocate(longer(2 * self%count + 8))
      longer(:self%count) = self%list
      call move_alloc(longer, self%list)
    end if
    self%count = self%count + 1
    self%list(self%count) = vertex
  end subroutine add

  !> The borders that were found along a line, in its order, and what was left open there.
  pure subroutine add_search(self, line, search)
    class(vertices_type), intent(inout) :: self
    type(line_type), intent(in) :: line
    type(search_type), intent(in) :: search
    integer :: i

    do i = 1, size(search%found%list)
      call self%add(vertex_of(line, search%found%list(i)))
    end do
    if (.not. allocated(self%open)) allocate(self%open(0))
    self%open = [self%open, (open_spot_type(line%start + search%doubts(i)%t * line%way, search%doubts(i)%width * line%way), &
      & i = 1, size(search%doubts))]
    self%thin = self%thin + search%thin
    self%left_out = self%left_out + search%left_out
  end subroutine add_search

  !> Passes all of them to a record, or takes them from there.
  subroutine exchange(self, record)
    class(vertices_type), intent(inout) :: self
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)

    if (allocated(self%list)) words = transfer(self%list(:self%count), [0_int64])
    call record%pass_words(words)
    if (record%reads) self%list = transfer(words, [vertex_type ::])
    if (record%reads) self%count = size(self%list)
    words = [integer(int64) ::]
    if (allocated(self%open)) words = transfer(self%open, [0_int64])
    call record%pass_words(words)
    if (record%reads) self%open = transfer(words, [open_spot_type ::])
    call record%pass(self%thin)
    call record%pass(self%left_out)
    call record%pass(self%rough)
  end subroutine exchange

  pure type(vertex_type) function vertex_of(line, crossing) result(vertex)
    type(line_type), intent(in) :: line
    type(crossing_type), intent(in) :: crossing

    vertex%u = line%start + crossing%t * line%way
    vertex%unstable_side = line%way / norm2(line%way)
    if (.not. crossing%unstable_above) vertex%unstable_side = -vertex%unstable_side
    vertex%kind = crossing%kind
    vertex%arg = crossing%arg
    vertex%error = crossing%error * norm2(line%way)
  end function vertex_of

  !> Borders on lines are found much more exactly than curves are to follow them, in u.
  pure real(dp) function precision_of_lines(self) result(precision)
    class(plane_type), intent(in) :: self
    real(dp), parameter :: share = 0.01_dp

    precision = share * self%deviation
  end function precision_of_lines

  !> The system at a point of a line. Error: the parameters make no sense.
  subroutine probe(self, along, t, found, error)
    class(plane_type), intent(in) :: self
    type(line_type), intent(in) :: along
    real(dp), intent(in) :: t
    type(probe_type), intent(out) :: found
    type(error_type), allocatable, intent(out) :: error

    call probe_line(along, t, found, error)
    associate (unused_plane => self)
    end associate
  end subroutine probe

  !> All borders along a line, from 0 to 1; `nodes`: where the search begins, ascending from 0 to 1. Error: the parameters make no
  !> sense.
  subroutine search(self, along, nodes, found, error)
    class(plane_type), intent(in) :: self
    type(line_type), intent(in) :: along
    real(dp), intent(in) :: nodes(:)
    type(search_type), intent(out) :: found
    type(error_type), allocatable, intent(out) :: error

    call search_line(along, nodes, found, error)
    ! the systems on the way are of no more use
    call found%forget_marks()
    associate (unused_plane => self)
    end associate
  end subroutine search

  !> The line start + t way.
  subroutine line(self, start, way, along)
    class(plane_type), intent(in) :: self
    real(dp), intent(in) :: start(2), way(2)
    type(line_type), intent(out) :: along
    allocate(along%axes(2))
    along%axes = self%axes
    allocate(along%start(2), along%way(2))
    along%start = start
    along%way = way
    along%family => self%family
    along%accuracy = self%accuracy
    along%tolerance = min(self%precision(), finest_lines)
  end subroutine line

end module gestell_task_boundary_map_vertex
