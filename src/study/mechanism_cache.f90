!> Lets many variants of a frame share one table of the mechanism's functions.
module gestell_study_mechanism_cache
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_period_map, only: end_of_block
  use gestell_floquet_integrator_method, only: method_type
  use gestell_model_frame, only: frame_type
  use gestell_model_mechanism, only: mechanism_type
  implicit none (type, external)
  private

  public :: swap_mechanisms, cache_mechanism

contains

  !> Tabulates the frame's mechanism at all phases at which the integration `method` evaluates it, if its steps end at `nodes`
  !> (gestell_floquet_integrator_mesh). The frame can then be solved repeatedly with these steps without evaluating its mechanism
  !> again. The table stays valid for any mass, inertia, origin, stiffness and damping, and for any speed of the same sign.
  subroutine cache_mechanism(frame, method, nodes)
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
  end subroutine cache_mechanism

  !> Exchanges the mechanisms of two frames. The mechanisms must be equal except for their tables.
  subroutine swap_mechanisms(one, other)
    class(frame_type), intent(inout) :: one, other
    class(mechanism_type), allocatable :: own

    call move_alloc(one%mechanism, own)
    call move_alloc(other%mechanism, one%mechanism)
    call move_alloc(own, other%mechanism)
  end subroutine swap_mechanisms

end module gestell_study_mechanism_cache
