!> power.csv: the driving torque over the turn, and where its power goes.
module gestell_task_power_csv
  use gestell_base_error, only: error_type
  use gestell_task_findings_csv, only: write_turn
  use gestell_task_findings, only: findings_type
  implicit none (type, external)
  private

  public :: write_power

contains

  !> Error: the file cannot be written.
  subroutine write_power(folder, preamble, findings, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    type(error_type), allocatable, intent(out) :: error

    character(len=*), parameter :: columns = ",torque_Nm,rigid_torque_Nm,drive_W,dampers_W,energy_J"

    associate (drive => findings%drive)
      if (allocated(drive%fluctuation)) then
        call write_turn(folder, "power.csv", preamble, columns // ",speed_fluctuation_rad_s", findings%speed, findings%period, &
          & reshape([transpose(drive%history), drive%fluctuation%history], [size(drive%history, 2), size(drive%history, 1) + 1]), &
          & error)
      else
        call write_turn(folder, "power.csv", preamble, columns, findings%speed, findings%period, transpose(drive%history), error)
      end if
    end associate
  end subroutine write_power

end module gestell_task_power_csv
