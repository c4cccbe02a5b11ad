!> The verdict in the words that stand wherever a vibration is told: one that the machine leaves is no use to anybody who does not
!> know it.
module gestell_output_report_verdict
  use gestell_base_wording, only: lower
  implicit none (type, external)
  private

  public :: alarm, judged, section, with_verdict

  character, parameter :: newline = new_line("a")
  !> What begins the line of a file's preamble that tells the verdict.
  character(len=*), parameter :: key = "verdict: "

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

  !> The preamble of a file that tells of the vibration of a machine with that verdict, which may be a sentence, or the state 'ok';
  !> without one it stays as it is.
  pure function with_verdict(preamble, verdict) result(lines)
    character(len=*), intent(in) :: preamble(:), verdict
    character(len=max(len(preamble), 300)), allocatable :: lines(:)
    character(len=:), allocatable :: words
    integer :: first

    words = verdict
    if (verdict == "ok") words = "stable"
    if (judged(verdict) /= "") words = judged(verdict)
    first = scan(words // " ", " :") - 1
    allocate(lines(size(preamble) + merge(0, 1, words == "")))
    lines(:size(preamble)) = preamble
    if (words /= "") lines(size(lines)) = key // lower(words(:first)) // words(first + 1:)
  end function with_verdict

  !> What has to stand before the title of a picture whose file has this preamble; empty of a stable machine.
  pure function alarm(preamble) result(word)
    character(len=*), intent(in) :: preamble(:)
    character(len=:), allocatable :: word
    integer :: i

    word = ""
    do i = 1, size(preamble)
      if (index(preamble(i), key // "unstable") == 1) word = "UNSTABLE: "
      if (index(preamble(i), key // "undecided") == 1) word = "UNDECIDED: "
      if (index(preamble(i), key // "unstable at ") == 1) word = "UNSTABLE IN PART: "
      if (index(preamble(i), key // "undecided at ") == 1) word = "UNDECIDED IN PART: "
    end do
  end function alarm

end module gestell_output_report_verdict
