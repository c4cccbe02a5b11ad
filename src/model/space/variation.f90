!> A frame in space linearised about one of its motions: the exact equations of gestell_model_space and their derivatives, at a
!> batch of phases, along the fixed axes.
!>
!> Let dalpha be a small rotation of the frame about the fixed axes: it changes the rotation matrix R by [dalpha] R, where [dalpha]
!> is the matrix of the cross product. Along the fixed axes the masses have the first moment Z = R S, the inertia tensor R J R^T,
!> which is J from here on, and the angular momentum L = J w + R H. The rotation changes them by
!>
!>     dZ = dalpha x Z,   dL = dalpha x L + J dalpha'.
!>
!> The left sides of the balances of momentum and angular momentum and their derivatives are therefore
!>
!>     m u'' + Z'',       m du'' + (dalpha x Z)'',
!>     L' + Z x u'',      (dalpha x L + J dalpha')' + (dalpha x Z) x u'' + Z x du''.
!>
!> A change dtheta of the rotation vector means, with the matrix T of gestell_math_rotation, dalpha = T^T dtheta. The moments along
!> the directions of theta are T L' + ..., because some of these directions may be locked.
module gestell_model_space_variation
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: find_turning_gradient, turning_less_one
  use gestell_math_vectors, only: batch, blocks_type, cross, cross_matrix, element, in_batch, scaled, steady, times, &
    & transposed, unit_matrix
  use gestell_model_mounting, only: damping_matrix, in_frame, in_space, stiffness_matrix, support_type, turned_loads
  use gestell_model_mounting_mounted, only: mounted_system
  use gestell_model_space, only: space_type
  use gestell_model_space_drive, only: add_drive, follow_frame, moved_type, rotate_frame, shift_time
  use gestell_model_space_loads, only: add_loads, count_loads, find_loads, space_load_type
  use gestell_model_space_masses, only: along_fixed_axes, fixed_masses_type, masses_type
  use gestell_model_space_mounting, only: add_supports, find_matrices, support_force
  implicit none (type, external)
  private

  public :: force_excess, ground_in_space, sample_varied

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
    type(fixed_masses_type) :: fixed
    type(moved_type) :: moved
    type(blocks_type) :: of_a, of_v, of_q
    real(dp), dimension(batch, 3, 0:2) :: u, theta
    real(dp) :: forces(batch, 3), moments(batch, 3)
    integer, parameter :: shifts(3) = in_frame(:3), turns(3) = in_frame(4:)
    integer :: at(batch), first, last, i, k

    if (.not. space%drive%uniform_in_space()) call space%masses_at(frame%mass, angles, masses)
    do first = 1, size(angles), batch
      last = min(first + batch - 1, size(angles))
      at = in_batch(first, size(angles))
      do i = 1, 3
        u(:, i, 0) = q(at, shifts(i))
        u(:, i, 1) = v(at, shifts(i))
        u(:, i, 2) = a(at, shifts(i))
        theta(:, i, 0) = q(at, turns(i))
        theta(:, i, 1) = v(at, turns(i))
        theta(:, i, 2) = a(at, turns(i))
      end do
      call follow_frame(space%drive, frame%speed, u(:, :, 2) - steady(frame%weights%gravity), theta, moved, lag(at, :))
      if (space%drive%uniform_in_space()) then
        call space%masses_at(frame%mass, angles(at) - moved%chi(:, 0), masses)
        call along_fixed_axes(masses, 1, moved%rotation, fixed)
      else
        call along_fixed_axes(masses, first, moved%rotation, fixed)
      end if
      call vary(frame, space, angles(at) - moved%chi(:, 0), fixed, moved, u, theta, forces, moments, of_a, of_v, of_q)
      do i = 1, 3
        r(first:last, shifts(i)) = forces(:last - first + 1, i)
        r(first:last, turns(i)) = moments(:last - first + 1, i)
      end do
      call store(of_a, first, last, m)
      call store(of_v, first, last, b)
      call store(of_q, first, last, c)
    end do
    ! the foundation's potential is quadratic in u and theta
    do k = 1, 6
      do i = 1, 6
        r(:, i) = r(:, i) + frame%foundation_stiffness(i, k) * q(:, k) + frame%foundation_damping(i, k) * v(:, k)
        b(:, i, k) = b(:, i, k) + frame%foundation_damping(i, k)
        c(:, i, k) = c(:, i, k) + frame%foundation_stiffness(i, k)
      end do
    end do
  end subroutine sample_varied

  !> Stores the matrices of a batch of phases, number `first` to `last`, in the frame's order of degrees of freedom.
  pure subroutine store(blocks, first, last, matrices)
    type(blocks_type), intent(in) :: blocks
    integer, intent(in) :: first, last
    real(dp), intent(inout) :: matrices(:, :, :)
    real(dp) :: a(batch)
    integer :: i, k

    do k = 1, 6
      do i = 1, 6
        a = element(blocks, in_space(i), in_space(k))
        matrices(first:last, i, k) = a(:last - first + 1)
      end do
    end do
  end subroutine store

  !> Forces (N) on the ground along the fixed axes xi, eta, zeta, and their moments (N m) about the rest position of the frame's
  !> centre of mass, in the frame's order, shape (6, points). `q`, `v`: motion, shape (points, 6).
  pure function ground_in_space(frame, q, v) result(forces)
    class(mounted_system), intent(in) :: frame
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp) :: forces(6, size(q, 1))

    forces = matmul(frame%foundation_stiffness, transpose(q)) + matmul(frame%foundation_damping, transpose(v)) &
      & + supported(frame%supports, q, v)
  end function ground_in_space

  !> Part of the forces of `ground_in_space` that some supports exert. The force of a support acts at its displaced upper end, or at
  !> the rest position of this end if the axes turn with the frame.
  pure function supported(supports, q, v) result(forces)
    type(support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp) :: forces(6, size(q, 1)), theta(batch, 3, 0:2)
    real(dp), dimension(batch, 3) :: u, u_d, force, moment, f, arm
    real(dp), dimension(batch, 3, 3) :: k, b
    type(moved_type) :: moved
    integer :: at(batch), first, n, i

    theta = 0
    do first = 1, size(q, 1), batch
      at = in_batch(first, size(q, 1))
      do i = 1, 3
        u(:, i) = q(at, in_frame(i))
        u_d(:, i) = v(at, in_frame(i))
        theta(:, i, 0) = q(at, in_frame(3 + i))
        theta(:, i, 1) = v(at, in_frame(3 + i))
      end do
      call rotate_frame(theta, moved)
      force = 0
      moment = 0
      do i = 1, size(supports)
        call find_matrices(supports(i), moved, k, b)
        f = support_force(supports(i), k, b, u, u_d, moved)
        arm = steady(supports(i)%position)
        if (.not. supports(i)%turning) arm = u + arm + times(moved%less_one, arm)
        force = force + f
        moment = moment + cross(arm, f)
      end do
      n = min(batch, size(q, 1) - first + 1)
      do i = 1, 3
        forces(in_frame(i), at(:n)) = force(:n, i)
        forces(in_frame(3 + i), at(:n)) = moment(:n, i)
      end do
    end do
  end function supported

  !> Nonlinear part of the forces on the ground (N) of the supports whose axes turn with the frame, three components for each
  !> support, shape (components, points). `q`, `v`: motion in the frame's order, shape (6, points).
  pure function force_excess(frame, q, v) result(excess)
    class(mounted_system), intent(in) :: frame
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp) :: excess(3 * count(frame%supports%turning), size(q, 2)), forces(6, size(q, 2))
    integer :: i, n

    n = 0
    do i = 1, size(frame%supports)
      if (.not. frame%supports(i)%turning) cycle
      associate (support => frame%supports(i:i))
        forces = supported(support, transpose(q), transpose(v)) - matmul(stiffness_matrix(support, 6) + turned_loads(support, 6), &
          & q) - matmul(damping_matrix(support, 6), v)
      end associate
      excess(n + 1:n + 3, :) = forces(in_frame(:3), :)
      n = n + 3
    end do
  end function force_excess

  !> Computes the left sides of the exact equations without the foundation, forces and moments along theta, and their derivatives m,
  !> b, c with respect to the second and first derivatives of (u, theta) and to (u, theta).
  pure subroutine vary(frame, space, angles, masses, moved, u, theta, forces, moments, m, b, c)
    class(mounted_system), intent(in) :: frame
    type(space_type), intent(in) :: space
    !> Angles of the mechanisms (rad)
    real(dp), intent(in) :: angles(batch)
    type(fixed_masses_type), intent(in) :: masses
    type(moved_type), intent(in) :: moved
    !> Displacement and rotation vector of the frame, with their first and second derivatives
    real(dp), dimension(batch, 3, 0:2), intent(in) :: u, theta
    real(dp), intent(out) :: forces(batch, 3), moments(batch, 3)
    type(blocks_type), intent(out) :: m, b, c
    real(dp), dimension(batch, 3) :: z, z_d, z_dd, h, h_d, l, l_d
    real(dp), dimension(batch, 3, 3) :: j, j_d

    associate (w => moved%w, w_d => moved%w_d, u_dd => u(:, :, 2), rate => moved%rate, gain => moved%gain)
      ! time derivatives of quantities that are fixed in the frame but for the drive's angle
      z = masses%s(:, :, 0)
      z_d = scaled(rate, masses%s(:, :, 1))
      z_dd = scaled(rate**2, masses%s(:, :, 2)) + scaled(gain, masses%s(:, :, 1)) + 2 * cross(w, z_d) + cross(w_d, z) &
        & + cross(w, cross(w, z))
      z_d = z_d + cross(w, z)
      h = scaled(rate, masses%h(:, :, 0)) + moved%spin
      h_d = scaled(rate**2, masses%h(:, :, 1)) + scaled(gain, masses%h(:, :, 0)) + cross(w, h)
      j = masses%j(:, :, :, 0)
      j_d = cross(w, j)
      j_d = scaled(rate, masses%j(:, :, :, 1)) + j_d + transposed(j_d)
      l = times(j, w) + h
      l_d = times(j, w_d) + times(j_d, w) + h_d
      forces = masses%mass * u_dd + z_dd
      moments = l_d + cross(z, u_dd) + moved%motor
      m%uu = unit_matrix(spread(masses%mass, 1, batch))
      m%ua = -cross_matrix(z)
      m%au = cross_matrix(z)
      m%aa = j
      b%uu = 0
      b%ua = -2 * cross_matrix(z_d)
      b%au = 0
      b%aa = j_d - cross_matrix(l)
      c%uu = 0
      c%ua = -cross_matrix(z_dd)
      c%au = 0
      c%aa = cross(u_dd, cross_matrix(z)) - cross_matrix(l_d + moved%motor)
      call add_supports(frame%supports, u(:, :, 0), u(:, :, 1), moved, forces, moments, b, c)
      if (frame%weights%act) call frame%weights%add_moment(moved%rotation, moved%less_one, z, moments, c%aa)
    end associate
    if (space%drive%uniform_in_space()) call add_drive(moved, masses, moments, m, b, c)
    if (count_loads(space%planes) > 0) call add_loads_at_phases(space, angles, moved, forces, moments, c)
    call take_theta(frame, moved, theta, moments, m, b, c)
    if (space%drive%held_by == "flywheel") call shift_time(moved, u, theta, m, b, c)
  end subroutine vary

  !> Adds the effect of the loads to the left sides and their derivatives.
  pure subroutine add_loads_at_phases(space, angles, moved, forces, moments, c)
    type(space_type), intent(in) :: space
    real(dp), intent(in) :: angles(batch)
    type(moved_type), intent(in) :: moved
    real(dp), intent(inout) :: forces(batch, 3), moments(batch, 3)
    type(blocks_type), intent(inout) :: c
    type(space_load_type) :: loads(count_loads(space%planes))
    real(dp) :: r(6), by_turn(6, 6), b(3), bend(3, 3), rotation(3, 3)
    integer :: k

    do k = 1, batch
      r = 0
      by_turn = 0
      b = moved%b(k, :)
      bend = moved%bend(k, :, :)
      rotation = moved%rotation(k, :, :)
      call find_loads(space%planes, angles(k), loads)
      call add_loads(loads, b, bend, rotation, r, by_turn)
      forces(k, :) = forces(k, :) + r(:3)
      moments(k, :) = moments(k, :) + r(4:)
      c%ua(k, :, :) = c%ua(k, :, :) + by_turn(:3, 4:)
      c%aa(k, :, :) = c%aa(k, :, :) + by_turn(4:, 4:)
    end do
  end subroutine add_loads_at_phases

  !> Replaces dalpha by T^T dtheta, and the moments along the fixed axes by those along the directions of theta. The moments do not
  !> contain the static moment that foundation and guides carry.
  pure subroutine take_theta(frame, moved, theta, moments, m, b, c)
    class(mounted_system), intent(in) :: frame
    type(moved_type), intent(in) :: moved
    real(dp), intent(in) :: theta(batch, 3, 0:2)
    real(dp), intent(inout) :: moments(batch, 3)
    type(blocks_type), intent(inout) :: m, b, c
    real(dp) :: gradient(batch, 3, 3), own(3)
    integer :: k

    associate (t => moved%turning(:, :, :, 0), t_d => moved%turning(:, :, :, 1), t_dd => moved%turning(:, :, :, 2))
      c%ua = times(c%ua, t) + times(b%ua, t_d) + times(m%ua, t_dd)
      c%aa = times(c%aa, t) + times(b%aa, t_d) + times(m%aa, t_dd)
      b%ua = times(b%ua, t) + 2 * times(m%ua, t_d)
      b%aa = times(b%aa, t) + 2 * times(m%aa, t_d)
      m%ua = times(m%ua, t)
      m%aa = times(m%aa, t)
      call find_turning_gradient(batch, theta, moments, gradient)
      associate (of_moments => transposed(t))
        m%au = times(of_moments, m%au)
        b%au = times(of_moments, b%au)
        c%au = times(of_moments, c%au)
        m%aa = times(of_moments, m%aa)
        b%aa = times(of_moments, b%aa)
        c%aa = times(of_moments, c%aa) + gradient
        moments = times(of_moments, moments)
      end associate
    end associate
    if (.not. any(abs(frame%weights%carried) > 0)) return
    do k = 1, batch
      own = theta(k, :, 0)
      moments(k, :) = moments(k, :) - matmul(frame%weights%carried, turning_less_one(own))
    end do
    ! the matrix T^T of theta is the matrix T of -theta
    call find_turning_gradient(batch, -theta(:, :, 0), steady(frame%weights%carried), gradient)
    c%aa = c%aa + gradient
  end subroutine take_theta

end module gestell_model_space_variation
