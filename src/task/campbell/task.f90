!> The task `campbell`: computes the modes as functions of the crank speed.
module gestell_task_campbell_task
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: judgement_type, not_judged
  use gestell_input_wording, only: counted
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: hertz, per_second, plain, rpm
  use gestell_model_frame, only: dof_names
  use gestell_study_mode, only: mode_type, max_dofs
  use gestell_task_common_task, only: all_speeds, longest_table, task_type
  use gestell_task_campbell, only: campbell_options, campbell_type, solve_campbell
  use gestell_task_campbell_crossings, only: crossing_type, find_crossings
  use gestell_task_campbell_plot, only: plot_campbell
  use gestell_task_campbell_report, only: campbell_verdict, report_campbell
  use gestell_task_common_context, only: context_type
  use gestell_task_common_locked_family, only: locked_family_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: follow_modes

  type, extends(task_type), public :: campbell_task
  contains
    procedure :: describe, run
  end type campbell_task

  !> The Campbell diagram and its crossings. Several tasks use them.
  type, public :: diagram_type
    type(campbell_options) :: options
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: crossings(:)
  end type diagram_type

  !> Model of the frame with which modes and critical speeds are computed: equations linearised about rest. In a resonance, the
  !> vibration of the exact frame may differ from the solution of these equations, or may not be found.
  character(len=*), parameter, public :: model_of_modes = "rest"

