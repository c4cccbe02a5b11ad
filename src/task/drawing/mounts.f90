!> Draws the frame's outline, and its mounts with spring, damper and ground.
module gestell_task_drawing_mounts
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: newline
  use gestell_math_sorting, only: ascending
  use gestell_model_mounting, only: support_type
  use gestell_task_drawing_elements, only: pair
  implicit none (type, external)
  private

  public :: append, clear, draw_mount, outline

  !> Number of corners of the polygon that replaces a circle around each point of the frame
  integer, parameter :: corners = 16
  !> A spring is drawn bold if its stiffness exceeds that of the other spring of the support by this factor
  real(dp), parameter :: much_stiffer = 1.5_dp
  !> Part of the symbol of a damper: the piston with its rod. Coordinates along the mount and across it, as fractions of its length
  real(dp), parameter :: rod(2, 4) = reshape([0.15_dp, 0.0_dp, 0.5_dp, 0.0_dp, 0.5_dp, 0.06_dp, 0.5_dp, -0.06_dp], [2, 4])
  !> Part of the symbol of a damper: the cylinder with its connection to the ground. Coordinates along the mount and across it, as
  !> fractions of its length
  real(dp), parameter :: cup(2, 6) = reshape([0.35_dp, 0.09_dp, 0.65_dp, 0.09_dp, 0.65_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.65_dp, &
    & 0.0_dp, 0.65_dp, -0.09_dp], [2, 6])
  !> Index for the implied do loop in the constant `hatch`
  integer :: i
  !> Symbol of the ground: one continuous line with oblique strokes on its far side. Coordinates as for the damper
  real(dp), parameter :: hatch(2, 17) = reshape([(1.0_dp, -0.28_dp + 0.14_dp * i, 1.1_dp, -0.36_dp + 0.14_dp * i, 1.0_dp, &
    & -0.28_dp + 0.14_dp * i, i = 0, 4), 1.0_dp, 0.28_dp, 1.0_dp, 0.28_dp], [2, 17])

  !> A drawing that consists of lines. `points`: points of all lines, one line after the other, shape (2, points). `share`: share of
  !> the frame's motion that each point follows: 1 on the frame, 0 on the ground, between these on springs. `ends`: for each line,
  !> the number of its last point
  type, public :: drawing_type
    real(dp), allocatable :: points(:, :), share(:)
    integer, allocatable :: ends(:)
  contains
    procedure :: data_lines
  end type drawing_type

