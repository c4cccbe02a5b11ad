!> Fourier series of periodic functions from equidistant samples, and their maxima between the samples.
module gestell_math_series_fourier
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_math_dft, only: dft
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lanes_products, only: padded_to_four
  implicit none (type, external)
  private

  public :: find_candidates, find_series, fourier_series, largest_between, largest_value, transform_matrix

  !> Fourier series f(theta) = mean + sum_k amplitude(k) cos(k theta + phase(k)); theta runs from 0 to 2 pi over the period
  type, public :: fourier_type
    !> Mean of f
    real(dp) :: mean = 0
    !> `amplitude`: amplitudes of orders 1, 2, ..., never negative. `phase`: phases (rad) of these orders.
    real(dp), allocatable :: amplitude(:), phase(:)
  contains
    procedure :: value => series_value, rms, largest_term, tail, beyond, peak
  end type fourier_type

contains

  !> Returns the series that interpolates `samples` at theta = 2 pi (i - 1) / size(samples). It contains all orders below half the
  !> number of samples.
  pure type(fourier_type) function fourier_series(samples) result(series)
    real(dp), intent(in) :: samples(:)
    type(fourier_type) :: only(1)

    call find_series(reshape(samples, [1, size(samples)]), only)
    series = only(1)
  end function fourier_series

  !> Computes the series of several functions, as `fourier_series` does for one. `samples`: shape (functions, samples). Functions
  !> that are zero, such as the moments in pins, are not transformed.
  pure subroutine find_series(samples, series)
    real(dp), intent(in) :: samples(:, :)
    type(fourier_type), intent(out) :: series(:)
    !> Number of functions that are transformed together: few enough for the processor's cache
    integer, parameter :: together = 8
    real(dp), allocatable :: cosine(:, :), sine(:, :)
    integer, allocatable :: used(:)
    logical :: is_zero(size(series))
    integer :: first, last, orders, i, k

    orders = (size(samples, 2) - 1) / 2
    do k = 1, size(series)
      is_zero(k) = all(abs(samples(k, :)) <= 0)
      if (is_zero(k)) allocate(series(k)%amplitude(orders), series(k)%phase(orders), source=0.0_dp)
    end do
    used = pack([(k, k = 1, size(series))], .not. is_zero)
    do first = 1, size(used), together
      last = min(first + together - 1, size(used))
      allocate(cosine(first:last, orders), sine(first:last, orders))
      call transform(samples(used(first:last), :), cosine, sine)
      do i = first, last
        k = used(i)
        series(k)%mean = sum(samples(k, :)) / size(samples, 2)
        series(k)%amplitude = hypot(cosine(i, :), sine(i, :))
        series(k)%phase = atan2(-sine(i, :), cosine(i, :))
      end do
      deallocate(cosine, sine)
    end do
  end subroutine find_series

  !> Computes the Fourier coefficients of cos(k theta) and sin(k theta), k = 1 ... size(cosine, 2), from `samples`, n numbers x(j)
  !> of each function, shape (functions, n).
  !>
  !> If n is even, Z is the transform of the n / 2 numbers x(2m) + i x(2m + 1). The samples with even j have the transform
  !> E(k) = (Z(k) + conjg(Z(n/2 - k))) / 2, those with odd j O(k) = (Z(k) - conjg(Z(n/2 - k))) / 2i; that of all samples is
  !> E(k) + exp(-2 pi i k / n) O(k).
  pure subroutine transform(samples, cosine, sine)
    real(dp), intent(in) :: samples(:, :)
    real(dp), intent(out) :: cosine(:, :), sine(:, :)
    complex(dp), allocatable :: z(:, :)
    complex(dp) :: y(size(samples, 1)), mirrored(size(samples, 1))
    real(dp) :: c(size(cosine, 2)), s(size(cosine, 2))
    integer :: n, orders, k

    n = size(samples, 2)
    orders = size(cosine, 2)
    if (modulo(n, 2) == 0 .and. 2 * orders < n) then
      z = dft(cmplx(samples(:, 1::2), samples(:, 2::2), dp))
      call cosine_sine([(2 * pi * k / n, k = 1, orders)], c, s)
      do k = 1, orders
        mirrored = conjg(z(:, n / 2 - k + 1))
        ! -s - i c = exp(-2 pi i k / n) / i
        y = (z(:, k + 1) + mirrored) / 2 + cmplx(-s(k), -c(k), dp) * (z(:, k + 1) - mirrored) / 2
        cosine(:, k) = 2 * real(y) / n
        sine(:, k) = -2 * aimag(y) / n
      end do
    else
      z = dft(cmplx(samples, 0, dp))
      cosine = 2 * real(z(:, 2:orders + 1)) / n
      sine = -2 * aimag(z(:, 2:orders + 1)) / n
    end if
  end subroutine transform

  !> Matrix, shape (n, columns), by which n samples are multiplied to give their Fourier coefficients. The product samples * matrix
  !> contains the coefficients of cos(k theta), followed by those of sin(k theta). Columns of zeros are appended until the number of
  !> columns is a multiple of four.
  pure function transform_matrix(n) result(matrix)
    integer, intent(in) :: n
    real(dp), allocatable :: matrix(:, :)
    integer :: orders, k, i

    orders = (n - 1) / 2
    allocate(matrix(n, padded_to_four(2 * orders)), source=0.0_dp)
    do k = 1, orders
      ! Remove whole turns from the angles: they would lose digits.
      matrix(:, k) = [(cos(2 * pi * mod(k * i, n) / n), i = 0, n - 1)] * 2 / n
      matrix(:, orders + k) = [(sin(2 * pi * mod(k * i, n) / n), i = 0, n - 1)] * 2 / n
    end do
  end function transform_matrix

  !> Maximum of |f| over all theta, where f is the Fourier series that interpolates `samples`.
  pure real(dp) function largest_value(samples)
    real(dp), intent(in) :: samples(:)
    real(dp), dimension(1, (size(samples) - 1) / 2) :: cosine, sine

    call transform(reshape(samples, [1, size(samples)]), cosine, sine)
    largest_value = largest_between(samples, cosine(1, :), sine(1, :))
  end function largest_value

  !> Value of the series at the angle theta with its first and second derivative, shape (3).
  pure function series_value(self, theta) result(f)
    class(fourier_type), intent(in) :: self
    real(dp), intent(in) :: theta
    real(dp) :: f(3)

    f = value(self%mean, self%amplitude * cos(self%phase), -self%amplitude * sin(self%phase), theta)
  end function series_value

  !> Value of a Fourier series at the angle theta with its first and second derivative, shape (3). The series is given by its mean
  !> and the coefficients of cos(k theta) and sin(k theta), which are computed by recurrence.
  pure function value(mean, cosine, sine, theta) result(f)
    real(dp), intent(in) :: mean, cosine(:), sine(:), theta
    real(dp) :: f(3), c, s, c1, s1, turned
    integer :: k

    f = [mean, 0.0_dp, 0.0_dp]
    c1 = cos(theta)
    s1 = sin(theta)
    c = 1
    s = 0
    do k = 1, size(cosine)
      turned = c * c1 - s * s1
      s = s * c1 + c * s1
      c = turned
      f(1) = f(1) + cosine(k) * c + sine(k) * s
      f(2) = f(2) + k * (sine(k) * c - cosine(k) * s)
      f(3) = f(3) - real(k, dp)**2 * (cosine(k) * c + sine(k) * s)
    end do
  end function value

  !> Root mean square (rms) of the series over theta, by Parseval's theorem.
  pure real(dp) function rms(self)
    class(fourier_type), intent(in) :: self

    rms = self%largest_term()
    ! Relative to the largest term: squares of small numbers underflow.
    if (rms > 0) rms = rms * sqrt((self%mean / rms)**2 + sum((self%amplitude / rms)**2) / 2)
  end function rms

  !> Largest absolute value among the mean and all amplitudes.
  pure real(dp) function largest_term(self)
    class(fourier_type), intent(in) :: self

    largest_term = max(abs(self%mean), maxval(self%amplitude))
  end function largest_term

  !> Largest amplitude in the upper third of the orders, relative to the largest amplitude of all orders. It is small if the samples
  !> resolve the function.
  pure real(dp) function tail(self)
    class(fourier_type), intent(in) :: self
    real(dp) :: maximum
    integer :: n

    n = size(self%amplitude)
    maximum = self%largest_term()
    tail = 0
    if (maximum > 0) tail = maxval(self%amplitude(n - n / 3 + 1:)) / maximum
  end function tail

  !> Estimated error of the series between the samples, caused by orders too high for the samples to resolve.
  !>
  !> It is four times the sum of the amplitudes in the upper third of the resolved orders. Twice this sum exceeds the sum of all
  !> unresolved amplitudes if amplitudes fall at least like 1/k^2. The other factor of two is needed because unresolved orders also
  !> appear as lower orders (aliasing).
  pure real(dp) function beyond(self)
    class(fourier_type), intent(in) :: self
    integer :: n

    n = size(self%amplitude)
    beyond = 4 * sum(self%amplitude(n - n / 3 + 1:))
  end function beyond

  !> Maximum of |f| over all theta; `samples` are the samples from which the series was computed.
  pure real(dp) function peak(self, samples)
    class(fourier_type), intent(in) :: self
    real(dp), intent(in) :: samples(:)

    peak = largest_between(samples, self%amplitude * cos(self%phase), -self%amplitude * sin(self%phase))
  end function peak

  !> Maximum of |f| over all theta, by solving f' = 0 near all samples that may be neighbours of the maximum. The highest orders
  !> are omitted if their amplitudes are rounding errors (below 4 epsilon / sqrt(samples) times the largest sample), because the
  !> factor k^2 in f'' would turn them into many false candidates.
  pure real(dp) function largest_between(samples, cosine, sine) result(peak)
    real(dp), intent(in) :: samples(:), cosine(:), sine(:)
    real(dp), parameter :: noise = 4 * epsilon(1.0_dp)
    real(dp), allocatable :: places(:)
    real(dp) :: highest, loss, mean, step
    integer :: i, k, n, orders

    n = size(samples)
    mean = sum(samples) / n
    highest = maxval(abs(samples))
    do orders = size(cosine), 1, -1
      if (hypot(cosine(orders), sine(orders)) > noise / sqrt(real(n, dp)) * highest) exit
    end do
    loss = (2 * pi / n)**2 / 8 * sum([(real(k, dp)**2 * hypot(cosine(k), sine(k)), k = 1, orders)])
    peak = highest
    if (loss <= epsilon(loss) * highest) return
    call find_candidates(samples, mean, cosine(:orders), sine(:orders), loss, places, step)
    do i = 1, size(places)
      peak = max(peak, refine_maximum(mean, cosine(:orders), sine(:orders), places(i), step))
    end do
  end function largest_between

  !> Finds the points close to which the maximum of |f| may lie. Within half a spacing of the maximum, |f| is smaller than the
  !> maximum by at most `loss` = spacing^2 max |f''| / 8.
  !>
  !> If all samples are nearly equal, such as those of a constant with rounding errors, all of them are candidates. If there are
  !> more than a few candidates, it is cheaper to evaluate f at a fraction of the spacing: `loss` falls with the square of the
  !> spacing, and a small `loss` rules out most candidates.
  pure subroutine find_candidates(samples, mean, cosine, sine, loss, places, step)
    !> `samples`: samples of f. `mean`: mean of f. `cosine`, `sine`: coefficients of cos(k theta) and sin(k theta). `loss`: maximum
    !> by which the largest sample can fall short of the maximum of |f|.
    real(dp), intent(in) :: samples(:), mean, cosine(:), sine(:), loss
    !> Values of theta (rad) close to which the maximum of |f| may lie
    real(dp), allocatable, intent(out) :: places(:)
    !> Spacing of theta (rad) between the points at which |f| was compared
    real(dp), intent(out) :: step
    !> If the number of candidates exceeds `few` times the new number of points per sample, f is evaluated at a spacing smaller by
    !> the factor `finer`. This is done at most twice.
    integer, parameter :: finer = 4, finest = finer**2, few = 8
    real(dp), allocatable :: f(:)
    complex(dp), allocatable :: c(:)
    integer :: divisor, i, n

    f = abs(samples)
    divisor = 1
    do
      n = size(f)
      step = 2 * pi / n
      places = pack([(step * (i - 1), i = 1, n)], f >= maxval(f) - loss / divisor**2 .and. f >= cshift(f, -1) &
        & .and. f >= cshift(f, 1))
      if (divisor == finest .or. size(places) <= few * finer * divisor) return
      divisor = finer * divisor
      c = spread((0.0_dp, 0.0_dp), 1, divisor * size(samples))
      c(:size(cosine) + 1) = [cmplx(mean, 0, dp), cmplx(cosine, sine, dp)]
      f = abs(real(dft(c)))
    end do
  end subroutine find_candidates

  !> Maximum of |f| near `start`. |f| must be at least as large at `start` as at the distance `step` on both sides. Newton's
  !> iteration for f' = 0 is confined to the interval from a point where |f| rises towards the maximum to a point beyond the
  !> maximum.
  pure real(dp) function refine_maximum(mean, cosine, sine, start, step)
    real(dp), intent(in) :: mean, cosine(:), sine(:), start, step
    real(dp) :: theta, rising, falling, f(3)
    integer :: iteration

    f = value(mean, cosine, sine, start)
    refine_maximum = abs(f(1))
    rising = start
    falling = start + sign(step, f(1) * f(2))
    theta = start
    do iteration = 1, 60
      if (.not. abs(f(2)) > epsilon(step) * abs(f(3))) return
      ! |f| is below the maximum by f'^2 / (2 |f''|): stop if this is no more than its rounding.
      if (f(1) * f(3) < 0 .and. f(2)**2 <= epsilon(step) * abs(f(1) * f(3))) return
      theta = theta - f(2) / merge(f(3), 1.0_dp, abs(f(3)) > 0)
      if (.not. (theta - rising) * (theta - falling) < 0) theta = (rising + falling) / 2
      f = value(mean, cosine, sine, theta)
      refine_maximum = max(refine_maximum, abs(f(1)))
      ! Does |f| rise here towards the point beyond the maximum?
      if (f(1) * f(2) * (falling - rising) > 0) then
        rising = theta
      else
        falling = theta
      end if
      if (.not. abs(falling - rising) > epsilon(step) * abs(theta)) return
    end do
  end function refine_maximum

end module gestell_math_series_fourier
