!> Splits the text of an input file into tokens, such as words, quoted texts and punctuation marks.
module gestell_input_namelist_scanner
  use gestell_input_wording, only: lower
  implicit none (type, external)
  private

  public :: scanner_type, token_type, next_token, skip_blanks, next_character

  !> A position in a text
  type :: scanner_type
    character(len=:), allocatable :: text
    integer :: position = 1, line = 1
  end type scanner_type

  !> Kinds of tokens.
  integer, parameter, public :: end_of_text = 0, mark = 1, bare = 2, quoted = 3, unclosed_quote = 4

  !> A token: one of the marks & / = , ( ), a word without quotes, or a quoted text, which is stored without its quotes
  type :: token_type
    integer :: kind = end_of_text
    character(len=:), allocatable :: text
    integer :: line = 0
  end type token_type

  character(len=*), parameter :: marks = "&/=,()"
  character(len=*), parameter :: quotes = "'"""
  character(len=*), parameter :: blanks = " " // achar(9) // achar(13) // achar(10)
  character(len=*), parameter :: line_ends = achar(13) // achar(10)
  !> Maximum length of the text in parentheses in nan(...).
  integer, parameter :: longest_payload = 20
  character(len=*), parameter :: word_ends = marks // quotes // blanks // "!"

contains

  !> Reads the next token and moves the scanner past it.
  pure subroutine next_token(scanner, token)
    type(scanner_type), intent(inout) :: scanner
    type(token_type), intent(out) :: token
    character(len=1) :: c

    call skip_blanks(scanner)
    token%line = scanner%line
    c = next_character(scanner)
    if (c == " ") then
      token%text = ""
    else if (index(marks, c) > 0) then
      token%kind = mark
      token%text = c
      scanner%position = scanner%position + 1
    else if (index(quotes, c) > 0) then
      call read_quoted(scanner, token)
    else
      call read_word(scanner, token)
    end if
  end subroutine next_token

  !> Character at the position of the scanner; a blank if this is the end of the text.
  pure character(len=1) function next_character(scanner) result(c)
    type(scanner_type), intent(in) :: scanner

    c = " "
    if (scanner%position <= len(scanner%text)) c = scanner%text(scanner%position:scanner%position)
  end function next_character

  !> Moves the scanner past blanks, line ends and comments.
  pure subroutine skip_blanks(scanner)
    type(scanner_type), intent(inout) :: scanner
    logical :: comment

    comment = .false.
    do while (scanner%position <= len(scanner%text))
      associate (c => scanner%text(scanner%position:scanner%position))
        if (c == new_line("a")) then
          scanner%line = scanner%line + 1
          comment = .false.
        else if (c == "!") then
          comment = .true.
        else if (.not. comment .and. index(blanks, c) == 0) then
          return
        end if
      end associate
      scanner%position = scanner%position + 1
    end do
  end subroutine skip_blanks

  !> Reads a quoted text, which must end on the line on which it begins. Two successive quotes within it stand for one quote.
  pure subroutine read_quoted(scanner, token)
    type(scanner_type), intent(inout) :: scanner
    type(token_type), intent(inout) :: token
    character(len=1) :: quote
    integer :: start, last, step

    quote = next_character(scanner)
    start = scanner%position + 1
    last = scanner%position
    token%kind = unclosed_quote
    do
      step = scan(scanner%text(last+1:), quote // line_ends)
      if (step == 0) step = len(scanner%text) - last + 1
      last = last + step
      scanner%position = last
      if (next_character(scanner) /= quote) exit
      scanner%position = last + 1
      if (next_character(scanner) /= quote) then
        token%kind = quoted
        exit
      end if
      last = last + 1
    end do
    call undouble(scanner%text(start:last-1), quote, token%text)
  end subroutine read_quoted

  !> Copies a text and replaces each doubled quote by a single one.
  pure subroutine undouble(text, quote, single)
    character(len=*), intent(in) :: text
    character(len=1), intent(in) :: quote
    character(len=:), allocatable, intent(out) :: single
    integer :: i, n

    allocate(character(len=len(text)) :: single)
    n = 0
    i = 1
    do while (i <= len(text))
      n = n + 1
      single(n:n) = text(i:i)
      i = i + merge(2, 1, text(i:i) == quote)
    end do
    single = single(:n)
  end subroutine undouble

  !> Reads a word, which ends before the next blank, quote or mark. The form nan(...) counts as one word.
  pure subroutine read_word(scanner, token)
    type(scanner_type), intent(inout) :: scanner
    type(token_type), intent(inout) :: token
    integer :: start, n

    start = scanner%position
    n = scan(scanner%text(start:), word_ends) - 1
    if (n < 0) n = len(scanner%text) - start + 1
    scanner%position = start + n
    token%kind = bare
    token%text = scanner%text(start:start+n-1)
    if (next_character(scanner) /= "(" .or. n < 3) return
    if (lower(token%text(n-2:)) /= "nan" .or. verify(token%text(:n-3), "+-*0123456789") > 0) return
    associate (rest => scanner%text(start:min(len(scanner%text), start + n + longest_payload)))
      n = scan(rest, ")" // blanks)
      if (n == 0) return
      if (rest(n:n) /= ")") return
      token%text = rest(:n)
    end associate
    scanner%position = start + n
  end subroutine read_word

end module gestell_input_namelist_scanner
