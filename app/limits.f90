!> What the system may do to the program: limits, signals, closed streams.
module limits
  use gestell_io_files, only: open_to_read, unlock_file
  use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t
  implicit none (type, external)
  private

  public :: prepare_process

  interface
    !> POSIX signal; a handler is an address, or one of a few small numbers.
    integer(c_intptr_t) function c_signal(number, handler) bind(c, name="signal")
      import :: c_int, c_intptr_t
      implicit none (type, external)
      integer(c_int), value :: number
      integer(c_intptr_t), value :: handler
    end function c_signal
  end interface

  !> SIGXFSZ and SIGPIPE, and SIG_IGN.
  integer(c_int), parameter :: file_too_large = 25, closed_pipe = 13
  integer(c_intptr_t), parameter :: ignore = 1
  integer(c_int), parameter :: standard_error = 2

contains

  !> Makes of signals that would kill the program failures of the call that it can tell: a file that grows beyond the limit
  !> (ulimit -f) fails as on a full disk, what nobody reads any more cannot be written. Standard streams that are closed are
  !> opened so that no result file takes their numbers: writing to them fails.
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

end module limits
