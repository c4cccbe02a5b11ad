!> Draws the pictures of results against the speed: resonance curves and their maxima.
module gestell_task_resonance_plot
  use gestell_base_verdict, only: failed, impossible, in_resonance, operator(/=), operator(==), state_word, undamped, undecided, &
    & unstable, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_output_picture_script, only: figure_type, new_figure, quoted
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, own_unit
  use gestell_output_picture_marks, only: beyond_colour, chart_marks, marks_type
  use gestell_output_picture_axis, only: decade_lines, extent_lines, tic_step
  use gestell_output_report_orders, only: order_as_fraction, order_of
  use gestell_output_picture_panels, only: height_of, key_line, layout_line, range_with_margin
  use gestell_output_picture_peaks, only: beyond_entry, peak_panel, peak_type
  use gestell_output_table, only: table_type
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_task_resonance_curve, only: resonance_curve_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: plot_peaks, plot_resonance

  !> Rows of a quantity's values that contain its peak (`of_peak`) and its rms (`of_rms`). The amplitudes of the orders follow
  integer, parameter :: of_peak = 1, of_rms = 3
  !> `most_below`: maximum number of panels in one column. `most_panels`: maximum number of panels. `max_orders`: maximum number of
  !> orders that are drawn
  integer, parameter :: most_below = 4, most_panels = 10, max_orders = 6
  !> The lower end of a panel is the larger of two values: `depth` times its maximum, and `below` times the lowest peak or rms
  real(dp), parameter :: depth = 1.0e-4_dp, below = 0.5_dp
  !> Height of the legend in pixels
  integer, parameter :: legend = 114

  !> States of points that have special marks, in the order of the marks in the legend
  type(verdict_type), parameter :: marked(6) = [undamped, undecided, unstable, in_resonance, impossible, failed]

