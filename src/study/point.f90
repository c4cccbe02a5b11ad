!> One point of a sweep by a solution of its own.
module gestell_study_point
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type
  use gestell_study_family, only: family_type
  use gestell_study_member, only: impossible_member, member_type
  use gestell_study_tile_results, only: all_columns, eta_peak, failed, has_multipliers, impossible, log_rho_max, psi_peak, &
    & rho_error, rho_max, stable, sweep_columns, undecided, unstable, verdict, verdict_behind, xi_peak
  use gestell_study_vibration, only: solve_vibration, vibration_type
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: peak_limit, solve_point, verdict_number

  !> What is computed at every point of a sweep.
  type, public :: sweep_order_type
    type(accuracy_type) :: accuracy
    !> The columns that are wanted.
    logical :: columns(sweep_columns) = all_columns
    !> 'auto', 'expansion' or 'direct'.
    character(len=9) :: engine = "auto"
    !> The model of the frame (gestell_study_frame_model), by which the family's members are.
    character(len=11) :: model = "exact"
  end type sweep_order_type

contains

  !> All columns of a point; those that are not wanted or have no number are NaN. Error: the parameters make no sense.
  subroutine solve_point(family, parameters, order, values, error)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    type(sweep_order_type), intent(in) :: order
    real(dp), intent(out) :: values(sweep_columns)
    type(error_type), allocatable, intent(out) :: error
    type(member_type) :: member
    type(multipliers_type) :: multipliers
    logical :: peaks

    values = ieee_value(1.0_dp, ieee_quiet_nan)
    peaks = any(order%columns(xi_peak:psi_peak))
    call member%make(family, parameters, error)
    if (.not. allocated(error)) call member%solve(order%accuracy, peaks, error)
    if (has_multipliers(order%columns) .and. .not. allocated(error)) call member%multipliers(.false., multipliers, error)
    values([verdict, verdict_behind]) = merge(impossible, failed, member%state == impossible_member)
    if (allocated(error) .or. .not. member%is_sound()) return
    if (has_multipliers(order%columns)) then
      values(rho_max) = abs(multipliers%rho(1))
      values(log_rho_max) = multipliers%log_abs(1)
      values(rho_error) = multipliers%error(1)
      values([verdict, verdict_behind]) = verdict_number(multipliers)
    end if
    if (peaks) call set_peaks(member%system, member%floquet, values)
  end subroutine solve_point

  !> Relative error of the vibration, in the norm of balanced units, that is allowed where the peaks come from an expansion: beside
  !> a resonance its error is many times that of Phi.
  pure real(dp) function peak_limit(order)
    type(sweep_order_type), intent(in) :: order

    peak_limit = 1000 * order%accuracy%tolerance
  end function peak_limit

  !> The peaks of a frame's vibration; a resonance has none, nor has another system.
  subroutine set_peaks(system, floquet, values)
    class(periodic_system), intent(in) :: system
    type(floquet_type), intent(in) :: floquet
    real(dp), intent(inout) :: values(sweep_columns)
    integer, parameter :: rows = 64, harmonics = 20
    type(vibration_type) :: vibration
    type(error_type), allocatable :: error

    call solve_vibration(system, floquet, rows, harmonics, vibration, error)
    if (.not. allocated(error)) values([xi_peak, eta_peak, psi_peak]) = vibration%peak(:3)
  end subroutine set_peaks

  !> The verdict as a number.
  pure integer function verdict_number(multipliers) result(number)
    type(multipliers_type), intent(in) :: multipliers

    select case (multipliers%verdict())
    case ("stable")
      number = stable
    case ("unstable")
      number = unstable
    case default
      number = undecided
    end select
  end function verdict_number

end module gestell_study_point
