!> Pictures of the vibration at probes.
module gestell_task_probes_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_output_picture_script, only: figure_type, new_figure, tic
  use gestell_output_picture_panels, only: height_of, history_panel, key_line, layout_line, order_axis, order_panel, turn_axis
  use gestell_task_probes_response, only: probe_response_type
  implicit none (type, external)
  private

  public :: plot_probes

  character, parameter :: newline = new_line("a")
  !> Columns before those of the probes, and of each: x, y, their size, the same of velocity and acceleration; of harmonics x
  !> and y alone, amplitude and phase.
  integer, parameter :: before = 2, of_history = 9, of_harmonics = 12

contains

  !> probes.gp, probes_history.gp, probes_harmonics.gp.
  function plot_probes(responses, speed, harmonics) result(figures)
    type(probe_response_type), intent(in) :: responses(:)
    real(dp), intent(in) :: speed
    integer, intent(in) :: harmonics
    type(figure_type) :: figures(3)
    character(len=64) :: names(size(responses))
    integer :: i

    do i = 1, size(names)
      names(i) = responses(i)%probe%name
    end do
    figures(1) = plot_limits(names)
    figures(2) = plot_histories(names, speed)
    figures(3) = plot_orders(names, harmonics)
  end function plot_probes

  !> The vibration velocity in its band, against the limit.
  function plot_limits(names) result(figure)
    character(len=*), intent(in) :: names(:)
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    integer :: i

    lines = "set title heading noenhanced" // newline // "set xtics noenhanced ("
    do i = 1, size(names)
      if (i > 1) lines = lines // ", "
      lines = lines // tic(trim(names(i))) // " " // text(i - 1)
    end do
    lines = lines // ")" // newline // "set xrange [-0.6:" // text(size(names) - 1) // ".6]; set boxwidth 0.24" // newline &
      & // "set ylabel 'vibration velocity (mm/s)'; set grid noxtics ytics; set xtics scale 0" // newline &
      & // "set bmargin 5; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
      & // "most = 0; set table $unused" // newline &
      & // "plot [0:1] [-1:1] 'probes.csv' using (0):(v = column('v_rms_band_mm_s'), most = v > most ? v : most, " &
      & // "v = column('limit_mm_s'), most = v > most ? v : most, 0)" // newline // "unset table" // newline &
      & // "set yrange [0:(most > 0 ? 1.08 * most : 1)]" // newline &
      & // "limit(v) = v == v ? v : -1" // newline &
      & // "plot 'probes.csv' using ($0 - 0.26):(column('vx_rms_band_mm_s')) with boxes lt 1 dt 1 lw 1 fs solid 1 border lt -1 " &
      & // "title 'along x', \" // newline // "  '' using 0:(column('vy_rms_band_mm_s')) with boxes lt 2 dt 1 lw 1 fs pattern 2 " &
      & // "border lt -1 title 'along y', \" // newline // "  '' using ($0 + 0.26):(column('v_rms_band_mm_s')) with boxes lt 3 " &
      & // "dt 1 lw 1 fs solid 0.25 border lt -1 title 'greatest direction', \" // newline &
      & // "  '' using ($0 - 0.42):(limit(column('limit_mm_s'))):(0.84):(0) with vectors nohead lt 7 dt 1 lw 3 " &
      & // "title 'limit'" // newline
    figure = new_figure("probes", "Vibration velocity at the probes, rms in the band, against the limit", lines, width=800, &
      & height=460)
  end function plot_limits

  !> Displacement, velocity and acceleration along both axes.
  function plot_histories(names, speed) result(figure)
    character(len=*), intent(in) :: names(:)
    real(dp), intent(in) :: speed
    type(figure_type) :: figure
    character(len=*), parameter :: labels(6) = [character(len=12) :: "x (mm)", "y (mm)", "x' (mm/s)", "y' (mm/s)", "x'' (m/s²)", &
      & "y'' (m/s²)"]
    integer, parameter :: parts(6) = [1, 2, 4, 5, 7, 8]
    character(len=:), allocatable :: lines
    integer :: i, k

    lines = layout_line(6, 2)
    do k = 1, 6
      lines = lines // turn_axis(speed, k > 4) // key_line(k == 2) // history_panel("probes_history.csv", trim(labels(k)), &
        & merge("1e3", "1  ", k <= 4), [(before + parts(k) + of_history * (i - 1), i = 1, size(names))], names)
    end do
    figure = new_figure("probes_history", "Displacement, velocity and acceleration at the probes over a turn", lines &
      & // "unset multiplot" // newline, width=880, height=nint(height_of(3)))
  end function plot_histories

  function plot_orders(names, harmonics) result(figure)
    character(len=*), intent(in) :: names(:)
    integer, intent(in) :: harmonics
    type(figure_type) :: figure
    character(len=*), parameter :: labels(2) = [character(len=12) :: "x' (mm/s)", "y' (mm/s)"]
    character(len=:), allocatable :: lines
    integer :: i, k

    lines = layout_line(2, 1) // "set grid noxtics ytics" &
      & // newline
    do k = 1, 2
      lines = lines // order_axis(harmonics, k == 2) // key_line(k == 1) // order_panel("probes_harmonics.csv", trim(labels(k)), &
        & "1e3", [(before + 2 * (k + 1) + 1 + of_harmonics * (i - 1), i = 1, size(names))], names)
    end do
    figure = new_figure("probes_harmonics", "Amplitudes of the vibration velocity at the probes", lines // "unset multiplot" &
      & // newline, width=800, height=nint(height_of(2)))
  end function plot_orders

end module gestell_task_probes_plot
