!> Writes the report of the task `critical`: the critical speeds.
module gestell_task_critical_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, fixed, newline, text
  use gestell_base_verdict, only: judgement_type, operator(/=), operator(>), stable
  use gestell_input_wording, only: counted
  use gestell_output_report_orders, only: range_of
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_output_report_warnings, only: judge_range
  use gestell_task_campbell, only: campbell_type
  use gestell_task_campbell_report, only: campbell_verdict, max_listed
  use gestell_task_critical, only: amplitude, critical_type, force, no_peak, peak, self_excited
  implicit none (type, external)
  private

  public :: critical_verdict, report_critical

  !> A peak is listed if its order contributes at least this share to the mean square of the vibration
  real(dp), parameter :: min_share = 0.01_dp

contains

  !> Section of the report on the critical speeds at which the peak is noticeable.
  pure function report_critical(critical, orders, turns, verdict, warning) result(report)
    type(critical_type), intent(in) :: critical(:)
    !> `orders`: highest order of the crank. `turns`: number of turns that the crank makes in the period
    integer, intent(in) :: orders, turns
    !> `verdict`: verdict on the vibrations at these speeds. `warning`: warning that some motions are too large for the linearised
    !> equations
    character(len=*), intent(in) :: warning
    type(judgement_type), intent(in) :: verdict
    character(len=:), allocatable :: report, rows
    integer :: i, listed, quiet

    report = newline // "CRITICAL SPEEDS, orders " // range_of(orders, turns) // ", linearised about rest" // newline
    if (verdict%verdict > stable) report = report // "  " // verdict%sentence() // newline
    report = report // warning
    if (size(critical) == 0) then
      report = report // "  no natural frequency crosses a requested order of the crank within the range" // newline
      return
    end if
    rows = ""
    listed = 0
    quiet = 0
    do i = 1, size(critical)
      associate (c => critical(i))
        if (c%outcome == no_peak .or. (c%outcome == peak .and. c%share < min_share)) then
          quiet = quiet + 1
          cycle
        end if
        listed = listed + 1
        if (listed > max_listed) cycle
        rows = rows // text(c%crossing%mode) // tab // concise(c%crossing%order, 4) // tab
        if (c%outcome == peak) then
          rows = rows // fixed(c%speed(amplitude), 5) // tab // concise(c%half_width, 3) // tab &
            & // concise(1000 * c%height(amplitude), 4) // tab
          if (c%found(force)) rows = rows // concise(c%height(force), 4)
          rows = rows // tab
          if (c%verdict /= stable) rows = rows // trim(c%verdict%word()) // "  "
          if (.not. c%moved%small()) rows = rows // "not small"
        else
          rows = rows // fixed(c%crossing%speed, 5) // repeat(tab, 4)
          if (c%outcome == self_excited) rows = rows // "unstable: the free vibration grows"
          if (c%outcome /= self_excited) rows = rows // "unbounded: the damping is zero within its error"
        end if
        rows = rows // newline
      end associate
    end do
    if (listed > 0) report = report // tabulated("rrrrrrl", "mode,order,peak at,half width,amplitude,ground force" // newline &
      & // ",,rpm,rpm,mm,N", rows)
    if (listed == 0) report = report // "  the vibration has no noticeable peak at any crossing" // newline
    if (listed > max_listed) report = report // "  ... the other critical speeds are in critical.csv" // newline
    if (quiet > 0) report = report // "  " // counted(quiet, "more crossing") // " without a noticeable peak" // newline
  end function report_critical

  !> Worst verdict on the vibrations at the crossings and at all speeds of the Campbell diagram. It is printed at the head of the
  !> report on the critical speeds and in its files.
  pure type(judgement_type) function critical_verdict(critical, campbell) result(judgement)
    type(critical_type), intent(in) :: critical(:)
    type(campbell_type), intent(in) :: campbell
    type(judgement_type) :: of_modes

    judgement = judge_range((critical%crossing%speed), (critical%verdict), "crossings", "disturbances of the vibration grow")
    of_modes = campbell_verdict(campbell)
    if (of_modes%verdict > judgement%verdict) judgement = of_modes
  end function critical_verdict

end module gestell_task_critical_report
