!> Every machine in data/, from the file to multipliers and periodic solution, is compared with the reference.
module test_data
  use checks, only: check_failure, check_success, check_that
  use data_files, only: machine_of_file
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: text
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: multipliers_type, solve_multipliers
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, solve_periodic
  use gestell_input_schema_check, only: check_document
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_configuration
  use gestell_input_namelist_document, only: document_type
  use gestell_input_namelist, only: parse_document, read_document
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_mechanism, only: mass_functions_type
  use reference_frame, only: frame_of, frame_period
  use reference_linear, only: eigenvalues, qp
  use reference_machine, only: machine_data
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  implicit none (type, external)
  private

  public :: collect_data

contains

  subroutine collect_data(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("results of the machines in data/ agree with the reference", test_machines), &
      & new_unittest("inertia forces of the cam press's ram agree with the closed form", test_cam_press), &
      & new_unittest("an unbalanced crank given by harmonics equals one given by links", test_harmonics), &
      & new_unittest("mass functions that no real masses can have are refused", test_impossible)]
  end subroutine collect_data

  subroutine test_machines(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(*) = [character(len=24) :: "khang_four_bar", "khang_four_bar_printed", &
      & "compressor", "watt_six_bar", "shaper", "flying_press", "cam_press", "rocking_sieve", "tilting_table"]
    integer :: i

    do i = 1, size(names)
      call compare("data/" // trim(names(i)) // ".nml", error)
      if (allocated(error)) return
    end do
  end subroutine test_machines

  !> Compares multipliers and x0 to 1e-9 of their sizes, and within the claimed errors.
  subroutine compare(file, error)
    character(len=*), intent(in) :: file
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(document_type) :: doc
    type(configuration_type) :: configuration
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(qp), allocatable :: phi(:, :), xp(:), x0(:)
    complex(qp), allocatable :: rho(:)
    integer :: n, k

    call machine_of_file(file, machine, failure)
    if (.not. allocated(failure)) call read_document(file, doc, failure)
    if (.not. allocated(failure)) call check_document(doc, input_schema(), failure)
    if (.not. allocated(failure)) call read_configuration(doc, configuration, failure)
    if (.not. allocated(failure)) call solve_monodromy(configuration%frame, accuracy_type(tolerance=1.0e-11_dp), .true., &
      & monodromy, failure)
    if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., multipliers, failure)
    if (.not. allocated(failure)) call solve_periodic(monodromy, solution, failure)
    if (allocated(failure)) then
      call test_failed(error, file // ": " // failure%message)
      return
    end if
    n = 2 * count(machine%free)
    allocate(phi(n, n), xp(n), x0(n), rho(n))
    call frame_period(frame_of(machine), 1.0e-20_qp, phi, xp, x0)
    call eigenvalues(phi, rho)
    do k = 1, n
      associate (distance => minval(abs(cmplx(rho, kind=dp) - multipliers%rho(k))))
        ! The tolerance 1e-11 leaves two digits for the condition of the multipliers.
        call check_that(error, distance, "<", 1.0e-9_dp, file // ": multipliers to 1e-9")
        call check_that(error, distance, "<=", multipliers%error(k) * abs(multipliers%rho(k)), file // ": claimed error")
        if (allocated(error)) return
      end associate
    end do
    call check_that(error, real(abs(solution%x0 - x0), dp), "<=", solution%error, file // ": claimed error of x0")
    call check_that(error, norm2(real(solution%x0 - x0, dp) / monodromy%scale), "<", 1.0e-9_dp &
      & * norm2(solution%x0 / monodromy%scale), file // ": x0 to 1e-9")
  end subroutine compare

  !> The ram of 14 kg moves downward by L = h (1/2 - 9/16 cos + 1/16 cos 3), L'' = 9/4 h sin^2 cos of the shaft's angle; the rod's
  !> centre of mass, 60 of its 180 mm from the crank's joint, upward by 2/3 r sin; shaft and feed have none.
  subroutine test_cam_press(error)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(configuration_type) :: configuration
    type(gestell_error), allocatable :: failure
    type(mass_functions_type) :: a
    real(dp), parameter :: h = 0.04_dp, r = 0.03_dp
    real(dp) :: phi, force
    integer :: k

    call read_document("data/cam_press.nml", doc, failure)
    if (.not. allocated(failure)) call check_document(doc, input_schema(), failure)
    if (.not. allocated(failure)) call read_configuration(doc, configuration, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 0, 71
      phi = 2 * pi * k / 72
      call configuration%frame%mechanism%mass_functions(phi, a)
      force = -14 * 9 * h / 4 * sin(phi)**2 * cos(phi) - 0.8_dp * 2 * r / 3 * sin(phi)
      call check_that(error, abs(a%a2%dd - force), "<", 1.0e-14_dp, "inertia force at " // text(5 * k) // " deg")
      if (allocated(error)) return
    end do
  end subroutine test_cam_press

  !> A crank of mass m with its centre at r: a1 = m r cos, a2 = m r sin, a3 = m r^2, H = m r^2 + J; a4 = 0.
  subroutine test_harmonics(error)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(configuration_type) :: configuration
    type(gestell_error), allocatable :: failure
    type(mass_functions_type) :: a
    real(dp), parameter :: phi = 0.7_dp, m = 3.0_dp, r = 0.2_dp

    call parse_document("&drive speed_rpm=60 / &frame mass=1, inertia=1, origin=0,0 /" // &
      & "&mass_functions mass=3.0, inertia=0.1, a1=0, 0.6, 0, a2=0, 0, 0.6, a3=0.12, moment=0.22, 0, 0, 0, 0.5 /", &
      & "in.nml", doc, failure)
    if (.not. allocated(failure)) call check_document(doc, input_schema(), failure)
    if (.not. allocated(failure)) call read_configuration(doc, configuration, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call configuration%frame%mechanism%mass_functions(phi, a)
    call check_that(error, maxval(abs([a%a1%v - m * r * cos(phi), a%a1%dd + m * r * cos(phi), a%a2%v - m * r * sin(phi), a%a2%d &
      & - m * r * cos(phi), a%a3%v - m * r**2, a%a3%d])), "<", 1.0e-15_dp, "terms of a point mass")
    if (allocated(error)) return
    ! H has 0.5 sin 2 phi besides, whose derivative is cos 2 phi.
    call check(error, a%a4, cos(2 * phi), thr=1.0e-15_dp)
  end subroutine test_harmonics

  !> A mass m with a1 = m r and a3 < m r^2.
  subroutine test_impossible(error)
    type(error_type), allocatable, intent(out) :: error
    type(harmonic_mechanism_type) :: mechanism
    type(gestell_error), allocatable :: failure

    call new_harmonic_mechanism(mechanism, 3.0_dp, 0.1_dp, [0.6_dp], [0.0_dp], [0.12_dp], [0.0_dp], failure)
    call check_success(error, failure, "a point mass at 0.2 m")
    if (allocated(error)) return
    call new_harmonic_mechanism(mechanism, 3.0_dp, 0.1_dp, [0.6_dp], [0.0_dp], [0.11_dp], [0.0_dp], failure)
    call check_failure(error, failure)
    if (allocated(error)) return
    call check(error, failure%code, 2)
  end subroutine test_impossible

end module test_data
