!> Changes values in the text of an input file. The rest of the text, including comments and blanks, remains as it is.
module gestell_input_namelist_edit
  use gestell_base_text, only: text
  use gestell_input_namelist_document, only: entry_type
  use gestell_input_namelist_scanner, only: bare, end_of_text, mark, next_character, next_token, scanner_type, &
    & skip_blanks, token_type
  use gestell_input_wording, only: lower
  implicit none (type, external)
  private

  public :: remove_group, set_entry, spell_entry, with_doubled_quotes

  character, parameter :: newline = new_line("a")

contains

  !> Returns a key and its values as in an input file: "key=values". If elements are missing before others, "key(i)=value" for each
  !> given element.
  pure subroutine spell_entry(entry, words)
    type(entry_type), intent(in) :: entry
    character(len=:), allocatable, intent(out) :: words
    character(len=:), allocatable :: value
    logical :: whole
    integer :: i, last

    last = findloc([(allocated(entry%values(i)%text), i = 1, size(entry%values))], .true., dim=1, back=.true.)
    whole = all([(allocated(entry%values(i)%text), i = 1, last)])
    words = ""
    if (whole) words = ", " // entry%key // "="
    do i = 1, last
      if (.not. allocated(entry%values(i)%text)) cycle
      value = entry%values(i)%text
      if (entry%values(i)%quoted) value = "'" // with_doubled_quotes(value) // "'"
      if (whole) then
        if (i > 1) words = words // ","
      else if (entry%rank == 2) then
        words = words // ", " // entry%key // "(" // text(1 + mod(i - 1, entry%rows)) // "," // text(1 + (i - 1) / entry%rows) &
          & // ")="
      else
        words = words // ", " // entry%key // "(" // text(i) // ")="
      end if
      words = words // value
    end do
    words = words(3:)
  end subroutine spell_entry

  !> Number of single quotes in a text.
  pure integer function number_of_quotes(text) result(number)
    character(len=*), intent(in) :: text
    integer :: i

    number = count([(text(i:i) == "'", i = 1, len(text))])
  end function number_of_quotes

  !> Copy of a text in which every quote is doubled, so that the copy can be enclosed in quotes.
  pure function with_doubled_quotes(text) result(words)
    character(len=*), intent(in) :: text
    character(len=len(text) + number_of_quotes(text)) :: words
    integer :: i, n

    n = 0
    do i = 1, len(text)
      words(n + 1:) = text(i:i) // "'"
      n = n + merge(2, 1, text(i:i) == "'")
    end do
  end function with_doubled_quotes

  !> Replaces the values of a key in one group of the text. If the group does not contain the key, adds it at the end of the group.
  pure subroutine set_entry(text, group, entry, remark)
    !> Content of an input file, which must have correct syntax
    character(len=:), allocatable, intent(inout) :: text
    !> Index of the group among all groups of the text, counted from 1
    integer, intent(in) :: group
    !> Name of the key, and the values that replace its old ones
    type(entry_type), intent(in) :: entry
    !> Comment that is added at the end of the line; none if empty
    character(len=*), intent(in) :: remark
    integer, allocatable :: first(:), last(:)
    character(len=:), allocatable :: comma, words
    integer :: i, at, beginning, ending

    call find_entries(text, group, entry%key, first, last, beginning, ending)
    do i = size(first), 2, -1
      call remove_comma(text, last(i) + 1)
      text = text(:first(i) - 1) // text(last(i) + 1:)
    end do
    call spell_entry(entry, words)
    if (size(first) > 0) then
      at = first(1)
      text = text(:at - 1) // words // text(last(1) + 1:)
    else
      at = ending
      text = trim(text(:at - 1)) // " " // words // " " // text(at:)
    end if
    if (remark == "") return
    i = index(text(at:), newline)
    if (i == 0) i = len(text) - at + 2
    at = at + i - 1
    comma = "   ! "
    if (index(text(index(text(:at - 1), newline, back=.true.) + 1:at - 1), "!") > 0) comma = "; "
    text = text(:at - 1) // comma // remark // text(at:)
  end subroutine set_entry

  !> Removes a group from the text, and its line if nothing else stands there.
  pure subroutine remove_group(text, group)
    !> Content of an input file, which must have correct syntax
    character(len=:), allocatable, intent(inout) :: text
    !> Index of the group among all groups of the text, counted from 1
    integer, intent(in) :: group
    integer, allocatable :: unused_first(:), unused_last(:)
    integer :: first, last, line_start, line_end

    call find_entries(text, group, "", unused_first, unused_last, first, last)
    line_start = index(text(:first - 1), newline, back=.true.) + 1
    line_end = last + index(text(last + 1:) // newline, newline)
    if (text(line_start:first - 1) == "" .and. text(last + 1:line_end - 1) == "") then
      first = line_start
      last = line_end
    end if
    text = text(:first - 1) // text(min(last, len(text)) + 1:)
  end subroutine remove_group

  !> Removes the next comma, starting at position `from`, unless something other than blanks and line breaks precedes it.
  pure subroutine remove_comma(text, from)
    character(len=:), allocatable, intent(inout) :: text
    integer, intent(in) :: from
    integer :: i

    i = from + verify(text(from:), " " // newline) - 1
    if (i < from) return
    if (text(i:i) == ",") text = text(:i - 1) // text(i + 1:)
  end subroutine remove_comma

  !> Finds the entries of a key in a group and returns the positions of their first and last characters, without trailing commas.
  !> `beginning` and `ending`: positions of the & and of the / of the group.
  pure subroutine find_entries(text, group, key, first, last, beginning, ending)
    character(len=*), intent(in) :: text, key
    integer, intent(in) :: group
    integer, allocatable, intent(out) :: first(:), last(:)
    integer, intent(out) :: beginning, ending
    type(scanner_type) :: scanner
    type(token_type) :: token
    integer :: number, start, behind, value_end
    logical :: inside, is_this_key

    allocate(first(0), last(0))
    scanner%text = text
    number = 0
    inside = .false.
    is_this_key = .false.
    value_end = 0
    beginning = 1
    ending = len(text) + 1
    do
      call skip_blanks(scanner)
      start = scanner%position
      call next_token(scanner, token)
      behind = scanner%position - 1
      if (token%kind == end_of_text) return
      if (token%kind == mark .and. token%text == "&" .and. .not. inside) then
        number = number + 1
        if (number == group) beginning = start
        inside = .true.
        call next_token(scanner, token)
        cycle
      end if
      if (.not. inside) cycle
      if (token%kind == mark .and. token%text == "/") then
        if (is_this_key) last = [last, value_end]
        ending = start
        if (number == group) return
        inside = .false.
        cycle
      end if
      if (number /= group) cycle
      if (token%kind == bare) then
        call skip_blanks(scanner)
        if (scan(next_character(scanner), "=(") > 0) then
          if (is_this_key) last = [last, value_end]
          is_this_key = lower(token%text) == key
          if (is_this_key) first = [first, start]
        end if
      end if
      if (token%kind /= mark .or. token%text /= ",") value_end = behind
    end do
  end subroutine find_entries

end module gestell_input_namelist_edit
