!> Composes marks for pictures with a parameter as abscissa: the value of the input, shaded unstable ranges, and grey areas where
!> motions are too large for the linearised equations.
module gestell_output_picture_marks
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_math_sorting, only: ascending
  use gestell_output_picture_axis, only: coordinate, unit_words
  use gestell_output_picture_script, only: quoted
  use gestell_study_grid, only: axis_type
  implicit none (type, external)
  private

  public :: apart, choose_spaced, boxes_where, chart_marks, input_marks, input_point, none_found, shade

  !> Gnuplot options. `unstable_fill`: fill of unstable ranges. `shaded_entry`, `unstable_entry`: legend entries for shaded
  !> ranges. `beyond_colour`: grey for motions that are too large for the linearised equations
  character(len=*), parameter, public :: unstable_fill = "fillcolor rgb '#F9E0C7' fillstyle solid 1 noborder", &
    & shaded_entry = ", keyentry with boxes lc rgb '#F9E0C7' fs solid 1 noborder title ", &
    & unstable_entry = shaded_entry // "'unstable'", &
    & beyond_colour = "999999"
  character(len=*), parameter :: own_line = "lc rgb '#8E24AA' dt (7,4) lw 1.2"
  !> `first_number`: number of the first gnuplot object and of the first arrow that this module uses. `most_shades`: maximum number
  !> of shaded ranges
  integer, parameter :: first_number = 100, most_shades = 200

  !> Gnuplot line that writes "none found" into an empty panel
  character(len=*), parameter :: none_found = "set label 1 'none found' at graph 0.5,graph 0.5 center textcolor rgb '#444444'" &
    & // newline

  !> `lines`: gnuplot lines that are placed before the panels of a picture. `entries`: entries of the legend, appended to the plot
  !> command
  type, public :: marks_type
    character(len=:), allocatable :: lines, entries
  end type marks_type

