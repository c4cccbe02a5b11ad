!> A family derived from another family: a model of the frame is applied to each of its members.
module gestell_study_frame_model_settled_family
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_system_family, only: family_type
  use gestell_study_frame_model, only: settle_member
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  !> A family that applies `model` to each member of the family `inner`.
  type, extends(family_type), public :: settled_family_type
    !> The family to whose members the model is applied
    class(family_type), allocatable :: inner
    !> The model of the frame to apply (see `settle_member`)
    character(len=11) :: model = "exact"
    type(accuracy_type) :: accuracy
  contains
    procedure :: member, inner_member
  end type settled_family_type

contains

  !> Creates a member of the family `inner` and applies `model` to it. Fails if the member cannot be created, or if `settle_member`
  !> fails.
  subroutine member(self, parameters, system, error)
    class(settled_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error

    call self%inner_member(parameters, system, error)
    if (.not. allocated(error)) call settle_member(system, trim(self%model), self%accuracy, error)
  end subroutine member

  !> Returns the member of the inner family without the model. Fails if the inner family fails.
  subroutine inner_member(self, parameters, system, error)
    class(settled_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error

    call self%inner%member(parameters, system, error)
  end subroutine inner_member

end module gestell_study_frame_model_settled_family
