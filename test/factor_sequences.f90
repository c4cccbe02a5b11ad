!> Sequences of factors with known multipliers, and all results of the library for one sequence.
module factor_sequences
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_factors_periodic_bounds, only: periodic_bounds
  use gestell_floquet_factors_periodic_eigenvectors, only: eigenvectors_type, periodic_eigenvectors
  use gestell_floquet_factors_periodic_schur, only: periodic_multipliers, periodic_schur
  use gestell_floquet_factors_rotations, only: norm
  use reference_random, only: random_type
  use testdrive, only: check, error_type
  implicit none (type, external)
  private

  public :: solve, distances, random_matrix, hidden, reflected

  !> All results for one sequence of factors.
  type, public :: outcome_type
    complex(dp), allocatable :: q(:, :, :), r(:, :, :)
    type(eigenvectors_type) :: vectors
    real(dp), allocatable :: log_abs(:), arg(:), bound(:), most(:), condition(:)
  end type outcome_type

contains

  !> Computes all results, and checks that the residuals of the form are rounding errors.
  subroutine solve(factors, outcome, error, errors)
    complex(dp), intent(in) :: factors(:, :, :)
    type(outcome_type), intent(out) :: outcome
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: errors(:)
    type(gestell_error), allocatable :: failure
    real(dp) :: residual, departure, claims(size(factors, 3))
    integer :: n, k

    n = size(factors, 1)
    k = size(factors, 3)
    allocate(outcome%q(n, n, k), outcome%r(n, n, k))
    allocate(outcome%log_abs(n), outcome%arg(n), outcome%bound(n), outcome%most(n), outcome%condition(n))
    claims = 0
    if (present(errors)) claims = errors
    associate (o => outcome)
      call periodic_schur(factors, o%q, o%r, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call schur_residuals(factors, o%q, o%r, residual, departure)
      ! Rotations of each factor with an error of 1e-16 each, from both sides: of 6 eigenvalues with 4 iterations each, 6 rotations
      ! in one, about 3e-14; processors differ in the last bits (2.3e-14 was seen).
      call check(error, residual, 0.0_dp, thr=5.0e-14_dp, more="residual")
      if (allocated(error)) return
      call check_that(error, departure, "<", 5.0e-14_dp, "departure")
      if (allocated(error)) return
      do k = 1, n - 1
        call check_that(error, maxval(abs(o%r(k + 1:, k, :))), "<=", 0.0_dp, "triangular")
        if (allocated(error)) return
      end do
      call periodic_multipliers(o%r, o%log_abs, o%arg)
      call periodic_eigenvectors(o%q, o%r, o%vectors)
      call periodic_bounds(factors, o%log_abs, o%arg, o%vectors, claims, o%bound, o%most, o%condition)
    end associate
  end subroutine solve

  !> Maxima of |Q_{k+1}^H A_k Q_k - R_k| / |A_k| and of |Q_k^H Q_k - E|, in Frobenius' norm.
  pure subroutine schur_residuals(factors, q, r, residual, departure)
    complex(dp), intent(in) :: factors(:, :, :), q(:, :, :), r(:, :, :)
    real(dp), intent(out) :: residual, departure
    complex(dp) :: difference(size(r, 1), size(r, 1))
    integer :: i, k, next

    residual = 0
    departure = 0
    do k = 1, size(r, 3)
      next = modulo(k, size(r, 3)) + 1
      difference = matmul(adjoint(q(:, :, next)), matmul(factors(:, :, k), q(:, :, k))) - r(:, :, k)
      residual = max(residual, norm(difference) / max(norm(factors(:, :, k)), tiny(1.0_dp)))
      difference = matmul(adjoint(q(:, :, k)), q(:, :, k))
      do i = 1, size(r, 1)
        difference(i, i) = difference(i, i) - 1
      end do
      departure = max(departure, norm(difference))
    end do
  end subroutine schur_residuals

  pure function adjoint(a)
    complex(dp), intent(in) :: a(:, :)
    complex(dp) :: adjoint(size(a, 2), size(a, 1))

    adjoint = conjg(transpose(a))
  end function adjoint

  !> |rho_i / mu - 1| with rho_i = exp(log_abs(i) + i arg(i)), for all i and j: least over j.
  function distances(log_abs, arg, log_mu, arg_mu) result(least)
    real(dp), intent(in) :: log_abs(:), arg(:), log_mu(:), arg_mu(:)
    real(dp) :: least(size(log_abs))
    integer :: i, j

    least = huge(1.0_dp)
    do i = 1, size(log_abs)
      do j = 1, size(log_mu)
        least(i) = min(least(i), abs(exp(min(log_mu(j) - log_abs(i), 300.0_dp)) * exp(cmplx(0, arg_mu(j) - arg(i), dp)) - 1))
      end do
    end do
  end function distances

  function random_matrix(random, n, m) result(a)
    type(random_type), intent(inout) :: random
    integer, intent(in) :: n, m
    complex(dp) :: a(n, m)
    integer :: i, j

    do j = 1, m
      do i = 1, n
        a(i, j) = cmplx(2 * random%draw() - 1, 2 * random%draw() - 1, dp)
      end do
    end do
  end function random_matrix

  !> By Gram and Schmidt, twice.
  function random_unitary(random, n) result(u)
    type(random_type), intent(inout) :: random
    integer, intent(in) :: n
    complex(dp) :: u(n, n)
    integer :: i, j, pass

    u = random_matrix(random, n, n)
    do i = 1, n
      do pass = 1, 2
        do j = 1, i - 1
          u(:, i) = u(:, i) - dot_product(u(:, j), u(:, i)) * u(:, j)
        end do
      end do
      u(:, i) = u(:, i) / norm2(abs(u(:, i)))
    end do
  end function random_unitary

  !> U_{k+1} T_k U_k^H with random unitary U.
  function hidden(random, t) result(factors)
    type(random_type), intent(inout) :: random
    complex(dp), intent(in) :: t(:, :, :)
    complex(dp) :: factors(size(t, 1), size(t, 1), size(t, 3))
    complex(dp) :: first(size(t, 1), size(t, 1)), this(size(t, 1), size(t, 1)), next(size(t, 1), size(t, 1))
    integer :: k

    first = random_unitary(random, size(t, 1))
    this = first
    do k = 1, size(t, 3)
      next = first
      if (k < size(t, 3)) next = random_unitary(random, size(t, 1))
      factors(:, :, k) = matmul(next, matmul(t(:, :, k), conjg(transpose(this))))
      this = next
    end do
  end function hidden

  !> H T H with the reflection H = E - 2 v v^T / v^T v, v = (1, 2, ..., n).
  function reflected(t) result(a)
    real(dp), intent(in) :: t(:, :)
    real(dp) :: a(size(t, 1), size(t, 1)), h(size(t, 1), size(t, 1))
    integer :: i, j, k, n

    n = size(t, 1)
    do j = 1, n
      do i = 1, n
        h(i, j) = merge(1, 0, i == j) - 2.0_dp * i * j / sum([(k**2, k = 1, n)])
      end do
    end do
    a = matmul(h, matmul(t, h))
  end function reflected

end module factor_sequences
