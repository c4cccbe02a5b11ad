!> Interface between models and Floquet analysis: a linear system with periodic coefficients,
!>
!>     x' = P(t) x + f(t),   P(t + T) = P(t),   f(t + T) = f(t).                                   (20)
!>
!> A model extends `periodic_system`, sets `states` and `period`, and provides `matrix`, and `forcing` if f is not zero. For
!> equations M q'' + B q' + C q = h extend `second_order_system` instead, with which M need not be inverted.
module gestell_system_periodic
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: check_periodic

  type, abstract, public :: periodic_system
    !> Number of states n
    integer :: states = 0
    !> Period T > 0, in the unit of the time t
    real(dp) :: period = 0
    !> Times in (0, T), ascending, at which the coefficients jump. An integration step ends at each of them.
    real(dp), allocatable :: breaks(:)
    !> Number of equal steps per period that resolves the fastest change of the coefficients. Integration methods without embedded
    !> methods use at least `least_steps` steps. Methods with embedded methods may use fewer steps, but at least as many nodes as
    !> `least_steps` steps with six stages have.
    integer :: least_steps = 8
    !> Relative error over a period caused by the rounding of the coefficients
    real(dp) :: rounding = epsilon(1.0_dp)
    !> Additional relative error of the forced motion caused by rounding of the forcing, for instance where forces cancel
    real(dp) :: load_rounding = 0
  contains
    procedure(matrix_at), deferred :: matrix
    procedure :: forcing => no_forcing, inherit, sample, coupled => all_coupled
    procedure :: conserves => no_known_conservation, check => check_periodic
  end type periodic_system

  abstract interface
    !> Computes the matrix P(t) of the equations x' = P x + f, shape (n, n), at the time `t` in [0, T].
    subroutine matrix_at(self, t, p)
      import :: periodic_system, dp
      implicit none (type, external)
      class(periodic_system), intent(in) :: self
      real(dp), intent(in) :: t
      real(dp), intent(out) :: p(:, :)
    end subroutine matrix_at
  end interface

  !> Maximum of `least_steps`
  integer, parameter :: most_least_steps = 2**17

contains

  !> Copies period, breaks, resolution and rounding errors from the system `from`. A system that is derived from `from` calls this
  !> procedure.
  pure subroutine inherit(self, from)
    class(periodic_system), intent(inout) :: self
    class(periodic_system), intent(in) :: from

    self%period = from%period
    self%least_steps = from%least_steps
    self%rounding = from%rounding
    self%load_rounding = from%load_rounding
    if (allocated(from%breaks)) self%breaks = from%breaks
  end subroutine inherit

  !> Checks the components of the system. Every procedure that solves a system calls this check first. If a model has more to check,
  !> its own check overrides this procedure and calls it. Fails if there are no states, if the period is not positive and finite, if
  !> the breaks are not ascending within the period, or if `least_steps` or a rounding error is out of range.
  subroutine check_periodic(self, error)
    class(periodic_system), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error
    logical :: ordered

    if (self%states < 1) then
      call fatal_error(error, "a system must have one state or more", invalid_input)
    else if (.not. (ieee_is_finite(self%period) .and. self%period > 0)) then
      call fatal_error(error, "the period must be positive and finite", invalid_input)
    else if (self%least_steps < 1 .or. self%least_steps > most_least_steps) then
      call fatal_error(error, "least_steps must lie between 1 and " // text(most_least_steps), invalid_input)
    else if (.not. all([self%rounding, self%load_rounding] >= 0 .and. ieee_is_finite([self%rounding, self%load_rounding]))) then
      call fatal_error(error, "rounding and load_rounding must be finite and not negative", invalid_input)
    else if (allocated(self%breaks)) then
      associate (phases => self%breaks / self%period)
        ordered = all(phases > 0 .and. phases < 1)
        if (ordered .and. size(phases) > 1) ordered = all(phases(2:) > phases(:size(phases) - 1))
      end associate
      if (.not. ordered) call fatal_error(error, "the breaks must be in ascending order, strictly between 0 and the period", &
        & invalid_input)
    end if
  end subroutine check_periodic

  !> Computes the forcing f(t), shape (n). It is zero unless a model overrides this procedure.
  subroutine no_forcing(self, t, f)
    class(periodic_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    associate (unused_system => self, unused_time => t)
    end associate
    f = 0
  end subroutine no_forcing

  !> Symmetric table, true for pairs of states that act on each other through P. For a second-order system the pairs are degrees of
  !> freedom. Parts that never act on each other are solved separately. All pairs are coupled unless a model overrides this
  !> function.
  function all_coupled(self) result(coupled)
    class(periodic_system), intent(in) :: self
    logical, allocatable :: coupled(:, :)

    allocate(coupled(self%states, self%states), source=.true.)
  end function all_coupled

  !> True if the equations of the states `chosen` (degrees of freedom for a second-order system) are those of a Lagrangian with
  !> periodic coefficients, without damping. Multipliers then come in pairs rho, 1 / conj(rho). The other states must not act on the
  !> chosen states. False unless a model overrides this function.
  logical function no_known_conservation(self, chosen) result(conserves)
    class(periodic_system), intent(in) :: self
    integer, intent(in) :: chosen(:)

    associate (unused_system => self, unused_states => chosen)
    end associate
    conserves = .false.
  end function no_known_conservation

  !> Computes the matrix P, shape (n, n, points), and if requested the forcing f, shape (n, points), at many phases t / T in [0, 1].
  !> Integrators call only this procedure. A model that computes coefficients at many phases more cheaply overrides this procedure.
  subroutine sample(self, phases, p, f)
    class(periodic_system), intent(in) :: self
    !> Phases t / T in [0, 1]
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: p(:, :, :)
    real(dp), intent(out), optional :: f(:, :)
    integer :: k

    do k = 1, size(phases)
      call self%matrix(phases(k) * self%period, p(:, :, k))
      if (present(f)) call self%forcing(phases(k) * self%period, f(:, k))
    end do
  end subroutine sample

end module gestell_system_periodic
