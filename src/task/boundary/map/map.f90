!> Computes stability borders in the plane of two parameters as curves.
module gestell_task_boundary_map
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_task_boundary_map_cells, only: connect_cells
  use gestell_task_boundary_line_functions, only: kind_names
  use gestell_task_boundary_line, only: border_options, check_search, line_type, parameter_at, sensitivity, skewed
  use gestell_task_boundary_line_search_result, only: searches_type
  use gestell_task_boundary_line_search, only: range_nodes
  use gestell_task_boundary_map_refine, only: refine_stretches
  use gestell_task_boundary_map_vertex, only: open_spot_type, plane_type, vertices_type
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: check_grid, grid_type
  use gestell_task_common_executor, only: executor_type, distribute_over
  implicit none (type, external)
  private

  public :: trace_borders, trace_curves

  !> A vertex (corner) of a border curve in the plane of the parameters.
  type, public :: border_vertex_type
    integer :: curve = 0
    real(dp) :: parameters(2) = 0
    !> Error bound of each parameter. On the line on which the vertex was found, the border lies within this distance on either
    !> side of the vertex.
    real(dp) :: error(2) = 0
    !> Argument of the multiplier with modulus 1 (see `border_type`).
    real(dp) :: arg_rad = 0
    !> Kind of the border (see `border_type`).
    character(len=15) :: kind = ""
    !> State of the machine where its measured quantity crosses a level (gestell_study_speed_point).
    character(len=15) :: state = ""
  end type border_vertex_type

  !> Part of a line in which a border cannot be excluded. `parameters`: the two parameters at the middle of this part. `width`:
  !> its extent in each parameter.
  type, public :: open_place_type
    real(dp) :: parameters(2) = 0, width(2) = 0
  end type open_place_type

  !> Curves of borders in the plane of two parameters.
  type, public :: border_map_type
    !> Vertices in the order in which the curves connect them. The region (machines that are unstable or above a level) lies to
    !> the left of a curve if the first parameter is plotted to the right and the second one upward. A closed curve ends with its
    !> first vertex.
    type(border_vertex_type), allocatable :: vertices(:)
    !> Number of curves on the map.
    integer :: curves = 0
    !> Number of connections between two vertices that could not be refined.
    integer :: rough = 0
    !> Parts in which a border cannot be excluded, both on the lines of the search grid and on the lines that divide its cells.
    type(open_place_type), allocatable :: places(:)
    !> Numbers of meetings of multipliers on all searched lines. `thin`: meetings whose tongues are narrower than the tolerance of
    !> the lines. `left_out`: meetings that were not searched.
    integer :: thin = 0, left_out = 0
  end type border_map_type

  !> Parallel work: each piece searches one line of the search grid for borders.
  type, extends(searches_type) :: lines_type
    class(plane_type), pointer :: plane => null()
    type(line_type), allocatable :: lines(:)
  contains
    procedure :: compute
  end type lines_type

