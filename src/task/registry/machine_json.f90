!> Describes the machine of the input in JSON, for programs that show or change it: its numbers and words with their units and
!> ranges, and the scenes from which it is drawn.
module gestell_task_registry_machine_json
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_key, only: integer_key, key_type, text_key
  use gestell_base_text, only: either, exact, newline, text
  use gestell_input_namelist_document, only: entry_type, group_type, name_of
  use gestell_input_schema, only: find_key_rule
  use gestell_input_schema_units, only: unit_symbol, units_type
  use gestell_output_json, only: json_string
  use gestell_task_common_configuration, only: configuration_type
  implicit none (type, external)
  private

  public :: machine_json

contains

  !> JSON object with the members `parameters`, one for each key that the input contains, and `scenes`.
  function machine_json(configuration, scenes) result(words)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: scenes
    character(len=:), allocatable :: words
    type(growing_text_type) :: all
    integer :: i, k

    associate (groups => configuration%document%groups, schema => configuration%schema)
      do i = 1, size(groups)
        do k = 1, size(groups(i)%entries)
          associate (entry => groups(i)%entries(k))
            if (entry%key == "name") cycle
            call all%append("," // newline // parameter_json(groups(i), entry, schema%keys(find_key_rule(schema, groups(i)%name, &
              & entry%key)), configuration%units))
          end associate
        end do
      end do
    end associate
    words = all%whole()
    words = "{""parameters"": [" // words(min(2, len(words) + 1):) // "]," // newline // """scenes"": " // scenes // "}"
  end function machine_json

  !> JSON object that describes one key of a group. Its path is the one that --set takes.
  function parameter_json(group, entry, rule, units) result(words)
    type(group_type), intent(in) :: group
    type(entry_type), intent(in) :: entry
    type(key_type), intent(in) :: rule
    type(units_type), intent(in) :: units
    character(len=:), allocatable :: words, path
    integer :: i

    path = group%name
    if (len(name_of(group)) > 0) then
      path = path // "(" // name_of(group) // ")"
    else if (group%number > 0) then
      path = path // "(" // text(group%number) // ")"
    end if
    words = "{""path"": " // json_string(path // "." // entry%key) // ", ""values"": ["
    do i = 1, size(entry%values)
      words = words // either(", ", "", i > 1) // value_json(entry, rule, i)
    end do
    words = words // "], ""unit"": " // json_string(unit_symbol(rule, 0, units, .true.)) // ", ""meaning"": " &
      & // json_string(trim(rule%meaning))
    if (rule%kind /= text_key) words = words // ", ""least"": " // bound(rule%range%least) // ", ""most"": " &
      & // bound(rule%range%most) // ", ""positive"": " // either("true", "false", rule%range%above_zero)
    if (rule%kind == integer_key) words = words // ", ""whole"": true"
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
