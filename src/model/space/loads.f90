!> Loads (forces and moments between links, frame and ground) on a frame in space and on its drive.
!>
!> A load against the ground exerts the force F at r relative to F, with the moment r x F + M. Every load exerts the torque Q = F r'
!> + M w on the drive, where r' is the velocity of the body's point at r and w the body's angular velocity, at unit speed of the
!> drive. If the frame rotates by dalpha about the fixed axes, the drive turns by dphi = -b dalpha (gestell_model_space_drive); a
!> load therefore exerts the moment r x F + M - b Q on the frame. `space_load_type` has its vectors along the frame's axes; a
!> rotation matrix R turns them to the fixed axes. A force that keeps its direction in space is along the fixed axes already.
module gestell_model_space_loads
  use gestell_base_kinds, only: dp, pi
  use gestell_math_jet, only: jet
  use gestell_math_rotation, only: cross, cross_matrix, identity, outer
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage_load, only: action_type, frame_body, ground_body, load_action, load_type
  use gestell_model_space_masses, only: plane_type
  implicit none (type, external)
  private

  public :: add_loads, count_loads, find_loads, load_power, load_torque, mean_load_torque

  !> A load at one angle of the drive, along the frame's axes. Element 0: value; element 1: derivative with respect to the angle.
  type, public :: space_load_type
    !> True if the load acts against the ground, and if its force keeps its direction in space.
    logical :: is_grounded = .false., is_fixed = .false.
    !> `point` relative to the frame's centre of mass (m), `velocity` of the body's point there at unit speed of the drive (m),
    !> `force` (N), `moment` (N m)
    real(dp), dimension(3, 0:1) :: point = 0, velocity = 0, force = 0, moment = 0
    !> Torque on the drive (N m); if `is_fixed`, without the part F r'
    real(dp) :: torque(0:1) = 0
  end type space_load_type

