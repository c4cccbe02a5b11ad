!> Reads the position of each mechanism on the frame, its gear ratio to the drive, and the copies of mechanisms.
module gestell_input_machine_mechanisms
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type
  use gestell_base_key, only: key_type, nonzero, of_angle, of_length, real_key, text_key
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_base_words, only: word_length
  use gestell_input_machine_copies, only: add_copies, list_names, members_type
  use gestell_input_namelist_document, only: document_type, group_names, group_type, groups_named, has, name_of
  use gestell_input_namelist_message, only: input_error
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_input_schema_read, only: count_values, read, read_axis_values
  use gestell_input_schema_units, only: units_type
  use gestell_math_rational, only: to_rational
  use gestell_model_joints_driven, only: no_ratio
  use gestell_model_joints_placement, only: placement_type
  implicit none (type, external)
  private

  public :: claim_name, read_members, read_planes

  !> Meanings of keys of &mechanism, and the meaning and default of the same keys of &repeat.
  character(len=*), parameter :: of_origin = "origin of the mechanism's x-y system relative to O (`&frame origin`); " // &
    &   "components along xi, eta (for a frame in space also zeta)", &
    & of_axis = "direction of the crank's axis, which is normal to the mechanism's plane; components along xi, eta, zeta", &
    & of_x_axis = "direction whose projection onto the mechanism's plane is the mechanism's x-axis; components along xi, " // &
    &   "eta, zeta", &
    & of_rotation = "angle by which the mechanism's x-axis is rotated within the mechanism's plane", &
    & of_phase = "angle of the mechanism's crank when the drive's angle is 0", &
    & of_ratio = "turns of the mechanism's crank per turn of the drive, negative if it turns in the opposite direction; a " // &
    &   "number such as 2 or 0.5, or numerator and denominator such as 17,23", as_original = "as the original", &
    & as_there = "as in `&mechanism`"

  type(key_type), parameter, public :: mechanism_keys(*) = [ &
    & key_type("mechanism", "name", text_key, "name by which `&joint`, `&link` and `&repeat` refer to the mechanism", &
    &   required=.true.), &
    & key_type("mechanism", "origin", real_key, of_origin, 1, 2, 3, unit=of_length, default=0.0_dp), &
    & key_type("mechanism", "axis", real_key, of_axis, 1, 3, 3, otherwise="along zeta"), &
    & key_type("mechanism", "x_axis", real_key, of_x_axis, 1, 3, 3, &
    &   otherwise="xi after the shortest rotation that turns zeta into `axis`"), &
    & key_type("mechanism", "angle", real_key, of_rotation, unit=of_angle, default=0.0_dp), &
    & key_type("mechanism", "phase", real_key, of_phase, unit=of_angle, default=0.0_dp), &
    & key_type("mechanism", "ratio", real_key, of_ratio, 1, 1, 2, default=1.0_dp, range=nonzero)]

  type(key_type), parameter, public :: repeat_keys(*) = [ &
    & key_type("repeat", "of", text_key, "name of the mechanism to copy, with all its joints and links", required=.true.), &
    & key_type("repeat", "name", text_key, "name of the copy; a joint or link `B` of the original is called `NAME.B` in the copy", &
    &   required=.true.), &
    & key_type("repeat", "origin", real_key, as_there, 1, 2, 3, unit=of_length, otherwise=as_original), &
    & key_type("repeat", "axis", real_key, as_there, 1, 3, 3, otherwise=as_original), &
    & key_type("repeat", "x_axis", real_key, as_there, 1, 3, 3, otherwise=as_original), &
    & key_type("repeat", "angle", real_key, as_there, unit=of_angle, otherwise=as_original), &
    & key_type("repeat", "phase", real_key, as_there, unit=of_angle, otherwise=as_original), &
    & key_type("repeat", "ratio", real_key, as_there, 1, 1, 2, range=nonzero, otherwise=as_original), &
    & key_type("repeat", "firing", real_key, "angle of the drive by which the loads of the copy lag behind those of the " // &
    &   "original. It decides in which turn of a `cycle` of several turns the copy fires, and must agree with `phase`", &
    &   unit=of_angle, otherwise="from `phase`")]

  type(key_type), parameter, public :: membership_key(2) = [ &
    & key_type("joint", "mechanism", text_key, "name of the mechanism to which the joint belongs, if the input has several " // &
    &   "mechanisms", otherwise="the only one"), &
    & key_type("link", "mechanism", text_key, "name of the mechanism to which the link belongs, if the input has several " // &
    &   "mechanisms", otherwise="that of `from`")]

  type(key_type), parameter :: from_key = key_type("link", "from", text_key, ""), on_key = key_type("load", "on", text_key, "")

  !> A mechanism, or a copy of a mechanism
  type :: placed_mechanism_type
    !> Its name
    character(len=word_length) :: name = ""
    !> For a copy: number of the mechanism that was copied. Otherwise the mechanism's own number
    integer :: original = 0
    !> Position of the mechanism, and its gear ratio to the drive
    type(placement_type) :: placement
    !> Plane of the mechanism, with components along the axes of the frame. `origin`: origin of the plane relative to the frame's
    !> point O (m); `axis`: normal of the plane; `x_axis`: direction of x. If `x_axis` is 0, `plane_axes` chooses this direction
    real(dp) :: origin(3) = 0, axis(3) = [0.0_dp, 0.0_dp, 1.0_dp], x_axis(3) = 0
    !> True if the mechanism has a plane of its own, which is tilted relative to the plane of the frame
    logical :: tilted = .false.
  end type placed_mechanism_type

