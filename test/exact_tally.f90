!> Examines the population of the exact frame machine by machine and counts the outcomes.
module exact_tally
  use exact_check, only: compare, count_type, finding_type, verdict_is_wrong
  use exact_claims, only: claims_type, solve_text
  use exact_specimens, only: exact_specimen, specimen
  use exact_text, only: input_text
  use oracle_frame, only: frame_type, new_frame
  use oracle_machine, only: dp, xp
  use oracle_signals, only: find_signals, list_signals, name_length, signal_type
  use oracle_turn, only: units_of
  use oracle_vibration, only: find_vibration, orbit_type, pieces, search_vibration, start_of
  implicit none (type, external)
  private

  public :: examine, find_truth, text_of

  integer, parameter, public :: line_length = 240
  !> Time limit of a machine (s).
  real(dp), parameter, public :: most_seconds = 5

  type, public :: exact_tally_type
    integer :: machines = 0, impossible = 0, vibrations = 0, failed = 0
    type(count_type) :: counts
    !> Vibrations that the library did not find, split into those that the oracle did not find either and those that it found;
    !> claimed vibrations that the oracle does not find, or for which it is not accurate enough.
    integer :: not_found = 0, nor_by_oracle = 0, oracle_lost = 0
    integer :: stable = 0, unstable = 0, undamped = 0, undecided = 0, undecided_off_border = 0
    !> Processor time of the library, in all and the longest (s), and of the oracle.
    real(dp) :: seconds = 0, longest = 0, oracle_seconds = 0
    !> The largest part of a bound that an error used, among the errors that kept their bound.
    real(dp) :: used = 0
    !> Exceeded bounds, wrong verdicts, missed vibrations, machines that took too long, and remarks that merely deserve a look.
    character(len=line_length), allocatable :: failures(:), remarks(:)
  end type exact_tally_type