contains

  !> Number of loads in all planes.
  pure integer function count_loads(planes)
    type(plane_type), intent(in) :: planes(:)
    integer :: i

    count_loads = 0
    do i = 1, size(planes)
      if (allocated(planes(i)%linkage%loads)) count_loads = count_loads + size(planes(i)%linkage%loads)
    end do
  end function count_loads

  !> Computes all loads at an angle of the drive (rad).
  pure subroutine find_loads(planes, angle, loads)
    type(plane_type), intent(in) :: planes(:)
    real(dp), intent(in) :: angle
    type(space_load_type), intent(out) :: loads(:)
    type(point_type), allocatable :: at(:)
    type(action_type) :: action
    integer :: i, k, n

    n = 0
    do i = 1, size(planes)
      if (count_loads(planes(i:i)) == 0) cycle
      allocate(at(size(planes(i)%linkage%joints)))
      call planes(i)%linkage%points(angle, at)
      do k = 1, size(planes(i)%linkage%loads)
        n = n + 1
        call load_action(planes(i)%linkage%loads(k), planes(i)%linkage%links, at, angle, action)
        call place(planes(i)%linkage%loads(k), action, planes(i), loads(n))
      end do
      deallocate(at)
    end do
  end subroutine find_loads

  !> Converts a load from the axes of its plane to those of the frame. A load on the frame is given in the frame's axes.
  pure subroutine place(load, action, plane, placed)
    type(load_type), intent(in) :: load
    type(action_type), intent(in) :: action
    type(plane_type), intent(in) :: plane
    type(space_load_type), intent(out) :: placed
    real(dp) :: axes(3, 3)

    placed%is_grounded = load%against == ground_body
    placed%is_fixed = placed%is_grounded .and. load%axes == "ground"
    placed%torque = [action%torque%v, action%torque%d]
    axes = plane%axes
    if (load%on == frame_body) axes = identity()
    placed%moment = outer(axes(:, 3), [action%moment%v, action%moment%d])
    placed%force = in_axes(action%force%x, action%force%y)
    if (load%on == frame_body) then
      placed%point(:, 0) = load%point
      if (norm2(load%vector) > 0) then
        placed%force = outer(load%vector, [action%force%x%v, action%force%x%d])
        placed%moment = outer(load%vector, [action%moment%v, action%moment%d])
      end if
      return
    end if
    placed%point = in_axes(action%point%x, action%point%y)
    placed%point(:, 0) = placed%point(:, 0) + plane%origin + load%z * axes(:, 3)
    if (.not. placed%is_fixed) return
    placed%velocity = in_axes(action%velocity%x, action%velocity%y)
    associate (f => placed%force, v => placed%velocity)
      placed%torque = placed%torque - [dot_product(f(:, 0), v(:, 0)), dot_product(f(:, 1), v(:, 0)) + dot_product(f(:, 0), v(:, 1))]
    end associate

  contains

    !> Vector of the plane with its derivative, along the frame's axes; shape (3, 0:1).
    pure function in_axes(x, y) result(vector)
      type(jet), intent(in) :: x, y
      real(dp) :: vector(3, 0:1)

      vector = matmul(axes(:, :2), reshape([x%v, y%v, x%d, y%d], [2, 2]))
    end function in_axes

  end subroutine place

  !> Computes force, moment and torque of a load, all along the fixed axes, and their derivatives with respect to small rotations
  !> dalpha of the frame, which turn the drive by -b dalpha.
  pure subroutine find_effect(load, rotation, b, force, moment, torque, force_turn, moment_turn, torque_turn)
    type(space_load_type), intent(in) :: load
    real(dp), intent(in) :: rotation(3, 3), b(3)
    real(dp), intent(out) :: force(3), moment(3), torque, force_turn(3, 3), moment_turn(3, 3), torque_turn(3)
    real(dp), dimension(3, 0:1) :: f, r, v

    force = 0
    moment = 0
    force_turn = 0
    moment_turn = 0
    torque = load%torque(0)
    torque_turn = -load%torque(1) * b
    if (.not. load%is_grounded) return
    f = load%force
    if (.not. load%is_fixed) f = matmul(rotation, f)
    r = matmul(rotation, load%point)
    force = f(:, 0)
    moment = cross(r(:, 0), force) + matmul(rotation, load%moment(:, 0))
    force_turn = -outer(f(:, 1), b)
    moment_turn = -cross_matrix(moment) - outer(cross(r(:, 1), f(:, 0)) + cross(r(:, 0), f(:, 1)) &
      & + matmul(rotation, load%moment(:, 1)), b)
    if (load%is_fixed) then
      ! d(r x F) = (dalpha x r) x F = dalpha x (r x F) - r x (dalpha x F)
      moment_turn = moment_turn + matmul(cross_matrix(r(:, 0)), cross_matrix(force))
      v = matmul(rotation, load%velocity)
      torque = torque + dot_product(force, v(:, 0))
      torque_turn = torque_turn + cross(v(:, 0), force) - (dot_product(f(:, 1), v(:, 0)) + dot_product(f(:, 0), v(:, 1))) * b
    else
      force_turn = force_turn - cross_matrix(force)
    end if
  end subroutine find_effect

  !> Adds the effect of the loads to the left sides r, shape (6), and to their derivatives c with respect to (du, dalpha), shape (6,
  !> 6), along the fixed axes. `b`, `bend`: change of the drive's angle (see the header) and the derivative of b with respect to
  !> dalpha.
  pure subroutine add_loads(loads, b, bend, rotation, r, c)
    type(space_load_type), intent(in) :: loads(:)
    real(dp), intent(in) :: b(3), bend(3, 3), rotation(3, 3)
    real(dp), intent(inout) :: r(6), c(6, 6)
    real(dp) :: force(3), moment(3), torque, force_turn(3, 3), moment_turn(3, 3), torque_turn(3)
    integer :: i

    do i = 1, size(loads)
      call find_effect(loads(i), rotation, b, force, moment, torque, force_turn, moment_turn, torque_turn)
      r(:3) = r(:3) - force
      r(4:) = r(4:) - moment + torque * b
      c(:3, 4:) = c(:3, 4:) - force_turn
      c(4:, 4:) = c(4:, 4:) - moment_turn + outer(b, torque_turn) + torque * bend
    end do
  end subroutine add_loads

  !> Torque of the loads on the drive (N m), and its derivatives with respect to rotations dalpha of the frame about the fixed axes.
  pure subroutine load_torque(loads, b, rotation, torque, torque_turn)
    type(space_load_type), intent(in) :: loads(:)
    real(dp), intent(in) :: b(3), rotation(3, 3)
    real(dp), intent(out) :: torque, torque_turn(3)
    real(dp) :: force(3), moment(3), one, force_turn(3, 3), moment_turn(3, 3), one_turn(3)
    integer :: i

    torque = 0
    torque_turn = 0
    do i = 1, size(loads)
      call find_effect(loads(i), rotation, b, force, moment, one, force_turn, moment_turn, one_turn)
      torque = torque + one
      torque_turn = torque_turn + one_turn
    end do
  end subroutine load_torque

  !> Power of the loads (W). `rate`: angular velocity of the drive relative to the frame (rad/s). `velocity`: velocity of the
  !> frame's centre of mass (m/s). `w`: its angular velocity (rad/s). Both are along the fixed axes.
  pure real(dp) function load_power(loads, rotation, rate, velocity, w) result(power)
    type(space_load_type), intent(in) :: loads(:)
    real(dp), intent(in) :: rotation(3, 3), rate, velocity(3), w(3)
    real(dp) :: force(3), moment(3), torque, force_turn(3, 3), moment_turn(3, 3), torque_turn(3)
    integer :: i

    power = 0
    do i = 1, size(loads)
      call find_effect(loads(i), rotation, [0.0_dp, 0.0_dp, 0.0_dp], force, moment, torque, force_turn, moment_turn, torque_turn)
      power = power + dot_product(force, velocity) + dot_product(moment, w) + torque * rate
    end do
  end function load_power

  !> Mean over the period of the loads' torque on the drive if the frame is at rest (N m). `points`: number of angles.
  pure real(dp) function mean_load_torque(planes, points) result(mean)
    type(plane_type), intent(in) :: planes(:)
    integer, intent(in) :: points
    type(space_load_type) :: loads(count_loads(planes))
    real(dp) :: torque, unused(3)
    integer :: k

    mean = 0
    do k = 1, points
      call find_loads(planes, 2 * pi * k / points, loads)
      call load_torque(loads, [0.0_dp, 0.0_dp, 0.0_dp], identity(), torque, unused)
      mean = mean + torque / points
    end do
  end function mean_load_torque

end module gestell_model_space_loads
