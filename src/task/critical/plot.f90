!> Draws the picture of the critical speeds, critical.gp.
module gestell_task_critical_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_output_picture_marks, only: marks_type
  use gestell_output_picture_panels, only: height_of, layout_line, range_with_margin
  use gestell_output_picture_peaks, only: beyond_entry, peak_panel, peak_type
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_output_table, only: table_type
  use gestell_task_campbell, only: campbell_type
  use gestell_task_campbell_plot, only: marks_of
  use gestell_task_critical, only: amplitude, critical_type, force
  implicit none (type, external)
  private

  public :: plot_critical

  !> Height of the legend in pixels
  integer, parameter :: legend = 64

contains

  !> The picture critical.gp: the peaks near the crossings against the speed, in one panel for the amplitude and one for the force.
  !> The range of speeds and the marks are those of the Campbell diagram.
  function plot_critical(table, critical, campbell, input) result(figure)
    type(table_type), intent(in) :: table
    type(critical_type), intent(in) :: critical(:)
    type(campbell_type), intent(in) :: campbell
    real(dp), intent(in) :: input(:)
    type(figure_type) :: figure
    type(marks_type) :: marks
    character(len=48), allocatable :: groups(:), titles(:)
    real(dp), allocatable :: speeds(:)
    logical :: descends
    integer :: i, k

    speeds = campbell%ends()
    marks = marks_of(campbell, speeds, input)
    descends = speeds(2) < speeds(1)
    do i = 1, size(critical)
      speeds = [speeds, pack(critical(i)%speed, critical(i)%found)]
    end do
    speeds = [minval(speeds), maxval(speeds)]
    if (descends) speeds = speeds([2, 1])
    if (any((critical%found(amplitude) .or. critical%found(force)) .and. .not. critical%moved%small())) then
      marks%entries = beyond_entry // marks%entries
    end if
    allocate(groups(0), titles(0))
    do k = 1, maxval([0, critical%crossing%mode])
      if (.not. any(critical%crossing%mode == k)) cycle
      groups = [character(len=48) :: groups, "column('mode') == " // text(k)]
      titles = [character(len=48) :: titles, "mode " // text(k)]
    end do
    figure = new_figure("critical", "Critical speeds at " // text(size(critical)) &
      & // " crossings, labelled with the order", layout_line(2, 1, legend) // marks%lines // "set xrange " &
      & // range_with_margin(speeds(1), speeds(2)) // newline // "set key off; set format x ''" // newline &
      & // peak_panel(peaks_of(critical, amplitude), speeds, "amplitude", "m", table%units, "critical.csv", "column('speed_rpm')", &
      & "column('" // table%key_of("amplitude") // "')", groups, titles, "") &
      & // "set key on at screen 0.5,screen 0.004 bottom center horizontal samplen 1 font ',12'" // newline &
      & // "set format x; set xlabel 'crank speed (rpm)'" // newline // peak_panel(peaks_of(critical, force), speeds, "force", &
      & "N", table%units, "critical.csv", "column('force_speed_rpm')", "column('" // table%key_of("force") // "')", groups, &
      & titles, marks%entries) &
      & // "unset multiplot" // newline, height=nint(height_of(2)) + legend)
  end function plot_critical

  !> Peaks of the quantity `which`, as its panel shows them.
  pure function peaks_of(critical, which) result(peaks)
    type(critical_type), intent(in) :: critical(:)
    integer, intent(in) :: which
    type(peak_type) :: peaks(size(critical))
    integer :: i

    do i = 1, size(critical)
      if (critical(i)%found(which)) peaks(i) = peak_type(critical(i)%speed(which), critical(i)%height(which), &
        & critical(i)%moved%small(), concise(critical(i)%crossing%order, 4) // "×")
    end do
  end function peaks_of

end module gestell_task_critical_plot
