!> The exponential of a small real matrix.
module gestell_floquet_integrator_expm
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: expm

contains

  !> exp(A) by scaling and squaring, exp(A) = exp(A / 2^s)^(2^s), with Taylor's polynomial of degree m = 9 or 16, in
  !> powers of A^r, r = sqrt(m) (M. Paterson, L. Stockmeyer, SIAM J. Comput. 2 (1973) 60). The first term left out is
  !> below the unit roundoff while the norm is below ((m + 1)! epsilon)**(1 / (m + 1)). Balance A first: its norm is
  !> what decides, and a norm far above the eigenvalues costs squarings, each of which doubles the roundoff.
  pure function expm(a) result(e)
    real(dp), intent(in) :: a(:, :)
    real(dp) :: e(size(a, 1), size(a, 1))
    real(dp), parameter :: inverse_factorial(0:16) = [1.0_dp, 1.0_dp, 5.0e-1_dp, 1 / 6.0_dp, 1 / 24.0_dp, 1 / 120.0_dp, &
      & 1 / 720.0_dp, 1 / 5040.0_dp, 1 / 40320.0_dp, 1 / 362880.0_dp, 1 / 3628800.0_dp, 1 / 39916800.0_dp, &
      & 1 / 479001600.0_dp, 1 / 6227020800.0_dp, 1 / 87178291200.0_dp, 1 / 1307674368000.0_dp, 1 / 20922789888000.0_dp]
    !> Norms up to which degree 9 and degree 16 do: (10! epsilon)**(1/10), (17! epsilon)**(1/17).
    real(dp), parameter :: reach_9 = 0.123_dp, reach_16 = 0.861_dp
    real(dp) :: power(size(a, 1), size(a, 1), 4), norm
    integer :: squarings, r, i, j, k

    norm = maxval(sum(abs(a), dim=1))
    squarings = 0
    r = 3
    if (norm > reach_9) r = 4
    if (norm > reach_16) squarings = exponent(norm / reach_16)

    power(:, :, 1) = a * 0.5_dp**squarings
    do k = 2, r
      power(:, :, k) = matmul(power(:, :, 1), power(:, :, k - 1))
    end do
    e = inverse_factorial(r * r) * power(:, :, r)
    do j = r - 1, 0, -1
      do k = 1, r - 1
        e = e + inverse_factorial(r * j + k) * power(:, :, k)
      end do
      do i = 1, size(a, 1)
        e(i, i) = e(i, i) + inverse_factorial(r * j)
      end do
      if (j > 0) e = matmul(power(:, :, r), e)
    end do
    do k = 1, squarings
      e = matmul(e, e)
    end do
  end function expm

end module gestell_floquet_integrator_expm
