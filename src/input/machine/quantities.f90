!> Reads the probes, and the quantities and measures that a task requests by their names.
module gestell_input_machine_quantities
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type
  use gestell_base_key, only: key_type, nonnegative, of_length, positive, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: character_count, longest_name, word_length
  use gestell_input_namelist_document, only: document_type, group_type, groups_named, has, name_of, group_named
  use gestell_input_schema_read, only: read, read_axis_values
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema_units, only: units_type
  use gestell_model_frame, only: frame_type, dof_names
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_rows, only: probe_type, quantity_type
  use gestell_study_measure, only: band_measure, band_only, has_band, measure_names, measure_type, new_measure, peak_measure
  implicit none (type, external)
  private

  public :: read_measure, read_measures, read_probes, read_quantities

  type(key_type), parameter, public :: probe_keys(*) = [ &
    & key_type("probe", "name", text_key, "name of the point in reports and files: 1 to 64 characters, without parentheses", &
    &   required=.true.), &
    & key_type("probe", "position", real_key, "position of the point relative to the frame's centre of mass F; components " // &
    &   "along xi, eta (for a frame in space also zeta)", 1, 2, 3, required=.true., unit=of_length), &
    & key_type("probe", "limit_mm_s", real_key, "limit of the rms velocity in the direction of strongest vibration; only " // &
    &   "frequencies within `band_hz` count", symbol="mm/s", otherwise="none", range=positive), &
    & key_type("probe", "limit_in_s", real_key, "replaces `limit_mm_s`: the limit in in/s", symbol="in/s", otherwise="none", &
    &   range=positive, same_as="limit_mm_s", factor=25.4_dp), &
    & key_type("probe", "band_hz", real_key, "frequency band to which `limit_mm_s` applies: lowest and highest frequency, " // &
    &   "both included", 1, 2, 2, symbol="Hz", otherwise="10, 1000", range=nonnegative)]

