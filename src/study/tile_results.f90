!> What a sweep tells of a point.
module gestell_study_tile_results
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: has_multipliers, peaks_of, verdict_column

  !> Columns, in the order in which they are written; peaks in the order of the frame's degrees of freedom.
  integer, parameter, public :: rho_max = 1, log_rho_max = 2, rho_error = 3, verdict = 4, xi_peak = 5, eta_peak = 6, &
    & psi_peak = 7, last_peak = 10, sweep_columns = 11
  !> The verdict behind the peaks, where these were ordered without it: no peak is told of which nobody knows whether the machine
  !> keeps to that vibration.
  integer, parameter, public :: verdict_behind = 11
  character(len=16), parameter, public :: column_names(sweep_columns) = [character(len=16) :: "rho_max", "log_rho_max", &
    & "rho_error", "verdict", "xi_peak_m", "eta_peak_m", "psi_peak_rad", "zeta_peak_m", &
    & "rot_xi_peak_rad", "rot_eta_peak_rad", "verdict"]
  !> All that can be ordered of a frame in the plane, and no verdict twice.
  logical, parameter, public :: all_columns(sweep_columns) = [.true., .true., .true., .true., .true., .true., .true., .false., &
    & .false., .false., .false.]

  type, public :: tile_results_type
    !> The numbers of the columns that were ordered and behind them measures with their errors, NaN where there is none, the
    !> verdict as its number (gestell_base_verdict); shape (numbers, points of the second axis, points of the first).
    real(dp), allocatable :: values(:, :, :)
    !> Solutions that were computed point by point, and those that an expansion rests on.
    integer :: solutions = 0
    !> Points that were compared with solutions of their own, and the greatest deviation of Phi (and x_p) relative to its size.
    integer :: checks = 0
    real(dp) :: deviation = 0
  end type tile_results_type

contains

  !> Which columns are peaks of a frame with so many degrees of freedom.
  pure function peaks_of(dofs) result(columns)
    integer, intent(in) :: dofs
    logical :: columns(sweep_columns)

    columns = .false.
    columns(xi_peak:xi_peak - 1 + dofs) = .true.
  end function peaks_of

  !> Whether any of the columns tells of the multipliers.
  pure logical function has_multipliers(columns)
    logical, intent(in) :: columns(sweep_columns)

    has_multipliers = any(columns([rho_max, log_rho_max, rho_error, verdict, verdict_behind]))
  end function has_multipliers

  !> The place of the verdict among the columns that are written; 0: none.
  pure integer function verdict_column(columns)
    logical, intent(in) :: columns(sweep_columns)

    verdict_column = 0
    if (columns(verdict_behind)) verdict_column = count(columns)
    if (columns(verdict)) verdict_column = count(columns(:verdict))
  end function verdict_column

end module gestell_study_tile_results
