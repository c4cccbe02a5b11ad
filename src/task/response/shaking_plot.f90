!> Plots the force on the ground and the shaking force, which the mechanism would exert on a frame at rest: a polar diagram, and
!> their ratio, the transmissibility.
module gestell_task_response_shaking_plot
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_math_series_fourier, only: find_series, fourier_type
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_shaking, only: shaking_loads
  use gestell_model_space, only: is_rotation
  use gestell_output_picture_axis, only: decade_lines
  use gestell_output_picture_axis_unit, only: maximum_in
  use gestell_output_picture_marks, only: choose_spaced
  use gestell_output_picture_orbits, only: inline_orbit_panel, orbit_layout, orbit_panel
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_output_report_orders, only: order_of
  use gestell_output_table, only: table_type
  use gestell_output_table_turn, only: amplitude_of
  use gestell_task_response_names, only: name_type, names_of
  use gestell_task_response_plot, only: speed_in_words
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: plot_force_polar, plot_transmissibility, sample_shaking

  !> Number of phases for each turn of the crank at which the shaking force is computed
  integer, parameter :: phases_per_turn = 180
  !> Orders whose shaking force is below these fractions have no transmissibility, because the ratio to a small remainder says
  !> nothing about the mounts. `least`: fraction of the strongest order of this component. `least_of_all`: fraction of the strongest
  !> order of all forces or of all moments
  real(dp), parameter :: least = 1.0e-2_dp, least_of_all = 1.0e-4_dp
  !> Shaking forces below this fraction of the largest are rounding errors
  real(dp), parameter :: noise = 1.0e-9_dp

