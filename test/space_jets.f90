!> The moving masses of a frame in space at one angle, by jets and link by link about F.
module space_jets
  use gestell_base_kinds, only: dp
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_path, only: carried, direction
  use gestell_model_space_masses, only: masses_type, new_masses, plane_type
  use gestell_math_rotation, only: cross
  implicit none (type, external)
  private

  public :: sums_by_jets

contains

  subroutine sums_by_jets(planes, angle, sums)
    type(plane_type), intent(in) :: planes(:)
    real(dp), intent(in) :: angle
    type(masses_type), intent(out) :: sums
    type(point_type), allocatable :: at(:)
    integer :: i, k

    call new_masses(1, sums)
    do i = 1, size(planes)
      allocate(at(size(planes(i)%linkage%joints)))
      call planes(i)%linkage%points(angle, at)
      do k = 1, size(planes(i)%linkage%links)
        call add_link(planes(i), k, at, sums)
      end do
      deallocate(at)
    end do
  end subroutine sums_by_jets

  subroutine add_link(plane, k, at, sums)
    type(plane_type), intent(in) :: plane
    integer, intent(in) :: k
    type(point_type), intent(in) :: at(:)
    type(masses_type), intent(inout) :: sums
    type(point_type) :: center, u
    real(dp) :: r(3, 0:2), axes(3, 3, 0:1), moments(3), rate, turn
    integer :: i

    associate (link => plane%linkage%links(k))
      if (link%to == 0) then
        center = point_type(at(link%from)%x, at(link%from)%y)
        center%x%v = center%x%v + link%center(1)
        center%y%v = center%y%v + link%center(2)
        u%x%v = link%axis(1)
        u%y%v = link%axis(2)
      else
        u = direction(at(link%from), at(link%to))
        center = carried(at(link%from), u, link%center(1), link%center(2))
      end if
      r(:, 0) = plane%origin + matmul(plane%axes, [center%x%v, center%y%v, link%z])
      r(:, 1) = matmul(plane%axes, [center%x%d, center%y%d, 0.0_dp])
      r(:, 2) = matmul(plane%axes, [center%x%dd, center%y%dd, 0.0_dp])
      axes(:, :, 0) = matmul(plane%axes, reshape([u%x%v, u%y%v, 0.0_dp, -u%y%v, u%x%v, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp], [3, 3]))
      axes(:, :, 1) = matmul(plane%axes, reshape([u%x%d, u%y%d, 0.0_dp, -u%y%d, u%x%d, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp], [3, 3]))
      rate = u%x%v * u%y%d - u%y%v * u%x%d
      turn = u%x%v * u%y%dd - u%y%v * u%x%dd
      moments = [link%along, link%across, link%inertia]
      sums%mass = sums%mass + link%mass
      sums%s(1, :, :) = sums%s(1, :, :) + link%mass * r
      do i = 1, 3
        sums%j(1, :, :, 0) = sums%j(1, :, :, 0) + moments(i) * outer(axes(:, i, 0), axes(:, i, 0))
        sums%j(1, :, :, 1) = sums%j(1, :, :, 1) + moments(i) * (outer(axes(:, i, 1), axes(:, i, 0)) &
          & + outer(axes(:, i, 0), axes(:, i, 1)))
        sums%j(1, i, i, 0) = sums%j(1, i, i, 0) + link%mass * dot_product(r(:, 0), r(:, 0))
        sums%j(1, i, i, 1) = sums%j(1, i, i, 1) + 2 * link%mass * dot_product(r(:, 0), r(:, 1))
      end do
      sums%j(1, :, :, 0) = sums%j(1, :, :, 0) - link%mass * outer(r(:, 0), r(:, 0))
      sums%j(1, :, :, 1) = sums%j(1, :, :, 1) - link%mass * (outer(r(:, 1), r(:, 0)) + outer(r(:, 0), r(:, 1)))
      sums%h(1, :, 0) = sums%h(1, :, 0) + link%mass * cross(r(:, 0), r(:, 1)) + link%inertia * rate * axes(:, 3, 0)
      sums%h(1, :, 1) = sums%h(1, :, 1) + link%mass * cross(r(:, 0), r(:, 2)) + link%inertia * turn * axes(:, 3, 0)
    end associate
  end subroutine add_link

  pure function outer(a, b)
    real(dp), intent(in) :: a(3), b(3)
    real(dp) :: outer(3, 3)

    outer = spread(a, 2, 3) * spread(b, 1, 3)
  end function outer

end module space_jets
