!> The text of an input file.
module gestell_io_source
  use, intrinsic :: iso_fortran_env, only: iostat_end, iostat_eor
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_io_text, only: decimal
  implicit none (type, external)
  private

  public :: read_text

  !> Larger files are no input files.
  integer, parameter :: largest = 100000000

contains

  !> Reads a whole file, its lines divided by new_line('a'). Errors: no such file, a directory, not readable.
  subroutine read_text(file, text, error)
    character(len=*), intent(in) :: file
    character(len=:), allocatable, intent(out) :: text
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: buffer
    character(len=8192) :: piece
    character(len=256) :: message
    integer :: unit, status, n, length
    logical :: exists, too_large

    inquire(file=file, exist=exists)
    if (len_trim(file) == 0 .or. .not. exists) then
      call fatal_error(error, file // ": there is no such file", invalid_input)
      return
    end if
    inquire(file=file // "/.", exist=exists)
    if (exists) then
      call fatal_error(error, file // ": is a directory, not a file", invalid_input)
      return
    end if
    open(newunit=unit, file=file, status="old", action="read", access="stream", form="formatted", &
      iostat=status, iomsg=message)
    if (status /= 0) then
      call fatal_error(error, file // ": cannot be read: " // trim(message), invalid_input)
      return
    end if

    allocate(character(len=8192) :: buffer)
    length = 0
    too_large = .false.
    do
      read(unit, "(a)", advance="no", size=n, iostat=status, iomsg=message) piece
      if (status == iostat_end) exit
      if (status == 0) n = len(piece)
      if (status /= 0 .and. status /= iostat_eor) exit
      too_large = length + n >= largest
      if (too_large) exit
      if (length + n + 1 > len(buffer)) buffer = buffer // repeat(" ", length + n + 1)
      buffer(length+1:length+n) = piece(:n)
      length = length + n
      if (status == iostat_eor) then
        length = length + 1
        buffer(length:length) = new_line("a")
      end if
    end do
    close(unit)
    text = buffer(:length)
    if (too_large) then
      call fatal_error(error, file // ": is larger than " // decimal(largest / 1000000) // " MB", invalid_input)
    else if (status /= iostat_end) then
      call fatal_error(error, file // ": cannot be read: " // trim(message), invalid_input)
    end if
  end subroutine read_text

end module gestell_io_source
