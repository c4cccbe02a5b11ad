!> Composes pictures of several gnuplot panels, and panels with columns of a file over the crank angle.
module gestell_output_picture_panels
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_math_sorting, only: ascending
  use gestell_model_frame, only: frame_type
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, unit_of
  use gestell_output_picture_script, only: quoted, span
  use gestell_output_picture_axis, only: extent_lines
  use gestell_output_table, only: table_type
  implicit none (type, external)
  private

  public :: bars, choose_largest, height_of, history_panel, key_line, layout_line, legend_height, turn_axis, range_with_margin

  !> Maximum length of a gnuplot expression for the values of a column, without the factor; names of joints and links may be long
  integer, parameter :: longest_column = 640
  !> Curves whose peak is below this fraction of the largest are not drawn
  real(dp), parameter :: least = 1.0e-3_dp
  !> Maximum number of characters of an entry of a legend
  integer, parameter, public :: longest_entry = 40

contains

  !> Chooses the curves of a picture: the `most` with the largest peaks, in their order, without those that are practically zero.
  pure subroutine choose_largest(peaks, most, chosen, remark)
    real(dp), intent(in) :: peaks(:)
    integer, intent(in) :: most
    integer, allocatable, intent(out) :: chosen(:)
    !> Text for the heading, for example ", the 8 largest of 14"; empty if no curve was left out because there are too many
    character(len=:), allocatable, intent(out) :: remark
    integer :: order(size(peaks)), i

    ! Rounding errors must not decide between equal peaks.
    order = ascending(-anint(1.0e6_dp * peaks / max(maxval([0.0_dp, peaks]), tiny(1.0_dp))))
    chosen = pack(order, peaks(order) >= least * maxval([0.0_dp, peaks]))
    remark = ""
    if (size(chosen) > most) remark = ", the " // text(most) // " largest of " // text(size(peaks))
    chosen = chosen(:min(most, size(chosen)))
    chosen = pack([(i, i = 1, size(peaks))], [(any(chosen == i), i = 1, size(peaks))])
  end subroutine choose_largest

  !> Height in pixels that a legend with these entries needs above a panel in addition to the height of `free` rows.
  pure integer function legend_height(titles, free)
    character(len=*), intent(in) :: titles(:)
    integer, intent(in) :: free
    !> Pixels: width of a picture without its left margin, width of a character, of the sample of a line, and height of a row
    integer, parameter :: width = 530, character_width = 9, sample = 45, row = 18
    integer :: columns

    columns = max(1, width / (sample + character_width * min(longest_entry, maxval([0, len_trim(titles)]))))
    legend_height = row * max(0, (size(titles) + columns - 1) / columns - free)
  end function legend_height

  !> Gnuplot line that arranges the panels below the heading of the picture, with `across` panels in a row. `legend`: height in
  !> pixels that is reserved for a legend at the bottom. `above`, `between`: additional height for legends above the first row of
  !> panels, and between the rows.
  pure function layout_line(panels, across, legend, above, between) result(line)
    integer, intent(in) :: panels, across
    integer, intent(in), optional :: legend, above, between
    character(len=:), allocatable :: line
    real(dp) :: height
    integer :: rows, more(3)

    rows = (panels + across - 1) / across
    more = 0
    if (present(legend)) more(1) = legend
    if (present(above)) more(2) = above
    if (present(between)) more(3) = between
    height = height_of(rows) + more(1) + more(2) + (rows - 1) * more(3)
    line = "set multiplot layout " // text(rows) // "," // text(across) // " margins " // merge("0.145", "0.155", across == 1) &
      & // ",0.97," // concise((70 + more(1)) / height, 3) // "," // concise(1 - (86 + more(2)) / height, 3) &
      & // " spacing 0.165," // concise((34 + more(3)) / height, 3) // " title heading noenhanced" // newline
  end function layout_line

  !> Gnuplot range between two values, with a margin at both ends so that a mark and its label fit.
  pure function range_with_margin(from, to) result(range)
    real(dp), intent(in) :: from, to
    character(len=:), allocatable :: range
    real(dp), parameter :: rim = 0.025_dp

    range = span([from, to])
    if (abs(to - from) > 0) range = "[" // concise(from - rim * (to - from), 9) // ":" // concise(to + rim * (to - from), 9) // "]"
  end function range_with_margin

  !> Height in pixels of a picture with this number of rows of panels.
  pure real(dp) function height_of(rows)
    integer, intent(in) :: rows

    height_of = 160 + 190 * rows
  end function height_of

  !> Gnuplot lines for an axis of the crank angle over the period of the frame. The angle is negative if the crank rotates
  !> clockwise. `named`: true if tics and axis are to be labelled.
  pure function turn_axis(frame, named) result(lines)
    class(frame_type), intent(in) :: frame
    logical, intent(in) :: named
    character(len=:), allocatable :: lines

    lines = "set xtics " // text(90 * frame%mechanism%turns) // "; set xrange [0:" // text(nint(frame%degrees_per_period())) &
      & // "]" // newline // x_names("crank angle (deg)", named)
  end function turn_axis

  !> Gnuplot line for the labels of the x axis: shows them if `named`, otherwise removes them.
  pure function x_names(label, named) result(line)
    character(len=*), intent(in) :: label
    logical, intent(in) :: named
    character(len=:), allocatable :: line

    line = either("set format x; set xlabel '" // label // "'", "set format x ''; unset xlabel", named) // newline
  end function x_names

  !> Gnuplot line that shows the legend, with the titles of the curves, above the next panel, or hides it from now on.
  pure function key_line(shown) result(line)
    logical, intent(in) :: shown
    character(len=:), allocatable :: line

    line = "set key " // either("on at graph 1,graph 1.01 bottom right horizontal samplen 1 font ',12'", "off", shown) &
      & // newline
  end function key_line

  !> Gnuplot lines for a panel with curves. Each curve shows a column of `table` over the table's first column.
  pure function history_panel(table, name, columns, titles, styles) result(lines)
    type(table_type), intent(in) :: table
    !> `name`: label of the y axis, without the unit. `columns`: names of the columns, which have the same unit. `titles`: titles
    !> of the curves
    character(len=*), intent(in) :: name, columns(:), titles(:)
    !> Numbers of the curves' line types. If absent, the curves have the line types 1, 2, ...
    integer, intent(in), optional :: styles(:)
    character(len=:), allocatable :: lines
    type(growing_text_type) :: curves
    type(axis_unit_type) :: unit
    character(len=longest_column) :: values(size(columns))
    integer :: i, number

    unit = unit_of(table, columns)
    values = values_of(table, trim(unit%words), columns)
    do i = 1, size(columns)
      number = i
      if (present(styles)) number = styles(i)
      if (i > 1) call curves%append(", \" // newline // "  ")
      call curves%append("'" // table%name // ".csv' using 1:(" // trim(values(i)) // ") with lines lt " // text(style(number)) &
        & // " title " // quoted(trim(titles(i)), longest_entry) // " noenhanced")
    end do
    lines = extent_lines(table%name // ".csv", values) // "set yrange [low - 0.07 * (high - low):high + 0.07 * (high - low)]" &
      & // newline // "set ylabel " // quoted(label_with(name, unit)) // " noenhanced" // newline // "plot " // curves%whole() &
      & // newline
  end function history_panel

  !> Gnuplot expressions for the values of these columns multiplied by `factor`.
  pure function values_of(table, factor, columns) result(expressions)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: factor, columns(:)
    character(len=longest_column) :: expressions(size(columns))
    integer :: i

    do i = 1, size(columns)
      expressions(i) = factor // " * column(" // text(table%number_of(columns(i))) // ")"
    end do
  end function values_of

  !> Gnuplot options for the i-th of several bars at the same place. Successive bars use `fills` fill patterns in turn, so that they
  !> differ in black-and-white print.
  pure function bars(i, fills)
    integer, intent(in) :: i, fills
    character(len=:), allocatable :: bars
    character(len=*), parameter :: all(5) = [character(len=10) :: "solid 1", "pattern 2", "solid 0.25", "pattern 5", "pattern 4"]

    bars = " lt " // text(i) // " dt 1 lw 1 fs " // trim(all(1 + mod(i - 1, fills)))
  end function bars

  !> Number of the gnuplot line type for the i-th curve. The script defines eight line types, which are used in turn.
  pure integer function style(i)
    integer, intent(in) :: i

    style = 1 + mod(i - 1, 8)
  end function style

end module gestell_output_picture_panels