contains

  !> Marks of a picture with a parameter as abscissa: a line at the value of the input, and shaded areas over the points (values
  !> of the parameter) at which the machine is unstable. A shaded area extends halfway to the neighbouring stable points.
  pure type(marks_type) function chart_marks(range, input, unit, at, unstable) result(marks)
    !> `range`: ends of the x axis. `input`: value of the parameter in the input, or empty. `at`: values of the parameter at the
    !> points, in ascending or descending order
    real(dp), intent(in) :: range(2), input(:), at(:)
    !> Unit of the value in `input`
    character(len=*), intent(in) :: unit
    !> For each point: true if it is unstable
    logical, intent(in) :: unstable(:)
    type(marks_type) :: own
    real(dp) :: ends(2)
    integer :: i, first, n

    marks%lines = ""
    n = 0
    first = 0
    do i = 1, size(at)
      if (unstable(i) .and. first == 0) first = i
      if (first == 0) cycle
      if (i < size(at)) then
        if (unstable(i) .and. unstable(i + 1)) cycle
      end if
      n = n + 1
      ends = [at(first) + at(max(first - 1, 1)), at(i) + at(min(i + 1, size(at)))] / 2
      if (n <= most_shades) marks%lines = marks%lines // shade(n, ends(1), ends(2))
      first = 0
    end do
    own = own_marks(range, input, input, unit, "back")
    marks%lines = marks%lines // own%lines
    marks%entries = either(unstable_entry, "", n > 0) // own%entries
  end function chart_marks

  !> Mark at the `value` of the input on the axis of a parameter, in front of shaded boxes. No mark if `value` is empty.
  pure type(marks_type) function input_marks(axis, value, unit) result(marks)
    type(axis_type), intent(in) :: axis
    real(dp), intent(in) :: value(:)
    character(len=*), intent(in) :: unit

    marks = own_marks(coordinate(axis, [axis%from, axis%to]), value, coordinate(axis, value), unit, "front")
  end function input_marks

  !> Marks with a vertical line at the value of the input. They are empty if this value lies outside the range.
  pure type(marks_type) function own_marks(range, value, position, unit, layer) result(marks)
    real(dp), intent(in) :: range(2), value(:), position(:)
    character(len=*), intent(in) :: unit, layer

    marks%lines = ""
    marks%entries = ""
    if (size(position) /= 1) return
    if (.not. within(position(1), range)) return
    marks%lines = "set arrow " // text(first_number) // " from first " // concise(position(1), 9) // ",graph 0 to first " &
      & // concise(position(1), 9) // ",graph 1 nohead " // layer // " " // own_line // newline
    marks%entries = ", keyentry with lines " // own_line // " title " &
      & // quoted(trim("input: " // concise(value(1), 6) // " " // unit_words(unit))) // " noenhanced"
  end function own_marks

  !> True if the value lies between the ends of the range.
  pure logical function within(value, range)
    real(dp), intent(in) :: value, range(2)

    within = (value - range(1)) * (value - range(2)) <= 0
  end function within

  !> Gnuplot line that shades an interval of the x axis as unstable.
  pure function shade(number, from, to) result(line)
    integer, intent(in) :: number
    real(dp), intent(in) :: from, to
    character(len=:), allocatable :: line

    line = "set object " // text(first_number + number) // " rectangle from first " // concise(from, 9) // ",graph 0 to first " &
      & // concise(to, 9) // ",graph 1 behind " // unstable_fill // newline
  end function shade

  !> Part of a gnuplot plot command that draws a shaded box for each row of a file for which `condition` is true. All arguments
  !> except `file` are gnuplot expressions.
  pure function boxes_where(file, condition, x, half, low, high) result(words)
    !> `x`, `half`: centre and half width of a box. `low`, `high`: y coordinates of the box's lower and upper end
    character(len=*), intent(in) :: file, condition, x, half, low, high
    character(len=:), allocatable :: words, at

    at = "(" // condition // " ? " // x // " : 1e290)"
    words = ", '" // file // "' using " // at // ":(" // low // "):(" // at // " - " // half &
      & // "):(" // at // " + " // half // "):(" // low // "):(" // high // ") with boxxyerror " // unstable_fill // " notitle"
  end function boxes_where

  !> Gnuplot lines that mark the machine of the input in a plane of two parameters. `values`: the parameters of this machine. The
  !> lines are empty if a parameter lies outside the range of its axis.
  pure function input_point(axes, values) result(line)
    type(axis_type), intent(in) :: axes(2)
    real(dp), intent(in) :: values(2)
    character(len=:), allocatable :: line, at
    real(dp) :: position(2)

    line = ""
    position = coordinate(axes, values)
    if (.not. (within(values(1), [axes(1)%from, axes(1)%to]) .and. within(values(2), [axes(2)%from, axes(2)%to]))) return
    at = concise(position(1), 9) // "," // concise(position(2), 9)
    line = "set style textbox opaque noborder margins 0.3,0.3" // newline &
      & // "set object " // text(first_number) // " circle at " // at // " size graph 0.01 front fillcolor rgb '#FFFFFF' " &
      & // "fillstyle solid 1 border lc rgb '#8E24AA'" // newline &
      & // "set label " // text(first_number) // " 'input' at " // at // " left offset 0.9,0.5 textcolor rgb '#8E24AA' " &
      & // "font ',12' boxed front" // newline
  end function input_point

  !> Positions for labels: as close as possible to `positions`, but within the range and at least `distance` from each other.
  !> Method: isotonic regression of the positions minus the cumulative distances, by pooling adjacent violators.
  pure function apart(positions, distance, range) result(spaced)
    real(dp), intent(in) :: positions(:), distance, range(2)
    real(dp) :: spaced(size(positions)), means(size(positions)), before(size(positions)), room(2)
    integer :: order(size(positions)), members(size(positions)), i, n

    order = ascending(positions)
    before = distance * [(i - 1, i = 1, size(order))]
    n = 0
    do i = 1, size(order)
      n = n + 1
      means(n) = positions(order(i)) - before(i)
      members(n) = 1
      do while (n > 1)
        if (means(n - 1) <= means(n)) exit
        means(n - 1) = (members(n - 1) * means(n - 1) + members(n) * means(n)) / (members(n - 1) + members(n))
        members(n - 1) = members(n - 1) + members(n)
        n = n - 1
      end do
    end do
    room = [minval(range), maxval(range) - distance * (size(order) - 1)]
    spaced(order) = [(spread(min(max(means(i), room(1)), max(room(2), room(1))), 1, members(i)), i = 1, n)] + before
  end function apart

  !> For each position: true if it is chosen. The first position is chosen, and then each position that is at least `distance` from
  !> all positions chosen so far.
  pure function choose_spaced(positions, distance) result(chosen)
    real(dp), intent(in) :: positions(:), distance
    logical :: chosen(size(positions))
    integer :: i

    do i = 1, size(positions)
      chosen(i) = .not. any(chosen(:i - 1) .and. abs(positions(:i - 1) - positions(i)) < distance)
    end do
  end function choose_spaced

end module gestell_output_picture_marks
