!> Mechanical systems with periodic coefficients,
!>
!>     M(t) q'' + B(t) q' + C(t) q = h(t),   x = (q, q'),                                     (8), (21)
!>
!> as periodic systems with n = 2 f states for f degrees of freedom. Some integrators use M, B, C, h directly; the others use P and
!> f of equations (21) and (22) of doc/theory.md.
module gestell_system_second_order
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_system_mass, only: solve_mass
  use gestell_system_periodic, only: check_periodic, periodic_system
  implicit none (type, external)
  private

  public :: check_second_order, conserved_form, has_positions, is_gyroscopic, sample_by_phase, sample_in_units, sample_traces

  !> Base type of mechanical systems. An extension sets `states` = 2 f and `period`, provides `matrices`, and also provides `load`
  !> if h is not zero.
  type, abstract, extends(periodic_system), public :: second_order_system
  contains
    procedure(matrices_at), deferred :: matrices
    procedure :: load => no_load, sample_second_order, matrix => first_order_matrix
    procedure :: forcing => first_order_forcing, sample => sample_first_order
    procedure :: check => check_second_order
  end type second_order_system

  abstract interface
    !> Computes M, B, C, each of shape (f, f), at the time `t` in [0, T].
    subroutine matrices_at(self, t, m, b, c)
      import :: second_order_system, dp
      implicit none (type, external)
      class(second_order_system), intent(in) :: self
      real(dp), intent(in) :: t
      real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    end subroutine matrices_at
  end interface

