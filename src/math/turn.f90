!> Rotations in the plane, represented by complex numbers E = exp(i psi).
module gestell_math_turn
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: less_one

contains

  !> E - 1 for E = exp(i psi), without cancellation for small angles psi: 1 - cos psi = sin^2 psi/(1 + cos psi).
  elemental complex(dp) function less_one(turn)
    complex(dp), intent(in) :: turn

    less_one = cmplx(merge(-aimag(turn)**2 / (1 + abs(real(turn))), real(turn) - 1, real(turn) > 0), aimag(turn), dp)
  end function less_one

end module gestell_math_turn
