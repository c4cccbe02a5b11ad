!> Interface to LAPACK. No other module calls LAPACK; this module hides workspaces and `info`.
module gestell_math_lapack
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: unit_matrix
  implicit none (type, external)
  private

  public :: factorise, solve_factored, log_abs_determinant, inverse, eigensystem, symmetric_pencil, balancing, &
    & inverse_factor, constrained_least_squares

  interface
    subroutine dgetrf(m, n, a, lda, ipiv, info)
      import :: dp
      implicit none (type, external)
      integer, intent(in) :: m, n, lda
      real(dp), intent(inout) :: a(lda, *)
      integer, intent(out) :: ipiv(*), info
    end subroutine dgetrf

    subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: trans
      integer, intent(in) :: n, nrhs, lda, ldb, ipiv(*)
      real(dp), intent(in) :: a(lda, *)
      real(dp), intent(inout) :: b(ldb, *)
      integer, intent(out) :: info
    end subroutine dgetrs

    subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: jobvl, jobvr
      integer, intent(in) :: n, lda, ldvl, ldvr, lwork
      real(dp), intent(inout) :: a(lda, *)
      real(dp), intent(out) :: wr(*), wi(*), vl(ldvl, *), vr(ldvr, *), work(*)
      integer, intent(out) :: info
    end subroutine dgeev

    subroutine dsygv(itype, jobz, uplo, n, a, lda, b, ldb, w, work, lwork, info)
      import :: dp
      implicit none (type, external)
      integer, intent(in) :: itype, n, lda, ldb, lwork
      character, intent(in) :: jobz, uplo
      real(dp), intent(inout) :: a(lda, *), b(ldb, *)
      real(dp), intent(out) :: w(*), work(*)
      integer, intent(out) :: info
    end subroutine dsygv

    subroutine zgetrf(m, n, a, lda, ipiv, info)
      import :: dp
      implicit none (type, external)
      integer, intent(in) :: m, n, lda
      complex(dp), intent(inout) :: a(lda, *)
      integer, intent(out) :: ipiv(*), info
    end subroutine zgetrf

    subroutine zgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: trans
      integer, intent(in) :: n, nrhs, lda, ldb, ipiv(*)
      complex(dp), intent(in) :: a(lda, *)
      complex(dp), intent(inout) :: b(ldb, *)
      integer, intent(out) :: info
    end subroutine zgetrs

    subroutine zgeev(jobvl, jobvr, n, a, lda, w, vl, ldvl, vr, ldvr, work, lwork, rwork, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: jobvl, jobvr
      integer, intent(in) :: n, lda, ldvl, ldvr, lwork
      complex(dp), intent(inout) :: a(lda, *)
      complex(dp), intent(out) :: w(*), vl(ldvl, *), vr(ldvr, *), work(*)
      real(dp), intent(out) :: rwork(*)
      integer, intent(out) :: info
    end subroutine zgeev

    subroutine dgebal(job, n, a, lda, ilo, ihi, scale, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: job
      integer, intent(in) :: n, lda
      real(dp), intent(inout) :: a(lda, *)
      integer, intent(out) :: ilo, ihi, info
      real(dp), intent(out) :: scale(*)
    end subroutine dgebal

    subroutine dpotrf(uplo, n, a, lda, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(dp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotrf

    subroutine dtrtri(uplo, diag, n, a, lda, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: uplo, diag
      integer, intent(in) :: n, lda
      real(dp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dtrtri

    subroutine dgglse(m, n, p, a, lda, b, ldb, c, d, x, work, lwork, info)
      import :: dp
      implicit none (type, external)
      integer, intent(in) :: m, n, p, lda, ldb, lwork
      real(dp), intent(inout) :: a(lda, *), b(ldb, *), c(*), d(*)
      real(dp), intent(out) :: x(*), work(*)
      integer, intent(out) :: info
    end subroutine dgglse
  end interface

  interface inverse
    module procedure real_inverse, complex_inverse
  end interface inverse

  interface eigensystem
    module procedure real_eigensystem, complex_eigensystem
  end interface eigensystem

contains

  !> Replaces the square matrix `a` by its LU factors (dgetrf). Fails if `a` is singular.
  subroutine factorise(a, pivots, error)
    real(dp), contiguous, intent(inout) :: a(:, :)
    integer, intent(out) :: pivots(:)
    type(error_type), allocatable, intent(out) :: error
    integer :: info

    call dgetrf(size(a, 1), size(a, 2), a, size(a, 1), pivots, info)
    if (info /= 0) call fatal_error(error, "the matrix of a linear system is singular", failed_computation)
  end subroutine factorise

  !> Solves A X = B with the LU factors from `factorise`. Overwrites `b(n, columns)` with X.
  subroutine solve_factored(a, pivots, b)
    real(dp), contiguous, intent(in) :: a(:, :)
    integer, intent(in) :: pivots(:)
    real(dp), contiguous, intent(inout) :: b(:, :)
    integer :: info

    call dgetrs("N", size(a, 1), size(b, 2), a, size(a, 1), pivots, b, size(b, 1), info)
  end subroutine solve_factored

  !> Computes ln |det A| of the square matrix `a`. Fails if `a` is singular.
  subroutine log_abs_determinant(a, value, error)
    real(dp), intent(in) :: a(:, :)
    real(dp), intent(out) :: value
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: lu(:, :)
    integer :: pivots(size(a, 1)), i

    allocate(lu, source=a)
    value = 0
    call factorise(lu, pivots, error)
    if (allocated(error)) return
    value = sum([(log(abs(lu(i, i))), i = 1, size(a, 1))])
  end subroutine log_abs_determinant

  !> Computes the inverse of the real matrix `a`. Fails if `a` is singular.
  subroutine real_inverse(a, inverted, error)
    real(dp), intent(in) :: a(:, :)
    real(dp), allocatable, intent(out) :: inverted(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: lu(:, :)
    integer :: pivots(size(a, 1))

    allocate(lu, source=a)
    allocate(inverted, source=unit_matrix(size(a, 1)))
    call factorise(lu, pivots, error)
    if (.not. allocated(error)) call solve_factored(lu, pivots, inverted)
  end subroutine real_inverse

  !> Computes the inverse of the complex matrix `a`. Fails if `a` is singular.
  subroutine complex_inverse(a, inverted, error)
    complex(dp), intent(in) :: a(:, :)
    complex(dp), allocatable, intent(out) :: inverted(:, :)
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: lu(:, :)
    integer :: pivots(size(a, 1)), n, info

    n = size(a, 1)
    allocate(lu, source=a)
    allocate(inverted, source=cmplx(unit_matrix(n), 0, dp))
    call zgetrf(n, n, lu, n, pivots, info)
    if (info /= 0) then
      call fatal_error(error, "the matrix of a linear system is singular", failed_computation)
    else
      call zgetrs("N", n, n, lu, n, pivots, inverted, n, info)
    end if
  end subroutine complex_inverse

  !> Computes the eigenvalues of the real matrix `a(n, n)`, and its right and left eigenvectors as unit columns (dgeev, which
  !> balances the matrix). Conjugate pairs are adjacent, the eigenvalue with positive imaginary part first. Fails if the iteration
  !> does not converge.
  subroutine real_eigensystem(a, values, right, left, error)
    real(dp), intent(in) :: a(:, :)
    complex(dp), allocatable, intent(out) :: values(:), right(:, :), left(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: work(:), copy(:, :), vl(:, :), vr(:, :)
    real(dp) :: wr(size(a, 1)), wi(size(a, 1))
    integer :: n, info

    n = size(a, 1)
    allocate(copy, source=a)
    allocate(vl(n, n), vr(n, n), work(8 * n))
    call dgeev("V", "V", n, copy, n, wr, wi, vl, n, vr, n, work, size(work), info)
    if (info /= 0) then
      call fatal_error(error, "the iteration for the eigenvalues of a matrix did not converge", failed_computation)
      return
    end if
    values = cmplx(wr, wi, dp)
    call unpack_vectors(vr, wi, right)
    call unpack_vectors(vl, wi, left)
  end subroutine real_eigensystem

  !> Computes the eigenvalues and unit eigenvectors of the complex matrix `a(n, n)` (zgeev), in LAPACK's order. Fails if the
  !> iteration does not converge.
  subroutine complex_eigensystem(a, values, right, left, error)
    complex(dp), intent(in) :: a(:, :)
    complex(dp), allocatable, intent(out) :: values(:), right(:, :), left(:, :)
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: work(:), copy(:, :)
    real(dp) :: rwork(2 * size(a, 1))
    integer :: n, info

    n = size(a, 1)
    allocate(copy, source=a)
    allocate(values(n), right(n, n), left(n, n), work(8 * n))
    call zgeev("V", "V", n, copy, n, values, left, n, right, n, work, size(work), rwork, info)
    if (info /= 0) call fatal_error(error, "the iteration for the eigenvalues of a matrix did not converge", failed_computation)
  end subroutine complex_eigensystem

  !> Converts eigenvectors from LAPACK's form to complex columns. LAPACK stores the real and imaginary parts of a conjugate pair as
  !> two real columns.
  pure subroutine unpack_vectors(v, wi, z)
    real(dp), contiguous, intent(in) :: v(:, :), wi(:)
    complex(dp), allocatable, intent(out) :: z(:, :)
    integer :: k

    allocate(z(size(v, 1), size(v, 2)))
    do k = 1, size(wi)
      if (wi(k) > 0) then
        z(:, k) = cmplx(v(:, k), v(:, k + 1), dp)
      else if (wi(k) < 0) then
        z(:, k) = cmplx(v(:, k - 1), -v(:, k), dp)
      else
        z(:, k) = cmplx(v(:, k), 0, dp)
      end if
    end do
  end subroutine unpack_vectors

  !> Solves A x = lambda B x for a symmetric A and a symmetric positive definite B (dsygv). Computes the eigenvalues, ascending, and
  !> the eigenvectors as columns of X with X' B X = E. Fails if B is not positive definite or the iteration does not converge.
  subroutine symmetric_pencil(a, b, values, error, vectors)
    !> A and B, shape (n, n)
    real(dp), intent(in) :: a(:, :), b(:, :)
    !> Eigenvalues, shape (n)
    real(dp), allocatable, intent(out) :: values(:)
    type(error_type), allocatable, intent(out) :: error
    !> Eigenvectors, shape (n, n)
    real(dp), allocatable, intent(out), optional :: vectors(:, :)
    real(dp), allocatable :: a_copy(:, :), b_copy(:, :), work(:)
    integer :: n, info

    n = size(a, 1)
    allocate(a_copy, source=a)
    allocate(b_copy, source=b)
    allocate(values(n), work(3 * n))
    call dsygv(1, merge("V", "N", present(vectors)), "U", n, a_copy, n, b_copy, n, values, work, size(work), info)
    if (info > n) then
      call fatal_error(error, "the mass matrix is not positive definite", failed_computation)
    else if (info /= 0) then
      call fatal_error(error, "the iteration for the natural frequencies did not converge", failed_computation)
    end if
    if (present(vectors)) call move_alloc(a_copy, vectors)
  end subroutine symmetric_pencil

  !> Powers of two d for which rows and columns of D^-1 A D, D = diag(d), have similar norms (dgebal).
  function balancing(a) result(d)
    real(dp), intent(in) :: a(:, :)
    real(dp) :: d(size(a, 1))
    real(dp), allocatable :: copy(:, :)
    integer :: low, high, info

    allocate(copy, source=a)
    call dgebal("S", size(a, 1), copy, size(a, 1), low, high, d, info)
    if (info /= 0) d = 1
  end function balancing

  !> Computes the lower triangular R with R B R' = E for a symmetric positive definite B (dpotrf, dtrtri). Fails if B is not
  !> positive definite.
  subroutine inverse_factor(b, r, error)
    real(dp), intent(in) :: b(:, :)
    real(dp), allocatable, intent(out) :: r(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: i, n, info

    n = size(b, 1)
    allocate(r, source=b)
    call dpotrf("L", n, r, max(1, n), info)
    if (info == 0) call dtrtri("L", "N", n, r, max(1, n), info)
    if (info /= 0) call fatal_error(error, "the matrix is not positive definite", failed_computation)
    do i = 2, n
      r(:i - 1, i) = 0
    end do
  end subroutine inverse_factor

  !> Computes the x that minimises |A x - c| subject to B x = d (dgglse). Fails if x is not unique.
  subroutine constrained_least_squares(a, c, b, d, x, error)
    !> `a`, shape (m, n): matrix A. `c`, shape (m): vector c. `b`, shape (p, n): matrix B. `d`, shape (p): vector d.
    real(dp), intent(in) :: a(:, :), c(:), b(:, :), d(:)
    !> Solution, shape (n)
    real(dp), intent(out) :: x(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: a_copy(:, :), b_copy(:, :), work(:)
    real(dp) :: c_copy(size(c)), d_copy(size(d))
    integer :: info

    allocate(a_copy, source=a)
    allocate(b_copy, source=b)
    c_copy = c
    d_copy = d
    allocate(work(32 * (size(a, 1) + size(a, 2) + size(b, 1) + 1)))
    call dgglse(size(a, 1), size(a, 2), size(b, 1), a_copy, max(1, size(a, 1)), b_copy, max(1, size(b, 1)), c_copy, d_copy, &
      & x, work, size(work), info)
    if (info /= 0) call fatal_error(error, "the least squares problem has no unique solution", failed_computation)
  end subroutine constrained_least_squares

end module gestell_math_lapack
