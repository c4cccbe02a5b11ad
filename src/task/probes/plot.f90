!> Plots the vibration at the probes, which are points of the frame.
module gestell_task_probes_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_words, only: word_length
  use gestell_model_frame, only: frame_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_axis_unit, only: maximum_of
  use gestell_output_picture_script, only: figure_type, new_figure, tics
  use gestell_output_picture_panels, only: bar_style => bars, height_of, history_panel, key_line, layout_line, &
    & legend_height, turn_axis
  use gestell_output_picture_axis_unit, only: maximum_in
  use gestell_output_picture_orbits, only: orbit_layout, orbit_panel
  use gestell_output_picture_orders, only: highest_order, order_axis, order_panel
  use gestell_output_table, only: table_type
  use gestell_output_table_turn, only: amplitude_of
  use gestell_output_table_unit, only: metre_per_s
  implicit none (type, external)
  private

  public :: plot_histories, plot_limits, plot_orbits, plot_orders

  !> Height of a row of a legend in pixels, and maximum number of rows
  integer, parameter :: row = 18, most_rows = 4
  !> Maximum number of panels with orbits
  integer, parameter :: most_orbits = 8

  character, parameter :: along(3) = ["x", "y", "z"]

contains

  !> The picture of the table probes.csv: rms velocity within the band along two or three `axes`, and the limit.
  type(figure_type) function plot_limits(table, names, axes) result(figure)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: names(:)
    integer, intent(in) :: axes
    character(len=:), allocatable :: lines
    logical :: has_limit
    integer :: i

    lines = "set title heading noenhanced" // newline // "set xtics noenhanced (" // tics(names, 0) // ")" // newline &
      & // "set xrange [-0.6:" // text(size(names) - 1) // ".6]; set boxwidth " &
      & // concise(0.72_dp / (axes + 1), 3) // newline &
      & // "set ylabel 'vibration velocity (" // trim(table%columns(table%number_of("v_rms_band"))%unit%words) &
      & // ")'; set grid noxtics ytics; set xtics scale 0" // newline &
      & // "set bmargin 5; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
      & // "most = 0; set table $unused" // newline &
      & // "plot [0:1] [-1:1] 'probes.csv' using (0):(v = column('" // table%key_of("v_rms_band") &
      & // "'), most = v > most ? v : most, v = column('" // table%key_of("limit") // "'), most = v > most ? v : most, 0)" &
      & // newline // "unset table" // newline &
      & // "set yrange [0:(most > 0 ? 1.08 * most : 1)]" // newline &
      & // "limit(v) = v == v ? v : -1" // newline // "plot"
    do i = 1, axes
      lines = lines // either(" 'probes.csv'", "  ''", i == 1) // boxes("v" // along(i) // "_rms_band", "along " // along(i))
    end do
    has_limit = maximum_of(table, ["limit"]) > 0
    lines = lines // "  ''" // boxes("v_rms_band", "strongest direction") // "  " // either("'' using ($0 - 0.42):" &
      & // "(limit(column('" // table%key_of("limit") // "'))):(0.84):(0) with vectors nohead lt 7 dt 1 lw 3 title 'limit'", &
      & "NaN notitle", has_limit) &
      & // newline
    figure = new_figure(table%name, "Vibration velocity at the probes: rms within the band" &
      & // either(", and its limit", "", has_limit), lines, height=460)

  contains

    !> Part of the plot command that draws bar number i of each probe. The height of the bar is the value in `column`.
    pure function boxes(column, title) result(words)
      character(len=*), intent(in) :: column, title
      character(len=:), allocatable :: words

      words = " using ($0 + " // concise(0.78_dp / (axes + 1) * (i - 1 - axes / 2.0_dp), 3) // "):(column('" &
        & // table%key_of(column) // "')) with boxes" // bar_style(i, 3) // " border lt -1 title '" // title // "', \" // newline
    end function boxes

  end function plot_limits

  !> The picture of the table probes_history.csv: displacement, velocity and acceleration along all axes.
  type(figure_type) function plot_histories(table, names, axes, frame) result(figure)
    type(table_type), intent(in) :: table
    !> Names of the probes, which are parts of the names of the table's columns
    character(len=*), intent(in) :: names(:)
    !> Number of coordinate axes of a displacement (2 or 3)
    integer, intent(in) :: axes
    class(frame_type), intent(in) :: frame
    character(len=*), parameter :: kinds(3) = [" ", "v", "a"], dots(3) = ["  ", "' ", "''"]
    character(len=:), allocatable :: lines
    character(len=word_length + 3) :: columns(size(names))
    integer :: kind, axis, legend

    ! panels side by side are too narrow for a legend above one of them
    legend = row * min(size(names), most_rows) + 8
    lines = layout_line(3 * axes, axes, legend)
    do kind = 1, 3
      do axis = 1, axes
        columns = trim(kinds(kind)) // along(axis) // "_" // names
        lines = lines // turn_axis(frame, kind == 3) // key_line(.false.)
        if (axes > 2) lines = lines // "set xtics " // text(180 * frame%mechanism%turns) // newline
        if (kind == 3 .and. axis == axes) lines = lines // "set key on at screen 0.5,screen 0.004 bottom center vertical maxrows " &
          & // text(most_rows) // " samplen 1 font ',12'" // newline
        lines = lines // history_panel(table, &
          & along(axis) // trim(dots(kind)), columns, names)
      end do
    end do
    figure = new_figure(table%name, "Displacement, velocity and acceleration at the probes over " &
      & // turns_in_words(frame%mechanism%turns), lines // "unset multiplot" // newline, &
      & height=nint(height_of(3)) + legend)
  end function plot_histories

  !> The picture probes_orbit.gp: the paths of the probes during the period. In space each probe has three projections.
  type(figure_type) function plot_orbits(table, names, axes) result(figure)
    !> The table probes_history.csv
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: names(:)
    !> Number of axes (2 or 3)
    integer, intent(in) :: axes
    integer, parameter :: planes(2, 3) = reshape([1, 2, 1, 3, 2, 3], [2, 3])
    character(len=:), allocatable :: lines, name
    integer :: i, k, n, shown, height

    n = merge(3, 1, axes > 2)
    shown = min(size(names), most_orbits / n)
    call orbit_layout(n * shown, merge(2, min(2, shown), n > 1), lines, height)
    lines = lines // "set key off" // newline
    do i = 1, shown
      ! gfortran 12 never frees trim(names(i)) if it is an argument of this function
      name = trim(names(i))
      do k = 1, n
        lines = lines // orbit_panel(table, along(planes(:, k)) // "_" // name, along(planes(:, k)), name, .false., &
          & maximum_in(table, trim(table%columns(table%number_of("x_" // name))%unit%words)))
      end do
    end do
    figure = new_figure("probes_orbit", "Orbits of the probes (angles: crank)", lines // "unset multiplot" // newline, &
      & height=height, table=table%name)
  end function plot_orbits

  !> The picture of the table probes_harmonics.csv: amplitudes of the velocity for each order.
  type(figure_type) function plot_orders(table, names, axes, turns) result(figure)
    type(table_type), intent(in) :: table
    !> Names of the probes, which are parts of the names of the table's columns
    character(len=*), intent(in) :: names(:)
    !> `axes`: number of axes (2 or 3). `turns`: number of turns that the crank makes in the period
    integer, intent(in) :: axes, turns
    character(len=:), allocatable :: lines
    character(len=word_length + 20) :: columns(size(names), axes)
    integer :: i, k, above

    do k = 1, axes
      do i = 1, size(names)
        columns(i, k) = amplitude_of("v" // along(k) // "_" // trim(names(i)), metre_per_s)
      end do
    end do
    above = legend_height(names, 1)
    lines = layout_line(axes, 1, above=above) // "set grid noxtics ytics" // newline
    do k = 1, axes
      lines = lines // order_axis(table, highest_order(table, [columns], turns), k == axes, turns) // key_line(k == 1) &
        & // order_panel(table, along(k) // "'", columns(:, k), names, turns)
    end do
    figure = new_figure(table%name, "Amplitudes of the vibration velocity at the probes", lines // "unset multiplot" // newline, &
      & height=nint(height_of(axes)) + above)
  end function plot_orders

end module gestell_task_probes_plot
