!> What holds a frame in space: springs and dampers along axes that stay in space.
module gestell_model_space_mounting
  use gestell_base_kinds, only: dp
  use gestell_model_space_rotation, only: cross, cross_matrix
  implicit none (type, external)
  private

  public :: add_supports, support_force, support_matrix

  !> Springs and dampers at `position` in the frame's axes (m), along the three columns of `axes`.
  type, public :: space_support_type
    real(dp) :: position(3) = 0, stiffness(3) = 0, damping(3) = 0
    real(dp) :: axes(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
  end type space_support_type

contains

  !> Of small motions (u, theta), shape (6, 6): sum of k g g^T, g = (n, p x n), over the three axes of a support with the numbers
  !> `k` along them.
  pure function support_matrix(support, k) result(c)
    type(space_support_type), intent(in) :: support
    real(dp), intent(in) :: k(3)
    real(dp) :: c(6, 6), g(6)
    integer :: i

    c = 0
    do i = 1, 3
      g = [support%axes(:, i), cross(support%position, support%axes(:, i))]
      c = c + k(i) * spread(g, 2, 6) * spread(g, 1, 6)
    end do
  end function support_matrix

  !> The force of a support on the ground, -F below, along axes in space (N).
  pure function support_force(support, u, v, rotation, w) result(force)
    type(space_support_type), intent(in) :: support
    real(dp), intent(in) :: u(3), v(3), rotation(3, 3), w(3)
    real(dp) :: force(3)

    associate (axes => support%axes, p => support%position)
      force = matmul(axes, support%stiffness * matmul(u + matmul(rotation, p) - p, axes) &
        & + support%damping * matmul(v + matmul(rotation, cross(w, p)), axes))
    end associate
  end function support_force

  !> Subtracts force and moment about F of the supports on a frame from r, shape (6), and their derivatives from b and c, shape
  !> (6, 6): with the frame's displacement u, velocity v, axes R, angular velocity w, the head of a support has moved by
  !>
  !>     d = u + (R - 1) p,   d' = v + R (w x p),   F = -K d - B d',   M = p x R^T F,
  !>
  !> forces along axes in space, moments along those of the frame. Changes: of u; of R by R [dalpha], so that dw = dalpha' + w x
  !> dalpha.
  pure subroutine add_supports(supports, u, v, rotation, w, r, b, c)
    type(space_support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: u(3), v(3), rotation(3, 3), w(3)
    real(dp), intent(inout) :: r(6), b(6, 6), c(6, 6)
    real(dp) :: k(3, 3), d(3, 3), f(3), arm(3), by_turn(3, 3), by_spin(3, 3), back(3, 3)
    integer :: i

    back = transpose(rotation)
    do i = 1, size(supports)
      associate (s => supports(i), p => supports(i)%position)
        k = matmul(s%axes * spread(s%stiffness, 1, 3), transpose(s%axes))
        d = matmul(s%axes * spread(s%damping, 1, 3), transpose(s%axes))
        arm = cross(w, p)
        f = -matmul(k, u + matmul(rotation, p) - p) - matmul(d, v + matmul(rotation, arm))
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
        f = matmul(back, f)
        back = matmul(cross_matrix(p), back)
        r(4:) = r(4:) - cross(p, f)
        c(4:, :3) = c(4:, :3) + matmul(back, k)
        b(4:, :3) = b(4:, :3) + matmul(back, d)
        c(4:, 4:) = c(4:, 4:) + matmul(back, by_turn) - matmul(cross_matrix(p), cross_matrix(f))
        b(4:, 4:) = b(4:, 4:) + matmul(back, by_spin)
        back = transpose(rotation)
      end associate
    end do
  end subroutine add_supports

end module gestell_model_space_mounting
