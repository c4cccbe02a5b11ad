!> Provides file operations that Fortran lacks. File names must not end with blanks. After an operation failed, `get_system_message`
!> returns the operating system's explanation until the next operation.
module gestell_base_files
  use gestell_base_error, only: error_type, fatal_error
  use gestell_base_platform, only: c_close, c_create, c_exists, c_is_folder, c_link, c_lock, c_make_folder, c_message, &
    & c_open_to_read, c_open_to_write, c_read, c_remove_file, c_remove_folder, c_rename, c_size, c_strlen, c_write
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int, c_null_char, c_ptr
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: close_file, copy_text, create_file, file_size, file_exists, folder_exists, get_system_message, link_file, lock_file, &
    & make_directory, open_to_read, open_to_write, read_at, read_chunk, read_file, remove_file, remove_folder, rename_file, &
    & report_system_error, try_lock, unlock_file, write_bytes

  !> Maximum length of the operating system's explanation
  integer, parameter :: longest_message = 256
  !> Position that stands for "after the last byte read or written"
  integer(int64), parameter :: onwards = -1

contains

  !> Returns the operating system's explanation why the last operation failed.
  subroutine get_system_message(words)
    character(len=:), allocatable, intent(out) :: words
    character(len=longest_message) :: buffer
    integer :: n

    n = c_message(buffer, len(buffer, c_int))
    words = buffer(:n)
  end subroutine get_system_message

  !> Returns the error that the last operation failed, with the explanation of the operating system.
  subroutine report_system_error(what, code, error)
    !> The operation that failed, for example "cam.csv: cannot be read"
    character(len=*), intent(in) :: what
    !> Exit code of the program for this error
    integer, intent(in) :: code
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: reason

    call get_system_message(reason)
    call fatal_error(error, what // ": " // reason, code)
  end subroutine report_system_error

  !> Copies the zero-terminated C string at `address`, which must not be null, to `text`.
  subroutine copy_text(address, text)
    type(c_ptr), intent(in) :: address
    character(len=:), allocatable, intent(out) :: text
    character(kind=c_char), pointer :: letters(:)
    integer :: i

    call c_f_pointer(address, letters, [c_strlen(address)])
    allocate(character(len=size(letters)) :: text)
    do i = 1, size(letters)
      text(i:i) = letters(i)
    end do
  end subroutine copy_text

  !> Size of a file in bytes; -1 if the file does not exist.
  integer(int64) function file_size(name)
    character(len=*), intent(in) :: name

    file_size = c_size(name // c_null_char)
  end function file_size

  !> True if a file or folder called `name` exists.
  logical function file_exists(name)
    character(len=*), intent(in) :: name

    file_exists = c_exists(name // c_null_char) /= 0
  end function file_exists

  !> True if a folder called `name` exists and can be entered.
  logical function folder_exists(name)
    character(len=*), intent(in) :: name

    folder_exists = c_is_folder(name // c_null_char) /= 0
  end function folder_exists

  !> Creates an empty file and opens it. An existing file or link of this name is removed first, so that the target of a link, or a
  !> file with further names, stays unchanged. `handle` is negative if the file cannot be created.
  subroutine create_file(name, handle)
    character(len=*), intent(in) :: name
    integer(c_int), intent(out) :: handle

    handle = c_remove_file(name // c_null_char)
    if (handle == 0) handle = c_create(name // c_null_char)
  end subroutine create_file

  !> Opens an existing file or folder for reading. `handle` is negative if it cannot be opened.
  subroutine open_to_read(name, handle)
    character(len=*), intent(in) :: name
    integer(c_int), intent(out) :: handle

    handle = c_open_to_read(name // c_null_char)
  end subroutine open_to_read

  !> Opens an existing file for writing; its content stays. `handle` is negative if the file cannot be opened.
  subroutine open_to_write(name, handle)
    character(len=*), intent(in) :: name
    integer(c_int), intent(out) :: handle

    handle = c_open_to_write(name // c_null_char)
  end subroutine open_to_write

  !> Reads at most len(bytes) bytes. `n` is the number of bytes read; it is 0 at the end of the file and -1 if reading fails.
  subroutine read_chunk(handle, bytes, n)
    integer(c_int), intent(in) :: handle
    ! allow(C072)
    character(len=*), intent(out) :: bytes
    integer, intent(out) :: n

    n = int(c_read(handle, bytes, len(bytes, int64), onwards))
  end subroutine read_chunk

  !> Writes all `bytes` at `position`, or at the current position of the file if `position` is absent. A gap between the old end of
  !> the file and `position` is filled with zeros.
  subroutine write_bytes(handle, bytes, done, position)
    integer(c_int), intent(in) :: handle
    character(len=*), intent(in) :: bytes
    !> True if all bytes were written
    logical, intent(out) :: done
    !> Position in the file of the first byte to be written; positions start at 1. If absent, writing continues after the last byte
    !> written
    integer(int64), intent(in), optional :: position
    integer(int64) :: written, n, place

    n = 0
    place = onwards
    do while (n < len(bytes, int64))
      if (present(position)) place = position - 1 + n
      written = c_write(handle, bytes(n + 1:), len(bytes, int64) - n, place)
      done = written > 0
      if (.not. done) return
      n = n + written
    end do
    done = .true.
  end subroutine write_bytes

  !> Reads len(bytes) bytes, starting at `position` in the file.
  subroutine read_at(handle, position, bytes, done)
    integer(c_int), intent(in) :: handle
    !> Position in the file of the first byte to be read; positions start at 1
    integer(int64), intent(in) :: position
    ! allow(C072)
    character(len=*), intent(out) :: bytes
    !> True if all bytes were read; false if reading failed or the file is too short
    logical, intent(out) :: done
    integer(int64) :: came, n

    n = 0
    do while (n < len(bytes, int64))
      came = c_read(handle, bytes(n + 1:), len(bytes, int64) - n, position - 1 + n)
      done = came > 0
      if (.not. done) return
      n = n + came
    end do
    done = .true.
  end subroutine read_at

  !> Reads a whole file. `bytes` is empty if the file cannot be read.
  subroutine read_file(name, bytes)
    character(len=*), intent(in) :: name
    character(len=:), allocatable, intent(out) :: bytes
    integer(c_int) :: handle
    logical :: done

    allocate(character(len=max(0_int64, file_size(name))) :: bytes)
    call open_to_read(name, handle)
    done = handle >= 0
    if (done) call read_at(handle, 1_int64, bytes, done)
    if (.not. done) bytes = ""
    if (handle >= 0) call close_file(handle, done)
  end subroutine read_file

  !> Closes a file. `done` is false if closing fails, as on systems that report a full disk only when a file is closed.
  subroutine close_file(handle, done)
    integer(c_int), intent(in) :: handle
    logical, intent(out) :: done

    done = c_close(handle) == 0
  end subroutine close_file

  !> Renames the file `old` to `new` and replaces an existing file of this name. The replacement is atomic: other processes find
  !> either the replaced file or the renamed one.
  subroutine rename_file(old, new, done)
    character(len=*), intent(in) :: old, new
    logical, intent(out) :: done

    done = c_rename(old // c_null_char, new // c_null_char) == 0
  end subroutine rename_file

  !> Gives the file `old` the second name `new` (hard link).
  subroutine link_file(old, new, done)
    character(len=*), intent(in) :: old, new
    logical, intent(out) :: done

    done = c_link(old // c_null_char, new // c_null_char) == 0
  end subroutine link_file

  !> Removes a file. Does nothing if the file does not exist.
  subroutine remove_file(name)
    character(len=*), intent(in) :: name
    integer(c_int) :: status

    status = c_remove_file(name // c_null_char)
  end subroutine remove_file

  !> Creates a folder. `made`: true if this call created the folder. `there`: true if a folder or file of this name exists
  !> afterwards.
  subroutine make_directory(name, made, there)
    character(len=*), intent(in) :: name
    logical, intent(out) :: made, there
    integer(c_int) :: status

    status = c_make_folder(name // c_null_char)
    made = status == 0
    there = status >= 0
  end subroutine make_directory

  !> Removes a folder, provided that it is empty.
  subroutine remove_folder(name, done)
    character(len=*), intent(in) :: name
    logical, intent(out), optional :: done
    integer(c_int) :: status

    status = c_remove_folder(name // c_null_char)
    if (present(done)) done = status == 0
  end subroutine remove_folder

  !> Locks the file `name` and waits until other processes release their locks on it. Creates the file if necessary. A `shared` lock
  !> waits only for exclusive locks. The operating system releases the lock when the process ends for any reason. On a file system
  !> without locks, nothing is locked.
  subroutine lock_file(name, handle, shared)
    character(len=*), intent(in) :: name
    integer(c_int), intent(out) :: handle
    logical, intent(in) :: shared
    integer(c_int) :: status

    call open_to_write(name, handle)
    if (handle < 0) handle = c_create(name // c_null_char)
    if (handle >= 0) status = c_lock(handle, merge(1_c_int, 0_c_int, shared), 1_c_int)
  end subroutine lock_file

  !> Tries to get an exclusive lock on an open file.
  subroutine try_lock(handle, wait, held, busy)
    integer(c_int), intent(in) :: handle
    !> True if the procedure is to wait until no other process holds the lock
    logical, intent(in) :: wait
    !> `held`: true if this process now has the lock; `busy`: true if another process has it. Both are false if the file system does
    !> not support locks
    logical, intent(out) :: held, busy
    integer(c_int) :: status

    status = c_lock(handle, 0_c_int, merge(1_c_int, 0_c_int, wait))
    held = status == 0
    busy = status > 0
  end subroutine try_lock

  !> Releases the lock on a file by closing the file.
  subroutine unlock_file(handle)
    integer(c_int), intent(in) :: handle
    integer(c_int) :: status

    if (handle >= 0) status = c_close(handle)
  end subroutine unlock_file

end module gestell_base_files
