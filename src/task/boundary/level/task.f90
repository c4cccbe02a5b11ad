!> The task `boundary` where a quantity is named: where its peak, its rms or its band crosses a level.
module gestell_task_boundary_level_task
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: state_word
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, exact
  use gestell_input_machine_quantities, only: kind_of_measure
  use gestell_input_namelist_document, only: group_type, has, the_group
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema_read, only: read
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: new_unit, unit_type
  use gestell_study_measure, only: band_measure, measure_names, measure_type, new_measure
  use gestell_study_speed_point, only: speed_options
  use gestell_task_common_task, only: all_machines, longest_table, task_type
  use gestell_task_boundary, only: line_along
  use gestell_task_boundary_keys, only: boundary_keys
  use gestell_task_boundary_level_line, only: level_line_type
  use gestell_task_boundary_level_plane, only: level_kinds, level_plane_type, level_states
  use gestell_task_boundary_level_plot, only: level_meanings, level_title, plot_levels
  use gestell_task_boundary_level_report, only: level_heading, level_lines, level_name, level_sentence, middle_line
  use gestell_task_boundary_level_search, only: find_levels, level_results_type
  use gestell_task_boundary_line, only: coordinate
  use gestell_task_boundary_reading, only: read_tolerance
  use gestell_task_boundary_map, only: border_map_type, trace_curves
  use gestell_task_boundary_map_plot, only: over_chart, plot_curves
  use gestell_task_boundary_map_report, only: curve_lines, curves_over
  use gestell_task_boundary_map_table, only: add_curves
  use gestell_task_boundary_line_options, only: border_options
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_common_locked_family, only: locked_family_type
  use gestell_task_range_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  type, extends(task_type), public :: level_task
    private
    type(measure_type) :: measure
    !> In the measure's unit.
    real(dp) :: level = 0
    !> Of boundaries, relative to the ranges.
    real(dp) :: tolerance = 0
  contains
    procedure :: describe
    procedure :: read => read_level
    procedure :: preview
    procedure :: run
  end type level_task

  character(len=*), parameter :: kinds_told = "level, or jump where the number jumps across it"

