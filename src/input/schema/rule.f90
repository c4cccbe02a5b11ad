!> Checks values against the record of their key, and composes the error messages.
module gestell_input_schema_rule
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: character_count, has_control, longest_name, longest_word
  use gestell_input_namelist_document, only: group_type, entry_type, value_type
  use gestell_input_namelist_message, only: refuse_entry
  use gestell_input_namelist_number, only: read_real, read_integer, is_digits
  use gestell_base_key, only: integer_key, key_type, real_key, text_key
  use gestell_base_text, only: text
  use gestell_input_schema, only: schema_type
  use gestell_input_namelist_suggest, only: advice, listed
  use gestell_input_wording, only: shown
  implicit none (type, external)
  private

  public :: check_values, element_of, describe_count, describe_extent, subscript_words, typing_hint, unknown_key

  !> Keys whose values are names of joints, links or other parts.
  character(len=*), parameter :: names(*) = [character(len=5) :: "name", "pivot", "from", "to"]
  !> For each rank of a key, the number of its subscripts in words.
  character(len=*), parameter :: subscript_counts(0:2) = [character(len=14) :: "no subscript", "one subscript", "two subscripts"]
  character(len=*), parameter :: straight_quotes = "must be in straight quotes, ' or """

contains

  !> Checks that all values of an entry are of the kind that the key requires, and converts texts to numbers where required.
  pure subroutine check_values(group, rule, merged, error)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: rule
    type(entry_type), intent(inout) :: merged
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: reason
    integer :: i

    do i = 1, size(merged%values)
      if (.not. allocated(merged%values(i)%text)) cycle
      call check_kind(rule, merged%values(i), reason)
      if (reason == "") cycle
      call refuse_entry(group, merged, reason, error, i)
      return
    end do
  end subroutine check_values

  !> Checks one value and, if the key requires a number, converts it. If the value does not suit the key, `reason` says why;
  !> otherwise `reason` is empty.
  pure subroutine check_kind(rule, value, reason)
    type(key_type), intent(in) :: rule
    type(value_type), intent(inout) :: value
    character(len=:), allocatable, intent(out) :: reason
    integer :: n

    reason = ""
    if (rule%kind == text_key) then
      if (.not. value%quoted) reason = "must be in quotes: '" // shown(value%text) // "'"
      if (.not. value%quoted .and. has_typeset_quotes(value%text)) reason = straight_quotes
      if (rule%name == "name" .and. value%text == "") reason = "must not be blank"
      n = huge(n)
      if (rule%rank > 0) n = longest_word
      if (any(rule%name == names)) n = longest_name
      if (character_count(trim(value%text)) > n) reason = "must not be longer than " // text(n) // " characters"
      if (rule%name == "name" .and. has_control(value%text)) reason = "must not contain control characters, such as line ends"
    else if (value%quoted) then
      reason = "must be a number, without quotes"
    else if (rule%kind == integer_key) then
      call read_integer(value%text, n, reason)
      value%number = n
    else if (rule%kind == real_key) then
      call read_real(value%text, value%number, reason)
    end if
  end subroutine check_kind

  !> Index of the element with these subscripts, counted column by column; 0 if there is no such element.
  pure integer function element_of(subscript, rule)
    integer, intent(in) :: subscript(:)
    type(key_type), intent(in) :: rule

    element_of = 0
    if (size(subscript) /= rule%rank .or. any(subscript < 1) .or. any(subscript > rule%most)) return
    element_of = subscript(1)
    if (rule%rank == 1) return
    element_of = 0
    if (subscript(1) > rule%rows .or. subscript(2) > rule%most / rule%rows) return
    element_of = subscript(1) + rule%rows * (subscript(2) - 1)
  end function element_of

  !> Compares the permitted number of values with the actual number, as in "takes 2 values, has 3".
  pure subroutine describe_count(rule, total, words)
    type(key_type), intent(in) :: rule
    real(dp), intent(in) :: total
    character(len=:), allocatable, intent(out) :: words
    integer, parameter :: many = 1000000

    words = "takes " // text(rule%most) // " value"
    if (rule%least < rule%most) words = "takes at most " // text(rule%most) // " value"
    if (rule%least < rule%most .and. total < rule%least) words = "takes at least " // text(rule%least) // " value"
    if (rule%most > 1) words = words // "s"
    if (total > many) then
      words = words // ", has more than " // text(many)
    else
      words = words // ", has " // text(nint(total))
    end if
  end subroutine describe_count

  !> Phrase that states the number of subscripts, such as "takes one subscript".
  pure function subscript_words(rule) result(words)
    type(key_type), intent(in) :: rule
    character(len=6 + len_trim(subscript_counts(rule%rank))) :: words

    words = "takes " // subscript_counts(rule%rank)
  end function subscript_words

  !> States the range of the subscripts, as in "the subscript runs from 1 to 2".
  pure subroutine describe_extent(rule, words)
    type(key_type), intent(in) :: rule
    character(len=:), allocatable, intent(out) :: words

    if (rule%rank == 2) then
      words = "the subscripts run from 1 to " // text(rule%rows) // " and 1 to " // text(rule%most / rule%rows)
    else
      words = "the subscript runs from 1 to " // text(rule%most)
    end if
  end subroutine describe_extent

  !> True if a text begins with a typographic quotation mark (UTF-8), as word processors insert it.
  pure logical function has_typeset_quotes(text)
    character(len=*), intent(in) :: text
    character(len=*), parameter :: begin = char(226) // char(128)
    character, parameter :: ends(*) = [char(152), char(153), char(154), char(156), char(157), char(158)]

    has_typeset_quotes = .false.
    if (len(text) >= 3) has_typeset_quotes = text(:2) == begin .and. any(text(3:3) == ends)
  end function has_typeset_quotes

  !> Hint for an error message if the user has probably typed a decimal comma, which splits a number into two values, or a
  !> typographic quotation mark. Otherwise blank.
  pure character(len=len(straight_quotes) + 3) function typing_hint(entry, rule) result(hint)
    type(entry_type), intent(in) :: entry
    type(key_type), intent(in) :: rule
    integer :: i, first

    hint = ""
    if (rule%kind == text_key) then
      if (.not. allocated(entry%values(1)%text)) return
      if (has_typeset_quotes(entry%values(1)%text)) hint = " (" // straight_quotes // ")"
      return
    end if
    do i = 1, size(entry%values) - 1
      associate (whole => entry%values(i), decimals => entry%values(i+1))
        if (whole%quoted .or. decimals%quoted .or. whole%count > 1 .or. decimals%count > 1) cycle
        first = 1
        if (scan(whole%text, "+-") == 1) first = 2
        if (.not. is_digits(whole%text(first:))) cycle
        if (verify(decimals%text(:1), "0123456789") > 0 .or. index(decimals%text, ".") > 0) cycle
        hint = " (a decimal comma? use a point)"
        return
      end associate
    end do
  end function typing_hint

  !> Composes the message about a key that the schema does not contain.
  pure subroutine unknown_key(key, schema, group, message)
    character(len=*), intent(in) :: key, group
    type(schema_type), intent(in) :: schema
    character(len=:), allocatable, intent(out) :: message
    character(len=16), allocatable :: names(:)

    names = pack((schema%keys%name), schema%keys%group == group)
    message = "unknown key '" // shown(key) // "': " // advice(key, names, "'", "'", "allowed are " // listed(names, "", ""))
  end subroutine unknown_key

end module gestell_input_schema_rule
