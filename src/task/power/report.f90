!> Writes the report of the task `power`: torque and power of the drive.
module gestell_task_power_report
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, fixed, newline
  use gestell_model_frame, only: frame_type
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_task_power_drive, only: drive_type, torque_type
  use gestell_task_power_flywheel, only: max_irregularity
  implicit none (type, external)
  private

  public :: drive_lines

  !> A torque counts as rounding error if its peak is below this fraction of the peak torque on the vibrating frame
  real(dp), parameter :: rounding = 1.0e-13_dp

contains

  !> Table of the driving torques, followed by lines on the mean powers and, with a flywheel, on the fluctuation of the speed.
  pure function drive_lines(drive, frame) result(lines)
    type(drive_type), intent(in) :: drive
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    type(torque_type) :: rigid
    real(dp) :: angle_per_period, ends(2)

    ! The torque on a balanced mechanism with a frame at rest is only rounding error.
    rigid = drive%rigid
    if (abs(rigid%peak) <= rounding * abs(drive%actual%peak)) rigid = torque_type()
    angle_per_period = frame%degrees_per_period()
    lines = tabulated("lrrrrr", ",peak,error,at crank,rms,mean" // newline // ",N m,N m,deg,N m,N m", &
      & torque_row("on the vibrating frame", drive%actual, concise(drive%peak_error, 1), angle_per_period) &
      & // torque_row("on a frame at rest", rigid, "", angle_per_period)) // "  counter-clockwise positive" // newline &
      & // "  mean power: drive " // concise(drive%drive_mean, 5) // " W, dampers " // concise(drive%dampers_mean, 5) &
      & // either(" W, loads " // concise(drive%loads_mean, 5), "", frame%mechanism%load_order >= 0) &
      & // " W; maximum of the drive " // concise(drive%maximum, 4) // " W" // newline
    if (.not. allocated(drive%fluctuation)) return
    associate (fluctuation => drive%fluctuation, speed => frame%drive_speed())
      ends = (abs(speed) + sign(1.0_dp, speed) * [fluctuation%least, fluctuation%maximum]) * 30 / pi
      lines = lines // "  speed with the flywheel: " // concise(minval(ends), 6) // " to " // concise(maxval(ends), 6) &
        & // " rpm" // either("", " (to first order)", frame%mechanism%load_order >= 0) &
        & // ", coefficient of irregularity " // concise(fluctuation%irregularity, 4) // " +- " &
        & // concise(fluctuation%error, 1) // newline
      if (fluctuation%irregularity > max_irregularity) lines = lines &
        & // "  note: the speed fluctuates by more than 1 %, so results may be wrong by up to about " &
        & // concise(200 * fluctuation%irregularity, 2) // " %. A fluctuation of 1 % requires a total inertia of flywheel and " &
        & // "mechanism of " // concise(fluctuation%inertia * fluctuation%irregularity / max_irregularity, 2) // " kg m^2" &
        & // newline
    end associate
  end function drive_lines

  !> Row of the table for one torque. `angle_per_period`: angle by which the drive turns in a period (deg).
  pure function torque_row(name, found, error, angle_per_period) result(row)
    character(len=*), intent(in) :: name, error
    type(torque_type), intent(in) :: found
    real(dp), intent(in) :: angle_per_period
    character(len=:), allocatable :: row

    row = name // tab // concise(found%peak, 5) // tab // error // tab &
      & // fixed(angle_per_period * found%peak_phase, 1) // tab // concise(found%rms, 5) // tab &
      & // concise(merge(0.0_dp, found%mean, abs(found%mean) < rounding * abs(found%peak)), 5) // newline
  end function torque_row

end module gestell_task_power_report
