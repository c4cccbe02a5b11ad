!> A family whose members several threads may ask for. They are made one after the other, as reading documents is for one thread;
!> each thread settles its own by the frame's model.
module gestell_task_locked_family
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_study_family, only: family_type
  use gestell_study_frame_model, only: settle_member
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  type, extends(family_type), public :: locked_family_type
    class(family_type), allocatable :: inner
    character(len=11) :: model = "exact"
    type(accuracy_type) :: accuracy
  contains
    procedure :: member
  end type locked_family_type

contains

  subroutine member(self, parameters, system, error)
    class(locked_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error

    ! the same lock as for writing: reading is for one thread
    !$omp critical (input_and_output)
    call self%inner%member(parameters, system, error)
    !$omp end critical (input_and_output)
    if (.not. allocated(error)) call settle_member(system, trim(self%model), self%accuracy, error)
  end subroutine member

end module gestell_task_locked_family
