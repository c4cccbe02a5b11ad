!> Joint forces of a frame's mechanisms as rows of its motion: the forces and moments in all pairs at phases of the period, on the
!> frame as it moves. The inertia of the links follows the exact kinematics, whatever model describes the motion.
module gestell_model_pairs_rows
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: cross, identity
  use gestell_math_vectors, only: batch, in_batch, times, transposed
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_path, only: direction
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: body_motion, link_type
  use gestell_model_linkage_load, only: action_type, load_action
  use gestell_model_mechanism, only: mechanism_type
  use gestell_model_mechanism_held, only: part_of_turn
  use gestell_model_mechanism_tabulated, only: tabulated_type
  use gestell_model_pairs, only: find_structure, frame_body, on_pin, structure_type
  use gestell_model_pairs_forces, only: add_force, add_to_pin, applied_type, clear, components, new_applied, solve_pairs
  use gestell_model_space, only: in_frame, is_rotation
  use gestell_model_space_drive, only: follow_frame, moved_type
  use gestell_model_space_masses, only: plane_type
  implicit none (type, external)
  private

  public :: compute_joint_forces, find_machine_pairs, joint_rows, load_count, mechanism_angles

  !> Sources of joint forces. `all_sources`: all of them together. `inertia`: the links' inertia on a frame at rest. `weights`: the
  !> links' weights. `before_loads` + k: load number k, counted over all planes. The motion of the frame is the source of the rest.
  integer, parameter, public :: inertia = 1, weights = 2, before_loads = 2
  integer, parameter :: all_sources = 0

  !> A plane of the machine with the bodies and pairs of its linkage. `origin`: origin of the plane's axes (m), along these axes.
  type, public :: plane_pairs_type
    type(plane_type) :: plane
    type(structure_type) :: structure
    real(dp) :: origin(3) = 0
  end type plane_pairs_type

  !> The motion of the frame and of its drive at one phase: rotation matrix R; along the frame's axes the acceleration `a` of the
  !> frame's centre of mass minus gravity, the angular velocity w and its derivative; first and second time derivatives of the
  !> mechanisms' angle.
  type :: carrier_type
    real(dp) :: rotation(3, 3) = 0, a(3) = 0, w(3) = 0, w_d(3) = 0, rate = 0, gain = 0
  end type carrier_type

  !> Bounds on the errors of the motion: of the accelerations `a` of the frame's centre of mass (m/s^2), of the angular acceleration
  !> `w_d` (rad/s^2), of the angular velocity `w` (rad/s), and of the rotation and of the drive's angle `turn` (rad); and on the
  !> `relative` errors of the links' accelerations.
  type :: uncertainty_type
    real(dp) :: a = 0, w_d = 0, w = 0, turn = 0, relative = 0
  end type uncertainty_type

