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
    real(dp), contiguous, intent(in) :: scale(:)
    real(dp), intent(inout) :: phi(:, :)
    logical, intent(out) :: fits
    real(dp), contiguous, intent(in), optional :: b(:, :)
    real(dp), intent(inout), optional :: xp(:), reach
    ! [Phi x_p], its columns in lanes too: column j in lane modulo(j - 1, lanes) + 1 of a group.
    real(dp) :: motion(lanes, size(scale), size(scale) / lanes + 1)
    integer :: j, n

    n = size(scale)
    motion = 0
    do j = 1, n
      motion(modulo(j - 1, lanes) + 1, :, (j - 1) / lanes + 1) = phi(:, j)
    end do
    if (present(xp)) motion(modulo(n, lanes) + 1, :, n / lanes + 1) = xp
    fits = size(a, 3) >= 2 * lanes
    if (fits) call by_segments(a, scale, motion, fits, b, reach)
    if (.not. fits) call one_by_one(a, scale, motion, fits, b, reach)
    do j = 1, n
      phi(:, j) = motion(modulo(j - 1, lanes) + 1, :, (j - 1) / lanes + 1)
    end do
    if (present(xp)) xp = motion(modulo(n, lanes) + 1, :, n / lanes + 1)
  end subroutine multiply_maps

  pure subroutine one_by_one(a, scale, motion, fits, b, reach)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), contiguous, intent(in) :: scale(:)
    real(dp), contiguous, intent(inout) :: motion(:, :, :)
    logical, intent(out) :: fits
    real(dp), contiguous, intent(in), optional :: b(:, :)
    real(dp), intent(inout), optional :: reach
    integer :: n, k

    n = size(scale)
    do k = 1, size(a, 3)
      call apply(n, a(:, :, k), motion)
      if (present(b)) motion(modulo(n, lanes) + 1, :, n / lanes + 1) = motion(modulo(n, lanes) + 1, :, n / lanes + 1) + b(:, k)
      fits = small(size(motion) / lanes, motion)
      if (.not. fits) return
      if (present(reach)) reach = max(reach, norm2(motion(modulo(n, lanes) + 1, :, n / lanes + 1) / scale))
    end do
  end subroutine one_by_one

  !> The same; where the product of a segment overflows nothing is done.
  pure subroutine by_segments(a, scale, motion, fits, b, reach)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), contiguous, intent(in) :: scale(:)
    real(dp), contiguous, intent(inout) :: motion(:, :, :)
    logical, intent(out) :: fits
    real(dp), contiguous, intent(in), optional :: b(:, :)
    real(dp), intent(inout), optional :: reach
    ! [A b] of step k of all segments; the segments' maps as far as step k; the motion at their starts.
    real(dp) :: step(lanes, size(scale), size(scale) + 1, (size(a, 3) + lanes - 1) / lanes)
    real(dp) :: segment(lanes, size(scale), size(scale) + 1), start(lanes, size(scale))
    real(dp) :: now(lanes, size(scale), size(motion, 3)), map(size(scale), size(scale) + 1)
    integer :: n, lane, group, forced, k

    n = size(scale)
    forced = modulo(n, lanes) + 1
    group = n / lanes + 1
    call arrange(n, a, step, b)
    segment = step(:, :, :, 1)
    do k = 2, size(step, 4)
      call compose(n, step(:, :, :, k), segment)
      fits = small(size(segment) / lanes, segment)
      if (.not. fits) return
    end do

    now = motion
    do lane = 1, lanes
      start(lane, :) = now(forced, :, group)
      map = segment(lane, :, :)
      call apply(n, map, now)
      if (present(b)) now(forced, :, group) = now(forced, :, group) + map(:, n + 1)
      fits = small(size(now) / lanes, now)
      if (.not. fits) return
    end do
    motion = now
    if (.not. present(reach)) return
    do k = 1, size(step, 4)
      call advance(n, step(:, :, :, k), .true., start)
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
    integer :: j

    do j = 1, n
      call advance(n, a, .false., s(:, :, j))
    end do
    call advance(n, a, .true., s(:, :, n + 1))
  end subroutine compose

  !> x <- A x, where `forced` x <- A x + b, in all lanes.
  pure subroutine advance(n, a, forced, x)
    integer, intent(in) :: n
    real(dp), intent(in) :: a(lanes, n, n + 1)
    logical, intent(in) :: forced
    real(dp), intent(inout) :: x(lanes, n)
    real(dp) :: old(lanes, n)
    integer :: lane, i, k

    old = x
    x = 0
    if (forced) x = a(:, :, n + 1)
    do k = 1, n
      do i = 1, n
        !GCC$ ivdep
        do lane = 1, lanes
          x(lane, i) = x(lane, i) + a(lane, i, k) * old(lane, k)
        end do
      end do
    end do
  end subroutine advance

  !> X <- A X for a single A, shape (n, n), and the columns of X in lanes.
  pure subroutine apply(n, a, x)
    integer, intent(in) :: n
    real(dp), intent(in) :: a(n, n)
    real(dp), contiguous, intent(inout) :: x(:, :, :)
    real(dp) :: old(lanes, n)
    integer :: lane, group, i, k

    do group = 1, size(x, 3)
      old = x(:, :, group)
      x(:, :, group) = 0
      do k = 1, n
        do i = 1, n
          !GCC$ ivdep
          do lane = 1, lanes
            x(lane, i, group) = x(lane, i, group) + a(i, k) * old(lane, k)
          end do
        end do
      end do
    end do
  end subroutine apply

  !> Whether all of `count` times `lanes` numbers are well within their range, and are numbers: sums keep what is none,
  !> maxima lose it.
  pure logical function small(count, x)
    integer, intent(in) :: count
    real(dp), intent(in) :: x(lanes, count)
    real(dp) :: sums(lanes)
    integer :: lane, i

    sums = 0
    do i = 1, count
      !GCC$ ivdep
      do lane = 1, lanes
        sums(lane) = sums(lane) + abs(x(lane, i))
      end do
    end do
    small = all(sums < greatest)
  end function small

  !> Greatest norm of x / scale in a lane.
  pure real(dp) function greatest_norm(n, x, scale)
    integer, intent(in) :: n
    real(dp), intent(in) :: x(lanes, n), scale(n)
    real(dp) :: y(lanes, n), squares(lanes)
    integer :: lane, i

    squares = 0
    do i = 1, n
      !GCC$ ivdep
      do lane = 1, lanes
        y(lane, i) = x(lane, i) / scale(i)
      end do
    end do
    if (.not. small(n, y)) then
      greatest_norm = maxval(norm2(y, dim=2))
      return
    end if
    do i = 1, n
      !GCC$ ivdep
      do lane = 1, lanes
        squares(lane) = squares(lane) + y(lane, i)**2
      end do
    end do
    greatest_norm = sqrt(maxval(squares))
  end function greatest_norm

end module gestell_floquet_product
