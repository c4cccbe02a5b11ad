!> Linear least squares in two stages, for problems with more counterweights than the force determines.
!>
!> The vector x of unknowns minimises the mean square of the forces A_1 x - b_1. If several x do so, the one with the smallest
!> mean square of the moments A_2 x - b_2 is chosen. If several x remain, the one with the smallest norm is chosen.
!>
!> Rotations of two columns at a time give A V = W, where V is orthogonal and the columns of W are orthogonal to each other (M. R.
!> Hestenes, J. SIAM 6, 1958, 51-90). Let v and w be corresponding columns of V and W for A = A_1. Then x_1, the minimum-norm
!> solution for the forces, is the sum of v (w . b_1)/(w . w) over all columns with nonzero w. The columns v with w = 0 do not
!> change the force; they form the matrix N. The mean square of the moments of x_1 + N y is minimised over y in the same way. x_1
!> and N y are orthogonal.
module gestell_study_balance_least_squares
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: unit_matrix
  implicit none (type, external)
  private

  !> Factors of A V = W: V is orthogonal, and the columns of W are orthogonal to each other. `counts`: true for the columns of W
  !> that do not vanish.
  type :: singular_type
    real(dp), allocatable :: w(:, :), v(:, :)
    logical, allocatable :: counts(:)
  contains
    procedure :: decompose, shortest
  end type singular_type

  !> Factors of the force problem, and factors of the moment problem in the unknowns that the force does not determine.
  type, public :: least_squares_type
    private
    type(singular_type) :: force, moment
    !> `of_moment`: the matrix of the moments. `free`: a matrix whose columns are the changes of the unknowns that leave the force
    !> unchanged
    real(dp), allocatable :: of_moment(:, :), free(:, :)
    !> Kind of each row: 1 force, 2 moment
    integer, allocatable :: kinds(:)
  contains
    procedure :: prepare, solve
  end type least_squares_type

contains

  !> Factors the matrices of both problems. `effects`: effects of the unknowns, shape (rows, angles, unknowns). `kinds`: kind of
  !> each row, 1 force, 2 moment.
  pure subroutine prepare(self, effects, kinds)
    class(least_squares_type), intent(inout) :: self
    real(dp), intent(in) :: effects(:, :, :)
    integer, intent(in) :: kinds(:)
    integer :: k

    self%kinds = kinds
    call self%force%decompose(columns_of(effects, kinds, 1))
    self%of_moment = columns_of(effects, kinds, 2)
    self%free = self%force%v(:, pack([(k, k = 1, size(self%force%counts))], .not. self%force%counts))
    call self%moment%decompose(matmul(self%of_moment, self%free), maxval(norm2(self%of_moment, dim=1)))
  end subroutine prepare

  !> Solves the least-squares problem. Each pair of unknowns is returned as one complex number of `u`. `target_values`: right-hand
  !> sides, shape (rows, angles).
  pure subroutine solve(self, target_values, u)
    class(least_squares_type), intent(in) :: self
    real(dp), intent(in) :: target_values(:, :)
    complex(dp), intent(out) :: u(:)
    real(dp) :: x(2 * size(u))

    x = self%force%shortest(row_of(target_values, self%kinds, 1))
    x = x + matmul(self%free, self%moment%shortest(row_of(target_values, self%kinds, 2) - matmul(self%of_moment, x)))
    u = cmplx(x(1::2), x(2::2), dp)
  end subroutine solve

  !> Matrix of the effects on all forces (`kind` 1) or on all moments (`kind` 2), shape (rows of this kind times angles,
  !> unknowns).
  pure function columns_of(effects, kinds, kind) result(a)
    real(dp), intent(in) :: effects(:, :, :)
    integer, intent(in) :: kinds(:), kind
    real(dp), allocatable :: a(:, :)
    integer :: k

    allocate(a(count(kinds == kind) * size(effects, 2), size(effects, 3)))
    do k = 1, size(effects, 3)
      a(:, k) = row_of(effects(:, :, k), kinds, kind)
    end do
  end function columns_of

  pure function row_of(values, kinds, kind) result(row)
    real(dp), intent(in) :: values(:, :)
    integer, intent(in) :: kinds(:), kind
    real(dp), allocatable :: row(:)

    row = pack(values, spread(kinds == kind, 2, size(values, 2)))
  end function row_of

  !> Computes an orthogonal matrix V, and a matrix W with orthogonal columns, so that A V = W. A column of W counts as zero if its
  !> norm is below 1e-8 of `total_size`. The default of `total_size` is the norm of the longest column of A.
  pure subroutine decompose(self, a, total_size)
    class(singular_type), intent(inout) :: self
    real(dp), intent(in) :: a(:, :)
    real(dp), intent(in), optional :: total_size
    integer, parameter :: most = 60
    real(dp), parameter :: dependent = 1.0e-8_dp, orthogonal = 1.0e-14_dp
    real(dp) :: longest, lengths(2), product, angle
    logical :: turned
    integer :: j, k, n, sweep

    n = size(a, 2)
    self%w = a
    self%v = unit_matrix(n)
    longest = maxval([0.0_dp, norm2(a, dim=1)])
    if (present(total_size)) longest = total_size
    do sweep = 1, most
      turned = .false.
      do k = 2, n
        do j = 1, k - 1
          lengths = [norm2(self%w(:, j)), norm2(self%w(:, k))]
          ! the direction of a column is meaningless if its norm is below the rounding error of the longest column
          if (minval(lengths) <= orthogonal * longest) cycle
          product = dot_product(self%w(:, j), self%w(:, k))
          if (abs(product) <= orthogonal * lengths(1) * lengths(2)) cycle
          turned = .true.
          angle = atan2(2 * product, lengths(1)**2 - lengths(2)**2) / 2
          call rotate(self%w(:, j), self%w(:, k), angle)
          call rotate(self%v(:, j), self%v(:, k), angle)
        end do
      end do
      if (.not. turned) exit
    end do
    self%counts = norm2(self%w, dim=1) > dependent * longest
  end subroutine decompose

  pure subroutine rotate(x, y, angle)
    real(dp), intent(inout) :: x(:), y(:)
    real(dp), intent(in) :: angle
    real(dp) :: before(size(x))

    before = x
    x = cos(angle) * before + sin(angle) * y
    y = cos(angle) * y - sin(angle) * before
  end subroutine rotate

  !> The minimum-norm least-squares solution of A x = b.
  pure function shortest(self, b) result(x)
    class(singular_type), intent(in) :: self
    real(dp), intent(in) :: b(:)
    real(dp) :: x(size(self%v, 1))
    integer :: k

    x = 0
    do k = 1, size(x)
      if (self%counts(k)) x = x + dot_product(self%w(:, k), b) / dot_product(self%w(:, k), self%w(:, k)) * self%v(:, k)
    end do
  end function shortest

end module gestell_study_balance_least_squares
