!> Computes the periodic motion of M q'' + B q' + C q = h(t) with constant M, B, C and a load of period T = 2 pi / w, harmonic by
!> harmonic (section "Averaged coefficients" of doc/theory.md):
!>
!>     h = sum Re(h_m exp(i m w t)),   Z_m q_m = h_m,   Z_m = C + i m w B - (m w)^2 M,   m = 0, 1, 2, ...
module gestell_floquet_constant_harmonics
  use gestell_base_error, only: error_type, failed_computation, fatal_error, resonance
  use gestell_base_kinds, only: dp, pi
  use gestell_math_dft, only: dft
  use gestell_math_lapack, only: inverse
  use gestell_base_text, only: concise
  use gestell_system_averaged, only: averaged_system
  implicit none (type, external)
  private

  public :: solve_harmonics

  !> Complex amplitudes of the periodic motion of a system with n states.
  type, public :: spectrum_type
    !> Complex amplitudes x_m of the harmonics m = 0, 1, ... of the state (q, q'), shape (n, 0:harmonics), in the units of the
    !> states.
    complex(dp), allocatable :: x(:, :)
    !> Bound on the error of x(t) at any t, shape (n).
    real(dp), allocatable :: error(:)
    !> Largest factor by which a relative error of M, B or C grows when the equations of a harmonic are solved.
    real(dp) :: condition = 0
    !> Number of times that the load was evaluated.
    integer :: evaluations = 0
  contains
    procedure :: motion
  end type spectrum_type

  !> M, B, C, bounds dM, dB, dC on their errors, and the fundamental frequency (rad/s). Matrices are in balanced units.
  type :: coefficients_type
    real(dp), allocatable, dimension(:, :) :: m, b, c, dm, db, dc
    real(dp) :: frequency = 0
  end type coefficients_type

  !> Safety factor: an error bound is this factor times the error estimate.
  real(dp), parameter :: safety = 4
  !> Maximum number of samples of the load.
  integer, parameter :: max_points = 2**14

contains

  !> Computes the periodic motion of `system` and bounds on its error.
  !>
  !> The number of samples is doubled until the harmonics change by no more than rounding errors. The error bound is the sum of
  !> four parts:
  !>
  !> - the effect of the errors of M, B and C,
  !> - the effect of errors in the load amplitudes h_m, caused by rounding and by harmonics that the samples do not resolve,
  !> - the change of the harmonics at the last doubling; a new harmonic counts with its full amplitude,
  !> - the resonant response of each free vibration that is faster than the highest harmonic, to a load as large as the largest
  !>   amplitude in the upper third of the h_m.
  !>
  !> Fails if the matrix Z_m of a harmonic is singular within its error (resonance, or no spring carries the mean load).
  subroutine solve_harmonics(system, scale, values, spectrum, error)
    type(averaged_system), intent(in) :: system
    !> Units of the states, shape (n)
    real(dp), intent(in) :: scale(:)
    !> Eigenvalues of P (1/s), shape (n)
    complex(dp), intent(in) :: values(:)
    type(spectrum_type), intent(out) :: spectrum
    type(error_type), allocatable, intent(out) :: error
    type(coefficients_type) :: coefficients
    complex(dp), allocatable :: h(:, :), x(:, :), before(:, :), inverted(:, :)
    real(dp), allocatable :: rounding(:)
    real(dp), dimension(size(scale)) :: change, maximum, units
    real(dp) :: tail(size(scale) / 2), dq(size(scale) / 2), dz(size(scale) / 2, size(scale) / 2), order
    integer :: points, n, f, k, last

    n = size(scale)
    f = n / 2
    coefficients = in_units(system, scale(:f))
    points = max(32, 2 * system%least_steps)
    allocate(before(n, 0:0), source=(0.0_dp, 0.0_dp))
    do
      call load_harmonics(system, points, scale(:f), h, rounding)
      spectrum%evaluations = spectrum%evaluations + points
      call solve_all(coefficients, h, rounding, x, spectrum%error, spectrum%condition, error)
      if (allocated(error)) return
      change = sum(abs(x(:, ubound(before, 2) + 1:)), dim=2) + sum(abs(x(:, :ubound(before, 2)) - before), dim=2)
      maximum = maxval(abs(x), dim=2)
      if (all(change <= spectrum%error + 16 * epsilon(1.0_dp) * maximum) .or. 2 * points > max_points) exit
      call move_alloc(x, before)
      points = 2 * points
    end do

    tail = maxval(abs(h(:, ubound(h, 2) - ubound(h, 2) / 3:)), dim=2)
    call solve_all(coefficients, h, rounding + 2 * tail, x, spectrum%error, spectrum%condition, error)
    if (allocated(error)) return
    spectrum%error = spectrum%error + safety * change + epsilon(1.0_dp) * sum(abs(x), dim=2)
    do k = 1, n
      order = anint(abs(aimag(values(k))) / coefficients%frequency)
      if (.not. order > ubound(x, 2)) cycle
      call invert(coefficients, order, inverted, dz, error)
      if (allocated(error)) return
      dq = matmul(abs(inverted), tail)
      spectrum%error = spectrum%error + [dq, order * coefficients%frequency * dq]
    end do
    units = [scale(:f), scale(:f)]
    spectrum%error = spectrum%error * units
    ! Drop the highest harmonics that are negligible compared with the largest amplitude.
    do last = ubound(x, 2), 1, -1
      if (any(abs(x(:, last)) > 1.0e-3_dp * epsilon(1.0_dp) * maximum)) exit
    end do
    allocate(spectrum%x(n, 0:last), source=x(:, :last) * spread(units, 2, last + 1))
  end subroutine solve_harmonics

  !> Converts the coefficients to balanced units: positions in units of `scale`, forces in units of 1 / `scale`, so that symmetric
  !> matrices remain symmetric. The errors of the coefficients include the rounding errors of the arithmetic.
  pure type(coefficients_type) function in_units(system, scale) result(coefficients)
    type(averaged_system), intent(in) :: system
    real(dp), intent(in) :: scale(:)
    real(dp) :: units(size(scale), size(scale)), rounding
    integer :: f

    f = size(scale)
    units = spread(scale, 1, f) * spread(scale, 2, f)
    rounding = 4 * f * epsilon(1.0_dp)
    coefficients%m = units * system%m
    coefficients%b = units * system%b
    coefficients%c = units * system%c
    coefficients%dm = units * (system%m_error + rounding * abs(system%m))
    coefficients%db = units * (system%b_error + rounding * abs(system%b))
    coefficients%dc = units * (system%c_error + rounding * abs(system%c))
    coefficients%frequency = 2 * pi / system%period
  end function in_units

  !> Computes the amplitudes h_m of the load from `points` samples, in units of 1 / `scale`; `h` has the shape (f, 0:points / 2 -
  !> 1). `rounding`, shape (f), bounds the error that rounding of the samples causes in each amplitude.
  subroutine load_harmonics(system, points, scale, h, rounding)
    type(averaged_system), intent(in) :: system
    integer, intent(in) :: points
    real(dp), intent(in) :: scale(:)
    complex(dp), allocatable, intent(out) :: h(:, :)
    real(dp), allocatable, intent(out) :: rounding(:)
    real(dp), allocatable :: samples(:, :)
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
    complex(dp) :: y(points)
    integer :: f, i

    f = size(scale)
    allocate(samples(points, f), h(f, 0:points / 2 - 1))
    allocate(m(points, f, f), b(points, f, f), c(points, f, f))
    call system%sample_second_order([(real(i, dp) / points, i = 0, points - 1)], m, b, c, samples)
    do i = 1, f
      samples(:, i) = samples(:, i) * scale(i)
      y = dft(cmplx(samples(:, i), 0, dp))
      h(i, :) = 2 * y(:size(h, 2)) / points
    end do
    h(:, 0) = h(:, 0) / 2
    ! Every order gets the same bound.
    allocate(rounding(f), source=2 * max(system%rounding + 4 * epsilon(1.0_dp), system%load_rounding / 4) &
      & * maxval(norm2(samples, dim=2)))
  end subroutine load_harmonics

  !> Computes all harmonics `x`. `bound`: bound on the error of their sum, caused by the errors of M, B, C and of the load
  !> amplitudes `h`. `rounding`: bounds on the errors of `h`. `condition`: largest factor by which the solution of a harmonic
  !> amplifies relative errors of M, B or C.
  subroutine solve_all(coefficients, h, rounding, x, bound, condition, error)
    type(coefficients_type), intent(in) :: coefficients
    complex(dp), intent(in) :: h(:, 0:)
    real(dp), intent(in) :: rounding(:)
    complex(dp), allocatable, intent(out) :: x(:, :)
    real(dp), allocatable, intent(out) :: bound(:)
    real(dp), intent(out) :: condition
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: inverted(:, :)
    real(dp) :: dz(size(h, 1), size(h, 1)), size_z(size(h, 1), size(h, 1)), dq(size(h, 1)), rate, share
    integer :: f, k

    f = size(h, 1)
    allocate(x(2 * f, 0:ubound(h, 2)))
    allocate(bound(2 * f), source=0.0_dp)
    condition = 0
    do k = 0, ubound(h, 2)
      call invert(coefficients, real(k, dp), inverted, dz, error)
      if (allocated(error)) return
      rate = k * coefficients%frequency
      x(:f, k) = matmul(inverted, h(:, k))
      x(f + 1:, k) = cmplx(0, rate, dp) * x(:f, k)
      ! dq <= |Z^-1| (dh + dZ (|q| + dq)), row by row
      share = norm(matmul(abs(inverted), dz))
      dq = matmul(abs(inverted), rounding + matmul(dz, abs(x(:f, k))))
      dq = dq + share / (1 - share) * maxval(dq)
      bound = bound + [dq, rate * dq]
      size_z = rate**2 * abs(coefficients%m) + rate * abs(coefficients%b) + abs(coefficients%c)
      condition = max(condition, norm(matmul(abs(inverted), size_z)))
    end do
  end subroutine solve_all

  !> Computes the inverse of Z_k = C + i k w B - (k w)^2 M and bounds `dz` on the errors of the elements of Z_k. Fails if Z_k may be
  !> singular within these errors.
  subroutine invert(coefficients, k, inverted, dz, error)
    type(coefficients_type), intent(in) :: coefficients
    real(dp), intent(in) :: k
    complex(dp), allocatable, intent(out) :: inverted(:, :)
    real(dp), intent(out) :: dz(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: singular
    real(dp) :: rate

    rate = k * coefficients%frequency
    dz = rate**2 * coefficients%dm + rate * coefficients%db + coefficients%dc
    call inverse(cmplx(coefficients%c - rate**2 * coefficients%m, rate * coefficients%b, dp), inverted, singular)
    if (.not. allocated(singular)) then
      if (norm(matmul(abs(inverted), dz)) < 0.5_dp) return
    end if
    if (k < 0.5_dp) then
      call fatal_error(error, "the averaged model has no periodic vibration: in one or more directions no spring carries the " // &
        & "mean load (harmonic 0)", failed_computation)
    else
      call fatal_error(error, "the averaged model has no periodic vibration: an undamped natural frequency coincides with " // &
        & "harmonic " // concise(k, 15) // " of the period (resonance); add damping or change the speed", failed_computation)
    end if
    error%cause = resonance
  end subroutine invert

  !> Norm of a matrix without negative elements: its maximum row sum.
  pure real(dp) function norm(a)
    real(dp), intent(in) :: a(:, :)

    norm = maxval(sum(a, dim=2))
  end function norm

  !> Computes the periodic motion x(t) at the phases t / T; shape (n, points).
  pure subroutine motion(self, phases, x)
    class(spectrum_type), intent(in) :: self
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: x(:, :)
    complex(dp) :: turn(0:ubound(self%x, 2))
    integer :: i, k, half

    turn(0) = 1
    do i = 1, size(phases)
      ! Build powers from lower ones by halving: rounding grows with the logarithm of the order.
      if (size(turn) > 1) turn(1) = exp(cmplx(0, 2 * pi * phases(i), dp))
      do k = 2, ubound(turn, 1)
        half = k / 2
        turn(k) = turn(half) * turn(k - half)
      end do
      x(:, i) = real(matmul(self%x, turn))
    end do
  end subroutine motion

end module gestell_floquet_constant_harmonics
