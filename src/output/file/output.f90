!> Writes a file that becomes visible only when it is complete. The file is written under a temporary name and every write is
!> checked. Finally the file is renamed, which replaces the old file in one step. After a failure the new file is removed and the
!> old one stays unchanged. The same procedures collect a text in memory.
module gestell_output_file_output
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_files, only: close_file, create_file, get_system_message, remove_file, rename_file, write_bytes
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none (type, external)
  private

  public :: collect_output, open_output, write_file

  !> Ending appended to the name of a file while the file is being written
  character(len=*), parameter, public :: temporary_ending = ".new"

  !> A file that is being written under a temporary name.
  type, public :: output_type
    private
    !> Name that the file has when it is complete; empty for standard output
    character(len=:), allocatable :: name
    !> Handle of the open file; negative if the file is not open
    integer(c_int) :: handle = -1
    !> Bytes that have been appended but not yet passed to the system
    character(len=:), allocatable :: pending
    !> Number of valid characters in `pending`
    integer :: used = 0
    !> Everything that has been appended; allocated if the output is collected in memory
    type(growing_text_type), allocatable :: collected
    !> Explanation of the first failure; empty as long as nothing has failed
    character(len=:), allocatable :: reason
  contains
    procedure :: append, complete, take
  end type output_type

  !> Number of bytes that are passed to the system in one call
  integer, parameter :: piece = 65536

contains

  !> Writes `bytes` to a file called `name`. Fails if the file cannot be written completely.
  subroutine write_file(name, bytes, error)
    character(len=*), intent(in) :: name, bytes
    type(error_type), allocatable, intent(out) :: error
    type(output_type) :: output

    call open_output(output, name)
    call output%append(bytes)
    call output%complete(error)
  end subroutine write_file

  !> Opens a file that will be called `name`, under its temporary name. Without a name, `output` writes to standard output. If
  !> opening the file or writing to it fails, `complete` returns the error.
  subroutine open_output(output, name)
    type(output_type), intent(out) :: output
    character(len=*), intent(in), optional :: name
    integer(c_int), parameter :: standard_output = 1

    output%name = ""
    output%reason = ""
    allocate(character(len=piece) :: output%pending)
    output%handle = standard_output
    if (.not. present(name)) return
    output%name = name
    call create_file(name // temporary_ending, output%handle)
    if (output%handle < 0) call get_system_message(output%reason)
  end subroutine open_output

  !> Makes `output` collect everything in memory, from where `take` returns it.
  subroutine collect_output(output)
    type(output_type), intent(out) :: output

    allocate(output%collected)
  end subroutine collect_output

  !> Returns everything that has been appended to an output in memory.
  subroutine take(self, text)
    class(output_type), intent(in) :: self
    character(len=:), allocatable, intent(out) :: text

    allocate(text, source=self%collected%whole())
  end subroutine take

  !> Appends bytes to the file; they are collected and written in larger pieces.
  subroutine append(self, bytes)
    class(output_type), intent(inout) :: self
    character(len=*), intent(in) :: bytes

    if (allocated(self%collected)) then
      call self%collected%append(bytes)
      return
    end if
    if (self%used + len(bytes) > piece) call flush_pending(self)
    if (len(bytes) > piece) then
      call flush_bytes(self, bytes)
    else
      self%pending(self%used + 1:self%used + len(bytes)) = bytes
      self%used = self%used + len(bytes)
    end if
  end subroutine append

  !> Writes the collected bytes to the file.
  subroutine flush_pending(output)
    type(output_type), intent(inout) :: output

    call flush_bytes(output, output%pending(:output%used))
    output%used = 0
  end subroutine flush_pending

  !> Writes bytes to the open file; does nothing if an earlier write has failed.
  subroutine flush_bytes(output, bytes)
    type(output_type), intent(inout) :: output
    character(len=*), intent(in) :: bytes
    logical :: done

    if (output%reason /= "") return
    call write_bytes(output%handle, bytes, done)
    if (.not. done) call get_system_message(output%reason)
  end subroutine flush_bytes

  !> Closes the file and gives it its final name. Fails if the file could not be written completely, for example because the disk is
  !> full; the incomplete file is then removed.
  subroutine complete(self, error)
    class(output_type), intent(inout) :: self
    type(error_type), allocatable, intent(out) :: error
    logical :: done

    call flush_pending(self)
    if (self%handle >= 0 .and. self%name /= "") then
      call close_file(self%handle, done)
      if (.not. done .and. self%reason == "") call get_system_message(self%reason)
      self%handle = -1
      if (self%reason == "") then
        call rename_file(self%name // temporary_ending, self%name, done)
        if (.not. done) call get_system_message(self%reason)
      end if
      if (self%reason /= "") call remove_file(self%name // temporary_ending)
    end if
    if (self%reason == "") return
    if (self%name == "") then
      call fatal_error(error, "standard output cannot be written: " // self%reason, failed_computation)
    else
      call fatal_error(error, self%name // ": cannot be written: " // self%reason, failed_computation)
      error%write_failed = .true.
    end if
  end subroutine complete

end module gestell_output_file_output
