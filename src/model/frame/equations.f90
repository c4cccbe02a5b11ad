!> Equations (9) to (12) of doc/theory.md: matrices and load of a frame in the plane with its mechanism, linearised about rest.
module gestell_model_frame_equations
  use gestell_base_kinds, only: dp, pi
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_v, load_sums_type, mechanism_type, &
    & table_columns
  use gestell_model_mechanism_loads, only: effect_of, load_effect_type
  use gestell_model_mounting_weights, only: weights_type
  use gestell_model_mechanism_held, only: part_of_turn, tabulate_effective
  implicit none (type, external)
  private

  public :: add_loads, add_weights, all_connected, cancellation, mass_matrix, set_load, set_matrices

contains

  !> The part of the mass matrix M in (9) that does not depend on the crank angle, for xi, eta and psi.
  pure function mass_matrix(mass, inertia, origin, mechanism) result(m)
    !> `mass`, `inertia`: mass (kg) and moment of inertia (kg m^2) of the frame about its centre of mass F. `origin`: origin of
    !> the mechanism relative to F (m)
    real(dp), intent(in) :: mass, inertia, origin(2)
    class(mechanism_type), intent(in) :: mechanism
    real(dp) :: m(3, 3)

    associate (xi0 => origin(1), eta0 => origin(2), m_g => mechanism%mass)
      m = 0
      m(1, 1) = mass + m_g
      m(2, 2) = mass + m_g
      m(1, 3) = -m_g * eta0
      m(2, 3) = m_g * xi0
      m(3, 1) = m(1, 3)
      m(3, 2) = m(2, 3)
      m(3, 3) = inertia + mechanism%inertia + m_g * (xi0**2 + eta0**2)
    end associate
  end function mass_matrix

  !> Computes the matrices M, B and C of (9) to (11) for the degrees of freedom `free`, shapes (angles, size(free), size(free)).
  !> The mass functions in `table` depend on the crank angle phi alone; the speed Omega enters through d/dt = Omega d/dphi.
  pure subroutine set_matrices(free, constant, damping, stiffness, speed, origin, table, m, b, c)
    integer, intent(in) :: free(:)
    !> `constant`: constant part of the mass matrix (from `mass_matrix`). `damping`, `stiffness`: matrices B_0 and C_0 of the
    !> mounting. `speed`: crank speed (rad/s). `origin`: origin of the mechanism relative to the frame's centre of mass (m)
    real(dp), intent(in) :: constant(3, 3), damping(3, 3), stiffness(3, 3), speed, origin(2)
    !> Mass functions at the crank angles, shape (angles, table_columns)
    real(dp), contiguous, intent(in) :: table(:, :)
    real(dp), contiguous, intent(inout) :: m(:, :, :), b(:, :, :), c(:, :, :)
    integer :: i, j, x, y, psi

    do j = 1, size(free)
      do i = 1, size(free)
        m(:, i, j) = constant(free(i), free(j))                                                   ! (9)
        b(:, i, j) = damping(free(i), free(j))                                               ! (10)
        c(:, i, j) = stiffness(free(i), free(j))                                             ! (11)
      end do
    end do

    x = findloc(free, 1, dim=1)
    y = findloc(free, 2, dim=1)
    psi = findloc(free, 3, dim=1)
    if (psi == 0) return
    associate (omega => speed, xi0 => origin(1), eta0 => origin(2))
      if (x > 0) then
        m(:, x, psi) = m(:, x, psi) - table(:, a2_v)
        m(:, psi, x) = m(:, x, psi)
        b(:, x, psi) = b(:, x, psi) - 2 * omega * table(:, a2_d)
        c(:, x, psi) = c(:, x, psi) - omega**2 * table(:, a2_dd)
      end if
      if (y > 0) then
        m(:, y, psi) = m(:, y, psi) + table(:, a1_v)
        m(:, psi, y) = m(:, y, psi)
        b(:, y, psi) = b(:, y, psi) + 2 * omega * table(:, a1_d)
        c(:, y, psi) = c(:, y, psi) + omega**2 * table(:, a1_dd)
      end if
      m(:, psi, psi) = m(:, psi, psi) + table(:, a3_v) + 2 * xi0 * table(:, a1_v) + 2 * eta0 * table(:, a2_v)
      b(:, psi, psi) = b(:, psi, psi) + omega * (table(:, a3_d) + 2 * xi0 * table(:, a1_d) + 2 * eta0 * table(:, a2_d))
    end associate
  end subroutine set_matrices

  !> Computes the load h of (12), shape (angles, size(free)), for the degrees of freedom `free`.
  pure subroutine set_load(free, speed, origin, load, h)
    integer, intent(in) :: free(:)
    !> `speed`: crank speed (rad/s). `origin`: origin of the mechanism relative to the frame's centre of mass (m)
    real(dp), intent(in) :: speed, origin(2)
    !> Two forces and the moment of the load, each divided by -Omega^2, from `tabulate_effective`; shape (angles, 3)
    real(dp), contiguous, intent(in) :: load(:, :)
    real(dp), contiguous, intent(inout) :: h(:, :)
    integer :: i

    associate (omega => speed, xi0 => origin(1), eta0 => origin(2))
      do i = 1, size(free)
        select case (free(i))
        case (1)
          h(:, i) = -omega**2 * load(:, 1)
        case (2)
          h(:, i) = -omega**2 * load(:, 2)
        case (3)
          h(:, i) = -omega**2 * (xi0 * load(:, 2) - eta0 * load(:, 1) + load(:, 3))
        case default
          h(:, i) = 0
        end select
      end do
    end associate
  end subroutine set_load

  !> Adds the loads (forces and moments between links, frame and ground) to the matrix C and the load h.
  pure subroutine add_loads(mechanism, origin, motor_torque, part, angles, free, c, h)
    class(mechanism_type), intent(in) :: mechanism
    !> `origin`: origin of the mechanism relative to the frame's centre of mass (m). `motor_torque`: mean torque of a flywheel's
    !> motor (N m). `part`: factor p in the crank angle phi = Omega t - p psi
    real(dp), intent(in) :: origin(2), motor_torque, part, angles(:)
    integer, intent(in) :: free(:)
    real(dp), contiguous, intent(inout) :: c(:, :, :)
    real(dp), contiguous, intent(inout), optional :: h(:, :)
    type(load_sums_type) :: sums(size(angles))
    type(load_effect_type) :: effect
    integer :: k, psi

    psi = findloc(free, 3, dim=1)
    call mechanism%sum_loads(angles, origin, sums)
    do k = 1, size(angles)
      effect = effect_of(sums(k), (1.0_dp, 0.0_dp), part)
      effect%force(3) = effect%force(3) - motor_torque
      if (present(h)) h(k, :) = h(k, :) + effect%force(free)
      if (psi > 0) c(k, :, psi) = c(k, :, psi) - effect%force_psi(free)
    end do
  end subroutine add_loads

  !> Adds the moment of the weights to row `psi` of the matrix C and the load h. If the crank angle lags by p psi,
  !> the first moment of the masses is S + i p S'. Its derivative with respect to psi involves S + 2 i p S' - p^2 S''.
  pure subroutine add_weights(weights, moment, part, table, psi, c, h)
    type(weights_type), intent(in) :: weights
    !> `moment`: first moment of the mechanism's mass at its origin (kg m). `part`: factor p. `table`: effective mass functions,
    !> shape (angles, table_columns)
    real(dp), intent(in) :: moment(2), part
    real(dp), contiguous, intent(in) :: table(:, :)
    integer, intent(in) :: psi
    real(dp), contiguous, intent(inout) :: c(:, :, :)
    real(dp), contiguous, intent(inout), optional :: h(:, :)
    complex(dp), parameter :: i = (0.0_dp, 1.0_dp)
    complex(dp) :: unbalance(size(table, 1)), rest

    associate (g => weights%gravity_in_plane(), mean => weights%mean)
      rest = cmplx(moment(1), moment(2), dp) - cmplx(mean(1), mean(2), dp)
      unbalance = cmplx(table(:, a1_v), table(:, a2_v), dp) + rest
      c(:, psi, psi) = c(:, psi, psi) + real(conjg(unbalance + i * part * cmplx(table(:, a1_d), table(:, a2_d), dp)) * g)
      if (present(h)) h(:, psi) = h(:, psi) + aimag(conjg(unbalance) * g)
    end associate
  end subroutine add_weights

  !> True if the first degree of freedom is coupled to all others, directly or through other degrees of freedom.
  pure logical function all_connected(coupled)
    logical, intent(in) :: coupled(:, :)
    logical :: reached(size(coupled, 1))
    integer :: i, k

    reached = coupled(:, 1)
    do i = 2, size(reached)
      do k = 2, size(reached)
        if (reached(k)) reached = reached .or. coupled(:, k)
      end do
    end do
    all_connected = all(reached)
  end function all_connected

  !> Measures how strongly the terms of the load cancel (dimensionless): the largest sum of their absolute values, divided by the
  !> largest load, minus 1. The value 0 means that nothing cancels. The maxima are over the degrees of freedom `free`. To make
  !> forces and moments comparable, forces are divided by the square root of the machine's mass, moments by the square root of its
  !> moment of inertia.
  real(dp) function cancellation(mechanism, free, origin, mass, inertia, uniform_in_space, speed)
    class(mechanism_type), intent(in) :: mechanism
    integer, intent(in) :: free(:)
    !> `origin`: origin of the mechanism relative to the frame's centre of mass (m). `mass` (kg), `inertia` (kg m^2): mass and
    !> moment of inertia of the frame
    real(dp), intent(in) :: origin(2), mass, inertia
    !> True if the crank turns uniformly relative to the ground, false if it turns uniformly relative to the frame
    logical, intent(in) :: uniform_in_space
    !> Crank speed (rad/s) at which loads (forces and moments between links, frame and ground) are added to the inertia forces
    real(dp), intent(in) :: speed
    integer, parameter :: angles = 16
    real(dp) :: effective(angles, table_columns), load(angles, 3), h(angles, size(free)), terms(3), weights(3), maximum
    type(load_sums_type) :: sums(angles)
    integer :: i

    cancellation = 0
    if (.not. any(mechanism%terms > 0)) return
    call tabulate_effective(mechanism, origin, uniform_in_space, [(2 * pi * i / angles, i = 1, angles)], effective, load)
    call set_load(free, 1.0_dp, origin, load, h)
    if (mechanism%load_order >= 0) then
      call mechanism%sum_loads([(2 * pi * i / angles, i = 1, angles)], origin, sums)
      associate (effects => effect_of(sums, (1.0_dp, 0.0_dp), part_of_turn(mechanism, uniform_in_space)))
        do i = 1, size(free)
          h(:, i) = h(:, i) + effects%force(free(i)) / speed**2
        end do
      end associate
    end if
    terms = mechanism%terms(:3)
    terms(3) = abs(origin(1)) * terms(2) + abs(origin(2)) * terms(1) + terms(3)
    weights = 1 / sqrt(max(tiny(1.0_dp), inertia + mechanism%inertia))
    weights(:2) = 1 / sqrt(max(tiny(1.0_dp), mass + mechanism%mass))
    maximum = maxval(maxval(abs(h), dim=1) * weights(free))
    if (maximum > 0) cancellation = max(0.0_dp, maxval(terms(free) * weights(free)) / maximum - 1)
  end function cancellation

end module gestell_model_frame_equations
