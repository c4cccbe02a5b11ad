!> Vertices of borders in the plane of two parameters, in coordinates u (gestell_task_boundary_line), and the plane itself.
!>
!> A border encloses a region: the unstable machines, or the machines with a measured quantity above its level.
module gestell_task_boundary_map_vertex
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_grid, only: axis_type
  use gestell_system_family, only: family_type
  use gestell_task_boundary_line, only: border_options, line_type, probe_line, probe_type
  use gestell_task_boundary_line_search_result, only: crossing_type, search_type
  use gestell_task_boundary_line_search, only: search_line
  use gestell_task_common_executor, only: work_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: vertex_of

  !> Upper limit of the tolerance of borders on lines, as a difference of the coordinates u. Because of this limit, narrow tongues
  !> are found even if the allowed deviation of the curves is large.
  real(dp), parameter, public :: finest_lines = 1.0e-8_dp

  !> A vertex: a point of a border in the plane.
  type, public :: vertex_type
    !> Coordinates u of the vertex (0 to 1 over the range of each parameter).
    real(dp) :: u(2) = 0
    !> Unit vector along the line on which the vertex was found. It points into the region.
    real(dp) :: inward(2) = 0
    integer :: kind = 0
    !> `arg`: argument of the multiplier with modulus 1 (0 to pi). `error`: distance from the vertex, as a difference of u, within
    !> which the border lies on either side
    real(dp) :: arg = 0, error = 0
    !> Number of the next vertex of the curve, or 0 at its end. Seen from this vertex towards the next, the region lies on the left.
    integer :: next = 0
  end type vertex_type

  !> Part of a line in which a border cannot be excluded. `u`: coordinates of its middle. `width`: its extent in each coordinate.
  type, public :: open_spot_type
    real(dp) :: u(2) = 0, width(2) = 0
  end type open_spot_type

  !> List of vertices, and of parts of lines in which a border cannot be excluded.
  type, public :: vertices_type
    integer :: count = 0
    !> The vertices. Only the first `count` elements are used.
    type(vertex_type), allocatable :: list(:)
    !> Parts of the searched lines in which a border cannot be excluded.
    type(open_spot_type), allocatable :: open(:)
    !> `thin`: number of meetings of undamped multipliers whose tongues are narrower than the tolerance of the lines. `left_out`:
    !> number of meetings of multipliers that were not searched. `rough`: number of connections between vertices that could not be
    !> refined.
    integer :: thin = 0, left_out = 0, rough = 0
  contains
    procedure :: add, add_search, exchange
  end type vertices_type

  !> Parallel work in which each piece finds vertices of borders.
  type, abstract, extends(work_type), public :: traces_type
    type(vertices_type), allocatable :: found(:)
  contains
    procedure :: exchange => exchange_vertices
  end type traces_type

  !> Plane of two parameters with a region in it. The region consists of the unstable machines, unless an extension overrides
  !> `probe` and `search`. `tolerance` is the allowed deviation of the curves from the border, as a difference of the coordinates
  !> u.
  type, extends(border_options), public :: plane_type
    class(family_type), pointer :: family => null()
    type(axis_type) :: axes(2)
    !> `kinds`: kinds of borders. `states`: state of the machine for each element of `kinds`.
    character(len=15), allocatable :: kinds(:), states(:)
  contains
    procedure :: line, probe, search, precision => precision_of_lines
  end type plane_type

contains

  !> Appends a vertex to the list.
  pure subroutine add(self, vertex)
    class(vertices_type), intent(inout) :: self
    type(vertex_type), intent(in) :: vertex

    if (.not. allocated(self%list)) allocate(self%list(64))
    if (self%count == size(self%list)) self%list = [self%list, spread(vertex, 1, self%count + 8)]
    self%count = self%count + 1
    self%list(self%count) = vertex
  end subroutine add

  !> Adds to the list the borders found along a line, in the order of the line, and the parts of the line in which a border cannot
  !> be excluded.
  pure subroutine add_search(self, line, search)
    class(vertices_type), intent(inout) :: self
    type(line_type), intent(in) :: line
    type(search_type), intent(in) :: search
    integer :: i

    do i = 1, size(search%borders)
      call self%add(vertex_of(line, search%borders(i)))
    end do
    if (.not. allocated(self%open)) allocate(self%open(0))
    self%open = [self%open, (open_spot_type(line%start + search%open_parts(i)%t * line%direction, &
      & search%open_parts(i)%width * line%direction), i = 1, size(search%open_parts))]
    self%thin = self%thin + search%thin
    self%left_out = self%left_out + search%left_out
  end subroutine add_search

  !> Writes all vertices, and all parts of lines without a decision, to a record, or reads them from a record.
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

  subroutine exchange_vertices(self, k, record)
    class(traces_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call self%found(k)%exchange(record)
  end subroutine exchange_vertices

  !> Creates the vertex at the crossing of a line with a border.
  pure type(vertex_type) function vertex_of(line, crossing) result(vertex)
    type(line_type), intent(in) :: line
    type(crossing_type), intent(in) :: crossing

    vertex%u = line%start + crossing%t * line%direction
    vertex%inward = line%direction / norm2(line%direction)
    if (.not. crossing%enters) vertex%inward = -vertex%inward
    vertex%kind = crossing%kind
    vertex%arg = crossing%arg
    vertex%error = crossing%error * norm2(line%direction)
  end function vertex_of

  !> Tolerance of borders on lines, as a difference of the coordinates u. It is much smaller than the allowed deviation of the
  !> curves.
  pure real(dp) function precision_of_lines(self) result(precision)
    class(plane_type), intent(in) :: self
    real(dp), parameter :: share = 0.01_dp

    precision = share * self%tolerance
  end function precision_of_lines

  !> Determines whether the system at the coordinates `u` belongs to the region of the unstable machines (`inside`), and whether
  !> it does not exist or could not be solved (`missing`). Fails if the parameters are invalid.
  subroutine probe(self, u, inside, missing, error)
    class(plane_type), intent(in) :: self
    real(dp), intent(in) :: u(2)
    logical, intent(out) :: inside, missing
    type(error_type), allocatable, intent(out) :: error
    type(line_type) :: here
    type(probe_type) :: system

    call self%line(u, [1.0_dp, 0.0_dp], here)
    call probe_line(here, 0.0_dp, system, error)
    inside = system%is_unstable()
    missing = system%missing()
  end subroutine probe

  !> Finds all borders along a line from t = 0 to t = 1. `nodes`: initial nodes, ascending from 0 to 1. Fails if the parameters are
  !> invalid.
  subroutine search(self, along, nodes, found, error)
    class(plane_type), intent(in) :: self
    type(line_type), intent(in) :: along
    real(dp), intent(in) :: nodes(:)
    type(search_type), intent(out) :: found
    type(error_type), allocatable, intent(out) :: error

    call search_line(along, nodes, found, error)
    ! A map does not need the systems along its lines, so their memory is freed.
    found%marks = [probe_type ::]
    found%mark_count = 0
    associate (unused_plane => self)
    end associate
  end subroutine search

  !> Sets up the line with the coordinates u(t) = `start` + t `direction`.
  subroutine line(self, start, direction, along)
    class(plane_type), intent(in) :: self
    real(dp), intent(in) :: start(2), direction(2)
    type(line_type), intent(out) :: along

    along%axes = self%axes
    along%start = start
    along%direction = direction
    along%family => self%family
    along%accuracy = self%accuracy
    along%tolerance = min(self%precision(), finest_lines)
  end subroutine line

end module gestell_task_boundary_map_vertex
