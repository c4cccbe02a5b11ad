!> What is wanted of every point of a sweep: engine, columns by their names, and numbers of the vibration by those of quantities.
module gestell_task_range_columns
  use gestell_base_error, only: error_type
  use gestell_input_machine_quantities, only: read_measures
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: group_type, has
  use gestell_input_namelist_message, only: input_error, label
  use gestell_input_namelist_suggest, only: listed, nearest_of
  use gestell_input_schema_read, only: read
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: look_up_quantity
  use gestell_model_quantity_rows, only: probe_type, quantity_type
  use gestell_study_point, only: sweep_options
  use gestell_study_tile_results, only: column_names, last_peak, peaks_of, sweep_columns, verdict, &
    & verdict_behind, xi_peak
  use gestell_task_range_keys, only: sweep_keys
  implicit none (type, external)
  private

  public :: read_either, read_order

  character(len=*), parameter :: fixed_names(*) = column_names(:verdict_behind - 1)

contains

  !> Engine, columns and measures of the groups &sweep, in any of which they may stand, about this frame, whose mechanism need not
  !> turn. Errors: other ones in another group; neither a column nor a quantity.
  subroutine read_order(groups, frame, probes, options, error)
    type(group_type), intent(in) :: groups(:)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    type(sweep_options), intent(out) :: options
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: columns(:), quantities(:)
    character(len=:), allocatable :: engine
    integer :: i

    call agree(groups, "columns", error)
    if (.not. allocated(error)) call agree(groups, "measures", error)
    if (allocated(error)) return
    call read_either(groups, "engine", engine, error)
    if (allocated(error)) return
    options%engine = engine
    options%columns = options%columns .or. peaks_of(frame%dofs())
    allocate(quantities(0))
    i = group_with(groups, "columns")
    if (has(groups(i), "columns")) then
      call read(groups(i), sweep_keys, "columns", columns, error)
      if (.not. allocated(error)) call check_columns(groups(i), frame, probes, columns, error)
      if (allocated(error)) return
      quantities = pack(columns, [(is_quantity(columns(i)), i = 1, size(columns))])
      options%columns = wanted(columns)
      options%names_columns = .true.
    end if
    i = group_with(groups, "measures")
    call read_measures(groups(i), sweep_keys, frame, probes, quantities, options%measures, error)
    options%probes = probes
  end subroutine read_order

  !> A word that may stand in any of the groups. Error: another one in another group.
  subroutine read_either(groups, key, word, error)
    type(group_type), intent(in) :: groups(:)
    character(len=*), intent(in) :: key
    character(len=:), allocatable, intent(out) :: word
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: first
    integer :: i

    do i = 1, size(groups)
      if (allocated(word)) call move_alloc(word, first)
      if (i == 1 .or. has(groups(i), key)) then
        call read(groups(i), sweep_keys, key, word, error)
        if (allocated(error)) return
      else
        word = first
      end if
      if (i == 1) cycle
      if (.not. has(groups(1), key) .or. word == first) cycle
      call input_error(groups(i), key, "is another one than in " // label(groups(1)), error)
      return
    end do
  end subroutine read_either

  !> The first group that has the key, or the first.
  pure integer function group_with(groups, key) result(i)
    type(group_type), intent(in) :: groups(:)
    character(len=*), intent(in) :: key

    do i = 1, size(groups)
      if (has(groups(i), key)) return
    end do
    i = 1
  end function group_with

  !> Error: two groups have different words for the key.
  subroutine agree(groups, key, error)
    type(group_type), intent(in) :: groups(:)
    character(len=*), intent(in) :: key
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: first(:), second(:)
    integer :: i

    if (size(groups) < 2) return
    if (.not. (has(groups(1), key) .and. has(groups(2), key))) return
    call read(groups(1), sweep_keys, key, first, error)
    if (.not. allocated(error)) call read(groups(2), sweep_keys, key, second, error)
    if (allocated(error)) return
    if (all([(any(second == first(i)), i = 1, size(first))]) .and. all([(any(first == second(i)), i = 1, size(second))])) return
    call input_error(groups(2), key, "are others than in " // label(groups(1)), error)
  end subroutine agree

  !> Errors: neither a column nor a quantity; a quantity twice.
  subroutine check_columns(group, frame, probes, columns, error)
    type(group_type), intent(in) :: group
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: columns(:)
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: reason
    type(quantity_type) :: quantity
    integer :: i, n, near

    do i = 1, size(columns)
      n = xi_peak - 1 + frame%dofs()
      if (any(fixed_names(n + 1:) == columns(i))) then
        call input_error(group, "columns", "is of a frame in space", error, i)
        return
      end if
      if (.not. is_quantity(columns(i))) cycle
      call look_up_quantity(frame, probes, trim(columns(i)), quantity, reason)
      if (allocated(reason)) then
        near = nearest_of(columns(i), fixed_names(:n))
        if (near > 0) then
          call input_error(group, "columns", "unknown; did you mean '" // trim(fixed_names(near)) // "'?", error, i)
        else
          call input_error(group, "columns", reason%message // "; nor is it one of " // listed(fixed_names(:n), "", ""), error, i)
        end if
      else if (any(columns(:i - 1) == columns(i))) then
        call input_error(group, "columns", "names '" // trim(columns(i)) // "' twice", error, i)
      end if
      if (allocated(error)) return
    end do
  end subroutine check_columns

  pure logical function is_quantity(column)
    character(len=*), intent(in) :: column

    is_quantity = all(fixed_names /= column)
  end function is_quantity

  !> The columns with these names, and the verdict behind peaks that were ordered without it: no peak is told of which nobody knows
  !> whether the machine keeps to that vibration.
  pure function wanted(columns)
    character(len=*), intent(in) :: columns(:)
    logical :: wanted(sweep_columns)
    integer :: i

    wanted = [(any(columns == column_names(i)), i = 1, sweep_columns)]
    wanted(verdict_behind) = .not. wanted(verdict) .and. (any(wanted(xi_peak:last_peak)) &
      & .or. any([(is_quantity(columns(i)), i = 1, size(columns))]))
  end function wanted

end module gestell_task_range_columns
