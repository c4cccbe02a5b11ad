!> Claims over a population of random machines, against quadruple precision; the program validation/population examines
!> thousands of them.
module test_population
  use checks, only: check_that
  use gestell_base_kinds, only: dp
  use population_check, only: comparison_type, compare, disagreement, liouville_bound, partners, truth_of, truth_type, &
    & unpaired
  use population_library, only: claim_type, solve_by_library
  use population_machines, only: specimen, specimen_type
  use population_tally, only: examine, quantile, tally_type
  use population_turn, only: compare_turn, turn_comparison_type
  use reference_machine, only: khang_machine, machine_data
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_population

contains

  subroutine collect_population(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_slow("bounds, verdicts and theorems hold for random machines by two methods", test_machines), &
      & new_slow("bounds hold for weakly and strongly damped machines and given steps", test_kinds), &
      & new_slow("machines whose error bounds once failed now keep them", test_former_failures), &
      & new_slow("machines whose bounds once failed with gauss10 now keep them", test_former_failures_gauss), &
      & new_unittest("the checks detect claims falsified by small amounts", test_false_claims), &
      & new_unittest("the pairing of multipliers prefers one within all bounds", test_partners), &
      & new_unittest("quantiles agree with hand calculation", test_quantile)]
  end subroutine collect_population

  subroutine test_machines(error)
    type(error_type), allocatable, intent(out) :: error
    ! Short periods: the reference takes most of the time. CI examines 150 further machines (step `population` of .ci/steps.sh).
    integer, parameter :: machines = 40
    real(dp), parameter :: max_turns = 20, most_median = 1000
    type(tally_type) :: tally
    integer :: i

    do i = 1, machines
      call examine(i, max_turns, tally)
      if (size(tally%failures) == 0) cycle
      call check(error, .false., more=trim(tally%failures(1)))
      return
    end do
    call check_that(error, quantile(tally%rho%ratio, 0.5_dp), "<=", most_median, "median bound of rho")
    call check_that(error, quantile(tally%x0%ratio, 0.5_dp), "<=", most_median, "median bound of x0")
    call check_that(error, quantile(tally%phi%ratio, 0.5_dp), "<=", most_median, "median bound of Phi")
    ! The population holds machines of all kinds: a fifth or more of all claims could be tested in each way.
    call check_that(error, min(tally%stable, tally%undecided, tally%reciprocal, tally%agreement, tally%liouville), ">", machines &
      & / 5, "tested claims")
    call check_that(error, tally%unstable, ">", 0, "tested claims")
    call check_that(error, size(tally%rho%ratio), ">", machines, "tested claims")
    ! An undecided machine is on the border or needs a smaller tolerance, except a few placed within 1e-11 of it on purpose.
    call check_that(error, tally%near_border, "<=", machines / 20, "undecided")
    call check_that(error, tally%undecided, "==", tally%decided_later + tally%on_border + tally%near_border, "undecided")
  end subroutine test_machines

  !> Machines whose bounds were once exceeded. Vibration: 59, 202, 384 and 900 (the motion was compared with one of few more
  !> steps, of the same steps, or of unequal steps); 5057 (stiffness that cancels); 48 (given steps that are too long); 1608 (a
  !> high order that fell unevenly); 2802 (rounding in decays that nearly coincide); 1790 (links whose forces cancel); 20694
  !> (the nodes miss part of a load that is small but moves most); 50615 (the nodes miss part of the coefficients); 20806, 30180
  !> and 50523 (vibrations followed in unequal steps); 130586 (rounding of a chain's accelerations).
  subroutine test_former_failures(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: numbers(*) = [59, 202, 202, 384, 900, 5057, 48, 1608, 2802, 1790, 1790, 20694, 50615, 20806, 30180, &
      & 50523, 130586]
    character(len=*), parameter :: kinds(*) = &
      & [character(len=6) :: "strong", "weak", "strong", "strong", "", "", "steps", "", "", "", "weak", "", "", "", "", "", ""]
    !> The same as in the program that found them.
    real(dp), parameter :: max_turns = 200
    type(tally_type) :: tally
    integer :: i

    do i = 1, size(numbers)
      call examine(numbers(i), max_turns, tally, trim(kinds(i)))
    end do
    if (size(tally%failures) > 0) call check(error, .false., more=trim(tally%failures(1)))
  end subroutine test_former_failures

  !> Machines whose bounds were once exceeded by Gauss' method of ten stages with few steps and coefficients that change as
  !> finely as the steps: those of Phi(T), 1906 and 30405, and of x0, 2562, whose change by the embedded method is small by
  !> coincidence.
  subroutine test_former_failures_gauss(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: numbers(*) = [1906, 2562, 30405]
    !> With more digits more steps are taken.
    real(dp), parameter :: tolerance = 0.01_dp
    type(specimen_type) :: one
    type(claim_type) :: claim
    type(comparison_type) :: c
    integer :: i

    do i = 1, size(numbers)
      one = specimen(numbers(i), 200.0_dp)
      call solve_by_library(one%machine, tolerance, "gauss10", claim)
      call compare(claim, truth_of(one%machine), .false., c)
      ! No error may come so near its bound that another machine's bound would be exceeded: the largest ratio was 0.5.
      call check_that(error, [c%phi_used, c%x0_used, c%rho_used, c%log_used], "<", 0.6_dp, "error over bound")
      if (allocated(error)) return
    end do
  end subroutine test_former_failures_gauss

  !> Kinds of machines whose vibrations are hard to bound over the turn.
  subroutine test_kinds(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=6), parameter :: kinds(3) = [character(len=6) :: "weak", "strong", "steps"]
    integer, parameter :: machines = 10
    ! Short periods: the reference takes most of the time.
    real(dp), parameter :: max_turns = 20, most_median = 1000
    type(tally_type) :: tally
    integer :: i, k

    do k = 1, size(kinds)
      do i = 1, machines
        call examine(i, max_turns, tally, trim(kinds(k)))
        if (size(tally%failures) == 0) cycle
        call check(error, .false., more=trim(kinds(k)) // ": " // trim(tally%failures(1)))
        return
      end do
    end do
    call check_that(error, size(tally%turn%ratio), ">", 5 * machines, "median bound of rows")
    call check_that(error, quantile(tally%turn%ratio, 0.5_dp), "<=", most_median, "median bound of rows")
    ! The error of one row in fifty may be as large as its peak, for example of a component that hardly moves.
    call check_that(error, tally%lost_rows, "<=", tally%rows / 50, "rows with useless bounds")
  end subroutine test_kinds

  !> Slightly falsified claims on the paper's machine.
  subroutine test_false_claims(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(claim_type) :: claim, other
    type(truth_type) :: truth
    type(comparison_type) :: c
    type(turn_comparison_type) :: turn
    integer :: i

    machine = khang_machine(1300.0_dp)
    truth = truth_of(machine)
    call solve_by_library(machine, 1.0e-6_dp, "auto", claim)
    call compare(claim, truth, .false., c)
    call check_that(error, max(c%rho_used, c%log_used, c%x0_used, c%phi_used), "<", 1.0_dp, "as claimed")
    call check_that(error, c%verdict_wrong, "==", .false., "as claimed")
    call check_that(error, min(c%rho_used, c%log_used, c%x0_used, c%phi_used), ">", 0.0_dp, "with errors")
    if (allocated(error)) return
    call compare(claim, truth, .true., c)
    call check(error, c%verdict_wrong, more="stable without damping")
    if (allocated(error)) return

    ! The vibration over the turn: one claim at a time is slightly falsified.
    turn = compare_turn(claim, truth%turn)
    call check_that(error, max(turn%rows, turn%peaks, turn%rms, turn%harmonics), "<", 1.0_dp, "turn as claimed")
    call check_that(error, turn%rows, ">", 0.0_dp, "turn as claimed")
    if (allocated(error)) return
    other = claim
    other%turn(8, 40) = other%turn(8, 40) + 2.1_dp * claim%turn_error(8)
    turn = compare_turn(other, truth%turn)
    call check_that(error, turn%rows, ">", 1.0_dp, "a row")
    call check_that(error, max(turn%peaks, turn%rms, turn%harmonics), "<", 1.0_dp, "a row")
    if (allocated(error)) return
    other = claim
    other%peak(4) = other%peak(4) + 2.1_dp * claim%peak_error(4)
    turn = compare_turn(other, truth%turn)
    call check_that(error, turn%peaks, ">", 1.0_dp, "a peak")
    call check_that(error, max(turn%rows, turn%rms, turn%harmonics), "<", 1.0_dp, "a peak")
    if (allocated(error)) return
    other = claim
    other%rms(9) = other%rms(9) - 2.1_dp * claim%turn_error(9)
    other%amplitude(3, 1) = other%amplitude(3, 1) + 3.1_dp * claim%turn_error(1)
    turn = compare_turn(other, truth%turn)
    call check_that(error, min(turn%rms, turn%harmonics), ">", 1.0_dp, "rms, harmonic")
    call check_that(error, max(turn%rows, turn%peaks), "<", 1.0_dp, "rms, harmonic")
    if (allocated(error)) return

    other = claim
    call check(error, disagreement(claim, other), 0.0_dp, more="one claim twice")
    if (allocated(error)) return
    other%x0(2) = other%x0(2) + 2.1_dp * claim%x0_error(2)
    call compare(other, truth, .false., c)
    call check_that(error, c%x0_used, ">", 1.0_dp, "x0")
    if (allocated(error)) return
    call check(error, disagreement(claim, other), 1.05_dp, thr=1.0e-6_dp, more="other x0")
    if (allocated(error)) return
    other = claim
    other%rho(3) = other%rho(3) + 2.1_dp * claim%bound(3)
    other%log_abs(5) = other%log_abs(5) + 1.1_dp * claim%error(5)
    other%phi(1, 1) = other%phi(1, 1) + 2.1_dp * claim%phi_error
    other%verdict = "unstable"
    call compare(other, truth, .false., c)
    call check_that(error, min(c%rho_used, c%log_used, c%phi_used), ">", 1.0_dp, "rho, ln |rho|, Phi, verdict")
    call check_that(error, c%verdict_wrong, "==", .true., "rho, ln |rho|, Phi, verdict")
    call check_that(error, disagreement(claim, other), ">", 1.0_dp, "other rho")

    ! Damped as little as the paper's machine is, it is no Hamiltonian system: ln |rho| = -0.001.
    call check_that(error, unpaired(claim), ">", 1.0_dp, "no reciprocal pairs")
    if (allocated(error)) return
    do i = 1, size(machine%supports)
      machine%supports(i)%damping = 0
    end do
    machine%foundation_damping = 0
    call solve_by_library(machine, 1.0e-6_dp, "auto", claim)
    call check_that(error, unpaired(claim), "<", 1.0_dp, "reciprocal pairs")
    call check_that(error, abs(claim%liouville_defect), "<", liouville_bound(claim), "Liouville")
  end subroutine test_false_claims

  !> The cheapest pairing can lie outside a bound where another lies within all.
  subroutine test_partners(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: cost(3, 3)

    cost(1, :) = [0.0_dp, 0.9_dp, 5.0_dp]
    cost(2, :) = [0.9_dp, 1.1_dp, 5.0_dp]
    cost(3, :) = [5.0_dp, 5.0_dp, 0.1_dp]
    call check_that(error, partners(cost), "==", [2, 1, 3], "within all bounds")
    if (allocated(error)) return
    cost(2, 2) = 0.5_dp
    call check_that(error, partners(cost), "==", [1, 2, 3], "cheapest")
    call check_that(error, partners(cshift(cost, 1, dim=2)), "==", [3, 1, 2], "permuted")
  end subroutine test_partners

  subroutine test_quantile(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: values(5) = [3.0_dp, 1.0_dp, 5.0_dp, 1.0_dp, 4.0_dp]

    call check_that(error, abs([quantile(values, 0.5_dp), quantile(values, 0.99_dp), quantile(values, 0.2_dp)] &
      & - [3.0_dp, 5.0_dp, 1.0_dp]), "<=", 0.0_dp, "quantiles")
  end subroutine test_quantile

end module test_population
