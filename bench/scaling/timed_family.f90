!> A family whose calls are timed.
module timed_family
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_system_family, only: family_type
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: seconds_now

  type, public :: tally_type
    integer :: calls = 0
    real(dp) :: seconds = 0
  end type tally_type

  type, extends(family_type), public :: timed_family_type
    class(family_type), allocatable :: inner
    type(tally_type), pointer :: tally => null()
  contains
    procedure :: member
  end type timed_family_type

contains

  subroutine member(self, parameters, system, error)
    class(timed_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: begin

    begin = seconds_now()
    call self%inner%member(parameters, system, error)
    self%tally%calls = self%tally%calls + 1
    self%tally%seconds = self%tally%seconds + seconds_now() - begin
  end subroutine member

  real(dp) function seconds_now()
    integer(int64) :: count, rate

    call system_clock(count, rate)
    seconds_now = real(count, dp) / rate
  end function seconds_now

end module timed_family
