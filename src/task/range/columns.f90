!> Reads what is requested for each point of a sweep: the solution method (`engine`), columns by name, and quantities of the
!> vibration by name.
module gestell_task_range_columns
  use gestell_base_error, only: error_type
  use gestell_base_words, only: word_length
  use gestell_input_machine_quantities, only: read_measures
  use gestell_input_namelist_document, only: group_type, has
  use gestell_input_namelist_message, only: input_error, label
  use gestell_input_namelist_suggest, only: listed, nearest_of
  use gestell_input_schema_read, only: read
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: look_up_quantity
  use gestell_model_quantity_rows, only: probe_type, quantity_type
  use gestell_study_point, only: sweep_options
  use gestell_study_tile_results, only: column_records, last_peak, peaks_of, verdict, xi_peak
  use gestell_task_range_keys, only: sweep_keys
  implicit none (type, external)
  private

  public :: find_group, read_sweep_options

  character(len=*), parameter :: fixed_names(*) = column_records%name

contains

  !> Reads the solution method (`engine`), the columns and the measures of a sweep. Each of these keys may be in any group &sweep.
  !> Fails if two groups give different values, or if a name is neither a column nor a quantity. The mechanism of the frame is not
  !> evaluated, so it need not be able to turn.
  subroutine read_sweep_options(groups, frame, probes, options, error)
    type(group_type), intent(in) :: groups(:)
    !> The frame whose quantities may be requested
    class(frame_type), intent(in) :: frame
    !> The probes whose quantities may be requested
    type(probe_type), intent(in) :: probes(:)
    !> Solution method (`engine`), columns and measures of the sweep
    type(sweep_options), intent(out) :: options
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: columns(:), quantities(:)
    character(len=:), allocatable :: engine
    type(group_type) :: group
    integer :: i

    call find_group(groups, "engine", group, error)
    if (.not. allocated(error)) call read(group, sweep_keys, "engine", engine, error)
    if (.not. allocated(error)) call find_group(groups, "columns", group, error)
    if (allocated(error)) return
    options%engine = engine
    options%columns = options%columns .or. peaks_of(frame%dofs())
    allocate(quantities(0))
    if (has(group, "columns")) then
      call read(group, sweep_keys, "columns", columns, error)
      if (.not. allocated(error)) call check_columns(group, frame, probes, columns, error)
      if (allocated(error)) return
      quantities = pack(columns, [(all(fixed_names /= columns(i)), i = 1, size(columns))])
      options%columns = [(any(columns == fixed_names(i)), i = 1, size(fixed_names))]
      ! A peak is reported only together with the verdict on the vibration to which it belongs.
      options%verdict_last = .not. options%columns(verdict) .and. (any(options%columns(xi_peak:last_peak)) &
        & .or. size(quantities) > 0)
      options%columns(verdict) = options%columns(verdict) .or. options%verdict_last
      options%names_columns = .true.
    end if
    call find_group(groups, "measures", group, error)
    if (.not. allocated(error)) call read_measures(group, sweep_keys, frame, probes, quantities, options%measures, error)
    options%probes = probes
  end subroutine read_sweep_options

  !> Finds the group &sweep from which to read a key. This is the first group that contains the key or, if no group does, the first
  !> group. Fails if two groups give different values.
  subroutine find_group(groups, key, group, error)
    type(group_type), intent(in) :: groups(:)
    character(len=*), intent(in) :: key
    type(group_type), intent(out) :: group
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: first(:), second(:)
    integer :: i

    group = groups(1)
    if (size(groups) < 2) return
    if (.not. has(groups(2), key)) return
    if (.not. has(groups(1), key)) then
      group = groups(2)
      return
    end if
    call read(groups(1), sweep_keys, key, first, error)
    if (.not. allocated(error)) call read(groups(2), sweep_keys, key, second, error)
    if (allocated(error)) return
    if (all([(any(second == first(i)), i = 1, size(first))]) .and. all([(any(first == second(i)), i = 1, size(second))])) return
    call input_error(groups(2), key, "differs from '" // key // "' in " // label(groups(1)) // &
      & "; give the same values in both groups", error)
  end subroutine find_group

  !> Checks the names of the columns. Fails if a name is neither a column nor a quantity, or if a quantity occurs twice.
  subroutine check_columns(group, frame, probes, columns, error)
    type(group_type), intent(in) :: group
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: columns(:)
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: reason
    type(quantity_type) :: quantity
    integer :: i, n, near

    n = xi_peak - 1 + frame%dofs()
    do i = 1, size(columns)
      if (any(fixed_names(:n) == columns(i))) cycle
      if (any(fixed_names(n + 1:) == columns(i))) then
        call input_error(group, "columns", "exists only if the frame moves in space", error, i)
        return
      end if
      call look_up_quantity(frame, probes, trim(columns(i)), quantity, reason)
      if (allocated(reason)) then
        near = nearest_of(columns(i), fixed_names(:n))
        if (near > 0) then
          call input_error(group, "columns", "unknown; did you mean '" // trim(fixed_names(near)) // "'?", error, i)
        else
          call input_error(group, "columns", reason%message // "; other columns are " // listed(fixed_names(:n), "", ""), error, i)
        end if
      else if (any(columns(:i - 1) == columns(i))) then
        call input_error(group, "columns", "column '" // trim(columns(i)) // "' is named twice", error, i)
      end if
      if (allocated(error)) return
    end do
  end subroutine check_columns

end module gestell_task_range_columns
