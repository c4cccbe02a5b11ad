!> Pictures of what is looked at over the speed: resonance curves and their maxima.
module gestell_task_resonance_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_picture_script, only: figure_type, new_figure, quoted, tic
  use gestell_output_picture_axis, only: decade_lines, extent_lines
  use gestell_output_picture_panels, only: height_of, layout_line, with_rim
  use gestell_model_frame_quantity, only: quantity_type
  use gestell_task_resonance_curve, only: resonance_curve_type
  use gestell_study_speed_point, only: state_names, unreached
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

contains

  !> resonance.gp.
  function plot_resonance(quantities, curve) result(figure)
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    logical :: found(size(state_names) - 1)
    logical :: visible(most_orders, most_panels)
    integer :: i, panels, across, rows

    do i = 1, size(found)
      found(i) = any(curve%points%state == i)
    end do
    panels = min(size(quantities), most_panels)
    across = merge(1, 2, panels <= most_below)
    rows = (panels + across - 1) / across
    visible = .false.
    do i = 1, panels
      visible(:, i) = visible_orders(curve, i)
    end do
    lines = layout_line(panels, across, &
      & legend) // "set key off" // newline // "set xrange " // sweep_of(curve) // newline // "set format x ''" // newline &
      & // shades(curve)
    do i = 1, panels
      if (i == panels - across + 1) lines = lines // "set format x; set xlabel 'crank speed (rpm)'" // newline
      if (i == panels) lines = lines // "set key on at screen 0.5,screen 0.004 bottom center horizontal samplen 2 font ',12'" &
        & // newline
      lines = lines // curve_panel(before + (of_rms + curve%order%orders) * (i - 1), label_of(quantities(i)), visible(:, i), found)
      if (i == panels) lines = lines // key(any(visible, dim=2), found)
      lines = lines // newline // "unset logscale y; set format y; set ytics autofreq" // newline
    end do
    figure = new_figure("resonance", "Response over the crank speed: peak, rms, and rms of single orders", lines &
      & // "unset multiplot" // newline, width=merge(820, 960, across == 1), height=legend + nint(height_of(rows)))
  end function plot_resonance

  !> Where the machine leaves its vibration, from the first such speed to the last of each interval.
  pure function shades(curve) result(lines)
    type(resonance_curve_type), intent(in) :: curve
    character(len=:), allocatable :: lines
    integer, parameter :: most = 100
    integer :: i, first, n

    lines = ""
    n = 0
    first = 0
    do i = 1, size(curve%points)
      if (curve%points(i)%state == unreached) then
        if (first == 0) first = i
        if (i < size(curve%points)) cycle
      end if
      if (first == 0) cycle
      n = n + 1
      if (n <= most) lines = lines // "set object " // text(n) // " rectangle from first " &
        & // concise(curve%points(first)%speed, 9) // ",graph 0 to first " // concise(curve%points(max(first, i - 1))%speed, 9) &
        & // ",graph 1 behind fillcolor rgb '#F9E2D2' fillstyle solid 1 noborder" // newline
      first = 0
    end do
  end function shades

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
        do k = 1, min(curve%order%orders, most_orders)
          most(k) = max(most(k), sqrt(0.5_dp) * values(of_rms + k))
        end do
      end associate
    end do
    visible = most > max(depth * high, below * low)
  end function visible_orders

  !> The lines' names, of all panels.
  pure function key(orders, found) result(words)
    logical, intent(in) :: orders(:), found(:)
    character(len=:), allocatable :: words
    integer :: k

    words = entry("lines lt 1 lw 2.5", "peak") // entry("lines lt 2 lw 2", "rms")
    do k = 1, size(orders)
      if (orders(k)) words = words // entry("lines lt " // text(2 + k) // " lw 1.5", "order " // text(k))
    end do
    do k = 1, size(found)
      if (found(k)) words = words // entry("points lt 7 pt " // text(k) // " ps 0.6", trim(state_names(k)))
    end do
  end function key

  pure function entry(style, name) result(words)
    character(len=*), intent(in) :: style, name
    character(len=:), allocatable :: words

    words = ", keyentry with " // style // " title '" // name // "'"
  end function entry

  !> One quantity, whose columns follow `first`, on a logarithmic axis of four decades at the most.
  pure function curve_panel(first, label, orders, found) result(lines)
    integer, intent(in) :: first
    character(len=*), intent(in) :: label
    logical, intent(in) :: orders(:), found(:)
    character(len=:), allocatable :: lines
    integer :: k

    lines = extent_lines("resonance.csv", [column(first + of_peak), column(first + of_rms)]) &
      & // "valid = high > 0 && low >= 0" // newline &
      & // "least = " // concise(below, 3) // " * low > " // concise(depth, 3) // " * high ? " // concise(below, 3) // " * low : " &
      & // concise(depth, 3) // " * high" // newline &
      & // "shown(v) = v == v ? (v > 0.1 * least ? v : 0.1 * least) : NaN" // newline &
      & // "if (valid) {" // newline // decade_lines("least", "2 * high") // "} else { set yrange [0:1] }" // newline &
      & // "set ylabel " // quoted(label) // " noenhanced" // newline // "plot NaN notitle" &
      & // line(first + of_peak, 1, "2.5", "") // line(first + of_rms, 2, "2", "")
    do k = 1, size(orders)
      if (orders(k)) lines = lines // line(first + of_rms + k, 2 + k, "1.5", "sqrt(0.5) * ")
    end do
    do k = 1, size(found)
      if (.not. found(k)) cycle
      lines = lines // ", 'resonance.csv' using (strcol(2) eq '" // trim(state_names(k)) // "' ? column(1) : 1e290):" &
        & // "(valid ? 1.2 * least : 0.03) with points lt 7 pt " // text(k) // " ps 0.6 notitle"
    end do
  end function curve_panel

  pure function line(number, style, width, factor) result(words)
    integer, intent(in) :: number, style
    character(len=*), intent(in) :: width, factor
    character(len=:), allocatable :: words

    words = ", for [i=1:valid] 'resonance.csv' using 1:(shown(" // factor // trim(column(number)) // ")) with lines lt " &
      & // text(style) // " lw " // width // " notitle"
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

  !> peaks.gp: where the maxima lie, with their values.
  function plot_peaks(quantities, curve) result(figure)
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    type(figure_type) :: figure
    character(len=:), allocatable :: lines, mine, range
    integer :: i

    associate (points => curve%points)
      range = with_rim(points(1)%speed, points(size(points))%speed)
    end associate
    lines = "set title heading noenhanced" &
      & // newline // "set xrange " // range // newline // "set yrange [" // text(size(quantities)) // ".5:0.3]" &
      & // newline &
      & // "set xlabel 'crank speed (rpm)'; set ytics noenhanced ("
    do i = 1, size(quantities)
      if (i > 1) lines = lines // ", "
      lines = lines // tic(label_of(quantities(i))) // " " // text(i)
    end do
    lines = lines // "); set key off" // newline // "plot NaN"
    do i = 1, size(quantities)
      if (.not. any(curve%maxima%quantity == i)) cycle
      mine = " using (strcol(1) eq " // quoted(trim(quantities(i)%name)) // " ? column(3) : 1e290):(" // text(i) // ")"
      lines = lines // ", 'peaks.csv'" // mine // " with points lt " // text(1 + mod(i - 1, 8)) // " ps 1.2"
      if (count(curve%maxima%quantity == i) <= most_labelled) lines = lines // ", ''" // mine &
        & // ":(sprintf('%.4g', column(4))) with labels offset 0,0.8 font ',11'"
    end do
    figure = new_figure("peaks", "Peaks of the resonance curves: " // text(size(curve%maxima)), lines, width=820, &
      & height=220 + 45 * size(quantities))
  end function plot_peaks

end module gestell_task_resonance_plot
