!> Shortens the coordinates of lines in SVG: rounds them to a tenth of a pixel, and removes points that lie on the line between
!> their neighbours.
module gestell_output_page_path
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  implicit none (type, external)
  private

  public :: short_path, short_points

  !> Largest distance between a removed point and the line (tenths of a pixel)
  real(dp), parameter :: tolerance = 1
  !> Number of steps of a line that are considered together; it limits the depth of the recursion.
  integer, parameter :: piece = 1000
  !> Largest coordinate that is rounded (pixels)
  real(dp), parameter :: farthest = 1.0e6_dp

contains

  !> Shorter path data that draw the same lines. Data with commands other than M, L and Z are returned unchanged.
  pure function short_path(data) result(path)
    character(len=*), intent(in) :: data
    character(len=:), allocatable :: path
    type(growing_text_type) :: pieces
    integer, allocatable :: points(:, :)
    integer :: first, last

    path = data
    if (verify(data, "MLZz0123456789.,+- " // achar(9) // achar(10)) > 0) return
    first = index(data, "M")
    do while (first > 0)
      last = index(data(first + 1:), "M")
      last = merge(first + last - 1, len(data), last > 0)
      call read_points(data(first:last), points)
      if (size(points, 2) == 0) return
      call pieces%append(relative_path(kept(points)))
      if (scan(data(first:last), "Zz") > 0) call pieces%append("z")
      first = merge(last + 1, 0, last < len(data))
    end do
    path = pieces%whole()
  end function short_path

  !> Shorter list of the corners of a polygon.
  pure function short_points(data) result(list)
    character(len=*), intent(in) :: data
    character(len=:), allocatable :: list
    type(growing_text_type) :: pieces
    integer, allocatable :: points(:, :), corners(:, :)
    integer :: i

    list = data
    call read_points(data, points)
    if (size(points, 2) == 0) return
    corners = kept(points)
    do i = 1, size(corners, 2)
      if (i > 1) call pieces%append(" ")
      call pieces%append(tenths(corners(1, i)) // "," // tenths(corners(2, i)))
    end do
    list = pieces%whole()
  end function short_points

  !> Reads all coordinates of a text, in tenths of a pixel, shape (2, points). There are no points if a coordinate is not a number
  !> or too large.
  pure subroutine read_points(data, points)
    character(len=*), intent(in) :: data
    integer, allocatable, intent(out) :: points(:, :)
    character(len=*), parameter :: digits = "0123456789.+-"
    integer, allocatable :: values(:)
    real(dp) :: value
    integer :: first, last, n, status

    allocate(values(len(data)))
    n = 0
    last = 0
    do
      first = scan(data(last + 1:), digits)
      if (first == 0) exit
      first = last + first
      last = verify(data(first:), digits)
      last = merge(first + last - 2, len(data), last > 0)
      read (data(first:last), *, iostat=status) value
      if (status /= 0) exit
      if (.not. abs(value) <= farthest) exit
      n = n + 1
      values(n) = nint(10 * value)
    end do
    if (first > 0 .or. modulo(n, 2) == 1) n = 0
    points = reshape(values(:n), [2, n / 2])
  end subroutine read_points

  !> Points of a line without those that are nearer than the tolerance to the line through the remaining points.
  pure function kept(points) result(rest)
    integer, intent(in) :: points(:, :)
    integer, allocatable :: rest(:, :)
    logical :: needed(size(points, 2))
    integer :: i

    needed = .false.
    needed(1) = .true.
    do i = 1, size(needed) - 1, piece
      needed(min(i + piece, size(needed))) = .true.
      call mark_needed(points, i, min(i + piece, size(needed)), needed)
    end do
    rest = points(:, pack([(i, i = 1, size(needed))], needed))
  end function kept

  !> Marks the points between `first` and `last` that the line needs (Douglas and Peucker, doi:10.3138/FM57-6770-U75U-7727).
  pure recursive subroutine mark_needed(points, first, last, needed)
    integer, intent(in) :: points(:, :), first, last
    logical, intent(inout) :: needed(:)
    real(dp) :: chord(2), offset(2), length, distance, largest
    integer :: i, farthest_point

    chord = points(:, last) - points(:, first)
    length = norm2(chord)
    largest = 0
    farthest_point = 0
    do i = first + 1, last - 1
      offset = points(:, i) - points(:, first)
      distance = norm2(offset)
      ! The nearest point of the segment is its start, its end, or the foot of the perpendicular.
      if (length > 0 .and. dot_product(offset, chord) > 0) distance = abs(offset(1) * chord(2) - offset(2) * chord(1)) / length
      if (dot_product(offset, chord) > length**2) distance = norm2(offset - chord)
      if (distance > largest) then
        largest = distance
        farthest_point = i
      end if
    end do
    if (largest <= tolerance) return
    needed(farthest_point) = .true.
    call mark_needed(points, first, farthest_point, needed)
    call mark_needed(points, farthest_point, last, needed)
  end subroutine mark_needed

  !> Path data of a line with coordinates relative to the previous point.
  pure function relative_path(points) result(path)
    integer, intent(in) :: points(:, :)
    character(len=:), allocatable :: path
    type(growing_text_type) :: pieces
    integer :: i, step(2)

    call pieces%append("M" // pair(points(:, 1)))
    do i = 2, size(points, 2)
      step = points(:, i) - points(:, i - 1)
      if (step(2) == 0) then
        call pieces%append("h" // tenths(step(1)))
      else if (step(1) == 0) then
        call pieces%append("v" // tenths(step(2)))
      else
        call pieces%append("l" // pair(step))
      end if
    end do
    path = pieces%whole()
  end function relative_path

  !> Two coordinates; a minus sign separates them if there is one.
  pure function pair(point) result(words)
    integer, intent(in) :: point(2)
    character(len=:), allocatable :: words

    words = tenths(point(1)) // trim(merge("  ", ", ", point(2) < 0)) // tenths(point(2))
  end function pair

  !> A number of tenths as a decimal number: 12 becomes 1.2, and -5 becomes -.5.
  pure function tenths(number) result(words)
    integer, intent(in) :: number
    character(len=:), allocatable :: words

    words = text(abs(number) / 10)
    if (modulo(number, 10) /= 0) then
      if (words == "0") words = ""
      words = words // "." // text(modulo(abs(number), 10))
    end if
    if (number < 0) words = "-" // words
  end function tenths

end module gestell_output_page_path
