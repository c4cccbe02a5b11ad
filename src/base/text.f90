!> Numbers as text.
module gestell_base_text
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: exact, short, fixed, text

  interface text
    module procedure :: integer_text
  end interface

contains

  !> All 17 significant digits, as the result files hold them: reading them back gives the same number.
  pure function exact(value) result(string)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: string
    character(len=32) :: buffer

    write (buffer, "(es24.16e3)") value
    string = trim(adjustl(buffer))
  end function exact

  !> About `digits` (default 6) significant digits in the form a reader likes, without trailing zeros.
  pure function short(value, digits) result(string)
    real(dp), intent(in) :: value
    integer, intent(in), optional :: digits
    character(len=:), allocatable :: string
    character(len=40) :: buffer, layout
    integer :: significant, exponent, last

    significant = 6
    if (present(digits)) significant = digits
    if (.not. abs(value) <= huge(value)) then
      write (buffer, "(g0)") value
      string = trim(adjustl(buffer))
      return
    end if
    write (layout, "(a, i0, a)") "(es40.", significant - 1, "e4)"
    write (buffer, layout) value
    read (buffer(36:), "(i5)") exponent
    if (exponent >= -4 .and. exponent < max(significant, 6)) then
      string = fixed(value, max(0, significant - 1 - exponent))
      if (index(string, ".") > 0) string = without_zeros(string)
    else
      last = index(buffer, "E") - 1
      string = without_zeros(trim(adjustl(buffer(:last)))) // "e" // integer_text(exponent)
    end if
  end function short

  !> With a number of digits behind the point.
  pure function fixed(value, decimals) result(string)
    real(dp), intent(in) :: value
    integer, intent(in) :: decimals
    character(len=:), allocatable :: string
    character(len=350) :: buffer
    character(len=16) :: layout

    write (layout, "(a, i0, a)") "(f350.", decimals, ")"
    write (buffer, layout) value
    string = trim(adjustl(buffer))
    if (decimals == 0) string = string(:len(string) - 1)
    if (string(1:1) == ".") string = "0" // string
    if (index(string, "-.") == 1) string = "-0" // string(2:)
    if (verify(string, "-0.") == 0 .and. string(1:1) == "-") string = string(2:)
  end function fixed

  pure function integer_text(value) result(string)
    integer, intent(in) :: value
    character(len=:), allocatable :: string
    character(len=12) :: buffer

    write (buffer, "(i0)") value
    string = trim(buffer)
  end function integer_text

  pure function without_zeros(string) result(shorter)
    character(len=*), intent(in) :: string
    character(len=:), allocatable :: shorter
    integer :: last

    last = verify(string, "0", back=.true.)
    if (string(last:last) == ".") last = last - 1
    shorter = string(:last)
  end function without_zeros

end module gestell_base_text
