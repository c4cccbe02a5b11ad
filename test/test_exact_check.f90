!> Tests of exact_check itself, with made-up results: which results count as failures, and which prove nothing.
module test_exact_check
  use checks, only: check_that
  use exact_check, only: compare, count_type, finding_type, verdict_is_wrong
  use exact_claims, only: claim_type, claims_type
  use oracle_frame, only: frame_type
  use oracle_machine, only: dp, xp
  use oracle_signals, only: signal_type
  use oracle_vibration, only: orbit_type
  use reference_linear, only: qp
  use testdrive, only: error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
  implicit none (type, external)
  private

  public :: collect_exact_check

contains

  subroutine collect_exact_check(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the check accepts a verdict only if the largest modulus allows it", test_verdicts), &
      & new_unittest("the check detects missing, NaN, wrong and unprovable numbers", test_numbers)]
  end subroutine collect_exact_check

  subroutine test_verdicts(error)
    type(error_type), allocatable, intent(out) :: error

    call check_that(error, is_wrong("stable", 1.0e-9_dp, 1.0e-10_dp), "==", .true., "stable")
    if (.not. allocated(error)) call check_that(error, is_wrong("unstable", -1.0e-9_dp, 1.0e-10_dp), "==", .true., "unstable")
    if (.not. allocated(error)) call check_that(error, is_wrong("undamped", 1.0e-9_dp, 1.0e-10_dp), "==", .true., "undamped")
    if (.not. allocated(error)) call check_that(error, is_wrong("undamped", 0.0_dp, 1.0e-10_dp), "==", .false., "undamped, right")
    if (.not. allocated(error)) call check_that(error, is_wrong("undecided", 1.0e-9_dp, 1.0e-10_dp), "==", .true., "undecided")
    if (.not. allocated(error)) call check_that(error, is_wrong("undecided", 1.0e-9_dp, 1.0e-9_dp), "==", .false., &
      & "undecided, the bound reaches the border")
  end subroutine test_verdicts

  !> The verdict for a largest modulus of 1 + `excess`, and the library's bound.
  logical function is_wrong(verdict, excess, bound)
    character(len=*), intent(in) :: verdict
    real(dp), intent(in) :: excess, bound
    type(claims_type) :: claims
    type(orbit_type) :: orbit

    claims%verdict = verdict
    allocate(claims%rho_error(1), source=bound)
    allocate(orbit%rho(1), source=cmplx(1 + real(excess, qp), 0, qp))
    is_wrong = verdict_is_wrong(claims, orbit)
  end function is_wrong

  subroutine test_numbers(error)
    type(error_type), allocatable, intent(out) :: error
    type(finding_type), allocatable :: findings(:)
    integer :: blunt

    call hold("xi", 1.0_xp, 0.0_xp, findings, blunt)
    call check_that(error, count(findings%used > 1), "==", 0, "right")
    if (.not. allocated(error)) call check_that(error, blunt, "==", 0, "sharp")
    if (allocated(error)) return
    call hold("xi", 1 + 2.0e-10_xp, 0.0_xp, findings, blunt)
    call check_that(error, count(findings%used > 1), ">", 0, "exceeded bound")
    if (allocated(error)) return
    call hold("eta", 1.0_xp, 0.0_xp, findings, blunt)
    call check_that(error, any(findings%what == "eta not reported" .and. findings%used > 1), "==", .true., "not reported")
    if (allocated(error)) return
    call hold("xi", ieee_value(1.0_xp, ieee_quiet_nan), 0.0_xp, findings, blunt)
    call check_that(error, any(findings%what == "xi history" .and. findings%used > 1), "==", .true., "the oracle has NaN")
    if (allocated(error)) return
    call hold("xi", 1 + 2.0e-10_xp, 1.0_xp, findings, blunt)
    call check_that(error, blunt, ">", 0, "the oracle is too blunt")
  end subroutine test_numbers

  !> The library reports xi = 1 with a bound of 1e-10; the oracle has the quantity `name` = `true` with an error of at most
  !> `unknown`.
  subroutine hold(name, true, unknown, findings, blunt)
    character(len=*), intent(in) :: name
    real(xp), intent(in) :: true, unknown
    type(finding_type), allocatable, intent(out) :: findings(:)
    integer, intent(out) :: blunt
    real(dp), parameter :: bound = 1.0e-10_dp
    type(claims_type) :: claims
    type(orbit_type) :: orbit
    type(signal_type) :: signals(1)
    type(frame_type) :: frame
    type(count_type) :: counts
    logical :: traps(size(ieee_usual))
    integer :: k

    allocate(claims%rho(1), source=(1.0_dp, 0.0_dp))
    allocate(claims%rho_error(1), source=bound)
    allocate(orbit%rho(1), source=(1.0_qp, 0.0_qp))
    allocate(claims%quantities(1))
    claims%quantities(1) = claim_type(name="xi", history=[(1.0_dp, k = 0, 8)], amplitudes=[0.0_dp], error=bound, peak=1.0_dp, &
      & peak_error=bound, rms=1.0_dp)
    signals(1)%name = name
    allocate(signals(1)%samples(8, 1), source=true)
    allocate(signals(1)%c(0:3, 1), source=(0.0_xp, 0.0_xp))
    signals(1)%c(0, 1) = true
    signals(1)%unknown = unknown
    ! Traps are off because NaN is intended.
    call ieee_get_halting_mode(ieee_usual, traps)
    call ieee_set_halting_mode(ieee_usual, .false.)
    call compare(claims, frame, orbit, signals, findings, counts)
    call ieee_set_flag(ieee_usual, .false.)
    call ieee_set_halting_mode(ieee_usual, traps)
    blunt = counts%blunt
  end subroutine hold

end module test_exact_check
