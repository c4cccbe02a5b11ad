!> All files state the same version.
module test_version
  use gestell_base_version, only: version
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_version

  character, parameter :: nl = new_line("a")

contains

  subroutine collect_version(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("fpm.toml states the library's version", test_manifest), &
      & new_unittest("CITATION.cff states the library's version", test_citation), &
      & new_unittest("CHANGELOG.md has an entry for the library's version", test_changelog), &
      & new_unittest("the manual page states the library's version", test_man_page), &
      & new_unittest("the page on C requests the library's version from find_package", test_page)]
  end subroutine collect_version

  !> CMake, Meson and the Python package read the version from fpm.toml.
  subroutine test_manifest(error)
    type(error_type), allocatable, intent(out) :: error

    call expect(error, "fpm.toml", nl // 'version = "' // version // '"' // nl)
  end subroutine test_manifest

  subroutine test_citation(error)
    type(error_type), allocatable, intent(out) :: error

    call expect(error, "CITATION.cff", nl // "version: " // version // nl)
  end subroutine test_citation

  !> The changelog has a section on the version, and below it the date of CITATION.cff.
  subroutine test_changelog(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: key = nl // "date-released: "
    character(len=:), allocatable :: citation
    integer :: at

    citation = text_of("CITATION.cff")
    at = index(citation, key)
    call check(error, at > 0, more="CITATION.cff has no date-released")
    if (allocated(error)) return
    at = at + len(key)
    call expect(error, "CHANGELOG.md", nl // "## [" // version // "] - " // citation(at:min(at + 9, len(citation))) // nl)
  end subroutine test_changelog

  subroutine test_man_page(error)
    type(error_type), allocatable, intent(out) :: error

    call expect(error, "share/man/man1/gestell.1", '"gestell ' // version // '"')
  end subroutine test_man_page

  !> The version that a CMake project is told to request has the same major number; any other is refused.
  subroutine test_page(error)
    type(error_type), allocatable, intent(out) :: error

    call expect(error, "doc/c.md", "find_package(gestell " // version(:index(version, ".")))
  end subroutine test_page

  !> Checks that the file contains `text`; a new line at its beginning or end stands for the beginning or end of a line.
  subroutine expect(error, file, text)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), intent(in) :: file, text

    call check(error, index(text_of(file), text) > 0, more=file // " has not " // text)
  end subroutine expect

  !> The contents of a file, after a new line; fpm runs tests in the project's folder.
  function text_of(file) result(text)
    character(len=*), intent(in) :: file
    character(len=:), allocatable :: text
    integer :: unit, status, bytes

    text = nl
    open (newunit=unit, file=file, action="read", status="old", access="stream", iostat=status)
    if (status /= 0) return
    inquire (unit=unit, size=bytes)
    deallocate (text)
    allocate (character(len=bytes + 1) :: text)
    text(1:1) = nl
    read (unit, iostat=status) text(2:)
    close (unit)
    if (status /= 0) text = nl
  end function text_of

end module test_version
