!> One table of the mechanism for many cases.
module gestell_study_table
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_period_map, only: end_of_block
  use gestell_floquet_integrator_method, only: method_type
  use gestell_model_frame, only: frame_type
  use gestell_model_mechanism, only: mechanism_type
  implicit none (type, external)
  private

  public :: exchange_mechanisms, remember_mechanism

contains

  !> Tabulates the frame's mechanism where `method` samples it between `nodes` (gestell_floquet_integrator_mesh) in `period_map`.
  !> Then the frame may be solved with these nodes for any speed of the same sign, mass, inertia, origin, stiffness and damping
  !> without evaluating its mechanism again.
  subroutine remember_mechanism(frame, method, nodes)
    type(frame_type), intent(inout) :: frame
    class(method_type), intent(in) :: method
    real(dp), intent(in) :: nodes(:)
    integer :: first, last

    last = 0
    do while (last < size(nodes) - 1)
      first = last + 1
      last = end_of_block(first, size(nodes) - 1)
      call frame%remember(method%phases(nodes(first:last), nodes(first + 1:last + 1)))
    end do
  end subroutine remember_mechanism

  !> Two frames take each other's mechanism, which is the same but for what it remembers.
  pure subroutine exchange_mechanisms(one, other)
    class(frame_type), intent(inout) :: one, other
    class(mechanism_type), allocatable :: own

    call move_alloc(one%mechanism, own)
    call move_alloc(other%mechanism, one%mechanism)
    call move_alloc(own, other%mechanism)
  end subroutine exchange_mechanisms

end module gestell_study_table
