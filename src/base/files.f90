!> Provides POSIX file operations that Fortran lacks. File names must not end with blanks. After an operation failed,
!> `system_message` returns the operating system's explanation until the next operation.
module gestell_base_files
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int, c_int64_t, c_intptr_t, c_null_char, c_ptr, c_size_t
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: close_file, copy_text, create_file, file_size, file_exists, system_message, link_file, lock_file, make_directory, &
    & open_to_read, open_to_write, read_at, read_chunk, read_file, remove_file, remove_folder, rename_file, try_lock, unlock_file, &
    & write_bytes

  !> Flags of the POSIX functions flock and open. For flock: `together` is LOCK_SH, `exclusive` is LOCK_EX, `without_waiting` is
  !> LOCK_NB. For open: `only_to_write` is O_WRONLY.
  integer(c_int), parameter :: together = 1, exclusive = 2, without_waiting = 4, only_to_write = 1
  !> Permissions of new files (`rights`) and of new folders (`folder_rights`). The system restricts them by the user's umask.
  integer(c_int), parameter :: rights = int(o"666", c_int), folder_rights = int(o"777", c_int)
  !> Values of errno: `not_there` is ENOENT, `exists_already` is EEXIST, `interrupted` is EINTR. `would_block` is EWOULDBLOCK, on
  !> Linux and on BSD (which includes macOS).
  integer(c_int), parameter :: not_there = 2, exists_already = 17, interrupted = 4, would_block(2) = [11, 35]

  abstract interface
    integer(c_int) function of_path(path) bind(c)
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
    end function of_path

    integer(c_int) function of_two_paths(old, new) bind(c)
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: old(*), new(*)
    end function of_two_paths
  end interface

  procedure(of_path), bind(c, name="unlink") :: c_unlink
  procedure(of_path), bind(c, name="rmdir") :: c_rmdir
  procedure(of_two_paths), bind(c, name="rename") :: c_rename
  procedure(of_two_paths), bind(c, name="link") :: c_link

  ! gfortran 12 ignores `value` in a procedure declared by an interface name and passes numbers by reference. Procedures with
  ! numbers therefore have explicit interfaces.
  interface
    !> POSIX function mkdir. In C, `mode` has the type mode_t, which may be shorter than int; it is passed as an int all the same.
    integer(c_int) function c_mkdir(path, mode) bind(c, name="mkdir")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_mkdir

    integer(c_int) function c_creat(path, mode) bind(c, name="creat")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_creat

    !> POSIX function open, declared without its third argument `mode`, which is needed only to create a file.
    integer(c_int) function c_open(path, flags) bind(c, name="open")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: flags
    end function c_open

    integer(c_int) function c_access(path, mode) bind(c, name="access")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_access

    integer(c_intptr_t) function c_write(handle, bytes, length) bind(c, name="write")
      import :: c_char, c_int, c_intptr_t, c_size_t
      implicit none (type, external)
      integer(c_int), value :: handle
      character(kind=c_char), intent(in) :: bytes(*)
      integer(c_size_t), value :: length
    end function c_write

    integer(c_intptr_t) function c_read(handle, bytes, length) bind(c, name="read")
      import :: c_char, c_int, c_intptr_t, c_size_t
      implicit none (type, external)
      integer(c_int), value :: handle
      ! allow(C072)
      character(kind=c_char), intent(out) :: bytes(*)
      integer(c_size_t), value :: length
    end function c_read

    !> off_t has 64 bits.
    integer(c_intptr_t) function c_pwrite(handle, bytes, length, offset) bind(c, name="pwrite")
      import :: c_char, c_int, c_int64_t, c_intptr_t, c_size_t
      implicit none (type, external)
      integer(c_int), value :: handle
      character(kind=c_char), intent(in) :: bytes(*)
      integer(c_size_t), value :: length
      integer(c_int64_t), value :: offset
    end function c_pwrite

    integer(c_intptr_t) function c_pread(handle, bytes, length, offset) bind(c, name="pread")
      import :: c_char, c_int, c_int64_t, c_intptr_t, c_size_t
      implicit none (type, external)
      integer(c_int), value :: handle
      ! allow(C072)
      character(kind=c_char), intent(out) :: bytes(*)
      integer(c_size_t), value :: length
      integer(c_int64_t), value :: offset
    end function c_pread

    integer(c_int) function c_flock(handle, operation) bind(c, name="flock")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: handle, operation
    end function c_flock

    integer(c_int) function c_close(handle) bind(c, name="close")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: handle
    end function c_close

    type(c_ptr) function c_strerror(number) bind(c, name="strerror")
      import :: c_int, c_ptr
      implicit none (type, external)
      integer(c_int), value :: number
    end function c_strerror

    integer(c_size_t) function c_strlen(words) bind(c, name="strlen")
      import :: c_ptr, c_size_t
      implicit none (type, external)
      type(c_ptr), value :: words
    end function c_strlen

    !> Returns the C variable errno. In C, errno is a macro that Fortran cannot use. The procedure called here belongs to gfortran's
    !> library.
    integer(c_int) function errno() bind(c, name="_gfortran_ierrno_i4")
      import :: c_int
      implicit none (type, external)
    end function errno
  end interface

