!> Decimal digits of numbers, several times as fast as they are written by formats: writing is most of a fast sweep's time.
module gestell_base_decimal
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: int64, qp => real128
  implicit none (type, external)
  private

  public :: find_digits, round_to_digits, round_to_places

  !> Whole numbers of 128 bits.
  integer, parameter :: wide = selected_int_kind(38)

  !> Digits that tell a number.
  integer, parameter, public :: all_digits = 17
  !> Exponents of two beyond which numbers would need longer tables.
  integer, parameter :: farthest = 990
  !> Counts in the tables, no more.
  integer :: i
  !> Powers of ten, cut off to 74 bits: 10^i = power(i) * 2^power_of_two(i).
  integer(wide), parameter :: power(-300:320) = [(int(scale(10.0_qp**i, 74 - exponent(10.0_qp**i)), wide), i = -300, 320)]
  integer, parameter :: power_of_two(-300:320) = [(exponent(10.0_qp**i) - 74, i = -300, 320)]
  integer(int64), parameter :: ten(0:all_digits) = [(10_int64**i, i = 0, all_digits)]

contains

  !> The whole number that `value`, without its sign, is with so many significant digits, and the exponent of the first of them; as
  !> of `find_digits`, and not `decided` beyond 17 digits.
  pure subroutine round_to_digits(value, count, whole, exponent, decided)
    real(dp), intent(in) :: value
    integer, intent(in) :: count
    integer(int64), intent(out) :: whole
    integer, intent(out) :: exponent
    logical, intent(out) :: decided

    call find_digits(value, whole, exponent, decided)
    decided = decided .and. count <= all_digits
    if (.not. decided) return
    call round_off(all_digits - count, whole, decided)
    if (whole < ten(count)) return
    whole = ten(count - 1)
    exponent = exponent + 1
  end subroutine round_to_digits

  !> The whole number of units 10^-places, 0 or more places, that `value` is without its sign; not `decided` beyond 17 digits too.
  pure subroutine round_to_places(value, places, whole, decided)
    real(dp), intent(in) :: value
    integer, intent(in) :: places
    integer(int64), intent(out) :: whole
    logical, intent(out) :: decided
    integer :: exponent, count

    call find_digits(value, whole, exponent, decided)
    if (.not. decided .or. whole == 0) return
    count = exponent + 1 + places
    decided = count <= all_digits
    if (count < 0) whole = 0
    if (decided .and. count >= 0) call round_off(all_digits - count, whole, decided)
  end subroutine round_to_places

  !> Drops so many digits, 0 to 17, of those that were rounded once; not `decided` where half of the last one is left that stays.
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

  !> The 17 digits and the exponent of a number without its sign, 0 and 0 of zero; not `decided` if the table of powers is too short
  !> to tell them or to which side the last digit is rounded, or if it is no number.
  pure subroutine find_digits(value, digits, exponent, decided)
    real(dp), intent(in) :: value
    integer(int64), intent(out) :: digits
    integer, intent(out) :: exponent
    logical, intent(out) :: decided
    real(dp), parameter :: decades_of_two = 0.30102999566398120_dp
    integer(int64), parameter :: hidden_bit = 2_int64**52
    integer(wide) :: product, rest, half
    integer(int64) :: bits
    integer :: binary, places

    ! value = mantissa * 2^binary, the mantissa between 2^52 and 2^53; nothing is compared, for NaN would raise an exception
    bits = transfer(value, bits)
    digits = 0
    exponent = 0
    decided = bits == 0
    binary = int(iand(shiftr(bits, 52), 2047_int64)) - 1075
    if (abs(binary + 52) >= farthest) return
    bits = ior(iand(bits, hidden_bit - 1), hidden_bit)
    ! never above the true exponent, and below it by one at the most
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
    ! the power lacks less than one in its last place
    decided = abs(rest - half) > bits
    if (rest > half) digits = digits + 1
    if (digits < ten(17)) return
    digits = ten(16)
    exponent = exponent + 1
  end subroutine find_digits

end module gestell_base_decimal
