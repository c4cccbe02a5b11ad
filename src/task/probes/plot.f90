!> Pictures of the vibration at probes.
module gestell_task_probes_plot
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_base_words, only: word_length
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_script, only: figure_type, new_figure, tic
  use gestell_output_picture_panels, only: height_of, history_panel, key_line, layout_line, order_axis, order_panel, turn_axis
  use gestell_task_probes_response, only: probe_response_type
  implicit none (type, external)
  private

  public :: plot_probes

  character, parameter :: newline = new_line("a")
  !> Columns before those of the probes.
  integer, parameter :: before = 2
  character, parameter :: along(3) = ["x", "y", "z"]

contains

  !> probes.gp, probes_history.gp, probes_harmonics.gp; of a period of so many `turns`.
  function plot_probes(responses, speed, harmonics, turns) result(figures)
    type(probe_response_type), intent(in) :: responses(:)
    real(dp), intent(in) :: speed
    integer, intent(in) :: harmonics, turns
    type(figure_type) :: figures(3)
    character(len=word_length) :: names(size(responses))
    integer :: i, axes

    do i = 1, size(names)
      names(i) = responses(i)%probe%name
    end do
    axes = size(responses(1)%parts) / 3 - 1
    figures(1) = plot_limits(names, axes)
    figures(2) = plot_histories(names, axes, speed, turns)
    figures(3) = plot_orders(names, axes, harmonics, turns)
  end function plot_probes

  !> The vibration velocity in its band, against the limit.
  function plot_limits(names, axes) result(figure)
    character(len=*), intent(in) :: names(:)
    integer, intent(in) :: axes
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    type(growing_text_type) :: tics
    integer :: i

    do i = 1, size(names)
      if (i > 1) call tics%append(", ")
      call tics%append(tic(trim(names(i))) // " " // text(i - 1))
    end do
    lines = "set title heading noenhanced" // newline // "set xtics noenhanced (" // tics%whole() // ")" // newline &
      & // "set xrange [-0.6:" // text(size(names) - 1) // ".6]; set boxwidth " &
      & // concise(0.72_dp / (axes + 1), 3) // newline &
      & // "set ylabel 'vibration velocity (mm/s)'; set grid noxtics ytics; set xtics scale 0" // newline &
      & // "set bmargin 5; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
      & // "most = 0; set table $unused" // newline &
      & // "plot [0:1] [-1:1] 'probes.csv' using (0):(v = column('v_rms_band_mm_s'), most = v > most ? v : most, " &
      & // "v = column('limit_mm_s'), most = v > most ? v : most, 0)" // newline // "unset table" // newline &
      & // "set yrange [0:(most > 0 ? 1.08 * most : 1)]" // newline &
      & // "limit(v) = v == v ? v : -1" // newline &
      & // "plot 'probes.csv' using " // boxes(1, axes, "vx_rms_band_mm_s", "along x")
    do i = 2, axes
      lines = lines // "  '' using " // boxes(i, axes, "v" // along(i) // "_rms_band_mm_s", "along " // along(i))
    end do
    lines = lines // "  '' using " // boxes(axes + 1, axes, "v_rms_band_mm_s", "greatest direction") &
      & // "  '' using ($0 - 0.42):(limit(column('limit_mm_s'))):(0.84):(0) with vectors nohead lt 7 dt 1 lw 3 " &
      & // "title 'limit'" // newline
    figure = new_figure("probes", "Vibration velocity at the probes, rms in the band, against the limit", lines, width=800, &
      & height=460)
  end function plot_limits

  !> The k-th of the boxes of a probe.
  pure function boxes(k, axes, column, title) result(words)
    integer, intent(in) :: k, axes
    character(len=*), intent(in) :: column, title
    character(len=:), allocatable :: words
    character(len=10), parameter :: fills(3) = [character(len=10) :: "solid 1", "pattern 2", "solid 0.25"]

    words = "($0 + " // concise(0.78_dp / (axes + 1) * (k - 1 - axes / 2.0_dp), 3) // "):(column('" // column &
      & // "')) with boxes lt " // text(k) // " dt 1 lw 1 fs " // trim(fills(1 + mod(k - 1, 3))) // " border lt -1 title '" &
      & // title // "', \" // newline
  end function boxes

  !> Displacement, velocity and acceleration along all axes.
  function plot_histories(names, axes, speed, turns) result(figure)
    character(len=*), intent(in) :: names(:)
    integer, intent(in) :: axes, turns
    real(dp), intent(in) :: speed
    type(figure_type) :: figure
    character(len=*), parameter :: marks(3) = [character(len=11) :: " (mm)", "' (mm/s)", "'' (m/s²)"]
    character(len=:), allocatable :: lines
    integer :: i, k, kind, axis

    lines = layout_line(3 * axes, axes)
    do k = 1, 3 * axes
      kind = 1 + (k - 1) / axes
      axis = k - axes * (kind - 1)
      lines = lines // turn_axis(speed, kind == 3, turns) // key_line(k == axes) // history_panel("probes_history.csv", &
        & along(axis) // trim(marks(kind)), merge("1e3", "1  ", kind < 3), [(before + (axes + 1) * (kind - 1) + axis &
        & + 3 * (axes + 1) * (i - 1), i = 1, size(names))], names)
    end do
    figure = new_figure("probes_history", "Displacement, velocity and acceleration at the probes over " &
      & // turns_in_words(turns), lines &
      & // "unset multiplot" // newline, width=880, height=nint(height_of(3)))
  end function plot_histories

  function plot_orders(names, axes, harmonics, turns) result(figure)
    character(len=*), intent(in) :: names(:)
    integer, intent(in) :: axes, harmonics, turns
    type(figure_type) :: figure
    character(len=:), allocatable :: lines
    integer :: i, k

    lines = layout_line(axes, 1) // "set grid noxtics ytics" &
      & // newline
    ! amplitude and phase of displacements, velocities, accelerations along the axes
    do k = 1, axes
      lines = lines // order_axis(harmonics, k == axes, turns) // key_line(k == 1) // order_panel("probes_harmonics.csv", &
        & along(k) // "' (mm/s)", "1e3", [(before + 2 * (axes + k - 1) + 1 + 6 * axes * (i - 1), i = 1, size(names))], names, turns)
    end do
    figure = new_figure("probes_harmonics", "Amplitudes of the vibration velocity at the probes", lines // "unset multiplot" &
      & // newline, width=800, height=nint(height_of(axes)))
  end function plot_orders

end module gestell_task_probes_plot
