!> Double precision helpers of the reference: starts of iterations and accelerations. No digit of a result depends on them.
module reference_double
  use, intrinsic :: iso_fortran_env, only: dp => real64
  implicit none (type, external)
  private

  public :: factors_type, factorise, eigenpairs

  !> LU factors of a matrix whose rows and columns have been scaled to the size 1.
  type :: factors_type
    complex(dp), allocatable :: lu(:, :)
    real(dp), allocatable :: row(:), column(:)
    integer, allocatable :: pivots(:)
  contains
    procedure :: solve => solve_factored
  end type factors_type

  interface
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
  end interface

contains

  !> ok: the matrix is not singular and all of its entries are finite.
  subroutine factorise(a, factors, ok)
    complex(dp), intent(in) :: a(:, :)
    type(factors_type), intent(out) :: factors
    logical, intent(out) :: ok
    integer :: n, info, k

    n = size(a, 1)
    allocate (factors%row(n), factors%column(n), factors%pivots(n))
    allocate (factors%lu, source=a)
    factors%row = maxval(abs(a), dim=2)
    ok = all(factors%row > 0) .and. all(factors%row <= huge(1.0_dp))
    if (.not. ok) return
    do k = 1, n
      factors%lu(:, k) = a(:, k)/factors%row
      factors%column(k) = maxval(abs(factors%lu(:, k)))
      ok = factors%column(k) > 0
      if (.not. ok) return
      factors%lu(:, k) = factors%lu(:, k)/factors%column(k)
    end do
    call zgetrf(n, n, factors%lu, n, factors%pivots, info)
    ok = info == 0
  end subroutine factorise

  !> x with a x = b, to double precision.
  function solve_factored(self, b) result(x)
    class(factors_type), intent(in) :: self
    complex(dp), intent(in) :: b(:)
    complex(dp) :: x(size(b))
    complex(dp) :: column(size(b), 1)
    integer :: info

    column(:, 1) = b/self%row
    call zgetrs('N', size(b), 1, self%lu, size(b), self%pivots, column, size(b), info)
    x = column(:, 1)/self%column
  end function solve_factored

  !> Eigenvalues, right and left eigenvectors (unit columns). Values that are real except for rounding are made real. ok: LAPACK
  !> found them.
  subroutine eigenpairs(a, lambda, right, left, ok)
    real(dp), intent(in) :: a(:, :)
    complex(dp), intent(out) :: lambda(:), right(:, :), left(:, :)
    logical, intent(out) :: ok
    complex(dp) :: copy(size(a, 1), size(a, 1)), work(8*size(a, 1))
    real(dp) :: rwork(2*size(a, 1))
    integer :: n, info

    n = size(a, 1)
    copy = cmplx(a, kind=dp)
    call zgeev('V', 'V', n, copy, n, lambda, left, n, right, n, work, size(work), rwork, info)
    ok = info == 0
    if (ok) lambda = cmplx(real(lambda), merge(0.0_dp, aimag(lambda), abs(aimag(lambda)) <= 1.0e-13_dp*maxval(abs(a))), dp)
  end subroutine eigenpairs

end module reference_double
