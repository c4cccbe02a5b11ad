!> The task `sensitivity`: computes how much the vibration changes with each parameter of the machine.
module gestell_task_sensitivity_task
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: judgement_type, not_judged, undecided
  use gestell_base_text, only: concise
  use gestell_input_machine_quantities, only: read_quantities
  use gestell_input_namelist_document, only: count_groups
  use gestell_input_schema, only: group_rule, schema_type
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_output_report_warnings, only: motion_warning
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: plain, unit_of_row
  use gestell_study_speed_point, only: speed_options
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_common_locked_family, only: locked_family_type
  use gestell_task_sensitivity_keys, only: sensitivity_keys
  use gestell_task_sensitivity, only: sensitivity_base_type, sensitivity_type, solve_sensitivity
  use gestell_task_sensitivity_plan, only: read_sensitivity, sensitivity_plan_type
  use gestell_task_sensitivity_plot, only: plot_sensitivity
  use gestell_task_sensitivity_report, only: report_sensitivity
  implicit none (type, external)
  private

  !> The task `sensitivity` with its plan from the input.
  type, extends(task_type), public :: sensitivity_task
    private
    !> Quantities whose relative changes are computed.
    type(quantity_type), allocatable :: quantities(:)
    !> Parameters that are changed, and the family of changed machines.
    type(sensitivity_plan_type) :: plan
  contains
    procedure :: describe, read => read_task, run
    procedure, nopass :: extend
  end type sensitivity_task

contains

  pure subroutine describe(self)
    class(sensitivity_task), intent(inout) :: self

    self%name = "sensitivity"
    self%meaning = "change of forces and vibrations if one parameter of the machine changes"
    self%tables = [character(len=longest_table) :: "sensitivity"]
    self%gives_verdict = .true.
  end subroutine describe

  subroutine extend(schema)
    type(schema_type), intent(inout) :: schema

    call schema%add(group_rule("sensitivity", "for the task `sensitivity`: quantities and parameters"), sensitivity_keys)
  end subroutine extend

  subroutine read_task(self, configuration, error)
    class(sensitivity_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    ! If the task is not requested, its group is read only to report the errors in it.
    if (.not. (self%requested .or. count_groups(configuration%document, "sensitivity") > 0)) return
    call read_quantities(configuration%document, sensitivity_keys, configuration%frame, configuration%probes, .false., &
      & self%quantities, error)
    if (allocated(error) .or. .not. self%requested) return
    configuration%analysis%verdict = .true.
    call read_sensitivity(configuration%document, configuration%schema, configuration%units, self%plan, error)
  end subroutine read_task

  subroutine run(self, context, result, error)
    class(sensitivity_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type) :: family
    type(table_type) :: table
    type(speed_options) :: options
    type(sensitivity_base_type) :: base
    type(sensitivity_type), allocatable :: derivatives(:)
    character(len=:), allocatable :: warning
    integer :: k

    call context%members(self%plan%family, family)
    associate (configuration => context%configuration, paths => self%plan%paths)
      options%names = self%quantities%name
      options%probes = configuration%probes
      options%accuracy = configuration%accuracy
      call solve_sensitivity(family, size(paths), options, base, derivatives, error, context%executor)
      if (allocated(error)) return
      table = table_of(self%quantities, paths, base, derivatives)
      call result%add(table)
      if (.not. context%is_presented()) return
      call result%add_figure(plot_sensitivity(table, self%quantities, paths, derivatives))
      warning = motion_warning([base%moved], configuration%analysis%model)
      call result%warn(undecided, warning)
      do k = 1, size(self%quantities)
        call result%warn(not_judged, strongest_influence(self%quantities(k), k, paths, derivatives))
      end do
      if (context%reports) call result%write_lines(report_sensitivity(self%quantities, paths, base, derivatives, warning))
    end associate
  end subroutine run

  !> Headline on the parameter that has the largest effect on the peak of quantity number `q`. Empty if no effect could be computed.
  pure function strongest_influence(quantity, q, paths, derivatives) result(line)
    type(quantity_type), intent(in) :: quantity
    integer, intent(in) :: q
    character(len=*), intent(in) :: paths(:)
    type(sensitivity_type), intent(in) :: derivatives(:)
    character(len=:), allocatable :: line
    integer :: i

    line = ""
    i = maxloc([(abs(derivatives(i)%slope(1, q)), i = 1, size(derivatives))], dim=1, mask=[(derivatives(i)%state(q) == "ok", i = &
      & 1, size(derivatives))])
    if (i > 0) line = "Strongest influence on the peak of " // trim(quantity%name) // ": " // trim(paths(i)) // ", " &
      & // concise(derivatives(i)%slope(1, q), 3) // " % per 1 %"
  end function strongest_influence

  !> The table sensitivity.csv, which has one row for each parameter of every quantity.
  pure type(table_type) function table_of(quantities, paths, base, derivatives) result(table)
    type(quantity_type), intent(in) :: quantities(:)
    character(len=*), intent(in) :: paths(:)
    type(sensitivity_base_type), intent(in) :: base
    type(sensitivity_type), intent(in) :: derivatives(:)
    integer :: i, k, n, m

    n = size(quantities)
    m = size(paths)
    table = new_table("sensitivity", "Sensitivity", "Change of peak and rms in percent if a parameter grows by 1 %.", &
      & judgement_type(base%state), shown=.true.)
    call table%add("quantity", "name as in the input", [((quantities(i)%name, k = 1, m), i = 1, n)])
    call table%add("unit", "unit of peak and rms", [((quantities(i)%unit, k = 1, m), i = 1, n)])
    call table%add("parameter", "path of the parameter that changes", ([((paths(k), k = 1, m), i = 1, n)]))
    call table%add("peak", unit_of_row, "peak for the machine in the input", [((base%values(1, i), k = 1, m), i = 1, n)])
    call table%add("peak_change_percent_per_percent", plain, "d ln(peak) / d ln(parameter)", [((derivatives(k)%slope(1, i), &
      & k = 1, m), i = 1, n)], error="peak_change_error")
    call table%add("peak_change_error", plain, "estimated error of the change of the peak", [((derivatives(k)%error(1, i), k = 1, &
      & m), i = 1, n)])
    call table%add("rms", unit_of_row, "rms for the machine in the input", [((base%values(2, i), k = 1, m), i = 1, n)])
    call table%add("rms_change_percent_per_percent", plain, "d ln(rms) / d ln(parameter)", [((derivatives(k)%slope(2, i), &
      & k = 1, m), i = 1, n)], error="rms_change_error")
    call table%add("rms_change_error", plain, "estimated error of the change of the rms", [((derivatives(k)%error(2, i), &
      & k = 1, m), i = 1, n)])
    call table%add("state", "ok; zero if nothing excites the quantity; undecided if the error is too large; failed if the " &
      & // "derivative cannot be computed", [((derivatives(k)%state(i), k = 1, m), i = 1, n)])
  end function table_of

end module gestell_task_sensitivity_task
