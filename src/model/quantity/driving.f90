!> The torque that keeps the crank at constant speed, and the power balance of the drive, for a frame in the plane.
!>
!> With r = (xi_0 + x, eta_0 + y), the position of a mass relative to F, let
!>
!>     S = sum m r,   A = sum [m r x r' + J_i phi_i'],   K = sum [m |r'|^2 + J_i phi_i'^2],
!>
!> and let J be the moment of inertia of (9). All these sums are functions of the crank angle phi; ' is d/dphi. Subscript t is d/dt,
!> and k is the unit normal to the plane. The frame has the small motion v = (xi, eta) and psi. Up to terms of third order in this
!> motion, the kinetic energy is
!>
!>     T = m |v_t|^2 / 2 + v_t . [psi_t k x S + Omega (S' + psi k x S')] + J psi_t^2 / 2 + psi_t Omega A + Omega^2 K / 2.
!>
!> The Lagrange equations of T for v and psi are (1) to (3). The equation for phi gives the driving torque,
!>
!>     M_d = Omega^2 K' / 2 + v_tt . (S' + psi k x S') + psi_tt A - psi_t^2 J' / 2.
!>
!> On a rigid frame only the first term remains. Along a solution of (8) the power balance holds exactly:
!>
!>     d/dt (T + q^T C_0 q / 2) = M_d Omega - q_t^T B_0 q_t,
!>
!> where C_0 and B_0 are the matrices of the mounting. An asymmetric part of C_0, which no spring has, dissipates power as B_0 does.
!>
!> The exact frame has the same balance with three changes. S' + psi k x S' becomes the vector S' rotated by psi. k x S becomes the
!> derivative of the rotated S with respect to psi. Springs and dampers are evaluated at their actual positions. If gravity acts,
!> M_d also lifts the links, and the energy includes the potential of the weights (gestell_model_mounting_weights); linearised about
!> rest, this potential is taken to second order in psi.
!>
!> If the crank turns uniformly relative to the ground (gestell_model_mechanism_held), phi = Omega t - p psi in all these
!> expressions. Then
!>
!>     M_d = phi_t^2 K' / 2 + v_tt . (S' + psi k x S') + psi_tt (A - p K) - psi_t^2 J' / 2,   phi_t = Omega - p psi_t,
!>
!> and the balance of the equations linearised about rest has a remainder of third order. The power that reaches crank and flywheel
!> is M_d Omega minus the power that the motor's torque delivers to the rotating frame.
!>
!> Loads (gestell_model_mechanism_loads) reduce M_d by their torque on the crank, and their power enters the balance.
module gestell_model_quantity_driving
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_driving_in_space, only: drive_power_in_space, torque_roundings
  use gestell_model_mechanism_held, only: part_of_turn
  use gestell_model_mechanism_loads, only: effect_of, load_effect_type, power_of_loads
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_dd, a3_v, a4_v, drive_columns, energy_d, &
    & energy_dd, energy_v, load_sums_type, spin_v, table_columns
  implicit none (type, external)
  private

  public :: drive_power

  !> Rows of `power`. `torque`: torque on the crank (N m), counter-clockwise positive. `rigid_torque`: torque on the crank if the
  !> frame were rigid (N m). `drive_watts`: power of the drive (W). `damper_watts`: power dissipated by the dampers (W).
  !> `stored_energy`: energy of mechanism, frame and springs (J). `load_watts`: power of the loads (W).
  integer, parameter, public :: torque = 1, rigid_torque = 2, drive_watts = 3, damper_watts = 4, stored_energy = 5, &
    & load_watts = 6, power_rows = 6

