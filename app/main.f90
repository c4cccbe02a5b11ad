!> Gestell's program: run, and the one error stop.
program main
  use cli, only: command_line
  use execution, only: execute
  use limits, only: prepare_process
  implicit none (type, external)

  integer :: code

  call prepare_process()
  call execute(command_line(), code)
  ! Not error stop: gfortran's prints a backtrace in a debug build, and the user gets one line.
  if (code /= 0) stop code, quiet=.true.
end program main
