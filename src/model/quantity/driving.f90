!> The torque that keeps the crank at its constant speed, and where its power goes.
!>
!> With S = sum m r about F, r = (xi_0 + x, eta_0 + y), A = sum [m r x r' + J phi'], K = sum [m |r'|^2 + J phi'^2] and the
!> moment of inertia J(phi) of (9), all functions of the crank angle phi, ' = d/dphi, the kinetic energy is up to terms of
!> third order in the frame's small motion v = (xi, eta) and psi
!>
!>     T = m |v.|^2 / 2 + v. . [psi. k x S + Omega (S' + psi k x S')] + J psi.^2 / 2 + psi. Omega A + Omega^2 K / 2.
!>
!> Its Lagrange equations for v and psi are (1) to (3); that for phi is the driving torque,
!>
!>     M_d = Omega^2 K' / 2 + v.. . (S' + psi k x S') + psi.. A - psi.^2 J' / 2,
!>
!> of which the first term is all on a rigid frame. Along a solution of (8) the power balance holds without remainder:
!>
!>     d/dt (T + q^T C_0 q / 2) = M_d Omega - q.^T B_0 q.,
!>
!> C_0, B_0 the mounting's matrices. (The part of C_0 that is not symmetric, as no spring has it, takes power beside B_0.) Of the
!> exact frame s + psi k x s is the vector s turned by psi, k x s its derivative, and the mounting's energy and power are those of
!> its springs and dampers where they are: the balance is the same. With weights M_d lifts the links too, and the energy has their
!> potential (gestell_model_mounting_weights), about rest to second order in psi.
!>
!> Of a crank that turns evenly in space (gestell_model_mechanism_held) phi = Omega t - p psi in all of this, so
!>
!>     M_d = phi.^2 K' / 2 + v.. . (S' + psi k x S') + psi.. (A - p K) - psi.^2 J' / 2,   phi. = Omega - p psi.;
!>
!> then the balance has, about rest, a remainder of third order. What crank and flywheel are given is M_d Omega less the part of the
!> motor's power that the frame's turning takes from it.
module gestell_model_quantity_driving
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_driving_in_space, only: drive_power_in_space, torque_roundings
  use gestell_model_mechanism_held, only: part_of_turn
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_dd, a3_v, a4_v, drive_columns, energy_d, &
    & energy_dd, energy_v, spin_v, table_columns
  implicit none (type, external)
  private

  public :: drive_power

  !> Rows of what the drive does: torque on the crank (N m, counter-clockwise positive), the torque on a rigid frame, the
  !> drive's power, that of the dampers (W), the energy of mechanism, frame and springs (J).
  integer, parameter, public :: torque = 1, rigid_torque = 2, drive_watts = 3, damper_watts = 4, stored_energy = 5, &
    & power_rows = 5

contains

  !> The drive at phases of the turn, shape (power_rows, phases), from the motion there: q, q', q'', shape (9, phases), in space
  !> (18, phases).
  !> `known`: the mechanism tells its kinetic energy. With `errors` of the motion's rows also `torque_error`, a bound on what these
  !> and roundings do to the torque.
  subroutine drive_power(frame, phases, motion, power, known, errors, torque_error)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:), motion(:, :)
    real(dp), intent(out) :: power(:, :)
    logical, intent(out) :: known
    real(dp), intent(in), optional :: errors(:)
    real(dp), intent(out), optional :: torque_error
    real(dp), allocatable :: masses(:, :), drive(:, :)
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
    even = part_of_turn(frame%mechanism, frame%even_in_space())
    power = 0
    if (present(torque_error)) torque_error = 0
    call frame%mechanism%tabulate(frame%crank_angles(phases), masses)
    call frame%mechanism%tabulate_drive(frame%crank_angles(phases), drive, known)
    if (.not. known) return
    do k = 1, size(phases)
      power(rigid_torque, k) = frame%speed**2 * drive(k, energy_d) / 2
      if (frame%weights%act) power(rigid_torque, k) = power(rigid_torque, k) &
        & + frame%weights%torque((1.0_dp, 0.0_dp), cmplx(masses(k, a1_d), masses(k, a2_d), dp))
    end do
    if (frame%even_in_space()) then
      call frame%mechanism%tabulate(frame%crank_angles(phases) - even * motion(3, :), masses)
      call frame%mechanism%tabulate_drive(frame%crank_angles(phases) - even * motion(3, :), drive, known)
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
            & + inertia * v(3)**2 / 2 + v(3) * rate * spin + rate**2 * drive(k, energy_v) / 2 &
            & + frame%potential(q)
          if (frame%weights%act) then
            power(torque, k) = power(torque, k) + frame%weights%torque(e(3), s_d)
            power(stored_energy, k) = power(stored_energy, k) + frame%weights%potential(e(3), q(3), s)
            by_turn = by_turn + frame%weights%torque(e(3), i * s_d - even * s_dd)
          end if
          power(drive_watts, k) = omega * power(torque, k) - frame%motor_torque * v(3)
          if (present(errors) .and. present(torque_error)) then
            terms = rate**2 * max(abs(drive(k, energy_d)), frame%mechanism%terms(4)) / 2 + v(3)**2 * abs(inertia_d) / 2 &
              & + dot_product(abs(acceleration(:2)), abs([real(e(1) * s_d), aimag(e(1) * s_d)]) + frame%mechanism%terms(:2)) &
              & + abs(acceleration(3)) * (abs(spin) + even * drive(k, energy_v))
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
