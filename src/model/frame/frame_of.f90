!> Finds the frame that a periodic system represents.
module gestell_model_frame_frame_of
  use gestell_model_frame, only: frame_type
  use gestell_system_averaged, only: averaged_system
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: frame_of

contains

  !> Pointer to the frame if `system` is a frame or the averaged model of a frame; null for all other systems.
  function frame_of(system) result(frame)
    class(periodic_system), intent(in), target :: system
    class(frame_type), pointer :: frame

    frame => null()
    select type (system)
    class is (frame_type)
      frame => system
    class is (averaged_system)
      select type (whole => system%whole)
      class is (frame_type)
        frame => whole
      end select
    end select
  end function frame_of

end module gestell_model_frame_frame_of
