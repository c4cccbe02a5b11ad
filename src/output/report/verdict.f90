!> States verdicts on stability in words. A verdict accompanies every reported vibration, because the machine vibrates in this way
!> only if the vibration is stable.
module gestell_output_report_verdict
  use gestell_base_text, only: either, newline
  use gestell_base_verdict, only: has_vibration, operator(>), stable, verdict_named, verdict_type
  use gestell_input_wording, only: lower
  implicit none (type, external)
  private

  public :: alarm, vibration_warning, section, verdict_line

  !> A verdict on several machines, such as the machine at all speeds of a range.
  type, public :: judgement_type
    type(verdict_type) :: verdict
    !> "stable", or another verdict in capital letters and the machines to which it applies
    character(len=:), allocatable :: words
    !> True if the machines are the points of a sweep. A sweep has a headline of its own, which counts the points with each verdict
    logical :: of_sweep = .false.
  end type judgement_type

contains

  !> Warning if a vibration is unstable, undamped or undecided; empty for any other verdict.
  pure function vibration_warning(verdict) result(words)
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: words
    type(verdict_type) :: on_machine

    select case (verdict)
    case ("unstable")
      words = "the machine leaves this vibration"
    case ("undamped")
      words = "disturbances neither grow nor decay, so the machine does not settle on this vibration"
    case ("undecided")
      words = "the error bounds leave open whether this vibration is stable"
    case default
      words = ""
      return
    end select
    on_machine = verdict_named(verdict)
    words = trim(on_machine%alarm()) // ": " // words
  end function vibration_warning

  !> Heading of a section of the report on a vibration. If the vibration is unstable, undamped or undecided, a warning follows the
  !> heading.
  pure function section(heading, verdict) result(line)
    character(len=*), intent(in) :: heading, verdict
    character(len=:), allocatable :: line

    line = newline // heading // newline
    if (vibration_warning(verdict) /= "") line = line // "  " // vibration_warning(verdict) // newline
  end function section

  !> Line that states the verdict in the head of a file; empty if `verdict` is empty. `verdict` is a word, a sentence, or the state
  !> "ok", which means stable.
  pure function verdict_line(verdict) result(line)
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: line
    integer :: first

    line = trim(verdict)
    if (verdict == "ok") line = "stable"
    if (vibration_warning(verdict) /= "") line = vibration_warning(verdict)
    if (line == "") return
    first = scan(line // " ", " :") - 1
    line = "verdict: " // lower(line(:first)) // line(first + 1:)
  end function verdict_line

  !> Text with which the title of a picture begins: the verdict in capital letters, followed by "IN PART" if it applies only to some
  !> machines. Empty if all machines are stable.
  pure function alarm(verdict) result(word)
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: word, line
    type(verdict_type) :: on_machine
    integer :: first

    line = verdict_line(verdict)
    line = line(len("verdict: ") + 1:)
    first = scan(line // " ", " :") - 1
    on_machine = verdict_named(line(:first))
    word = ""
    if (on_machine > stable .and. has_vibration(on_machine)) word = trim(on_machine%alarm()) &
      & // either(" IN PART: ", ": ", index(line(first + 1:), " at ") == 1)
  end function alarm

end module gestell_output_report_verdict
