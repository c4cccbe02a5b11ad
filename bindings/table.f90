!> A table of the machine of an input file as lines of numbers and words: table FILE TABLE [PATH NUMBER]. An error goes to standard
!> error, and its code is the program's.
program table
  use gestell, only: dp, error_type, machine_type, solution_type, table_type, wrong_usage
  use, intrinsic :: iso_fortran_env, only: error_unit
  implicit none (type, external)

  type(machine_type) :: machine
  type(solution_type) :: solution
  type(table_type) :: found
  type(error_type), allocatable :: error
  character(len=500) :: words(4)
  character(len=25) :: digits
  real(dp) :: number
  integer :: i, k

  if (command_argument_count() < 2) error stop wrong_usage
  do i = 1, command_argument_count()
    call get_command_argument(i, words(i))
  end do
  call machine%read(trim(words(1)), error)
  if (.not. allocated(error) .and. command_argument_count() == 4) then
    read(words(4), *) number
    call machine%set(trim(words(3)), number, error)
  end if
  if (.not. allocated(error)) call machine%solve(solution, error)
  if (.not. allocated(error)) call solution%table(trim(words(2)), found, error)
  if (allocated(error)) then
    write(error_unit, "(a)") error%message
    stop error%code, quiet=.true.
  end if
  print "(*(a, :, ','))", (found%columns(k)%key, k = 1, size(found%columns))
  do i = 1, found%rows
    do k = 1, size(found%columns)
      associate (column => found%columns(k))
        if (k > 1) write(*, "(a)", advance="no") ","
        if (allocated(column%words)) then
          write(*, "(a)", advance="no") column%word(i)
        else if (allocated(column%integers)) then
          write(*, "(i0)", advance="no") column%integers(i)
        else
          write(digits, "(es25.16e3)") column%numbers(i)
          write(*, "(a)", advance="no") trim(adjustl(digits))
        end if
      end associate
    end do
    print "(a)"
  end do
end program table
