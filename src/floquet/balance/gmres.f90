!> GMRES, the generalised minimal residual method: solves A x = b from products A v for an A close to the unit matrix
!> (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7, 1986, 856-869). The caller multiplies `last` by A and passes the product
!> to `extend`.
module gestell_floquet_balance_gmres
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> State of the GMRES iteration, which the procedures of this type update.
  type, public :: gmres_type
    private
    !> Number of products A v so far
    integer :: products = 0
    !> `vectors`: orthonormal basis vectors V. `cosine`, `sine`: the plane rotations that form the orthogonal matrix Q. `r`: the
    !> triangular matrix R with A V = (V Q) R. `residual_norms`: components of the residual of b in the basis V Q
    real(dp), allocatable :: vectors(:, :), r(:, :), cosine(:), sine(:), residual_norms(:)
  contains
    procedure :: begin, last, extend, solution, amplification, residual
  end type gmres_type

  !> Value of the function `residual` if there is no solution.
  real(dp), parameter :: none = 1.0e100_dp

contains

  !> Starts the iteration for the right-hand side `b`. Allocates memory for at most `most` products.
  pure subroutine begin(self, b, most)
    class(gmres_type), intent(inout) :: self
    real(dp), intent(in) :: b(:)
    integer, intent(in) :: most

    self%products = 0
    allocate(self%vectors(size(b), most + 1), self%r(most + 1, most))
    allocate(self%cosine(most), self%sine(most), self%residual_norms(most + 1))
    self%residual_norms(1) = norm2(b)
    self%vectors(:, 1) = b / max(self%residual_norms(1), tiny(1.0_dp))
  end subroutine begin

  !> The vector v whose product A v the caller must compute next.
  pure function last(self)
    class(gmres_type), intent(in) :: self
    real(dp) :: last(size(self%vectors, 1))

    last = self%vectors(:, self%products + 1)
  end function last

  !> Extends the basis by `product`, the product of A with the vector `last`.
  pure subroutine extend(self, product)
    class(gmres_type), intent(inout) :: self
    real(dp), contiguous, intent(in) :: product(:)
    real(dp) :: rotated
    integer :: m, i

    m = self%products + 1
    self%products = m
    associate (next => self%vectors(:, m + 1), column => self%r(:, m))
      next = product
      do i = 1, m
        column(i) = inner(self%vectors(:, i), next)
        next = next - column(i) * self%vectors(:, i)
      end do
      column(m + 1) = sqrt(inner(next, next))
      next = next / max(column(m + 1), tiny(rotated))
      do i = 1, m - 1
        rotated = self%cosine(i) * column(i) + self%sine(i) * column(i + 1)
        column(i + 1) = self%cosine(i) * column(i + 1) - self%sine(i) * column(i)
        column(i) = rotated
      end do
      rotated = hypot(column(m), column(m + 1))
      self%cosine(m) = column(m) / max(rotated, tiny(rotated))
      self%sine(m) = column(m + 1) / max(rotated, tiny(rotated))
      column(m) = rotated
    end associate
    self%residual_norms(m + 1) = -self%sine(m) * self%residual_norms(m)
    self%residual_norms(m) = self%cosine(m) * self%residual_norms(m)
  end subroutine extend

  !> The combination x of the basis vectors so far that minimises |b - A x|.
  pure function solution(self) result(x)
    class(gmres_type), intent(in) :: self
    real(dp) :: x(size(self%vectors, 1))
    real(dp) :: y(self%products)
    integer :: i

    y = coefficients(self, self%residual_norms(:self%products))
    x = 0
    do i = 1, self%products
      x = x + y(i) * self%vectors(:, i)
    end do
  end function solution

  !> Norm of the residual relative to the solution, |b - A x|/|x|; `none` if there is no solution.
  pure real(dp) function residual(self)
    class(gmres_type), intent(in) :: self
    real(dp) :: size_of_solution

    residual = abs(self%residual_norms(self%products + 1))
    if (.not. residual > 0) return
    size_of_solution = norm2(coefficients(self, self%residual_norms(:self%products)))
    if (residual < none * min(1.0_dp, size_of_solution)) then
      residual = residual / size_of_solution
    else
      residual = none
    end if
  end function residual

  !> Estimate of the norm |A^-1| from the products so far: 1 + |R^-1 - E|, where R is the triangular matrix of the iteration and E
  !> the unit matrix.
  pure real(dp) function amplification(self)
    class(gmres_type), intent(in) :: self
    real(dp) :: column(self%products), squares
    integer :: i

    squares = 0
    do i = 1, self%products
      column = 0
      column(i) = 1
      column(:i) = coefficients(self, column(:i))
      column(i) = column(i) - 1
      squares = squares + sum(column(:i)**2)
    end do
    amplification = 1 + sqrt(squares)
  end function amplification

  !> Solves the triangular system R x = y with the leading columns of R.
  pure function coefficients(self, y) result(x)
    class(gmres_type), intent(in) :: self
    real(dp), intent(in) :: y(:)
    real(dp) :: x(size(y))
    integer :: i

    x = y
    do i = size(y), 1, -1
      x(i) = x(i) / self%r(i, i)
      x(:i - 1) = x(:i - 1) - x(i) * self%r(:i - 1, i)
    end do
  end function coefficients

  !> The scalar product u . v, in four independent sums that the processor adds in parallel.
  pure real(dp) function inner(u, v)
    real(dp), contiguous, intent(in) :: u(:), v(:)
    real(dp) :: s1, s2, s3, s4
    integer :: i

    s1 = 0
    s2 = 0
    s3 = 0
    s4 = 0
    do i = 1, size(u) - 3, 4
      s1 = s1 + u(i) * v(i)
      s2 = s2 + u(i + 1) * v(i + 1)
      s3 = s3 + u(i + 2) * v(i + 2)
      s4 = s4 + u(i + 3) * v(i + 3)
    end do
    do i = size(u) - mod(size(u), 4) + 1, size(u)
      s1 = s1 + u(i) * v(i)
    end do
    inner = (s1 + s2) + (s3 + s4)
  end function inner

end module gestell_floquet_balance_gmres
