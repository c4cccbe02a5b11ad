!> Error bounds, verdicts and theorems over a population of random machines, against a solution in quadruple precision
!> that shares nothing with the library:
!>
!>     fpm run population --directory validation --profile release -- [MACHINES [FIRST [KIND]]]
!>
!> examines MACHINES machines (default 100) from number FIRST (default 1) on, a tenth of a second each: all kinds about rest, or
!> only weakly or strongly damped ones (KIND weak, strong), or with given steps (steps), or by Gauss' methods of six to ten stages
!> (gauss). Stops with an error where a bound is beaten, a verdict wrong, a theorem broken beyond the bounds, or two methods
!> disagree by more.
!>
!> KIND exact: other machines by the exact frame, a third of a second each, against an oracle in extended precision (oracle_...):
!> multipliers, verdicts, and history, peak, root of the mean square and harmonics of displacements, probes, torque and the forces
!> of every place. Stops with an error where a bound is beaten, a verdict wrong or left open though the bound does not reach the
!> border, a vibration that exists is not found, a quantity not reported, or a solution takes more than five seconds of the
!> processor. KIND input prints the input files of these machines instead.
program population
  use exact_specimens, only: specimen
  use exact_tally, only: examine_exact => examine, exact_tally_type, exact_line => line_length, text_of
  use gestell_base_kinds, only: dp
  use population_tally, only: examine, line_length, quantile, ratios_type, tally_type
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none (type, external)

  !> In a period the fastest free motion turns by at most this (rad): the reference then takes less than a second.
  real(dp), parameter :: max_turns = 200
  character(len=*), parameter :: usage = "usage: population [MACHINES [FIRST [weak | strong | steps | gauss | exact | input]]]"
  type(tally_type) :: tally
  integer :: machines, first, shown, i
  character(len=20) :: kind

  machines = argument(1, 100)
  first = argument(2, 1)
  call get_command_argument(3, kind)
  if (all(kind /= [character(len=6) :: "", "weak", "strong", "steps", "gauss", "exact", "input"])) error stop usage
  if (kind == "input") then
    do i = first, first + machines - 1
      print "(a)", text_of(specimen(i))
    end do
    stop
  else if (kind == "exact") then
    call run_exact(shown)
    if (shown > 0) error stop 1, quiet=.true.
    stop
  end if
  print "(a, /)", "Bounds beaten, verdicts wrong, theorems broken, methods at odds:"
  shown = 0
  do i = first, first + machines - 1
    call examine(i, max_turns, tally, trim(kind))
    call show(tally%failures(shown + 1:))
    shown = size(tally%failures)
  end do
  print "(a, i0)", "in all ", shown
  print "(/, a, i0, a, i0, a, i0, a)", "Machines ", first, " to ", first + machines - 1, ", ", tally%claims, " solutions."
  call show_ratios()
  call show_verdicts()
  print "(/, a)", "Bounds more than 1e6 times the true error, of multipliers that are not lost; the widest:"
  call show_widest(": Phi,")
  call show_widest(": rho,")
  call show_widest(": ln |rho|,")
  call show_widest(": x0,")
  call show_widest(": row,")
  print "(/, a, /)", "Declined, or undecided near a border:"
  call show(tally%declined)
  if (shown > 0) error stop 1, quiet=.true.

