!> Draws the order map of resonance curves: amplitude as colour over crank speed and order.
module gestell_task_resonance_order_map
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_output_picture_axis, only: decade_lines
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, own_unit
  use gestell_output_picture_script, only: figure_type, new_figure, quoted
  use gestell_output_report_orders, only: order_as_fraction
  use gestell_output_table, only: table_type
  use gestell_task_resonance_curve, only: resonance_curve_type
  implicit none (type, external)
  private

  public :: plot_order_map

  !> `most_panels`: maximum number of quantities. `most_columns`: maximum number of columns of the map
  integer, parameter :: most_panels = 4, most_columns = 160

contains

  !> The picture order_map.gp of the table resonance.csv, with a panel for each quantity. Each cell shows the largest amplitude in
  !> its range of speeds. No picture if fewer than two orders are requested or the speed does not vary.
  function plot_order_map(table, quantities, curve, turns) result(figures)
    type(table_type), intent(in) :: table
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    !> Number of turns that the crank makes in the period
    integer, intent(in) :: turns
    type(figure_type), allocatable :: figures(:)
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    integer, allocatable :: harmonics(:)
    real(dp) :: ends(2), height
    integer :: i, columns, panels

    allocate(figures(0))
    harmonics = curve%options%requested_harmonics()
    columns = min(most_columns, count(.not. curve%points%refined))
    ends = curve%points([1, size(curve%points)])%speed
    if (size(harmonics) < 2 .or. columns < 2 .or. .not. abs(ends(2) - ends(1)) > 0) return
    panels = min(size(quantities), most_panels)
    height = 160 + 190 * panels
    lines = "set multiplot layout " // text(panels) // ",1 margins 0.1,0.8," // concise(70 / height, 3) // "," &
      & // concise(1 - 70 / height, 3) // " spacing 0," // concise(26 / height, 3) // " title heading noenhanced" // newline &
      & // "columns = " // text(columns) // "; orders = " // text(size(harmonics)) // "; from = " // concise(ends(1), 9) &
      & // "; step = " // concise((ends(2) - ends(1)) / (columns - 1), 9) // newline &
      & // "cell(speed, k) = (i = int((speed - from) / step + 0.5) + 1, i = i < 1 ? 1 : i > columns ? columns : i, " &
      & // "(k - 1) * columns + i)" // newline &
      & // "set palette defined (0 '#440154', 1 '#3B528B', 2 '#21918C', 3 '#5EC962', 4 '#FDE725')" // newline &
      & // "set object 1 rectangle from graph 0,graph 0 to graph 1,graph 1 behind fillcolor rgb '#BBBBBB' fillstyle solid 1 " &
      & // "noborder" // newline // "set tics out; unset grid; set key off; set format x ''" // newline &
      & // "set xrange [" // concise(minval(ends), 9) // ":" // concise(maxval(ends), 9) // "]" // newline &
      & // "set yrange [" // concise((harmonics(1) - 0.5_dp) / turns, 4) // ":" &
      & // concise((harmonics(size(harmonics)) + 0.5_dp) / turns, 4) // "]; set ylabel 'order'; set ytics " &
      & // text(1 + harmonics(size(harmonics)) / (10 * turns)) // newline
    do i = 1, panels
      if (i == panels) lines = lines // "set format x; set xlabel 'crank speed (rpm)'" // newline
      lines = lines // panel(quantities(i))
    end do
    figure = new_figure("order_map", "Order map: amplitude of each order over the crank speed", lines // "unset multiplot" &
      & // newline, height=nint(height), table=table%name)
    figures = [figure]

  contains

    !> The panel of one quantity. The colours cover four decades below the largest amplitude of small motions, if there are any.
    pure function panel(quantity) result(lines)
      type(quantity_type), intent(in) :: quantity
      character(len=:), allocatable :: lines, column
      type(axis_unit_type) :: unit
      integer :: k

      unit = own_unit(table, trim(quantity%name) // "_peak")
      ! -1: no speed in the cell; 0: no vibration at this speed
      lines = "array amplitude[columns * orders]; do for [i=1:columns * orders] { amplitude[i] = -1 }; most = 0; all = 0" &
        & // newline // "set table $unused; unset logscale" // newline
      do k = 1, size(harmonics)
        column = "column(" // text(table%number_of(trim(quantity%name) // "_order_" // order_as_fraction(harmonics(k), turns))) &
          & // ")"
        lines = lines // "plot [0:1] [-1:1] 'resonance.csv' using (0):(v = " // trim(unit%words) // " * " // column &
          & // ", v = v == v ? v : 0, i = cell(column(1), " // text(k) // "), amplitude[i] = v > amplitude[i] ? v : " &
          & // "amplitude[i], most = v > most && strcol('small_motion') ne '0' ? v : most, all = v > all ? v : all, 0) " &
          & // "smooth unique" // newline
      end do
      lines = lines // "unset table" // newline // "set print $map; print 'speed,order,amplitude'" // newline &
        & // "do for [k=1:orders] { do for [i=1:columns] {" // newline &
        & // "  v = amplitude[(k - 1) * columns + i]; last = v < 0 && i > 1 ? last : v" // newline &
        & // "  print sprintf('%.9g,%.9g,%s', from + (i - 1) * step, (" // text(harmonics(1)) // " + k - 1) / " // text(turns) &
        & // ".0, last > 0 ? sprintf('%.6g', last) : 'NaN')" // newline // "} }" // newline // "unset print" // newline &
        & // "most = most > 0 ? most : all > 0 ? all : 1" // newline // decade_lines("1e-4 * most", "most", "cb") &
        & // "set cblabel " // quoted(label_with(trim(quantity%name), unit)) // " noenhanced offset 0.6" // newline &
        & // "plot $map using 1:2:3 with image pixels" // newline
    end function panel

  end function plot_order_map

end module gestell_task_resonance_order_map
