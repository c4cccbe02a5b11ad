!> Input files as the reference's data, for the tests. Only reading is the library's; kinematics and equations are not.
module data_files
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_input_schema_check, only: check_document
  use gestell_input_namelist_document, only: document_type, group_names, group_type, groups_named, has, the_group, word_length
  use gestell_input_schema_get, only: get
  use gestell_input_namelist, only: read_document
  use gestell_input_schema, only: input_schema
  use gestell_input_schema_units, only: find_unit, unit_type
  use reference_machine, only: joint_data, machine_data
  implicit none (type, external)
  private

  public :: machine_of_file

contains

  !> The machine of an input file in the project's folder.
  subroutine machine_of_file(file, machine, error)
    character(len=*), intent(in) :: file
    type(machine_data), intent(out) :: machine
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(group_type), allocatable :: joints(:), links(:), supports(:)
    type(unit_type) :: length, inertia, stiffness, damping
    character(len=word_length), allocatable :: freedoms(:)
    character(len=:), allocatable :: from, to
    integer :: i

    call read_document(file, doc, error)
    if (.not. allocated(error)) call check_document(doc, input_schema(), error)
    if (allocated(error)) return
    length = unit_in(doc, "length", "m")
    inertia = unit_in(doc, "inertia", "kg m^2")
    stiffness = unit_in(doc, "stiffness", "N/m")
    damping = unit_in(doc, "damping", "N s/m")

    allocate(joints, source=groups_named(doc, "joint"))
    allocate(machine%joints(size(joints)))
    do i = 1, size(joints)
      call read_joint(joints(i), joints, length, machine%joints(i), error)
    end do
    allocate(links, source=groups_named(doc, "link"))
    allocate(machine%links(size(links)))
    do i = 1, size(links)
      associate (link => machine%links(i))
        call get(links(i), "from", from, error)
        link%from = findloc(group_names(joints) == from, .true., dim=1)
        if (has(links(i), "to")) then
          call get(links(i), "to", to, error)
          link%to = findloc(group_names(joints) == to, .true., dim=1)
        end if
        call get(links(i), "mass", link%mass, error)
        call get(links(i), "inertia", link%inertia, error, unit=inertia)
        call get(links(i), "center", link%center, error, default=0.0_dp, unit=length)
      end associate
    end do
    allocate(supports, source=groups_named(doc, "support"))
    allocate(machine%supports(size(supports)))
    do i = 1, size(supports)
      associate (support => machine%supports(i))
        call get(supports(i), "position", support%position, error, unit=length)
        call get(supports(i), "stiffness", support%stiffness, error, unit=stiffness)
        call get(supports(i), "damping", support%damping, error, default=0.0_dp, unit=damping)
        call get(supports(i), "angle", support%angle_deg, error, default=0.0_dp)
      end associate
    end do
    call get(the_group(doc, "foundation"), "stiffness", machine%foundation_stiffness, error, default=0.0_dp)
    call get(the_group(doc, "foundation"), "damping", machine%foundation_damping, error, default=0.0_dp)
    call get(the_group(doc, "frame"), "mass", machine%frame_mass, error)
    call get(the_group(doc, "frame"), "inertia", machine%frame_inertia, error, unit=inertia)
    call get(the_group(doc, "frame"), "origin", machine%origin, error, unit=length)
    call get(the_group(doc, "frame"), "dof", freedoms, error, default=["xi ", "eta", "psi"])
    machine%free = [any(freedoms == "xi"), any(freedoms == "eta"), any(freedoms == "psi")]
    call get(the_group(doc, "drive"), "speed_rpm", machine%speed_rpm, error)
  end subroutine machine_of_file

  function unit_in(doc, quantity, si_name) result(unit)
    type(document_type), intent(in) :: doc
    character(len=*), intent(in) :: quantity, si_name
    type(unit_type) :: unit
    character(len=:), allocatable :: name
    type(error_type), allocatable :: error

    call get(the_group(doc, "units"), quantity, name, error, default=si_name)
    unit = find_unit(quantity, name)
  end function unit_in

  !> What the joint's type does not use stays at its default.
  subroutine read_joint(group, joints, length, joint, error)
    type(group_type), intent(in) :: group, joints(:)
    type(unit_type), intent(in) :: length
    type(joint_data), intent(inout) :: joint
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: kind, pivot
    character(len=word_length), allocatable :: words(:)
    integer :: k

    call get(group, "type", kind, error)
    joint%kind = kind
    call get(group, "position", joint%position, error, default=0.0_dp, unit=length)
    call get(group, "radius", joint%radius, error, default=0.0_dp, unit=length)
    call get(group, "phase", joint%phase_deg, error, default=0.0_dp)
    call get(group, "lengths", joint%lengths, error, default=0.0_dp, unit=length)
    call get(group, "branch", joint%branch, error, default=1)
    call get(group, "offset", joint%offset, error, default=0.0_dp, unit=length)
    call get(group, "guide_point", joint%guide_point, error, default=0.0_dp, unit=length)
    call get(group, "guide_angle", joint%guide_angle_deg, error, default=0.0_dp)
    call get(group, "slot_angle", joint%slot_angle_deg, error, default=90.0_dp)
    if (has(group, "pivot")) then
      call get(group, "pivot", pivot, error)
      joint%ends(1) = findloc(group_names(joints) == pivot, .true., dim=1)
    end if
    if (has(group, "ends")) then
      call get(group, "ends", words, error)
      do k = 1, size(words)
        joint%ends(k) = findloc(group_names(joints) == words(k), .true., dim=1)
      end do
    end if
    if (has(group, "guide")) then
      call get(group, "guide", words, error)
      do k = 1, 2
        joint%guide(k) = findloc(group_names(joints) == words(k), .true., dim=1)
      end do
    end if
  end subroutine read_joint

end module data_files