contains

  !> Reads the groups &probe. Fails if a name is empty, is used twice or contains a parenthesis, or if a frequency band is empty.
  subroutine read_probes(doc, units, probes, error)
    type(document_type), intent(in) :: doc
    !> Units of the input
    type(units_type), intent(in) :: units
    type(probe_type), allocatable, intent(out) :: probes(:)
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: groups(:)
    type(dictionary_type) :: names
    real(dp) :: place(3)
    integer :: i

    groups = groups_named(doc, "probe")
    allocate(probes(size(groups)))
    do i = 1, size(groups)
      associate (probe => probes(i), group => groups(i))
        probe%name = name_of(group)
        if (len_trim(name_of(group)) == 0 .or. scan(name_of(group), "()") > 0 .or. &
          & character_count(name_of(group)) > longest_name) then
          call input_error(group, "name", "must have 1 to 64 characters and no parentheses", error)
        else if (names%position(probe%name) > 0) then
          call input_error(group, "name", "is already the name of another probe", error)
        end if
        if (allocated(error)) return
        call names%add(probe%name)
        call read_axis_values(group, probe_keys, "position", units, place, error)
        probe%position = place(:2)
        probe%z = place(3)
        if (has(group, "limit_mm_s")) then
          call read(group, probe_keys, "limit_mm_s", probe%limit, error)
          probe%limit = probe%limit / 1000
        end if
        if (has(group, "band_hz")) call read(group, probe_keys, "band_hz", probe%band, error)
        if (.not. (allocated(error) .or. probe%band(2) > probe%band(1))) call input_error(group, "band_hz", &
          & "the second frequency must be greater than the first", error)
        if (allocated(error)) return
      end associate
    end do
  end subroutine read_probes

  !> Reads the key `quantities` of a group. If this key is missing, returns the force on the ground and either the free
  !> coordinates (if `coordinates` is true) or the velocities of all probes with a limit. Fails if a quantity is unknown or named
  !> twice.
  subroutine read_quantities(doc, keys, frame, probes, coordinates, quantities, error)
    type(document_type), intent(in) :: doc
    !> Records of the keys of the group
    type(key_type), intent(in) :: keys(:)
    !> Frame that provides the quantities
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    !> Selects the default: true for the free coordinates and the force, false for the force and the velocities of probes with a
    !> limit
    logical, intent(in) :: coordinates
    type(quantity_type), allocatable, intent(out) :: quantities(:)
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: reason
    type(group_type) :: group
    type(dictionary_type) :: names_so_far
    character(len=word_length), allocatable :: names(:)
    integer :: i, n

    group = group_named(doc, trim(keys(1)%group))
    if (has(group, "quantities")) then
      call read(group, keys, "quantities", names, error)
      if (allocated(error)) return
    else if (coordinates) then
      names = [character(len=word_length) :: dof_names(frame%free), "f"]
    else
      allocate(names(1 + count(probes%limit > 0)))
      names(1) = "f"
      n = 1
      do i = 1, size(probes)
        if (.not. probes(i)%limit > 0) cycle
        n = n + 1
        names(n) = "probe(" // trim(probes(i)%name) // ").v"
      end do
    end if
    allocate(quantities(size(names)))
    do i = 1, size(names)
      call find_quantity(frame, probes, trim(adjustl(names(i))), quantities(i), reason)
      if (allocated(reason)) then
        call input_error(group, "quantities", reason%message, error)
      else if (names_so_far%position(names(i)) > 0) then
        call input_error(group, "quantities", "names '" // trim(names(i)) // "' twice", error)
      end if
      if (allocated(error)) return
      call names_so_far%add(names(i))
    end do
  end subroutine read_quantities

  !> Reads the key `measures` of a group, or its default, and creates the requested measures of each quantity. A quantity without
  !> a frequency band does not get the measure 'band'. Fails if `measures` is given without `quantities`, or if 'band' is given
  !> but no quantity has a frequency band. Also fails if `new_measure` fails.
  subroutine read_measures(group, keys, frame, probes, names, measures, error)
    type(group_type), intent(in) :: group
    !> Records of the keys of the group
    type(key_type), intent(in) :: keys(:)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    !> Names of the quantities
    character(len=*), intent(in) :: names(:)
    type(measure_type), allocatable, intent(out) :: measures(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: kinds(:)
    integer :: i, k, n

    call read(group, keys, "measures", kinds, error)
    if (size(names) == 0 .and. has(group, "measures") .and. .not. allocated(error)) call input_error(group, "measures", &
      & "applies to quantities, but no quantity is requested", error)
    if (allocated(error)) return
    allocate(measures(size(names) * size(measure_names)))
    n = 0
    do i = 1, size(names)
      do k = 1, size(measure_names)
        if (all(kinds /= measure_names(k)) .or. k == band_measure .and. .not. has_band(trim(names(i)))) cycle
        n = n + 1
        call new_measure(frame, probes, trim(names(i)), k, measures(n), error)
        if (allocated(error)) return
      end do
    end do
    measures = measures(:n)
    if (size(names) > 0 .and. any(kinds == measure_names(band_measure)) .and. all(measures%kind /= band_measure)) call &
      & input_error(group, "measures", band_only, error)
  end subroutine read_measures

  !> Reads the key called `name`, whose value must be the name of a measure. Fails if there is no such measure.
  subroutine read_measure(group, keys, name, kind, error)
    type(group_type), intent(in) :: group
    !> Records of the group's keys
    type(key_type), intent(in) :: keys(:)
    !> Name of the key that is read
    character(len=*), intent(in) :: name
    !> Index of the measure in `measure_names`
    integer, intent(out) :: kind
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: word

    kind = peak_measure
    call read(group, keys, name, word, error)
    if (.not. allocated(error)) kind = maxloc(merge(1, 0, measure_names == word), dim=1)
  end subroutine read_measure

end module gestell_input_machine_quantities
