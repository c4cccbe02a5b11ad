!> Defines the kind of real numbers, and constants, for the whole library.
module gestell_base_kinds
  use, intrinsic :: iso_fortran_env, only: real64
  implicit none (type, external)
  private

  !> Kind of all real numbers in the library.
  integer, parameter, public :: dp = real64

  real(dp), parameter, public :: pi = acos(-1.0_dp)

end module gestell_base_kinds
