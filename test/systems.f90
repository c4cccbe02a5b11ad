!> Periodic systems with known solutions, and disguised forms of systems, for the tests.
module systems
  use gestell_base_kinds, only: dp, pi
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: diagonal

  !> y'' + d y' + (a - 2 q cos 2 t) y = h cos(2 t), T = pi.
  type, extends(second_order_system), public :: mathieu_type
    real(dp) :: a = 0, q = 0, d = 0, h = 0
  contains
    procedure :: matrices => mathieu_matrices
    procedure :: load => mathieu_load
  end type mathieu_type

  !> Meissner: y'' + (a - 2 q psi) y = 0, psi = +1 on [0, pi/3], -1 to pi, as a first-order system.
  type, extends(periodic_system), public :: meissner_type
    real(dp) :: a = 1, q = 0.1_dp
  contains
    procedure :: matrix => meissner_matrix
  end type meissner_type

  !> Vinograd's system: T = pi / 6, exponents +2 and -13, although P has the eigenvalues -1 and -10 at all times.
  type, extends(periodic_system), public :: vinograd_type
  contains
    procedure :: matrix => vinograd_matrix
  end type vinograd_type

  !> x' = (c + cos t) x + exp(sin t), T = 2 pi: Phi(t) = exp(c t + sin t), for c = 0 x_p(T) = 2 pi.
  type, extends(periodic_system), public :: scalar_type
    real(dp) :: c = 0
  contains
    procedure :: matrix => scalar_matrix
    procedure :: forcing => scalar_forcing
  end type scalar_type

  !> Constant M, B, C with h = amplitude cos(2 pi t / T).
  type, extends(second_order_system), public :: constant_type
    real(dp) :: m(2, 2) = 0, b(2, 2) = 0, c(2, 2) = 0, amplitude(2) = 0
  contains
    procedure :: matrices => constant_matrices
    procedure :: load => constant_load
  end type constant_type

  !> Uncoupled oscillators that do not declare this: q_i'' + damping(i) q_i' + square(i) q_i = h_i with h_i = amplitude(i) cos(w
  !> t), w = 2 pi / T, for the last one amplitude / (1 + sharpness - cos(w t)) if sharpness > 0.
  type, extends(second_order_system), public :: oscillators_type
    real(dp), allocatable :: square(:), damping(:), amplitude(:)
    real(dp) :: sharpness = 0
    !> Coefficients of sin w t in `square`; unallocated: none.
    real(dp), allocatable :: modulation(:)
  contains
    procedure :: matrices => oscillators_matrices
    procedure :: load => oscillators_load
    procedure :: start => oscillators_start
  end type oscillators_type

  !> q'' + q'/10 + c q = h with c = 5 + step, h = 1 up to the phase `edge`, then c = 5, h = 0.
  type, extends(second_order_system), public :: jumping_type
    real(dp) :: edge = 0.5_dp, step = 2
  contains
    procedure :: matrices => jumping_matrices
    procedure :: load => jumping_load
  end type jumping_type

  !> q'' + d q' + square q = 0 with d = damping (1 + 2 sum of ratio^k cos(k w t)), w = 2 pi / T: a pulse at t = 0.
  type, extends(second_order_system), public :: pulsed_type
    real(dp) :: square = 1, damping = 0.05_dp, ratio = 0
  contains
    procedure :: matrices => pulsed_matrices
  end type pulsed_type

  !> Another second-order system over `turns` of its periods (set `period` to match), from the time `start` on.
  type, extends(second_order_system), public :: again_type
    class(second_order_system), allocatable :: system
    real(dp) :: start = 0
  contains
    procedure :: matrices => again_matrices
    procedure :: load => again_load
  end type again_type

  !> Another system through P and f alone, which hides its second-order structure.
  type, extends(periodic_system), public :: plain_type
    class(periodic_system), allocatable :: system
  contains
    procedure :: matrix => plain_matrix
    procedure :: forcing => plain_forcing
  end type plain_type

  !> One element of B is sin(t + 1) minus its expansion by the addition theorem, which is zero except for rounding.
  type, extends(second_order_system), public :: cancelling_type
    real(dp) :: depth = 0.1_dp
  contains
    procedure :: matrices => cancelling_matrices
    procedure :: load => cancelling_load
  end type cancelling_type

