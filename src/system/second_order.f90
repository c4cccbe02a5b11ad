!> Mechanical systems with periodic coefficients,
!>
!>     M(t) q'' + B(t) q' + C(t) q = h(t),   x = (q, q'),                                     (8), (21)
!>
!> as periodic systems with n = 2 f states for f degrees of freedom. Integrators that know the structure take
!> M, B, C, h as they are; the others get P and f of (21), (22).
module gestell_system_second_order
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_lapack, only: factorise, solve_factored
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: sample_in_units

  !> Extend this, set `states` = 2 f and `period`, give `matrices` (and `load` if there is one).
  type, abstract, extends(periodic_system), public :: second_order_system
  contains
    procedure(matrices_at), deferred :: matrices
    procedure :: load => no_load
    procedure :: sample_second_order
    procedure :: matrix => first_order_matrix
    procedure :: forcing => first_order_forcing
    procedure :: sample => sample_first_order
  end type second_order_system

  abstract interface
    !> M, B, C, each of shape (f, f), at a time in [0, T].
    subroutine matrices_at(self, t, m, b, c)
      import :: second_order_system, dp
      implicit none (type, external)
      class(second_order_system), intent(in) :: self
      real(dp), intent(in) :: t
      real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    end subroutine matrices_at
  end interface

contains

  !> h(t), shape (f): zero unless a model says otherwise.
  subroutine no_load(self, t, h)
    class(second_order_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    associate (unused_system => self, unused_time => t)
    end associate
    h = 0
  end subroutine no_load

  !> M, B, C, each of shape (f, f, points), and where asked for h, shape (f, points), at many phases t / T at once.
  !> Override it where coefficients are cheaper in bulk.
  subroutine sample_second_order(self, phases, m, b, c, h)
    class(second_order_system), intent(in) :: self
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), intent(out), optional :: h(:, :)
    integer :: k

    do k = 1, size(phases)
      call self%matrices(phases(k) * self%period, m(:, :, k), b(:, :, k), c(:, :, k))
      if (present(h)) call self%load(phases(k) * self%period, h(:, k))
    end do
  end subroutine sample_second_order

  !> U M U, U B U, U C U and U h at many phases, U = diag(units) with powers of two that make the diagonal of M about 1: in
  !> the coordinates U^-1 q, elimination with pivots does not confuse a small number of kilograms with a small one of
  !> kilogram square metres.
  subroutine sample_in_units(system, phases, m, b, c, units, h)
    class(second_order_system), intent(in) :: system
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :), units(:)
    real(dp), intent(out), optional :: h(:, :)
    integer :: i, j

    if (present(h)) then
      call system%sample_second_order(phases, m, b, c, h)
    else
      call system%sample_second_order(phases, m, b, c)
    end if
    do i = 1, size(units)
      units(i) = unit_of(maxval(abs(m(i, i, :))))
    end do
    do j = 1, size(units)
      do i = 1, size(units)
        m(i, j, :) = units(i) * units(j) * m(i, j, :)
        b(i, j, :) = units(i) * units(j) * b(i, j, :)
        c(i, j, :) = units(i) * units(j) * c(i, j, :)
      end do
      if (present(h)) h(j, :) = units(j) * h(j, :)
    end do
  end subroutine sample_in_units

  !> A power of two near 1 / sqrt(mass).
  pure real(dp) function unit_of(mass)
    real(dp), intent(in) :: mass

    unit_of = 1
    if (mass > 0 .and. mass <= huge(mass)) unit_of = scale(1.0_dp, -exponent(mass) / 2)
  end function unit_of

  !> P(t) of (22).
  subroutine first_order_matrix(self, t, p)
    class(second_order_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp) :: many(self%states, self%states, 1)

    call self%sample([t / self%period], many)
    p = many(:, :, 1)
  end subroutine first_order_matrix

  !> f(t) of (21).
  subroutine first_order_forcing(self, t, f)
    class(second_order_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)
    real(dp) :: p(self%states, self%states, 1), many(self%states, 1)

    call self%sample([t / self%period], p, many)
    f = many(:, 1)
  end subroutine first_order_forcing

  !> P = [0 E; -M^-1 C, -M^-1 B] and f = [0; M^-1 h], (21) and (22). NaN where M is singular.
  subroutine sample_first_order(self, phases, p, f)
    class(second_order_system), intent(in) :: self
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: p(:, :, :)
    real(dp), intent(out), optional :: f(:, :)
    real(dp), allocatable :: m(:, :, :), b(:, :, :), c(:, :, :), h(:, :), right(:, :)
    type(error_type), allocatable :: error
    real(dp) :: units(self%states / 2)
    integer :: pivots(self%states / 2), n, i, k

    n = self%states / 2
    allocate(m(n, n, size(phases)), b(n, n, size(phases)), c(n, n, size(phases)), h(n, size(phases)))
    if (present(f)) then
      call sample_in_units(self, phases, m, b, c, units, h)
    else
      call sample_in_units(self, phases, m, b, c, units)
      h = 0
    end if

    allocate(right(n, 2 * n + 1))
    p(:n, :, :) = 0
    do i = 1, n
      p(i, n + i, :) = 1
    end do
    do k = 1, size(phases)
      right(:, :n) = -c(:, :, k)
      right(:, n + 1:2 * n) = -b(:, :, k)
      right(:, 2 * n + 1) = h(:, k)
      call factorise(m(:, :, k), pivots, error)
      if (allocated(error)) then
        right = ieee_value(1.0_dp, ieee_quiet_nan)
      else
        call solve_factored(m(:, :, k), pivots, right)
      end if
      ! From U^-1 q and U^-1 q' to q and q'.
      right = right * spread(units, 2, 2 * n + 1)
      right(:, :2 * n) = right(:, :2 * n) / spread([units, units], 1, n)
      p(n + 1:, :, k) = right(:, :2 * n)
      if (present(f)) f(:, k) = [spread(0.0_dp, 1, n), right(:, 2 * n + 1)]
    end do
  end subroutine sample_first_order

end module gestell_system_second_order
