!> Reads the mechanism from an input file: either joints and links, or mass functions.
module gestell_input_machine_mechanism
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_key, only: key_type, nonnegative, of_inertia, of_length, of_mass, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_input_namelist_document, only: count_groups, document_type, group_type, has, indices_named, name_of, group_named
  use gestell_input_schema_read, only: count_values, read
  use gestell_input_machine_joints, only: check_joint_references, read_joint, type_of_joint
  use gestell_input_machine_copies, only: members_type
  use gestell_input_machine_loading, only: read_load
  use gestell_input_machine_mechanisms, only: claim_name, membership_key, read_members
  use gestell_input_namelist_message, only: locate_in_group, input_error, location
  use gestell_input_schema_units, only: units_type
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_joints_joint, only: form_type
  use gestell_model_joints_types_registry, only: joint_forms
  use gestell_model_joints_placement, only: placement_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_gearing, only: gear, max_crank_turns, max_turns
  use gestell_model_mechanism, only: mechanism_type
  implicit none (type, external)
  private

  public :: prepend_location, read_mechanism

  type(key_type), parameter, public :: link_keys(*) = [ &
    & key_type("link", "name", text_key, "name of the link in messages, in reports and in paths such as `link(NAME).mass`", &
    & required=.true.), &
    & key_type("link", "from", text_key, "joint at the origin of the link's axes", required=.true.), &
    & key_type("link", "to", text_key, "joint to which the link's xi-axis points. Without `to` the link moves with `from` but " // &
    &   "does not rotate: its axes stay parallel to x and y", otherwise="none"), &
    & key_type("link", "mass", real_key, "mass of the link", unit=of_mass, range=nonnegative), &
    & key_type("link", "inertia", real_key, "moment of inertia about the centre of mass; a link that only translates needs it " // &
    &   "too, because it rotates with the frame. In space 3 values: about the link's xi-axis, its perpendicular in the plane, " // &
    &   "and the normal. 1 value J means 0, J, J (slender link)", 1, 1, 3, unit=of_inertia, range=nonnegative), &
    & key_type("link", "center", real_key, "position of the centre of mass relative to the joint `from`: distance along the " // &
    &   "link's xi-axis, and distance perpendicular to it (positive to the left)", 1, 2, 2, unit=of_length, default=0.0_dp), &
    & key_type("link", "z", real_key, "coordinate of the centre of mass along the normal of the mechanism's plane; used only " // &
    &   "for a frame in space", unit=of_length, default=0.0_dp), &
    & membership_key(2)]

  !> Maximum number of coefficients of a mass function: its mean, and cosine and sine coefficients up to order 500.
  integer, parameter :: max_harmonics = 1001

  type(key_type), parameter, public :: mass_function_keys(*) = [ &
    & key_type("mass_functions", "mass", real_key, "total mass of the moving parts", symbol="kg", range=nonnegative), &
    & key_type("mass_functions", "inertia", real_key, "sum of the moments of inertia of the moving parts, each about its own " // &
    &   "centre of mass", symbol="kg m^2", range=nonnegative), &
    & key_type("mass_functions", "a1", real_key, "sum of m x over the moving parts, with x measured from O, as a Fourier " // &
    &   "series in the crank angle phi: the mean, then the factors of cos phi, sin phi, cos 2 phi, sin 2 phi, ...", 1, 1, &
    &   max_harmonics, symbol="kg m", default=0.0_dp), &
    & key_type("mass_functions", "a2", real_key, "sum of m y over the moving parts, as a Fourier series like `a1`", 1, 1, &
    & max_harmonics, symbol="kg m", default=0.0_dp), &
    & key_type("mass_functions", "a3", real_key, "sum of m (x^2 + y^2) over the moving parts, as a Fourier series like `a1`", 1, &
    & 1, max_harmonics, symbol="kg m^2", default=0.0_dp), &
    & key_type("mass_functions", "moment", real_key, "angular momentum divided by the crank speed, as a Fourier series like " // &
    &   "`a1`: sum of m (x y' - y x') + J alpha', where alpha is the angle of a part, J its moment of inertia, and ' the " // &
    &   "derivative with respect to the crank angle", 1, 1, max_harmonics, symbol="kg m^2", default=0.0_dp), &
    & key_type("mass_functions", "energy", real_key, "twice the kinetic energy divided by the squared crank speed, as a " // &
    &   "Fourier series like `a1`: sum of m (x'^2 + y'^2) + J alpha'^2 (symbols as in `moment`); required by the " // &
    &   "task `power` and with `held_by='flywheel'` or `'outside'`", 1, 1, max_harmonics, symbol="kg m^2", otherwise="none")]