contains

  !> Outline of a frame, at a `distance` from each of the `points`, shape (2, points). It is the convex hull of circles around the
  !> points, with its corners in counter-clockwise order.
  function outline(points, distance) result(hull)
    real(dp), intent(in) :: points(:, :), distance
    real(dp), allocatable :: hull(:, :)
    real(dp) :: all(2, corners * size(points, 2)), chain(2, corners * size(points, 2) + 1), turn
    integer :: order(corners * size(points, 2)), i, k, n, start

    do i = 1, size(points, 2)
      do k = 1, corners
        turn = 2 * pi * (k - 0.5_dp) / corners
        all(:, corners * (i - 1) + k) = points(:, i) + distance * [cos(turn), sin(turn)]
      end do
    end do
    ! sort the points by x, and points with equal x by y
    order = ascending(all(2, :))
    order = order(ascending(all(1, order)))
    ! Andrew's monotone chain algorithm: lower part of the hull from left to right, then upper part from right to left
    n = 0
    do i = 1, size(order)
      call add(all(:, order(i)), 1)
    end do
    start = n
    do i = size(order) - 1, 1, -1
      call add(all(:, order(i)), start)
    end do
    hull = chain(:, :n - 1)
  contains
    !> Appends a corner to the hull. Removes the previous corners at which the hull is no longer convex.
    subroutine add(point, first)
      real(dp), intent(in) :: point(2)
      integer, intent(in) :: first

      do while (n > first)
        associate (a => chain(:, n) - chain(:, n - 1), b => point - chain(:, n))
          if (a(1) * b(2) - a(2) * b(1) > 0) exit
        end associate
        n = n - 1
      end do
      n = n + 1
      chain(:, n) = point
    end subroutine add
  end function outline

  !> Draws spring, damper and ground along both axes of a support. The symbols point away from the centre of the picture. A spring
  !> that is much stiffer than the other one is added to `stiff`.
  subroutine draw_mount(drawing, stiff, support, middle, length)
    !> `drawing`: lines of ordinary springs, of dampers and of the ground. `stiff`: lines of stiff springs, which are drawn bold
    type(drawing_type), intent(inout) :: drawing, stiff
    type(support_type), intent(in) :: support
    !> `middle`: centre of the picture (m). `length`: length of the symbol of a mount (m)
    real(dp), intent(in) :: middle(2), length
    real(dp) :: along(2), across(2), aside, offset, start
    logical :: spring, damper
    integer :: axis, main

    do axis = 1, 2
      along = support%axes(:2, axis)
      main = maxloc(abs(along), dim=1)
      offset = support%position(main) - middle(main)
      if (abs(offset) > 0.01_dp * length) then
        along = along * sign(1.0_dp, offset * along(main))
      else if (along(2) > 0.5_dp) then
        along = -along
      end if
      across = [-along(2), along(1)]
      spring = support%stiffness(axis) > 0
      damper = support%damping(axis) > 0
      if (.not. (spring .or. damper)) cycle
      aside = merge(0.13_dp, 0.0_dp, spring .and. damper)
      start = merge(0.15_dp, 0.0_dp, damper)
      if (support%stiffness(axis) > much_stiffer * support%stiffness(3 - axis)) then
        call add_shape(stiff, zigzag(start), aside, start, 1.0_dp)
      else if (spring) then
        call add_shape(drawing, zigzag(start), aside, start, 1.0_dp)
      end if
      ! The damper is stretched as a whole, so that its parts stay together when the frame moves across it.
      if (damper) call add_shape(drawing, rod, -aside, start, 1.0_dp)
      if (damper) call add_shape(drawing, cup, -aside, start, 1.0_dp)
      if (spring .and. damper) then
        call add_shape(drawing, reshape([0.15_dp, -aside, 0.15_dp, aside], [2, 2]), 0.0_dp, 1.0_dp, 1.0_dp)
        call add_shape(drawing, reshape([0.0_dp, 0.0_dp, 0.15_dp, 0.0_dp], [2, 2]), 0.0_dp, 1.0_dp, 1.0_dp)
      end if
      call add_shape(drawing, hatch, 0.0_dp, 0.0_dp, 0.0_dp)
    end do
  contains
    !> Adds a line to a drawing. Its coordinates along the mount and across it are fractions of the mount's length. `moved`:
    !> sideways displacement of the line. `first`, `last`: coordinates along the mount up to which the line moves like the frame,
    !> and from which it is at rest.
    subroutine add_shape(lines, shape, moved, first, last)
      type(drawing_type), intent(inout) :: lines
      real(dp), intent(in) :: shape(:, :), moved, first, last
      real(dp) :: points(2, size(shape, 2)), share(size(shape, 2))
      integer :: i

      do i = 1, size(shape, 2)
        points(:, i) = support%position(:2) + length * (shape(1, i) * along + (shape(2, i) + moved) * across)
      end do
      share = merge(1.0_dp, 0.0_dp, shape(1, :) < last)
      if (last > first) share = min(1.0_dp, (last - shape(1, :)) / (last - first))
      call append(lines, points, share)
    end subroutine add_shape
  end subroutine draw_mount

  !> Symbol of a spring: a zigzag line that begins at `start`. Coordinates are fractions of the mount's length.
  pure function zigzag(start) result(shape)
    real(dp), intent(in) :: start
    real(dp) :: shape(2, 10)
    integer :: i

    shape = reshape([start, 0.0_dp, 0.2_dp, 0.0_dp, (0.2_dp + 0.1_dp * (i - 2.5_dp), 0.1_dp * (-1)**i, i = 3, 8), 0.8_dp, &
      & 0.0_dp, 1.0_dp, 0.0_dp], [2, 10])
  end function zigzag

  !> Makes a drawing empty.
  pure subroutine clear(drawing)
    type(drawing_type), intent(out) :: drawing

    allocate(drawing%points(2, 0), drawing%share(0), drawing%ends(0))
  end subroutine clear

  !> Appends a line to a drawing. Without `share` all its points move like the frame.
  pure subroutine append(drawing, points, share)
    type(drawing_type), intent(inout) :: drawing
    real(dp), intent(in) :: points(:, :)
    real(dp), intent(in), optional :: share(:)
    integer :: i

    if (.not. allocated(drawing%points)) call clear(drawing)
    drawing%points = reshape([drawing%points, points], [2, size(drawing%points, 2) + size(points, 2)])
    if (present(share)) drawing%share = [drawing%share, share]
    if (.not. present(share)) drawing%share = [drawing%share, (1.0_dp, i = 1, size(points, 2))]
    drawing%ends = [drawing%ends, size(drawing%points, 2)]
  end subroutine append

  !> The lines of the drawing as inline data for gnuplot. A blank line follows each line of the drawing.
  pure function data_lines(self) result(lines)
    class(drawing_type), intent(in) :: self
    character(len=:), allocatable :: lines
    integer :: i

    lines = ""
    do i = 1, size(self%points, 2)
      lines = lines // pair(self%points(:, i)) // newline
      if (any(self%ends == i)) lines = lines // newline
    end do
  end function data_lines

end module gestell_task_drawing_mounts
