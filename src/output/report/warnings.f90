!> Warns of computed vibrations that no real machine performs: unstable vibrations, and vibrations too large for linear equations.
module gestell_output_report_warnings
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_base_verdict, only: judgement_type, not_judged, operator(==), operator(>), stable, undecided, unstable, &
    & verdict_type, worst
  use gestell_study_vibration_small_motion, only: moved_type, small_part, small_turn
  implicit none (type, external)
  private

  public :: motion_warning, judge_range, small_motion_limits

  !> Maximum number of intervals that a warning lists
  integer, parameter :: max_listed = 6

contains

  !> Warning if the largest of the motions `all` is too large for the linear equations; otherwise empty. The limits for the model
  !> 'exact' are higher, because only the forces of the supports are linear in it.
  pure function motion_warning(all, model) result(line)
    type(moved_type), intent(in) :: all(:)
    character(len=*), intent(in) :: model
    character(len=:), allocatable :: line
    integer :: turn, path

    line = ""
    if (size(all) == 0) return
    turn = maxloc(all%turn, dim=1)
    path = maxloc(all%displacement, dim=1)
    if (model == "exact") then
      if (.not. any(all%is_large())) return
      line = "  LARGE MOTIONS: " // trim(all(turn)%rotation) // " reaches " // concise(all(turn)%turn, 3) // " rad"
      if (all(path)%displacement > 0) line = line // ", F moves by " // concise(all(path)%displacement, 3) // " m"
      line = line // newline // "    check that springs and dampers are linear for motions of this size" // newline
      return
    end if
    if (.not. any(.not. all%small())) return
    line = "  BEYOND SMALL MOTIONS:"
    if (all(turn)%is_rotation_large()) line = line // " " // trim(all(turn)%rotation) // " reaches " &
      & // concise(all(turn)%turn, 3) // " rad"
    if (all(turn)%is_rotation_large() .and. all(path)%is_displacement_large()) line = line // ","
    if (all(path)%is_displacement_large()) line = line // " F moves by " // concise(all(path)%displacement, 3) // " m"
    line = line // newline // "    the linear equations hold for " // trim(all(turn)%rotation) // " up to " &
      & // small_motion_limits(all(path)%size) // newline
  end function motion_warning

  !> Phrase that states up to which angle, and up to which displacement of the frame's centre of mass F, a motion is small. The
  !> displacement is omitted unless the size of the `machine` (m) is positive.
  pure function small_motion_limits(machine) result(words)
    real(dp), intent(in) :: machine
    character(len=:), allocatable :: words

    words = concise(small_turn) // " rad"
    if (machine > 0) words = words // ", F up to " // concise(small_part * machine, 2) // " m"
  end function small_motion_limits

  !> Worst of the `verdicts`, with a sentence that lists the speeds at which it applies.
  pure type(judgement_type) function judge_range(speeds, verdicts, things, consequence) result(judgement)
    !> Drive speeds (1/min)
    real(dp), intent(in) :: speeds(:)
    !> Verdict at each speed
    type(verdict_type), intent(in) :: verdicts(:)
    !> `things`: noun for the values ("speeds" if they form a range in ascending order). `consequence`: what an unstable vibration
    !> means for these machines
    character(len=*), intent(in) :: things, consequence
    integer :: i

    judgement%verdict = not_judged
    do i = 1, size(verdicts)
      judgement%verdict = worst(judgement%verdict, verdicts(i))
    end do
    if (.not. judgement%verdict > stable) return
    judgement%rest = "disturbances neither grow nor decay"
    if (judgement%verdict == undecided) judgement%rest = "the error bounds leave open whether these vibrations are stable"
    if (judgement%verdict == unstable) judgement%rest = consequence
    associate (chosen => [(verdicts(i) == judgement%verdict, i = 1, size(verdicts))])
      judgement%extent = " at " // text(count(chosen)) // " of " // text(size(speeds)) // " " // things
      judgement%rest = ", " // stretches(speeds, chosen, things == "speeds") // " rpm: " // judgement%rest
    end associate
  end function judge_range

  !> List of the intervals of successive `values` for which `chosen` is true, for example "218.1 to 245.3, 300". If `joined` is
  !> false, each value is listed separately.
  pure function stretches(values, chosen, joined) result(words)
    real(dp), intent(in) :: values(:)
    logical, intent(in) :: chosen(:), joined
    character(len=:), allocatable :: words
    integer :: i, first, listed

    words = ""
    listed = 0
    first = 0
    do i = 1, size(values)
      if (chosen(i) .and. first == 0) first = i
      if (first == 0) cycle
      if (joined .and. i < size(values)) then
        if (chosen(i) .and. chosen(i + 1)) cycle
      end if
      listed = listed + 1
      if (listed > 1 .and. listed <= max_listed + 1) words = words // ", "
      if (listed <= max_listed) words = words // concise(values(first), 6)
      if (listed <= max_listed .and. i > first) words = words // " to " // concise(values(i), 6)
      if (listed == max_listed + 1) words = words // "..."
      first = 0
    end do
  end function stretches

end module gestell_output_report_warnings
