!> Plots sweeps: as curves against one parameter, or as charts of two parameters.
module gestell_task_sweep_plot
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: failed, impossible, operator(==), undamped, undecided, unstable, unstable_number, verdict_type
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_words, only: word_length
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_script, only: figure_type, new_figure, quoted
  use gestell_output_picture_axis, only: coordinate, decade_lines, extent_lines, parameter_axis, with_unit
  use gestell_output_picture_marks, only: boxes_where, input_marks, input_point, marks_type, unstable_entry
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_summary, only: summary_type
  use gestell_study_measure, only: measure_names, measure_type
  use gestell_study_tile_results, only: column_records, last_peak, log_rho_max, rho_error, rho_max, sweep_columns, verdict, xi_peak
  implicit none (type, external)
  private

  public :: plot_sweep

  !> A finite coordinate outside every plot.
  character(len=*), parameter :: nowhere = "1e290"
  !> Maximum number of measures that are drawn in one panel.
  integer, parameter :: most_measures = 4

contains

  !> The plot sweep.gp of the requested columns of sweep.csv. `turns`: number of turns that the drive makes in a period.
  function plot_sweep(plan, turns, summary) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: turns
    type(summary_type), intent(in) :: summary
    type(figure_type) :: figure
    character(len=:), allocatable :: label, counts
    integer :: column(sweep_columns), ordered(count(plan%options%columns)), k

    label = turns_in_words(turns)
    if (plan%period_varies()) label = "the period of each point"
    label = "ln |ρ|max (growth in " // label // ")"
    counts = summary%tally()
    if (counts /= "") counts = ": " // counts
    ordered = plan%options%ordered()
    ! Numbers of the columns in sweep.csv; 0 for each column that was not requested.
    column = 0
    column(ordered) = [(size(plan%paths) + k, k = 1, size(ordered))]
    if (size(plan%grid%axes) > 1 .and. all(plan%grid%axes%count > 1)) then
      figure = plot_chart(plan, column, label, counts)
    else
      figure = plot_curves(plan, maxloc(plan%grid%axes%count, dim=1), column, label, counts, summary)
    end if
  end function plot_sweep

  !> Plots curves against parameter number `k`, the only one that varies. `label`: axis label for the growth. `counts`: verdicts
  !> that the title lists.
  function plot_curves(plan, k, column, label, counts, summary) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: k, column(sweep_columns)
    character(len=*), intent(in) :: label, counts
    type(summary_type), intent(in) :: summary
    type(figure_type) :: figure
    type(marks_type) :: marks
    character(len=:), allocatable :: lines, x, style, axis_lines, half, unstable_rows, margins
    character(len=16) :: symbols(xi_peak:last_peak)
    !> Width of the boxes for shading, relative to the distance of the values. It is slightly larger than 1, so that there are no
    !> gaps.
    real(dp), parameter :: overlap = 1.05_dp
    logical :: growth, peaks, bounds
    real(dp) :: ends(2), height
    integer :: panels, i, j, n, before

    growth = any(column([rho_max, log_rho_max, verdict]) > 0)
    peaks = any(column(xi_peak:last_peak) > 0)
    bounds = column(rho_error) > 0 .and. plan%options%names_columns
    panels = count([growth, peaks, bounds]) + (plan%options%measured() + most_measures - 1) / most_measures
    height = 200 + 240 * max(panels, 1)
    margins = "0.12,0.86 spacing 0,0.1"
    if (panels > 1) margins = concise(85 / height, 3) // "," // concise(1 - 100 / height, 3) // " spacing 0," &
      & // concise(68 / height, 3)
    x = "(X(column(" // text(k) // ")))"
    style = "with lines"
    if (plan%grid%axes(k)%count < 30) style = "with linespoints ps 0.5"
    axis_lines = parameter_axis("x", plan%grid%axes(k), with_unit(plan%paths(k), plan%units(k)), 0.0_dp)
    marks = input_marks(plan%grid%axes(k), pack(plan%base, [(i == k, i = 1, size(plan%base))]), plan%units(k))
    unstable_rows = ""
    if (column(verdict) > 0 .and. summary%verdicts(unstable_number) > 0) then
      unstable_rows = "strcol(" // text(column(verdict)) // ") eq 'unstable'"
    end if
    if (column(verdict) == 0 .and. growth .and. summary%most > 1) unstable_rows = growth_of(column) // " > 0"
    associate (axis => plan%grid%axes(k))
      ends = coordinate(axis, [axis%from, axis%to])
      half = concise(overlap * abs(ends(2) - ends(1)) / (2 * max(1, axis%count - 1)), 6)
    end associate
    lines = "set multiplot layout " // text(max(panels, 1)) // ",1 margins 0.13,0.97," // margins // " title heading noenhanced" &
      & // newline // axis_lines // marks%lines &
      & // "set key at graph 1,graph 1.02 bottom right horizontal samplen 2 font ',12'" // newline
    if (panels > 1) lines = lines // "unset xlabel" // newline
    if (growth) lines = lines // growth_panel(column, x, style, label, summary, shades("low", "high"))
    n = count([growth])
    if (bounds) call add([column(rho_error)], ["error of |ρ|"], "1", "bound on the error")
    do i = xi_peak, last_peak
      symbols(i) = trim(column_records(i)%symbol) // " (m" // trim(column_records(i)%unit) // ")"
    end do
    if (peaks) call add(column(xi_peak:last_peak), symbols, "1e3", "peak of the vibration")
    before = size(plan%paths) + count(plan%options%columns)
    do i = 1, plan%options%measured(), most_measures
      associate (shown => [(j, j = i, min(i + most_measures - 1, plan%options%measured()))])
        call add(before + 2 * shown - 1, title_of(plan%options%measures(shown)), "1", "vibration")
      end associate
    end do
    if (panels == 0) lines = lines // "set yrange [0:1]; plot NaN notitle" // newline
    figure = new_figure("sweep", "Sweep over " // trim(plan%paths(k)) // counts, lines // "unset multiplot" // newline, &
      & width=800, height=nint(height))

  contains

    !> Adds a panel with a logarithmic axis. `columns`: numbers of columns in sweep.csv, 0 for none. `factor`: factor on their
    !> values. Only the last one of several panels has a label for the parameter.
    subroutine add(columns, titles, factor, label)
      integer, intent(in) :: columns(:)
      character(len=*), intent(in) :: titles(:), factor, label

      n = n + 1
      if (n == panels .and. panels > 1) lines = lines // axis_lines
      lines = lines // logarithmic_panel(columns, titles, factor, label, x, style, shades("bottom", "top"))
    end subroutine add

    !> Parts of the plot command that shade the unstable ranges, and their legend entries.
    pure function shades(low, high) result(words)
      character(len=*), intent(in) :: low, high
      character(len=:), allocatable :: words

      words = marks%entries
      if (unstable_rows /= "") words = boxes_where("sweep.csv", unstable_rows, x, half, low, high) // unstable_entry // words
    end function shades
  end function plot_curves

  !> The panel of ln |rho| against the parameter, where rho is the multiplier with the largest modulus. Points whose verdict is
  !> not `stable` are marked.
  pure function growth_panel(column, x, style, label, summary, shades) result(lines)
    integer, intent(in) :: column(sweep_columns)
    character(len=*), intent(in) :: x, style, label, shades
    type(summary_type), intent(in) :: summary
    character(len=:), allocatable :: lines, marks
    type(verdict_type) :: mark
    integer :: i
    type(verdict_type), parameter :: marked(5) = [unstable, undecided, impossible, failed, undamped]
    character(len=*), parameter :: points(5) = [character(len=32) :: "lt 2 pt 7 ps 0.6", "lt 5 pt 9 ps 0.8", &
      & "lt 8 pt 2 ps 0.8", "lt 7 pt 1 ps 0.9", "lt 5 pt 8 ps 0.8"]

    if (column(rho_max) + column(log_rho_max) > 0) then
      lines = "growth(r) = r > 0 ? log(r) : NaN" // newline // extent_lines("sweep.csv", [growth_of(column)]) &
        & // "low = low > 0 ? 0 : low; high = high < 0 ? 0 : high" // newline &
        & // "step = 0.06 * (high - low); low = low - step; high = high + step" // newline &
        & // "set yrange [low:high]; set ylabel '" // label // "'" // newline &
        & // "set object 1 rectangle from graph 0,graph 0 to graph 1,first 0 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 " &
        & // "noborder" // newline &
        & // "set arrow 1 from graph 0,first 0 to graph 1,first 0 nohead front lt 7 dt 1 lw 1.5" // newline &
        & // "curve(v) = v > low && v < high ? v : NaN" // newline &
        & // "plot NaN notitle" // shades // ", for [i=1:(high < 1e299)] 'sweep.csv' using " // x // ":(" // growth_of(column) &
        & // ") " // style // " lt 1 notitle"
      marks = growth_of(column)
    else
      lines = "low = 0; high = 1; set yrange [0:1]; unset ytics; set ylabel 'verdict'" // newline // "plot NaN notitle" // shades
      marks = "0.5"
    end if
    if (column(verdict) > 0) then
      do i = 1, size(marked)
        mark = marked(i)
        if (summary%verdicts(mark%number()) == 0) cycle
        lines = lines // ", 'sweep.csv' using " // x // ":(strcol(" // text(column(verdict)) // ") eq '" &
          & // trim(mark%word()) // "' ? " // either("low + 0.04 * (high - low)", marks, mark == impossible .or. mark == failed) &
          & // " : " // nowhere // ") with points " // trim(points(i)) &
          & // either(" notitle", " title '" // trim(mark%word()) // "'", mark == unstable)
      end do
    end if
    lines = lines // newline // "unset object 1; unset arrow 1; set ytics" // newline
  end function growth_panel

  !> Title of a measure: its name and its unit.
  elemental character(len=word_length + 16) function title_of(measure) result(title)
    type(measure_type), intent(in) :: measure

    title = trim(measure%quantity) // " " // trim(measure_names(measure%kind)) // " (" // trim(measure%unit) // ")"
  end function title_of

  !> A panel with a logarithmic axis. It shows columns of sweep.csv, given by their numbers (0 for none) and multiplied by `factor`.
  pure function logarithmic_panel(column, titles, factor, label, x, style, shades) result(lines)
    integer, intent(in) :: column(:)
    character(len=*), intent(in) :: titles(:), factor, label, x, style, shades
    character(len=:), allocatable :: lines
    integer :: i

    lines = "over(v) = v > 0 ? v * " // factor // " : NaN" // newline // "least = 1e300; most = 0" // newline
    do i = 1, size(column)
      if (column(i) == 0) cycle
      lines = lines // extent_lines("sweep.csv", ["over(column(" // text(column(i)) // "))"]) &
        & // "valid" // text(i) // " = high > 0 && most >= 0" // newline &
        & // "if (low > 0) { least = low < least ? low : least; most = high > most ? high : most } else { valid" // text(i) &
        & // " = 0 }" // newline
    end do
    lines = lines // "if (most > 0) { least = least > 1e-9 * most ? least : 1e-9 * most" // newline &
      & // decade_lines("least / 1.5", "most * 1.5") // "} else { bottom = 0; top = 1; set yrange [0:1] }" // newline &
      & // "set ylabel '" // label // "'" // newline // "plot NaN notitle" // shades
    do i = 1, size(column)
      if (column(i) == 0) cycle
      lines = lines // ", for [i=1:valid" // text(i) // "] 'sweep.csv' using " // x // ":(over(column(" // text(column(i)) &
        & // "))) " // style // " lt " // text(i) // " title " // quoted(trim(titles(i))) // " noenhanced"
    end do
    lines = lines // newline
  end function logarithmic_panel

  !> Plots charts of two parameters: one for ln |rho| (rho: multiplier with the largest modulus), and one for each other column
  !> that the input requests.
  function plot_chart(plan, column, growth_label, counts) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: column(sweep_columns)
    character(len=*), intent(in) :: growth_label, counts
    type(figure_type) :: figure
    character(len=:), allocatable :: lines, charts, multiplot
    integer :: i, across, down, n

    n = 0
    charts = ""
    if (any(column([log_rho_max, rho_max]) > 0)) call add(growth_of(column), growth_label, .true.)
    if (n == 0 .or. plan%options%names_columns) then
      do i = 1, plan%options%measured()
        call add_decades(1 + 2 * i + count(plan%options%columns), trim(title_of(plan%options%measures(i))))
      end do
      if (column(verdict) > 0 .and. .not. plan%options%verdict_last) call add("(strcol(" // text(column(verdict)) &
        & // ") eq 'stable' ? -1 : strcol(" // text(column(verdict)) &
        & // ") eq 'unstable' ? 1 : strstrt('undamped undecided', strcol(" // text(column(verdict)) // ")) > 0 ? 0 : NaN)", &
        & "-1: stable, 0: undamped or undecided, 1: unstable", .true.)
      do i = xi_peak, last_peak
        if (column(i) > 0) call add_decades(column(i), trim(column_records(i)%symbol) // " peak (" &
          & // trim(column_records(i)%unit) // ")")
      end do
      if (column(rho_error) > 0) call add_decades(column(rho_error), "the error of |ρ|")
    end if
    lines = "if (!exists('over')) { over = '' }" // newline // "growth(r) = r > 0 ? log(r) : NaN" // newline &
      & // "X(v) = v; Y(v) = v" // newline &
      & // parameter_axis("x", plan%grid%axes(1), with_unit(plan%paths(1), plan%units(1)), 0.5_dp / (plan%grid%axes(1)%count - 1)) &
      & // parameter_axis("y", plan%grid%axes(2), with_unit(plan%paths(2), plan%units(2)), 0.5_dp / (plan%grid%axes(2)%count - 1)) &
      & // "# stable: blue, paler toward the border; unstable: orange to brown; no result: grey" // newline
    if (size(plan%base) == 2) lines = lines // input_point(plan%grid%axes, plan%base)
    lines = lines // "set object 1 rectangle from graph 0,graph 0 to graph 1,graph 1 behind fillcolor rgb '#BBBBBB' fillstyle " &
      & // "solid 1 noborder" // newline // "set tics out; unset grid; set key off" // newline
    across = merge(2, 1, n > 1)
    down = (n + across - 1) / across
    multiplot = "set title heading noenhanced; set rmargin at screen 0.82" // newline
    if (n > 1) multiplot = "set rmargin 19; set multiplot layout " // text(down) // ",2 title heading noenhanced" // newline
    lines = lines // multiplot // charts
    if (n > 1) lines = lines // "unset multiplot" // newline
    figure = new_figure("sweep", "Chart over " // trim(plan%paths(1)) // " and " // trim(plan%paths(2)) // counts, lines, &
      & width=merge(1240, 800, n > 1), height=merge(120 + 480 * down, 600, n > 1))

  contains

    !> Adds a chart of the gnuplot expression `value`. `signed`: true if its values at stable points are negative.
    subroutine add(value, label, signed)
      character(len=*), intent(in) :: value, label
      logical, intent(in) :: signed

      n = n + 1
      charts = charts // extent_lines("sweep.csv", [value]) // "set cbrange [low:high]; set cblabel " // quoted(label) &
        & // " noenhanced" // newline
      if (signed) then
        charts = charts // "if (high <= 0) { set palette defined (low '#2A6FA8', high '#E4EEF5') }" // newline &
          & // "if (low >= 0) { set palette defined (low '#F3A65A', high '#7A2E00') }" // newline &
          & // "if (low < 0 && high > 0) { set palette defined (low '#2A6FA8', 0 '#E4EEF5', 0 '#F3A65A', high '#7A2E00') }" &
          & // newline
      else
        charts = charts // "set palette defined (0 '#FFFFFF', 1 '#56B4E9', 2 '#0072B2', 3 '#000000')" // newline
      end if
      charts = charts // "plot 'sweep.csv' using (X(column(1))):(Y(column(2))):(" // value // ") with image @over" // newline
    end subroutine add

    !> Adds a chart of the decimal logarithm of column number `number`.
    subroutine add_decades(number, name)
      integer, intent(in) :: number
      character(len=*), intent(in) :: name

      call add("growth(column(" // text(number) // ")) / log(10)", "lg of " // name, .false.)
    end subroutine add_decades

  end function plot_chart

  !> Gnuplot expression for ln |rho|, where rho is the multiplier with the largest modulus.
  pure function growth_of(column) result(expression)
    integer, intent(in) :: column(sweep_columns)
    character(len=:), allocatable :: expression

    expression = "growth(column(" // text(column(rho_max)) // "))"
    if (column(log_rho_max) > 0) expression = "column(" // text(column(log_rho_max)) // ")"
  end function growth_of

end module gestell_task_sweep_plot
