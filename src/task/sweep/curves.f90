!> Composes the gnuplot lines of a column of a sweep as a curve against one parameter.
module gestell_task_sweep_curves
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: failed, impossible, operator(==), undamped, undecided, unstable, unstable_number, verdict_type
  use gestell_base_text, only: concise, either, newline, text
  use gestell_output_picture_axis, only: coordinate, decade_lines, extent_lines, parameter_axis, with_unit
  use gestell_output_picture_marks, only: boxes_where, input_marks, marks_type, unstable_entry
  use gestell_output_picture_script, only: quoted
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_shown, only: decades, growth, shown_type, states
  use gestell_task_sweep_summary, only: summary_type
  implicit none (type, external)
  private

  public :: curve_lines

  !> A finite coordinate outside every plot
  character(len=*), parameter :: nowhere = "1e290"
  !> Width of the boxes for shading, relative to the distance of the values. It is slightly larger than 1, so that there are no gaps
  real(dp), parameter :: overlap = 1.05_dp
  !> Values below this fraction of the maximum are not drawn
  character(len=*), parameter :: least = "1e-4"

contains

  !> The lines of the picture of a column against parameter number `k`, the only one that varies.
  function curve_lines(plan, k, shown, summary) result(lines)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: k
    type(shown_type), intent(in) :: shown
    type(summary_type), intent(in) :: summary
    character(len=:), allocatable :: lines, x, style, unstable_rows, shades
    type(marks_type) :: marks
    real(dp) :: ends(2)
    integer :: i

    x = "(X(column(" // text(k) // ")))"
    style = either("with linespoints ps 0.5 lt 1", "with lines lt 1", plan%grid%axes(k)%count < 30)
    marks = input_marks(plan%grid%axes(k), pack(plan%base, [(i == k, i = 1, size(plan%base))]), plan%units(k))
    unstable_rows = ""
    if (shown%verdict > 0) then
      if (summary%verdicts(unstable_number) > 0) unstable_rows = "strcol(" // text(shown%verdict) // ") eq 'unstable'"
    else if (shown%kind == growth .and. summary%most > 1) then
      unstable_rows = trim(shown%value) // " > 0"
    end if
    shades = marks%entries
    if (unstable_rows /= "") then
      associate (axis => plan%grid%axes(k))
        ends = coordinate(axis, [axis%from, axis%to])
        shades = boxes_where("sweep.csv", unstable_rows, x, concise(overlap * abs(ends(2) - ends(1)) / (2 * max(1, axis%count &
          & - 1)), 6), "low", "high") // unstable_entry // shades
      end associate
    end if
    lines = "set multiplot title heading noenhanced" // newline // "set rmargin at screen 0.96; set bmargin at screen 0.15; " &
      & // "set tmargin at screen 0.8" // newline &
      & // parameter_axis("x", plan%grid%axes(k), with_unit(plan%paths(k), plan%units(k)), 0.0_dp) // marks%lines &
      & // "set key at graph 1,graph 1.02 bottom right horizontal samplen 2 font ',12'" // newline &
      & // "growth(r) = r > 0 ? log(r) : NaN" // newline // "set ylabel " // quoted(trim(shown%label)) // " noenhanced" // newline
    select case (shown%kind)
    case (growth)
      lines = lines // extent_lines("sweep.csv", [shown%value]) // "low = low > 0 ? 0 : low; high = high < 0 ? 0 : high" &
        & // newline // "step = 0.06 * (high - low); low = low - step; high = high + step; set yrange [low:high]" // newline &
        & // "set object 1 rectangle from graph 0,graph 0 to graph 1,first 0 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 " &
        & // "noborder" // newline &
        & // "set arrow 1 from graph 0,first 0 to graph 1,first 0 nohead front lt 7 dt 1 lw 1.5" // newline &
        & // "plot NaN notitle" // shades // ", for [i=1:(high < 1e299)] 'sweep.csv' using " // x // ":(" // trim(shown%value) &
        & // ") " // style // " notitle" // state_marks(trim(shown%value))
    case (states)
      lines = lines // "low = 0; high = 1; set yrange [0:1]; unset ytics; set ylabel 'verdict'" // newline // "plot NaN notitle" &
        & // shades // state_marks("0.5")
    case (decades)
      lines = lines // "positive(v) = v > 0 ? v : NaN" // newline &
        & // extent_lines("sweep.csv", ["positive(" // trim(shown%value) // ")"]) // "found = low > 0" // newline &
        & // "if (found) {" // newline // decade_lines("(low > " // least // " * high ? low : " // least // " * high) / 1.5", &
        & "high * 1.5") &
        & // "} else { bottom = 0; top = 1; set yrange [0:1]; set label 1 'zero' at graph 0.5,graph 0.5 center }" // newline &
        & // "low = bottom; high = top" // newline &
        & // "plot NaN notitle" // shades // ", for [i=1:found] 'sweep.csv' using " // x // ":(positive(" // trim(shown%value) &
        & // ")) " // style // " notitle"
    case default ! other kinds do not exist
    end select
    lines = lines // newline // "unset multiplot" // newline

  contains

    !> Parts of the plot command that mark points whose verdict is not `stable`. `height`: gnuplot expression for their ordinate.
    pure function state_marks(height) result(words)
      character(len=*), intent(in) :: height
      character(len=:), allocatable :: words
      type(verdict_type) :: mark
      integer :: i
      type(verdict_type), parameter :: marked(5) = [unstable, undecided, impossible, failed, undamped]
      character(len=*), parameter :: points(5) = [character(len=32) :: "lt 2 pt 7 ps 0.6", "lt 5 pt 9 ps 0.8", &
        & "lt 8 pt 2 ps 0.8", "lt 7 pt 1 ps 0.9", "lt 5 pt 8 ps 0.8"]

      words = ""
      if (shown%verdict == 0) return
      do i = 1, size(marked)
        mark = marked(i)
        if (summary%verdicts(mark%number()) == 0) cycle
        words = words // ", 'sweep.csv' using " // x // ":(strcol(" // text(shown%verdict) // ") eq '" // trim(mark%word()) &
          & // "' ? " // either("low + 0.04 * (high - low)", height, mark == impossible .or. mark == failed) // " : " // nowhere &
          & // ") with points " // trim(points(i)) // either(" notitle", " title '" // trim(mark%word()) // "'", mark == unstable)
      end do
    end function state_marks

  end function curve_lines

end module gestell_task_sweep_curves
