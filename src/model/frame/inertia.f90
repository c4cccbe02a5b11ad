!> The matrices (9) to (11) of a frame with its mechanism.
module gestell_model_frame_inertia
  use gestell_base_kinds, only: dp
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_v, mass_functions_type, mechanism_type
  implicit none (type, external)
  private

  public :: mass_matrix, set_matrices

contains

  !> M of (9), all three degrees of freedom, of a frame of `mass` (kg) and `inertia` (kg m^2) about F, the mechanism's pivot at its
  !> `origin` (m), from the mass functions `a`.
  pure function mass_matrix(mass, inertia, origin, mechanism, a) result(m)
    real(dp), intent(in) :: mass, inertia, origin(2)
    class(mechanism_type), intent(in) :: mechanism
    type(mass_functions_type), intent(in) :: a
    real(dp) :: m(3, 3)

    associate (xi0 => origin(1), eta0 => origin(2), m_g => mechanism%mass)
      m = 0
      m(1, 1) = mass + m_g
      m(2, 2) = mass + m_g
      m(1, 3) = -(m_g * eta0 + a%a2%v)
      m(2, 3) = m_g * xi0 + a%a1%v
      m(3, 1) = m(1, 3)
      m(3, 2) = m(2, 3)
      m(3, 3) = inertia + mechanism%inertia + m_g * (xi0**2 + eta0**2) + a%a3%v + 2 * xi0 * a%a1%v + 2 * eta0 * a%a2%v
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

end module gestell_model_frame_inertia
