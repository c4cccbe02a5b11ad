!> Times the library inside one process, by the orders and with the answers of bench/peers/serve.h:
!>
!>     speed DATA < orders
!>
!> where DATA is the folder of the input files. An order is a line
!>
!>     machine rpm method setting seconds size unit_1 ... unit_n
!>
!> Method `auto`: the whole solution to the tolerance `setting`, answered by shortest time, median time, runs, evaluations, the
!> real and the imaginary parts of the multipliers and x0. `multipliers`: the same without x0, zeros in its place; `peaks`: also
!> all that the task response says. Every other method: Phi(T) (rows) and x0 with `setting` steps, `gauss9-plain` as
!> Gauss had it, not fitted to the fastest motion. The solution is repeated for so many `seconds`, or -`seconds` times if that is
!> negative. Reading the file and proving that the mechanism turns come before; all kinematics are timed.
program speed
  use gestell_api_numerics, only: dp, error_type, frame_type, method_type, new_method
  use gestell_floquet_integrator_gauss, only: gauss_method
  use gestell_input_schema_check, only: check_document
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_configuration
  use gestell_input_namelist_document, only: document_type
  use gestell_input_namelist, only: read_document
  use gestell_input_schema_path, only: set_value
  use gestell_input_schema, only: schema_type
  use library_calls, only: map_with_steps, solve_to_tolerance
  use, intrinsic :: iso_fortran_env, only: int64, output_unit
  implicit none (type, external)

  integer, parameter :: most_runs = 1001
  character(len=*), parameter :: whole(3) = [character(len=11) :: "auto", "multipliers", "peaks"]
  character(len=200) :: folder, line
  character(len=40) :: machine, rpm, method
  real(dp) :: setting, seconds
  integer :: status

  call get_command_argument(1, folder)
  do
    read (*, "(a)", iostat=status) line
    if (status /= 0) exit
    read (line, *) machine, rpm, method, setting, seconds
    call answer(trim(machine), trim(rpm), trim(method), setting, seconds)
    flush (output_unit)
  end do

contains

  subroutine answer(machine, rpm, method, setting, seconds)
    character(len=*), intent(in) :: machine, rpm, method
    real(dp), intent(in) :: setting, seconds
    type(frame_type) :: frame
    class(method_type), allocatable :: prepared
    type(error_type), allocatable :: error
    real(dp) :: times(most_runs)
    real(dp), allocatable :: phi(:, :), x0(:), found(:)
    complex(dp), allocatable :: rho(:)
    integer(int64) :: begin, start, finish, rate
    integer :: runs, evaluations, numbers, most, length, n

    call read_machine(machine, rpm, frame)
    n = frame%states
    allocate(phi(n, n), x0(n), found(n * n + n), rho(n))
    if (all(method /= whole)) then
      length = index(method // "-", "-") - 1
      call new_method(method(:length), prepared, error)
      if (allocated(error)) then
        print "(2a)", "failed: ", error%message
        return
      end if
      select type (prepared)
      class is (gauss_method)
        prepared%fitted = length == len(method)
      end select
    end if
    call system_clock(begin, rate)
    most = most_runs
    if (seconds < 0) most = min(nint(-seconds), most_runs)
    runs = 0
    do
      call system_clock(start)
      select case (method)
      case ("auto", "multipliers", "peaks")
        call solve_to_tolerance(frame, setting, method, rho, x0, evaluations, error)
      case default
        call map_with_steps(frame, prepared, nint(setting), phi, x0, evaluations, error)
      end select
      call system_clock(finish)
      if (allocated(error)) then
        print "(2a)", "failed: ", error%message
        return
      end if
      runs = runs + 1
      times(runs) = real(finish - start, dp) / rate
      if (runs == most .or. (seconds >= 0 .and. finish - begin >= seconds * rate)) exit
    end do

    call sort(times(:runs))
    select case (method)
    case ("auto", "multipliers", "peaks")
      numbers = 3 * n
      found(:numbers) = [rho%re, rho%im, x0]
    case default
      numbers = size(found)
      found = [reshape(transpose(phi), [n * n]), x0]
    end select
    print "(2(es16.9, ','), i0, ',', i0, *(:, ',', es24.17))", times(1), times((runs + 1) / 2), runs, evaluations, found(:numbers)
  end subroutine answer

  pure subroutine sort(values)
    real(dp), intent(inout) :: values(:)
    real(dp) :: value
    integer :: i, k

    do i = 2, size(values)
      value = values(i)
      do k = i - 1, 1, -1
        if (values(k) <= value) exit
        values(k + 1) = values(k)
      end do
      values(k + 1) = value
    end do
  end subroutine sort

  subroutine read_machine(name, rpm, frame)
    character(len=*), intent(in) :: name, rpm
    type(frame_type), intent(out) :: frame
    type(configuration_type) :: configuration
    type(document_type) :: doc
    type(schema_type) :: schema
    type(error_type), allocatable :: error

    schema = input_schema()
    call read_document(trim(folder) // "/" // name // ".nml", doc, error)
    if (.not. allocated(error)) call set_value(doc, schema, "drive.speed_rpm=" // rpm, error)
    if (.not. allocated(error)) call check_document(doc, schema, error)
    if (.not. allocated(error)) call read_configuration(doc, configuration, error)
    if (allocated(error)) error stop error%message
    frame = configuration%frame
  end subroutine read_machine

end program speed
