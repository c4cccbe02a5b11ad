!> Writes the report of the task `campbell`: the modes as functions of the speed.
module gestell_task_campbell_report
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, fixed, newline, text
  use gestell_base_verdict, only: judgement_type, operator(>), stable, undamped, undecided, unstable, verdict_type
  use gestell_input_wording, only: counted
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_output_report_warnings, only: judge_range
  use gestell_task_campbell, only: campbell_type
  use gestell_task_campbell_crossings, only: crossing_type
  use gestell_study_mode, only: mode_type
  implicit none (type, external)
  private

  public :: campbell_verdict, report_campbell

  !> Maximum number of rows in a table of the report.
  integer, parameter, public :: max_listed = 60
  !> Minimum width, relative to the speed, of an interval that is reported by its ends. A narrower interval is reported by its width
  real(dp), parameter :: wide = 1.0e-4_dp

contains

  !> Section of the report: the modes at both ends of the range of speeds, and the crossings.
  pure function report_campbell(campbell, crossings) result(report)
    type(campbell_type), intent(in) :: campbell
    type(crossing_type), intent(in) :: crossings(:)
    character(len=:), allocatable :: report, rows, list
    type(judgement_type) :: judgement
    logical, allocatable :: solved(:)
    integer, parameter :: most_named = 5
    integer :: first, last, named, k

    report = newline // "CAMPBELL DIAGRAM  of " // counted(campbell%modes, "mode") // " at " &
      & // counted(count(campbell%points%ordered), "speed") // ", about rest" // newline
    judgement = campbell_verdict(campbell)
    if (judgement%verdict > stable) report = report // "  " // judgement%sentence() // newline
    solved = campbell%points%solved
    if (.not. any(solved)) then
      report = report // "  no mode can be identified at any crank speed of the range" // newline
      return
    end if
    first = findloc(solved, .true., dim=1)
    last = findloc(solved, .true., dim=1, back=.true.)
    rows = ""
    associate (from => campbell%points(first), to => campbell%points(last))
      do k = 1, campbell%modes
        rows = rows // text(k) // tab // words(from%modes(k)) // tab // words(to%modes(k)) // newline
      end do
      report = report // tabulated("rrrrr", "mode,at " // concise(from%speed, 7) // " rpm,damping,at " // concise(to%speed, 7) &
        & // " rpm,damping" // newline // ",Hz,ratio,Hz,ratio", rows)
    end associate
    if (.not. all(solved)) report = report // "  note: at " // counted(count(.not. solved), "speed") &
      & // " the mechanism cannot be assembled, or no mode can be identified" // newline
    ! list the first speeds at which modes cannot be distinguished
    list = ""
    named = 0
    do k = 1, size(campbell%points)
      if (campbell%points(k)%unambiguous) cycle
      if (.not. campbell%points(max(k - 1, 1))%unambiguous .and. k > 1) cycle
      named = named + 1
      if (named <= most_named) list = list // ", " // concise(campbell%points(k)%speed, 5)
    end do
    if (named > 0) report = report // "  note: near " // list(3:) // either(", ...", "", named > most_named) &
      & // " rpm the mode shapes mix, so the numbers of the modes may be interchanged" // newline
    report = report // crossing_lines(crossings)
  end function report_campbell

  !> Frequency (Hz) and damping ratio of a mode, separated by a tab; dashes if the mode is not identified.
  pure function words(mode)
    type(mode_type), intent(in) :: mode
    character(len=:), allocatable :: words

    words = "-" // tab // "-"
    if (mode%identified) words = concise(mode%frequency() / (2 * pi), 6) // tab // ratio(mode)
  end function words

  !> Damping ratio of a mode; 0 if the growth rate does not exceed its error bound.
  pure function ratio(mode)
    type(mode_type), intent(in) :: mode
    character(len=:), allocatable :: ratio

    ratio = "0"
    if (abs(mode%growth) > mode%error) ratio = concise(mode%damping_ratio(), 4)
  end function ratio

  !> Table of the crossings in the Campbell diagram.
  pure function crossing_lines(crossings) result(report)
    type(crossing_type), intent(in) :: crossings(:)
    character(len=:), allocatable :: report, rows
    integer :: i

    if (size(crossings) == 0) then
      report = newline // "  no natural frequency crosses a requested order of the crank within the range" // newline
      return
    end if
    rows = ""
    do i = 1, min(size(crossings), max_listed)
      associate (c => crossings(i))
        rows = rows // text(c%mode) // tab // concise(c%order, 4) // tab // fixed(c%speed, 5) // tab &
          & // fixed(c%at%frequency() / (2 * pi), 4) // tab // ratio(c%at) // tab
        if (.not. noticeably_locked(c)) then
          rows = rows // either("unstable", "", c%at%growth > c%at%error)
        else if (abs(c%ends(2) - c%ends(1)) > wide * abs(c%speed)) then
          rows = rows // "locked from " // concise(c%ends(1), 7) // " to " // concise(c%ends(2), 7)
        else
          rows = rows // "locked over " // concise(abs(c%ends(2) - c%ends(1)), 2) // " rpm"
        end if
        if (noticeably_locked(c) .and. c%at%growth > c%at%error) rows = rows // ", unstable"
        rows = rows // newline
      end associate
    end do
    report = newline // tabulated("rrrrrl", "mode,order,crossing,frequency,damping" // newline // ",,rpm,Hz,ratio", rows)
    if (size(crossings) > max_listed) report = report // "  ... all crossings in crossings.csv" // newline
  end function crossing_lines

  !> True if the mode is locked to the order over an interval of speeds that is wide relative to the resonance, or in which the
  !> free vibration grows.
  pure logical function noticeably_locked(crossing)
    type(crossing_type), intent(in) :: crossing
    real(dp), parameter :: small_part = 0.1_dp
    real(dp) :: half_width

    associate (mode => crossing%at)
      half_width = 60 / (2 * pi) * max(abs(mode%growth), abs(mode%partner_growth)) / crossing%order
      noticeably_locked = crossing%locked .and. (abs(crossing%ends(2) - crossing%ends(1)) > small_part * half_width &
        & .or. mode%growth > mode%error)
    end associate
  end function noticeably_locked

  !> The worst verdict at all speeds of the diagram. It is printed at the head of the report on the diagram and in its files.
  pure type(judgement_type) function campbell_verdict(campbell) result(judgement)
    type(campbell_type), intent(in) :: campbell
    type(verdict_type) :: verdicts(size(campbell%points))
    integer :: i

    do i = 1, size(campbell%points)
      associate (modes => campbell%points(i)%modes(:campbell%modes))
        if (campbell%points(i)%solved) verdicts(i) = stable
        if (any(modes%identified .and. modes%neutral)) verdicts(i) = undamped
        if (any(modes%identified .and. modes%growth >= -modes%error .and. .not. modes%neutral)) verdicts(i) = undecided
        if (any(modes%grows())) verdicts(i) = unstable
      end associate
    end do
    judgement = judge_range((campbell%points%speed), verdicts, "speeds", "a free vibration grows")
  end function campbell_verdict

end module gestell_task_campbell_report
