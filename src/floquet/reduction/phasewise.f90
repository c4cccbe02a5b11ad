!> Computes products and inverses of small matrices at many phases of the period at once. The phase is the first index of every
!> array and the innermost loop: the numbers of several phases fill a vector register of the processor, and no phase costs a
!> procedure call or memory of its own.
module gestell_floquet_reduction_phasewise
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: vector_length
  use gestell_math_lanes_versions, only: four_columns
  use gestell_math_lapack, only: factorise, inverse, solve_factored
  implicit none (type, external)
  private

  public :: along_phases, inverses, lanes, multiply, solve, times

  !> Number of phases that are treated together: eight numbers of 64 bits fill the widest vector registers.
  integer, parameter :: lanes = 8

  !> Computes c = a b at every phase. A factor that has no index for the phase is constant. Shapes: matrices (phases, n, n), vectors
  !> (phases, n).
  interface multiply
    procedure matrices_matrices, matrix_matrices, matrices_matrix, matrices_vectors, matrix_vectors
  end interface multiply

contains

  !> Computes c = a b at every phase, where matrices `a` and `b` both vary with the phase.
  pure subroutine matrices_matrices(a, b, c)
    real(dp), contiguous, intent(in) :: a(:, :, :), b(:, :, :)
    real(dp), contiguous, intent(out) :: c(:, :, :)
    integer :: j

    do j = 1, size(b, 3)
      call matrices_vectors(a, b(:, :, j), c(:, :, j))
    end do
  end subroutine matrices_matrices

  !> Computes c = a b at every phase, where matrix `a` and vector `b` both vary with the phase.
  pure subroutine matrices_vectors(a, b, c)
    real(dp), contiguous, intent(in) :: a(:, :, :), b(:, :)
    real(dp), contiguous, intent(out) :: c(:, :)
    real(dp) :: total(lanes)
    integer :: i, k, l, block

    do i = 1, size(c, 2)
      do block = 0, size(c, 1) - lanes, lanes
        total = 0
        do k = 1, size(b, 2)
          do l = 1, lanes
            total(l) = total(l) + a(block + l, i, k) * b(block + l, k)
          end do
        end do
        do l = 1, lanes
          c(block + l, i) = total(l)
        end do
      end do
      do l = size(c, 1) - modulo(size(c, 1), lanes) + 1, size(c, 1)
        c(l, i) = dot_product(a(l, i, :), b(l, :))
      end do
    end do
  end subroutine matrices_vectors

  !> Computes c = a b at every phase for a constant matrix `a` and a matrix `b` that varies with the phase.
  pure subroutine matrix_matrices(a, b, c)
    real(dp), contiguous, intent(in) :: a(:, :), b(:, :, :)
    real(dp), contiguous, intent(out) :: c(:, :, :)
    integer :: j

    do j = 1, size(b, 3)
      call matrix_vectors(a, b(:, :, j), c(:, :, j))
    end do
  end subroutine matrix_matrices

  !> Computes c = a b at every phase for a constant matrix `a` and a vector `b` that varies with the phase.
  pure subroutine matrix_vectors(a, b, c)
    real(dp), contiguous, intent(in) :: a(:, :), b(:, :)
    real(dp), contiguous, intent(out) :: c(:, :)
    real(dp) :: transposed(size(a, 2), size(a, 1))

    transposed = transpose(a)
    call times(b, transposed, c)
  end subroutine matrix_vectors

  !> Computes c = a b at every phase for a matrix `a` that varies with the phase and a constant matrix `b`.
  pure subroutine matrices_matrix(a, b, c)
    real(dp), contiguous, intent(in) :: a(:, :, :), b(:, :)
    real(dp), contiguous, intent(out) :: c(:, :, :)

    call columns_times(size(a, 1) * size(a, 2), size(b, 1), size(b, 2), a, b, c)
  end subroutine matrices_matrix

  !> Computes the matrix product c = a b, where `a` has many rows.
  pure subroutine times(a, b, c)
    real(dp), contiguous, intent(in) :: a(:, :), b(:, :)
    real(dp), contiguous, intent(out) :: c(:, :)

    call columns_times(size(a, 1), size(a, 2), size(b, 2), a, b, c)
  end subroutine times

  !> Treats each matrix element as a function of the phase and multiplies its values by the matrix `operator`, shape (points,
  !> phases). `results` has the shape (points, n, n).
  pure subroutine along_phases(operator, values, results)
    real(dp), contiguous, intent(in) :: operator(:, :), values(:, :, :)
    real(dp), contiguous, intent(out) :: results(:, :, :)

    call columns_times(size(operator, 1), size(operator, 2), size(values, 2) * size(values, 3), operator, values, results)
  end subroutine along_phases

  !> Computes the matrix product c = a b. The inner loop treats four columns together.
  pure subroutine columns_times(rows, inner, columns, a, b, c)
    integer, intent(in) :: rows, inner, columns
    real(dp), intent(in) :: a(rows, inner), b(inner, columns)
    real(dp), intent(out) :: c(rows, columns)
    real(dp) :: of_block(lanes, inner), four(lanes, 4)
    integer :: j, k, l, block, length

    length = vector_length()
    do block = 0, rows - lanes, lanes
      of_block = a(block + 1:block + lanes, :)
      do j = 1, columns - 3, 4
        call four_columns(length, inner, of_block, b(1, j), four)
        c(block + 1:block + lanes, j:j + 3) = four
      end do
    end do
    do l = rows - modulo(rows, lanes) + 1, rows
      do j = 1, columns - modulo(columns, 4)
        c(l, j) = dot_product(a(l, :), b(:, j))
      end do
    end do
    do j = columns - modulo(columns, 4) + 1, columns
      c(:, j) = 0
      do k = 1, inner
        c(:, j) = c(:, j) + a(:, k) * b(k, j)
      end do
    end do
  end subroutine columns_times

  !> Computes the inverses of the matrices `a`, shape (phases, n, n), at all phases by elimination without pivoting. If the matrices
  !> are close to the unit matrix, this is as accurate as elimination with pivoting. At phases where elimination loses digits, the
  !> inverse is computed again by LAPACK. Fails if `a` is singular at some phase.
  subroutine inverses(a, inverted, error)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), contiguous, intent(out) :: inverted(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: exact = 1.0e3_dp * epsilon(1.0_dp)
    real(dp), allocatable :: product(:, :, :), defect(:), one(:, :)
    real(dp) :: some(lanes, size(a, 2), size(a, 2))
    integer :: n, first, last, i, k

    n = size(a, 2)
    do first = 1, size(a, 1), lanes
      last = min(first + lanes - 1, size(a, 1))
      some(:last - first + 1, :, :) = a(first:last, :, :)
      some(last - first + 2:, :, :) = 1
      call gauss_jordan(n, some)
      inverted(first:last, :, :) = some(:last - first + 1, :, :)
    end do
    allocate(product, mold=a)
    call multiply(a, inverted, product)
    allocate(defect(size(a, 1)), source=0.0_dp)
    do k = 1, n
      product(:, k, k) = product(:, k, k) - 1
      do i = 1, n
        ! NaN propagates through a sum.
        defect = defect + abs(product(:, i, k))
      end do
    end do
    if (all(defect <= exact)) return
    do k = 1, size(a, 1)
      if (defect(k) <= exact) cycle
      call inverse(a(k, :, :), one, error)
      if (allocated(error)) return
      inverted(k, :, :) = one
    end do
  end subroutine inverses

  !> Solves `operator` x = `right` at all phases and overwrites `right` with x; shapes (phases, n, n), (phases, n). Elimination uses
  !> the diagonal elements as pivots. At phases where elimination loses digits, x is computed again by LAPACK. Fails if `operator`
  !> is singular at some phase.
  subroutine solve(operator, right, error)
    real(dp), contiguous, intent(in) :: operator(:, :, :)
    real(dp), contiguous, intent(inout) :: right(:, :)
    type(error_type), allocatable, intent(out) :: error
    !> Maximum residual relative to the sum of the magnitudes of its terms. LAPACK solves the equations of a phase again if its
    !> residual is larger.
    real(dp), parameter :: exact = 1.0e3_dp * epsilon(1.0_dp)
    real(dp) :: some(lanes, size(right, 2), size(right, 2) + 1), x(lanes, size(right, 2)), left(lanes), size_of(lanes)
    real(dp) :: lu(size(right, 2), size(right, 2)), one(size(right, 2), 1)
    integer :: pivots(size(right, 2)), n, first, last, k

    n = size(right, 2)
    do first = 1, size(right, 1), lanes
      last = min(first + lanes - 1, size(right, 1))
      some(:last - first + 1, :, :n) = operator(first:last, :, :)
      some(:last - first + 1, :, n + 1) = right(first:last, :)
      some(last - first + 2:, :, :) = 1
      call solve_in_lanes(n, some, x)
      call find_residuals(n, operator(first:last, :, :), right(first:last, :), x(:last - first + 1, :), &
        & left(:last - first + 1), size_of(:last - first + 1))
      do k = first, last
        if (left(k - first + 1) <= exact * size_of(k - first + 1)) then
          right(k, :) = x(k - first + 1, :)
        else
          lu = operator(k, :, :)
          call factorise(lu, pivots, error)
          if (allocated(error)) return
          one(:, 1) = right(k, :)
          call solve_factored(lu, pivots, one)
          right(k, :) = one(:, 1)
        end if
      end do
    end do
  end subroutine solve

  !> Computes two sums over the equations at each phase: `left`, the sum of the residuals |A x - b|, and `size_of`, the sum of
  !> |A| |x| + |b|.
  pure subroutine find_residuals(n, a, b, x, left, size_of)
    integer, intent(in) :: n
    real(dp), intent(in) :: a(:, :, :), b(:, :), x(:, :)
    real(dp), intent(out) :: left(:), size_of(:)
    real(dp) :: missed(size(left), n)
    integer :: i, k

    missed = -b
    size_of = sum(abs(b), dim=2)
    do k = 1, n
      do i = 1, n
        missed(:, i) = missed(:, i) + a(:, i, k) * x(:, k)
        size_of = size_of + abs(a(:, i, k) * x(:, k))
      end do
    end do
    left = sum(abs(missed), dim=2)
  end subroutine find_residuals

  !> Solves A x = b in each lane for w = [A b], shape (lanes, n, n + 1). Overwrites w.
  pure subroutine solve_in_lanes(n, w, x)
    integer, intent(in) :: n
    real(dp), intent(inout) :: w(lanes, n, n + 1)
    real(dp), intent(out) :: x(lanes, n)
    real(dp) :: reciprocal(lanes)
    integer :: i, j, k

    do k = 1, n
      reciprocal = 1 / pivot_of(w(:, k, k))
      do j = k + 1, n + 1
        w(:, k, j) = w(:, k, j) * reciprocal
        do i = k + 1, n
          w(:, i, j) = w(:, i, j) - w(:, i, k) * w(:, k, j)
        end do
      end do
    end do
    x = w(:, :, n + 1)
    do k = n, 2, -1
      do i = 1, k - 1
        x(:, i) = x(:, i) - w(:, i, k) * x(:, k)
      end do
    end do
  end subroutine solve_in_lanes

  !> The pivot, or 1 if the pivot is nearly zero. After such a pivot the result of elimination is useless, but dividing by 1 avoids
  !> overflow.
  elemental real(dp) function pivot_of(value) result(pivot)
    real(dp), intent(in) :: value
    real(dp), parameter :: least = 1.0e-6_dp

    pivot = merge(value, 1.0_dp, abs(value) > least)
  end function pivot_of

  !> Replaces the matrices w by their inverses, by Gauss-Jordan elimination that uses the diagonal elements as pivots.
  pure subroutine gauss_jordan(n, w)
    integer, intent(in) :: n
    real(dp), intent(inout) :: w(lanes, n, n)
    real(dp) :: reciprocal(lanes), factor(lanes)
    integer :: i, j, k

    do k = 1, n
      reciprocal = 1 / pivot_of(w(:, k, k))
      w(:, k, k) = 1
      do j = 1, n
        w(:, k, j) = w(:, k, j) * reciprocal
      end do
      do i = 1, n
        if (i == k) cycle
        factor = w(:, i, k)
        w(:, i, k) = 0
        do j = 1, n
          w(:, i, j) = w(:, i, j) - factor * w(:, k, j)
        end do
      end do
    end do
  end subroutine gauss_jordan

end module gestell_floquet_reduction_phasewise
