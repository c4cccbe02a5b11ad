!> Computes cosines and sines of many angles in a loop that compilers vectorise on every system. (Vectorised library functions exist
!> only in the GNU run-time library, with errors of up to four units in the last place.)
module gestell_math_cosine_sine
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: cosine_sine

  !> First part of pi / 2, which is stored in two parts. It has 33 bits, so that its multiples up to `farthest` / (pi / 2) are
  !> exact.
  real(dp), parameter :: quarter_head = anint(pi / 2 * 2.0_dp**32) / 2.0_dp**32, quarter_tail = 6.077100506506192e-11_dp

  !> Maximum modulus of an angle (rad) for these series; the run-time library computes the cosines and sines of larger angles.
  real(dp), parameter :: farthest = 1.0e6_dp

  !> Adding and then subtracting this constant rounds a number to the nearest integer.
  real(dp), parameter :: rounder = 1.5_dp / epsilon(1.0_dp)

contains

  !> Computes c = cos(angles) and s = sin(angles); all arrays have the same shape. Errors are below 0.8 epsilon.
  !>
  !> Multiples of pi / 2 are subtracted from the angle. For the remainder, |x| <= pi / 4, the Taylor series are summed up to x^16 /
  !> 16! and x^17 / 17!; the next terms are below 2e-18. Each multiple of pi / 2 changes (c, s) to (-s, c).
  pure subroutine cosine_sine(angles, c, s)
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: c(:), s(:)
    real(dp) :: quarters, x, x2, cosine, sine, across, along
    integer :: k, turned

    if (.not. all(abs(angles) <= farthest)) then
      c = cos(angles)
      s = sin(angles)
      return
    end if
    do k = 1, size(angles)
      quarters = (angles(k) * (2 / pi) + rounder) - rounder
      x = (angles(k) - quarters * quarter_head) - quarters * quarter_tail
      x2 = x * x
      cosine = 1 - x2 * (1 / 2.0_dp - x2 * (1 / 24.0_dp - x2 * (1 / 720.0_dp - x2 * (1 / 40320.0_dp &
        & - x2 * (1 / 3628800.0_dp - x2 * (1 / 479001600.0_dp - x2 * (1 / 87178291200.0_dp &
        & - x2 * (1 / 20922789888000.0_dp))))))))
      sine = x - x * x2 * (1 / 6.0_dp - x2 * (1 / 120.0_dp - x2 * (1 / 5040.0_dp - x2 * (1 / 362880.0_dp &
        & - x2 * (1 / 39916800.0_dp - x2 * (1 / 6227020800.0_dp - x2 * (1 / 1307674368000.0_dp &
        & - x2 * (1 / 355687428096000.0_dp))))))))
      turned = iand(int(quarters), 3)
      along = merge(cosine, sine, iand(turned, 1) == 0)
      across = merge(sine, cosine, iand(turned, 1) == 0)
      c(k) = merge(along, -along, iand(turned + 1, 2) == 0)
      s(k) = merge(across, -across, iand(turned, 2) == 0)
    end do
  end subroutine cosine_sine

end module gestell_math_cosine_sine