contains

  pure subroutine describe(self)
    class(level_task), intent(inout) :: self

    self%name = "boundary"
    self%tables = [character(len=longest_table) :: "boundary", "level"]
    self%about = all_machines
  end subroutine describe

  subroutine read_level(self, configuration, error)
    class(level_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: reason
    type(group_type) :: group
    character(len=:), allocatable :: name
    integer :: kind

    if (.not. self%ordered) return
    group = the_group(configuration%document, "boundary")
    self%ordered = has(group, "quantity")
    if (.not. self%ordered) then
      if (has(group, "measure")) call input_error(group, "measure", "tells of a quantity: none is named", error)
      if (has(group, "level") .and. .not. allocated(error)) call input_error(group, "level", "is one of a quantity: none is " &
        & // "named", error)
      return
    end if
    call read_tolerance(configuration%document, configuration%plan, self%tolerance, error)
    if (.not. allocated(error)) call kind_of_measure(group, boundary_keys, "measure", kind, error)
    if (.not. allocated(error)) call read(group, boundary_keys, "quantity", name, error)
    if (allocated(error)) return
    call new_measure(configuration%frame, configuration%probes, trim(adjustl(name)), kind, self%measure, reason)
    if (allocated(reason)) then
      call input_error(group, trim(merge("measure ", "quantity", index(reason%message, "'band'") == 1)), reason%message, error)
      return
    end if
    call read_value(self, group, configuration, error)
  end subroutine read_level

  !> The level; of a band that of the probe where it has a limit. Error: there is none, or it is out of range.
  subroutine read_value(self, group, configuration, error)
    class(level_task), intent(inout) :: self
    type(group_type), intent(in) :: group
    type(configuration_type), intent(in) :: configuration
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: limit
    integer :: k

    limit = 0
    if (self%measure%kind == band_measure) then
      do k = 1, size(configuration%probes)
        associate (probe => configuration%probes(k))
          if (index(self%measure%quantity, "probe(" // trim(probe%name) // ").") == 1) limit = 1000 * probe%limit
        end associate
      end do
    end if
    if (has(group, "level") .or. .not. limit > 0) then
      call read(group, boundary_keys, "level", self%level, error)
    else
      self%level = limit
    end if
  end subroutine read_value

  function preview(self, configuration) result(lines)
    class(level_task), intent(in) :: self
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines

    lines = level_heading(self%measure, self%level, self%tolerance, configuration%plan)
  end function preview

  subroutine run(self, context, result, error)
    class(level_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(level_results_type) :: results
    type(border_map_type) :: map
    type(table_type) :: table
    character(len=10) :: middle

    associate (plan => context%configuration%plan)
      if (size(plan%grid%axes) == 2) then
        call solve_map(self, context, map, middle, error)
        if (allocated(error)) return
        table = empty_table(self)
        call add_curves(plan, map, kinds_told, table, of_level=.true.)
        call result%add(table, plot_curves(plan, map, level_kinds, level_states, level_meanings, &
          & level_title(self%measure, self%level), "above the level"))
        call result%draw_over("sweep", over_chart(map))
        call result%warn("", "Border " // level_name(self%measure, self%level) // curves_over(map, plan%paths))
        call result%say(level_heading(self%measure, self%level, self%tolerance, plan) // new_line("a") &
          & // curve_lines(map, plan%paths) // middle_line(middle))
      else
        call solve_line(self, context, results, error)
        if (allocated(error)) return
        call result%add(table_of(self, plan, results), plot_levels(plan%paths(1), plan%units(1), plan%grid%axes(1), plan%base, &
          & self%measure, self%level, results))
        call result%add(curve_of(self, plan, results))
        call result%warn("", "Border " // level_name(self%measure, self%level) // level_sentence(trim(plan%paths(1)), results))
        call result%say(level_heading(self%measure, self%level, self%tolerance, plan) // level_lines(results))
      end if
    end associate
  end subroutine run

  !> What is wanted of each machine.
  pure type(speed_options) function order_of(self, configuration) result(order)
    class(level_task), intent(in) :: self
    type(configuration_type), intent(in) :: configuration

    order%names = [self%measure%quantity]
    order%measures = [self%measure]
    order%probes = configuration%probes
    order%orders = 0
    order%accuracy = configuration%accuracy
  end function order_of

  !> The crossings over one parameter. Error: it makes no sense.
  subroutine solve_line(self, context, results, error)
    class(level_task), intent(in) :: self
    type(context_type), intent(inout), target :: context
    type(level_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type), target :: family
    type(level_line_type) :: line
    type(border_options) :: options
    real(dp), allocatable :: nodes(:)
    integer :: k

    associate (plan => context%configuration%plan)
      call context%members(plan%family, family)
      options%tolerance = self%tolerance
      options%accuracy = context%configuration%accuracy
      options%executor => context%executor
      associate (axis => plan%grid%axes(1))
        call line_along(family, [axis], 1, [axis%from], options, line%line)
        line%options = order_of(self, context%configuration)
        line%level = self%level
        line%over_speed = plan%paths(1) == "drive.speed_rpm"
        nodes = axis%value([(k, k = 1, axis%count)])
        if (.not. line%over_speed) nodes = 1 + coordinate(axis, nodes)
      end associate
      call find_levels(line, nodes, results, error)
    end associate
  end subroutine solve_line

  !> The curves over two; where there are none, on which side the `middle` of the ranges lies, else empty. Error: the
  !> parameters make no sense.
  subroutine solve_map(self, context, map, middle, error)
    class(level_task), intent(in) :: self
    type(context_type), intent(inout), target :: context
    type(border_map_type), intent(out) :: map
    character(len=10), intent(out) :: middle
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type), target :: family
    type(level_plane_type) :: plane

    associate (plan => context%configuration%plan)
      call context%members(plan%family, family)
      plane%family => family
      plane%accuracy = context%configuration%accuracy
      plane%deviation = self%tolerance
      plane%executor => context%executor
      plane%kinds = level_kinds
      plane%states = level_states
      plane%options = order_of(self, context%configuration)
      plane%level = self%level
      plane%speed_axis = findloc(plan%paths == "drive.speed_rpm", .true., dim=1)
      call trace_curves(plane, plan%grid, map, error)
      middle = ""
      if (.not. allocated(error) .and. map%curves == 0) call plane%in_the_middle(middle, error)
    end associate
  end subroutine solve_map

  !> boundary.csv without its columns.
  pure type(table_type) function empty_table(self) result(table)
    class(level_task), intent(in) :: self

    table = new_table("boundary", "Crossings of a level", "Where " // trim(self%measure%name()) // " comes to " &
      & // concise(self%level, 9) // " " // trim(self%measure%unit) // ".", "", shown=.true.)
    table%remarks = "level: " // trim(self%measure%name()) // " = " // exact(self%level) // " " // trim(self%measure%unit) &
      & // new_line("a")
  end function empty_table

  !> The same over one parameter, with a remark for each place that the search left open.
  pure type(table_type) function table_of(self, plan, results) result(table)
    class(level_task), intent(in) :: self
    type(sweep_plan_type), intent(in) :: plan
    type(level_results_type), intent(in) :: results
    character(len=:), allocatable :: path
    type(unit_type) :: unit
    integer :: i

    path = trim(plan%paths(1))
    unit = unit_type(words=plan%units(1))
    table = empty_table(self)
    associate (crossings => results%crossings)
      call table%add("curve", "number of the crossing", [(i, i = 1, size(crossings))])
      call table%add(path, unit, "where it is, in the units of the input", (crossings%value), error=path // "_error")
      call table%add("kind", kinds_told, merge("jump ", "level", crossings%jumps))
      call table%add(path // "_error", unit, "the crossing lies within the value plus and minus this", (crossings%error))
      call table%add("below", "at the smaller value: within, above or undecided", (crossings%below))
      call table%add("above", "at the greater value", (crossings%above))
      call table%add("state", "of the machine: ok, undamped, undecided or unstable", state_word(crossings%state))
    end associate
    do i = 1, size(results%places)
      table%remarks = table%remarks // "open: " // path // " = " // exact(results%places(i)%value) // " within " &
        & // exact(results%places(i)%width) // ": a crossing could not be excluded" // new_line("a")
    end do
  end function table_of

  !> level.csv: the curve.
  pure type(table_type) function curve_of(self, plan, results) result(table)
    class(level_task), intent(in) :: self
    type(sweep_plan_type), intent(in) :: plan
    type(level_results_type), intent(in) :: results
    character(len=:), allocatable :: name

    name = trim(self%measure%name())
    table = new_table("level", "The number over the parameter", "", "")
    call table%add(trim(plan%paths(1)), unit_type(words=plan%units(1)), "in the units of the input", results%values)
    call table%add(name, new_unit(trim(self%measure%unit)), trim(self%measure%meaning()), results%numbers, error=name // "_error")
    call table%add(name // "_error", new_unit(trim(self%measure%unit)), "bound on its error", results%errors)
    call table%add("state", "ok, undamped, undecided, unstable, resonance, impossible or failed", state_word(results%states))
  end function curve_of

end module gestell_task_boundary_level_task
