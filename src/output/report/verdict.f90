!> The verdict in the words that stand wherever a vibration is told: one that the machine leaves is no use to anybody who does not
!> know it.
module gestell_output_report_verdict
  use gestell_input_wording, only: lower
  implicit none (type, external)
  private

  public :: alarm, judged, section, verdict_line

  character, parameter :: newline = new_line("a")

contains

  !> What a vibration of a machine with that verdict is worth; empty of a stable one, and where there is no verdict.
  pure function judged(verdict) result(words)
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: words

    select case (verdict)
    case ("unstable")
      words = "UNSTABLE: the machine leaves this vibration"
    case ("undecided")
      words = "UNDECIDED: whether the machine keeps to this vibration cannot be told"
    case default
      words = ""
    end select
  end function judged

  !> The heading of a section of the report on a vibration.
  pure function section(heading, verdict) result(line)
    character(len=*), intent(in) :: heading, verdict
    character(len=:), allocatable :: line

    line = newline // heading // newline
    if (judged(verdict) /= "") line = newline // heading // newline // "  " // judged(verdict) // newline
  end function section

  !> The line that heads a file about the vibration of a machine with that verdict, which may be a sentence, or the state 'ok';
  !> empty without one.
  pure function verdict_line(verdict) result(line)
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: line
    integer :: first

    line = trim(verdict)
    if (verdict == "ok") line = "stable"
    if (judged(verdict) /= "") line = judged(verdict)
    if (line == "") return
    first = scan(line // " ", " :") - 1
    line = "verdict: " // lower(line(:first)) // line(first + 1:)
  end function verdict_line

  !> What has to stand before the title of a picture of such a file; empty of a stable machine.
  pure function alarm(verdict) result(word)
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: word
    character(len=:), allocatable :: line

    line = verdict_line(verdict)
    word = ""
    if (index(line, "verdict: unstable") == 1) word = "UNSTABLE: "
    if (index(line, "verdict: undecided") == 1) word = "UNDECIDED: "
    if (index(line, "verdict: unstable at ") == 1) word = "UNSTABLE IN PART: "
    if (index(line, "verdict: undecided at ") == 1) word = "UNDECIDED IN PART: "
  end function alarm

end module gestell_output_report_verdict
