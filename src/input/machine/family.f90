!> Defines families of machines for sweeps and sensitivities: in a family, some values of an input file are variable parameters.
module gestell_input_machine_family
  use gestell_base_error, only: error_type, impossible_mechanism
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: document_type, find_entry
  use gestell_input_machine_frame, only: frame_data_type, read_drive_and_frame, read_frame
  use gestell_input_schema_locate, only: find_target, target_type
  use gestell_input_machine_mechanism, only: read_mechanism
  use gestell_input_schema_path, only: set_path_real
  use gestell_input_schema, only: find_group_rule, mechanism_group, option_group, schema_type
  use gestell_input_wording, only: lower
  use gestell_input_schema_units, only: units_type
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_joint, only: form_type
  use gestell_model_joints_types_registry, only: joint_forms
  use gestell_model_mechanism, only: mechanism_type
  use gestell_system_family, only: family_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: new_document_family

  !> Place in the document (group, key and element) of a number that depends on a parameter
  type :: location_type
    integer :: parameter = 0, group = 0, entry = 0, element = 0
  end type location_type

  !> All frames that result from a document for different values of its parameters. Only one thread at a time may use this object,
  !> because reading documents is not thread-safe.
  type, extends(family_type), public :: document_family_type
    private
    !> Groups of the document that are read again for every member of the family
    type(document_type) :: doc
    type(units_type) :: units
    !> Definitions of all joint types
    type(form_type), allocatable :: forms(:)
    !> For each parameter: path of the value or values that it changes
    character(len=word_length), allocatable :: paths(:)
    !> Places in the document of the numbers that depend on parameters; only the first `located` elements are used
    type(location_type), allocatable :: locations(:)
    integer :: located = 0
    !> True if a parameter p is a relative change: the numbers at its places are multiplied by 1 + p. False if p replaces the
    !> numbers
    logical :: relative = .false.
    !> `mechanism`: the evaluated mechanism, which all members of the family share; unallocated if a parameter changes it.
    !> `impossible`: reason why this mechanism cannot be assembled
    class(mechanism_type), allocatable :: mechanism
    type(error_type), allocatable :: impossible
  contains
    procedure :: member, shares_mechanism, check
  end type document_family_type

