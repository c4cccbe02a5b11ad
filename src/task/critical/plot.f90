!> Draws the picture of the critical speeds, critical.gp.
module gestell_task_critical_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_output_picture_script, only: figure_type, new_figure, axis_unit_type, pick_unit
  use gestell_output_picture_marks, only: apart, beyond_colour, marks_type
  use gestell_output_picture_panels, only: height_of, key_line, layout_line, range_with_margin
  use gestell_task_campbell, only: campbell_type
  use gestell_task_campbell_plot, only: marks_of
  use gestell_task_critical, only: amplitude, critical_type, force
  implicit none (type, external)
  private

  public :: plot_critical

  !> Maximum number of peaks that are labelled
  integer, parameter :: most_peaks = 20
  !> Width of a label that is written vertically, as a fraction of the length of the axis
  real(dp), parameter :: upright = 0.024_dp
  !> Forces below this fraction of the largest force are not drawn
  real(dp), parameter :: least_force = 1.0e-3_dp

contains

  !> The picture critical.gp: the peaks near the crossings against the speed, in one panel for the amplitude and one for the force.
  !> The range of speeds and the marks are those of the Campbell diagram.
  function plot_critical(critical, campbell, input) result(figure)
    type(critical_type), intent(in) :: critical(:)
    type(campbell_type), intent(in) :: campbell
    real(dp), intent(in) :: input(:)
    type(figure_type) :: figure
    type(marks_type) :: marks
    character(len=:), allocatable :: lines
    real(dp), allocatable :: speeds(:)
    logical :: descends
    integer :: i

    speeds = campbell%ends()
    marks = marks_of(campbell, speeds, input)
    descends = speeds(2) < speeds(1)
    do i = 1, size(critical)
      speeds = [speeds, pack(critical(i)%speed, critical(i)%found)]
    end do
    speeds = [minval(speeds), maxval(speeds)]
    if (descends) speeds = speeds([2, 1])
    if (any((critical%found(amplitude) .or. critical%found(force)) .and. .not. critical%moved%small())) marks%entries = &
      & ", keyentry with linespoints lt 1 dt 1 lc rgb '#" // beyond_colour // "' title 'beyond small motions'" // marks%entries
    lines = layout_line(2, 1) // marks%lines // "set xrange " // range_with_margin(speeds(1), speeds(2)) // newline &
      & // key_line(.true.) // "tint(name) = strcol('small_motion') eq '0' ? 0x" // beyond_colour // " : 0x0072B2" // newline &
      & // "set format x ''" // newline // panel(critical, amplitude, speeds, "m", 0.0_dp, marks%entries) // key_line(.false.) &
      & // "set format x; set xlabel 'crank speed (rpm)'" // newline // "unset label" // newline &
      & // panel(critical, force, speeds, "N", least_force, "")
    figure = new_figure("critical", "Critical speeds: peaks near crossings, labelled 'mode: order'; crossings: " &
      & // text(size(critical)), lines // "unset multiplot" // newline, width=800, height=nint(height_of(2)))
  end function plot_critical

  !> One panel of the picture: peaks as vertical lines against the speed, on a logarithmic scale. Peaks below `least` times the
  !> maximum are omitted. `entries` are added to the legend.
  pure function panel(critical, which, range, si, least, entries) result(lines)
    type(critical_type), intent(in) :: critical(:)
    integer, intent(in) :: which
    real(dp), intent(in) :: range(2), least
    character(len=*), intent(in) :: si, entries
    character(len=:), allocatable :: lines, drawn
    type(axis_unit_type) :: unit
    real(dp) :: heights(size(critical)), lowest
    real(dp), allocatable :: spaced(:)
    integer, allocatable :: shown(:), named(:)
    integer :: i

    heights = merge(critical%height(which), 0.0_dp, critical%found(which))
    shown = pack([(i, i = 1, size(critical))], heights > least * maxval([0.0_dp, heights]))
    unit = pick_unit(si, maxval([0.0_dp, heights]))
    lines = "set ylabel '" // either("amplitude", "force", which == amplitude) // " (" // trim(unit%name) // ")'" // newline
    if (size(shown) == 0) then
      lines = lines // "unset logscale y; set yrange [0:1]; set format y; plot NaN notitle" // entries // newline
      return
    end if
    lowest = unit%factor * minval(heights(shown)) / 4
    named = shown
    do while (size(named) > most_peaks)
      i = minloc(heights(named), dim=1)
      named = [named(:i - 1), named(i + 1:)]
    end do
    spaced = apart((critical(named)%speed(which)), upright * abs(range(2) - range(1)), range)
    do i = 1, size(named)
      associate (one => critical(named(i)))
        lines = lines // "set label " // text(i) // " '" // text(one%crossing%mode) // ": " // concise(one%crossing%order, 4) &
          & // "×' at " // concise(spaced(i), 9) // "," // concise(unit%factor * one%height(which), 6) &
          & // " rotate by 90 left offset 0,0.6 font ',11'" // newline
      end associate
    end do
    drawn = "'critical.csv' using '" // either("", "force_", which == amplitude) // "speed_rpm':(shown(" // trim(unit%words) &
      & // " * column('" // either("amplitude_m", "force_N", which == amplitude) // "'))):(tint(0)) with "
    lines = lines // "shown(v) = v > " // concise(3.9_dp * lowest, 6) // " ? v : NaN" // newline &
      & // "set logscale y; set format y '10^{%L}'; set yrange [" // concise(lowest, 6) // ":" &
      & // concise(4 * unit%factor * maxval(heights) * (unit%factor * maxval(heights) / lowest)**0.45_dp, 6) // "]" // newline &
      & // "plot " // drawn // "impulses lt 1 lw 2 lc rgb variable notitle, " // drawn &
      & // "points lt 1 ps 1 lc rgb variable notitle" // entries // newline
  end function panel

end module gestell_task_critical_plot
