!> Prepares the program for limits and signals of the operating system: stack size, file size, closed pipes and closed standard
!> streams.
module gestell_run_process
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_text, only: text
  use gestell_base_files, only: open_to_read, unlock_file
  use gestell_input_namelist_number, only: read_integer
  use gestell_input_wording, only: lower
  use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t, c_long
  implicit none (type, external)
  private

  public :: check_stacks, prepare_process

  !> POSIX structure rlimit. A negative component means that there is no limit.
  type, bind(c) :: limit_type
    integer(c_long) :: current, most
  end type limit_type

  interface
    !> POSIX function signal. `handler` is the address of a procedure or a small integer such as SIG_IGN.
    integer(c_intptr_t) function c_signal(number, handler) bind(c, name="signal")
      import :: c_int, c_intptr_t
      implicit none (type, external)
      integer(c_int), value :: number
      integer(c_intptr_t), value :: handler
    end function c_signal

    !> POSIX getrlimit.
    integer(c_int) function c_getrlimit(resource, limit) bind(c, name="getrlimit")
      import :: c_int, limit_type
      implicit none (type, external)
      integer(c_int), value :: resource
      type(limit_type), intent(out) :: limit
    end function c_getrlimit
  end interface

  !> SIGXFSZ and SIGPIPE; SIG_IGN.
  integer(c_int), parameter :: file_too_large = 25, closed_pipe = 13
  integer(c_intptr_t), parameter :: ignore = 1
  integer(c_int), parameter :: standard_error = 2
  !> Value of RLIMIT_STACK.
  integer(c_int), parameter :: stack_resource = 3
  !> Stack sizes in kB. `min_stack`: needed by the program. `min_thread_stack`: needed by each thread. `usual_stack`: usual limit of
  !> the operating system. The needs are about twice the maximum observed in the tests.
  integer, parameter :: min_stack = 256, usual_stack = 8192, min_thread_stack = 256

contains

  !> Prevents two signals from ending the program, so that it can report an error instead. One signal means that a file exceeds the
  !> limit of ulimit -f, the other that nobody reads from a pipe. Also opens each closed standard stream on /dev/null for reading,
  !> so that no result file receives the number of the stream. Writing to such a stream then fails.
  subroutine prepare_process()
    integer(c_intptr_t) :: before
    integer(c_int) :: handle

    before = c_signal(file_too_large, ignore)
    before = c_signal(closed_pipe, ignore)
    do
      call open_to_read("/dev/null", handle)
      if (handle < 0 .or. handle > standard_error) exit
    end do
    call unlock_file(handle)
  end subroutine prepare_process

  !> Fails if a stack is so small that the program would overflow it and be ended by a signal. OMP_STACKSIZE sets the stack size
  !> of the threads. If it is not set, the stack limit of the program also applies to the threads.
  subroutine check_stacks(error)
    type(error_type), allocatable, intent(out) :: error
    type(limit_type) :: limit
    integer :: thread_stack

    if (c_getrlimit(stack_resource, limit) == 0) then
      if (limit%current >= 0 .and. limit%current < 1024 * min_stack) then
        call fatal_error(error, "the stack is limited to " // text(int(limit%current / 1024)) // " kB, but " // text(min_stack) &
          & // " kB are needed; set a larger limit with ulimit -s " // text(usual_stack), wrong_usage)
        return
      end if
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
