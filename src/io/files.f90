!> What POSIX can do with files and Fortran cannot. Names are those of the program, without blanks at the end.
module gestell_io_files
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: file_size, lock_file, remove_file, remove_folder, rename_file, unlock_file

  !> LOCK_EX of flock, and the rights of a file that is made.
  integer(c_int), parameter :: exclusive = 2, rights = int(o"666", c_int)

  interface
    integer(c_int) function c_rename(old, new) bind(c, name="rename")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: old(*), new(*)
    end function c_rename

    integer(c_int) function c_unlink(path) bind(c, name="unlink")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
    end function c_unlink

    integer(c_int) function c_rmdir(path) bind(c, name="rmdir")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
    end function c_rmdir

    !> POSIX creat; mode_t is passed as an int, as variables of its size are.
    integer(c_int) function c_creat(path, mode) bind(c, name="creat")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_creat

    integer(c_int) function c_flock(handle, operation) bind(c, name="flock")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: handle, operation
    end function c_flock

    integer(c_int) function c_close(handle) bind(c, name="close")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: handle
    end function c_close
  end interface

contains

  !> Bytes of a file, -1 where there is none.
  integer(int64) function file_size(name)
    character(len=*), intent(in) :: name

    inquire (file=name, size=file_size)
  end function file_size

  !> Puts a file in another's place at one stroke: at any moment there is the old one or the new one.
  subroutine rename_file(old, new, done)
    character(len=*), intent(in) :: old, new
    logical, intent(out) :: done

    done = c_rename(old // c_null_char, new // c_null_char) == 0
  end subroutine rename_file

  !> Removes a file; one that is not there is no failure.
  subroutine remove_file(name)
    character(len=*), intent(in) :: name
    integer(c_int) :: status

    status = c_unlink(name // c_null_char)
  end subroutine remove_file

  !> Removes a folder if it is empty.
  subroutine remove_folder(name)
    character(len=*), intent(in) :: name
    integer(c_int) :: status

    status = c_rmdir(name // c_null_char)
  end subroutine remove_folder

  !> Waits until no other process holds the empty file `name`, and holds it. The system lets go of it when the process
  !> ends, however it does. Where there are no locks nothing is held.
  subroutine lock_file(name, handle)
    character(len=*), intent(in) :: name
    integer(c_int), intent(out) :: handle
    integer(c_int) :: status

    handle = c_creat(name // c_null_char, rights)
    if (handle >= 0) status = c_flock(handle, exclusive)
  end subroutine lock_file

  !> Lets go of it.
  subroutine unlock_file(handle)
    integer(c_int), intent(in) :: handle
    integer(c_int) :: status

    if (handle >= 0) status = c_close(handle)
  end subroutine unlock_file

end module gestell_io_files
