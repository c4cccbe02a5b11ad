!> The torque-roll axis: the axis about which an unsupported machine rotates under a torque about its shaft.
!>
!> Let m, S and J be the mass, first moment and inertia tensor about F of the machine, averaged over the turn; let e be the
!> direction of the shaft and tau e a torque. With the centre of mass c = S/m and J_c = J - m (|c|^2 1 - c c^T), the balances of
!> momentum and angular momentum give
!>
!>     J_c theta'' = tau e,   u'' = c x theta''.
!>
!> The machine rotates about an axis through c with the direction J_c^-1 e. This axis is parallel to the shaft only if the shaft is
!> parallel to a principal axis. (T. Jeong, R. Singh, J. Sound Vib. 234, 2000, 85-114, doi 10.1006/jsvi.1999.2860.)
module gestell_model_space_torque_roll
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: cross
  implicit none (type, external)
  private

  public :: find_torque_roll

  !> The torque-roll axis of a machine, and the motion of the machine about this axis.
  type, public :: torque_roll_type
    !> True if the axis exists; false if J_c is singular or the numbers overflow.
    logical :: known = .false.
    !> `axis`: direction as a unit vector. `center`: centre of mass of the machine, through which the axis passes, relative to the
    !> frame's centre of mass (m). `angle`: angle between axis and shaft (rad).
    real(dp) :: axis(3) = 0, center(3) = 0, angle = 0
    !> Motion (u, theta) under a torque about the shaft, scaled so that theta is a unit vector.
    real(dp) :: motion(6) = 0
  end type torque_roll_type

contains

  !> Computes the torque-roll axis from the mean mass matrix for (u, theta) and the unit vector `shaft`.
  pure subroutine find_torque_roll(mass, shaft, roll_axis)
    real(dp), intent(in) :: mass(6, 6), shaft(3)
    type(torque_roll_type), intent(out) :: roll_axis
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
    roll_axis%axis = matmul(adjugate, shaft)
    roll_axis%known = norm2(roll_axis%axis) > 0 .and. norm2(roll_axis%axis) <= huge(1.0_dp)
    if (.not. roll_axis%known) return
    roll_axis%axis = roll_axis%axis / norm2(roll_axis%axis)
    roll_axis%center = c
    roll_axis%angle = atan2(norm2(cross(roll_axis%axis, shaft)), dot_product(roll_axis%axis, shaft))
    roll_axis%motion(4:) = roll_axis%axis
    roll_axis%motion(:3) = cross(c, roll_axis%axis)
  end subroutine find_torque_roll

end module gestell_model_space_torque_roll
