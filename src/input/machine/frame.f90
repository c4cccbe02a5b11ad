!> Reads the drive, the frame and its mounts from an input file.
module gestell_input_machine_frame
  use gestell_base_error, only: error_type
  use gestell_base_key, only: fraction, key_type, nonnegative, nonzero, of_angle, of_damping, of_inertia, of_length, of_mass, &
    & of_stiffness, positive, real_key, text_key
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: text
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: document_type, find_entry, group_type, groups_named, has, indices_named, group_named
  use gestell_input_schema, only: variant_type
  use gestell_input_schema_read, only: count_values, read, read_axis_values
  use gestell_input_machine_loads, only: foundation_keys, gravity_keys, read_foundation, read_gravity
  use gestell_input_machine_mechanisms, only: read_planes
  use gestell_input_machine_mechanism, only: prepend_location
  use gestell_input_namelist_message, only: locate_in_group, input_error, label
  use gestell_input_schema_units, only: units_type
  use gestell_model_frame, only: frame_type, dof_names, new_frame
  use gestell_model_frame_damping, only: add_damping_ratios
  use gestell_model_mechanism_held, only: held_subject, holders
  use gestell_model_mechanism, only: mechanism_type
  use gestell_model_frame_in_space, only: split_into_planes, put_in_space
  use gestell_model_linkage, only: linkage_type
  use gestell_model_space_drive, only: drive_type
  use gestell_model_space_masses, only: plane_type
  use gestell_math_rotation, only: identity, rotation_matrix
  use gestell_model_mounting, only: damping_matrix, stiffness_matrix, support_type
  use gestell_model_mounting_weights, only: gravity_subject
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: foundation_keys, gravity_keys, read_drive_and_frame, read_frame, note_on_ignored_values

  type(key_type), parameter, public :: drive_keys(*) = [ &
    & key_type("drive", "speed_rpm", real_key, "crank speed: positive if the crank turns counter-clockwise, negative if " // &
    &   "clockwise", required=.true., symbol="1/min", range=nonzero), &
    & key_type("drive", "speed_hz", real_key, "replaces `speed_rpm`: turns of the crank per second", symbol="Hz", &
    &   range=nonzero, otherwise="`speed_rpm` / 60", same_as="speed_rpm", factor=60.0_dp), &
    & key_type("drive", "held_by", text_key, "what keeps the crank speed constant", word="motor", words=trim(holders(1)) // &
    &   ", " // trim(holders(2)) // ", " // trim(holders(3))), &
    & key_type("drive", "flywheel_inertia", real_key, "moment of inertia of the flywheel about the crank's axis, without any " // &
    &   "part that a link already includes; allowed only with `held_by='flywheel'`. The task `power` computes the speed " // &
    &   "fluctuation from it", otherwise="none", unit=of_inertia, range=positive)]

  type(key_type), parameter, public :: frame_keys(*) = [ &
    & key_type("frame", "mass", real_key, "mass of the frame without the links", unit=of_mass, range=positive), &
    & key_type("frame", "inertia", real_key, "moment of inertia of the frame without the links, about its centre of mass F. " // &
    &   "In the plane: 1 value, about zeta. In space: 3 values, about xi, eta, zeta; 3 more values may follow, the elements " // &
    &   "xy, xz, yz of the tensor (xy is minus the sum of m x y)", 1, 1, 6, unit=of_inertia), &
    & key_type("frame", "origin", real_key, "position of O, the origin of the mechanism's x-y system, relative to the frame's " // &
    &   "centre of mass F; components along xi, eta (for a frame in space also zeta)", 1, 2, 3, unit=of_length), &
    & key_type("frame", "dof", text_key, "degrees of freedom in which the frame can move; the others are locked. With " // &
    &   "`'zeta'`, `'rot_xi'` or `'rot_eta'` it is a frame in space (three-dimensional motion); without these the frame moves " // &
    &   "in a plane", 1, 1, 6, word="xi, eta, psi", words="xi, eta, psi, zeta, rot_xi, rot_eta")]

  type(key_type), parameter, public :: support_keys(*) = [ &
    & key_type("support", "position", real_key, "position of the support relative to the frame's centre of mass F; components " // &
    &   "along xi, eta (for a frame in space also zeta)", 1, 2, 3, unit=of_length), &
    & key_type("support", "stiffness", real_key, "stiffness along the support's first and second axis; for a frame in space " // &
    &   "also along the third axis (0 if not given)", 1, 2, 3, unit=of_stiffness, range=nonnegative, alike=.true.), &
    & key_type("support", "damping", real_key, "damping along the support's first and second axis; for a frame in space also " // &
    &   "along the third axis (0 if not given)", 1, 2, 3, unit=of_damping, default=0.0_dp, range=nonnegative, alike=.true.), &
    & key_type("support", "damping_ratio", real_key, "damping ratio D along each axis of the support, which adds 2 D k/w to " // &
    &   "`damping`: k is the stiffness along the axis, w the natural angular frequency of the machine on its mounts if it " // &
    &   "moves along this axis without rotating", default=0.0_dp, range=fraction), &
    & key_type("support", "angle", real_key, "angle by which the support's axes are rotated about zeta; for a frame in space " // &
    &   "up to 3 successive angles: about zeta, about the rotated eta-axis, about the rotated xi-axis", 1, 1, 3, unit=of_angle, &
    &   default=0.0_dp), &
    & key_type("support", "axes", text_key, "whether the support's axes keep their direction or rotate with the frame", &
    &   word="space", words="space, frame")]

  !> Words that the keys `held_by`, `dof` and `axes` accept, and the meaning of each.
  type(variant_type), parameter, public :: frame_words(*) = [ &
    & variant_type("drive", "held_by", "motor", "a stiff motor on the frame: it keeps the crank's speed relative to the frame " // &
    &   "constant; the reaction of the whole driving torque, with its fluctuation, acts on the frame"), &
    & variant_type("drive", "held_by", "flywheel", "a heavy flywheel on the crankshaft: it keeps the crank's speed relative " // &
    &   "to the ground constant; only the reaction of the mean driving torque acts on the frame"), &
    & variant_type("drive", "held_by", "outside", "a drive beside the machine, connected by a belt or coupling: it keeps the " // &
    &   "crank's speed relative to the ground constant; no driving torque acts on the frame"), &
    & variant_type("frame", "dof", "xi", "displacement along xi"), &
    & variant_type("frame", "dof", "eta", "displacement along eta"), &
    & variant_type("frame", "dof", "psi", "rotation about zeta, the normal of the plane"), &
    & variant_type("frame", "dof", "zeta", "displacement along zeta, for a frame in space"), &
    & variant_type("frame", "dof", "rot_xi", "rotation about xi, for a frame in space"), &
    & variant_type("frame", "dof", "rot_eta", "rotation about eta, for a frame in space"), &
    & variant_type("support", "axes", "space", "the axes keep their direction relative to the ground, as for a mount on which " // &
    &   "the frame stands"), &
    & variant_type("support", "axes", "frame", "the axes rotate with the frame, as for guides or shear pads bolted to the frame")]

  !> Data of drive, frame and mounts in SI units. The mechanism is not included.
  type, public :: frame_data_type
    !> Data of the frame: `mass` (kg), `inertia` tensor (kg m^2), and `origin`, position of the point O relative to the centre of
    !> mass F (m). Data of the drive: `speed` (rad/s) and `flywheel_inertia` (kg m^2). `gravity`: acceleration (m/s^2).
    !> `stiffness`, `damping`: matrices of the foundation without the supports (SI), in the order of the frame's degrees of
    !> freedom
    real(dp) :: mass = 0, inertia(3, 3) = 0, origin(3) = 0, stiffness(6, 6) = 0, damping(6, 6) = 0, speed = 0, gravity(3) = 0, &
      & flywheel_inertia = 0
    !> Damping ratio of each mode of the mounting, and damping ratio of each support
    real(dp) :: damping_ratio = 0
    real(dp), allocatable :: support_ratios(:)
    !> What keeps the drive speed constant: 'motor', 'flywheel' or 'outside'. Value of the key `held_by`
    character(len=8) :: held_by = "motor"
    !> Indices of the free degrees of freedom, in ascending order
    integer, allocatable :: free(:)
    type(support_type), allocatable :: supports(:)
  end type frame_data_type

contains

  !> Reads the frame, its supports and foundation, and the drive, and builds the frame with its mechanism. Fails if a value is
  !> invalid or the mechanism cannot be assembled at some crank angle. The message names the line of the faulty group.
  subroutine read_frame(doc, units, mechanism, frame, error)
    !> The checked input
    type(document_type), intent(in) :: doc
    !> Units of the input
    type(units_type), intent(in) :: units
    !> The mechanism, which the caller has already read
    class(mechanism_type), intent(in) :: mechanism
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(frame_data_type) :: data

    call read_drive_and_frame(doc, units, data, error)
    if (allocated(error)) return
    data%speed = data%speed / mechanism%turns
    if (any(data%free > 3)) then
      call read_frame_in_space(doc, units, data, mechanism, frame, error)
    else
      call new_frame(frame, mechanism, data%mass, data%inertia(3, 3), data%origin(:2), (data%stiffness(:3, :3)), &
        & (data%damping(:3, :3)), data%speed, error, data%free, data%supports, held_by=trim(data%held_by))
    end if
    if (.not. allocated(error)) call add_damping_ratios(frame, data%damping_ratio, data%support_ratios, error)
    if (.not. allocated(error)) call frame%weigh(data%gravity, error)
    frame%flywheel_inertia = data%flywheel_inertia
    if (.not. allocated(error)) return
    if (allocated(error%subject)) then
      if (error%subject == gravity_subject) call locate_in_group(group_named(doc, "gravity"), error)
      if (error%subject == held_subject) call locate_in_group(group_named(doc, "drive"), error)
      call prepend_location(doc, error)
    else
      call locate_in_group(group_named(doc, "frame"), error)
    end if
  end subroutine read_frame

  !> Builds a frame that moves in three dimensions. Fails if the mechanism is given by mass functions. Also fails if the drive
  !> requires a mechanism with ratio 1 and there is none.
  subroutine read_frame_in_space(doc, units, data, mechanism, frame, error)
    type(document_type), intent(in) :: doc
    type(units_type), intent(in) :: units
    type(frame_data_type), intent(in) :: data
    class(mechanism_type), intent(in) :: mechanism
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(plane_type), allocatable :: planes(:)
    type(drive_type) :: drive
    real(dp), allocatable :: origins(:, :), axes(:, :, :)

    call read_planes(doc, units, origins, axes, drive%axis, error)
    if (allocated(error)) return
    drive%held_by = data%held_by
    drive%flywheel_inertia = data%flywheel_inertia
    if (drive%uniform_in_space() .and. .not. norm2(drive%axis) > 0) then
      call input_error(group_named(doc, "drive"), "held_by", "other than 'motor' requires a mechanism with ratio=1 if the " // &
        &   "frame moves in space: the crankshaft of this mechanism is the drive's shaft", error)
      return
    end if
    select type (mechanism)
    type is (linkage_type)
      call split_into_planes(mechanism, data%origin, origins, axes, planes)
    class default
      call input_error(group_named(doc, "mass_functions"), "", "cannot describe the mechanism of a frame in space: use &joint " // &
        &   "and &link", error)
      return
    end select
    call new_frame(frame, mechanism, data%mass, data%inertia(3, 3), data%origin(:2), (data%stiffness(:3, :3)), &
      & (data%damping(:3, :3)), data%speed, error)
    if (.not. allocated(error)) call put_in_space(frame, data%inertia, planes, data%supports, data%free, error, data%stiffness, &
      & data%damping, drive)
    if (.not. allocated(error)) frame%space%origin = data%origin
  end subroutine read_frame_in_space

  !> Reads drive, frame, foundation, supports and gravity. Fails if a value is invalid. Also fails if the frame moves in its plane
  !> and a value is allowed only for a frame that moves in three dimensions.
  subroutine read_drive_and_frame(doc, units, data, error)
    type(document_type), intent(in) :: doc
    type(units_type), intent(in) :: units
    type(frame_data_type), intent(out) :: data
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    character(len=word_length), allocatable :: names(:)
    logical :: in_space
    integer :: i

    call read_drive(group_named(doc, "drive"), units, data, error)
    if (allocated(error)) return
    group = group_named(doc, "frame")
    call read(group, frame_keys, "mass", data%mass, error, units)
    call read(group, frame_keys, "dof", names, error)
    if (allocated(error)) return
    data%free = pack([(i, i = 1, size(dof_names))], [(any(names == dof_names(i)), i = 1, size(dof_names))])
    if (size(data%free) /= size(names)) call input_error(group, "dof", "names a degree of freedom twice", error)
    if (allocated(error)) return
    in_space = any(data%free > 3)
    call read_foundation(group_named(doc, "foundation"), units, in_space, data%stiffness, data%damping, &
      & data%damping_ratio, error)
    if (.not. allocated(error)) call read_gravity(groups_named(doc, "gravity"), units, in_space, data%gravity, error)
    if (.not. allocated(error)) call read_inertia(group, units, any(data%free > 4), data%inertia, error)
    call read_axis_values(group, frame_keys, "origin", units, data%origin, error)
    if (.not. allocated(error)) call read_supports(doc, units, in_space, data%supports, data%support_ratios, error)
    if (.not. allocated(error) .and. .not. in_space) call refuse_tilted(doc, error)
  end subroutine read_drive_and_frame

  !> Reads the drive: its speed, the key `held_by` and the flywheel.
  subroutine read_drive(group, units, data, error)
    type(group_type), intent(in) :: group
    type(units_type), intent(in) :: units
    type(frame_data_type), intent(inout) :: data
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: held_by
    real(dp) :: speed_rpm

    call read(group, drive_keys, "speed_rpm", speed_rpm, error)
    if (.not. allocated(error) .and. abs(speed_rpm) < 1.0e-300_dp) call input_error(group, "speed_rpm", "is too close to zero", &
      & error)
    call read(group, drive_keys, "held_by", held_by, error)
    if (has(group, "flywheel_inertia")) call read(group, drive_keys, "flywheel_inertia", data%flywheel_inertia, error, units)
    if (allocated(error)) return
    data%speed = speed_rpm * 2 * pi / 60
    data%held_by = held_by
    if (has(group, "flywheel_inertia") .and. held_by /= "flywheel") call input_error(group, "flywheel_inertia", &
      & "is only allowed with held_by='flywheel'", error)
  end subroutine read_drive

  !> Reads the inertia tensor of the frame. Fails if a moment of inertia is not positive. Also fails if only one value is given
  !> although the frame can rotate about xi or eta (`can_tilt`).
  subroutine read_inertia(group, units, can_tilt, inertia, error)
    type(group_type), intent(in) :: group
    type(units_type), intent(in) :: units
    logical, intent(in) :: can_tilt
    real(dp), intent(out) :: inertia(3, 3)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: j(6)
    integer :: i, n

    inertia = 0
    j = 0
    n = max(1, count_values(group, "inertia"))
    call read(group, frame_keys, "inertia", j(:n), error, units)
    if (allocated(error)) return
    do i = 1, min(n, 3)
      if (j(i) > 0) cycle
      if (n == 1) call input_error(group, "inertia", "must be positive", error)
      if (n > 1) call input_error(group, "inertia", "must be positive", error, i)
      return
    end do
    if (all(n /= [1, 3, 6])) then
      call input_error(group, "inertia", "must have 1, 3 or 6 values, but has " // text(n), error)
    else if (n == 1 .and. can_tilt) then
      call input_error(group, "inertia", "must have 3 or 6 values, because the frame can rotate about xi or eta", error)
    else if (n == 1) then
      ! rotation about xi and eta is blocked; their moments of inertia only complete the tensor of a possible body
      inertia = j(1) * identity()
    else
      inertia = reshape([j(1), j(4), j(5), j(4), j(2), j(6), j(5), j(6), j(3)], [3, 3])
    end if
  end subroutine read_inertia

  !> Fails if a support or mechanism is tilted out of the plane in which the frame moves.
  subroutine refuse_tilted(doc, error)
    type(document_type), intent(in) :: doc
    type(error_type), allocatable, intent(out) :: error
    character(len=9), parameter :: names(4) = [character(len=9) :: "support", "mechanism", "repeat", "load"]
    character(len=9), parameter :: keys(4) = [character(len=9) :: "angle", "axis", "axis", "direction"]
    integer :: i, k

    do k = 1, size(names)
      do i = 1, size(doc%groups)
        if (doc%groups(i)%name /= names(k)) cycle
        if (count_values(doc%groups(i), trim(keys(k))) < 2) cycle
        call input_error(doc%groups(i), trim(keys(k)), "describes a tilt out of the plane in which the frame moves: add zeta, " // &
          &   "rot_xi or rot_eta to &frame dof", error)
        return
      end do
    end do
  end subroutine refuse_tilted

  !> Returns a note if a nonzero value along zeta is ignored because &frame lacks the key `dof`, so that the frame moves in its
  !> plane. Otherwise the note is empty.
  function note_on_ignored_values(doc) result(line)
    type(document_type), intent(in) :: doc
    character(len=:), allocatable :: line
    character(len=9), parameter :: keys(3) = [character(len=9) :: "position", "origin", "stiffness"]
    integer :: i, k

    line = ""
    if (count_values(group_named(doc, "frame"), "dof") > 0) return
    do i = 1, size(doc%groups)
      associate (group => doc%groups(i))
        if (all(group%name /= [character(len=9) :: "support", "frame", "mechanism", "repeat"])) cycle
        do k = 1, size(keys)
          if (count_values(group, trim(keys(k))) < 3) cycle
          if (.not. abs(group%entries(find_entry(group, trim(keys(k))))%values(3)%number) > 0) cycle
          line = label(group) // ": the third value of " // trim(keys(k)) // " is ignored, because the frame moves in a " &
            & // "plane; to move it in space, add zeta, rot_xi or rot_eta to &frame dof" // new_line("a")
          return
        end do
      end associate
    end do
  end function note_on_ignored_values

  !> Reads the supports. Their axes can be tilted out of the plane only if the frame moves in three dimensions (`in_space`). Fails
  !> if a value is invalid, or if a support is so far from the frame's centre of mass F that its stiffness or damping about F
  !> overflows.
  subroutine read_supports(doc, units, in_space, supports, ratios, error)
    type(document_type), intent(in) :: doc
    type(units_type), intent(in) :: units
    logical, intent(in) :: in_space
    type(support_type), allocatable, intent(out) :: supports(:)
    !> Damping ratios of the supports
    real(dp), allocatable, intent(out) :: ratios(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: axes
    real(dp), dimension(3) :: position, stiffness, damping, angles
    integer, allocatable :: at(:)
    integer :: i, n

    allocate(at, source=indices_named(doc, "support"))
    allocate(supports(size(at)), ratios(size(at)))
    do i = 1, size(at)
      associate (group => doc%groups(at(i)))
        call read_axis_values(group, support_keys, "position", units, position, error)
        call read_axis_values(group, support_keys, "stiffness", units, stiffness, error)
        call read_axis_values(group, support_keys, "damping", units, damping, error)
        call read(group, support_keys, "damping_ratio", ratios(i), error)
        angles = 0
        n = max(1, count_values(group, "angle"))
        call read(group, support_keys, "angle", angles(:n), error, units)
        call read(group, support_keys, "axes", axes, error)
        if (allocated(error)) return
        supports(i) = support_type(position, stiffness, damping, angles(1), axes == "frame")
        angles = modulo(angles, 2 * pi)
        if (in_space) supports(i)%axes = matmul(rotation_matrix([0.0_dp, 0.0_dp, angles(1)]), &
          & matmul(rotation_matrix([0.0_dp, angles(2), 0.0_dp]), rotation_matrix([angles(3), 0.0_dp, 0.0_dp])))
        if (all(ieee_is_finite(stiffness_matrix(supports(i:i))) .and. ieee_is_finite(damping_matrix(supports(i:i))))) cycle
        call input_error(group, "position", "is so far from F that the stiffness or damping about F overflows", error)
        return
      end associate
    end do
  end subroutine read_supports

end module gestell_input_machine_frame
