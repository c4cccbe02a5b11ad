!> The content of an input file: groups with their keys, and where each value came from.
module gestell_input_namelist_document
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  implicit none (type, external)
  private

  public :: value_type, entry_type, group_type, document_type
  public :: the_group, count_groups, groups_named, indices_named, group_names, name_of, has, find_entry

  !> One value as it was typed.
  type :: value_type
    !> Unallocated: this element of a vector is not given.
    character(len=:), allocatable :: text
    logical :: quoted = .false.
    !> The number that `text` spells, in a document in the schema's form.
    real(dp) :: number = 0
    !> Repeat count, as in 3*1.0.
    integer :: count = 1
    !> Line of the value's key.
    integer :: line = 0
    !> Stands in messages in place of file and line where the value is not from the file.
    character(len=:), allocatable :: origin
  end type value_type

  !> A key and its values; in a checked document one entry a key, `values` in Fortran's order of elements.
  type :: entry_type
    character(len=:), allocatable :: key
    integer :: line = 0
    !> Subscripts as typed; of size zero in a checked document.
    integer, allocatable :: subscript(:)
    type(value_type), allocatable :: values(:)
    !> Number of subscripts an element has.
    integer :: rank = 0
    !> First dimension of a matrix.
    integer :: rows = 1
  end type entry_type

  !> One group `&name ... /`.
  type :: group_type
    character(len=:), allocatable :: name
    character(len=:), allocatable :: file
    integer :: line = 0
    !> Counts the groups of the same name; zero where it is the only one.
    integer :: number = 0
    type(entry_type), allocatable :: entries(:)
  end type group_type

  !> All groups of a file, in the file's order.
  type :: document_type
    character(len=:), allocatable :: file
    !> The full path of the file that was read; not allocated where none was.
    character(len=:), allocatable :: path
    !> All that was typed, comments too, where the document is that of a text.
    character(len=:), allocatable :: text
    type(group_type), allocatable :: groups(:)
    !> Whether the keys are known to follow the schema.
    logical :: normalised = .false.
  end type document_type

contains

  !> The group of a name that occurs at most once; an empty one where the file has none.
  pure function the_group(doc, name) result(group)
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
  end function the_group

  !> How many groups of a name there are. (The size of `groups_named` would leave them to nobody: gfortran 12 does not free what a
  !> function gives to an expression.)
  pure integer function count_groups(doc, name)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: name
    integer :: i

    count_groups = count([(doc%groups(i)%name == name, i = 1, size(doc%groups))])
  end function count_groups

  !> All groups of a name, in the file's order.
  pure function groups_named(doc, name) result(groups)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: name
    type(group_type), allocatable :: groups(:)
    integer, allocatable :: at(:)
    integer :: i

    allocate(at, source=indices_named(doc, name))
    ! One by one: gfortran 12 does not free what a section by a list of indices has allocated.
    allocate(groups(size(at)))
    do i = 1, size(at)
      groups(i) = doc%groups(at(i))
    end do
  end function groups_named

  !> The places of all groups of a name, in the file's order.
  pure function indices_named(doc, name) result(at)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: name
    integer, allocatable :: at(:)
    integer :: i

    allocate(at(count_groups(doc, name)))
    at = pack([(i, i = 1, size(doc%groups))], [(doc%groups(i)%name == name, i = 1, size(doc%groups))])
  end function indices_named

  !> The values of the groups' key `name`, blank where a group has none.
  pure function group_names(groups) result(names)
    type(group_type), intent(in) :: groups(:)
    character(len=word_length) :: names(size(groups))
    integer :: i

    do i = 1, size(groups)
      names(i) = name_of(groups(i))
    end do
  end function group_names

  !> Whether a group has a key.
  pure logical function has(group, key)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key

    has = find_entry(group, key) > 0
  end function has

  !> Index of a key's (first) entry in its group, zero where it is missing.
  pure integer function find_entry(group, key) result(found)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key

    do found = 1, size(group%entries)
      if (group%entries(found)%key == key) return
    end do
    found = 0
  end function find_entry

  !> The value of a group's key `name`, empty where it has none.
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
