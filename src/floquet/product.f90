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
    real(dp), contiguous, intent(inout) :: motion(:, :)
    logical, intent(out) :: fits
    real(dp), contiguous, intent(in), optional :: b(:, :)
    real(dp), intent(inout), optional :: reach
    real(dp) :: map(size(scale), size(scale) + 1)
    integer :: n, k

    n = size(scale)
    do k = 1, size(a, 3)
      map(:, :n) = a(:, :, k)
      map(:, n + 1) = 0
      if (present(b)) map(:, n + 1) = b(:, k)
      call apply(n, map, motion)
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
    ! [A b] of step k of all segments; the segments' maps as far as step k; the motion at their starts.
    real(dp) :: step(lanes, size(scale), size(scale) + 1, (size(a, 3) + lanes - 1) / lanes)
    real(dp) :: segment(lanes, size(scale), size(scale) + 1), start(lanes, size(scale))
    real(dp), dimension(size(scale), size(scale) + 1) :: now, map
    integer :: n, lane, k

    n = size(scale)
    call arrange(n, a, step, b)
    segment = step(:, :, :, 1)
    do k = 2, size(step, 4)
      call compose(n, step(:, :, :, k), segment)
      fits = small(n, segment)
      if (.not. fits) return
    end do

    now = motion
    do lane = 1, lanes
      start(lane, :) = now(:, n + 1)
      map = segment(lane, :, :)
      call apply(n, map, now)
      fits = maxval(abs(now)) < greatest
      if (.not. fits) return
    end do
    motion = now
    if (.not. present(reach)) return
    do k = 1, size(step, 4)
      call advance(n, step(:, :, :, k), start)
      reach = max(reach, greatest_norm(n, start, scale))
    end do
  end subroutine by_segments

  !> [A b] of the steps as shape (lanes, n, n + 1, length of a segment). Beyond the last step nothing moves.
  pure subroutine arrange(n, a, step, b)
    integer, intent(in) :: n
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), contiguous, intent(out) :: step(:, :, :, :)
    real(dp), contiguous, intent(in), optional :: b(:, :)
    integer :: length, lane, k, first, last, i

    length = size(step, 4)
    do lane = 1, lanes
      first = length * (lane - 1)
      last = max(0, min(length, size(a, 3) - first))
      do k = 1, last
        step(lane, :, :n, k) = a(:, :, first + k)
        step(lane, :, n + 1, k) = 0
        if (present(b)) step(lane, :, n + 1, k) = b(:, first + k)
      end do
      do k = last + 1, length
        step(lane, :, :, k) = 0
        do i = 1, n
          step(lane, i, i, k) = 1
        end do
      end do
    end do
  end subroutine arrange

  !> S <- A S, s <- A s + b in all lanes, for [S s] and [A b].
  pure subroutine compose(n, a, s)
    integer, intent(in) :: n
    real(dp), intent(in) :: a(lanes, n, n + 1)
    real(dp), intent(inout) :: s(lanes, n, n + 1)
    real(dp) :: old(lanes, n)
    integer :: i, j, k

    do j = 1, n + 1
      old = s(:, :, j)
      s(:, :, j) = 0
      if (j == n + 1) s(:, :, j) = a(:, :, j)
      do k = 1, n
        do i = 1, n
          s(:, i, j) = s(:, i, j) + a(:, i, k) * old(:, k)
        end do
      end do
    end do
  end subroutine compose

  !> The same of a single map.
  pure subroutine apply(n, a, s)
    integer, intent(in) :: n
    real(dp), intent(in) :: a(n, n + 1)
    real(dp), intent(inout) :: s(n, n + 1)
    real(dp) :: old(n)
    integer :: j, k

    do j = 1, n + 1
      old = s(:, j)
      s(:, j) = 0
      if (j == n + 1) s(:, j) = a(:, j)
      do k = 1, n
        s(:, j) = s(:, j) + a(:, k) * old(k)
      end do
    end do
  end subroutine apply

  !> x <- A x + b in all lanes.
  pure subroutine advance(n, a, x)
    integer, intent(in) :: n
    real(dp), intent(in) :: a(lanes, n, n + 1)
    real(dp), intent(inout) :: x(lanes, n)
    real(dp) :: old(lanes, n)
    integer :: i, k

    old = x
    x = a(:, :, n + 1)
    do k = 1, n
      do i = 1, n
        x(:, i) = x(:, i) + a(:, i, k) * old(:, k)
      end do
    end do
  end subroutine advance

  !> Whether all numbers are well within their range, sums over each lane at least. (Sums keep what is not a number,
  !> maxima lose it.)
  pure logical function small(n, s)
    integer, intent(in) :: n
    real(dp), intent(in) :: s(lanes, n, n + 1)
    real(dp) :: sums(lanes)
    integer :: i, j

    sums = 0
    do j = 1, n + 1
      do i = 1, n
        sums = sums + abs(s(:, i, j))
      end do
    end do
    small = all(sums < greatest)
  end function small

  !> Greatest norm of x / scale in a lane.
  pure real(dp) function greatest_norm(n, x, scale)
    integer, intent(in) :: n
    real(dp), intent(in) :: x(lanes, n), scale(n)
    real(dp) :: squares(lanes)
    integer :: i

    squares = 0
    do i = 1, n
      squares = squares + (x(:, i) / scale(i))**2
    end do
    greatest_norm = sqrt(maxval(squares))
  end function greatest_norm

end module gestell_floquet_product
