!> Composes error messages of one line that name file, line, group and key.
module gestell_input_namelist_message
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_words, only: length_on_one_line, put_on_one_line
  use gestell_base_text, only: either, text
  use gestell_input_namelist_document, only: value_type, entry_type, group_type, find_entry, name_of
  use gestell_input_wording, only: shown, longest_shown
  implicit none (type, external)
  private

  public :: locate_in_group, input_error, refuse_entry, refuse_line, location, label, describe_entry

contains

  !> Returns an error for a wrong value of a key. The message has the form "file:line: &group 'name': key = value: message". For a
  !> value that comes from --set, the form is "--set path=value: message".
  pure subroutine input_error(group, key, message, error, element)
    type(group_type), intent(in) :: group
    !> `key`: name of the key, or empty if the error concerns the whole group. `message`: what is wrong
    character(len=*), intent(in) :: key, message
    type(error_type), allocatable, intent(out) :: error
    !> Index of the element whose value is wrong. If absent, the message concerns all values of the key
    integer, intent(in), optional :: element
    integer :: i

    i = find_entry(group, key)
    if (i > 0) then
      call refuse_entry(group, group%entries(i), message, error, element)
    else if (key == "") then
      call refuse_line(group, group%line, message, error)
    else
      call refuse_line(group, group%line, key // ": " // message, error)
    end if
  end subroutine input_error

  !> Puts file, line and group in front of an error's message, unless the message already begins with the file or with an option. If
  !> the message begins with the group's name, the name is not repeated.
  subroutine locate_in_group(group, error)
    type(group_type), intent(in) :: group
    type(error_type), allocatable, intent(inout) :: error
    character(len=:), allocatable :: own

    own = location(group%file, 0)
    if (index(error%message, own(:len(own) - 1)) == 1 .or. index(error%message, "--") == 1) return
    own = label(group) // ": "
    if (index("&" // error%message, own) == 1) error%message = error%message(len(own):)
    error%message = location(group%file, group%line) // own // error%message
  end subroutine locate_in_group

  !> Returns an error for a wrong value of `entry`. The message has the same form as that of `input_error`.
  pure subroutine refuse_entry(group, entry, message, error, element)
    type(group_type), intent(in) :: group
    type(entry_type), intent(in) :: entry
    !> The explanation
    character(len=*), intent(in) :: message
    type(error_type), allocatable, intent(out) :: error
    !> Index of the element whose value is wrong. If absent, the message concerns all values
    integer, intent(in), optional :: element
    character(len=:), allocatable :: typed

    associate (value => entry%values(value_with_line(entry, element)))
      if (allocated(value%origin)) then
        call fatal_error(error, value%origin // ": " // message, invalid_input)
      else
        call describe_entry(entry, typed, element)
        call refuse_line(group, value%line, typed // ": " // message, error)
      end if
    end associate
  end subroutine refuse_entry

  !> Returns an error that names the group and the line with number `line`. `message` says what is wrong.
  pure subroutine refuse_line(group, line, message, error)
    type(group_type), intent(in) :: group
    integer, intent(in) :: line
    character(len=*), intent(in) :: message
    type(error_type), allocatable, intent(out) :: error

    call fatal_error(error, location(group%file, line) // label(group) // ": " // message, invalid_input)
  end subroutine refuse_line

  !> Index of the value whose line the message quotes: `element` if present, otherwise the first value that the input gives.
  pure integer function value_with_line(entry, element) result(i)
    type(entry_type), intent(in) :: entry
    integer, intent(in), optional :: element

    if (present(element)) then
      i = element
      if (i >= 1 .and. i <= size(entry%values)) then
        if (allocated(entry%values(i)%text)) return
      end if
    end if
    do i = 1, size(entry%values) - 1
      if (allocated(entry%values(i)%text)) return
    end do
  end function value_with_line

  !> Returns a key with all its values as the user typed them, "key = values". If `element` is present, only this element,
  !> "key(2) = value".
  pure subroutine describe_entry(entry, words, element)
    type(entry_type), intent(in) :: entry
    character(len=:), allocatable, intent(out) :: words
    integer, intent(in), optional :: element
    character(len=:), allocatable :: comma
    integer, allocatable :: at(:)
    integer :: i, last

    allocate(at(0))
    if (allocated(entry%subscript)) at = entry%subscript
    if (present(element)) then
      if (entry%rank == 1) at = [element]
      if (entry%rank == 2) at = [1 + mod(element - 1, entry%rows), 1 + (element - 1) / entry%rows]
    end if
    words = entry%key
    if (size(at) == 1) words = words // "(" // text(at(1)) // ")"
    if (size(at) > 1) words = words // "(" // text(at(1)) // "," // text(at(2)) // ")"
    if (present(element)) then
      if (element < 1 .or. element > size(entry%values)) return
      if (allocated(entry%values(element)%text)) words = words // " = " // typed_value(entry%values(element))
      return
    end if
    words = words // " ="
    comma = " "
    last = findloc([(allocated(entry%values(i)%text), i = 1, size(entry%values))], .true., dim=1, back=.true.)
    do i = 1, last
      if (.not. allocated(entry%values(i)%text)) cycle
      words = words // comma // typed_value(entry%values(i))
      comma = ", "
      if (len(words) <= 2 * longest_shown .or. i == last) cycle
      words = words // ", ..."
      return
    end do
    if (comma == " ") words = words // comma
  end subroutine describe_entry

  !> A value as the user typed it, with its quotes and repeat count.
  pure function typed_value(value) result(words)
    type(value_type), intent(in) :: value
    character(len=merge(1 + len(text(value%count)), 0, value%count /= 1) + merge(2, 0, value%quoted) + len(shown(value%text))) &
      & :: words

    words = either(text(value%count) // "*", "", value%count /= 1) // either("'", "", value%quoted) // shown(value%text) // "'"
  end function typed_value

  !> Beginning of a message: "file:line: ", or "file: " if `line` is zero.
  pure function location(file, line) result(words)
    character(len=*), intent(in) :: file
    integer, intent(in) :: line
    character(len=length_on_one_line(file) + 2 + merge(1 + len(text(line)), 0, line > 0)) :: words
    character(len=:), allocatable :: name

    ! make the file's name printable, as elsewhere in messages
    call put_on_one_line(file, name)
    words = name // either(":" // text(line), "", line > 0) // ": "
  end function location

  !> Name by which messages refer to a group, such as "&joint 'B'", "&support 2" or "&drive".
  pure function label(group) result(words)
    type(group_type), intent(in) :: group
    character(len=1 + len(shown(group%name)) + merge(3 + len(shown(name_of(group))), merge(1 + len(text(group%number)), 0, &
      & group%number > 0), len_trim(name_of(group)) > 0)) :: words

    words = "&" // shown(group%name) // either(" '" // shown(name_of(group)) // "'", " " // text(group%number), &
      & len_trim(name_of(group)) > 0)
  end function label

end module gestell_input_namelist_message
