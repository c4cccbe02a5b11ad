!> Content of an input file: groups with their keys and values. Each value records where it came from.
module gestell_input_namelist_document
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  implicit none (type, external)
  private

  public :: value_type, entry_type, group_type, document_type
  public :: group_named, count_groups, groups_named, indices_named, group_names, name_of, has, find_entry

  !> A value as typed
  type :: value_type
    !> The value as text; unallocated if this element of a vector or matrix is not given
    character(len=:), allocatable :: text
    !> True if the value was typed in quotes. `text` does not contain the quotes
    logical :: quoted = .false.
    !> The number that `text` represents; set when the document is normalised
    real(dp) :: number = 0
    !> Repeat count, as in 3*1.0
    integer :: count = 1
    !> Line of the value's key in the file
    integer :: line = 0
    !> Replaces file and line in messages if the value does not come from the file
    character(len=:), allocatable :: origin
  end type value_type

  !> A key and its values. A normalised document has one entry for each key, its values ordered column by column
  type :: entry_type
    character(len=:), allocatable :: key
    !> Line of the key in the file
    integer :: line = 0
    !> Subscripts as typed; empty in a normalised document
    integer, allocatable :: subscript(:)
    type(value_type), allocatable :: values(:)
    !> Number of subscripts of an element
    integer :: rank = 0
    !> Number of rows of a matrix
    integer :: rows = 1
  end type entry_type

  !> One group `&name ... /`
  type :: group_type
    character(len=:), allocatable :: name
    !> Name of the file in messages
    character(len=:), allocatable :: file
    !> Line of the group in the file
    integer :: line = 0
    !> Number of the group among those of the same name; 0 if it is the only one
    integer :: number = 0
    type(entry_type), allocatable :: entries(:)
  end type group_type

  !> All groups of a file in their order
  type :: document_type
    !> Name of the file in messages
    character(len=:), allocatable :: file
    !> Full path of the file; unallocated if the input was no file
    character(len=:), allocatable :: path
    !> The complete text with comments; unallocated if groups were added in code
    character(len=:), allocatable :: text
    type(group_type), allocatable :: groups(:)
    !> True if all keys have been checked and merged as the schema requires
    logical :: normalised = .false.
  end type document_type

contains

  !> Returns the group of this name, or an empty group if the file has none. Use it for groups that may occur only once.
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

  !> Number of groups of this name. It does not call `groups_named`, because gfortran 12 does not free function results within an
  !> expression.
  pure integer function count_groups(doc, name)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: name
    integer :: i

    count_groups = count([(doc%groups(i)%name == name, i = 1, size(doc%groups))])
  end function count_groups

  !> All groups of this name in the order of the file.
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

  !> Indices of all groups of this name in the order of the file.
  pure function indices_named(doc, name) result(at)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: name
    integer, allocatable :: at(:)
    integer :: i

    allocate(at(count_groups(doc, name)))
    at = pack([(i, i = 1, size(doc%groups))], [(doc%groups(i)%name == name, i = 1, size(doc%groups))])
  end function indices_named

  !> Names of the groups (values of their key `name`); blank for a group without a name.
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

  !> Index of the first entry of a key in its group; 0 if the key is missing.
  pure integer function find_entry(group, key) result(found)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key

    do found = 1, size(group%entries)
      if (group%entries(found)%key == key) return
    end do
    found = 0
  end function find_entry

  !> Name of the group (value of its key `name`); empty if it has none.
  pure function name_of(group) result(name)
    type(group_type), intent(in) :: group
    character(len=:), allocatable :: name
    integer :: i

    name = ""
    i = find_entry(group, "name")
    if (i == 0) return
    if (size(group%entries(i)%values) /= 1) return
    if (allocated(group%entries(i)%values(1)%text)) name = group%entries(i)%values(1)%text
  end function name_of

end module gestell_input_namelist_document
