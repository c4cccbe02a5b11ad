!> Compares paths of files and completes them to absolute paths (POSIX). File names must not end with blanks.
module gestell_base_paths
  use gestell_base_files, only: copy_text
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_intptr_t, c_null_char, c_ptr, c_size_t
  implicit none (type, external)
  private

  public :: full_path, is_link, is_same_file

  !> `longest_path`: maximum length of a path (PATH_MAX). `stat_bytes`: size of a buffer for the C structure stat.
  !> `identity_bytes`: number of bytes at the beginning of this structure that identify a file by device and inode (on macOS they
  !> also hold mode and number of links).
  integer, parameter :: longest_path = 4096, stat_bytes = 1024, identity_bytes = 16

  interface
    integer(c_int) function c_stat(path, status) bind(c, name="stat")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      ! allow(C072)
      character(kind=c_char), intent(inout) :: status(*)
    end function c_stat

    integer(c_intptr_t) function c_readlink(path, target, room) bind(c, name="readlink")
      import :: c_char, c_intptr_t, c_size_t
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      ! allow(C072)
      character(kind=c_char), intent(inout) :: target(*)
      integer(c_size_t), value :: room
    end function c_readlink

    type(c_ptr) function c_realpath(path, full) bind(c, name="realpath")
      import :: c_char, c_ptr
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      ! allow(C072)
      character(kind=c_char), intent(inout) :: full(*)
    end function c_realpath
  end interface

contains

  !> True if `name` is a symbolic link, even if the file to which it points does not exist.
  logical function is_link(name)
    character(len=*), intent(in) :: name
    character(kind=c_char) :: target(1)

    is_link = c_readlink(name // c_null_char, target, 1_c_size_t) >= 0
  end function is_link

  !> True if `one` and `another` denote the same existing file, after symbolic links have been followed.
  logical function is_same_file(one, another)
    character(len=*), intent(in) :: one, another
    character(kind=c_char) :: status(stat_bytes, 2)

    is_same_file = .false.
    if (c_stat(one // c_null_char, status(:, 1)) /= 0) return
    if (c_stat(another // c_null_char, status(:, 2)) /= 0) return
    is_same_file = all(status(:identity_bytes, 1) == status(:identity_bytes, 2))
  end function is_same_file

  !> Absolute path of a file, with all symbolic links replaced by their targets. The path stays valid if the working directory
  !> changes. Returns `name` itself if the file does not exist.
  function full_path(name) result(path)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: path
    character(kind=c_char), target :: letters(longest_path)
    type(c_ptr) :: full

    path = name
    full = c_realpath(name // c_null_char, letters)
    if (c_associated(full)) call copy_text(full, path)
  end function full_path

end module gestell_base_paths
