!> Reads the input groups &sweep: the varied parameters, their ranges, and the results requested for each point.
module gestell_task_range_plan
  use gestell_base_error, only: error_type, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_input_namelist_document, only: document_type, group_type, groups_named, has, group_named
  use gestell_input_machine_family, only: document_family_type, new_document_family
  use gestell_base_key, only: integer_key, text_key
  use gestell_base_text, only: integer_text, text
  use gestell_input_schema_read, only: read
  use gestell_input_schema_locate, only: find_target, target_type
  use gestell_input_namelist_message, only: locate_in_group, input_error, label
  use gestell_input_schema_path, only: get_path
  use gestell_input_schema, only: find_group_rule, option_group, schema_type
  use gestell_input_wording, only: lower, shown
  use gestell_input_schema_units, only: unit_symbol, units_type
  use gestell_task_range_columns, only: find_group, read_sweep_options
  use gestell_task_range_keys, only: resonance_keys, sweep_keys
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: probe_type
  use gestell_output_table_result_units, only: result_units_type
  use gestell_study_grid, only: axis_type, grid_type, new_axis, new_grid
  use gestell_study_point, only: sweep_options
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: find_number, limit_points, overlap, read_speeds, read_sweep, refuse_standstill

  !> Plan of a sweep. Its component `options` includes accuracy and model, which have input groups of their own.
  type, public :: sweep_plan_type
    !> Paths of the varied parameters, as written in the header of sweep.csv; shape (number of axes).
    character(len=:), allocatable :: paths(:)
    !> Units in which the input gives the parameters; empty for parameters without a unit.
    character(len=16), allocatable :: units(:)
    type(grid_type) :: grid
    type(sweep_options) :: options
    !> Format of the table of the sweep: 'csv' or 'npy'.
    character(len=:), allocatable :: format
    type(document_family_type) :: family
    !> Values of the varied parameters in the input itself. Size 0 if the input gives no value, or several different values, for
    !> one of the parameters.
    real(dp), allocatable :: base(:)
    !> Units of the results.
    type(result_units_type) :: result_units
    !> Highest order of the crank speed that the tasks over a range of speeds consider.
    integer :: orders = 0
  contains
    procedure :: period_varies
  end type sweep_plan_type

  !> Maximum number of values of an axis that are checked before the computation starts.
  integer, parameter :: most_checked = 10000
  !> Maximum number of points of a sweep. With more points, the number of tiles (rectangles of points that are computed as one
  !> piece of work) might not fit a default integer.
  integer(int64), parameter :: max_points = 10_int64**11

