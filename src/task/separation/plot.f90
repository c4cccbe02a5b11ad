!> Plots the frequencies of the modes and the orders of the crank against the speed.
module gestell_task_separation_plot
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, newline, text
  use gestell_output_report_orders, only: range_of
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_task_campbell, only: campbell_type
  use gestell_task_separation, only: separation_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: plot_separation

  !> `narrow`: width of the speed range that is drawn for a single speed, relative to this speed. `side_margin`: distance by which
  !> the plot extends beyond each end of the range, relative to the speed at this end. `highest`: the frequency
  !> axis ends at most at this multiple of the highest mode
  real(dp), parameter :: narrow = 0.04_dp, side_margin = 0.2_dp, highest = 1.5_dp

contains

  !> The picture separation.gp: frequencies of the modes against the speed, and the lines of the orders. Within the range of
  !> operation, the region in which a frequency is too near to an order is shaded.
  type(figure_type) function plot_separation(separations, campbell, harmonics, turns, margin) result(figure)
    type(separation_type), intent(in) :: separations(:)
    type(campbell_type), intent(in) :: campbell
    !> `harmonics`: numbers of the harmonics of the period. `turns`: number of turns that the crank makes in the period
    integer, intent(in) :: harmonics(:), turns
    !> Required distance of a mode from an order (%)
    real(dp), intent(in) :: margin
    character(len=:), allocatable :: lines, bands, curves, top_words
    real(dp) :: range(2), orders(size(harmonics)), top, at
    integer :: i, k, n

    range = [minval(abs(campbell%points%speed)), maxval(abs(campbell%points%speed))]
    if (.not. range(2) > range(1)) range = range * [1 - narrow / 2, 1 + narrow / 2]
    orders = real(harmonics, dp) / turns
    top = maxval(orders) * range(2) / 60 * (1 + margin / 100)
    ! orders far above all modes do not matter
    associate (modes => pack((separations%frequency), ieee_is_finite(separations%frequency)))
      if (size(modes) > 0) top = max(maxval(modes), min(top, highest * maxval(modes)))
    end associate
    top_words = concise(1.1_dp * top, 6)
    associate (left => range(1) * (1 - side_margin), right => range(2) * (1 + side_margin))
      lines = "set title heading noenhanced" // newline &
        & // "set xrange [" // concise(left, 7) // ":" // concise(right, 7) // "]" // newline &
        & // "set yrange [0:" // top_words // "]" // newline &
        & // "set xlabel 'crank speed (rpm)'; set ylabel 'frequency (Hz)'" // newline &
        & // "set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
        & // "set print $range; print 'speed_rpm'; do for [i=0:100] { print " // concise(range(1), 7) // " + i * " &
        & // concise((range(2) - range(1)) / 100, 9) // " }; unset print" // newline &
        & // "# gnuplot does not clip filled curves" // newline // "shown(v) = v < " // top_words // " ? v : " // top_words &
        & // newline
      bands = ""
      curves = ""
      do k = 1, size(orders)
        at = min(right, 60 * top / orders(k))
        if (at > left + 0.1_dp * (right - left)) lines = lines // "set label " // text(k) // " '" // concise(orders(k), 4) &
          & // "×' at " // concise(at, 7) // "," // concise(orders(k) * at / 60, 7) // " right offset -0.5,0.5 " &
          & // "font ',12' textcolor rgb '#666666' front" // newline
        bands = bands // ", $range using 1:(shown(" // concise(orders(k), 9) // " * $1 / 60 * " &
          & // concise(max(0.0_dp, 1 - margin / 100), 6) // ")):(shown(" // concise(orders(k), 9) // " * $1 / 60 * " &
          & // concise(1 + margin / 100, 6) // ")) with filledcurves lc rgb '#F7E2B3' fs solid 1 noborder " &
          & // either("title 'margin'", "notitle", k == 1)
        curves = curves // ", " // concise(orders(k), 9) // " * x / 60 with lines lt 8 dt 1 lw 0.8 notitle"
      end do
    end associate
    do k = 1, campbell%modes
      lines = lines // "$mode" // text(k) // " << END" // newline // "speed_rpm,frequency_Hz" // newline
      do i = 1, size(campbell%points)
        associate (speed => campbell%points(i)%speed, mode => campbell%points(i)%modes(k))
          if (.not. mode%identified) cycle
          ! a mode that is known at a single speed is drawn as a short line
          do n = 1, merge(2, 1, size(campbell%points) == 1)
            at = abs(speed)
            if (size(campbell%points) == 1) at = range(n)
            lines = lines // concise(at, 9) // "," // concise(mode%frequency() / (2 * pi), 9) // newline
          end do
        end associate
      end do
      lines = lines // "END" // newline
      curves = curves // ", $mode" // text(k) // " using 1:2 with lines lt " // text(k) // " title 'mode " // text(k) // "'"
    end do
    if (any(separations%state == "fail")) curves = curves // ", 'separation.csv' using (stringcolumn('state') eq 'fail' ? " &
      & // "abs(column('speed_rpm')) : NaN):'frequency_Hz' with points lt 2 pt 6 ps 2 lw 2 title 'too close'"
    bands = bands // curves
    lines = lines // "plot " // bands(3:) // newline
    figure = new_figure("separation", "Natural frequencies and orders " // range_of(maxval(harmonics) / turns, turns) &
      & // " of the crank, margin " // concise(margin, 4) // " %", lines, height=520)
  end function plot_separation

end module gestell_task_separation_plot
