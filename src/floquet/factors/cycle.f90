!> Solves x_{k+1} = A_k x_k + b_k with x_{K+1} = x_1 for the factors A_k of a monodromy matrix, and bounds the errors of x_k. The
!> solution uses the periodic Schur form; the error bounds use this form or the eigenvectors.
module gestell_floquet_factors_cycle
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_factors, only: factors_type
  use gestell_floquet_factors_periodic_bounds, only: periodic_bounds
  use gestell_floquet_factors_periodic_eigenvectors, only: eigenvectors_type, periodic_eigenvectors
  use gestell_floquet_factors_periodic_schur, only: periodic_multipliers, periodic_schur
  implicit none (type, external)
  private

  public :: accumulate, distance_from_one, periodic_answer, solve_spectrum

  !> Periodic Schur form, multipliers and eigenvectors of the factors. n is the number of states, K the number of factors.
  type, public :: spectrum_type
    !> `q`, `r`: periodic Schur form, shapes (n, n, K). `z`: logarithms of the multipliers, shape (n).
    complex(dp), allocatable :: q(:, :, :), r(:, :, :), z(:)
    !> Eigenvectors at the start of each factor.
    type(eigenvectors_type) :: vectors
    !> Three arrays of shape (n). `bound`: bounds on the errors of the multipliers, relative to |rho|. `most`: upper bounds on ln
    !> |rho|. `condition`: condition numbers of the multipliers.
    real(dp), allocatable :: bound(:), most(:), condition(:)
    !> Lower bounds on |1 - rho| / max(1, |rho|), shape (n). Allocated only if the periodic motion is requested.
    real(dp), allocatable :: distance(:)
  end type spectrum_type

