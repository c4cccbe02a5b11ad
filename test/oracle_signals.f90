!> Quantities of the exact frame's vibration, for the oracle: their values over the period by name, peaks, roots of the mean
!> square and harmonics, from Fourier series in extended precision.
module oracle_signals
  use oracle_frame, only: drive_torque, evaluate, equations_type, frame_type, ground_force
  use oracle_joints, only: list_pins, pin_forces, pin_type
  use oracle_machine, only: i, pi, xp
  use oracle_turn, only: acceleration_of, run_turn, turn_type
  use oracle_vibration, only: orbit_type
  implicit none (type, external)
  private

  public :: find_signals, list_signals

  integer, parameter, public :: name_length = 20

  !> A quantity over the period, a scalar or a vector of the plane: samples at equidistant times, the first at 0, shape (samples,
  !> 1 or 2), and its harmonics c_k, f = sum of c_k exp(2 pi i k t/T) over all k, of k from 0 on.
  type, public :: signal_type
    character(len=name_length) :: name = ""
    real(xp), allocatable :: samples(:, :)
    complex(xp), allocatable :: c(:, :)
    !> Estimate of the quantity's error due to sampling.
    real(xp) :: unknown = 0
  contains
    procedure :: at
    procedure :: peak
    procedure :: least
    procedure :: rms
    procedure :: amplitude
    procedure :: band
  end type signal_type

