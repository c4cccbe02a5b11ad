!> Files and report of what was asked about the vibration: forces on the ground, probes, the drive.
module gestell_task_findings_output
  use gestell_base_error, only: error_type
  use gestell_task_forces_csv, only: write_forces
  use gestell_task_forces_plot, only: plot_forces, plot_power
  use gestell_task_response_plot_probes, only: plot_probes
  use gestell_task_power_csv, only: write_power
  use gestell_task_response_probes_csv, only: write_probes
  use gestell_task_power_report, only: drive_lines
  use gestell_task_forces_report, only: force_lines
  use gestell_task_response_report_probes, only: probe_lines
  use gestell_task_findings, only: findings_type
  implicit none (type, external)
  private

  public :: report_findings, write_findings

contains

  !> Writes the files of what there is into `folder`, each with its script for gnuplot; `preamble` heads each, orders go up to
  !> `harmonics`.
  !> Error: a file cannot be written.
  subroutine write_findings(folder, preamble, findings, harmonics, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    integer, intent(in) :: harmonics
    type(error_type), allocatable, intent(out) :: error

    if (allocated(findings%places)) then
      call write_forces(folder, preamble, findings, harmonics, error)
      if (.not. allocated(error)) call plot_forces(folder, preamble, findings, harmonics, error)
      if (allocated(error)) return
    end if
    if (allocated(findings%watched)) then
      call write_probes(folder, preamble, findings, harmonics, error)
      if (.not. allocated(error)) call plot_probes(folder, preamble, findings, harmonics, error)
      if (allocated(error)) return
    end if
    if (.not. allocated(findings%drive)) return
    call write_power(folder, preamble, findings, error)
    if (.not. allocated(error)) call plot_power(folder, preamble, findings%speed, error)
  end subroutine write_findings

  !> The sections of what there is, of a machine with that verdict.
  pure function report_findings(findings, verdict) result(lines)
    type(findings_type), intent(in) :: findings
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: lines

    lines = ""
    if (allocated(findings%places)) lines = lines // force_lines(findings%places, findings%speed, verdict)
    if (allocated(findings%watched)) lines = lines // probe_lines(findings%watched, findings%period, verdict)
    if (allocated(findings%drive)) lines = lines // drive_lines(findings%drive, findings%speed, verdict)
  end function report_findings

end module gestell_task_findings_output
