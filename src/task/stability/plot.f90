!> Plots the multipliers of the vibration.
module gestell_task_stability_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_script, only: figure_type, new_figure, panel_heading, span
  use gestell_task_response_plot, only: speed_in_words
  use gestell_model_frame, only: frame_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: plot_multipliers

contains

  !> The picture multipliers.gp. Left panel: the multipliers in the complex plane, with the unit circle. Right panel: ln |rho|
  !> against the argument of the multiplier.
  type(figure_type) function plot_multipliers(frame, multipliers) result(figure)
    class(frame_type), intent(in) :: frame
    type(multipliers_type), intent(in) :: multipliers
    character(len=:), allocatable :: lines, words, around_zero
    real(dp) :: half_width, modulus(size(multipliers%rho)), bounds(size(multipliers%rho))
    logical :: visible(size(multipliers%rho))

    modulus = abs(multipliers%rho)
    words = trim(multipliers%verdict()) // ", |ρ|max = " // concise(modulus(1), 7)
    ! Multipliers that are too large for a panel with the unit circle appear only in the right panel.
    visible = modulus < 20
    half_width = 1.25_dp
    if (any(visible)) half_width = max(half_width, 1.1_dp * maxval(modulus, mask=visible))
    bounds = min(multipliers%error, 1.0_dp)
    associate (logs => multipliers%log_abs)
      around_zero = span([logs - bounds, logs + bounds, 0.15_dp * maxval(abs(logs), mask=ieee_is_finite(logs))])
    end associate
    lines = "set multiplot title heading noenhanced" // newline // panel_heading("in the complex plane; shaded: stable") &
      & // "set lmargin screen 0.09; set rmargin screen 0.47; set bmargin screen 0.15; set tmargin screen 0.8" // newline &
      & // "set size ratio -1" // newline &
      & // "set xrange [-" // concise(half_width, 4) // ":" // concise(half_width, 4) // "]" // newline &
      & // "set yrange [-" // concise(half_width, 4) // ":" // concise(half_width, 4) // "]" // newline &
      & // "set xlabel 'Re ρ'; set ylabel 'Im ρ' offset 1" // newline &
      & // "set object 1 circle at 0,0 size 1 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 border lt -1" // newline &
      & // "set arrow 1 from graph 0,first 0 to graph 1,first 0 nohead lt 8 dt 1 lw 0.6" // newline &
      & // "set arrow 2 from first 0,graph 0 to first 0,graph 1 nohead lt 8 dt 1 lw 0.6" // newline &
      & // "plot NaN notitle"
    if (any(visible)) lines = lines // ", 'multipliers.csv' using (column('abs') < 20 ? column('re') : 1e3):" &
      & // "(column('im')):(column('abs') * (column('error') < 1 ? column('error') : 1)) with circles lt 2 dt 1 " &
      & // "fs solid 0.3 noborder notitle, 'multipliers.csv' using (column('abs') < 20 ? column('re') : 1e3):'im' " &
      & // "with points lt 2 pt 7 ps 1.1 notitle"
    lines = lines // newline // "unset object 1; unset arrow" // newline &
      & // "set lmargin screen 0.6; set rmargin screen 0.975" // newline // "set size noratio" // newline &
      & // panel_heading("growth in " // turns_in_words(frame%mechanism%turns) // ", with error bounds") &
      & // "set xrange [-0.05:1.05]; set xlabel '|arg ρ| / π'; set xtics 0.25" // newline &
      & // "set yrange " // around_zero // "; set ylabel 'ln |ρ|'" // newline &
      & // "set object 2 rectangle from graph 0,graph 0 to graph 1,first 0 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 " &
      & // "noborder" // newline &
      & // "set arrow 3 from graph 0,first 0 to graph 1,first 0 nohead lt 7 dt 1 lw 1.5" // newline // "plot NaN notitle"
    if (any(ieee_is_finite(multipliers%log_abs))) lines = lines // ", 'multipliers.csv' using " &
      & // "(abs(column('arg_rad')) / pi):'log_abs':(0):(-column('log_abs')) with vectors nohead lt 2 dt 1 lw 1 notitle, " &
      & // "'multipliers.csv' using (abs(column('arg_rad')) / pi):'log_abs':(column('error') < 1 ? column('error') : 1) " &
      & // "with yerrorbars lt 2 dt 1 lw 1.5 pt 7 ps 1.1 notitle"
    figure = new_figure("multipliers", "Multipliers at " // speed_in_words(frame) // ": " // words, lines // newline &
      & // "unset multiplot" // newline, width=880, height=460)
  end function plot_multipliers

end module gestell_task_stability_plot
