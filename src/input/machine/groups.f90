!> Lists the input groups that describe the machine, and the keys of these groups. Reads the units of the input.
module gestell_input_machine_groups
  use gestell_base_error, only: error_type
  use gestell_base_key, only: joined, key_type, of_pressure, quantities, text_key
  use gestell_base_words, only: word_length
  use gestell_input_machine_frame, only: drive_keys, foundation_keys, frame_keys, frame_words, gravity_keys, support_keys
  use gestell_input_machine_joints, only: joint_keys, joint_variants
  use gestell_input_machine_loading, only: load_keys, load_words
  use gestell_input_machine_mechanism, only: link_keys, mass_function_keys
  use gestell_input_machine_mechanisms, only: mechanism_keys, repeat_keys
  use gestell_input_machine_quantities, only: probe_keys
  use gestell_input_namelist_document, only: document_type, group_named, group_type, has
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema, only: frame_group, group_rule, mechanism_group, schema_type
  use gestell_input_schema_read, only: read
  use gestell_input_schema_units, only: find_unit, of_results, quantity_names, unit_names, units_type
  implicit none (type, external)
  private

  public :: machine_schema, read_units

  type(group_rule), parameter :: groups(*) = [ &
    & group_rule("drive", "speed of the crank, and what keeps this speed constant", required=.true., subject=frame_group), &
    & group_rule("units", "units of the numbers in all groups except `&mass_functions`, and units of the results"), &
    & group_rule("mechanism", "position and gear ratio of one of several mechanisms on the frame", repeatable=.true., &
    &   subject=mechanism_group), &
    & group_rule("repeat", "a copy of a mechanism, with all its joints and links", repeatable=.true., subject=mechanism_group), &
    & group_rule("joint", "a joint of the mechanism: fixed pivot, crank pin, slider, ...", repeatable=.true., &
    &   subject=mechanism_group), &
    & group_rule("link", "a rigid body attached to joints of the mechanism", repeatable=.true., subject=mechanism_group), &
    & group_rule("load", "a force or moment between links, frame and ground over the crank angle", repeatable=.true., &
    &   subject=mechanism_group), &
    & group_rule("mass_functions", "sums over the moving masses, in SI units; replaces joints and links", &
    &   subject=mechanism_group), &
    & group_rule("frame", "mass, inertia and degrees of freedom of the elastically mounted frame", required=.true., &
    &   subject=frame_group), &
    & group_rule("support", "a mount with springs and dampers between frame and ground", repeatable=.true., subject=frame_group), &
    & group_rule("foundation", "stiffness and damping about F, in addition to those of the supports", subject=frame_group), &
    & group_rule("gravity", "gravity, which acts on the frame and on all moving masses", subject=frame_group), &
    & group_rule("probe", "a point of the frame whose vibration is reported", repeatable=.true.)]

  !> For each quantity: the values to which its unit applies, as help and manual describe them.
  character(len=*), parameter :: meanings(quantities) = [character(len=128) :: &
    & "unit of lengths and positions", &
    & "unit of masses", &
    & "unit of moments of inertia", &
    & "unit of the stiffness of supports, and of the foundation's c11, c12, c22, which couple displacements", &
    & "unit of forces, and of the foundation's stiffness elements that couple a displacement and a rotation (c13, c23)", &
    & "unit of moments, and of the foundation's rotational stiffness (c33; for a frame in space all elements that couple " // &
    &   "rotations)", &
    & "unit of the damping of supports, and of the foundation's b1, b2 (damping of displacements)", &
    & "unit of the foundation's b3 (damping of rotations)", &
    & "unit of angles", &
    & "unit of pressures", &
    & "unit of `&load area`", &
    & "unit of the acceleration of gravity"]

contains

  !> Schema of all groups that describe the machine: their keys, units and permitted values.
  function machine_schema() result(schema)
    type(schema_type) :: schema

    schema%groups = groups
    schema%keys = [drive_keys, unit_keys(), mechanism_keys, repeat_keys, joint_keys(), link_keys, load_keys, &
      & mass_function_keys, frame_keys, support_keys, foundation_keys, gravity_keys, probe_keys]
    schema%variants = [joint_variants(), load_words, frame_words]
  end function machine_schema

  !> Keys of the group &units. Each record lists the unit names that the key accepts.
  pure function unit_keys() result(keys)
    type(key_type) :: keys(quantities + 1)
    character(len=12), allocatable :: names(:), result_names(:)
    integer :: i

    result_names = [character(len=12) :: "SI", "input"]
    do i = 1, quantities
      names = unit_names(i)
      keys(i) = key_type("units", quantity_names(i), text_key, meanings(i), word=names(1), words=joined(names))
      if (any(of_results == i)) result_names = [result_names, names]
    end do
    keys(of_pressure)%word = ""
    keys(of_pressure)%otherwise = "`'bar'`; `'Pa'` in `&load force` with `area` or `bore`"
    keys(quantities + 1) = key_type("units", "results", text_key, "units of lengths, masses, moments of inertia, forces and " // &
      & "moments in the results: SI units, those of the input, or the listed units and otherwise SI units", 1, 1, &
      & size(of_results), word="SI", words=joined(result_names))
  end function unit_keys

  !> Reads the group &units, which sets the units of the input and of the results. Fails if a unit is unknown, or if two units of
  !> the results measure the same quantity.
  subroutine read_units(doc, units, error, results)
    type(document_type), intent(in) :: doc
    type(units_type), intent(out) :: units
    type(error_type), allocatable, intent(out) :: error
    !> Units of the results
    type(units_type), intent(out), optional :: results
    type(key_type) :: keys(quantities + 1)
    type(group_type) :: group
    character(len=word_length), allocatable :: words(:)
    character(len=:), allocatable :: name
    integer :: chosen(quantities), i, k

    group = group_named(doc, "units")
    if (size(group%entries) == 0) return
    keys = unit_keys()
    do i = 1, quantities
      if (.not. has(group, trim(quantity_names(i)))) cycle
      call read(group, keys, trim(quantity_names(i)), name, error)
      if (allocated(error)) return
      units%of(i) = find_unit(i, name)
    end do
    if (has(group, "pressure")) units%of_pressure_times_area = units%of(of_pressure)
    if (.not. present(results) .or. .not. has(group, "results")) return
    call read(group, keys, "results", words, error)
    if (allocated(error)) return
    chosen = 0
    do k = 1, size(words)
      if (words(k) == "SI" .or. words(k) == "input") then
        if (size(words) > 1) call input_error(group, "results", "'" // trim(words(k)) // "' must stand alone", error)
        if (words(k) == "input") results%of(of_results) = units%of(of_results)
      else
        i = of_results(findloc([(any(unit_names(of_results(i)) == words(k)), i = 1, size(of_results))], .true., dim=1))
        chosen(i) = chosen(i) + 1
        if (chosen(i) > 1) call input_error(group, "results", "gives two units of " // trim(quantity_names(i)), error, k)
        results%of(i) = find_unit(i, trim(words(k)))
      end if
      if (allocated(error)) return
    end do
  end subroutine read_units

end module gestell_input_machine_groups
