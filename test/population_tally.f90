!> Examines the whole population machine by machine and counts the outcomes.
module population_tally
  use gestell_base_kinds, only: dp
  use population_check, only: comparison_type, compare, disagreement, liouville_bound, truth_of, truth_type, unpaired
  use population_library, only: claim_type, solve_by_library
  use population_machines, only: specimen, specimen_type
  use population_turn, only: compare_turn, turn_comparison_type
  implicit none (type, external)
  private

  public :: examine, quantile

  integer, parameter, public :: line_length = 200

  !> Ratios of a bound to the true error, with the requested tolerance, if the true error is above rounding.
  type, public :: ratios_type
    real(dp), allocatable :: ratio(:), tolerance(:)
    !> Errors as small as rounding, which are not among the ratios.
    integer :: at_roundoff = 0
  end type ratios_type

  type, public :: tally_type
    integer :: machines = 0, claims = 0
    !> Claims without results or without x0, and among the latter those for which no periodic vibration exists.
    integer :: refused = 0, x0_refused = 0, resonant = 0
    type(ratios_type) :: rho, log_abs, x0, phi, turn
    !> Rows of vibrations in all, and those whose bound is greater than their peak.
    integer :: rows = 0, lost_rows = 0
    !> Number of multipliers, and of those whose modulus is unknown: their relative bound is above 1/2.
    integer :: multipliers = 0, lost = 0
    !> Verdicts by the first method, and the outcome of the undecided ones at the smallest tolerance: decided; rho_max is 1 to
    !> rounding; it is closer to 1 than the bound there.
    integer :: stable = 0, unstable = 0, undecided = 0, decided_later = 0, on_border = 0, near_border = 0
    !> Liouville's defects, reciprocal pairs and pairs of methods that were compared with their bounds.
    integer :: liouville = 0, reciprocal = 0, agreement = 0
    !> Failures: exceeded bounds, wrong verdicts, violated theorems, methods that disagree.
    character(len=line_length), allocatable :: failures(:)
    !> Bounds more than 1e6 times a true error above rounding, except of lost results, and by how many times.
    character(len=line_length), allocatable :: wide(:)
    real(dp), allocatable :: times(:)
    !> Machines that were refused altogether, or near a border.
    character(len=line_length), allocatable :: declined(:)
  end type tally_type

  !> Relative errors up to this are roundoff.
  real(dp), parameter :: roundoff = 1.0e-14_dp
  !> From this relative bound on a multiplier counts as unknown.
  real(dp), parameter :: lost = 0.5_dp
  real(dp), parameter :: too_wide = 1.0e6_dp, min_tolerance = 1.0e-13_dp

