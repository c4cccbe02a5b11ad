!> The command-line program `gestell`.
program main
  use gestell_run_command_line, only: command_line
  use gestell_run_console, only: print_error_line
  use gestell_run, only: execute
  use gestell_base_error, only: error_type
  use gestell_run_terminal, only: terminal_type
  use gestell_task_common_executor, only: executor_type
  use gestell_run_process, only: check_stacks, end_process, prepare_process
  implicit none (type, external)

  class(executor_type), allocatable :: executor
  type(error_type), allocatable :: error
  integer :: code

  call prepare_process()
  call check_stacks(error)
  if (allocated(error)) then
    call print_error_line(error%message)
    code = error%code
  else
    allocate(executor)
    allocate(terminal_type :: executor%progress)
    call execute(command_line(), code, executor)
  end if
  ! Not error stop: in a debug build gfortran adds a backtrace to it, but the user should see one line only.
  if (code /= 0) call end_process(code)
end program main
