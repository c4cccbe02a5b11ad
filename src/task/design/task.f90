!> The task `design`: changes parameters of the machine, for example counterweights or mounts, to minimise objectives subject to
!> limits.
module gestell_task_design_task
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_input_schema, only: group_rule, schema_type
  use gestell_base_verdict, only: has_vibration, judgement_type, operator(==), operator(>), stable, undecided, unstable, &
    & verdict_type
  use gestell_output_table, only: table_type
  use gestell_output_result, only: result_type
  use gestell_task_common_task, only: longest_table, task_type, unsolved_machine
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_design_improved, only: improved_text
  use gestell_task_design_keys, only: constraint_keys, design_keys, objective_keys, robust_keys
  use gestell_task_design_plan, only: design_plan_type, read_design
  use gestell_task_design_plot, only: plot_curve, plot_goals, plot_parameters, plot_range, plot_starts
  use gestell_task_design_report, only: design_headline, report_design
  use gestell_task_design_search, only: design_type, find_curve, find_design
  use gestell_task_design_tables, only: curve_table, goal_table, parameter_table, range_table, start_table
  use gestell_task_common_locked_family, only: locked_family_type
  implicit none (type, external)
  private

  !> The task `design` with its plan from the input.
  type, extends(task_type), public :: design_task
    private
    type(design_plan_type) :: plan
  contains
    procedure :: describe, read => read_task, run
    procedure, nopass :: extend
  end type design_task

contains

  pure subroutine describe(self)
    class(design_task), intent(inout) :: self

    self%name = "design"
    self%meaning = "the machine with the best objective within the ranges of `&design` and the limits of `&constraint`"
    self%tables = [character(len=longest_table) :: "design", "design_goals", "design_range", "design_starts", "design_trade_off"]
    self%scope = unsolved_machine
    self%gives_verdict = .true.
  end subroutine describe

  subroutine extend(schema)
    type(schema_type), intent(inout) :: schema

    call schema%add(group_rule("design", "for the task `design`: a parameter that may change, and its range", repeatable=.true.), &
      & design_keys)
    call schema%add(group_rule("objective", "for the task `design`: a quantity to minimise", repeatable=.true.), objective_keys)
    call schema%add(group_rule("constraint", "for the task `design`: a limit that a quantity must meet", repeatable=.true.), &
      & constraint_keys)
    call schema%add(group_rule("robust", "for the task `design`: tolerances of speed and mounting"), robust_keys)
  end subroutine extend

  subroutine read_task(self, configuration, error)
    class(design_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    if (self%requested) call read_design(configuration, self%plan, error)
  end subroutine read_task

  subroutine run(self, context, result, error)
    class(design_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type) :: family
    type(design_type) :: design
    type(table_type) :: table
    type(verdict_type) :: judged, state
    type(judgement_type) :: verdict
    character(len=:), allocatable :: words, improved

    ! The search itself computes the vibrations of its machines, so the family supplies frames at rest.
    call context%members(self%plan%family, family, "rest")
    call find_design(family, self%plan, context%configuration%frame, design, error, context%executor)
    if (.not. allocated(error) .and. design%best == 0) call fatal_error(error, "at every starting point of the search the " // &
      &   "machine is impossible or has no periodic vibration: change the ranges in &design", failed_computation)
    if (allocated(error)) return
    associate (plan => self%plan, configuration => context%configuration)
      if (plan%curve > 0) call find_curve(family, plan, design, error)
      if (.not. allocated(error)) call improved_text(configuration%document, configuration%schema, plan%all_paths, &
        & design%x(plan%owners), improved, error)
      if (allocated(error)) return
      judged = design%after%verdict()
      verdict%verdict = judged
      call result%add(parameter_table(plan, design, verdict), plot_parameters(plan))
      call result%add(goal_table(design, verdict), plot_goals(design))
      if (size(design%options%conditions) > 1) then
        table = range_table(plan, design, verdict)
        call table%convert(result%units)
        call result%add(table, plot_range(plan, table))
      end if
      if (size(design%found) > 1) call result%add(start_table(plan, design, verdict), plot_starts((design%found%objective)))
      if (plan%curve > 0) then
        table = curve_table(plan, design)
        call table%convert(result%units)
        call result%add(table, plot_curve(design, table))
      end if
      if (len(improved) > 0) call result%attach("design.nml", improved)
      call design_headline(design, state, words)
      call result%warn(state, words)
      call judge(judged, result)
      call result%write_lines(report_design(plan, design, judged))
    end associate
  end subroutine run

  !> Adds the verdict on the design to the result, and a final line if the design is not stable.
  pure subroutine judge(verdict, result)
    type(verdict_type), intent(in) :: verdict
    type(result_type), intent(inout) :: result
    character(len=:), allocatable :: rest

    rest = ", disturbances of the vibration neither grow nor decay"
    if (verdict == undecided) rest = ", the error bounds leave open whether disturbances of the vibration grow or decay"
    if (verdict == unstable) rest = ", disturbances of the vibration grow"
    if (verdict > stable .and. has_vibration(verdict)) then
      call result%judge(judgement_type(verdict, ": after the design", rest))
    else
      call result%include_verdict(verdict)
    end if
  end subroutine judge

end module gestell_task_design_task
