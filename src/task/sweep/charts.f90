!> Composes the gnuplot lines of a chart: a column of a sweep as colours over two parameters.
module gestell_task_sweep_charts
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: either, newline, text
  use gestell_output_picture_axis, only: decade_lines, extent_lines, parameter_axis, with_unit
  use gestell_output_picture_marks, only: input_point
  use gestell_output_picture_script, only: quoted
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_shown, only: decades, growth, shown_type, states
  implicit none (type, external)
  private

  public :: chart_lines

  !> Colours of a logarithmic scale, from dark to light (viridis): their order is visible without colours, and to the colour-blind
  character(len=*), parameter :: viridis = "set palette defined (0 '#440154', 1 '#3B528B', 2 '#21918C', 3 '#5EC962', 4 '#FDE725')"
  !> Charts with more cells than this are drawn as an image, whose cells web browsers blur, instead of one rectangle for each cell
  integer, parameter :: most_cells = 10000
  !> Values below this fraction of the maximum have the colour of the lower end of the scale
  character(len=*), parameter :: least = "1e-4"

contains

  !> The lines of the chart. They plot the curves of the macro @over, which the task `boundary` may define, on top.
  function chart_lines(plan, shown) result(lines)
    type(sweep_plan_type), intent(in) :: plan
    type(shown_type), intent(in) :: shown
    character(len=:), allocatable :: lines, value

    value = trim(shown%value)
    lines = "if (!exists('over')) { over = '' }" // newline // "growth(r) = r > 0 ? log(r) : NaN" // newline &
      & // "X(v) = v; Y(v) = v" // newline &
      & // parameter_axis("x", plan%grid%axes(1), with_unit(plan%paths(1), plan%units(1)), 0.5_dp / (plan%grid%axes(1)%count - 1)) &
      & // parameter_axis("y", plan%grid%axes(2), with_unit(plan%paths(2), plan%units(2)), 0.5_dp / (plan%grid%axes(2)%count - 1)) &
      & // "# no result: grey" // newline
    if (size(plan%base) == 2) lines = lines // input_point(plan%grid%axes, plan%base)
    lines = lines // "set object 1 rectangle from graph 0,graph 0 to graph 1,graph 1 behind fillcolor rgb '#BBBBBB' fillstyle " &
      & // "solid 1 noborder" // newline // "set tics out; unset grid; set key off; set title heading noenhanced" // newline &
      & // "set rmargin at screen 0.79; set bmargin at screen 0.15; set tmargin at screen 0.86" // newline
    select case (shown%kind)
    case (growth)
      lines = lines // extent_lines("sweep.csv", [value]) // "set cbrange [low:high]" // newline // growth_colours()
    case (states)
      value = "(strcol(" // text(shown%verdict) // ") eq 'stable' ? 0 : strcol(" // text(shown%verdict) &
        & // ") eq 'unstable' ? 2 : strstrt('undamped undecided', strcol(" // text(shown%verdict) // ")) > 0 ? 1 : NaN)"
      lines = lines // "set cbrange [-0.5:2.5]; set palette maxcolors 3; " &
        & // "set palette defined (0 '#2A6FA8', 1 '#E3EEF5', 2 '#F3A65A')" // newline &
        & // "set cbtics ('stable' 0, ""undamped or\nundecided"" 1, 'unstable' 2) scale 0" // newline
    case (decades)
      lines = lines // "positive(v) = v > 0 ? v : NaN" // newline // extent_lines("sweep.csv", ["positive(" // value // ")"]) &
        & // "if (high > 0) {" // newline // decade_lines("(low > " // least // " * high ? low : " // least // " * high)", "high", &
        & "cb") // "}" // newline // viridis // newline
    case default ! other kinds do not exist
    end select
    lines = lines // "set cblabel " // quoted(trim(shown%label)) // " noenhanced offset 0.8" // newline &
      & // "plot 'sweep.csv' using (X(column(1))):(Y(column(2))):(" // value // ") with image " &
      & // either("pixels", "      ", product(real(plan%grid%axes%count, dp)) <= most_cells) // " @over" // newline
  end function chart_lines

  !> Gnuplot lines for the colours of growth: stable points are blue, paler toward the border; unstable points are orange to brown.
  pure function growth_colours() result(lines)
    character(len=:), allocatable :: lines

    ! unlike E4EEF5, the colour E3EEF5 is the same on dark screens
    lines = "if (high <= 0) { set palette defined (low '#2A6FA8', high '#E3EEF5') }" // newline &
      & // "if (low >= 0) { set palette defined (low '#F3A65A', high '#7A2E00') }" // newline &
      & // "if (low < 0 && high > 0) { set palette defined (low '#2A6FA8', 0 '#E3EEF5', 0 '#F3A65A', high '#7A2E00') }" // newline
  end function growth_colours

end module gestell_task_sweep_charts
