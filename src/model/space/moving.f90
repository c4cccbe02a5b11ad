!> Sums over the masses that determine the torque on the drive, as functions of the drive's angle phi, ' = d/dphi. The links have
!> centres of mass at r relative to F, inertia tensors J_i, and angular velocities w_i relative to the frame, all along the frame's
!> axes:
!>
!>     S = sum m r,   J = sum [m (|r|^2 1 - r r^T) + J_i],   A = sum [m r x r' + J_i w_i],   K = sum [m |r'|^2 + w_i J_i w_i].
module gestell_model_space_moving
  use gestell_base_kinds, only: dp
  use gestell_math_jet, only: jet
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_path, only: carried, direction
  use gestell_model_space_masses, only: plane_type
  use gestell_math_rotation, only: cross, identity, outer
  implicit none (type, external)
  private

  public :: find_moving

  !> The sums and their derivatives with respect to the drive's angle. `s`: S', S'', S''' (kg m), shape (3, 3). `j`: J', J'' (kg
  !> m^2), shape (3, 3, 2). `a`: A, A', A'' (kg m^2), shape (3, 0:2). `k`: K, K', K'' (kg m^2).
  type, public :: moving_type
    real(dp) :: s(3, 3) = 0, j(3, 3, 2) = 0, a(3, 0:2) = 0, k(0:2) = 0
  end type moving_type

contains

  !> Computes the sums S, J, A, K over the masses of all planes at one angle of the drive (rad).
  pure subroutine find_moving(planes, angle, moving)
    type(plane_type), intent(in) :: planes(:)
    real(dp), intent(in) :: angle
    type(moving_type), intent(out) :: moving
    type(point_type), allocatable :: at(:)
    type(point_type) :: center, along
    integer :: i, k

    do i = 1, size(planes)
      allocate(at(size(planes(i)%linkage%joints)))
      call planes(i)%linkage%points(angle, at)
      do k = 1, size(planes(i)%linkage%links)
        associate (link => planes(i)%linkage%links(k))
          if (link%to == 0) then
            along = point_type(jet(link%axis(1)), jet(link%axis(2)))
            center = carried(at(link%from), point_type(jet(1.0_dp), jet(0.0_dp)), link%center(1), link%center(2))
          else
            along = direction(at(link%from), at(link%to))
            center = carried(at(link%from), along, link%center(1), link%center(2))
          end if
        end associate
        call add_link(planes(i), k, center, along, moving)
      end do
      deallocate(at)
    end do
  end subroutine find_moving

  !> Adds link `k` of a plane to the sums. `center`: centre of mass of the link. `along`: direction of the link's axis in the plane.
  pure subroutine add_link(plane, k, center, along, moving)
    type(plane_type), intent(in) :: plane
    integer, intent(in) :: k
    type(point_type), intent(in) :: center, along
    type(moving_type), intent(inout) :: moving
    real(dp) :: r(3, 0:3), u(3, 0:3), v(3, 0:3), spin(0:2)
    integer :: i

    associate (q => plane%axes, link => plane%linkage%links(k))
      r = in_axes(q, center)
      r(:, 0) = r(:, 0) + plane%origin + link%z * q(:, 3)
      u = in_axes(q, along)
      do i = 0, 3
        v(:, i) = cross(q(:, 3), u(:, i))
      end do
      ! phi_i' = (u x u') n
      spin(0) = dot_product(v(:, 0), u(:, 1))
      spin(1) = dot_product(v(:, 0), u(:, 2))
      spin(2) = dot_product(v(:, 0), u(:, 3)) + dot_product(v(:, 1), u(:, 2))
      associate (m => link%mass, inertia => link%inertia)
        moving%s = moving%s + m * r(:, 1:)
        moving%j(:, :, 1) = moving%j(:, :, 1) + 2 * (link%along * symmetric(u(:, 0), u(:, 1)) &
          & + link%across * symmetric(v(:, 0), v(:, 1)) &
          & + m * (dot_product(r(:, 0), r(:, 1)) * identity() - symmetric(r(:, 0), r(:, 1))))
        moving%j(:, :, 2) = moving%j(:, :, 2) + 2 * (link%along * (symmetric(u(:, 0), u(:, 2)) + outer(u(:, 1), u(:, 1))) &
          & + link%across * (symmetric(v(:, 0), v(:, 2)) + outer(v(:, 1), v(:, 1))) &
          & + m * ((dot_product(r(:, 0), r(:, 2)) + dot_product(r(:, 1), r(:, 1))) * identity() - symmetric(r(:, 0), r(:, 2)) &
          & - outer(r(:, 1), r(:, 1))))
        moving%a(:, 0) = moving%a(:, 0) + m * cross(r(:, 0), r(:, 1)) + inertia * spin(0) * q(:, 3)
        moving%a(:, 1) = moving%a(:, 1) + m * cross(r(:, 0), r(:, 2)) + inertia * spin(1) * q(:, 3)
        moving%a(:, 2) = moving%a(:, 2) + m * (cross(r(:, 1), r(:, 2)) + cross(r(:, 0), r(:, 3))) + inertia * spin(2) * q(:, 3)
        moving%k(0) = moving%k(0) + m * dot_product(r(:, 1), r(:, 1)) + inertia * spin(0)**2
        moving%k(1) = moving%k(1) + 2 * (m * dot_product(r(:, 1), r(:, 2)) + inertia * spin(0) * spin(1))
        moving%k(2) = moving%k(2) + 2 * (m * (dot_product(r(:, 2), r(:, 2)) + dot_product(r(:, 1), r(:, 3))) &
          & + inertia * (spin(1)**2 + spin(0) * spin(2)))
      end associate
    end associate
  end subroutine add_link

  !> Converts a vector `p` of the plane, with its derivatives, to the frame's axes; shape (3, 0:3).
  pure function in_axes(axes, p) result(r)
    real(dp), intent(in) :: axes(3, 3)
    type(point_type), intent(in) :: p
    real(dp) :: r(3, 0:3)

    r = matmul(axes(:, :2), reshape([p%x%v, p%y%v, p%x%d, p%y%d, p%x%dd, p%y%dd, p%x%ddd, p%y%ddd], [2, 4]))
  end function in_axes

  !> Symmetric product (a b^T + b a^T)/2.
  pure function symmetric(a, b)
    real(dp), intent(in) :: a(3), b(3)
    real(dp) :: symmetric(3, 3)

    symmetric = (outer(a, b) + outer(b, a)) / 2
  end function symmetric

end module gestell_model_space_moving