contains

  !> Computes the stability borders in the plane of two parameters. The borders on the lines of the search grid are found by the
  !> method of gestell_task_boundary_line_search. They are connected within each cell, and the curves are refined. Fails if
  !> `check_search` fails, if the grid does not have two axes, or if the parameters are invalid.
  subroutine trace_borders(family, grid, accuracy, deviation, map, error, executor)
    !> Family of systems that depend on two parameters
    class(family_type), intent(in), target :: family
    !> Ranges of the two parameters, and number of search lines along each axis
    type(grid_type), intent(in) :: grid
    !> Tolerance of the monodromy matrix, integration method, and number of steps
    type(accuracy_type), intent(in) :: accuracy
    !> Allowed deviation of the curves from the border. It is relative to the ranges or, on logarithmic axes, to the ranges of the
    !> logarithms
    real(dp), intent(in) :: deviation
    !> The border curves
    type(border_map_type), intent(out) :: map
    type(error_type), allocatable, intent(out) :: error
    !> Distributes the work over threads. The threads may request members of `family` at the same time
    class(executor_type), intent(inout), optional, target :: executor
    type(plane_type), target :: plane

    plane%family => family
    plane%border_options = border_options(accuracy, deviation)
    plane%kinds = kind_names
    plane%states = spread(repeat(" ", len(plane%states)), 1, size(kind_names))
    if (present(executor)) plane%executor => executor
    call trace_curves(plane, grid, map, error)
  end subroutine trace_borders

  !> Computes the curves that enclose the region (unstable machines, or machines above a level) in the plane of two parameters. On
  !> entry all components of `plane` except its axes must be set. Fails if `trace_borders` would fail.
  subroutine trace_curves(plane, grid, map, error)
    class(plane_type), intent(inout), target :: plane
    type(grid_type), intent(in) :: grid
    type(border_map_type), intent(out) :: map
    type(error_type), allocatable, intent(out) :: error
    type(vertices_type) :: vertices
    integer :: k

    allocate(map%vertices(0), map%places(0))
    call check_grid(grid, error)
    if (allocated(error)) return
    if (size(grid%axes) /= 2) then
      call fatal_error(error, "a map of stability boundaries needs a grid with exactly two axes", invalid_input)
      return
    end if
    call check_search(grid%axes, plane%accuracy, plane%tolerance, error)
    if (allocated(error)) return
    plane%axes = grid%axes
    call search_grid(plane, vertices, error)
    if (.not. allocated(error)) call assemble_curves(plane, vertices, map, error)
    if (allocated(error)) return
    map%thin = vertices%thin
    map%left_out = vertices%left_out
    map%places = [(open_place_type(parameter_at(plane%axes, vertices%open(k)%u), &
      & abs(sensitivity(plane%axes, vertices%open(k)%u)) * vertices%open(k)%width), k = 1, size(vertices%open))]
  end subroutine trace_curves

  !> Searches the lines of the search grid for borders, first the lines on which the second parameter is constant. Then connects
  !> the borders within the cells. Fails if the parameters are invalid.
  subroutine search_grid(plane, vertices, error)
    class(plane_type), intent(in), target :: plane
    type(vertices_type), intent(out) :: vertices
    type(error_type), allocatable, intent(out) :: error
    type(lines_type) :: work
    real(dp), allocatable :: u1(:), u2(:)
    !> Number of the first vertex on each line: the vertices of line k have the numbers first(k) to first(k + 1) - 1.
    integer, allocatable :: first(:)
    integer :: k

    u1 = skewed(plane%axes(1)%count)
    u2 = skewed(plane%axes(2)%count)
    work%plane => plane
    allocate(work%lines(size(u2) + size(u1)), work%found(size(u2) + size(u1)), first(size(u2) + size(u1) + 1))
    do k = 1, size(u2)
      call plane%line([0.0_dp, u2(k)], [1.0_dp, 0.0_dp], work%lines(k))
    end do
    do k = 1, size(u1)
      call plane%line([u1(k), 0.0_dp], [0.0_dp, 1.0_dp], work%lines(size(u2) + k))
    end do
    call distribute_over(work, size(work%lines), error, plane%executor)
    if (allocated(error)) return
    do k = 1, size(work%lines)
      first(k) = vertices%count + 1
      call vertices%add_search(work%lines(k), work%found(k))
    end do
    first(size(first)) = vertices%count + 1
    call connect_cells(plane, u1, u2, first(size(u2) + 1:), first(:size(u2) + 1), vertices, error)
    if (.not. allocated(error)) call list_isolated(first(size(first)) - 1, vertices)
  end subroutine search_grid

  !> Adds to `vertices%open` the vertices on the lines of the grid (the first `number` vertices) that belong to no curve. The
  !> border through such a vertex could not be followed into the cells on either side.
  pure subroutine list_isolated(number, vertices)
    integer, intent(in) :: number
    type(vertices_type), intent(inout) :: vertices
    logical :: passed(vertices%count)
    integer :: k

    ! The list of vertices is not allocated if it is empty.
    if (vertices%count == 0) return
    passed = vertices%list(:vertices%count)%next > 0
    do k = 1, vertices%count
      if (vertices%list(k)%next > 0) passed(vertices%list(k)%next) = .true.
    end do
    do k = 1, number
      associate (v => vertices%list(k))
        if (.not. passed(k)) vertices%open = [vertices%open, open_spot_type(v%u, 2 * v%error * abs(v%inward))]
      end associate
    end do
  end subroutine list_isolated

  recursive subroutine compute(self, k, error)
    class(lines_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    !> Maximum number of initial nodes on a line. The search adds nodes where it needs them.
    integer, parameter :: most_nodes = 20
    integer :: along

    along = maxloc(self%lines(k)%direction, dim=1)
    call self%plane%search(self%lines(k), range_nodes(min(self%plane%axes(along)%count, most_nodes)), self%found(k), error)
  end subroutine compute

  !> Puts the refined curves one after another in `map`: first the open curves, then the closed ones.
  subroutine assemble_curves(plane, vertices, map, error)
    class(plane_type), intent(in) :: plane
    type(vertices_type), intent(in) :: vertices
    type(border_map_type), intent(inout) :: map
    type(error_type), allocatable, intent(out) :: error
    !> Curves shorter than this multiple of the tolerance are omitted, because they enclose regions too narrow for the allowed
    !> deviation.
    real(dp), parameter :: least = 2
    type(vertices_type) :: curves
    type(vertices_type), allocatable :: between(:)
    integer, allocatable :: numbers(:), own(:)
    logical, allocatable :: done(:), reached(:)
    real(dp) :: extent
    integer :: start, closed, i

    call refine_stretches(plane, vertices, between, error)
    if (allocated(error)) return
    map%rough = sum(between%rough)
    allocate(done(vertices%count), reached(vertices%count), source=.false.)
    allocate(numbers(0))
    do start = 1, vertices%count
      if (vertices%list(start)%next > 0) reached(vertices%list(start)%next) = .true.
    end do
    do closed = 0, 1
      do start = 1, vertices%count
        if (done(start) .or. vertices%list(start)%next == 0 .or. (closed == 0 .and. reached(start))) cycle
        call append_curve(vertices, between, start, done, curves)
        extent = maxval([(norm2(curves%list(i)%u - curves%list(size(numbers) + 1)%u), i = size(numbers) + 1, curves%count)])
        if (extent <= least * plane%tolerance) then
          curves%count = size(numbers)
        else
          map%curves = map%curves + 1
          numbers = [numbers, spread(map%curves, 1, curves%count - size(numbers))]
        end if
      end do
    end do
    map%vertices = [(border_vertex_type(numbers(i), parameter_at(plane%axes, curves%list(i)%u), &
      & abs(sensitivity(plane%axes, curves%list(i)%u)) * curves%list(i)%error, curves%list(i)%arg, &
      & plane%kinds(curves%list(i)%kind), plane%states(curves%list(i)%kind)), i = 1, curves%count)]
    ! If exactly one of the two ranges descends, left and right are exchanged in the plane of the parameters, so the curves are
    ! reversed.
    if ((plane%axes(1)%to < plane%axes(1)%from) .neqv. (plane%axes(2)%to < plane%axes(2)%from)) then
      do start = 1, map%curves
        own = pack([(i, i = 1, curves%count)], numbers == start)
        map%vertices(own) = map%vertices(own(size(own):1:-1))
      end do
    end if
  end subroutine assemble_curves

  !> Appends the curve that begins at vertex number `start` to `curves`. Between each vertex and the next one on the curve, it
  !> inserts the vertices in `between`, which refinement has added.
  pure subroutine append_curve(vertices, between, start, done, curves)
    type(vertices_type), intent(in) :: vertices, between(:)
    integer, intent(in) :: start
    logical, intent(inout) :: done(:)
    type(vertices_type), intent(inout) :: curves
    integer :: here, i

    here = start
    call curves%add(vertices%list(here))
    do
      done(here) = .true.
      if (vertices%list(here)%next == 0) return
      do i = 1, between(here)%count
        call curves%add(between(here)%list(i))
      end do
      here = vertices%list(here)%next
      call curves%add(vertices%list(here))
      if (done(here)) return
    end do
  end subroutine append_curve

end module gestell_task_boundary_map
