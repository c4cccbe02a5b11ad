!> Describes the machine of the input in JSON, for programs that show or change it: its numbers and words with their units and
!> ranges, and the scenes from which it is drawn.
module gestell_task_registry_machine_json
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_key, only: integer_key, key_type, text_key
  use gestell_base_text, only: either, exact, newline, text
  use gestell_input_namelist_document, only: document_type, entry_type, group_type, name_of
  use gestell_input_schema, only: find_key_rule, schema_type
  use gestell_input_schema_locate, only: find_target, target_type
  use gestell_input_schema_units, only: unit_symbol, units_type
  use gestell_input_wording, only: shown
  use gestell_output_json, only: json_string
  use gestell_task_common_configuration, only: configuration_type
  implicit none (type, external)
  private

  public :: list_parameters, machine_json

contains

  !> JSON object with the members `parameters`, one for each key that the input contains, and `scenes`.
  function machine_json(configuration, scenes) result(words)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: scenes
    character(len=:), allocatable :: words
    type(error_type), allocatable :: error

    ! Without a path, the list cannot fail
    call list_parameters(configuration%document, configuration%schema, configuration%units, words, error)
    words = "{""parameters"": " // words // "," // newline // """scenes"": " // scenes // "}"
  end function machine_json

  !> JSON array with an object for each key that the document contains, or for each group in which `path` denotes a key. If the path
  !> denotes an element, the objects contain only this element. Fails if the path denotes nothing, or no value of the input.
  subroutine list_parameters(document, schema, units, words, error, path)
    !> Normalised document (see `normalise`)
    type(document_type), intent(in) :: document
    type(schema_type), intent(in) :: schema
    type(units_type), intent(in) :: units
    character(len=:), allocatable, intent(out) :: words
    type(error_type), allocatable, intent(out) :: error
    character(len=*), intent(in), optional :: path
    type(target_type) :: target
    type(growing_text_type) :: all
    integer :: i, k

    if (present(path)) call find_target(document, schema, path, shown(path) // ": ", target, error)
    if (allocated(error)) return
    do i = 1, size(document%groups)
      if (present(path)) then
        if (.not. any(target%groups == i)) cycle
      end if
      associate (group => document%groups(i))
        do k = 1, size(group%entries)
          if (present(path)) then
            if (group%entries(k)%key /= target%key) cycle
            if (.not. has_value(group%entries(k), target%element)) cycle
          else if (group%entries(k)%key == "name") then
            cycle
          end if
          call all%append("," // newline // parameter_json(group, group%entries(k), schema%keys(find_key_rule(schema, group%name, &
            & group%entries(k)%key)), units, target%element))
        end do
      end associate
    end do
    words = all%whole()
    if (present(path) .and. words == "") call fatal_error(error, shown(path) // ": has no value in the input", invalid_input)
    words = "[" // words(min(2, len(words) + 1):) // "]"
  end subroutine list_parameters

  !> True if the input gives this element of a key or, for 0, any of its elements.
  pure logical function has_value(entry, element)
    type(entry_type), intent(in) :: entry
    integer, intent(in) :: element
    integer :: i

    has_value = any([(allocated(entry%values(i)%text) .and. (element == 0 .or. element == i), i = 1, size(entry%values))])
  end function has_value

  !> JSON object that describes one key of a group, with its value number `element` or, for 0, all its values. Its path is the one
  !> that --set takes.
  function parameter_json(group, entry, rule, units, element) result(words)
    type(group_type), intent(in) :: group
    type(entry_type), intent(in) :: entry
    type(key_type), intent(in) :: rule
    type(units_type), intent(in) :: units
    integer, intent(in) :: element
    character(len=:), allocatable :: words, path
    integer :: i, first, last

    path = group%name
    if (len(name_of(group)) > 0) then
      path = path // "(" // name_of(group) // ")"
    else if (group%number > 0) then
      path = path // "(" // text(group%number) // ")"
    end if
    words = "{""path"": " // json_string(path // "." // entry%key) // ", ""values"": ["
    first = max(element, 1)
    last = merge(element, size(entry%values), element > 0)
    do i = first, last
      words = words // either(", ", "", i > first) // value_json(entry, rule, i)
    end do
    words = words // "], ""unit"": " // json_string(trim(unit_symbol(rule, element, units, element == 0))) // ", ""meaning"": " &
      & // json_string(trim(rule%meaning))
    if (rule%kind /= text_key) words = words // ", ""least"": " // bound(rule%range%least) // ", ""most"": " &
      & // bound(rule%range%most) // ", ""positive"": " // either("true", "false", rule%range%above_zero)
    if (rule%kind == integer_key) words = words // ", ""whole"": true"
    if (entry%rank == 1 .and. element == 0) words = words // ", ""list"": true"
    if (entry%rank == 2) words = words // ", ""rows"": " // text(entry%rows)
    if (rule%words /= "") words = words // ", ""words"": " // json_string(trim(rule%words))
    words = words // "}"
  end function parameter_json

  !> A value as typed; null if the input does not give this element.
  function value_json(entry, rule, i) result(word)
    type(entry_type), intent(in) :: entry
    type(key_type), intent(in) :: rule
    integer, intent(in) :: i
    character(len=:), allocatable :: word

    associate (value => entry%values(i))
      if (.not. allocated(value%text)) then
        word = "null"
      else if (rule%kind == text_key) then
        word = json_string(value%text)
      else if (rule%kind == integer_key) then
        word = text(nint(value%number))
      else
        word = exact(value%number)
      end if
    end associate
  end function value_json

  !> A bound of a range; null if there is none.
  function bound(value) result(word)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: word

    word = "null"
    if (abs(value) < huge(value)) word = exact(value)
  end function bound

end module gestell_task_registry_machine_json
