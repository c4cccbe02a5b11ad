!> The side of curves in a plane, as rows and columns of boxes.
module gestell_output_picture_regions
  use gestell_base_kinds, only: dp
  use gestell_math_sorting, only: ascending
  implicit none (type, external)
  private

  public :: left_side

  !> Rows, and columns.
  integer, parameter :: rows = 160
  !> Boxes overlap their neighbours by this part of their width: no seams.
  real(dp), parameter :: overlap = 0.1_dp

contains

  !> Boxes (x from, x to, y from, y to), shape (4, boxes), that cover what lies on the left of curves through `points`, shape
  !> (2, points) in the unit square, those of a `curve` one after the other: on every row and column the intervals that begin and
  !> end where a curve crosses it, or end at the rim. What no row and no column tells stays open.
  pure function left_side(points, curve) result(boxes)
    real(dp), intent(in) :: points(:, :)
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

  !> On the line where the coordinate `across` is `at`, the intervals of the other one, `along`, shape (2, intervals). Where a curve
  !> comes from below, as `across` grows, what is smaller `along` is inside; without `inside_before` what is greater.
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
