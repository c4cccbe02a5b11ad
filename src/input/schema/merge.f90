!> Merges the entries of a group, so that each key has one entry with one value for each element.
module gestell_input_schema_merge
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_input_namelist_document, only: group_type, entry_type, value_type
  use gestell_input_namelist_message, only: refuse_entry, refuse_line
  use gestell_input_namelist_number, only: read_real
  use gestell_input_schema_rule, only: check_values, describe_count, describe_extent, element_of, subscript_words, typing_hint, &
    unknown_key
  use gestell_base_key, only: key_type
  use gestell_base_text, only: concise, text
  use gestell_input_schema, only: schema_type, find_key_rule
  implicit none (type, external)
  private

  public :: merge_entries, expand, start

contains

  !> Merges all entries of a group. Fails if a key is unknown, a value is given twice, or the values do not suit their key.
  pure subroutine merge_entries(group, schema, error)
    type(group_type), intent(inout) :: group
    type(schema_type), intent(in) :: schema
    type(error_type), allocatable, intent(out) :: error
    type(entry_type) :: merged(count(schema%keys%group == group%name))
    integer :: index_of(size(schema%keys)), rule_of(size(merged))
    character(len=:), allocatable :: message
    integer :: i, n, rule

    n = 0
    index_of = 0
    do i = 1, size(group%entries)
      associate (entry => group%entries(i))
        rule = find_key_rule(schema, group%name, entry%key)
        if (rule > 0) call translate(entry, schema%keys(rule))
        if (rule > 0) rule = find_key_rule(schema, group%name, entry%key)
        if (rule == 0) then
          call unknown_key(entry%key, schema, group%name, message)
          call refuse_line(group, entry%line, message, error)
          return
        end if
        if (index_of(rule) == 0) then
          n = n + 1
          index_of(rule) = n
          rule_of(n) = rule
        end if
        call merge_entry(group, entry, schema%keys(rule), merged(index_of(rule)), error)
        if (allocated(error)) return
      end associate
    end do
    do i = 1, n
      call close_list(group, schema%keys(rule_of(i)), merged(i), error)
      if (allocated(error)) return
      call check_values(group, schema%keys(rule_of(i)), merged(i), error)
      if (allocated(error)) return
    end do
    group%entries = merged(:n)
  end subroutine merge_entries

  !> If the key of an entry is another name of a key, gives the entry that key and the values in its unit. Values that are no
  !> numbers stay as typed, and are refused later.
  pure subroutine translate(entry, rule)
    type(entry_type), intent(inout) :: entry
    type(key_type), intent(in) :: rule
    character(len=:), allocatable :: reason
    real(dp) :: number
    integer :: i

    if (rule%same_as == "") return
    entry%key = trim(rule%same_as)
    do i = 1, size(entry%values)
      if (.not. allocated(entry%values(i)%text)) cycle
      call read_real(entry%values(i)%text, number, reason)
      if (reason == "") entry%values(i)%text = concise(rule%factor * number, 17)
    end do
  end subroutine translate

  !> Adds one entry of the input file to the merged entry of the same key.
  pure subroutine merge_entry(group, entry, rule, merged, error)
    type(group_type), intent(in) :: group
    type(entry_type), intent(in) :: entry
    type(key_type), intent(in) :: rule
    type(entry_type), intent(inout) :: merged
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: words
    integer :: element

    if (size(entry%subscript) == 0) then
      if (allocated(merged%key)) then
        call refuse_entry(group, entry, "is given twice (first in line " // text(merged%line) // ")", error)
        return
      end if
      call expand(group, entry, rule, merged, error)
      return
    end if

    element = element_of(entry%subscript, rule)
    if (size(entry%subscript) /= rule%rank) then
      call refuse_entry(group, entry, subscript_words(rule), error)
    else if (element == 0) then
      call describe_extent(rule, words)
      call refuse_entry(group, entry, "has no such element: " // words, error)
    else if (size(entry%values) > 1 .or. entry%values(1)%count > 1) then
      call refuse_entry(group, entry, "takes 1 value" // trim(typing_hint(entry, rule)), error)
    else
      if (.not. allocated(merged%key)) call start(entry, rule, rule%most, merged)
      if (size(merged%values) < element) then
        call refuse_entry(group, entry, "is given twice (first in line " // text(merged%line) // ")", error)
      else if (allocated(merged%values(element)%text)) then
        call refuse_entry(group, entry, "is given twice (first in line " // text(merged%values(element)%line) // ")", error)
      else
        merged%values(element) = entry%values(1)
      end if
    end if
  end subroutine merge_entry

  !> Stores the values of an entry that has no subscripts: resolves repeat counts and checks the number of values.
  pure subroutine expand(group, entry, rule, merged, error)
    !> Group that contains the entry, for messages
    type(group_type), intent(in) :: group
    type(entry_type), intent(in) :: entry
    !> Record of the entry's key
    type(key_type), intent(in) :: rule
    type(entry_type), intent(inout) :: merged
    type(error_type), allocatable, intent(out) :: error
    type(value_type) :: value
    character(len=:), allocatable :: words
    real(dp) :: total
    integer :: i, k, n, place, rows

    ! in real numbers, because large repeat counts would overflow an integer
    total = sum(real(entry%values%count, dp))
    if (rule%shorter > 0 .and. all(nint(min(total, 1.0e6_dp)) /= [rule%shorter, rule%most])) then
      call refuse_entry(group, entry, "takes " // text(rule%shorter) // " or " // text(rule%most) // " values, has " &
        // text(nint(min(total, 1.0e6_dp))) // trim(typing_hint(entry, rule)), error)
    else if (total > rule%most) then
      call describe_count(rule, total, words)
      call refuse_entry(group, entry, words // trim(typing_hint(entry, rule)), error)
    else if (total < rule%least .and. rule%shorter == 0) then
      call describe_count(rule, total, words)
      call refuse_entry(group, entry, words, error)
    end if
    if (allocated(error)) return
    call start(entry, rule, merge(rule%most, nint(total), rule%shorter > 0), merged)
    rows = nint(sqrt(total))
    n = 0
    do i = 1, size(entry%values)
      value = entry%values(i)
      value%count = 1
      do k = 1, entry%values(i)%count
        n = n + 1
        place = n
        ! the entry gives a matrix in its short form
        if (rule%rank == 2 .and. nint(total) == rule%shorter) place = 1 + mod(n - 1, rows) + rule%rows * ((n - 1) / rows)
        merged%values(place) = value
      end do
    end do
  end subroutine expand

  !> Creates a merged entry that has no values yet.
  pure subroutine start(entry, rule, n, merged)
    !> Entry from which key and line number are copied
    type(entry_type), intent(in) :: entry
    type(key_type), intent(in) :: rule
    !> Number of elements
    integer, intent(in) :: n
    type(entry_type), intent(inout) :: merged

    merged%key = entry%key
    merged%line = entry%line
    merged%rank = rule%rank
    merged%rows = rule%rows
    allocate(merged%subscript(0))
    allocate(merged%values(n))
  end subroutine start

  !> Removes the elements after the last given one from a list of variable length, but keeps the minimum number of elements. Fails
  !> if an element beyond this minimum is given although the element before it is missing.
  pure subroutine close_list(group, rule, merged, error)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: rule
    type(entry_type), intent(inout) :: merged
    type(error_type), allocatable, intent(out) :: error
    integer :: i, n

    if (rule%least == rule%most) return
    n = 0
    do i = 1, size(merged%values)
      if (.not. allocated(merged%values(i)%text)) cycle
      if (i > max(n + 1, rule%least)) then
        call refuse_entry(group, merged, "the element before it is missing", error, i)
        return
      end if
      n = i
    end do
    if (rule%least > 1) n = max(n, rule%least)
    merged%values = merged%values(:n)
  end subroutine close_list

end module gestell_input_schema_merge
