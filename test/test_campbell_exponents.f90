!> The modes' exponents against the multipliers of the reference.
module test_campbell_exponents
  use checks, only: check_success, check_that
  use data_files, only: machine_of_file
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: eigensystem
  use gestell_study_mode, only: mode_type
  use reference_flow, only: flow_map
  use reference_frame, only: frame_of
  use reference_linear, only: qp
  use reference_machine, only: khang_machine, machine_data, period
  use slow_tests, only: new_slow
  use test_campbell_modes, only: modes_of
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_campbell_exponents

contains

  subroutine collect_campbell_exponents(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_slow("exponents of machines with heavy mechanisms agree with the reference", test_heavy), &
      & new_unittest("the locked mode of the sieve swings at half the crank frequency and grows", test_locked), &
      & new_unittest("real multipliers of two modes are assigned to the right modes", test_real)]
  end subroutine collect_campbell_exponents

  !> Multipliers of the reference, each with the growth and the frequency, up to multiples of the crank's, of a mode.
  subroutine compare_with_reference(machine, modes, error)
    type(machine_data), intent(in) :: machine
    type(mode_type), intent(in) :: modes(:)
    type(error_type), allocatable, intent(out) :: error
    real(qp) :: phi(2 * size(modes), 2 * size(modes)), particular(2 * size(modes))
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
    complex(dp) :: exponent
    type(gestell_error), allocatable :: failure
    real(dp) :: crank, nearest
    integer :: i, k

    call flow_map(frame_of(machine), 0.0_qp, period(machine), 1.0e-22_qp, phi, particular)
    call eigensystem(real(phi, dp), rho, right, left, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    crank = 2 * pi / real(period(machine), dp)
    do k = 1, size(modes)
      call check(error, modes(k)%identified, more="a mode is unknown")
      if (allocated(error)) return
      nearest = huge(nearest)
      do i = 1, size(rho)
        exponent = log(rho(i)) * crank / (2 * pi) - cmplx(modes(k)%growth, modes(k)%frequency(), dp)
        exponent = cmplx(real(exponent), aimag(exponent) - crank * anint(aimag(exponent) / crank), dp)
        nearest = min(nearest, abs(exponent))
      end do
      ! LAPACK's eigenvalues of the reference's Phi(T) in double precision, of condition up to about 1e4.
      call check_that(error, nearest, "<=", modes(k)%error + 1.0e-11_dp * crank, "exponent beyond its error")
      call check_that(error, modes(k)%error, "<", 1.0e-5_dp * crank, "the error bound is not too wide")
      if (allocated(error)) return
    end do
  end subroutine compare_with_reference

  subroutine test_heavy(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: speeds(4) = [100.0_dp, 330.0_dp, -600.0_dp, 1500.0_dp]
    type(machine_data) :: machine
    type(mode_type), allocatable :: modes(:)
    integer :: k

    do k = 1, size(speeds)
      machine = khang_machine(speeds(k), mass_factor=10.0_dp)
      call modes_of(machine, modes, error)
      if (allocated(error)) return
      call compare_with_reference(machine, modes, error)
      if (allocated(error)) return
    end do
  end subroutine test_heavy

  !> The sieve at 229 rpm swings once in two turns, and grows.
  subroutine test_locked(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(mode_type), allocatable :: modes(:)
    type(gestell_error), allocatable :: failure

    call machine_of_file("data/rocking_sieve.nml", machine, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call modes_of(machine, modes, error)
    if (allocated(error)) return
    call compare_with_reference(machine, modes, error)
    if (allocated(error)) return
    call check_that(error, modes(1)%real_pair, "==", .true., "not locked")
    call check_that(error, modes(1)%growth, ">", 0.0_dp, "not locked")
    call check_that(error, modes(1)%partner_growth, "<", modes(1)%growth, "not locked")
    ! Both halves of a real motion: the component and its conjugate are one vibration.
    call check_that(error, modes(1)%share(), ">", 0.99_dp, "share")
    call check_that(error, abs(modes(1)%frequency() / (machine%speed_rpm * pi / 60) - 1), "<", 1.0e-12_dp, "half the speed")
  end subroutine test_locked

  !> The sieve, also free along x and overdamped there: of four real multipliers the two negative ones belong to the locked
  !> mode, and the two positive ones to the mode that does not oscillate.
  subroutine test_real(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(mode_type), allocatable :: modes(:)
    type(gestell_error), allocatable :: failure
    real(qp) :: phi(4, 4), particular(4)
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
    real(dp) :: exponents(2)
    integer :: k

    call machine_of_file("data/rocking_sieve.nml", machine, failure)
    if (.not. allocated(failure)) then
      machine%free = [.true., .false., .true.]
      machine%foundation_stiffness(1, 1) = 2.0e4_dp
      machine%foundation_damping(1) = 3.0e3_dp
      call modes_of(machine, modes, error)
      if (allocated(error)) return
      call flow_map(frame_of(machine), 0.0_qp, period(machine), 1.0e-24_qp, phi, particular)
      call eigensystem(real(phi, dp), rho, right, left, failure)
    end if
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, count(real(rho) < 0), "==", 2, "not the intended case")
    call check_that(error, abs(aimag(rho)), "<=", 0.0_dp, "not the intended case")
    call check_that(error, modes(1)%frequency(), "<=", 0.0_dp, "frequencies")
    call check_that(error, abs(modes(2)%frequency() * real(period(machine), dp) / pi - 1), "<", 1.0e-12_dp, "frequencies")
    if (allocated(error)) return
    do k = 1, 2
      exponents = log(abs(pack(real(rho), real(rho) > 0 .eqv. k == 1))) / real(period(machine), dp)
      ! The smallest multiplier is 1e-13 of the largest; from Phi(T) in double precision it is accurate to a tenth only.
      call check_that(error, abs(modes(k)%growth - maxval(exponents)), "<", 1.0e-8_dp, "growth")
      call check_that(error, abs(modes(k)%partner_growth - minval(exponents)), "<", merge(1.0_dp, 1.0e-8_dp, k == 1), "partner")
      if (allocated(error)) return
    end do
  end subroutine test_real

end module test_campbell_exponents
