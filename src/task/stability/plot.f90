!> Plots the multipliers of the vibration, and frequency and damping ratio of the free vibrations.
module gestell_task_stability_plot
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, newline, text
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_marks, only: unstable_fill
  use gestell_output_picture_script, only: figure_type, new_figure, panel_heading, span
  use gestell_study_mode, only: mode_type
  use gestell_task_response_plot, only: speed_in_words
  use gestell_model_frame, only: frame_type
  implicit none (type, external)
  private

  public :: plot_multipliers

  !> Height of the picture in pixels
  integer, parameter :: height = 430
  !> Moduli above this limit are not drawn
  real(dp), parameter :: largest_modulus = 20
  !> The axis of damping ratios is logarithmic if the ratio of the largest to the smallest exceeds this limit
  real(dp), parameter :: many_decades = 30
  !> Labels of modes that are nearer to each other than this part of the axes are joined
  real(dp), parameter :: least_distance = 0.08_dp

contains

  !> The picture multipliers.gp. Left panel: the multipliers in the complex plane, with the unit circle. Right panel: damping ratio
  !> against frequency, with a legend that lists both.
  type(figure_type) function plot_multipliers(frame, multipliers, modes) result(figure)
    class(frame_type), intent(in) :: frame
    type(multipliers_type), intent(in) :: multipliers
    !> Modes of the free vibration. If absent or if no mode is identified, the right panel is missing
    type(mode_type), intent(in), optional :: modes(:)
    type(mode_type), allocatable :: shown(:)
    character(len=:), allocatable :: lines
    integer :: i

    allocate(shown(0))
    if (present(modes)) shown = pack(modes, [(modes(i)%identified, i = 1, size(modes))])
    lines = "set multiplot title heading noenhanced" // newline // circle_panel(abs(multipliers%rho), frame%mechanism%turns, &
      & size(shown) > 0)
    if (size(shown) > 0) lines = lines // damping_panel(shown)
    figure = new_figure("multipliers", "Multipliers at " // speed_in_words(frame) // ": " // trim(multipliers%verdict()) &
      & // ", |ρ|max = " // concise(abs(multipliers%rho(1)), 7), lines // "unset multiplot" // newline, height=height)
  end function plot_multipliers

  !> The panel with the multipliers in the complex plane. `turns`: number of turns of the crank in the period. `beside`: true if
  !> there is a panel on its right.
  pure function circle_panel(modulus, turns, beside) result(lines)
    real(dp), intent(in) :: modulus(:)
    integer, intent(in) :: turns
    logical, intent(in) :: beside
    character(len=:), allocatable :: lines, range
    real(dp) :: half_width

    half_width = 1.25_dp
    if (any(modulus < largest_modulus)) half_width = max(half_width, 1.1_dp * maxval(modulus, mask=modulus < largest_modulus))
    range = "range [-" // concise(half_width, 4) // ":" // concise(half_width, 4) // "]; "
    lines = panel_heading("multipliers of " // turns_in_words(turns) // "; shaded: stable") &
      & // "set lmargin screen " // either("0.11", "0.3 ", beside) &
      & // "; set rmargin screen " // either("0.47", "0.84", beside) // "; set bmargin screen 0.29; set tmargin screen 0.81" &
      & // newline // "set size ratio -1; set x" // range // "set y" // range // "set xtics 0.5; set ytics 0.5" // newline &
      & // "set xlabel 'Re ρ'; set ylabel 'Im ρ' offset 1" // newline &
      & // "set object 1 circle at 0,0 size 1 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 border lt -1" // newline &
      & // "set arrow 1 from graph 0,first 0 to graph 1,first 0 nohead lt 8 dt 1 lw 0.6" // newline &
      & // "set arrow 2 from first 0,graph 0 to first 0,graph 1 nohead lt 8 dt 1 lw 0.6" // newline &
      & // "drawn(v) = column('abs') < " // concise(largest_modulus, 3) // " ? v : 1e3" // newline // "plot NaN notitle"
    if (any(modulus < largest_modulus)) lines = lines // ", 'multipliers.csv' using (drawn(column('re'))):'im':" &
      & // "(column('abs') * (column('error') < 1 ? column('error') : 1)) with circles lt 1 dt 1 fs solid 0.3 noborder notitle, " &
      & // "'' using (drawn(column('re'))):'im':(column('abs') > 1 + column('error') ? 0xD55E00 : 0x0072B2) with points pt 7 " &
      & // "ps 0.9 lc rgb variable notitle"
    lines = lines // newline // "unset object 1; unset arrow" // newline
  end function circle_panel

  !> The panel with the damping ratio of each mode against its frequency. Modes that grow are orange.
  pure function damping_panel(modes) result(lines)
    type(mode_type), intent(in) :: modes(:)
    character(len=:), allocatable :: lines, numbers
    real(dp) :: frequency(size(modes)), ratio(size(modes)), bound(size(modes)), place(size(modes), 2)
    logical :: logarithmic
    integer :: labelled_at(size(modes)), i, k

    frequency = modes%frequency() / (2 * pi)
    ratio = 100 * modes%damping_ratio()
    bound = 100 * modes%error / max(modes%error, hypot(modes%growth, 2 * pi * frequency), tiny(1.0_dp))
    logarithmic = all(ratio > 0)
    if (logarithmic) logarithmic = maxval(ratio) > many_decades * minval(ratio)
    ! modes whose labels would cover each other have a common label at the last of them, where no point covers it
    place(:, 1) = frequency / max(1.15_dp * maxval(frequency), tiny(1.0_dp))
    place(:, 2) = ratio / max(1.2_dp * maxval(abs(ratio)), tiny(1.0_dp))
    if (logarithmic) place(:, 2) = log(ratio) / log(4 * maxval(ratio) / minval(ratio))
    labelled_at = [(i, i = 1, size(modes))]
    do i = size(modes) - 1, 1, -1
      k = i + findloc(labelled_at(i + 1:) == [(k, k = i + 1, size(modes))] .and. maxval(abs(place(i + 1:, :) &
        & - spread(place(i, :), 1, size(modes) - i)), dim=2) < least_distance, .true., dim=1)
      labelled_at(i) = labelled_at(k)
    end do
    lines = "$modes << EOD" // newline // "frequency,ratio,bound,colour,number" // newline
    do i = 1, size(modes)
      numbers = ""
      do k = 1, i
        if (labelled_at(k) == i) numbers = numbers // either(", ", "", numbers /= "") // text(k)
      end do
      lines = lines // concise(frequency(i), 7) // "," // concise(ratio(i), 7) // "," // concise(bound(i), 2) // "," &
        & // either("0xD55E00", "0x0072B2", modes(i)%grows()) // ",""" // numbers // """" // newline
    end do
    lines = lines // "EOD" // newline // panel_heading("free vibrations") &
      & // "set lmargin screen 0.64; set rmargin screen 0.97; set size noratio" // newline &
      & // "set xrange [0:" // concise(max(1.15_dp * maxval(frequency), 1.0e-3_dp), 4) // "]; set xlabel 'frequency (Hz)'; " &
      & // "set xtics autofreq" // newline // "set ylabel 'damping ratio (%)' offset 0; set ytics autofreq" // newline
    if (logarithmic) then
      lines = lines // "set logscale y; set yrange [" // concise(minval(ratio) / 2, 3) // ":" // concise(2 * maxval(ratio), 3) &
        & // "]" // newline
    else
      lines = lines // "set yrange " // span([0.0_dp, ratio, 1.15_dp * ratio], 1.0e-9_dp) // newline
      if (any(ratio < 0)) lines = lines // "set object 2 rectangle from graph 0,graph 0 to graph 1,first 0 behind " &
        & // unstable_fill // newline
      lines = lines // "set arrow 3 from graph 0,first 0 to graph 1,first 0 nohead lt 7 dt 1 lw 1" // newline
    end if
    do i = 1, size(modes)
      lines = lines // "set label " // text(i) // " '" // text(i) // ":  " // concise(frequency(i), 4) // " Hz,  " &
        & // concise(ratio(i), 3) // " %' at screen " // concise(0.05_dp + 0.325_dp * mod(i - 1, 3), 3) // ",screen " &
        & // concise(0.09_dp - 0.05_dp * ((i - 1) / 3), 3) // " font ',13'" // newline
    end do
    lines = lines // "plot $modes using 1:2:3:4 with yerrorbars pt 7 ps 0.9 lw 1.5 lc rgb variable notitle, " &
      & // "'' using 1:2:5 with labels offset 0.9,0.6 font ',12' notitle" // newline
  end function damping_panel

end module gestell_task_stability_plot
