!> Boxes that fill the part of a picture on the left of directed curves.
module test_regions
  use checks, only: check_that
  use gestell_base_kinds, only: dp, pi
  use gestell_output_picture_regions, only: left_side
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_regions

  !> Rows, and columns, of boxes in the unit square.
  integer, parameter :: rows = 160
  !> Points of each circle; between them it deviates by less than 3e-5.
  integer, parameter :: corners = 300

contains

  subroutine collect_regions(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("boxes cover the left side of circles and lines, and nothing else", test_sides)]
  end subroutine collect_regions

  subroutine test_sides(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: disc(2, corners + 1), hole(2, corners + 1), line(2, 2)
    integer :: k

    disc = circle([0.55_dp, 0.45_dp], 0.37_dp, 1)
    hole = circle([0.6_dp, 0.4_dp], 0.15_dp, -1)
    line = reshape([-0.1_dp, 0.3_dp, 1.1_dp, 0.6_dp], [2, 2])
    call check_boxes("disc", disc, [(1, k = 1, size(disc, 2))], in_disc, error)
    if (allocated(error)) return
    call check_boxes("disc with a hole", reshape([disc, hole], [2, 2 * corners + 2]), [(1, k = 1, corners + 1), (2, k = 1, &
      & corners + 1)], in_ring, error)
    if (allocated(error)) return
    call check_boxes("outside of a hole", hole, [(1, k = 1, size(hole, 2))], beside_hole, error)
    if (allocated(error)) return
    call check_boxes("above a line", line, [1, 1], above, error)
    if (allocated(error)) return
    call check_boxes("below a line", line(:, 2:1:-1), [1, 1], below, error)
    if (allocated(error)) return
    call check_boxes("left of a steep line", line([2, 1], :), [1, 1], before, error)
  end subroutine test_sides

  !> Every point farther from the curves than a box is wide is covered exactly if it is on the left and its row or column meets a
  !> curve. `depth`: distance of a point from the curves, positive on the left.
  subroutine check_boxes(name, points, curve, depth, error)
    character(len=*), intent(in) :: name
    real(dp), intent(in) :: points(:, :)
    integer, intent(in) :: curve(:)
    interface
      pure real(dp) function depth(x, y)
        import :: dp
        implicit none (type, external)
        real(dp), intent(in) :: x, y
      end function depth
    end interface
    type(error_type), allocatable, intent(out) :: error
    !> Places in each direction; two in each row, the outermost ones included.
    integer, parameter :: across = 331
    real(dp), parameter :: width = 1.0_dp / rows
    real(dp), allocatable :: boxes(:, :)
    real(dp) :: x, y, low(2), high(2)
    character(len=60) :: place
    logical, allocatable :: covered(:, :)
    logical :: met
    integer :: i, k

    boxes = left_side(points, curve)
    ! A box is as high as a row, or as wide as a column, and overlaps its neighbours by a tenth.
    call check_that(error, abs(min(boxes(2, :) - boxes(1, :), boxes(4, :) - boxes(3, :)) - 1.1_dp * width) * merge(1, 0, &
      & max(boxes(2, :) - boxes(1, :), boxes(4, :) - boxes(3, :)) > 1.2_dp * width), "<", 1.0e-12_dp, name // ": width of a box")
    low = minval(points, dim=2)
    high = maxval(points, dim=2)
    allocate(covered(across, across), source=.false.)
    do i = 1, size(boxes, 2)
      associate (x => boxes(:2, i) * across + 0.5_dp, y => boxes(3:, i) * across + 0.5_dp)
        covered(max(1, ceiling(x(1))):min(across, floor(x(2))), max(1, ceiling(y(1))):min(across, floor(y(2)))) = .true.
      end associate
    end do
    do i = 1, across
      x = (i - 0.5_dp) / across
      do k = 1, across
        y = (k - 0.5_dp) / across
        if (abs(depth(x, y)) < 1.2_dp * width) cycle
        met = any([x, y] > low + width .and. [x, y] < high - width)
        if ((covered(i, k) .eqv. depth(x, y) > 0) .or. .not. (met .or. depth(x, y) < 0)) cycle
        write (place, "(a, f0.4, a, f0.4)") ": covered at ", x, ", ", y
        call check_that(error, covered(i, k), "==", depth(x, y) > 0, name // trim(place))
        return
      end do
    end do
  end subroutine check_boxes

  !> A circle, counterclockwise in the `direction` 1, clockwise if it is -1. The first point is repeated at the end.
  pure function circle(centre, radius, direction) result(points)
    real(dp), intent(in) :: centre(2), radius
    integer, intent(in) :: direction
    real(dp) :: points(2, corners + 1)
    integer :: k

    do k = 0, corners
      points(:, k + 1) = centre + radius * [cos(2 * pi * k / corners), direction * sin(2 * pi * k / corners)]
    end do
  end function circle

  pure real(dp) function in_disc(x, y)
    real(dp), intent(in) :: x, y

    in_disc = 0.37_dp - hypot(x - 0.55_dp, y - 0.45_dp)
  end function in_disc

  pure real(dp) function beside_hole(x, y)
    real(dp), intent(in) :: x, y

    beside_hole = hypot(x - 0.6_dp, y - 0.4_dp) - 0.15_dp
  end function beside_hole

  pure real(dp) function in_ring(x, y)
    real(dp), intent(in) :: x, y

    in_ring = min(in_disc(x, y), beside_hole(x, y))
  end function in_ring

  !> The line leads from (-0.1, 0.3) to (1.1, 0.6).
  pure real(dp) function above(x, y)
    real(dp), intent(in) :: x, y

    above = (y - 0.325_dp - 0.25_dp * x) / hypot(1.0_dp, 0.25_dp)
  end function above

  pure real(dp) function below(x, y)
    real(dp), intent(in) :: x, y

    below = -above(x, y)
  end function below

  !> The mirrored line leads from (0.3, -0.1) upward to (0.6, 1.1).
  pure real(dp) function before(x, y)
    real(dp), intent(in) :: x, y

    before = -above(y, x)
  end function before

end module test_regions
