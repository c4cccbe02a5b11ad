!> Draws the plots of a design.
module gestell_task_design_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_base_words, only: character_count
  use gestell_output_picture_axis, only: decade_lines
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, unit_of
  use gestell_output_table, only: table_type
  use gestell_output_table_result_units, only: conversion_type
  use gestell_output_picture_script, only: figure_type, new_figure, picture_width, quoted, tic, tics
  use gestell_task_design_plan, only: design_plan_type
  use gestell_task_design_report, only: worst_of
  use gestell_task_design_search, only: design_type
  implicit none (type, external)
  private

  public :: plot_curve, plot_goals, plot_parameters, plot_range, plot_starts

  !> Maximum length of the name of a column
  integer, parameter :: longest_column = 160

contains

  !> The plot design.gp: position of each parameter in its range, before and after the design.
  type(figure_type) function plot_parameters(plan) result(figure)
    type(design_plan_type), intent(in) :: plan
    character(len=:), allocatable :: lines
    integer :: n, i

    n = size(plan%paths)
    lines = "set title heading noenhanced" // newline // "set xrange [-0.05:1.05]; set yrange [" // text(n) // ".5:0.5]" &
      & // newline // "set xlabel ""position in the range\n0: lower end, 1: upper end""; set ytics noenhanced (" &
      & // tics(plan%paths, 1) // ")" // newline &
      & // "set key at screen 0.5,screen 0.01 bottom center horizontal; set bmargin 7; set lmargin " &
      & // text(min(44, 4 + maxval([(character_count(trim(plan%paths(i))), i = 1, n)]))) // newline &
      & // "place(x) = (column(x) - column('lower')) / (column('upper') - column('lower'))" // newline &
      & // "plot 'design.csv' using (0):($0 + 1):(1):(0) with vectors nohead lt 8 notitle, " &
      & // "'' using (place('before')):($0 + 1) with points lt 8 pt 6 ps 1.5 lw 2 title 'before', " &
      & // "'' using (place('after')):($0 + 1) with points lt 1 pt 7 ps 1.3 title 'after'" // newline
    figure = new_figure("design", "Design parameters within their ranges", lines, height=176 + 34 * n)
  end function plot_parameters

  !> The plot design_starts.gp: objective at the local optimum that was reached from each start.
  type(figure_type) function plot_starts(objectives) result(figure)
    real(dp), intent(in) :: objectives(:)

    figure = new_figure("design_starts", "Objective at the local optimum from each start", "set title heading noenhanced" &
      & // newline // "set xlabel 'start'; set ylabel 'weighted objective'; set yrange [0:" &
      & // merge("1", "*", all(abs(objectives) <= 0)) // "]; set xrange [0.5:" // text(size(objectives)) // ".5]; set xtics 1,1" &
      & // newline // "set offsets 0, 0, graph 0.05, 0; set key bottom right" // newline &
      & // "plot 'design_starts.csv' using 1:(column('violation') > 0 ? NaN : $2) with points lt 1 pt 7 ps 1.2 " &
      & // "title 'limits met', '' using 1:(column('violation') > 0 ? $2 : NaN) with points lt 2 pt 6 ps 1.2 lw 2 " &
      & // "title 'limits not met'" // newline, height=400)
  end function plot_starts

  !> The plot design_goals.gp: value of each goal after the design, in per cent of its value before, together with the limits.
  type(figure_type) function plot_goals(design) result(figure)
    type(design_type), intent(in) :: design
    character(len=:), allocatable :: block, lines, marks
    real(dp) :: before(3), after(3), top
    integer :: g, longest
    !> Width of the picture in pixels if a name is long
    integer, parameter :: wide = 800

    block = ""
    marks = ""
    longest = 0
    top = 110
    do g = 1, size(design%goals)
      before = worst_of(design%before, design, g)
      after = worst_of(design%after, design, g)
      if (.not. abs(before(1)) > 0) cycle
      longest = max(longest, character_count(trim(design%goals(g)%name())))
      marks = marks // ", " // tic(trim(design%goals(g)%name())) // " " // text(g)
      block = block // text(g) // "," // concise(100 * after(1) / before(1), 6) // ","
      if (g > size(design%options%objectives)) then
        block = block // concise(100 * design%goals(g)%limit / before(1), 6)
        top = max(top, 110 * design%goals(g)%limit / before(1))
      else
        block = block // "NaN"
      end if
      block = block // newline
      top = max(top, 110 * after(1) / before(1))
    end do
    lines = "set title heading noenhanced" // newline // "$goals << END" // newline // "g,after,limit" // newline // block &
      & // "END" // newline // "set boxwidth 0.6; set style fill solid 0.6" // newline &
      & // "set bmargin 5; set key at screen 0.5,screen 0.01 bottom center horizontal" // newline &
      & // "set xrange [0.3:" // concise(size(design%goals) + 0.7_dp, 4) // "]; set yrange [0:" // concise(top, 5) // "]" &
      & // newline // "set ylabel 'after the design (% of before)'; set xtics noenhanced (" // marks(3:) // ")" // newline &
      & // "plot 100 with lines lt 8 dt 2 title 'before', $goals using 1:2 with boxes lt 1 title 'after', " &
      & // "'' using 1:2:(sprintf('%.3g', $2)) with labels offset 0,0.6 notitle, " &
      & // "'' using ($1 - 0.35):3:(0.7):(0) with vectors nohead lt 2 lw 2 title 'limit'" // newline
    figure = new_figure("design_goals", "Objectives and quantities with a limit, before and after the design", lines, &
      & height=480, width=merge(wide, picture_width, longest > 24))
  end function plot_goals

  !> The plot design_range.gp: first objective against the speed, before and after the design.
  type(figure_type) function plot_range(plan, table) result(figure)
    type(design_plan_type), intent(in) :: plan
    !> The table design_range.csv
    type(table_type), intent(in) :: table
    !> The axis is logarithmic if the largest value is so many times the smallest: otherwise the design would lie on the axis.
    real(dp), parameter :: flat = 30
    character(len=:), allocatable :: lines, style, name, y_axis
    character(len=longest_column) :: columns(2)
    type(axis_unit_type) :: unit
    real(dp) :: values(2)

    ! With tolerances the values do not form a curve, so they are plotted as points. Maxima between the given speeds are at the end
    ! of the file, so the points are sorted by speed (`smooth unique`).
    style = trim(merge("with points                   ", "smooth unique with linespoints", plan%robust))
    name = trim(plan%options%objectives(1)%measure%name())
    if (table%number_of(name // "_before") == 0) name = trim(plan%options%objectives(1)%measure%quantity)
    columns = [character(len=longest_column) :: name // "_before", name // "_after"]
    unit = unit_of(table, columns)
    values = unit%factor * extremes(table, columns)
    y_axis = "set yrange [0:*]" // newline
    if (values(1) > 0 .and. values(2) > flat * values(1)) y_axis = decade_lines(concise(values(1) / 1.5_dp, 4), concise(1.5_dp &
      & * values(2), 4))
    lines = "set title heading noenhanced" // newline // "set xlabel 'crank speed (rpm)'; set ylabel " &
      & // quoted(label_with(trim(plan%options%objectives(1)%name()), unit)) // " noenhanced" // newline &
      & // y_axis // "set key top left" // newline // "plot 'design_range.csv' using (abs($1)):(" // trim(unit%words) &
      & // " * column(" // text(table%number_of(columns(1))) // ")) " // style // " lt 8 pt 7 ps 0.4 title 'before', " &
      & // "'' using (abs($1)):(" // trim(unit%words) // " * column(" // text(table%number_of(columns(2))) // ")) " // style &
      & // " lt 1 pt 7 ps 0.4 title 'after'" // newline
    figure = new_figure("design_range", "Objective over the speed, before and after the design", lines, &
      & height=480)
  end function plot_range

  !> The smallest and the largest number in some columns of a table.
  pure function extremes(table, columns) result(values)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: columns(:)
    real(dp) :: values(2)
    integer :: i

    values = [huge(1.0_dp), -huge(1.0_dp)]
    do i = 1, size(columns)
      associate (numbers => table%columns(table%number_of(columns(i)))%numbers)
        values = [min(values(1), minval(numbers)), max(values(2), maxval(numbers))]
      end associate
    end do
  end function extremes

  !> The plot design_trade_off.gp: trade-off curve between two objectives. The machine of the input and the design are marked as
  !> points.
  type(figure_type) function plot_curve(design, table) result(figure)
    type(design_type), intent(in) :: design
    !> The table design_trade_off.csv
    type(table_type), intent(in) :: table
    character(len=:), allocatable :: lines
    type(axis_unit_type) :: units(2)
    type(conversion_type) :: conversion
    real(dp) :: numbers(3, 2, 2)
    integer :: g

    do g = 1, 2
      numbers(:, g, 1) = worst_of(design%before, design, g)
      numbers(:, g, 2) = worst_of(design%after, design, g)
      conversion = table%units%conversion(design%options%objectives(g)%measure%unit)
      numbers(1, g, :) = conversion%converted(numbers(1, g, :))
    end do
    units = [unit_of(table, ["first"]), unit_of(table, ["second"])]
    lines = "set title heading noenhanced" // newline // "set key top right; set offsets graph 0.05, graph 0.05, graph 0.05, " &
      & // "graph 0.05" // newline // axis("x", 1) // axis("y", 2) // point("before", 1) // point("after", 2) &
      & // "plot 'design_trade_off.csv' using (" // trim(units(1)%words) // " * $1):(" // trim(units(2)%words) &
      & // " * $2) with linespoints lt 1 pt 7 ps 0.6 title 'best trade-off', " &
      & // "$before using 1:2 with points lt 8 pt 2 ps 1.5 lw 2 title 'machine of the input', " &
      & // "$after using 1:2 with points lt 2 pt 6 ps 1.8 lw 2 title 'design'" // newline
    figure = new_figure("design_trade_off", "Trade-off between the two objectives", lines, height=520)

  contains

    function axis(which, k) result(line)
      character(len=*), intent(in) :: which
      integer, intent(in) :: k
      character(len=:), allocatable :: line

      line = "set " // which // "label " // quoted(label_with(trim(design%options%objectives(k)%name()), units(k))) &
        & // " noenhanced" // newline
    end function axis

    function point(name, k) result(line)
      character(len=*), intent(in) :: name
      integer, intent(in) :: k
      character(len=:), allocatable :: line

      line = "$" // name // " << END" // newline // "x,y" // newline // concise(units(1)%factor &
        & * numbers(1, 1, k), 7) // "," // concise(units(2)%factor * numbers(1, 2, k), 7) // newline // "END" // newline
    end function point

  end function plot_curve

end module gestell_task_design_plot
