!> Words for people: on standard output unless it is to be silent, and kept for the page that holds the whole report.
module console
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none (type, external)
  private

  type, public :: console_type
    !> Nothing is printed; what is said is kept all the same.
    logical :: silent = .false.
    character(len=:), allocatable :: said
  contains
    procedure :: say
  end type console_type

contains

  !> Says complete lines.
  subroutine say(self, words)
    class(console_type), intent(inout) :: self
    character(len=*), intent(in) :: words

    if (.not. allocated(self%said)) self%said = ""
    self%said = self%said // words
    if (.not. self%silent) write (output_unit, "(a)", advance="no") words
  end subroutine say

end module console
