!> Adds the columns that all tables over the period share: crank angle, time, orders and harmonics.
module gestell_output_table_turn
  use gestell_base_kinds, only: dp
  use gestell_math_series_fourier, only: fourier_type
  use gestell_model_frame, only: frame_type
  use gestell_output_table, only: table_type
  use gestell_output_table_unit, only: degree, hertz, plain, radian, second, unit_type
  implicit none (type, external)
  private

  public :: add_harmonics, add_order_column, add_orders, add_turn, amplitude_of

contains

  !> Adds two columns, crank angle and time, with `points` + 1 rows that cover one period of the frame.
  pure subroutine add_turn(table, frame, points)
    type(table_type), intent(inout) :: table
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: points
    integer :: k

    call table%add("crank", degree, "crank angle, negative if the crank turns clockwise", &
      & [(frame%degrees_per_period() * k / points, k = 0, points)])
    call table%add("t", second, "time", [(frame%period * k / points, k = 0, points)])
  end subroutine add_turn

  !> Adds two columns, order (multiple of the crank speed) and frequency, for the harmonics 0 to `last`. Harmonic 0 is the mean.
  pure subroutine add_orders(table, frame, last)
    type(table_type), intent(inout) :: table
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: last
    integer :: k

    call add_order_column(table, "order", "order (multiple of the crank speed); order 0 is the mean", [(k, k = 0, last)], &
      & frame%mechanism%turns)
    call table%add("frequency", hertz, "frequency of the order", [(k / frame%period, k = 0, last)])
  end subroutine add_orders

  !> Adds a column with the orders of the harmonics `k`. If the period is one turn of the crank, the column contains integers.
  pure subroutine add_order_column(table, name, meaning, k, turns)
    type(table_type), intent(inout) :: table
    !> `name`: name of the column. `meaning`: explanation of the column
    character(len=*), intent(in) :: name, meaning
    !> `k`: numbers of the harmonics. `turns`: number of turns that the crank completes in the period
    integer, intent(in) :: k(:), turns

    if (turns == 1) then
      call table%add(name, meaning, k)
    else
      call table%add(name, plain, meaning, real(k, dp) / turns)
    end if
  end subroutine add_order_column

  !> Adds two columns with amplitudes (in `unit`) and phases of a Fourier series, for the harmonics 0 to `last`. The amplitude of
  !> harmonic 0 is the mean with its sign. Harmonics that the series does not contain get amplitude 0 and phase 0.
  pure subroutine add_harmonics(table, name, unit, series, last)
    type(table_type), intent(inout) :: table
    !> Text with which the names of both columns begin
    character(len=*), intent(in) :: name
    !> Unit of the amplitudes
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
    call table%add(amplitude_of(name, unit), unit_type(words=unit%words), &
      & "amplitude of the harmonic amplitude * cos(2 pi frequency t + phase)", amplitude)
    call table%add(trim(name) // "_" // trim(unit%suffix) // "_phase", radian, "phase of this harmonic", phase)
  end subroutine add_harmonics

  !> Name of the column with the amplitudes of a quantity.
  pure function amplitude_of(name, unit) result(column)
    character(len=*), intent(in) :: name
    type(unit_type), intent(in) :: unit
    character(len=len_trim(name) + len_trim(unit%suffix) + 11) :: column

    column = trim(name) // "_" // trim(unit%suffix) // "_amplitude"
  end function amplitude_of

end module gestell_output_table_turn
