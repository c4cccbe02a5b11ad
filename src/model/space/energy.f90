!> Potential energy of the mounting of a frame in space, and the power that a mounting dissipates, in space or in the plane.
module gestell_model_space_energy
  use gestell_base_kinds, only: dp
  use gestell_model_mounting, only: in_frame, in_space
  use gestell_model_mounting_mounted, only: mounted_system
  use gestell_math_rotation, only: cross, identity, rotation_less_one, rotation_matrix, turning_matrices
  implicit none (type, external)
  private

  public :: mounting_energy, mounting_power

contains

  !> Potential energy (J) of mounting and gravity at q = (u, theta), up to a constant. `s`: first moment of the masses about the
  !> frame's centre of mass (kg m). Gravity and the static forces contribute -tr(R X) with the rotation matrix R; for the matrix X
  !> see gestell_model_mounting_weights.
  pure real(dp) function mounting_energy(frame, q, s)
    class(mounted_system), intent(in) :: frame
    real(dp), intent(in) :: q(6), s(3)
    real(dp) :: turn(3, 3), d(3)
    integer :: i

    turn = rotation_less_one(q(4:))
    mounting_energy = dot_product(q, matmul(frame%foundation_stiffness(in_frame, in_frame), q)) / 2
    do i = 1, size(frame%supports)
      associate (support => frame%supports(i), p => frame%supports(i)%position)
        d = q(:3) + matmul(turn, p)
        ! d is now e. The work of the static force along u cancels against that of the weights and is left out
        if (support%turning) d = d + matmul(d, turn)
        mounting_energy = mounting_energy + dot_product(support%stiffness, matmul(d, support%axes)**2) / 2
        if (support%turning) mounting_energy = mounting_energy + dot_product(support%static, d - q(:3))
      end associate
    end do
    if (frame%weights%act) mounting_energy = mounting_energy + dot_product(frame%weights%carried, q(4:)) &
      & - dot_product(frame%weights%gravity, matmul(turn + identity(), s - frame%weights%mean)) &
      & - sum(transpose(turn) * frame%weights%rest)
  end function mounting_energy

  !> Power (W) dissipated by the mounting when (u, theta) has the value q and the rate of change v. The dampers and the asymmetric
  !> part of the foundation's stiffness dissipate it.
  pure real(dp) function mounting_power(frame, q, v)
    class(mounted_system), intent(in) :: frame
    real(dp), intent(in) :: q(6), v(6)
    real(dp) :: rotation(3, 3), turning(3, 3, 0:2), w(3), d_d(3)
    integer :: i

    rotation = rotation_matrix(q(4:))
    turning = turning_matrices(reshape([q(4:), v(4:), 0.0_dp, 0.0_dp, 0.0_dp], [3, 3]))
    w = matmul(turning(:, :, 0), v(4:))
    associate (c => frame%foundation_stiffness, at => in_space(:size(frame%stiffness, 1)))
      mounting_power = dot_product(v(at), matmul(frame%foundation_damping, v(at))) &
        & + dot_product(v(at), matmul(c - transpose(c), q(at))) / 2
    end associate
    do i = 1, size(frame%supports)
      associate (support => frame%supports(i), p => frame%supports(i)%position)
        d_d = v(:3) + matmul(rotation, cross(w, p))
        ! e' = R^T v - w x y, y = R^T (u - p)
        if (support%turning) d_d = matmul(v(:3), rotation) - cross(w, matmul(q(:3) - p, rotation))
        mounting_power = mounting_power + dot_product(support%damping, matmul(d_d, support%axes)**2)
      end associate
    end do
  end function mounting_power

end module gestell_model_space_energy
