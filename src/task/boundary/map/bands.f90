!> Connects borders that cross a rectangle side by side, as the borders of many tongues do.
module gestell_task_boundary_map_bands
  use gestell_base_kinds, only: dp
  use gestell_math_sorting, only: ascending
  use gestell_task_boundary_map_vertex, only: vertices_type
  implicit none (type, external)
  private

  public :: link_through, opposite_sides, cross_straight

  !> A rectangle in the plane of two parameters. Its coordinates u lie in low(1) <= u(1) <= high(1) and low(2) <= u(2) <= high(2).
  type, public :: box_type
    real(dp) :: low(2) = 0, high(2) = 1
  end type box_type

contains

  !> Finds two opposite sides of the box of which each contains half of the vertices `ids`. Returns the number of the coordinate
  !> that is constant on these sides, or 0 if there are no such sides.
  pure integer function opposite_sides(box, ids, vertices) result(k)
    type(box_type), intent(in) :: box
    integer, intent(in) :: ids(:)
    type(vertices_type), intent(in) :: vertices

    do k = 2, 1, -1
      if (2 * size(along(box%low(k), k, ids, vertices)) == size(ids) .and. &
        & 2 * size(along(box%high(k), k, ids, vertices)) == size(ids)) return
    end do
  end function opposite_sides

  !> Indices of those vertices among `ids` whose coordinate number `k` equals `value`, in ascending order of the other coordinate.
  pure function along(value, k, ids, vertices) result(found)
    real(dp), intent(in) :: value
    integer, intent(in) :: k, ids(:)
    type(vertices_type), intent(in) :: vertices
    integer, allocatable :: found(:)

    found = pack(ids, abs(vertices%list(ids)%u(k) - value) <= 0)
    found = found(ascending((vertices%list(found)%u(3 - k))))
  end function along

  !> Indices of corresponding vertices, shape (number of borders, 3): on the lower side of the box, on the line midway between the
  !> sides, and on the upper side, each in ascending order. If the vertices do not correspond, the result has no rows.
  pure function rows(box, ids, half_way, k, vertices)
    type(box_type), intent(in) :: box
    integer, intent(in) :: ids(:), half_way(:), k
    type(vertices_type), intent(in) :: vertices
    integer, allocatable :: rows(:, :), low(:), half(:), high(:)
    integer :: i, n

    low = along(box%low(k), k, ids, vertices)
    half = along((box%low(k) + box%high(k)) / 2, k, half_way, vertices)
    high = along(box%high(k), k, ids, vertices)
    n = merge(size(low), 0, size(half) == size(low) .and. size(half) == size(high))
    rows = reshape([low, half, high], [n, 3])
    do i = 1, size(rows, 1)
      associate (sides => vertices%list(rows(i, :))%inward(3 - k))
        if (.not. (all(sides > 0) .or. all(sides < 0))) n = 0
      end associate
    end do
    rows = rows(:n, :)
  end function rows

  !> True if all borders cross the box straight from one of two opposite sides to the other. Each border has one vertex on each of
  !> these sides and one on the line midway between them. This middle vertex must lie near the mean of the two others, at a
  !> distance much smaller than that to the neighbouring borders. Two borders close together (of a tongue or a gap) are
  !> represented by their centre line.
  pure logical function cross_straight(box, ids, half_way, k, vertices)
    type(box_type), intent(in) :: box
    !> `ids`: indices of the vertices on the two opposite sides. `half_way`: indices of the vertices on the line midway between the
    !> sides. `k`: number of the coordinate that is constant on these lines
    integer, intent(in) :: ids(:), half_way(:), k
    type(vertices_type), intent(in) :: vertices
    real(dp), parameter :: near = 0.25_dp
    integer, allocatable :: at(:, :)
    real(dp), allocatable :: first(:, :), last(:, :), position(:, :), gap(:, :)
    integer :: i, n, units

    at = rows(box, ids, half_way, k, vertices)
    n = size(at, 1)
    cross_straight = n > 0
    if (n == 0) return
    position = reshape((vertices%list([at])%u(3 - k)), [n, 3])
    ! Gaps before the first border, between borders and behind the last one. Beyond the box nothing is known, so the outer gaps are
    ! set to the width of the box.
    allocate(gap(0:n, 3), source=box%high(3 - k) - box%low(3 - k))
    gap(1:n - 1, :) = position(2:, :) - position(:n - 1, :)
    allocate(first(n, 3), last(n, 3))
    units = 0
    i = 1
    do while (i <= n)
      units = units + 1
      first(units, :) = position(i, :)
      if (i < n) then
        if (maxval(gap(i, :)) < near * min(minval(gap(i - 1, :)), minval(gap(i + 1, :)))) i = i + 1
      end if
      last(units, :) = position(i, :)
      i = i + 1
    end do
    associate (center => (first(:units, :) + last(:units, :)) / 2)
      associate (bend => abs(center(:, 2) - (center(:, 1) + center(:, 3)) / 2))
        if (units == 1) cross_straight = bend(1) <= near * gap(0, 1)
        do i = 1, units - 1
          cross_straight = cross_straight .and. bend(i) + bend(i + 1) <= near * minval(first(i + 1, :) - last(i, :))
        end do
      end associate
    end associate
  end function cross_straight

  !> Links the three vertices of each border that crosses the box: one on each of two opposite sides, and one on the line midway
  !> between these sides. The region that the borders enclose lies on the left of the links.
  pure subroutine link_through(box, ids, half_way, k, vertices)
    type(box_type), intent(in) :: box
    !> `ids`: indices of the vertices on the two opposite sides. `half_way`: indices of the vertices on the line midway between the
    !> sides. `k`: number of the coordinate that is constant on these lines
    integer, intent(in) :: ids(:), half_way(:), k
    type(vertices_type), intent(inout) :: vertices
    integer, allocatable :: at(:, :)
    integer :: i

    at = rows(box, ids, half_way, k, vertices)
    do i = 1, size(at, 1)
      ! On the left of a border that leads upward, the region has smaller values of the first coordinate. On the left of a border
      ! that leads to the right, it has larger values of the second coordinate.
      if ((vertices%list(at(i, 2))%inward(3 - k) > 0) .eqv. k == 2) at(i, :) = at(i, 3:1:-1)
      vertices%list(at(i, 1))%next = at(i, 2)
      vertices%list(at(i, 2))%next = at(i, 3)
    end do
  end subroutine link_through

end module gestell_task_boundary_map_bands
