!> A frame in space linearised about one of its motions: the exact equations of gestell_model_space and their derivatives.
!>
!> Let dalpha be a small rotation of the frame about its axes: the rotation matrix R changes by R [dalpha], where [dalpha] is the
!> matrix of the cross product. Then
!>
!>     dw  = dalpha' + w x dalpha,   dw' = dalpha'' + w' x dalpha + w x dalpha',
!>     d(R g)      = R (dalpha x g + dg),   dg = 2 dw x S' + dw' x S + dw x (w x S) + w x (dw x S),
!>     d(R^T u'')  = R^T du'' - dalpha x (R^T u'').
!>
!> A change dtheta of the rotation vector means, with the matrix T of gestell_math_rotation,
!>
!>     dalpha = T dtheta,   dalpha' = T dtheta' + T' dtheta,   dalpha'' = T dtheta'' + 2 T' dtheta' + T'' dtheta.
module gestell_model_space_variation
  use gestell_base_kinds, only: dp
  use gestell_model_mounting, only: damping_matrix, in_frame, in_space, stiffness_matrix, turned_loads
  use gestell_model_mounting_mounted, only: mounted_system
  use gestell_model_space, only: space_type
  use gestell_model_space_drive, only: add_drive, drive_type, driven_type, follow_frame, shift_time, turn_type
  use gestell_model_space_loads, only: add_loads, count_loads, find_loads, space_load_type
  use gestell_model_space_masses, only: masses_type
  use gestell_model_space_mounting, only: add_supports, support_force
  use gestell_model_space_moving, only: find_moving
  use gestell_math_rotation, only: cross, cross_matrix, identity, rotation_less_one, turning_less_one, turning_matrices
  implicit none (type, external)
  private

  public :: force_excess, ground_in_space, sample_varied, vary

