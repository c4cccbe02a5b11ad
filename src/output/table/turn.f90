!> Columns that tables over one turn of the crank have in common: histories and harmonics.
module gestell_output_table_turn
  use gestell_base_kinds, only: dp
  use gestell_math_fourier, only: fourier_type
  use gestell_output_table, only: table_type
  use gestell_output_table_unit, only: degree, hertz, radian, second, unit_type
  implicit none (type, external)
  private

  public :: add_harmonics, add_orders, add_turn

contains

  !> Crank angle and time of `points` + 1 rows; `speed` in rad/s, `period` in s.
  pure subroutine add_turn(table, speed, period, points)
    type(table_type), intent(inout) :: table
    real(dp), intent(in) :: speed, period
    integer, intent(in) :: points
    integer :: k

    call table%add("crank", degree, "crank angle, negative for a clockwise crank", [(sign(360.0_dp, speed) * k / points, k = 0, &
      & points)])
    call table%add("t", second, "time", [(period * k / points, k = 0, points)])
  end subroutine add_turn

  !> Orders of the crank from 0, the mean, to `last`, and their frequencies.
  pure subroutine add_orders(table, period, last)
    type(table_type), intent(inout) :: table
    real(dp), intent(in) :: period
    integer, intent(in) :: last
    integer :: k

    call table%add("order", "order of the crank; 0: the mean", [(k, k = 0, last)])
    call table%add("frequency", hertz, "of the order", [(k / period, k = 0, last)])
  end subroutine add_orders

  !> Amplitude and phase of a series in `unit`, orders 0 to `last`. Order 0 is the mean, with its sign.
  pure subroutine add_harmonics(table, name, unit, series, last)
    type(table_type), intent(inout) :: table
    character(len=*), intent(in) :: name
    type(unit_type), intent(in) :: unit
    type(fourier_type), intent(in) :: series
    integer, intent(in) :: last
    real(dp) :: amplitude(0:last), phase(0:last)
    integer :: n

    amplitude = 0
    phase = 0
    n = min(last, size(series%amplitude))
    amplitude(0) = series%mean
    amplitude(1:n) = series%amplitude(:n)
    phase(1:n) = series%phase(:n)
    call table%add(trim(name) // "_" // trim(unit%suffix) // "_amplitude", unit_type(words=unit%words), &
      & "amplitude of amplitude cos(2 pi order t / T + phase)", amplitude)
    call table%add(trim(name) // "_" // trim(unit%suffix) // "_phase", radian, "phase of the same", phase)
  end subroutine add_harmonics

end module gestell_output_table_turn