contains

  !> All quantities, at `samples` times of the period, a multiple of the orbit's pieces.
  subroutine find_signals(frame, orbit, samples, signals)
    type(frame_type), intent(in) :: frame
    type(orbit_type), intent(in) :: orbit
    integer, intent(in) :: samples
    type(signal_type), allocatable, intent(out) :: signals(:)
    type(turn_type) :: turn
    real(xp) :: q(3), v(3), a(3), phi
    integer :: k

    call run_turn(frame, orbit%start, orbit%motor, samples, .false., turn)
    call list_signals(frame, samples, signals)
    do k = 1, samples
      phi = frame%speed * frame%period * (k - 1) / samples
      call acceleration_of(frame, phi, turn%x(:, k - 1), orbit%motor, q, v, a)
      call take_sample(frame, phi, q, v, a, orbit%motor, k, signals)
    end do
    do k = 1, size(signals)
      call read_series(signals(k))
    end do
  end subroutine find_signals

  !> Names of the quantities and room for them, in the order in which `take_sample` fills them.
  subroutine list_signals(frame, samples, signals)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: samples
    type(signal_type), allocatable, intent(out) :: signals(:)
    character(len=3), parameter :: coordinates(3) = ["xi ", "eta", "psi"]
    character(len=name_length) :: part
    type(pin_type), allocatable :: pins(:)
    integer :: j, k

    allocate(signals(0))
    do k = 1, 3
      call add(trim(coordinates(k)), 1)
      call add(trim(coordinates(k)) // "_dot", 1)
    end do
    call add_force("")
    call add("m", 1)
    do j = 1, size(frame%machine%supports)
      write (part, "('support(', i0, ').')") j
      call add_force(trim(part))
    end do
    call add_force("foundation.")
    call add("foundation.m", 1)
    call add_force("guide.")
    call add("guide.m", 1)
    call add_force("total.")
    call add("total.m", 1)
    call add("torque", 1)
    do k = 0, 2
      part = repeat("v", merge(1, 0, k == 1)) // repeat("a", merge(1, 0, k == 2))
      call add("probe(p)." // trim(part) // "x", 1)
      call add("probe(p)." // trim(part) // "y", 1)
      call add("probe(p)." // merge("d", part(:1), k == 0), 2)
    end do
    call list_pins(frame%machine, pins)
    do k = 1, size(pins)
      call add_force(trim(pins(k)%name))
    end do

  contains

    subroutine add_force(of)
      character(len=*), intent(in) :: of

      call add(of // "fx", 1)
      call add(of // "fy", 1)
      call add(of // "f", 2)
    end subroutine add_force

    subroutine add(name, components)
      character(len=*), intent(in) :: name
      integer, intent(in) :: components
      type(signal_type) :: signal

      signal%name = name
      allocate(signal%samples(samples, components))
      signals = [signals, signal]
    end subroutine add

  end subroutine list_signals

  subroutine take_sample(frame, phi, q, v, a, motor, k, signals)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: phi, q(3), v(3), a(3), motor
    integer, intent(in) :: k
    type(signal_type), intent(inout) :: signals(:)
    complex(xp) :: u, force, guide, supports, turned, place
    real(xp) :: moment, couple, guide_couple, own, held(3)
    type(equations_type) :: eq
    type(pin_type), allocatable :: pins(:)
    complex(xp), allocatable :: forces(:)
    integer :: j, n

    n = 0
    do j = 1, 3
      call put([q(j)])
      call put([v(j)])
    end do
    u = cmplx(q(1), q(2), xp)
    call evaluate(frame, phi, q, v, motor, .false., eq)
    ! The residuals of the held coordinates' equations are forces on the frame; the ground receives the opposite.
    held = -(matmul(eq%m, a) + eq%f)
    do j = 1, 3
      if (frame%machine%free(j)) held(j) = 0
    end do
    guide = cmplx(held(1), held(2), xp)
    guide_couple = held(3) + aimag(conjg(u) * guide)
    supports = 0
    couple = 0
    do j = 1, size(frame%machine%supports)
      call ground_force(frame, j, q, v, force, moment)
      supports = supports + force
      couple = couple + moment
    end do
    held = matmul(real(frame%machine%foundation_stiffness, xp), q) + frame%machine%foundation_damping * v
    own = held(3)
    turned = cmplx(held(1), held(2), xp)
    call put_force(supports + turned, supports + turned + guide)
    call put([couple + own])
    do j = 1, size(frame%machine%supports)
      call ground_force(frame, j, q, v, force, moment)
      call put_force(force, force)
    end do
    call put_force(turned, turned)
    call put([own])
    call put_force(guide, guide)
    call put([guide_couple])
    call put_force(supports + turned + guide, supports + turned + guide)
    call put([couple + own + guide_couple])
    call put([drive_torque(frame, phi, q, v, a)])
    place = cmplx(frame%machine%probe(1), frame%machine%probe(2), xp)
    turned = exp(i * q(3)) * place
    call put_force(u + 2 * i * sin(q(3) / 2) * exp(i * q(3) / 2) * place)
    call put_force(cmplx(v(1), v(2), xp) + i * v(3) * turned)
    call put_force(cmplx(a(1), a(2), xp) + (i * a(3) - v(3)**2) * turned)
    call list_pins(frame%machine, pins)
    forces = pin_forces(frame, pins, phi, q, v, a)
    do j = 1, size(pins)
      call put_force(forces(j))
    end do

  contains

    !> Adds a vector along x and y and its size, which may be that of another vector.
    subroutine put_force(z, whole)
      complex(xp), intent(in) :: z
      complex(xp), intent(in), optional :: whole

      call put([real(z)])
      call put([aimag(z)])
      if (present(whole)) then
        call put([real(whole), aimag(whole)])
      else
        call put([real(z), aimag(z)])
      end if
    end subroutine put_force

    subroutine put(values)
      real(xp), intent(in) :: values(:)

      n = n + 1
      signals(n)%samples(k, :) = values
    end subroutine put

  end subroutine take_sample

  !> Harmonics of the samples. The part that the samples miss is estimated as four times their last third.
  subroutine read_series(signal)
    type(signal_type), intent(inout) :: signal
    complex(xp), allocatable :: c(:, :)
    real(xp) :: rounding
    integer :: k, n

    n = size(signal%samples, 1)
    allocate(c(0:n - 1, size(signal%samples, 2)))
    do k = 1, size(c, 2)
      c(:, k) = transformed(cmplx(signal%samples(:, k), kind=xp)) / n
    end do
    signal%unknown = 4 * sum(abs(c(n / 3:(n - 1) / 2, :)))
    ! Rounding errors must not count as harmonics.
    rounding = maxval(square(c)) * (epsilon(1.0_xp) / 16)**2
    do k = (n - 1) / 2, 1, -1
      if (any(square(c(k, :)) > rounding)) exit
    end do
    allocate(signal%c(0:k, size(c, 2)))
    signal%c = c(:k, :)
  end subroutine read_series

  !> sum of f_m exp(-2 pi i k m/n), m from 0, by halves.
  pure recursive function transformed(f) result(c)
    complex(xp), intent(in) :: f(0:)
    complex(xp) :: c(0:size(f) - 1)
    complex(xp) :: odd(0:size(f) / 2 - 1)
    integer :: k, m, n

    n = size(f)
    if (modulo(n, 2) == 0) then
      c(:n / 2 - 1) = transformed(f(0::2))
      odd = transformed(f(1::2))
      do k = 0, n / 2 - 1
        odd(k) = odd(k) * exp(-2 * i * pi * k / n)
      end do
      c(n / 2:) = c(:n / 2 - 1) - odd
      c(:n / 2 - 1) = c(:n / 2 - 1) + odd
    else
      do k = 0, n - 1
        c(k) = sum([(f(m) * exp(-2 * i * pi * modulo(k * m, n) / n), m = 0, n - 1)])
      end do
    end if
  end function transformed

  elemental real(xp) function square(z)
    complex(xp), intent(in) :: z

    square = real(z)**2 + aimag(z)**2
  end function square

  !> The components and two derivatives by the phase of the period, t/T 2 pi; shape (components, 0:2).
  pure function values(signal, phase) result(f)
    type(signal_type), intent(in) :: signal
    real(xp), intent(in) :: phase
    real(xp) :: f(size(signal%c, 2), 0:2)
    complex(xp) :: wave, step, term(size(signal%c, 2))
    integer :: k

    f = 0
    f(:, 0) = real(signal%c(0, :))
    step = exp(i * phase)
    wave = 1
    do k = 1, ubound(signal%c, 1)
      wave = wave * step
      term = 2 * signal%c(k, :) * wave
      f(:, 0) = f(:, 0) + real(term)
      f(:, 1) = f(:, 1) - k * aimag(term)
      f(:, 2) = f(:, 2) - k**2 * real(term)
    end do
  end function values

  !> A scalar with its sign, or a vector's size, at a sample.
  pure real(xp) function at(self, k)
    class(signal_type), intent(in) :: self
    integer, intent(in) :: k

    at = self%samples(k, 1)
    if (size(self%samples, 2) > 1) at = norm2(self%samples(k, :))
  end function at

  !> Maximum of the size over the period, from all high samples among many by Newton's method for the derivative of the square.
  real(xp) function peak(self)
    class(signal_type), intent(in) :: self

    peak = sqrt(largest_square(self))
  end function peak

  !> The minimum of a scalar. A constant is added that makes it positive everywhere; the minimum is then found as a maximum.
  real(xp) function least(self)
    class(signal_type), intent(in) :: self
    type(signal_type) :: lowered
    real(xp) :: lift

    lift = 2 * self%peak()
    lowered%samples = self%samples - lift
    lowered%c = self%c
    lowered%c(0, 1) = lowered%c(0, 1) - lift
    least = lift - lowered%peak()
  end function least

  real(xp) function largest_square(signal) result(maximum)
    type(signal_type), intent(in) :: signal
    real(xp), parameter :: high = 0.9_xp, counts = 0.01_xp
    real(xp), allocatable :: squares(:)
    real(xp) :: f(size(signal%c, 2), 0:2), phase, slope, bend, largest
    integer :: finer, k, n, step

    maximum = 0
    if (.not. maxval(abs(signal%samples)) > 0) return
    ! 16 points per period of the highest relevant order: between two of them a maximum loses 2 %.
    n = size(signal%samples, 1)
    largest = maxval([0.0_xp, square(signal%c(1:, :))])
    do k = ubound(signal%c, 1), 1, -1
      if (any(square(signal%c(k, :)) > counts**2 * largest)) exit
    end do
    finer = max(1, (16 * k - 1) / n + 1)
    n = finer * n
    allocate(squares(n))
    do k = 1, n
      if (modulo(k - 1, finer) == 0) then
        squares(k) = sum(signal%samples(1 + (k - 1) / finer, :)**2)
      else
        f = values(signal, 2 * pi * (k - 1) / n)
        squares(k) = sum(f(:, 0)**2)
      end if
    end do
    largest = maxval(squares)
    maximum = largest
    do k = 1, n
      if (squares(k) < high * largest) cycle
      if (squares(k) < squares(1 + modulo(k - 2, n)) .or. squares(k) < squares(1 + modulo(k, n))) cycle
      phase = 2 * pi * (k - 1) / n
      do step = 1, 12
        f = values(signal, phase)
        maximum = max(maximum, sum(f(:, 0)**2))
        slope = sum(f(:, 0) * f(:, 1))
        bend = sum(f(:, 1)**2 + f(:, 0) * f(:, 2))
        if (.not. bend < 0) exit
        if (abs(slope) <= 1.0e-12_xp * abs(bend)) exit
        phase = phase - slope / bend
      end do
    end do
  end function largest_square

  !> By Parseval's theorem.
  pure real(xp) function rms(self)
    class(signal_type), intent(in) :: self

    rms = sqrt(sum(real(self%c(0, :))**2) + 2 * sum(abs(self%c(1:, :))**2))
  end function rms

  !> Size of an order of the period, from 1 on; for a vector the root of the sum of its components' squares.
  pure real(xp) function amplitude(self, order)
    class(signal_type), intent(in) :: self
    integer, intent(in) :: order

    amplitude = 0
    if (order <= ubound(self%c, 1)) amplitude = 2 * norm2(abs(self%c(order, :)))
  end function amplitude

  !> Root of the mean square of a vector's orders between two frequencies, in the direction in which it is largest: the root of
  !> the larger eigenvalue of the mean of f f^T. `period` in s, `range` in Hz.
  pure real(xp) function band(self, period, range)
    class(signal_type), intent(in) :: self
    real(xp), intent(in) :: period, range(2)
    real(xp) :: xx, yy, xy
    integer :: k

    xx = 0
    yy = 0
    xy = 0
    do k = 1, ubound(self%c, 1)
      if (k / period < range(1) .or. k / period > range(2)) cycle
      xx = xx + 2 * abs(self%c(k, 1))**2
      yy = yy + 2 * abs(self%c(k, 2))**2
      xy = xy + 2 * real(self%c(k, 1) * conjg(self%c(k, 2)))
    end do
    band = sqrt((xx + yy) / 2 + hypot((xx - yy) / 2, xy))
  end function band

end module oracle_signals
