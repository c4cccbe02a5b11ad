!> Reads the plan of the task `sensitivity`: the parameters, and the family of machines in which they are varied.
module gestell_task_sensitivity_plan
  use gestell_base_error, only: error_type
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: count_groups, document_type, find_entry, group_type, has, name_of, group_named
  use gestell_input_machine_family, only: document_family_type, new_document_family
  use gestell_base_key, only: real_key
  use gestell_base_text, only: text
  use gestell_input_schema_read, only: read
  use gestell_input_schema_locate, only: find_target, target_type
  use gestell_input_namelist_message, only: locate_in_group, input_error
  use gestell_input_schema, only: find_group_rule, option_group, schema_type
  use gestell_input_schema_units, only: units_type
  use gestell_task_sensitivity_keys, only: sensitivity_keys
  implicit none (type, external)
  private

  public :: read_sensitivity

  !> Plan of a sensitivity analysis: what is varied.
  type, public :: sensitivity_plan_type
    !> Paths of the parameters, for example "frame.mass". If a path refers to several numbers, all of them change together.
    character(len=word_length), allocatable :: paths(:)
    !> Family of machines that differ from the unchanged machine by relative changes of parameters.
    type(document_family_type) :: family
  end type sensitivity_plan_type

  !> Maximum number of supports that are varied one by one by default. If there are more, only all supports together are varied.
  integer, parameter :: most_supports = 100

contains

  !> Reads the plan from a checked input document. Fails if a path does not refer to a number of the machine, refers only to zeros,
  !> or is given twice.
  subroutine read_sensitivity(doc, schema, units, plan, error)
    !> The checked input document
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    type(units_type), intent(in) :: units
    !> The parameters, and the machine as a function of their relative changes
    type(sensitivity_plan_type), intent(out) :: plan
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    integer :: i

    group = group_named(doc, "sensitivity")
    if (has(group, "parameters")) then
      call read(group, sensitivity_keys, "parameters", plan%paths, error)
      do i = 1, size(plan%paths)
        if (allocated(error)) return
        plan%paths(i) = adjustl(plan%paths(i))
        call check_path(doc, schema, group, trim(plan%paths(i)), error)
        if (.not. allocated(error) .and. any(plan%paths(:i - 1) == plan%paths(i))) call input_error(group, "parameters", &
          & "names '" // trim(plan%paths(i)) // "' twice", error)
      end do
    else
      call default_paths(doc, schema, plan%paths)
    end if
    if (allocated(error)) return
    call new_document_family(plan%family, doc, schema, units, plan%paths, error)
    if (allocated(error) .and. has(group, "parameters")) call locate_in_group(group, error)
  end subroutine read_sensitivity

  !> Checks a path. Fails if it does not refer to a number of the machine, or refers only to numbers that are zero or missing.
  subroutine check_path(doc, schema, group, path, error)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: path
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: reason
    type(target_type) :: target

    call find_target(doc, schema, path, "", target, reason)
    if (allocated(reason)) then
      call input_error(group, "parameters", reason%message, error)
    else if (schema%keys(target%rule)%kind /= real_key .or. &
      & schema%groups(find_group_rule(schema, schema%keys(target%rule)%group))%subject == option_group) then
      call input_error(group, "parameters", "'" // path // "' is not a numerical key of the machine", error)
    else if (.not. is_nonzero(doc, target)) then
      call input_error(group, "parameters", "'" // path // "' is zero or not given, so it cannot be changed by a percentage", error)
    end if
  end subroutine check_path

  !> True if at least one of the numbers to which `target` refers is given and is not zero.
  pure logical function is_nonzero(doc, target)
    type(document_type), intent(in) :: doc
    type(target_type), intent(in) :: target
    integer :: i, e, v

    is_nonzero = .false.
    do i = 1, size(target%groups)
      associate (group => doc%groups(target%groups(i)))
        e = find_entry(group, target%key)
        if (e == 0) cycle
        do v = 1, size(group%entries(e)%values)
          if (target%element > 0 .and. v /= target%element) cycle
          is_nonzero = is_nonzero .or. abs(group%entries(e)%values(v)%number) > 0
        end do
      end associate
    end do
  end function is_nonzero

  !> Finds the parameters that are varied by default: those among speed, masses, moments of inertia, stiffness and damping that are
  !> given and not zero.
  subroutine default_paths(doc, schema, paths)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    character(len=word_length), allocatable, intent(out) :: paths(:)
    character(len=*), parameter :: single(*) = [character(len=20) :: "drive.speed_rpm", "frame.mass", "frame.inertia"]
    character(len=*), parameter :: mounting(*) = [character(len=24) :: "support.stiffness", "support.damping", &
      & "support.damping_ratio", "foundation.stiffness", "foundation.damping", "foundation.damping_ratio"]
    integer :: i, n, used, supports

    supports = count_groups(doc, "support")
    allocate(paths(size(single) + 2 * count_groups(doc, "link") + size(mounting) + 3 * supports))
    used = 0
    do i = 1, size(single)
      call add(trim(single(i)))
    end do
    do i = 1, size(doc%groups)
      if (doc%groups(i)%name /= "link") cycle
      call add("link(" // name_of(doc%groups(i)) // ").mass")
      call add("link(" // name_of(doc%groups(i)) // ").inertia")
    end do
    do i = 1, size(mounting)
      call add(trim(mounting(i)))
      if (index(mounting(i), "support.") /= 1 .or. supports < 2 .or. supports > most_supports) cycle
      do n = 1, supports
        call add("support(" // text(n) // ")" // trim(mounting(i)(8:)))
      end do
    end do
    paths = paths(:used)

  contains

    !> Adds a path to the list if it refers to a number that is not zero.
    subroutine add(path)
      character(len=*), intent(in) :: path
      type(target_type) :: target
      type(error_type), allocatable :: failure

      if (len(path) > word_length) return
      call find_target(doc, schema, path, "", target, failure)
      if (allocated(failure)) return
      if (.not. is_nonzero(doc, target)) return
      used = used + 1
      paths(used) = path
    end subroutine add

  end subroutine default_paths

end module gestell_task_sensitivity_plan
