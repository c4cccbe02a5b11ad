!> Handles text that the user has written: limits its length, counts UTF-8 characters, and removes characters that are unsafe to
!> print.
module gestell_base_words
  implicit none (type, external)
  private

  public :: character_count, continues, has_control, length_of_character, length_on_one_line, on_one_line, printable, &
    & put_on_one_line

  !> Maximum numbers of characters. `longest_name`: for a name. `longest_word`: for any other word of a list, such as
  !> "probe(NAME).v" or "link(NAME).center(2)".
  integer, parameter, public :: longest_name = 64, longest_word = 128
  !> Number of bytes needed for a word of `longest_word` characters: a UTF-8 character has up to four bytes.
  integer, parameter, public :: word_length = 4 * longest_word
  !> Limits for messages, in bytes. `longest_piece`: for a word. `longest_tail`: for the end of a word, which remains if the word is
  !> shortened. `longest_line`: for the whole message.
  integer, parameter :: longest_piece = 240, longest_tail = 60, longest_line = 960
  character, parameter :: newline = new_line("a")

contains

  !> Number of UTF-8 characters in a text; trailing blanks are counted.
  pure integer function character_count(text)
    character(len=*), intent(in) :: text
    integer :: i

    character_count = count([(.not. continues(text(i:i)), i = 1, len(text))])
  end function character_count

  !> True if a byte belongs to a UTF-8 character but is not its first byte.
  elemental logical function continues(byte)
    character, intent(in) :: byte

    continues = iand(ichar(byte), 192) == 128
  end function continues

  !> Converts a message to one line that is safe to print: control characters are removed, and long words and long lines are
  !> shortened. This is not a function, because gfortran 12 keeps the length of a function's text in static memory, which all
  !> threads share.
  pure subroutine put_on_one_line(message, line)
    character(len=*), intent(in) :: message
    character(len=:), allocatable, intent(out) :: line
    character(len=:), allocatable :: short
    integer :: first, last, n

    ! a shortened word, with its dots and blank, is never longer than the word itself
    allocate(character(len=len(message) + len(message) / longest_piece * 4 + 4) :: short)
    n = 0
    first = 1
    do while (first <= len(message))
      last = first + index(message(first:), " ") - 2
      if (last < first - 1) last = len(message)
      if (last - first < longest_piece) then
        call put(short, n, message(first:min(last + 1, len(message))))
      else
        call put(short, n, message(first:end_of_last_character(message, first + longest_piece - longest_tail)))
        call put(short, n, "...")
        call put(short, n, message(end_of_last_character(message, last - longest_tail) + 1:min(last + 1, len(message))))
      end if
      first = last + 2
    end do
    line = short(:n)
    if (n > longest_line) line = short(:end_of_last_character(short, longest_line - longest_piece)) // " ... " &
      & // short(end_of_last_character(short, n - longest_piece) + 1:n)
    call make_printable(line, .false.)
  end subroutine put_on_one_line

  !> Length of the line to which `put_on_one_line` converts a message.
  pure integer function length_on_one_line(message) result(length)
    character(len=*), intent(in) :: message
    character(len=:), allocatable :: line

    call put_on_one_line(message, line)
    length = len(line)
  end function length_on_one_line

  !> Copies `piece` into a text, after the text's first `n` bytes, and increases `n` accordingly. The text must be long enough.
  pure subroutine put(text, n, piece)
    ! allow(C072)
    character(len=*), intent(inout) :: text
    integer, intent(inout) :: n
    character(len=*), intent(in) :: piece

    text(n + 1:n + len(piece)) = piece
    n = n + len(piece)
  end subroutine put

  !> Makes a file name, title or setting safe to print on one line: replaces line ends, and all bytes that `printable` replaces, by
  !> "?".
  pure function on_one_line(words) result(line)
    character(len=*), intent(in) :: words
    character(len=len(words)) :: line

    line = words
    call make_printable(line, .false.)
  end function on_one_line

  !> Replaces control characters, which could change the state of a terminal, and bytes that are not valid UTF-8: "?" replaces each
  !> byte. Line ends remain.
  pure function printable(words) result(safe)
    character(len=*), intent(in) :: words
    character(len=len(words)) :: safe

    safe = words
    call make_printable(safe, .true.)
  end function printable

  !> Replaces unsafe bytes of a text by "?", under the same rules as `printable`. Also replaces line ends, unless `keeps_line_ends`.
  pure subroutine make_printable(text, keeps_line_ends)
    ! allow(C072)
    character(len=*), intent(inout) :: text
    logical, intent(in) :: keeps_line_ends
    integer :: i, n

    i = 1
    do while (i <= len(text))
      n = length_of_character(text(i:))
      if (n == 0 .or. is_control(text(i:i + max(n, 1) - 1)) .or. .not. keeps_line_ends .and. text(i:i) == newline) then
        n = max(n, 1)
        text(i:i + n - 1) = repeat("?", n)
      end if
      i = i + n
    end do
  end subroutine make_printable

  !> Position of the last byte of the last complete UTF-8 character within the first `n` bytes of a text. If the text is not UTF-8,
  !> this is `n`.
  pure integer function end_of_last_character(text, n) result(last)
    character(len=*), intent(in) :: text
    integer, intent(in) :: n

    do last = n, max(1, n - 3), -1
      if (.not. continues(text(last + 1:last + 1))) return
    end do
    last = n
  end function end_of_last_character

  !> True if a text contains a control character (of one or two bytes) or a line end.
  pure logical function has_control(text)
    character(len=*), intent(in) :: text
    integer :: i

    has_control = index(text, newline) > 0 .or. any([(is_control(text(i:min(i + 1, len(text)))), i = 1, len(text))])
  end function has_control

  !> True if a UTF-8 character is a control character, of one or two bytes, but not a line end.
  pure logical function is_control(character)
    character(len=*), intent(in) :: character
    integer :: first

    first = ichar(character(1:1))
    is_control = first < 32 .and. character(1:1) /= newline .or. first == 127
    if (first == 194 .and. len(character) > 1) is_control = ichar(character(2:2)) < 160
  end function is_control

  !> Number of bytes of the first UTF-8 character of a text. 0 if this character is invalid or XML does not allow it.
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
    ! overlong encodings, surrogates, code points that are no characters or too large
    if (n == 3 .and. point < 2048 .or. n == 4 .and. point < 65536 .or. point >= 55296 .and. point < 57344 &
      & .or. point == 65534 .or. point == 65535 .or. point > 1114111) n = 0
  end function length_of_character

end module gestell_base_words
