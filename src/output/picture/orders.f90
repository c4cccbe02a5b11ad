!> Composes gnuplot panels with amplitudes over the orders of the crank speed, drawn as stems.
module gestell_output_picture_orders
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, maximum_of, unit_of
  use gestell_output_picture_panels, only: longest_entry
  use gestell_output_picture_script, only: quoted
  use gestell_output_table, only: table_type
  implicit none (type, external)
  private

  public :: highest_order, order_axis, order_panel

  !> `least`: amplitudes below this fraction of the largest amplitude in the same unit are not drawn. `fewest`: minimum number of
  !> orders on the axis
  real(dp), parameter :: least = 1.0e-3_dp
  integer, parameter :: fewest = 4

contains

  !> Number of the highest harmonic whose amplitude in one of the columns reaches `least` times the largest amplitude in the same
  !> unit. The axis ends there, so that the orders that matter fill the picture.
  pure integer function highest_order(table, columns, turns) result(highest)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: columns(:)
    !> Number of turns that the crank completes in the period
    integer, intent(in) :: turns
    real(dp) :: maxima(size(columns))
    integer :: numbers(size(columns)), i, k

    do i = 1, size(columns)
      numbers(i) = table%number_of(columns(i))
      maxima(i) = maxval([0.0_dp, abs(table%columns(numbers(i))%numbers)])
    end do
    highest = fewest * turns
    do i = 1, size(columns)
      associate (own => table%columns(numbers(i)))
        do k = 1, size(columns)
          if (table%columns(numbers(k))%unit%words == own%unit%words) maxima(i) = max(maxima(i), maxima(k))
        end do
        do k = highest + 2, table%rows
          if (abs(own%numbers(k)) > least * maxima(i)) highest = k - 1
        end do
      end associate
    end do
    highest = min(highest, table%rows - 1)
  end function highest_order

  !> Gnuplot lines for an axis of orders (multiples of the crank speed) from 0 to that of harmonic `last` of the period. Its label
  !> states the frequency of order 1. `named`: true if tics and axis are to be labelled.
  pure function order_axis(table, last, named, turns) result(lines)
    !> Table with the columns `order` and `frequency`
    type(table_type), intent(in) :: table
    integer, intent(in) :: last, turns
    logical, intent(in) :: named
    character(len=:), allocatable :: lines, label
    integer, parameter :: steps(5) = [1, 2, 5, 10, 20]
    integer :: i

    label = "order of the crank"
    associate (frequency => table%columns(table%number_of("frequency"))%numbers)
      if (size(frequency) > 1) label = label // " (1: " // concise(turns * frequency(2), 4) // " Hz)"
    end associate
    i = findloc(last <= 8 * turns * steps, .true., dim=1)
    if (i == 0) i = size(steps)
    lines = "set xrange [" // concise(-0.6_dp / turns, 6) // ":" // concise((last + 0.6_dp) / turns, 6) // "]; set xtics " &
      & // text(steps(i)) // newline &
      & // either("set format x; set xlabel '" // label // "'", "set format x ''; unset xlabel", named) // newline
  end function order_axis

  !> Gnuplot lines for a panel with amplitudes over the orders: a stem for each order and column. The y axis is logarithmic and ends
  !> three decades below the largest amplitude.
  pure function order_panel(table, name, columns, titles, turns) result(lines)
    type(table_type), intent(in) :: table
    !> `name`: label of the y axis, without the unit. `columns`: names of the columns, which have the same unit. `titles`: title of
    !> the stems of each column
    character(len=*), intent(in) :: name, columns(:), titles(:)
    !> Number of turns that the crank completes in a period; it determines the distance of the stems of an order
    integer, intent(in) :: turns
    character(len=:), allocatable :: lines, x, y, style, lowest
    type(growing_text_type) :: curves
    type(axis_unit_type) :: unit
    real(dp) :: most
    integer :: i

    unit = unit_of(table, columns)
    most = maximum_of(table, columns)
    lowest = concise(least * unit%factor * most, 3)
    do i = 1, size(columns)
      x = "(column('order') + " // concise(0.7_dp / size(columns) / turns * (i - 0.5_dp * (size(columns) + 1)), 3) // ")"
      ! a mark below the lowest amplitude would be cut off by the edge of the panel
      y = "(v = abs(" // trim(unit%words) // " * column(" // text(table%number_of(columns(i))) // ")), v >= " // lowest &
        & // " ? v : NaN)"
      style = "lt " // text(1 + mod(i - 1, 8))
      call curves%append(either(", \" // newline // "  ", "", i > 1) // "'" // table%name // ".csv' using " // x // ":" // y &
        & // " with impulses " // style // " dt 1 lw 2 notitle, '' using " // x // ":" // y // " with points " // style &
        & // " ps 0.8 title " // quoted(trim(titles(i)), longest_entry) // " noenhanced")
    end do
    lines = "unset logscale y; set yrange [0:1]; set format y" // newline
    if (most > 0) lines = "set logscale y; set yrange [" &
      & // concise(0.6_dp * least * unit%factor * most, 3) // ":" // concise(2 * unit%factor * most, 3) // "]; set format y '%g'" &
      & // newline
    lines = lines // "set ylabel " // quoted(label_with(name, unit)) // " noenhanced" // newline // "plot " // curves%whole() &
      & // newline
  end function order_panel

end module gestell_output_picture_orders
