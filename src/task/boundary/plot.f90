!> Plots borders: critical values of one parameter, curves in the plane of two parameters, or crossings of a level.
module gestell_task_boundary_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_output_picture_axis, only: coordinate, parameter_axis, with_unit
  use gestell_output_picture_marks, only: apart, input_marks, marks_type, shade, unstable_entry
  use gestell_task_boundary_branches, only: turning_point
  use gestell_task_boundary_level_line, only: level_type
  use gestell_task_boundary_level_plane, only: level_kinds, level_states
  use gestell_task_boundary_level_plot, only: level_meanings, level_title, plot_levels
  use gestell_task_boundary_map_plot, only: empty_label, count_words, plot_curves
  use gestell_task_boundary_solution, only: border_results_type
  use gestell_task_range_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  public :: plot_borders

  character, parameter :: newline = new_line("a")
  character(len=*), parameter :: kinds(4) = [character(len=15) :: "divergence", "period_doubling", "flutter", turning_point]
  character(len=*), parameter :: meanings(4) = [character(len=30) :: "divergence (ρ = 1)", "period doubling (ρ = -1)", &
    & "flutter (pair of ρ)", "turning point (ρ = 1)"]

contains

  !> The plot boundary.gp with the results of the task `boundary`.
  function plot_borders(plan, results, level) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    type(level_type), intent(in), optional :: level
    type(figure_type) :: figure

    if (allocated(results%map) .and. present(level)) then
      figure = plot_curves(plan, results%map, level_kinds, level_states, level_meanings, level_title(level), "above the level")
    else if (present(level)) then
      figure = plot_levels(plan%paths(1), plan%units(1), plan%grid%axes(1), plan%base, level, (results%values%value), &
        & results%curve%points)
    else if (allocated(results%map)) then
      figure = plot_curves(plan, results%map, kinds(:3), [" ", " ", " "], meanings(:3), &
        & "Stability boundaries over " // trim(plan%paths(1)) // " and " // trim(plan%paths(2)), "unstable")
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
        & // parameter_axis("x", axis, with_unit(plan%paths(1), plan%units(1)), 0.0_dp) &
        & // "set yrange [-0.08:1.3]" // newline &
        & // "set ylabel '|arg ρ| / π of the critical multiplier'" // newline // "set ytics 0,0.25,1" // newline &
        & // "set key outside bottom center horizontal samplen 2" // newline // marks%lines
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
    figure = new_figure("boundary", "Stability boundaries over " // trim(plan%paths(1)) // ": " &
      & // count_words(size(results%values)), &
      & lines // list // marks%entries // newline, width=800, height=440)
  end function plot_values

end module gestell_task_boundary_plot
