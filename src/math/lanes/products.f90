!> Computes sums of products in eight lanes side by side, as in gestell_math_lanes.
module gestell_math_lanes_products
  use gestell_base_processor, only: has_versions, vector_length
  use gestell_math_lanes_versions, only: four_columns
  use gestell_math_lanes, only: lanes
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: combine, padded_to_four, multiply

contains

  !> Smallest multiple of four that is not below n.
  pure integer function padded_to_four(n)
    integer, intent(in) :: n

    padded_to_four = 4 * ((n + 3) / 4)
  end function padded_to_four

  !> Computes values(lane, j) = sum over k = 1 ... n of factors(lane, k) terms(k, j) for j = 1 ... numbers. `numbers` must be a
  !> multiple of four.
  pure subroutine combine(n, numbers, factors, terms, values)
    integer, intent(in) :: n, numbers
    real(dp), intent(in) :: factors(lanes, n), terms(n, numbers)
    real(dp), intent(inout) :: values(lanes, numbers)
    integer :: length, j

    length = vector_length()
    do j = 1, numbers, 4
      call four_columns(length, n, factors, terms(1, j), values(1, j))
    end do
  end subroutine combine

  !> Body of `multiply`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine multiply_here(n, columns, factor, rows, b, c, once) bind(C, name="lanes_gestell_multiply")
    !$omp declare simd uniform(n, columns, factor, rows, b, c) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: n, columns, once
    real(dp), intent(in) :: factor, rows(lanes, columns, n), b(lanes, n, columns)
    real(dp), intent(inout) :: c(lanes, n, columns)
    real(dp) :: s11, s21, s31, s12, s22, s32, s13, s23, s33
    integer :: lane, i, j, k, i2, i3, j2, j3

    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    ! Three rows and three columns at a time, so that no sum waits for its own last addition. If fewer remain, the last one is
    ! computed repeatedly. A loop over lanes is vectorised only if the elements of the sum have a constant stride: therefore A
    ! is stored by rows.
    do i = 1, n, 3
      i2 = min(i + 1, n)
      i3 = min(i + 2, n)
      do j = 1, columns, 3
        j2 = min(j + 1, columns)
        j3 = min(j + 2, columns)
        !GCC$ ivdep
        do lane = 1, lanes
          s11 = 0
          s21 = 0
          s31 = 0
          s12 = 0
          s22 = 0
          s32 = 0
          s13 = 0
          s23 = 0
          s33 = 0
          k = 1
          do
            s11 = s11 + rows(lane, k, i) * b(lane, k, j)
            s21 = s21 + rows(lane, k, i2) * b(lane, k, j)
            s31 = s31 + rows(lane, k, i3) * b(lane, k, j)
            s12 = s12 + rows(lane, k, i) * b(lane, k, j2)
            s22 = s22 + rows(lane, k, i2) * b(lane, k, j2)
            s32 = s32 + rows(lane, k, i3) * b(lane, k, j2)
            s13 = s13 + rows(lane, k, i) * b(lane, k, j3)
            s23 = s23 + rows(lane, k, i2) * b(lane, k, j3)
            s33 = s33 + rows(lane, k, i3) * b(lane, k, j3)
            k = k + 1
            if (k > n) exit
          end do
          c(lane, i, j) = factor * s11
          c(lane, i2, j) = factor * s21
          c(lane, i3, j) = factor * s31
          c(lane, i, j2) = factor * s12
          c(lane, i2, j2) = factor * s22
          c(lane, i3, j2) = factor * s32
          c(lane, i, j3) = factor * s13
          c(lane, i2, j3) = factor * s23
          c(lane, i3, j3) = factor * s33
        end do
      end do
    end do
  end subroutine multiply_here

  !> Computes C = factor A B for matrices with `n` rows and columns. `rows`: rows of A, of which the first n elements are used,
  !> shape (lanes, columns, n). B and C have the shape (lanes, n, columns), columns >= n. `length`: number of double precision
  !> numbers in a vector register (gestell_base_processor).
  pure subroutine multiply(length, n, columns, factor, rows, b, c)
    integer, intent(in) :: length, n, columns
    real(dp), intent(in) :: factor, rows(lanes, columns, n), b(lanes, n, columns)
    real(dp), intent(out) :: c(lanes, n, columns)
    procedure(multiply_here), bind(C, name="_ZGVeN2uuuuuul_lanes_gestell_multiply") :: multiply_512
    procedure(multiply_here), bind(C, name="_ZGVdN2uuuuuul_lanes_gestell_multiply") :: multiply_256

    if (has_versions .and. length == 8) then
      call multiply_512(n, columns, factor, rows, b, c, 1)
    else if (has_versions .and. length == 4) then
      call multiply_256(n, columns, factor, rows, b, c, 1)
    else
      call multiply_here(n, columns, factor, rows, b, c, 1)
    end if
  end subroutine multiply

end module gestell_math_lanes_products
