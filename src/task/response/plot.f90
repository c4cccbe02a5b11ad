!> Plots the periodic vibration over the period, and its harmonics.
module gestell_task_response_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_output_picture_script, only: figure_type, new_figure, axis_unit_type, panel_heading, pick_unit, span
  use gestell_output_picture_panels, only: bars
  use gestell_output_report_significance, only: zero_if_noise
  use gestell_output_table, only: table_type
  use gestell_output_table_turn, only: amplitude_of
  use gestell_model_frame, only: frame_type
  use gestell_study_vibration, only: vibration_type
  use gestell_task_response_names, only: name_type, names_of
  implicit none (type, external)
  private

  public :: plot_harmonics, plot_response, speed_in_words

contains

  !> The picture of the table response.csv: motion of the frame and forces on the ground against the crank angle.
  type(figure_type) function plot_response(table, frame, vibration) result(figure)
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    character(len=:), allocatable :: lines
    type(axis_unit_type) :: unit
    real(dp) :: scale, noise
    type(name_type) :: names(3 * frame%dofs())
    integer :: i, k, n, first

    n = frame%dofs()
    names = names_of(n)
    lines = "set multiplot layout " // text(n) // ",2 margins 0.125,0.975,0.1,0.86 spacing 0.135," &
      & // either("0.065", "0.04", n == 3) // " title heading noenhanced" // newline &
      & // "set xtics 90; set format x ''" // newline &
      & // "set xrange [0:" // text(nint(frame%degrees_per_period())) // "]" // newline
    do i = 1, 2 * n
      ! place each coordinate next to the force or moment in its direction
      k = (i + 1) / 2 + merge(0, 2 * n, mod(i, 2) == 1)
      first = n * ((k - 1) / n) + 1
      unit = pick_unit(trim(names(k)%unit%words), vibration%peak(k))
      scale = unit%factor * zero_if_noise(vibration%peak(k), vibration%peak_error(k), maxval(vibration%peak(first:first + n - 1)))
      ! variations are not enlarged if they are below the error bound, or below the rounding error of quantities of the same kind
      noise = 2 * vibration%peak_error(k)
      if (k < first + 2) noise = max(noise, 1.0e-9_dp * maxval(vibration%peak(first:first + 1)))
      if (i == 2 * n - 1) lines = lines // "set format x; set xlabel 'crank angle (deg)'" // newline
      lines = lines // panel_heading("peak " // concise(scale * vibration%peak(k), 4) // ", rms " &
        & // concise(scale * vibration%rms(k), 4) // " " // trim(unit%name)) &
        & // "set ylabel '" // trim(names(k)%symbol) // " (" // trim(unit%name) // ")'" // newline &
        & // "set yrange " // span(unit%factor * vibration%history(k, :), unit%factor * noise) // newline &
        & // "plot 'response.csv' using 'crank_deg':(" // trim(unit%words) // " * column('" // table%key_of(names(k)%column) &
        & // "')) with lines lt " // text(merge(1, 2, mod(i, 2) == 1)) // " dt 1 notitle" // newline
    end do
    figure = new_figure("response", "Periodic vibration and forces on the ground at " // speed_in_words(frame), lines &
      & // "unset multiplot" // newline, width=880, height=220 * n)
  end function plot_response

  !> The picture of the table harmonics.csv: amplitudes of the quantities for each order.
  type(figure_type) function plot_harmonics(table, frame, harmonics, vibration) result(figure)
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame
    !> Highest harmonic that is drawn
    integer, intent(in) :: harmonics
    type(vibration_type), intent(in) :: vibration
    character(len=:), allocatable :: lines
    real(dp) :: step
    integer :: i, n

    n = frame%dofs()
    step = 1.0_dp / frame%mechanism%turns
    lines = "set multiplot layout 2,1 margins 0.11,0.98,0.11,0.79 spacing 0,0.08 title heading noenhanced" // newline &
      & // "set xrange [" // concise(-0.6_dp * step, 6) // ":" // concise((harmonics + 0.6_dp) * step, 6) // "]" // newline &
      & // "set key inside top right horizontal samplen 2" // newline &
      & // "set grid noxtics ytics" // newline &
      & // "set link x2 via x * " // concise(1 / frame%period / step, 9) // " inverse x / " &
      & // concise(1 / frame%period / step, 9) // newline &
      & // "set x2tics; set x2label 'frequency (Hz)'" // newline // "set xtics nomirror; set format x ''" // newline &
      & // "set boxwidth " // concise(0.78_dp / n * step, 3) // newline // "set style fill solid 1 border lt -1" // newline
    do i = 0, 1
      lines = lines // panel(table, vibration, harmonics, step, n, 2 * n * i)
      if (i == 0) lines = lines // "unset x2label; set format x2 ''; set format x" // newline &
        & // "set xlabel 'order of the crank (0: magnitude of the mean)'" // newline
    end do
    figure = new_figure("harmonics", "Harmonics of the vibration and of the forces on the ground at " // speed_in_words(frame), &
      & lines // "unset multiplot" // newline, width=880, height=640)
  end function plot_harmonics

  !> A panel of the picture. It shows `n` quantities as bars, beginning with quantity number `first` + 1. Its logarithmic axis
  !> covers six decades below the maximum.
  pure function panel(table, vibration, harmonics, step, n, first) result(lines)
    type(table_type), intent(in) :: table
    type(vibration_type), intent(in) :: vibration
    real(dp), intent(in) :: step
    integer, intent(in) :: harmonics, n, first
    character(len=:), allocatable :: lines
    type(axis_unit_type) :: units(n)
    type(name_type) :: names(3 * n)
    real(dp) :: maximum
    integer :: i, k

    maximum = 0
    names = names_of(n)
    do i = 1, n
      k = first + i
      associate (series => vibration%series(k))
        units(i) = pick_unit(trim(names(k)%unit%words), vibration%peak(k))
        maximum = max(maximum, units(i)%factor * abs(series%mean))
        if (harmonics > 0) maximum = max(maximum, units(i)%factor * maxval(series%amplitude(:harmonics)))
      end associate
    end do
    lines = "set ylabel 'amplitude'" // newline
    if (maximum > 0) then
      lines = lines // "set logscale y" // newline // "set format y '10^{%L}'" // newline &
        & // "set yrange [" // concise(maximum * 1.0e-6_dp, 3) // ":" // concise(maximum * 30, 3) // "]" // newline
    else
      lines = lines // "set yrange [0:1]" // newline
    end if
    lines = lines // "plot "
    do i = 1, n
      associate (name => names(first + i))
        lines = lines // either(", ", "", i > 1) // "'harmonics.csv' using (column('order') + " &
          & // concise(0.84_dp / n * step * (i - (n + 1) / 2.0_dp), 3) // "):(" // trim(units(i)%words) // " * abs(column('" &
          & // table%key_of(amplitude_of(name%column, name%unit)) // "'))) with " // bars(i, 3) // " title '" &
          & // trim(name%symbol) // " (" // trim(units(i)%name) // ")'"
      end associate
    end do
    lines = lines // newline
  end function panel

  !> The drive speed as text, for example "360 rpm".
  pure function speed_in_words(frame) result(words)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: words

    words = concise(frame%drive_rpm(), 6) // " rpm"
  end function speed_in_words

end module gestell_task_response_plot
