!> Forces of springs and dampers on a frame in space. The axes of a support either turn with the frame or have fixed directions.
!>
!> Let the frame have the displacement u, velocity v, rotation R and angular velocity w. The upper end of a support, attached to the
!> frame at p, then has the displacement d and the velocity d'. The support exerts the force F, with the moment M about the frame's
!> centre of mass,
!>
!>     d = u + (R - 1) p,   d' = v + R (w x p),   F = -K d - B d',   M = p x R^T F.
!>
!> Forces are along the fixed axes xi, eta, zeta, moments along the frame's axes. If the axes of the support turn with the frame,
!> displacement and rate are measured in the frame. With the vector y = R^T (u - p) from the support's position at rest to the
!> centre of mass,
!>
!>     e = R^T d = p + y,   e' = R^T v - w x y,   f = K e + B e' + G,   F = -R f,   M = y x f,
!>
!> where the static force G on the ground turns with the axes. For a frame in the plane see gestell_model_exact_moved_mounting.
module gestell_model_space_mounting
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: cross, cross_matrix, identity
  use gestell_model_mounting, only: support_type
  implicit none (type, external)
  private

  public :: add_supports, support_force

contains

  !> Dynamic force of a support on the ground (N), without the static force, along the fixed axes xi, eta, zeta. `turn` is R - 1
  !> with the rotation matrix R, so that R x = x + turn x.
  pure function support_force(support, u, v, turn, w) result(force)
    type(support_type), intent(in) :: support
    !> `u`, `v`: displacement (m) and velocity (m/s) of the frame's centre of mass along the fixed axes xi, eta, zeta. `turn`: R -
    !> 1 with the rotation matrix R. `w`: angular velocity along the frame's axes (rad/s)
    real(dp), intent(in) :: u(3), v(3), turn(3, 3), w(3)
    real(dp) :: force(3), d(3), e(3), e_d(3)

    associate (p => support%position)
      d = u + matmul(turn, p)
      if (support%turning) then
        e = d + matmul(d, turn)
        e_d = v + matmul(v, turn) - cross(w, e - p)
        force = mount_force(support, e, e_d)
        force = force + matmul(turn, force + support%static)
      else
        e_d = cross(w, p)
        force = mount_force(support, d, v + e_d + matmul(turn, e_d))
      end if
    end associate
  end function support_force

  !> Force K d + B d' (N).
  pure function mount_force(support, d, d_d) result(force)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: d(3), d_d(3)
    real(dp) :: force(3)

    force = matmul(support%axes, support%stiffness * matmul(d, support%axes) + support%damping * matmul(d_d, support%axes))
  end function mount_force

  !> Subtracts the forces of the supports, and their moments about the frame's centre of mass, from the left sides r, shape (6).
  !> The derivatives of forces and moments with respect to u' and dalpha' are subtracted from b, those with respect to u and
  !> dalpha from c, shapes (6, 6). Here dalpha is a small rotation about the frame's axes: it changes the rotation matrix R by R
  !> [dalpha], and the angular velocity w by dalpha' + w x dalpha.
  pure subroutine add_supports(supports, u, v, turn, w, r, b, c)
    type(support_type), intent(in) :: supports(:)
    !> As in `support_force`
    real(dp), intent(in) :: u(3), v(3), turn(3, 3), w(3)
    real(dp), intent(inout) :: r(6), b(6, 6), c(6, 6)
    integer :: i

    do i = 1, size(supports)
      if (supports(i)%turning) then
        call add_in_frame(supports(i), u, v, turn, w, r, b, c)
      else
        call add_in_space(supports(i), u, v, turn, w, r, b, c)
      end if
    end do
  end subroutine add_supports

  pure subroutine add_in_space(support, u, v, turn, w, r, b, c)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: u(3), v(3), turn(3, 3), w(3)
    real(dp), intent(inout) :: r(6), b(6, 6), c(6, 6)
    real(dp) :: k(3, 3), d(3, 3), f(3), arm(3), by_turn(3, 3), by_spin(3, 3), back(3, 3), rotation(3, 3)

    rotation = turn + identity()
    associate (p => support%position)
      k = matrix(support, support%stiffness)
      d = matrix(support, support%damping)
      arm = cross(w, p)
      f = -matmul(k, u + matmul(turn, p)) - matmul(d, v + matmul(rotation, arm))
      ! d d = d u + R (dalpha x p), d d' = d v + R (dalpha x (w x p) + (dalpha' + w x dalpha) x p)
      by_spin = -matmul(rotation, cross_matrix(p))
      by_turn = -matmul(rotation, cross_matrix(arm) + matmul(cross_matrix(p), cross_matrix(w)))
      by_turn = matmul(k, by_spin) + matmul(d, by_turn)              ! of -F
      by_spin = matmul(d, by_spin)
      r(:3) = r(:3) - f
      c(:3, :3) = c(:3, :3) + k
      b(:3, :3) = b(:3, :3) + d
      c(:3, 4:) = c(:3, 4:) + by_turn
      b(:3, 4:) = b(:3, 4:) + by_spin
      ! M = p x R^T F: dM = p x (R^T dF - dalpha x R^T F)
      f = matmul(f, rotation)
      back = matmul(cross_matrix(p), transpose(rotation))
      r(4:) = r(4:) - cross(p, f)
      c(4:, :3) = c(4:, :3) + matmul(back, k)
      b(4:, :3) = b(4:, :3) + matmul(back, d)
      c(4:, 4:) = c(4:, 4:) + matmul(back, by_turn) - matmul(cross_matrix(p), cross_matrix(f))
      b(4:, 4:) = b(4:, 4:) + matmul(back, by_spin)
    end associate
  end subroutine add_in_space

  !> Subtracts the force and moment of one support whose axes turn with the frame, and their derivatives, from r, b and c;
  !> `add_supports` calls it for each of these supports. With y and e as in the header of this module, dy = R^T du + y x dalpha and
  !> de' = R^T dv - w x R^T du + y x dalpha' + e' x dalpha. The left sides r contain only the changes of the static force and of its
  !> moment from their values at rest.
  pure subroutine add_in_frame(support, u, v, turn, w, r, b, c)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: u(3), v(3), turn(3, 3), w(3)
    real(dp), intent(inout) :: r(6), b(6, 6), c(6, 6)
    real(dp), dimension(3, 3) :: k, d, arm, load, rotation, back, by_place, by_speed, by_turn, by_spin
    real(dp) :: y(3), e(3), e_d(3), f(3)

    k = matrix(support, support%stiffness)
    d = matrix(support, support%damping)
    rotation = turn + identity()
    back = transpose(rotation)
    e = matmul(back, u + matmul(turn, support%position))
    y = e - support%position
    e_d = matmul(back, v) - cross(w, y)
    f = matmul(k, e) + matmul(d, e_d)
    arm = cross_matrix(y)
    load = cross_matrix(f + support%static)
    ! derivatives of f
    by_place = matmul(k, back) - matmul(d, matmul(cross_matrix(w), back))
    by_speed = matmul(d, back)
    by_turn = matmul(k, arm) + matmul(d, cross_matrix(e_d))
    by_spin = matmul(d, arm)
    ! -F = R f, minus G, which balances the weights at rest: d(R f) = R (df + dalpha x f)
    r(:3) = r(:3) + matmul(rotation, f) + matmul(turn, support%static)
    c(:3, :3) = c(:3, :3) + matmul(rotation, by_place)
    b(:3, :3) = b(:3, :3) + matmul(rotation, by_speed)
    c(:3, 4:) = c(:3, 4:) + matmul(rotation, by_turn - load)
    b(:3, 4:) = b(:3, 4:) + matmul(rotation, by_spin)
    ! -M = f x y, minus its value G x y at rest, where y = -p
    r(4:) = r(4:) - cross(y, f) - cross(e, support%static)
    c(4:, :3) = c(4:, :3) + matmul(load, back) - matmul(arm, by_place)
    b(4:, :3) = b(4:, :3) - matmul(arm, by_speed)
    c(4:, 4:) = c(4:, 4:) + matmul(load, arm) - matmul(arm, by_turn)
    b(4:, 4:) = b(4:, 4:) - matmul(arm, by_spin)
  end subroutine add_in_frame

  !> Matrix K or B of a support along the frame's axes. `k`: stiffness or damping along each axis of the support.
  pure function matrix(support, k)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: k(3)
    real(dp) :: matrix(3, 3)

    matrix = matmul(support%axes * spread(k, 1, 3), transpose(support%axes))
  end function matrix

end module gestell_model_space_mounting
