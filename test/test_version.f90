!> The version is the same wherever it stands.
module test_version
  use gestell_base_version, only: version
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_version

contains

  subroutine collect_version(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("fpm.toml", test_manifest), &
      & new_unittest("CITATION.cff", test_citation), &
      & new_unittest("CHANGELOG.md", test_changelog)]
  end subroutine collect_version

  subroutine test_manifest(error)
    type(error_type), allocatable, intent(out) :: error

    call check(error, has_line("fpm.toml", 'version = "' // version // '"'), more="fpm.toml has not " // version)
  end subroutine test_manifest

  subroutine test_citation(error)
    type(error_type), allocatable, intent(out) :: error

    call check(error, has_line("CITATION.cff", "version: " // version), more="CITATION.cff has not " // version)
  end subroutine test_citation

  subroutine test_changelog(error)
    type(error_type), allocatable, intent(out) :: error

    call check(error, has_line("CHANGELOG.md", "## [" // version // "]"), more="CHANGELOG.md has not " // version)
  end subroutine test_changelog

  !> Whether a line of the file begins with `line`; fpm runs tests in the project's folder.
  logical function has_line(file, line)
    character(len=*), intent(in) :: file, line
    character(len=200) :: buffer
    integer :: unit, status

    has_line = .false.
    open (newunit=unit, file=file, action="read", status="old", iostat=status)
    do while (status == 0 .and. .not. has_line)
      read (unit, "(a)", iostat=status) buffer
      if (status == 0) has_line = index(buffer, line) == 1
    end do
    close (unit)
  end function has_line

end module test_version
