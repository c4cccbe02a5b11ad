!> Close to a resonance the lost digits are those that the error bound claims, and the report names what resonates.
module test_resonance
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type, failed_computation
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_study_vibration_analysis, only: analyse, analysis_type, find_modes, analysis_options
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine
  use systems, only: diagonal
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  implicit none (type, external)
  private

  public :: collect_resonance

  integer, parameter :: order = 5

contains

  subroutine collect_resonance(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("near resonance the lost digits are those that the error bound claims", test_digits), &
      & new_unittest("the error at resonance names the multiplier and the order", test_singular), &
      & new_unittest("a frame that is not held gives an error with advice", test_loose), &
      & new_unittest("soft springs are not reported as a resonance", test_soft)]
  end subroutine collect_resonance

  !> The paper's frame, undamped, free along x only: there M and C are constant. The crank turns at 1 / 5 of its frequency,
  !> times 1 + `detuning`.
  subroutine one_freedom(detuning, frame, stiffness, error)
    real(dp), intent(in) :: detuning
    type(frame_type), intent(out) :: frame
    real(dp), intent(out) :: stiffness
    type(gestell_error), allocatable, intent(out) :: error
    type(frame_type) :: whole

    call frame_of_machine(khang_machine(240.0_dp), whole, error)
    if (allocated(error)) return
    stiffness = whole%stiffness(1, 1)
    call new_frame(frame, whole%mechanism, whole%mass, whole%inertia, whole%origin, whole%stiffness, &
      & diagonal([0.0_dp, 0.0_dp, 0.0_dp]), (1 + detuning) * sqrt(stiffness / (whole%mass + whole%mechanism%mass)) / order, &
      & error, free=[1])
  end subroutine one_freedom

  !> xi(0) = sum of h_m / (C - m^2 W^2 M) over the harmonics of the load.
  subroutine test_digits(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: samples = 128
    real(dp), parameter :: detunings(3) = [1.0e-3_dp, 1.0e-6_dp, 1.0e-9_dp]
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure
    real(dp) :: stiffness, mass, load(samples, 1), m(samples, 1, 1), b(samples, 1, 1), c(samples, 1, 1), exact, oracle
    complex(dp) :: harmonic
    integer :: i, k, l

    do i = 1, size(detunings)
      call one_freedom(detunings(i), frame, stiffness, failure)
      if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest"), accuracy_type(tolerance=1.0e-12_dp), &
        & analysis, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call frame%sample_second_order([(real(k, dp) / samples, k = 0, samples - 1)], m, b, c, load)
      mass = m(1, 1, 1)
      exact = sum(load) / samples / stiffness
      do l = 1, samples / 2 - 1
        harmonic = 2 * sum([(load(k, 1) * exp(cmplx(0, -2 * pi * l * (k - 1) / samples, dp)), k = 1, samples)]) / samples
        exact = exact + real(harmonic) / (stiffness - (l * frame%speed)**2 * mass)
      end do
      ! C - 25 W^2 M is what rounding leaves of two numbers that agree to twice the detuning.
      oracle = 4 * epsilon(1.0_dp) / detunings(i) * abs(exact)
      associate (start => analysis%vibration%start)
        call check_that(error, abs(start%x0(1) - exact), "<=", start%error(1) + oracle, "bound of x0")
        ! |1 - rho| = 2 pi 5 x detuning amplifies an error of 1e-12 and the roundoff of the steps.
        call check_that(error, start%error(1), "<=", 1.0e-10_dp * abs(exact) / detunings(i), "the bound is too wide")
        ! (1 + |Phi|) / |1 - rho|, with |Phi| between 1 and 2.
        call check_that(error, abs(log10(start%condition * 2 * pi * order * detunings(i) / 2.5_dp)), "<", 0.3_dp, "digits")
        if (allocated(error)) return
      end associate
      call check(error, allocated(analysis%resonance), more="not called near resonance")
      if (allocated(error)) return
      call find_modes(frame, .false., accuracy_type(tolerance=1.0e-12_dp), analysis)
      call check(error, allocated(analysis%resonance), more="the resonating order is not named")
      if (allocated(error)) return
      call check(error, analysis%resonance%near(), more="near")
      if (allocated(error)) return
      ! The frequency is 5 times the speed but for the detuning.
      call check_that(error, abs(analysis%resonance%ratio * (1 + detunings(i)) / order - 1), "<", 1.0e-9_dp, "frequency")
      if (allocated(error)) return
      call check(error, analysis%resonance%order, order)
      if (allocated(error)) return
      call check_that(error, abs(analysis%resonance%distance / (2 * pi * order * detunings(i)) - 1), "<", 0.01_dp, "distance")
      if (allocated(error)) return
    end do
  end subroutine test_digits

  subroutine test_singular(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure
    real(dp) :: stiffness

    call one_freedom(0.0_dp, frame, stiffness, failure)
    if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest"), accuracy_type(), analysis, failure)
    if (.not. allocated(failure)) then
      call test_failed(error, "a result at resonance")
      return
    end if
    call check(error, failure%code, failed_computation)
    if (allocated(error)) return
    call check_that(error, failure%message, "contains", "multiplier 1 is ")
    call check_that(error, failure%message, "contains", "order 5")
    call check_that(error, [allocated(analysis%multipliers), allocated(analysis%vibration)], "==", [.true., .false.], "results")
  end subroutine test_singular

  subroutine test_loose(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: whole, frame
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure

    call frame_of_machine(khang_machine(240.0_dp), whole, failure)
    if (.not. allocated(failure)) call new_frame(frame, whole%mechanism, whole%mass, whole%inertia, whole%origin, &
      & diagonal([0.0_dp, 1.0e5_dp, 1.0e4_dp]), diagonal([0.0_dp, 1.0_dp, 1.0_dp]), whole%speed, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call analyse(frame, analysis_options(model="rest"), accuracy_type(), analysis, failure)
    call check_failure(error, failure, "the frame is not held in xi: add a &support")
  end subroutine test_loose

  !> The paper's frame, free along x only, with a crank 32, 64 and 128 times as fast as its vibration: |1 - rho| is about 2 pi /
  !> 32 and less, and the condition is above 10, although no order resonates.
  subroutine test_soft(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure
    real(dp) :: stiffness
    integer :: i

    do i = 1, 3
      call one_freedom(order * 16 * 2.0_dp**i - 1, frame, stiffness, failure)
      if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest"), accuracy_type(), analysis, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, analysis%vibration%start%condition, ">", 10.0_dp, "condition")
      if (allocated(error)) return
      call find_modes(frame, .false., accuracy_type(), analysis)
      call check(error, .not. analysis%resonance%near(), more="called near resonance")
      if (allocated(error)) return
    end do
  end subroutine test_soft

end module test_resonance
