!> Prepares the program for limits and signals of the operating system: stack size, file size, closed pipes and closed standard
!> streams.
module gestell_run_process
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_text, only: text
  use gestell_base_platform, only: c_exit, c_prepare, c_stack_limit
  use gestell_input_namelist_number, only: read_integer
  use gestell_input_wording, only: lower
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: check_stacks, end_process, prepare_process

  !> Stack sizes in kB. `min_stack`: needed by the program. `min_thread_stack`: needed by each thread. `usual_stack`: usual limit of
  !> the operating system. The needs are about twice the maximum observed in the tests.
  integer, parameter :: min_stack = 256, usual_stack = 8192, min_thread_stack = 256

contains

  !> Prepares standard streams and signals (see `c_prepare`).
  subroutine prepare_process()
    call c_prepare()
  end subroutine prepare_process

  !> Ends the program with an exit code and without a message. (gfortran 11 does not know `stop code, quiet=.true.`.)
  subroutine end_process(code)
    integer, intent(in) :: code

    call c_exit(int(code, c_int))
  end subroutine end_process

  !> Fails if a stack is so small that the program would overflow it and be ended by a signal. OMP_STACKSIZE sets the stack size
  !> of the threads. If it is not set, the stack limit of the program also applies to the threads.
  subroutine check_stacks(error)
    type(error_type), allocatable, intent(out) :: error
    integer(int64) :: limit
    integer :: thread_stack

    limit = c_stack_limit()
    if (limit >= 0 .and. limit < 1024 * min_stack) then
      call fatal_error(error, "the stack is limited to " // text(int(limit / 1024)) // " kB, but " // text(min_stack) &
        & // " kB are needed; set a larger limit with ulimit -s " // text(usual_stack), wrong_usage)
      return
    end if
    thread_stack = kilobytes("OMP_STACKSIZE")
    if (thread_stack >= 0 .and. thread_stack < min_thread_stack) call fatal_error(error, "OMP_STACKSIZE is " // text(thread_stack) &
      & // " kB, but every thread needs " // text(min_thread_stack) // " kB", wrong_usage)
  end subroutine check_stacks

  !> Size in kB that an environment variable specifies in OpenMP's format: a number followed by B, K, M or G (K if omitted). Returns
  !> -1 if the variable is unset or invalid. Also returns -1 if its unit is M or G, because such a size is always sufficient.
  integer function kilobytes(name)
    character(len=*), intent(in) :: name
    character(len=32) :: value
    character(len=:), allocatable :: reason
    character :: unit
    integer :: n, status

    kilobytes = -1
    call get_environment_variable(name, value, status=status)
    if (status /= 0 .or. value == "") return
    n = len_trim(value)
    unit = "k"
    if (scan(lower(value(n:n)), "bkmg") == 1) then
      unit = lower(value(n:n))
      n = n - 1
    end if
    call read_integer(trim(adjustl(value(:n))), kilobytes, reason)
    if (reason /= "" .or. kilobytes < 0 .or. kilobytes > 0 .and. scan(unit, "mg") == 1) then
      kilobytes = -1
    else if (unit == "b") then
      kilobytes = kilobytes / 1024
    end if
  end function kilobytes

end module gestell_run_process