contains

  !> Computes torque, power and energy of the drive at phases of the period.
  subroutine drive_power(frame, phases, motion, power, known, errors, torque_error)
    class(frame_type), intent(in) :: frame
    !> `phases`: phases of the period. `motion`: q, q', q'' at these phases, shape (9, phases) in the plane, (18, phases) in space
    real(dp), contiguous, intent(in) :: phases(:), motion(:, :)
    !> The computed rows `torque` to `load_watts`, shape (power_rows, phases)
    real(dp), intent(out) :: power(:, :)
    !> False if the mechanism has no data on its kinetic energy; `power` is 0 in this case
    logical, intent(out) :: known
    !> Error bounds of the rows of `motion`
    real(dp), intent(in), optional :: errors(:)
    !> Error bound of the torque (N m) due to `errors` and rounding errors
    real(dp), intent(out), optional :: torque_error
    real(dp), allocatable :: masses(:, :), drive(:, :)
    type(load_sums_type), allocatable :: loads(:)
    type(load_effect_type) :: effect
    real(dp) :: spin, spin_d, inertia, inertia_d, inertia_dd, rate, by_turn, by_rate, even, terms
    complex(dp) :: origin, s, s_d, s_dd, u_d, u_dd, e(3)
    complex(dp), parameter :: i = (0.0_dp, 1.0_dp)
    integer :: k

    if (allocated(frame%space)) then
      known = .true.
      call drive_power_in_space(frame, phases, motion, power, errors, torque_error)
      return
    end if
    allocate(masses(size(phases), table_columns), drive(size(phases), drive_columns))
    even = part_of_turn(frame%mechanism, frame%uniform_in_space())
    power = 0
    if (present(torque_error)) torque_error = 0
    call frame%mechanism%tabulate(frame%crank_angles(phases), masses)
    call frame%mechanism%tabulate_drive(frame%crank_angles(phases), drive, known)
    if (.not. known) return
    allocate(loads(size(phases)))
    call frame%mechanism%sum_loads(frame%crank_angles(phases), frame%origin, loads)
    do k = 1, size(phases)
      effect = effect_of(loads(k), (1.0_dp, 0.0_dp), even)
      power(rigid_torque, k) = frame%speed**2 * drive(k, energy_d) / 2 - effect%torque
      if (frame%weights%act) power(rigid_torque, k) = power(rigid_torque, k) &
        & + frame%weights%torque((1.0_dp, 0.0_dp), cmplx(masses(k, a1_d), masses(k, a2_d), dp))
    end do
    if (frame%uniform_in_space()) then
      call frame%mechanism%tabulate(frame%crank_angles(phases) - even * motion(3, :), masses)
      call frame%mechanism%tabulate_drive(frame%crank_angles(phases) - even * motion(3, :), drive, known)
      call frame%mechanism%sum_loads(frame%crank_angles(phases) - even * motion(3, :), frame%origin, loads)
    end if
    origin = cmplx(frame%origin(1), frame%origin(2), dp)
    associate (omega => frame%speed, mass => frame%mechanism%mass)
      do k = 1, size(phases)
        associate (a => masses(k, :), q => motion(1:3, k), v => motion(4:6, k), acceleration => motion(7:9, k))
          e = frame%rotations(q(3))
          u_d = cmplx(v(1), v(2), dp)
          u_dd = cmplx(acceleration(1), acceleration(2), dp)
          s = mass * origin + cmplx(a(a1_v), a(a2_v), dp)
          s_d = cmplx(a(a1_d), a(a2_d), dp)
          s_dd = cmplx(a(a1_dd), a(a2_dd), dp)
          rate = omega - even * v(3)
          spin = drive(k, spin_v) + aimag(conjg(origin) * s_d)
          spin_d = a(a4_v) + aimag(conjg(origin) * s_dd)
          inertia = frame%inertia + frame%mechanism%inertia + mass * sum(frame%origin**2) + a(a3_v) &
            & + 2 * dot_product(frame%origin, [a(a1_v), a(a2_v)])
          inertia_d = a(a3_d) + 2 * real(conjg(origin) * s_d)
          inertia_dd = a(a3_dd) + 2 * real(conjg(origin) * s_dd)
          power(torque, k) = rate**2 * drive(k, energy_d) / 2 + real(conjg(u_dd) * e(1) * s_d) &
            & + acceleration(3) * (spin - even * drive(k, energy_v)) - v(3)**2 * inertia_d / 2
          by_turn = real(conjg(u_dd) * (e(2) * s_d - even * e(1) * s_dd)) &
            & + even * (v(3)**2 * inertia_dd / 2 - acceleration(3) * (spin_d - even * drive(k, energy_d)) &
            & - rate**2 * drive(k, energy_dd) / 2)
          by_rate = -v(3) * inertia_d - even * rate * drive(k, energy_d)
          power(damper_watts, k) = frame%dissipation(q, v)
          power(stored_energy, k) = (frame%mass + mass) * sum(v(:2)**2) / 2 &
            & + real(conjg(u_d) * (v(3) * e(2) * s + rate * e(1) * s_d)) &
            & + inertia * v(3)**2 / 2 + v(3) * rate * spin + rate**2 * drive(k, energy_v) / 2 + frame%potential(q)
          if (frame%weights%act) then
            power(torque, k) = power(torque, k) + frame%weights%torque(e(3), s_d)
            power(stored_energy, k) = power(stored_energy, k) + frame%weights%potential(e(3), q(3), s)
            by_turn = by_turn + frame%weights%torque(e(3), i * s_d - even * s_dd)
          end if
          effect = effect_of(loads(k), e(1), even)
          power(torque, k) = power(torque, k) - effect%torque
          by_turn = by_turn - effect%torque_psi
          power(load_watts, k) = power_of_loads(loads(k), e(1), rate, v)
          power(drive_watts, k) = omega * power(torque, k) - frame%motor_torque * v(3)
          if (present(errors) .and. present(torque_error)) then
            terms = rate**2 * max(abs(drive(k, energy_d)), frame%mechanism%terms(4)) / 2 + v(3)**2 * abs(inertia_d) / 2 &
              & + dot_product(abs(acceleration(:2)), abs([real(e(1) * s_d), aimag(e(1) * s_d)]) + frame%mechanism%terms(:2)) &
              & + abs(acceleration(3)) * (abs(spin) + even * drive(k, energy_v))
            terms = terms + abs(effect%torque)
            if (frame%weights%act) terms = terms + norm2(frame%weights%gravity) * (abs(s_d) + norm2(frame%mechanism%terms(:2)))
            torque_error = max(torque_error, dot_product(abs([real(e(1) * s_d), aimag(e(1) * s_d)]), errors(7:8)) &
              & + abs(spin - even * drive(k, energy_v)) * errors(9) + abs(by_turn) * errors(3) + abs(by_rate) * errors(6) &
              & + torque_roundings * (epsilon(terms) + frame%rounding) * terms)
          end if
        end associate
      end do
    end associate
  end subroutine drive_power

end module gestell_model_quantity_driving
