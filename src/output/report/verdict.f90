!> The verdict in the words that stand wherever a vibration is reported: one that the machine leaves is of no use to anybody who
!> does not know it.
module gestell_output_report_verdict
  use gestell_base_text, only: either, newline
  use gestell_base_verdict, only: has_vibration, operator(>), stable, verdict_named, verdict_type
  use gestell_input_wording, only: lower
  implicit none (type, external)
  private

  public :: alarm, judged, section, verdict_line

  !> A verdict on a range of machines, and a sentence about it: "stable", or a word in capitals with the machines it holds for.
  type, public :: judgement_type
    type(verdict_type) :: verdict
    character(len=:), allocatable :: words
    !> True if the machines are the points of a sweep. A sweep has a headline of its own, which counts all verdicts.
    logical :: of_sweep = .false.
  end type judgement_type

contains

  !> What a vibration of a machine with that verdict is worth; empty of a stable one, and where there is no verdict.
  pure function judged(verdict) result(words)
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: words
    type(verdict_type) :: on_machine

    select case (verdict)
    case ("unstable")
      words = "the machine leaves this vibration"
    case ("undamped")
      words = "free vibrations neither grow nor decay, so the machine does not settle on this vibration"
    case ("undecided")
      words = "whether the machine keeps to this vibration cannot be told"
    case default
      words = ""
      return
    end select
    on_machine = verdict_named(verdict)
    words = trim(on_machine%alarm()) // ": " // words
  end function judged

  !> The heading of a section of the report on a vibration.
  pure function section(heading, verdict) result(line)
    character(len=*), intent(in) :: heading, verdict
    character(len=:), allocatable :: line

    line = newline // heading // newline
    if (judged(verdict) /= "") line = line // "  " // judged(verdict) // newline
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
