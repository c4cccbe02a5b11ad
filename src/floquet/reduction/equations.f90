!> Solves complex linear equations at many phases together, in real arithmetic.
module gestell_floquet_reduction_equations
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_reduction_conjugates, only: divide, entry
  implicit none (type, external)
  private

  public :: means

  !> Complex linear equations for n unknowns. Every row is divided by re + i im. The caller sets `re` and `im` before calling
  !> `start`. The divisor should be close to the diagonal elements, so that elimination needs no pivoting.
  type, public :: equations_type
    integer :: n = 0
    !> Real and imaginary part of the divisor, shape (phases).
    real(dp), allocatable :: re(:), im(:)
    !> `matrix`: matrix, shape (phases, 2 n, 2 n). `x`: right-hand side, replaced by the solution, shape (phases, 2 n). Real parts
    !> precede imaginary parts.
    real(dp), allocatable :: matrix(:, :, :), x(:, :)
  contains
    procedure :: start, add, set_right
  end type equations_type

contains

  !> Prepares equations for `n` unknowns, with all elements zero. If a divisor is nearly zero at some phase, all divisors are
  !> replaced by 1.
  pure subroutine start(self, n)
    class(equations_type), intent(inout) :: self
    integer, intent(in) :: n
    real(dp), parameter :: little = 1.0e-6_dp

    self%n = n
    allocate(self%matrix(size(self%re), 2 * n, 2 * n), self%x(size(self%re), 2 * n), source=0.0_dp)
    if (all(self%re**2 + self%im**2 > little)) return
    self%re = 1
    self%im = 0
  end subroutine start

  !> Adds re + i im to the element (row, column) of the matrix.
  subroutine add(self, re, im, row, column)
    class(equations_type), intent(inout) :: self
    real(dp), intent(in) :: re(:), im(:)
    integer, intent(in) :: row, column
    real(dp) :: a(size(re)), b(size(re))
    type(error_type), allocatable :: unused

    a = re
    b = im
    call divide(self%re, self%im, a, b, unused)
    associate (n => self%n, matrix => self%matrix)
      matrix(:, row, column) = matrix(:, row, column) + a
      matrix(:, n + row, n + column) = matrix(:, n + row, n + column) + a
      matrix(:, row, n + column) = matrix(:, row, n + column) - b
      matrix(:, n + row, column) = matrix(:, n + row, column) + b
    end associate
  end subroutine add

  !> Sets the right-hand side of one equation to re + i im.
  subroutine set_right(self, re, im, row)
    class(equations_type), intent(inout) :: self
    real(dp), intent(in) :: re(:), im(:)
    integer, intent(in) :: row
    type(error_type), allocatable :: unused

    self%x(:, row) = re
    self%x(:, self%n + row) = im
    call divide(self%re, self%im, self%x(:, row), self%x(:, self%n + row), unused)
  end subroutine set_right

  !> Computes the mean of those eigenvalues of the generator D that belong to the columns `own`, at each phase.
  pure subroutine means(d, conjugate, own, re, im)
    real(dp), contiguous, intent(in) :: d(:, :, :)
    integer, intent(in) :: conjugate(:), own(:)
    real(dp), intent(out) :: re(:), im(:)
    real(dp), dimension(size(d, 1)) :: one_re, one_im
    integer :: k

    re = 0
    im = 0
    do k = 1, size(own)
      call entry(d, conjugate, own(k), own(k), one_re, one_im)
      re = re + one_re / size(own)
      im = im + one_im / size(own)
    end do
  end subroutine means

end module gestell_floquet_reduction_equations
