!> Reference equations of motion of the frame, (8)-(12) and (20)-(23), in quadruple precision.
module reference_frame
  use reference_flow, only: flow_system, flow_map, periodic_start
  use reference_linear, only: qp, solve
  use reference_linkage, only: mass_functions, mass_functions_type
  use reference_machine, only: crank_speed, machine_data, period, pi_qp
  implicit none (type, external)
  private

  public :: frame_system, frame_of, frame_matrices, frame_period

  !> The frame of a machine as a system of 2, 4 or 6 states x = (q, q'), q the free ones of (xi, eta, psi) in this
  !> order, t in s from the crank's phase.
  type, extends(flow_system) :: frame_system
    type(machine_data) :: machine
    real(qp) :: omega = 0
    integer, allocatable :: free(:) ! their places in (xi, eta, psi)
    real(qp) :: stiffness(3, 3) = 0, damping(3, 3) = 0 ! of supports and foundation, all three: c_ij and b_ij
  contains
    procedure :: evaluate => evaluate_frame
  end type frame_system

contains

  function frame_of(machine) result(frame)
    type(machine_data), intent(in) :: machine
    type(frame_system) :: frame
    integer :: i

    frame%free = pack([1, 2, 3], machine%free)
    frame%n = 2*size(frame%free)
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

  !> M, B, C (n/2, n/2) and h (n/2) of (9)-(12) at time t: what holds the rest of q at 0 does no work on the free ones,
  !> so their rows stand as they are, and the columns of the rest go.
  subroutine frame_matrices(frame, t, m, b, c, h)
    class(frame_system), intent(in) :: frame
    real(qp), intent(in) :: t
    real(qp), intent(out) :: m(:, :), b(:, :), c(:, :), h(:)
    real(qp) :: full_m(3, 3), full_b(3, 3), full_c(3, 3), full_h(3)

    call full_matrices(frame, t, full_m, full_b, full_c, full_h)
    m = full_m(frame%free, frame%free)
    b = full_b(frame%free, frame%free)
    c = full_c(frame%free, frame%free)
    h = full_h(frame%free)
  end subroutine frame_matrices

  subroutine full_matrices(frame, t, m, b, c, h)
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
  end subroutine full_matrices

  !> P and f of (21), (22).
  subroutine evaluate_frame(self, t, p, f)
    class(frame_system), intent(in) :: self
    real(qp), intent(in) :: t
    real(qp), intent(out) :: p(:, :), f(:)
    real(qp), dimension(size(self%free), size(self%free)) :: m, b, c
    real(qp) :: h(size(self%free)), right(size(self%free), 2*size(self%free) + 1)
    integer :: i, k

    k = size(self%free)
    call frame_matrices(self, t, m, b, c, h)
    right(:, :k) = -c
    right(:, k + 1:2*k) = -b
    right(:, 2*k + 1) = h
    right = solve(m, right)
    p = 0
    do i = 1, k
      p(i, i + k) = 1
    end do
    p(k + 1:, :) = right(:, :2*k)
    f(:k) = 0
    f(k + 1:) = right(:, 2*k + 1)
  end subroutine evaluate_frame

  !> Everything of one period: Phi(T), x_p(T) and the start x0 of the periodic vibration.
  subroutine frame_period(frame, tolerance, phi, particular, x0)
    type(frame_system), intent(in) :: frame
    real(qp), intent(in) :: tolerance
    real(qp), intent(out) :: phi(:, :), particular(:), x0(:)

    call flow_map(frame, 0.0_qp, period(frame%machine), tolerance, phi, particular)
    x0 = periodic_start(phi, particular)
  end subroutine frame_period

end module reference_frame
