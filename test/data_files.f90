!> Input files as the reference's data, for the tests. The library only reads them; kinematics and equations are the
!> reference's.
module data_files
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_input_schema_check, only: check_document
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: document_type, group_names, group_type, groups_named, has, group_named
  use gestell_base_key, only: key_type
  use gestell_input_machine_frame, only: drive_keys, foundation_keys, frame_keys, support_keys
  use gestell_input_machine_groups, only: read_units
  use gestell_input_machine_mechanism, only: link_keys
  use gestell_input_machine_joints, only: joint_keys
  use gestell_input_schema_read, only: read
  use gestell_input_namelist, only: read_document
  use gestell_task_registry, only: input_schema
  use gestell_input_schema_units, only: units_type
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
    type(units_type) :: units
    character(len=word_length), allocatable :: freedoms(:)
    character(len=:), allocatable :: from, to
    integer :: i

    call read_document(file, doc, error)
    if (.not. allocated(error)) call check_document(doc, input_schema(), error)
    if (allocated(error)) return
    call read_units(doc, units, error)

    allocate(joints, source=groups_named(doc, "joint"))
    allocate(machine%joints(size(joints)))
    do i = 1, size(joints)
      call read_joint(joints(i), joints, units, machine%joints(i), error)
    end do
    allocate(links, source=groups_named(doc, "link"))
    allocate(machine%links(size(links)))
    do i = 1, size(links)
      associate (link => machine%links(i))
        call read(links(i), link_keys, "from", from, error)
        link%from = findloc(group_names(joints) == from, .true., dim=1)
        if (has(links(i), "to")) then
          call read(links(i), link_keys, "to", to, error)
          link%to = findloc(group_names(joints) == to, .true., dim=1)
        end if
        call read(links(i), link_keys, "mass", link%mass, error)
        call read(links(i), link_keys, "inertia", link%inertia, error, units)
        call read(links(i), link_keys, "center", link%center, error, units, default=0.0_dp)
      end associate
    end do
    allocate(supports, source=groups_named(doc, "support"))
    allocate(machine%supports(size(supports)))
    do i = 1, size(supports)
      associate (support => machine%supports(i))
        call read(supports(i), support_keys, "position", support%position, error, units)
        call read(supports(i), support_keys, "stiffness", support%stiffness, error, units)
        call read(supports(i), support_keys, "damping", support%damping, error, units, default=0.0_dp)
        call read(supports(i), support_keys, "angle", support%angle_deg, error, default=0.0_dp)
      end associate
    end do
    call read(group_named(doc, "foundation"), foundation_keys, "stiffness", machine%foundation_stiffness, error)
    call read(group_named(doc, "foundation"), foundation_keys, "damping", machine%foundation_damping, error, default=0.0_dp)
    call read(group_named(doc, "frame"), frame_keys, "mass", machine%frame_mass, error)
    call read(group_named(doc, "frame"), frame_keys, "inertia", machine%frame_inertia, error, units)
    call read(group_named(doc, "frame"), frame_keys, "origin", machine%origin, error, units)
    call read(group_named(doc, "frame"), frame_keys, "dof", freedoms, error)
    machine%free = [any(freedoms == "xi"), any(freedoms == "eta"), any(freedoms == "psi")]
    call read(group_named(doc, "drive"), drive_keys, "speed_rpm", machine%speed_rpm, error)
  end subroutine machine_of_file

  !> Properties that the joint's type does not use keep their defaults.
  subroutine read_joint(group, joints, units, joint, error)
    type(group_type), intent(in) :: group, joints(:)
    type(units_type), intent(in) :: units
    type(joint_data), intent(inout) :: joint
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: kind, pivot
    character(len=word_length), allocatable :: words(:)
    type(key_type), allocatable :: keys(:)
    integer :: k

    allocate(keys, source=joint_keys())
    call read(group, keys, "type", kind, error)
    joint%kind = kind
    call read(group, keys, "position", joint%position, error, units, default=0.0_dp)
    call read(group, keys, "radius", joint%radius, error, units, default=0.0_dp)
    call read(group, keys, "phase", joint%phase_deg, error, default=0.0_dp)
    call read(group, keys, "lengths", joint%lengths, error, units, default=0.0_dp)
    if (has(group, "branch")) call read(group, keys, "branch", joint%branch, error)
    call read(group, keys, "offset", joint%offset, error, units, default=0.0_dp)
    call read(group, keys, "guide_point", joint%guide_point, error, units, default=0.0_dp)
    call read(group, keys, "guide_angle", joint%guide_angle_deg, error, default=0.0_dp)
    call read(group, keys, "slot_angle", joint%slot_angle_deg, error, default=90.0_dp)
    if (kind == "follower") then
      call read(group, keys, "lift", joint%lift, error, units, default=0.0_dp)
      call read(group, keys, "lift_phase", joint%phase_deg, error)
    end if
    if (kind == "cylinder") call read(group, keys, "stroke", joint%lift, error, units, default=0.0_dp)
    if (has(group, "pivot")) then
      call read(group, keys, "pivot", pivot, error)
      joint%ends(1) = findloc(group_names(joints) == pivot, .true., dim=1)
    end if
    if (has(group, "ends") .or. has(group, "cam")) then
      call read(group, keys, trim(merge("cam ", "ends", has(group, "cam"))), words, error)
      do k = 1, size(words)
        joint%ends(k) = findloc(group_names(joints) == words(k), .true., dim=1)
      end do
    end if
    if (has(group, "guide")) then
      call read(group, keys, "guide", words, error)
      do k = 1, 2
        joint%guide(k) = findloc(group_names(joints) == words(k), .true., dim=1)
      end do
    end if
  end subroutine read_joint

end module data_files
