!> The moving masses of planar mechanisms as a frame in space feels them. Of the places r = o + Q (x, y, z) of the links' centres of
!> mass about F, in the frame's axes, Q the axes of a mechanism, o its origin, and the links' tensors of inertia and angular
!> velocities,
!>
!>     S = sum m r,   J = sum [m (|r|^2 1 - r r^T) + J_i],   H = sum [m r x r' + J_i w_i],
!>
!> functions of the drive's angle phi, ' = d/dphi. A link of a plane keeps its z; its tensor has the axes along it, across it and
!> along the normal.
module gestell_model_space_masses
  use gestell_base_kinds, only: dp
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-)
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_path, only: carried, direction
  use gestell_model_linkage, only: linkage_type
  use gestell_model_space_rotation, only: cross, cross_matrix
  implicit none (type, external)
  private

  public :: sum_planes

  !> A linkage in a plane of its own.
  type, public :: plane_type
    type(linkage_type) :: linkage
    !> Q, whose third column is the normal; o (m).
    real(dp) :: axes(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3]), origin(3) = 0
  end type plane_type

  !> At an angle of the drive: S, S', S'' (kg m), shape (3, 0:2); J, J' (kg m^2), shape (3, 3, 0:1); H, H' (kg m^2), shape (3, 0:1).
  type, public :: masses_type
    real(dp) :: mass = 0, s(3, 0:2) = 0, j(3, 3, 0:1) = 0, h(3, 0:1) = 0
  end type masses_type

contains

  !> All planes at an angle of the drive (rad).
  pure subroutine sum_planes(planes, angle, masses)
    type(plane_type), intent(in) :: planes(:)
    real(dp), intent(in) :: angle
    type(masses_type), intent(out) :: masses
    type(masses_type) :: one
    integer :: i

    do i = 1, size(planes)
      call sum_plane(planes(i), angle, one)
      call add_placed(one, planes(i)%axes, planes(i)%origin, masses)
    end do
  end subroutine sum_planes

  !> One plane about the origin of its own axes.
  pure subroutine sum_plane(plane, angle, sums)
    type(plane_type), intent(in) :: plane
    real(dp), intent(in) :: angle
    type(masses_type), intent(out) :: sums
    type(point_type) :: at(size(plane%linkage%joints)), center, u
    type(jet) :: xx, yy, xy, cc, ss, cs
    real(dp) :: rate, turn
    integer :: i

    call plane%linkage%points(angle, at)
    do i = 1, size(plane%linkage%links)
      associate (link => plane%linkage%links(i), z => plane%linkage%links(i)%z, along => plane%linkage%links(i)%along, &
        & across => plane%linkage%links(i)%across)
        if (link%to == 0) then
          u = point_type(jet(link%axis(1)), jet(link%axis(2)))
          center = point_type(at(link%from)%x + link%center(1), at(link%from)%y + link%center(2))
        else
          u = direction(at(link%from), at(link%to))
          center = carried(at(link%from), u, link%center(1), link%center(2))
        end if
        rate = u%x%v * u%y%d - u%y%v * u%x%d
        turn = u%x%v * u%y%dd - u%y%v * u%x%dd
        sums%mass = sums%mass + link%mass
        sums%s(:, 0) = sums%s(:, 0) + link%mass * [center%x%v, center%y%v, z]
        sums%s(:2, 1) = sums%s(:2, 1) + link%mass * [center%x%d, center%y%d]
        sums%s(:2, 2) = sums%s(:2, 2) + link%mass * [center%x%dd, center%y%dd]
        cc = u%x * u%x
        ss = u%y * u%y
        cs = u%x * u%y
        xx = link%mass * (center%y * center%y + z**2) + along * cc + across * ss
        yy = link%mass * (center%x * center%x + z**2) + along * ss + across * cc
        xy = (along - across) * cs - link%mass * (center%x * center%y)
        call add_tensor(xx, yy, xx + yy + jet(-2 * link%mass * z**2 - along - across + link%inertia), xy, &
          & (-link%mass * z) * center%x, (-link%mass * z) * center%y, sums%j)
        sums%h(:, 0) = sums%h(:, 0) + [-link%mass * z * center%y%d, link%mass * z * center%x%d, &
          & link%mass * (center%x%v * center%y%d - center%y%v * center%x%d) + link%inertia * rate]
        sums%h(:, 1) = sums%h(:, 1) + [-link%mass * z * center%y%dd, link%mass * z * center%x%dd, &
          & link%mass * (center%x%v * center%y%dd - center%y%v * center%x%dd) + link%inertia * turn]
      end associate
    end do
  end subroutine sum_plane

  pure subroutine add_tensor(xx, yy, zz, xy, xz, yz, j)
    type(jet), intent(in) :: xx, yy, zz, xy, xz, yz
    real(dp), intent(inout) :: j(3, 3, 0:1)

    j(:, :, 0) = j(:, :, 0) + reshape([xx%v, xy%v, xz%v, xy%v, yy%v, yz%v, xz%v, yz%v, zz%v], [3, 3])
    j(:, :, 1) = j(:, :, 1) + reshape([xx%d, xy%d, xz%d, xy%d, yy%d, yz%d, xz%d, yz%d, zz%d], [3, 3])
  end subroutine add_tensor

  !> Adds the sums of a plane with these axes at `origin` to those about F.
  pure subroutine add_placed(plane, axes, origin, sums)
    type(masses_type), intent(in) :: plane
    real(dp), intent(in) :: axes(3, 3), origin(3)
    type(masses_type), intent(inout) :: sums
    real(dp) :: s(3, 0:2)
    integer :: k

    s = matmul(axes, plane%s)
    sums%mass = sums%mass + plane%mass
    sums%j(:, :, 0) = sums%j(:, :, 0) - plane%mass * matmul(cross_matrix(origin), cross_matrix(origin))
    do k = 0, 1
      ! [o + q]^T [o + q], summed
      sums%j(:, :, k) = sums%j(:, :, k) + matmul(axes, matmul(plane%j(:, :, k), transpose(axes))) &
        & - matmul(cross_matrix(origin), cross_matrix(s(:, k))) - matmul(cross_matrix(s(:, k)), cross_matrix(origin))
      sums%h(:, k) = sums%h(:, k) + matmul(axes, plane%h(:, k)) + cross(origin, s(:, k + 1))
    end do
    s(:, 0) = s(:, 0) + plane%mass * origin
    sums%s = sums%s + s
  end subroutine add_placed

end module gestell_model_space_masses
