!> The task `separation`: computes the distances of the modes from the orders of the crank speed, at the operating speed or over a
!> range of speeds.
module gestell_task_separation_task
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: judgement_type, verdict_type
  use gestell_input_machine_family, only: document_family_type, new_document_family
  use gestell_input_machine_frame, only: drive_keys
  use gestell_input_namelist_document, only: document_type, group_type, groups_named, has, group_named
  use gestell_input_schema, only: group_rule, schema_type
  use gestell_input_schema_read, only: read
  use gestell_input_wording, only: lower
  use gestell_output_report_orders, only: range_of
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_order_column
  use gestell_output_table_unit, only: hertz, plain, rpm, unit_type
  use gestell_model_frame, only: dof_names
  use gestell_task_common_task, only: longest_table, task_type, unsolved_machine
  use gestell_task_campbell, only: campbell_options, campbell_type, solve_campbell
  use gestell_task_campbell_crossings, only: crossing_type, find_crossings
  use gestell_task_campbell_report, only: campbell_verdict
  use gestell_task_campbell_task, only: model_of_modes
  use gestell_task_common_configuration, only: configuration_type, read_plan
  use gestell_task_common_context, only: context_type
  use gestell_task_common_locked_family, only: locked_family_type
  use gestell_task_separation, only: find_separations, separation_type
  use gestell_task_separation_keys, only: separation_keys
  use gestell_task_separation_plot, only: plot_separation
  use gestell_task_separation_report, only: report_separation, separation_headline
  use gestell_task_separation_torque_roll, only: axis_table, share_torque_roll, torque_roll_line
  use gestell_task_range_keys, only: sweep_keys
  use gestell_task_range_plan, only: refuse_standstill
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  type, extends(task_type), public :: separation_task
    private
    !> Highest order of the crank speed that is examined
    integer :: orders = 4
    !> Required distance of a mode from an order (%), relative to the frequency of the order
    real(dp) :: margin = 20
    !> Family of machines that differ in the speed
    type(document_family_type) :: family
    !> Speeds that are examined (1/min): the operating speed, or the speeds of the sweep
    real(dp), allocatable :: speeds(:)
  contains
    procedure :: describe, read => read_separation, run
    procedure, nopass :: extend
  end type separation_task

  character(len=*), parameter :: speed_path = "drive.speed_rpm"
  type(unit_type), parameter :: percent = unit_type("percent", "%")

