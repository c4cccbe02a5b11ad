!> How the borders on the sides of a cell hang together within it.
module gestell_task_boundary_map_cells
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_task_boundary_map_bands, only: box_type, link_through, opposite_sides, pass_straight
  use gestell_task_boundary_line, only: line_type, probe_type
  use gestell_task_boundary_line_found, only: search_type
  use gestell_task_boundary_line_search, only: short_nodes
  use gestell_task_boundary_map_vertex, only: plane_type, vertex_type, vertices_type
  use gestell_task_common_executor, only: spread_over, work_type
  use gestell_task_common_record, only: record_type
  implicit none (type, external)
  private

  public :: connect_cells

  !> A cell of the search grid: the vertices on its sides, by their numbers among all, and these with those that were found in it.
  type :: cell_type
    type(box_type) :: box
    integer, allocatable :: sides(:)
    type(vertices_type) :: vertices
  end type cell_type

  !> A piece is a cell.
  type, extends(work_type) :: cells_type
    class(plane_type), pointer :: plane => null()
    integer :: count = 0
    type(cell_type), allocatable :: cells(:)
  contains
    procedure :: add
    procedure :: compute
    procedure :: exchange
  end type cells_type

contains

  !> Links the vertices on the lines of the search grid, at u1 and u2, from side to side of its cells. `first1`, `first2`: the
  !> number of the first vertex of each line, and one more. Error: the parameters make no sense.
  subroutine connect_cells(plane, u1, u2, first1, first2, vertices, error)
    class(plane_type), intent(in), target :: plane
    real(dp), intent(in) :: u1(:), u2(:)
    integer, intent(in) :: first1(:), first2(:)
    type(vertices_type), intent(inout) :: vertices
    type(error_type), allocatable, intent(out) :: error
    type(cells_type) :: work
    integer :: i, j, k

    work%plane => plane
    allocate(work%cells(size(u1) * size(u2)))
    do i = 1, size(u1) - 1
      do j = 1, size(u2) - 1
        call work%add(box_type([u1(i), u2(j)], [u1(i + 1), u2(j + 1)]), &
          & [(k, k = first1(i), first1(i + 2) - 1), (k, k = first2(j), first2(j + 2) - 1)], vertices)
      end do
    end do
    call spread_over(work, work%count, error, plane%executor)
    if (allocated(error)) return
    do k = 1, work%count
      call take(work%cells(k), vertices)
    end do
  end subroutine connect_cells

  !> Adds a cell, unless none of the vertices `pool` lies on its sides.
  pure subroutine add(self, box, pool, vertices)
    class(cells_type), intent(inout) :: self
    type(box_type), intent(in) :: box
    integer, intent(in) :: pool(:)
    type(vertices_type), intent(in) :: vertices
    integer, allocatable :: sides(:)
    logical, allocatable :: enter(:)

    call around(box, pool, vertices, sides, enter)
    if (size(sides) == 0) return
    self%count = self%count + 1
    associate (cell => self%cells(self%count))
      cell%box = box
      cell%sides = sides
      cell%vertices%count = size(sides)
      cell%vertices%list = vertices%list(sides)
    end associate
  end subroutine add

  recursive subroutine compute(self, k, error)
    class(cells_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    associate (cell => self%cells(k))
      call connect_cell(self%plane, cell%box, [(i, i = 1, size(cell%sides))], cell%vertices, error)
    end associate
  end subroutine compute

  subroutine exchange(self, k, record)
    class(cells_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call self%cells(k)%vertices%exchange(record)
  end subroutine exchange

  !> Adds what was found in a cell to all vertices.
  pure subroutine take(cell, vertices)
    type(cell_type), intent(in) :: cell
    type(vertices_type), intent(inout) :: vertices
    type(vertex_type) :: vertex
    integer, allocatable :: numbers(:)
    integer :: i, n

    n = size(cell%sides)
    numbers = [cell%sides, (vertices%count + i, i = 1, cell%vertices%count - n)]
    do i = 1, size(numbers)
      vertex = cell%vertices%list(i)
      if (vertex%next > 0) vertex%next = numbers(vertex%next)
      if (i > n) call vertices%add(vertex)
      if (vertex%next > 0) vertices%list(numbers(i))%next = vertex%next
    end do
    if (allocated(cell%vertices%open)) vertices%open = [vertices%open, cell%vertices%open]
    vertices%thin = vertices%thin + cell%vertices%thin
    vertices%left_out = vertices%left_out + cell%vertices%left_out
  end subroutine take

  !> Links those of the vertices `pool` that lie on the sides of `box`. In a turn about the box, counter-clockwise, unstable
  !> stretches begin at the vertices that `enter` them and end at those that leave. Two vertices are linked; of four the
  !> system at their mean tells whether the unstable stretches hang together; of four or more on two opposite sides the line half
  !> way between these. Where that is not certain, systems are missing, or a narrow tongue ends in the box, it is halved, down to
  !> the size of the deviation allowed. Error: the parameters make no sense.
  recursive subroutine connect_cell(plane, box, pool, vertices, error)
    class(plane_type), intent(in) :: plane
    type(box_type), intent(in) :: box
    integer, intent(in) :: pool(:)
    type(vertices_type), intent(inout) :: vertices
    type(error_type), allocatable, intent(out) :: error
    !> A box that is so much longer one way than the other is halved that way.
    real(dp), parameter :: flat = 0.125_dp
    integer, allocatable :: ids(:)
    logical, allocatable :: enter(:)
    logical :: regular, joined, certain, parallel
    integer :: n, k

    call around(box, pool, vertices, ids, enter)
    n = size(ids)
    if (n == 0) return
    regular = mod(n, 2) == 0
    if (regular) regular = all(enter .neqv. cshift(enter, 1))
    joined = .false.
    certain = .false.
    parallel = .false.
    associate (size_of => box%high - box%low)
      k = maxloc(size_of, dim=1)
      if (regular .and. n == 2) then
        certain = .not. tip(box, vertices%list(ids(1))%u, vertices%list(ids(2))%u)
        if (.not. certain) k = merge(1, 2, abs(vertices%list(ids(1))%u(1) - vertices%list(ids(2))%u(1)) <= 0)
      else if (regular) then
        associate (sides => opposite_sides(box, ids, vertices))
          if (n == 4) call mean_tells(plane, box, ids, enter, sides > 0, vertices, joined, certain, error)
          if (allocated(error)) return
          if (sides > 0) parallel = size_of(sides) > flat * size_of(3 - sides)
          if (parallel) k = sides
        end associate
      end if
      if (.not. certain) then
        call divide(plane, box, ids, k, parallel, size_of(k) <= plane%deviation, vertices, certain, error)
        if (allocated(error) .or. .not. certain) return
      end if
    end associate
    call link(ids, enter, joined, vertices)
  end subroutine connect_cell

  !> Whether the two lie on one side of the box, close together: a tongue ends in it, nobody knows where.
  pure logical function tip(box, u, v)
    type(box_type), intent(in) :: box
    real(dp), intent(in) :: u(2), v(2)
    real(dp), parameter :: close = 0.5_dp
    integer :: along

    tip = .false.
    do along = 1, 2
      if (abs(u(along) - v(along)) < close * (box%high(along) - box%low(along)) .and. &
        & .not. abs(u(3 - along) - v(3 - along)) > 0) tip = .true.
    end do
  end function tip

  !> Those of `pool` on the sides of the box, counter-clockwise from its lower left corner, and whether the side is unstable
  !> thereafter.
  pure subroutine around(box, pool, vertices, ids, enter)
    type(box_type), intent(in) :: box
    integer, intent(in) :: pool(:)
    type(vertices_type), intent(in) :: vertices
    integer, allocatable, intent(out) :: ids(:)
    logical, allocatable, intent(out) :: enter(:)
    real(dp) :: positions(size(pool)), position, tangent(2)
    integer :: order(size(pool)), n, i, k
    logical :: entering(size(pool))

    n = 0
    do i = 1, size(pool)
      associate (v => vertices%list(pool(i)))
        call position_around(box, v%u, position, tangent)
        if (position < 0) cycle
        k = n + 1
        do while (k > 1)
          if (positions(k - 1) <= position) exit
          positions(k) = positions(k - 1)
          order(k) = order(k - 1)
          entering(k) = entering(k - 1)
          k = k - 1
        end do
        positions(k) = position
        order(k) = pool(i)
        entering(k) = dot_product(v%unstable_side, tangent) > 0
        n = n + 1
      end associate
    end do
    ids = order(:n)
    enter = entering(:n)
  end subroutine around

  !> Where `u` lies on the way around the box, 0 to 4, -1 if it is not on a side; and the direction of that way there.
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

  !> Whether the unstable stretches of four hang together. The system at their mean tells, if it agrees with their distances:
  !> near ones are the sides of a tongue, unstable or stable. If not, the tongue may pass beside the mean, or end: a line
  !> through the mean, across it, is searched for its sides, between which it lies.
  subroutine mean_tells(plane, box, ids, enter, opposite, vertices, joined, certain, error)
    class(plane_type), intent(in) :: plane
    type(box_type), intent(in) :: box
    integer, intent(in) :: ids(:)
    logical, intent(in) :: enter(:), opposite
    type(vertices_type), intent(in) :: vertices
    logical, intent(out) :: joined, certain
    type(error_type), allocatable, intent(out) :: error
    type(line_type) :: line
    type(probe_type) :: probe
    type(search_type) :: search
    real(dp) :: mean(2), across(2), lengths(2), chord(2)
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
    call plane%line(mean, [1.0_dp, 0.0_dp], line)
    call plane%probe(line, 0.0_dp, probe, error)
    certain = .not. probe%missing() .and. (probe%is_unstable() .eqv. joined)
    if (allocated(error) .or. certain .or. opposite) return

    ! Where the ways between near vertices begin differs by one.
    i = merge(1, 2, enter(1) .eqv. joined)
    k = modulo(i, size(ids)) + 1
    across = vertices%list(ids(k))%u - vertices%list(ids(i))%u
    across = across / norm2(across) * maxval(box%high - box%low) / 2
    across = across * min(1.0_dp, within(mean, across))
    if (norm2(across) < plane%precision()) return
    call plane%line(mean - across, 2 * across, line)
    call plane%search(line, short_nodes, search, error)
    if (allocated(error)) return
    associate (sides => search%found%list%unstable_above)
      if (size(sides) == 2) certain = (sides(1) .eqv. joined) .and. (sides(2) .neqv. joined)
    end associate
  end subroutine mean_tells

  !> The greatest factor that keeps center +- factor way within the ranges.
  pure real(dp) function within(center, way) result(factor)
    real(dp), intent(in) :: center(2), way(2)

    factor = minval(min(center, 1 - center) / max(abs(way), tiny(1.0_dp)))
  end function within

  !> Links neighbours: across the stretches that are not unstable if the unstable ones are `joined`, else across these.
  pure subroutine link(ids, enter, joined, vertices)
    integer, intent(in) :: ids(:)
    logical, intent(in) :: enter(:), joined
    type(vertices_type), intent(inout) :: vertices
    integer :: i, k

    do i = 1, size(ids)
      k = modulo(i, size(ids)) + 1
      if (enter(i) .eqv. enter(k)) cycle
      if (joined .and. .not. enter(i)) vertices%list(ids(i))%next = ids(k)
      if (.not. joined .and. enter(i)) vertices%list(ids(k))%next = ids(i)
    end do
  end subroutine link

  !> Links what passes from one side of the box to the opposite one, if it is `parallel` and borders on the line through the
  !> middle, on which coordinate `k` is constant, show that it does; else halves the box by that line and links within the
  !> halves, if it is not too `small` for that: then it is `left` as it is. Error: the parameters make no sense.
  recursive subroutine divide(plane, box, ids, k, parallel, small, vertices, left, error)
    class(plane_type), intent(in) :: plane
    type(box_type), intent(in) :: box
    integer, intent(in) :: ids(:), k
    logical, intent(in) :: parallel, small
    type(vertices_type), intent(inout) :: vertices
    logical, intent(out) :: left
    type(error_type), allocatable, intent(out) :: error
    type(line_type) :: line
    type(search_type) :: search
    type(box_type) :: half(2)
    real(dp) :: start(2), way(2)
    integer :: before, i

    left = small .and. .not. parallel
    if (left) return
    before = vertices%count
    start = box%low
    start(k) = box%middle(k)
    way = box%high - box%low
    way(k) = 0
    call plane%line(start, way, line)
    call plane%search(line, short_nodes, search, error)
    if (allocated(error)) return
    call vertices%add_search(line, search)
    associate (half_way => [(i, i = before + 1, vertices%count)])
      if (parallel) then
        if (pass_straight(box, ids, half_way, k, vertices)) then
          call link_through(box, ids, half_way, k, vertices)
          return
        end if
      end if
      left = small
      if (left) return
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
