!> Converts a frame in the plane to a frame in space with six degrees of freedom.
module gestell_model_frame_in_space
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: symmetric_pencil
  use gestell_math_rotation, only: identity
  use gestell_model_frame_data, only: check_free
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_load, only: frame_body
  use gestell_model_mechanism_held, only: check_uniform_turn
  use gestell_model_space_drive, only: drive_type
  use gestell_model_space_loads, only: mean_load_torque
  use gestell_model_space_masses, only: plane_type
  use gestell_model_mounting, only: support_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: split_into_planes, put_in_space

contains

  !> Converts a frame that `new_frame` has created with its foundation to a frame in space. The frame gets an inertia tensor,
  !> mechanisms in several planes, supports and six degrees of freedom. Fails if a number is not finite or out of range, or if a
  !> mechanism cannot turn, or if `check_uniform_turn` fails.
  subroutine put_in_space(frame, inertia, planes, supports, free, error, stiffness, damping, drive)
    type(frame_type), intent(inout) :: frame
    !> Inertia tensor of the frame about its centre of mass (kg m^2)
    real(dp), intent(in) :: inertia(3, 3)
    !> The mechanisms, each in its plane; they replace the frame's mechanism
    type(plane_type), intent(in) :: planes(:)
    type(support_type), intent(in) :: supports(:)
    !> Indices of the free degrees of freedom, 1 to 6
    integer, intent(in) :: free(:)
    type(error_type), allocatable, intent(out) :: error
    !> Matrices of the foundation, with degrees of freedom in the frame's order. By default the frame keeps its matrices for (xi,
    !> eta, psi)
    real(dp), intent(in), optional :: stiffness(6, 6), damping(6, 6)
    !> What keeps the speed constant; by default it is the motor
    type(drive_type), intent(in), optional :: drive
    !> Assumed number of rounding errors in each term of the load, as for a frame in the plane (gestell_model_frame).
    real(dp), parameter :: share = 12
    type(plane_type), allocatable :: prepared(:)
    real(dp) :: c(6, 6), b(6, 6)
    integer :: i

    call check_free(free, 6, error)
    if (allocated(error)) return
    if (.not. all(ieee_is_finite(inertia))) then
      call fatal_error(error, "the frame's inertia must be finite", invalid_input)
    else if (not_a_rigid_body(inertia)) then
      call fatal_error(error, "no rigid body has this inertia: a principal moment of inertia is negative, or greater than the " &
        & // "sum of the other two", invalid_input)
    end if
    if (allocated(error)) return
    prepared = planes
    do i = 1, size(prepared)
      call prepared(i)%linkage%prepare(error)
      if (allocated(error)) return
      associate (scale => prepared(i)%linkage%angle_scale)
        frame%rounding = max(frame%rounding, epsilon(1.0_dp) / scale**2)
        frame%least_steps = max(frame%least_steps, ceiling(2 * pi / scale))
      end associate
    end do
    allocate(frame%space)
    frame%space%inertia = inertia
    call move_alloc(prepared, frame%space%planes)
    c = 0
    c(:3, :3) = frame%stiffness
    if (present(stiffness)) c = stiffness
    b = 0
    b(:3, :3) = frame%damping
    if (present(damping)) b = damping
    call frame%put_on(supports, c, b)
    if (.not. all(ieee_is_finite(frame%stiffness)) .or. .not. all(ieee_is_finite(frame%damping))) then
      call fatal_error(error, &
        & "a support is so far from F that its stiffness or damping about F overflows double precision", invalid_input)
      return
    end if
    if (present(drive)) frame%space%drive = drive
    call check_uniform_turn(frame%space%drive%held_by, frame%mechanism, error)
    if (allocated(error)) return
    frame%space%drive%turns = frame%mechanism%turns
    frame%held_by = frame%space%drive%held_by
    if (frame%loads_act()) frame%least_steps = max(frame%least_steps, ceiling(2 * pi * frame%mechanism%load_order))
    if (frame%loads_act() .and. frame%held_by == "flywheel") frame%space%motor_torque = -mean_load_torque(frame%space%planes, &
      & 4 * frame%least_steps) / frame%mechanism%turns
    frame%flywheel_inertia = frame%space%drive%flywheel_inertia
    frame%inertia = inertia(3, 3)
    if (size(planes) > 0) frame%shaft_axes = planes(1)%axes
    frame%mechanism_distance = maxval([(norm2(planes(i)%origin), i = 1, size(planes))])
    frame%free = free
    frame%states = 2 * size(free)
    frame%load_rounding = min(1.0_dp, share * frame%rounding * frame%space%cancellation(frame%mass, frame%speed, &
      & free))
  end subroutine put_in_space

  !> Splits a linkage by planes: plane 0, which is the plane of the frame, and the planes given by `origins` and `axes`. Each part
  !> gets all joints, but only the links that move in its plane and the loads on them. Planes without links are omitted.
  subroutine split_into_planes(linkage, origin, origins, axes, planes)
    type(linkage_type), intent(in) :: linkage
    !> `origin`: origin of plane 0 relative to the frame's centre of mass (m). `origins`: origins of the other planes relative to
    !> `origin` (m), shape (3, planes). `axes`: axes of the other planes as columns, shape (3, 3, planes)
    real(dp), intent(in) :: origin(3), origins(:, :), axes(:, :, :)
    type(plane_type), allocatable, intent(out) :: planes(:)
    integer :: i, k, n

    allocate(planes(count([(any(linkage%links%plane == k), k = 0, size(origins, 2))])))
    n = 0
    do k = 0, size(origins, 2)
      if (.not. any(linkage%links%plane == k)) cycle
      n = n + 1
      planes(n)%linkage = linkage
      if (any(linkage%links%plane /= k)) then
        planes(n)%linkage%links = pack(linkage%links, linkage%links%plane == k)
        planes(n)%linkage%prepared = .false.
      end if
      if (allocated(linkage%loads)) then
        ! loads on the frame belong to no plane
        planes(n)%linkage%loads = pack(linkage%loads, merge(n == 1, linkage%loads%plane == k, linkage%loads%on == frame_body))
        ! a plane counts its own links from 1
        do i = 1, size(planes(n)%linkage%loads)
          associate (load => planes(n)%linkage%loads(i), in_plane => linkage%links%plane == k)
            load%on = min(load%on, count(in_plane(:load%on)))
            load%against = min(load%against, count(in_plane(:load%against)))
          end associate
        end do
      end if
      planes(n)%origin = origin
      if (k == 0) cycle
      planes(n)%origin = origin + origins(:, k)
      planes(n)%axes = axes(:, :, k)
    end do
  end subroutine split_into_planes

  !> True if no rigid body has this inertia tensor: a principal moment is negative or exceeds the sum of the other two. A relative
  !> tolerance of 1e-9 allows for rounding errors.
  logical function not_a_rigid_body(inertia)
    real(dp), intent(in) :: inertia(3, 3)
    real(dp), parameter :: rounding = 1.0e-9_dp
    real(dp), allocatable :: principal(:)
    type(error_type), allocatable :: error

    call symmetric_pencil(inertia, identity(), principal, error)
    not_a_rigid_body = allocated(error)
    if (.not. not_a_rigid_body) not_a_rigid_body = principal(1) < -rounding * principal(3) &
      & .or. principal(3) > (1 + rounding) * (principal(1) + principal(2))
  end function not_a_rigid_body

end module gestell_model_frame_in_space
