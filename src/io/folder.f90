!> The folder that the result files go to.
module gestell_io_folder
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char
  implicit none (type, external)
  private

  public :: make_folder

  interface
    !> POSIX mkdir; mode_t is passed as an int, as variables of its size are.
    integer(c_int) function c_mkdir(path, mode) bind(c, name="mkdir")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_mkdir
  end interface

contains

  !> Makes `folder` and the folders above it where they are missing. Error: it cannot be made.
  subroutine make_folder(folder, error)
    character(len=*), intent(in) :: folder
    type(error_type), allocatable, intent(out) :: error
    integer(c_int) :: status
    logical :: exists
    integer :: i

    do i = 2, len(folder)
      if (folder(i:i) == "/") status = c_mkdir(folder(:i - 1) // c_null_char, int(o"777", c_int))
    end do
    status = c_mkdir(folder // c_null_char, int(o"777", c_int))
    inquire (file=folder // "/.", exist=exists)
    if (.not. exists) call fatal_error(error, "the folder '" // folder // "' for the results cannot be made; name " // &
      & "another with --output", wrong_usage)
  end subroutine make_folder

end module gestell_io_folder
