!> A preconditioner of harmonic balance that couples neighbouring harmonics. It solves the equations of motion exactly for
!> coefficients that consist of their mean and their first harmonic,
!>
!>     C = C_0 + C_1 exp(i theta) + conj(C_1) exp(-i theta),   B alike,   q = sum over k of X_k exp(i k theta),
!>     S_k X_{k-1} + A_k X_k + R_k X_{k+1} = H_k,
!>     A_k = C_0 + i k B_0 - k^2 E,   S_k = C_1 + i (k - 1) B_1,   R_k = conj(C_1) + i (k + 1) conj(B_1).
!>
!> From the highest order down, X_k = G_k - W_k X_{k-1} with W_k = D_k S_k, G_k = D_k (H_k - R_k G_{k+1}) and
!> D_k = (A_k - R_k W_{k+1})^-1. At order 0 both neighbours are conjugate: (A_0 - 2 Re R_0 W_1) X_0 = H_0 - 2 Re R_0 G_1.
module gestell_floquet_balance_coupled_harmonics
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_balance_harmonic_means, only: invert
  implicit none (type, external)
  private

  public :: couple_harmonics

  !> The factors for f degrees of freedom and the orders 0 ... K
  type, public :: coupled_type
    !> D_k, W_k and R_k, shapes (f, f, 0:K)
    complex(dp), allocatable, private, dimension(:, :, :) :: d, w, r
  contains
    procedure :: solve
  end type coupled_type

contains

  !> Computes the factors from B and C at equidistant phases, shapes (phases, f, f). `fits` is false if a matrix is singular.
  pure subroutine couple_harmonics(b, c, coupled, fits)
    real(dp), intent(in) :: b(:, :, :), c(:, :, :)
    type(coupled_type), intent(out) :: coupled
    logical, intent(out) :: fits
    complex(dp), parameter :: i = (0.0_dp, 1.0_dp)
    complex(dp) :: wave(size(c, 1)), next(size(c, 2), size(c, 2))
    complex(dp), dimension(size(c, 2), size(c, 2), 0:1) :: b_k, c_k
    integer :: f, n, j, k

    n = size(c, 1)
    f = size(c, 2)
    wave = [(exp(-2 * pi * i * j / n), j = 0, n - 1)] / n
    do k = 1, f
      do j = 1, f
        b_k(j, k, :) = [cmplx(sum(b(:, j, k)) / n, 0, dp), sum(b(:, j, k) * wave)]
        c_k(j, k, :) = [cmplx(sum(c(:, j, k)) / n, 0, dp), sum(c(:, j, k) * wave)]
      end do
    end do
    allocate(coupled%d(f, f, 0:n / 2 - 1), coupled%w(f, f, 0:n / 2 - 1), coupled%r(f, f, 0:n / 2 - 1))
    next = 0
    do k = n / 2 - 1, 0, -1
      coupled%r(:, :, k) = conjg(c_k(:, :, 1)) + i * (k + 1) * conjg(b_k(:, :, 1))
      next = times(coupled%r(:, :, k), next)
      if (k == 0) next = 2 * real(next)
      associate (d => coupled%d(:, :, k))
        d = c_k(:, :, 0) + i * k * b_k(:, :, 0) - next
        do j = 1, f
          d(j, j) = d(j, j) - k**2
        end do
        call invert(d, fits)
        if (.not. fits) return
        next = times(d, c_k(:, :, 1) + i * (k - 1) * b_k(:, :, 1))
      end associate
      coupled%w(:, :, k) = next
    end do
  end subroutine couple_harmonics

  !> Product of two small matrices.
  pure function times(a, b)
    complex(dp), intent(in) :: a(:, :), b(:, :)
    complex(dp) :: times(size(a, 1), size(a, 1))
    integer :: j, k

    times = 0
    do j = 1, size(a, 1)
      do k = 1, size(a, 1)
        times(:, j) = times(:, j) + a(:, k) * b(k, j)
      end do
    end do
  end function times

  !> Replaces the harmonics of a load by those of the motion. The harmonics, shape (0:2 K + 1, f), are the coefficients of the
  !> cosines of orders 0 ... K, followed by those of the sines.
  pure subroutine solve(self, x)
    class(coupled_type), intent(in) :: self
    real(dp), contiguous, intent(inout) :: x(0:, :)
    complex(dp) :: g(size(x, 2), 0:size(x, 1) / 2), load(size(x, 2))
    integer :: half, j, k

    half = size(x, 1) / 2
    g(:, half) = 0
    do k = half - 1, 0, -1
      load = 0
      do j = 1, size(load)
        load = load - self%r(:, j, k) * g(j, k + 1)
      end do
      if (k == 0) load = 2 * real(load)
      load = load + cmplx(x(k, :), -x(half + k, :), dp) * merge(1.0_dp, 0.5_dp, k == 0)
      g(:, k) = 0
      do j = 1, size(load)
        g(:, k) = g(:, k) + self%d(:, j, k) * load(j)
      end do
    end do
    g(:, 0) = real(g(:, 0))
    x(0, :) = real(g(:, 0))
    x(half, :) = 0
    do k = 1, half - 1
      do j = 1, size(load)
        g(:, k) = g(:, k) - self%w(:, j, k) * g(j, k - 1)
      end do
      x(k, :) = 2 * real(g(:, k))
      x(half + k, :) = -2 * aimag(g(:, k))
    end do
  end subroutine solve

end module gestell_floquet_balance_coupled_harmonics
