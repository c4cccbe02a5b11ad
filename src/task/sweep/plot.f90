!> Pictures of sweeps: curves over one parameter, a chart over two.
module gestell_task_sweep_plot
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: failed, impossible, operator(==), undamped, undecided, unstable, unstable_number, verdict_type
  use gestell_base_text, only: concise, text
  use gestell_base_words, only: word_length
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_script, only: figure_type, new_figure, quoted
  use gestell_output_picture_axis, only: coordinate, decade_lines, extent_lines, parameter_axis, with_unit
  use gestell_output_picture_marks, only: boxes_where, input_marks, input_point, marks_type, unstable_entry
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_summary, only: summary_type, verdict_count_type
  use gestell_study_grid, only: axis_type
  use gestell_study_measure, only: measure_names
  use gestell_study_point, only: sweep_options
  use gestell_study_tile_results, only: last_peak, log_rho_max, rho_error, rho_max, sweep_columns, verdict, verdict_behind, xi_peak
  implicit none (type, external)
  private

  public :: plot_sweep

  character, parameter :: newline = new_line("a")
  !> Beyond any picture, but finite.
  character(len=*), parameter :: nowhere = "1e290"
  !> Of what is measured that many are drawn in one panel.
  integer, parameter :: most_measures = 4

contains

  !> sweep.gp, from the columns of sweep.csv that were ordered; so many turns of the drive are a period.
  function plot_sweep(plan, turns, summary) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: turns
    type(summary_type), intent(in) :: summary
    type(figure_type) :: figure
    character(len=:), allocatable :: label
    integer :: k

    label = turns_in_words(turns)
    if (plan%period_varies()) label = "the period of each"
    label = "ln |ρ|max (growth in " // label // ")"
    if (size(plan%grid%axes) > 1 .and. all(plan%grid%axes%count > 1)) then
      figure = plot_chart(plan, plan%options, label, summary)
    else
      k = maxloc(plan%grid%axes%count, dim=1)
      figure = plot_curves(plan, k, plan%options, label, summary)
    end if
  end function plot_sweep

  !> Over parameter `k`, in whose column it stands; the only one that runs. `label`: of the growth.
  function plot_curves(plan, k, options, label, summary) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: k
    type(sweep_options), intent(in) :: options
    character(len=*), intent(in) :: label
    type(summary_type), intent(in) :: summary
    type(figure_type) :: figure
    type(marks_type) :: marks
    character(len=:), allocatable :: lines, x, style, axis_lines, half, unstable_rows
    logical :: growth, peaks, bounds
    integer :: column(sweep_columns), panels, i, n

    column = column_numbers(options%columns, size(plan%paths))
    growth = any(options%columns([rho_max, log_rho_max, verdict, verdict_behind]))
    peaks = any(options%columns(xi_peak:last_peak))
    bounds = options%columns(rho_error) .and. options%names_columns
    panels = count([growth, peaks, bounds]) + (options%measured() + most_measures - 1) / most_measures
    x = "(X(column(" // text(k) // ")))"
    style = "with lines"
    if (plan%grid%axes(k)%count < 30) style = "with linespoints ps 0.5"
    axis_lines = parameter_axis("x", plan%grid%axes(k), with_unit(plan%paths(k), plan%units(k)), 0.0_dp)
    marks = input_marks(plan%grid%axes(k), pack(plan%base, [(i == k, i = 1, size(plan%base))]), plan%units(k))
    unstable_rows = ""
    if (column(verdict) > 0 .and. summary%verdicts(unstable_number) > 0) unstable_rows = "strcol(" // text(column(verdict)) &
      & // ") eq 'unstable'"
    if (column(verdict) == 0 .and. growth .and. summary%most > 1) unstable_rows = growth_of(column) // " > 0"
    half = concise(half_step(plan%grid%axes(k)), 6)
    lines = "set multiplot layout " // text(max(panels, 1)) // ",1 margins 0.13,0.97," // margins(panels) // newline &
      & // axis_lines // marks%lines &
      & // "set key at graph 1,graph 1.02 bottom right horizontal samplen 2 font ',12'" // newline
    if (panels > 1) lines = lines // "unset xlabel" // newline
    if (growth) lines = lines // growth_panel(column, x, style, label, summary, shades("low", "high"))
    n = count([growth])
    if (bounds) call add(logarithmic_panel([column(rho_error)], ["error of |ρ|"], "1", "bound on the error", x, style, &
      & shades("bottom", "top")))
    if (peaks) call add(peaks_panel(column, x, style, shades("bottom", "top")))
    do i = 1, options%measured(), most_measures
      call add(measures_panel(options, i, size(plan%paths), x, style, shades("bottom", "top")))
    end do
    if (panels == 0) lines = lines // "set yrange [0:1]; plot NaN notitle" // newline
    figure = new_figure("sweep", "Sweep over " // trim(plan%paths(k)) // tally(summary), lines // "unset multiplot" // newline, &
      & width=800, height=height_of(panels))

  contains

    !> Adds a panel; only the last of several labels the axis.
    subroutine add(panel)
      character(len=*), intent(in) :: panel

      n = n + 1
      if (n == panels .and. panels > 1) lines = lines // axis_lines
      lines = lines // panel
    end subroutine add

    !> What is unstable, and entries of the key.
    pure function shades(low, high) result(words)
      character(len=*), intent(in) :: low, high
      character(len=:), allocatable :: words

      words = marks%entries
      if (unstable_rows /= "") words = boxes_where("sweep.csv", unstable_rows, x, half, low, high) // unstable_entry // words
    end function shades
  end function plot_curves

  !> Room below, above and between so many panels, and the heading.
  pure function margins(panels) result(words)
    integer, intent(in) :: panels
    character(len=:), allocatable :: words
    real(dp) :: height

    words = merge("0.12,0.86", "0.17,0.8 ", panels < 2) // " spacing 0,0.1"
    height = height_of(panels)
    if (panels > 1) words = concise(85 / height, 3) // "," // concise(1 - 100 / height, 3) // " spacing 0," &
      & // concise(68 / height, 3)
    words = words // " title heading noenhanced"
  end function margins

  !> Pixels of a picture of so many panels.
  pure integer function height_of(panels)
    integer, intent(in) :: panels

    height_of = 200 + 240 * max(panels, 1)
  end function height_of

  !> Half the distance between values, as on the axis, and a little more: boxes without seams.
  pure real(dp) function half_step(axis)
    type(axis_type), intent(in) :: axis
    real(dp), parameter :: overlap = 1.05_dp
    real(dp) :: ends(2)

    ends = coordinate(axis, [axis%from, axis%to])
    half_step = overlap * abs(ends(2) - ends(1)) / (2 * max(1, axis%count - 1))
  end function half_step

  !> ln |rho| over the parameter, the points of bad verdicts marked.
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
          & // trim(mark%word()) // "' ? "
        if (mark == impossible .or. mark == failed) then
          lines = lines // "low + 0.04 * (high - low)"
        else
          lines = lines // marks
        end if
        lines = lines // " : " // nowhere // ") with points " // trim(points(i))
        if (mark == unstable) then
          lines = lines // " notitle"
        else
          lines = lines // " title '" // trim(mark%word()) // "'"
        end if
      end do
    end if
    lines = lines // newline // "unset object 1; unset arrow 1; set ytics" // newline
  end function growth_panel

  !> Peaks of the degrees of freedom on a logarithmic axis.
  pure function peaks_panel(column, x, style, shades) result(lines)
    integer, intent(in) :: column(sweep_columns)
    character(len=*), intent(in) :: x, style, shades
    character(len=:), allocatable :: lines

    lines = logarithmic_panel(column(xi_peak:last_peak), [character(len=13) :: "ξ (mm)", "η (mm)", "ψ (mrad)", "ζ (mm)", &
      & "rot ξ (mrad)", "rot η (mrad)"], "1e3", "peak of the vibration", x, style, shades)
  end function peaks_panel

  !> What is measured of quantities, in their units, on a logarithmic axis: from the `first` on as many as have room for their
  !> names.
  pure function measures_panel(options, first, parameters, x, style, shades) result(lines)
    type(sweep_options), intent(in) :: options
    integer, intent(in) :: first, parameters
    character(len=*), intent(in) :: x, style, shades
    character(len=:), allocatable :: lines
    character(len=word_length + 16) :: titles(min(most_measures, options%measured() - first + 1))
    integer :: k

    do k = 1, size(titles)
      associate (measure => options%measures(first + k - 1))
        titles(k) = trim(measure%quantity) // " " // trim(measure_names(measure%kind)) // " (" // trim(measure%unit) // ")"
      end associate
    end do
    lines = logarithmic_panel([(parameters + count(options%columns) + 2 * (first + k) - 3, k = 1, size(titles))], titles, "1", &
      & "of the vibration", x, style, shades)
  end function measures_panel

  !> Columns of sweep.csv by their numbers, 0 for none, times a factor.
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

  !> Over two parameters: ln |rho| as a chart, and all other columns that the input names.
  function plot_chart(plan, options, growth_label, summary) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    type(sweep_options), intent(in) :: options
    character(len=*), intent(in) :: growth_label
    type(summary_type), intent(in) :: summary
    type(figure_type) :: figure
    character(len=*), parameter :: peaks(xi_peak:last_peak) = [character(len=20) :: "ξ peak (m)", "η peak (m)", "ψ peak (rad)", &
      & "ζ peak (m)", "rot ξ peak (rad)", "rot η peak (rad)"]
    character(len=:), allocatable :: lines, charts, multiplot
    integer :: column(sweep_columns), i, across, down, n

    column = column_numbers(options%columns, 2)
    n = 0
    charts = ""
    if (any(options%columns([log_rho_max, rho_max]))) call add(growth_of(column), growth_label, .true.)
    if (n == 0 .or. options%names_columns) then
      do i = 1, options%measured()
        associate (measure => options%measures(i))
          call add(decades(1 + 2 * i + count(options%columns)), "lg of " // trim(measure%quantity) // " " &
            & // trim(measure_names(measure%kind)) // " (" // trim(measure%unit) // ")", .false.)
        end associate
      end do
      if (options%columns(verdict)) call add("(strcol(" // text(column(verdict)) // ") eq 'stable' ? -1 : strcol(" &
        & // text(column(verdict)) // ") eq 'unstable' ? 1 : strstrt('undamped undecided', strcol(" // text(column(verdict)) &
        & // ")) > 0 ? 0 : NaN)", "-1 stable, 0 undamped or undecided, 1 unstable", .true.)
      do i = xi_peak, last_peak
        if (options%columns(i)) call add(decades(column(i)), "lg of " // trim(peaks(i)), .false.)
      end do
      if (options%columns(rho_error)) call add(decades(column(rho_error)), "lg of the error of |ρ|", .false.)
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
    figure = new_figure("sweep", "Chart over " // trim(plan%paths(1)) // " and " // trim(plan%paths(2)) // tally(summary), lines, &
      & width=merge(1240, 800, n > 1), height=merge(120 + 480 * down, 600, n > 1))

  contains

    !> A chart of `value`, an expression of gnuplot's, `signed` where it is negative for what is stable.
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

    !> The decimal logarithm of a column.
    pure function decades(number) result(value)
      integer, intent(in) :: number
      character(len=:), allocatable :: value

      value = "growth(column(" // text(number) // ")) / log(10)"
    end function decades

  end function plot_chart

  !> Column numbers in sweep.csv, 0 where one was not ordered.
  pure function column_numbers(columns, parameters) result(column)
    logical, intent(in) :: columns(sweep_columns)
    integer, intent(in) :: parameters
    integer :: column(sweep_columns)
    integer :: i

    column = [(merge(parameters + count(columns(:i)), 0, columns(i)), i = 1, sweep_columns)]
    if (columns(verdict_behind)) column(verdict) = column(verdict_behind)
  end function column_numbers

  !> ln |rho| of the greatest multiplier.
  pure function growth_of(column) result(expression)
    integer, intent(in) :: column(sweep_columns)
    character(len=:), allocatable :: expression

    if (column(log_rho_max) > 0) then
      expression = "column(" // text(column(log_rho_max)) // ")"
    else
      expression = "growth(column(" // text(column(rho_max)) // "))"
    end if
  end function growth_of

  !> How many points have which verdict.
  pure function tally(summary) result(words)
    type(summary_type), intent(in) :: summary
    character(len=:), allocatable :: words
    type(verdict_count_type), allocatable :: counts(:)
    integer :: i

    words = ""
    counts = summary%verdict_counts()
    do i = 1, size(counts)
      if (i > 1) words = words // ", "
      words = words // concise(real(counts(i)%points, dp), 12) // " " // trim(counts(i)%verdict%word())
    end do
    if (words /= "") words = ": " // words
  end function tally

end module gestell_task_sweep_plot
