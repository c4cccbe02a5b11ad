!> Defines the columns of a sweep, with one record for each column, and stores the results of one tile (a rectangle of grid
!> points).
module gestell_study_tile_results
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: peaks_of

  !> Index of each column, in the order in which files list the columns. The peaks follow the order of the frame's degrees of
  !> freedom.
  integer, parameter, public :: rho_max = 1, log_rho_max = 2, rho_error = 3, verdict = 4, xi_peak = 5, eta_peak = 6, &
    & psi_peak = 7, last_peak = 10, sweep_columns = 10

  !> A column of the table that a sweep can report.
  type, public :: sweep_column_type
    !> Name of the column in the input and in files; it ends with the unit
    character(len=16) :: name = ""
    !> Unit of the values
    character(len=3) :: unit = ""
    !> Symbol of the column in pictures
    character(len=7) :: symbol = ""
    !> Name of the column that holds the error bound
    character(len=9) :: error = ""
    !> True if values may be negative; they are then printed one character wider
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

  !> Results of a sweep for one tile (a rectangle of grid points).
  type, public :: tile_results_type
    !> Values at all points, shape (values, points of axis 2, points of axis 1): first the requested columns, then the measures with
    !> their errors. NaN where a value does not exist. Verdicts are stored as numbers (gestell_base_verdict)
    real(dp), allocatable :: values(:, :, :)
    !> Number of solutions that were computed, both at points solved directly and at the support points of expansions
    integer :: solutions = 0
    !> Number of points at which the result of an expansion was checked against a direct solution
    integer :: checks = 0
    !> Largest deviation of the expansion from the direct solution at the checked points, relative to the size of the direct
    !> solution. The monodromy matrix Phi is compared, with vibrations also Phi together with the motion forced from rest
    real(dp) :: deviation = 0
  end type tile_results_type

contains

  !> True for the columns that are peaks of degrees of freedom of a frame with `dofs` degrees of freedom, shape (columns).
  pure function peaks_of(dofs) result(columns)
    integer, intent(in) :: dofs
    logical :: columns(sweep_columns)
    integer :: k

    columns = [(k >= xi_peak .and. k < xi_peak + dofs, k = 1, sweep_columns)]
  end function peaks_of

end module gestell_study_tile_results