contains

  pure function diagonal(d) result(a)
    real(dp), intent(in) :: d(:)
    real(dp) :: a(size(d), size(d))
    integer :: i

    a = 0
    do i = 1, size(d)
      a(i, i) = d(i)
    end do
  end function diagonal

  subroutine mathieu_matrices(self, t, m, b, c)
    class(mathieu_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    m = 1
    b = self%d
    c = self%a - 2 * self%q * cos(2 * t)
  end subroutine mathieu_matrices

  subroutine mathieu_load(self, t, h)
    class(mathieu_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    h = self%h * cos(2 * t)
  end subroutine mathieu_load

  !> The sum is Poisson's kernel.
  subroutine pulsed_matrices(self, t, m, b, c)
    class(pulsed_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    associate (r => self%ratio)
      m = 1
      b = self%damping * (1 - r**2) / (1 - 2 * r * cos(2 * pi * t / self%period) + r**2)
      c = self%square
    end associate
  end subroutine pulsed_matrices

  subroutine meissner_matrix(self, t, p)
    class(meissner_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    p = 0
    p(1, 2) = 1
    p(2, 1) = -(self%a - 2 * self%q * merge(1.0_dp, -1.0_dp, t < pi / 3))
  end subroutine meissner_matrix

  subroutine vinograd_matrix(self, t, p)
    class(vinograd_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    associate (unused => self)
    end associate
    associate (c => cos(6 * t), s => sin(6 * t))
      p(1, 1) = -1 - 9 * c**2 + 12 * s * c
      p(1, 2) = 12 * c**2 + 9 * s * c
      p(2, 1) = -12 * s**2 + 9 * s * c
      p(2, 2) = -1 - 9 * s**2 - 12 * s * c
    end associate
  end subroutine vinograd_matrix

  subroutine scalar_matrix(self, t, p)
    class(scalar_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    p = self%c + cos(t)
  end subroutine scalar_matrix

  subroutine scalar_forcing(self, t, f)
    class(scalar_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    associate (unused => self)
    end associate
    f = exp(sin(t))
  end subroutine scalar_forcing

  subroutine constant_matrices(self, t, m, b, c)
    class(constant_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    associate (unused => t)
    end associate
    m = self%m
    b = self%b
    c = self%c
  end subroutine constant_matrices

  subroutine constant_load(self, t, h)
    class(constant_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    h = self%amplitude * cos(2 * pi * t / self%period)
  end subroutine constant_load

  subroutine oscillators_matrices(self, t, m, b, c)
    class(oscillators_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    m = diagonal(spread(1.0_dp, 1, size(self%square)))
    b = diagonal(self%damping)
    c = diagonal(self%square)
    if (allocated(self%modulation)) c = c + diagonal(self%square * self%modulation * sin(2 * pi * t / self%period))
  end subroutine oscillators_matrices

  subroutine oscillators_load(self, t, h)
    class(oscillators_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    associate (n => size(h), c => cos(2 * pi * t / self%period))
      h = self%amplitude * c
      if (self%sharpness > 0) h(n) = self%amplitude(n) / (1 + self%sharpness - c)
    end associate
  end subroutine oscillators_load

  !> The periodic motion's state at t = 0: 1 / (a - cos u) = (1 + 2 sum of r^k cos k u) / s, s^2 = a^2 - 1, r = a - s.
  pure function oscillators_start(self) result(x)
    class(oscillators_type), intent(in) :: self
    real(dp) :: x(self%states), r, s, w
    complex(dp) :: q
    integer :: n, i, k

    n = size(self%square)
    w = 2 * pi / self%period
    s = sqrt((1 + self%sharpness)**2 - 1)
    r = 1 + self%sharpness - s
    x = 0
    do i = 1, n
      do k = 0, 2000
        q = self%amplitude(i) / cmplx(self%square(i) - (k * w)**2, k * w * self%damping(i), dp)
        if (i == n .and. self%sharpness > 0) then
          q = q * merge(1, 2, k == 0) * r**k / s
        else if (k /= 1) then
          cycle
        end if
        x(i) = x(i) + real(q)
        x(n + i) = x(n + i) - k * w * aimag(q)
      end do
    end do
  end function oscillators_start

  subroutine jumping_matrices(self, t, m, b, c)
    class(jumping_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    m = 1
    b = 0.1_dp
    c = 5 + merge(self%step, 0.0_dp, t < self%edge * self%period)
  end subroutine jumping_matrices

  subroutine jumping_load(self, t, h)
    class(jumping_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    h = merge(1, 0, t < self%edge * self%period)
  end subroutine jumping_load

  subroutine again_matrices(self, t, m, b, c)
    class(again_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    call self%system%matrices(modulo(t + self%start, self%system%period), m, b, c)
  end subroutine again_matrices

  subroutine again_load(self, t, h)
    class(again_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    call self%system%load(modulo(t + self%start, self%system%period), h)
  end subroutine again_load

  subroutine plain_matrix(self, t, p)
    class(plain_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    call self%system%matrix(t, p)
  end subroutine plain_matrix

  subroutine plain_forcing(self, t, f)
    class(plain_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    call self%system%forcing(t, f)
  end subroutine plain_forcing

  subroutine cancelling_matrices(self, t, m, b, c)
    class(cancelling_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    m = reshape([2.0_dp, 0.0_dp, 0.0_dp, 2.0_dp], [2, 2])
    b = 0
    b(1, 2) = sin(t + 1) - (sin(t) * cos(1.0_dp) + cos(t) * sin(1.0_dp))
    c = m * (1 + self%depth * cos(t))
  end subroutine cancelling_matrices

  subroutine cancelling_load(self, t, h)
    class(cancelling_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    h = self%depth * cos(t)
  end subroutine cancelling_load

end module systems
