!> GMRES against its definition: its solution minimises the residual over the Krylov space.
module test_gmres
  use checks, only: check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: inverse
  use gestell_floquet_balance_gmres, only: gmres_type
  use reference_random, only: random_type
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_gmres

contains

  subroutine collect_gmres(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the residual is as small as it can be after every product", test_minimum), &
      & new_unittest("the estimate of the inverse's norm is exact for a multiple of the unit matrix", test_amplification)]
  end subroutine collect_gmres

  !> After m products the residual b - A x is orthogonal to A v for all vectors v of the Krylov space of b, A b, ... A^(m-1) b, and
  !> x lies in it. Matrices of 1 to 9 rows, because scalar products are summed four by four.
  subroutine test_minimum(error)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    type(gmres_type) :: gmres
    real(dp), allocatable :: a(:, :), b(:), x(:), krylov(:, :)
    ! A basis of powers has a condition of up to 1e4 here, whose square multiplies roundings.
    real(dp), parameter :: allowed = 1.0e-7_dp
    integer :: n, m, i, k

    do n = 1, 9
      call random%start(n, 1)
      a = reshape([(random%about_zero(0.5_dp), k = 1, n**2)], [n, n])
      do k = 1, n
        a(k, k) = a(k, k) + 1
      end do
      b = [(random%about_zero(1.0_dp), k = 1, n)]
      krylov = spread(b, 2, n)
      do k = 2, n
        krylov(:, k) = matmul(a, krylov(:, k - 1))
        krylov(:, k) = krylov(:, k) / norm2(krylov(:, k))
      end do
      call restart(gmres)
      call gmres%begin(b, n)
      do m = 1, min(n, 5)
        call check_that(error, abs(norm2(gmres%last()) - 1), "<", 1.0e-14_dp, "length of the vector")
        call gmres%extend(matmul(a, gmres%last()))
        x = gmres%solution()
        associate (residual => b - matmul(a, x), best => least_squares(a, krylov(:, :m), b))
          call check_that(error, abs(x - best), "<", allowed * norm2(best), "solution of least squares")
          call check_that(error, [(abs(dot_product(matmul(a, krylov(:, i)), residual)), i = 1, m)], "<", 1.0e-13_dp * norm2(b), &
            & "orthogonality")
          ! With all vectors only roundings remain.
          call check_that(error, abs(gmres%residual() - norm2(residual) / norm2(x)), "<", 1.0e-12_dp * norm2(b) / norm2(x), &
            & "reported residual")
        end associate
        if (allocated(error)) return
      end do
    end do
  end subroutine test_minimum

  !> The combination of the columns of `basis` for which |b - A x| is least, by the normal equations.
  function least_squares(a, basis, b) result(x)
    real(dp), intent(in) :: a(:, :), basis(:, :), b(:)
    real(dp) :: x(size(b)), image(size(b), size(basis, 2))
    real(dp), allocatable :: normal(:, :)
    type(gestell_error), allocatable :: failure

    image = matmul(a, basis)
    call inverse(matmul(transpose(image), image), normal, failure)
    x = 0
    if (.not. allocated(failure)) x = matmul(basis, matmul(normal, matmul(transpose(image), b)))
  end function least_squares

  pure subroutine restart(gmres)
    type(gmres_type), intent(out) :: gmres

    associate (unused => gmres)
    end associate
  end subroutine restart

  !> A = c E is inverted by one product: |A^-1| = 1 / c, of which the estimate is 1 + |1 / c - 1|.
  subroutine test_amplification(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: factors(4) = [1.0_dp, 0.25_dp, 0.01_dp, 2.0_dp], b(5) = [1.0_dp, -2.0_dp, 0.0_dp, 3.0_dp, 0.5_dp]
    type(gmres_type) :: gmres
    integer :: k

    do k = 1, size(factors)
      call restart(gmres)
      call gmres%begin(b, 3)
      call gmres%extend(factors(k) * gmres%last())
      call check_that(error, abs(gmres%amplification() - 1 - abs(1 / factors(k) - 1)), "<", 1.0e-13_dp / factors(k), "estimate")
      call check_that(error, abs(gmres%solution() - b / factors(k)), "<", 1.0e-14_dp * norm2(b) / factors(k), "solution")
      if (allocated(error)) return
    end do
  end subroutine test_amplification

end module test_gmres
