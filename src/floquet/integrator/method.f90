!> Base type of the integration methods. A method computes the affine map of each step,
!>
!>     x(end of step) = A x(start of step) + b,
!>
!> and an estimate of the computing time of a step.
module gestell_floquet_integrator_method
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: evaluation_work, matrix_work, product_work

  !> Effects of variations of the coefficients and loads between the nodes of a step, summed over the steps. The method does not
  !> see these variations
  type, public :: unresolved_type
    !> `coefficients`: phase error (radians) due to variations of the coefficients. `turns`: phase advance (radians) of the
    !> fastest motion. `load`, `loads`, `missed`: integrals over time of the size of the loads, of the error of their quadrature,
    !> and of the error of their interpolation.
    real(dp) :: coefficients = 0, loads = 0, turns = 0, load = 0, missed = 0
    !> Number of steps
    integer :: steps = 0
    !> `fitted(1)`, `fitted(2)`: sums over the steps of the squares and of the fourth powers of the phase advances (radians per
    !> step) to which the steps are fitted
    real(dp) :: fitted(2) = 0
    !> Bounds on the changes of the last f states due to the error of the loads, shape (f). In a system with positions these states
    !> are the velocities.
    real(dp), allocatable :: velocity_errors(:)
  end type unresolved_type

  !> Maximum length of a method's name
  integer, parameter, public :: name_length = 9

  !> Base type of all integration methods
  type, abstract, public :: method_type
    !> Name by which a user selects the method
    character(len=name_length) :: name = ""
    !> Order of the method: the error of Phi(T) falls like steps**(-order)
    integer :: order = 0
    !> Number of evaluations of the coefficients per step. If two steps share an end, the evaluation at this end counts once
    integer :: stages = 0
    !> Error constant: if the phase of the fastest motion advances by theta radians in a period of N steps, the relative error of
    !> Phi(T) is about
    !>
    !>     error_constant theta (theta / N)**order.
    real(dp) :: error_constant = 0
    !> True if the method is exact for constant P. Its error is then the error predicted by `error_constant`, times the relative
    !> variation of P over the period. The error is smaller still if the phase advance theta (radians per period) of the fastest
    !> motion exceeds m = `least_steps`, the number of steps that resolve P. It is then also multiplied by (m / theta)**3,
    !> because errors of a motion much faster than the changes of P nearly cancel.
    logical :: exact_if_constant = .false.
    !> Order of the first embedded method; 0 if the method has no embedded methods
    integer :: lower_order = 0
    !> Error constant of the first embedded method
    real(dp) :: lower_constant = 0
    !> Maximum phase advance (radians) of the fastest motion in a step. In longer steps `pair` may need row exchanges, which are
    !> slow.
    real(dp) :: longest_turn = huge(1.0_dp)
  contains
    procedure :: prepare => default_prepare, phases => default_phases, steps_at_once => one_step
    procedure(step_maps), deferred :: maps
    procedure :: pair => default_pair
    procedure(step_work), deferred :: work
  end type method_type

  abstract interface
    !> Computes the maps of the steps from phase `from(k)` to phase `to(k)`. The steps need not be consecutive. Fails if the
    !> equations of a step are singular.
    subroutine step_maps(self, system, from, to, map, error)
      import :: method_type, periodic_system, error_type, dp
      implicit none (type, external)
      class(method_type), intent(in) :: self
      class(periodic_system), intent(in) :: system
      !> Start and end of each step, as phases t / T
      real(dp), intent(in) :: from(:), to(:)
      !> Maps [A b] of the steps, shape (steps or more, n, n + 1); or A alone, shape (steps or more, n, n), if no forced solution is
      !> requested
      real(dp), contiguous, intent(out) :: map(:, :, :)
      type(error_type), allocatable, intent(out) :: error
    end subroutine step_maps

    !> Computing time of a step, approximately in nanoseconds, for a system with this number of states. The evaluation of the
    !> coefficients is included. The formulas are fitted to measured times of systems with 2, 6 and 12 states (Debian's BLAS).
    !> Only the ratios of the times matter.
    pure real(dp) function step_work(self, states, second_order) result(work)
      import :: method_type, dp
      implicit none (type, external)
      class(method_type), intent(in) :: self
      integer, intent(in) :: states
      logical, intent(in) :: second_order
    end function step_work
  end interface

contains

  !> Default of `prepare`, which does nothing. A method overrides this default to compute its coefficients. Name, order and
  !> constants of a method are known before `prepare` is called.
  pure subroutine default_prepare(self)
    class(method_type), intent(inout) :: self

    associate (unused => self)
    end associate
  end subroutine default_prepare

  !> Default of `pair`, for methods without embedded methods. It computes the maps as `maps` does, and returns copies of them as the
  !> maps of both embedded methods.
  subroutine default_pair(self, system, from, to, map, error, lower, unresolved)
    class(method_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    !> Start and end of each step, as phases t / T
    real(dp), intent(in) :: from(:), to(:)
    !> `map`: maps of the method, as in `maps`. `lower`: maps of the two embedded methods, shape (steps or more, n, n or n + 1, 2).
    real(dp), contiguous, intent(out) :: map(:, :, :), lower(:, :, :, :)
    type(error_type), allocatable, intent(out) :: error
    !> Effects of variations of the coefficients and loads between the nodes, summed over the steps; a method with embedded
    !> methods adds the effects in the steps of this call
    type(unresolved_type), intent(inout) :: unresolved

    associate (nothing_new => unresolved)
    end associate
    call self%maps(system, from, to, map, error)
    lower(:, :, :, 1) = map
    lower(:, :, :, 2) = map
  end subroutine default_pair

  !> Default of `phases`: an empty list. A method may override this default to return the phases at which `maps` samples the
  !> coefficients, in the order of sampling. A model may then evaluate its coefficients at these phases in advance.
  pure function default_phases(self, from, to) result(phases)
    class(method_type), intent(in) :: self
    real(dp), intent(in) :: from(:), to(:)
    real(dp), allocatable :: phases(:)

    associate (unused_method => self, unused_start => from, unused_end => to)
    end associate
    allocate(phases(0))
  end function default_phases

  !> Default of `steps_at_once`: 1, for methods that compute each step separately. Other methods return the number of steps that
  !> they compute together. Fewer steps than this number take just as long.
  pure integer function one_step(self, states, second_order)
    class(method_type), intent(in) :: self
    integer, intent(in) :: states
    logical, intent(in) :: second_order

    associate (unused_method => self, unused_states => states, unused_kind => second_order)
    end associate
    one_step = 1
  end function one_step

  !> Computing time of one evaluation of the coefficients, in the units of `step_work`. M, B, C and h of a frame take 15 to 25
  !> per phase if many phases are evaluated at once. A user's model that evaluates one time per call takes 40 or more. A matrix P
  !> given by short formulas takes little.
  pure real(dp) function evaluation_work(second_order) result(work)
    logical, intent(in) :: second_order

    work = merge(40.0_dp, 30.0_dp, second_order)
  end function evaluation_work

  !> Computing time of one evaluation of P and f, in the units of `step_work`. If P and f are computed from M, B, C and h, this time
  !> includes the elimination of M.
  pure real(dp) function matrix_work(states, second_order) result(work)
    integer, intent(in) :: states
    logical, intent(in) :: second_order

    work = evaluation_work(second_order)
    if (second_order) work = work + 20 + 2.5_dp * states**2
  end function matrix_work

  !> Computing time of the product of two matrices with n rows, in the units of `step_work`. For the small n that occur here it
  !> grows like n^2.
  pure real(dp) function product_work(n) result(work)
    integer, intent(in) :: n

    work = 3.2_dp * n**2
  end function product_work

end module gestell_floquet_integrator_method
