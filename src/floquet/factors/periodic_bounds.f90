!> Computes error bounds for multipliers from the error bounds of the factors; equation (71) of doc/theory.md.
module gestell_floquet_factors_periodic_bounds
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_factors_periodic_eigenvectors, only: eigenvectors_type, periodic_eigenvectors
  use gestell_floquet_factors_periodic_schur, only: periodic_schur
  use gestell_floquet_factors_rotations, only: norm
  implicit none (type, external)
  private

  public :: periodic_bounds

  !> Largest modulus of the logarithm of a ratio; exponentials of larger logarithms would overflow.
  real(dp), parameter :: far = 300

  !> Discs around the centres c_j in the complex plane; a point mu lies in disc j if |mu - c_j| <= radius(j) |c_j|. All
  !> components have the shape (n).
  type :: discs_type
    !> `log_abs`: ln |c_j|. `arg`: argument of c_j.
    real(dp), allocatable :: log_abs(:), arg(:)
    !> `radius`: radius of each disc relative to the modulus of its centre, at most exp(far). `most`: maximum of ln |mu| over the
    !> points mu of the disc, valid even if the radius exceeds exp(far).
    real(dp), allocatable :: radius(:), most(:)
    !> Number of the cluster to which each disc belongs. Discs that touch belong to the same cluster.
    integer, allocatable :: cluster(:)
  end type discs_type

