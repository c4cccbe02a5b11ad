!> The library as its users call it: machines from text and in code, refused input, several threads.
module test_api
  use checks, only: check_success, check_that
  use gestell, only: dp, gestell_error => error_type, invalid_input, machine_type, response_type, solution_type, table_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_api

  character, parameter :: newline = new_line("a")
  !> An unbalanced rotor on springs that are equal in all directions: |x| = m e W^2 / |k - M W^2 + i W c|.
  character(len=*), parameter :: rotor = "&drive speed_rpm=600 / &joint name='O', type='ground', position=0,0 /" // newline // &
    & "&joint name='A', type='crank', pivot='O', radius=0.1 /" // newline // &
    & "&link name='crank', from='O', to='A', mass=2, inertia=0.01, center=0.05,0 /" // newline // &
    & "&frame mass=98, inertia=5, origin=0,0, dof='xi','eta' / &model frame='rest' /" // newline
  character(len=*), parameter :: springs = "&support position=0,0, stiffness=4e5,4e5, damping=500,500 /"
  real(dp), parameter :: pi = acos(-1.0_dp)

contains

  subroutine collect_api(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a rotor built in code agrees with its closed form", test_rotor), &
      & new_unittest("a sweep returns and writes one row for each speed, with the multiplier of this speed", test_sweep), &
      & new_unittest("the text of a machine describes the same machine", test_text), &
      & new_unittest("a removed group is missing from the list of values and from the text", test_removed), &
      & new_unittest("a refused change leaves the machine unchanged", test_refused), &
      & new_unittest("several threads obtain the same numbers as one", test_threads)]
  end subroutine collect_api

  !> Amplitude and force of an unbalanced rotor, built in code.
  subroutine test_rotor(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: speed = 2 * pi * 12, m = 100, k = 4.0e5_dp, c = 500, unbalance = 0.1_dp
    type(machine_type) :: machine
    type(solution_type) :: solution
    type(response_type) :: found
    type(table_type) :: table
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: lines
    real(dp) :: amplitude

    call machine%add(rotor, failure)
    if (.not. allocated(failure)) call machine%add(springs, failure)
    if (.not. allocated(failure)) call machine%set("drive.speed_rpm", 720.0_dp, failure)
    if (.not. allocated(failure)) call machine%solve(solution, failure, "stability, response", 1.0e-11_dp)
    if (.not. allocated(failure)) call solution%response("xi", found, failure)
    if (.not. allocated(failure)) call solution%table("response", table, failure)
    if (.not. allocated(failure)) call solution%report(lines, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, trim(solution%verdict()), "stable")
    if (allocated(error)) return
    amplitude = unbalance * speed**2 / abs(cmplx(k - m * speed**2, speed * c, dp))
    ! to the tolerance, plus rounding
    call check_that(error, abs(found%amplitudes(1) - amplitude), "<", 1.0e-10_dp * amplitude, "amplitude")
    call check_that(error, abs(found%peak - amplitude), "<", 1.0e-10_dp * amplitude, "peak")
    call check_that(error, abs(found%rms - amplitude / sqrt(2.0_dp)), "<", 1.0e-10_dp * amplitude, "rms")
    if (allocated(error)) return
    call check(error, found%unit, "m")
    if (allocated(error)) return
    call check(error, found%name, "xi")
    if (allocated(error)) return
    call check_that(error, size(found%history), "==", table%rows, "a point of the history for every row")
    if (allocated(error)) return
    call check(error, index(lines, "720 rpm") > 0 .and. index(lines, "VERDICT") > 0, more="the report: " // lines)
  end subroutine test_rotor

  !> The table of a sweep, and the file that is written without solving again.
  subroutine test_sweep(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: folder = "build/test_api"
    integer, parameter :: count = 5
    type(machine_type) :: machine, single
    type(solution_type) :: solution, alone
    type(table_type) :: table
    type(gestell_error), allocatable :: failure
    complex(dp), allocatable :: rho(:)
    real(dp), allocatable :: errors(:)
    character(len=:), allocatable :: lines
    integer :: i, unit, status, rows
    character :: first

    call machine%parse(rotor // springs // "&sweep parameter='drive.speed_rpm', from=400, to=800, count=5 /", failure)
    if (.not. allocated(failure)) call machine%solve(solution, failure, "sweep", 1.0e-11_dp)
    if (.not. allocated(failure)) call solution%table("sweep", table, failure)
    if (.not. allocated(failure)) call solution%report(lines, failure)
    if (.not. allocated(failure)) call solution%write(folder, failure)
    if (.not. allocated(failure)) call single%parse(rotor // springs, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, table%rows, "==", count, "rows of the table")
    if (allocated(error)) return
    do i = 1, count
      call single%set("drive.speed_rpm", 300.0_dp + 100 * i, failure)
      if (.not. allocated(failure)) call single%solve(alone, failure, "stability", 1.0e-11_dp)
      call check_success(error, failure)
      if (allocated(error)) return
      call alone%multipliers(rho, errors)
      ! to twice the tolerance
      call check_that(error, abs(table%columns(table%number_of("rho_max"))%numbers(i) - maxval(abs(rho))), "<=", 2.0e-11_dp, "rho")
      if (allocated(error)) return
    end do
    rows = 0
    open (newunit=unit, file=folder // "/sweep.csv", action="read", status="old", iostat=status)
    call check_that(error, status, "==", 0, "opening the file")
    if (allocated(error)) return
    do while (status == 0)
      read (unit, "(a)", iostat=status) first
      if (status == 0 .and. first /= "#") rows = rows + 1
    end do
    close (unit)
    call check_that(error, rows, "==", count + 1, "keys and rows of the file")
  end subroutine test_sweep

  !> A machine that was read, changed and extended, and one that was built in code: its text describes the same machine, keeps
  !> comments, and yields itself.
  subroutine test_text(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: comment = "   ! the springs / & not 'changed'"
    type(machine_type) :: machine, built
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: words

    call machine%text(words, failure)
    call refused(error, failure, "the machine is empty")
    if (allocated(error)) return
    call machine%parse(rotor // springs // comment, failure)
    if (.not. allocated(failure)) call machine%text(words, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, words == rotor // springs // comment, more="unchanged: " // words)
    if (allocated(error)) return
    call machine%set("link(crank).mass", 0.1_dp + 0.2_dp, failure)
    if (.not. allocated(failure)) call machine%set("accuracy.tolerance", 1.0e-10_dp, failure)
    if (.not. allocated(failure)) call machine%set("case.title", "it's / &", failure)
    if (.not. allocated(failure)) call machine%add("&support position=1,0, stiffness=1e5,1e5 /", failure)
    if (.not. allocated(failure)) call machine%add("&probe name='p', position=1,2 /", failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call same_machine(error, machine, words)
    if (allocated(error)) return
    call check(error, index(words, springs // comment // newline) > 0, more="comments stay: " // words)
    if (allocated(error)) return
    call built%add(rotor, failure)
    if (.not. allocated(failure)) call built%add("&joint name='it''s', type='ground', position=1,2 /" // springs, failure)
    call check_success(error, failure)
    if (.not. allocated(error)) call same_machine(error, built, words)
  end subroutine test_text

  !> The values of the input by their paths, of one key and of all; groups that are removed. Messages name the text.
  subroutine test_removed(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_type) :: machine
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: words

    call machine%parse(rotor // springs, failure, "rotor.nml")
    if (.not. allocated(failure)) call machine%add("&probe name='p', position=1,2 /", failure)
    if (.not. allocated(failure)) call machine%parameters(words, failure, "frame.dof(2)")
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, index(words, """path"": ""frame.dof"", ""values"": [""eta""]") > 0, more=words)
    if (allocated(error)) return
    call machine%parameters(words, failure, "link(crank).name")
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, index(words, "[""crank""]") > 0, more=words)
    if (allocated(error)) return
    call machine%parameters(words, failure, "foundation.damping")
    call refused(error, failure, "foundation.damping: has no value in the input")
    if (allocated(error)) return
    call machine%remove("support", failure)
    if (.not. allocated(failure)) call machine%remove("probe(p)", failure)
    if (.not. allocated(failure)) call machine%text(words, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, words, rotor)
    if (allocated(error)) return
    call machine%parameters(words, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, index(words, "support") + index(words, "probe") == 0 &
      & .and. index(words, """link(crank).mass""") > 0, more=words)
    if (allocated(error)) return
    call machine%remove("support", failure)
    call refused(error, failure, "support: the input has no &support")
    if (allocated(error)) return
    call machine%parse("&frame mas=1 /", failure, "rotor.nml")
    call refused(error, failure, "rotor.nml:1: ")
  end subroutine test_removed

  !> Compares a machine with another that reads its text. Returns this text.
  subroutine same_machine(error, machine, words)
    type(error_type), allocatable, intent(out) :: error
    type(machine_type), intent(in) :: machine
    character(len=:), allocatable, intent(out) :: words
    type(machine_type) :: again
    type(solution_type) :: solution, other
    type(gestell_error), allocatable :: failure
    complex(dp), allocatable :: rho(:), other_rho(:)
    real(dp), allocatable :: errors(:), mass(:), other_mass(:)
    character(len=:), allocatable :: other_words

    call machine%text(words, failure)
    if (.not. allocated(failure)) call again%parse(words, failure)
    if (.not. allocated(failure)) call again%text(other_words, failure)
    if (.not. allocated(failure)) call machine%get("link(crank).mass", mass, failure)
    if (.not. allocated(failure)) call again%get("link(crank).mass", other_mass, failure)
    if (.not. allocated(failure)) call machine%solve(solution, failure, "stability")
    if (.not. allocated(failure)) call again%solve(other, failure, "stability")
    call check_success(error, failure, words)
    if (allocated(error)) return
    call check(error, words == other_words, more="the text of its text: " // other_words)
    if (allocated(error)) return
    ! no digit is lost
    call check_that(error, abs(mass(1) - other_mass(1)), "<=", 0.0_dp, "mass")
    if (allocated(error)) return
    call solution%multipliers(rho, errors)
    call other%multipliers(other_rho, errors)
    call check_that(error, maxval(abs(rho - other_rho)), "<=", 0.0_dp, "multipliers")
  end subroutine same_machine

  subroutine test_refused(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_type) :: machine
    type(solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: values(:)

    call machine%solve(solution, failure)
    call refused(error, failure, "the machine is empty")
    if (allocated(error)) return
    call machine%parse(rotor // springs // "&support position=1,0, stiffness=1e5,1e5 /", failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call machine%add("&joint name='A', type='RRR' / &springs /", failure)
    call refused(error, failure, "springs")
    if (allocated(error)) return
    call machine%set("joint.lengths(2)", 7.0_dp, failure)
    call refused(error, failure, "the element before it is missing")
    if (allocated(error)) return
    call machine%set("support(3).stiffness", 7.0_dp, failure)
    call refused(error, failure, "numbered from 1 to 2")
    if (allocated(error)) return
    ! setting a path adds its group, and the group may stand only once
    call machine%set("accuracy.tolerance", 1.0e-10_dp, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call machine%add("&accuracy tolerance=1e-8 /", failure)
    call refused(error, failure, "may occur only once")
    if (allocated(error)) return
    call machine%get("support.damping", values, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, size(values) == 2, more="damping of one support, of two numbers")
    if (allocated(error)) return
    call check_that(error, maxval(abs(values - 500)), "<", epsilon(1.0_dp), "damping is unchanged")
    if (allocated(error)) return
    call machine%solve(solution, failure)
    call check_success(error, failure)
  end subroutine test_refused

  !> Several threads with machines of their own: their results at 24 speeds, and the texts of 4000 messages of many lengths,
  !> which mix if two threads use shared memory.
  subroutine test_threads(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: speeds = 24, messages = 4000
    real(dp) :: alone(speeds), together(speeds)
    logical :: right(messages)
    integer :: k

    do k = 1, speeds
      alone(k) = peak_at(k)
    end do
    !$omp parallel do num_threads(4)
    do k = 1, speeds
      together(k) = peak_at(k)
    end do
    !$omp end parallel do
    call check_that(error, maxval(abs(together - alone)), "<=", 0.0_dp, "peaks")
    call check_that(error, minval(alone), ">", 0.0_dp, "least peak")
    if (allocated(error)) return
    !$omp parallel do num_threads(4)
    do k = 1, messages
      right(k) = shows_key(1 + mod(7 * k, 60))
    end do
    !$omp end parallel do
    call check_that(error, count(.not. right), "==", 0, "messages with other words")
  end subroutine test_threads

  !> True if the message on an unknown key of n letters contains the whole key.
  logical function shows_key(n)
    integer, intent(in) :: n
    character(len=n) :: key
    type(machine_type) :: machine
    type(gestell_error), allocatable :: failure

    key = repeat("x", n)
    call machine%parse("&drive speed_rpm=600, " // key // "=1 / &frame /", failure)
    shows_key = allocated(failure)
    if (shows_key) shows_key = index(failure%message, "'" // key // "'") > 0
  end function shows_key

  !> The peak of xi at the k-th speed; -1 if anything fails.
  real(dp) function peak_at(k)
    integer, intent(in) :: k
    type(machine_type) :: machine
    type(solution_type) :: solution
    type(response_type) :: found
    type(gestell_error), allocatable :: failure

    peak_at = -1
    call machine%parse(rotor // springs, failure)
    if (.not. allocated(failure)) call machine%set("drive.speed_rpm", 500.0_dp + 10 * k, failure)
    if (.not. allocated(failure)) call machine%solve(solution, failure, "response")
    if (.not. allocated(failure)) call solution%response("xi", found, failure)
    if (.not. allocated(failure)) peak_at = found%peak
  end function peak_at

  !> Checks that a call was refused with these words.
  subroutine refused(error, failure, words)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable, intent(in) :: failure
    character(len=*), intent(in) :: words

    call check(error, allocated(failure), more="an invalid change was accepted")
    if (allocated(error)) return
    call check(error, index(failure%message, words) > 0, more=failure%message)
    if (allocated(error)) return
    call check_that(error, failure%code, "==", invalid_input, "code")
  end subroutine refused

end module test_api