contains

  !> Explanation, by the operating system, why the last POSIX call failed.
  function system_message() result(words)
    character(len=:), allocatable :: words

    call copy_text(c_strerror(errno()), words)
  end function system_message

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

    inquire (file=name, size=file_size)
  end function file_size

  !> True if a file or folder called `name` exists.
  logical function file_exists(name)
    character(len=*), intent(in) :: name

    file_exists = c_access(name // c_null_char, 0_c_int) == 0
  end function file_exists

  !> Creates an empty file and opens it. An existing file or link of this name is removed first, so that the target of a link, or a
  !> file with further names, stays unchanged. `handle` is negative if the file cannot be created.
  subroutine create_file(name, handle)
    character(len=*), intent(in) :: name
    integer(c_int), intent(out) :: handle

    handle = -1
    if (c_unlink(name // c_null_char) /= 0) then
      if (errno() /= not_there) return
    end if
    handle = c_creat(name // c_null_char, rights)
  end subroutine create_file

  !> Opens an existing file or folder for reading. `handle` is negative if it cannot be opened.
  subroutine open_to_read(name, handle)
    character(len=*), intent(in) :: name
    integer(c_int), intent(out) :: handle

    handle = c_open(name // c_null_char, 0_c_int)
  end subroutine open_to_read

  !> Opens an existing file for writing; its content stays. `handle` is negative if the file cannot be opened.
  subroutine open_to_write(name, handle)
    character(len=*), intent(in) :: name
    integer(c_int), intent(out) :: handle

    handle = c_open(name // c_null_char, only_to_write)
  end subroutine open_to_write

  !> Reads at most len(bytes) bytes. `n` is the number of bytes read; it is 0 at the end of the file and -1 if reading fails.
  subroutine read_chunk(handle, bytes, n)
    integer(c_int), intent(in) :: handle
    ! allow(C072)
    character(len=*), intent(out) :: bytes
    integer, intent(out) :: n

    do
      n = int(c_read(handle, bytes, len(bytes, c_size_t)))
      if (n >= 0) return
      if (errno() /= interrupted) return
    end do
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
    integer(c_intptr_t) :: written
    integer(int64) :: n

    n = 0
    do while (n < len(bytes, int64))
      associate (left => int(len(bytes, int64) - n, c_size_t))
        if (present(position)) then
          written = c_pwrite(handle, bytes(n + 1:), left, position - 1 + n)
        else
          written = c_write(handle, bytes(n + 1:), left)
        end if
      end associate
      done = written > 0
      if (done) then
        n = n + written
      else
        if (written == 0) return
        if (errno() /= interrupted) return
      end if
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
    integer(c_intptr_t) :: came
    integer(int64) :: n

    n = 0
    do while (n < len(bytes, int64))
      came = c_pread(handle, bytes(n + 1:), int(len(bytes, int64) - n, c_size_t), position - 1 + n)
      done = came > 0
      if (done) then
        n = n + came
      else
        if (came == 0) return
        if (errno() /= interrupted) return
      end if
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

    status = c_unlink(name // c_null_char)
  end subroutine remove_file

  !> Creates a folder. `made`: true if this call created the folder. `there`: true if a folder or file of this name exists
  !> afterwards.
  subroutine make_directory(name, made, there)
    character(len=*), intent(in) :: name
    logical, intent(out) :: made, there

    made = c_mkdir(name // c_null_char, folder_rights) == 0
    there = made
    if (.not. made) there = errno() == exists_already
  end subroutine make_directory

  !> Removes a folder, provided that it is empty.
  subroutine remove_folder(name, done)
    character(len=*), intent(in) :: name
    logical, intent(out), optional :: done
    integer(c_int) :: status

    status = c_rmdir(name // c_null_char)
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
    if (handle < 0) handle = c_creat(name // c_null_char, rights)
    if (handle >= 0) status = c_flock(handle, merge(together, exclusive, shared))
  end subroutine lock_file

  !> Tries to get an exclusive lock on an open file.
  subroutine try_lock(handle, wait, held, busy)
    integer(c_int), intent(in) :: handle
    !> True if the procedure is to wait until no other process holds the lock
    logical, intent(in) :: wait
    !> `held`: true if this process now has the lock; `busy`: true if another process has it. Both are false if the file system does
    !> not support locks
    logical, intent(out) :: held, busy

    held = c_flock(handle, merge(exclusive, exclusive + without_waiting, wait)) == 0
    busy = .false.
    if (.not. held) busy = any(would_block == errno())
  end subroutine try_lock

  !> Releases the lock on a file by closing the file.
  subroutine unlock_file(handle)
    integer(c_int), intent(in) :: handle
    integer(c_int) :: status

    if (handle >= 0) status = c_close(handle)
  end subroutine unlock_file

end module gestell_base_files
