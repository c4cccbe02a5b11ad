!> Limits that the system sets to the program.
module limits
  use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t
  implicit none (type, external)
  private

  public :: survive_file_limit

  interface
    !> POSIX signal; a handler is an address, or one of a few small numbers.
    integer(c_intptr_t) function c_signal(number, handler) bind(c, name="signal")
      import :: c_int, c_intptr_t
      implicit none (type, external)
      integer(c_int), value :: number
      integer(c_intptr_t), value :: handler
    end function c_signal
  end interface

  !> SIGXFSZ, and SIG_IGN.
  integer(c_int), parameter :: file_too_large = 25
  integer(c_intptr_t), parameter :: ignore = 1

contains

  !> A file that grows beyond the limit (ulimit -f) fails as on a full disk, in place of killing the program.
  subroutine survive_file_limit()
    integer(c_intptr_t) :: before

    before = c_signal(file_too_large, ignore)
  end subroutine survive_file_limit

end module limits
