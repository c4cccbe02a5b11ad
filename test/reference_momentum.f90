!> Forces and moment on the ground from the laws of momentum and angular momentum of bodies in space, without equations of
!> motion.
module reference_momentum
  use reference_joints, only: left
  use reference_linear, only: qp
  use reference_linkage, only: motion_type, move
  use reference_machine, only: crank_speed, dp, machine_data, pi_qp
  implicit none (type, external)
  private

  public :: derivative, exact_torque, ground_forces

contains

  !> d/dt of a trigonometric polynomial through equidistant samples over the period, the first at t = 0.
  function derivative(samples, period) result(slope)
    real(dp), intent(in) :: samples(:), period
    real(dp) :: slope(size(samples))
    real(dp) :: cosine, sine, w(0:size(samples) - 1), u(0:size(samples) - 1)
    integer :: i, k, n

    n = size(samples)
    w = real([(cos(2*pi_qp*i/n), i=0, n - 1)], dp)
    u = real([(sin(2*pi_qp*i/n), i=0, n - 1)], dp)
    slope = 0
    do k = 1, (n - 1)/2
      cosine = 2*sum(samples*[(w(modulo(k*i, n)), i=0, n - 1)])/n
      sine = 2*sum(samples*[(u(modulo(k*i, n)), i=0, n - 1)])/n
      slope = slope + k*[(sine*w(modulo(k*i, n)) - cosine*u(modulo(k*i, n)), i=0, n - 1)]
    end do
    slope = slope*real(2*pi_qp, dp)/period
  end function derivative

  !> Forces on the ground (N) and their moment about F (N m), shape (3, points), from q = (xi, eta, psi) at equidistant
  !> times over a turn, to first order in q: minus d/dt of the momentum, and minus d/dt of the angular momentum about F as it
  !> moves less what its acceleration adds.
  function ground_forces(machine, q) result(forces)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: q(:, :)
    real(dp) :: forces(3, size(q, 2))
    real(dp) :: sums(4, size(q, 2)), v(3, size(q, 2)), spin(size(q, 2)), t, omega, r(2), rd(2), acceleration(2)
    type(motion_type) :: motion
    integer :: i, k, n

    n = size(q, 2)
    t = 60/abs(machine%speed_rpm)
    omega = real(crank_speed(machine), dp)
    do i = 1, 3
      v(i, :) = derivative(q(i, :), t)
    end do
    do k = 1, n
      motion = move(machine, crank_speed(machine)*t*(k - 1)/n)
      sums(:2, k) = machine%frame_mass*q(:2, k)
      sums(3:, k) = 0
      spin(k) = machine%frame_inertia*v(3, k)
      do i = 1, size(machine%links)
        associate (m => machine%links(i)%mass, j => machine%links(i)%inertia)
          r = real(motion%center(:, 0, i), dp) + machine%origin
          rd = real(motion%center(:, 1, i), dp)*omega
          sums(:2, k) = sums(:2, k) + m*(q(:2, k) + r + q(3, k)*[-r(2), r(1)])
          sums(3:, k) = sums(3:, k) + m*r
          spin(k) = spin(k) + m*(r(1)*(rd(2) + v(3, k)*r(1)) - r(2)*(rd(1) - v(3, k)*r(2))) &
            & + j*(v(3, k) + omega*real(motion%turn(1, i), dp))
        end associate
      end do
    end do
    do i = 1, 2
      forces(i, :) = -derivative(derivative(sums(i, :), t), t)
      v(i, :) = derivative(v(i, :), t)
    end do
    forces(3, :) = -derivative(spin, t)
    do k = 1, n
      acceleration = v(:2, k)
      forces(3, k) = forces(3, k) - (sums(3, k)*acceleration(2) - sums(4, k)*acceleration(1))
    end do
  end function ground_forces

  !> The torque on the crank (N m) at the crank angle `angle` by Lagrange's equation for it, d/dt dT/dOmega - dT/dphi, of the
  !> kinetic energy of all bodies in space, exact in psi: q, q', q'' are the frame's position, velocity and acceleration.
  function exact_torque(machine, angle, q, v, a) result(torque)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: angle, q(3), v(3), a(3)
    real(qp) :: torque, crank, rate, gain
    real(qp), parameter :: h = 1.0e-11_qp ! truncation h^2, roundings 1e-33/h

    crank = angle
    rate = crank_speed(machine)
    gain = 0
    if (machine%held_by /= "motor") then
      ! the crank turns uniformly in space: its angle against the frame is smaller by psi
      crank = crank - q(3)
      rate = rate - v(3)
      gain = -a(3)
    end if
    torque = (impulse(h) - impulse(-h))/(2*h) - (energy(crank + h, rate, q, v) - energy(crank - h, rate, q, v))/(2*h)

  contains

    !> The derivative of T with respect to the crank's rate, a time t later: T is a polynomial of degree two in the rate.
    function impulse(t) result(p)
      real(qp), intent(in) :: t
      real(qp) :: p, phi, w, q_t(3), v_t(3)

      phi = crank + rate*t + gain*t**2/2
      w = rate + gain*t
      q_t = q + v*t + a*t**2/2
      v_t = v + a*t
      p = (energy(phi, w + 1, q_t, v_t) - energy(phi, w - 1, q_t, v_t))/2
    end function impulse

    !> Kinetic energy of the links.
    function energy(phi, w, q, v) result(t)
      real(qp), intent(in) :: phi, w, q(3), v(3)
      real(qp) :: t, r(2), rd(2), velocity(2)
      type(motion_type) :: motion
      integer :: i

      motion = move(machine, phi)
      t = 0
      do i = 1, size(machine%links)
        r = turned(motion%center(:, 0, i) + machine%origin, q(3))
        rd = turned(motion%center(:, 1, i), q(3))*w
        velocity = v(:2) + v(3)*left(r) + rd
        t = t + (machine%links(i)%mass*sum(velocity**2) + machine%links(i)%inertia*(v(3) + w*motion%turn(1, i))**2)/2
      end do
    end function energy

  end function exact_torque

  !> r turned by psi.
  pure function turned(r, psi) result(s)
    real(qp), intent(in) :: r(2), psi
    real(qp) :: s(2)

    s = [cos(psi)*r(1) - sin(psi)*r(2), sin(psi)*r(1) + cos(psi)*r(2)]
  end function turned

end module reference_momentum
