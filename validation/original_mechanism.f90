!> The four-bar mechanism of the paper's example on its elastically mounted frame, eqs (4)-(12) and (20)-(23).
!> Closed form, double precision, nothing from the library: the ground on which the original program is reconstructed.
module original_mechanism
  use, intrinsic :: iso_fortran_env, only: dp => real64
  implicit none (type, external)
  private

  public :: dp, pi
  public :: four_bar, heavier, crank_speed, state_form, inertia_matrix, identity, solve

  real(dp), parameter :: pi = acos(-1.0_dp)

  !> The example with the data of Table 1; every default is the paper's value in SI units, apart from
  !> `ground_link` and the standard gravity in `stiffness`, which are recovered from Table 3.
  type :: four_bar
    !> l1: from the crank's bearing (the origin O) to the rocker's bearing, along x
    real(dp) :: ground_link = 0.40_dp
    !> l2, l3, l4: crank, coupler, rocker
    real(dp) :: length(3) = [0.07_dp, 0.37_dp, 0.16_dp]
    !> Centres of mass on the way from the link's first to its second joint
    real(dp) :: center(3) = [0.03_dp, 0.18_dp, 0.08_dp]
    real(dp) :: mass(3) = [0.50_dp, 0.60_dp, 0.25_dp]
    real(dp) :: inertia(3) = [0.0035_dp, 0.0070_dp, 0.0060_dp]
    real(dp) :: frame_mass = 18.0_dp, frame_inertia = 0.78_dp
    !> (xi0, eta0): the origin O in the frame's system
    real(dp) :: origin(2) = [-0.20_dp, 0.20_dp]
    !> Places of the four supports in the frame's system
    real(dp) :: support_x(4) = [-0.30_dp, -0.10_dp, 0.10_dp, 0.30_dp]
    real(dp) :: support_y(4) = -0.20_dp
    !> Stiffness of every support in both directions: 200 kp/cm
    real(dp) :: stiffness = 20000.0_dp * 9.80665_dp
    real(dp) :: damping(3) = [0.5_dp, 0.5_dp, 0.05_dp]
  end type four_bar

  !> (4)-(7) with their derivatives with respect to the time; a12 = a1 + i a2.
  type :: mass_functions
    complex(dp) :: a12, a12_dot, a12_ddot
    real(dp) :: a3, a3_dot, a4
  end type mass_functions

  interface
    subroutine dgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: dp
      implicit none (type, external)
      integer, intent(in) :: n, nrhs, lda, ldb
      real(dp), intent(inout) :: a(lda, *), b(ldb, *)
      integer, intent(out) :: ipiv(*), info
    end subroutine dgesv
  end interface