contains

  !> Reads the mechanism of a checked document: mass functions if the document contains them, otherwise a linkage. Fails under the
  !> conditions stated at `read_harmonics` and `read_linkage`.
  subroutine read_mechanism(doc, units, mechanism, error, forms)
    type(document_type), intent(in) :: doc
    !> Units of the input
    type(units_type), intent(in) :: units
    class(mechanism_type), allocatable, intent(out) :: mechanism
    type(error_type), allocatable, intent(out) :: error
    !> Definitions of all joint types. If absent, they are composed again, which costs time if many mechanisms are read
    type(form_type), intent(in), optional :: forms(:)
    type(form_type), allocatable :: own(:)
    type(linkage_type) :: linkage
    type(harmonic_mechanism_type) :: harmonic

    if (count_groups(doc, "mass_functions") > 0) then
      call read_harmonics(doc, harmonic, error)
      if (.not. allocated(error)) allocate(mechanism, source=harmonic)
    else
      if (present(forms)) then
        call read_linkage(doc, units, forms, linkage, error)
      else
        call joint_forms(own)
        call read_linkage(doc, units, own, linkage, error)
      end if
      if (.not. allocated(error)) allocate(mechanism, source=linkage)
    end if
  end subroutine read_mechanism

  !> Reads mass functions, given by the coefficients of their harmonics in SI units. Fails if the input also contains joints or
  !> links.
  subroutine read_harmonics(doc, harmonic, error)
    type(document_type), intent(in) :: doc
    type(harmonic_mechanism_type), intent(out) :: harmonic
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    real(dp), allocatable :: a1(:), a2(:), a3(:), moment(:), energy(:)
    real(dp) :: mass, inertia
    character(len=9), parameter :: linkage_groups(5) = [character(len=9) :: "joint", "link", "mechanism", "repeat", "load"]
    integer :: i

    group = group_named(doc, "mass_functions")
    if (sum([(count_groups(doc, trim(linkage_groups(i))), i = 1, size(linkage_groups))]) > 0) then
      call input_error(group, "", "cannot be combined with &joint, &link, &load, &mechanism or &repeat", error)
      return
    end if
    call read(group, mass_function_keys, "mass", mass, error)
    call read(group, mass_function_keys, "inertia", inertia, error)
    call read_harmonic_series(group, "a1", a1, error)
    call read_harmonic_series(group, "a2", a2, error)
    call read_harmonic_series(group, "a3", a3, error)
    call read_harmonic_series(group, "moment", moment, error)
    if (has(group, "energy")) call read_harmonic_series(group, "energy", energy, error)
    if (allocated(error)) return
    call new_harmonic_mechanism(harmonic, mass, inertia, a1, a2, a3, moment, error, energy)
    if (allocated(error)) call locate_in_group(group, error)
  end subroutine read_harmonics

  !> Reads the coefficients of one mass function: its mean, then a cosine and a sine coefficient for each order. Returns zero if the
  !> key is missing or `error` is already allocated.
  subroutine read_harmonic_series(group, key, values, error)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    real(dp), allocatable, intent(out) :: values(:)
    type(error_type), allocatable, intent(inout) :: error

    allocate(values(max(1, count_values(group, key))))
    call read(group, mass_function_keys, key, values, error)
    if (allocated(error)) return
    if (modulo(size(values), 2) == 0) call input_error(group, key, &
      & "must have an odd number of values: the mean, then one cosine and one sine coefficient for each order", error)
  end subroutine read_harmonic_series

  !> Reads all mechanisms of a checked document as one linkage. Fails if a key does not suit a joint's type, a value is out of
  !> range, a joint is unknown or listed too late, or a name is used twice. Also fails under the conditions stated at
  !> `read_members`.
  subroutine read_linkage(doc, units, forms, linkage, error)
    type(document_type), intent(in) :: doc
    type(units_type), intent(in) :: units
    type(form_type), intent(in) :: forms(:)
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(members_type) :: joints, links, loads
    type(placement_type), allocatable :: placements(:)
    type(dictionary_type) :: names, link_names, load_names
    integer :: i, k

    call read_members(doc, units, joints, links, loads, placements, error)
    if (allocated(error)) return
    if (size(joints%groups) == 0) then
      call fatal_error(error, doc%file // ": the mechanism is missing: groups &joint and &link (or &mass_functions) are " // &
        & "required", invalid_input)
      return
    end if
    do i = 1, size(joints%groups)
      call claim_name(joints%groups(i), names, error)
      if (allocated(error)) return
    end do
    do i = 1, size(links%groups)
      call claim_name(links%groups(i), link_names, error)
      if (allocated(error)) return
    end do
    do i = 1, size(loads%groups)
      call claim_name(loads%groups(i), load_names, error)
      if (allocated(error)) return
    end do
    do i = 1, size(placements)
      call check_crank(joints, i, forms, error)
      if (allocated(error)) return
    end do
    do i = 1, size(joints%groups)
      call read_joint(joints%groups, names, i, forms, units, placements(joints%mechanism(i)), linkage, error)
      if (allocated(error)) return
    end do
    if (size(links%groups) == 0) then
      call fatal_error(error, doc%file // ": the mechanism has no mass: a group &link is required", invalid_input)
      return
    end if
    do i = 1, size(links%groups)
      call read_link(links%groups(i), joints%groups, names, units, placements(links%mechanism(i)), linkage, error)
      if (allocated(error)) return
    end do
    allocate(linkage%loads(0))
    do i = 1, size(loads%groups)
      call read_load(loads%groups(i), joints%groups, names, units, placement_of(placements, loads%mechanism(i)), linkage, &
        & error)
      if (allocated(error)) return
      associate (load => linkage%loads(i))
        k = load%joint
        if (k > 0) k = placements(joints%mechanism(k))%plane - load%plane
        if (k /= 0) call input_error(loads%groups(i), "joint", "must belong to a mechanism in the plane of the link in 'on'", &
          & error)
        if (load%against > 0) k = linkage%links(max(1, load%against))%plane - load%plane
        if (k /= 0 .and. .not. allocated(error)) call input_error(loads%groups(i), "against", "must name a link that " // &
          &   "moves in the plane of the link in 'on'", error)
      end associate
      if (allocated(error)) return
    end do
    call gear(linkage%joints, linkage%loads, linkage%turns, linkage%crank_turns, i)
    if (size(linkage%loads) == 0) deallocate(linkage%loads)
    if (i == 0) return
    if (i > size(joints%groups)) then
      call input_error(loads%groups(i - size(joints%groups)), "", "together with the other loads and mechanisms it repeats only " &
        & // "after " // text(linkage%turns) // " turns of the drive; at most " // text(max_turns) // " are allowed", error)
    else if (linkage%turns > max_turns) then
      call input_error(group_of_ratio(doc, joints, i), "ratio", "the mechanism repeats only after " // text(linkage%turns) &
        & // " turns of the drive; at most " // text(max_turns) // " are allowed", error)
    else
      call input_error(group_of_ratio(doc, joints, i), "ratio", "before the motion of the mechanism repeats, the crank " // &
        &   "turns more than the permitted " // text(max_crank_turns) // " times", error)
    end if
  end subroutine read_linkage

  !> Position of the mechanism with this number; for 0, the position of the frame's own axes.
  pure type(placement_type) function placement_of(placements, mechanism) result(placement)
    type(placement_type), intent(in) :: placements(:)
    integer, intent(in) :: mechanism

    if (mechanism > 0) placement = placements(mechanism)
  end function placement_of

  !> Returns the group whose key `ratio` sets the gear ratio of joint `i`: the group of the joint, or that of its mechanism or copy.
  pure function group_of_ratio(doc, joints, i) result(group)
    type(document_type), intent(in) :: doc
    type(members_type), intent(in) :: joints
    integer, intent(in) :: i
    type(group_type) :: group
    integer :: copy

    group = joints%groups(i)
    if (has(group, "ratio") .or. count_groups(doc, "mechanism") == 0) return
    copy = joints%mechanism(i) - count_groups(doc, "mechanism")
    associate (mechanisms => indices_named(doc, "mechanism"), copies => indices_named(doc, "repeat"))
      if (copy > 0) group = doc%groups(copies(copy))
      if (copy <= 0) group = doc%groups(mechanisms(joints%mechanism(i)))
    end associate
  end function group_of_ratio

  !> Fails if the mechanism with this number contains no crank and no cylinder.
  subroutine check_crank(joints, mechanism, forms, error)
    type(members_type), intent(in) :: joints
    integer, intent(in) :: mechanism
    type(form_type), intent(in) :: forms(:)
    type(error_type), allocatable, intent(out) :: error
    integer :: i, number

    do i = 1, size(joints%groups)
      if (joints%mechanism(i) /= mechanism) cycle
      call type_of_joint(joints%groups(i), forms, number, error)
      if (allocated(error)) return
      if (any(forms(number)%name == [character(len=8) :: "crank", "cylinder"])) return
    end do
    call fatal_error(error, joints%groups(findloc(joints%mechanism, mechanism, dim=1))%file // ": every mechanism needs a joint " &
      & // "of type 'crank' or 'cylinder'", invalid_input)
  end subroutine check_crank

  !> Reads the link that a group describes and adds it to the linkage.
  subroutine read_link(group, joints, names, units, placement, linkage, error)
    type(group_type), intent(in) :: group, joints(:)
    type(dictionary_type), intent(in) :: names
    type(units_type), intent(in) :: units
    type(placement_type), intent(in) :: placement
    type(linkage_type), intent(inout) :: linkage
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: from, to
    real(dp) :: mass, inertia(3), center(2), z
    integer :: n

    call read(group, link_keys, "from", from, error)
    if (.not. allocated(error)) call check_joint_references(group, "from", [from], joints, names, size(joints), error)
    call read(group, link_keys, "to", to, error)
    if (allocated(error)) return
    if (has(group, "to")) call check_joint_references(group, "to", [to], joints, names, size(joints), error)
    if (.not. allocated(error) .and. to == from) call input_error(group, "to", "must differ from the joint in 'from'", error)
    call read(group, link_keys, "mass", mass, error, units)
    n = min(3, max(1, count_values(group, "inertia")))
    if (.not. allocated(error) .and. n == 2) call input_error(group, "inertia", "must have 1 or 3 values, but has 2", error)
    call read(group, link_keys, "inertia", inertia(:n), error, units)
    call read(group, link_keys, "center", center, error, units)
    call read(group, link_keys, "z", z, error, units)
    if (allocated(error)) return
    if (n == 1) inertia = [0.0_dp, inertia(1), inertia(1)]
    if (.not. has(group, "to")) center = placement%vector(center)
    call linkage%link(name_of(group), from, to, mass, inertia(3), center, error)
    if (allocated(error)) call locate_in_group(group, error)
    if (allocated(error)) return
    associate (link => linkage%links(size(linkage%links)))
      link%z = placement%z + z
      link%own_z = z
      link%along = inertia(1)
      link%across = inertia(2)
      link%axis = placement%vector([1.0_dp, 0.0_dp])
      link%plane = placement%plane
    end associate
  end subroutine read_link

  !> Puts file and line of the faulty joint or link in front of the message of `error`.
  subroutine prepend_location(doc, error)
    type(document_type), intent(in) :: doc
    type(error_type), allocatable, intent(inout) :: error
    integer :: begin, i

    if (.not. allocated(error%subject)) return
    do i = 1, size(doc%groups)
      associate (group => doc%groups(i))
        ! for a joint or link of a copy, named PART.NAME, the line is that of the original
        begin = 0
        if (index(error%subject, group%name // " '") == 1) begin = index(error%subject, "." // name_of(group) // "'")
        if (group%name // " '" // name_of(group) // "'" /= error%subject .and. begin == 0) cycle
        error%message = location(group%file, group%line) // error%message
        return
      end associate
    end do
  end subroutine prepend_location

end module gestell_input_machine_mechanism