contains

  !> Checks the components as `check_periodic` does. Also fails if the number of states is odd.
  subroutine check_second_order(self, error)
    class(second_order_system), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error

    call check_periodic(self, error)
    if (allocated(error)) return
    if (modulo(self%states, 2) /= 0) call fatal_error(error, "a second-order system must have an even number of states: " &
      & // "two for each degree of freedom", invalid_input)
  end subroutine check_second_order

  !> True if the states of the system are positions and velocities.
  pure logical function has_positions(system)
    class(periodic_system), intent(in) :: system

    has_positions = .false.
    select type (system)
    class is (second_order_system)
      has_positions = .true.
    end select
  end function has_positions

  !> Computes Omega = [G M; -M 0] at t = 0 for a system that conserves energy; G is the antisymmetric part of B. For two solutions x
  !> and y of such a system, x' Omega y does not change with time. `form` is unallocated for other systems.
  subroutine conserved_form(system, form)
    class(periodic_system), intent(in) :: system
    real(dp), allocatable, intent(out) :: form(:, :)
    real(dp), dimension(1, system%states / 2, system%states / 2) :: m, b, c
    integer :: f, i

    f = system%states / 2
    select type (system)
    class is (second_order_system)
      if (.not. system%conserves([(i, i = 1, f)])) return
      call system%sample_second_order([0.0_dp], m, b, c)
      allocate(form(2 * f, 2 * f), source=0.0_dp)
      form(:f, :f) = (b(1, :, :) - transpose(b(1, :, :))) / 2
      form(:f, f + 1:) = m(1, :, :)
      form(f + 1:, :f) = -m(1, :, :)
    end select
  end subroutine conserved_form

  !> True if, for the degrees of freedom `chosen`, M, B and C are constant, B is antisymmetric and C symmetric, except for rounding
  !> errors.
  logical function is_gyroscopic(system, chosen)
    class(second_order_system), intent(in) :: system
    integer, intent(in) :: chosen(:)
    real(dp), parameter :: rounding = 64 * epsilon(1.0_dp)
    real(dp), dimension(4 * system%least_steps, system%states / 2, system%states / 2) :: m, b, c
    real(dp) :: mass, rate
    integer :: j, k

    call system%sample_second_order([((k - 1.0_dp) / size(m, 1), k = 1, size(m, 1))], m, b, c)
    rate = 2 * pi / system%period
    is_gyroscopic = .true.
    do j = 1, size(chosen)
      do k = 1, size(chosen)
        associate (here => chosen(j), other => chosen(k))
          mass = rounding * sqrt(abs(m(1, here, here) * m(1, other, other)))
          is_gyroscopic = is_gyroscopic .and. all(abs(m(:, here, other) - m(1, here, other)) <= mass &
            & .and. abs(b(:, here, other) + b(1, other, here)) <= rate * mass &
            & .and. abs(c(:, here, other) - c(1, other, here)) <= rate**2 * mass + rounding * abs(c(1, here, here)))
        end associate
      end do
    end do
  end function is_gyroscopic

  !> Computes the load h(t), shape (f). It is zero unless a model overrides this procedure.
  subroutine no_load(self, t, h)
    class(second_order_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    associate (unused_system => self, unused_time => t)
    end associate
    h = 0
  end subroutine no_load

  !> Computes M, B, C, each of shape (points, f, f), and if requested h, shape (points, f), at many phases t / T. The phase is the
  !> first index, so that loops over the phases run in vector registers. Integrators call only this procedure. A model that computes
  !> coefficients at many phases more cheaply overrides this procedure.
  subroutine sample_second_order(self, phases, m, b, c, h)
    class(second_order_system), intent(in) :: self
    !> Phases t / T in [0, 1]
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    real(dp), dimension(size(m, 2), size(m, 2)) :: m1, b1, c1
    real(dp) :: h1(size(m, 2))
    integer :: k

    do k = 1, size(phases)
      call self%matrices(phases(k) * self%period, m1, b1, c1)
      m(k, :, :) = m1
      b(k, :, :) = b1
      c(k, :, :) = c1
      if (.not. present(h)) cycle
      call self%load(phases(k) * self%period, h1)
      h(k, :) = h1
    end do
  end subroutine sample_second_order

  !> Computes U M U, U B U, U C U and U h at many phases. U = diag(units) consists of powers of two that make the diagonal of M
  !> about 1. In the coordinates U^-1 q, elimination with pivoting does not depend on the units of masses and moments of inertia.
  subroutine sample_in_units(system, phases, m, b, c, units, h)
    class(second_order_system), intent(in) :: system
    !> Phases t / T
    real(dp), contiguous, intent(in) :: phases(:)
    !> U M U, U B U, U C U with U = diag(units), each of shape (phases, f, f); `units` has shape (f)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :), units(:)
    !> U h, shape (phases, f)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    real(dp) :: mass
    integer :: i, j

    call system%sample_second_order(phases, m, b, c, h)
    ! A power of two near 1 / sqrt of the largest mass. Vectorised by hand: maxval tests every element for NaN.
    do i = 1, size(units)
      mass = 0
      do j = 1, size(phases)
        mass = max(mass, abs(m(j, i, i)))
      end do
      units(i) = 1
      if (mass > 0 .and. mass <= huge(mass)) units(i) = scale(1.0_dp, -exponent(mass) / 2)
    end do
    do j = 1, size(units)
      do i = 1, size(units)
        m(:, i, j) = units(i) * units(j) * m(:, i, j)
        b(:, i, j) = units(i) * units(j) * b(:, i, j)
        c(:, i, j) = units(i) * units(j) * c(:, i, j)
      end do
      if (present(h)) h(:, j) = units(j) * h(:, j)
    end do
  end subroutine sample_in_units

  !> Computes the trace of the first-order matrix P at many phases, shape (phases). By equation (22) it is -tr M^-1 B. The trace is
  !> NaN where M is singular.
  subroutine sample_traces(system, phases, traces)
    class(second_order_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(out) :: traces(:)
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
    real(dp) :: units(system%states / 2)
    integer :: f, i

    f = system%states / 2
    allocate(m(size(phases), f, f), b(size(phases), f, f), c(size(phases), f, f))
    call sample_in_units(system, phases, m, b, c, units)
    call solve_mass(m, b)
    traces = 0
    do i = 1, f
      traces = traces - b(:, i, i)
    end do
  end subroutine sample_traces

  !> Computes the lower half of the first-order matrix P at many phases, shape (phases, f, 2 f). By equation (22) it is [-M^-1 C,
  !> -M^-1 B]. If requested, also computes M^-1 h of equation (21), shape (phases, f). The results are NaN where M is singular.
  subroutine sample_accelerations(system, phases, of_states, of_load)
    class(second_order_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(out) :: of_states(:, :, :)
    real(dp), intent(out), optional :: of_load(:, :)
    !> Mass matrix M, and the columns of C, B and h side by side
    real(dp), allocatable :: m(:, :, :), right(:, :, :)
    real(dp) :: units(system%states / 2)
    integer :: f, i, j

    f = system%states / 2
    allocate(m(size(phases), f, f), right(size(phases), f, merge(2 * f + 1, 2 * f, present(of_load))))
    if (present(of_load)) then
      call sample_in_units(system, phases, m, right(:, :, f + 1:2 * f), right(:, :, :f), units, right(:, :, 2 * f + 1))
    else
      call sample_in_units(system, phases, m, right(:, :, f + 1:2 * f), right(:, :, :f), units)
    end if
    right(:, :, :2 * f) = -right(:, :, :2 * f)
    call solve_mass(m, right)

    ! From U^-1 q and U^-1 q' to q and q'.
    do j = 1, f
      do i = 1, f
        of_states(:, i, j) = units(i) * right(:, i, j) / units(j)
        of_states(:, i, f + j) = units(i) * right(:, i, f + j) / units(j)
      end do
      if (present(of_load)) of_load(:, j) = units(j) * right(:, j, 2 * f + 1)
    end do
  end subroutine sample_accelerations

  !> Computes the first-order matrix P of any system, shape (phases, n, n), and if requested the forcing f, shape (phases, n).
  !> The phase is the first index.
  subroutine sample_by_phase(system, phases, p, f)
    class(periodic_system), intent(in) :: system
    !> Phases t / T in [0, 1]
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(out) :: p(:, :, :)
    real(dp), intent(out), optional :: f(:, :)
    real(dp), allocatable :: many(:, :, :), loads(:, :)
    integer :: half, i

    select type (system)
    class is (second_order_system)
      half = system%states / 2
      p(:, :half, :) = 0
      do i = 1, half
        p(:, i, half + i) = 1
      end do
      if (present(f)) then
        f(:, :half) = 0
        call sample_accelerations(system, phases, p(:, half + 1:, :), f(:, half + 1:))
      else
        call sample_accelerations(system, phases, p(:, half + 1:, :))
      end if
    class default
      allocate(many(system%states, system%states, size(phases)))
      ! An unallocated variable counts as an absent argument.
      if (present(f)) allocate(loads(system%states, size(phases)))
      call system%sample(phases, many, loads)
      do i = 1, size(phases)
        p(i, :, :) = many(:, :, i)
        if (present(f)) f(i, :) = loads(:, i)
      end do
    end select
  end subroutine sample_by_phase

  !> Computes the first-order matrix P(t) of equation (22), shape (n, n).
  subroutine first_order_matrix(self, t, p)
    class(second_order_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp) :: many(self%states, self%states, 1)

    call self%sample([t / self%period], many)
    p = many(:, :, 1)
  end subroutine first_order_matrix

  !> Computes the first-order forcing f(t) of equation (21), shape (n).
  subroutine first_order_forcing(self, t, f)
    class(second_order_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)
    real(dp) :: p(self%states, self%states, 1), many(self%states, 1)

    call self%sample([t / self%period], p, many)
    f = many(:, 1)
  end subroutine first_order_forcing

  !> Computes the first-order matrix P = [0 E; -M^-1 C, -M^-1 B] and the forcing f = [0; M^-1 h] of equations (21) and (22), at many
  !> phases. The results are NaN where M is singular.
  subroutine sample_first_order(self, phases, p, f)
    class(second_order_system), intent(in) :: self
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: p(:, :, :)
    real(dp), intent(out), optional :: f(:, :)
    real(dp), allocatable :: of_states(:, :, :), of_load(:, :)
    real(dp) :: all_phases(size(phases))
    integer :: n, i, k

    n = self%states / 2
    all_phases = phases
    allocate(of_states(size(phases), n, 2 * n))
    ! An unallocated variable counts as an absent argument.
    if (present(f)) allocate(of_load(size(phases), n))
    call sample_accelerations(self, all_phases, of_states, of_load)

    p(:n, :, :) = 0
    do k = 1, size(phases)
      do i = 1, n
        p(i, n + i, k) = 1
      end do
      p(n + 1:, :, k) = of_states(k, :, :)
      if (.not. present(f)) cycle
      f(:n, k) = 0
      f(n + 1:, k) = of_load(k, :)
    end do
  end subroutine sample_first_order

end module gestell_system_second_order
