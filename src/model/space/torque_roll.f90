!> The torque-roll axis: about which a machine that nothing holds turns under a torque about its shaft.
!>
!> With the means of the masses over the turn, m, S and J about F, the shaft's direction e and a torque tau e, momentum and angular
!> momentum give, c = S/m the centre of mass and J_c = J - m (|c|^2 1 - c c^T),
!>
!>     J_c theta'' = tau e,   u'' = c x theta'':
!>
!> an axis through c along J_c^-1 e, which is the shaft's direction only where that is a principal axis. (T. Jeong, R. Singh,
!> J. Sound Vib. 234, 2000, 85-114, doi 10.1006/jsvi.1999.2860.)
module gestell_model_space_torque_roll
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: cross
  implicit none (type, external)
  private

  public :: find_torque_roll

  type, public :: torque_roll_type
    !> Whether there is one: where J_c has no inverse, or the numbers overflow, there is none.
    logical :: known = .false.
    !> The axis as a unit vector, the centre of mass from F (m), and the angle between axis and shaft (rad).
    real(dp) :: axis(3) = 0, center(3) = 0, angle = 0
    !> The motion (u, theta) at the unit torque, up to a factor.
    real(dp) :: motion(6) = 0
  end type torque_roll_type

contains

  !> Of the mean mass matrix of (u, theta) and the unit vector `shaft`.
  pure subroutine find_torque_roll(mass, shaft, found)
    real(dp), intent(in) :: mass(6, 6), shaft(3)
    type(torque_roll_type), intent(out) :: found
    real(dp) :: j(3, 3), adjugate(3, 3), c(3)
    integer :: i

    ! M has [S] below its diagonal
    c = [mass(6, 2), mass(4, 3), mass(5, 1)] / mass(1, 1)
    do i = 1, 3
      j(:, i) = mass(4:, 3 + i) + mass(1, 1) * c * c(i)
      j(i, i) = j(i, i) - mass(1, 1) * dot_product(c, c)
    end do
    j = j / maxval(abs(j))
    adjugate(1, :) = cross(j(:, 2), j(:, 3))
    adjugate(2, :) = cross(j(:, 3), j(:, 1))
    adjugate(3, :) = cross(j(:, 1), j(:, 2))
    found%axis = matmul(adjugate, shaft)
    found%known = norm2(found%axis) > 0 .and. norm2(found%axis) <= huge(1.0_dp)
    if (.not. found%known) return
    found%axis = found%axis / norm2(found%axis)
    found%center = c
    found%angle = atan2(norm2(cross(found%axis, shaft)), dot_product(found%axis, shaft))
    found%motion(4:) = found%axis
    found%motion(:3) = cross(c, found%axis)
  end subroutine find_torque_roll

end module gestell_model_space_torque_roll
