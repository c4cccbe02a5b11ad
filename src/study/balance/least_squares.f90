!> Linear least squares in two stages, for more counterweights than the force determines: x by which the mean square of forces
!> A_1 x - b_1 is least, of these x those by which that of moments A_2 x - b_2 is, of these the one of least squares.
!>
!> With A V = W, V orthogonal and the columns of W orthogonal to each other, by rotations of two at a time (M. R. Hestenes, J. SIAM
!> 6, 1958, 51-90), x_1 is the sum of v (w . b_1)/(w . w) over the columns w that do not vanish. Those v whose w vanish, N, leave
!> the force; along N y the moment is a problem of the same kind, and x_1 and N y are at right angles.
module gestell_study_balance_least_squares
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: unit_matrix
  implicit none (type, external)
  private

  !> A V = W: W, V, and which columns of W do not vanish.
  type :: singular_type
    real(dp), allocatable :: w(:, :), v(:, :)
    logical, allocatable :: counts(:)
  contains
    procedure :: decompose
    procedure :: shortest
  end type singular_type

  type, public :: least_squares_type
    private
    type(singular_type) :: force, moment
    real(dp), allocatable :: of_moment(:, :), free(:, :)
    !> Of the rows.
    integer, allocatable :: kinds(:)
  contains
    procedure :: prepare
    procedure :: solve
  end type least_squares_type

contains

  !> The effects of the unknowns, shape (rows, angles, unknowns), rows of `kinds` 1: a force, 2: a moment.
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

  !> The unknowns, two by two as complex numbers, for what is `wanted` of the rows, shape (rows, angles).
  pure subroutine solve(self, wanted, u)
    class(least_squares_type), intent(in) :: self
    real(dp), intent(in) :: wanted(:, :)
    complex(dp), intent(out) :: u(:)
    real(dp) :: x(2 * size(u))

    x = self%force%shortest(row_of(wanted, self%kinds, 1))
    x = x + matmul(self%free, self%moment%shortest(row_of(wanted, self%kinds, 2) - matmul(self%of_moment, x)))
    u = cmplx(x(1::2), x(2::2), dp)
  end subroutine solve

  !> Rows of a kind over all angles, a column an unknown.
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

  !> Columns of W count beside the longest of A, or beside `size_of_all`.
  pure subroutine decompose(self, a, size_of_all)
    class(singular_type), intent(inout) :: self
    real(dp), intent(in) :: a(:, :)
    real(dp), intent(in), optional :: size_of_all
    integer, parameter :: most = 60
    real(dp), parameter :: dependent = 1.0e-8_dp, orthogonal = 1.0e-14_dp
    real(dp) :: longest, lengths(2), product, angle
    logical :: turned
    integer :: j, k, n, sweep

    n = size(a, 2)
    self%w = a
    self%v = unit_matrix(n)
    longest = maxval([0.0_dp, norm2(a, dim=1)])
    if (present(size_of_all)) longest = size_of_all
    do sweep = 1, most
      turned = .false.
      do k = 2, n
        do j = 1, k - 1
          lengths = [norm2(self%w(:, j)), norm2(self%w(:, k))]
          ! beside what is rounding of the longest no direction is known
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

  !> The x of least squares among those by which the square of A x - b is least.
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
