!> Converts numbers to text. No function of this module has a result of deferred length, because gfortran keeps such a length in
!> static memory, which all threads share.
module gestell_base_text
  use gestell_base_decimal, only: round_to_digits, round_to_places
  use gestell_base_kinds, only: dp
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: concise, either, exact, fixed, integer_text, text, whole_number

  character, parameter, public :: newline = new_line("a")

  !> Converts a number to text with 6 significant digits, concise(value), or with a given number of them, concise(value, digits).
  interface concise
    module procedure :: concise_6, concise_digits
  end interface

  !> Length of a text in which any number fits.
  integer, parameter :: longest = 360

contains

  !> Returns `first` if the condition is true, otherwise `second`. The texts may have different lengths, which `merge` does not
  !> allow.
  pure function either(first, second, condition) result(chosen)
    character(len=*), intent(in) :: first, second
    logical, intent(in) :: condition
    character(len=len(first) * count([condition]) + len(second) * count([.not. condition])) :: chosen

    if (condition) then
      chosen = first
    else
      chosen = second
    end if
  end function either

  !> Positive integer that a text of digits represents; 0 if the text contains anything else.
  pure integer function whole_number(digits) result(number)
    character(len=*), intent(in) :: digits
    integer :: status

    number = 0
    if (len(digits) == 0 .or. verify(digits, "0123456789") > 0) return
    read (digits, "(i12)", iostat=status) number
    if (status /= 0) number = 0
  end function whole_number

  pure character(len=24) function exact_line(value) result(line)
    real(dp), intent(in) :: value

    write (line, "(es24.16e3)") value
    line = adjustl(line)
  end function exact_line

  pure character(len=longest) function concise_line(value, digits) result(line)
    real(dp), intent(in) :: value
    integer, intent(in) :: digits
    character(len=40) :: buffer, layout
    integer(int64) :: whole
    integer :: exponent
    logical :: decided

    if (.not. ieee_is_finite(value)) then
      write (line, "(g0)") value
      line = adjustl(line)
      return
    end if
    call round_to_digits(value, digits, whole, exponent, decided)
    if (decided) then
      buffer = decimal_digits(whole, digits - 1, len(buffer))
    else
      write (layout, "(a, i0, a)") "(es40.", digits - 1, "e4)"
      write (buffer, layout) abs(value)
      read (buffer(36:), "(i5)") exponent
      buffer = adjustl(buffer(:index(buffer, "E") - 1))
    end if
    if (exponent >= -4 .and. exponent < max(digits, 6)) then
      line = fixed_line(value, max(0, digits - 1 - exponent))
      if (index(line, ".") > 0) call drop_zeros(line)
    else
      line = buffer
      call drop_zeros(line)
      line(len_trim(line) + 1:) = "e" // integer_line(int(exponent, int64))
      if (value < 0) line = "-" // line(:longest - 1)
    end if
  end function concise_line

  pure character(len=longest) function fixed_line(value, decimals) result(line)
    real(dp), intent(in) :: value
    integer, intent(in) :: decimals
    character(len=16) :: layout
    integer(int64) :: whole
    logical :: decided

    call round_to_places(value, decimals, whole, decided)
    if (decided) then
      line = decimal_digits(whole, decimals, len(line))
      if (value < 0 .and. whole > 0) line = "-" // line(:longest - 1)
      return
    end if
    write (layout, "(a, i0, a)") "(f350.", decimals, ")"
    write (line, layout) value
    line = adjustl(line)
    if (decimals == 0) line = line(:len_trim(line) - 1)
    if (line(1:1) == ".") line = "0" // line(:longest - 1)
    if (index(line, "-.") == 1) line = "-0" // line(2:longest - 1)
    if (verify(trim(line), "-0.") == 0 .and. line(1:1) == "-") line = line(2:)
  end function fixed_line

  pure character(len=20) function integer_line(value) result(line)
    integer(int64), intent(in) :: value

    line = decimal_digits(abs(value), 0, len(line))
    if (value < 0) line = "-" // line(:len(line) - 1)
  end function integer_line

  !> Text of the number whole * 10^-decimals, where whole >= 0. The text has no decimal point if `decimals` is 0.
  pure function decimal_digits(whole, decimals, length) result(line)
    integer(int64), intent(in) :: whole
    integer, intent(in) :: decimals, length
    character(len=length) :: line
    character(len=longest) :: digits
    integer(int64) :: rest
    integer :: first, k

    rest = whole
    first = longest + 1
    k = 0
    do while (rest > 0 .or. k <= decimals)
      if (k == decimals .and. k > 0) then
        first = first - 1
        digits(first:first) = "."
      end if
      first = first - 1
      digits(first:first) = achar(48 + int(mod(rest, 10_int64)))
      rest = rest / 10
      k = k + 1
    end do
    line = digits(first:)
  end function decimal_digits

  !> Removes trailing zeros after the decimal point, and the decimal point if no digit remains after it.
  pure subroutine drop_zeros(line)
    character(len=longest), intent(inout) :: line
    integer :: last

    last = verify(trim(line), "0", back=.true.)
    if (line(last:last) == ".") last = last - 1
    line(last + 1:) = ""
  end subroutine drop_zeros

  !> Text of a number with 17 significant digits, as in the result files. Reading this text yields exactly the same number.
  pure function exact(value) result(string)
    real(dp), intent(in) :: value
    character(len=len_trim(exact_line(value))) :: string

    string = exact_line(value)
  end function exact

  !> Text of a number with 6 significant digits and without trailing zeros. The notation is fixed or exponential, depending on the
  !> magnitude.
  pure function concise_6(value) result(string)
    real(dp), intent(in) :: value
    character(len=len_trim(concise_line(value, 6))) :: string

    string = concise_line(value, 6)
  end function concise_6

  !> Text of a number with `digits` significant digits and without trailing zeros. The notation is fixed or exponential, depending
  !> on the magnitude.
  pure function concise_digits(value, digits) result(string)
    real(dp), intent(in) :: value
    integer, intent(in) :: digits
    character(len=len_trim(concise_line(value, digits))) :: string

    string = concise_line(value, digits)
  end function concise_digits

  !> Text of a number with `decimals` digits after the decimal point.
  pure function fixed(value, decimals) result(string)
    real(dp), intent(in) :: value
    integer, intent(in) :: decimals
    character(len=len_trim(fixed_line(value, decimals))) :: string

    string = fixed_line(value, decimals)
  end function fixed

  !> Text of an integer: its decimal digits and, if it is negative, the sign.
  pure function text(value) result(string)
    integer, intent(in) :: value
    character(len=len_trim(integer_line(int(value, int64)))) :: string

    string = integer_line(int(value, int64))
  end function text

  !> Text of a 64-bit integer: its decimal digits and, if it is negative, the sign.
  pure function integer_text(value) result(string)
    integer(int64), intent(in) :: value
    character(len=len_trim(integer_line(value))) :: string

    string = integer_line(value)
  end function integer_text

end module gestell_base_text
