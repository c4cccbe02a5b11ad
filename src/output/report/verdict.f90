!> States verdicts on stability in words. A verdict accompanies every reported vibration, because the machine vibrates in this way
!> only if the vibration is stable.
module gestell_output_report_verdict
  use gestell_base_text, only: either, newline
  use gestell_base_verdict, only: has_vibration, judgement_type, operator(>), stable, undecided, unstable, verdict_type
  implicit none (type, external)
  private

  public :: alarm, vibration_warning, section, verdict_line

contains

  !> Warning if a vibration is unstable, undamped or undecided; empty for any other verdict.
  pure function vibration_warning(verdict) result(words)
    type(verdict_type), intent(in) :: verdict
    character(len=:), allocatable :: words

    words = ""
    if (verdict > stable .and. has_vibration(verdict)) words = trim(verdict%alarm()) // ": " // consequence(verdict)
  end function vibration_warning

  !> States whether the machine settles on a vibration with this verdict: undamped, undecided or unstable.
  pure function consequence(verdict) result(words)
    type(verdict_type), intent(in) :: verdict
    character(len=:), allocatable :: words

    words = "the machine leaves this vibration"
    if (unstable > verdict) words = "the error bounds leave open whether this vibration is stable"
    if (undecided > verdict) words = "disturbances neither grow nor decay, so the machine does not settle on this vibration"
  end function consequence

  !> Heading of a section of the report on a vibration. If the vibration is unstable, undamped or undecided, a warning follows the
  !> heading.
  pure function section(heading, verdict) result(line)
    character(len=*), intent(in) :: heading
    type(verdict_type), intent(in) :: verdict
    character(len=:), allocatable :: line

    line = newline // heading // newline
    if (vibration_warning(verdict) /= "") line = line // "  " // vibration_warning(verdict) // newline
  end function section

  !> Line that states the verdict in the head of a file; empty if there is no verdict.
  pure function verdict_line(judgement) result(line)
    type(judgement_type), intent(in) :: judgement
    character(len=:), allocatable :: line

    line = trim(judgement%verdict%word())
    if (line == "") return
    line = "verdict: " // line
    if (allocated(judgement%extent)) line = line // judgement%extent
    if (allocated(judgement%rest)) line = line // judgement%rest
    if (allocated(judgement%extent) .or. vibration_warning(judgement%verdict) == "") return
    line = line // ": " // consequence(judgement%verdict)
  end function verdict_line

  !> Text with which the title of a picture begins: the verdict in capital letters, followed by "IN PART" if it applies only to some
  !> machines. Empty if all machines are stable.
  pure function alarm(judgement) result(word)
    type(judgement_type), intent(in) :: judgement
    character(len=:), allocatable :: word

    word = ""
    if (vibration_warning(judgement%verdict) /= "") word = trim(judgement%verdict%alarm()) // either(" IN PART: ", ": ", &
      & allocated(judgement%extent))
  end function alarm

end module gestell_output_report_verdict
