!> Defines the kind of real numbers and the constant pi for the whole library.
module gestell_base_kinds
  use, intrinsic :: iso_fortran_env, only: real64
  implicit none (type, external)
  private

  !> Kind of the real numbers in the library: double precision.
  integer, parameter, public :: dp = real64

  real(dp), parameter, public :: pi = acos(-1.0_dp)

end module gestell_base_kinds