contains

  !> Reads the joints, links and loads of a checked document, including those of copies. Fails if a mechanism is unknown or has no
  !> joints, or a name is used twice. Also fails if a link is assigned to another mechanism than its joint `from`.
  subroutine read_members(doc, units, joints, links, loads, placements, error)
    type(document_type), intent(in) :: doc
    !> Units of the input
    type(units_type), intent(in) :: units
    !> Joints, links and loads in the order of the document; those of the copies follow. A load on the frame belongs to mechanism 0
    type(members_type), intent(out) :: joints, links, loads
    !> Position of each mechanism. If the input contains no &mechanism, its only mechanism is at the point O of the frame
    type(placement_type), allocatable, intent(out) :: placements(:)
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: mechanisms(:), copies(:)
    type(placed_mechanism_type), allocatable :: parts(:)
    type(members_type) :: originals, original_links
    integer :: i

    call read_placed_mechanisms(doc, units, mechanisms, copies, parts, error)
    if (allocated(error)) return
    call assign_joints(groups_named(doc, "joint"), mechanisms, joints, error)
    if (allocated(error)) return
    do i = 1, size(mechanisms)
      if (any(joints%mechanism == i)) cycle
      call input_error(mechanisms(i), "name", "no joint belongs to this mechanism", error)
      return
    end do
    allocate(links%groups, source=groups_named(doc, "link"))
    call assign_links(joints, links)
    allocate(loads%groups, source=groups_named(doc, "load"))
    call assign_loads(links, loads)
    originals = joints
    original_links = links
    call add_copies(links, (parts%name), (parts%original), originals, copies, error)
    if (.not. allocated(error)) call add_copies(joints, (parts%name), (parts%original), originals, copies, error)
    if (.not. allocated(error)) call add_copies(loads, (parts%name), (parts%original), originals, copies, error, original_links)
    if (allocated(error)) return
    call assign_links(joints, links)
    call check_links(links, (parts%name), error)
    if (allocated(error)) return
    placements = parts%placement
  end subroutine read_members

  !> Reads the planes of those mechanisms whose plane is tilted relative to the frame's plane. Fails under the conditions stated at
  !> `read_placed_mechanisms`.
  subroutine read_planes(doc, units, origins, axes, shaft, error)
    type(document_type), intent(in) :: doc
    !> Units of the input
    type(units_type), intent(in) :: units
    !> `origins`: origin of each plane relative to the frame's point O (m), shape (3, planes). `axes`: for each plane, unit
    !> vectors along x, y and the normal, with components along the axes of the frame, shape (3, 3, planes)
    real(dp), allocatable, intent(out) :: origins(:, :), axes(:, :, :)
    !> Axis of the drive: the normal of the first mechanism with ratio 1; zero if no mechanism has this ratio
    real(dp), intent(out) :: shaft(3)
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: mechanisms(:), copies(:)
    type(placed_mechanism_type), allocatable :: parts(:)
    integer :: i, k

    shaft = 0
    call read_placed_mechanisms(doc, units, mechanisms, copies, parts, error)
    if (allocated(error)) return
    allocate(origins(3, count(parts%tilted)), axes(3, 3, count(parts%tilted)))
    do i = size(parts), 1, -1
      k = parts(i)%placement%plane
      if (parts(i)%placement%ratio == parts(i)%placement%denominator) shaft = parts(i)%axis / norm2(parts(i)%axis)
      if (k > 0) origins(:, k) = parts(i)%origin
      if (k > 0) axes(:, :, k) = plane_axes(parts(i)%axis, parts(i)%x_axis)
    end do
  end subroutine read_planes

  !> Reads the positions of all mechanisms and copies. Fails if a name is missing or used twice, the original of a copy does not
  !> exist, or an axis is the zero vector.
  subroutine read_placed_mechanisms(doc, units, mechanisms, copies, parts, error)
    type(document_type), intent(in) :: doc
    type(units_type), intent(in) :: units
    type(group_type), allocatable, intent(out) :: mechanisms(:), copies(:)
    type(placed_mechanism_type), allocatable, intent(out) :: parts(:)
    type(error_type), allocatable, intent(out) :: error
    type(dictionary_type) :: names
    integer :: i, n, planes

    mechanisms = groups_named(doc, "mechanism")
    copies = groups_named(doc, "repeat")
    n = size(mechanisms)
    allocate(parts(max(1, n) + size(copies)))
    parts(1)%original = 1
    do i = 1, n
      call claim_name(mechanisms(i), names, error)
      if (allocated(error)) return
      parts(i)%name = name_of(mechanisms(i))
      parts(i)%original = i
      call read_placement(mechanisms(i), mechanism_keys, units, parts(i), error)
      if (allocated(error)) return
    end do
    do i = 1, size(copies)
      call claim_name(copies(i), names, error)
      if (.not. allocated(error)) call read_copy(copies(i), units, parts(:n + i - 1), parts(max(1, n) + i), error)
      if (allocated(error)) return
    end do
    ! a mechanism in a tilted plane lies at the origin of this plane
    planes = 0
    do i = 1, size(parts)
      associate (placement => parts(i)%placement)
        placement%plane = 0
        if (parts(i)%tilted) then
          planes = planes + 1
          placement%plane = planes
        else
          placement%origin = parts(i)%origin(:2)
          placement%z = parts(i)%origin(3)
        end if
      end associate
    end do
  end subroutine read_placed_mechanisms

  !> Unit vectors along x, y and the normal of a plane. The direction of x is the projection of `x_axis` on the plane. If `x_axis`
  !> is zero, x is the image of xi under the shortest rotation that maps zeta to the normal.
  pure function plane_axes(axis, x_axis) result(axes)
    real(dp), intent(in) :: axis(3), x_axis(3)
    real(dp) :: axes(3, 3), n(3), x(3)

    n = axis / norm2(axis)
    if (norm2(x_axis) > 0) then
      x = x_axis - dot_product(x_axis, n) * n
    else if (1 + n(3) > epsilon(1.0_dp)) then
      x = [1 - n(1)**2 / (1 + n(3)), -n(1) * n(2) / (1 + n(3)), -n(1)]
    else
      x = [1, 0, 0]
    end if
    x = x / max(norm2(x), tiny(1.0_dp))
    axes(:, 1) = x
    axes(:, 2) = [n(2) * x(3) - n(3) * x(2), n(3) * x(1) - n(1) * x(3), n(1) * x(2) - n(2) * x(1)]
    axes(:, 3) = n
  end function plane_axes

  !> Appends the name of a group to `names`. Fails if the name is empty or already in use.
  subroutine claim_name(group, names, error)
    type(group_type), intent(in) :: group
    type(dictionary_type), intent(inout) :: names
    type(error_type), allocatable, intent(out) :: error

    if (name_of(group) == "") then
      call input_error(group, "name", "must not be empty", error)
    else if (names%position(name_of(group)) > 0) then
      call input_error(group, "name", "is already used", error)
    else
      call names%add(name_of(group))
    end if
  end subroutine claim_name

  !> Reads the keys for the position and the gear ratio of `part`. A component whose key is missing keeps its value. Fails if an
  !> axis is the zero vector or x_axis is normal to the plane.
  subroutine read_placement(group, keys, units, part, error)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: keys(:)
    type(units_type), intent(in) :: units
    type(placed_mechanism_type), intent(inout) :: part
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: upright(3) = [0.0_dp, 0.0_dp, 1.0_dp]
    real(dp) :: axes(3, 3)

    if (has(group, "origin")) call read_axis_values(group, keys, "origin", units, part%origin, error)
    if (has(group, "axis")) call read(group, keys, "axis", part%axis, error)
    if (has(group, "x_axis")) call read(group, keys, "x_axis", part%x_axis, error)
    if (allocated(error)) return
    part%tilted = part%tilted .or. has(group, "axis") .or. has(group, "x_axis")
    if (.not. norm2(part%axis) > 0) then
      call input_error(group, "axis", "must not be the zero vector", error)
      return
    end if
    axes = plane_axes(part%axis, part%x_axis)
    if (.not. norm2(axes(:, 1)) > 0.5_dp .or. norm2(part%x_axis) > 0 .and. .not. &
      & norm2(part%x_axis - dot_product(part%x_axis, axes(:, 3)) * axes(:, 3)) > 1.0e-6_dp * norm2(part%x_axis)) then
      call input_error(group, "x_axis", "must not be normal to the mechanism's plane", error)
      return
    end if
    ! it is the frame's own plane
    if (.not. norm2(axes(:, 3) - upright) > 0 .and. .not. norm2(part%x_axis) > 0) part%tilted = .false.
    if (has(group, "angle")) call read(group, keys, "angle", part%placement%angle, error, units)
    if (has(group, "phase")) call read(group, keys, "phase", part%placement%phase, error, units)
    if (has(group, "ratio")) call read_ratio(group, keys, part%placement, error)
  end subroutine read_placement

  !> Reads the gear ratio of a mechanism. Does nothing if `error` is already allocated. Fails if the ratio is not a permitted
  !> fraction.
  subroutine read_ratio(group, keys, placement, error)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: keys(:)
    type(placement_type), intent(inout) :: placement
    type(error_type), allocatable, intent(inout) :: error
    real(dp) :: numbers(2)
    integer :: n
    logical :: known

    n = count_values(group, "ratio")
    call read(group, keys, "ratio", numbers(:n), error)
    if (allocated(error)) return
    call to_rational(numbers(:n), placement%ratio, placement%denominator, known)
    if (.not. known) call input_error(group, "ratio", no_ratio, error)
  end subroutine read_ratio

  !> Reads a group &repeat, which copies one of the mechanisms or copies in `before`. Fails if `before` does not contain the
  !> original.
  subroutine read_copy(group, units, before, copy, error)
    type(group_type), intent(in) :: group
    type(units_type), intent(in) :: units
    type(placed_mechanism_type), intent(in) :: before(:)
    type(placed_mechanism_type), intent(out) :: copy
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: of
    integer :: i

    call read(group, repeat_keys, "of", of, error)
    if (allocated(error)) return
    i = findloc(before%name == of, .true., dim=1)
    if (size(before) == 0) then
      call input_error(group, "of", "the input has no &mechanism: to copy a mechanism, first give it a name: &mechanism name='" // &
        & of // "' /", error)
    else if (i == 0) then
      call input_error(group, "of", "there is no mechanism '" // of // "' before this group" // suggestion(of, before%name), error)
    end if
    if (allocated(error)) return
    copy = before(i)
    copy%name = name_of(group)
    call read_placement(group, repeat_keys, units, copy, error)
    if (has(group, "firing") .and. .not. allocated(error)) call read_firing(group, units, before(i)%placement, copy%placement, &
      & error)
  end subroutine read_copy

  !> Reads by which angle of the drive the loads of a copy lag behind those of the original, and converts it to whole turns of the
  !> copy's crank. Fails if the copy's crank does not lag by this angle, up to whole turns.
  subroutine read_firing(group, units, original, copy, error)
    type(group_type), intent(in) :: group
    type(units_type), intent(in) :: units
    type(placement_type), intent(in) :: original
    type(placement_type), intent(inout) :: copy
    type(error_type), allocatable, intent(inout) :: error
    real(dp), parameter :: rounding = 1.0e-6_dp
    real(dp) :: firing, turns

    call read(group, repeat_keys, "firing", firing, error, units)
    if (allocated(error)) return
    turns = (original%phase + 2 * pi * original%load_turns - copy%phase - firing * copy%ratio / copy%denominator) / (2 * pi)
    copy%load_turns = nint(turns)
    if (abs(turns - copy%load_turns) <= rounding) return
    call input_error(group, "firing", "does not agree with 'phase': the crank of the copy lags behind that of the original by " &
      & // concise((original%phase - copy%phase) * copy%denominator / copy%ratio * 180 / pi) // " deg", error)
  end subroutine read_firing

  !> Determines for each joint of the document the mechanism to which it belongs.
  subroutine assign_joints(groups, mechanisms, joints, error)
    type(group_type), intent(in) :: groups(:), mechanisms(:)
    type(members_type), intent(out) :: joints
    type(error_type), allocatable, intent(out) :: error
    type(dictionary_type) :: names
    character(len=:), allocatable :: name
    integer :: i

    allocate(joints%groups, source=groups)
    allocate(joints%mechanism(size(groups)), source=1)
    call list_names(mechanisms, names)
    do i = 1, size(groups)
      if (has(groups(i), "mechanism")) then
        call read(groups(i), membership_key(1:1), "mechanism", name, error)
        if (allocated(error)) return
        joints%mechanism(i) = names%position(name)
        if (joints%mechanism(i) > 0) cycle
        if (size(mechanisms) == 0) then
          call input_error(groups(i), "mechanism", "requires a group &mechanism with this name", error)
        else
          call input_error(groups(i), "mechanism", "there is no mechanism '" // name // "'" // suggestion(name, &
            & group_names(mechanisms)), error)
        end if
        return
      else if (size(mechanisms) > 1) then
        call input_error(groups(i), "", "needs the key 'mechanism', because there are " // text(size(mechanisms)) &
          & // " mechanisms", error)
        return
      end if
    end do
  end subroutine assign_joints

  !> Assigns each link to the mechanism of its joint `from`. If this joint is unknown, the link gets the mechanism number 0.
  subroutine assign_links(joints, links)
    type(members_type), intent(in) :: joints
    type(members_type), intent(inout) :: links
    type(dictionary_type) :: names
    character(len=:), allocatable :: from
    type(error_type), allocatable :: none
    integer :: i, k

    if (.not. allocated(links%mechanism)) allocate(links%mechanism(size(links%groups)), source=0)
    call list_names(joints%groups, names)
    do i = 1, size(links%groups)
      if (links%mechanism(i) > 0 .or. .not. has(links%groups(i), "from")) cycle
      call read(links%groups(i), [from_key], "from", from, none)
      k = names%position(from)
      if (k > 0) links%mechanism(i) = joints%mechanism(k)
    end do
  end subroutine assign_links

  !> Assigns each load to the mechanism of its link `on`; 0 if it acts on the frame or the link is unknown.
  subroutine assign_loads(links, loads)
    type(members_type), intent(in) :: links
    type(members_type), intent(inout) :: loads
    type(dictionary_type) :: names
    character(len=:), allocatable :: on
    type(error_type), allocatable :: none
    integer :: i, k

    allocate(loads%mechanism(size(loads%groups)), source=0)
    call list_names(links%groups, names)
    do i = 1, size(loads%groups)
      if (.not. has(loads%groups(i), "on")) cycle
      call read(loads%groups(i), [on_key], "on", on, none)
      k = names%position(on)
      if (k > 0) loads%mechanism(i) = links%mechanism(k)
    end do
  end subroutine assign_loads

  !> Fails if the key `mechanism` of a link names a mechanism to which the link's joint `from` does not belong. Unknown joints are
  !> not reported here, but by `read_link`.
  subroutine check_links(links, names, error)
    type(members_type), intent(inout) :: links
    character(len=*), intent(in) :: names(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: name
    integer :: i

    do i = 1, size(links%groups)
      links%mechanism(i) = max(links%mechanism(i), 1)
      if (.not. has(links%groups(i), "mechanism")) cycle
      call read(links%groups(i), membership_key(2:2), "mechanism", name, error)
      if (allocated(error)) return
      if (name == names(links%mechanism(i))) cycle
      call input_error(links%groups(i), "mechanism", "must be '" // trim(names(links%mechanism(i))) // "', the mechanism of " &
        & // "the joint in 'from'", error)
      return
    end do
  end subroutine check_links

end module gestell_input_machine_mechanisms
