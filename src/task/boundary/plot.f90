!> Plots borders: critical values of one parameter, curves in the plane of two parameters, or crossings of a level.
module gestell_task_boundary_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_base_verdict, only: operator(==), unstable
  use gestell_output_picture_script, only: figure_type, new_figure, quoted
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, pick_unit
  use gestell_output_picture_axis, only: coordinate, decade_lines, extent_lines, parameter_axis, parameter_title, with_unit
  use gestell_output_picture_marks, only: apart, input_marks, marks_type, shade, unstable_entry
  use gestell_task_boundary_branches, only: turning_point
  use gestell_task_boundary_level_line, only: level_type
  use gestell_task_boundary_level_plane, only: level_kinds, level_states
  use gestell_task_boundary_map_plot, only: empty_label, count_words, plot_curves
  use gestell_task_boundary_solution, only: border_results_type
  use gestell_task_range_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  public :: plot_borders

  character(len=*), parameter :: kinds(4) = [character(len=15) :: "divergence", "period_doubling", "flutter", turning_point]
  character(len=*), parameter :: meanings(4) = [character(len=30) :: "divergence (ρ = 1)", "period doubling (ρ = -1)", &
    & "flutter (pair of ρ)", "turning point (ρ = 1)"]
  !> Legend entry for each kind of border in `level_kinds` together with its state in `level_states`.
  character(len=*), parameter :: level_meanings(8) = [character(len=30) :: "level", "level (undamped)", &
    & "level (undecided)", "level (unstable)", "jump", "jump (undamped)", "jump (undecided)", "jump (unstable)"]

