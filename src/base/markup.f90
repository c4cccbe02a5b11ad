!> Text for HTML and SVG.
module gestell_base_markup
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_text, only: newline
  use gestell_base_words, only: printable
  implicit none (type, external)
  private

  public :: escaped

contains

  !> Copy of a user's text with escapes for the special characters of HTML. ASCII control characters, which HTML does not permit,
  !> become blanks. Bytes that are not UTF-8 are replaced.
  pure function escaped(words) result(safe)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: safe, text
    type(growing_text_type) :: pieces
    integer :: i

    text = words
    do i = 1, len(text)
      if (text(i:i) < " " .and. text(i:i) /= newline) text(i:i) = " "
    end do
    text = printable(text)
    do i = 1, len(text)
      select case (text(i:i))
      case ("&")
        call pieces%append("&amp;")
      case ("<")
        call pieces%append("&lt;")
      case (">")
        call pieces%append("&gt;")
      case ("""")
        call pieces%append("&quot;")
      case default
        call pieces%append(text(i:i))
      end select
    end do
    safe = pieces%whole()
  end function escaped

end module gestell_base_markup
