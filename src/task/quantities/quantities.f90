!> The part of the task `response` that evaluates those quantities that the input requests by name.
module gestell_task_quantities
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline
  use gestell_input_machine_quantities, only: read_measures, read_quantities
  use gestell_input_namelist_document, only: group_type, has, group_named
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: new_unit, unit_of_row
  use gestell_study_measure, only: measure_names, measure_type, rows_of, compute_measures
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_common_keys, only: response_keys
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  !> The part of the task `response` that evaluates requested quantities.
  type, extends(task_type), public :: quantities_task
    private
    !> The requested quantities, and for each the requested value: peak, rms, or rms within a frequency band
    type(measure_type), allocatable :: measures(:)
  contains
    procedure :: describe, read => read_task, run
  end type quantities_task

contains

  pure subroutine describe(self)
    class(quantities_task), intent(inout) :: self

    self%name = "response"
    self%tables = [character(len=longest_table) :: "quantities"]
    self%gives_verdict = .true.
    self%brief = .true.
  end subroutine describe

  !> Reads the requested quantities, and requests the rows of the motion from which they are computed. Fails if a quantity is
  !> invalid.
  subroutine read_task(self, configuration, error)
    class(quantities_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(quantity_type), allocatable :: quantities(:)
    type(group_type) :: group
    integer :: rows

    allocate(quantities(0))
    associate (doc => configuration%document, frame => configuration%frame, probes => configuration%probes)
      group = group_named(doc, "response")
      if (has(group, "quantities")) call read_quantities(doc, response_keys, frame, probes, .false., quantities, error)
      if (.not. allocated(error)) call read_measures(group, response_keys, frame, probes, (quantities%name), self%measures, error)
      if (allocated(error)) return
      self%requested = self%requested .and. size(self%measures) > 0
      call rows_of(frame, probes, self%measures, rows, error)
    end associate
    if (self%requested) configuration%analysis%rows = max(configuration%analysis%rows, rows)
  end subroutine read_task

  !> Evaluates the requested quantities, and adds table and report to `result`.
  subroutine run(self, context, result, error)
    class(quantities_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    character(len=:), allocatable :: lines
    real(dp) :: values(2, size(self%measures))
    integer :: i

    values = ieee_value(values, ieee_quiet_nan)
    if (allocated(context%analysis%vibration)) then
      call compute_measures(context%analysis%frame, context%configuration%probes, context%analysis%vibration, self%measures, &
        & values, error)
      if (allocated(error)) return
      table = new_table("quantities", "Quantities", "Requested quantities of the vibration.", shown=.true.)
      lines = ""
      associate (measures => self%measures)
        call table%add("quantity", "name of the quantity in the input", (measures%quantity))
        call table%add("measure", "peak, rms or band", measure_names(measures%kind))
        call table%add("unit", "unit of the value", (measures%unit))
        call table%add("value", unit_of_row, "value over the period", values(1, :), error="error")
        call table%add("error", unit_of_row, "bound on its error", values(2, :))
        do i = 1, size(measures)
          lines = lines // trim(measures(i)%quantity) // tab // trim(measure_names(measures(i)%kind)) // tab &
            & // concise(values(1, i), 5) // tab // concise(values(2, i), 1) // tab // trim(measures(i)%unit) // newline
        end do
      end associate
      call result%add(table)
      if (context%reports) call result%write_section("QUANTITIES", tabulated("llrrl", ",,value,error", lines))
    end if
    do i = 1, size(self%measures)
      associate (measure => self%measures(i), unit => new_unit(trim(self%measures(i)%unit)))
        ! another task may already have added this quantity
        if (result%brief%number_of(trim(measure%name()) // "_" // trim(unit%suffix)) > 0) cycle
        call result%brief%add(trim(measure%name()), unit, trim(measure%meaning()), values(1:1, i))
        call result%brief%add(trim(measure%name()) // "_error", unit, "bound on its error", values(2:2, i))
      end associate
    end do
  end subroutine run

end module gestell_task_quantities
