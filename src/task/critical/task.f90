!> The task `critical`: finds the speeds near resonances at which the vibration has a maximum.
module gestell_task_critical_task
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_base_verdict, only: judgement_type, not_judged, undecided
  use gestell_input_wording, only: counted
  use gestell_output_report_warnings, only: motion_warning
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_order_column
  use gestell_output_table_unit, only: hertz, metre, newton, plain, rpm, unit_type
  use gestell_task_common_task, only: all_speeds, longest_table, task_type
  use gestell_task_critical_plot, only: plot_critical
  use gestell_task_critical_report, only: critical_verdict, report_critical
  use gestell_task_campbell_task, only: diagram_type, follow_modes, model_of_modes
  use gestell_task_common_context, only: context_type
  use gestell_task_common_locked_family, only: locked_family_type
  use gestell_task_critical, only: amplitude, critical_type, find_critical, force, outcomes
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  type, extends(task_type), public :: critical_task
  contains
    procedure :: describe, run
  end type critical_task

contains

  pure subroutine describe(self)
    class(critical_task), intent(inout) :: self

    self%name = "critical"
    self%meaning = "critical speeds: the crank speeds at which the vibration has a peak"
    self%tables = [character(len=longest_table) :: "critical"]
    self%scope = all_speeds
    self%gives_verdict = .true.
  end subroutine describe

  !> Finds the critical speeds, and adds table, picture and report to `result`.
  subroutine run(self, context, result, error)
    class(critical_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(diagram_type) :: diagram
    type(locked_family_type) :: family
    type(critical_type), allocatable :: critical(:)
    type(judgement_type) :: judgement
    type(table_type) :: table
    character(len=:), allocatable :: warning
    integer :: maximum, turns

    call follow_modes(context, diagram, error)
    call context%members(context%configuration%plan%family, family, model_of_modes)
    if (.not. allocated(error)) call find_critical(family, diagram%options, diagram%crossings, critical, error, context%executor)
    if (allocated(error)) return
    judgement = critical_verdict(critical, diagram%campbell)
    turns = context%configuration%turns()
    table = table_of(critical, turns, judgement)
    call table%convert(result%units)
    call result%add(table, plot_critical(table, critical, diagram%campbell, context%configuration%plan%base))
    call result%judge(judgement)
    warning = motion_warning(pack(critical%moved, critical%found(amplitude) .or. critical%found(force)), model_of_modes)
    call result%warn(undecided, warning)
    maximum = maxloc(critical%height(amplitude), dim=1, mask=critical%found(amplitude))
    if (maximum > 0) then
      associate (peak => critical(maximum), unused => self)
        call result%warn(not_judged, "Critical speeds: " // counted(count(critical%found(amplitude)), "peak") &
          & // ", maximum amplitude " // concise(1000 * peak%height(amplitude), 4) // " mm at " &
          & // concise(peak%speed(amplitude), 6) // " rpm (mode " &
          & // text(peak%crossing%mode) // ", order " // concise(peak%crossing%order, 4) // ")")
      end associate
    end if
    call result%write_lines(report_critical(critical, context%configuration%plan%orders, turns, judgement, warning))
  end subroutine run

  !> The table critical.csv, which lists the critical speeds. `turns`: number of turns that the crank makes in the period.
  pure type(table_type) function table_of(critical, turns, verdict) result(table)
    type(critical_type), intent(in) :: critical(:)
    integer, intent(in) :: turns
    type(judgement_type), intent(in) :: verdict

    table = new_table("critical", "Critical speeds", "Crank speeds at which the vibration has a peak, for each mode and order.", &
      & verdict, shown=.true.)
    table%model = model_of_modes
    call table%add("mode", "number of the mode", (critical%crossing%mode))
    call add_order_column(table, "order", "order of the crank", (critical%crossing%harmonic), turns)
    call table%add("outcome", "what happens at the crossing: peak, no_peak, unbounded (the damping is zero within its error) " &
      & // "or unstable (the free vibration grows)", outcomes(critical%outcome))
    call table%add("crossing", rpm, "crank speed at which the order equals the mode's frequency", (critical%crossing%speed))
    call table%add("half_width", rpm, "half width of the resonance, computed from the damping of the mode", (critical%half_width))
    call table%add("frequency", hertz, "frequency of the mode at the crossing", critical%crossing%at%frequency() / (2 * pi))
    call table%add("damping_ratio", plain, "damping ratio of the mode at the crossing", critical%crossing%at%damping_ratio())
    call add_peaks(table, amplitude, "", "amplitude", metre)
    call table%add("share", plain, "share of the order in the mean square of the vibration at the peak", &
      & shown(amplitude, critical%share))
    call add_peaks(table, force, "force_", "force", newton)
    call table%add("verdict", "worse of the verdicts at the peak of the amplitude and at the peak of the force", &
      & critical%verdict%word())
    call table%add("small_motion", "1: the motion at the peaks is small; 0: it is too large for the linearised equations", &
      & critical%moved%small(), critical%found(amplitude) .or. critical%found(force))

  contains

    !> Adds the columns for the peaks of the quantity `which` to the table.
    pure subroutine add_peaks(table, which, prefix, name, unit)
      type(table_type), intent(inout) :: table
      integer, intent(in) :: which
      character(len=*), intent(in) :: prefix, name
      type(unit_type), intent(in) :: unit

      call table%add(prefix // "speed", rpm, "speed of the peak", shown(which, critical%speed(which)), &
        & bounds=shown(which, critical%error(which)))
      call table%add(name, unit, trim(merge("amplitude of the order at the peak                 ", &
        & "maximum of the total force at the speed of the peak", which == amplitude)), shown(which, critical%height(which)))
      call table%add(prefix // "prominence", plain, "height of the peak divided by the height of the higher of the two " &
        & // "adjacent valleys", shown(which, critical%prominence(which)))
    end subroutine add_peaks

    !> The values for the quantity `which`; NaN where it has no peak.
    pure function shown(which, values)
      integer, intent(in) :: which
      real(dp), intent(in) :: values(:)
      real(dp) :: shown(size(values))

      shown = merge(values, ieee_value(1.0_dp, ieee_quiet_nan), critical%found(which))
    end function shown

  end function table_of

end module gestell_task_critical_task
