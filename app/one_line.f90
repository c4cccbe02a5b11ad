!> Results as lines on standard output, for shell scripts: a header and a line for each case.
module one_line
  use cli, only: setting_type
  use console, only: print_out
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_task_configuration, only: configuration_type
  use gestell_task_sweep_csv, only: case_lines, header, rows
  use gestell_task_sweep_summary, only: summary_type
  use gestell_study_vibration_analysis, only: analysis_type
  use gestell_task_findings, only: findings_type
  use gestell_task_forces_ground, only: whole_force
  use gestell_study_point, only: verdict_number
  use gestell_study_tile_results, only: eta_peak, log_rho_max, psi_peak, rho_error, rho_max, sweep_columns, verdict, xi_peak
  use sweeping, only: compute_all
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: print_case, print_sweep

contains

  !> The machine of the input: what was set, the columns of sweep.csv that its tasks ask for, and what else they do: peaks of
  !> the forces, the velocity at probes in their bands, the torque's peak; last the verdict, where it does not stand before them.
  !> Error: it cannot be written.
  subroutine print_case(settings, configuration, analysis, findings, error)
    type(setting_type), intent(in) :: settings(:)
    type(configuration_type), intent(in) :: configuration
    type(analysis_type), intent(in) :: analysis
    type(findings_type), intent(in) :: findings
    type(error_type), allocatable, intent(out) :: error
    character(len=96), allocatable :: names(:)
    real(dp), allocatable :: others(:)
    real(dp) :: values(sweep_columns)
    logical :: columns(sweep_columns)
    character(len=:), allocatable :: assignments(:)
    character(len=:), allocatable :: word
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
    call other_columns(configuration, analysis, findings, names, others)
    word = ""
    if (allocated(analysis%multipliers) .and. .not. columns(verdict)) word = trim(analysis%multipliers%verdict())
    call print_out(case_lines(assignments, columns, values, names, others, word), error)
  end subroutine print_case

  !> The columns that do not stand in sweep.csv; NaN where there is no vibration.
  subroutine other_columns(configuration, analysis, findings, names, others)
    type(configuration_type), intent(in) :: configuration
    type(analysis_type), intent(in) :: analysis
    type(findings_type), intent(in) :: findings
    character(len=96), allocatable, intent(out) :: names(:)
    real(dp), allocatable, intent(out) :: others(:)
    integer :: forces, probes, drives, searched, i

    forces = merge(1 + size(configuration%frame%supports), 0, configuration%forces)
    probes = merge(size(configuration%probes), 0, configuration%tasks%response)
    drives = merge(1, 0, configuration%power)
    searched = merge(1, 0, configuration%tasks%all_vibrations .and. configuration%tasks%judged())
    allocate(names(forces + probes + drives + searched))
    allocate(others(size(names)), source=ieee_value(1.0_dp, ieee_quiet_nan))
    if (forces > 0) names(1) = "f_peak_N"
    do i = 1, forces - 1
      names(1 + i) = "support(" // text(i) // ").f_peak_N"
    end do
    do i = 1, probes
      names(forces + i) = "probe(" // trim(configuration%probes(i)%name) // ").v_band_mm_s"
    end do
    if (drives > 0) names(forces + probes + 1) = "torque_peak_Nm"
    if (searched > 0) names(size(names)) = "vibrations"
    if (allocated(findings%places)) then
      others(1) = findings%places(size(findings%places))%statistics(whole_force)%peak
      do i = 1, forces - 1
        others(1 + i) = findings%places(i)%statistics(whole_force)%peak
      end do
    end if
    if (allocated(findings%watched)) others(forces + 1:forces + probes) = 1000 * findings%watched%greatest
    if (allocated(findings%drive)) others(forces + probes + 1) = findings%drive%actual%peak
    if (allocated(analysis%several) .and. searched > 0) others(size(others)) = size(analysis%several)
  end subroutine other_columns

  !> All points of a sweep, in the grid's order. Errors: they could not be computed; they cannot be written.
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
      call print_out(header(plan%paths, plan%order%columns) // new_line("a"), error)
      do i = 1, size(values, 3)
        if (allocated(error)) return
        call print_out(rows(plan%grid, plan%order%columns, [i, 1], values(:, :, i:i)), error)
      end do
    end associate
  end subroutine print_sweep

end module one_line
