!> Plots accuracy against computing time.
module gestell_task_trade_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_task_trade, only: trade_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: plot_trade

contains

  !> The picture trade.gp: error of the monodromy matrix Phi(T) against the number of evaluations, and against the computing time
  !> in seconds. Each method has a line.
  type(figure_type) function plot_trade(trade, with_averaged) result(figure)
    type(trade_type), intent(in) :: trade
    !> True if the table has a row for the averaged model
    logical, intent(in) :: with_averaged
    character(len=:), allocatable :: lines, curves
    integer :: i, methods

    curves = ""
    methods = 0
    do i = 1, size(trade%rows)
      if (i > 1) then
        if (trade%rows(i)%method == trade%rows(i - 1)%method) cycle
      end if
      if (.not. any(trade%rows%method == trade%rows(i)%method .and. ieee_is_finite(trade%rows%error_phi))) cycle
      methods = methods + 1
      curves = curves // curve(trim(trade%rows(i)%method), methods)
    end do
    if (with_averaged) curves = curves // curve("averaged", methods + 1)
    if (methods == 0) curves = ", NaN notitle"
    lines = "set multiplot layout 1,2 margins 0.09,0.8,0.14,0.84 spacing 0.03,0 title heading noenhanced" // newline &
      & // "above_zero(v) = v > 1e-17 ? v : 1e-17" // newline &
      & // "set logscale xy; set format '10^{%L}'; set yrange [1e-17:10]" // newline &
      & // "set key off; set ylabel 'relative error of Φ(T)'; set xlabel 'evaluations per period'" // newline &
      & // "set xrange " // decades(real(trade%rows%evaluations, dp)) // newline &
      & // "work(name) = column(name) > 0 ? column(name) : 1" // newline // "unit = 'evaluations'" // newline &
      & // "plot " // curves(3:) // newline &
      & // "set key at screen 0.985,screen 0.84 top right samplen 2 font ',12'" // newline &
      & // "set format y ''; unset ylabel; set xlabel 'time of one solution (s)'; unit = 'seconds'; set xrange " &
      & // decades((trade%rows%seconds)) // newline &
      & // "work(name) = column(name) > 1e-9 ? column(name) : 1e-9" // newline &
      & // "plot " // curves(3:) // newline // "unset multiplot" // newline
    figure = new_figure("trade", "Measured error of Φ(T) against work", lines, height=520)
  end function plot_trade

  !> Gnuplot range that contains all positive values. A factor of 2 is left as a margin at both ends.
  pure function decades(values) result(range)
    real(dp), intent(in) :: values(:)
    character(len=:), allocatable :: range

    range = "[1e-3:1]"
    if (any(values > 0)) range = "[" // concise(minval(values, mask=values > 0) / 2, 3) // ":" // concise(2 * maxval(values), 3) &
      & // "]"
  end function decades

  !> Part of the plot command that draws the points of one method as a line.
  pure function curve(method, number) result(words)
    character(len=*), intent(in) :: method
    integer, intent(in) :: number
    character(len=:), allocatable :: words

    words = ", 'trade.csv' using (strcol('method') eq '" // method // "' ? work(unit) : NaN):" &
      & // "(above_zero(column('error_phi'))) with linespoints lt " // text(1 + mod(number - 1, 8)) // " dt 1 lw 1.2 pt " &
      & // text(number) // " ps 0.7 title '" // method // "' noenhanced"
  end function curve

end module gestell_task_trade_plot
