!> How fast the fastest motion of a system turns in the mean.
!>
!> Where P is greatest P^16 is little but that motion: one of its columns, u, is the shape, one of its rows, l, that of P^T. At other
!> phases the shape is another, but by two-sided Rayleigh quotients with u and l the frequency is wrong by the product of what both
!> miss only (A. M. Ostrowski, doi:10.1007/BF00282291). With positions, of which u and l are, it is that of z^2 + 2 d z + k = 0,
!>
!>     k = l K u / l u,   2 d = l D u / l u,   K = M^-1 C,   D = M^-1 B,   w^2 = -Re z^2 = k - 2 d^2,
!>
!> without positions w^2 = -l P P u / l u. In a step of length h a method with s stages leaves a phase error c (w h)^(2 s + 1), one
!> that is fitted to a motion of frequency v (gestell_floquet_integrator_tableau) nearly c (w h)^(2 s - 1) (w^2 - v^2) h^2. In the sum
!> over a turn nothing is left of these where
!>
!>     v^2 = sum of w^(2 s + 1) / sum of w^(2 s - 1).
module gestell_floquet_period_pace
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: pace_of

contains

  !> v, radians in the unit of time, for eight stages, from P at many phases, shape (phases, n, n), and P^16 in units `scale` where it
  !> is greatest; half of the n states are positions, or none. 0: the motion does not turn.
  pure real(dp) function pace_of(p, power, scale, positions) result(pace)
    real(dp), contiguous, intent(in) :: p(:, :, :), power(:, :), scale(:)
    logical, intent(in) :: positions
    real(dp) :: square(size(p, 1)), damping(size(p, 1)), before(size(p, 1)), after(size(p, 1))
    real(dp) :: left(size(scale)), right(size(scale)), greatest
    integer :: m, i, j, row, column

    pace = 0
    m = size(scale)
    if (positions) m = m / 2
    call find_greatest(power(:m, :m), positions, row, column)
    right(:m) = power(:m, column) * scale(:m)
    left(:m) = power(row, :m) / scale(:m)
    greatest = dot_product(left(:m), right(:m))
    if (.not. abs(greatest) > tiny(greatest)) return
    left(:m) = left(:m) / greatest
    square = 0
    if (positions) then
      damping = 0
      do j = 1, m
        do i = 1, m
          square = square - left(i) * right(j) * p(:, m + i, j)
          damping = damping - left(i) * right(j) * p(:, m + i, m + j)
        end do
      end do
      square = square - damping**2 / 2
    else
      do j = 1, m
        before = 0
        after = 0
        do i = 1, m
          before = before + left(i) * p(:, i, j)
          after = after + p(:, j, i) * right(i)
        end do
        square = square - before * after
      end do
    end if
    greatest = maxval(square)
    if (.not. greatest > 0) return
    square = max(square / greatest, 0.0_dp)
    ! Of the squares the powers are halves.
    before = square**7 * sqrt(square)
    pace = sqrt(greatest * sum(before * square) / sum(before))
  end function pace_of

  !> Row and column of an element of P^16 that is great in both: the greatest one of positions, of other states the greatest on the
  !> diagonal.
  pure subroutine find_greatest(power, positions, row, column)
    real(dp), intent(in) :: power(:, :)
    logical, intent(in) :: positions
    integer, intent(out) :: row, column
    integer :: i, j

    row = 1
    column = 1
    do j = 1, size(power, 2)
      do i = 1, size(power, 1)
        if (i /= j .and. .not. positions) cycle
        if (.not. abs(power(i, j)) > abs(power(row, column))) cycle
        row = i
        column = j
      end do
    end do
  end subroutine find_greatest

end module gestell_floquet_period_pace
