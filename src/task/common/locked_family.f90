!> A family of machines from which several threads may request members. Members are created one at a time, because only one thread
!> at a time may read documents. Each thread then applies the model of the frame to its own member.
module gestell_task_common_locked_family
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_frame_model_settled_family, only: settled_family_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  !> Family of machines from which several threads may request members at the same time.
  type, extends(settled_family_type), public :: locked_family_type
  contains
    procedure :: inner_member
  end type locked_family_type

contains

  !> Creates the member with these parameters; other threads wait meanwhile.
  subroutine inner_member(self, parameters, system, error)
    class(locked_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error

    ! The lock is the one for writing, because reading and writing must not overlap.
    !$omp critical (input_and_output)
    call self%settled_family_type%inner_member(parameters, system, error)
    !$omp end critical (input_and_output)
  end subroutine inner_member

end module gestell_task_common_locked_family
