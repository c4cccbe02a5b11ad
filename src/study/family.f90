!> A family of systems that depends on a few parameters: what a sweep or a border is about.
module gestell_study_family
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  type, abstract, public :: family_type
  contains
    procedure(member_at), deferred :: member
  end type family_type

  abstract interface
    !> The system at these parameters, shape (number of parameters). Called from one thread at a time.
    !> Errors: `impossible_mechanism` where the parameters allow no assembly; `invalid_input` where they make no sense.
    subroutine member_at(self, parameters, system, error)
      import :: dp, error_type, family_type, periodic_system
      implicit none (type, external)
      class(family_type), intent(in) :: self
      real(dp), intent(in) :: parameters(:)
      class(periodic_system), allocatable, intent(out) :: system
      type(error_type), allocatable, intent(out) :: error
    end subroutine member_at
  end interface

end module gestell_study_family
