!> The gateway to BLAS.
module gestell_math_blas
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: multiply

  interface
    !> Thirteen arguments: as BLAS has them.
    pure subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: transa, transb
      integer, intent(in) :: m, n, k, lda, ldb, ldc
      real(dp), intent(in) :: alpha, a(lda, *), b(ldb, *), beta
      real(dp), intent(inout) :: c(ldc, *)
    end subroutine dgemm
  end interface

contains

  !> C = A B for A of shape (m, k), B of (k, n), which stand one after the other in memory.
  pure subroutine multiply(m, n, k, a, b, c)
    integer, intent(in) :: m, n, k
    real(dp), intent(in) :: a(m, k), b(k, n)
    real(dp), intent(inout) :: c(m, n)

    call dgemm("N", "N", m, n, k, 1.0_dp, a, m, b, k, 0.0_dp, c, m)
  end subroutine multiply

end module gestell_math_blas
