!> Computes peak, rms, crest factor and harmonics of a quantity over one period.
module gestell_study_vibration_statistics
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_math_series_fourier, only: fourier_type, largest_value
  use gestell_base_kinds, only: dp, pi
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_study_vibration, only: check_rows, vibration_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: band_rms, history_of, compute_minimum, compute_statistics, phase_of_maximum

  !> Statistics of one quantity over one period, in its unit.
  type, public :: statistics_type
    !> Fourier series of each component, shape (components). A signed quantity has one component; the magnitude of a vector has two
    !> or three
    type(fourier_type), allocatable :: series(:)
    !> `peak`: maximum of the absolute value over the period. `peak_error`: bound on the error of the peak. `error`: bound on the
    !> error at any time, which also bounds the error of `rms`
    real(dp) :: peak = 0, peak_error = 0, rms = 0, error = 0
    !> Phase t / T of the peak, from the vertex of the parabola through the largest sample and its two neighbours
    real(dp) :: peak_phase = 0
  contains
    procedure :: crest, amplitude, strongest, finite
  end type statistics_type

contains

  !> True if the peak, its error bound and the rms are finite.
  elemental logical function finite(self)
    class(statistics_type), intent(in) :: self

    finite = ieee_is_finite(self%peak) .and. ieee_is_finite(self%peak_error) .and. ieee_is_finite(self%rms)
  end function finite

  !> Computes peak, rms and harmonics of `quantity`. Fails if `quantity` is not initialised, or if `vibration` does not contain the
  !> rows of the motion from which the quantity is computed.
  subroutine compute_statistics(vibration, quantity, statistics, error)
    type(vibration_type), intent(in) :: vibration
    type(quantity_type), intent(in) :: quantity
    type(statistics_type), intent(out) :: statistics
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: samples(:, :)
    real(dp) :: between, error_along
    integer :: i, n

    call check_quantity(vibration, quantity, error)
    if (allocated(error)) return
    call components(quantity, vibration%motion, samples)
    allocate(statistics%series(size(samples, 2)))
    n = used_rows(quantity, vibration%motion)
    between = 0
    do i = 1, size(samples, 2)
      call combine(quantity%weights(:, i), vibration%motion_series, statistics%series(i))
      statistics%rms = hypot(statistics%rms, statistics%series(i)%rms())
      error_along = vibration%motion_errors%along(quantity%weights(:n, i))
      if (allocated(quantity%rounding)) error_along = error_along &
        & + sum(quantity%rounding(:n, i) * maxval(abs(vibration%motion(:n, :)), dim=2))
      statistics%error = hypot(statistics%error, error_along)
      between = hypot(between, statistics%series(i)%beyond())
    end do
    if (size(samples, 2) == 1) then
      statistics%peak = statistics%series(1)%peak(samples(:, 1))
      statistics%peak_phase = phase_of_maximum(abs(samples(:, 1)))
    else
      statistics%peak = largest_size(statistics%series, samples)
      statistics%peak_phase = phase_of_maximum(norm2(samples, dim=2))
    end if
    statistics%peak_error = statistics%error + between
  end subroutine compute_statistics

  !> Computes the minimum over the period of a quantity with one component, and a bound on the error of the minimum. Fails if
  !> `compute_statistics` fails.
  subroutine compute_minimum(vibration, quantity, least, min_error, error)
    type(vibration_type), intent(in) :: vibration
    type(quantity_type), intent(in) :: quantity
    real(dp), intent(out) :: least, min_error
    type(error_type), allocatable, intent(out) :: error
    type(statistics_type) :: statistics
    real(dp), allocatable :: samples(:, :)

    least = 0
    min_error = 0
    call compute_statistics(vibration, quantity, statistics, error)
    if (allocated(error)) return
    call components(quantity, vibration%motion, samples)
    ! The peak minus the quantity is nowhere negative. So the maximum of its absolute value is its maximum.
    least = statistics%peak - largest_value(statistics%peak - samples(:, 1))
    min_error = statistics%peak_error
  end subroutine compute_minimum

  !> Maximum of the magnitude of a vector, from the samples of its components, shape (samples, components), and from their Fourier
  !> series. The square of the magnitude contains orders up to twice the highest order of the components. If the upper half of the
  !> components' orders is not negligible, the square is therefore sampled twice as finely.
  pure real(dp) function largest_size(series, samples)
    type(fourier_type), intent(in) :: series(:)
    real(dp), intent(in) :: samples(:, :)
    real(dp), parameter :: counts = 1.0e-13_dp
    real(dp) :: fine(2 * size(samples, 1)), largest, upper
    integer :: i, n

    n = size(samples, 1)
    largest = max(maxval(abs(samples)), tiny(1.0_dp))
    upper = maxval([(max(0.0_dp, maxval(series(i)%amplitude(max(1, n / 4):))), i = 1, size(series))])
    if (upper <= counts * largest) then
      largest_size = largest * sqrt(largest_value(sum((samples / largest)**2, dim=2)))
      return
    end if
    fine(1::2) = sum((samples / largest)**2, dim=2)
    fine(2::2) = 0
    do i = 1, size(series)
      fine(2::2) = fine(2::2) + (half_way(series(i), n) / largest)**2
    end do
    largest_size = largest * sqrt(largest_value(fine))
  end function largest_size

  !> Values of a Fourier series midway between its n samples.
  pure function half_way(series, n) result(f)
    type(fourier_type), intent(in) :: series
    integer, intent(in) :: n
    real(dp) :: f(n)
    real(dp) :: c(0:n - 1), s(0:n - 1), along, across
    integer :: i, k, at

    call cosine_sine([(2 * pi * i / n, i = 0, n - 1)], c, s)
    f = series%mean
    do k = 1, size(series%amplitude)
      along = series%amplitude(k) * cos(series%phase(k) + pi * k / n)
      across = -series%amplitude(k) * sin(series%phase(k) + pi * k / n)
      at = 0
      do i = 1, n
        f(i) = f(i) + along * c(at) + across * s(at)
        at = at + k
        if (at >= n) at = at - n
      end do
    end do
  end function half_way

  !> Fourier series of a weighted sum of rows, computed from the series of the rows.
  pure subroutine combine(weights, rows, series)
    real(dp), intent(in) :: weights(:)
    type(fourier_type), intent(in) :: rows(:)
    type(fourier_type), intent(out) :: series
    complex(dp) :: c(size(rows(1)%amplitude))
    integer :: k

    k = min(size(rows), size(weights))
    if (count(abs(weights(:k)) > 0) == 1) then
      k = findloc(abs(weights(:k)) > 0, .true., dim=1)
      series = rows(k)
      series%mean = weights(k) * series%mean
      series%amplitude = abs(weights(k)) * series%amplitude
      if (weights(k) < 0) series%phase = series%phase - sign(pi, series%phase)
      return
    end if
    c = 0
    do k = 1, min(size(rows), size(weights))
      if (.not. abs(weights(k)) > 0) cycle
      series%mean = series%mean + weights(k) * rows(k)%mean
      c = c + weights(k) * rows(k)%amplitude * exp(cmplx(0.0_dp, rows(k)%phase, dp))
    end do
    series%amplitude = abs(c)
    series%phase = atan2(aimag(c), real(c))
  end subroutine combine

  !> Phase t / T, in [0, 1), of the maximum of a function given by equidistant samples over the period.
  pure real(dp) function phase_of_maximum(samples)
    real(dp), intent(in) :: samples(:)
    real(dp) :: before, after, bend
    integer :: i, n

    n = size(samples)
    i = maxloc(samples, dim=1)
    before = samples(i) - samples(1 + modulo(i - 2, n))
    after = samples(i) - samples(1 + modulo(i, n))
    bend = before + after
    phase_of_maximum = i - 1
    if (bend > 0) phase_of_maximum = phase_of_maximum + (before - after) / (2 * bend)
    phase_of_maximum = modulo(phase_of_maximum / n, 1.0_dp)
  end function phase_of_maximum

  !> Components of the quantity, computed from the samples of a motion, shape (samples, components). Most weights are zero.
  pure subroutine components(quantity, motion, samples)
    type(quantity_type), intent(in) :: quantity
    real(dp), intent(in) :: motion(:, :)
    real(dp), allocatable, intent(out) :: samples(:, :)
    integer :: i, k

    allocate(samples(size(motion, 2), size(quantity%weights, 2)), source=0.0_dp)
    do i = 1, size(samples, 2)
      do k = 1, used_rows(quantity, motion)
        if (abs(quantity%weights(k, i)) > 0) samples(:, i) = samples(:, i) + quantity%weights(k, i) * motion(k, :)
      end do
    end do
  end subroutine components

  !> Number of rows that the motion and the weights of a quantity have in common. Only joint forces have weights for the last rows.
  pure integer function used_rows(quantity, motion)
    type(quantity_type), intent(in) :: quantity
    real(dp), intent(in) :: motion(:, :)

    used_rows = min(size(motion, 1), size(quantity%weights, 1))
  end function used_rows

  !> Computes the quantity, or its magnitude if it is a vector, at the times of the history, shape (points + 1). Fails if
  !> `compute_statistics` fails.
  pure subroutine history_of(vibration, quantity, history, error)
    type(vibration_type), intent(in) :: vibration
    type(quantity_type), intent(in) :: quantity
    real(dp), allocatable, intent(out) :: history(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: samples(:, :)

    call check_quantity(vibration, quantity, error)
    if (allocated(error)) return
    call components(quantity, vibration%motion_history, samples)
    history = samples(:, 1)
    if (size(samples, 2) > 1) history = norm2(samples, dim=2)
  end subroutine history_of

  !> Checks that the quantity can be computed. Fails if `find_quantity` has not initialised the quantity, or if `vibration` lacks
  !> rows of the motion from which the quantity is computed.
  pure subroutine check_quantity(vibration, quantity, error)
    type(vibration_type), intent(in) :: vibration
    type(quantity_type), intent(in) :: quantity
    type(error_type), allocatable, intent(out) :: error

    if (allocated(quantity%weights)) then
      call check_rows(vibration, quantity%rows(), error)
    else
      call fatal_error(error, "call find_quantity or point_quantity first: the quantity is not initialised", invalid_input)
    end if
  end subroutine check_quantity

  !> Crest factor: peak divided by rms; 0 if nothing moves.
  pure real(dp) function crest(self)
    class(statistics_type), intent(in) :: self

    crest = 0
    if (self%rms > 0) crest = self%peak / self%rms
  end function crest

  !> Amplitude of an order (1, 2, ...) of the period. For a vector it is the root of the sum of the squares over the components. The
  !> amplitude is zero for orders that the samples do not resolve.
  pure real(dp) function amplitude(self, order)
    class(statistics_type), intent(in) :: self
    integer, intent(in) :: order
    integer :: i

    amplitude = 0
    do i = 1, size(self%series)
      if (order <= size(self%series(i)%amplitude)) amplitude = hypot(amplitude, self%series(i)%amplitude(order))
    end do
  end function amplitude

  !> Number of the order with the largest amplitude; 0 if nothing moves.
  pure integer function strongest(self)
    class(statistics_type), intent(in) :: self
    integer :: k

    strongest = maxloc([(self%amplitude(k), k = 1, size(self%series(1)%amplitude))], dim=1)
    if (.not. self%amplitude(strongest) > 0) strongest = 0
  end function strongest

  !> Computes the rms of all orders whose frequency, order / period, lies in `band`, both limits included. Fails if `statistics` is
  !> empty, if the period is not positive, or if the limits of the band are not ascending.
  pure subroutine band_rms(statistics, period, band, along, largest_direction, error)
    !> Statistics of the velocity of a probe
    type(statistics_type), intent(in) :: statistics
    !> Period (s), and lower and upper limit of the frequency band (Hz)
    real(dp), intent(in) :: period, band(2)
    !> `along`: rms of each component, shape (components). `largest_direction`: rms in the direction in which the rms is largest
    real(dp), intent(out) :: along(:), largest_direction
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: square(3, 3), unit
    complex(dp) :: c(3)
    real(dp), parameter :: rounding = 1.0e-12_dp
    integer :: k, i, n

    along = 0
    largest_direction = 0
    n = 0
    if (allocated(statistics%series)) n = size(statistics%series)
    if (n < 1 .or. n > 3 .or. size(along) /= n .or. .not. (period > 0 .and. band(1) <= band(2))) then
      call fatal_error(error, "a frequency band requires initialised statistics, a positive period, and a lower limit below " // &
        &   "the upper one", invalid_input)
      return
    end if
    ! Amplitudes are scaled first, because their squares would overflow long before their square roots do.
    unit = maxval([(maxval(statistics%series(i)%amplitude), i = 1, n)])
    if (.not. unit > 0) return
    square = 0
    c = 0
    do k = 1, size(statistics%series(1)%amplitude)
      if (k / period < band(1) * (1 - rounding) .or. k / period > band(2) * (1 + rounding)) cycle
      c(:n) = [(statistics%series(i)%amplitude(k) / unit * exp(cmplx(0, statistics%series(i)%phase(k), dp)), i = 1, n)]
      square = square + real(spread(c, 2, 3) * conjg(spread(c, 1, 3)), dp) / 2
    end do
    along = unit * [(sqrt(square(i, i)), i = 1, n)]
    ! In the plane: the larger eigenvalue of the symmetric 2 x 2 matrix.
    largest_direction = unit * sqrt((square(1, 1) + square(2, 2)) / 2 + hypot((square(1, 1) - square(2, 2)) / 2, square(1, 2)))
    if (n == 3) largest_direction = unit * sqrt(largest_eigenvalue(square))
  end subroutine band_rms

  !> Largest eigenvalue of a symmetric 3 x 3 matrix, by the trigonometric solution of its characteristic equation (O. K. Smith,
  !> Communications of the ACM 4, 1961, 168, doi 10.1145/355578.366316).
  pure real(dp) function largest_eigenvalue(a) result(largest_root)
    real(dp), intent(in) :: a(3, 3)
    real(dp) :: middle, p, b(3, 3), half_determinant
    integer :: i

    middle = (a(1, 1) + a(2, 2) + a(3, 3)) / 3
    b = a
    do i = 1, 3
      b(i, i) = b(i, i) - middle
    end do
    p = sqrt(sum(b**2) / 6)
    largest_root = middle
    if (.not. p > 0) return
    b = b / p
    half_determinant = (b(1, 1) * (b(2, 2) * b(3, 3) - b(2, 3)**2) - b(1, 2) * (b(1, 2) * b(3, 3) - b(2, 3) * b(1, 3)) &
      & + b(1, 3) * (b(1, 2) * b(2, 3) - b(2, 2) * b(1, 3))) / 2
    largest_root = middle + 2 * p * cos(acos(min(1.0_dp, max(-1.0_dp, half_determinant))) / 3)
  end function largest_eigenvalue

end module gestell_study_vibration_statistics
