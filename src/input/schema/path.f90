!> Sets and returns values of a document that are denoted by paths such as joint(B).lengths(1).
module gestell_input_schema_path
  use gestell_base_error, only: error_type, fatal_error, invalid_input, wrong_usage
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: exact
  use gestell_input_schema_check, only: normalise
  use gestell_input_namelist_document, only: document_type, group_type, entry_type, find_entry
  use gestell_input_schema_locate, only: target_type, find_target
  use gestell_input_schema_merge, only: expand, start
  use gestell_input_schema_rule, only: check_values
  use gestell_base_key, only: key_type, text_key
  use gestell_input_schema, only: schema_type
  use gestell_input_wording, only: shown, without_quotes
  implicit none (type, external)
  private

  public :: set_value, get_path, position_of_equals, set_path_real, set_path_text

contains

  !> Executes the assignment "PATH=VALUE" of --set. Fails if the path denotes nothing or the value is not permitted.
  pure subroutine set_value(doc, schema, assignment, error)
    type(document_type), intent(inout) :: doc
    type(schema_type), intent(in) :: schema
    !> "PATH=VALUE" as typed
    character(len=*), intent(in) :: assignment
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: origin
    integer :: equals

    origin = "--set " // shown(trim(assignment))
    equals = position_of_equals(assignment)
    if (equals > 0) then
      call assign(doc, schema, assignment(:equals-1), assignment(equals+1:), origin, error)
    else
      call fatal_error(error, origin // ": must be PATH=VALUE, such as drive.speed_rpm=240", wrong_usage)
    end if
  end subroutine set_value

  !> Sets the value at `path` to a number; no digit of it is lost. Fails under the same conditions as `set_value`.
  pure subroutine set_path_real(doc, schema, path, value, error)
    type(document_type), intent(inout) :: doc
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: path
    !> The number as in an input file, in the units of the input
    real(dp), intent(in) :: value
    type(error_type), allocatable, intent(out) :: error

    call set_path_text(doc, schema, path, exact(value), error)
  end subroutine set_path_real

  !> Sets the value at `path` to the text `value`, in the form that `--set PATH=VALUE` accepts after the equals sign. Fails under
  !> the same conditions as `set_value`.
  pure subroutine set_path_text(doc, schema, path, value, error)
    type(document_type), intent(inout) :: doc
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: path, value
    type(error_type), allocatable, intent(out) :: error

    call assign(doc, schema, path, value, "at " // shown(path) // "=" // shown(trim(value)), error)
  end subroutine set_path_text

  !> Returns the numbers that `path` denotes, as typed, in the order of the groups and their elements. Fails if the path denotes
  !> nothing or a text.
  pure subroutine get_path(doc, schema, path, values, error)
    type(document_type), intent(inout) :: doc
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: path
    real(dp), allocatable, intent(out) :: values(:)
    type(error_type), allocatable, intent(out) :: error
    type(target_type) :: target
    integer :: i, j, k

    allocate(values(0))
    call normalise(doc, schema, error)
    if (allocated(error)) return
    call find_target(doc, schema, path, shown(path) // ": ", target, error)
    if (allocated(error)) return
    if (schema%keys(target%rule)%kind == text_key) then
      call fatal_error(error, shown(path) // ": is a text, not a number", invalid_input)
      return
    end if
    do i = 1, size(target%groups)
      associate (group => doc%groups(target%groups(i)))
        j = find_entry(group, target%key)
        if (j == 0) cycle
        do k = 1, size(group%entries(j)%values)
          if (target%element > 0 .and. k /= target%element) cycle
          if (.not. allocated(group%entries(j)%values(k)%text)) cycle
          values = [values, group%entries(j)%values(k)%number]
        end do
      end associate
    end do
    if (size(values) == 0) call fatal_error(error, shown(path) // ": has no value in the input", invalid_input)
  end subroutine get_path

  !> Sets the value at `path`. Error messages quote `origin` in place of file and line.
  pure subroutine assign(doc, schema, path, text, origin, error)
    type(document_type), intent(inout) :: doc
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: path, text, origin
    type(error_type), allocatable, intent(out) :: error
    type(target_type) :: target
    type(group_type) :: group
    type(group_type), allocatable :: groups(:)
    type(key_type) :: rule
    type(entry_type) :: typed_entry, entry
    integer :: i, largest_element

    call normalise(doc, schema, error)
    if (allocated(error)) return
    call find_target(doc, schema, path, origin // ": ", target, error)
    if (allocated(error)) return
    rule = schema%keys(target%rule)

    group%name = trim(rule%group)
    group%file = doc%file
    allocate(group%entries(0))
    if (target%element > 0) then
      rule%least = 1
      rule%most = 1
    end if
    call split(text, rule, target%key, origin, typed_entry, error)
    if (allocated(error)) return
    call expand(group, typed_entry, rule, entry, error)
    if (allocated(error)) return
    call check_values(group, rule, entry, error)
    if (allocated(error)) return
    ! change nothing unless all groups can be changed
    largest_element = minval([(largest_element_of(doc%groups(target%groups(i)), schema%keys(target%rule)), i = 1, &
      & size(target%groups))])
    if (size(target%groups) == 0) largest_element = largest_element_of(group, schema%keys(target%rule))
    if (target%element > largest_element) then
      call fatal_error(error, entry%values(1)%origin // ": the element before it is missing", invalid_input)
      return
    end if
    if (size(target%groups) == 0) then
      allocate(groups(size(doc%groups) + 1))
      groups(:size(doc%groups)) = doc%groups
      groups(size(groups)) = group
      call move_alloc(groups, doc%groups)
      target%groups = [size(doc%groups)]
    end if
    do i = 1, size(target%groups)
      call store_entry(doc%groups(target%groups(i)), entry, schema%keys(target%rule), target%element, size(typed_entry%values) == 1)
    end do
  end subroutine assign

  !> Largest index that an element may have when it is set. For a list of variable length this is the number of existing elements
  !> plus one, or the minimum length of the list if that is larger.
  pure integer function largest_element_of(group, rule)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: rule
    integer :: i

    largest_element_of = rule%most
    if (rule%least == rule%most) return
    i = find_entry(group, trim(rule%name))
    largest_element_of = rule%least
    if (i > 0) largest_element_of = max(largest_element_of, 1 + size(group%entries(i)%values))
  end function largest_element_of

  !> Stores an entry in a group. If `element` > 0, only the first value of the entry is stored, as this element; otherwise all
  !> values are stored. If one value was typed (`one`) for a key whose components are `alike`, it is stored for all existing
  !> components, and at least for the minimum number of components.
  pure subroutine store_entry(group, entry, rule, element, one)
    type(group_type), intent(inout) :: group
    type(entry_type), intent(in) :: entry
    type(key_type), intent(in) :: rule
    integer, intent(in) :: element
    logical, intent(in) :: one
    type(entry_type), allocatable :: entries(:)
    type(entry_type) :: longer
    integer :: i, n

    i = find_entry(group, entry%key)
    if (i == 0) then
      n = size(group%entries)
      allocate(entries(n + 1))
      entries(:n) = group%entries
      call move_alloc(entries, group%entries)
      i = n + 1
      n = rule%most
      if (rule%least < rule%most) n = merge(0, rule%least, rule%least == 1)
      call start(entry, rule, n, group%entries(i))
    end if
    if (element == 0) then
      n = size(entry%values)
      if (rule%alike .and. one) n = max(rule%least, size(group%entries(i)%values))
      group%entries(i) = entry
      group%entries(i)%values = entry%values(:n)
      return
    end if
    n = size(group%entries(i)%values)
    if (element > n) then
      call start(entry, rule, n + 1, longer)
      longer%values(:n) = group%entries(i)%values
      group%entries(i) = longer
    end if
    group%entries(i)%values(element) = entry%values(1)
  end subroutine store_entry

  !> Splits a text at commas into the values of an entry. If the key accepts only one text, the whole text is its value, including
  !> commas.
  pure subroutine split(text, rule, key, origin, entry, error)
    character(len=*), intent(in) :: text, key, origin
    type(key_type), intent(in) :: rule
    type(entry_type), intent(out) :: entry
    type(error_type), allocatable, intent(out) :: error
    integer :: i, n, start_of, next

    n = 1
    if (rule%kind /= text_key .or. rule%most > 1) n = 1 + count([(text(i:i) == ",", i = 1, len(text))])
    entry%key = key
    allocate(entry%subscript(0))
    allocate(entry%values(n))
    start_of = 1
    do i = 1, n
      next = index(text(start_of:), ",")
      if (n == 1 .or. next == 0) next = len(text) - start_of + 2
      associate (value => entry%values(i))
        value%text = trim(adjustl(text(start_of:start_of+next-2)))
        value%origin = origin
        if (value%text == "" .and. .not. (rule%kind == text_key .and. n == 1)) then
          call fatal_error(error, origin // ": a value is missing", invalid_input)
          return
        end if
        if (rule%kind == text_key) then
          value%quoted = .true.
          value%text = without_quotes(value%text)
        end if
      end associate
      start_of = start_of + next
    end do
    if (rule%alike .and. n == 1) entry%values%count = rule%most
  end subroutine split

  !> Position of the equals sign that separates path and value; 0 if there is none. An equals sign in parentheses belongs to a name.
  pure integer function position_of_equals(text) result(i)
    character(len=*), intent(in) :: text
    integer :: depth

    depth = 0
    do i = 1, len(text)
      if (text(i:i) == "=" .and. depth <= 0) return
      if (text(i:i) == "(") depth = depth + 1
      if (text(i:i) == ")") depth = depth - 1
    end do
    i = 0
  end function position_of_equals

end module gestell_input_schema_path
