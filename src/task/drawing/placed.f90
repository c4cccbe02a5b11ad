!> Converts the positions in planar mechanisms to positions in space, in order to draw the machine.
module gestell_task_drawing_placed
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_diagram, only: diagram_type
  implicit none (type, external)
  private

  public :: place_in_space, point_in_space

  !> Positions in the frame's axes, measured from F (m). `joints`: shape (3, joints, angles). `centers`: centres of mass, shape (3,
  !> links, angles). `guides`: both ends of each slider's travel, shape (3, 2, sliders). If a slider's guide moves, both ends equal
  !> the slider's first position. `rates`: derivatives of `joints` and `centers` with respect to the crank angle, as in
  !> diagram_type, shape (3, joints + links, angles, 2).
  type, public :: placed_type
    real(dp), allocatable :: joints(:, :, :), centers(:, :, :), guides(:, :, :), rates(:, :, :, :)
    !> Number of the plane of each joint, and the joint's offset from this plane (m)
    integer, allocatable :: plane(:)
    real(dp), allocatable :: z(:)
  end type placed_type

contains

  !> Computes positions in space. All joints of a mechanism get the same offset from its plane, which is the mean offset of its
  !> links. Rotating links that start at the frame may be parts of a shaft and lie anywhere along it. Their offsets are therefore
  !> ignored if the mechanism has rotating links that start at a moving joint.
  subroutine place_in_space(frame, linkage, diagram, placed)
    class(frame_type), intent(in) :: frame
    class(linkage_type), intent(in) :: linkage
    !> Positions of joints and centres of mass in the planes of the mechanisms
    type(diagram_type), intent(in) :: diagram
    type(placed_type), intent(out) :: placed
    integer :: mechanism(size(linkage%joints)), of_point(size(diagram%rates, 2)), i, k, n, order
    real(dp) :: end_point(2)
    logical, dimension(size(linkage%links)) :: own, between

    ! number the mechanisms: joints that are connected by bars get the same number
    mechanism = [(i, i = 1, size(mechanism))]
    do i = 1, size(diagram%bars)
      associate (ends => mechanism(diagram%bars(i)%joints))
        where (mechanism == maxval(ends)) mechanism = minval(ends)
      end associate
    end do
    allocate(placed%plane(size(mechanism)), source=0)
    allocate(placed%z(size(mechanism)), source=0.0_dp)
    do i = 1, size(mechanism)
      own = [(mechanism(linkage%links(k)%from) == mechanism(i), k = 1, size(own))]
      if (.not. any(own)) cycle
      placed%plane(i) = linkage%links(findloc(own, .true., dim=1))%plane
      between = [(own(k) .and. .not. diagram%grounded(linkage%links(k)%from), k = 1, size(own))]
      between = between .and. linkage%links%to > 0
      if (any(between)) own = between
      placed%z(i) = sum(linkage%links%z, mask=own) / count(own)
    end do
    n = size(diagram%joints, 3)
    allocate(placed%joints(3, size(mechanism), n), placed%centers(3, size(linkage%links), n))
    allocate(placed%guides(3, 2, size(diagram%sliders)))
    do k = 1, n
      do i = 1, size(mechanism)
        placed%joints(:, i, k) = point_in_space(frame, placed%plane(i), [diagram%joints(:, i, k), placed%z(i)])
      end do
      do i = 1, size(linkage%links)
        placed%centers(:, i, k) = point_in_space(frame, linkage%links(i)%plane, [diagram%centers(:, i, k), linkage%links(i)%z])
      end do
    end do
    allocate(placed%rates(3, size(of_point), n, 2))
    of_point = [placed%plane, linkage%links%plane]
    do order = 1, 2
      do k = 1, n
        do i = 1, size(of_point)
          placed%rates(:, i, k, order) = vector_in_space(of_point(i), [diagram%rates(:, i, k, order), 0.0_dp])
        end do
      end do
    end do
    do i = 1, size(diagram%sliders)
      associate (slider => diagram%sliders(i))
        do k = 1, 2
          end_point = slider%guide%point + slider%travel(k) * [cos(slider%guide%angle), sin(slider%guide%angle)]
          placed%guides(:, k, i) = point_in_space(frame, placed%plane(slider%joint), [end_point, placed%z(slider%joint)])
          if (any(slider%guide%carriers > 0)) placed%guides(:, k, i) = placed%joints(:, slider%joint, 1)
        end do
      end associate
    end do

  contains

    !> Components along the frame's axes of a vector in the plane that has this `number`.
    pure function vector_in_space(number, vector)
      integer, intent(in) :: number
      real(dp), intent(in) :: vector(3)
      real(dp) :: vector_in_space(3)
      integer :: p

      vector_in_space = vector
      do p = 1, size(frame%space%planes)
        associate (own => frame%space%planes(p))
          if (own%linkage%links(1)%plane == number) vector_in_space = matmul(own%axes, vector)
        end associate
      end do
    end function vector_in_space

  end subroutine place_in_space

  !> Position in the frame's axes (m) of a point in the plane that has this `number`.
  pure function point_in_space(frame, number, point)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: number
    real(dp), intent(in) :: point(3)
    real(dp) :: point_in_space(3)
    integer :: p

    point_in_space = frame%space%origin + point
    do p = 1, size(frame%space%planes)
      associate (own => frame%space%planes(p))
        if (own%linkage%links(1)%plane == number) point_in_space = own%origin + matmul(own%axes, point)
      end associate
    end do
  end function point_in_space

end module gestell_task_drawing_placed
