!> Sums of products in eight lanes side by side, as in gestell_math_lanes.
module gestell_math_lanes_products
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: vector_length
  use gestell_math_lanes_versions, only: four_columns
  use gestell_math_lanes, only: lanes
  implicit none (type, external)
  private

  public :: combine, in_fours, multiply

contains

  !> The next multiple of four.
  pure integer function in_fours(n)
    integer, intent(in) :: n

    in_fours = 4 * ((n + 3) / 4)
  end function in_fours

  !> values(lane, j) = sum over k = 1 ... n of factors(lane, k) terms(k, j), j = 1 ... numbers, a multiple of four.
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

  !> C = factor A B, A of shape (lanes, n, n), B and C of (lanes, n, columns).
  pure subroutine multiply(n, columns, factor, a, b, c)
    integer, intent(in) :: n, columns
    real(dp), intent(in) :: factor, a(lanes, n, n), b(lanes, n, columns)
    real(dp), intent(out) :: c(lanes, n, columns)
    real(dp) :: s11, s21, s12, s22
    integer :: lane, i, j, k, i2, j2

    ! Two rows and two columns together; the last one stands beside itself where their number is odd.
    do j = 1, columns, 2
      j2 = min(j + 1, columns)
      do i = 1, n, 2
        i2 = min(i + 1, n)
        !GCC$ ivdep
        do lane = 1, lanes
          s11 = 0
          s21 = 0
          s12 = 0
          s22 = 0
          k = 1
          do
            s11 = s11 + a(lane, i, k) * b(lane, k, j)
            s21 = s21 + a(lane, i2, k) * b(lane, k, j)
            s12 = s12 + a(lane, i, k) * b(lane, k, j2)
            s22 = s22 + a(lane, i2, k) * b(lane, k, j2)
            k = k + 1
            if (k > n) exit
          end do
          c(lane, i, j) = factor * s11
          c(lane, i2, j) = factor * s21
          c(lane, i, j2) = factor * s12
          c(lane, i2, j2) = factor * s22
        end do
      end do
    end do
  end subroutine multiply

end module gestell_math_lanes_products
