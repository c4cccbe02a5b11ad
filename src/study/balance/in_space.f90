!> What mechanisms in space exert on a frame at rest, over -Omega^2, weights aside: S'' and the moment H' about a point, or what of
!> it the frame feels by who holds the speed (gestell_model_space).
module gestell_study_balance_in_space
  use gestell_base_kinds, only: dp
  use gestell_model_linkage_bodies, only: link_type
  use gestell_model_space, only: in_frame, new_space, space_type
  use gestell_model_space_masses, only: plane_type
  use gestell_model_space_mounting, only: space_support_type
  use gestell_model_space_rotation, only: cross
  implicit none (type, external)
  private

  public :: shaking_of_link, shaking_of_planes

contains

  !> Of these planes on the frame of `space`, at angles of its drive (rad), with moments about a point that is `about` from F (m),
  !> shape (6, angles): kg m and kg m^2.
  pure function shaking_of_planes(space, planes, about, angles) result(rows)
    type(space_type), intent(in) :: space
    type(plane_type), intent(in) :: planes(:)
    real(dp), intent(in) :: about(3)
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp) :: rows(6, size(angles))
    real(dp), allocatable :: m(:, :, :), b(:, :, :), c(:, :, :), h(:, :)
    real(dp), parameter :: weightless(3, 3) = 0, none(6, 6) = 0
    type(space_type) :: bare
    type(space_support_type) :: no_supports(0)
    integer :: k

    call new_space(bare, weightless, planes, no_supports, none, none)
    bare%drive = space%drive
    allocate(m(size(angles), 6, 6), b(size(angles), 6, 6), c(size(angles), 6, 6), h(size(angles), 6))
    call bare%sample_at_rest(0.0_dp, 1.0_dp, angles, [(k, k = 1, 6)], m, b, c, h)
    rows = -transpose(h(:, in_frame))
    do k = 1, size(angles)
      rows(4:, k) = rows(4:, k) - cross(about, rows(:3, k))
    end do
  end function shaking_of_planes

  !> The same of a link alone that moves as those of its plane.
  pure function shaking_of_link(space, link, about, angles) result(rows)
    type(space_type), intent(in) :: space
    type(link_type), intent(in) :: link
    real(dp), intent(in) :: about(3)
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp) :: rows(6, size(angles))
    type(plane_type) :: plane
    integer :: k

    do k = 1, size(space%planes)
      if (space%planes(k)%linkage%links(1)%plane == link%plane) plane = space%planes(k)
    end do
    plane%linkage%links = [link]
    rows = shaking_of_planes(space, [plane], about, angles)
  end function shaking_of_link

end module gestell_study_balance_in_space
