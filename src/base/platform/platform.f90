!> All calls of the operating system. posix.c and windows.c define these functions. Every build compiles both files; each file is
!> empty on the other system. They are written in C because only the system's C compiler knows errno, structures and constants.
!>
!> Names of files end with c_null_char. Functions return -1 on failure unless their comment says otherwise; `c_message` then
!> explains the failure. The comments say what Windows does differently. The names for C begin with "platform" because a shared
!> library exports every name that begins with "gestell".
module gestell_base_platform
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_ptr, c_size_t
  implicit none (type, external)
  private

  public :: c_close, c_create, c_decode, c_exists, c_exit, c_full_path, c_is_folder, c_is_link, c_is_same, c_is_terminal, &
    & c_is_windows, c_link, c_lock, c_make_folder, c_message, c_open_to_read, c_open_to_write, c_prepare, c_read, &
    & c_remove_file, c_remove_folder, c_rename, c_size, c_stack_limit, c_strlen, c_write

  interface
    !> 1 on Windows, otherwise 0. Paths and shell commands depend on it.
    integer(c_int) function c_is_windows() bind(c, name="platform_gestell_is_windows")
      import :: c_int
      implicit none (type, external)
    end function c_is_windows

    !> 1 if a file or folder of this name exists, otherwise 0.
    integer(c_int) function c_exists(name) bind(c, name="platform_gestell_exists")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_exists

    !> 1 if `name` is a folder that can be entered, otherwise 0. Links are followed.
    integer(c_int) function c_is_folder(name) bind(c, name="platform_gestell_is_folder")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_is_folder

    !> Size of a file in bytes; -1 if the file does not exist.
    integer(c_int64_t) function c_size(name) bind(c, name="platform_gestell_size")
      import :: c_char, c_int64_t
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_size

    !> 1 if `name` is a symbolic link, even if its target does not exist. Windows: also other reparse points,
    !> such as the folders of cloud storage.
    integer(c_int) function c_is_link(name) bind(c, name="platform_gestell_is_link")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_is_link

    !> 1 if both names denote the same existing file, after links have been followed.
    integer(c_int) function c_is_same(one, another) bind(c, name="platform_gestell_is_same")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: one(*)
      character(kind=c_char), intent(in) :: another(*)
    end function c_is_same

    !> Absolute path of an existing file, with slashes between folders. Returns the number of bytes written to `path`; -1 if the
    !> file does not exist. Symbolic links are replaced by their targets. Windows: links stay in the path.
    integer(c_int) function c_full_path(name, path, room) bind(c, name="platform_gestell_full_path")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
      ! allow(C072)
      character(kind=c_char), intent(inout) :: path(*)
      integer(c_int), value :: room
    end function c_full_path

    !> Opens an existing file or, on POSIX systems, a folder. Windows: a folder cannot be opened, so that nothing locks it.
    integer(c_int) function c_open_to_read(name) bind(c, name="platform_gestell_open_to_read")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_open_to_read

    !> Opens an existing file; its content stays.
    integer(c_int) function c_open_to_write(name) bind(c, name="platform_gestell_open_to_write")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_open_to_write

    !> Opens a new file, or empties an existing one. The user's umask restricts who may use the file.
    integer(c_int) function c_create(name) bind(c, name="platform_gestell_create")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_create

    !> Returns 0 if the file could be closed.
    integer(c_int) function c_close(handle) bind(c, name="platform_gestell_close")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: handle
    end function c_close

    !> Reads at most `length` bytes. `position` counts from 0; if it is negative, reading continues after the last byte read.
    !> Returns the number of bytes read, which is 0 at the end of the file; -1 if reading fails.
    integer(c_int64_t) function c_read(handle, into, length, position) bind(c, name="platform_gestell_read")
      import :: c_char, c_int, c_int64_t
      implicit none (type, external)
      integer(c_int), value :: handle
      ! allow(C072)
      character(kind=c_char), intent(inout) :: into(*)
      integer(c_int64_t), value :: length
      integer(c_int64_t), value :: position
    end function c_read

    !> Writes at most `length` bytes, with `position` as in `c_read`. Returns the number of bytes written; -1 if writing fails.
    integer(c_int64_t) function c_write(handle, bytes, length, position) bind(c, name="platform_gestell_write")
      import :: c_char, c_int, c_int64_t
      implicit none (type, external)
      integer(c_int), value :: handle
      character(kind=c_char), intent(in) :: bytes(*)
      integer(c_int64_t), value :: length
      integer(c_int64_t), value :: position
    end function c_write

    !> Locks an open file. Returns 0 if this process now has the lock, 1 if another process has it, and -1 if the file system has no
    !> locks: then nothing is locked.
    integer(c_int) function c_lock(handle, shared, wait) bind(c, name="platform_gestell_lock")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: handle
      integer(c_int), value :: shared
      integer(c_int), value :: wait
    end function c_lock

    !> Renames a file and replaces an existing file `new` in one step. Windows: fails while another program uses `new`.
    integer(c_int) function c_rename(old, new) bind(c, name="platform_gestell_rename")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: old(*)
      character(kind=c_char), intent(in) :: new(*)
    end function c_rename

    !> Gives a file a second name (hard link). Fails on file systems without hard links, such as FAT.
    integer(c_int) function c_link(old, new) bind(c, name="platform_gestell_link")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: old(*)
      character(kind=c_char), intent(in) :: new(*)
    end function c_link

    !> Returns 0 if no file of this name exists afterwards.
    integer(c_int) function c_remove_file(name) bind(c, name="platform_gestell_remove_file")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_remove_file

    !> Returns 0 if the folder was created, 1 if a file or folder of this name exists already, otherwise -1.
    integer(c_int) function c_make_folder(name) bind(c, name="platform_gestell_make_folder")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_make_folder

    !> Removes an empty folder. Returns 0 if it was removed.
    integer(c_int) function c_remove_folder(name) bind(c, name="platform_gestell_remove_folder")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
    end function c_remove_folder

    !> Writes the system's explanation why the last call failed to `text`, and returns its length.
    integer(c_int) function c_message(text, room) bind(c, name="platform_gestell_message")
      import :: c_char, c_int
      implicit none (type, external)
      ! allow(C072)
      character(kind=c_char), intent(inout) :: text(*)
      integer(c_int), value :: room
    end function c_message

    !> 1 if `handle` is a terminal, otherwise 0.
    integer(c_int) function c_is_terminal(handle) bind(c, name="platform_gestell_is_terminal")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: handle
    end function c_is_terminal

    !> Limit of the program's stack in bytes; -1 if there is none. Windows: -1, because the stack is set when the program is linked.
    integer(c_int64_t) function c_stack_limit() bind(c, name="platform_gestell_stack_limit")
      import :: c_int64_t
      implicit none (type, external)
    end function c_stack_limit

    !> Prevents two signals from ending the program, so that it can report an error instead. One signal means that a file exceeds
    !> the limit of ulimit -f, the other that nobody reads from a pipe. Also opens each closed standard stream on /dev/null for
    !> reading, so that no result file receives the number of the stream. Writing to such a stream then fails. Windows has no such
    !> signals and does not reuse the numbers: there this function does nothing.
    subroutine c_prepare() bind(c, name="platform_gestell_prepare")
      implicit none (type, external)
    end subroutine c_prepare

    !> Converts a word of the command line to UTF-8 and returns its length. POSIX systems: copies it. Windows: converts it from the
    !> code page of the system, in which letters of other languages are question marks.
    integer(c_int) function c_decode(name, text, room) bind(c, name="platform_gestell_decode")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
      ! allow(C072)
      character(kind=c_char), intent(inout) :: text(*)
      integer(c_int), value :: room
    end function c_decode

    !> Function of the C library: number of bytes before the zero byte.
    integer(c_size_t) function c_strlen(words) bind(c, name="strlen")
      import :: c_ptr, c_size_t
      implicit none (type, external)
      type(c_ptr), value :: words
    end function c_strlen

    !> Function of the C library: ends the program with an exit code, after all files are closed.
    subroutine c_exit(code) bind(c, name="exit")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: code
    end subroutine c_exit
  end interface

end module gestell_base_platform
