!> The columns of a sweep, one record each, and the results of a tile.
module gestell_study_tile_results
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: peaks_of

  !> Numbers of the columns, in the order in which files list them; peaks in the order of the frame's degrees of freedom.
  integer, parameter, public :: rho_max = 1, log_rho_max = 2, rho_error = 3, verdict = 4, xi_peak = 5, eta_peak = 6, &
    & psi_peak = 7, last_peak = 10, sweep_columns = 10

  !> What a sweep can report of every point.
  type, public :: sweep_column_type
    !> Name in the input and in files, which ends with the unit
    character(len=16) :: name = ""
    !> Unit of the numbers; symbol in pictures
    character(len=3) :: unit = ""
    character(len=7) :: symbol = ""
    !> Name of the column with the error
    character(len=9) :: error = ""
    !> Whether numbers may be negative: then they take one character more
    logical :: signed = .false.
  end type sweep_column_type

  type(sweep_column_type), parameter, public :: column_records(sweep_columns) = [ &
    & sweep_column_type("rho_max", error="rho_error"), &
    & sweep_column_type("log_rho_max", signed=.true.), &
    & sweep_column_type("rho_error"), &
    & sweep_column_type("verdict"), &
    & sweep_column_type("xi_peak_m", "m", "ξ"), &
    & sweep_column_type("eta_peak_m", "m", "η"), &
    & sweep_column_type("psi_peak_rad", "rad", "ψ"), &
    & sweep_column_type("zeta_peak_m", "m", "ζ"), &
    & sweep_column_type("rot_xi_peak_rad", "rad", "rot ξ"), &
    & sweep_column_type("rot_eta_peak_rad", "rad", "rot η")]

  type, public :: tile_results_type
    !> The numbers of the requested columns and behind them measures with their errors, NaN where there is none, the verdict as its
    !> number (gestell_base_verdict); shape (numbers, points of the second axis, points of the first).
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
    integer :: k

    columns = [(k >= xi_peak .and. k < xi_peak + dofs, k = 1, sweep_columns)]
  end function peaks_of

end module gestell_study_tile_results
