!> Gestell's program: run, and the one error stop.
program main
  use cli, only: command_line
  use console, only: tell
  use execution, only: execute
  use gestell_base_error, only: error_type
  use limits, only: check_stacks, prepare_process
  implicit none (type, external)

  type(error_type), allocatable :: error
  integer :: code

  call prepare_process()
  call check_stacks(error)
  if (allocated(error)) then
    call tell(error%message)
    code = error%code
  else
    call execute(command_line(), code)
  end if
  ! Not error stop: gfortran's prints a backtrace in a debug build, and the user gets one line.
  if (code /= 0) stop code, quiet=.true.
end program main
