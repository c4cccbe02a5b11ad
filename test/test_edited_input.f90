!> Changing values and removing groups in the text of an input: what is read afterwards differs from what was read before only in
!> these values or groups.
module test_edited_input
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_input_namelist, only: parse_document
  use gestell_input_namelist_document, only: document_type, entry_type, group_type
  use gestell_input_namelist_edit, only: remove_group, set_entry, spell_entry
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_edited_input

  character, parameter :: nl = new_line("a")
  !> Quotes and comments contain what begins and ends groups; one key is given element by element.
  character(len=*), parameter :: text = &
    & "! before & all /" // nl // &
    & "&case title='a / b & c''s', tasks='design' /   ! & comment /" // nl // &
    & "&joint name='A', position=0,0 / &joint name='B',   ! stiffness=1" // nl // &
    & "  position=1,   ! first / &" // nl // &
    & "  2, lengths=3,4 /" // nl // &
    & "&support stiffness(1)=5, position=0,1, ! by elements" // nl // &
    & "  stiffness(2)=6 /" // nl // &
    & "&probe position(1)=1 , position(2)=2" // nl // "  , name='p' /" // nl // &
    & "&frame mass=1" // nl // &
    & "/" // nl

contains

  subroutine collect_edited_input(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a changed input yields the new value, and all others as before", test_every_key), &
      & new_unittest("a text without one of its groups yields all other groups as before", test_every_group), &
      & new_unittest("spelled entries are read as the same elements, missing ones included", test_spelling)]
  end subroutine collect_edited_input

  !> Every key of every group, and a key that the group does not have yet.
  subroutine test_every_key(error)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: before
    type(gestell_error), allocatable :: failure
    integer :: g, k

    call parse_document(text, "in.nml", before, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do g = 1, size(before%groups)
      do k = 1, size(before%groups(g)%entries)
        call check_edit(before, g, before%groups(g)%entries(k)%key, error)
        if (allocated(error)) return
      end do
      call check_edit(before, g, "extra", error)
      if (allocated(error)) return
    end do
  end subroutine test_every_key

  !> Every group. Also compares two whole texts: of a group in a line of its own, and of one that shares its line.
  subroutine test_every_group(error)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: before, after
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: edited
    integer :: removed, g

    call parse_document(text, "in.nml", before, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do removed = 1, size(before%groups)
      edited = text
      call remove_group(edited, removed)
      call parse_document(edited, "in.nml", after, failure)
      call check_success(error, failure, edited)
      if (allocated(error)) return
      call check_that(error, size(after%groups), "==", size(before%groups) - 1, "groups of " // edited)
      if (allocated(error)) return
      do g = 1, size(after%groups)
        call check_that(error, values_of(after%groups(g), "", .false.), "==", values_of(before%groups(merge(g, g + 1, &
          & g < removed)), "", .false.), "other groups in " // edited)
        if (allocated(error)) return
      end do
    end do
    edited = "! a" // nl // "&case title='/ &'" // nl // "/ " // nl // "&drive /! c" // nl // "&frame / &model /"
    call remove_group(edited, 1)
    call check_that(error, edited, "==", "! a" // nl // "&drive /! c" // nl // "&frame / &model /", "text")
    if (allocated(error)) return
    call remove_group(edited, 1)
    call remove_group(edited, 2)
    call check_that(error, edited, "==", "! a" // nl // "! c" // nl // "&frame / ", "text")
    if (allocated(error)) return
    call remove_group(edited, 1)
    call check_that(error, edited, "==", "! a" // nl // "! c" // nl, "text")
  end subroutine test_every_group

  !> Whole lists, and lists in which the first element, an element in the middle, or elements of a matrix are missing.
  subroutine test_spelling(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: input = "&a k=1 / &a k=1,2 / &a k(2)=3 / &a k(1)=1, k(3)=3 / &a k(2,2)=5 / " &
      & // "&a k(1,1)=1, k(2,1)=2, k(3,1)=3 / &a k='it''s', '/ &', 'x' / &a k(2)='7' / &a k(1)=1, k(2)=2 /"
    type(document_type) :: before, after
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: words
    integer :: g, i

    call parse_document(input, "in.nml", before, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do g = 1, size(before%groups)
      call spell_entry(before%groups(g)%entries(1), words)
      call parse_document("&a " // words // " /", "in.nml", after, failure)
      call check_success(error, failure, words)
      if (allocated(error)) return
      associate (old => before%groups(g)%entries(1), new => after%groups(1)%entries(1))
        call check_that(error, new%key, "==", "k", words)
        call check_that(error, count([(allocated(new%values(i)%text), i = 1, size(new%values))]), "==", &
          & count([(allocated(old%values(i)%text), i = 1, size(old%values))]), "number of elements in " // words)
        do i = 1, size(old%values)
          if (.not. allocated(old%values(i)%text) .or. allocated(error)) cycle
          call check_that(error, size(new%values) >= i, "==", .true., "elements of " // words)
          if (allocated(error)) return
          call check_that(error, allocated(new%values(i)%text), "==", .true., "an element of " // words)
          if (allocated(error)) return
          call check_that(error, new%values(i)%text, "==", old%values(i)%text, words)
          call check_that(error, new%values(i)%quoted, "==", old%values(i)%quoted, "quotes of " // words)
        end do
      end associate
    end do
  end subroutine test_spelling

  subroutine check_edit(before, group, key, error)
    type(document_type), intent(in) :: before
    integer, intent(in) :: group
    character(len=*), intent(in) :: key
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: remark = "changed by the test"
    type(document_type) :: after
    type(entry_type) :: entry
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: edited
    integer :: g

    entry%key = key
    allocate(entry%values(2))
    entry%values(1)%text = "7.5"
    entry%values(2)%text = "it's / &"
    entry%values(2)%quoted = .true.
    edited = text
    call set_entry(edited, group, entry, remark)
    call parse_document(edited, "in.nml", after, failure)
    call check_success(error, failure, edited)
    if (allocated(error)) return
    call check_that(error, size(after%groups), "==", size(before%groups), "groups of " // edited)
    do g = 1, size(before%groups)
      if (allocated(error)) return
      if (g == group) then
        call check_that(error, values_of(after%groups(g), key, .true.), "==", " [7.5] [it's / &]", "new value in " // edited)
        call check_that(error, values_of(after%groups(g), key, .false.), "==", values_of(before%groups(g), key, .false.), &
          & "other keys in " // edited)
      else
        call check_that(error, values_of(after%groups(g), "", .false.), "==", values_of(before%groups(g), "", .false.), &
          & "other groups in " // edited)
      end if
    end do
    ! The rest of the text remains, comments included, and the remark is a comment.
    call check_that(error, index(edited, "! before & all /"), "==", 1, "first comment")
    call check_that(error, edited, "contains", remark, "remark")
    call check_that(error, count([(edited(g:g) == "!", g = 1, len(edited))]), ">=", count([(text(g:g) == "!", g = 1, len(text))]), &
      & "comments in " // edited)
  end subroutine check_edit

  !> Values of a group, each in brackets: of one `key` only, or of all other keys with their names.
  function values_of(group, key, of_key) result(words)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    logical, intent(in) :: of_key
    character(len=:), allocatable :: words
    integer :: i, k

    words = ""
    do i = 1, size(group%entries)
      if ((group%entries(i)%key == key) .neqv. of_key) cycle
      if (.not. of_key) words = words // " " // group%entries(i)%key
      do k = 1, size(group%entries(i)%values)
        words = words // " [" // group%entries(i)%values(k)%text // "]"
      end do
    end do
  end function values_of

end module test_edited_input
