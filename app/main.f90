!> Gestell's program: parse, run, and the one error stop.
program main
  use cli, only: help_text, options_type, parse_command_line
  use driver, only: run
  use gestell_base_error, only: error_type
  use gestell_base_version, only: version
  use limits, only: survive_file_limit
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  implicit none (type, external)

  type(options_type) :: options
  type(error_type), allocatable :: error
  integer :: code

  code = 0
  call survive_file_limit()
  call parse_command_line(options, error)
  if (.not. allocated(error)) then
    if (options%help) then
      write (output_unit, "(a)") help_text()
    else if (options%version) then
      write (output_unit, "(a)") "gestell " // version
    else
      call run(options, code, error)
    end if
  end if
  if (allocated(error)) then
    write (error_unit, "(a)") error%message
    code = error%code
  end if
  flush (output_unit)
  ! Not error stop: gfortran's prints a backtrace in a debug build, and the user gets one line.
  if (code /= 0) stop code, quiet=.true.
end program main
