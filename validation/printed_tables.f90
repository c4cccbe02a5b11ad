!> Tables 2 and 3 as they stand in the paper.
module printed_tables
  use original_mechanism, only: dp
  implicit none (type, external)
  private

  public :: speed_rpm, table_2, table_3, quantity, six_decimals

  !> Both tables: n in 1/min
  real(dp), parameter :: speed_rpm(2) = [240.0_dp, 360.0_dp]

  !> Table 2: rho_max
  real(dp), parameter :: table_2(2) = [0.602127_dp, 0.508802_dp]

  !> Table 3 with all its digits (decimal comma in the print): one column per speed
  character(len=9), parameter :: table_3(6, 2) = reshape([ &
      & ' 0.000224', '-0.000001', '-0.000729', ' 0.002318', '-0.000022', '-0.008151', &
      & ' 0.000501', '-0.000000', '-0.001636', ' 0.011054', '-0.000197', '-0.039094'], [6, 2])

  character(len=13), parameter :: quantity(6) = [character(len=13) :: &
      & 'xi (m)', 'eta (m)', 'psi (rad)', 'xi'' (m/s)', 'eta'' (m/s)', 'psi'' (rad/s)']

contains

  !> A value as Table 3 prints it: six decimals, the sign of a negative zero kept.
  elemental function six_decimals(value) result(text)
    real(dp), intent(in) :: value
    character(len=9) :: text

    write (text, '(f9.6)') value
  end function six_decimals

end module printed_tables
