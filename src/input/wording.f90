!> Small helpers for the text of messages.
module gestell_input_wording
  implicit none (type, external)
  private

  public :: counted, decimal, has_control, length_of_character, lower, one_line_of, on_one_line, printable, shown, &
    & without_quotes

  !> Longest piece of the user's text that a message repeats.
  integer, parameter, public :: longest_shown = 60
  !> Bytes that a word of a message may have, those that stay of its end, and those that a message may have.
  integer, parameter :: longest_word = 240, longest_tail = 60, longest_line = 960

contains

  !> The user's text fit for one line of a message: shortened between characters of UTF-8, no control characters.
  pure function shown(text) result(short)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: short
    integer :: i, n

    n = len(text)
    if (n > longest_shown) then
      n = longest_shown - 3
      do while (n > longest_shown - 6 .and. iand(ichar(text(n+1:n+1)), 192) == 128)
        n = n - 1
      end do
      short = text(:n) // "..."
    else
      short = text
    end if
    do i = 1, n
      if (ichar(short(i:i)) < 32 .or. ichar(short(i:i)) == 127) short(i:i) = "?"
    end do
  end function shown

  !> A message as one line that is fit for a terminal: no control characters, words and the whole of bounded length.
  pure function one_line_of(message) result(line)
    character(len=*), intent(in) :: message
    character(len=:), allocatable :: line
    integer :: first, last

    line = ""
    first = 1
    do while (first <= len(message))
      last = first + index(message(first:) // " ", " ") - 2
      if (last - first < longest_word) then
        line = line // message(first:min(last + 1, len(message)))
      else
        line = line // message(first:before_character(message, first + longest_word - longest_tail)) // "..." &
          & // message(before_character(message, last - longest_tail) + 1:min(last + 1, len(message)))
      end if
      first = last + 2
    end do
    if (len(line) > longest_line) line = line(:before_character(line, longest_line - longest_word)) // " ... " &
      & // line(before_character(line, len(line) - longest_word) + 1:)
    line = on_one_line(line)
  end function one_line_of

  !> Words that are to stay on their line, as a file's name, a title or a setting: `printable`, and "?" for ends of lines too.
  pure function on_one_line(words) result(line)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: line
    integer :: i

    line = printable(words)
    do i = 1, len(line)
      if (line(i:i) == new_line("a")) line(i:i) = "?"
    end do
  end function on_one_line

  !> The end of the last whole character of UTF-8 within the first `n` bytes; `n` itself where it is no such text.
  pure integer function before_character(text, n) result(last)
    character(len=*), intent(in) :: text
    integer, intent(in) :: n

    do last = n, max(1, n - 3), -1
      if (iand(ichar(text(last + 1:last + 1)), 192) /= 128) return
    end do
    last = n
  end function before_character

  !> Words without control characters, but for ends of lines: a terminal would obey them. "?" stands for each of their bytes,
  !> and for bytes that are no UTF-8.
  pure function printable(words) result(safe)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: safe
    integer :: i, n

    safe = words
    i = 1
    do while (i <= len(safe))
      n = length_of_character(safe(i:))
      if (n == 0 .or. is_control(safe(i:i + max(n, 1) - 1))) then
        n = max(n, 1)
        safe(i:i + n - 1) = repeat("?", n)
      end if
      i = i + n
    end do
  end function printable

  !> Whether a text has control characters, of one byte or two, ends of lines among them.
  pure logical function has_control(text)
    character(len=*), intent(in) :: text
    integer :: i

    has_control = index(text, new_line("a")) > 0 .or. any([(is_control(text(i:min(i + 1, len(text)))), i = 1, len(text))])
  end function has_control

  !> Whether a character of UTF-8 is a control character, of one byte or two; the end of a line is none.
  pure logical function is_control(character)
    character(len=*), intent(in) :: character
    integer :: first

    first = ichar(character(1:1))
    is_control = first < 32 .and. character(1:1) /= new_line("a") .or. first == 127
    if (first == 194 .and. len(character) > 1) is_control = ichar(character(2:2)) < 160
  end function is_control

  !> Bytes of the UTF-8 character at the beginning of a text, 0 where there is none that XML allows.
  pure integer function length_of_character(words) result(n)
    character(len=*), intent(in) :: words
    integer :: lead, point, i, byte

    lead = ichar(words(1:1))
    select case (lead)
    case (:127)
      n = 1
      return
    case (194:223)
      n = 2
      point = lead - 192
    case (224:239)
      n = 3
      point = lead - 224
    case (240:244)
      n = 4
      point = lead - 240
    case default
      n = 0
      return
    end select
    do i = 2, n
      byte = 0
      if (i <= len(words)) byte = ichar(words(i:i))
      if (iand(byte, 192) /= 128) then
        n = 0
        return
      end if
      point = 64 * point + iand(byte, 63)
    end do
    ! too long for what it is, surrogates, no characters, beyond the last
    if (n == 3 .and. point < 2048 .or. n == 4 .and. point < 65536 .or. point >= 55296 .and. point < 57344 &
      & .or. point == 65534 .or. point == 65535 .or. point > 1114111) n = 0
  end function length_of_character

  !> Lower case of the letters a to z.
  elemental function lower(text) result(low)
    character(len=*), intent(in) :: text
    character(len=len(text)) :: low
    integer :: i

    low = text
    do i = 1, len(text)
      if (text(i:i) >= "A" .and. text(i:i) <= "Z") low(i:i) = achar(iachar(text(i:i)) + 32)
    end do
  end function lower

  !> An integer without blanks.
  pure function decimal(number) result(text)
    integer, intent(in) :: number
    character(len=:), allocatable :: text
    character(len=12) :: buffer

    write(buffer, "(i0)") number
    text = trim(buffer)
  end function decimal

  !> A number of things in words, as "1 link", "2 links".
  pure function counted(number, thing) result(text)
    integer, intent(in) :: number
    character(len=*), intent(in) :: thing
    character(len=:), allocatable :: text

    text = decimal(number) // " " // thing
    if (number /= 1) text = text // "s"
  end function counted

  !> A text without the quotes around it, if it has such.
  pure function without_quotes(text) result(inner)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: inner
    integer :: n

    inner = text
    n = len(text)
    if (n < 2) return
    if (text(1:1) == text(n:n) .and. scan(text(1:1), "'""") == 1) inner = text(2:n-1)
  end function without_quotes

end module gestell_input_wording
