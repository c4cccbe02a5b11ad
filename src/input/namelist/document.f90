!> Defines the content of an input file: groups, their keys, and the values of the keys. Each value records where it came from.
module gestell_input_namelist_document
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  implicit none (type, external)
  private

  public :: value_type, entry_type, group_type, document_type
  public :: group_named, count_groups, groups_named, indices_named, group_names, name_of, has, find_entry

  !> A value as typed
  type :: value_type
    !> The value as text. Unallocated if the value is an element of a vector or matrix and the input does not give this element
    character(len=:), allocatable :: text
    !> True if the input gives the value in quotes, which `text` does not contain
    logical :: quoted = .false.
    !> The number that `text` represents; it is set when the document is normalised
    real(dp) :: number = 0
    !> Repeat count of the value: 3 for 3*1.0
    integer :: count = 1
    !> Number of the line of the file in which the value's key stands
    integer :: line = 0
    !> If the value does not come from the file: text that messages quote in place of file and line
    character(len=:), allocatable :: origin
  end type value_type

  !> A key and its values. In a normalised document each key has one entry, which contains the values column by column
  type :: entry_type
    character(len=:), allocatable :: key
    !> Number of the line of the file in which the key stands
    integer :: line = 0
    !> Subscripts of the key as typed; empty in a normalised document
    integer, allocatable :: subscript(:)
    type(value_type), allocatable :: values(:)
    !> Number of subscripts that an element of the key has
    integer :: rank = 0
    !> Number of rows, if the key is a matrix
    integer :: rows = 1
  end type entry_type

  !> One group `&name ... /`
  type :: group_type
    character(len=:), allocatable :: name
    !> Name of the file, for messages
    character(len=:), allocatable :: file
    !> Number of the line of the file in which the group begins
    integer :: line = 0
    !> Number of the group among the groups of the same name; 0 if no other group has this name
    integer :: number = 0
    type(entry_type), allocatable :: entries(:)
  end type group_type

  !> All groups of an input file, in the order of the file
  type :: document_type
    !> Name of the input file, for messages
    character(len=:), allocatable :: file
    !> Full path of the input file; unallocated if the input is no file
    character(len=:), allocatable :: path
    !> Complete text of the input, including comments; unallocated if groups were added in code
    character(len=:), allocatable :: text
    type(group_type), allocatable :: groups(:)
    !> True if all keys have been checked against the schema and merged to one entry for each key
    logical :: normalised = .false.
  end type document_type

contains

  !> Returns the group called `name`, or an empty group if the document contains none. Intended for groups that may occur only
  !> once.
  pure function group_named(doc, name) result(group)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: name
    type(group_type) :: group
    integer :: i

    do i = 1, size(doc%groups)
      if (doc%groups(i)%name == name) then
        group = doc%groups(i)
        return
      end if
    end do
    group%name = name
    group%file = doc%file
    allocate(group%entries(0))
  end function group_named

  !> Number of groups called `name`. The function does not use `groups_named`, because gfortran 12 does not free function results
  !> that occur within an expression.
  pure integer function count_groups(doc, name)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: name
    integer :: i

    count_groups = count([(doc%groups(i)%name == name, i = 1, size(doc%groups))])
  end function count_groups

  !> All groups called `name`, in the order of the file.
  pure function groups_named(doc, name) result(groups)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: name
    type(group_type), allocatable :: groups(:)
    integer, allocatable :: at(:)
    integer :: i

    allocate(at, source=indices_named(doc, name))
    ! One by one, because gfortran 12 does not free the components of an array section with vector subscripts.
    allocate(groups(size(at)))
    do i = 1, size(at)
      groups(i) = doc%groups(at(i))
    end do
  end function groups_named

  !> Indices of all groups called `name`, in the order of the file.
  pure function indices_named(doc, name) result(at)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: name
    integer, allocatable :: at(:)
    integer :: i

    allocate(at(count_groups(doc, name)))
    at = pack([(i, i = 1, size(doc%groups))], [(doc%groups(i)%name == name, i = 1, size(doc%groups))])
  end function indices_named

  !> Names of the groups, which are the values of their keys `name`; blank for a group without this key.
  pure function group_names(groups) result(names)
    type(group_type), intent(in) :: groups(:)
    character(len=word_length) :: names(size(groups))
    integer :: i

    do i = 1, size(groups)
      names(i) = name_of(groups(i))
    end do
  end function group_names

  !> True if the group contains the key.
  pure logical function has(group, key)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key

    has = find_entry(group, key) > 0
  end function has

  !> Index of the first entry of a key in its group; 0 if the group does not contain the key.
  pure integer function find_entry(group, key) result(found)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key

    do found = 1, size(group%entries)
      if (group%entries(found)%key == key) return
    end do
    found = 0
  end function find_entry

  !> Length of a group's name; 0 if the group has no name.
  pure integer function length_of_name(group) result(length)
    type(group_type), intent(in) :: group
    integer :: i

    length = 0
    i = find_entry(group, "name")
    if (i == 0) return
    if (size(group%entries(i)%values) /= 1) return
    if (allocated(group%entries(i)%values(1)%text)) length = len(group%entries(i)%values(1)%text)
  end function length_of_name

  !> Name of the group, which is the value of its key `name`; empty if the group does not contain this key.
  pure function name_of(group) result(name)
    type(group_type), intent(in) :: group
    character(len=length_of_name(group)) :: name

    if (len(name) > 0) name = group%entries(find_entry(group, "name"))%values(1)%text
  end function name_of

end module gestell_input_namelist_document
