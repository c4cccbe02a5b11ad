!> Builds the scenes of the modes: the frame displaced by each mode shape, with its mounts and its mechanism.
module gestell_task_modes_shapes
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: probe_type
  use gestell_output_picture_scene, only: scene_type
  use gestell_study_mode, only: max_dofs, mode_type
  use gestell_task_drawing_scene, only: build_scene
  implicit none (type, external)
  private

  public :: build_shapes

  !> Number of instants in a period of the mode, and largest displacement of the frame as a part of the machine's size
  integer, parameter :: instants = 24
  real(dp), parameter :: visible = 0.06_dp

contains

  !> Builds a scene for each mode that oscillates, with the mechanism at crank angle 0. At the first instant the largest component
  !> of the mode shape has its maximum. If no mode oscillates, a single scene shows the machine at rest.
  subroutine build_shapes(frame, modes, probes, scenes)
    class(frame_type), intent(in) :: frame
    type(mode_type), intent(in) :: modes(:)
    type(probe_type), intent(in) :: probes(:)
    type(scene_type), allocatable, intent(out) :: scenes(:)
    complex(dp) :: shape(max_dofs)
    real(dp) :: motion(frame%dofs(), 0:instants)
    integer, allocatable :: shown(:)
    integer :: i, k

    shown = pack([(i, i = 1, size(modes))], [(modes(i)%frequency() > 0, i = 1, size(modes))])
    allocate(scenes(max(size(shown), 1)))
    if (size(shown) == 0) then
      motion = 0
      call build_scene(frame, frame%mechanism, probes, [(0.0_dp, k = 0, instants)], motion, scenes(1))
      scenes(1)%name = "no mode oscillates"
    end if
    do i = 1, size(shown)
      associate (mode => modes(shown(i)), scene => scenes(i))
        shape = mode%shape()
        associate (largest => shape(maxloc(abs(shape), dim=1)))
          shape = shape * (abs(largest) / largest)
        end associate
        motion = 0
        do k = 0, instants
          motion(frame%free, k) = real(shape(:size(frame%free)) * exp(cmplx(0.0_dp, 2 * pi * k / instants, dp)))
        end do
        call build_scene(frame, frame%mechanism, probes, [(0.0_dp, k = 0, instants)], motion, scene)
        call scene%scale_motion(visible, rounded=.false.)
        scene%seconds = 2
        scene%name = "mode " // text(i) // ": " // concise(mode%frequency() / (2 * pi), 3) // " Hz, damping " &
          & // concise(100 * mode%damping_ratio(), 2) // " %"
      end associate
    end do
  end subroutine build_shapes

end module gestell_task_modes_shapes
