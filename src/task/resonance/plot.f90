!> Pictures of what is looked at over the speed: resonance curves and their maxima.
module gestell_task_resonance_plot
  use gestell_base_verdict, only: failed, impossible, in_resonance, operator(/=), operator(==), state_word, undamped, undecided, &
    & unstable, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_base_words, only: character_count
  use gestell_output_picture_script, only: figure_type, new_figure, quoted, tic
  use gestell_output_picture_marks, only: apart, beyond_colour, chart_marks, marks_type
  use gestell_output_picture_axis, only: decade_lines, extent_lines
  use gestell_output_report_orders, only: order_of
  use gestell_output_picture_panels, only: height_of, layout_line, with_rim
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_task_resonance_curve, only: resonance_curve_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: plot_peaks, plot_resonance

  character, parameter :: newline = new_line("a")
  !> Columns before those of the quantities: speed, state, refined; of each before the orders: peak, its error, rms.
  integer, parameter :: before = 3, of_peak = 1, of_rms = 3
  !> Panels in one column, and in all; orders that are drawn; maxima of a quantity that have room for their values.
  integer, parameter :: most_below = 4, most_panels = 10, most_orders = 6, most_labelled = 8
  !> A panel's decades, and its lower end below the lowest peak or rms.
  real(dp), parameter :: depth = 1.0e-4_dp, below = 0.5_dp
  !> Pixels of the legend.
  integer, parameter :: legend = 62

  !> States of points with marks of their own, in the order of the marks.
  type(verdict_type), parameter :: marked(6) = [undamped, undecided, unstable, in_resonance, impossible, failed]

