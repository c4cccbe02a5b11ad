!> The task `resonance`: computes the vibration as a function of the crank speed.
module gestell_task_resonance_task
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: judgement_type, not_judged, operator(/=), stable, state_word, undecided
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_input_machine_quantities, only: read_quantities
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_output_report_warnings, only: motion_warning
  use gestell_output_result, only: result_type
  use gestell_output_report_orders, only: order_as_fraction
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_order_column
  use gestell_output_table_unit, only: new_unit, plain, rpm, unit_type, unit_of_row
  use gestell_study_speed_point, only: speed_options
  use gestell_task_common_task, only: all_speeds, longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_common_locked_family, only: locked_family_type
  use gestell_task_range_keys, only: resonance_keys
  use gestell_task_resonance_curve, only: resonance_curve_type, solve_curve
  use gestell_output_picture_script, only: figure_type
  use gestell_task_resonance_order_map, only: plot_order_map
  use gestell_task_resonance_plot, only: plot_peaks, plot_resonance
  use gestell_task_resonance_report, only: report_resonance, curve_verdict
  implicit none (type, external)
  private

  type, extends(task_type), public :: resonance_task
    private
    !> Quantities whose curves are computed
    type(quantity_type), allocatable :: quantities(:)
  contains
    procedure :: describe
    procedure :: read => read_resonance
    procedure :: run
  end type resonance_task

contains

  pure subroutine describe(self)
    class(resonance_task), intent(inout) :: self

    self%name = "resonance"
    self%meaning = "resonance curves: vibrations and forces as functions of the crank speed"
    self%tables = [character(len=longest_table) :: "resonance", "peaks", "order_map"]
    self%scope = all_speeds
    self%gives_verdict = .true.
  end subroutine describe

  !> Reads the quantities whose curves are requested. Fails if a quantity is invalid.
  subroutine read_resonance(self, configuration, error)
    class(resonance_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    call read_quantities(configuration%document, resonance_keys, configuration%frame, configuration%probes, .true., &
      & self%quantities, error)
  end subroutine read_resonance

  !> Computes the resonance curves, and adds tables, pictures and report to `result`.
  subroutine run(self, context, result, error)
    class(resonance_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(resonance_curve_type) :: curve
    type(locked_family_type) :: family
    type(speed_options) :: options
    type(judgement_type) :: judgement
    character(len=:), allocatable :: warning
    type(figure_type), allocatable :: figures(:)
    type(table_type) :: table
    integer :: i, k, turns

    call context%members(context%configuration%plan%family, family)
    associate (configuration => context%configuration)
      options%names = self%quantities%name
      options%probes = configuration%probes
      options%harmonics = configuration%harmonics(configuration%plan%orders)
      turns = configuration%turns()
      options%accuracy = configuration%accuracy
      call solve_curve(family, options, configuration%speeds(), curve, error, context%executor)
      if (allocated(error)) return
      judgement = curve_verdict(curve)
      warning = motion_warning(pack(curve%points%moved, curve%has_values()), configuration%analysis%model)
      if (any(curve%points%state /= stable)) result%all_stable = .false.
      table = curve_table(self%quantities, curve, turns, judgement)
      call table%convert(result%units)
      call result%add(table, plot_resonance(table, self%quantities, curve, turns, configuration%plan%base))
      figures = plot_order_map(table, self%quantities, curve, turns)
      do i = 1, size(figures)
        call result%add_figure(figures(i))
      end do
      table = new_table("peaks", "Peaks of the resonance curves", "", judgement, shown=.true.)
      associate (maxima => curve%maxima)
        call table%add("quantity", "name as in the input", (self%quantities(maxima%quantity)%name))
        call table%add("unit", "unit of the value", (self%quantities(maxima%quantity)%unit))
        call table%add("speed", rpm, "speed of the maximum", (maxima%speed))
        call table%add("value", unit_of_row, "peak of the quantity at this speed", (maxima%value))
        call table%add("width", rpm, "difference between the two speeds at which the curve has fallen to 1 / sqrt(2) of the " // &
          &   "peak", (maxima%width))
        call table%add("damping_ratio", plain, "width / (2 speed)", (maxima%damping_ratio))
        call add_order_column(table, "strongest_order", "order of the crank with the largest amplitude", &
          & (maxima%strongest_order), turns)
        call table%add("state", "state of the machine as in resonance.csv, or unbounded, or jump", &
          & merge("jump      ", merge("unbounded ", state_word(maxima%state), maxima%unbounded), maxima%jump))
        call table%add("small_motion", "as in resonance.csv", (maxima%small))
        call table%add("other_side", unit_of_row, "peak value on the other side of the jump, if the state is jump", &
          & (maxima%other_side))
      end associate
      call table%convert(result%units)
      call result%add(table, plot_peaks(table, self%quantities, curve, turns, configuration%plan%base))
      call result%judge(judgement)
      call result%warn(undecided, warning)
      do k = 1, size(self%quantities)
        associate (points => curve%points)
          i = maxloc([(points(i)%values(1, k), i = 1, size(points))], dim=1, mask=curve%has_values())
          if (i > 0) call result%warn(not_judged, "Response of " // trim(self%quantities(k)%name) // ": maximum " &
            & // concise(points(i)%values(1, k), 4) // " " // trim(self%quantities(k)%unit) // " at " &
            & // concise(points(i)%speed, 6) // " rpm")
        end associate
      end do
      call result%write_lines(report_resonance(self%quantities, curve, turns, judgement, warning, &
        & configuration%analysis%model))
    end associate
  end subroutine run

  !> The table resonance.csv of the curves. `turns`: number of turns that the crank makes in the period.
  pure type(table_type) function curve_table(quantities, curve, turns, verdict) result(table)
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    integer, intent(in) :: turns
    type(judgement_type), intent(in) :: verdict
    character(len=:), allocatable :: name
    type(unit_type) :: unit
    integer, allocatable :: harmonics(:)
    integer :: i, k

    harmonics = curve%options%requested_harmonics()
    table = new_table("resonance", "Resonance curves", "Response as a function of speed. Shading marks unstable vibrations; " &
      & // "at gaps no periodic vibration exists.", verdict)
    call table%add("speed", rpm, "crank speed", (curve%points%speed))
    call table%add("state", "ok, undamped, undecided, unstable, resonance, impossible or failed", state_word(curve%points%state))
    call table%add("refined", "1 if the program added this speed between those of the sweep", (curve%points%refined))
    do k = 1, size(quantities)
      name = trim(quantities(k)%name)
      unit = new_unit(trim(quantities(k)%unit))
      call table%add(name // "_peak", unit, "maximum magnitude over the period", row(1), bounds=row(2))
      call table%add(name // "_rms", unit, "root mean square over the period", row(3))
      do i = 1, size(harmonics)
        call table%add(name // "_order_" // order_as_fraction(harmonics(i), turns), unit, "amplitude of the order", row(3 + i))
      end do
    end do
    call table%add("small_motion", "1: the motion is small; 0: too large for the linear equations", curve%points%moved%small(), &
      & curve%has_values())

  contains

    !> Value number `i` of quantity number `k`, at all speeds.
    pure function row(i)
      integer, intent(in) :: i
      real(dp) :: row(size(curve%points))
      integer :: p

      row = [(curve%points(p)%values(i, k), p = 1, size(row))]
    end function row

  end function curve_table

end module gestell_task_resonance_task