contains

  !> The input file of machine `number`.
  function text_of(one) result(text)
    type(exact_specimen), intent(in) :: one
    character(len=:), allocatable :: text
    character(len=60) :: title

    write (title, "('exact ', i0, 1x, a, 1x, a)") one%number, trim(one%linkage), trim(one%trait)
    text = input_text(one%machine, trim(title), one%tolerance)
  end function text_of

  !> Examines machine `number`.
  subroutine examine(number, tally)
    integer, intent(in) :: number
    type(exact_tally_type), intent(inout) :: tally
    integer :: before

    if (.not. allocated(tally%failures)) allocate(tally%failures(0), tally%remarks(0))
    before = size(tally%failures)
    call examine_one(number, tally)
    if (size(tally%failures) > before) tally%failed = tally%failed + 1
  end subroutine examine

  subroutine examine_one(number, tally)
    integer, intent(in) :: number
    type(exact_tally_type), intent(inout) :: tally
    type(exact_specimen) :: one
    type(claims_type) :: claims
    type(frame_type) :: frame
    type(orbit_type) :: orbit
    type(signal_type), allocatable :: signals(:)
    character(len=name_length), allocatable :: names(:)
    !> A frame that turns by more has fallen over; a search from rest need not find such a vibration.
    real(dp), parameter :: far = 1.5_dp
    real(dp) :: before, after, turn

    one = specimen(number)
    call new_frame(one%machine, frame)
    call list_signals(frame, 0, signals)
    names = signals%name
    call solve_text(text_of(one), names, claims)
    tally%machines = tally%machines + 1
    if (claims%impossible) then
      tally%impossible = tally%impossible + 1
      call note(tally%remarks, one, "impossible: " // claims%refusal)
      return
    end if
    tally%seconds = tally%seconds + claims%seconds
    tally%longest = max(tally%longest, claims%seconds)
    if (claims%seconds > most_seconds) call note(tally%failures, one, "slow (s)", [claims%seconds])
    call cpu_time(before)
    call find_truth(frame, claims, orbit, signals)
    call cpu_time(after)
    tally%oracle_seconds = tally%oracle_seconds + after - before
    if (len(claims%refusal) > 0) then
      tally%not_found = tally%not_found + 1
      if (orbit%found) then
        turn = max_turn(frame, orbit)
        if (turn < far) call note(tally%failures, one, "not found: " // claims%refusal // ", psi, rho_max:", [turn, &
          & real(maxval(abs(orbit%rho)), dp)])
        if (turn >= far) call note(tally%remarks, one, "fallen over: " // claims%refusal // ", psi:", [turn])
      else
        tally%nor_by_oracle = tally%nor_by_oracle + 1
        call note(tally%remarks, one, "found by none: " // claims%refusal)
      end if
      return
    end if
    if (.not. orbit%found) then
      tally%oracle_lost = tally%oracle_lost + 1
      call note(tally%failures, one, "no vibration near the claimed one, Newton's last step:", [real(orbit%last_step, dp)])
      return
    end if
    tally%vibrations = tally%vibrations + 1
    call count_verdict(one, claims, orbit, tally)
    call compare_with_oracle(one, claims, frame, orbit, signals, tally)
  end subroutine examine_one

  !> Maximum of abs(psi) over the period.
  real(dp) function max_turn(frame, orbit)
    type(frame_type), intent(in) :: frame
    type(orbit_type), intent(in) :: orbit
    integer :: k

    max_turn = 0
    associate (units => units_of(frame))
      do k = 1, size(frame%free)
        if (frame%free(k) == 3) max_turn = real(maxval(abs(orbit%turn%x(k, :))) * units(3), dp)
      end do
    end associate
  end function max_turn

  !> Finds the vibration near the claimed one, or any vibration if none is claimed, and its quantities with as many samples as
  !> they need.
  subroutine find_truth(frame, claims, orbit, signals)
    type(frame_type), intent(in) :: frame
    type(claims_type), intent(in) :: claims
    type(orbit_type), intent(out) :: orbit
    type(signal_type), allocatable, intent(inout) :: signals(:)
    real(xp), parameter :: settled = 1.0e-17_xp, seen = 1.0e-16_xp
    integer :: steps, samples, k
    real(xp) :: unresolved, before, motor
    real(xp), allocatable :: start(:, :)

    steps = 48 * frame%machine%turns
    if (.not. allocated(claims%history)) then
      call search_vibration(frame, steps, orbit)
      return
    end if
    allocate(start(2 * size(frame%free), pieces))
    do k = 1, pieces
      associate (x => real(claims%history(:, 1 + (k - 1) * (size(claims%history, 2) - 1) / pieces), xp))
        start(:, k) = start_of(frame, x(:3), x(4:))
      end associate
    end do
    ! With a flywheel the motor delivers the mean of the torque on the crank.
    motor = 0
    if (frame%machine%held_by == "flywheel" .and. allocated(claims%torque%history)) then
      motor = sum(real(claims%torque%history(2:), xp)) / (size(claims%torque%history) - 1)
    end if
    do
      orbit = orbit_type(motor=motor)
      call find_vibration(frame, start, steps, orbit)
      if (orbit%turn%unsettled < settled .or. steps > 1000) exit
      steps = 2 * steps
    end do
    if (.not. orbit%found) return
    samples = max(steps, 192 * frame%machine%turns)
    before = huge(before)
    do
      call find_signals(frame, orbit, samples, signals)
      unresolved = maxval([(signals(k)%unknown / max(maxval(abs(signals(k)%samples)), tiny(unresolved)), k = 1, size(signals))])
      ! An error that more samples do not reduce is rounding.
      if (unresolved < seen .or. unresolved > before / 4 .or. samples > 1000 * frame%machine%turns) exit
      before = unresolved
      samples = 2 * samples
    end do
  end subroutine find_truth

  subroutine count_verdict(one, claims, orbit, tally)
    type(exact_specimen), intent(in) :: one
    type(claims_type), intent(in) :: claims
    type(orbit_type), intent(in) :: orbit
    type(exact_tally_type), intent(inout) :: tally
    real(dp), parameter :: border = 1.0e-5_dp
    real(dp) :: excess

    excess = real(maxval(abs(orbit%rho)) - 1, dp)
    if (verdict_is_wrong(claims, orbit)) call note(tally%failures, one, "wrong: " // claims%verdict // ", rho_max - 1:", [excess])
    select case (claims%verdict)
    case ("stable")
      tally%stable = tally%stable + 1
    case ("unstable")
      tally%unstable = tally%unstable + 1
    case ("undamped")
      tally%undamped = tally%undamped + 1
    case default
      tally%undecided = tally%undecided + 1
      if (abs(excess) < border) return
      tally%undecided_off_border = tally%undecided_off_border + 1
      call note(tally%remarks, one, "undecided, rho_max - 1, bound:", [excess, claims%rho_error(1)])
    end select
  end subroutine count_verdict

  subroutine compare_with_oracle(one, claims, frame, orbit, signals, tally)
    type(exact_specimen), intent(in) :: one
    type(claims_type), intent(in) :: claims
    type(frame_type), intent(in) :: frame
    type(orbit_type), intent(in) :: orbit
    type(signal_type), intent(in) :: signals(:)
    type(exact_tally_type), intent(inout) :: tally
    type(finding_type), allocatable :: findings(:)
    integer :: k

    call compare(claims, frame, orbit, signals, findings, tally%counts)
    do k = 1, size(findings)
      associate (finding => findings(k))
        if (finding%used <= 1) then
          tally%used = max(tally%used, finding%used)
        else if (all(findings(:k - 1)%what /= finding%what .or. findings(:k - 1)%used <= 1)) then
          call note(tally%failures, one, trim(finding%what) // ": claimed, true, bound, error/bound", [finding%claimed, &
            & finding%true, finding%bound, finding%used])
        end if
      end associate
    end do
  end subroutine compare_with_oracle

  subroutine note(lines, one, text, numbers)
    character(len=line_length), allocatable, intent(inout) :: lines(:)
    type(exact_specimen), intent(in) :: one
    character(len=*), intent(in) :: text
    real(dp), intent(in), optional :: numbers(:)
    character(len=line_length) :: line
    character(len=60) :: head
    character(len=100) :: figures

    figures = ""
    if (present(numbers)) write (figures, "(*(es25.16e3))") numbers
    write (head, "(i0, 1x, a, 1x, a, 1x, a, es9.1)") one%number, trim(one%linkage), trim(one%trait), &
      & trim(one%machine%held_by), one%tolerance
    line = trim(head) // ": " // text // figures
    lines = [character(len=line_length) :: lines, line]
  end subroutine note

end module exact_tally
