!> A line on the terminal that says how far the work is; nothing where standard error is no terminal.
module terminal
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: error_unit
  implicit none (type, external)
  private

  public :: show_progress

  interface
    !> POSIX isatty.
    integer(c_int) function c_isatty(descriptor) bind(c, name="isatty")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: descriptor
    end function c_isatty
  end interface

  integer(c_int), parameter :: standard_error = 2

contains

  !> Shows `part`, from 0 to 1, in place of what it showed before; at 1 the line disappears.
  subroutine show_progress(part)
    real(dp), intent(in) :: part
    integer, parameter :: width = 30
    integer :: done

    if (c_isatty(standard_error) == 0) return
    done = nint(width * part)
    if (part < 1) then
      write (error_unit, "(6a)", advance="no") achar(13), "measuring [", repeat("#", done), repeat(".", width - done), "]"
    else
      write (error_unit, "(3a)", advance="no") achar(13), repeat(" ", width + 12), achar(13)
    end if
    flush (error_unit)
  end subroutine show_progress

end module terminal
