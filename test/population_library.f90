!> The library's results for a machine of the population. Only this module knows how the library is called.
module population_library
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_choice_methods, only: method_names
  use gestell_floquet_solution_integrated, only: integrated_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type, nothing_known
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: floquet_type, liouville_defect, solve_floquet, solve_multipliers, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: accelerations
  use gestell_study_vibration, only: quantities, solve_vibration, vibration_type
  use machines, only: frame_of_machine
  use reference_machine, only: machine_data
  implicit none (type, external)
  private

  public :: all_methods, largest_log_abs, solve_by_library

  integer, parameter, public :: name_length = 12
  !> Numbers of times per turn at which the vibration is reported, of its rows (the quantities of a vibration, then the
  !> accelerations), and of its orders.
  integer, parameter, public :: turn_points = 64, turn_rows = quantities + 3, orders = 16

  !> The library's results for a machine; all shapes (n) or (n, n).
  type, public :: claim_type
    !> Why there are no results, or no vibration; empty if there are.
    character(len=:), allocatable :: refusal, x0_refusal
    !> The mechanism cannot turn.
    logical :: impossible = .false.
    !> Multipliers, bounds on their errors, absolute and relative, and ln |rho|.
    complex(dp), allocatable :: rho(:)
    real(dp), allocatable :: bound(:), error(:), log_abs(:)
    character(len=9) :: verdict = ""
    !> Start of the periodic vibration and the bounds on its errors; units that make the states comparable.
    real(dp), allocatable :: x0(:), x0_error(:), scale(:)
    !> The vibration over the turn: rows at the times k T / turn_points, bounds that hold at all times, peaks with bounds, roots of
    !> the mean square, amplitudes, shape (orders, quantities); unallocated where it is declined.
    real(dp), allocatable :: turn(:, :), turn_error(:), peak(:), peak_error(:), rms(:), amplitude(:, :)
    !> Phi(T), its norm and the bound on the norm of its error, in those units; unallocated where it was not needed.
    real(dp), allocatable :: phi(:, :)
    real(dp) :: norm = 0, phi_error = 0
    !> ln |det Phi(T)| - integral of tr P, of the uncoupled part where it is largest.
    real(dp) :: liouville_defect = 0
  end type claim_type

contains

  !> The names of all methods.
  function all_methods() result(names)
    character(len=name_length), allocatable :: names(:)

    names = method_names()
  end function all_methods

  subroutine solve_by_library(machine, tolerance, method, claim, steps)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: tolerance
    character(len=*), intent(in) :: method
    type(claim_type), intent(out) :: claim
    integer, intent(in), optional :: steps
    type(accuracy_type) :: accuracy
    type(frame_type) :: frame
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: periodic
    type(error_type), allocatable :: error

    claim%refusal = ""
    claim%x0_refusal = ""
    call frame_of_machine(machine, frame, error)
    claim%impossible = allocated(error)
    accuracy%tolerance = tolerance
    accuracy%method = trim(method)
    if (present(steps)) accuracy%steps = steps
    if (.not. allocated(error)) call solve_floquet(frame, accuracy, .true., floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
    if (allocated(error)) then
      claim%refusal = error%message
      return
    end if
    claim%rho = multipliers%rho
    claim%error = multipliers%error
    claim%bound = merge(huge(1.0_dp), multipliers%error * abs(multipliers%rho), multipliers%error >= nothing_known)
    claim%log_abs = multipliers%log_abs
    claim%verdict = multipliers%verdict()
    claim%scale = floquet%scale
    call assemble(frame, floquet, claim)
    call solve_periodic(floquet, periodic, error)
    if (allocated(error)) then
      claim%x0_refusal = error%message
    else
      claim%x0 = periodic%x0
      claim%x0_error = periodic%error
      call read_turn(frame, floquet, claim)
    end if
  end subroutine solve_by_library

  !> The vibration over the turn, unless it is declined.
  subroutine read_turn(frame, floquet, claim)
    type(frame_type), intent(in) :: frame
    type(floquet_type), intent(in) :: floquet
    type(claim_type), intent(inout) :: claim
    type(vibration_type) :: vibration
    type(error_type), allocatable :: error
    integer :: k

    call solve_vibration(frame, floquet, turn_points, orders, vibration, error, accelerations)
    if (allocated(error)) return
    allocate(claim%turn(turn_rows, turn_points), claim%turn_error(turn_rows), claim%amplitude(orders, quantities))
    claim%turn(:quantities, :) = vibration%history(:, 2:)
    claim%turn(quantities + 1:, :) = vibration%motion_history(7:9, 2:)
    claim%turn_error(:quantities) = vibration%error
    associate (bounds => vibration%motion_errors%bounds())
      claim%turn_error(quantities + 1:) = bounds(7:9)
    end associate
    claim%x0 = vibration%start%x0
    claim%x0_error = vibration%start%error
    claim%peak = vibration%peak
    claim%peak_error = vibration%peak_error
    claim%rms = vibration%rms
    do k = 1, quantities
      claim%amplitude(:, k) = vibration%series(k)%amplitude(:orders)
    end do
  end subroutine read_turn

  !> Phi(T) from its parts, if all of them have been integrated.
  subroutine assemble(frame, floquet, claim)
    type(frame_type), intent(in) :: frame
    type(floquet_type), intent(in) :: floquet
    type(claim_type), intent(inout) :: claim
    real(dp), allocatable :: phi(:, :)
    type(error_type), allocatable :: error
    real(dp) :: norm, phi_error
    integer :: n, k

    n = size(floquet%scale)
    norm = 0
    phi_error = 0
    allocate(phi(n, n), source=0.0_dp)
    do k = 1, size(floquet%parts)
      select type (part => floquet%parts(k)%solution)
      type is (integrated_type)
        associate (m => part%monodromy, states => floquet%parts(k)%states)
          phi(states, states) = m%phi
          norm = hypot(norm, m%norm)
          phi_error = hypot(phi_error, m%error)
        end associate
      class default
        return
      end select
    end do
    call move_alloc(phi, claim%phi)
    claim%norm = norm
    claim%phi_error = phi_error
    call liouville_defect(frame, floquet, claim%liouville_defect, error)
    if (allocated(error)) claim%refusal = error%message
  end subroutine assemble

  !> ln rho_max at the least tolerance; `failed` where the library declines.
  subroutine largest_log_abs(machine, value, failed)
    type(machine_data), intent(in) :: machine
    real(dp), intent(out) :: value
    logical, intent(out) :: failed
    type(claim_type) :: claim

    call solve_by_library(machine, 1.0e-13_dp, "auto", claim)
    failed = len(claim%refusal) > 0
    value = 0
    if (.not. failed) value = maxval(claim%log_abs)
  end subroutine largest_log_abs

end module population_library
