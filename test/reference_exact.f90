!> The exact equations of the frame from d'Alembert's principle, in quadruple precision, that share nothing with the library: every
!> link's and the frame's place in space as a function of (xi, eta, psi) and the crank angle, accelerations and virtual
!> displacements by central differences of these places.
!>
!>     sum [m (z'' - g). dz/dq + J (phi + psi)'' d(phi + psi)/dq] + dV/dq + sum (B d').dd/dq + sum (F_0 . dd/dq) = 0,
!>
!> V the springs' potential, d the displacement of a support's head along its axes in space or in the frame. F_0 are the springs'
!> static forces: V's second differences times the small displacement by which the weights, in the mean over the turn, are in
!> equilibrium. phi = Omega t, or, of a crank that turns evenly in space, Omega t - psi, also in the virtual displacements.
module reference_exact
  use reference_linear, only: qp, solve
  use reference_linkage, only: motion_type, move
  use reference_machine, only: crank_speed, machine_data, pi_qp
  implicit none (type, external)
  private

  public :: inertia_of, mass_of, mean_dissipation, place, residual, sag

  !> Step of the differences, in m or rad.
  real(qp), parameter :: by_place = 1.0e-8_qp

contains

  !> Residuals of the equations for the motion q(phi), given at phi - angle_step, phi and phi + angle_step, shape (3, 3), and
  !> the sums of the sizes of their terms; shapes (3). `torque`: of the motor that drives a flywheel on the frame.
  subroutine residual(machine, phi, angle_step, q, torque, left, terms)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: phi, angle_step, q(3, -1:1), torque
    real(qp), intent(out) :: left(3), terms(3)
    type(motion_type) :: motion(-1:1), ahead, behind
    real(qp) :: omega, z(2, -1:1), along(2), acceleration(2), spin, rest(3), even, psi_d, psi_dd, turns
    integer :: i, k, n

    omega = crank_speed(machine)
    even = merge(0, 1, machine%held_by == 'motor')
    do n = -1, 1
      motion(n) = move(machine, phi + n*angle_step - even*q(3, n))
    end do
    psi_d = omega*(q(3, 1) - q(3, -1))/(2*angle_step)
    psi_dd = omega**2*(q(3, 1) - 2*q(3, 0) + q(3, -1))/angle_step**2
    left = 0
    terms = 0
    rest = sag(machine)
    do k = 1, 3
      turns = merge(even*by_place, 0.0_qp, k == 3)
      ahead = move(machine, phi - even*q(3, 0) - turns)
      behind = move(machine, phi - even*q(3, 0) + turns)
      ! Links and, as number 0, the frame.
      do i = 0, size(machine%links)
        do n = -1, 1
          z(:, n) = place(machine, motion(n), i, q(:, n))
        end do
        acceleration = omega**2*(z(:, 1) - 2*z(:, 0) + z(:, -1))/angle_step**2
        along = (place(machine, ahead, i, moved(q(:, 0), k, by_place)) &
          - place(machine, behind, i, moved(q(:, 0), k, -by_place)))/(2*by_place)
        call add(mass_of(machine, i)*dot_product(acceleration, along))
        call add(-mass_of(machine, i)*dot_product(machine%gravity, along))
        if (k < 3) cycle
        spin = psi_dd
        turns = 1
        if (i > 0) then
          spin = spin + (omega - even*psi_d)**2*motion(0)%turn(2, i) - even*psi_dd*motion(0)%turn(1, i)
          turns = 1 - even*motion(0)%turn(1, i)
        end if
        call add(inertia_of(machine, i)*spin*turns)
      end do
      call add((potential(machine, moved(q(:, 0), k, by_place)) - potential(machine, moved(q(:, 0), k, -by_place)))/(2*by_place))
      call add(damping_power(machine, q, omega/angle_step, k))
      call add(static_power(machine, rest, q(:, 0), k))
      if (k == 3) call add(torque)
    end do

  contains

    subroutine add(term)
      real(qp), intent(in) :: term

      left(k) = left(k) + term
      terms(k) = terms(k) + abs(term)
    end subroutine add

  end subroutine residual

  pure function moved(q, k, step)
    real(qp), intent(in) :: q(3), step
    integer, intent(in) :: k
    real(qp) :: moved(3)

    moved = q
    moved(k) = moved(k) + step
  end function moved

  !> Position of a centre of mass in space; for the frame (0) that of its centre F.
  pure function place(machine, motion, i, q)
    type(machine_data), intent(in) :: machine
    type(motion_type), intent(in) :: motion
    integer, intent(in) :: i
    real(qp), intent(in) :: q(3)
    real(qp) :: place(2)

    place = q(:2)
    if (i > 0) place = place + turned(machine%origin + motion%center(:, 0, i), q(3))
  end function place

  pure function turned(r, psi)
    real(qp), intent(in) :: r(2), psi
    real(qp) :: turned(2)

    turned = [cos(psi)*r(1) - sin(psi)*r(2), sin(psi)*r(1) + cos(psi)*r(2)]
  end function turned

  pure real(qp) function mass_of(machine, i)
    type(machine_data), intent(in) :: machine
    integer, intent(in) :: i

    mass_of = machine%frame_mass
    if (i > 0) mass_of = machine%links(i)%mass
  end function mass_of

  pure real(qp) function inertia_of(machine, i)
    type(machine_data), intent(in) :: machine
    integer, intent(in) :: i

    inertia_of = machine%frame_inertia
    if (i > 0) inertia_of = machine%links(i)%inertia
  end function inertia_of

  !> Potential of all springs; the foundation's is quadratic in xi, eta, psi.
  pure real(qp) function potential(machine, q)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: q(3)
    integer :: j

    potential = dot_product(q, matmul(real(machine%foundation_stiffness, qp), q))/2
    do j = 1, size(machine%supports)
      potential = potential + sum(machine%supports(j)%stiffness*stretch(machine, j, q)**2)/2
    end do
  end function potential

  !> Displacement of a support's head along its two axes.
  pure function stretch(machine, j, q)
    type(machine_data), intent(in) :: machine
    integer, intent(in) :: j
    real(qp), intent(in) :: q(3)
    real(qp) :: stretch(2), d(2), p(2)

    p = machine%supports(j)%position
    d = q(:2) + turned(p, q(3)) - p
    stretch = turned(d, -real(machine%supports(j)%angle_deg, qp)*pi_qp/180)
    if (machine%supports(j)%turning) stretch = turned(stretch, -q(3))
  end function stretch

  !> The small displacement from unloaded springs to rest; zero in directions that are not free.
  function sag(machine) result(q)
    type(machine_data), intent(in) :: machine
    real(qp) :: q(3)
    integer, parameter :: samples = 128
    real(qp), parameter :: none(3) = 0
    type(motion_type) :: motion
    real(qp) :: c(3, 3), weight(3)
    integer :: i, k, n

    q = 0
    if (.not. any(abs(machine%gravity) > 0)) return
    weight = 0
    do n = 1, samples
      motion = move(machine, 2*pi_qp*n/samples)
      do k = 1, 3
        do i = 0, size(machine%links)
          weight(k) = weight(k) + mass_of(machine, i)/samples*dot_product(machine%gravity, &
            (place(machine, motion, i, moved(none, k, by_place)) &
            - place(machine, motion, i, moved(none, k, -by_place)))/(2*by_place))
        end do
      end do
    end do
    do k = 1, 3
      do i = 1, 3
        c(i, k) = (potential(machine, moved(moved(none, i, by_place), k, by_place)) &
          - potential(machine, moved(moved(none, i, -by_place), k, by_place)) &
          - potential(machine, moved(moved(none, i, by_place), k, -by_place)) &
          + potential(machine, moved(moved(none, i, -by_place), k, -by_place)))/(4*by_place**2)
      end do
    end do
    do k = 1, 3
      if (machine%free(k)) cycle
      c(k, :) = 0
      c(k, k) = 1
      weight(k) = 0
    end do
    q = solve(c, weight)
  end function sag

  !> The static forces' part of the k-th equation; the springs were stretched by the linear displacement of their heads.
  pure real(qp) function static_power(machine, rest, q, k) result(power)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: rest(3), q(3)
    integer, intent(in) :: k
    real(qp), parameter :: none(3) = 0
    real(qp) :: stretched(2)
    integer :: j, n

    power = dot_product(machine%foundation_stiffness(k, :), rest)
    do j = 1, size(machine%supports)
      stretched = 0
      do n = 1, 3
        stretched = stretched + rest(n)*(stretch(machine, j, moved(none, n, by_place)) &
          - stretch(machine, j, moved(none, n, -by_place)))/(2*by_place)
      end do
      power = power + sum(machine%supports(j)%stiffness*stretched &
        *(stretch(machine, j, moved(q, k, by_place)) - stretch(machine, j, moved(q, k, -by_place)))/(2*by_place))
    end do
  end function static_power

  !> The dampers' part of the k-th equation; `rate`: over the differences of q.
  pure real(qp) function damping_power(machine, q, rate, k) result(power)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: q(3, -1:1), rate
    integer, intent(in) :: k
    integer :: j

    power = machine%foundation_damping(k)*rate*(q(k, 1) - q(k, -1))/2
    do j = 1, size(machine%supports)
      power = power + sum(machine%supports(j)%damping*rate*(stretch(machine, j, q(:, 1)) - stretch(machine, j, q(:, -1)))/2 &
        *(stretch(machine, j, moved(q(:, 0), k, by_place)) - stretch(machine, j, moved(q(:, 0), k, -by_place)))/(2*by_place))
    end do
  end function damping_power

  !> The mean power of the dampers, of q at as many equidistant crank angles, each with its neighbours, shape (3, 3, angles).
  real(qp) function mean_dissipation(machine, angle_step, q) result(power)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: angle_step, q(:, :, :)
    real(qp) :: rate
    integer :: j, k

    power = 0
    rate = crank_speed(machine)/angle_step
    do j = 1, size(q, 3)
      do k = 1, 3
        power = power + rate*(q(k, 3, j) - q(k, 1, j))/2*damping_power(machine, q(:, :, j), rate, k)/size(q, 3)
      end do
    end do
  end function mean_dissipation

end module reference_exact