contains

  !> resonance.gp; so many turns of the drive are a period; `input`: the input's own speed (1/min), or nothing.
  function plot_resonance(quantities, curve, turns, input) result(figure)
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    integer, intent(in) :: turns
    real(dp), intent(in) :: input(:)
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    type(marks_type) :: marks
    logical :: found(size(marked))
    logical :: visible(most_orders, most_panels), small(size(curve%points)), parts(2)
    integer, allocatable :: harmonics(:)
    integer :: i, panels, across, rows

    do i = 1, size(found)
      found(i) = any(curve%points%state == marked(i))
    end do
    panels = min(size(quantities), most_panels)
    harmonics = curve%options%split_off()
    across = merge(1, 2, panels <= most_below)
    rows = (panels + across - 1) / across
    small = [(curve%points(i)%moved%small(), i = 1, size(small))]
    parts = [any(small .and. curve%has_values()), any(.not. small .and. curve%has_values())]
    marks = marks_of(curve, input)
    visible = .false.
    do i = 1, panels
      visible(:, i) = visible_orders(curve, i)
    end do
    lines = layout_line(panels, across, &
      & legend) // "set key off" // newline // "set xrange " // sweep_of(curve) // newline // "set format x ''" // newline &
      & // "# each part of a curve with the first point of the next" // newline &
      & // "here = 0; there = 0" // newline &
      & // "small(v) = (before = here, here = strcol('small_motion') ne '0', before || here ? v : NaN)" // newline &
      & // "beyond(v) = (before = there, there = strcol('small_motion') eq '0', before || there ? v : NaN)" // newline &
      & // "tint(v) = strcol('small_motion') eq '0' ? 0x" // beyond_colour // " : 0x0072B2" // newline // marks%lines
    do i = 1, panels
      if (i == panels - across + 1) lines = lines // "set format x; set xlabel 'crank speed (rpm)'" // newline
      if (i == panels) lines = lines // "set key on at screen 0.5,screen 0.004 bottom center horizontal samplen 2 font ',12'" &
        & // newline
      lines = lines // curve_panel(before + (of_rms + size(harmonics)) * (i - 1), label_of(quantities(i)), visible(:, i), &
        & found, parts)
      if (i == panels) lines = lines // key(any(visible, dim=2), harmonics, turns, found, parts(2)) // marks%entries
      lines = lines // newline // "unset logscale y; set format y; set ytics autofreq" // newline
    end do
    figure = new_figure("resonance", "Response over the crank speed: peak, rms, and rms of single orders", lines &
      & // "unset multiplot" // newline, width=merge(820, 960, across == 1), height=legend + nint(height_of(rows)))
  end function plot_resonance

  !> The input's speed, and where the machine leaves its vibration.
  pure type(marks_type) function marks_of(curve, input) result(marks)
    type(resonance_curve_type), intent(in) :: curve
    real(dp), intent(in) :: input(:)

    associate (points => curve%points)
      marks = chart_marks([points(1)%speed, points(size(points))%speed], input, "rpm", (points%speed), points%state == unstable)
    end associate
  end function marks_of

  !> Whose parts of the rms come up to the lower end of the quantity's panel.
  pure function visible_orders(curve, quantity) result(visible)
    type(resonance_curve_type), intent(in) :: curve
    integer, intent(in) :: quantity
    logical :: visible(most_orders)
    real(dp) :: low, high, most(most_orders)
    integer :: i, k

    low = huge(low)
    high = 0
    most = 0
    do i = 1, size(curve%points)
      associate (values => curve%points(i)%values(:, quantity))
        if (.not. all(ieee_is_finite(values))) cycle
        low = min(low, values(of_peak), values(of_rms))
        high = max(high, values(of_peak), values(of_rms))
        do k = 1, min(size(values) - of_rms, most_orders)
          most(k) = max(most(k), sqrt(0.5_dp) * values(of_rms + k))
        end do
      end associate
    end do
    visible = most > max(depth * high, below * low)
  end function visible_orders

  !> The lines' names, of all panels.
  pure function key(orders, harmonics, turns, found, beyond) result(words)
    logical, intent(in) :: orders(:), found(:), beyond
    integer, intent(in) :: harmonics(:), turns
    character(len=:), allocatable :: words
    integer :: k

    words = entry("lines lt 1 lw 2.5", "peak") // entry("lines lt 2 lw 2", "rms")
    do k = 1, size(orders)
      if (orders(k)) words = words // entry("lines lt " // text(2 + k) // " lw 1.5", "order " // order_of(harmonics(k), turns))
    end do
    if (beyond) words = words // entry("lines lt 1 lc rgb '#" // beyond_colour // "' lw 2.5", "beyond small motions")
    do k = 1, size(found)
      if (found(k) .and. marked(k) /= unstable) words = words // entry("points lt 7 pt " // text(k) // " ps 0.6", &
        & trim(state_word(marked(k))))
    end do
  end function key

  pure function entry(style, name) result(words)
    character(len=*), intent(in) :: style, name
    character(len=:), allocatable :: words

    words = ", keyentry with " // style // " title '" // name // "'"
  end function entry

  !> One quantity, whose columns follow `first`, on a logarithmic axis of four decades at the most; `parts`: whether some motions
  !> are small, and whether some are not.
  pure function curve_panel(first, label, orders, found, parts) result(lines)
    integer, intent(in) :: first
    character(len=*), intent(in) :: label
    logical, intent(in) :: orders(:), found(:), parts(2)
    character(len=:), allocatable :: lines
    integer :: k

    lines = extent_lines("resonance.csv", [column(first + of_peak), column(first + of_rms)]) &
      & // "valid = high > 0 && low >= 0" // newline &
      & // "least = " // concise(below, 3) // " * low > " // concise(depth, 3) // " * high ? " // concise(below, 3) // " * low : " &
      & // concise(depth, 3) // " * high" // newline &
      & // "shown(v) = v == v ? (v > 0.1 * least ? v : 0.1 * least) : NaN" // newline &
      & // "if (valid) {" // newline // decade_lines("least", "2 * high") // "} else { set yrange [0:1] }" // newline &
      & // "set ylabel " // quoted(label) // " noenhanced" // newline // "plot NaN notitle" &
      & // ", for [i=1:valid] 'resonance.csv' using 1:(shown(" // trim(column(first + of_peak)) // ")):(tint(0)) with lines lt 1 " &
      & // "lw 2.5 lc rgb variable notitle" // line(first + of_rms, 2, "2", "", parts)
    do k = 1, size(orders)
      if (orders(k)) lines = lines // line(first + of_rms + k, 2 + k, "1.5", "sqrt(0.5) * ", parts)
    end do
    do k = 1, size(found)
      if (.not. found(k)) cycle
      lines = lines // ", 'resonance.csv' using (strcol(2) eq '" // trim(state_word(marked(k))) // "' ? column(1) : 1e290):" &
        & // "(valid ? 1.2 * least : 0.03) with points lt 7 pt " // text(k) // " ps 0.6 notitle"
    end do
  end function curve_panel

  !> A column times `factor`, grey beyond small motions. (The colour of each point, as that of the peak, would take the dashes.)
  pure function line(number, style, width, factor, parts) result(words)
    integer, intent(in) :: number, style
    character(len=*), intent(in) :: width, factor
    logical, intent(in) :: parts(2)
    character(len=:), allocatable :: words, value

    value = "(shown(" // factor // trim(column(number)) // ")))"
    words = ""
    if (parts(1)) words = ", for [i=1:valid] 'resonance.csv' using 1:(small" // value // " with lines lt " // text(style) &
      & // " lw " // width // " notitle"
    if (parts(2)) words = words // ", for [i=1:valid] 'resonance.csv' using 1:(beyond" // value // " with lines lt " &
      & // text(style) // " lw " // width // " lc rgb '#" // beyond_colour // "' notitle"
  end function line

  pure character(len=16) function column(number)
    integer, intent(in) :: number

    column = "column(" // text(number) // ")"
  end function column

  !> A quantity with its unit.
  pure function label_of(quantity) result(label)
    type(quantity_type), intent(in) :: quantity
    character(len=:), allocatable :: label

    label = trim(quantity%name) // " (" // trim(quantity%unit) // ")"
  end function label_of

  !> From the first speed to the last.
  pure function sweep_of(curve) result(range)
    type(resonance_curve_type), intent(in) :: curve
    character(len=:), allocatable :: range

    associate (points => curve%points)
      range = "[" // concise(points(1)%speed, 9) // ":" // concise(points(size(points))%speed, 9) // "]"
    end associate
  end function sweep_of

  !> peaks.gp: where the maxima lie, with their values; `input` as of the curves.
  function plot_peaks(quantities, curve, input) result(figure)
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    real(dp), intent(in) :: input(:)
    type(figure_type) :: figure
    type(marks_type) :: marks
    character(len=:), allocatable :: lines, mine
    real(dp) :: range(2)
    integer :: i

    associate (points => curve%points)
      range = [points(1)%speed, points(size(points))%speed]
    end associate
    marks = marks_of(curve, input)
    lines = "set title heading noenhanced" // newline // "set xrange " // with_rim(range(1), range(2)) // newline &
      & // "set yrange [" // text(size(quantities)) // ".5:0.3]" // newline &
      & // "set xlabel 'crank speed (rpm)'; set ytics noenhanced ("
    do i = 1, size(quantities)
      if (i > 1) lines = lines // ", "
      lines = lines // tic(label_of(quantities(i))) // " " // text(i)
    end do
    lines = lines // ")" // newline // "set lmargin " // text(min(44, 2 + maxval([(character_count(label_of(quantities(i))), &
      & i = 1, size(quantities))]))) // "; set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" &
      & // newline // marks%lines // values(curve, range) // rows_of(curve) // "plot NaN notitle"
    do i = 1, size(quantities)
      mine = "of($0) == " // text(i)
      if (any(curve%maxima%quantity == i)) lines = lines // dots(mine, i, "")
      if (any(curve%maxima%quantity == i .and. .not. curve%maxima%small)) lines = lines &
        & // dots(mine // " && strcol('small_motion') eq '0'", i, " lc rgb '#" // beyond_colour // "'")
    end do
    if (.not. all(curve%maxima%small)) lines = lines // entry("points lt 1 lc rgb '#" // beyond_colour // "' ps 1.2", &
      & "beyond small motions")
    figure = new_figure("peaks", "Peaks of the resonance curves: " // text(size(curve%maxima)), lines // marks%entries, width=820, &
      & height=260 + 45 * size(quantities))
  end function plot_peaks

  !> The maxima of quantity `i` of which a condition holds.
  pure function dots(condition, i, colour) result(words)
    character(len=*), intent(in) :: condition, colour
    integer, intent(in) :: i
    character(len=:), allocatable :: words

    words = ", 'peaks.csv' using (" // condition // " ? column(3) : 1e290):(" // text(i) // ") with points lt " &
      & // text(1 + mod(i - 1, 8)) // " ps 1.2" // colour // " notitle"
  end function dots

  !> The number of the quantity of each row of the file.
  pure function rows_of(curve) result(line)
    type(resonance_curve_type), intent(in) :: curve
    character(len=:), allocatable :: line
    integer :: i

    line = "of(row) = int(word('"
    do i = 1, size(curve%maxima)
      line = line // text(curve%maxima(i)%quantity) // " "
    end do
    line = line // "', int(row) + 1))" // newline
  end function rows_of

  !> The values of the maxima, in rows with room for them.
  pure function values(curve, range) result(lines)
    type(resonance_curve_type), intent(in) :: curve
    real(dp), intent(in) :: range(2)
    character(len=:), allocatable :: lines
    real(dp), allocatable :: spaced(:)
    integer, allocatable :: mine(:)
    integer :: q, i, n

    lines = ""
    n = 0
    do q = 1, size(curve%options%names)
      mine = pack([(i, i = 1, size(curve%maxima))], curve%maxima%quantity == q)
      if (size(mine) > most_labelled) cycle
      spaced = apart((curve%maxima(mine)%speed), 0.08_dp * abs(range(2) - range(1)), range)
      do i = 1, size(mine)
        n = n + 1
        lines = lines // "set label " // text(n) // " '" // concise(curve%maxima(mine(i))%value, 4) // "' at " &
          & // concise(spaced(i), 9) // "," // text(q) // " center offset 0,0.9 font ',11'" // newline
      end do
    end do
  end function values

end module gestell_task_resonance_plot