contains

  pure subroutine describe(self)
    class(separation_task), intent(inout) :: self

    self%name = "separation"
    self%meaning = "distances between the natural frequencies and multiples of the crank speed"
    self%tables = [character(len=longest_table) :: "separation", "torque_roll"]
    self%scope = unsolved_machine
    self%gives_verdict = .true.
  end subroutine describe

  !> Adds the group &separation to the input schema.
  subroutine extend(schema)
    type(schema_type), intent(inout) :: schema

    call schema%add(group_rule("separation", "for the task `separation`: orders of the crank speed that are compared with the " &
      & // "natural frequencies, and the required distance"), separation_keys)
  end subroutine extend

  !> Reads the group &separation and the speeds. Fails if a value is out of range, or if the sweep of the speed is invalid.
  subroutine read_separation(self, configuration, error)
    class(separation_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    associate (doc => configuration%document)
      call read(group_named(doc, "separation"), separation_keys, "orders", self%orders, error)
      if (.not. allocated(error)) call read(group_named(doc, "separation"), separation_keys, "margin_percent", self%margin, error)
      if (allocated(error) .or. .not. self%requested) return
      allocate(self%speeds(1))
      call read(group_named(doc, "drive"), drive_keys, "speed_rpm", self%speeds(1), error)
      if (allocated(error)) return
      if (runs_over_speed(doc)) then
        if (.not. allocated(configuration%plan)) call read_plan(configuration, .false., error)
        if (.not. allocated(error)) call refuse_standstill(groups_named(doc, "sweep"), configuration%plan, error)
        if (allocated(error)) return
        self%speeds = configuration%speeds()
      end if
      call new_document_family(self%family, doc, configuration%schema, configuration%units, [speed_path], error, self%speeds(:1))
    end associate
  end subroutine read_separation

  !> True if the sweep varies the speed and nothing else.
  logical function runs_over_speed(doc)
    type(document_type), intent(in) :: doc
    type(group_type), allocatable :: groups(:)
    type(error_type), allocatable :: error
    character(len=:), allocatable :: path

    groups = groups_named(doc, "sweep")
    runs_over_speed = size(groups) == 1
    if (runs_over_speed) runs_over_speed = has(groups(1), "parameter")
    if (.not. runs_over_speed) return
    call read(groups(1), sweep_keys, "parameter", path, error)
    if (.not. allocated(error)) runs_over_speed = lower(trim(adjustl(path))) == speed_path
  end function runs_over_speed

  !> Computes the distances between modes and orders, and adds tables, picture and report to `result`.
  subroutine run(self, context, result, error)
    class(separation_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type) :: family
    type(campbell_options) :: options
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: crossings(:)
    type(separation_type), allocatable :: separations(:)
    type(judgement_type) :: judgement
    type(verdict_type) :: state
    character(len=:), allocatable :: words
    integer :: turns

    options%accuracy = context%configuration%accuracy
    options%harmonics = context%configuration%harmonics(self%orders)
    turns = context%configuration%turns()
    call context%members(self%family, family, model_of_modes)
    call solve_campbell(family, self%speeds, options, campbell, error, context%executor)
    if (.not. allocated(error)) call find_crossings(family, options, campbell, crossings, error, context%executor)
    if (allocated(error)) return
    separations = find_separations(campbell, crossings, options%harmonics, turns, self%margin / 100)
    call share_torque_roll(context%configuration%frame, campbell, separations)
    judgement = campbell_verdict(campbell)
    call result%add(table_of(separations, turns, trim(family%model), judgement), plot_separation(separations, campbell, &
      & options%harmonics, turns, self%margin))
    if (context%configuration%frame%dofs() > 3) call result%add(axis_table(context%configuration%frame))
    call result%judge(judgement)
    call separation_headline(separations, self%margin, state, words)
    call result%warn(state, words)
    call result%write_lines(report_separation(separations, self%speeds, range_of(self%orders, turns), self%margin, &
      & judgement, torque_roll_line(separations(::size(options%harmonics)))))
  end subroutine run

  !> The table separation.csv, which has one row for each order of every mode.
  pure type(table_type) function table_of(separations, turns, model, verdict) result(table)
    type(separation_type), intent(in) :: separations(:)
    integer, intent(in) :: turns
    character(len=*), intent(in) :: model
    type(judgement_type), intent(in) :: verdict
    integer :: i, k, n

    n = size(separations)
    table = new_table("separation", "Separation", "Natural frequencies, and orders of the crank speed with the required margins.", &
      & verdict, shown=.true.)
    table%model = model
    call table%add("mode", "number of the mode", (separations%mode))
    call add_order_column(table, "order", "multiple of the crank speed", (separations%harmonic), turns)
    call table%add("speed", rpm, "speed at which mode and order are closest", (separations%speed))
    call table%add("frequency", hertz, "frequency of the mode at this speed", (separations%frequency), &
      & bounds=[(merge(separations(i)%at%error / (2 * pi), &
      & ieee_value(1.0_dp, ieee_quiet_nan), separations(i)%at%identified), i = 1, n)])
    call table%add("damping_ratio", plain, "damping ratio (Lehr) of the mode at this speed", [(separations(i)%at%damping_ratio(), &
      & i = 1, n)])
    call table%add("share", plain, "share of the strongest component in the mean square of the mode", [(separations(i)%at%share(), &
      & i = 1, n)])
    call table%add("excitation", hertz, "frequency of the order at the speed of this row", (separations%excitation))
    call table%add("distance", percent, "difference between the frequencies of mode and order, relative to the order's " &
      & // "frequency", 100 * separations%distance, bounds=100 * separations%error)
    do k = 1, maxval([3, separations%dofs])
      call table%add("energy_" // trim(dof_names(k)), plain, "share of " // trim(dof_names(k)) &
        & // " in the kinetic energy of the mode", [(separations(i)%energy(k), i = 1, n)])
    end do
    call table%add("state", "pass, fail or undecided", (separations%state))
    if (any(separations%torque_roll >= 0)) call table%add("energy_torque_roll", plain, "share of the motion about the " &
      & // "torque-roll axis in the kinetic energy of the mode", [(merge(separations(i)%torque_roll, ieee_value(1.0_dp, &
      & ieee_quiet_nan), separations(i)%torque_roll >= 0), i = 1, n)])
  end function table_of

end module gestell_task_separation_task
