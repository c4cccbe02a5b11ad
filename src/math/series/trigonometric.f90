!> Trigonometric polynomials: evaluates several functions and their derivatives at many phases.
module gestell_math_series_trigonometric
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_math_dft, only: dft
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: series_through

  !> Trigonometric polynomials f_j(theta) = sum over k of cosine(k, j) cos(k theta) + sine(k, j) sin(k theta), k = 0 ... K
  type, public :: series_type
    !> Coefficients of cos(k theta) and sin(k theta), k = 0 ... K; shapes (0:K, functions)
    real(dp), allocatable :: cosine(:, :), sine(:, :)
    !> Taylor coefficients of the functions in powers of K (theta - theta_p), where K is the highest order, about equidistant
    !> points theta_p = 2 pi p / size(taylor, 3); shape (0:terms, functions, 0:places - 1). Allocated by `tabulate`.
    real(dp), allocatable, private :: taylor(:, :, :)
  contains
    procedure :: tabulate, values, tail, beyond, trim => trim_series
  end type series_type

  !> Number of orders from which Taylor coefficients are used; with fewer orders, summing over the orders is cheaper.
  integer, parameter :: many_orders = 64
  !> `places_per_order`: number of expansion points per order. `terms`: highest power. With the highest order K, K times the
  !> distance of a phase from the nearest expansion point is at most z = pi / 4. So the truncation error in the second derivative
  !> of order K, z^(terms - 1) / (terms - 1)!, is below epsilon / 4.
  integer, parameter :: places_per_order = 4, terms = 18

