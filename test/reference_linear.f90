!> Small dense linear algebra in quadruple precision: solve, determinant, eigenvalues, eigenvector.
!> Written for matrices up to about 8 x 8; slow and plain on purpose.
module reference_linear
  use, intrinsic :: iso_fortran_env, only: qp => real128
  implicit none (type, external)
  private

  public :: qp, solve, determinant, eigenvalues, eigenvector

  real(qp), parameter :: eps = epsilon(1.0_qp)

  !> x = solve(a, b): the solution of a x = b (b a vector or a matrix, real or complex), error stop if a is singular.
  interface solve
    module procedure solve_vector
    module procedure solve_matrix
    module procedure solve_complex
  end interface solve

contains

  function solve_vector(a, b) result(x)
    real(qp), intent(in) :: a(:, :), b(:)
    real(qp) :: x(size(b)), column(size(b), 1)

    column(:, 1) = b
    column = solve_matrix(a, column)
    x = column(:, 1)
  end function solve_vector

  !> Gaussian elimination with row exchanges; the pivot is judged relative to the largest entry of its row.
  function solve_matrix(a, b) result(x)
    real(qp), intent(in) :: a(:, :), b(:, :)
    real(qp) :: x(size(b, 1), size(b, 2))
    real(qp) :: u(size(a, 1), size(a, 1)), weight(size(a, 1)), row(size(a, 1)), row_x(size(b, 2)), factor
    integer :: n, i, k, p

    n = size(a, 1)
    u = a
    x = b
    weight = maxval(abs(a), dim=2)
    if (any(weight <= 0)) error stop "reference_linear: singular matrix"
    do k = 1, n
      p = k - 1 + maxloc(abs(u(k:, k))/weight(k:), dim=1)
      if (abs(u(p, k)) <= 0) error stop "reference_linear: singular matrix"
      if (p /= k) then
        row = u(k, :); u(k, :) = u(p, :); u(p, :) = row
        row_x = x(k, :); x(k, :) = x(p, :); x(p, :) = row_x
        weight(p) = weight(k)
      end if
      do i = k + 1, n
        factor = u(i, k)/u(k, k)
        u(i, k + 1:) = u(i, k + 1:) - factor*u(k, k + 1:)
        x(i, :) = x(i, :) - factor*x(k, :)
      end do
    end do
    do k = n, 1, -1
      x(k, :) = x(k, :)/u(k, k)
      do i = 1, k - 1
        x(i, :) = x(i, :) - u(i, k)*x(k, :)
      end do
    end do
  end function solve_matrix

  !> Solves a complex matrix with one right-hand side. A vanishing pivot is replaced by the smallest value that rounding could
  !> have left there, as inverse iteration requires.
  function solve_complex(a, b) result(x)
    complex(qp), intent(in) :: a(:, :), b(:)
    complex(qp) :: x(size(b)), u(size(a, 1), size(a, 1)), row(size(a, 1)), element
    real(qp) :: least
    integer :: n, i, k, p

    n = size(a, 1)
    u = a
    x = b
    least = max(eps*maxval(abs(a)), tiny(1.0_qp)**0.25_qp)
    do k = 1, n
      p = k - 1 + maxloc(abs(u(k:, k)), dim=1)
      row = u(k, :); u(k, :) = u(p, :); u(p, :) = row
      element = x(k); x(k) = x(p); x(p) = element
      if (abs(u(k, k)) < least) u(k, k) = least
      do i = k + 1, n
        element = u(i, k)/u(k, k)
        u(i, k + 1:) = u(i, k + 1:) - element*u(k, k + 1:)
        x(i) = x(i) - element*x(k)
      end do
    end do
    do k = n, 1, -1
      x(k) = (x(k) - sum(u(k, k + 1:)*x(k + 1:)))/u(k, k)
    end do
  end function solve_complex

  !> Determinant by elimination with row exchanges.
  function determinant(a) result(det)
    real(qp), intent(in) :: a(:, :)
    real(qp) :: det
    real(qp) :: u(size(a, 1), size(a, 1)), row(size(a, 1))
    integer :: n, i, k, p

    n = size(a, 1)
    u = a
    det = 1
    do k = 1, n
      p = k - 1 + maxloc(abs(u(k:, k)), dim=1)
      if (abs(u(p, k)) <= 0) then
        det = 0
        return
      end if
      if (p /= k) then
        row = u(k, :); u(k, :) = u(p, :); u(p, :) = row
        det = -det
      end if
      det = det*u(k, k)
      do i = k + 1, n
        u(i, k:) = u(i, k:) - u(i, k)/u(k, k)*u(k, k:)
      end do
    end do
  end function determinant

  !> All eigenvalues of the real n x n matrix a: largest modulus first, of equal moduli (to 1e-20) the larger |im|
  !> first, of a conjugate pair the one above the real axis first. residual(k) = |a y - lambda_k y|_2 / (|a|_F |y|_2)
  !> of the balanced matrix, a few 1e-34 when all is well.
  !> Method: balancing, then the QR iteration with Wilkinson's shift on the whole (not reduced) complex matrix.
  subroutine eigenvalues(a, lambda, residual)
    real(qp), intent(in) :: a(:, :)
    complex(qp), intent(out) :: lambda(:)
    real(qp), intent(out), optional :: residual(:)
    real(qp) :: balanced(size(a, 1), size(a, 1)), d(size(a, 1)), norm
    complex(qp) :: t(size(a, 1), size(a, 1)), shift, y(size(a, 1))
    integer :: n, i, k, m

    n = size(a, 1)
    call balance(a, balanced, d)
    t = cmplx(balanced, kind=qp)
    norm = sqrt(sum(balanced**2))
    do m = n, 2, -1
      do i = 1, 500
        if (sqrt(sum(abs(t(m, :m - 1))**2)) <= 0.25_qp*eps*norm) exit
        shift = wilkinson(t(m - 1:m, m - 1:m))
        if (mod(i, 11) == 0) shift = shift + cmplx(0.37_qp, 0.61_qp, qp)*sqrt(sum(abs(t(m, :m - 1))**2))
        call qr_step(t(:m, :m), shift)
      end do
      if (i > 500) error stop "reference_linear: the QR iteration does not end"
    end do
    lambda = [(t(k, k), k = 1, n)]
    call sort(lambda)
    if (present(residual)) then
      do k = 1, n
        call inverse_iteration(balanced, lambda(k), y)
        residual(k) = sqrt(sum(abs(matmul(balanced, y) - lambda(k)*y)**2))/max(norm, tiny(norm))
      end do
    end if
  end subroutine eigenvalues

  !> Eigenvector of a for its eigenvalue lambda, 2-norm 1, the component of largest modulus real and positive.
  function eigenvector(a, lambda) result(y)
    real(qp), intent(in) :: a(:, :)
    complex(qp), intent(in) :: lambda
    complex(qp) :: y(size(a, 1))
    real(qp) :: balanced(size(a, 1), size(a, 1)), d(size(a, 1))
    integer :: k

    call balance(a, balanced, d)
    call inverse_iteration(balanced, lambda, y)
    y = d*y
    k = maxloc(abs(y), dim=1)
    y = y*(abs(y(k))/y(k))/sqrt(sum(abs(y)**2))
  end function eigenvector

  subroutine inverse_iteration(a, lambda, y)
    real(qp), intent(in) :: a(:, :)
    complex(qp), intent(in) :: lambda
    complex(qp), intent(out) :: y(:)
    complex(qp) :: shifted(size(a, 1), size(a, 1))
    integer :: k

    shifted = cmplx(a, kind=qp)
    do k = 1, size(a, 1)
      shifted(k, k) = shifted(k, k) - lambda
      y(k) = cmplx(1.0_qp, 0.1_qp*k, qp)
    end do
    do k = 1, 3
      y = y/maxval(abs(y))
      y = solve(shifted, y)
    end do
    y = y/maxval(abs(y))
    y = y/sqrt(sum(abs(y)**2))
  end subroutine inverse_iteration

  !> b = D^-1 a D with D = diag(d), powers of two, so that rows and columns are of like size.
  subroutine balance(a, b, d)
    real(qp), intent(in) :: a(:, :)
    real(qp), intent(out) :: b(:, :), d(:)
    real(qp) :: row, column, f
    integer :: i, sweep

    b = a
    d = 1
    do sweep = 1, 20
      do i = 1, size(a, 1)
        row = sum(abs(b(i, :))) - abs(b(i, i))
        column = sum(abs(b(:, i))) - abs(b(i, i))
        if (row <= 0 .or. column <= 0) cycle
        f = 2.0_qp**nint(log(row/column)/(2*log(2.0_qp)))
        d(i) = d(i)*f
        b(i, :) = b(i, :)/f
        b(:, i) = b(:, i)*f
      end do
    end do
  end subroutine balance

  !> The eigenvalue of t (2 x 2) that is nearer to t(2, 2).
  pure function wilkinson(t) result(shift)
    complex(qp), intent(in) :: t(:, :)
    complex(qp) :: shift, mean, root

    mean = (t(1, 1) + t(2, 2))/2
    root = sqrt(((t(1, 1) - t(2, 2))/2)**2 + t(1, 2)*t(2, 1))
    shift = mean + root
    if (abs(mean - root - t(2, 2)) < abs(shift - t(2, 2))) shift = mean - root
  end function wilkinson

  !> t <- R Q + shift E with Q R = t - shift E, by Householder reflections.
  subroutine qr_step(t, shift)
    complex(qp), intent(inout) :: t(:, :)
    complex(qp), intent(in) :: shift
    complex(qp) :: v(size(t, 1), size(t, 1)), phase
    real(qp) :: norm
    integer :: n, i, k

    n = size(t, 1)
    v = 0
    do i = 1, n
      t(i, i) = t(i, i) - shift
    end do
    do k = 1, n - 1
      norm = sqrt(sum(abs(t(k:, k))**2))
      if (norm <= 0) cycle
      phase = 1
      if (abs(t(k, k)) > 0) phase = t(k, k)/abs(t(k, k))
      v(k:, k) = t(k:, k)
      v(k, k) = v(k, k) + phase*norm
      v(:, k) = v(:, k)/sqrt(sum(abs(v(:, k))**2))
      do i = k, n
        t(:, i) = t(:, i) - 2*dot_product(v(:, k), t(:, i))*v(:, k)
      end do
    end do
    do k = 1, n - 1
      do i = 1, n
        t(i, :) = t(i, :) - 2*sum(t(i, :)*v(:, k))*conjg(v(:, k))
      end do
    end do
    do i = 1, n
      t(i, i) = t(i, i) + shift
    end do
  end subroutine qr_step

  subroutine sort(z)
    complex(qp), intent(inout) :: z(:)
    complex(qp) :: swap
    integer :: i, k

    do i = 1, size(z) - 1
      do k = size(z) - 1, i, -1
        if (precedes(z(k + 1), z(k))) then
          swap = z(k); z(k) = z(k + 1); z(k + 1) = swap
        end if
      end do
    end do
  end subroutine sort

  pure function precedes(a, b) result(before)
    complex(qp), intent(in) :: a, b
    logical :: before
    real(qp) :: small

    small = 1.0e-20_qp*max(abs(a), abs(b))
    if (abs(abs(a) - abs(b)) > small) then
      before = abs(a) > abs(b)
    else if (abs(abs(a%im) - abs(b%im)) > small) then
      before = abs(a%im) > abs(b%im)
    else
      before = a%im - b%im > small
    end if
  end function precedes

end module reference_linear