contains

  !> Computes, along a motion, the left sides r of the exact equations, shape (angles, 6), and the derivatives M, B, C of these left
  !> sides, shape (angles, 6, 6). All six degrees of freedom are included, in the frame's order.
  pure subroutine sample_varied(frame, space, angles, q, v, a, lag, r, m, b, c)
    class(mounted_system), intent(in) :: frame
    type(space_type), intent(in) :: space
    !> Angles of the drive (rad)
    real(dp), contiguous, intent(in) :: angles(:)
    !> `q`, `v`, `a`: motion q, q', q'' at these angles, shapes (angles, 6). `lag`: only with a flywheel, the argument `lag` of
    !> `follow_frame`, shape (angles, 3)
    real(dp), intent(in) :: q(:, :), v(:, :), a(:, :), lag(:, :)
    real(dp), intent(out) :: r(:, :), m(:, :, :), b(:, :, :), c(:, :, :)
    type(masses_type) :: masses
    type(driven_type), allocatable :: driven(:)
    type(space_load_type), allocatable :: loads(:)
    real(dp) :: motion(6, 0:2), all_r(6), all_m(6, 6), all_b(6, 6), all_c(6, 6)
    integer :: k

    if (space%drive%uniform_in_space()) then
      allocate(driven(size(angles)))
      call follow_motion(frame, space, angles, v, a, q, lag, masses, driven)
    else
      call space%masses_at(frame%mass, frame%speed, angles, masses)
    end if
    allocate(loads(count_loads(space%planes)))
    do k = 1, size(angles)
      motion = in_order(q(k, :), v(k, :), a(k, :))
      if (allocated(driven)) then
        call find_loads(space%planes, angles(k) - driven(k)%turn%chi(0), loads)
        call vary(frame, space%drive, masses, k, motion, all_r, all_m, all_b, all_c, driven(k), loads)
      else
        call find_loads(space%planes, angles(k), loads)
        call vary(frame, space%drive, masses, k, motion, all_r, all_m, all_b, all_c, loads=loads)
      end if
      r(k, :) = all_r(in_space)
      m(k, :, :) = all_m(in_space, in_space)
      b(k, :, :) = all_b(in_space, in_space)
      c(k, :, :) = all_c(in_space, in_space)
    end do
  end subroutine sample_varied

  !> Converts the motion q, q', q'' from the frame's order to the order (u, theta), shape (6, 0:2).
  pure function in_order(q, v, a) result(motion)
    real(dp), intent(in) :: q(:), v(:), a(:)
    real(dp) :: motion(6, 0:2)

    motion(in_space, 0) = q
    motion(in_space, 1) = v
    motion(in_space, 2) = a
  end function in_order

  !> Computes, along a motion, the state of a drive that turns uniformly relative to the ground, and the sums over the masses at the
  !> angles of this drive.
  pure subroutine follow_motion(frame, space, angles, v, a, q, lag, masses, driven)
    class(mounted_system), intent(in) :: frame
    type(space_type), intent(in) :: space
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), intent(in) :: q(:, :), v(:, :), a(:, :), lag(:, :)
    type(masses_type), intent(out) :: masses
    type(driven_type), intent(out) :: driven(:)
    real(dp) :: motion(6, 0:2), turned(size(angles)), rates(size(angles), 2)
    integer :: k

    do k = 1, size(angles)
      motion = in_order(q(k, :), v(k, :), a(k, :))
      call follow_frame(space%drive, frame%speed, motion(:3, 2) - frame%weights%gravity, motion(4:, :), driven(k)%moved, &
        & driven(k)%turn, lag(k, :))
      turned(k) = angles(k) - driven(k)%turn%chi(0)
      rates(k, :) = [driven(k)%moved%rate, driven(k)%moved%gain]
      call find_moving(space%planes, turned(k), driven(k)%moving)
    end do
    call space%masses_at(frame%mass, frame%speed, turned, masses, rates)
  end subroutine follow_motion

  !> Forces (N) on the ground along the fixed axes xi, eta, zeta, and their moments (N m) about the rest position of the frame's
  !> centre of mass, in the frame's order, shape (6, points). `q`, `v`: motion, shape (points, 6). The force of a support acts at
  !> its displaced upper end, or at the rest position of this end if the axes turn with the frame.
  pure function ground_in_space(frame, q, v) result(forces)
    class(mounted_system), intent(in) :: frame
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp) :: forces(6, size(q, 1)), place(6), rate(6), f(6), force(3), arm(3), turn(3, 3), w(3)
    integer :: i, k

    forces = matmul(frame%foundation_stiffness, transpose(q)) + matmul(frame%foundation_damping, transpose(v))
    do k = 1, size(q, 1)
      place = q(k, :)
      rate = v(k, :)
      turn = rotation_less_one(place(in_frame(4:)))
      w = spin_of(place, rate)
      f = 0
      do i = 1, size(frame%supports)
        force = support_force(frame%supports(i), place(in_frame(:3)), rate(in_frame(:3)), turn, w)
        f(:3) = f(:3) + force
        arm = frame%supports(i)%position
        if (.not. frame%supports(i)%turning) arm = place(in_frame(:3)) + arm + matmul(turn, arm)
        f(4:) = f(4:) + cross(arm, force)
      end do
      forces(:, k) = forces(:, k) + f(in_space)
    end do
  end function ground_in_space

  !> Angular velocity of the frame along its axes (rad/s), from q and q' in the frame's order.
  pure function spin_of(q, v) result(w)
    real(dp), intent(in) :: q(6), v(6)
    real(dp) :: w(3)

    w = matmul(turning_less_one(q(in_frame(4:))), v(in_frame(4:))) + v(in_frame(4:))
  end function spin_of

  !> Nonlinear part of the forces on the ground (N) of the supports whose axes turn with the frame, three components for each
  !> support. `q`, `v`: motion in the frame's order.
  pure function force_excess(frame, q, v) result(excess)
    class(mounted_system), intent(in) :: frame
    real(dp), intent(in) :: q(6), v(6)
    real(dp) :: excess(3 * count(frame%supports%turning)), c(6, 6), b(6, 6)
    integer, parameter :: along(3) = in_frame(:3)
    integer :: i, n

    n = 0
    do i = 1, size(frame%supports)
      if (.not. frame%supports(i)%turning) cycle
      c = stiffness_matrix(frame%supports(i:i), 6) + turned_loads(frame%supports(i:i), 6)
      b = damping_matrix(frame%supports(i:i), 6)
      excess(n + 1:n + 3) = support_force(frame%supports(i), q(along), v(along), rotation_less_one(q(in_frame(4:))), &
        & spin_of(q, v)) - matmul(c(along, :), q) - matmul(b(along, :), v)
      n = n + 3
    end do
  end function force_excess

  !> Computes the left sides r of the exact equations of a frame and their derivatives m, b, c with respect to q'', q' and q, all in
  !> the order (u, theta).
  pure subroutine vary(frame, drive, masses, k, q, r, m, b, c, driven, loads)
    class(mounted_system), intent(in) :: frame
    type(drive_type), intent(in) :: drive
    !> Sums over the masses at many angles; the procedure uses only the sums at angle number `k`
    type(masses_type), intent(in) :: masses
    integer, intent(in) :: k
    !> Motion q, q', q'' in the order (u, theta)
    real(dp), intent(in) :: q(6, 0:2)
    real(dp), intent(out) :: r(6), m(6, 6), b(6, 6), c(6, 6)
    !> State of the drive; required if the drive turns uniformly relative to the ground
    type(driven_type), intent(in), optional :: driven
    !> Loads (forces and moments between links, frame and ground) at this angle
    type(space_load_type), intent(in), optional :: loads(:)
    type(turn_type) :: lag
    real(dp), dimension(3, 3) :: turn, rotation, back, s, spin, wheel, change
    real(dp), dimension(3, 3, 0:2) :: turning, varied
    real(dp), dimension(3, 0:2) :: theta, sums
    real(dp) :: stiffness(6, 6), damping(6, 6), inertia(3, 3, 0:1), momenta(3, 0:1), w(3), w_d(3), g(3), a(3), momentum(3)
    integer :: i

    sums = masses%s(k, :, :)
    inertia = masses%j(k, :, :, :)
    momenta = masses%h(k, :, :)
    theta = q(4:, :)
    turn = rotation_less_one(theta(:, 0))
    rotation = turn + identity()
    back = transpose(rotation)
    turning = turning_matrices(theta)
    w = matmul(turning(:, :, 0), theta(:, 1))
    w_d = matmul(turning(:, :, 0), theta(:, 2)) + matmul(turning(:, :, 1), theta(:, 1))
    g = sums(:, 2) + 2 * cross(w, sums(:, 1)) + cross(w_d, sums(:, 0)) + cross(w, cross(w, sums(:, 0)))
    a = matmul(back, q(:3, 2))
    momentum = matmul(inertia(:, :, 0), w) + momenta(:, 0)
    if (present(driven)) momentum = momentum + driven%moved%spin
    r(:3) = masses%mass * q(:3, 2) + matmul(rotation, g)
    r(4:) = matmul(inertia(:, :, 0), w_d) + matmul(inertia(:, :, 1), w) + cross(w, momentum) + momenta(:, 1) + cross(sums(:, 0), a)
    s = cross_matrix(sums(:, 0))
    spin = cross_matrix(w)
    b = 0
    c = 0
    m(:3, :3) = masses%mass * identity()
    ! derivatives with respect to dalpha'', dalpha', dalpha
    m(:3, 4:) = -matmul(rotation, s)
    m(4:, :3) = matmul(s, back)
    m(4:, 4:) = inertia(:, :, 0)
    ! derivatives with respect to w: of g, and of the moment, J' dw + dw x (J w + H) + w x (J dw)
    change = -2 * cross_matrix(sums(:, 1)) - cross_matrix(cross(w, sums(:, 0))) - matmul(spin, s)
    wheel = inertia(:, :, 1) - cross_matrix(momentum) + matmul(spin, inertia(:, :, 0))
    b(:3, 4:) = matmul(rotation, change - matmul(s, spin))
    b(4:, 4:) = wheel + matmul(inertia(:, :, 0), spin)
    c(:3, 4:) = matmul(rotation, matmul(change, spin) - matmul(s, cross_matrix(w_d)) - cross_matrix(g))
    c(4:, 4:) = matmul(wheel, spin) + matmul(inertia(:, :, 0), cross_matrix(w_d)) + matmul(s, cross_matrix(a))
    call add_supports(frame%supports, q(:3, 0), q(:3, 1), turn, w, r, b, c)
    if (frame%weights%act) then
      r(4:) = r(4:) - frame%weights%moment(turn, sums(:, 0))
      c(4:, 4:) = c(4:, 4:) + frame%weights%moment_stiffness(rotation, sums(:, 0))
    end if
    if (present(driven)) then
      call add_drive(driven%turn, driven%moving, driven%moved, r, m, b, c)
      r(4:) = r(4:) + driven%moved%motor
      lag = driven%turn
    end if
    if (present(loads)) call add_loads(loads, lag, rotation, r, c)
    ! derivatives with respect to dtheta'', dtheta', dtheta, and the moments T^T r along the directions of theta, since some of
    ! these directions may be locked. r excludes the remaining static moment, which foundation and guides carry
    c(:, 4:) = matmul(m(:, 4:), turning(:, :, 2)) + matmul(b(:, 4:), turning(:, :, 1)) + matmul(c(:, 4:), turning(:, :, 0))
    b(:, 4:) = 2 * matmul(m(:, 4:), turning(:, :, 1)) + matmul(b(:, 4:), turning(:, :, 0))
    m(:, 4:) = matmul(m(:, 4:), turning(:, :, 0))
    m(4:, :) = matmul(transpose(turning(:, :, 0)), m(4:, :))
    b(4:, :) = matmul(transpose(turning(:, :, 0)), b(4:, :))
    c(4:, :) = matmul(transpose(turning(:, :, 0)), c(4:, :))
    do i = 1, 3
      varied = turning_matrices(reshape([theta(:, 0), merge(1.0_dp, 0.0_dp, [1, 2, 3] == i), 0.0_dp, 0.0_dp, 0.0_dp], [3, 3]))
      c(4:, 3 + i) = c(4:, 3 + i) + matmul(transpose(varied(:, :, 1)), r(4:) - frame%weights%carried)
    end do
    r(4:) = matmul(transpose(turning(:, :, 0)), r(4:))
    if (frame%weights%act) r(4:) = r(4:) - matmul(frame%weights%carried, turning_less_one(theta(:, 0)))
    ! the foundation's potential is quadratic in u and theta
    stiffness = frame%foundation_stiffness(in_frame, in_frame)
    damping = frame%foundation_damping(in_frame, in_frame)
    r = r + matmul(stiffness, q(:, 0)) + matmul(damping, q(:, 1))
    b = b + damping
    c = c + stiffness
    if (drive%held_by == "flywheel" .and. present(driven)) call shift_time(driven%turn, w_d, driven%moved%rate &
      & + dot_product(driven%turn%b, w), turning, q, m, b, c)
  end subroutine vary

end module gestell_model_space_variation
