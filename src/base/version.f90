!> Defines the version number of the library; no other part of the code contains it. A test compares it with fpm.toml, CITATION.cff,
!> CHANGELOG.md and the man page.
module gestell_base_version
  implicit none (type, external)
  private

  character(len=*), parameter, public :: version = "1.0.0"

end module gestell_base_version
