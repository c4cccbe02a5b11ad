!> Vectors and 3 x 3 matrices of space at a batch of phases, with the shapes (batch, 3) and (batch, 3, 3). The phases come first and
!> innermost in every loop, so that they run in the processor's vector registers.
!>
!> The cross product of a vector and a matrix is one of dyads: a x B has the columns a x b of B, so it is [a] B; A x b has the rows
!> a x b of A, so it is A [b]. Here [a] is the matrix of the cross product: [a] b = a x b.
module gestell_math_vectors
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: cross, cross_matrix, dot, element, in_batch, outer, scaled, steady, times, transposed, unit_matrix

  !> Number of phases in a batch.
  integer, parameter, public :: batch = 32

  !> 6 x 6 matrices for displacements u and rotations alpha, in blocks. The first letter of a block names its rows, the second its
  !> columns.
  type, public :: blocks_type
    real(dp), dimension(batch, 3, 3) :: uu, ua, au, aa
  end type blocks_type

  interface cross
    module procedure :: cross_vectors, cross_columns, cross_rows
  end interface

  interface cross_matrix
    module procedure :: matrices_of_cross
  end interface

  interface outer
    module procedure :: outer_products
  end interface

  !> Products of matrices with matrices and vectors.
  interface times
    module procedure :: matrix_matrix, matrix_vector
  end interface

  !> Vectors and matrices that are the same at all phases.
  interface steady
    module procedure :: steady_vector, steady_matrix
  end interface

  !> Products of a number for each phase with vectors and matrices.
  interface scaled
    module procedure :: scaled_vector, scaled_matrix
  end interface

  !> Components that follow each component of a vector in cyclic order.
  integer, parameter :: next(3) = [2, 3, 1], last(3) = [3, 1, 2]

