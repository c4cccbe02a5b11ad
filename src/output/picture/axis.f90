!> Composes gnuplot lines for axes of pictures, in particular linear and logarithmic axes of parameters.
module gestell_output_picture_axis
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline
  use gestell_output_picture_script, only: quoted, span
  use gestell_study_grid, only: axis_type
  implicit none (type, external)
  private

  public :: coordinate, decade_lines, extent_lines, parameter_axis, parameter_title, tic_step, unit_words, with_unit

  !> Path of the crank speed in the input
  character(len=*), parameter :: speed_path = "drive.speed_rpm"

contains

  !> Gnuplot lines that set range, tics and label for the axis of a parameter. They also define the gnuplot function X or Y, which
  !> returns the position of a value on the axis: the value itself or, on a logarithmic axis, log10 of its magnitude.
  pure function parameter_axis(letter, axis, name, margin) result(lines)
    !> Letter of the axis: x or y
    character, intent(in) :: letter
    type(axis_type), intent(in) :: axis
    !> Text that labels the axis
    character(len=*), intent(in) :: name
    !> Margin at each end of the axis, as a fraction of the length of its range
    real(dp), intent(in) :: margin
    character(len=:), allocatable :: lines
    real(dp) :: ends(2), wider

    ends = coordinate(axis, [axis%from, axis%to])
    ends = [minval(ends), maxval(ends)]
    wider = margin * (ends(2) - ends(1))
    lines = either("[" // concise(ends(1) - wider, 9) // ":" // concise(ends(2) + wider, 9) // "]", span(ends), ends(2) > ends(1))
    lines = "set " // letter // "range " // lines // newline // "set " // letter // "label " // quoted(name) // " noenhanced" &
      & // newline
    if (axis%logarithmic) then
      lines = lines // achar(iachar(letter) - 32) // "(v) = log10(abs(v))" // newline // "set " // letter // "tics (" &
        & // logarithmic_tics(axis) // ")" // newline
    else
      lines = lines // achar(iachar(letter) - 32) // "(v) = v" // newline
    end if
  end function parameter_axis

  !> Label of an axis: title of the parameter and, if it has a unit, the unit in parentheses.
  pure function with_unit(path, unit) result(name)
    character(len=*), intent(in) :: path, unit
    character(len=:), allocatable :: name

    name = parameter_title(trim(path))
    if (unit /= "") name = name // " (" // unit_words(unit) // ")"
  end function with_unit

  !> Unit as pictures show it: that of the input, but rpm instead of 1/min.
  pure function unit_words(unit) result(words)
    character(len=*), intent(in) :: unit
    character(len=:), allocatable :: words

    words = trim(unit)
    if (words == "1/min") words = "rpm"
  end function unit_words

  !> Title of a parameter: its path in words, for example "support(2) stiffness(1)". Names in parentheses remain unchanged.
  pure function parameter_title(path) result(title)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: title
    integer :: i, depth

    title = path
    if (path == speed_path) title = "crank speed"
    if (path == speed_path) return
    depth = 0
    do i = 1, len(title)
      if (title(i:i) == "(") depth = depth + 1
      if (title(i:i) == ")") depth = depth - 1
      if (depth == 0 .and. scan(title(i:i), "._") > 0) title(i:i) = " "
    end do
  end function parameter_title

  !> Position of a value on its axis: the value itself or, on a logarithmic axis, log10 of its magnitude.
  elemental real(dp) function coordinate(axis, value)
    type(axis_type), intent(in) :: axis
    real(dp), intent(in) :: value

    coordinate = value
    if (axis%logarithmic) coordinate = log10(abs(value))
  end function coordinate

  !> Gnuplot list of the tics of a logarithmic axis: at 1, 2 and 5 times the powers of ten, or only at the powers of ten if the axis
  !> covers many decades. If fewer than two tics fit, they are at the ends of the axis.
  pure function logarithmic_tics(axis) result(list)
    type(axis_type), intent(in) :: axis
    character(len=:), allocatable :: list
    real(dp), parameter :: steps(3) = [1.0_dp, 2.0_dp, 5.0_dp]
    real(dp) :: ends(2), value
    integer :: decade, i, tic_count, first, last

    ends = abs([axis%from, axis%to])
    ends = [minval(ends), maxval(ends)]
    first = floor(log10(ends(1)))
    last = ceiling(log10(ends(2)))
    list = ""
    tic_count = 0
    do decade = first, last, max(1, (last - first) / 6)
      do i = 1, merge(1, 3, last - first > 3)
        value = steps(i) * 10.0_dp**decade
        if (value < 0.999_dp * ends(1) .or. value > 1.001_dp * ends(2)) cycle
        tic_count = tic_count + 1
        list = list // ", " // tic(sign(value, axis%from))
      end do
    end do
    if (tic_count < 2) list = ", " // tic(axis%from) // ", " // tic(axis%to)
    list = list(3:)
  end function logarithmic_tics

  !> Distance of tics on a linear axis of this length: 1, 2 or 5 times a power of ten, so that at most `most` steps fit.
  pure real(dp) function tic_step(length, most) result(step)
    real(dp), intent(in) :: length
    integer, intent(in) :: most
    real(dp) :: decade, least

    least = length / most
    decade = 10.0_dp**floor(log10(least))
    step = decade * merge(merge(2.0_dp, 5.0_dp, least < 2 * decade), 10.0_dp, least < 5 * decade)
  end function tic_step

  !> Label and position of one tic of a logarithmic axis.
  pure function tic(value) result(words)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: words

    words = "'" // concise(value, 4) // "' " // concise(log10(abs(value)), 9)
  end function tic

  !> Gnuplot lines that set the variables `low` and `high` to the minimum and maximum of some expressions over the rows of a file,
  !> and ensure that `low` < `high`. The option `smooth unique` reduces gnuplot's table of plotted points to one row. Without this
  !> option a file with millions of rows would take minutes.
  pure function extent_lines(file, expressions) result(lines)
    character(len=*), intent(in) :: file, expressions(:)
    character(len=:), allocatable :: lines
    type(growing_text_type) :: plots
    integer :: i

    do i = 1, size(expressions)
      call plots%append("plot [0:1] [-1:1] '" // file // "' using (0):(v = " // trim(expressions(i)) &
        & // ", low = v < low && v > -1e300 ? v : low, high = v > high && v < 1e300 ? v : high, 0) smooth unique" // newline)
    end do
    lines = "low = 1e300; high = -1e300" // newline // "set table $unused; unset logscale" // newline // plots%whole() &
      & // "unset table" // newline // "if (low > high) { low = 0; high = 0 }" // newline &
      & // "if (high - low <= 1e-9 * (abs(low) + abs(high))) { low = low - (low == 0 ? 1 : 0.01 * abs(low)); " &
      & // "high = high + (high == 0 ? 1 : 0.01 * abs(high)) }" // newline
  end function extent_lines

  !> Gnuplot lines for a logarithmic axis that extends from the expression `from` to the expression `to`. If the range covers at
  !> least two decades, tics are only at powers of ten; otherwise there are also tics between them. Numbers are written without
  !> powers of ten where they remain short.
  pure function decade_lines(from, to, axis) result(lines)
    character(len=*), intent(in) :: from, to
    !> Name of the axis: y, the default, or cb
    character(len=*), intent(in), optional :: axis
    character(len=:), allocatable :: lines, name

    name = "y"
    if (present(axis)) name = axis
    lines = "bottom = " // from // "; top = " // to // "; set logscale " // name // "; set " // name // "range [bottom:top]" &
      & // newline // "set " // name // "tics autofreq; set format " // name &
      & // " (bottom > 0.9e-4 && top < 2e5 ? '%g' : '10^{%L}')" // newline &
      & // "if (top < 100 * bottom) {" // newline &
      & // "  marks = top < 4 * bottom ? '1 1.2 1.5 2 2.5 3 4 5 6 7 8 9' : top < 8 * bottom ? '1 2 3 4 6 8' : '1 2 5'" // newline &
      & // "  list = ''" // newline &
      & // "  do for [decade=floor(log10(bottom)):ceil(log10(top))] { do for [mark in marks] {" // newline &
      & // "    v = mark * 10.0**decade" // newline &
      & // "    plain = abs(decade) < 5 ? sprintf('%g', v) : mark . '·10^{' . decade . '}'" // newline &
      & // "    if (v >= bottom && v <= top) { list = list . (list eq '' ? '' : ', ') . sprintf(""'%s' %.6e"", plain, v) }" &
      & // newline // "  } }" // newline &
      & // "  if (list ne '') { eval 'set " // name // "tics (' . list . ')' }" // newline // "}" // newline
  end function decade_lines

end module gestell_output_picture_axis
