!> Provides helper functions for the wording of messages.
module gestell_input_wording
  use gestell_base_text, only: text
  use gestell_base_words, only: continues
  implicit none (type, external)
  private

  public :: counted, lower, shown, without_quotes

  !> Maximum length of a user's text that a message quotes; longer texts are shortened.
  integer, parameter, public :: longest_shown = 60

contains

  !> Number of bytes of a user's text that a message quotes. A character of several bytes is quoted whole or not at all.
  pure integer function bytes_shown(text) result(n)
    character(len=*), intent(in) :: text

    n = len(text)
    if (n <= longest_shown) return
    n = longest_shown - 3
    do while (n > longest_shown - 6 .and. continues(text(n+1:n+1)))
      n = n - 1
    end do
  end function bytes_shown

  !> A user's text in the form in which messages quote it: without control characters, and shortened if it is too long (never
  !> within a character).
  pure function shown(text) result(short)
    character(len=*), intent(in) :: text
    character(len=bytes_shown(text) + merge(3, 0, len(text) > longest_shown)) :: short
    integer :: i

    short = text(:bytes_shown(text)) // "..."
    do i = 1, bytes_shown(text)
      if (ichar(short(i:i)) < 32 .or. ichar(short(i:i)) == 127) short(i:i) = "?"
    end do
  end function shown

  !> Copy of a text in which the letters A to Z are replaced by lower-case letters.
  elemental function lower(text) result(low)
    character(len=*), intent(in) :: text
    character(len=len(text)) :: low
    integer :: i

    low = text
    do i = 1, len(text)
      if (text(i:i) >= "A" .and. text(i:i) <= "Z") low(i:i) = achar(iachar(text(i:i)) + 32)
    end do
  end function lower

  !> A number and its noun in the singular or plural, such as "1 link" or "2 links".
  pure function counted(number, thing) result(words)
    integer, intent(in) :: number
    character(len=*), intent(in) :: thing
    character(len=len(text(number)) + len(thing) + merge(1, 2, number == 1)) :: words

    words = text(number) // " " // thing // "s"
  end function counted

  !> True if a text begins and ends with the same quote.
  pure logical function is_in_quotes(text)
    character(len=*), intent(in) :: text
    integer :: n

    n = len(text)
    is_in_quotes = .false.
    if (n >= 2) is_in_quotes = text(1:1) == text(n:n) .and. scan(text(1:1), "'""") == 1
  end function is_in_quotes

  !> Text without the quotes that enclose it. A text without quotes is returned unchanged.
  pure function without_quotes(text) result(inner)
    character(len=*), intent(in) :: text
    character(len=len(text) - merge(2, 0, is_in_quotes(text))) :: inner

    inner = text(1 + (len(text) - len(inner)) / 2:)
  end function without_quotes

end module gestell_input_wording
