!> The torque that keeps the drive of a frame in space at its speed, and the power balance of the drive; (50) of doc/theory.md. Let
!> m be the mass of the machine, v = u' the velocity of F, and w the angular velocity of the frame. S, J, H, K are the sums of
!> gestell_model_space_masses; here J includes the frame. All vectors are along the fixed axes. The kinetic energy is
!>
!>     T = m |v|^2/2 + v (w x S + phi' S_1) + w J w/2 + phi' w H + phi'^2 K/2,   index 1: d/dphi,
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
  use gestell_model_space, only: in_frame
  use gestell_model_space_drive, only: find_torque, follow_frame, moved_type
  use gestell_model_space_energy, only: mounting_energy, mounting_power
  use gestell_model_space_loads, only: count_loads, find_loads, load_power, load_torque, space_load_type
  use gestell_model_space_masses, only: along_fixed_axes, fixed_masses_type, masses_type, sum_planes
  use gestell_math_rotation, only: identity
  use gestell_math_vectors, only: batch, cross, dot, in_batch, scaled, steady, times, transposed
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
    type(moved_type) :: moved
    type(masses_type) :: masses, rigid
    type(fixed_masses_type) :: at
    type(space_load_type) :: loads(count_loads(frame%space%planes))
    real(dp) :: angles(size(phases)), lag(size(phases), 3), q(6, 0:1), s(3), b(3), w(3), rotation(3, 3), by_loads(3)
    real(dp), dimension(batch) :: turned, torque, of_loads, energy
    real(dp), dimension(batch, 3) :: by_gain, by_spin, by_turn
    real(dp), dimension(batch, 3, 0:2) :: u, theta
    integer :: these(batch), first, i, k, n
    logical :: has_lag

    angles = frame%crank_angles(phases)
    has_lag = .false.
    select type (frame)
    class is (varied_frame_type)
      has_lag = .true.
      lag = frame%lag(phases)
    end select
    if (present(torque_error)) torque_error = 0
    call sum_planes(frame%space%planes, angles, rigid, third=.true.)
    do first = 1, size(phases), batch
      these = in_batch(first, size(phases))
      do k = 0, 2
        do i = 1, 3
          u(:, i, k) = motion(6 * k + in_frame(i), these)
          theta(:, i, k) = motion(6 * k + in_frame(3 + i), these)
        end do
      end do
      associate (falling => u(:, :, 2) - steady(frame%weights%gravity))
        if (has_lag) then
          call follow_frame(frame%space%drive, frame%speed, falling, theta, moved, lag(these, :))
        else
          call follow_frame(frame%space%drive, frame%speed, falling, theta, moved)
        end if
      end associate
      turned = angles(these) - moved%chi(:, 0)
      call sum_planes(frame%space%planes, turned, masses, third=.true.)
      masses%mass = masses%mass + frame%mass
      do k = 1, batch
        masses%j(k, :, :, 0) = masses%j(k, :, :, 0) + frame%space%inertia
      end do
      call along_fixed_axes(masses, 1, moved%rotation, at)
      call find_torque(moved, at, torque, by_gain, by_spin, by_turn)
      associate (v => u(:, :, 1), w => moved%w, rate => moved%rate)
        energy = at%mass * dot(v, v) / 2 + dot(v, cross(w, at%s(:, :, 0)) + scaled(rate, at%s(:, :, 1))) &
          & + dot(w, times(at%j(:, :, :, 0), w)) / 2 + rate * dot(w, at%h(:, :, 0)) + rate**2 * at%k(:, 0) / 2
      end associate
      do n = first, min(first + batch - 1, size(phases))
        k = n - first + 1
        q = reshape([motion(in_frame, n), motion(6 + in_frame, n)], [6, 2])
        b = moved%b(k, :)
        w = moved%w(k, :)
        rotation = moved%rotation(k, :, :)
        s = masses%s(k, :, 0)
        power(2, n) = frame%speed**2 * rigid%k(n, 1) / 2 - dot_product(frame%weights%gravity, rigid%s(n, :, 1))
        call find_loads(frame%space%planes, angles(n), loads)
        call load_torque(loads, b, identity(), of_loads(k), by_loads)
        power(2, n) = power(2, n) - of_loads(k)
        call find_loads(frame%space%planes, turned(k), loads)
        call load_torque(loads, b, rotation, of_loads(k), by_loads)
        power(1, n) = torque(k) - of_loads(k)
        by_turn(k, :) = by_turn(k, :) - by_loads
        power(6, n) = load_power(loads, rotation, moved%rate(k), q(:3, 1), w)
        ! with a flywheel chi' is w n minus its mean: phi' + w n = Omega + c
        power(3, n) = power(1, n) * (moved%rate(k) + dot_product(b, w)) &
          & - dot_product(moved%motor(k, :), w)
        power(4, n) = mounting_power(frame, q(:, 0), q(:, 1))
        power(5, n) = energy(k) + mounting_energy(frame, q(:, 0), s)
      end do
      n = min(batch, size(phases) - first + 1)
      if (present(errors) .and. present(torque_error)) torque_error = max(torque_error, maxval(effects(n) &
        & + torque_roundings * (epsilon(1.0_dp) + frame%rounding) * absolute_terms(n)))
    end do

  contains

    !> Sum of the absolute values of the terms of the torque (N m) at the first `count` phases of the batch. It bounds the rounding
    !> errors of the torque where the links' terms cancel.
    function absolute_terms(count) result(terms)
      integer, intent(in) :: count
      real(dp) :: terms(count), all(batch), of_forces, of_energy
      integer :: i

      of_forces = 0
      of_energy = 0
      do i = 1, size(frame%space%planes)
        of_forces = of_forces + norm2(frame%space%planes(i)%linkage%terms(:2))
        of_energy = of_energy + frame%space%planes(i)%linkage%terms(4)
      end do
      associate (a => moved%a, w => moved%w, w_d => moved%w_d)
        all = lengths(a) * (lengths(at%s(:, :, 1)) + of_forces) + lengths(w_d) * lengths(at%h(:, :, 0)) &
          & + lengths(w) * lengths(times(at%j(:, :, :, 1), w)) / 2 + abs(moved%gain) * at%k(:, 0) &
          & + moved%rate**2 * max(abs(at%k(:, 1)), of_energy) / 2
      end associate
      terms = all(:count) + abs(of_loads(:count))
    end function absolute_terms

    pure function lengths(a)
      real(dp), intent(in) :: a(batch, 3)
      real(dp) :: lengths(batch)

      lengths = sqrt(dot(a, a))
    end function lengths

    !> Bounds on the errors of the torque (N m) that errors of the motion cause, at the first `count` phases of the batch.
    function effects(count)
      integer, intent(in) :: count
      real(dp) :: effects(count), all(batch)
      real(dp), dimension(batch, 3, 3) :: t, t_d, t_dd
      integer :: i

      t = transposed(moved%turning(:, :, :, 0))
      t_d = transposed(moved%turning(:, :, :, 1))
      t_dd = transposed(moved%turning(:, :, :, 2))
      all = 0
      associate (by_theta_dd => times(t, by_gain), by_theta_d => times(t, by_spin) + 2 * times(t_d, by_gain), &
        & by_theta => times(t, by_turn) + times(t_d, by_spin) + times(t_dd, by_gain))
        do i = 1, 3
          all = all + abs(at%s(:, i, 1)) * errors(12 + in_frame(i)) + abs(by_theta_dd(:, i)) * errors(12 + in_frame(3 + i)) &
            & + abs(by_theta_d(:, i)) * errors(6 + in_frame(3 + i)) + abs(by_theta(:, i)) * errors(in_frame(3 + i))
        end do
      end associate
      effects = all(:count)
    end function effects

  end subroutine drive_power_in_space

end module gestell_model_quantity_driving_in_space