contains

  !> Numbers of the phases in the batch that begins with phase `first` of `phases`. A batch that is not full repeats the last phase.
  pure function in_batch(first, phases) result(at)
    integer, intent(in) :: first, phases
    integer :: at(batch), k

    at = [(min(first + k, phases), k = 0, batch - 1)]
  end function in_batch

  !> Element (i, k) of 6 x 6 matrices.
  pure function element(blocks, i, k) result(a)
    type(blocks_type), intent(in) :: blocks
    integer, intent(in) :: i, k
    real(dp) :: a(batch)

    if (i <= 3 .and. k <= 3) a = blocks%uu(:, i, k)
    if (i <= 3 .and. k > 3) a = blocks%ua(:, i, k - 3)
    if (i > 3 .and. k <= 3) a = blocks%au(:, i - 3, k)
    if (i > 3 .and. k > 3) a = blocks%aa(:, i - 3, k - 3)
  end function element

  !> Dot product of a and b.
  pure function dot(a, b)
    real(dp), intent(in) :: a(batch, 3), b(batch, 3)
    real(dp) :: dot(batch)

    dot = a(:, 1) * b(:, 1) + a(:, 2) * b(:, 2) + a(:, 3) * b(:, 3)
  end function dot

  pure function cross_vectors(a, b) result(c)
    real(dp), intent(in) :: a(batch, 3), b(batch, 3)
    real(dp) :: c(batch, 3)

    c(:, 1) = a(:, 2) * b(:, 3) - a(:, 3) * b(:, 2)
    c(:, 2) = a(:, 3) * b(:, 1) - a(:, 1) * b(:, 3)
    c(:, 3) = a(:, 1) * b(:, 2) - a(:, 2) * b(:, 1)
  end function cross_vectors

  pure function cross_columns(a, b) result(c)
    real(dp), intent(in) :: a(batch, 3), b(batch, 3, 3)
    real(dp) :: c(batch, 3, 3)
    integer :: k

    do k = 1, 3
      c(:, 1, k) = a(:, 2) * b(:, 3, k) - a(:, 3) * b(:, 2, k)
      c(:, 2, k) = a(:, 3) * b(:, 1, k) - a(:, 1) * b(:, 3, k)
      c(:, 3, k) = a(:, 1) * b(:, 2, k) - a(:, 2) * b(:, 1, k)
    end do
  end function cross_columns

  pure function cross_rows(a, b) result(c)
    real(dp), intent(in) :: a(batch, 3, 3), b(batch, 3)
    real(dp) :: c(batch, 3, 3)
    integer :: i, k

    do k = 1, 3
      do i = 1, 3
        c(:, i, k) = a(:, i, next(k)) * b(:, last(k)) - a(:, i, last(k)) * b(:, next(k))
      end do
    end do
  end function cross_rows

  !> [a], the matrix of the cross product.
  pure function matrices_of_cross(a) result(c)
    real(dp), intent(in) :: a(batch, 3)
    real(dp) :: c(batch, 3, 3)
    integer :: k

    do k = 1, 3
      c(:, k, k) = 0
      c(:, last(k), next(k)) = a(:, k)
      c(:, next(k), last(k)) = -a(:, k)
    end do
  end function matrices_of_cross

  !> Outer product a b^T.
  pure function outer_products(a, b) result(c)
    real(dp), intent(in) :: a(batch, 3), b(batch, 3)
    real(dp) :: c(batch, 3, 3)
    integer :: i, k

    do k = 1, 3
      do i = 1, 3
        c(:, i, k) = a(:, i) * b(:, k)
      end do
    end do
  end function outer_products

  !> The matrix f 1.
  pure function unit_matrix(f) result(a)
    real(dp), intent(in) :: f(batch)
    real(dp) :: a(batch, 3, 3)
    integer :: k

    a = 0
    do k = 1, 3
      a(:, k, k) = f
    end do
  end function unit_matrix

  pure function transposed(a) result(c)
    real(dp), intent(in) :: a(batch, 3, 3)
    real(dp) :: c(batch, 3, 3)
    integer :: i, k

    do k = 1, 3
      do i = 1, 3
        c(:, i, k) = a(:, k, i)
      end do
    end do
  end function transposed

  pure function matrix_matrix(a, b) result(c)
    real(dp), intent(in) :: a(batch, 3, 3), b(batch, 3, 3)
    real(dp) :: c(batch, 3, 3)
    integer :: i, k

    do k = 1, 3
      do i = 1, 3
        c(:, i, k) = a(:, i, 1) * b(:, 1, k) + a(:, i, 2) * b(:, 2, k) + a(:, i, 3) * b(:, 3, k)
      end do
    end do
  end function matrix_matrix

  pure function matrix_vector(a, b) result(c)
    real(dp), intent(in) :: a(batch, 3, 3), b(batch, 3)
    real(dp) :: c(batch, 3)
    integer :: i

    do i = 1, 3
      c(:, i) = a(:, i, 1) * b(:, 1) + a(:, i, 2) * b(:, 2) + a(:, i, 3) * b(:, 3)
    end do
  end function matrix_vector

  pure function steady_vector(a) result(c)
    real(dp), intent(in) :: a(3)
    real(dp) :: c(batch, 3)
    integer :: i

    do i = 1, 3
      c(:, i) = a(i)
    end do
  end function steady_vector

  pure function steady_matrix(a) result(c)
    real(dp), intent(in) :: a(3, 3)
    real(dp) :: c(batch, 3, 3)
    integer :: i, k

    do k = 1, 3
      do i = 1, 3
        c(:, i, k) = a(i, k)
      end do
    end do
  end function steady_matrix

  pure function scaled_vector(f, a) result(c)
    real(dp), intent(in) :: f(batch), a(batch, 3)
    real(dp) :: c(batch, 3)
    integer :: i

    do i = 1, 3
      c(:, i) = f * a(:, i)
    end do
  end function scaled_vector

  pure function scaled_matrix(f, a) result(c)
    real(dp), intent(in) :: f(batch), a(batch, 3, 3)
    real(dp) :: c(batch, 3, 3)
    integer :: i, k

    do k = 1, 3
      do i = 1, 3
        c(:, i, k) = f * a(:, i, k)
      end do
    end do
  end function scaled_matrix

end module gestell_math_vectors
