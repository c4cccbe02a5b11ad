!> Copies mechanisms as requested by the groups &repeat. The joints, links and loads of each copy receive names of their own.
module gestell_input_machine_copies
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type
  use gestell_base_text, only: text
  use gestell_base_words, only: character_count, longest_name
  use gestell_input_namelist_document, only: group_type, name_of
  use gestell_input_namelist_message, only: input_error
  implicit none (type, external)
  private

  public :: add_copies, list_names

  !> Joints, links or loads of the input, including those of copied mechanisms
  type, public :: members_type
    type(group_type), allocatable :: groups(:)
    !> For each joint, link or load: number of the mechanism, or copy of a mechanism, to which it belongs
    integer, allocatable :: mechanism(:)
  end type members_type

contains

  !> Returns the names of groups, in the order of the groups.
  pure subroutine list_names(groups, names)
    type(group_type), intent(in) :: groups(:)
    type(dictionary_type), intent(out) :: names
    integer :: i

    do i = 1, size(groups)
      call names%add(name_of(groups(i)))
    end do
  end subroutine list_names

  !> Adds the joints, links or loads of each copied mechanism (&repeat). In a copy called PART, the copy of joint, link or load NAME
  !> is called PART.NAME, and its keys refer to joints and links of the copy. Fails if a name becomes too long.
  subroutine add_copies(members, parts, originals, joints, copies, error, links)
    !> Joints, links or loads of the input, to which the procedure appends those of the copies
    type(members_type), intent(inout) :: members
    !> Names of all mechanisms, then names of all copies
    character(len=*), intent(in) :: parts(:)
    !> For each mechanism: its own number. For each copy: number of the mechanism that was copied, directly or through another
    !> copy
    integer, intent(in) :: originals(:)
    !> Joints of the mechanisms that are copied
    type(members_type), intent(in) :: joints
    !> The groups &repeat
    type(group_type), intent(in) :: copies(:)
    type(error_type), allocatable, intent(out) :: error
    !> Links of the mechanisms that are copied; required if `members` are loads
    type(members_type), intent(in), optional :: links
    type(group_type), allocatable :: longer(:)
    type(dictionary_type) :: names, link_names
    integer, allocatable :: mechanism(:)
    integer :: first, c, i, n

    call list_names(joints%groups, names)
    if (present(links)) call list_names(links%groups, link_names)
    first = size(parts) - size(copies)
    n = size(members%groups)
    allocate(longer(n + sum([(count(members%mechanism == originals(first + c)), c = 1, size(copies))])))
    longer(:n) = members%groups
    allocate(mechanism(size(longer)))
    mechanism(:n) = members%mechanism
    do c = 1, size(copies)
      do i = 1, size(members%groups)
        if (members%mechanism(i) /= originals(first + c)) cycle
        n = n + 1
        longer(n) = members%groups(i)
        mechanism(n) = first + c
        call rename(longer(n), trim(parts(first + c)), originals(first + c), joints, names, copies(c), error)
        if (present(links) .and. .not. allocated(error)) call rename(longer(n), trim(parts(first + c)), originals(first + c), &
          & links, link_names, copies(c), error, .true.)
        if (allocated(error)) return
      end do
    end do
    call move_alloc(longer, members%groups)
    call move_alloc(mechanism, members%mechanism)
  end subroutine add_copies

  !> Converts `member`, a joint, link or load of mechanism `original`, to that of the copy called `part`: renames it, and the joints
  !> to which its keys refer. Fails if a name becomes too long.
  subroutine rename(member, part, original, joints, names, copy, error, only_bodies)
    type(group_type), intent(inout) :: member
    character(len=*), intent(in) :: part
    integer, intent(in) :: original
    type(members_type), intent(in) :: joints
    type(dictionary_type), intent(in) :: names
    type(group_type), intent(in) :: copy
    type(error_type), allocatable, intent(out) :: error
    !> Present: `joints` and `names` are those of links, and only the bodies of a load are renamed
    logical, intent(in), optional :: only_bodies
    character(len=13), parameter :: words(6) = [character(len=13) :: "type", "mechanism", "law", "axes", "interpolation", &
      & "table"], bodies(2) = [character(len=13) :: "on", "against"]
    integer :: e, v, k

    do e = 1, size(member%entries)
      associate (entry => member%entries(e))
        if (any(bodies == entry%key) .neqv. present(only_bodies)) cycle
        if (entry%key == "mechanism") entry%values(1)%text = part
        if (any(words == entry%key)) cycle
        do v = 1, size(entry%values)
          if (.not. entry%values(v)%quoted) cycle
          if (entry%key /= "name") then
            k = names%position(entry%values(v)%text)
            if (k == 0) cycle
            if (joints%mechanism(k) /= original) cycle
          end if
          entry%values(v)%text = part // "." // entry%values(v)%text
          if (character_count(entry%values(v)%text) <= longest_name) cycle
          call input_error(copy, "name", "makes the name '" // entry%values(v)%text // "' longer than " // text(longest_name) &
            & // " characters", error)
          return
        end do
      end associate
    end do
  end subroutine rename

end module gestell_input_machine_copies
