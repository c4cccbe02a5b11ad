!> Solves a linear system with periodic coefficients that a user defines: multipliers, verdict and periodic motion.
module gestell_api_system
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_api_guarded, only: explain_failure, guard, watch_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_floquet_solution, only: floquet_type, follow, solve_floquet, solve_multipliers, solve_periodic, bound_motion_errors
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: solve_system

  !> Results for a linear system with periodic coefficients.
  type, public :: motion_type
    !> "stable", "unstable" or "undecided"; never "undamped", because nothing is known about the damping of a user's system
    character(len=9) :: verdict = ""
    !> `multipliers`: multipliers rho in descending magnitude; `exponents`: characteristic exponents ln(rho) / T (1/s). Both have
    !> one element for each state
    complex(dp), allocatable :: multipliers(:), exponents(:)
    !> Absolute bounds on the errors of the multipliers, shape (states)
    real(dp), allocatable :: errors(:)
    !> `x`: periodic motion at equidistant times from 0 to T, both ends included, shape (states, points + 1). `x_error`: for each
    !> state, a bound on its error that holds at all these times. Both are allocated only if a motion was requested
    real(dp), allocatable :: x(:, :), x_error(:)
  end type motion_type

  integer, parameter :: max_points = 1000000

contains

  !> Solves a linear system with periodic coefficients. Fails if the tolerance is out of range or cannot be reached, or if the
  !> system is faulty: coefficients that are not finite or not smooth, a singular mass matrix, or a period that is far too long.
  !> Such faults are found within 100,000 calls. Also fails if a motion is requested at an undamped resonance; the multipliers are
  !> returned even then.
  subroutine solve_system(system, motion, error, tolerance, points)
    !> Extends `second_order_system` (M q'' + B q' + C q = h) or `periodic_system` (x' = P x + f)
    class(periodic_system), intent(in) :: system
    !> Receives the multipliers, the verdict and, if requested, the periodic motion
    type(motion_type), intent(out) :: motion
    type(error_type), allocatable, intent(out) :: error
    !> Relative tolerance of the multipliers and the motion
    real(dp), intent(in), optional :: tolerance
    !> Number of intervals into which the period is divided for the periodic motion, 1 to 1,000,000. If absent, no motion is
    !> computed
    integer, intent(in), optional :: points
    class(periodic_system), allocatable :: guarded
    type(watch_type), target :: watch
    type(accuracy_type) :: accuracy
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: start
    type(turn_errors_type) :: errors
    real(dp), allocatable :: phases(:)
    integer :: k

    if (present(tolerance)) accuracy%tolerance = tolerance
    if (present(points)) then
      if (points < 1 .or. points > max_points) call fatal_error(error, &
        & "the number of points of the motion must lie between 1 and 1000000", invalid_input)
      if (allocated(error)) return
    end if
    call system%check(error)
    if (allocated(error)) return
    call guard(system, watch, guarded)
    call solve_floquet(guarded, accuracy, present(points), floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
    call explain_failure(system, watch, error)
    if (allocated(error)) return
    motion%verdict = multipliers%verdict()
    motion%multipliers = multipliers%rho
    motion%exponents = multipliers%exponent
    motion%errors = abs(multipliers%rho) * multipliers%error
    if (.not. present(points)) return
    phases = [(real(k, dp) / points, k = 0, points)]
    allocate(motion%x(system%states, points + 1))
    call solve_periodic(floquet, start, error)
    if (.not. allocated(error)) call follow(guarded, floquet, start, phases, motion%x, error)
    if (.not. allocated(error)) call bound_motion_errors(guarded, floquet, phases, motion%x, errors, error)
    if (.not. allocated(error)) motion%x_error = errors%bounds()
    call explain_failure(system, watch, error)
    if (allocated(error)) deallocate(motion%x)
  end subroutine solve_system

end module gestell_api_system
