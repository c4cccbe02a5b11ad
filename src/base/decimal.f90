!> Converts real numbers to decimal digits several times as fast as Fortran formats do. A fast sweep spends most of its time writing
!> numbers.
module gestell_base_decimal
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: int64, real128
  implicit none (type, external)
  private

  public :: find_digits, round_to_digits, round_to_places

  !> Quadruple precision, which the tables below need. flang 22 for Debian does not have it: then no rounding is certain.
  logical, parameter :: has_quadruple = real128 > 0
  integer, parameter :: qp = merge(real128, dp, has_quadruple)
  !> Kind of an integer with 128 bits.
  integer, parameter :: wide = selected_int_kind(38)

  !> Number of significant decimal digits that suffice to restore a double-precision number exactly.
  integer, parameter, public :: all_digits = 17
  !> The tables of powers cover numbers whose binary exponent has a magnitude below this limit.
  integer, parameter :: max_binary_exponent = 990
  !> Index for the implied do loops in the constants below.
  integer :: i
  !> Powers of ten in quadruple precision, otherwise ones
  real(qp), parameter :: decade(-300:320) = [(10.0_qp**merge(i, 0, has_quadruple), i = -300, 320)]
  !> Powers of ten: 10^i is power(i) * 2^power_of_two(i), where power(i) is truncated to 74 bits.
  integer(wide), parameter :: power(-300:320) = int(scale(decade, 74 - exponent(decade)), wide)
  integer, parameter :: power_of_two(-300:320) = exponent(decade) - 74
  integer(int64), parameter :: ten(0:all_digits) = [(10_int64**i, i = 0, all_digits)]

contains

  !> Rounds the magnitude of `value` to `count` significant digits: abs(value) = whole * 10^(exponent - count + 1) after rounding.
  pure subroutine round_to_digits(value, count, whole, exponent, decided)
    !> Number to be rounded; its sign is ignored
    real(dp), intent(in) :: value
    !> Number of significant digits to keep, at least 1
    integer, intent(in) :: count
    !> The kept digits as an integer; 0 if `value` is zero
    integer(int64), intent(out) :: whole
    !> Decimal exponent of the first significant digit
    integer, intent(out) :: exponent
    !> False if the rounding is not certain (see `find_digits`) or if `count` exceeds 17. The caller must then use a Fortran format
    logical, intent(out) :: decided

    call find_digits(value, whole, exponent, decided)
    decided = decided .and. count <= all_digits
    if (.not. decided) return
    call round_off(all_digits - count, whole, decided)
    if (whole < ten(count)) return
    whole = ten(count - 1)
    exponent = exponent + 1
  end subroutine round_to_digits

  !> Rounds the magnitude of `value` to an integer multiple of 10^-places: abs(value) = whole * 10^-places after rounding.
  pure subroutine round_to_places(value, places, whole, decided)
    real(dp), intent(in) :: value
    !> Number of decimal places to keep, 0 or more
    integer, intent(in) :: places
    integer(int64), intent(out) :: whole
    !> False if the rounding is not certain (see `find_digits`) or if `whole` would have more than 17 digits. The caller must then
    !> use a Fortran format
    logical, intent(out) :: decided
    integer :: exponent, count

    call find_digits(value, whole, exponent, decided)
    if (.not. decided .or. whole == 0) return
    count = exponent + 1 + places
    decided = count <= all_digits
    if (count < 0) whole = 0
    if (decided .and. count >= 0) call round_off(all_digits - count, whole, decided)
  end subroutine round_to_places

  !> Drops the last `dropped` digits (0 to 17) of `whole` and rounds. `decided` is false if these digits are exactly half a unit of
  !> the last remaining digit. In such a tie the correct direction is unknown, because `whole` is itself a rounded number.
  pure subroutine round_off(dropped, whole, decided)
    integer, intent(in) :: dropped
    integer(int64), intent(inout) :: whole
    logical, intent(out) :: decided
    integer(int64) :: twice

    twice = 2 * mod(whole, ten(dropped))
    decided = twice /= ten(dropped)
    whole = whole / ten(dropped)
    if (twice > ten(dropped)) whole = whole + 1
  end subroutine round_off

  !> Rounds the magnitude of `value` to 17 significant digits: abs(value) = digits * 10^(exponent - 16) after rounding.
  pure subroutine find_digits(value, digits, exponent, decided)
    real(dp), intent(in) :: value
    !> The 17 significant digits as an integer; 0 if `value` is zero
    integer(int64), intent(out) :: digits
    !> Decimal exponent of the first significant digit; 0 if `value` is zero
    integer, intent(out) :: exponent
    !> False if `value` is NaN or infinite, or if the tables of powers are too short or too inaccurate to round it correctly
    logical, intent(out) :: decided
    real(dp), parameter :: decades_of_two = 0.30102999566398120_dp
    integer(int64), parameter :: hidden_bit = 2_int64**52
    integer(wide) :: product, rest, half
    integer(int64) :: bits
    integer :: binary, places

    ! value = mantissa * 2^binary with 2^52 <= mantissa < 2^53. Bits instead of comparisons: comparing NaN raises an exception.
    bits = transfer(value, bits)
    digits = 0
    exponent = 0
    decided = bits == 0
    binary = int(iand(shiftr(bits, 52), 2047_int64)) - 1075
    if (abs(binary + 52) >= max_binary_exponent .or. .not. has_quadruple) return
    bits = ior(iand(bits, hidden_bit - 1), hidden_bit)
    ! this estimate is the true exponent or one less
    exponent = floor((binary + 52) * decades_of_two)
    product = bits * power(16 - exponent)
    places = -(binary + power_of_two(16 - exponent))
    if (shiftr(product, places) >= ten(17)) then
      exponent = exponent + 1
      product = bits * power(16 - exponent)
      places = -(binary + power_of_two(16 - exponent))
    end if
    digits = int(shiftr(product, places), int64)
    rest = product - shiftl(int(digits, wide), places)
    half = shiftl(1_wide, places - 1)
    ! the truncated power of ten is too small by less than one unit in its last place
    decided = abs(rest - half) > bits
    if (rest > half) digits = digits + 1
    if (digits < ten(17)) return
    digits = ten(16)
    exponent = exponent + 1
  end subroutine find_digits

end module gestell_base_decimal
