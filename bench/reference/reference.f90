!> Writes what the benchmarks are measured against, bench/reference.dat, in quadruple precision:
!>
!>     fpm run --directory bench/reference --profile release
!>
!> Kinematics, equations and integration are those of test/reference_*; only the units that balance the states are the
!> library's own. Each case is integrated with two tolerances, whose difference is told.
program reference
  use data_files, only: machine_of_file
  use gestell_base_error, only: error_type
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_model_frame, only: frame_type
  use machines, only: frame_of_machine
  use reference_frame, only: frame_of, frame_period
  use reference_linear, only: eigenvalues, qp
  use reference_machine, only: dp, machine_data
  implicit none (type, external)

  real(qp), parameter :: tolerances(2) = [1.0e-20_qp, 1.0e-24_qp]
  integer :: unit

  open (newunit=unit, file="../reference.dat", status="replace", action="write")
  write (unit, "(a)") "# Phi(T), rows of six; x_p(T); x0; multipliers; of each the change by the last refinement, relative."
  write (unit, "(a)") "# Cases by name, speed (rpm) and w_max T; states (q, q') in SI units, balanced by the units `scale`."
  write (unit, "(a)") "# Made by bench/reference/reference.f90 in quadruple precision."
  call solve("khang_four_bar", 240.0_dp)
  call solve("khang_four_bar", 20.0_dp)
  call solve("khang_four_bar", 1.0_dp)
  call solve("compressor", 1450.0_dp)
  call solve("watt_six_bar", 180.0_dp)
  close (unit)

contains

  subroutine solve(name, speed)
    character(len=*), intent(in) :: name
    real(dp), intent(in) :: speed
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(error_type), allocatable :: error
    type(survey_type) :: survey
    real(qp) :: phi(6, 6, 2), xp(6, 2), x0(6, 2)
    complex(qp) :: rho(6)
    integer :: i

    call machine_of_file("../../data/" // name // ".nml", machine, error)
    if (.not. allocated(error)) then
      machine%speed_rpm = speed
      call frame_of_machine(machine, frame, error)
    end if
    if (.not. allocated(error)) call survey_system(frame, survey, error)
    if (allocated(error)) error stop error%message

    do i = 1, 2
      call frame_period(frame_of(machine), tolerances(i), phi(:, :, i), xp(:, i), x0(:, i))
    end do
    call eigenvalues(phi(:, :, 2), rho)

    write (unit, "(a, 2(1x, f0.3))") "case " // name, speed, survey%phase_advance
    write (unit, "(a, 6(1x, es22.15))") "scale", survey%scale
    do i = 1, 6
      write (unit, "(a, 6(1x, es27.20))") "phi", phi(i, :, 2)
    end do
    write (unit, "(a, 6(1x, es27.20))") "xp", xp(:, 2)
    write (unit, "(a, 6(1x, es27.20))") "x0", x0(:, 2)
    do i = 1, 6
      write (unit, "(a, 2(1x, es27.20))") "rho", rho(i)
    end do
    write (unit, "(a, 3(1x, es9.2))") "change", norm2(phi(:, :, 1) - phi(:, :, 2)) / norm2(phi(:, :, 2)), &
      & norm2(xp(:, 1) - xp(:, 2)) / norm2(xp(:, 2)), norm2(x0(:, 1) - x0(:, 2)) / norm2(x0(:, 2))
  end subroutine solve

end program reference
