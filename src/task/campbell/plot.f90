!> Draws the Campbell diagram: the modes against the speed.
module gestell_task_campbell_plot
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, newline, text
  use gestell_output_picture_script, only: figure_type, new_figure, span
  use gestell_output_picture_marks, only: apart, chart_marks, marks_type
  use gestell_output_picture_panels, only: key_line, layout_line
  use gestell_task_campbell, only: campbell_type
  use gestell_task_campbell_crossings, only: crossing_type
  implicit none (type, external)
  private

  public :: marks_of, plot_campbell

  !> Maximum number of order lines with a label
  integer, parameter :: most_named = 12
  !> Width of a label, as a fraction of the axis
  real(dp), parameter :: label_width = 0.043_dp
  !> Minimum width of an interval of speeds in which a mode is locked to an order, as a fraction of the half width of the
  !> resonance. Narrower intervals are not drawn
  real(dp), parameter :: noticeable = 0.1_dp

contains

  !> The picture campbell.gp. Upper panel: frequencies against the speed, crossings, and lines of the orders 1 to `orders`. Lower
  !> panel: damping ratios.
  function plot_campbell(campbell, crossings, orders, input) result(figure)
    type(campbell_type), intent(in) :: campbell
    type(crossing_type), intent(in) :: crossings(:)
    integer, intent(in) :: orders
    !> Speed that the input gives (1/min); empty if the input gives no speed
    real(dp), intent(in) :: input(:)
    type(figure_type) :: figure
    type(marks_type) :: marks
    character(len=:), allocatable :: lines, frequencies, dampings, curve, style, range
    real(dp), allocatable :: damping(:), shown(:)
    real(dp) :: speeds(size(campbell%points)), top
    logical :: identified(campbell%modes), wide(size(crossings))
    integer :: i, k

    speeds = campbell%points%speed
    top = 0
    identified = .false.
    allocate(damping(1), source=0.0_dp)
    do i = 1, size(campbell%points)
      if (.not. campbell%points(i)%solved) cycle
      do k = 1, campbell%modes
        associate (mode => campbell%points(i)%modes(k))
          if (.not. mode%identified) cycle
          identified(k) = .true.
          top = max(top, mode%frequency() / (2 * pi))
          damping = [damping, 100 * mode%damping_ratio()]
        end associate
      end do
    end do
    if (.not. top > 0) top = 1
    top = 1.12_dp * top
    frequencies = "plot NaN notitle"
    dampings = frequencies
    do k = 1, orders
      frequencies = frequencies // ", " // text(k) // " * abs(x) / 60 with lines lt 8 dt 1 lw 0.8 notitle"
    end do
    ! The line of a half order is drawn only if it contains a crossing.
    allocate(shown(0))
    do i = 1, size(crossings)
      if (.not. abs(crossings(i)%order - anint(crossings(i)%order)) > 0 .or. any(.not. abs(shown - crossings(i)%order) > 0)) cycle
      shown = [shown, crossings(i)%order]
      frequencies = frequencies // ", " // concise(shown(size(shown)), 4) // " * abs(x) / 60 with lines lt 8 dt 3 lw 0.8 notitle"
    end do
    do k = 1, campbell%modes
      if (.not. identified(k)) cycle
      ! in campbell.csv successive rows of the same mode are `campbell%modes` rows apart
      curve = ", 'campbell.csv' every " // text(campbell%modes) // "::" // text(k - 1) // " using 1:("
      style = ") with lines lt " // text(k) // " lw 2.5 "
      frequencies = frequencies // curve // "column('frequency_Hz')" // style // "title 'mode " // text(k) // "'"
      dampings = dampings // curve // "100 * column('damping_ratio')" // style // "notitle"
    end do
    ! True if the interval in which the mode is locked is wide relative to the half width of the resonance
    wide = [(crossings(i)%locked .and. abs(crossings(i)%ends(2) - crossings(i)%ends(1)) > noticeable &
      & * abs(crossings(i)%at%growth) * 30 / (pi * crossings(i)%order), i = 1, size(crossings))]
    if (any(wide)) frequencies = frequencies &
      & // ", 'crossings.csv' using (wide(" // concise(noticeable, 3) // ") ? column('from_rpm') : NaN):'frequency_Hz':" &
      & // "(column('to_rpm') - column('from_rpm')):(0) with vectors nohead lt 2 dt 1 lw 6 title 'locked to an order'"
    if (size(crossings) > 0) frequencies = frequencies // ", 'crossings.csv' using 'speed_rpm':'frequency_Hz' with points lt 7 " &
      & // "pt 6 ps 1 title 'crossing'"
    marks = marks_of(campbell, campbell%ends(), input)
    range = either("[" // concise(speeds(1), 9) // ":" // concise(speeds(size(speeds)), 9) // "]", span(speeds), &
      & maxval(speeds) > minval(speeds))
    lines = layout_line(3, 1) // marks%lines // "set xrange " // range // newline &
      & // "wide(part) = column('locked') > 0 && abs(column('to_rpm') - column('from_rpm')) > " &
      & // "part * abs(column('growth_1_per_s')) * 30 / (pi * column('order'))" // newline &
      & // "set lmargin screen 0.155; set rmargin screen 0.94; set tmargin screen 0.87; set bmargin screen 0.49" // newline &
      & // "set key on at screen 0.5,screen 0.004 bottom center horizontal samplen 2 font ',12'" // newline &
      & // "set format x ''; set yrange [0:" // concise(top, 6) // "]; set ylabel 'frequency (Hz)'" // newline &
      & // order_names(speeds, top, [shown, [(real(k, dp), k = 1, orders)]]) // frequencies // marks%entries // newline &
      & // "unset label" // newline &
      & // "set lmargin screen 0.155; set rmargin screen 0.94; set tmargin screen 0.44; set bmargin screen 0.21" // newline &
      & // key_line(.false.) // "set format x; set xlabel 'crank speed (rpm)'; set yrange " // from_zero(damping) // newline &
      & // "set ylabel 'damping (%)'" // newline &
      & // "set arrow 1 from graph 0,first 0 to graph 1,first 0 nohead lt 7 dt 1 lw 1" // newline // dampings // newline &
      & // "unset multiplot" // newline
    figure = new_figure("campbell", "Campbell diagram", lines, height=700)
  end function plot_campbell

  !> Gnuplot range that includes all values and zero.
  pure function from_zero(values) result(range)
    real(dp), intent(in) :: values(:)
    character(len=:), allocatable :: range
    real(dp) :: low, high

    low = min(0.0_dp, minval(values))
    high = max(0.0_dp, maxval(values))
    if (.not. high > low) high = 1
    range = "[" // concise(1.1_dp * low, 6) // ":" // concise(1.1_dp * high, 6) // "]"
  end function from_zero

  !> Marks on the speed axis: the speed that the input gives, and ranges of speeds in which a free vibration grows.
  pure type(marks_type) function marks_of(campbell, range, input) result(marks)
    type(campbell_type), intent(in) :: campbell
    real(dp), intent(in) :: range(2), input(:)
    integer :: i

    associate (points => campbell%points)
      marks = chart_marks(range, input, "rpm", (points%speed), &
        & [(any(points(i)%modes(:campbell%modes)%grows()), i = 1, size(points))])
    end associate
  end function marks_of

  !> Gnuplot labels with the numbers of the orders. Each label lies outside the diagram, where the line of the order leaves it on
  !> the right or at the top.
  pure function order_names(speeds, top, orders) result(lines)
    real(dp), intent(in) :: speeds(:), top, orders(:)
    character(len=:), allocatable :: lines
    real(dp) :: last
    real(dp), allocatable :: named(:), spaced(:)
    integer :: k

    last = speeds(size(speeds))
    lines = ""
    named = pack(orders, orders * abs(last) / 60 <= top)
    named = named(:min(size(named), most_named))
    spaced = apart(named * abs(last) / 60, 0.05_dp * top, [0.0_dp, top])
    do k = 1, size(named)
      lines = lines // name(named(k), "graph 1,first " // concise(spaced(k), 7) // " left offset 0.5,0")
    end do
    named = pack(orders, orders * abs(last) / 60 > top .and. orders * minval(abs(speeds)) / 60 <= top)
    named = named(:min(size(named), most_named))
    spaced = apart(sign(60 * top / named, last), label_width * abs(last - speeds(1)), [speeds(1), last])
    do k = 1, size(named)
      lines = lines // name(named(k), "first " // concise(spaced(k), 7) // ",graph 1 center offset 0,0.6")
    end do

  contains

    !> Gnuplot label with the number of an order, at the coordinates `at`.
    pure function name(order, at) result(line)
      real(dp), intent(in) :: order
      character(len=*), intent(in) :: at
      character(len=:), allocatable :: line

      line = "set label '" // concise(order, 4) // "×' at " // at // " font ',12' textcolor rgb '#666666'" // newline
    end function name

  end function order_names

end module gestell_task_campbell_plot