contains

  !> Shaking forces and moments of the mechanism on a frame at rest, shape (dofs, phases). Empty if external loads act: then they
  !> are not the only cause of the vibration.
  subroutine sample_shaking(frame, loads)
    class(frame_type), intent(in) :: frame
    real(dp), allocatable, intent(out) :: loads(:, :)
    real(dp), allocatable :: by_phase(:, :)
    integer :: n, i

    n = phases_per_turn * frame%mechanism%turns
    if (frame%loads_act()) n = 0
    allocate(by_phase(0, 0))
    if (n > 0) call shaking_loads(frame, [(real(i, dp) / n, i = 0, n - 1)], by_phase)
    loads = transpose(by_phase)
    if (.not. all(ieee_is_finite(loads))) deallocate(loads)
    if (.not. allocated(loads)) allocate(loads(0, 0))
  end subroutine sample_shaking

  !> The picture force_polar.gp: polar diagrams of the shaking force `loads` and of the force on the ground. In space there are
  !> three projections.
  type(figure_type) function plot_force_polar(table, frame, loads) result(figure)
    !> The table response.csv
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: loads(:, :)
    !> Indices of the forces along x, y and z among the degrees of freedom, and the two axes of each projection
    integer, parameter :: along(3) = [1, 2, 4], planes(2, 3) = reshape([1, 2, 1, 3, 2, 3], [2, 3])
    character(len=2), parameter :: columns(3) = ["fx", "fy", "fz"]
    character(len=7), parameter :: labels(3) = ["force x", "force y", "force z"]
    real(dp) :: shown(size(loads, 1), size(loads, 2)), largest
    character(len=:), allocatable :: lines, unit
    integer :: i, n, height

    unit = trim(table%columns(table%number_of("fx"))%unit%words)
    largest = maximum_in(table, unit)
    shown = loads
    if (size(loads) > 0) then
      largest = max(largest, maxval(abs(loads(along(:merge(3, 2, frame%dofs() > 3)), :))))
      where (abs(loads) < noise * largest) shown = 0
    end if
    n = merge(3, 1, frame%dofs() > 3)
    call orbit_layout(2 * n, 2, lines, height)
    if (size(loads) == 0) call orbit_layout(n, min(n, 2), lines, height)
    lines = lines // "set key off" // newline
    do i = 1, n
      associate (k => planes(:, i))
        if (size(loads) > 0) lines = lines // inline_orbit_panel(closed(shown(along(k), :)), frame%degrees_per_period(), unit, &
          & labels(k), "shaking force on a frame at rest", largest)
        lines = lines // orbit_panel(table, columns(k), labels(k), "force on the ground" &
          & // either(" without guides", "", size(frame%free) < frame%dofs()), .true., largest)
      end associate
    end do
    figure = new_figure("force_polar", "Polar diagrams of the forces at " // speed_in_words(frame) // " (angles of the crank)", &
      & lines // "unset multiplot" // newline, height=height, table="response")
  end function plot_force_polar

  !> The points of a curve followed by the first point.
  pure function closed(points)
    real(dp), intent(in) :: points(:, :)
    real(dp) :: closed(size(points, 1), size(points, 2) + 1)

    closed(:, :size(points, 2)) = points
    closed(:, size(points, 2) + 1) = points(:, 1)
  end function closed

  !> The picture transmissibility.gp: amplitudes of forces and moments on the ground, divided by those of the shaking force `loads`,
  !> at the frequencies of the orders. Empty if no order shakes the frame.
  function plot_transmissibility(table, frame, loads) result(figures)
    !> The table harmonics.csv
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: loads(:, :)
    type(figure_type), allocatable :: figures(:)
    type(figure_type) :: figure
    type(fourier_type) :: series(size(loads, 1))
    type(name_type) :: names(3 * frame%dofs())
    type(growing_text_type) :: curves, rigid
    real(dp) :: ratio(table%rows - 1, size(loads, 1)), limit
    character(len=:), allocatable :: column
    integer :: i, k, n

    allocate(figures(0))
    if (size(loads) == 0 .or. table%rows < 2) return
    names = names_of(frame%dofs())
    call find_series(loads, series)
    n = min(table%rows - 1, size(series(1)%amplitude))
    ratio = 0
    do i = 1, size(series)
      if (all(frame%free /= i)) cycle
      limit = 0
      do k = 1, size(series)
        if (is_rotation(k) .eqv. is_rotation(i)) limit = max(limit, maxval(series(k)%amplitude))
      end do
      limit = max(least * maxval(series(i)%amplitude), least_of_all * limit)
      column = table%key_of(amplitude_of(trim(names(2 * frame%dofs() + i)%column), names(2 * frame%dofs() + i)%unit))
      associate (amplitudes => table%columns(table%number_of(column))%numbers(2:))
        call rigid%append("rigid" // text(i) // "(row) = real(word('0")
        do k = 1, n
          if (series(i)%amplitude(k) > limit) ratio(k, i) = amplitudes(k) / series(i)%amplitude(k)
          call rigid%append(" " // either(concise(series(i)%amplitude(k), 6), "0", ratio(k, i) > 0))
        end do
        call rigid%append(repeat(" 0", table%rows - 1 - n) // "', int(row) + 1))" // newline)
        if (any(ratio(:, i) > 0)) call curves%append(", 'harmonics.csv' using (rigid" // text(i) // "($0) > 0 ? " &
          & // "column('frequency_Hz') : NaN):(column('" // column // "') / rigid" // text(i) // "($0)) with points lt " &
          & // text(i) // " ps 1.1 title '" // trim(names(2 * frame%dofs() + i)%symbol) // "'")
      end associate
    end do
    if (.not. any(ratio > 0)) return
    figure = new_figure("transmissibility", "Transmissibility at " // speed_in_words(frame) &
      & // ": force on the ground / on a frame at rest", axes(ratio) // rigid%whole() &
      & // "plot 1 with lines lt 7 dt 1 lw 1 notitle" // curves%whole() // newline // "unset multiplot" // newline, &
      & height=460, table="harmonics")
    figures = [figure]

  contains

    !> Gnuplot lines for the axes: frequency below, order above.
    function axes(ratio) result(lines)
      real(dp), intent(in) :: ratio(:, :)
      character(len=:), allocatable :: lines, list
      integer, allocatable :: present_orders(:)
      logical, allocatable :: named(:)
      real(dp), allocatable :: positions(:)
      real(dp) :: low, high
      integer :: k

      present_orders = pack([(k, k = 1, size(ratio, 1))], any(ratio > 0, dim=2))
      low = minval(ratio, mask=ratio > 0)
      high = maxval(ratio)
      lines = "set multiplot title heading noenhanced; set lmargin screen 0.14; set rmargin screen 0.97" // newline &
        & // "set bmargin screen 0.26; set tmargin screen 0.76" // newline // decade_lines(concise(min(low, 0.5_dp) / 1.5_dp, 3), &
        & concise(max(high, 1.0_dp) * 1.5_dp, 3)) // "set ylabel 'transmissibility'" // newline
      associate (from => 0.8_dp * present_orders(1) / frame%period, &
        & to => 1.25_dp * present_orders(size(present_orders)) / frame%period)
        lines = lines // decade_lines(concise(from, 5), concise(to, 5), "x") // "set x2range [" &
          & // concise(from, 5) // ":" // concise(to, 5) // "]; set logscale x2" // newline
      end associate
      ! positions on the axis; if labels are too wide for their distance, they are turned
      positions = log(real(present_orders, dp)) / log(1.6_dp * present_orders(size(present_orders)) / present_orders(1))
      named = choose_spaced(positions, 0.02_dp)
      list = ""
      do k = 1, size(present_orders)
        if (named(k)) list = list // either(", ", "", list /= "") // "'" // order_of(present_orders(k), frame%mechanism%turns) &
          & // "' " // concise(present_orders(k) / frame%period, 7)
      end do
      lines = lines // "set xlabel 'frequency (Hz)'; set x2label 'order of the crank' offset 0,-0.4; set x2tics " &
        & // either("norotate", "rotate by 90", all(choose_spaced(positions, 0.05_dp))) // " (" // list // ")" // newline &
        & // "set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2 font ',12'" // newline &
        & // "set object 1 rectangle from graph 0,graph 0 to graph 1,first 1 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 " &
        & // "noborder" // newline // "set label 1 'isolated' at graph 0.02,graph 0.05 textcolor rgb '#44617A' font ',12'" &
        & // newline
    end function axes

  end function plot_transmissibility

end module gestell_task_response_shaking_plot
