!> Periodic functions from equidistant samples: harmonics, and extremes between the samples.
module gestell_base_fourier
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: fourier_series

  !> f(theta) = mean + sum_k amplitude(k) cos(k theta + phase(k)), theta from 0 to 2 pi over the period.
  type, public :: fourier_type
    real(dp) :: mean = 0
    !> Orders 1, 2, ...; amplitudes are not negative, phases in rad.
    real(dp), allocatable :: amplitude(:), phase(:)
  contains
    procedure :: value => series_value
    procedure :: rms
    procedure :: tail
    procedure :: peak
  end type fourier_type

contains

  !> The series through `samples`, taken at theta = 2 pi (i - 1) / size(samples), of all orders below half their number.
  pure function fourier_series(samples) result(series)
    real(dp), intent(in) :: samples(:)
    type(fourier_type) :: series
    real(dp), allocatable :: cosine(:), sine(:)
    real(dp) :: c, s
    integer :: n, k, i, at

    n = size(samples)
    allocate(cosine(0:n - 1), sine(0:n - 1), series%amplitude((n - 1) / 2), series%phase((n - 1) / 2))
    do i = 0, n - 1
      cosine(i) = cos(2 * pi * i / n)
      sine(i) = sin(2 * pi * i / n)
    end do
    series%mean = sum(samples) / n
    do k = 1, size(series%amplitude)
      c = 0
      s = 0
      at = 0
      do i = 1, n
        c = c + samples(i) * cosine(at)
        s = s - samples(i) * sine(at)
        at = at + k
        if (at >= n) at = at - n
      end do
      series%amplitude(k) = 2 * hypot(c, s) / n
      series%phase(k) = atan2(s, c)
    end do
  end function fourier_series

  !> f at theta, and with it its first and second derivative.
  pure function series_value(self, theta) result(f)
    class(fourier_type), intent(in) :: self
    real(dp), intent(in) :: theta
    real(dp) :: f(3)
    real(dp) :: c, s
    integer :: k

    f = [self%mean, 0.0_dp, 0.0_dp]
    do k = 1, size(self%amplitude)
      c = self%amplitude(k) * cos(k * theta + self%phase(k))
      s = self%amplitude(k) * sin(k * theta + self%phase(k))
      f = f + [c, -k * s, -real(k, dp)**2 * c]
    end do
  end function series_value

  !> Root of the mean square, by Parseval's theorem.
  pure real(dp) function rms(self)
    class(fourier_type), intent(in) :: self

    rms = sqrt(self%mean**2 + sum(self%amplitude**2) / 2)
  end function rms

  !> The greatest amplitude in the upper third of the orders relative to the greatest of all: small where the samples
  !> resolve the function.
  pure real(dp) function tail(self)
    class(fourier_type), intent(in) :: self
    real(dp) :: greatest
    integer :: n

    n = size(self%amplitude)
    greatest = max(abs(self%mean), maxval(self%amplitude))
    tail = 0
    if (greatest > 0) tail = maxval(self%amplitude(n - n / 3 + 1:)) / greatest
  end function tail

  !> max |f|: Newton's iteration for f' = 0 from every one of the `samples` that the maximum can lie beside. Half a
  !> spacing away f has lost at most spacing^2 max |f''| / 8 of it.
  pure real(dp) function peak(self, samples)
    class(fourier_type), intent(in) :: self
    real(dp), intent(in) :: samples(:)
    real(dp) :: step, greatest, loss
    integer :: i, k, n

    n = size(samples)
    step = 2 * pi / n
    greatest = maxval(abs(samples))
    loss = step**2 / 8 * sum([(real(k, dp)**2 * self%amplitude(k), k = 1, size(self%amplitude))])
    peak = greatest
    if (loss <= epsilon(loss) * greatest) return
    do i = 1, n
      if (abs(samples(i)) < greatest - loss) cycle
      if (abs(samples(i)) < abs(samples(1 + modulo(i - 2, n))) .or. abs(samples(i)) < abs(samples(1 + modulo(i, n)))) cycle
      peak = max(peak, refined(self, step * (i - 1), step))
    end do
  end function peak

  !> The greatest |f| that Newton's iteration for f' = 0 meets within one `step` of `start`.
  pure real(dp) function refined(self, start, step)
    class(fourier_type), intent(in) :: self
    real(dp), intent(in) :: start, step
    real(dp) :: theta, f(3)
    integer :: iteration

    theta = start
    refined = 0
    do iteration = 1, 20
      f = self%value(theta)
      if (abs(theta - start) > step) return
      refined = max(refined, abs(f(1)))
      if (.not. abs(f(2)) < step * abs(f(3))) return
      theta = theta - f(2) / f(3)
      if (abs(f(2)) <= epsilon(step) * abs(f(3))) return
    end do
  end function refined

end module gestell_base_fourier
