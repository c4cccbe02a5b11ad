!> What POSIX can do with files and Fortran cannot. Names are those of the program, without blanks at the end.
module gestell_io_files
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: file_size, remove_file, remove_folder, rename_file

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

end module gestell_io_files
