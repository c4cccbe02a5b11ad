!> Text for HTML and SVG.
module gestell_base_markup
  use gestell_base_text, only: newline
  use gestell_base_words, only: printable
  implicit none (type, external)
  private

  public :: escaped

contains

  ! gfortran 12 requires that functions in specifications precede their use.

  !> The escape of a special character of HTML; any other character itself.
  pure character(len=6) function escape(letter)
    character, intent(in) :: letter

    select case (letter)
    case ("&")
      escape = "&amp;"
    case ("<")
      escape = "&lt;"
    case (">")
      escape = "&gt;"
    case ("""")
      escape = "&quot;"
    case default
      escape = letter
    end select
  end function escape

  !> Length of a text in which each special character of HTML is replaced by its escape.
  pure integer function escaped_length(text) result(length)
    character(len=*), intent(in) :: text
    integer :: i

    length = 0
    do i = 1, len(text)
      length = length + max(1, len_trim(escape(text(i:i))))
    end do
  end function escaped_length

  !> Copy of a text with blanks in place of control characters, except ends of lines.
  pure function without_controls(words) result(text)
    character(len=*), intent(in) :: words
    character(len=len(words)) :: text
    integer :: i

    text = words
    do i = 1, len(text)
      if (text(i:i) < " " .and. text(i:i) /= newline) text(i:i) = " "
    end do
  end function without_controls

  !> Length of the text that `escaped` returns.
  pure integer function safe_length(words)
    character(len=*), intent(in) :: words

    safe_length = escaped_length(printable(without_controls(words)))
  end function safe_length

  !> Copy of a text in which escapes replace the special characters of HTML.
  pure function with_escapes(text) result(safe)
    character(len=*), intent(in) :: text
    character(len=escaped_length(text)) :: safe
    integer :: i, n, next

    n = 0
    do i = 1, len(text)
      next = n + max(1, len_trim(escape(text(i:i))))
      safe(n + 1:next) = escape(text(i:i))
      n = next
    end do
  end function with_escapes

  !> Copy of a user's text with escapes for the special characters of HTML. ASCII control characters, which HTML does not permit,
  !> become blanks. Bytes that are not UTF-8 are replaced.
  pure function escaped(words) result(safe)
    character(len=*), intent(in) :: words
    character(len=safe_length(words)) :: safe

    safe = with_escapes(printable(without_controls(words)))
  end function escaped

end module gestell_base_markup