contains

  !> The plot boundary.gp with the results of the task `boundary`.
  function plot_borders(plan, results, level) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    type(level_type), intent(in), optional :: level
    type(figure_type) :: figure

    if (allocated(results%map) .and. present(level)) then
      figure = plot_curves(plan, results%map, level_kinds, level_states, level_meanings, level_title(plan, level), &
        & "above the level")
    else if (present(level)) then
      figure = plot_levels(plan, results, level)
    else if (allocated(results%map)) then
      figure = plot_curves(plan, results%map, kinds(:3), [" ", " ", " "], meanings(:3), &
        & "Stability boundaries over " // parameter_title(trim(plan%paths(1))) // " and " &
        & // parameter_title(trim(plan%paths(2))), "unstable")
    else
      figure = plot_values(plan, results)
    end if
  end function plot_borders

  !> Plot of the critical values, and of the arguments of their multipliers. The unstable ranges of the parameter are shaded.
  function plot_values(plan, results) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    type(figure_type) :: figure
    type(marks_type) :: marks
    character(len=:), allocatable :: lines, list
    real(dp) :: ends(2), here(size(results%values)), places(size(results%values))
    integer :: i

    associate (values => results%values, axis => plan%grid%axes(1))
      ends = coordinate(axis, [axis%from, axis%to])
      here = coordinate(axis, values%value)
      places = apart(here, 0.026_dp * abs(ends(2) - ends(1)), ends)
      marks = input_marks(axis, plan%base, plan%units(1))
      lines = "set title heading noenhanced" // newline &
        & // parameter_axis("x", axis, with_unit(plan%paths(1), plan%units(1)), 0.0_dp) // "set yrange [-0.08:1.3]" // newline &
        & // "set ylabel '|arg ρ| / π of the critical multiplier'" // newline // "set ytics 0,0.25,1" // newline &
        & // "set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline // marks%lines
      do i = 1, size(values)
        if (values(i)%above == "unstable") lines = lines // shade(i + 1, here(i), &
          & min(maxval(ends), minval(here, mask=here > here(i) .and. values%vibration == values(i)%vibration)))
        if (i == 1 .and. values(i)%below == "unstable") lines = lines // shade(1, minval(ends), here(i))
        lines = lines // "set label " // text(i) // " '" // concise(values(i)%value, 6) // "' at " &
          & // concise(places(i), 9) // "," // concise(values(i)%arg_rad / acos(-1.0_dp) + 0.04_dp, 4) &
          & // " rotate by 90 left font ',12'" // newline
      end do
      list = empty_label(size(values)) // "plot NaN notitle"
      do i = 1, size(kinds)
        if (any(values%kind == kinds(i))) list = list // ", 'boundary.csv' using (strcol('kind') eq '" // trim(kinds(i)) &
          & // "' ? X(column(2)) : 1e290):(column('arg_rad') / pi) with impulses lt " // text(i) // " notitle" &
          & // ", '' using (strcol('kind') eq '" // trim(kinds(i)) // "' ? X(column(2)) : 1e290):(column('arg_rad') / pi) " &
          & // "with points lt " // text(i) // " ps 1.2 title '" // trim(meanings(i)) // "'"
      end do
      if (any([values%above, values%below] == "unstable")) list = list // unstable_entry
    end associate
    figure = new_figure("boundary", "Stability boundaries over " // parameter_title(trim(plan%paths(1))) // ": " &
      & // count_words(size(results%values)), lines // list // marks%entries // newline, height=440)
  end function plot_values

  !> Start of the title of a plot: the quantity and its level.
  pure function level_title(plan, level) result(title)
    type(sweep_plan_type), intent(in) :: plan
    type(level_type), intent(in) :: level
    character(len=:), allocatable :: title

    title = "Where " // level%subject() // " crosses " // trim(plan%result_units%amount(level%value, 6, trim(level%measure%unit)))
  end function level_title

  !> Plot of the measured quantity from level.csv against the parameter, and of its crossings of the level from boundary.csv.
  function plot_levels(plan, results, level) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    type(level_type), intent(in) :: level
    type(figure_type) :: figure
    !> Labels do not overlap if their distance is at least this fraction of the axis.
    real(dp), parameter :: least_distance = 0.03_dp
    character(len=:), allocatable :: lines, value
    type(axis_unit_type) :: unit
    type(marks_type) :: marks
    real(dp) :: last, at
    integer :: i

    associate (values => results%values, axis => plan%grid%axes(1))
      marks = input_marks(axis, plan%base, plan%units(1))
      unit = pick_unit(trim(level%measure%unit), level%value, plan%result_units)
      value = "over(" // trim(unit%words) // " * column(2))"
      lines = "set title heading noenhanced" // newline &
        & // parameter_axis("x", axis, with_unit(plan%paths(1), plan%units(1)), 0.0_dp) &
        & // "level = " // concise(unit%factor * level%value, 12) // newline // "over(v) = v > 0 ? v : NaN" // newline &
        & // extent_lines("level.csv", [value]) &
        & // "low = low > 0 && low < level ? low : level; high = high > level ? high : level" // newline &
        & // decade_lines("(low > 1e-6 * high ? low : 1e-6 * high) / 1.5", "high * 1.5") &
        & // "set ylabel " // quoted(label_with(level%subject(), unit)) // " noenhanced" // newline &
        & // "set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
        & // "set object 1 rectangle from graph 0,first level " &
        & // "to graph 1,graph 1 behind fillcolor rgb '#F9E0C7' fillstyle solid 1 noborder" // newline // marks%lines
      last = huge(last)
      do i = 1, size(values)
        at = coordinate(axis, values(i)%value)
        if (abs(at - last) < least_distance * abs(coordinate(axis, axis%to) - coordinate(axis, axis%from))) cycle
        last = at
        lines = lines // "set label " // text(i) // " '  " // concise(values(i)%value, 6) // "' at first " // concise(at, 9) &
          & // ",first level rotate by 90 left font ',12'" // newline
      end do
      lines = lines // "plot [] 'level.csv' using (X(column(1))):(" // value // ") with lines lt 1 lw 1.5 notitle, " &
        & // "level with lines lt 7 dt 2 title 'level'"
      if (any(results%curve%points%state == unstable)) lines = lines // ", 'level.csv' using (X(column(1))):(strcol(4) eq " &
        & // "'unstable' ? " // value // " : NaN) with points lt 2 pt 7 ps 0.4 title 'unstable'"
      if (size(values) > 0) lines = lines // ", 'boundary.csv' using (X(column(2))):(level) with points lt 7 pt 7 " &
        & // "ps 0.9 title 'crossings'"
    end associate
    figure = new_figure("boundary", level_title(plan, level), lines // marks%entries // newline, height=480)
  end function plot_levels

end module gestell_task_boundary_plot
