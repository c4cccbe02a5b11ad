!> Connects the vertices on the sides of each cell of the search grid by borders through the interior of the cell.
module gestell_task_boundary_map_cells
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_task_boundary_map_bands, only: box_type, link_through, opposite_sides, cross_straight
  use gestell_math_sorting, only: ascending
  use gestell_task_boundary_line, only: line_type
  use gestell_task_boundary_line_search_result, only: search_type
  use gestell_task_boundary_line_search, only: short_nodes
  use gestell_task_boundary_map_vertex, only: plane_type, traces_type, vertex_type, vertices_type
  use gestell_task_common_executor, only: distribute_over
  implicit none (type, external)
  private

  public :: connect_cells

  !> A cell of the search grid: a rectangle between neighbouring lines.
  type :: cell_type
    type(box_type) :: box
    !> Indices, in the list of all vertices, of the vertices on the sides of the cell.
    integer, allocatable :: sides(:)
  end type cell_type

  !> Parallel work: each piece connects the vertices of one cell. It adds vertices inside the cell, and links each vertex to the
  !> next.
  type, extends(traces_type) :: cells_type
    class(plane_type), pointer :: plane => null()
    type(cell_type), allocatable :: cells(:)
  contains
    procedure :: compute
  end type cells_type

contains

  !> Connects the vertices on the lines of the search grid through the cells between these lines. Fails if the parameters are
  !> invalid.
  subroutine connect_cells(plane, u1, u2, first1, first2, vertices, error)
    class(plane_type), intent(in), target :: plane
    !> Lines of the search grid. `u1`: first coordinates of the lines on which the first parameter is constant. `u2`: second
    !> coordinates of the lines on which the second parameter is constant
    real(dp), intent(in) :: u1(:), u2(:)
    !> `first1`: number of the first vertex on each line of constant first parameter. `first2`: number of the first vertex on each
    !> line of constant second parameter. The last element of each array is one more than the number of the last vertex on these
    !> lines
    integer, intent(in) :: first1(:), first2(:)
    type(vertices_type), intent(inout) :: vertices
    type(error_type), allocatable, intent(out) :: error
    type(cells_type) :: work
    type(box_type) :: box
    integer, allocatable :: sides(:)
    logical, allocatable :: enter(:)
    integer :: i, j, k, cells

    work%plane => plane
    allocate(work%cells(size(u1) * size(u2)), work%found(size(u1) * size(u2)))
    cells = 0
    do i = 1, size(u1) - 1
      do j = 1, size(u2) - 1
        box = box_type([u1(i), u2(j)], [u1(i + 1), u2(j + 1)])
        call vertices_around(box, [(k, k = first1(i), first1(i + 2) - 1), (k, k = first2(j), first2(j + 2) - 1)], vertices, &
          & sides, enter)
        if (size(sides) == 0) cycle
        cells = cells + 1
        work%cells(cells) = cell_type(box, sides)
        work%found(cells)%count = size(sides)
        work%found(cells)%list = vertices%list(sides)
      end do
    end do
    call distribute_over(work, cells, error, plane%executor)
    if (allocated(error)) return
    do k = 1, cells
      call merge_cell(work%cells(k)%sides, work%found(k), vertices)
    end do
  end subroutine connect_cells

  recursive subroutine compute(self, k, error)
    class(cells_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    call connect_cell(self%plane, self%cells(k)%box, [(i, i = 1, size(self%cells(k)%sides))], self%found(k), error)
  end subroutine compute

  !> Adds the results of one cell to the list of all vertices. `sides`: indices of the vertices on the sides of the cell.
  pure subroutine merge_cell(sides, found, vertices)
    integer, intent(in) :: sides(:)
    type(vertices_type), intent(in) :: found
    type(vertices_type), intent(inout) :: vertices
    type(vertex_type) :: vertex
    integer, allocatable :: numbers(:)
    integer :: i, n

    n = size(sides)
    numbers = [sides, (vertices%count + i, i = 1, found%count - n)]
    do i = 1, size(numbers)
      vertex = found%list(i)
      if (vertex%next > 0) vertex%next = numbers(vertex%next)
      if (i > n) call vertices%add(vertex)
      if (vertex%next > 0) vertices%list(numbers(i))%next = vertex%next
    end do
    if (allocated(found%open)) vertices%open = [vertices%open, found%open]
    vertices%thin = vertices%thin + found%thin
    vertices%left_out = vertices%left_out + found%left_out
  end subroutine merge_cell

  !> Links the vertices of `pool` that lie on the sides of `box`, by borders through the box. These vertices divide the sides into
  !> stretches that are alternately inside and outside the region that the borders enclose.
  !>
  !> Two vertices are linked directly. For four vertices, the system at their mean decides whether the two stretches inside the
  !> region belong to one connected area. For four or more vertices on two opposite sides, a search along the line midway between
  !> these sides decides. The box is halved if the decision is uncertain, if systems are missing, or if a narrow tongue ends in
  !> the box. Halving ends at the allowed deviation. Fails if the parameters are invalid.
  recursive subroutine connect_cell(plane, box, pool, vertices, error)
    class(plane_type), intent(in) :: plane
    type(box_type), intent(in) :: box
    integer, intent(in) :: pool(:)
    type(vertices_type), intent(inout) :: vertices
    type(error_type), allocatable, intent(out) :: error
    !> A box is halved across its longer side if the ratio of its shorter to its longer side is smaller than this.
    real(dp), parameter :: flat = 0.125_dp
    integer, allocatable :: ids(:)
    logical, allocatable :: enter(:)
    logical :: regular, joined, certain, parallel
    integer :: n, i, k

    call vertices_around(box, pool, vertices, ids, enter)
    n = size(ids)
    if (n == 0) return
    ! Vertices that enter and leave the region alternately are even in number.
    regular = all(enter .neqv. cshift(enter, 1))
    joined = .false.
    certain = .false.
    parallel = .false.
    associate (size_of => box%high - box%low)
      k = maxloc(size_of, dim=1)
      if (regular .and. n == 2) then
        certain = .not. has_tip(box, vertices%list(ids(1))%u, vertices%list(ids(2))%u)
        if (.not. certain) k = merge(1, 2, abs(vertices%list(ids(1))%u(1) - vertices%list(ids(2))%u(1)) <= 0)
      else if (regular) then
        associate (sides => opposite_sides(box, ids, vertices))
          if (n == 4) call decide_by_mean(plane, box, ids, enter, sides > 0, vertices, joined, certain, error)
          if (allocated(error)) return
          if (sides > 0) parallel = size_of(sides) > flat * size_of(3 - sides)
          if (parallel) k = sides
        end associate
      end if
      if (.not. certain) then
        call divide(plane, box, ids, k, parallel, size_of(k) <= plane%tolerance, vertices, certain, error)
        if (allocated(error) .or. .not. certain) return
      end if
    end associate
    ! If the parts inside the region are connected, vertices are linked across the parts outside it. Otherwise they are linked
    ! across the parts inside.
    do i = 1, n
      k = modulo(i, n) + 1
      if (enter(i) .eqv. enter(k)) cycle
      if (joined .and. .not. enter(i)) vertices%list(ids(i))%next = ids(k)
      if (.not. joined .and. enter(i)) vertices%list(ids(k))%next = ids(i)
    end do
  end subroutine connect_cell

  !> True if both vertices lie close together on one side of the box. A tongue then ends at an unknown position inside the box.
  pure logical function has_tip(box, u, v)
    type(box_type), intent(in) :: box
    real(dp), intent(in) :: u(2), v(2)
    real(dp), parameter :: close = 0.5_dp
    logical :: same(2)

    same = .not. abs(u - v) > 0
    has_tip = any(same([2, 1]) .and. abs(u - v) < close * (box%high - box%low))
  end function has_tip

  !> Selects the vertices of `pool` on the sides of the box, counter-clockwise from the corner `box%low`. `enter`: true if the path
  !> around the box enters the region at this vertex.
  pure subroutine vertices_around(box, pool, vertices, ids, enter)
    type(box_type), intent(in) :: box
    integer, intent(in) :: pool(:)
    type(vertices_type), intent(in) :: vertices
    integer, allocatable, intent(out) :: ids(:)
    logical, allocatable, intent(out) :: enter(:)
    real(dp) :: positions(size(pool)), tangent(2)
    logical :: entering(size(pool))
    integer, allocatable :: places(:)
    integer :: i

    do i = 1, size(pool)
      associate (v => vertices%list(pool(i)))
        call position_around(box, v%u, positions(i), tangent)
        entering(i) = dot_product(v%inward, tangent) > 0
      end associate
    end do
    places = pack([(i, i = 1, size(pool))], positions >= 0)
    places = places(ascending(positions(places)))
    ids = pool(places)
    enter = entering(places)
  end subroutine vertices_around

  !> Computes the position of the point `u` on the counter-clockwise path around the box, from 0 to 4, and the direction of the path
  !> there. The position is -1 if `u` does not lie on a side.
  pure subroutine position_around(box, u, position, tangent)
    type(box_type), intent(in) :: box
    real(dp), intent(in) :: u(2)
    real(dp), intent(out) :: position, tangent(2)
    real(dp) :: part(2)

    position = -1
    tangent = 0
    part = (u - box%low) / (box%high - box%low)
    if (any(part < 0 .or. part > 1)) return
    if (u(2) <= box%low(2)) then
      position = part(1)
      tangent(1) = 1
    else if (u(1) >= box%high(1)) then
      position = 1 + part(2)
      tangent(2) = 1
    else if (u(2) >= box%high(2)) then
      position = 3 - part(1)
      tangent(1) = -1
    else if (u(1) <= box%low(1)) then
      position = 4 - part(2)
      tangent(2) = -1
    end if
  end subroutine position_around

  !> Decides how the borders run through a box whose sides they cross at four vertices. `joined` is true if the two stretches of
  !> the sides inside the region belong to one connected area. A chord joins two neighbouring vertices. The shorter pair of
  !> opposite chords is assumed to span the ends of a tongue, which lies either inside or outside the region. The decision is
  !> `certain` if the system at the mean of the vertices agrees with this assumption. If it disagrees, the mean may lie beside the
  !> tongue, or the tongue may end in the box. Both borders of the tongue are then sought on a line across the tongue through the
  !> mean.
  subroutine decide_by_mean(plane, box, ids, enter, opposite, vertices, joined, certain, error)
    class(plane_type), intent(in) :: plane
    type(box_type), intent(in) :: box
    integer, intent(in) :: ids(:)
    logical, intent(in) :: enter(:), opposite
    type(vertices_type), intent(in) :: vertices
    logical, intent(out) :: joined, certain
    type(error_type), allocatable, intent(out) :: error
    type(line_type) :: line
    type(search_type) :: search
    real(dp) :: mean(2), across(2), lengths(2), chord(2)
    logical :: inside, missing
    integer :: i, k

    mean = 0
    lengths = 0
    do i = 1, size(ids)
      k = modulo(i, size(ids)) + 1
      chord = vertices%list(ids(k))%u - vertices%list(ids(i))%u
      mean = mean + vertices%list(ids(i))%u / size(ids)
      lengths = lengths + merge([norm2(chord), 0.0_dp], [0.0_dp, norm2(chord)], enter(i))
    end do
    joined = lengths(1) < lengths(2)
    call plane%probe(mean, inside, missing, error)
    certain = .not. missing .and. (inside .eqv. joined)
    if (allocated(error) .or. certain .or. opposite) return

    ! The first chord between vertices that are close together starts at vertex 1 or 2.
    i = merge(1, 2, enter(1) .eqv. joined)
    k = modulo(i, size(ids)) + 1
    across = vertices%list(ids(k))%u - vertices%list(ids(i))%u
    across = across / norm2(across) * maxval(box%high - box%low) / 2
    ! Shorten the line so that it stays within the ranges.
    across = across * min(1.0_dp, minval(min(mean, 1 - mean) / max(abs(across), tiny(1.0_dp))))
    if (norm2(across) < plane%precision()) return
    call plane%line(mean - across, 2 * across, line)
    call plane%search(line, short_nodes, search, error)
    if (allocated(error)) return
    associate (sides => search%borders%enters)
      if (size(sides) == 2) certain = (sides(1) .eqv. joined) .and. (sides(2) .neqv. joined)
    end associate
  end subroutine decide_by_mean

  !> Divides a box by the line through its middle on which coordinate number `k` is constant. If the borders are `parallel`, and
  !> if the vertices on the dividing line show that all borders cross the box, the vertices `ids` are linked through those on the
  !> dividing line. Otherwise the vertices of each half are connected separately. A box that is too `small` for this is not
  !> divided, and `is_final` is true. Fails if the parameters are invalid.
  recursive subroutine divide(plane, box, ids, k, parallel, small, vertices, is_final, error)
    class(plane_type), intent(in) :: plane
    type(box_type), intent(in) :: box
    integer, intent(in) :: ids(:), k
    logical, intent(in) :: parallel, small
    type(vertices_type), intent(inout) :: vertices
    logical, intent(out) :: is_final
    type(error_type), allocatable, intent(out) :: error
    type(line_type) :: line
    type(search_type) :: search
    type(box_type) :: half(2)
    real(dp) :: start(2), direction(2)
    integer :: before, i

    is_final = small .and. .not. parallel
    if (is_final) return
    before = vertices%count
    start = box%low
    start(k) = (box%low(k) + box%high(k)) / 2
    direction = box%high - box%low
    direction(k) = 0
    call plane%line(start, direction, line)
    call plane%search(line, short_nodes, search, error)
    if (allocated(error)) return
    call vertices%add_search(line, search)
    associate (half_way => [(i, i = before + 1, vertices%count)])
      if (parallel) then
        if (cross_straight(box, ids, half_way, k, vertices)) then
          call link_through(box, ids, half_way, k, vertices)
          return
        end if
      end if
      is_final = small
      if (is_final) return
      half = box
      half(1)%high(k) = start(k)
      half(2)%low(k) = start(k)
      do i = 1, 2
        call connect_cell(plane, half(i), [ids, half_way], vertices, error)
        if (allocated(error)) return
      end do
    end associate
  end subroutine divide

end module gestell_task_boundary_map_cells
