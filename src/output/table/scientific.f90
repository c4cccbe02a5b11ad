!> Numbers as es24.16e3 writes them, without its blanks, several times as fast: writing is most of a fast sweep's time.
module gestell_output_table_scientific
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: int64, qp => real128
  implicit none (type, external)
  private

  public :: put_number

  !> Whole numbers of 128 bits.
  integer, parameter :: wide = selected_int_kind(38)

  !> Widest number: -1.2345678901234567E+001
  integer, parameter, public :: number_width = 24

  !> Exponents of two beyond which numbers would need longer tables.
  integer, parameter :: farthest = 990
  !> Counts in the tables, no more.
  integer :: i, k
  !> Powers of ten, cut off to 74 bits: 10^i = power(i) * 2^power_of_two(i).
  integer(wide), parameter :: power(-300:320) = [(int(scale(10.0_qp**i, 74 - exponent(10.0_qp**i)), wide), i = -300, 320)]
  integer, parameter :: power_of_two(-300:320) = [(exponent(10.0_qp**i) - 74, i = -300, 320)]
  !> The texts of 00 to 99.
  character(len=2), parameter :: pair(0:99) = [((achar(48 + k) // achar(48 + i), i = 0, 9), k = 0, 9)]
  integer(int64), parameter :: ten_8 = 10_int64**8, ten_16 = 10_int64**16, ten_17 = 10_int64**17

contains

  !> Writes `value` behind the first `n` characters of `line`, which has room for `number_width` more, and moves `n`.
  pure subroutine put_number(line, n, value)
    character(len=:), allocatable, intent(inout) :: line
    integer, intent(inout) :: n
    real(dp), intent(in) :: value
    character(len=number_width) :: word
    integer(int64) :: digits
    integer :: exponent, first
    logical :: decided

    ! the exponent, from its bits: nothing is compared, for NaN would raise an exception
    decided = abs(iand(int(shiftr(transfer(value, digits), 52)), 2047) - 1023) < farthest
    if (decided) call find_digits(abs(value), digits, exponent, decided)
    if (.not. decided) then
      write (word, "(es24.16e3)") value
      first = verify(word, " ")
      line(n + 1:n + number_width + 1 - first) = word(first:)
      n = n + number_width + 1 - first
      return
    end if
    if (value < 0) then
      n = n + 1
      line(n:n) = "-"
    end if
    word(1:1) = achar(48 + int(digits / ten_16))
    word(2:2) = "."
    call put_eight(word(3:10), int(mod(digits, ten_16) / ten_8))
    call put_eight(word(11:18), int(mod(digits, ten_8)))
    word(19:19) = "E"
    word(20:20) = merge("-", "+", exponent < 0)
    word(21:21) = achar(48 + abs(exponent) / 100)
    word(22:23) = pair(mod(abs(exponent), 100))
    line(n + 1:n + 23) = word(:23)
    n = n + 23
  end subroutine put_number

  !> The 17 digits and the exponent of a positive number; not `decided` if the table of powers is too short to tell to which
  !> side the last digit is rounded.
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

    ! value = mantissa * 2^binary, the mantissa between 2^52 and 2^53
    bits = transfer(value, bits)
    binary = int(ishft(bits, -52)) - 1075
    bits = ior(iand(bits, hidden_bit - 1), hidden_bit)
    ! never above the true exponent, and below it by one at the most
    exponent = floor((binary + 52) * decades_of_two)
    product = bits * power(16 - exponent)
    places = -(binary + power_of_two(16 - exponent))
    if (shiftr(product, places) >= ten_17) then
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
    if (digits < ten_17) return
    digits = ten_16
    exponent = exponent + 1
  end subroutine find_digits

  !> Eight digits.
  pure subroutine put_eight(word, number)
    character(len=8), intent(out) :: word
    integer, intent(in) :: number
    integer :: upper, lower

    upper = number / 10000
    lower = mod(number, 10000)
    word = pair(upper / 100) // pair(mod(upper, 100)) // pair(lower / 100) // pair(mod(lower, 100))
  end subroutine put_eight

end module gestell_output_table_scientific
