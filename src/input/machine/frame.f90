!> Drive, frame and mounting of an input file.
module gestell_input_machine_frame
  use gestell_base_error, only: error_type
  use gestell_base_key, only: key_type, nonnegative, nonzero, of_angle, of_damping, of_damping_diagonal, of_inertia, of_length, &
    & of_mass, of_stiffness, of_stiffness_matrix, positive, real_key, text_key
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_input_namelist_document, only: document_type, group_type, groups_named, the_group, word_length
  use gestell_input_schema_read, only: count_values, read
  use gestell_input_machine_mechanism, only: name_line
  use gestell_input_namelist_message, only: in_group, input_error
  use gestell_input_schema_units, only: units_type
  use gestell_model_frame, only: frame_type, dof_names, new_frame
  use gestell_model_mechanism_held, only: held_subject, holders
  use gestell_model_mechanism, only: mechanism_type
  use gestell_model_frame_mounting, only: damping_matrix, stiffness_matrix, support_type
  use gestell_model_frame_weights, only: gravity_subject
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: read_drive_and_frame, read_frame

  type(key_type), parameter, public :: drive_keys(*) = [ &
    & key_type("drive", "speed_rpm", real_key, "crank speed, counter-clockwise positive", required=.true., symbol="1/min", &
    &   range=nonzero), &
    & key_type("drive", "held_by", text_key, "who holds this speed, see below", word="motor", words=trim(holders(1)) // ", " // &
    &   trim(holders(2)) // ", " // trim(holders(3))), &
    & key_type("drive", "flywheel_inertia", real_key, "with `held_by='flywheel'` only: what the flywheel has beyond the " // &
    &   "links, about the crank's axis; then the task `power` tells how evenly it turns", otherwise="none", unit=of_inertia, &
    &   range=positive)]

  type(key_type), parameter, public :: frame_keys(*) = [ &
    & key_type("frame", "mass", real_key, "m_F", unit=of_mass, range=positive), &
    & key_type("frame", "inertia", real_key, "J_F about the frame's centre of mass F", unit=of_inertia, range=positive), &
    & key_type("frame", "origin", real_key, "the mechanism's origin O in the frame's system, whose origin is F", 1, 2, 2, &
    &   unit=of_length), &
    & key_type("frame", "dof", text_key, "the degrees of freedom that are free; the others rest", 1, 1, 3, word="xi, eta, psi", &
    &   words="xi, eta, psi")]

  type(key_type), parameter, public :: support_keys(*) = [ &
    & key_type("support", "position", real_key, "in the frame's system", 1, 2, 2, unit=of_length), &
    & key_type("support", "stiffness", real_key, "along its two axes", 1, 2, 2, unit=of_stiffness, range=nonnegative, &
    &   alike=.true.), &
    & key_type("support", "damping", real_key, "along its two axes", 1, 2, 2, unit=of_damping, default=0.0_dp, &
    &   range=nonnegative, alike=.true.), &
    & key_type("support", "angle", real_key, "turns the two axes", unit=of_angle, default=0.0_dp), &
    & key_type("support", "axes", text_key, "whether the axes stay in space or turn with the frame, see below", word="space", &
    &   words="space, frame")]

  type(key_type), parameter, public :: foundation_keys(*) = [ &
    & key_type("foundation", "stiffness", real_key, "c_ij added to what the supports give, symmetric and nowhere negative", &
    &   2, 9, 9, unit=of_stiffness_matrix, default=0.0_dp, rows=3), &
    & key_type("foundation", "damping", real_key, "b_i added to the diagonal", 1, 3, 3, unit=of_damping_diagonal, &
    &   default=0.0_dp, range=nonnegative)]

  type(key_type), parameter, public :: gravity_keys(*) = [ &
    & key_type("gravity", "acceleration", real_key, "of gravity; 0: as without the group", symbol="m/s^2", default=9.80665_dp, &
    &   range=nonnegative), &
    & key_type("gravity", "direction", real_key, "of the weights in the frame's axes: 0 along xi, -90 downwards against eta", &
    &   unit=of_angle, default=-90.0_dp)]

  !> Drive, frame and mounting in SI, stiffness and damping of the foundation alone; the mechanism is missing.
  type, public :: frame_data_type
    real(dp) :: mass = 0, inertia = 0, origin(2) = 0, stiffness(3, 3) = 0, damping(3, 3) = 0, speed = 0, gravity(2) = 0, &
      & flywheel_inertia = 0
    character(len=8) :: held_by = "motor"
    integer, allocatable :: free(:)
    type(support_type), allocatable :: supports(:)
  end type frame_data_type

contains

  !> Frame, supports, foundation and drive with their mechanism, which is turned once.
  subroutine read_frame(doc, units, mechanism, frame, error)
    type(document_type), intent(in) :: doc
    type(units_type), intent(in) :: units
    class(mechanism_type), intent(in) :: mechanism
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(frame_data_type) :: data

    call read_drive_and_frame(doc, units, data, error)
    if (allocated(error)) return
    call new_frame(frame, mechanism, data%mass, data%inertia, data%origin, data%stiffness, data%damping, data%speed, error, &
      & data%free, data%supports, data%gravity, trim(data%held_by))
    frame%flywheel_inertia = data%flywheel_inertia
    if (.not. allocated(error)) return
    if (allocated(error%subject)) then
      if (error%subject == gravity_subject) call in_group(the_group(doc, "gravity"), error)
      if (error%subject == held_subject) call in_group(the_group(doc, "drive"), error)
      call name_line(doc, error)
    else
      call in_group(the_group(doc, "frame"), error)
    end if
  end subroutine read_frame

  !> All of it but the mechanism.
  subroutine read_drive_and_frame(doc, units, data, error)
    type(document_type), intent(in) :: doc
    type(units_type), intent(in) :: units
    type(frame_data_type), intent(out) :: data
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group

    call read_drive(the_group(doc, "drive"), units, data, error)
    if (allocated(error)) return
    call read_supports(groups_named(doc, "support"), units, data%supports, error)
    if (allocated(error)) return
    call read_foundation(the_group(doc, "foundation"), units, data%stiffness, data%damping, error)
    if (allocated(error)) return
    call read_gravity(groups_named(doc, "gravity"), units, data%gravity, error)
    if (allocated(error)) return

    group = the_group(doc, "frame")
    call read(group, frame_keys, "mass", data%mass, error, units)
    if (.not. allocated(error)) call read(group, frame_keys, "inertia", data%inertia, error, units)
    if (.not. allocated(error)) call read(group, frame_keys, "origin", data%origin, error, units)
    if (allocated(error)) return
    call read_dof(group, data%free, error)
  end subroutine read_drive_and_frame

  !> The speed and who holds it.
  subroutine read_drive(group, units, data, error)
    type(group_type), intent(in) :: group
    type(units_type), intent(in) :: units
    type(frame_data_type), intent(inout) :: data
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: held_by
    real(dp) :: speed_rpm

    call read(group, drive_keys, "speed_rpm", speed_rpm, error)
    if (allocated(error)) return
    if (abs(speed_rpm) < 1.0e-300_dp) then
      call input_error(group, "speed_rpm", "is too small", error)
      return
    end if
    data%speed = speed_rpm * 2 * pi / 60
    call read(group, drive_keys, "held_by", held_by, error)
    if (allocated(error)) return
    data%held_by = held_by
    if (count_values(group, "flywheel_inertia") == 0) return
    call read(group, drive_keys, "flywheel_inertia", data%flywheel_inertia, error, units)
    if (allocated(error)) return
    if (held_by /= "flywheel") call input_error(group, "flywheel_inertia", "needs held_by='flywheel'", error)
  end subroutine read_drive

  !> c_ij and b_ij of the foundation. Error: the stiffness is not symmetric, or negative in some direction.
  subroutine read_foundation(group, units, stiffness, damping, error)
    type(group_type), intent(in) :: group
    type(units_type), intent(in) :: units
    real(dp), intent(out) :: stiffness(3, 3), damping(3, 3)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: b(3)
    integer :: i, k

    damping = 0
    call read(group, foundation_keys, "stiffness", stiffness, error)
    if (allocated(error)) return
    do i = 1, 3
      k = 1 + mod(i, 3)
      if (.not. abs(stiffness(i, k) - stiffness(k, i)) > 0) cycle
      call input_error(group, "stiffness", "the matrix must be symmetric, c" // text(i) // text(k) // " is " &
        & // concise(stiffness(i, k)) // " and c" // text(k) // text(i) // " is " // concise(stiffness(k, i)), error, &
        & element=i + 3 * (k - 1))
      return
    end do
    call read(group, foundation_keys, "stiffness", stiffness, error, units)
    if (negative_somewhere(stiffness)) then
      call input_error(group, "stiffness", "the matrix is not positive (semi-)definite: it would push the frame away in " // &
        & "some direction", error)
      return
    end if
    call read(group, foundation_keys, "damping", b, error, units)
    if (allocated(error)) return
    do i = 1, 3
      damping(i, i) = b(i)
    end do
  end subroutine read_foundation

  !> Whether a symmetric matrix has a principal minor below zero by more than rounding (Sylvester).
  pure logical function negative_somewhere(c)
    real(dp), intent(in) :: c(3, 3)
    real(dp), parameter :: rounding = 1.0e-12_dp
    real(dp) :: products, mixed
    integer :: i, k

    negative_somewhere = any([(c(i, i) < 0, i = 1, 3)])
    do i = 1, 3
      k = 1 + mod(i, 3)
      negative_somewhere = negative_somewhere .or. c(i, k)**2 > (1 + rounding) * c(i, i) * c(k, k)
    end do
    products = c(1, 1) * c(2, 2) * c(3, 3)
    mixed = c(1, 1) * c(2, 3)**2 + c(2, 2) * c(1, 3)**2 + c(3, 3) * c(1, 2)**2 - 2 * c(1, 2) * c(2, 3) * c(1, 3)
    negative_somewhere = negative_somewhere .or. mixed > (1 + rounding) * products
  end function negative_somewhere

  subroutine read_supports(groups, units, supports, error)
    type(group_type), intent(in) :: groups(:)
    type(units_type), intent(in) :: units
    type(support_type), allocatable, intent(out) :: supports(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: axes
    integer :: i

    allocate(supports(size(groups)))
    do i = 1, size(groups)
      associate (support => supports(i), group => groups(i))
        call read(group, support_keys, "position", support%position, error, units)
        if (.not. allocated(error)) call read(group, support_keys, "stiffness", support%stiffness, error, units)
        if (.not. allocated(error)) call read(group, support_keys, "damping", support%damping, error, units)
        if (.not. allocated(error)) call read(group, support_keys, "angle", support%angle, error, units)
        if (.not. allocated(error)) call read(group, support_keys, "axes", axes, error)
        if (allocated(error)) return
        support%turning = axes == "frame"
        if (all(ieee_is_finite(stiffness_matrix([support])) .and. ieee_is_finite(damping_matrix([support])))) cycle
        call input_error(group, "position", "so far from F its stiffness or damping about F overflows", error)
        return
      end associate
    end do
  end subroutine read_supports

  !> Gravity (m/s^2) along xi and eta; without a group there is none.
  subroutine read_gravity(groups, units, gravity, error)
    type(group_type), intent(in) :: groups(:)
    type(units_type), intent(in) :: units
    real(dp), intent(out) :: gravity(2)
    type(error_type), allocatable, intent(out) :: error
    !> Along an axis the other component is zero, not its rounding.
    real(dp), parameter :: rounding = 4 * epsilon(1.0_dp)
    real(dp) :: acceleration, direction

    gravity = 0
    if (size(groups) == 0) return
    call read(groups(1), gravity_keys, "acceleration", acceleration, error)
    if (.not. allocated(error)) call read(groups(1), gravity_keys, "direction", direction, error, units)
    if (allocated(error)) return
    gravity = [cos(direction), sin(direction)]
    gravity = acceleration * merge(gravity, 0.0_dp, abs(gravity) > rounding)
  end subroutine read_gravity

  !> Key `dof`: numbers of the free degrees of freedom, each once, in the order of the matrices.
  subroutine read_dof(group, free, error)
    type(group_type), intent(in) :: group
    integer, allocatable, intent(out) :: free(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: names(:)
    integer :: i

    call read(group, frame_keys, "dof", names, error)
    if (allocated(error)) return
    free = pack([1, 2, 3], [(any(names == dof_names(i)), i = 1, 3)])
    if (size(free) /= size(names)) call input_error(group, "dof", "names a degree of freedom twice", error)
  end subroutine read_dof

end module gestell_input_machine_frame
