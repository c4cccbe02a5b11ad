!> Reference equations of motion of the frame, (8)-(12) and (20)-(23), in quadruple precision.
module reference_frame
  use reference_flow, only: flow_system, flow_map, periodic_start
  use reference_four_bar, only: crank_speed, machine_data, mass_functions, mass_functions_type, period, pi_qp
  use reference_linear, only: qp, solve
  implicit none (type, external)
  private

  public :: frame_system, frame_of, frame_matrices, frame_period

  !> The frame of a machine as a system of 6 states x = (q, q'), q = (xi, eta, psi), t in s from the crank's phase.
  type, extends(flow_system) :: frame_system
    type(machine_data) :: machine
    real(qp) :: omega = 0
    real(qp) :: stiffness(3, 3) = 0, damping(3, 3) = 0 ! of supports and foundation: c_ij and b_ij
  contains
    procedure :: evaluate => evaluate_frame
  end type frame_system

contains

  function frame_of(machine) result(frame)
    type(machine_data), intent(in) :: machine
    type(frame_system) :: frame
    integer :: i

    frame%n = 6
    frame%machine = machine
    frame%omega = crank_speed(machine)
    frame%stiffness = machine%foundation_stiffness
    do i = 1, 3
      frame%damping(i, i) = machine%foundation_damping(i)
    end do
    do i = 1, size(machine%supports)
      associate (support => machine%supports(i))
        frame%stiffness = frame%stiffness + at_frame(support%stiffness*1.0_qp, support%position*1.0_qp, &
          & support%angle_deg*pi_qp/180)
        frame%damping = frame%damping + at_frame(support%damping*1.0_qp, support%position*1.0_qp, &
          & support%angle_deg*pi_qp/180)
      end associate
    end do
  end function frame_of

  !> G^T diag(coefficient) G, where G q are the displacements of the point (X, Y) of the frame along the support's two
  !> axes. At angle 0: c11 = k, c13 = -k Y, c22 = kb, c23 = kb X, c33 = k Y^2 + kb X^2.
  function at_frame(coefficient, position, angle) result(c)
    real(qp), intent(in) :: coefficient(2), position(2), angle
    real(qp) :: c(3, 3), axis(2, 2), g(2, 3)
    integer :: i, j

    axis(1, :) = [cos(angle), sin(angle)]
    axis(2, :) = [-sin(angle), cos(angle)]
    g(:, 1) = axis(:, 1)
    g(:, 2) = axis(:, 2)
    g(:, 3) = matmul(axis, [-position(2), position(1)])
    do j = 1, 3
      do i = 1, 3
        c(i, j) = sum(g(:, i)*coefficient*g(:, j))
      end do
    end do
  end function at_frame

  !> M, B, C (3, 3) and h (3) of (9)-(12) at time t.
  subroutine frame_matrices(frame, t, m, b, c, h)
    class(frame_system), intent(in) :: frame
    real(qp), intent(in) :: t
    real(qp), intent(out) :: m(3, 3), b(3, 3), c(3, 3), h(3)
    type(mass_functions_type) :: a
    real(qp) :: x0, y0, w

    x0 = frame%machine%origin(1)
    y0 = frame%machine%origin(2)
    w = frame%omega
    a = mass_functions(frame%machine, w*t)
    m = 0
    m(1, 1) = frame%machine%frame_mass + a%mass
    m(2, 2) = m(1, 1)
    m(1, 3) = -(a%mass*y0 + a%a2(0))
    m(2, 3) = a%mass*x0 + a%a1(0)
    m(3, 1) = m(1, 3)
    m(3, 2) = m(2, 3)
    m(3, 3) = frame%machine%frame_inertia + a%inertia + a%mass*(x0**2 + y0**2) + a%a3(0) &
      & + 2*(x0*a%a1(0) + y0*a%a2(0))
    b = frame%damping
    b(1, 3) = b(1, 3) - 2*w*a%a2(1)
    b(2, 3) = b(2, 3) + 2*w*a%a1(1)
    b(3, 3) = b(3, 3) + w*(a%a3(1) + 2*(x0*a%a1(1) + y0*a%a2(1)))
    c = frame%stiffness
    c(1, 3) = c(1, 3) - w**2*a%a2(2)
    c(2, 3) = c(2, 3) + w**2*a%a1(2)
    h = -w**2*[a%a1(2), a%a2(2), x0*a%a2(2) - y0*a%a1(2) + a%a4]
  end subroutine frame_matrices

  !> P and f of (21), (22).
  subroutine evaluate_frame(self, t, p, f)
    class(frame_system), intent(in) :: self
    real(qp), intent(in) :: t
    real(qp), intent(out) :: p(:, :), f(:)
    real(qp) :: m(3, 3), b(3, 3), c(3, 3), h(3), right(3, 7)
    integer :: i

    call frame_matrices(self, t, m, b, c, h)
    right(:, 1:3) = -c
    right(:, 4:6) = -b
    right(:, 7) = h
    right = solve(m, right)
    p = 0
    do i = 1, 3
      p(i, i + 3) = 1
    end do
    p(4:6, :) = right(:, 1:6)
    f(1:3) = 0
    f(4:6) = right(:, 7)
  end subroutine evaluate_frame

  !> Everything of one period: Phi(T), x_p(T) and the start x0 of the periodic vibration.
  subroutine frame_period(frame, tolerance, phi, particular, x0)
    type(frame_system), intent(in) :: frame
    real(qp), intent(in) :: tolerance
    real(qp), intent(out) :: phi(6, 6), particular(6), x0(6)

    call flow_map(frame, 0.0_qp, period(frame%machine), tolerance, phi, particular)
    x0 = periodic_start(phi, particular)
  end subroutine frame_period

end module reference_frame
