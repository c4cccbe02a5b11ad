!> Compares paths of files and completes them to absolute paths. File names must not end with blanks.
module gestell_base_paths
  use gestell_base_platform, only: c_decode, c_full_path, c_is_link, c_is_same, c_is_windows
  use, intrinsic :: iso_c_binding, only: c_int, c_null_char
  implicit none (type, external)
  private

  public :: decode_word, find_full_path, is_absolute, is_link, is_same_file, use_slashes

  !> Maximum length of an absolute path in bytes
  integer, parameter :: longest_path = 32768

contains

  !> True if `name` is a symbolic link, even if the file to which it points does not exist.
  logical function is_link(name)
    character(len=*), intent(in) :: name

    is_link = c_is_link(name // c_null_char) /= 0
  end function is_link

  !> True if `one` and `another` denote the same existing file, after symbolic links have been followed.
  logical function is_same_file(one, another)
    character(len=*), intent(in) :: one, another

    is_same_file = c_is_same(one // c_null_char, another // c_null_char) /= 0
  end function is_same_file

  !> Absolute path of a file, with all symbolic links replaced by their targets. The path stays valid if the working directory
  !> changes. Returns `name` itself if the file does not exist.
  subroutine find_full_path(name, path)
    character(len=*), intent(in) :: name
    character(len=:), allocatable, intent(out) :: path
    character(len=:), allocatable :: letters
    integer :: n

    path = name
    allocate(character(len=longest_path) :: letters)
    n = c_full_path(name // c_null_char, letters, len(letters, c_int))
    if (n >= 0) path = letters(:n)
  end subroutine find_full_path

  !> True if a path does not depend on the working directory: /folder/file, and on Windows also C:/folder/file.
  logical function is_absolute(path)
    character(len=*), intent(in) :: path

    is_absolute = index(path, "/") == 1
    if (.not. is_absolute .and. c_is_windows() /= 0) is_absolute = index(path, "\") == 1 .or. index(path, ":") == 2
  end function is_absolute

  !> Replaces each backslash in a path by a slash, which Windows accepts too. On other systems it changes nothing.
  subroutine use_slashes(path)
    ! allow(C072)
    character(len=*), intent(inout) :: path
    integer :: i

    if (c_is_windows() == 0) return
    do i = 1, len(path)
      if (path(i:i) == "\") path(i:i) = "/"
    end do
  end subroutine use_slashes

  !> Converts a word of the command line to UTF-8 (see `c_decode`).
  subroutine decode_word(word)
    character(len=:), allocatable, intent(inout) :: word
    character(len=:), allocatable :: text
    integer :: n

    allocate(character(len=4 * len(word) + 1) :: text)
    n = c_decode(word // c_null_char, text, len(text, c_int))
    word = text(:n)
  end subroutine decode_word

end module gestell_base_paths
