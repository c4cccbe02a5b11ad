!> Pictures of borders of stability: critical values of one parameter, curves over two.
module gestell_task_boundary_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_output_picture_axis, only: coordinate, parameter_axis, with_unit
  use gestell_output_picture_marks, only: apart, input_marks, input_point, marks_type, shade, unstable_entry, unstable_fill
  use gestell_output_picture_regions, only: left_side
  use gestell_task_boundary_branches, only: turning_point
  use gestell_task_boundary_map, only: border_map_type
  use gestell_task_boundary_solution, only: border_results_type
  use gestell_study_grid, only: grid_type
  use gestell_task_sweep_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  public :: plot_borders

  character, parameter :: newline = new_line("a")
  character(len=*), parameter :: kinds(4) = [character(len=15) :: "divergence", "period_doubling", "flutter", turning_point]
  character(len=*), parameter :: meanings(4) = [character(len=30) :: "divergence (ρ = 1)", "period doubling (ρ = -1)", &
    & "flutter (pair of ρ)", "turning point (ρ = 1)"]

contains

  !> boundary.gp.
  function plot_borders(plan, results) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    type(figure_type) :: figure

    if (allocated(results%map)) then
      figure = plot_map(plan, results)
    else
      figure = plot_values(plan, results)
    end if
  end function plot_borders

  !> Critical values with the argument of their multiplier, and which side is unstable.
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
        if (values(i)%above == "unstable") lines = lines // shade(i + 1, here(i), next_of(i))
        if (i == 1 .and. values(i)%below == "unstable") lines = lines // shade(1, minval(ends), here(i))
        lines = lines // "set label " // text(i) // " '" // concise(values(i)%value, 6) // "' at " &
          & // concise(places(i), 9) // "," // concise(values(i)%arg_rad / acos(-1.0_dp) + 0.04_dp, 4) &
          & // " rotate by 90 left font ',12'" // newline
      end do
      list = empty(size(values)) // "plot NaN notitle"
      do i = 1, size(kinds)
        if (any(values%kind == kinds(i))) list = list // ", 'boundary.csv' using (strcol('kind') eq '" // trim(kinds(i)) &
          & // "' ? X(column(2)) : 1e290):(column('arg_rad') / pi) with impulses lt " // text(i) // " notitle" &
          & // ", '' using (strcol('kind') eq '" // trim(kinds(i)) // "' ? X(column(2)) : 1e290):(column('arg_rad') / pi) " &
          & // "with points lt " // text(i) // " ps 1.2 title '" // trim(meanings(i)) // "'"
      end do
      if (any([values%above, values%below] == "unstable")) list = list // unstable_entry
    end associate
    figure = new_figure("boundary", "Borders of stability over " // trim(plan%paths(1)) // ": " // found(size(results%values)), &
      & lines // list // marks%entries // newline, width=800, height=440)
  contains
    !> The critical value behind number `i`, or the end of the range.
    pure real(dp) function next_of(i)
      integer, intent(in) :: i

      next_of = maxval(ends)
      associate (own => here > here(i) .and. results%values%vibration == results%values(i)%vibration)
        if (any(own)) next_of = minval(here, mask=own)
      end associate
    end function next_of
  end function plot_values

  !> Curves, their kinds told by dashes, and the unstable side of each.
  function plot_map(plan, results) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    type(figure_type) :: figure
    character(len=:), allocatable :: lines, list
    integer :: i, c

    associate (map => results%map, paths => plan%paths, units => plan%units, grid => plan%grid)
      lines = "set title heading noenhanced" // newline &
        & // parameter_axis("x", grid%axes(1), with_unit(paths(1), units(1)), 0.0_dp) &
        & // parameter_axis("y", grid%axes(2), with_unit(paths(2), units(2)), 0.0_dp) &
        & // "set key outside bottom center horizontal samplen 3" // newline
      lines = lines // unstable_side(grid, map)
      if (size(plan%base) == 2) lines = lines // input_point(grid%axes, plan%base)
      list = empty(map%curves) // "plot NaN notitle"
      if (map%curves > 0) list = list // ", $unstable using 1:3:1:2:3:4 with boxxyerror " // unstable_fill // " notitle" &
        & // unstable_entry
      do c = 1, map%curves
        do i = 1, size(kinds)
          if (any(map%vertices%curve == c .and. map%vertices%kind == kinds(i))) list = list // ", 'boundary.csv' using " &
            & // "(column(1) == " // text(c) // " && strcol('kind') eq '" // trim(kinds(i)) // "' ? X(column(2)) : NaN):" &
            & // "(Y(column(3))) with lines lt " // text(i) // " lw 2.5 notitle"
        end do
      end do
      do i = 1, size(kinds)
        if (any(map%vertices%kind == kinds(i))) list = list // ", keyentry with lines lt " // text(i) // " lw 2.5 title '" &
          & // trim(meanings(i)) // "'"
      end do
    end associate
    figure = new_figure("boundary", "Borders of stability over " // trim(plan%paths(1)) // " and " // trim(plan%paths(2)) // ": " &
      & // found(results%map%curves), lines // list // newline, width=800, height=560)
  end function plot_map

  !> The data block $unstable: boxes on the unstable side, x from, to, y from, to.
  pure function unstable_side(grid, map) result(lines)
    type(grid_type), intent(in) :: grid
    type(border_map_type), intent(in) :: map
    character(len=:), allocatable :: lines
    real(dp) :: points(2, size(map%vertices)), low(2), wide(2), box(4)
    real(dp), allocatable :: boxes(:, :)
    integer, allocatable :: order(:)
    logical :: mirrored
    integer :: i, k

    if (map%curves == 0) then
      lines = ""
      return
    end if
    mirrored = .false.
    do k = 1, 2
      associate (ends => coordinate(grid%axes(k), [grid%axes(k)%from, grid%axes(k)%to]))
        low(k) = minval(ends)
        wide(k) = maxval(ends) - low(k)
      end associate
      points(k, :) = (coordinate(grid%axes(k), map%vertices%parameters(k)) - low(k)) / wide(k)
      ! the logarithm of negative values falls: what was on the left is on the right
      mirrored = mirrored .neqv. (grid%axes(k)%logarithmic .and. grid%axes(k)%from < 0)
    end do
    order = [(i, i = 1, size(points, 2))]
    if (mirrored) order = order(size(order):1:-1)
    boxes = left_side(points(:, order), (map%vertices(order)%curve))
    lines = "$unstable << END" // newline // "from,to,from,to" // newline
    do i = 1, size(boxes, 2)
      box = [low(1) + wide(1) * boxes(:2, i), low(2) + wide(2) * boxes(3:, i)]
      lines = lines // concise(box(1), 6) // "," // concise(box(2), 6) // "," // concise(box(3), 6) // "," // concise(box(4), 6) &
        & // newline
    end do
    lines = lines // "END" // newline
  end function unstable_side

  !> What an empty picture says.
  pure function empty(number) result(line)
    integer, intent(in) :: number
    character(len=:), allocatable :: line

    line = ""
    if (number == 0) line = "set label 1 'none found' at graph 0.5,graph 0.5 center textcolor rgb '#444444'" // newline
  end function empty

  pure function found(number) result(words)
    integer, intent(in) :: number
    character(len=:), allocatable :: words

    words = text(number) // " found"
    if (number == 0) words = "none found"
  end function found

end module gestell_task_boundary_plot
