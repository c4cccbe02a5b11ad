!> Check of (1)-(3) against Newton's law without any linearisation.
!>
!> Derivation. A mass m_i at s = (xi_0 + x_i, eta_0 + y_i) in the frame's system is in space at R = q + D s with
!> q = (xi, eta) and D the rotation by psi. With J the rotation by 90 degrees and s'' = r'' (r = (x_i, y_i)),
!>   R'' = q'' + psi'' J D s - psi'^2 D s + 2 psi' J D r' + D r''.
!> To first order in (q, psi) D = E + psi J, and psi'^2 drops out:
!>   R'' = q'' + psi'' J s + 2 psi' J r' + r'' + psi J r'',    J r = (-y, x).
!> Forces: m_F q'' + sum m_i R'' = K, the force of supports and foundation. First component:
!>   (m_F + m_G) xi'' - psi'' (m_G eta_0 + sum m_i y_i) - 2 psi' sum m_i y_i' - psi sum m_i y_i''
!>     = -sum m_i x_i'' + K_x,
!> which is (1); the second, with J's lower row, has +x in the place of -y: (2).
!> Moments about the (moving) point F: J_F psi'' + sum J_i (psi'' + phi_i'') + sum m_i (D s) x R'' = K_m. Turning both
!> factors by D^-1 leaves a cross product as it is, so without linearisation
!>   (D s) x R'' = (D s) x q'' + psi'' |s|^2 + 2 psi' s.r' + s x r'',
!> the psi'^2 term being s x s = 0. To first order (D s) x q'' = s_x eta'' - s_y xi''. The sums give (3):
!> there is no term in psi apart from the springs, and h_3 = -sum m_i (s x r'') - sum J_i phi_i'' is that of (12).
!> Supports: the point S = (X, Y) moves by d = q + (D - E) S; force -k d - b d', moment (D S) x force. To first order
!> d = (xi - Y psi, eta + X psi), whence c_ij = G^T k G with G = [E, J S].
!>
!> The routine below takes only the positions of joints and centres from the kinematics; all derivatives in time are
!> differences, and nothing of the derivation enters.
module reference_newton
  use reference_frame, only: frame_matrices, frame_of, frame_system
  use reference_linear, only: qp
  use reference_linkage, only: motion_type, move
  use reference_machine, only: machine_data, pi_qp
  implicit none (type, external)
  private

  public :: newton_orders

  !> Second derivative by a central difference of order 10 over 11 points.
  real(qp), parameter :: second(0:5) = [-5269.0_qp/1800, 5.0_qp/3, -5.0_qp/21, 5.0_qp/126, -5.0_qp/1008, 1.0_qp/3150]
  real(qp), parameter :: spacing = 1.0_qp/10000 ! of the differences, in crank angle (rad)

