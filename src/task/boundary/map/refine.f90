!> Refines curves until they follow a border within a tolerance.
module gestell_task_boundary_map_refine
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_task_boundary_line, only: line_type
  use gestell_task_boundary_line_search_result, only: search_type
  use gestell_task_boundary_line_search, only: short_nodes
  use gestell_task_boundary_map_vertex, only: plane_type, traces_type, vertex_of, vertex_type, vertices_type
  use gestell_task_common_executor, only: distribute_over
  implicit none (type, external)
  private

  public :: refine_stretches

  !> Parallel work: each piece refines the connection between two vertices of a curve.
  type, extends(traces_type) :: stretches_type
    class(plane_type), pointer :: plane => null()
    type(vertex_type), allocatable :: ends(:, :)
  contains
    procedure :: compute
  end type stretches_type

contains

  !> Computes the vertices to be inserted between each vertex and the next one on its curve. Fails if the parameters are invalid.
  subroutine refine_stretches(plane, vertices, between, error)
    class(plane_type), intent(in), target :: plane
    type(vertices_type), intent(in) :: vertices
    type(vertices_type), allocatable, intent(out) :: between(:)
    type(error_type), allocatable, intent(out) :: error
    type(stretches_type) :: work
    integer, allocatable :: first(:)
    integer :: i

    allocate(between(vertices%count))
    if (vertices%count == 0) return
    first = pack([(i, i = 1, vertices%count)], vertices%list(:vertices%count)%next > 0)
    work%plane => plane
    allocate(work%ends(2, size(first)), work%found(size(first)))
    do i = 1, size(first)
      work%ends(:, i) = vertices%list([first(i), vertices%list(first(i))%next])
    end do
    call distribute_over(work, size(first), error, plane%executor)
    if (allocated(error)) return
    do i = 1, size(first)
      between(first(i)) = work%found(i)
    end do
  end subroutine refine_stretches

  recursive subroutine compute(self, k, error)
    class(stretches_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most_divisions = 12

    call refine(self%plane, self%ends(1, k), self%ends(2, k), most_divisions, self%found(k), error)
  end subroutine compute

  !> Adds to `curve` the vertices needed between `p` and its successor `q`. At 1/2, 1/4 and 3/4 of the straight connection, the
  !> distance between the border and this connection must not exceed the allowed deviation. If `p` and `q` belong to different kinds
  !> of border, the connection is divided until the corner between them is located with the precision of the search lines. A
  !> connection on which no border is found is counted as rough. Fails if the parameters are invalid.
  recursive subroutine refine(plane, p, q, divisions, curve, error)
    class(plane_type), intent(in) :: plane
    type(vertex_type), intent(in) :: p, q
    integer, intent(in) :: divisions
    type(vertices_type), intent(inout) :: curve
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: parts(3) = [0.5_dp, 0.25_dp, 0.75_dp]
    type(vertex_type) :: middle
    logical :: found, near
    integer :: k

    if (divisions == 0) return
    if (norm2(q%u - p%u) <= merge(plane%precision(), plane%tolerance, p%kind == q%kind)) return
    do k = 1, size(parts)
      call find_border_across(plane, p, q, parts(k), p%kind == q%kind, middle, found, near, error)
      if (allocated(error)) return
      if (.not. near) exit
    end do
    if (near) return
    if (.not. found) then
      curve%rough = curve%rough + 1
      return
    end if
    call refine(plane, p, middle, divisions - 1, curve, error)
    if (allocated(error)) return
    call curve%add(middle)
    call refine(plane, middle, q, divisions - 1, curve, error)
  end subroutine refine

  !> Finds the border on a line perpendicular to the connection from `p` to `q`, at the fraction `part` of its length. The line
  !> extends to both sides, because the border of a narrow tongue may lie on either side of the connection. Of several borders,
  !> the nearest one with the region on the left is selected. `near`: true if `near_suffices` is true and the border, or the edge
  !> of the ranges, is not farther away than the allowed deviation.
  subroutine find_border_across(plane, p, q, part, near_suffices, vertex, found, near, error)
    class(plane_type), intent(in) :: plane
    type(vertex_type), intent(in) :: p, q
    real(dp), intent(in) :: part
    logical, intent(in) :: near_suffices
    type(vertex_type), intent(out) :: vertex
    logical, intent(out) :: found, near
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: growth = 4
    real(dp) :: middle(2), left(2), outward(2), distance, edge, farthest
    logical :: inside, inside_beyond, missing

    found = .false.
    near = .false.
    middle = p%u + part * (q%u - p%u)
    left = [p%u(2) - q%u(2), q%u(1) - p%u(1)] / norm2(q%u - p%u)
    call plane%probe(middle, inside, missing, error)
    if (allocated(error) .or. missing) return
    ! If the region is wide, it is sufficient to search on one side of the connection.
    outward = merge(-left, left, inside)
    edge = distance_to_edge(middle, outward)
    near = near_suffices .and. edge <= plane%tolerance
    if (near) return
    call plane%probe(middle + min(plane%tolerance, edge) * outward, inside_beyond, missing, error)
    if (allocated(error) .or. missing) return
    near = near_suffices .and. (inside_beyond .neqv. inside)
    if (near) return
    distance = plane%tolerance
    farthest = 2 * norm2(q%u - p%u)
    do
      call nearest_crossing(plane, middle, left, distance, vertex, found, error)
      near = near_suffices .and. found .and. distance <= plane%tolerance
      if (allocated(error) .or. found .or. distance >= farthest) return
      distance = min(growth * distance, farthest)
    end do
  end subroutine find_border_across

  !> Finds the border nearest to `middle` on the line in the direction `left`, up to `distance` on both sides. Considers only
  !> borders at which a point that moves in the direction `left` enters the region whose border is sought.
  subroutine nearest_crossing(plane, middle, left, distance, vertex, found, error)
    class(plane_type), intent(in) :: plane
    real(dp), intent(in) :: middle(2), left(2), distance
    type(vertex_type), intent(out) :: vertex
    logical, intent(out) :: found
    type(error_type), allocatable, intent(out) :: error
    type(line_type) :: line
    type(search_type) :: search
    real(dp) :: back, ahead
    integer :: i

    back = min(distance, distance_to_edge(middle, -left))
    ahead = min(distance, distance_to_edge(middle, left))
    call plane%line(middle - back * left, (back + ahead) * left, line)
    call plane%search(line, short_nodes, search, error)
    found = .false.
    if (allocated(error)) return
    associate (list => search%borders)
      i = minloc(abs(list%t - back / (back + ahead)), dim=1, mask=list%enters)
      found = i > 0
      if (found) vertex = vertex_of(line, list(i))
    end associate
  end subroutine nearest_crossing

  !> Distance from the point `u` to the edge of the ranges in the direction `direction`.
  pure real(dp) function distance_to_edge(u, direction) result(distance)
    real(dp), intent(in) :: u(2), direction(2)

    distance = max(0.0_dp, minval(merge(1 - u, u, direction > 0) / max(abs(direction), tiny(1.0_dp)), mask=abs(direction) > 0))
  end function distance_to_edge

end module gestell_task_boundary_map_refine
