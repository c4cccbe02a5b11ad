!> Prints the report on standard output, and notes and errors on standard error.
module gestell_run_console
  use gestell_base_error, only: error_type, failed_computation
  use gestell_base_files, only: report_system_error, write_bytes
  use gestell_base_words, only: printable, put_on_one_line
  use gestell_output_result, only: result_type
  use gestell_task_registry_run, only: listener_type
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none (type, external)
  private

  public :: print_out, print_error_line

  !> Prints the report piece by piece while the tasks run.
  type, extends(listener_type), public :: console_type
    !> `silent`: true if the report is not printed. `omits_notes`: true if notes are not printed because another process
    !> prints them
    logical :: silent = .false., omits_notes = .false.
    !> Allocated if writing to standard output has failed. Printing then stops, but the files are still written
    type(error_type), allocatable :: error
  contains
    procedure :: receive, write_lines
  end type console_type

  integer(c_int), parameter :: standard_output = 1, standard_error = 2

contains

  !> Prints those parts of the report and the notes that have been added since the last call.
  subroutine receive(self, result)
    class(console_type), intent(inout) :: self
    type(result_type), intent(inout) :: result
    character, parameter :: newline = new_line("a")
    integer :: last

    call result%insert_headlines()
    do while (len(result%notes) > 0)
      last = index(result%notes, newline)
      if (.not. self%omits_notes) call print_error_line(result%notes(:last - 1))
      result%notes = result%notes(last + 1:)
    end do
    call self%write_lines(result%unprinted_report())
  end subroutine receive

  !> Prints complete lines of the report.
  subroutine write_lines(self, words)
    class(console_type), intent(inout) :: self
    character(len=*), intent(in) :: words

    if (.not. (self%silent .or. allocated(self%error))) call print_out(printable(words), self%error)
  end subroutine write_lines

  !> Writes a text to standard output. Fails if the text cannot be written completely.
  subroutine print_out(words, error)
    character(len=*), intent(in) :: words
    type(error_type), allocatable, intent(out) :: error
    logical :: done

    call write_bytes(standard_output, words, done)
    if (done) return
    call report_system_error("standard output cannot be written", failed_computation, error)
    error%write_failed = .true.
  end subroutine print_out

  !> Writes one line to standard error. A failure is ignored, because it could be reported nowhere else.
  subroutine print_error_line(words)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: line
    logical :: done

    call put_on_one_line(words, line)
    call write_bytes(standard_error, line // new_line("a"), done)
  end subroutine print_error_line

end module gestell_run_console
