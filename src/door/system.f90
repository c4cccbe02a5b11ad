!> Any linear system with periodic coefficients, of a user's own: multipliers, verdict, periodic motion.
module gestell_door_system
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_door_guarded, only: explain_failure, guard, watch_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_floquet_solution, only: floquet_type, follow, solve_floquet, solve_multipliers, solve_periodic, take_errors
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: solve_system

  !> What is known of it.
  type, public :: motion_type
    !> stable, unstable or undecided (that nothing damps a system of a user's own is not known).
    character(len=9) :: verdict = ""
    !> Multipliers, the largest first, and bounds on their errors; shapes (states). Characteristic exponents ln(rho) / T.
    complex(dp), allocatable :: multipliers(:), exponents(:)
    real(dp), allocatable :: errors(:)
    !> The periodic motion at equidistant times from 0 to T, both included, shape (states, points + 1), and bounds on its error that
    !> hold at all times, shape (states); not allocated where it was not asked for.
    real(dp), allocatable :: x(:, :), x_error(:)
  end type motion_type

  integer, parameter :: most_points = 1000000

contains

  !> `system` extends `second_order_system` (M q'' + B q' + C q = h) or `periodic_system` (x' = P x + f). `points`: intervals of the
  !> periodic motion. Errors: a system that makes no sense; a tolerance out of range or out of reach; coefficients that are not
  !> finite or not smooth, a singular mass matrix, a period that is far too long, each within 100,000 calls of the coefficients;
  !> resonance, where a motion is asked for; then the multipliers are there.
  subroutine solve_system(system, motion, error, tolerance, points)
    class(periodic_system), intent(in) :: system
    type(motion_type), intent(out) :: motion
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: tolerance
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
      if (points < 1 .or. points > most_points) call fatal_error(error, "points of a motion: from 1 to 1000000", invalid_input)
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
    if (.not. allocated(error)) call take_errors(guarded, floquet, phases, motion%x, errors, error)
    if (.not. allocated(error)) motion%x_error = errors%bounds()
    call explain_failure(system, watch, error)
    if (allocated(error)) deallocate(motion%x)
  end subroutine solve_system

end module gestell_door_system