contains

  !> Computes all components of the spectrum except `distance`. Fails if the periodic QR algorithm does not converge.
  subroutine solve_spectrum(factors, spectrum, error)
    type(factors_type), intent(in) :: factors
    type(spectrum_type), intent(out) :: spectrum
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: a(:, :, :)
    real(dp), allocatable :: log_abs(:), arg(:)
    integer :: n

    n = size(factors%scale)
    allocate(a, source=cmplx(factors%a, 0, dp))
    allocate(spectrum%q, spectrum%r, mold=a)
    allocate(spectrum%z(n), log_abs(n), arg(n), spectrum%bound(n), spectrum%most(n), spectrum%condition(n))
    call periodic_schur(a, spectrum%q, spectrum%r, error)
    if (allocated(error)) return
    call periodic_multipliers(spectrum%r, log_abs, arg)
    spectrum%z = cmplx(log_abs, arg, dp)
    call periodic_eigenvectors(spectrum%q, spectrum%r, spectrum%vectors)
    call periodic_bounds(a, log_abs, arg, spectrum%vectors, factors%error, spectrum%bound, spectrum%most, spectrum%condition)
  end subroutine solve_spectrum

  !> Lower bound on |1 - rho| / max(1, |rho|) for multiplier `i`. Zero or negative if 1 lies within the error bound of rho.
  pure real(dp) function distance_from_one(spectrum, i)
    type(spectrum_type), intent(in) :: spectrum
    integer, intent(in) :: i

    associate (z => spectrum%z(i), bound => spectrum%bound(i))
      if (spectrum%most(i) < -0.5_dp) then
        distance_from_one = 1 - exp(spectrum%most(i))
      else
        distance_from_one = (abs(1 - exp(merge(z, -z, real(z) <= 0))) - bound * exp(min(real(z), 0.0_dp))) / (1 + bound)
      end if
    end associate
  end function distance_from_one

  !> Computes the periodic solution of x_{k+1} = A_k x_k + b_k; `b` and `x` have the shape (n, K). In the coordinates z = Q^H x of
  !> the periodic Schur form
  !>
  !>     z_{k+1} = R_k z_k + Q_{k+1}^H b_k.
  !>
  !> The components of z are computed one after the other, the last one first. Component i is computed forward if |rho_i| <= 1 and
  !> backward if |rho_i| > 1, so that it never grows.
  pure subroutine periodic_answer(spectrum, b, x)
    type(spectrum_type), intent(in) :: spectrum
    real(dp), intent(in) :: b(:, :)
    real(dp), allocatable, intent(out) :: x(:, :)
    complex(dp), dimension(size(b, 1), size(b, 2)) :: turned, z
    integer :: k

    do k = 1, size(b, 2)
      turned(:, k) = matmul(conjg(transpose(spectrum%q(:, :, modulo(k, size(b, 2)) + 1))), b(:, k))
    end do
    call solve_triangular_cycle(spectrum%z, spectrum%r, turned, z)
    allocate(x(size(b, 1), size(b, 2)))
    do k = 1, size(b, 2)
      x(:, k) = real(matmul(spectrum%q(:, :, k), z(:, k)))
    end do
  end subroutine periodic_answer

  !> Computes bounds on the errors of the states at the starts of the segments.
  !>
  !> One bound uses the Schur form, in which couplings between components add up over all segments. The other bound uses the
  !> eigenvectors, which are uncoupled but may be nearly parallel. Both bounds are valid; the smaller one is returned.
  pure subroutine accumulate(factors, spectrum, relative_error, at_starts)
    type(factors_type), intent(in) :: factors
    type(spectrum_type), intent(in) :: spectrum
    !> Bounds on the error that each segment adds, in balanced units, shape (K)
    real(dp), intent(in) :: relative_error(:)
    !> Bounds on the errors of the states at the starts of the segments, in balanced units, shape (n, K)
    real(dp), allocatable, intent(out) :: at_starts(:, :)
    complex(dp), dimension(size(spectrum%z), size(relative_error)) :: z
    complex(dp), allocatable :: sizes(:, :, :)
    integer :: n, k

    n = size(spectrum%z)
    allocate(sizes, source=cmplx(abs(spectrum%r), 0, dp))
    call solve_triangular_cycle(cmplx(real(spectrum%z), 0, dp), sizes, cmplx(spread(relative_error, 1, n), 0, dp), z, &
      & spectrum%distance)
    allocate(at_starts(n, size(relative_error)))
    do k = 1, size(relative_error)
      at_starts(:, k) = 2 * matmul(abs(spectrum%q(:, :, k)), abs(z(:, k)))
    end do
    call accumulate_uncoupled(factors, spectrum, relative_error, at_starts)
  end subroutine accumulate

  !> Replaces each bound in `at_starts` by the bound from the eigenvectors if that bound is smaller.
  !>
  !> The errors e_k at the starts satisfy e_{k+1} = (A_k + E_k) e_k + d_k, where E_k is the error of A_k and d_k the error that
  !> segment k adds. With e_k = X_k z_k this becomes
  !>
  !>     z_{k+1} = Lambda_k z_k + Y_{k+1} d_k + Y_{k+1} (E_k X_k + S_k) z_k,   S_k = A_k X_k - X_{k+1} Lambda_k.
  !>
  !> First z is computed without the last term. Let q be the largest fraction by which the last term changes z. If q < 1/2,
  !> fixed-point iteration converges and increases the bound by at most the factor 1 / (1 - q). Otherwise no bound is replaced.
  pure subroutine accumulate_uncoupled(factors, spectrum, relative_error, at_starts)
    type(factors_type), intent(in) :: factors
    type(spectrum_type), intent(in) :: spectrum
    real(dp), intent(in) :: relative_error(:)
    real(dp), intent(inout) :: at_starts(:, :)
    real(dp), dimension(size(spectrum%z), size(relative_error)) :: left, driven
    complex(dp), dimension(size(spectrum%z), size(relative_error)) :: z, again
    complex(dp) :: sizes(size(spectrum%z), size(spectrum%z), size(relative_error)), logarithm(size(spectrum%z))
    complex(dp) :: residual(size(spectrum%z), size(spectrum%z))
    real(dp) :: part
    integer :: n, i, k, next

    n = size(spectrum%z)
    logarithm = cmplx(real(spectrum%z), 0, dp)
    sizes = 0
    do k = 1, size(relative_error)
      next = modulo(k, size(relative_error)) + 1
      left(:, k) = norm2(abs(spectrum%vectors%y(:, :, next)), dim=2)
      do i = 1, n
        sizes(i, i, k) = abs(spectrum%vectors%lambda(i, k))
      end do
    end do
    call solve_triangular_cycle(logarithm, sizes, cmplx(left * spread(relative_error, 1, n), 0, dp), z, spectrum%distance)
    do k = 1, size(relative_error)
      next = modulo(k, size(relative_error)) + 1
      associate (x => spectrum%vectors%x, lambda => spectrum%vectors%lambda(:, k))
        residual = matmul(factors%a(:, :, k), x(:, :, k)) - x(:, :, next) * spread(lambda, 1, n)
      end associate
      driven(:, k) = left(:, k) * dot_product(factors%error(k) + norm2(abs(residual), dim=1), abs(z(:, k)))
    end do
    call solve_triangular_cycle(logarithm, sizes, cmplx(driven, 0, dp), again, spectrum%distance)
    if (.not. all(abs(again) <= 0.5_dp * abs(z))) return
    part = maxval(abs(again) / max(abs(z), tiny(1.0_dp)))
    do k = 1, size(relative_error)
      at_starts(:, k) = min(at_starts(:, k), matmul(abs(spectrum%vectors%x(:, :, k)), abs(z(:, k))) / (1 - part))
    end do
  end subroutine accumulate_uncoupled

  !> Computes the periodic solution z, shape (n, K), of z_{k+1} = R_k z_k + b_k for upper triangular R_k. `logarithm`: logarithms
  !> of the multipliers rho_i, the products of R_k(i, i) over k.
  !>
  !> If `distances` is present, it contains lower bounds that replace |1 - rho_i|, and R and b must contain magnitudes. The
  !> result is then an upper bound on |z|.
  pure subroutine solve_triangular_cycle(logarithm, r, b, z, distances)
    complex(dp), intent(in) :: logarithm(:), r(:, :, :), b(:, :)
    complex(dp), intent(out) :: z(:, :)
    real(dp), intent(in), optional :: distances(:)
    complex(dp) :: g(size(b, 2)), particular, denominator
    real(dp) :: sign
    integer :: i, k, count

    count = size(b, 2)
    ! Magnitudes add up in both directions.
    sign = merge(1.0_dp, -1.0_dp, present(distances))
    do i = size(b, 1), 1, -1
      g = [(b(i, k) + sum(r(i, i + 1:, k) * z(i + 1:, k)), k = 1, count)]
      denominator = 1 - exp(merge(logarithm(i), -logarithm(i), real(logarithm(i)) <= 0))
      if (present(distances)) denominator = distances(i)
      particular = 0
      if (real(logarithm(i)) <= 0) then
        do k = 1, count
          particular = r(i, i, k) * particular + g(k)
        end do
        z(i, 1) = particular / denominator
        do k = 1, count - 1
          z(i, k + 1) = r(i, i, k) * z(i, k) + g(k)
        end do
      else
        do k = count, 1, -1
          particular = (particular + sign * g(k)) / r(i, i, k)
        end do
        z(i, 1) = particular / denominator
        do k = count, 2, -1
          z(i, k) = (z(i, modulo(k, count) + 1) + sign * g(k)) / r(i, i, k)
        end do
      end if
    end do
  end subroutine solve_triangular_cycle

end module gestell_floquet_factors_cycle
