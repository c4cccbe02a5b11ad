!> A family of systems that depends on a few parameters. Sweeps and stability boundaries are computed for a family.
module gestell_system_family
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: create_member

  !> Base type of all families. An extension provides the procedure `member`.
  type, abstract, public :: family_type
  contains
    procedure(member_at), deferred :: member
    procedure :: shares_mechanism => no_shared_mechanism
  end type family_type

  abstract interface
    !> Creates the system at these parameters, shape (number of parameters). At any time only one thread calls this procedure.
    !> `error` has one of three codes. `impossible_mechanism`: the mechanism cannot be assembled. `invalid_input`: the parameters
    !> are invalid. `failed_computation`: the vibration about which the system is linearised cannot be computed.
    subroutine member_at(self, parameters, system, error)
      import :: dp, error_type, family_type, periodic_system
      implicit none (type, external)
      class(family_type), intent(in) :: self
      real(dp), intent(in) :: parameters(:)
      class(periodic_system), allocatable, intent(out) :: system
      type(error_type), allocatable, intent(out) :: error
    end subroutine member_at
  end interface

contains

  !> True if all members of the family that are frames have the same mechanism. False unless an extension overrides this function.
  pure logical function no_shared_mechanism(self)
    class(family_type), intent(in) :: self

    associate (unused => self)
    end associate
    no_shared_mechanism = .false.
  end function no_shared_mechanism

  !> Returns the member of `family` at these parameters after checking it. All studies obtain their systems through this procedure.
  !> Fails if `member` of the family fails or returns no system, or if the system is invalid.
  subroutine create_member(family, parameters, system, error)
    class(family_type), intent(in) :: family
    !> Parameters, shape (number of parameters)
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error

    call family%member(parameters, system, error)
    if (allocated(error)) return
    if (allocated(system)) then
      call system%check(error)
    else
      call fatal_error(error, "the procedure `member` of the family returned neither a system nor an error", invalid_input)
    end if
  end subroutine create_member

end module gestell_system_family