contains

  !> Examines machine `number` of the population by both of its methods.
  subroutine examine(number, max_turns, tally, kind)
    integer, intent(in) :: number
    real(dp), intent(in) :: max_turns
    type(tally_type), intent(inout) :: tally
    character(len=*), intent(in), optional :: kind
    type(specimen_type) :: one
    type(truth_type) :: truth
    type(claim_type) :: claims(2)
    integer :: i

    if (tally%machines == 0) allocate(tally%failures(0), tally%wide(0), tally%times(0), tally%declined(0))
    one = specimen(number, max_turns, kind)
    tally%machines = tally%machines + 1
    do i = 1, 2
      call solve_by_library(one%machine, one%tolerance, one%methods(i), claims(i), one%steps)
      if (claims(i)%impossible) then
        call note(tally%declined, line(one, one%methods(i), claims(i)%refusal))
        return
      end if
    end do
    truth = truth_of(one%machine)
    do i = 1, 2
      call compare_with_truth(truth, one, one%methods(i), claims(i), tally)
    end do
    if (len(claims(1)%refusal) == 0) call count_verdict(truth, one, claims(1), tally)
    if (any([len(claims(1)%refusal), len(claims(2)%refusal)] > 0)) return
    tally%agreement = tally%agreement + 1
    call expect(disagreement(claims(1), claims(2)), one, one%methods(2), "two methods", tally)
  end subroutine examine

  !> Checks one claim against the truth and the theorems.
  subroutine compare_with_truth(truth, one, method, claim, tally)
    type(truth_type), intent(in) :: truth
    type(specimen_type), intent(in) :: one
    character(len=*), intent(in) :: method
    type(claim_type), intent(in) :: claim
    type(tally_type), intent(inout) :: tally
    type(comparison_type) :: c
    type(turn_comparison_type) :: turn

    tally%claims = tally%claims + 1
    if (len(claim%refusal) > 0) then
      tally%refused = tally%refused + 1
      call note(tally%declined, line(one, method, claim%refusal))
      return
    end if
    if (len(claim%x0_refusal) > 0) then
      tally%x0_refused = tally%x0_refused + 1
      if (.not. allocated(truth%x0)) tally%resonant = tally%resonant + 1
    end if
    call compare(claim, truth, one%undamped(), c)
    call expect(c%rho_used, one, method, "rho", tally)
    call expect(c%log_used, one, method, "ln |rho|", tally)
    call expect(c%x0_used, one, method, "x0", tally)
    call expect(c%phi_used, one, method, "Phi", tally)
    if (c%verdict_wrong) call note(tally%failures, line(one, method, "wrong: " // claim%verdict // ", rho_max - 1:", &
      & [truth%excess]))
    tally%multipliers = tally%multipliers + size(claim%rho)
    tally%lost = tally%lost + count(claim%error >= lost)
    call collect(pack(c%rho_error, claim%error < lost), pack(c%rho_bound, claim%error < lost), one, method, "rho", &
      & tally%rho, tally)
    call collect(pack(c%log_error, claim%error < lost), pack(c%log_bound, claim%error < lost), one, method, &
      & "ln |rho|", tally%log_abs, tally)
    if (allocated(claim%phi)) call collect([c%phi_error], [c%phi_bound], one, method, "Phi", tally%phi, tally)
    if (allocated(claim%x0)) call collect([c%x0_error], [c%x0_bound], one, method, "x0", tally%x0, tally)

    if (allocated(claim%turn) .and. allocated(truth%turn)) then
      turn = compare_turn(claim, truth%turn)
      call expect(turn%rows, one, method, "a row", tally)
      call expect(turn%peaks, one, method, "a peak", tally)
      call expect(turn%rms, one, method, "an rms", tally)
      call expect(turn%harmonics, one, method, "a harmonic", tally)
      tally%rows = tally%rows + size(turn%bound)
      tally%lost_rows = tally%lost_rows + count(turn%bound >= 1)
      call collect(turn%error, turn%bound, one, method, "row", tally%turn, tally)
    end if

    associate (bound => liouville_bound(claim))
      if (bound < huge(bound)) then
        tally%liouville = tally%liouville + 1
        call expect(abs(claim%liouville_defect) / bound, one, method, "Liouville's defect", tally)
      end if
    end associate
    if (one%undamped()) then
      tally%reciprocal = tally%reciprocal + 1
      call expect(unpaired(claim), one, method, "reciprocal pairs", tally)
    end if
  end subroutine compare_with_truth

  subroutine count_verdict(truth, one, claim, tally)
    type(truth_type), intent(in) :: truth
    type(specimen_type), intent(in) :: one
    type(claim_type), intent(in) :: claim
    type(tally_type), intent(inout) :: tally
    type(claim_type) :: later

    select case (claim%verdict)
    case ("stable")
      tally%stable = tally%stable + 1
    case ("unstable")
      tally%unstable = tally%unstable + 1
    case ("undamped")
      ! The machine lies on the border, so the truth must too.
      tally%undecided = tally%undecided + 1
      tally%on_border = tally%on_border + merge(1, 0, abs(truth%excess) < roundoff)
    case default
      tally%undecided = tally%undecided + 1
      call solve_by_library(one%machine, min_tolerance, "auto", later)
      if (len(later%refusal) == 0 .and. later%verdict /= "undecided") then
        tally%decided_later = tally%decided_later + 1
      else if (abs(truth%excess) < roundoff) then
        tally%on_border = tally%on_border + 1
      else
        tally%near_border = tally%near_border + 1
        call note(tally%declined, line(one, "auto", "verdict at least tolerance; rho_max - 1, bound of the largest:", &
          & [truth%excess, later%bound(1)]))
      end if
    end select
  end subroutine count_verdict

  !> Notes a failure if more than the whole bound is used.
  subroutine expect(used, one, method, what, tally)
    real(dp), intent(in) :: used
    type(specimen_type), intent(in) :: one
    character(len=*), intent(in) :: method, what
    type(tally_type), intent(inout) :: tally

    if (.not. used <= 1) call note(tally%failures, line(one, method, what // ", error / bound:", [used]))
  end subroutine expect

  !> Adds the ratios of bounds to errors above roundoff, and notes the widest of them if it is too wide.
  subroutine collect(error, bound, one, method, what, ratios, tally)
    real(dp), intent(in) :: error(:), bound(:)
    type(specimen_type), intent(in) :: one
    character(len=*), intent(in) :: method, what
    type(ratios_type), intent(inout) :: ratios
    type(tally_type), intent(inout) :: tally
    real(dp) :: ratio(size(error))
    integer :: k

    if (.not. allocated(ratios%ratio)) allocate(ratios%ratio(0), ratios%tolerance(0))
    ratio = bound / max(error, roundoff)
    associate (counts => error > roundoff)
      ratios%at_roundoff = ratios%at_roundoff + count(.not. counts)
      ratios%ratio = [ratios%ratio, pack(ratio, counts)]
      ratios%tolerance = [ratios%tolerance, spread(one%tolerance, 1, count(counts))]
      k = maxloc(ratio, dim=1, mask=counts .and. bound < lost)
    end associate
    if (k == 0) return
    if (ratio(k) <= too_wide) return
    tally%times = [tally%times, ratio(k)]
    call note(tally%wide, line(one, method, what // ", error, bound:", [error(k), bound(k)]))
  end subroutine collect

  function line(one, method, text, numbers)
    type(specimen_type), intent(in) :: one
    character(len=*), intent(in) :: method, text
    real(dp), intent(in), optional :: numbers(:)
    character(len=line_length) :: line
    character(len=40) :: figures
    character(len=60) :: head

    figures = ""
    if (present(numbers)) write (figures, "(*(es12.3e3))") numbers
    write (head, "(i0, 1x, a, 1x, a, es9.1, ' rpm', es8.1, 1x, a)") one%number, trim(one%linkage), trim(one%trait), &
      & one%machine%speed_rpm, one%tolerance, trim(method)
    line = trim(head) // ": " // text // figures
  end function line

  subroutine note(lines, new)
    character(len=line_length), allocatable, intent(inout) :: lines(:)
    character(len=line_length), intent(in) :: new

    lines = [character(len=line_length) :: lines, new]
  end subroutine note

  !> The value below which a share of them lies; 0 where there are none.
  pure real(dp) function quantile(values, share)
    real(dp), intent(in) :: values(:), share
    real(dp) :: rest(size(values))
    real(dp) :: low
    integer :: i, k

    quantile = 0
    rest = values
    do i = 1, ceiling(share * size(values))
      k = minloc(rest, dim=1)
      low = rest(k)
      rest(k) = huge(1.0_dp)
      quantile = low
    end do
  end function quantile

end module population_tally
