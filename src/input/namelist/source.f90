!> The text of an input file.
module gestell_input_namelist_source
  use, intrinsic :: iso_c_binding, only: c_int
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_files, only: close_file, is_there, last_reason, open_to_read, read_some
  use gestell_base_text, only: text
  implicit none (type, external)
  private

  public :: read_text

  !> Larger files are no input files.
  integer, parameter :: largest = 100000000

contains

  !> Reads all bytes of a file. Errors: no such file, a directory, not readable, too large.
  subroutine read_text(file, content, error)
    character(len=*), intent(in) :: file
    character(len=:), allocatable, intent(out) :: content
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: buffer
    character(len=65536) :: piece
    integer(c_int) :: handle
    integer :: n, length
    logical :: is_folder, closed

    handle = -1
    inquire(file=file // "/.", exist=is_folder)
    if (.not. is_there(file)) then
      call fatal_error(error, file // ": there is no such file", invalid_input)
    else if (is_folder) then
      call fatal_error(error, file // ": is a directory, not a file", invalid_input)
    else
      call open_to_read(file, handle)
      if (handle < 0) call fatal_error(error, file // ": cannot be read: " // last_reason(), invalid_input)
    end if
    if (allocated(error)) return
    allocate(character(len=len(piece)) :: buffer)
    length = 0
    do
      call read_some(handle, piece, n)
      if (n <= 0 .or. length + n >= largest) exit
      if (length + n > len(buffer)) buffer = buffer // repeat(" ", len(buffer) + n)
      buffer(length + 1:length + n) = piece(:n)
      length = length + n
    end do
    if (n < 0) then
      call fatal_error(error, file // ": cannot be read: " // last_reason(), invalid_input)
    else if (n > 0) then
      call fatal_error(error, file // ": is larger than " // text(largest / 1000000) // " MB", invalid_input)
    end if
    call close_file(handle, closed)
    content = buffer(:length)
  end subroutine read_text

end module gestell_input_namelist_source