contains

  !> Creates a family whose parameters are the values at some paths of a document. Fails if a path denotes nothing, or if the
  !> mechanism is invalid. If `start` is present, each path must denote exactly one number.
  subroutine new_document_family(family, doc, schema, units, paths, error, start)
    type(document_family_type), intent(out) :: family
    !> The checked input
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    !> Units in which the document gives numbers
    type(units_type), intent(in) :: units
    !> Path of the value or values that each parameter changes, written as for --set
    character(len=*), intent(in) :: paths(:)
    type(error_type), allocatable, intent(out) :: error
    !> If present, each parameter replaces the number at its path, and `start` contains a valid value of each parameter. If
    !> absent, each parameter p multiplies all numbers at its path by 1 + p. Numbers that the document does not contain stay
    !> missing
    real(dp), intent(in), optional :: start(:)
    integer :: k
    logical :: moves

    family%units = units
    family%paths = paths
    family%relative = .not. present(start)
    allocate(family%locations(8))
    call joint_forms(family%forms)
    moves = any([(subject(schema, lower(paths(k)(:scan(paths(k) // ".", "(.") - 1))) == mechanism_group, k = 1, size(paths))])
    if (.not. moves) then
      call read_mechanism(doc, units, family%mechanism, error, family%forms)
      if (allocated(error)) return
      call family%mechanism%prepare(family%impossible)
      if (allocated(family%impossible)) then
        if (family%impossible%code /= impossible_mechanism) call move_alloc(family%impossible, error)
        if (allocated(error)) return
      end if
    end if
    call select_groups(doc, schema, moves, family%doc)
    if (present(start)) then
      do k = 1, size(paths)
        call set_path_real(family%doc, schema, trim(paths(k)), start(k), error)
        if (allocated(error)) return
      end do
    end if
    do k = 1, size(paths)
      call add_locations(family, schema, k, error)
      if (allocated(error)) return
    end do
  end subroutine new_document_family

  !> Part of the input that a group describes: `option_group`, `frame_group` or `mechanism_group`.
  pure integer function subject(schema, group)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group
    integer :: i

    subject = option_group
    i = find_group_rule(schema, group)
    if (i > 0) subject = schema%groups(i)%subject
  end function subject

  !> Selects the groups that are read again for each member of the family. Groups of the mechanism are selected only if
  !> `mechanism` is true. &mechanism and &repeat are always selected, because a frame that moves in three dimensions depends on
  !> the positions of its mechanisms.
  pure subroutine select_groups(doc, schema, mechanism, selected)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    logical, intent(in) :: mechanism
    type(document_type), intent(out) :: selected
    integer :: i
    character(len=9), parameter :: places(2) = [character(len=9) :: "mechanism", "repeat"]
    logical :: is_selected(size(doc%groups))

    do i = 1, size(doc%groups)
      is_selected(i) = subject(schema, doc%groups(i)%name) /= option_group .and. &
        & (mechanism .or. any(places == doc%groups(i)%name) .or. subject(schema, doc%groups(i)%name) /= mechanism_group)
    end do
    selected%file = doc%file
    selected%normalised = doc%normalised
    selected%groups = doc%groups(pack([(i, i = 1, size(is_selected))], is_selected))
  end subroutine select_groups

  !> Appends to the family the places of all numbers at the path of parameter `k`.
  pure subroutine add_locations(family, schema, k, error)
    type(document_family_type), intent(inout) :: family
    type(schema_type), intent(in) :: schema
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    type(target_type) :: target
    integer :: i, e, v

    call find_target(family%doc, schema, trim(family%paths(k)), "", target, error)
    if (allocated(error)) return
    do i = 1, size(target%groups)
      e = find_entry(family%doc%groups(target%groups(i)), target%key)
      if (e == 0) cycle
      do v = 1, size(family%doc%groups(target%groups(i))%entries(e)%values)
        if (target%element > 0 .and. v /= target%element) cycle
        if (family%located == size(family%locations)) family%locations = [family%locations, family%locations]
        family%located = family%located + 1
        family%locations(family%located) = location_type(k, target%groups(i), e, v)
      end do
    end do
  end subroutine add_locations

  !> Builds the frame for given values of the parameters. If the values are invalid, the error message quotes the parameters.
  subroutine member(self, parameters, system, error)
    class(document_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(frame_type), allocatable :: frame
    class(mechanism_type), allocatable :: mechanism
    type(document_type) :: doc
    type(error_type), allocatable :: worded

    if (allocated(self%impossible)) then
      allocate(error, source=self%impossible)
      return
    end if
    call set_numbers(self, parameters, .false., doc)
    allocate(frame)
    if (allocated(self%mechanism)) then
      call read_frame(doc, self%units, self%mechanism, frame, error)
    else
      call read_mechanism(doc, self%units, mechanism, error, self%forms)
      if (.not. allocated(error)) call read_frame(doc, self%units, mechanism, frame, error)
    end if
    if (.not. allocated(error)) then
      call move_alloc(frame, system)
    else if (error%code /= impossible_mechanism) then
      call self%check(parameters, worded)
      if (allocated(worded)) call move_alloc(worded, error)
    end if
  end subroutine member

  !> True if no parameter changes the mechanism. It is then evaluated only once for all members.
  pure logical function shares_mechanism(self)
    class(document_family_type), intent(in) :: self

    shares_mechanism = allocated(self%mechanism)
  end function shares_mechanism

  !> Checks values of the parameters without evaluating the mechanism. Fails if a value is invalid; the error message then quotes
  !> the parameters instead of the values in the file.
  subroutine check(self, parameters, error)
    class(document_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(frame_data_type) :: data
    class(mechanism_type), allocatable :: mechanism

    call set_numbers(self, parameters, .true., doc)
    if (.not. allocated(self%mechanism)) call read_mechanism(doc, self%units, mechanism, error, self%forms)
    if (.not. allocated(error)) call read_drive_and_frame(doc, self%units, data, error)
  end subroutine check

  !> Returns the document after the values of the parameters have been inserted. If `named` is true, error messages about an
  !> inserted number quote the parameter's path and this number.
  subroutine set_numbers(self, parameters, named, doc)
    class(document_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    logical, intent(in) :: named
    type(document_type), intent(out) :: doc
    integer :: i

    doc = self%doc
    do i = 1, self%located
      associate (p => self%locations(i))
        associate (value => doc%groups(p%group)%entries(p%entry)%values(p%element))
          if (self%relative) then
            value%number = value%number * (1 + parameters(p%parameter))
          else
            value%number = parameters(p%parameter)
          end if
          if (.not. (named .and. allocated(value%text))) cycle
          value%text = concise(value%number)
          value%origin = trim(self%paths(p%parameter)) // " = " // value%text
        end associate
      end associate
    end do
  end subroutine set_numbers

end module gestell_input_machine_family
