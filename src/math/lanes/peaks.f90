!> Computes maxima of periodic functions, eight functions together, by the method of gestell_math_series_fourier.
module gestell_math_lanes_peaks
  use gestell_base_kinds, only: dp, pi
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_math_lanes, only: lanes
  implicit none (type, external)
  private

  public :: largest_values

  !> Maximum number of Newton steps
  integer, parameter :: max_steps = 60

contains

  !> Computes max |f| of trigonometric polynomials by solving f' = 0 near all samples that may be neighbours of the maximum. Within
  !> half a spacing of the maximum, |f| is smaller than the maximum by at most spacing^2 max |f''| / 8. `samples` has the shape
  !> (lanes, n). The columns of `harmonics` are the coefficients of cos(k theta), k = 1 ... (n - 1) / 2, then those of sin(k theta);
  !> further columns are ignored.
  pure subroutine largest_values(samples, harmonics, maximum)
    real(dp), contiguous, intent(in) :: samples(:, :), harmonics(:, :)
    real(dp), intent(out) :: maximum(lanes)
    real(dp) :: size_at(lanes, 0:size(samples, 2) + 1)
    real(dp), dimension(lanes) :: mean, loss, least, at
    integer :: n, k, orders

    n = size(samples, 2)
    orders = (n - 1) / 2
    mean = 0
    maximum = 0
    do k = 1, n
      mean = mean + samples(:, k) / n
      size_at(:, k) = abs(samples(:, k))
      maximum = max(maximum, size_at(:, k))
    end do
    size_at(:, 0) = size_at(:, n)
    size_at(:, n + 1) = size_at(:, 1)
    loss = 0
    do k = 1, orders
      loss = loss + real(k, dp)**2 * (abs(harmonics(:, k)) + abs(harmonics(:, orders + k)))
    end do
    loss = loss * (2 * pi / n)**2 / 8
    ! Above all samples if |f| cannot be larger between them.
    least = maximum - merge(loss, -maximum, loss > epsilon(1.0_dp) * maximum)
    at = 0
    do
      call find_next(n, size_at, least, at)
      if (.not. any(at <= n)) exit
      call refine(n, mean, harmonics, at, maximum)
    end do
  end subroutine largest_values

  !> Finds, in every lane, the next sample after sample `at` whose absolute value is at least `least` and not below those of the
  !> two adjacent samples. If there is no such sample, `at` becomes n + 1.
  pure subroutine find_next(n, size_at, least, at)
    integer, intent(in) :: n
    real(dp), intent(in) :: size_at(lanes, 0:n + 1), least(lanes)
    real(dp), intent(inout) :: at(lanes)
    real(dp) :: next, here, place
    integer :: lane, i

    !GCC$ ivdep
    do lane = 1, lanes
      next = n + 1
      place = n
      i = n
      do
        here = merge(place, 0.0_dp, size_at(lane, i) >= max(least(lane), max(size_at(lane, i - 1), size_at(lane, i + 1))))
        next = merge(here, next, here > at(lane))
        place = place - 1
        i = i - 1
        if (i < 1) exit
      end do
      at(lane) = next
    end do
  end subroutine find_next

  !> Computes the maximum of |f| near each sample `at` at which |f| is not below its values at the two adjacent samples. Raises
  !> `maximum` to the result if the result is larger. Newton's iteration for f' = 0 is confined to an interval that contains the
  !> maximum of |f|. The iteration ends when the next step would raise |f| by less than the rounding error of |f|.
  pure subroutine refine(n, mean, harmonics, at, maximum)
    integer, intent(in) :: n
    real(dp), contiguous, intent(in) :: harmonics(:, :)
    real(dp), intent(in) :: mean(lanes), at(lanes)
    real(dp), intent(inout) :: maximum(lanes)
    real(dp), dimension(lanes) :: theta, rising, falling, f, f_d, f_dd
    logical :: moving(lanes)
    real(dp) :: next
    integer :: lane, step

    theta = 2 * pi / n * (at - 1)
    call evaluate((n - 1) / 2, mean, harmonics, theta, f, f_d, f_dd)
    rising = theta
    falling = theta + sign(2 * pi / n, f * f_d)
    moving = at <= n
    do step = 1, max_steps
      moving = moving .and. f_d**2 > epsilon(1.0_dp) * abs(f * f_dd)
      if (.not. any(moving)) exit
      do lane = 1, lanes
        next = theta(lane) - f_d(lane) / merge(f_dd(lane), 1.0_dp, abs(f_dd(lane)) > 0)
        if (.not. (next - rising(lane)) * (next - falling(lane)) < 0) next = (rising(lane) + falling(lane)) / 2
        if (moving(lane)) theta(lane) = next
      end do
      call evaluate((n - 1) / 2, mean, harmonics, theta, f, f_d, f_dd)
      maximum = merge(max(maximum, abs(f)), maximum, moving)
      ! Does |f| rise here towards the point beyond the maximum?
      where (f * f_d * (falling - rising) > 0)
        rising = theta
      else where
        falling = theta
      end where
      moving = moving .and. abs(falling - rising) > epsilon(1.0_dp) * abs(theta)
    end do
  end subroutine refine

  !> Computes f, df/dtheta and d2f/dtheta2 at the angles `theta`; cos(k theta) and sin(k theta) come from a recurrence.
  pure subroutine evaluate(orders, mean, harmonics, theta, f, f_d, f_dd)
    integer, intent(in) :: orders
    real(dp), intent(in) :: mean(lanes), harmonics(lanes, 2 * orders), theta(lanes)
    real(dp), dimension(lanes), intent(out) :: f, f_d, f_dd
    real(dp), dimension(lanes) :: c1, s1
    real(dp) :: order, c, s, turned, along, across, s0, s_1, s_2
    integer :: lane, k

    call cosine_sine(theta, c1, s1)
    !GCC$ ivdep
    do lane = 1, lanes
      s0 = mean(lane)
      s_1 = 0
      s_2 = 0
      order = 0
      c = 1
      s = 0
      k = 1
      do
        turned = c * c1(lane) - s * s1(lane)
        s = s * c1(lane) + c * s1(lane)
        c = turned
        order = order + 1
        along = harmonics(lane, k) * c + harmonics(lane, orders + k) * s
        across = harmonics(lane, orders + k) * c - harmonics(lane, k) * s
        s0 = s0 + along
        s_1 = s_1 + order * across
        s_2 = s_2 - order**2 * along
        k = k + 1
        if (k > orders) exit
      end do
      f(lane) = s0
      f_d(lane) = s_1
      f_dd(lane) = s_2
    end do
  end subroutine evaluate

end module gestell_math_lanes_peaks
