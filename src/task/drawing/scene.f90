!> Builds the scene of a machine that moves: its frame on the mounts, and its mechanism in the frame.
module gestell_task_drawing_scene
  use gestell_base_kinds, only: dp, pi
  use gestell_math_rotation, only: cross
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_diagram, only: diagram_type, slider_type, trace_diagram
  use gestell_model_mechanism, only: mechanism_type
  use gestell_model_mounting, only: in_frame, support_type
  use gestell_model_quantity_rows, only: probe_type
  use gestell_output_picture_scene, only: bar, block, center, ground, guide, new_scene, outline, pin, probe, scene_type, spring, &
    & view_type
  use gestell_task_drawing_elements, only: link_colour
  use gestell_task_drawing_mounts, only: clear, draw_mount, drawing_type, hull => outline
  use gestell_task_drawing_placed, only: place_in_space, placed_type, point_in_space
  implicit none (type, external)
  private

  public :: build_scene

  !> The views of a machine in space
  type(view_type), parameter :: in_space(3) = [view_type("from the front", 1, 2, .false.), &
    & view_type("from the left", 3, 2, .false.), view_type("from above", 1, 3, .true.)]

contains

  !> Builds the scene of a frame and its mechanism. A mechanism that is no linkage is not drawn.
  subroutine build_scene(frame, mechanism, probes, angles, motion, scene)
    class(frame_type), intent(in) :: frame
    class(mechanism_type), intent(in) :: mechanism
    type(probe_type), intent(in) :: probes(:)
    !> Angle of the mechanism at each instant (rad), and the frame's displacements and rotations, shape (dofs, instants)
    real(dp), intent(in) :: angles(:), motion(:, :)
    type(scene_type), intent(out) :: scene
    type(diagram_type) :: diagram
    type(linkage_type) :: linkage
    real(dp), allocatable :: moving(:, :, :), points(:, :)
    real(dp) :: low(3), high(3), extent, rigid(6, size(angles)), mount
    integer, allocatable :: fixed(:)
    integer :: i, joints, links, sliders

    select type (mechanism)
    type is (linkage_type)
      linkage = mechanism
      call trace_diagram(linkage, angles, diagram)
    class default
      allocate(linkage%joints(0), linkage%links(0), diagram%bars(0), diagram%sliders(0), diagram%grounded(0))
      allocate(diagram%joints(2, 0, size(angles)), diagram%centers(2, 0, size(angles)))
    end select
    joints = size(linkage%joints)
    links = size(linkage%links)
    sliders = size(diagram%sliders)
    rigid = 0
    if (frame%dofs() > 3) rigid = motion(in_frame, :)
    if (frame%dofs() == 3) rigid([1, 2, 6], :) = motion
    points = points_of_frame(frame, probes)
    ! first without sliders, whose symbols are scaled to the size of the picture
    moving = moving_points(frame, linkage, diagram, 0.0_dp)
    do i = 1, 3
      low(i) = min(minval(points(i, :)), minval(moving(i, :, :)))
      high(i) = max(maxval(points(i, :)), maxval(moving(i, :, :)))
    end do
    extent = maxval(high - low)
    if (.not. extent > 0) extent = 1
    moving = moving_points(frame, linkage, diagram, 0.05_dp * extent)
    if (frame%dofs() > 3) then
      scene = new_scene(in_space, moving, rigid, angles * 180 / pi)
    else
      scene = new_scene([view_type()], moving, rigid, angles * 180 / pi)
    end if

    ! joints on the frame, and ends of the guides on the frame
    fixed = pack([(i, i = 1, joints)], diagram%grounded)
    do i = 1, sliders
      if (.not. any(diagram%sliders(i)%guide%carriers > 0)) fixed = [fixed, joints + links + 4 * i + [-3, -2]]
    end do
    call add_outlines(scene, reshape([points, moving(:, fixed, 1)], [3, size(points, 2) + size(fixed)]), 0.025_dp * extent)
    mount = 0.12_dp * extent
    do i = 1, size(frame%supports)
      if (frame%dofs() > 3) then
        call add_springs(scene, frame%supports(i), mount)
      else
        call add_mount(scene, frame%supports(i), (low(:2) + high(:2)) / 2, mount)
      end if
    end do
    do i = 1, sliders
      call scene%add_moving(guide, joints + links + 4 * i + [-3, -2])
    end do
    do i = 1, links
      if (linkage%links(i)%to == 0 .and. norm2(linkage%links(i)%center) > 0) call scene%add_moving(bar, [linkage%links(i)%from, &
        & joints + i], link_colour(linkage, i))
    end do
    do i = 1, size(diagram%bars)
      associate (rod => diagram%bars(i))
        if (rod%slides) then
          call scene%add_moving(guide, rod%joints)
        else
          call scene%add_moving(bar, rod%joints, link_colour(linkage, rod%link))
        end if
      end associate
    end do
    do i = 1, sliders
      call scene%add_moving(block, joints + links + 4 * i + [-1, 0])
    end do
    do i = 1, links
      call scene%add_moving(center, [joints + i], link_colour(linkage, i))
    end do
    do i = 1, joints
      call scene%add_moving(pin, [i])
    end do
    do i = 1, size(probes)
      call scene%add_line(probe, reshape([probes(i)%position, probes(i)%z], [3, 1]), [1.0_dp])
    end do
    scene%extent = extent
  end subroutine build_scene

  !> Points of the frame (m), shape (3, points): F, supports and probes.
  pure function points_of_frame(frame, probes) result(points)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    real(dp) :: points(3, 1 + size(frame%supports) + size(probes))
    integer :: i

    points = reshape([0.0_dp, 0.0_dp, 0.0_dp, (frame%supports(i)%position, i = 1, size(frame%supports)), &
      & (probes(i)%position, probes(i)%z, i = 1, size(probes))], shape(points))
  end function points_of_frame

  !> Positions relative to the frame (m) of all joints, of the links' centres of mass, and of four points for each slider: the ends
  !> of its guide, and the ends of its block, which has this `length` (m). Shape (3, points, instants).
  function moving_points(frame, linkage, diagram, length) result(points)
    class(frame_type), intent(in) :: frame
    class(linkage_type), intent(in) :: linkage
    type(diagram_type), intent(in) :: diagram
    real(dp), intent(in) :: length
    real(dp), allocatable :: points(:, :, :)
    type(placed_type) :: placed
    real(dp) :: ends(2, 4)
    integer :: i, j, k, n, sliders

    sliders = size(diagram%sliders)
    n = size(diagram%joints, 2) + size(diagram%centers, 2)
    allocate(points(3, n + 4 * sliders, size(diagram%joints, 3)), source=0.0_dp)
    if (n == 0) return
    if (frame%dofs() > 3) then
      call place_in_space(frame, linkage, diagram, placed)
      points(:, :size(diagram%joints, 2), :) = placed%joints
      points(:, size(diagram%joints, 2) + 1:n, :) = placed%centers
    else
      do i = 1, 2
        points(i, :size(diagram%joints, 2), :) = frame%origin(i) + diagram%joints(i, :, :)
        points(i, size(diagram%joints, 2) + 1:n, :) = frame%origin(i) + diagram%centers(i, :, :)
      end do
    end if
    do k = 1, size(points, 3)
      do i = 1, sliders
        associate (slider => diagram%sliders(i))
          ends = ends_of(slider, diagram%joints(:, :, k), length)
          do j = 1, 4
            if (frame%dofs() > 3) then
              points(:, n + 4 * (i - 1) + j, k) = point_in_space(frame, placed%plane(slider%joint), &
                & [ends(:, j), placed%z(slider%joint)])
            else
              points(:2, n + 4 * (i - 1) + j, k) = frame%origin + ends(:, j)
            end if
          end do
        end associate
      end do
    end do
  end function moving_points

  !> Ends of a slider's guide and of its block, in the plane of the mechanism (m), shape (2, 4).
  pure function ends_of(slider, joints, length) result(ends)
    type(slider_type), intent(in) :: slider
    real(dp), intent(in) :: joints(:, :), length
    real(dp) :: ends(2, 4), along(2), from(2), axis(2)

    along = [cos(slider%guide%angle), sin(slider%guide%angle)]
    from = slider%guide%point
    if (any(slider%guide%carriers > 0)) then
      associate (start => joints(:, slider%guide%carriers(1)), to => joints(:, slider%guide%carriers(2)))
        axis = (to - start) / norm2(to - start)
        along = turned(along)
        from = start + turned(from)
      end associate
    end if
    ends(:, 1) = from + (slider%travel(1) - length) * along
    ends(:, 2) = from + (slider%travel(2) + length) * along
    ends(:, 3) = joints(:, slider%joint) - length / 2 * along
    ends(:, 4) = joints(:, slider%joint) + length / 2 * along

  contains

    !> Copy of a vector that is turned like the first axis to the direction `axis`.
    pure function turned(vector)
      real(dp), intent(in) :: vector(2)
      real(dp) :: turned(2)

      turned = [axis(1) * vector(1) - axis(2) * vector(2), axis(2) * vector(1) + axis(1) * vector(2)]
    end function turned

  end function ends_of

  !> Adds the outline of the frame around its `points`, shape (3, points), at this `distance` from them: one for each view.
  subroutine add_outlines(scene, points, distance)
    type(scene_type), intent(inout) :: scene
    real(dp), intent(in) :: points(:, :), distance
    real(dp), allocatable :: corners(:, :), in_space(:, :)
    integer :: i, view

    do view = 1, size(scene%views)
      associate (axes => [scene%views(view)%right, scene%views(view)%upward])
        corners = hull(points(axes, :), distance)
        in_space = spread(sum(points, dim=2) / size(points, 2), 2, size(corners, 2))
        in_space(axes, :) = corners
      end associate
      call scene%add_line(outline, in_space, [(1.0_dp, i = 1, size(corners, 2))])
      scene%lines(size(scene%lines))%view = merge(view, 0, size(scene%views) > 1)
    end do
  end subroutine add_outlines

  !> Adds springs, dampers and the ground of a support in the plane.
  subroutine add_mount(scene, support, middle, length)
    type(scene_type), intent(inout) :: scene
    type(support_type), intent(in) :: support
    !> `middle`: centre of the machine (m). `length`: length of the symbol (m)
    real(dp), intent(in) :: middle(2), length
    type(drawing_type) :: drawings(2)
    integer :: i, k, from

    call clear(drawings(1))
    call clear(drawings(2))
    call draw_mount(drawings(1), drawings(2), support, middle, length)
    do k = 1, 2
      from = 1
      do i = 1, size(drawings(k)%ends)
        associate (drawing => drawings(k), to => drawings(k)%ends(i))
          call scene%add_line(merge(spring, ground, any(drawing%share(from:to) > 0)), drawing%points(:, from:to), &
            & drawing%share(from:to))
          from = to + 1
        end associate
      end do
    end do
  end subroutine add_mount

  !> Adds the springs of a support in space, which point away from F.
  subroutine add_springs(scene, support, length)
    type(scene_type), intent(inout) :: scene
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: length
    integer, parameter :: turns = 6
    real(dp) :: along(3), across(3), points(3, turns + 4), share(turns + 4)
    integer :: axis, i

    do axis = 1, 3
      if (.not. (support%stiffness(axis) > 0 .or. support%damping(axis) > 0)) cycle
      along = support%axes(:, axis)
      if (dot_product(along, support%position) < 0) along = -along
      ! a direction across the spring that no view shows as a point
      across = cross(along, [0.5_dp, 0.7_dp, -0.6_dp])
      across = across / norm2(across)
      share = [1.0_dp, 0.8_dp, (0.8_dp - 0.6_dp * (i - 0.5_dp) / turns, i = 1, turns), 0.2_dp, 0.0_dp]
      points = spread(support%position, 2, turns + 4) + length * (spread(along, 2, turns + 4) * spread(1 - share, 1, 3) &
        & + spread(across, 2, turns + 4) * spread([0.0_dp, 0.0_dp, (0.1_dp * (-1)**i, i = 1, turns), 0.0_dp, 0.0_dp], 1, 3))
      call scene%add_line(spring, points, share)
      call scene%add_line(ground, spread(points(:, turns + 4), 2, 2) + 0.15_dp * length * reshape([across, -across], [3, 2]), &
        & [0.0_dp, 0.0_dp])
    end do
  end subroutine add_springs

end module gestell_task_drawing_scene
