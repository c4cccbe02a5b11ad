!> The joints and links of an input file.
module gestell_io_mechanism
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: text
  use gestell_io_document, only: document_type, group_names, group_type, groups_named, has, name_of, word_length
  use gestell_io_get, only: get, nonnegative, positive
  use gestell_io_message, only: input_error, label, place
  use gestell_io_suggest, only: suggestion
  use gestell_model_linkage, only: linkage_type
  implicit none (type, external)
  private

  public :: in_group, name_line, read_linkage

  !> The types of joints, and the keys that each needs and can have, as words between blanks.
  character(len=*), parameter :: type_names(*) = [character(len=8) :: "ground", "crank", "RRR"]
  character(len=*), parameter :: needed_keys(*) = [character(len=32) :: " position ", " pivot radius ", " ends lengths branch "]
  character(len=*), parameter :: optional_keys(*) = [character(len=32) :: " ", " phase ", " "]

contains

  !> The linkage of a checked document. Errors: keys that do not fit the joint's type, joints that are not there (yet),
  !> names given twice, values out of range.
  subroutine read_linkage(doc, linkage, error)
    type(document_type), intent(in) :: doc
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: joints(:), links(:)
    integer :: i

    joints = groups_named(doc, "joint")
    links = groups_named(doc, "link")
    call check_names(joints, error)
    if (allocated(error)) return
    call check_names(links, error)
    if (allocated(error)) return
    call check_crank(joints, error)
    if (allocated(error)) return
    do i = 1, size(joints)
      call read_joint(joints, i, linkage, error)
      if (allocated(error)) return
    end do
    if (size(links) == 0) then
      call fatal_error(error, doc%file // ": the mechanism has no mass: a group &link is required", &
        & invalid_input)
      return
    end if
    do i = 1, size(links)
      call read_link(links(i), joints, linkage, error)
      if (allocated(error)) return
    end do
  end subroutine read_linkage

  subroutine check_names(groups, error)
    type(group_type), intent(in) :: groups(:)
    type(error_type), allocatable, intent(out) :: error
    integer :: i, j

    do i = 1, size(groups)
      if (name_of(groups(i)) == "") then
        call input_error(groups(i), "name", "must not be empty", error)
        return
      end if
      do j = 1, i - 1
        if (name_of(groups(i)) /= name_of(groups(j))) cycle
        call input_error(groups(i), "name", "is taken already", error)
        return
      end do
    end do
  end subroutine check_names

  !> A mechanism has one crank.
  subroutine check_crank(joints, error)
    type(group_type), intent(in) :: joints(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: type
    logical :: found
    integer :: i

    found = .false.
    do i = 1, size(joints)
      call get(joints(i), "type", type, error, allowed=type_names)
      if (allocated(error)) return
      if (type /= "crank") cycle
      if (found) then
        call input_error(joints(i), "type", "a mechanism has only one crank", error)
        return
      end if
      found = .true.
    end do
    if (.not. found) call fatal_error(error, joints(1)%file // ": no joint has type = 'crank', one must", invalid_input)
  end subroutine check_crank

  !> Joint `i`, built on those before it.
  subroutine read_joint(joints, i, linkage, error)
    type(group_type), intent(in) :: joints(:)
    integer, intent(in) :: i
    type(linkage_type), intent(inout) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    character(len=:), allocatable :: type, pivot
    character(len=word_length), allocatable :: ends(:)
    real(dp) :: position(2), radius, phase, lengths(2)
    integer :: branch

    group = joints(i)
    call get(group, "type", type, error, allowed=type_names)
    if (allocated(error)) return
    call check_keys(group, type, error)
    if (allocated(error)) return

    select case (type)
    case ("ground")
      call get(group, "position", position, error)
      if (allocated(error)) return
      call linkage%ground(name_of(group), position, error)
    case ("crank")
      call get(group, "pivot", pivot, error)
      if (allocated(error)) return
      call check_known(group, "pivot", [pivot], joints, i - 1, error)
      if (allocated(error)) return
      call get(group, "radius", radius, error, must=positive)
      if (allocated(error)) return
      call get(group, "phase", phase, error, default=0.0_dp)
      if (allocated(error)) return
      call linkage%crank(name_of(group), pivot, radius, phase * pi / 180, error)
    case default ! RRR
      call get_ends(joints, i, ends, error)
      if (allocated(error)) return
      call get(group, "lengths", lengths, error, must=positive)
      if (allocated(error)) return
      call get(group, "branch", branch, error)
      if (allocated(error)) return
      if (abs(branch) /= 1) then
        call input_error(group, "branch", "must be 1 or -1", error)
        return
      end if
      call linkage%rrr(name_of(group), ends, lengths, branch, error)
    end select
    if (allocated(error)) call in_group(group, error)
  end subroutine read_joint

  !> The ends of joint `i`: two different earlier joints.
  subroutine get_ends(joints, i, ends, error)
    type(group_type), intent(in) :: joints(:)
    integer, intent(in) :: i
    character(len=word_length), allocatable, intent(out) :: ends(:)
    type(error_type), allocatable, intent(out) :: error

    call get(joints(i), "ends", ends, error)
    if (allocated(error)) return
    if (size(ends) /= 2) then
      call input_error(joints(i), "ends", "needs 2 joints", error)
      return
    end if
    call check_known(joints(i), "ends", ends, joints, i - 1, error)
    if (allocated(error)) return
    if (ends(1) == ends(2)) call input_error(joints(i), "ends", "needs 2 different joints", error)
  end subroutine get_ends

  !> Whether the group has all keys that its type of joint needs and none that it does not know.
  subroutine check_keys(group, type, error)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: type
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: needs, may, rest
    integer :: i, blank

    i = findloc(type_names == type, .true., dim=1)
    needs = trim(needed_keys(i)) // " "
    may = trim(optional_keys(i)) // " "
    do i = 1, size(group%entries)
      associate (key => group%entries(i)%key)
        if (key == "name" .or. key == "type" .or. index(needs // may, " " // key // " ") > 0) cycle
        call input_error(group, key, "a joint of type '" // type // "' has no such key, it has" // &
          & commas(trim(needs) // trim(may)), error)
        return
      end associate
    end do
    rest = adjustl(needs)
    do while (len_trim(rest) > 0)
      blank = index(rest, " ")
      if (.not. has(group, rest(:blank - 1))) then
        call input_error(group, "", "a joint of type '" // type // "' needs the key '" // rest(:blank - 1) // "'", error)
        return
      end if
      rest = adjustl(rest(blank:))
    end do
  end subroutine check_keys

  !> Words between blanks as words between commas.
  pure function commas(words) result(text)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: text
    integer :: i

    text = ""
    do i = 1, len_trim(words)
      if (words(i:i) == " " .and. i > 1) text = text // ","
      text = text // words(i:i)
    end do
  end function commas

  !> Whether all `names` are those of the first `known` of the `joints`.
  subroutine check_known(group, key, names, joints, known, error)
    type(group_type), intent(in) :: group, joints(:)
    character(len=*), intent(in) :: key, names(:)
    integer, intent(in) :: known
    type(error_type), allocatable, intent(out) :: error
    integer :: i, place

    do i = 1, size(names)
      place = findloc(group_names(joints) == names(i), .true., dim=1)
      if (place == 0) then
        call input_error(group, key, "there is no joint '" // trim(names(i)) // "'" // &
          & suggestion(trim(names(i)), group_names(joints(:known))), error)
      else if (place == known + 1) then
        call input_error(group, key, "a joint cannot be built on itself", error)
      else if (place > known) then
        call input_error(group, key, "joint '" // trim(names(i)) // "' stands only in line " // text(joints(place)%line) &
          & // ": list it before this one", error)
      end if
      if (allocated(error)) return
    end do
  end subroutine check_known

  subroutine read_link(group, joints, linkage, error)
    type(group_type), intent(in) :: group, joints(:)
    type(linkage_type), intent(inout) :: linkage
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: from, to
    real(dp) :: mass, inertia, center(2)

    call get(group, "from", from, error)
    if (allocated(error)) return
    call check_known(group, "from", [from], joints, size(joints), error)
    if (allocated(error)) return
    to = ""
    if (has(group, "to")) then
      call get(group, "to", to, error)
      if (allocated(error)) return
      call check_known(group, "to", [to], joints, size(joints), error)
      if (allocated(error)) return
      if (to == from) then
        call input_error(group, "to", "is the joint of from, needs another one", error)
        return
      end if
    end if
    call get(group, "mass", mass, error, must=nonnegative)
    if (allocated(error)) return
    call get(group, "inertia", inertia, error, must=nonnegative)
    if (allocated(error)) return
    call get(group, "center", center, error, default=0.0_dp)
    if (allocated(error)) return
    call linkage%link(name_of(group), from, to, mass, inertia, center, error)
    if (allocated(error)) call in_group(group, error)
  end subroutine read_link

  !> Puts file, line and group in front of an error's message.
  subroutine in_group(group, error)
    type(group_type), intent(in) :: group
    type(error_type), allocatable, intent(inout) :: error

    error%message = place(group%file, group%line) // label(group) // ": " // error%message
  end subroutine in_group

  !> Puts file and line of the joint or link that the error is about in front of its message.
  subroutine name_line(doc, error)
    type(document_type), intent(in) :: doc
    type(error_type), allocatable, intent(inout) :: error
    integer :: i

    if (.not. allocated(error%subject)) return
    do i = 1, size(doc%groups)
      associate (group => doc%groups(i))
        if (group%name // " '" // name_of(group) // "'" /= error%subject) cycle
        error%message = place(group%file, group%line) // error%message
        return
      end associate
    end do
  end subroutine name_line

end module gestell_io_mechanism
