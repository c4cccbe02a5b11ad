!> Fills, with rows and columns of boxes, the part of a plane that lies on the left of directed curves.
module gestell_output_picture_regions
  use gestell_base_kinds, only: dp
  use gestell_math_sorting, only: ascending
  implicit none (type, external)
  private

  public :: left_side

  !> Number of rows, and of columns, into which the unit square is divided
  integer, parameter :: rows = 160
  !> Overlap of neighbouring boxes, divided by their width; it prevents visible seams
  real(dp), parameter :: overlap = 0.1_dp

contains

  !> Boxes that cover the area on the left of the curves, seen in the direction of the curves. Shape (4, boxes): minimum x,
  !> maximum x, minimum y and maximum y of each box. A box lies in one row or column and extends from one curve to the next, or to
  !> the edge of the square. A gap remains where neither the row nor the column meets a curve.
  pure function left_side(points, curve) result(boxes)
    !> Points of all curves in the unit square, shape (2, points). The points of a curve are listed in its direction
    real(dp), intent(in) :: points(:, :)
    !> For each point: number of the curve to which it belongs
    integer, intent(in) :: curve(:)
    real(dp), allocatable :: boxes(:, :), spans(:, :)
    real(dp) :: half, at
    integer :: k, i

    half = (1 + overlap) / (2 * rows)
    allocate(boxes(4, 0))
    do k = 1, rows
      at = (k - 0.5_dp) / rows
      call intervals(points(2, :), points(1, :), curve, at, .true., spans)
      boxes = reshape([boxes, [(spans(:, i), at - half, at + half, i = 1, size(spans, 2))]], [4, size(boxes, 2) + size(spans, 2)])
      call intervals(points(1, :), points(2, :), curve, at, .false., spans)
      boxes = reshape([boxes, [(at - half, at + half, spans(:, i), i = 1, size(spans, 2))]], [4, size(boxes, 2) + size(spans, 2)])
    end do
  end function left_side

  !> Returns in `spans`, shape (2, intervals), the parts of the line `across` = `at` that lie inside the area: intervals of the
  !> other coordinate, `along`. If `inside_before` is true, the area lies at smaller `along` wherever `across` increases in the
  !> direction of a curve, and at larger `along` wherever `across` decreases. If `inside_before` is false, the sides are
  !> exchanged.
  pure subroutine intervals(across, along, curve, at, inside_before, spans)
    real(dp), intent(in) :: across(:), along(:), at
    integer, intent(in) :: curve(:)
    logical, intent(in) :: inside_before
    real(dp), allocatable, intent(out) :: spans(:, :)
    real(dp) :: crossings(size(across)), start
    logical :: ends(size(across))
    integer, allocatable :: order(:)
    integer :: i, n

    n = 0
    do i = 1, size(across) - 1
      if (curve(i) /= curve(i + 1) .or. (across(i) <= at .eqv. across(i + 1) <= at)) cycle
      n = n + 1
      crossings(n) = along(i) + (at - across(i)) / (across(i + 1) - across(i)) * (along(i + 1) - along(i))
      ends(n) = (across(i + 1) > across(i)) .eqv. inside_before
    end do
    allocate(spans(2, 0))
    if (n == 0) return
    order = ascending(crossings(:n))
    start = merge(0, -1, ends(order(1)))
    do i = 1, n
      if (ends(order(i)) .and. start >= 0) spans = reshape([spans, start, crossings(order(i))], [2, size(spans, 2) + 1])
      start = merge(-1.0_dp, crossings(order(i)), ends(order(i)))
    end do
    if (start >= 0) spans = reshape([spans, start, 1.0_dp], [2, size(spans, 2) + 1])
  end subroutine intervals

end module gestell_output_picture_regions
