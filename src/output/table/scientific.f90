!> Writes numbers in the format es24.16e3 without leading blanks. This is faster than a formatted write statement.
module gestell_output_table_scientific
  use gestell_base_decimal, only: find_digits
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: put_number

  !> Maximum number of characters of a number, for example -1.2345678901234567E+001
  integer, parameter, public :: number_width = 24

  !> Indices for the implied do loops in the constant `pair`
  integer :: i, k
  !> The texts 00 to 99
  character(len=2), parameter :: pair(0:99) = [((achar(48 + k) // achar(48 + i), i = 0, 9), k = 0, 9)]
  integer(int64), parameter :: ten_8 = 10_int64**8, ten_16 = 10_int64**16

contains

  !> Writes `value` after the first `n` characters of `line` and increases `n` accordingly. At least `number_width` characters must
  !> follow in `line`.
  pure subroutine put_number(line, n, value)
    character(len=:), allocatable, intent(inout) :: line
    integer, intent(inout) :: n
    real(dp), intent(in) :: value
    character(len=number_width) :: word
    integer(int64) :: digits
    integer :: exponent, first
    logical :: decided

    call find_digits(value, digits, exponent, decided)
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

  !> Writes an integer of up to eight digits as eight digits, with leading zeros.
  pure subroutine put_eight(word, number)
    character(len=8), intent(out) :: word
    integer, intent(in) :: number
    integer :: upper, lower

    upper = number / 10000
    lower = mod(number, 10000)
    word(1:2) = pair(upper / 100)
    word(3:4) = pair(mod(upper, 100))
    word(5:6) = pair(lower / 100)
    word(7:8) = pair(mod(lower, 100))
  end subroutine put_eight

end module gestell_output_table_scientific
