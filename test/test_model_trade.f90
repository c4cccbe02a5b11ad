!> The averaged model against the periodic one: where they agree, how their difference grows, and how it is reported.
module test_model_trade
  use checks, only: check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_task_trade_model_trade, only: measure_model, model_trade_type
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine, machine_data
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  implicit none (type, external)
  private

  public :: collect_model_trade

contains

  subroutine collect_model_trade(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("averaged and periodic model agree if only the load is periodic", test_agreement), &
      & new_unittest("the averaged model's error is proportional to the mechanism's masses", test_light), &
      & new_unittest("the model comparison reports signs, error bounds and resonances correctly", test_trade)]
  end subroutine collect_model_trade

  !> xi and eta alone: M, B, C of (9) to (11) are constant there, the load is not.
  subroutine test_agreement(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: periodic, averaged
    type(model_trade_type) :: trade
    type(gestell_error), allocatable :: failure
    integer :: k

    machine = khang_machine(300.0_dp, 5.0_dp)
    machine%free = [.true., .true., .false.]
    call frame_of_machine(machine, frame, failure)
    if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest"), accuracy_type(tolerance=1.0e-12_dp), &
      & periodic, failure)
    if (.not. allocated(failure)) call analyse(frame, analysis_options(averaged=.true.), accuracy_type(), averaged, failure)
    if (failed(failure, error)) return
    associate (p => periodic%vibration, a => averaged%vibration)
      call check_that(error, abs(a%start%x0 - p%start%x0), "<=", a%start%error + p%start%error, "x0")
      call check_that(error, abs(a%peak - p%peak), "<=", a%peak_error + p%peak_error, "peaks")
      call check_that(error, a%peak([1, 2, 4, 5, 7, 8]), ">", 1.0e3_dp * a%peak_error([1, 2, 4, 5, 7, 8]), "there are peaks")
      ! Both start with the same rows.
      call check_that(error, maxval(abs(a%history - p%history)), "<", 1.0e-9_dp * maxval(abs(p%history)), "history")
      if (allocated(error)) return
    end associate
    do k = 1, 4
      call check_that(error, minval(abs(averaged%multipliers%rho - periodic%multipliers%rho(k))), "<=", &
        & periodic%multipliers%error(k) + maxval(averaged%multipliers%error), "multipliers")
      if (allocated(error)) return
    end do
    call measure_model(frame, accuracy_type(), trade, failure)
    if (failed(failure, error)) return
    call check_that(error, trade%worst_difference(), "<=", 0.0_dp, "no error of the averaged model")
    call check_that(error, abs(trade%rho_difference()), "<=", 0.0_dp, "no error of the averaged model")
    call check_that(error, trade%error_phi, "<", 1.0e-8_dp, "errors of the row")
    call check_that(error, trade%error_rho, "<", 1.0e-8_dp, "errors of the row")
    call check_that(error, trade%error_x0, "<", 1.0e-7_dp, "errors of the row")
  end subroutine test_agreement

  !> The periodic parts of M, B, C are proportional to the mechanism's masses. To first order, so is the error of the averaged
  !> model, relative to Phi(T) and to x0 (which is itself proportional).
  subroutine test_light(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(model_trade_type) :: trade(2)
    type(gestell_error), allocatable :: failure
    integer :: i

    do i = 1, 2
      call frame_of_machine(khang_machine(360.0_dp, 10.0_dp**(-1 - i)), frame, failure)
      if (.not. allocated(failure)) call measure_model(frame, accuracy_type(tolerance=1.0e-12_dp), trade(i), failure)
      if (failed(failure, error)) return
    end do
    ! The second order is a hundredth of the first, times the nearness to a resonance (5 %).
    call check(error, trade(1)%error_phi / trade(2)%error_phi, 10.0_dp, thr=0.5_dp, more="Phi")
    if (allocated(error)) return
    call check(error, trade(1)%error_x0 / trade(2)%error_x0, 10.0_dp, thr=1.0_dp, more="x0")
    if (allocated(error)) return
    call check_that(error, abs(trade(1)%peak_difference(1)), ">", 5 * abs(trade(2)%peak_difference(1)), "peak")
  end subroutine test_light

  subroutine test_trade(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(model_trade_type) :: trade
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: frequencies(:)
    integer :: i

    trade%periodic%log_rho = -0.5_dp
    trade%averaged%log_rho = -0.4_dp
    trade%periodic%peak = [1.0_dp, 2.0_dp, 0.0_dp, (1.0_dp, i = 4, 9)]
    trade%averaged%peak = [1.1_dp, 1.5_dp, 0.0_dp, (1.0_dp, i = 4, 9)]
    trade%periodic%peak_error = [0.1_dp, 0.1_dp, (0.0_dp, i = 3, 9)]
    trade%averaged%peak_error = trade%periodic%peak_error
    ! 0.1 of 1 is within 0.1 + 0.1; -0.5 of 2 is not within 0.2.
    call check_that(error, maxval(abs([(trade%peak_difference(i), i = 1, 9)] - [0.0_dp, -0.25_dp, (0.0_dp, i = 3, 9)])), "<", &
      & 1.0e-15_dp, "misses of peaks")
    if (allocated(error)) return
    call check(error, trade%log_rho_difference(), 0.2_dp, thr=1.0e-15_dp)
    if (allocated(error)) return
    call check(error, trade%rho_difference(), exp(0.1_dp) - 1, thr=1.0e-15_dp)
    if (allocated(error)) return
    call check(error, trade%worst_difference(), 0.25_dp, thr=1.0e-15_dp)
    if (allocated(error)) return
    trade%averaged%log_rho_error = 0.11_dp
    call check_that(error, abs(trade%log_rho_difference()) + abs(trade%rho_difference()), "<=", 0.0_dp, "within the errors")
    if (allocated(error)) return

    machine = khang_machine(360.0_dp)
    call frame_of_machine(machine, frame, failure)
    call measure_model(frame, accuracy_type(), trade, failure)
    if (failed(failure, error)) return
    call check_that(error, trade%periodic%verdict, "==", "stable", "periodic")
    call check_that(error, trade%averaged%verdict, "==", "stable", "averaged")
    call check_that(error, allocated(trade%resonance), "==", .false., "resonance")
    call check_that(error, trade%evaluations, ">", 0, "evaluations")
    call check_that(error, trade%averaged%seconds, ">=", 0.0_dp, "seconds")
    if (allocated(error)) return

    ! Without damping, at a fifth of the lowest natural frequency, which the periodic coefficients shift a little.
    call frame%natural_frequencies(frequencies, failure)
    machine%foundation_damping = 0
    machine%speed_rpm = frequencies(1) / 5 * 30 / pi
    call frame_of_machine(machine, frame, failure)
    call measure_model(frame, accuracy_type(), trade, failure)
    if (failed(failure, error)) return
    call check(error, allocated(trade%resonance) .and. .not. allocated(trade%averaged%peak), more="resonance")
    if (allocated(error)) return
    call check_that(error, trade%resonance, "contains", "harmonic 5")
    if (allocated(error)) return
    call check(error, allocated(trade%periodic%peak), more=trade%resonance)
    if (allocated(error)) return
    call check_that(error, abs(trade%peak_difference(1)), "<=", 0.0_dp, "no peaks to compare")
  end subroutine test_trade

  logical function failed(failure, error)
    type(gestell_error), allocatable, intent(in) :: failure
    type(error_type), allocatable, intent(out) :: error

    failed = allocated(failure)
    if (failed) call test_failed(error, failure%message)
  end function failed

end module test_model_trade
