!> Words for people: on standard output unless it is to be silent, and kept for the page that holds the whole report; notes and
!> errors on standard error.
module gestell_run_console
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_files, only: last_reason, write_whole
  use gestell_base_words, only: printable, put_on_one_line
  use gestell_output_result, only: result_type
  use gestell_task_registry_run, only: listener_type
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none (type, external)
  private

  public :: print_out, tell

  type, extends(listener_type), public :: console_type
    !> Nothing is printed, what is said is kept all the same; another process tells notes.
    logical :: silent = .false., aside = .false.
    character(len=:), allocatable :: said
    !> What went wrong with standard output. What is said after that is kept alone: the files are written all the same.
    type(error_type), allocatable :: error
  contains
    procedure :: hear
    procedure :: say
  end type console_type

  integer(c_int), parameter :: standard_output = 1, standard_error = 2

contains

  !> Says what of the report was not yet said, and notes.
  subroutine hear(self, result)
    class(console_type), intent(inout) :: self
    type(result_type), intent(inout) :: result
    character, parameter :: newline = new_line("a")
    integer :: last

    call result%lead()
    do while (len(result%notes) > 0)
      last = index(result%notes, newline)
      if (.not. self%aside) call tell(result%notes(:last - 1))
      result%notes = result%notes(last + 1:)
    end do
    call self%say(result%rest())
  end subroutine hear

  !> Says complete lines.
  subroutine say(self, words)
    class(console_type), intent(inout) :: self
    character(len=*), intent(in) :: words

    if (.not. allocated(self%said)) self%said = ""
    self%said = self%said // printable(words)
    if (.not. (self%silent .or. allocated(self%error))) call print_out(printable(words), self%error)
  end subroutine say

  !> Writes to standard output. Error: not all of it can be written.
  subroutine print_out(words, error)
    character(len=*), intent(in) :: words
    type(error_type), allocatable, intent(out) :: error
    logical :: done

    call write_whole(standard_output, words, done)
    if (done) return
    call fatal_error(error, "standard output cannot be written: " // last_reason(), failed_computation)
    error%unwritten = .true.
  end subroutine print_out

  !> Writes one line to standard error; where that fails there is nobody to tell.
  subroutine tell(words)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: line
    logical :: done

    call put_on_one_line(words, line)
    call write_whole(standard_error, line // new_line("a"), done)
  end subroutine tell

end module gestell_run_console
