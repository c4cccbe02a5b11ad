!> The verdict in the words that stand wherever a vibration is reported: one that the machine leaves is of no use to anybody who
!> does not know it.
module gestell_output_report_verdict
  use gestell_base_verdict, only: verdict_type
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

  character, parameter :: newline = new_line("a")

contains

  !> What a vibration of a machine with that verdict is worth; empty of a stable one, and where there is no verdict.
  pure function judged(verdict) result(words)
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: words

    select case (verdict)
    case ("unstable")
      words = "UNSTABLE: the machine leaves this vibration"
    case ("undamped")
      words = "UNDAMPED: free vibrations neither grow nor decay, so the machine does not settle on this vibration"
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
    character(len=*), parameter :: words(3) = [character(len=9) :: "UNSTABLE", "UNDECIDED", "UNDAMPED"]
    integer :: i

    line = verdict_line(verdict)
    word = ""
    do i = 1, size(words)
      if (index(line, "verdict: " // lower(trim(words(i)))) /= 1) cycle
      word = trim(words(i)) // ": "
      if (index(line, "verdict: " // lower(trim(words(i))) // " at ") == 1) word = trim(words(i)) // " IN PART: "
    end do
  end function alarm

end module gestell_output_report_verdict
