!> Plot of a measured quantity as a function of a parameter, and of the parameter values at which it crosses a level.
module gestell_task_boundary_level_plot
  use gestell_base_verdict, only: operator(==), unstable
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_picture_axis, only: coordinate, decade_lines, extent_lines, parameter_axis, with_unit
  use gestell_output_picture_marks, only: input_marks, marks_type
  use gestell_output_picture_script, only: figure_type, new_figure, quoted
  use gestell_study_grid, only: axis_type
  use gestell_study_speed_point, only: speed_point_type
  use gestell_task_boundary_level_line, only: level_type
  implicit none (type, external)
  private

  public :: level_title, plot_levels

  character, parameter :: newline = new_line("a")
  !> Legend entry for each kind of border in `level_kinds` together with its state in `level_states`.
  character(len=*), parameter, public :: level_meanings(8) = [character(len=30) :: "level", "level (undamped)", &
    & "level (undecided)", "level (unstable)", "jump", "jump (undamped)", "jump (undecided)", "jump (unstable)"]

contains

  !> Start of the title of a plot: the quantity and its level.
  pure function level_title(level) result(title)
    type(level_type), intent(in) :: level
    character(len=:), allocatable :: title

    title = "Where " // level%subject() // " crosses " // concise(level%value, 6) // " " // trim(level%measure%unit)
  end function level_title

  !> The plot boundary.gp: the measured quantity from level.csv against the parameter, and its crossings of the level from
  !> boundary.csv.
  function plot_levels(path, unit, axis, input, level, crossings, points) result(figure)
    !> Name and unit of the parameter on the horizontal axis
    character(len=*), intent(in) :: path, unit
    type(axis_type), intent(in) :: axis
    !> Value of the parameter in the input file; empty if the input gives no value
    real(dp), intent(in) :: input(:)
    !> Measured quantity and level
    type(level_type), intent(in) :: level
    !> Parameter values at which the quantity crosses the level
    real(dp), intent(in) :: crossings(:)
    !> Points of the curve, in the order of the parameter
    class(speed_point_type), intent(in) :: points(:)
    type(figure_type) :: figure
    !> Labels do not overlap if their distance is at least this fraction of the axis.
    real(dp), parameter :: apart = 0.03_dp
    character(len=:), allocatable :: lines
    type(marks_type) :: marks
    real(dp) :: last, at
    integer :: i

    lines = "set title heading noenhanced" // newline // parameter_axis("x", axis, with_unit(path, unit), 0.0_dp) &
      & // "level = " // concise(level%value, 12) // newline // "over(v) = v > 0 ? v : NaN" // newline &
      & // extent_lines("level.csv", ["over(column(2))"]) &
      & // "low = low > 0 && low < level ? low : level; high = high > level ? high : level" // newline &
      & // decade_lines("(low > 1e-6 * high ? low : 1e-6 * high) / 1.5", "high * 1.5") &
      & // "set ylabel " // quoted(level%subject() // " (" // trim(level%measure%unit) // ")") // " noenhanced" // newline &
      & // "set key outside bottom center horizontal samplen 2" // newline &
      & // "set object 1 rectangle from graph 0,first level to graph 1,graph 1 behind fillcolor rgb '#F9E0C7' fillstyle solid 1 " &
      & // "noborder" // newline
    marks = input_marks(axis, input, unit)
    lines = lines // marks%lines
    last = huge(last)
    do i = 1, size(crossings)
      at = coordinate(axis, crossings(i))
      if (abs(at - last) < apart * abs(coordinate(axis, axis%to) - coordinate(axis, axis%from))) cycle
      last = at
      lines = lines // "set label " // text(i) // " '  " // concise(crossings(i), 6) // "' at first " // concise(at, 9) &
        & // ",first level rotate by 90 left font ',12'" // newline
    end do
    lines = lines // "plot [] 'level.csv' using (X(column(1))):(over(column(2))) with lines lt 1 lw 1.5 notitle, " &
      & // "level with lines lt 7 dt 2 title 'level'"
    if (any(points%state == unstable)) lines = lines // ", 'level.csv' using (X(column(1))):(strcol(4) eq 'unstable' ? " &
      & // "over(column(2)) : NaN) with points lt 2 pt 7 ps 0.4 title 'unstable'"
    if (size(crossings) > 0) lines = lines // ", 'boundary.csv' using (X(column(2))):(level) with points lt 7 pt 7 " &
      & // "ps 0.9 title 'crossings'"
    figure = new_figure("boundary", level_title(level), lines // marks%entries // newline, width=800, height=480)
  end function plot_levels

end module gestell_task_boundary_level_plot
