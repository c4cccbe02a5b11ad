!> Families of machines for sweeps and sensitivities: some values of an input file become parameters.
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

  !> Where the document contains a number that depends on a parameter
  type :: location_type
    integer :: parameter = 0, group = 0, entry = 0, element = 0
  end type location_type

  !> The frames that a document describes for different values of its parameters. Only one thread at a time may use it: reading
  !> documents is not thread-safe.
  type, extends(family_type), public :: document_family_type
    private
    !> Groups that are read again for every member
    type(document_type) :: doc
    type(units_type) :: units
    !> Definitions of all types of joints
    type(form_type), allocatable :: forms(:)
    !> Path of each parameter
    character(len=word_length), allocatable :: paths(:)
    !> Where the document contains the numbers that depend on parameters; only the first `located` elements are used
    type(location_type), allocatable :: locations(:)
    integer :: located = 0
    !> True if a parameter p multiplies the numbers at its locations by 1 + p; false if it replaces them
    logical :: relative = .false.
    !> The mechanism, evaluated once, if no parameter changes it. `impossible`: reason why it cannot be assembled
    class(mechanism_type), allocatable :: mechanism
    type(error_type), allocatable :: impossible
  contains
    procedure :: member
    procedure :: shares_mechanism
    procedure :: check
  end type document_family_type

contains

  !> Makes the values at some paths of a document the parameters of a family. Fails if a path denotes nothing, or if the mechanism
  !> is invalid. With `start`, a path must denote exactly one number.
  subroutine new_document_family(family, doc, schema, units, paths, error, start)
    type(document_family_type), intent(out) :: family
    !> The checked input
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    !> Units of the input
    type(units_type), intent(in) :: units
    !> Path of each parameter, as for --set
    character(len=*), intent(in) :: paths(:)
    type(error_type), allocatable, intent(out) :: error
    !> If present, a parameter is the number at its path, and `start` holds any valid value of each. If absent, a parameter is the
    !> relative change of all numbers at its path: 0 gives the machine of the document, and missing numbers stay missing
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

  !> What a group describes: `option_group`, `frame_group` or `mechanism_group`.
  pure integer function subject(schema, group)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group
    integer :: i

    subject = option_group
    i = find_group_rule(schema, group)
    if (i > 0) subject = schema%groups(i)%subject
  end function subject

  !> Selects the groups from which a member is read. They always include &mechanism and &repeat, because a frame in space depends on
  !> the position of its mechanisms.
  pure subroutine select_groups(doc, schema, mechanism, selected)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    logical, intent(in) :: mechanism
    type(document_type), intent(out) :: selected
    integer :: i, n
    character(len=9), parameter :: places(2) = [character(len=9) :: "mechanism", "repeat"]
    logical :: is_selected(size(doc%groups))

    do i = 1, size(doc%groups)
      is_selected(i) = subject(schema, doc%groups(i)%name) /= option_group .and. &
        & (mechanism .or. any(places == doc%groups(i)%name) .or. subject(schema, doc%groups(i)%name) /= mechanism_group)
    end do
    selected%file = doc%file
    selected%normalised = doc%normalised
    allocate(selected%groups(count(is_selected)))
    n = 0
    do i = 1, size(doc%groups)
      if (.not. is_selected(i)) cycle
      n = n + 1
      selected%groups(n) = doc%groups(i)
    end do
  end subroutine select_groups

  !> Adds the locations of the numbers at the path of parameter `k`.
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

  !> Builds the frame for given parameters. If they are invalid, the error message quotes the parameters.
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

  !> True if all members have the same mechanism, which is then evaluated only once.
  pure logical function shares_mechanism(self)
    class(document_family_type), intent(in) :: self

    shares_mechanism = allocated(self%mechanism)
  end function shares_mechanism

  !> Checks the parameters without evaluating the mechanism. Fails if they are invalid; the message then quotes the parameters
  !> rather than the values in the file.
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

  !> Returns the document with the parameters inserted. If `named`, messages about these numbers quote the path and the number.
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