contains

  !> Returns the series that interpolates `samples`, shape (samples, functions), at theta = 2 pi (i - 1) / size(samples, 1). It
  !> contains all orders below half the number of samples.
  pure type(series_type) function series_through(samples) result(series)
    real(dp), intent(in) :: samples(:, :)
    complex(dp) :: y(size(samples, 1))
    integer :: n, j, highest

    n = size(samples, 1)
    highest = (n - 1) / 2
    allocate(series%cosine(0:highest, size(samples, 2)), series%sine(0:highest, size(samples, 2)))
    do j = 1, size(samples, 2)
      y = dft(cmplx(samples(:, j), 0, dp))
      series%cosine(:, j) = 2 * real(y(:highest + 1)) / n
      series%sine(:, j) = -2 * aimag(y(:highest + 1)) / n
    end do
    series%cosine(0, :) = series%cosine(0, :) / 2
    series%sine(0, :) = 0
  end function series_through

  !> Computes the Taylor coefficients of a series of many orders. With them the cost of `values` per phase does not grow with the
  !> number of orders. Call this procedure again after changing the coefficients.
  pure subroutine tabulate(self)
    class(series_type), intent(inout) :: self
    complex(dp), allocatable :: z(:)
    complex(dp) :: turned
    real(dp) :: power
    integer :: orders, functions, places, n, j, k, p

    if (allocated(self%taylor)) deallocate(self%taylor)
    orders = ubound(self%cosine, 1)
    functions = size(self%cosine, 2)
    if (orders < many_orders) return
    places = 2**ceiling(log(real(places_per_order * orders, dp)) / log(2.0_dp))
    allocate(self%taylor(0:terms, functions, 0:places - 1))
    ! f = Re sum (a_k - i b_k) exp(i k theta). Two functions share a complex transform, one as its imaginary part. dft has the
    ! opposite sign of i, which reverses the order of the places.
    do n = 0, terms
      do j = 1, functions, 2
        allocate(z(places), source=(0.0_dp, 0.0_dp))
        do k = 0, orders
          ! (k / K)^n / n!
          power = 1
          do p = 1, n
            power = power * (real(k, dp) / orders) / p
          end do
          turned = power * (0.0_dp, 1.0_dp)**n * cmplx(self%cosine(k, j), -self%sine(k, j), dp)
          call add_order(z, k, turned, (1.0_dp, 0.0_dp))
          if (j == functions) cycle
          turned = power * (0.0_dp, 1.0_dp)**n * cmplx(self%cosine(k, j + 1), -self%sine(k, j + 1), dp)
          call add_order(z, k, turned, (0.0_dp, 1.0_dp))
        end do
        z = dft(z)
        do p = 0, places - 1
          self%taylor(n, j, p) = real(z(1 + modulo(-p, places)))
          if (j < functions) self%taylor(n, j + 1, p) = aimag(z(1 + modulo(-p, places)))
        end do
        deallocate(z)
      end do
    end do
  end subroutine tabulate

  !> Adds Re(c exp(i k theta)), times `unit`, to elements k and -k of a discrete Fourier transform.
  pure subroutine add_order(z, k, c, unit)
    complex(dp), intent(inout) :: z(0:)
    integer, intent(in) :: k
    complex(dp), intent(in) :: c, unit

    z(k) = z(k) + unit * c / 2
    z(modulo(-k, size(z))) = z(modulo(-k, size(z))) + unit * conjg(c) / 2
  end subroutine add_order

  !> Computes f, df/dtheta and d2f/dtheta2 at theta = 2 pi `phases`, each with the shape (phases, functions).
  pure subroutine values(self, phases, f, f_d, f_dd)
    class(series_type), intent(in) :: self
    !> Phases theta / (2 pi), shape (phases)
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: f(:, :), f_d(:, :), f_dd(:, :)

    if (allocated(self%taylor)) then
      call expand(self, phases, f, f_d, f_dd)
    else
      call add_up(self, phases, f, f_d, f_dd)
    end if
  end subroutine values

  !> Computes the values and derivatives from the Taylor coefficients at the nearest expansion point, by Horner's scheme.
  pure subroutine expand(self, phases, f, f_d, f_dd)
    class(series_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: f(:, :), f_d(:, :), f_dd(:, :)
    real(dp) :: phase, z, value, slope, bend
    integer :: orders, places, place, j, n, p

    orders = ubound(self%cosine, 1)
    places = size(self%taylor, 3)
    do p = 1, size(phases)
      phase = modulo(phases(p), 1.0_dp) * places
      place = nint(phase)
      z = 2 * pi * orders * (phase - place) / places
      place = modulo(place, places)
      do j = 1, size(self%cosine, 2)
        value = 0
        slope = 0
        bend = 0
        do n = terms, 0, -1
          bend = bend * z + slope
          slope = slope * z + value
          value = value * z + self%taylor(n, j, place)
        end do
        f(p, j) = value
        f_d(p, j) = slope * orders
        f_dd(p, j) = 2 * bend * real(orders, dp)**2
      end do
    end do
  end subroutine expand

  !> Computes the values and derivatives by summing over the orders; cos(k theta) and sin(k theta) come from a recurrence. Phases
  !> are processed in blocks that fit in the processor's first cache.
  pure subroutine add_up(self, phases, f, f_d, f_dd)
    class(series_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: f(:, :), f_d(:, :), f_dd(:, :)
    integer, parameter :: block = 64
    real(dp), dimension(block) :: c1, s1, c, s
    real(dp) :: turned, along, across
    integer :: first, n, k, j, p

    do first = 0, size(phases) - 1, block
      n = min(block, size(phases) - first)
      call cosine_sine(2 * pi * phases(first + 1:first + n), c1(:n), s1(:n))
      c = 1
      s = 0
      do j = 1, size(self%cosine, 2)
        f(first + 1:first + n, j) = self%cosine(0, j)
        f_d(first + 1:first + n, j) = 0
        f_dd(first + 1:first + n, j) = 0
      end do
      do k = 1, ubound(self%cosine, 1)
        do p = 1, n
          turned = c(p) * c1(p) - s(p) * s1(p)
          s(p) = s(p) * c1(p) + c(p) * s1(p)
          c(p) = turned
        end do
        do j = 1, size(self%cosine, 2)
          associate (a => self%cosine(k, j), b => self%sine(k, j))
            do p = 1, n
              along = a * c(p) + b * s(p)
              across = b * c(p) - a * s(p)
              f(first + p, j) = f(first + p, j) + along
              f_d(first + p, j) = f_d(first + p, j) + k * across
              f_dd(first + p, j) = f_dd(first + p, j) - real(k, dp)**2 * along
            end do
          end associate
        end do
      end do
    end do
  end subroutine add_up

  !> Largest amplitude of each function in the upper third of the orders, shape (functions). It estimates the error caused by
  !> unresolved orders.
  pure function tail(self)
    class(series_type), intent(in) :: self
    real(dp) :: tail(size(self%cosine, 2))
    integer :: highest

    highest = ubound(self%cosine, 1)
    associate (first => highest - highest / 3 + 1)
      tail = maxval(hypot(self%cosine(first:, :), self%sine(first:, :)), dim=1)
    end associate
  end function tail

  !> Estimate of the largest amplitude of each function above the highest order, shape (functions). The amplitudes above the highest
  !> order are assumed to be smaller than those of the last sixth of the orders by a factor of at most ten. The factor is the one by
  !> which the amplitudes fall from the second last sixth to the last sixth.
  pure function beyond(self)
    class(series_type), intent(in) :: self
    real(dp), parameter :: steepest = 0.1_dp
    real(dp) :: beyond(size(self%cosine, 2))
    real(dp), dimension(size(self%cosine, 2)) :: before, last
    integer :: highest

    highest = ubound(self%cosine, 1)
    associate (middle => highest - max(1, highest / 6), first => highest - max(2, highest / 3) + 1)
      before = maxval(hypot(self%cosine(first:middle, :), self%sine(first:middle, :)), dim=1)
      last = maxval(hypot(self%cosine(middle + 1:, :), self%sine(middle + 1:, :)), dim=1)
    end associate
    beyond = last * min(1.0_dp, max(steepest, last / max(before, tiny(before))))
  end function beyond

  !> Removes the highest orders if the amplitudes of all functions, divided by `units`, are below `least`: derivatives would amplify
  !> the rounding errors in these orders.
  pure subroutine trim_series(self, units, least)
    class(series_type), intent(inout) :: self
    real(dp), intent(in) :: units(:), least
    real(dp), allocatable :: shorter(:, :)
    integer :: k

    do k = ubound(self%cosine, 1), 1, -1
      if (any(hypot(self%cosine(k, :), self%sine(k, :)) > least * units)) exit
    end do
    allocate(shorter(0:k, size(units)), source=self%cosine(:k, :))
    call move_alloc(shorter, self%cosine)
    allocate(shorter(0:k, size(units)), source=self%sine(:k, :))
    call move_alloc(shorter, self%sine)
    if (allocated(self%taylor)) deallocate(self%taylor)
  end subroutine trim_series

end module gestell_math_series_trigonometric