contains

  !> The picture of the table `resonance`, which has one panel for each quantity.
  function plot_resonance(table, quantities, curve, turns, input) result(figure)
    type(table_type), intent(in) :: table
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    !> Number of turns that the crank makes in the period
    integer, intent(in) :: turns
    !> Speed that the input gives (1/min); empty if the input gives no speed
    real(dp), intent(in) :: input(:)
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    type(marks_type) :: marks
    !> `found`: true for each state in `marked` that occurs. `visible`: true for each order that is visible in a panel. `parts`:
    !> whether some motions are small (element 1), and whether some are not (element 2)
    logical :: found(size(marked)), visible(max_orders, most_panels), parts(2)
    logical :: small(size(curve%points))
    integer, allocatable :: harmonics(:)
    integer :: i, panels, across, rows

    found = [(any(curve%points%state == marked(i)), i = 1, size(found))]
    panels = min(size(quantities), most_panels)
    harmonics = curve%options%requested_harmonics()
    across = merge(1, 2, panels <= most_below)
    rows = (panels + across - 1) / across
    small = curve%points%moved%small()
    parts = [any(small .and. curve%has_values()), any(.not. small .and. curve%has_values())]
    marks = marks_of(curve, input)
    visible = .false.
    do i = 1, panels
      visible(:, i) = visible_orders(curve, i)
    end do
    lines = layout_line(panels, across, legend) // speed_tics(curve, across) // "set key off" // newline // "set xrange [" &
      & // concise(curve%points(1)%speed, 9) &
      & // ":" // concise(curve%points(size(small))%speed, 9) // "]" // newline // "set format x ''" // newline &
      & // "# each part of a curve with the first point of the next" // newline // "here = 0; there = 0" // newline &
      & // "small(v) = (before = here, here = strcol('small_motion') ne '0', before || here ? v : NaN)" // newline &
      & // "beyond(v) = (before = there, there = strcol('small_motion') eq '0', before || there ? v : NaN)" // newline &
      & // "tint(v) = strcol('small_motion') eq '0' ? 0x" // beyond_colour // " : 0x0072B2" // newline // marks%lines
    do i = 1, panels
      if (i == panels - across + 1) lines = lines // "set format x; set xlabel 'crank speed (rpm)'" // newline
      if (i == panels) lines = lines // "set key on at screen 0.5,screen 0.004 bottom center horizontal samplen 2 font ',12'" &
        & // newline
      lines = lines // curve_panel(quantities(i), visible(:, i))
      if (i == panels) lines = lines // key(any(visible, dim=2)) // marks%entries
      lines = lines // newline // "unset logscale y; set format y; set ytics autofreq" // newline
    end do
    figure = new_figure(table%name, "Response over the crank speed: peak, rms, and rms of each order", lines &
      & // "unset multiplot" // newline, height=legend + nint(height_of(rows)))

  contains

    !> Entries of the legend that all panels share. `orders`: true for orders that are visible.
    pure function key(orders) result(words)
      logical, intent(in) :: orders(:)
      character(len=:), allocatable :: words
      integer :: k

      words = entry("lines lt 1 lw 2.5", "peak") // entry("lines lt 2 lw 2", "rms")
      do k = 1, size(orders)
        if (orders(k)) words = words // entry("lines lt " // text(2 + k) // " lw 1.5", "order " // order_of(harmonics(k), turns))
      end do
      if (parts(2)) words = words // entry("lines lt 1 lc rgb '#" // beyond_colour // "' lw 2.5", "beyond small motions")
      do k = 1, size(found)
        if (found(k) .and. marked(k) /= unstable) words = words // entry("points lt 7 pt " // text(k) // " ps 0.6", &
          & trim(state_word(marked(k))))
      end do
    end function key

    !> The panel of one quantity. Its logarithmic axis covers at most four decades.
    pure function curve_panel(quantity, orders) result(lines)
      type(quantity_type), intent(in) :: quantity
      logical, intent(in) :: orders(:)
      character(len=:), allocatable :: lines, name
      type(axis_unit_type) :: unit
      integer :: k

      name = trim(quantity%name)
      unit = own_unit(table, name // "_peak")
      ! the axis ends above the small motions, for which the model holds
      lines = "holds(v) = " // either("strcol('small_motion') ne '0' ? v : NaN", "v", parts(1)) // newline &
        & // extent_lines("resonance.csv", ["holds(" // column(name // "_peak") // ")", "holds(" // column(name // "_rms") &
        & // ")"]) &
        & // "valid = high > 0 && low >= 0" // newline // "least = " // concise(below, 3) // " * low > " // concise(depth, 3) &
        & // " * high ? " // concise(below, 3) // " * low : " // concise(depth, 3) // " * high" // newline &
        & // "shown(v) = v == v ? " // trim(unit%words) &
        & // " * (v > 0.1 * least ? v : 0.1 * least) : NaN" // newline // "if (valid) {" // newline &
        & // decade_lines(trim(unit%words) // " * least", trim(unit%words) // " * 3 * high") // "} else { set yrange [0:1] }" &
        & // newline // "set ylabel " // quoted(label_with(quantity%name, unit)) // " noenhanced" // newline // "plot NaN notitle" &
        & // ", for [i=1:valid] 'resonance.csv' using 1:(shown(" // trim(column(name // "_peak")) // ")):(tint(0)) with lines " &
        & // "lt 1 lw 2.5 lc rgb variable notitle" // line(name // "_rms", 2, "2", "")
      do k = 1, size(orders)
        if (orders(k)) lines = lines // line(name // "_order_" // order_as_fraction(harmonics(k), turns), 2 + k, "1.5", &
          & "sqrt(0.5) * ")
      end do
      do k = 1, size(found)
        if (found(k)) lines = lines // ", 'resonance.csv' using (strcol(" // text(table%number_of("state")) // ") eq '" &
          & // trim(state_word(marked(k))) // "' ? column(1) : 1e290):(valid ? 1.2 * bottom : 0.03) with points lt 7 pt " &
          & // text(k) // " ps 0.6 notitle"
      end do
    end function curve_panel

    !> Part of a plot command that draws a column times `factor`. The line is grey where the motion is not small. Small and other
    !> motions are drawn separately, because lines with a colour for each point would lose their dashes.
    pure function line(name, style, width, factor) result(words)
      character(len=*), intent(in) :: name, width, factor
      integer, intent(in) :: style
      character(len=:), allocatable :: words, value

      value = "(shown(" // factor // trim(column(name)) // "))) with lines lt " // text(style) // " lw " // width
      words = ""
      if (parts(1)) words = ", for [i=1:valid] 'resonance.csv' using 1:(small" // value // " notitle"
      if (parts(2)) words = words // ", for [i=1:valid] 'resonance.csv' using 1:(beyond" // value // " lc rgb '#" &
        & // beyond_colour // "' notitle"
    end function line

    !> Gnuplot expression for the column called `name`.
    pure character(len=16) function column(name)
      character(len=*), intent(in) :: name

      column = "column(" // text(table%number_of(name)) // ")"
    end function column

  end function plot_resonance

  !> Gnuplot line for the tics on the speed axis if `across` panels share a row. In half a row there is room for few labels.
  pure function speed_tics(curve, across) result(line)
    type(resonance_curve_type), intent(in) :: curve
    integer, intent(in) :: across
    character(len=:), allocatable :: line
    real(dp) :: length

    line = ""
    length = abs(curve%points(size(curve%points))%speed - curve%points(1)%speed)
    if (across > 1 .and. length > 0) line = "set xtics " // concise(tic_step(length, 4), 3) // newline
  end function speed_tics

  !> Marks on the speed axis: the speed that the input gives, and ranges of speeds in which the machine is unstable.
  pure type(marks_type) function marks_of(curve, input) result(marks)
    type(resonance_curve_type), intent(in) :: curve
    real(dp), intent(in) :: input(:)

    associate (points => curve%points)
      marks = chart_marks([points(1)%speed, points(size(points))%speed], input, "rpm", (points%speed), points%state == unstable)
    end associate
  end function marks_of

  !> True for the orders whose rms reaches the lower end of the quantity's panel, so that they are visible.
  pure function visible_orders(curve, quantity) result(visible)
    type(resonance_curve_type), intent(in) :: curve
    integer, intent(in) :: quantity
    logical :: visible(max_orders)
    real(dp) :: low, high, most(max_orders)
    integer :: i, k

    low = huge(low)
    high = 0
    most = 0
    do i = 1, size(curve%points)
      associate (values => curve%points(i)%values(:, quantity))
        if (.not. all(ieee_is_finite(values))) cycle
        low = min(low, values(of_peak), values(of_rms))
        high = max(high, values(of_peak), values(of_rms))
        k = min(size(values) - of_rms, max_orders)
        most(:k) = max(most(:k), sqrt(0.5_dp) * values(of_rms + 1:of_rms + k))
      end associate
    end do
    visible = most > max(depth * high, below * low)
  end function visible_orders

  !> Part of a plot command that creates an entry of the legend.
  pure function entry(style, name) result(words)
    character(len=*), intent(in) :: style, name
    character(len=:), allocatable :: words

    words = ", keyentry with " // style // " title '" // name // "'"
  end function entry

  !> The picture of the table `peaks`: the maxima of each quantity against the speed, labelled with the strongest order.
  function plot_peaks(table, quantities, curve, turns, input) result(figure)
    type(table_type), intent(in) :: table
    type(quantity_type), intent(in) :: quantities(:)
    !> The curve, with the list of its maxima
    type(resonance_curve_type), intent(in) :: curve
    !> Number of turns that the crank makes in the period
    integer, intent(in) :: turns
    !> Speed that the input gives (1/min); empty if it gives no speed
    real(dp), intent(in) :: input(:)
    type(figure_type) :: figure
    type(marks_type) :: marks
    character(len=:), allocatable :: lines
    real(dp) :: range(2)
    integer :: i, panels, across

    range = curve%points([1, size(curve%points)])%speed
    marks = marks_of(curve, input)
    if (.not. all(curve%maxima%small)) marks%entries = beyond_entry // marks%entries
    panels = min(size(quantities), most_panels)
    across = merge(1, 2, panels <= most_below)
    lines = layout_line(panels, across) // speed_tics(curve, across) // marks%lines // "set xrange " &
      & // range_with_margin(range(1), range(2)) // newline // "set format x ''" // newline // "of(row) = int(word('"
    ! the gnuplot function of(row) returns the number of the quantity in a row of the file
    do i = 1, size(curve%maxima)
      lines = lines // text(curve%maxima(i)%quantity) // " "
    end do
    lines = lines // "', int(row) + 1))" // newline
    do i = 1, panels
      if (i == panels - across + 1) lines = lines // "set format x; set xlabel 'crank speed (rpm)'" // newline
      lines = lines // key_line(i == across) // peak_panel(own_peaks(i), range, trim(quantities(i)%name), &
        & trim(quantities(i)%unit), table%units, table%name // ".csv", "column('speed_rpm')", "column('value')", &
        & ["of($0) == " // text(i)], [" "], marks%entries)
    end do
    figure = new_figure(table%name, "Resonance peaks (" // text(size(curve%maxima)) // "), labelled with the strongest order", &
      & lines // "unset multiplot" // newline, height=nint(height_of((panels + across - 1) / across)))

  contains

    !> The maxima of quantity number `q`.
    pure function own_peaks(q) result(peaks)
      integer, intent(in) :: q
      type(peak_type) :: peaks(count(curve%maxima%quantity == q))
      integer :: k, n

      n = 0
      do k = 1, size(curve%maxima)
        associate (maximum => curve%maxima(k))
          if (maximum%quantity /= q) cycle
          n = n + 1
          peaks(n) = peak_type(maximum%speed, maximum%value, maximum%small, order_of(maximum%strongest_order, turns) // "×")
        end associate
      end do
    end function own_peaks

  end function plot_peaks

end module gestell_task_resonance_plot
