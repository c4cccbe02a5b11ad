!> The task `boundary`: borders of stability over one or two parameters.
module gestell_task_boundary_task
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: exact
  use gestell_input_namelist_document, only: has, the_group
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: radian, unit_type
  use gestell_task_common_task, only: all_machines, longest_table, task_type
  use gestell_task_boundary, only: border_accuracy
  use gestell_task_boundary_map_plot, only: over_chart
  use gestell_task_boundary_map_table, only: add_curves
  use gestell_task_boundary_line_options, only: border_options
  use gestell_task_boundary_plot, only: plot_borders
  use gestell_task_boundary_reading, only: read_tolerance
  use gestell_task_boundary_report, only: report_borders, report_search, summary, way_to_stable
  use gestell_task_boundary_solution, only: border_results_type, solve_borders
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_common_locked_family, only: locked_family_type
  use gestell_task_range_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  type, extends(task_type), public :: boundary_task
    private
    !> Of boundaries, relative to the ranges.
    real(dp) :: tolerance = 0
  contains
    procedure :: describe
    procedure :: read => read_boundary
    procedure :: preview
    procedure :: run
  end type boundary_task

contains

  pure subroutine describe(self)
    class(boundary_task), intent(inout) :: self

    self%name = "boundary"
    self%tables = [character(len=longest_table) :: "boundary"]
    self%about = all_machines
  end subroutine describe

  subroutine read_boundary(self, configuration, error)
    class(boundary_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    ! with a quantity it is about that: gestell_task_boundary_level_task
    self%ordered = self%ordered .and. .not. has(the_group(configuration%document, "boundary"), "quantity")
    if (.not. self%ordered) return
    call read_tolerance(configuration%document, configuration%plan, self%tolerance, error)
  end subroutine read_boundary

  function preview(self, configuration) result(lines)
    class(boundary_task), intent(in) :: self
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines

    lines = report_search(configuration%plan, self%tolerance)
  end function preview

  subroutine run(self, context, result, error)
    class(boundary_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(border_results_type) :: results
    type(table_type) :: table
    integer :: k

    call solve(self, context, results, error)
    if (allocated(error)) return
    associate (plan => context%configuration%plan)
      if (allocated(results%map)) then
        table = empty_table()
        call add_curves(plan, results%map, "divergence, period_doubling or flutter", table, of_level=.false.)
        call result%draw_over("sweep", over_chart(results%map))
      else
        table = table_of_values(plan, results)
      end if
      call result%add(table, plot_borders(plan, results))
      call result%warn("", summary(plan, results))
      if (allocated(results%nearest)) then
        do k = 1, size(results%nearest)
          call result%warn("", way_to_stable(trim(plan%paths(k)), results%nearest(k)))
        end do
      end if
      call result%say(report_search(plan, self%tolerance) // report_borders(plan, results, self%tolerance))
    end associate
  end subroutine run

  subroutine solve(self, context, results, error)
    class(boundary_task), intent(in) :: self
    type(context_type), intent(inout), target :: context
    type(border_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type), target :: family
    type(locked_family_type), allocatable, target :: bare
    type(border_options) :: options

    associate (plan => context%configuration%plan)
      call context%members(plan%family, family)
      family%accuracy%tolerance = min(family%accuracy%tolerance, border_accuracy)
      if (size(plan%grid%axes) == 1 .and. family%model == "exact") then
        allocate(bare, source=family)
        bare%model = "rest"
      end if
      options%accuracy = context%configuration%accuracy
      options%tolerance = self%tolerance
      options%executor => context%executor
      call solve_borders(family, plan%grid, options, plan%base, results, error, bare)
    end associate
  end subroutine solve

  pure type(table_type) function empty_table() result(table)
    table = new_table("boundary", "Stability boundaries", "Where the largest multiplier crosses the unit circle.", "", &
      & shown=.true.)
  end function empty_table

  !> boundary.csv over one parameter, with a remark for each place that the search left open.
  pure type(table_type) function table_of_values(plan, results) result(table)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    character(len=:), allocatable :: path
    type(unit_type) :: unit
    integer :: i

    table = empty_table()
    path = trim(plan%paths(1))
    unit = unit_type(words=plan%units(1))
    associate (values => results%values)
      call table%add("curve", "number of the critical value", [(i, i = 1, size(values))])
      call table%add(path, unit, "critical value, in the units of the input", (values%value), error=path // "_error")
      call table%add("arg", radian, "argument of the critical multiplier", (values%arg_rad))
      call table%add("kind", "divergence, period_doubling, flutter or turning_point", (values%kind))
      call table%add(path // "_error", unit, "the border lies within the value plus and minus this", (values%error))
      call table%add("below", "verdict at the smaller value", (values%below))
      call table%add("above", "verdict at the greater value", (values%above))
      call table%add("vibration", "whose border it is", (values%vibration))
    end associate
    if (.not. allocated(results%rest%places)) return
    associate (places => results%rest%places)
      do i = 1, size(places)
        table%remarks = table%remarks // "open: " // path // " = " // exact(places(i)%value) // " within " &
          & // exact(places(i)%width) &
          & // ": a border could not be excluded" // new_line("a")
      end do
    end associate
  end function table_of_values

end module gestell_task_boundary_task
