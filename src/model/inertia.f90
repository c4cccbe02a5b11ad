!> The mass matrix (9) of a frame with its mechanism.
module gestell_model_inertia
  use gestell_base_kinds, only: dp
  use gestell_model_mechanism, only: mass_functions_type, mechanism_type
  implicit none (type, external)
  private

  public :: mass_matrix

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

end module gestell_model_inertia
