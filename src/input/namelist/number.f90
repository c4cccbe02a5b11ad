!> Reads numbers in a strict notation: an ambiguous notation is an error.
module gestell_input_namelist_number
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text_of => text
  use gestell_input_wording, only: lower
  implicit none (type, external)
  private

  public :: read_real, read_integer, is_digits

  !> A number with this decimal exponent or a larger one is an error, because some of these numbers overflow.
  integer, parameter :: exponent_limit = 308
  character(len=*), parameter :: signs = "+-"

contains

  !> Converts a text to a real number. If the text is not a valid number, `reason` says why; otherwise `reason` is empty.
  pure subroutine read_real(text, value, reason)
    character(len=*), intent(in) :: text
    real(dp), intent(out) :: value
    character(len=:), allocatable, intent(out) :: reason
    character(len=:), allocatable :: digits
    integer :: split, point, first, exponent, status
    logical :: ok

    value = 0
    call refuse_number(text, reason)
    digits = lower(without_sign(text))
    split = scan(digits, "ed")
    exponent = 0
    if (split > 0) then
      call read_exponent(digits(split+1:), exponent, ok)
      if (.not. ok) return
      digits = digits(:split-1)
    end if
    point = index(digits, ".")
    if (point == 0) point = len(digits) + 1
    if (.not. is_digits(digits(:point-1) // digits(point+1:))) return

    first = verify(digits, "0.")
    reason = ""
    if (first == 0) return
    ! decimal exponent of the first significant digit
    if (first < point) first = first + 1
    if (exponent + point - first >= exponent_limit) then
      reason = "is too large"
      return
    end if
    digits = digits(:point-1) // "." // digits(point+1:) // "e"
    if (exponent + point - first < -2 * exponent_limit) return
    digits = digits // text_of(exponent)
    if (text(1:1) == "-") digits = "-" // digits
    read(digits, *, iostat=status) value
    if (status /= 0) call refuse_number(text, reason)
  end subroutine read_real

  !> Converts a text to an integer. If the text is not a valid integer, `reason` says why; otherwise `reason` is empty.
  pure subroutine read_integer(text, value, reason)
    character(len=*), intent(in) :: text
    integer, intent(out) :: value
    character(len=:), allocatable, intent(out) :: reason
    real(dp) :: whole

    value = 0
    call read_real(text, whole, reason)
    if (reason /= "") return
    if (.not. is_digits(without_sign(text))) then
      reason = "must be a whole number, written without decimal point and exponent"
    else if (abs(whole) > huge(value)) then
      reason = "is too large"
    else
      value = nint(whole)
    end if
  end subroutine read_integer

  !> True if a text is not empty and consists only of digits.
  pure logical function is_digits(text)
    character(len=*), intent(in) :: text

    is_digits = len(text) > 0 .and. verify(text, "0123456789") == 0
  end function is_digits

  !> Copy of a text without its leading sign, if it has one.
  pure function without_sign(text) result(rest)
    character(len=*), intent(in) :: text
    character(len=len(text) - merge(1, 0, scan(text, signs) == 1)) :: rest

    rest = text(1 + len(text) - len(rest):)
  end function without_sign

  !> Converts the digits of an exponent to an integer. `ok` is false if the text is not an integer.
  pure subroutine read_exponent(text, exponent, ok)
    character(len=*), intent(in) :: text
    integer, intent(out) :: exponent
    logical, intent(out) :: ok
    !> Any larger exponent is replaced by this one. It is far outside the range of double precision, but sums of such exponents do
    !> not overflow.
    integer, parameter :: enough = 10000000
    character(len=:), allocatable :: digits
    integer :: i

    exponent = 0
    digits = without_sign(text)
    ok = is_digits(digits)
    if (.not. ok) return
    do i = 1, len(digits)
      exponent = min(10 * exponent + iachar(digits(i:i)) - iachar("0"), enough)
    end do
    if (text(1:1) == "-") exponent = -exponent
  end subroutine read_exponent

  !> Explains why a text is not a valid number.
  pure subroutine refuse_number(text, reason)
    character(len=*), intent(in) :: text
    character(len=:), allocatable, intent(out) :: reason
    character(len=:), allocatable :: word

    word = lower(without_sign(text))
    if (word == "inf" .or. word == "infinity" .or. word == "nan" .or. index(word, "nan(") == 1) then
      reason = "must be finite"
    else
      reason = "must be a number"
    end if
  end subroutine refuse_number

end module gestell_input_namelist_number
