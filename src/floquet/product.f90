!> The product of the affine maps of many steps, x <- A_k x + b_k for k = 1 ... m.
!>
!> The steps are divided into eight segments of equal length that lie side by side in lanes (gestell_base_lanes): their
!> products are formed at the same time, and then they are few.
module gestell_floquet_product
  use gestell_base_kinds, only: dp
  use gestell_base_lanes, only: lanes
  implicit none (type, external)
  private

  public :: multiply_maps

  !> Beyond this the squares within a norm overflow.
  real(dp), parameter :: greatest = 1.0e150_dp

contains

  !> Applies the maps `a`, shape (n, n, steps), and where forced `b`, shape (n, steps), to `phi`, shape (n, n), and to `xp`,
  !> shape (n). `reach` becomes the greatest size that xp has on the way, in the norm of x / scale, if that is greater.
  !> `fits`: whether all numbers do.
  pure subroutine multiply_maps(a, scale, phi, fits, b, xp, reach)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), intent(in) :: scale(:)
    real(dp), intent(inout) :: phi(:, :)
    logical, intent(out) :: fits
    real(dp), contiguous, intent(in), optional :: b(:, :)
    real(dp), intent(inout), optional :: xp(:), reach
    real(dp), dimension(size(phi, 1), size(phi, 1) + 1) :: motion

    motion(:, :size(scale)) = phi
    motion(:, size(scale) + 1) = 0
    if (present(xp)) motion(:, size(scale) + 1) = xp
    fits = size(a, 3) >= 2 * lanes
    if (fits) call by_segments(a, scale, motion, fits, b, reach)
    if (.not. fits) call one_by_one(a, scale, motion, fits, b, reach)
    phi = motion(:, :size(scale))
    if (present(xp)) xp = motion(:, size(scale) + 1)
  end subroutine multiply_maps

  !> `motion`, shape (n, n + 1), is [Phi x_p].
  pure subroutine one_by_one(a, scale, motion, fits, b, reach)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), intent(in) :: scale(:)
    real(dp), intent(inout) :: motion(:, :)
    logical, intent(out) :: fits
    real(dp), contiguous, intent(in), optional :: b(:, :)
    real(dp), intent(inout), optional :: reach
    integer :: n, k

    n = size(scale)
    do k = 1, size(a, 3)
      motion = matmul(a(:, :, k), motion)
      if (present(b)) motion(:, n + 1) = motion(:, n + 1) + b(:, k)
      fits = maxval(abs(motion)) < greatest
      if (.not. fits) return
      if (present(reach)) reach = max(reach, norm2(motion(:, n + 1) / scale))
    end do
  end subroutine one_by_one

  !> The same; where the product of a segment overflows nothing is done.
  pure subroutine by_segments(a, scale, motion, fits, b, reach)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), intent(in) :: scale(:)
    real(dp), intent(inout) :: motion(:, :)
    logical, intent(out) :: fits
    real(dp), contiguous, intent(in), optional :: b(:, :)
    real(dp), intent(inout), optional :: reach
    ! A and b of step k of all segments; the segments' maps and solutions as far as step k; the motion at their starts.
    real(dp) :: step(lanes, size(scale), size(scale) + 1, (size(a, 3) + lanes - 1) / lanes)
    real(dp) :: segment(lanes, size(scale), size(scale) + 1), start(lanes, size(scale))
    real(dp), dimension(size(scale), size(scale) + 1) :: now
    integer :: n, length, lane, k

    n = size(scale)
    length = size(step, 4)
    do k = 1, length
      do lane = 1, lanes
        call take_step(length * (lane - 1) + k, step(lane, :, :, k))
      end do
    end do
    segment = step(:, :, :, 1)
    do k = 2, length
      call compose(n, step(:, :, :, k), segment)
      fits = maxval(abs(segment)) < greatest
      if (.not. fits) return
    end do

    now = motion
    do lane = 1, lanes
      start(lane, :) = now(:, n + 1)
      now = matmul(segment(lane, :, :n), now)
      now(:, n + 1) = now(:, n + 1) + segment(lane, :, n + 1)
      fits = maxval(abs(now)) < greatest
      if (.not. fits) return
    end do
    motion = now
    if (.not. present(reach)) return
    do k = 1, length
      call advance(n, step(:, :, :, k), start)
      reach = max(reach, sqrt(maxval(sum((start / spread(scale, 1, lanes))**2, dim=2))))
    end do

  contains

    !> [A b] of a step; beyond the last one nothing moves.
    pure subroutine take_step(number, map)
      integer, intent(in) :: number
      real(dp), intent(out) :: map(:, :)
      integer :: i

      map = 0
      if (number <= size(a, 3)) then
        map(:, :n) = a(:, :, number)
        if (present(b)) map(:, n + 1) = b(:, number)
      else
        do i = 1, n
          map(i, i) = 1
        end do
      end if
    end subroutine take_step

  end subroutine by_segments

  !> S <- A S, s <- A s + b in all lanes, for [S s] and [A b].
  pure subroutine compose(n, a, s)
    integer, intent(in) :: n
    real(dp), intent(in) :: a(lanes, n, n + 1)
    real(dp), intent(inout) :: s(lanes, n, n + 1)
    real(dp) :: sum(lanes, n)
    integer :: i, j, k

    do j = 1, n + 1
      sum = 0
      if (j == n + 1) sum = a(:, :, j)
      do k = 1, n
        do i = 1, n
          sum(:, i) = sum(:, i) + a(:, i, k) * s(:, k, j)
        end do
      end do
      s(:, :, j) = sum
    end do
  end subroutine compose

  !> x <- A x + b in all lanes.
  pure subroutine advance(n, a, x)
    integer, intent(in) :: n
    real(dp), intent(in) :: a(lanes, n, n + 1)
    real(dp), intent(inout) :: x(lanes, n)
    real(dp) :: next(lanes, n)
    integer :: i, k

    next = a(:, :, n + 1)
    do k = 1, n
      do i = 1, n
        next(:, i) = next(:, i) + a(:, i, k) * x(:, k)
      end do
    end do
    x = next
  end subroutine advance

end module gestell_floquet_product