contains

  !> The same machine with `factor` times the masses and moments of inertia of the moving links.
  pure function heavier(machine, factor) result(heavy)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: factor
    type(four_bar) :: heavy

    heavy = machine
    heavy%mass = factor * machine%mass
    heavy%inertia = factor * machine%inertia
  end function heavier

  !> Omega in rad/s of n in 1/min.
  pure real(dp) function crank_speed(rpm) result(omega)
    real(dp), intent(in) :: rpm

    omega = rpm * pi / 30.0_dp
  end function crank_speed

  !> (20)-(23) at the time t: x' = P x + f with x = (q, q').
  subroutine state_form(machine, omega, t, p, f)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega, t
    real(dp), intent(out) :: p(6, 6), f(6)

    type(mass_functions) :: a
    real(dp) :: right(3, 7)
    integer :: i

    a = sum_over_links(machine, omega, omega * t)
    right(:, 1:3) = -stiffness_matrix(machine, a)
    right(:, 4:6) = -damping_matrix(machine, a)
    right(:, 7) = excitation(machine, a)
    right = solve(mass_matrix(machine, a), right)

    p = 0.0_dp
    do i = 1, 3
      p(i, i + 3) = 1.0_dp
    end do
    p(4:6, :) = right(:, 1:6)
    f = [0.0_dp, 0.0_dp, 0.0_dp, right(:, 7)]
  end subroutine state_form

  !> M of (9) at a crank angle.
  pure function inertia_matrix(machine, angle) result(m)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: angle
    real(dp) :: m(3, 3)

    m = mass_matrix(machine, sum_over_links(machine, 1.0_dp, angle))
  end function inertia_matrix

  !> (9)
  pure function mass_matrix(machine, a) result(m)
    type(four_bar), intent(in) :: machine
    type(mass_functions), intent(in) :: a
    real(dp) :: m(3, 3)

    real(dp) :: total, links, xi0, eta0, m13, m23, m33

    links = sum(machine%mass)
    total = machine%frame_mass + links
    xi0 = machine%origin(1)
    eta0 = machine%origin(2)
    m13 = -links * eta0 - a%a12%im
    m23 = links * xi0 + a%a12%re
    m33 = machine%frame_inertia + sum(machine%inertia) + links * (xi0**2 + eta0**2) &
        & + a%a3 + 2 * xi0 * a%a12%re + 2 * eta0 * a%a12%im
    m = reshape([total, 0.0_dp, m13, 0.0_dp, total, m23, m13, m23, m33], [3, 3])
  end function mass_matrix

  !> (10)
  pure function damping_matrix(machine, a) result(b)
    type(four_bar), intent(in) :: machine
    type(mass_functions), intent(in) :: a
    real(dp) :: b(3, 3)

    integer :: i

    b = 0.0_dp
    do i = 1, 3
      b(i, i) = machine%damping(i)
    end do
    b(1, 3) = -2 * a%a12_dot%im
    b(2, 3) = 2 * a%a12_dot%re
    b(3, 3) = b(3, 3) + a%a3_dot + 2 * machine%origin(1) * a%a12_dot%re + 2 * machine%origin(2) * a%a12_dot%im
  end function damping_matrix

  !> (11), with the spring constants c_ij of the supports
  pure function stiffness_matrix(machine, a) result(c)
    type(four_bar), intent(in) :: machine
    type(mass_functions), intent(in) :: a
    real(dp) :: c(3, 3)

    real(dp) :: k

    k = machine%stiffness
    associate (x => machine%support_x, y => machine%support_y)
      c = 0.0_dp
      c(1, 1) = k * size(x)
      c(2, 2) = k * size(x)
      c(3, 1) = -k * sum(y)
      c(3, 2) = k * sum(x)
      c(3, 3) = k * sum(x**2 + y**2)
    end associate
    c(1, 3) = c(3, 1) - a%a12_ddot%im
    c(2, 3) = c(3, 2) + a%a12_ddot%re
  end function stiffness_matrix

  !> (12)
  pure function excitation(machine, a) result(h)
    type(four_bar), intent(in) :: machine
    type(mass_functions), intent(in) :: a
    real(dp) :: h(3)

    h(1) = -a%a12_ddot%re
    h(2) = -a%a12_ddot%im
    h(3) = -machine%origin(1) * a%a12_ddot%im + machine%origin(2) * a%a12_ddot%re - a%a4
  end function excitation

  !> (4)-(7) at a crank angle, the plane of the mechanism taken as the complex plane.
  !> The links' angles phi, beta, gamma follow from the loop  l2 e^(i phi) + l3 e^(i beta) = l1 + l4 e^(i gamma)
  !> (open branch: the joint between coupler and rocker lies left of the way from the crank pin to the rocker's
  !> bearing), their derivatives from that loop differentiated and turned by -gamma (for beta) or -beta (for gamma).
  pure function sum_over_links(machine, omega, phi) result(a)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega, phi
    type(mass_functions) :: a

    real(dp), dimension(3) :: angle, rate, acceleration
    complex(dp), dimension(3) :: z, z_dot, z_ddot, along, pivot, pivot_dot, pivot_ddot
    complex(dp) :: diagonal
    real(dp) :: beta, gamma, rise, beta_dot, gamma_dot
    complex(dp), parameter :: i = (0.0_dp, 1.0_dp)

    associate (l1 => machine%ground_link, l2 => machine%length(1), l3 => machine%length(2), l4 => machine%length(3))
      diagonal = l1 - l2 * exp(i * phi)
      rise = acos((l3**2 + abs(diagonal)**2 - l4**2) / (2 * l3 * abs(diagonal)))
      beta = atan2(diagonal%im, diagonal%re) + rise
      along(1) = l3 * exp(i * beta) - diagonal
      gamma = atan2(along(1)%im, along(1)%re)

      beta_dot = -omega * l2 * sin(phi - gamma) / (l3 * sin(beta - gamma))
      gamma_dot = omega * l2 * sin(phi - beta) / (l4 * sin(gamma - beta))
      angle = [phi, beta, gamma]
      rate = [omega, beta_dot, gamma_dot]
      acceleration(1) = 0.0_dp
      acceleration(2) = (l4 * gamma_dot**2 - omega**2 * l2 * cos(phi - gamma) - l3 * beta_dot**2 * cos(beta - gamma)) &
          & / (l3 * sin(beta - gamma))
      acceleration(3) = (omega**2 * l2 * cos(phi - beta) + l3 * beta_dot**2 - l4 * gamma_dot**2 * cos(gamma - beta)) &
          & / (l4 * sin(gamma - beta))

      pivot = [(0.0_dp, 0.0_dp), l2 * exp(i * phi), cmplx(l1, 0.0_dp, dp)]
      pivot_dot = [(0.0_dp, 0.0_dp), i * omega * l2 * exp(i * phi), (0.0_dp, 0.0_dp)]
      pivot_ddot = [(0.0_dp, 0.0_dp), -omega**2 * l2 * exp(i * phi), (0.0_dp, 0.0_dp)]
    end associate

    along = machine%center * exp(i * angle)
    z = pivot + along
    z_dot = pivot_dot + i * rate * along
    z_ddot = pivot_ddot + (i * acceleration - rate**2) * along

    associate (m => machine%mass)
      a%a12 = sum(m * z)
      a%a12_dot = sum(m * z_dot)
      a%a12_ddot = sum(m * z_ddot)
      a%a3 = sum(m * abs(z)**2)
      a%a3_dot = sum(2 * m * real(conjg(z) * z_dot))
      a%a4 = sum(m * aimag(conjg(z) * z_ddot) + machine%inertia * acceleration)
    end associate
  end function sum_over_links

  !> The solution of a x = b for several right-hand sides.
  function solve(a, b) result(x)
    real(dp), intent(in) :: a(:, :), b(:, :)
    real(dp) :: x(size(b, 1), size(b, 2))

    real(dp) :: factors(size(a, 1), size(a, 2))
    integer :: pivots(size(a, 1)), info

    factors = a
    x = b
    call dgesv(size(a, 1), size(b, 2), factors, size(a, 1), pivots, x, size(b, 1), info)
    if (info /= 0) error stop "the matrix to be solved with is singular"
  end function solve

  pure function identity(n) result(e)
    integer, intent(in) :: n
    real(dp) :: e(n, n)

    integer :: i

    e = 0.0_dp
    do i = 1, n
      e(i, i) = 1.0_dp
    end do
  end function identity

end module original_mechanism
