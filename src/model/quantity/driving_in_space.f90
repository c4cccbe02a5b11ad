!> The torque that keeps the drive of a frame in space at its speed, and the power balance of the drive; (50) of doc/theory.md. Let
!> m be the mass of the machine, v = R^T u' the velocity of F, and w the angular velocity of the frame, both along the frame's axes.
!> S, J, A, K are the sums of gestell_model_space_moving; here J includes the frame. The kinetic energy is
!>
!>     T = m |v|^2/2 + v (w x S + phi' S_1) + w J w/2 + phi' w A + phi'^2 K/2,   index 1: d/dphi,
!>
!> and the torque M_d = d/dt dT/dphi' - dT/dphi. The shaft has the axis n. Let c be the mean of w n, and M the mean torque of the
!> motor that drives a flywheel. The rate of change of T and of the mounting's energy, plus the dissipated power, is
!>
!>     M_d Omega   (motor, outside),      M_d (Omega + c) - M w n   (flywheel).
!>
!> Torque, T and the forces of the mounting follow the exact kinematics in all models. With the equations linearised about rest the
!> balance therefore has a remainder of third order. If gravity acts, the torque also lifts the masses.
module gestell_model_quantity_driving_in_space
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_model_space, only: in_frame, in_space
  use gestell_model_space_drive, only: driven_type, find_torque, follow_frame
  use gestell_model_space_energy, only: mounting_energy, mounting_power
  use gestell_model_space_loads, only: count_loads, find_loads, load_power, load_torque, space_load_type
  use gestell_model_space_masses, only: masses_type
  use gestell_model_space_moving, only: find_moving, moving_type
  use gestell_math_rotation, only: cross, identity, turning_matrices
  implicit none (type, external)
  private

  public :: drive_power_in_space

  !> Assumed number of rounding errors in each term of the torque: the second derivatives of the positions contain one rounding
  !> error for each joint.
  real(dp), parameter, public :: torque_roundings = 16

contains

  !> Computes torque, power and energy of the drive of a frame in space at phases of the period.
  subroutine drive_power_in_space(frame, phases, motion, power, errors, torque_error)
    class(frame_type), intent(in) :: frame
    !> `phases`: phases of the period. `motion`: q, q', q'' at these phases, shape (18, phases)
    real(dp), contiguous, intent(in) :: phases(:), motion(:, :)
    !> Rows, shape (6, phases). 1: torque on the drive's shaft (N m). 2: this torque if the frame were rigid (N m). 3: power of the
    !> drive (W). 4: power dissipated by the dampers (W). 5: energy of mechanisms, frame and springs (J). 6: power of the loads (W)
    real(dp), intent(out) :: power(:, :)
    !> Error bounds of the rows of `motion`, shape (18)
    real(dp), intent(in), optional :: errors(:)
    !> Error bound of the torque (N m) due to `errors` and rounding errors
    real(dp), intent(out), optional :: torque_error
    type(driven_type) :: driven
    type(moving_type) :: rigid
    type(space_load_type) :: loads(count_loads(frame%space%planes))
    real(dp) :: angles(size(phases)), lag(size(phases), 3), q(6, 0:2), v(3), falling(3), by_gain(6), by_rate(6), by_place(6), &
      & of_loads, by_loads(3)
    type(masses_type) :: at
    logical :: has_errors
    integer :: k

    angles = frame%crank_angles(phases)
    has_errors = .false.
    select type (frame)
    class is (varied_frame_type)
      has_errors = .true.
      lag = frame%lag(phases)
    end select
    if (present(torque_error)) torque_error = 0
    do k = 1, size(phases)
      q = reshape([motion(in_frame, k), motion(6 + in_frame, k), motion(12 + in_frame, k)], [6, 3])
      falling = q(:3, 2) - frame%weights%gravity
      if (has_errors) then
        call follow_frame(frame%space%drive, frame%speed, falling, q(4:, :), driven%moved, driven%turn, lag(k, :))
      else
        call follow_frame(frame%space%drive, frame%speed, falling, q(4:, :), driven%moved, driven%turn)
      end if
      call find_moving(frame%space%planes, angles(k), rigid)
      call find_moving(frame%space%planes, angles(k) - driven%turn%chi(0), driven%moving)
      call find_torque(driven%turn, driven%moving, driven%moved, power(1, k), by_gain, by_rate, by_place)
      power(2, k) = frame%speed**2 * rigid%k(1) / 2 - dot_product(frame%weights%gravity, rigid%s(:, 1))
      call find_loads(frame%space%planes, angles(k), loads)
      call load_torque(loads, driven%turn%b, identity(), of_loads, by_loads)
      power(2, k) = power(2, k) - of_loads
      call find_loads(frame%space%planes, angles(k) - driven%turn%chi(0), loads)
      call load_torque(loads, driven%turn%b, driven%moved%rotation, of_loads, by_loads)
      power(1, k) = power(1, k) - of_loads
      by_place(4:) = by_place(4:) - by_loads
      power(6, k) = load_power(loads, driven%moved%rotation, driven%moved%rate, q(:3, 1), driven%moved%w)
      ! with a flywheel chi' is w n minus its mean: phi' + w n = Omega + c
      power(3, k) = power(1, k) * (driven%moved%rate + dot_product(driven%turn%b, driven%moved%w)) &
        & - dot_product(driven%moved%motor, driven%moved%w)
      power(4, k) = mounting_power(frame, q(:, 0), q(:, 1))
      call frame%space%masses_at(frame%mass, 1.0_dp, [angles(k) - driven%turn%chi(0)], at)
      v = matmul(q(:3, 1), driven%moved%rotation)
      associate (w => driven%moved%w, rate => driven%moved%rate, moving => driven%moving)
        power(5, k) = at%mass * dot_product(v, v) / 2 + dot_product(v, cross(w, at%s(1, :, 0)) + rate * moving%s(:, 1)) &
          & + dot_product(w, matmul(at%j(1, :, :, 0), w)) / 2 + rate * dot_product(w, moving%a(:, 0)) &
          & + rate**2 * moving%k(0) / 2 + mounting_energy(frame, q(:, 0), at%s(1, :, 0))
      end associate
      if (present(errors) .and. present(torque_error)) torque_error = max(torque_error, effect() &
        & + torque_roundings * (epsilon(1.0_dp) + frame%rounding) * absolute_terms())
    end do

  contains

    !> Sum of the absolute values of the terms of the torque (N m). It bounds the rounding errors of the torque where the links'
    !> terms cancel.
    pure real(dp) function absolute_terms()
      real(dp) :: of_forces, of_energy
      integer :: i

      of_forces = 0
      of_energy = 0
      do i = 1, size(frame%space%planes)
        of_forces = of_forces + norm2(frame%space%planes(i)%linkage%terms(:2))
        of_energy = of_energy + frame%space%planes(i)%linkage%terms(4)
      end do
      associate (moving => driven%moving, moved => driven%moved)
        absolute_terms = norm2(moved%a) * (norm2(moving%s(:, 1)) + of_forces) + norm2(moved%w_d) * norm2(moving%a(:, 0)) &
          & + norm2(moved%w) * norm2(matmul(moving%j(:, :, 1), moved%w)) / 2 + abs(moved%gain) * moving%k(0) &
          & + moved%rate**2 * max(abs(moving%k(1)), of_energy) / 2 + abs(of_loads)
      end associate
    end function absolute_terms

    !> Bound on the error of the torque (N m) that errors of the motion cause.
    pure real(dp) function effect()
      real(dp) :: turning(3, 3, 0:2), of_motion(6, 0:2)

      turning = turning_matrices(q(4:, :))
      of_motion(:, 2) = by_gain
      of_motion(:, 1) = by_rate
      of_motion(:, 0) = by_place
      of_motion(4:, 2) = matmul(by_gain(4:), turning(:, :, 0))
      of_motion(4:, 1) = matmul(by_rate(4:), turning(:, :, 0)) + 2 * matmul(by_gain(4:), turning(:, :, 1))
      of_motion(4:, 0) = matmul(by_place(4:), turning(:, :, 0)) + matmul(by_rate(4:), turning(:, :, 1)) &
        & + matmul(by_gain(4:), turning(:, :, 2))
      effect = sum(abs(reshape(of_motion(in_space, :), [18])) * errors(:18))
    end function effect

  end subroutine drive_power_in_space

end module gestell_model_quantity_driving_in_space