contains

  pure subroutine describe(self)
    class(campbell_task), intent(inout) :: self

    self%name = "campbell"
    self%meaning = "natural frequencies and damping ratios as functions of the crank speed"
    self%tables = [character(len=longest_table) :: "campbell", "crossings"]
    self%scope = all_speeds
    self%gives_verdict = .true.
  end subroutine describe

  !> Computes the Campbell diagram, and adds tables, pictures and report to `result`.
  subroutine run(self, context, result, error)
    class(campbell_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(diagram_type) :: diagram
    type(judgement_type) :: judgement
    type(table_type) :: table

    call follow_modes(context, diagram, error)
    if (allocated(error)) return
    judgement = campbell_verdict(diagram%campbell)
    call result%add(campbell_table(diagram%campbell, judgement), plot_campbell(diagram%campbell, diagram%crossings, &
      & context%configuration%plan%orders, context%configuration%plan%base))
    associate (crossings => diagram%crossings, unused => self)
      table = new_table("crossings", "Crossings", "", judgement, shown=.true.)
      table%model = model_of_modes
      call table%add("mode", "number of the mode", (crossings%mode))
      call table%add("order", plain, "multiple of the crank speed", (crossings%order))
      call table%add("speed", rpm, "crank speed at the crossing; if the mode is locked to the order, middle of the locking " &
        & // "interval", (crossings%speed), bounds=(crossings%error))
      call table%add("from", rpm, "start of the interval of speeds in which the mode is locked to the order; without locking, " &
        & // "speed of the crossing", (crossings%ends(1)))
      call table%add("to", rpm, "end of the interval of speeds in which the mode is locked to the order; without locking, " &
        & // "speed of the crossing", (crossings%ends(2)))
      call table%add("frequency", hertz, "frequency of the mode at the crossing", crossings%at%frequency() / (2 * pi))
      call table%add("growth", per_second, "growth rate of the mode at the crossing", (crossings%at%growth))
      call table%add("damping_ratio", plain, "damping ratio (Lehr) of the mode at the crossing", crossings%at%damping_ratio())
      call table%add("locked", "1: the mode is locked to the order over an interval of speeds; 0: the mode only crosses the " &
        & // "order", (crossings%locked))
      call result%add(table)
    end associate
    call result%judge(judgement)
    call result%warn(not_judged, "Campbell diagram: " // counted(diagram%campbell%modes, "mode") // ", " &
      & // counted(size(diagram%crossings), "crossing") // " with orders of the crank")
    call result%write_lines(report_campbell(diagram%campbell, diagram%crossings))
  end subroutine run

  !> Computes the modes at the speeds of the sweep, and their crossings with orders. Stores them in `context` for other tasks.
  subroutine follow_modes(context, diagram, error)
    type(context_type), intent(inout) :: context
    type(diagram_type), intent(out) :: diagram
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type) :: family

    if (allocated(context%stored_result)) then
      select type (stored_result => context%stored_result)
      type is (diagram_type)
        diagram = stored_result
        return
      end select
    end if
    diagram%options%accuracy = context%configuration%accuracy
    diagram%options%harmonics = context%configuration%harmonics(context%configuration%plan%orders)
    call context%members(context%configuration%plan%family, family, model_of_modes)
    call solve_campbell(family, context%configuration%speeds(), diagram%options, diagram%campbell, error, context%executor)
    if (.not. allocated(error)) call find_crossings(family, diagram%options, diagram%campbell, diagram%crossings, error, &
      & context%executor)
    if (.not. allocated(error)) allocate(context%stored_result, source=diagram)
  end subroutine follow_modes

  !> The table campbell.csv, which has one row for each mode at each speed. Mode shapes are scaled so that their largest component
  !> is real and positive.
  pure type(table_type) function campbell_table(campbell, verdict) result(table)
    type(campbell_type), intent(in) :: campbell
    type(judgement_type), intent(in) :: verdict
    integer, parameter :: columns = 7 + 2 * max_dofs
    real(dp) :: values(columns, campbell%modes * size(campbell%points))
    integer :: i, k

    associate (points => campbell%points, modes => campbell%modes)
      do i = 1, size(points)
        do k = 1, modes
          values(:, modes * (i - 1) + k) = numbers(points(i)%modes(k), campbell%free)
        end do
      end do
      table = new_table("campbell", "Campbell diagram", "Frequencies of the modes and multiples of the crank speed (orders), " &
        & // "over the crank speed.", verdict)
      table%model = model_of_modes
      call table%add("speed", rpm, "crank speed", [((points(i)%speed, k = 1, modes), i = 1, size(points))])
      call table%add("mode", "number of the mode", [((k, k = 1, modes), i = 1, size(points))])
      call table%add("frequency", hertz, "frequency of the mode's strongest component; 0: the mode does not oscillate", &
        & values(1, :), error="frequency_error")
      call table%add("growth", per_second, "larger growth rate of the mode's two exponents; negative: the mode decays", &
        & values(2, :), error="growth_error")
      call table%add("partner_growth", per_second, "smaller growth rate of the mode's two exponents", values(3, :))
      call table%add("damping_ratio", plain, "damping ratio (Lehr)", values(4, :))
      call table%add("share", plain, "share of the strongest component in the mean square of the mode's motion", values(5, :))
      call table%add("frequency_error", hertz, "bound on the error of the frequency", values(6, :))
      call table%add("growth_error", per_second, "bound on the error of the growth rate", values(7, :))
      do k = 1, merge(max_dofs, 3, any(campbell%free > 3))
        call table%add(trim(dof_names(k)) // "_re", plain, "real part of the mode shape", values(6 + 2 * k, :))
        call table%add(trim(dof_names(k)) // "_im", plain, "imaginary part of the mode shape", values(7 + 2 * k, :))
      end do
      call table%add("real_pair", "1: the mode has two real multipliers, because it is locked to the crank or overdamped; 0: " &
        & // "it has a conjugate pair", &
        & [((points(i)%modes(k)%identified .and. points(i)%modes(k)%real_pair, k = 1, modes), i = 1, size(points))])
      call table%add("sure", "0: mode shapes mix at this speed, so the numbers of the modes may be interchanged; 1: the " &
        & // "numbers are certain", [((points(i)%unambiguous, k = 1, modes), i = 1, size(points))])
      call table%add("inserted", "1: the program added this speed; 0: the speed was given in &sweep", &
        & [((.not. points(i)%ordered, k = 1, modes), i = 1, size(points))])
    end associate
  end function campbell_table

  !> One row of the table: the numbers from the frequency to the error bound, followed by the mode shape. The largest component of
  !> the shape is made real and positive.
  pure function numbers(mode, free) result(row)
    type(mode_type), intent(in) :: mode
    integer, intent(in) :: free(:)
    real(dp) :: row(7 + 2 * max_dofs)
    complex(dp) :: shape(max_dofs), all(max_dofs)
    integer :: k

    row = ieee_value(1.0_dp, ieee_quiet_nan)
    if (.not. mode%identified) return
    shape = mode%shape()
    associate (largest => shape(maxloc(abs(shape), dim=1)))
      if (abs(largest) > 0) shape = shape * (abs(largest) / largest)
    end associate
    all = 0
    all(free) = shape(:size(free))
    row(:7) = [mode%frequency() / (2 * pi), mode%growth, mode%partner_growth, mode%damping_ratio(), mode%share(), &
      & mode%error / (2 * pi), mode%error]
    row(8:) = [(real(all(k)), aimag(all(k)), k = 1, max_dofs)]
  end function numbers

end module gestell_task_campbell_task
