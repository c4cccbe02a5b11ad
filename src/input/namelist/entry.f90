!> Parses one key of a namelist group and the values of this key.
module gestell_input_namelist_entry
  use gestell_base_error, only: error_type
  use gestell_base_text, only: text
  use gestell_input_namelist_document, only: group_type, entry_type, value_type
  use gestell_input_namelist_message, only: refuse_line
  use gestell_input_namelist_number, only: is_digits, read_integer
  use gestell_input_namelist_scanner, only: scanner_type, token_type, next_token, skip_blanks, next_character, &
    bare, mark, quoted, unclosed_quote
  use gestell_input_wording, only: shown, lower
  implicit none (type, external)
  private

  public :: parse_entry, is_name

contains

  !> Parses a key with its values, "key = values" or "key(i) = values".
  pure subroutine parse_entry(scanner, group, token, entry, error)
    !> Position reached in the text; when the procedure is called, the position after the key
    type(scanner_type), intent(inout) :: scanner
    !> Group that contains the key, for messages
    type(group_type), intent(in) :: group
    !> When the procedure is called: the key. On return: the first token after the values
    type(token_type), intent(inout) :: token
    type(entry_type), intent(out) :: entry
    type(error_type), allocatable, intent(out) :: error

    entry%key = lower(token%text)
    entry%line = token%line
    allocate(entry%subscript(0))
    if (.not. is_name(entry%key)) then
      if (entry%key(1:1) == "$") then
        call refuse_line(group, token%line, "close the group with / instead of " // shown(token%text), error)
      else
        call refuse_line(group, token%line, "a key is expected, not '" // shown(token%text) // "'", error)
      end if
      return
    end if
    call next_token(scanner, token)
    if (token%kind == mark .and. token%text == "(") then
      call parse_subscript(scanner, group, entry, error)
      if (allocated(error)) return
      call next_token(scanner, token)
    end if
    if (token%kind /= mark .or. token%text /= "=") then
      call refuse_line(group, entry%line, "= is missing after '" // shown(entry%key) // "'", error)
      return
    end if
    call parse_values(scanner, group, token, entry, error)
  end subroutine parse_entry

  !> Parses the integers of a subscript "(i)" or "(i,j)" and moves the scanner past the closing parenthesis.
  pure subroutine parse_subscript(scanner, group, entry, error)
    type(scanner_type), intent(inout) :: scanner
    type(group_type), intent(in) :: group
    type(entry_type), intent(inout) :: entry
    type(error_type), allocatable, intent(out) :: error
    type(token_type) :: token
    character(len=:), allocatable :: reason
    integer :: i

    do
      call next_token(scanner, token)
      call read_integer(token%text, i, reason)
      if (token%kind /= bare .or. reason /= "" .or. size(entry%subscript) == 2) exit
      entry%subscript = [entry%subscript, i]
      call next_token(scanner, token)
      if (token%kind /= mark) exit
      if (token%text == ")") return
      if (token%text /= ",") exit
    end do
    call refuse_line(group, entry%line, "'" // shown(entry%key) // "(': one or two whole numbers and a ) must follow", error)
  end subroutine parse_subscript

  !> Parses values until the next key, the end of the group or the end of the text.
  pure subroutine parse_values(scanner, group, token, entry, error)
    type(scanner_type), intent(inout) :: scanner
    type(group_type), intent(in) :: group
    type(token_type), intent(inout) :: token
    type(entry_type), intent(inout) :: entry
    type(error_type), allocatable, intent(out) :: error
    type(value_type), allocatable :: longer(:)
    type(value_type) :: value
    integer :: n, behind, after, position
    logical :: separated

    allocate(entry%values(2))
    n = 0
    behind = 0
    separated = .false.
    do
      call skip_blanks(scanner)
      position = scanner%position
      call next_token(scanner, token)
      select case (token%kind)
      case (mark)
        if (token%text /= ",") exit
        if (separated .or. n == 0) then
          call refuse_line(group, token%line, "a value is missing before a comma of '" // shown(entry%key) // "'", error)
          return
        end if
        separated = .true.
        cycle
      case (bare, quoted, unclosed_quote)
        call parse_value(scanner, group, token, entry, value, error)
        if (allocated(error)) return
        after = scanner%position
        call skip_blanks(scanner)
        if (token%kind == bare .and. scan(next_character(scanner), "=(") > 0) exit
        if (position == behind) then
          call refuse_line(group, token%line, "a blank or comma is missing before '" // shown(token%text) &
            // "' (a quote within a text is written twice)", error)
          return
        end if
      case default
        exit
      end select
      if (n == size(entry%values)) then
        allocate(longer(2 * n))
        longer(:n) = entry%values
        call move_alloc(longer, entry%values)
      end if
      n = n + 1
      entry%values(n) = value
      separated = .false.
      behind = after
    end do
    entry%values = entry%values(:n)
    if (n == 0) call refuse_line(group, entry%line, "'" // shown(entry%key) // "' has no value", error)
  end subroutine parse_values

  !> Parses one value, and its repeat count if it has one, from a token.
  pure subroutine parse_value(scanner, group, token, entry, value, error)
    type(scanner_type), intent(inout) :: scanner
    type(group_type), intent(in) :: group
    type(token_type), intent(inout) :: token
    type(entry_type), intent(in) :: entry
    type(value_type), intent(out) :: value
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: reason
    integer :: star

    star = index(token%text, "*")
    if (token%kind == bare .and. is_digits(token%text(:star-1))) then
      call read_integer(token%text(:star-1), value%count, reason)
      if (reason /= "" .or. value%count == 0) then
        call refuse_line(group, token%line, "'" // shown(token%text) // "': the repeat count must be from 1 to " // text(huge(1)), &
          & error)
        return
      end if
      if (star < len(token%text)) then
        token%text = token%text(star+1:)
      else if (scan(next_character(scanner), "'""") > 0) then
        call next_token(scanner, token)
      else
        call refuse_line(group, token%line, "a value is missing after '" // shown(token%text) // "'", error)
        return
      end if
    end if
    if (token%kind == unclosed_quote) call refuse_line(group, token%line, "the text '" // shown(token%text) &
      & // " has no closing quote on its line", error)
    value%text = token%text
    value%quoted = token%kind /= bare
    value%line = entry%line
  end subroutine parse_value

  !> True if a text is a permitted name of a group or key: a letter, followed by letters, digits and underscores.
  pure logical function is_name(text)
    character(len=*), intent(in) :: text
    character(len=*), parameter :: letters = "abcdefghijklmnopqrstuvwxyz"

    is_name = scan(lower(text), letters) == 1 .and. verify(lower(text), letters // "0123456789_") == 0
  end function is_name

end module gestell_input_namelist_entry
