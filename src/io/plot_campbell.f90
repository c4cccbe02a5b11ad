!> Pictures of the modes over the speed: Campbell diagram, crossings, critical speeds.
module gestell_io_plot_campbell
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_io_plot, only: axis_unit_type, heading, pick_unit, span, write_script
  use gestell_io_plot_panels, only: height_of, key_line, layout_line
  use gestell_study_campbell, only: campbell_type
  use gestell_study_campbell_crossings, only: crossing_type
  use gestell_study_critical, only: amplitude, critical_type, force
  implicit none (type, external)
  private

  public :: plot_campbell, plot_critical, plot_crossings

  character, parameter :: newline = new_line("a")
  !> Lines of orders with a number, at the most.
  integer, parameter :: most_named = 12

contains

  !> campbell.gp: frequencies with the lines of `orders` orders of the crank and the crossings, damping below.
  !> Error: it cannot be written.
  subroutine plot_campbell(folder, preamble, campbell, crossings, orders, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(campbell_type), intent(in) :: campbell
    type(crossing_type), intent(in) :: crossings(:)
    integer, intent(in) :: orders
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: lines, frequencies, dampings
    real(dp), allocatable :: damping(:), shown(:)
    real(dp) :: speeds(size(campbell%points)), top
    logical :: told(campbell%modes)
    integer :: i, k

    speeds = campbell%points%speed
    top = 0
    told = .false.
    allocate(damping(1), source=0.0_dp)
    do i = 1, size(campbell%points)
      if (.not. campbell%points(i)%solved) cycle
      do k = 1, campbell%modes
        associate (mode => campbell%points(i)%modes(k))
          if (.not. mode%told) cycle
          told(k) = .true.
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
    ! Half orders only where something happens on them.
    allocate(shown(0))
    do i = 1, size(crossings)
      if (.not. abs(crossings(i)%order - anint(crossings(i)%order)) > 0 .or. any(.not. abs(shown - crossings(i)%order) > 0)) cycle
      shown = [shown, crossings(i)%order]
      frequencies = frequencies // ", " // concise(shown(size(shown)), 4) // " * abs(x) / 60 with lines lt 8 dt 3 lw 0.8 notitle"
    end do
    do k = 1, campbell%modes
      if (.not. told(k)) cycle
      frequencies = frequencies // curve(k, campbell%modes, "column('frequency_Hz')", .true.)
      dampings = dampings // curve(k, campbell%modes, "100 * column('damping_ratio')", .false.)
    end do
    if (any(crossings%locked)) frequencies = frequencies // ", 'crossings.csv' using (column('locked') > 0 ? column('from_rpm') " &
      & // ": NaN):'frequency_Hz':(column('to_rpm') - column('from_rpm')):(0) with vectors nohead lt 2 dt 1 lw 6 " &
      & // "title 'locked to an order'"
    if (size(crossings) > 0) frequencies = frequencies // ", 'crossings.csv' using 'speed_rpm':'frequency_Hz' with points lt 7 " &
      & // "pt 6 ps 1 title 'crossing'"
    lines = layout_line(3, 1, heading(preamble, "Campbell diagram")) // "set xrange " // sweep_of(speeds) // newline &
      & // "set lmargin screen 0.13; set rmargin screen 0.97; set tmargin screen 0.87; set bmargin screen 0.42" // newline &
      & // key_line(.true.) &
      & // "set format x ''; set yrange [0:" // concise(top, 6) // "]; set ylabel 'frequency (Hz)'" // newline &
      & // order_names(speeds, top, [shown, [(real(k, dp), k = 1, orders)]]) // frequencies // newline &
      & // "unset label" // newline &
      & // "set lmargin screen 0.13; set rmargin screen 0.97; set tmargin screen 0.37; set bmargin screen 0.1" // newline &
      & // key_line(.false.) &
      & // "set format x; set xlabel 'crank speed (rpm)'; set yrange " // span(damping) // "; set ylabel 'damping (%)'" // newline &
      & // "set arrow 1 from graph 0,first 0 to graph 1,first 0 nohead lt 7 dt 1 lw 1" // newline // dampings // newline &
      & // "unset multiplot" // newline // "unset output" // newline
    call write_script(folder, "campbell", lines, error, width=820, height=680)
  end subroutine plot_campbell

  !> Every so many rows belong to one mode.
  pure function curve(mode, modes, value, named) result(words)
    integer, intent(in) :: mode, modes
    character(len=*), intent(in) :: value
    logical, intent(in) :: named
    character(len=:), allocatable :: words

    words = ", 'campbell.csv' every " // text(modes) // "::" // text(mode - 1) // " using 1:(" // value // ") with lines lt " &
      & // text(mode) // " lw 2.5 "
    if (named) then
      words = words // "title 'mode " // text(mode) // "'"
    else
      words = words // "notitle"
    end if
  end function curve

  !> The range of the speeds, from the first to the last.
  pure function sweep_of(speeds) result(range)
    real(dp), intent(in) :: speeds(:)
    character(len=:), allocatable :: range

    if (maxval(speeds) > minval(speeds)) then
      range = "[" // concise(speeds(1), 9) // ":" // concise(speeds(size(speeds)), 9) // "]"
    else
      range = span(speeds)
    end if
  end function sweep_of

  !> The numbers of the orders where their lines leave the picture.
  pure function order_names(speeds, top, orders) result(lines)
    real(dp), intent(in) :: speeds(:), top, orders(:)
    character(len=:), allocatable :: lines
    real(dp) :: fastest, at
    integer :: k

    fastest = speeds(maxloc(abs(speeds), dim=1))
    lines = ""
    do k = 1, min(size(orders), most_named)
      at = min(abs(fastest), 0.95_dp * top * 60 / orders(k))
      if (at < minval(abs(speeds))) cycle
      lines = lines // "set label " // text(k) // " '" // concise(orders(k), 4) // "×' at " // concise(sign(at, fastest), 7) &
        & // "," // concise(orders(k) * at / 60, 7) // " right offset -0.5,0 font ',12' textcolor rgb '#666666' front" // newline
    end do
  end function order_names

  !> crossings.gp. Error: it cannot be written.
  subroutine plot_crossings(folder, preamble, crossings, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(crossing_type), intent(in) :: crossings(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: lines
    real(dp) :: speeds(size(crossings)), frequencies(size(crossings))
    integer :: i, k

    do i = 1, size(crossings)
      speeds(i) = crossings(i)%speed
      frequencies(i) = crossings(i)%at%frequency() / (2 * pi)
    end do
    lines = "set title " // heading(preamble, "Crossings of modes with orders of the crank: " // found(size(crossings))) &
      & // " noenhanced" // newline // "set xrange " // span(speeds) // newline // "set yrange " // span([0.0_dp, 1.1_dp &
      & * frequencies]) // newline // "set xlabel 'crank speed (rpm)'; set ylabel 'frequency (Hz)'" // newline &
      & // "set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline // "plot NaN notitle"
    do k = 1, maxval([0, crossings%mode])
      if (.not. any(crossings%mode == k)) cycle
      lines = lines // ", 'crossings.csv' using (column('mode') == " // text(k) // " ? column('speed_rpm') : 1e290):" &
        & // "'frequency_Hz' with points lt " // text(k) // " ps 1.4 title 'mode " // text(k) // "'"
    end do
    if (size(crossings) > 0) lines = lines // ", 'crossings.csv' using 'speed_rpm':'frequency_Hz':(sprintf('%g×', " &
      & // "column('order'))) with labels offset 0,0.9 font ',12' notitle"
    call write_script(folder, "crossings", lines // newline // "unset output" // newline, error, width=800, height=460)
  end subroutine plot_crossings

  !> critical.gp: the peaks near the crossings, by amplitude and by force. Error: it cannot be written.
  subroutine plot_critical(folder, preamble, critical, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(critical_type), intent(in) :: critical(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: lines
    real(dp), allocatable :: speeds(:)
    type(axis_unit_type) :: unit
    integer :: i

    allocate(speeds(0))
    do i = 1, size(critical)
      speeds = [speeds, critical(i)%crossing%speed]
      if (critical(i)%found(amplitude)) speeds = [speeds, critical(i)%speed(amplitude)]
      if (critical(i)%found(force)) speeds = [speeds, critical(i)%speed(force)]
    end do
    unit = pick_unit("m", greatest(amplitude))
    lines = layout_line(2, 1, heading(preamble, "Critical speeds: peaks near " // found(size(critical)) &
      & // " crossings (mode and order)")) // "set xrange " // span(speeds) // newline // key_line(.false.) &
      & // "set format x ''" // newline // panel("amplitude (" // trim(unit%name) // ")", "speed_rpm", "amplitude_m", &
      & unit%factor, any_found(amplitude))
    unit = pick_unit("N", greatest(force))
    lines = lines // "set format x; set xlabel 'crank speed (rpm)'" // newline &
      & // panel("force (" // trim(unit%name) // ")", "force_speed_rpm", "force_N", unit%factor, any_found(force))
    call write_script(folder, "critical", lines // "unset multiplot" // newline // "unset output" // newline, error, width=800, &
      & height=nint(height_of(2)))
  contains
    pure real(dp) function greatest(which)
      integer, intent(in) :: which
      integer :: i

      greatest = 0
      do i = 1, size(critical)
        if (critical(i)%found(which)) greatest = max(greatest, critical(i)%height(which))
      end do
    end function greatest

    pure logical function any_found(which)
      integer, intent(in) :: which
      integer :: i

      any_found = any([(critical(i)%found(which), i = 1, size(critical))])
    end function any_found
  end subroutine plot_critical

  !> Peaks as lines from the axis, on a logarithmic scale.
  pure function panel(label, speed, height, factor, some) result(lines)
    character(len=*), intent(in) :: label, speed, height, factor
    logical, intent(in) :: some
    character(len=:), allocatable :: lines

    lines = "set ylabel '" // label // "'" // newline
    if (.not. some) then
      lines = lines // "unset logscale y; set yrange [0:1]; set format y; plot NaN notitle" // newline
      return
    end if
    lines = lines // "least = 1e300; most = 0; set table $unused; unset logscale" // newline &
      & // "plot [-1e9:1e9] [-1:1] 'critical.csv' using (0):(v = " // trim(factor) // " * column('" // height // "'), " &
      & // "least = v < least ? v : least, most = v > most ? v : most, 0)" // newline // "unset table" // newline &
      & // "set logscale y; set format y '10^{%L}'; set yrange [least / 4:most * 60]" // newline // "plot 'critical.csv' using '" &
      & // speed // "':(" // trim(factor) // " * column('" // height // "')) with impulses lt 1 lw 2 notitle, '' using '" // speed &
      & // "':(" // trim(factor) // " * column('" // height // "')) with points lt 1 ps 1 notitle, '' using '" // speed // "':(" &
      & // trim(factor) // " * column('" // height // "')):(sprintf('%g: %g×', column('mode'), column('order'))) with labels " &
      & // "rotate by 90 left offset 0,0.6 font ',11' notitle" // newline
  end function panel

  pure function found(number) result(words)
    integer, intent(in) :: number
    character(len=:), allocatable :: words

    words = text(number)
    if (number == 0) words = "no"
  end function found

end module gestell_io_plot_campbell
