!> What every integration method of the library offers: the affine maps of single steps,
!>
!>     x(end of step) = A x(start of step) + b,
!>
!> and what its use costs.
module gestell_floquet_integrator_method
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: evaluation_work, matrix_work, product_work

  !> What the nodes of many steps may not tell of the coefficients (radians) and of the loads; the radians that these steps turn,
  !> the load itself, and what interpolation misses of it, length included.
  type, public :: unseen_type
    real(dp) :: coefficients = 0, loads = 0, turns = 0, load = 0, missed = 0
    !> Steps, and the squares and fourth powers of the angles that the motion turns by in these to which they are fitted.
    integer :: steps = 0
    real(dp) :: fitted(2) = 0
    !> By how much what is missed of the loads may change the last states, the velocities where there are positions.
    real(dp), allocatable :: kicks(:)
  end type unseen_type

  !> Length of a method's name.
  integer, parameter, public :: name_length = 9

  type, abstract, public :: method_type
    !> As a user names it.
    character(len=name_length) :: name = ""
    !> The error of Phi(T) falls like steps**(-order).
    integer :: order = 0
    !> Evaluations of the coefficients in a step; an end that two steps share counts once.
    integer :: stages = 0
    !> With N steps of a period in which the fastest motion turns by theta radians the relative error of Phi(T) is about
    !>
    !>     error_constant theta (theta / N)**order.
    real(dp) :: error_constant = 0
    !> Whether the method is exact where P is constant. Then the error is that, times the part of P that changes, times
    !> (m / theta)**3 where the fastest motion turns by more radians than the m steps that resolve P: the errors of a
    !> motion much faster than the changes of P nearly cancel.
    logical :: exact_if_constant = .false.
    !> Order and error constant of the method embedded in this one, whose maps `pair` gives beside its own; 0: there is none.
    integer :: lower_order = 0
    real(dp) :: lower_constant = 0
    !> How far the fastest motion may turn in a step (radians): beyond, `pair` may have to exchange rows, which takes long.
    real(dp) :: longest_turn = huge(1.0_dp)
  contains
    procedure :: prepare => nothing_to_prepare
    procedure :: phases => no_phases
    procedure :: steps_at_once => one_step
    procedure(step_maps), deferred :: maps
    procedure :: pair => no_pair
    procedure(step_work), deferred :: work
  end type method_type

  abstract interface
    !> The maps of the steps from phase `from(k)` to phase `to(k)`: [A b], shape (steps, n, n + 1), or, where the forced solution is
    !> not asked for, A alone, shape (steps, n, n). The steps need not follow each other; there may be room for more.
    !> Error: the equations of a step are singular.
    subroutine step_maps(self, system, from, to, map, error)
      import :: method_type, periodic_system, error_type, dp
      implicit none (type, external)
      class(method_type), intent(in) :: self
      class(periodic_system), intent(in) :: system
      real(dp), intent(in) :: from(:), to(:)
      real(dp), contiguous, intent(out) :: map(:, :, :)
      type(error_type), allocatable, intent(out) :: error
    end subroutine step_maps

    !> Work of a step for a system with so many states, evaluations of the coefficients included: nanoseconds where the
    !> formulas were fitted to measured times of systems with 2, 6 and 12 states (Debian's BLAS); only ratios count.
    pure function step_work(self, states, second_order) result(work)
      import :: method_type, dp
      implicit none (type, external)
      class(method_type), intent(in) :: self
      integer, intent(in) :: states
      logical, intent(in) :: second_order
      real(dp) :: work
    end function step_work
  end interface

contains

  !> Computes the coefficients of the method: the constants above need none.
  pure subroutine nothing_to_prepare(self)
    class(method_type), intent(inout) :: self

    associate (unused => self)
    end associate
  end subroutine nothing_to_prepare

  !> As `maps`, and the maps of the embedded method and of the one embedded in that: `lower`, shape (steps, n, n or n + 1, 2).
  !> `unseen` is added to.
  subroutine no_pair(self, system, from, to, map, error, lower, unseen)
    class(method_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: from(:), to(:)
    real(dp), contiguous, intent(out) :: map(:, :, :), lower(:, :, :, :)
    type(error_type), allocatable, intent(out) :: error
    type(unseen_type), intent(inout) :: unseen

    associate (nothing_new => unseen)
    end associate
    call self%maps(system, from, to, map, error)
    lower(:, :, :, 1) = map
    lower(:, :, :, 2) = map
  end subroutine no_pair

  !> The phases at which `maps` samples the coefficients of these steps, in its order: what a model may prepare. None where
  !> a method does not say.
  pure function no_phases(self, from, to) result(phases)
    class(method_type), intent(in) :: self
    real(dp), intent(in) :: from(:), to(:)
    real(dp), allocatable :: phases(:)

    associate (unused_method => self, unused_start => from, unused_end => to)
    end associate
    allocate(phases(0))
  end function no_phases

  !> How many steps are done side by side: fewer cost as much.
  pure integer function one_step(self, states, second_order)
    class(method_type), intent(in) :: self
    integer, intent(in) :: states
    logical, intent(in) :: second_order

    associate (unused_method => self, unused_states => states, unused_kind => second_order)
    end associate
    one_step = 1
  end function one_step

  !> Work of evaluating the coefficients once. M, B, C and h of a frame take 15 to 25 in bulk, those that a user wrote for
  !> one time 40 and more; a P that somebody wrote down is short.
  pure real(dp) function evaluation_work(second_order) result(work)
    logical, intent(in) :: second_order

    work = merge(40.0_dp, 30.0_dp, second_order)
  end function evaluation_work

  !> Work of evaluating P and f once; from M, B, C and h, M is eliminated.
  pure real(dp) function matrix_work(states, second_order) result(work)
    integer, intent(in) :: states
    logical, intent(in) :: second_order

    work = evaluation_work(second_order)
    if (second_order) work = work + 20 + 2.5_dp * states**2
  end function matrix_work

  !> Work of multiplying two matrices of n rows: for the small n in question it grows like n^2.
  pure real(dp) function product_work(n) result(work)
    integer, intent(in) :: n

    work = 3.2_dp * n**2
  end function product_work

end module gestell_floquet_integrator_method