contains

  !> Finds the bodies and pairs of all mechanisms of a frame. Fails if a mechanism is no linkage or its forces are not determined.
  subroutine find_machine_pairs(frame, pairs, error)
    class(frame_type), intent(in) :: frame
    type(plane_pairs_type), allocatable, intent(out) :: pairs(:)
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    if (allocated(frame%space)) then
      allocate(pairs(size(frame%space%planes)))
      do i = 1, size(pairs)
        pairs(i)%plane = frame%space%planes(i)
      end do
    else
      allocate(pairs(1))
      pairs(1)%plane%origin(:2) = frame%origin
      call copy_linkage(frame%mechanism, pairs(1)%plane%linkage, error)
    end if
    do i = 1, size(pairs)
      pairs(i)%origin = matmul(pairs(i)%plane%origin, pairs(i)%plane%axes)
      if (.not. allocated(error)) call find_structure(pairs(i)%plane%linkage, pairs(i)%structure, error)
    end do
  end subroutine find_machine_pairs

  !> Number of rows that the joint forces of a frame need; 0 if they are not determined.
  integer function joint_rows(frame)
    class(frame_type), intent(in) :: frame
    type(plane_pairs_type), allocatable :: pairs(:)
    type(error_type), allocatable :: error
    integer :: i

    call find_machine_pairs(frame, pairs, error)
    joint_rows = 0
    if (.not. allocated(error)) joint_rows = components * sum([(size(pairs(i)%structure%places), i = 1, size(pairs))])
  end function joint_rows

  !> Copies the linkage that a mechanism is or from which it was tabulated. Fails if it has no linkage.
  recursive subroutine copy_linkage(mechanism, linkage, error)
    class(mechanism_type), intent(in) :: mechanism
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: error

    select type (mechanism)
    class is (tabulated_type)
      call copy_linkage(mechanism%source, linkage, error)
    type is (linkage_type)
      linkage = mechanism
    class default
      call fatal_error(error, "joint forces require joints and links: &mass_functions does not determine them", invalid_input)
    end select
  end subroutine copy_linkage

  !> Computes the forces and moments in all pairs at phases of the period. Fails if a linkage is at a dead point.
  subroutine compute_joint_forces(frame, pairs, phases, motion, forces, error, errors, relative, bounds, parts)
    class(frame_type), intent(in) :: frame
    !> The pairs of the frame's mechanisms, by `find_machine_pairs`
    type(plane_pairs_type), intent(in) :: pairs(:)
    !> `phases`: phases of the period. `motion`: q, q', q'' at these phases, shape (3 dofs or more, phases)
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(in) :: motion(:, :)
    !> Forces and moments, shape (components of all places, phases)
    real(dp), intent(out) :: forces(:, :)
    type(error_type), allocatable, intent(out) :: error
    !> `errors`: bounds on the errors of q, q', q'', shape (3 dofs). `relative`: bound on the relative errors of the links'
    !> accelerations. They cause errors of the forces, up to `bounds`, shape (components of all places)
    real(dp), intent(in), optional :: errors(:), relative
    real(dp), intent(out), optional :: bounds(:)
    !> Parts of the forces with one source each, shape (components of all places, phases, sources): inertia, weights, all loads
    real(dp), intent(out), optional :: parts(:, :, :)
    type(carrier_type), allocatable :: carriers(:, :)
    type(carrier_type) :: carrier(0:weights)
    type(applied_type) :: applied
    type(point_type), allocatable :: at(:)
    type(uncertainty_type) :: uncertainty
    real(dp), allocatable :: values(:, :), wrong_by(:)
    real(dp) :: angles(size(phases))
    integer :: i, k, n, first, last, sources, load

    allocate(carriers(size(phases), 0:weights))
    call move_frame(frame, phases, motion, carriers, angles)
    if (present(bounds)) then
      bounds = 0
      uncertainty = new_uncertainty(frame, errors, relative)
    end if
    sources = 0
    if (present(parts)) then
      sources = size(parts, 3)
      parts = 0
    end if
    last = 0
    load = before_loads
    do i = 1, size(pairs)
      associate (linkage => pairs(i)%plane%linkage, structure => pairs(i)%structure)
        first = last + 1
        last = last + components * size(structure%places)
        allocate(at(size(linkage%joints)))
        allocate(values(first:last, 0:sources), wrong_by(first:last))
        call new_applied(structure, sources, present(bounds), applied)
        applied%relative = uncertainty%relative + uncertainty%turn
        do k = 1, size(phases)
          call linkage%points(angles(k), at)
          call clear(applied)
          carrier = seen_from(pairs(i)%plane, carriers(k, :))
          do n = 1, size(linkage%links)
            call add_inertia(linkage%links(n), structure%links(n), pairs(i), at, carrier(:min(weights, sources)), uncertainty, &
              & applied)
          end do
          do n = 1, load_count(pairs(i:i))
            call add_load(pairs(i)%plane, structure, n, at, angles(k), carrier(all_sources)%rotation, pack([all_sources, &
              & load + n], [.true., present(parts)]), applied)
          end do
          call solve_pairs(structure, at, sources, applied, values, wrong_by, error)
          if (allocated(error)) return
          forces(first:last, k) = values(:, all_sources)
          if (present(bounds)) bounds(first:last) = max(bounds(first:last), wrong_by)
          if (present(parts)) parts(first:last, k, :) = values(:, 1:)
        end do
        load = load + load_count(pairs(i:i))
        deallocate(at, values, wrong_by)
      end associate
    end do
  end subroutine compute_joint_forces

  !> Bounds on the errors of the motion, from bounds on the errors of q, q', q''. An error of the drive's angle counts by the crank
  !> angle over which the motion of the mechanism changes noticeably.
  pure type(uncertainty_type) function new_uncertainty(frame, errors, relative) result(uncertainty)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: errors(:), relative
    integer, allocatable :: turns(:), shifts(:)
    integer :: i

    turns = pack([(i, i = 1, frame%dofs())], is_rotation([(i, i = 1, frame%dofs())]))
    shifts = pack([(i, i = 1, frame%dofs())], .not. is_rotation([(i, i = 1, frame%dofs())]))
    associate (n => frame%dofs())
      uncertainty = uncertainty_type(norm2(errors(2 * n + shifts)), norm2(errors(2 * n + turns)), norm2(errors(n + turns)), &
        & norm2(errors(turns)) / min(1.0_dp, frame%mechanism%angle_scale), relative)
    end associate
  end function new_uncertainty

  !> Angles of the mechanisms relative to the frame (rad) at phases of the period. `motion`: q, q', q'' at these phases, shape (3
  !> dofs or more, phases).
  function mechanism_angles(frame, phases, motion) result(angles)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(in) :: motion(:, :)
    real(dp) :: angles(size(phases))
    type(carrier_type), allocatable :: carriers(:, :)

    allocate(carriers(size(phases), 0:weights))
    call move_frame(frame, phases, motion, carriers, angles)
  end function mechanism_angles

  !> Lag of the drive, as `follow_frame` requires it, at phases of the period.
  pure function lag_of(frame, phases) result(lag)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp) :: lag(size(phases), 3)

    lag = 0
    select type (frame)
    class is (varied_frame_type)
      if (allocated(frame%space)) lag = frame%lag(phases)
    end select
  end function lag_of

  !> The motion of the frame and of its drive at phases of the period, and the angles of the mechanisms. `carriers(:, all_sources)`:
  !> the whole motion; `inertia` and `weights`: the terms that contribute to these parts of the forces.
  subroutine move_frame(frame, phases, motion, carriers, angles)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(in) :: motion(:, :)
    type(carrier_type), intent(out) :: carriers(:, 0:)
    real(dp), intent(out) :: angles(:)
    integer :: k

    angles = frame%crank_angles(phases)
    if (allocated(frame%space)) then
      call move_in_space(frame, lag_of(frame, phases), motion, carriers(:, all_sources), angles)
    else
      call move_in_plane(frame, motion, carriers(:, all_sources), angles)
    end if
    do k = 1, size(phases)
      carriers(k, inertia)%rate = frame%speed
      carriers(k, weights)%a = -matmul(frame%weights%gravity, carriers(k, all_sources)%rotation)
    end do
  end subroutine move_frame

  !> The motion of a frame in the plane. Converts `angles` from the angles of the drive to those of the mechanisms.
  pure subroutine move_in_plane(frame, motion, carriers, angles)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: motion(:, :)
    type(carrier_type), intent(inout) :: carriers(:)
    real(dp), intent(inout) :: angles(:)
    real(dp) :: part, c, s
    integer :: k

    part = part_of_turn(frame%mechanism, frame%uniform_in_space())
    do k = 1, size(angles)
      associate (here => carriers(k))
        c = cos(motion(3, k))
        s = sin(motion(3, k))
        here%rotation = identity()
        here%rotation(:2, 1) = [c, s]
        here%rotation(:2, 2) = [-s, c]
        here%a = matmul([motion(7:8, k), 0.0_dp] - frame%weights%gravity, here%rotation)
        here%w(3) = motion(6, k)
        here%w_d(3) = motion(9, k)
        here%rate = frame%speed - part * motion(6, k)
        here%gain = -part * motion(9, k)
        angles(k) = angles(k) - part * motion(3, k)
      end associate
    end do
  end subroutine move_in_plane

  !> The motion of a frame in space. Converts `angles` from the angles of the drive to those of the mechanisms.
  pure subroutine move_in_space(frame, lag, motion, carriers, angles)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: lag(:, :), motion(:, :)
    type(carrier_type), intent(inout) :: carriers(:)
    real(dp), intent(inout) :: angles(:)
    type(moved_type) :: moved
    real(dp) :: theta(batch, 3, 0:2), u_dd(batch, 3)
    real(dp), dimension(batch, 3) :: a, w, w_d
    integer :: at(batch), first, i, k, n

    do first = 1, size(angles), batch
      at = in_batch(first, size(angles))
      do i = 1, 3
        u_dd(:, i) = motion(12 + in_frame(i), at) - frame%weights%gravity(i)
        do k = 0, 2
          theta(:, i, k) = motion(6 * k + in_frame(3 + i), at)
        end do
      end do
      if (any(abs(lag) > 0)) then
        call follow_frame(frame%space%drive, frame%speed, u_dd, theta, moved, lag(at, :))
      else
        call follow_frame(frame%space%drive, frame%speed, u_dd, theta, moved)
      end if
      associate (back => transposed(moved%rotation))
        a = times(back, moved%a)
        w = times(back, moved%w)
        w_d = times(back, moved%w_d)
      end associate
      do n = first, min(first + batch - 1, size(angles))
        k = n - first + 1
        carriers(n) = carrier_type(moved%rotation(k, :, :), a(k, :), w(k, :), w_d(k, :), moved%rate(k), moved%gain(k))
        angles(n) = angles(n) - moved%chi(k, 0)
      end do
    end do
  end subroutine move_in_space

  !> The motion of the frame along the axes of a plane instead of the frame's axes.
  elemental type(carrier_type) function seen_from(plane, carrier) result(seen)
    type(plane_type), intent(in) :: plane
    type(carrier_type), intent(in) :: carrier

    seen = carrier
    seen%a = matmul(carrier%a, plane%axes)
    seen%w = matmul(carrier%w, plane%axes)
    seen%w_d = matmul(carrier%w_d, plane%axes)
  end function seen_from

  !> Adds inertia and weight of a link to the known forces. The acceleration of its centre of mass r, minus gravity, is
  !>
  !>     a + w' x r + w x (w x r) + 2 w x r' + r'',   r' = dr/dphi phi',   r'' = d2r/dphi2 phi'^2 + dr/dphi phi'',
  !>
  !> along the plane's axes. Euler's equation gives the moment about the plane's normal: -(J_3 (w_3' + w_i') - (J_1 - J_2) w_1 w_2),
  !> where w_1, w_2 are the components of w along the link and perpendicular to it in the plane.
  pure subroutine add_inertia(link, body, pairs, at, moved, uncertainty, applied)
    type(link_type), intent(in) :: link
    !> Number of the body that the link belongs to
    integer, intent(in) :: body
    type(plane_pairs_type), intent(in) :: pairs
    type(point_type), intent(in) :: at(:)
    !> The motion that each source of the forces requires (see `move_frame`), along the plane's axes
    type(carrier_type), intent(in) :: moved(0:)
    type(uncertainty_type), intent(in) :: uncertainty
    type(applied_type), intent(inout) :: applied
    type(point_type) :: center
    real(dp) :: r(3), dr(3), ddr(3), acceleration(3), force(2), torque, rate, turn, unequal, u(2), terms, errors(3)
    integer :: source

    if (body == frame_body) return
    call body_motion(link, at, center, rate, turn)
    r = pairs%origin + [center%x%v, center%y%v, link%z]
    dr = [center%x%d, center%y%d, 0.0_dp]
    ddr = [center%x%dd, center%y%dd, 0.0_dp]
    unequal = link%along - link%across
    u = 0
    if (abs(unequal) > 0) u = axis_of(link, at)
    errors = 0
    do source = 0, ubound(moved, 1)
      associate (m => moved(source), w => moved(source)%w)
        acceleration = m%a + ddr * m%rate**2 + dr * m%gain
        if (source == all_sources) acceleration = acceleration + cross(m%w_d, r) + cross(w, cross(w, r) + 2 * m%rate * dr)
        force = -link%mass * acceleration(:2)
        torque = -link%inertia * (m%w_d(3) + turn * m%rate**2 + rate * m%gain) &
          & + unequal * (w(1) * u(1) + w(2) * u(2)) * (w(2) * u(1) - w(1) * u(2))
        if (applied%bounded .and. source == all_sources) then
          associate (e => uncertainty, fast => norm2(w) + abs(m%rate))
            terms = norm2(m%a) + (norm2(m%w_d) + norm2(w)**2) * norm2(r) + 2 * norm2(w) * norm2(dr) * abs(m%rate) &
              & + norm2(ddr) * m%rate**2 + norm2(dr) * abs(m%gain)
            errors(:2) = link%mass * ((e%relative + e%turn) * terms + e%a + e%w_d * (norm2(r) + norm2(dr)) &
              & + 2 * e%w * fast * (norm2(r) + norm2([dr, ddr])))
            errors(3) = link%inertia * ((e%relative + e%turn) * (norm2(m%w_d) + abs(turn) * m%rate**2 &
              & + abs(rate * m%gain)) + e%w_d * (1 + abs(rate)) + 2 * e%w * fast * abs(turn)) &
              & + abs(unequal) * norm2(w) * (2 * e%w + (e%relative + e%turn) * norm2(w))
          end associate
        end if
        if (body == on_pin) then
          call add_to_pin(link%from, source, force, errors(:2), applied)
        else
          call add_force(pairs%structure, at, body, source, [center%x%v, center%y%v], force, torque, errors, applied)
        end if
      end associate
    end do
  end subroutine add_inertia

  !> Number of loads in these planes.
  pure integer function load_count(pairs)
    type(plane_pairs_type), intent(in) :: pairs(:)
    integer :: i

    load_count = 0
    do i = 1, size(pairs)
      if (allocated(pairs(i)%plane%linkage%loads)) load_count = load_count + size(pairs(i)%plane%linkage%loads)
    end do
  end function load_count

  !> Adds load `number` of a plane to the known forces on its two bodies. A force whose direction is fixed in space turns against
  !> the frame.
  pure subroutine add_load(plane, structure, number, at, crank_angle, rotation, sources, applied)
    type(plane_type), intent(in) :: plane
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: number
    type(point_type), intent(in) :: at(:)
    !> Angle of the mechanisms (rad), and rotation matrix of the frame
    real(dp), intent(in) :: crank_angle, rotation(3, 3)
    !> Sources to whose forces the load belongs
    integer, intent(in) :: sources(:)
    type(applied_type), intent(inout) :: applied
    type(action_type) :: action
    real(dp) :: force(2)

    associate (load => plane%linkage%loads(number), q => plane%axes(:, :2))
      call load_action(load, plane%linkage%links, at, crank_angle, action, plane%origin(:2))
      force = [action%force%x%v, action%force%y%v]
      if (load%axes == "ground") force = matmul(matmul(matmul(q, force), rotation), q)
      call add_to_body(load%on, 1.0_dp, applied)
      call add_to_body(load%against, -1.0_dp, applied)
    end associate

  contains

    pure subroutine add_to_body(link, direction, applied)
      integer, intent(in) :: link
      real(dp), intent(in) :: direction
      type(applied_type), intent(inout) :: applied
      integer :: i

      if (link <= 0) return
      do i = 1, size(sources)
        associate (body => structure%links(link), errors => applied%relative * [norm2(force), norm2(force), abs(action%moment%v)])
          if (body == on_pin) then
            call add_to_pin(plane%linkage%links(link)%from, sources(i), direction * force, errors(:2), applied)
          else
            call add_force(structure, at, body, sources(i), [action%point%x%v, action%point%y%v], direction * force, direction &
              & * action%moment%v, errors, applied)
          end if
        end associate
      end do
    end subroutine add_to_body

  end subroutine add_load

  !> Direction of a link's axis in its plane.
  pure function axis_of(link, at)
    type(link_type), intent(in) :: link
    type(point_type), intent(in) :: at(:)
    real(dp) :: axis_of(2)
    type(point_type) :: along

    axis_of = link%axis
    if (link%to == 0) return
    along = direction(at(link%from), at(link%to))
    axis_of = [along%x%v, along%y%v]
  end function axis_of

end module gestell_model_pairs_rows
