!> Forces of springs and dampers on a frame in space. The axes of a support either turn with the frame or have fixed directions.
!>
!> Let the frame have the displacement u, velocity v, rotation R and angular velocity w. The upper end of a support, attached to the
!> frame at p, then has the displacement d and the velocity d'. The support exerts the force F, with the moment M about the frame's
!> centre of mass, all along the fixed axes xi, eta, zeta:
!>
!>     d = u + (R - 1) p,   d' = v + w x R p,   F = -K d - B d',   M = R p x F.
!>
!> If the axes of the support turn with the frame, so do K = R K_0 R^T, B and the static force G on the ground, and the rate of d is
!> measured in the frame. With the vector y = u - p from the support's position at rest to the centre of mass,
!>
!>     d* = v - w x y,   F = -K d - B d* - R G,   M = -y x F.
!>
!> For a frame in the plane see gestell_model_exact_moved_mounting.
module gestell_model_space_mounting
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: cross
  use gestell_math_vectors, only: batch, blocks_type, cross, cross_matrix, steady, times, transposed
  use gestell_model_mounting, only: support_type
  use gestell_model_space_drive, only: moved_type
  implicit none (type, external)
  private

  public :: add_supports, find_matrices, support_force

contains

  !> Computes the matrices K and B of a support along the fixed axes at a batch of phases.
  pure subroutine find_matrices(support, moved, k, b)
    type(support_type), intent(in) :: support
    type(moved_type), intent(in) :: moved
    real(dp), dimension(batch, 3, 3), intent(out) :: k, b

    k = steady(matrix(support%stiffness))
    b = steady(matrix(support%damping))
    if (.not. support%turning) return
    k = times(moved%rotation, times(k, transposed(moved%rotation)))
    b = times(moved%rotation, times(b, transposed(moved%rotation)))

  contains

    !> Matrix along the frame's axes. `along`: stiffness or damping along each axis of the support.
    pure function matrix(along)
      real(dp), intent(in) :: along(3)
      real(dp) :: matrix(3, 3)

      matrix = matmul(support%axes * spread(along, 1, 3), transpose(support%axes))
    end function matrix

  end subroutine find_matrices

  !> Dynamic force of a support on the ground (N), without the static force at rest, along the fixed axes xi, eta, zeta. `k`, `b`:
  !> its matrices along these axes. `u`, `v`: displacement (m) and velocity (m/s) of the frame's centre of mass.
  pure function support_force(support, k, b, u, v, moved) result(force)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: k(batch, 3, 3), b(batch, 3, 3), u(batch, 3), v(batch, 3)
    type(moved_type), intent(in) :: moved
    real(dp), dimension(batch, 3) :: force, p, shift

    p = steady(support%position)
    shift = times(moved%less_one, p)
    if (support%turning) then
      force = times(k, u + shift) + times(b, v - cross(moved%w, u - p)) + times(moved%less_one, steady(support%static))
    else
      force = times(k, u + shift) + times(b, v + cross(moved%w, p + shift))
    end if
  end function support_force

  !> Subtracts the forces of the supports, and their moments about the frame's centre of mass, from the left sides of the balances
  !> of forces and moments, along the fixed axes, at a batch of phases. The derivatives of the left sides with respect to (u',
  !> dalpha') are added to b, those with respect to (u, dalpha) to c. Here dalpha is a small rotation about the fixed axes: it
  !> changes a vector r that is fixed in the frame by dalpha x r.
  pure subroutine add_supports(supports, u, v, moved, forces, moments, b, c)
    type(support_type), intent(in) :: supports(:)
    !> Displacement (m) and velocity (m/s) of the frame's centre of mass along the fixed axes
    real(dp), intent(in) :: u(batch, 3), v(batch, 3)
    type(moved_type), intent(in) :: moved
    real(dp), intent(inout) :: forces(batch, 3), moments(batch, 3)
    type(blocks_type), intent(inout) :: b, c
    real(dp) :: stiffness(batch, 3, 3), damping(batch, 3, 3), f(batch, 3)
    integer :: i

    do i = 1, size(supports)
      call find_matrices(supports(i), moved, stiffness, damping)
      f = support_force(supports(i), stiffness, damping, u, v, moved)
      forces = forces + f
      if (supports(i)%turning) then
        call add_in_frame(supports(i), stiffness, damping, f, u, v, moved, moments, b, c)
      else
        call add_in_space(supports(i), stiffness, damping, f, moved, moments, b, c)
      end if
    end do
  end subroutine add_supports

  !> Support whose axes have fixed directions. With its arm r = R p, displacement d = u + (R - 1) p and force f = K d + B d' on the
  !> ground,
  !>
  !>     dd = du - r x dalpha,   dd' = dv - r x dalpha' - r' x dalpha,   d(r x f) = r x df + f x (r x dalpha).
  pure subroutine add_in_space(support, k, d, f, moved, moments, b, c)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: k(batch, 3, 3), d(batch, 3, 3), f(batch, 3)
    type(moved_type), intent(in) :: moved
    real(dp), intent(inout) :: moments(batch, 3)
    type(blocks_type), intent(inout) :: b, c
    real(dp), dimension(batch, 3, 3) :: k_arm, d_arm, by_turn
    real(dp) :: arm(batch, 3)

    arm = times(moved%rotation, steady(support%position))
    k_arm = cross(k, arm)
    d_arm = cross(d, arm)
    by_turn = -k_arm - cross(d, cross(moved%w, arm))
    b%uu = b%uu + d
    c%uu = c%uu + k
    b%ua = b%ua - d_arm
    c%ua = c%ua + by_turn
    moments = moments + cross(arm, f)
    ! r x K = -(K x r)^T, because K is symmetric
    b%au = b%au - transposed(d_arm)
    c%au = c%au - transposed(k_arm)
    b%aa = b%aa - cross(arm, d_arm)
    c%aa = c%aa + cross(arm, by_turn) + cross(f, cross_matrix(arm))
  end subroutine add_in_space

  !> Support whose axes turn with the frame. Let K and B be along the fixed axes. With y and d* of the module's header, the force on
  !> the ground is f + G with f = K d + B d* + (R - 1) G, and its moment -y x (f + G);
  !>
  !>     df = K (du + y x dalpha) + B (dv - w x du + y x dalpha' + v x dalpha - w x (y x dalpha)) - (f + G) x dalpha.
  !>
  !> The left sides contain only the changes of the static force and of its moment from their values at rest in the frame's axes.
  pure subroutine add_in_frame(support, k, d, f, u, v, moved, moments, b, c)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: k(batch, 3, 3), d(batch, 3, 3), f(batch, 3), u(batch, 3), v(batch, 3)
    type(moved_type), intent(in) :: moved
    real(dp), intent(inout) :: moments(batch, 3)
    type(blocks_type), intent(inout) :: b, c
    real(dp), dimension(batch, 3, 3) :: by_place, by_spin, by_turn, load
    real(dp), dimension(batch, 3) :: y, static, of_static

    y = u - steady(support%position)
    static = steady(support%static)
    of_static = steady(cross(support%position, support%static))
    load = cross_matrix(f + static)
    by_place = k - cross(d, moved%w)
    by_spin = cross(d, y)
    by_turn = cross(k, y) + times(d, cross_matrix(v) - cross(moved%w, cross_matrix(y))) - load
    b%uu = b%uu + d
    c%uu = c%uu + by_place
    b%ua = b%ua + by_spin
    c%ua = c%ua + by_turn
    ! -y x (f + G) - R (p x G) without differences of nearly equal moments
    moments = moments - cross(y, f) - cross(u, static) - times(moved%less_one, of_static)
    b%au = b%au - cross(y, d)
    c%au = c%au - cross(y, by_place) + load
    b%aa = b%aa - cross(y, by_spin)
    c%aa = c%aa - cross(y, by_turn) + cross_matrix(times(moved%rotation, of_static))
  end subroutine add_in_frame

end module gestell_model_space_mounting