contains

  !> True if the sweep varies a gear ratio. The number of turns that the drive makes in a period then varies, too.
  pure logical function period_varies(self)
    class(sweep_plan_type), intent(in) :: self
    integer :: k

    period_varies = any([(index(lower(self%paths(k)), ").ratio") > 0, k = 1, size(self%paths))])
  end function period_varies

  !> Reads the sweep from a checked document. The mechanism of the frame is not evaluated, so it need not be able to turn. Fails if
  !> there is no group &sweep, or if there are more than two. Fails also if a path cannot be varied or occurs twice, a range is
  !> empty, a value is invalid, or a column does not exist.
  subroutine read_sweep(doc, schema, units, frame, probes, plan, error)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    type(units_type), intent(in) :: units
    !> The frame whose quantities may be requested
    class(frame_type), intent(in) :: frame
    !> The probes whose quantities may be requested
    type(probe_type), intent(in) :: probes(:)
    !> Plan of the sweep
    type(sweep_plan_type), intent(out) :: plan
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: groups(:)
    type(group_type) :: group
    type(target_type) :: targets(2)
    type(axis_type) :: axes(2)
    character(len=:), allocatable :: path
    real(dp), allocatable :: first(:)
    integer :: i, longest

    groups = groups_named(doc, "sweep")
    if (size(groups) == 0) then
      call input_error(group_named(doc, "case"), "tasks", "needs a group &sweep with parameter, from, to and count", error)
      return
    else if (size(groups) > 2) then
      call input_error(groups(3), "", "at most two groups &sweep are allowed, one for each parameter", error)
      return
    end if
    longest = 1
    do i = 1, size(groups)
      call read(groups(i), sweep_keys, "parameter", path, error)
      if (.not. allocated(error)) call find_number(doc, schema, groups(i), "parameter", path, targets(i), error)
      if (.not. allocated(error)) call read_axis(groups(i), axes(i), error)
      if (allocated(error)) return
      longest = max(longest, len(path))
    end do
    allocate(character(len=longest) :: plan%paths(size(groups)))
    allocate(plan%units(size(groups)))
    do i = 1, size(groups)
      call read(groups(i), sweep_keys, "parameter", path, error)
      plan%paths(i) = adjustl(path)
      plan%units(i) = trim(unit_symbol(schema%keys(targets(i)%rule), targets(i)%element, units))
    end do
    if (size(groups) == 2) then
      if (overlap(doc, targets)) then
        call input_error(groups(2), "parameter", "is already varied in " // label(groups(1)), error)
        return
      end if
    end if
    call new_grid(plan%grid, axes(:size(groups)), error)
    if (allocated(error)) return
    call limit_points(plan%grid, groups, max_points, error)
    if (allocated(error)) return
    call read_sweep_options(groups, frame, probes, plan%options, error)
    plan%grid%one_by_one = plan%options%one_by_one()
    if (.not. allocated(error)) call find_group(groups, "format", group, error)
    if (.not. allocated(error)) call read(group, sweep_keys, "format", plan%format, error)
    if (allocated(error)) return
    first = axes(:size(groups))%from
    call new_document_family(plan%family, doc, schema, units, plan%paths, error, first)
    call read_base(doc, schema, plan)
    if (allocated(error)) then
      ! Error messages on the mechanism refer to a line of the input already. Messages on a path do not, so the group is added to
      ! them.
      call locate_in_group(groups(1), error)
      return
    end if
    call check_values(groups, plan, error)
  end subroutine read_sweep

  !> Checks the size of a grid. Fails if the grid has more than `most` points.
  subroutine limit_points(grid, groups, most, error)
    type(grid_type), intent(in) :: grid
    type(group_type), intent(in) :: groups(:)
    integer(int64), intent(in) :: most
    type(error_type), allocatable, intent(out) :: error

    if (grid%points() > most) call input_error(groups(size(groups)), "count", "gives " // integer_text(grid%points()) &
      & // " points in total; at most " // integer_text(most) // " can be computed", error)
  end subroutine limit_points

  !> Completes the plan for tasks that vary the speed by the highest order that they consider. Fails if the sweep varies another
  !> parameter, if it has fewer than two speeds, or if it includes standstill.
  subroutine read_speeds(doc, plan, error)
    type(document_type), intent(in) :: doc
    type(sweep_plan_type), intent(inout) :: plan
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: groups(:)

    groups = groups_named(doc, "sweep")
    if (size(groups) > 1) then
      call input_error(groups(2), "", "the tasks resonance, critical and campbell vary only the speed: remove this group", error)
    else if (lower(trim(plan%paths(1))) /= "drive.speed_rpm") then
      call input_error(groups(1), "parameter", "must be 'drive.speed_rpm' for the tasks resonance, critical and campbell", error)
    else if (plan%grid%axes(1)%count < 2) then
      call input_error(groups(1), "count", "must be at least 2 for the tasks resonance, critical and campbell", error)
    end if
    if (.not. allocated(error)) call refuse_standstill(groups, plan, error)
    if (.not. allocated(error)) call read(group_named(doc, "resonance"), resonance_keys, "orders", plan%orders, error)
  end subroutine read_speeds

  !> Checks the ranges of speeds. Fails if a range includes zero.
  subroutine refuse_standstill(groups, plan, error)
    type(group_type), intent(in) :: groups(:)
    type(sweep_plan_type), intent(in) :: plan
    type(error_type), allocatable, intent(out) :: error
    integer :: k

    do k = 1, size(groups)
      if (lower(trim(plan%paths(k))) /= "drive.speed_rpm" .or. plan%grid%axes(k)%from / plan%grid%axes(k)%to > 0) cycle
      call input_error(groups(k), "to", "the range must not include standstill: 'from' and 'to' must have the same sign", error)
      return
    end do
  end subroutine refuse_standstill

  !> Reads the values that the document gives for the varied parameters into `plan%base`. This array has the size 0 if the document
  !> gives no value, or several different values, for one of the parameters.
  subroutine read_base(doc, schema, plan)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    type(sweep_plan_type), intent(inout) :: plan
    type(document_type) :: copy
    type(error_type), allocatable :: none
    real(dp), allocatable :: values(:)
    real(dp) :: base(size(plan%paths))
    integer :: k

    allocate(plan%base(0))
    copy = doc
    do k = 1, size(base)
      call get_path(copy, schema, trim(plan%paths(k)), values, none)
      if (allocated(none)) return
      if (any(abs(values - values(1)) > 0)) return
      base(k) = values(1)
    end do
    plan%base = base
  end subroutine read_base

  !> Finds the input value to which `path` refers. The path is given by the `key` of the `group`. Fails if the path does not refer
  !> to a real number that describes the machine.
  subroutine find_number(doc, schema, group, key, path, target, error)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    !> Group of the input that contains the path; error messages refer to it
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key, path
    !> The input value to which the path refers
    type(target_type), intent(out) :: target
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: reason

    call find_target(doc, schema, path, "", target, reason)
    if (allocated(reason)) then
      call input_error(group, key, reason%message, error)
      return
    end if
    associate (rule => schema%keys(target%rule))
      if (rule%kind == text_key) then
        call input_error(group, key, "has a text as its value; only numbers can be varied", error)
      else if (schema%groups(find_group_rule(schema, rule%group))%subject == option_group) then
        call input_error(group, key, "&" // trim(rule%group) // " does not describe the machine; only numbers of the " &
          & // "machine can be varied", error)
      else if (rule%kind == integer_key) then
        call input_error(group, key, "has a whole number as its value; only real numbers can be varied", error)
      else if (rule%least > 1 .and. target%element == 0 .and. .not. rule%alike) then
        call input_error(group, key, "has " // text(rule%least) // " values; give the path of one of them, for example " &
          & // shown(path) // trim(merge("(1,1)", "(1)  ", rule%rank == 2)), error)
      end if
    end associate
  end subroutine find_number

  subroutine read_axis(group, axis, error)
    type(group_type), intent(in) :: group
    type(axis_type), intent(out) :: axis
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: reason
    character(len=:), allocatable :: spacing
    real(dp) :: from, to
    integer :: count

    call read(group, sweep_keys, "from", from, error)
    if (.not. allocated(error)) call read(group, sweep_keys, "count", count, error)
    if (.not. allocated(error)) call read(group, sweep_keys, "spacing", spacing, error)
    if (allocated(error)) return
    to = from
    if (count > 1 .or. has(group, "to")) call read(group, sweep_keys, "to", to, error)
    if (allocated(error)) return
    call new_axis(axis, from, to, count, spacing == "log", reason)
    if (allocated(reason)) call input_error(group, trim(merge("count", "to   ", count == 1)), reason%message, error)
  end subroutine read_axis

  !> True if two paths refer to a common value of the input.
  pure logical function overlap(doc, targets)
    type(document_type), intent(in) :: doc
    type(target_type), intent(in) :: targets(2)
    logical :: chosen(size(doc%groups), 2)
    integer :: k

    overlap = .false.
    if (targets(1)%rule /= targets(2)%rule) return
    if (all(targets%element > 0) .and. targets(1)%element /= targets(2)%element) return
    chosen = .false.
    do k = 1, 2
      chosen(targets(k)%groups, k) = .true.
    end do
    ! If the file does not contain a group, defaults apply as if it contained the group once.
    overlap = any(chosen(:, 1) .and. chosen(:, 2)) .or. .not. any(chosen)
  end function overlap

  !> Checks the values of each axis, combined with the first value of the other axis. Also checks the last values of both axes
  !> together. On a long axis only evenly spaced values including both ends are checked, and the value closest to zero, because
  !> some keys do not allow zero.
  subroutine check_values(groups, plan, error)
    type(group_type), intent(in) :: groups(:)
    type(sweep_plan_type), intent(in) :: plan
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: values(size(groups))
    integer :: i, k, chosen, checked, zero

    do k = 1, size(groups)
      values = plan%grid%axes%from
      associate (axis => plan%grid%axes(k))
        zero = 1
        if (axis%count > 1) zero = nint(min(max(1 - axis%from / (axis%to - axis%from) * (axis%count - 1), 1.0_dp), &
          & real(axis%count, dp)))
        checked = min(axis%count, most_checked)
        do i = 0, checked
          ! Select evenly spaced values from end to end, and the value closest to zero.
          chosen = zero
          if (i < checked) chosen = 1 + int(int(i, int64) * (axis%count - 1) / max(1, checked - 1))
          values(k) = axis%value(chosen)
          call check_point(groups(k))
          if (allocated(error)) return
        end do
      end associate
    end do
    values = plan%grid%axes%to
    call check_point(groups(size(groups)))

  contains

    !> Checks one set of values. Fails if the values are invalid; the error message refers to `group`.
    subroutine check_point(group)
      type(group_type), intent(in) :: group

      call plan%family%check(values, error)
      if (.not. allocated(error)) return
      error%code = invalid_input
      call locate_in_group(group, error)
    end subroutine check_point

  end subroutine check_values

end module gestell_task_range_plan