contains

  !> Computes error bounds for the multipliers rho_i = exp(log_abs(i) + i arg(i)) of a product of factors A_k + E_k, in which the
  !> errors E_k are unknown.
  !>
  !> Eigenvectors are the columns x_j of X_k and the rows y_j of Y_k = X_k^-1. They transform the true factors A_k + E_k to
  !> Lambda_k + F_k, where Lambda_k is diagonal, F_k = Y_{k+1} (E_k X_k + S_k), and S_k = A_k X_k - X_{k+1} Lambda_k is the
  !> residual. Let |x_j| = 1. If the rows of Y_{k+1} are then scaled to unit length, each element of column j of F_k Lambda_k^-1
  !> is at most eta_k(j) = (|E_k| + |S_k(:, j)|) |y_j| / |lambda_k(j)|. By Gershgorin's theorem for columns all true multipliers
  !> mu lie in discs |mu - rho_j| <= |rho_j| r_j. A cluster of connected discs contains as many multipliers as discs. The bound
  !> for a multiplier therefore extends over its whole cluster.
  !>
  !> The relation 1 + r_j = prod_k (1 + n eta_k(j)) is proved for an error in a single factor, of any size, and for multipliers
  !> that do not couple (n = 1). For errors in several factors it neglects products of two couplings between multipliers, so it
  !> is correct to first order in the couplings.
  !>
  !> The discs are valid for any X_k, because S_k includes the inaccuracy of X_k. For close or defective multipliers X_k is
  !> nearly singular. If discs touch, the routine therefore also tries the eigenvectors of factors perturbed by about |E_k|. The
  !> perturbation splits a multiplier of multiplicity m in proportion to |E|^(1/m), and the bound is of the same size.
  pure subroutine periodic_bounds(factors, log_abs, arg, vectors, errors, bound, most, condition)
    !> Factors A_k, shape (n, n, K)
    complex(dp), intent(in) :: factors(:, :, :)
    !> `log_abs`, `arg`: logarithms of the moduli, and arguments, of the multipliers, shapes (n). `errors`: bounds on the errors of
    !> the factors in the Frobenius norm, shape (K).
    real(dp), intent(in) :: log_abs(:), arg(:), errors(:)
    !> Eigenvectors of the factors
    type(eigenvectors_type), intent(in) :: vectors
    !> Three arrays of shape (n). `bound`: bounds on the errors of the multipliers, relative to |rho_i|, at most about 1e300.
    !> `most`: upper bounds on the logarithms of the moduli, valid even if rho_i has no correct digit. `condition`: condition
    !> numbers |y_i| |x_i| of the multipliers, maxima over the period, at least 1.
    real(dp), intent(out) :: bound(:), most(:), condition(:)
    type(discs_type) :: discs
    type(error_type), allocatable :: failure
    type(eigenvectors_type) :: others
    complex(dp), allocatable, dimension(:, :, :) :: moved, q, r
    real(dp), dimension(size(bound)) :: other, other_most
    integer :: k

    condition = [(maxval(norm2(abs(vectors%y(k, :, :)), dim=1)), k = 1, size(bound))]
    discs = discs_of(factors, vectors, errors)
    call bound_errors(discs, log_abs, arg, bound, most)
    if (all(discs%cluster == [(k, k = 1, size(bound))])) return

    allocate(moved, q, r, mold=factors)
    call move(factors, errors, moved)
    call periodic_schur(moved, q, r, failure)
    if (allocated(failure)) return
    call periodic_eigenvectors(q, r, others)
    call bound_errors(discs_of(factors, others, errors), log_abs, arg, other, other_most)
    if (sum(log(other)) < sum(log(bound))) then
      bound = other
      most = other_most
    end if
  end subroutine periodic_bounds

  !> Adds to each factor a pseudo-random matrix that is about as large as the error bound of the factor. `moved`: the changed
  !> factors.
  pure subroutine move(factors, errors, moved)
    complex(dp), intent(in) :: factors(:, :, :)
    real(dp), intent(in) :: errors(:)
    complex(dp), intent(out) :: moved(:, :, :)
    real(dp), parameter :: golden = (sqrt(5.0_dp) - 1) / 2
    real(dp) :: step, turns
    integer :: n, i, j, k, count

    n = size(factors, 1)
    count = 0
    do k = 1, size(factors, 3)
      step = max(errors(k), rounding(factors(:, :, k))) / n
      do j = 1, n
        do i = 1, n
          ! Squares times an irrational number, modulo 1, are well spread.
          count = count + 1
          turns = modulo(golden * count * count, 1.0_dp)
          moved(i, j, k) = factors(i, j, k) + step * exp(cmplx(0, 2 * pi * turns, dp))
        end do
      end do
    end do
  end subroutine move

  !> Bound on the rounding error of the product of matrix `a` with a unit vector.
  pure real(dp) function rounding(a)
    complex(dp), intent(in) :: a(:, :)

    rounding = size(a, 1) * epsilon(1.0_dp) * norm(a)
  end function rounding

  !> Discs around the multipliers, computed from the eigenvectors `vectors`.
  pure type(discs_type) function discs_of(factors, vectors, errors) result(discs)
    complex(dp), intent(in) :: factors(:, :, :)
    type(eigenvectors_type), intent(in) :: vectors
    real(dp), intent(in) :: errors(:)
    complex(dp) :: residual(size(factors, 1), size(factors, 1)), phase(size(factors, 1)), ratio
    real(dp) :: least, growth, error, eta
    integer :: n, i, j, k, next

    n = size(factors, 1)
    allocate(discs%log_abs(n), discs%radius(n), discs%most(n), source=0.0_dp)
    phase = 1
    do k = 1, size(factors, 3)
      next = modulo(k, size(factors, 3)) + 1
      residual = matmul(factors(:, :, k), vectors%x(:, :, k)) - vectors%x(:, :, next) * spread(vectors%lambda(:, k), 1, n)
      ! Replace a growth of zero by `least`; the difference counts as an error.
      least = max(rounding(factors(:, :, k)), epsilon(1.0_dp) * errors(k), tiny(1.0_dp))
      do j = 1, n
        growth = abs(vectors%lambda(j, k))
        error = errors(k) + rounding(factors(:, :, k)) + norm(residual(:, j:j)) + max(0.0_dp, least - growth)
        growth = max(growth, least)
        eta = n * norm2(abs(vectors%y(j, :, next))) * error / growth
        discs%radius(j) = min(discs%radius(j) + eta * (1 + discs%radius(j)), exp(far))
        discs%most(j) = discs%most(j) + log(growth) + log(1 + eta)
        discs%log_abs(j) = discs%log_abs(j) + log(growth)
        if (abs(vectors%lambda(j, k)) > 0) phase(j) = phase(j) * vectors%lambda(j, k) / abs(vectors%lambda(j, k))
      end do
    end do
    ! Avoid atan2 (see gestell_floquet_multipliers): conjugates must get exactly opposite arguments.
    discs%arg = aimag(log(phase))

    discs%cluster = [(j, j = 1, n)]
    do i = 1, n
      do j = 1, n
        if (discs%log_abs(j) > discs%log_abs(i)) cycle
        ratio = quotient(discs%log_abs(j), discs%arg(j), discs%log_abs(i), discs%arg(i))
        if (abs(1 - ratio) > discs%radius(i) + relative_radius(discs, j, discs%log_abs(i))) cycle
        where (discs%cluster == discs%cluster(i)) discs%cluster = discs%cluster(j)
      end do
    end do
  end function discs_of

  !> For each multiplier rho_i, computes two maxima over the cluster of discs that contains it. `bound`: largest distance of a
  !> point of the cluster from rho_i, relative to |rho_i|. `most`: largest logarithm of the modulus of a point.
  pure subroutine bound_errors(discs, log_abs, arg, bound, most)
    type(discs_type), intent(in) :: discs
    real(dp), intent(in) :: log_abs(:), arg(:)
    real(dp), intent(out) :: bound(:), most(:)
    real(dp), parameter :: farthest = 690
    real(dp) :: away(size(bound)), farther
    integer :: i, j, home

    do i = 1, size(bound)
      away = [(abs(1 - quotient(log_abs(i), arg(i), discs%log_abs(j), discs%arg(j))) / discs%radius(j), j = 1, size(bound))]
      home = minloc(away, dim=1)
      most(i) = maxval(discs%most, mask=discs%cluster == discs%cluster(home))
      farther = most(i) - log_abs(i)
      if (farther <= far) then
        farther = -farthest
        do j = 1, size(bound)
          if (discs%cluster(j) /= discs%cluster(home)) cycle
          associate (ratio => quotient(discs%log_abs(j), discs%arg(j), log_abs(i), arg(i)))
            farther = max(farther, log(abs(1 - ratio) + relative_radius(discs, j, log_abs(i))))
          end associate
        end do
      end if
      bound(i) = exp(min(farther, farthest))
    end do
  end subroutine bound_errors

  !> Radius of disc `j` relative to the modulus of another multiplier; `log_abs` is the logarithm of this modulus.
  pure real(dp) function relative_radius(discs, j, log_abs)
    type(discs_type), intent(in) :: discs
    integer, intent(in) :: j
    real(dp), intent(in) :: log_abs

    if (discs%radius(j) < 1) then
      relative_radius = discs%radius(j) * exp(min(discs%log_abs(j) - log_abs, far))
    else
      relative_radius = exp(min(discs%most(j) - log_abs, far))
    end if
  end function relative_radius

  !> Ratio of two multipliers, given by their logarithms. The modulus of the result is limited to exp(far).
  pure complex(dp) function quotient(log_abs, arg, other_log_abs, other_arg)
    real(dp), intent(in) :: log_abs, arg, other_log_abs, other_arg

    quotient = exp(min(log_abs - other_log_abs, far)) * exp(cmplx(0, arg - other_arg, dp))
  end function quotient

end module gestell_floquet_factors_periodic_bounds