contains

  !> orders(:, 1): forces and moment of inertia, orders(:, 2): forces and moment of supports and foundation; rows
  !> xi, eta, psi. Order of the difference between Newton's law and M q'' + B q' + C q - h for a vibration of the given
  !> amplitude (rad, and times 0.1 m) when the amplitude is cut to a tenth: 2 if the linear equations are right (3 where
  !> the quadratic terms vanish by symmetry), 1 or 0 if they are wrong. defect: the differences at the smaller
  !> amplitude over the norm of the forces. Take an amplitude of 1e-4 to 1e-6. All of q is taken as free, whatever
  !> machine%free says: for fewer it is the same equations with the rest of q at 0.
  subroutine newton_orders(machine, angle, amplitude, orders, defect)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: angle, amplitude
    real(qp), intent(out) :: orders(3, 2), defect(3, 2)
    type(frame_system) :: frame
    type(machine_data) :: unhindered
    real(qp) :: coarse(3, 2), forces(2)

    unhindered = machine
    unhindered%free = .true.
    frame = frame_of(unhindered)
    call difference(frame, angle, amplitude, coarse, forces)
    call difference(frame, angle, amplitude/10, defect, forces)
    orders = log10(max(abs(coarse), 1.0e-30_qp)/max(abs(defect), 1.0e-30_qp))
    defect(:, 1) = defect(:, 1)/forces(1)
    defect(:, 2) = defect(:, 2)/forces(2)
  end subroutine newton_orders

  !> Newton's law minus the linear equations; column 1 inertia, column 2 supports. forces: norms of the compared terms.
  subroutine difference(frame, angle, amplitude, result, forces)
    type(frame_system), intent(in) :: frame
    real(qp), intent(in) :: angle, amplitude
    real(qp), intent(out) :: result(3, 2), forces(2)
    real(qp), dimension(3, 3) :: m, b, c
    real(qp), dimension(3) :: h, q, v, acceleration, linear_inertia, linear_support

    q = vibration(amplitude, 0.0_qp, 0)
    v = vibration(amplitude, 0.0_qp, 1)*frame%omega
    acceleration = vibration(amplitude, 0.0_qp, 2)*frame%omega**2
    call frame_matrices(frame, angle/frame%omega, m, b, c, h)
    linear_support = matmul(frame%stiffness, q) + matmul(frame%damping, v)
    linear_inertia = matmul(m, acceleration) + matmul(b, v) + matmul(c, q) - h - linear_support
    result(:, 1) = inertia_forces(frame, angle, amplitude) - linear_inertia
    result(:, 2) = support_forces(frame, q, v) - linear_support
    forces = [norm2(linear_inertia), norm2(linear_support)]
  end subroutine difference

  !> q and its derivatives at `turned` from the moment considered: some vibration with all of q, q', q'' different
  !> from zero and of like size. Everything is in crank angle.
  function vibration(amplitude, turned, order) result(q)
    real(qp), intent(in) :: amplitude, turned
    integer, intent(in) :: order
    real(qp) :: q(3)
    real(qp), parameter :: frequency(3) = [1.3_qp, 0.9_qp, 1.7_qp], phase(3) = [0.4_qp, 2.2_qp, -0.7_qp]
    real(qp), parameter :: size_of(3) = [0.07_qp, 0.11_qp, 0.9_qp]

    q = amplitude*size_of*frequency**order*cos(frequency*turned + phase + order*pi_qp/2)
  end function vibration

  !> Sums of m R'' and of J (psi'' + phi'') + m (R - F) x R'' over frame and links, without linearisation.
  function inertia_forces(frame, angle, amplitude) result(force)
    type(frame_system), intent(in) :: frame
    real(qp), intent(in) :: angle, amplitude
    real(qp) :: force(3)
    real(qp) :: place(3, 0:size(frame%machine%links), -5:5), acceleration(3)
    integer :: i

    do i = -5, 5
      call places(frame, angle, amplitude, i, place(:, :, i))
    end do
    acceleration = acceleration_of(place(:, 0, :), frame%omega)
    force = [frame%machine%frame_mass, frame%machine%frame_mass, frame%machine%frame_inertia]*acceleration
    do i = 1, size(frame%machine%links)
      associate (link => frame%machine%links(i))
        acceleration = acceleration_of(place(:, i, :), frame%omega)
        force(1:2) = force(1:2) + link%mass*acceleration(1:2)
        force(3) = force(3) + link%inertia*acceleration(3) &
          & + link%mass*cross(place(1:2, i, 0) - place(1:2, 0, 0), acceleration(1:2))
      end associate
    end do
  end function inertia_forces

  !> Place in space (x, y, angle) of the frame's F (column 0) and of the links' centres of mass, i spacings of crank
  !> angle after the moment considered. Angles of links are counted from that moment.
  subroutine places(frame, angle, amplitude, i, place)
    type(frame_system), intent(in) :: frame
    real(qp), intent(in) :: angle, amplitude
    integer, intent(in) :: i
    real(qp), intent(out) :: place(3, 0:size(frame%machine%links))
    type(motion_type) :: now, start
    real(qp) :: u0(2), u(2)
    integer :: k

    start = move(frame%machine, angle)
    now = move(frame%machine, angle + i*spacing)
    place(:, 0) = vibration(amplitude, i*spacing, 0)
    do k = 1, size(frame%machine%links)
      place(1:2, k) = place(1:2, 0) + rotate(place(3, 0), frame%machine%origin + now%center(:, 0, k))
      place(3, k) = place(3, 0)
      associate (link => frame%machine%links(k))
        if (link%to /= 0) then
          u0 = start%joint(:, 0, link%to) - start%joint(:, 0, link%from)
          u = now%joint(:, 0, link%to) - now%joint(:, 0, link%from)
          place(3, k) = place(3, k) + atan2(cross(u0, u), dot_product(u0, u))
        end if
      end associate
    end do
  end subroutine places

  !> Second derivative in time, in the middle of 11 values.
  function acceleration_of(values, omega) result(derivative)
    real(qp), intent(in) :: values(:, -5:), omega
    real(qp) :: derivative(3)
    integer :: k

    derivative = second(0)*values(:, 0)
    do k = 1, 5
      derivative = derivative + second(k)*(values(:, k) + values(:, -k))
    end do
    derivative = derivative*(omega/spacing)**2
  end function acceleration_of

  !> Forces and moment about F that the frame must overcome at supports and foundation.
  function support_forces(frame, q, v) result(force)
    type(frame_system), intent(in) :: frame
    real(qp), intent(in) :: q(3), v(3)
    real(qp) :: force(3)
    real(qp) :: arm(2), shift(2), speed(2), pull(2), turned
    integer :: i

    force = matmul(real(frame%machine%foundation_stiffness, qp), q) + frame%machine%foundation_damping*v
    do i = 1, size(frame%machine%supports)
      associate (support => frame%machine%supports(i))
        turned = support%angle_deg*pi_qp/180
        arm = rotate(q(3), real(support%position, qp))
        shift = rotate(-turned, q(1:2) + arm - support%position)
        speed = rotate(-turned, v(1:2) + v(3)*[-arm(2), arm(1)])
        pull = rotate(turned, support%stiffness*shift + support%damping*speed)
        force(1:2) = force(1:2) + pull
        force(3) = force(3) + cross(arm, pull)
      end associate
    end do
  end function support_forces

  pure function rotate(by, u) result(w)
    real(qp), intent(in) :: by, u(2)
    real(qp) :: w(2)

    w = [cos(by)*u(1) - sin(by)*u(2), sin(by)*u(1) + cos(by)*u(2)]
  end function rotate

  pure function cross(u, w) result(z)
    real(qp), intent(in) :: u(2), w(2)
    real(qp) :: z

    z = u(1)*w(2) - u(2)*w(1)
  end function cross

end module reference_newton
