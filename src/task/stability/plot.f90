!> Pictures of the multipliers and their eigenvectors.
module gestell_task_stability_plot
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_output_picture_script, only: heading, panel_heading, span, write_script
  use gestell_task_response_plot, only: speed_in_words
  use gestell_model_frame, only: frame_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: plot_modes, plot_multipliers

  character, parameter :: newline = new_line("a")

contains

  !> multipliers.gp: in the plane with the unit circle, and what a turn leaves of each, ln |rho|, over the argument.
  !> Error: it cannot be written.
  subroutine plot_multipliers(folder, preamble, frame, multipliers, error)
    character(len=*), intent(in) :: folder, preamble(:)
    class(frame_type), intent(in) :: frame
    type(multipliers_type), intent(in) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: lines, words
    real(dp) :: greatest, modulus(size(multipliers%rho)), bounds(size(multipliers%rho))
    logical :: seen(size(multipliers%rho))

    modulus = abs(multipliers%rho)
    words = trim(multipliers%verdict()) // ", |ρ|max = " // concise(modulus(1), 7)
    ! What does not fit on a page beside the unit circle is outside of the left panel, and in the right one all the same.
    seen = modulus < 20
    greatest = 1.25_dp
    if (any(seen)) greatest = max(greatest, 1.1_dp * maxval(modulus, mask=seen))
    bounds = min(multipliers%error, 1.0_dp)
    lines = "set multiplot title " // heading(preamble, "Multipliers at " // speed_in_words(frame) // ": " // words) &
      & // " noenhanced" // newline // panel_heading("in the complex plane; shaded: stable") &
      & // "set lmargin screen 0.09; set rmargin screen 0.47; set bmargin screen 0.15; set tmargin screen 0.8" // newline &
      & // "set size ratio -1" // newline &
      & // "set xrange [-" // concise(greatest, 4) // ":" // concise(greatest, 4) // "]" // newline &
      & // "set yrange [-" // concise(greatest, 4) // ":" // concise(greatest, 4) // "]" // newline &
      & // "set xlabel 'Re ρ'; set ylabel 'Im ρ' offset 1" // newline &
      & // "set object 1 circle at 0,0 size 1 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 border lt -1" // newline &
      & // "set arrow 1 from graph 0,first 0 to graph 1,first 0 nohead lt 8 dt 1 lw 0.6" // newline &
      & // "set arrow 2 from first 0,graph 0 to first 0,graph 1 nohead lt 8 dt 1 lw 0.6" // newline &
      & // "plot NaN notitle"
    if (any(seen)) lines = lines // ", 'multipliers.csv' using (column('abs') < 20 ? column('re') : 1e3):" &
      & // "(column('im')):(column('abs') * (column('error') < 1 ? column('error') : 1)) with circles lt 2 dt 1 " &
      & // "fs solid 0.3 noborder notitle, 'multipliers.csv' using (column('abs') < 20 ? column('re') : 1e3):'im' " &
      & // "with points lt 2 pt 7 ps 1.1 notitle"
    lines = lines // newline // "unset object 1; unset arrow" // newline &
      & // "set lmargin screen 0.6; set rmargin screen 0.975" // newline // "set size noratio" // newline &
      & // panel_heading("growth in a turn, with error bounds") &
      & // "set xrange [-0.05:1.05]; set xlabel '|arg ρ| / π'; set xtics 0.25" // newline &
      & // "set yrange " // around_zero(multipliers%log_abs, bounds) // "; set ylabel 'ln |ρ|'" // newline &
      & // "set object 2 rectangle from graph 0,graph 0 to graph 1,first 0 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 " &
      & // "noborder" // newline &
      & // "set arrow 3 from graph 0,first 0 to graph 1,first 0 nohead lt 7 dt 1 lw 1.5" // newline // "plot NaN notitle"
    if (any(ieee_is_finite(multipliers%log_abs))) lines = lines // ", 'multipliers.csv' using " &
      & // "(abs(column('arg_rad')) / pi):'log_abs':(0):(-column('log_abs')) with vectors nohead lt 2 dt 1 lw 1 notitle, " &
      & // "'multipliers.csv' using (abs(column('arg_rad')) / pi):'log_abs':(column('error') < 1 ? column('error') : 1) " &
      & // "with yerrorbars lt 2 dt 1 lw 1.5 pt 7 ps 1.1 notitle"
    call write_script(folder, "multipliers", lines // newline // "unset multiplot" // newline // "unset output" // newline, &
      & error, width=880, height=460)
  end subroutine plot_multipliers

  !> The range of ln |rho| with its bounds and zero.
  pure function around_zero(log_abs, bounds) result(range)
    real(dp), intent(in) :: log_abs(:), bounds(:)
    character(len=:), allocatable :: range

    range = span([log_abs - bounds, log_abs + bounds, 0.15_dp * maxval(abs(log_abs), mask=ieee_is_finite(log_abs))])
  end function around_zero

  !> modes.gp: the displacements of every eigenvector as bars, a conjugate pair once. The turn psi counts by the path of a
  !> point at the frame's radius of gyration. Error: it cannot be written.
  subroutine plot_modes(folder, preamble, frame, multipliers, error)
    character(len=*), intent(in) :: folder, preamble(:)
    class(frame_type), intent(in) :: frame
    type(multipliers_type), intent(in) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: lines, places, labels
    real(dp) :: radius
    integer :: i, shown

    radius = 1
    if (frame%mass > 0 .and. frame%inertia > 0) radius = sqrt(frame%inertia / frame%mass)
    shown = 0
    places = ""
    labels = ""
    do i = 1, size(multipliers%rho)
      if (aimag(multipliers%rho(i)) < 0) then
        places = places // " -9"
        cycle
      end if
      shown = shown + 1
      places = places // " " // text(shown)
      if (shown > 1) labels = labels // ", "
      labels = labels // "'" // text(i)
      if (aimag(multipliers%rho(i)) > 0) labels = labels // ", " // text(i + 1)
      labels = labels // "' " // text(shown)
    end do
    lines = "set title " // heading(preamble, "Shapes of the modes at " // speed_in_words(frame) // ", at the start of a turn") &
      & // " noenhanced" // newline &
      & // "# a row's place among the bars, -9 for the second of a pair" // newline &
      & // "place(row) = real(word('" // places(2:) // "', int(row)))" // newline &
      & // "size_of(name) = sqrt(column(name . '_re')**2 + column(name . '_im')**2)" // newline &
      & // "radius = " // concise(radius, 9) // newline &
      & // "greatest(a, b, c) = a > b ? (a > c ? a : c) : (b > c ? b : c)" // newline &
      & // "most(row) = greatest(size_of('xi'), size_of('eta'), radius * size_of('psi'))" // newline &
      & // "part(value) = most(0) > 0 ? value / most(0) : 0" // newline &
      & // "set xrange [0.4:" // text(shown) // ".6]; set yrange [0:1.05]; set boxwidth 0.24" // newline &
      & // "set xtics (" // labels // "); set xlabel 'multipliers (largest first)'" // newline &
      & // "set ylabel 'amplitude relative to the greatest'" // newline &
      & // "set grid noxtics ytics; set key outside bottom center horizontal samplen 2" // newline &
      & // "set style fill solid 1 border lt -1" // newline &
      & // "plot 'modes.csv' using (place(column('index')) - 0.27):(part(size_of('xi'))) with boxes lt 1 dt 1 lw 1 " &
      & // "fs solid 1 title '|ξ|', '' using (place(column('index'))):(part(size_of('eta'))) with boxes lt 2 dt 1 lw 1 " &
      & // "fs pattern 2 title '|η|', '' using (place(column('index')) + 0.27):(part(radius * size_of('psi'))) " &
      & // "with boxes lt 3 dt 1 lw 1 fs solid 0.25 title 'r |ψ|, r = " // concise(radius, 3) // " m'" // newline &
      & // "unset output" // newline
    call write_script(folder, "modes", lines, error, width=720, height=460)
  end subroutine plot_modes

end module gestell_task_stability_plot
