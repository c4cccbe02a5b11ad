!> Computes sweeps with many MPI processes (ranks) on one machine, or on several that share a file system.
program main
  use gestell_run_command_line, only: command_line, options_type, parse
  use gestell_run_console, only: print_error_line
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_version, only: version
  use gestell_run_process, only: check_stacks, end_process, prepare_process
  use mpi_f08, only: mpi_finalize, mpi_init
  use gestell_run, only: run
  use gestell_task_common_executor, only: executor_type
  use ranked_executor, only: ranked_executor_type
  use ranks, only: own_rank, share_error
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none (type, external)

  type(options_type) :: options
  class(executor_type), allocatable :: executor
  type(error_type), allocatable :: error
  logical :: is_leading_rank
  integer :: code

  code = 0
  call prepare_process()
  call mpi_init()
  is_leading_rank = own_rank() == 0
  call check_stacks(error)
  call share_error(error)
  if (.not. allocated(error)) call parse(command_line(), options, error)
  call share_error(error)
  if (.not. allocated(error)) then
    if (options%has("--help")) then
      if (is_leading_rank) write (output_unit, "(a)") help_text()
    else if (options%has("--version")) then
      if (is_leading_rank) write (output_unit, "(a)") "gestell_mpi " // version
    else
      call check_support(options, error)
      allocate(ranked_executor_type :: executor)
      executor%has_many_processes = .true.
      if (.not. allocated(error)) call run(options, code, error, executor)
    end if
  end if
  if (allocated(error)) then
    if (is_leading_rank) call print_error_line(error%message)
    code = error%code
  end if
  flush (output_unit)
  call mpi_finalize()
  ! All ranks end with the same exit code, which is that of gestell.
  if (code /= 0) call end_process(code)

contains

  !> Fails if the options request work that a single process does.
  subroutine check_support(options, error)
    type(options_type), intent(in) :: options
    type(error_type), allocatable, intent(out) :: error

    if (.not. any(options%has([character(len=18) :: "--check", "--fail-if-unstable", "--json", "--merge", "--one-line", "--plot", &
      & "--report"]))) return
    call fatal_error(error, "gestell_mpi does not support --check, --fail-if-unstable, --json, --merge, --one-line, --plot and " &
      & // "--report; use gestell", wrong_usage)
  end subroutine check_support

  pure function help_text() result(text)
    character(len=:), allocatable :: text
    character, parameter :: newline = new_line("a")

    text = "Computes a sweep of gestell with many MPI ranks that share the folder of the results." // newline // newline // &
      & "usage: mpirun -q -n RANKS gestell_mpi [options] input.nml" // newline // newline // &
      & "  -s, --set PATH=VALUE    as in gestell" // newline // &
      & "  -o, --output DIR        as in gestell" // newline // &
      & "      --part i/n          compute part i of n without sweep.csv; gestell --merge" // newline // &
      & "                          writes it on one core; 1/1 computes all points" // newline // &
      & "  -q, --quiet             print no report on standard output" // newline // &
      & "  -h, --help              print this text" // newline // &
      & "  -V, --version           print the version" // newline // newline // &
      & "After an interruption start again with any number of ranks, or with gestell: only" // newline // &
      & "the missing points are computed. Exit codes are those of gestell. Without -q" // newline // &
      & "mpirun prints a message of its own for every exit code other than 0."
  end function help_text

end program main
