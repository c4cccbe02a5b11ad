!> The equations (9) to (12) about rest of a frame in the plane with its mechanism.
module gestell_model_frame_equations
  use gestell_base_kinds, only: dp, pi
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_v, mechanism_type, table_columns
  use gestell_model_mechanism_held, only: tabulate_felt
  implicit none (type, external)
  private

  public :: cancellation, mass_matrix, set_load, set_matrices

contains

  !> What M of (9) is without the mass functions, all three degrees of freedom, of a frame of `mass` (kg) and `inertia` (kg m^2)
  !> about F, the mechanism's pivot at its `origin` (m).
  pure function mass_matrix(mass, inertia, origin, mechanism) result(m)
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

  !> (9) to (11) of the `free` degrees of freedom from a table of the mass functions, shapes (angles, size(free), size(free));
  !> `constant`: M without them; `damping` and `stiffness`: B_0, C_0. The mass functions depend on the crank angle alone; the speed
  !> enters by d/dt = Omega d/dphi.
  pure subroutine set_matrices(free, constant, damping, stiffness, speed, origin, table, m, b, c)
    integer, intent(in) :: free(:)
    real(dp), intent(in) :: constant(3, 3), damping(3, 3), stiffness(3, 3), speed, origin(2)
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

  !> h of (12), shape (angles, degrees of freedom), of the `free` ones of xi, eta, psi, from the `load` at crank angles, shape
  !> (angles, 3), as `tabulate_felt` has it; the crank's `speed` (rad/s) and its pivot, the `origin`, in the frame (m).
  pure subroutine set_load(free, speed, origin, load, h)
    integer, intent(in) :: free(:)
    real(dp), intent(in) :: speed, origin(2)
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

  !> By how many times the absolute terms of the load exceed it, the greatest over the `free` of xi, eta, psi, weighted as in the
  !> kinetic energy of `mass` (kg) and `inertia` (kg m^2); 0: nothing cancels. `even_in_space`: so the crank turns.
  real(dp) function cancellation(mechanism, free, origin, mass, inertia, even_in_space)
    class(mechanism_type), intent(in) :: mechanism
    integer, intent(in) :: free(:)
    real(dp), intent(in) :: origin(2), mass, inertia
    logical, intent(in) :: even_in_space
    integer, parameter :: angles = 16
    real(dp) :: felt(angles, table_columns), load(angles, 3), h(angles, size(free)), terms(3), weights(3), greatest
    integer :: i

    cancellation = 0
    if (.not. any(mechanism%terms > 0)) return
    call tabulate_felt(mechanism, origin, even_in_space, [(2 * pi * i / angles, i = 1, angles)], felt, load)
    call set_load(free, 1.0_dp, origin, load, h)
    terms = mechanism%terms(:3)
    terms(3) = abs(origin(1)) * terms(2) + abs(origin(2)) * terms(1) + terms(3)
    weights = 1 / sqrt(max(tiny(1.0_dp), inertia + mechanism%inertia))
    weights(:2) = 1 / sqrt(max(tiny(1.0_dp), mass + mechanism%mass))
    greatest = maxval(maxval(abs(h), dim=1) * weights(free))
    if (greatest > 0) cancellation = max(0.0_dp, maxval(terms(free) * weights(free)) / greatest - 1)
  end function cancellation

end module gestell_model_frame_equations
