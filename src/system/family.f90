!> A family of systems that depends on a few parameters: what a sweep or a border is about.
module gestell_system_family
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: take_member

  type, abstract, public :: family_type
  contains
    procedure(member_at), deferred :: member
    procedure :: shares_mechanism => not_known
  end type family_type

  abstract interface
    !> The system at these parameters, shape (number of parameters). Called from one thread at a time.
    !> Errors: `impossible_mechanism` where the parameters allow no assembly; `invalid_input` where they make no sense;
    !> `failed_computation` where no vibration was found that the system is about.
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

  !> Whether the mechanism is the same in all members that are frames: not unless a family says so.
  pure logical function not_known(self)
    class(family_type), intent(in) :: self

    associate (unused => self)
    end associate
    not_known = .false.
  end function not_known

  !> The member of `family` at these parameters: all studies come through here. Errors: its own; there is no system, or one whose
  !> components make no sense.
  subroutine take_member(family, parameters, system, error)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error

    call family%member(parameters, system, error)
    if (allocated(error)) return
    if (allocated(system)) then
      call system%check(error)
    else
      call fatal_error(error, "the family has neither a system nor an error to give", invalid_input)
    end if
  end subroutine take_member

end module gestell_system_family
