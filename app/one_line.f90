!> Results as lines on standard output, for shell scripts: a header and a line for each case.
module one_line
  use cli, only: setting_type
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_io_configuration, only: configuration_type
  use gestell_io_sweep_csv, only: case_lines, header, rows
  use gestell_io_sweep_summary, only: summary_type
  use gestell_study_analysis, only: analysis_type
  use gestell_study_point, only: verdict_number
  use gestell_study_tile_results, only: eta_peak, log_rho_max, psi_peak, rho_error, rho_max, sweep_columns, verdict, xi_peak
  use sweeping, only: compute_all
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none (type, external)
  private

  public :: print_case, print_sweep

contains

  !> The machine of the input: what was set, then the columns of sweep.csv that its tasks ask for.
  subroutine print_case(settings, configuration, analysis)
    type(setting_type), intent(in) :: settings(:)
    type(configuration_type), intent(in) :: configuration
    type(analysis_type), intent(in) :: analysis
    real(dp) :: values(sweep_columns)
    logical :: columns(sweep_columns)
    character(len=:), allocatable :: assignments(:)
    integer :: i, longest

    longest = 1
    do i = 1, size(settings)
      longest = max(longest, len(settings(i)%assignment))
    end do
    allocate(character(len=longest) :: assignments(size(settings)))
    do i = 1, size(settings)
      assignments(i) = settings(i)%assignment
    end do
    columns = .false.
    columns([rho_max, log_rho_max, rho_error, verdict]) = configuration%tasks%stability .or. configuration%tasks%modes
    columns([xi_peak, eta_peak, psi_peak]) = configuration%tasks%response
    values = ieee_value(1.0_dp, ieee_quiet_nan)
    if (allocated(analysis%multipliers)) then
      associate (multipliers => analysis%multipliers)
        values([rho_max, log_rho_max, rho_error]) = [abs(multipliers%rho(1)), multipliers%log_abs(1), multipliers%error(1)]
        values(verdict) = verdict_number(multipliers)
      end associate
    end if
    if (allocated(analysis%vibration)) values([xi_peak, eta_peak, psi_peak]) = analysis%vibration%peak(:3)
    write (output_unit, "(a)", advance="no") case_lines(assignments, columns, values)
  end subroutine print_case

  !> All points of a sweep, in the grid's order. Error: they could not be computed.
  subroutine print_sweep(configuration, summary, error)
    type(configuration_type), intent(in) :: configuration
    type(summary_type), intent(out) :: summary
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: values(:, :, :)
    integer :: i

    associate (plan => configuration%plan)
      call compute_all(plan, values, error)
      if (allocated(error)) return
      call summary%add_points(plan%order%columns, [1, 1], values)
      write (output_unit, "(a)") header(plan%paths, plan%order%columns)
      do i = 1, size(values, 3)
        write (output_unit, "(a)", advance="no") rows(plan%grid, plan%order%columns, [i, 1], values(:, :, i:i))
      end do
    end associate
  end subroutine print_sweep

end module one_line
