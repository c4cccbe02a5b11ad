!> A file that takes its name when it is complete: it grows under another name, every write and its end are checked, and then it
!> replaces what was there at one stroke. Whatever fails, the old file stays as it was and nothing is left of the new one.
module gestell_output_file_output
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_files, only: close_file, create_file, last_reason, remove_file, rename_file, write_whole
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none (type, external)
  private

  public :: open_output, open_standard_output, write_file

  !> What a name has behind it as long as the file grows.
  character(len=*), parameter, public :: growing = ".new"

  type, public :: output_type
    private
    character(len=:), allocatable :: name
    integer(c_int) :: handle = -1
    !> What is not yet given to the system.
    character(len=:), allocatable :: pending
    integer :: used = 0
    !> Why it failed, empty where it did not.
    character(len=:), allocatable :: reason
  contains
    procedure :: append
    procedure :: complete
  end type output_type

  !> Bytes that are given to the system at once.
  integer, parameter :: piece = 65536

contains

  !> A file of these bytes. Error: it cannot be written.
  subroutine write_file(name, bytes, error)
    character(len=*), intent(in) :: name, bytes
    type(error_type), allocatable, intent(out) :: error
    type(output_type) :: output

    call open_output(output, name)
    call output%append(bytes)
    call output%complete(error)
  end subroutine write_file

  !> Begins the file `name`. What fails, here and in `append`, `complete` tells.
  subroutine open_output(output, name)
    type(output_type), intent(out) :: output
    character(len=*), intent(in) :: name

    output%name = name
    output%reason = ""
    allocate(character(len=piece) :: output%pending)
    call create_file(name // growing, output%handle)
    if (output%handle < 0) output%reason = last_reason()
  end subroutine open_output

  !> Standard output instead of a file.
  subroutine open_standard_output(output)
    type(output_type), intent(out) :: output
    integer(c_int), parameter :: standard_output = 1

    output%name = ""
    output%reason = ""
    allocate(character(len=piece) :: output%pending)
    output%handle = standard_output
  end subroutine open_standard_output

  !> Adds bytes.
  subroutine append(self, bytes)
    class(output_type), intent(inout) :: self
    character(len=*), intent(in) :: bytes

    if (self%used + len(bytes) > piece) call flush_pending(self)
    if (len(bytes) > piece) then
      call give(self, bytes)
    else
      self%pending(self%used + 1:self%used + len(bytes)) = bytes
      self%used = self%used + len(bytes)
    end if
  end subroutine append

  subroutine flush_pending(output)
    type(output_type), intent(inout) :: output

    call give(output, output%pending(:output%used))
    output%used = 0
  end subroutine flush_pending

  !> Gives bytes to the system.
  subroutine give(output, bytes)
    type(output_type), intent(inout) :: output
    character(len=*), intent(in) :: bytes
    logical :: done

    if (output%reason /= "") return
    call write_whole(output%handle, bytes, done)
    if (.not. done) output%reason = last_reason()
  end subroutine give

  !> Ends the file and gives it its name. Error: it could not be written to its end, as on a full disk; it is gone then.
  subroutine complete(self, error)
    class(output_type), intent(inout) :: self
    type(error_type), allocatable, intent(out) :: error
    logical :: done

    call flush_pending(self)
    if (self%handle >= 0 .and. self%name /= "") then
      call close_file(self%handle, done)
      if (.not. done .and. self%reason == "") self%reason = last_reason()
      self%handle = -1
      if (self%reason == "") then
        call rename_file(self%name // growing, self%name, done)
        if (.not. done) self%reason = last_reason()
      end if
      if (self%reason /= "") call remove_file(self%name // growing)
    end if
    if (self%reason == "") return
    if (self%name == "") then
      call fatal_error(error, "standard output cannot be written: " // self%reason, failed_computation)
    else
      call fatal_error(error, self%name // ": cannot be written: " // self%reason, failed_computation)
      error%unwritten = .true.
    end if
  end subroutine complete

end module gestell_output_file_output
