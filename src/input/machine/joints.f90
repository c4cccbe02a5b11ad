!> The joints of an input file, each by its type.
module gestell_input_machine_joints
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type
  use gestell_base_key, only: integer_key, key_type, of_angle, of_length, positive, real_key, text_key
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: text
  use gestell_input_namelist_document, only: group_names, group_type, has, name_of, word_length
  use gestell_input_schema_read, only: read
  use gestell_input_namelist_message, only: in_group, input_error
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_input_schema_units, only: units_type
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_linkage, only: linkage_type
  implicit none (type, external)
  private

  public :: check_known, read_joint

  !> The types of joints, and the keys that each needs and can have, as words between blanks.
  character(len=*), parameter :: joint_types(*) = [character(len=6) :: &
    & "ground", "crank", "RRR", "RRP", "RPR", "rigid", "PRP", "RPP"]
  character(len=*), parameter :: guide_keys = " guide guide_point guide_angle "
  character(len=*), parameter :: needed_keys(*) = [character(len=24) :: " position ", " pivot radius ", &
    & " ends lengths branch ", " ends lengths branch ", " ends lengths branch ", " ends offset ", " ", " ends slot_angle "]
  character(len=*), parameter :: optional_keys(*) = [character(len=64) :: " ", " phase ", " ", guide_keys, " ", " ", &
    & guide_keys // "guide2 guide2_point guide2_angle ", guide_keys]
  type(key_type), parameter, public :: joint_keys(*) = [ &
    & key_type("joint", "name", text_key, "what other groups call it", required=.true.), &
    & key_type("joint", "type", text_key, "one of those below", required=.true., &
    &   words="ground, crank, RRR, RRP, RPR, rigid, PRP, RPP"), &
    & key_type("joint", "position", real_key, "where it is", 1, 2, 2, unit=of_length), &
    & key_type("joint", "pivot", text_key, "the joint about which a crank turns"), &
    & key_type("joint", "radius", real_key, "of a crank", unit=of_length, range=positive), &
    & key_type("joint", "phase", real_key, "of a crank", unit=of_angle, default=0.0_dp), &
    & key_type("joint", "ends", text_key, "joints", 1, 1, 2), &
    & key_type("joint", "lengths", real_key, "lengths", 1, 1, 2, unit=of_length, range=positive), &
    & key_type("joint", "branch", integer_key, "1 or -1"), &
    & key_type("joint", "guide_point", real_key, "p", 1, 2, 2, unit=of_length), &
    & key_type("joint", "guide_angle", real_key, "p", unit=of_angle), &
    & key_type("joint", "guide", text_key, "p", 1, 2, 2), &
    & key_type("joint", "guide2_point", real_key, "p", 1, 2, 2, unit=of_length), &
    & key_type("joint", "guide2_angle", real_key, "p", unit=of_angle), &
    & key_type("joint", "guide2", text_key, "p", 1, 2, 2), &
    & key_type("joint", "slot_angle", real_key, "p", unit=of_angle), &
    & key_type("joint", "offset", real_key, "p", 1, 2, 2, unit=of_length)]
  !> Lines at a smaller angle (rad) are parallel.
  real(dp), parameter :: parallel = 1.0e-9_dp

contains

  !> Adds joint `i` of `joints`, whose names are `names`, to the linkage, built on those before it.
  !> Errors: keys that do not fit the joint's type, joints that are not there (yet), values out of range.
  subroutine read_joint(joints, names, i, units, linkage, error)
    type(group_type), intent(in) :: joints(:)
    type(dictionary_type), intent(in) :: names
    integer, intent(in) :: i
    type(units_type), intent(in) :: units
    type(linkage_type), intent(inout) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    character(len=:), allocatable :: type, pivot
    character(len=word_length), allocatable :: ends(:)
    type(guide_type) :: guides(2)
    real(dp) :: position(2), radius, angle, lengths(2)
    integer :: branch

    group = joints(i)
    call read(group, joint_keys, "type", type, error)
    if (.not. allocated(error)) call check_keys(group, type, error)
    if (allocated(error)) return

    select case (type)
    case ("ground")
      call read(group, joint_keys, "position", position, error, units)
      if (allocated(error)) return
      call linkage%ground(name_of(group), position, error)
    case ("crank")
      call read(group, joint_keys, "pivot", pivot, error)
      if (.not. allocated(error)) call check_known(group, "pivot", [pivot], joints, names, i - 1, error)
      if (.not. allocated(error)) call read(group, joint_keys, "radius", radius, error, units)
      if (.not. allocated(error)) call read(group, joint_keys, "phase", angle, error, units, default=0.0_dp)
      if (allocated(error)) return
      if (abs(angle) > 2 * pi) angle = modulo(angle, 2 * pi)
      call linkage%crank(name_of(group), pivot, radius, angle, error)
    case ("RRR")
      call get_ends(joints, names, i, 2, ends, error)
      if (.not. allocated(error)) call read(group, joint_keys, "lengths", lengths, error, units)
      if (.not. allocated(error)) call get_branch(group, branch, error)
      if (allocated(error)) return
      call linkage%rrr(name_of(group), ends, lengths, branch, error)
    case ("RRP")
      call get_ends(joints, names, i, 1, ends, error)
      if (.not. allocated(error)) call read(group, joint_keys, "lengths", lengths(:1), error, units)
      if (.not. allocated(error)) call get_branch(group, branch, error)
      if (.not. allocated(error)) call get_guide(joints, names, i, "guide", units, linkage, guides(1), error)
      if (allocated(error)) return
      call linkage%rrp(name_of(group), ends(1), lengths(1), guides(1), branch, error)
    case ("RPR")
      call get_ends(joints, names, i, 2, ends, error)
      if (.not. allocated(error)) call read(group, joint_keys, "lengths", lengths(:1), error, units)
      if (.not. allocated(error)) call get_branch(group, branch, error)
      if (allocated(error)) return
      call linkage%rpr(name_of(group), ends, lengths(1), branch, error)
    case ("rigid")
      call get_ends(joints, names, i, 2, ends, error)
      if (.not. allocated(error)) call read(group, joint_keys, "offset", position, error, units)
      if (allocated(error)) return
      call linkage%rigid(name_of(group), ends, position, error)
    case ("PRP")
      call get_guide(joints, names, i, "guide", units, linkage, guides(1), error)
      if (.not. allocated(error)) call get_guide(joints, names, i, "guide2", units, linkage, guides(2), error)
      if (allocated(error)) return
      if (all(guides(1)%carriers == guides(2)%carriers) .and. &
        & abs(sin(guides(1)%angle - guides(2)%angle)) < parallel) then
        call input_error(group, "", "its two guides are parallel", error)
        return
      end if
      call linkage%prp(name_of(group), guides, error)
    case default ! RPP
      call get_ends(joints, names, i, 1, ends, error)
      if (.not. allocated(error)) call get_guide(joints, names, i, "guide", units, linkage, guides(1), error)
      if (.not. allocated(error)) call read(group, joint_keys, "slot_angle", angle, error, units)
      if (allocated(error)) return
      if (abs(sin(angle)) < parallel) then
        call input_error(group, "slot_angle", "the slot is parallel to the guide", error)
        return
      end if
      call linkage%rpp(name_of(group), ends(1), guides(1), angle, error)
    end select
    if (allocated(error)) call in_group(group, error)
  end subroutine read_joint

  !> The ends of joint `i`: a number of different earlier joints.
  subroutine get_ends(joints, names, i, number, ends, error)
    type(group_type), intent(in) :: joints(:)
    type(dictionary_type), intent(in) :: names
    integer, intent(in) :: i, number
    character(len=word_length), allocatable, intent(out) :: ends(:)
    type(error_type), allocatable, intent(out) :: error

    call read(joints(i), joint_keys, "ends", ends, error)
    if (allocated(error)) return
    if (size(ends) /= number) then
      call input_error(joints(i), "ends", "needs " // trim(merge("1 joint ", "2 joints", number == 1)), error)
      return
    end if
    call check_known(joints(i), "ends", ends, joints, names, i - 1, error)
    if (allocated(error) .or. number == 1) return
    if (ends(1) == ends(2)) call input_error(joints(i), "ends", "needs 2 different joints", error)
  end subroutine get_ends

  subroutine get_branch(group, branch, error)
    type(group_type), intent(in) :: group
    integer, intent(out) :: branch
    type(error_type), allocatable, intent(out) :: error

    call read(group, joint_keys, "branch", branch, error)
    if (allocated(error)) return
    if (abs(branch) /= 1) call input_error(group, "branch", "must be 1 or -1", error)
  end subroutine get_branch

  !> A guide of joint `i` by the keys `key`, `key`_point and `key`_angle: carried by two joints, or fixed, by its point
  !> and angle.
  subroutine get_guide(joints, names, i, key, units, linkage, guide, error)
    type(group_type), intent(in) :: joints(:)
    type(dictionary_type), intent(in) :: names
    integer, intent(in) :: i
    character(len=*), intent(in) :: key
    type(units_type), intent(in) :: units
    type(linkage_type), intent(in) :: linkage
    type(guide_type), intent(out) :: guide
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: carriers(:)
    real(dp) :: point(2), angle

    if (.not. has(joints(i), key)) then
      if (.not. (has(joints(i), key // "_point") .and. has(joints(i), key // "_angle"))) then
        call input_error(joints(i), "", "needs the keys '" // key // "_point' and '" // key // "_angle' of a fixed guide, or '" &
          & // key // "' of a guide between two joints", error)
        return
      end if
      call read(joints(i), joint_keys, key // "_point", guide%point, error, units)
      if (.not. allocated(error)) call read(joints(i), joint_keys, key // "_angle", guide%angle, error, units)
      return
    end if
    call read(joints(i), joint_keys, key, carriers, error)
    if (.not. allocated(error)) call check_known(joints(i), key, carriers, joints, names, i - 1, error)
    if (.not. allocated(error)) call read(joints(i), joint_keys, key // "_point", point, error, units, default=0.0_dp)
    if (.not. allocated(error)) call read(joints(i), joint_keys, key // "_angle", angle, error, units, default=0.0_dp)
    if (allocated(error)) return
    if (carriers(1) == carriers(2)) then
      call input_error(joints(i), key, "needs 2 different joints", error)
    else
      call linkage%moving_guide(carriers, point, angle, guide, error)
      if (allocated(error)) call in_group(joints(i), error)
    end if
  end subroutine get_guide

  !> Whether the group has all keys that its type of joint needs and none that it does not know.
  subroutine check_keys(group, type, error)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: type
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: needs, may, rest
    integer :: i, blank

    i = findloc(joint_types == type, .true., dim=1)
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

  !> Whether all `wanted` are among the first `known` of the `joints`, whose names are `names`.
  subroutine check_known(group, key, wanted, joints, names, known, error)
    type(group_type), intent(in) :: group, joints(:)
    character(len=*), intent(in) :: key, wanted(:)
    type(dictionary_type), intent(in) :: names
    integer, intent(in) :: known
    type(error_type), allocatable, intent(out) :: error
    integer :: i, place

    do i = 1, size(wanted)
      place = names%place(wanted(i))
      if (place == 0) then
        call input_error(group, key, "there is no joint '" // trim(wanted(i)) // "'" // &
          & suggestion(trim(wanted(i)), group_names(joints(:known))), error)
      else if (place == known + 1) then
        call input_error(group, key, "a joint cannot be built on itself", error)
      else if (place > known .and. builds_on(joints, place, known + 1)) then
        call input_error(group, key, "joint '" // trim(wanted(i)) // "' in line " // text(joints(place)%line) // " is built on '" &
          & // name_of(group) // "' in turn: joints that hold each other make a triad (Assur group of class III) or a larger " &
          & // "group, and only dyads are built in, two links at a time", error)
      else if (place > known) then
        call input_error(group, key, "joint '" // trim(wanted(i)) // "' stands only in line " // text(joints(place)%line) &
          & // ": list it before this one", error)
      end if
      if (allocated(error)) return
    end do
  end subroutine check_known

  !> Whether joint `i` is built on joint `target`, directly or by way of others; not where there is no such joint.
  logical function builds_on(joints, i, target)
    type(group_type), intent(in) :: joints(:)
    integer, intent(in) :: i, target
    logical :: found(size(joints)), done(size(joints))
    integer :: k

    builds_on = .false.
    if (i < 1 .or. target > size(joints)) return
    found = [(k == i, k = 1, size(joints))]
    done = .false.
    do while (any(found .and. .not. done))
      k = findloc(found .and. .not. done, .true., dim=1)
      done(k) = .true.
      found = found .or. carriers_of(joints, k)
    end do
    builds_on = found(target)
  end function builds_on

  !> The joints that joint `i` names.
  function carriers_of(joints, i) result(named)
    type(group_type), intent(in) :: joints(:)
    integer, intent(in) :: i
    logical :: named(size(joints))
    character(len=*), parameter :: keys(*) = [character(len=6) :: "pivot", "ends", "guide", "guide2"]
    character(len=word_length), allocatable :: names(:)
    type(error_type), allocatable :: none
    integer :: k, n

    named = .false.
    do k = 1, size(keys)
      if (.not. has(joints(i), trim(keys(k)))) cycle
      call read(joints(i), joint_keys, trim(keys(k)), names, none)
      if (allocated(none)) cycle
      do n = 1, size(names)
        named = named .or. group_names(joints) == names(n)
      end do
    end do
  end function carriers_of

end module gestell_input_machine_joints
