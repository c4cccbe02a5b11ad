!> Error bounds, verdicts and theorems over a population of random machines, against a solution in quadruple precision
!> that shares nothing with the library:
!>
!>     fpm run population --directory validation --profile release -- [MACHINES [FIRST [weak | strong | steps | gauss]]]
!>
!> examines MACHINES machines (default 100) from number FIRST (default 1) on, a tenth of a second each: all kinds, or only weakly or
!> strongly damped ones, or with given steps, or by Gauss' methods of six to ten stages. Stops with an error where a bound is
!> beaten, a verdict wrong, a theorem broken beyond the bounds, or two methods disagree by more.
program population
  use gestell_base_kinds, only: dp
  use population_tally, only: examine, line_length, quantile, ratios_type, tally_type
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none (type, external)

  !> In a period the fastest free motion turns by at most this (rad): the reference then takes less than a second.
  real(dp), parameter :: most_turns = 200
  character(len=*), parameter :: usage = "usage: population [MACHINES [FIRST [weak | strong | steps | gauss]]]"
  type(tally_type) :: tally
  integer :: machines, first, shown, i
  character(len=20) :: kind

  machines = argument(1, 100)
  first = argument(2, 1)
  call get_command_argument(3, kind)
  if (all(kind /= [character(len=6) :: "", "weak", "strong", "steps", "gauss"])) error stop usage
  print "(a, /)", "Bounds beaten, verdicts wrong, theorems broken, methods at odds:"
  shown = 0
  do i = first, first + machines - 1
    call examine(i, most_turns, tally, trim(kind))
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
