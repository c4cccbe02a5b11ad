!> Rows and samples of the vibration: for any requested number of rows the motion is sampled until it is resolved.
module test_history_rows
  use checks, only: check_success, check_that
  use data_files, only: machine_of_file
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine, machine_data
  use systems, only: diagonal
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_history_rows

contains

  subroutine collect_history_rows(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a history with many rows is periodic and agrees with fewer rows", test_many), &
      & new_unittest("an unannounced high order of the shaking force is resolved", test_unannounced_order), &
      & new_unittest("with a loose tolerance integration errors do not increase the samples", test_few_samples)]
  end subroutine collect_history_rows

  !> More rows than samples: every third row equals a row of a history with a third of the number.
  subroutine test_many(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(analysis_type) :: many, some
    type(gestell_error), allocatable :: failure

    call frame_of_machine(khang_machine(300.0_dp), frame, failure)
    if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest", stability=.false., points=1500), &
      & accuracy_type(), many, failure)
    if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest", stability=.false., points=500), &
      & accuracy_type(), some, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, size(many%vibration%history, 2), 1501)
    if (allocated(error)) return
    call check(error, maxval(abs(many%vibration%history(:6, 1) - many%vibration%start%x0)), 0.0_dp)
    if (allocated(error)) return
    ! Two integrations with different steps, each to 1e-9, times the condition away from resonance.
    call check_that(error, maxval(abs(many%vibration%history(:, ::3) - some%vibration%history), dim=2), "<", 1.0e-7_dp &
      & * some%vibration%peak, "rows")
  end subroutine test_many

  !> Shaking forces of order 40 that the mechanism does not declare: 64 samples would take them for order 24. With eta held some
  !> quantities are zero, and resolved at once.
  subroutine test_unannounced_order(error)
    type(error_type), allocatable, intent(out) :: error
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(analysis_type) :: few
    type(gestell_error), allocatable :: failure
    real(dp) :: wave(81)
    integer :: i

    wave = 0
    wave(2) = 1
    wave(80) = 1.0e-5_dp
    call new_harmonic_mechanism(mechanism, 1.0_dp, 0.1_dp, wave, [0.0_dp], [2.0_dp], [0.0_dp], failure)
    mechanism%angle_scale = 1
    if (.not. allocated(failure)) call new_frame(frame, mechanism, 18.0_dp, 0.8_dp, [0.0_dp, 0.0_dp], &
      & diagonal([4.0e5_dp, 4.0e5_dp, 4.0e4_dp]), diagonal([1.0e3_dp, 1.0e3_dp, 1.0e2_dp]), 10.0_dp, failure, [1, 3])
    if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest", stability=.false., points=1, harmonics=1), &
      & accuracy_type(), few, &
      & failure)
    call check_success(error, failure)
    if (allocated(error)) return
    associate (amplitude => few%vibration%series(1)%amplitude)
      call check_that(error, size(amplitude), ">", 40, "harmonics")
      if (allocated(error)) return
      call check(error, maxloc(amplitude(2:), dim=1) + 1, 40)
      if (allocated(error)) return
    end associate
    do i = 1, 9
      call check_that(error, few%vibration%series(i)%tail(), "<", 1.0e-9_dp, "tail")
      if (allocated(error)) return
    end do
  end subroutine test_unannounced_order

  !> A coarse integration leaves kinks that no number of samples resolves, and they need not be resolved.
  subroutine test_few_samples(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: loose, tight
    type(gestell_error), allocatable :: failure

    call machine_of_file("data/rocking_sieve.nml", machine, failure)
    if (.not. allocated(failure)) machine%speed_rpm = 100
    if (.not. allocated(failure)) call frame_of_machine(machine, frame, failure)
    if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest", stability=.false.), &
      & accuracy_type(tolerance=0.1_dp), loose, &
      & failure)
    if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest", stability=.false.), &
      & accuracy_type(tolerance=1.0e-12_dp), &
      & tight, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, abs(loose%vibration%peak - tight%vibration%peak), "<=", loose%vibration%peak_error, "peaks")
    ! 360 rows requested, doubled once at most.
    call check_that(error, size(loose%vibration%series(3)%amplitude), "<", 360, "harmonics")
  end subroutine test_few_samples

end module test_history_rows