contains

  !> The machines by the exact frame; so many failures are `shown`.
  subroutine run_exact(shown)
    integer, intent(out) :: shown
    type(exact_tally_type) :: exact
    integer :: k

    print "(a, /)", "Bounds beaten, verdicts wrong, vibrations not found, slow solutions:"
    shown = 0
    do k = first, first + machines - 1
      call examine_exact(k, exact)
      call show_exact(exact%failures(shown + 1:))
      shown = size(exact%failures)
    end do
    print "(a, i0, a, i0)", "in all ", shown, ", in machines ", exact%failed
    print "(/, a, i0, a, i0, a, i0, a)", "Machines ", first, " to ", first + machines - 1, " by the exact frame; ", &
      & exact%impossible, " do not turn."
    print "(a, i0, a, i0, a, f6.3)", "Vibrations: ", exact%vibrations, ", numbers held against bounds: ", &
      & exact%counts%numbers, "; largest part of a bound that was kept: ", exact%used
    print "(a, f6.3, a)", "The oracle is too blunt (its error exceeds a quarter of the bound) for ", 100.0_dp &
      & * exact%counts%blunt / max(exact%counts%numbers, 1), " % of them."
    print "(a, i0, a, i0, a)", "Without vibration: ", exact%not_found, ", of which the oracle finds none either in ", &
      & exact%nor_by_oracle, "."
    print "(a, i0, a, i0, a, i0, a, i0, a, i0)", "Verdicts: stable ", exact%stable, ", unstable ", exact%unstable, &
      & ", undamped ", exact%undamped, ", undecided ", exact%undecided, ", of these not within 1e-5 of the border ", &
      & exact%undecided_off_border
    print "(a, f0.1, a, f0.3, a, f0.1)", "Processor time (s): library ", exact%seconds, ", the slowest ", exact%longest, &
      & ", oracle ", exact%oracle_seconds
    print "(/, a, /)", "Remarks:"
    call show_exact(exact%remarks)
  end subroutine run_exact

  subroutine show_exact(lines)
    character(len=exact_line), intent(in) :: lines(:)
    integer :: k

    do k = 1, size(lines)
      print "(a)", trim(lines(k))
    end do
    flush (output_unit)
  end subroutine show_exact

  integer function argument(place, default)
    integer, intent(in) :: place, default
    character(len=20) :: word
    integer :: status

    argument = default
    call get_command_argument(place, word)
    if (word == "") return
    read (word, *, iostat=status) argument
    if (status /= 0 .or. argument < 1) error stop usage
  end function argument

  !> Bound over true error by the tolerance that was ordered.
  subroutine show_ratios()
    integer :: decade

    print "(/, a, /)", "Bound over true error, where that is above 1e-14: median, 99 % below, number."
    print "(a)", "| tolerance | Phi | | | rho | | | ln abs(rho) | | | x0 | | | row | | |"
    print "(a)", "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    do decade = 2, 12
      print "('| 1e-', i0, ' to 1e-', i0, 5a, ' |')", decade, decade + 1, trim(row(tally%phi, decade)), &
        & trim(row(tally%rho, decade)), trim(row(tally%log_abs, decade)), trim(row(tally%x0, decade)), &
        & trim(row(tally%turn, decade))
    end do
    print "('| all', 5a, ' |')", trim(row(tally%phi)), trim(row(tally%rho)), trim(row(tally%log_abs)), &
      & trim(row(tally%x0)), trim(row(tally%turn))
    print "('| up to 1e-14 | | | ', i0, ' | | | ', i0, ' | | | ', i0, ' | | | ', i0, ' | | | ', i0, ' |')", tally%phi%at_roundoff, &
      & tally%rho%at_roundoff, tally%log_abs%at_roundoff, tally%x0%at_roundoff, tally%turn%at_roundoff
    print "(/, a, i0, a, i0, a)", "Of ", tally%multipliers, " multipliers ", tally%lost, " are lost (bound above half of them)."
    print "(a, i0, a, i0, a)", "Of ", tally%rows, " rows of vibrations ", tally%lost_rows, " claim more than their peak."
  end subroutine show_ratios

  function row(ratios, decade) result(cells)
    type(ratios_type), intent(in) :: ratios
    integer, intent(in), optional :: decade
    character(len=40) :: cells
    real(dp), allocatable :: chosen(:)

    allocate(chosen(0))
    cells = " | | | 0"
    if (.not. allocated(ratios%ratio)) return
    chosen = ratios%ratio
    if (present(decade)) chosen = pack(chosen, floor(-log10(ratios%tolerance)) == decade)
    write (cells, "(2(' |', es8.1), ' | ', i0)") quantile(chosen, 0.5_dp), quantile(chosen, 0.99_dp), size(chosen)
  end function row

  subroutine show_verdicts()
    print "(/, a, i0, a, i0, a, i0)", "Verdicts: stable ", tally%stable, ", unstable ", tally%unstable, ", undecided ", &
      & tally%undecided
    print "(a, i0, a, i0, a, i0)", "Of the undecided at the least tolerance: decided ", tally%decided_later, &
      & ", on the border to roundoff ", tally%on_border, ", nearer to it than the bound ", tally%near_border
    print "(a, i0, a, i0, a, i0, a, i0)", "Declined: ", tally%refused, ", x0 alone ", tally%x0_refused, &
      & ", of which no vibration is periodic in ", tally%resonant
    print "(a, i0, a, i0, a, i0)", "Held against their bounds: Liouville's defects ", tally%liouville, &
      & ", reciprocal pairs ", tally%reciprocal, ", two methods ", tally%agreement
  end subroutine show_verdicts

  !> Of the bounds on one quantity the ten widest.
  subroutine show_widest(quantity)
    character(len=*), intent(in) :: quantity
    logical :: left(size(tally%wide))
    integer :: k, place

    left = index(tally%wide, quantity) > 0
    print "(/, a, 1x, i0, /)", quantity(3:), count(left)
    do k = 1, min(10, count(left))
      place = maxloc(tally%times, dim=1, mask=left)
      left(place) = .false.
      print "(a)", trim(tally%wide(place))
    end do
  end subroutine show_widest

  subroutine show(lines)
    character(len=line_length), intent(in) :: lines(:)
    integer :: k

    do k = 1, size(lines)
      print "(a)", trim(lines(k))
    end do
    flush (output_unit)
  end subroutine show

end program population
