!> The drive, for people.
module gestell_task_power_report
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, fixed
  use gestell_input_wording, only: padded
  use gestell_output_report_verdict, only: section
  use gestell_task_power_drive, only: drive_type, torque_type
  use gestell_task_power_flywheel, only: fluctuation_type, uneven
  implicit none (type, external)
  private

  public :: drive_lines, holder_line

  character, parameter :: newline = new_line("a")
  !> What lies below this part of the greatest torque is what roundings leave of zero.
  real(dp), parameter :: rounding = 1.0e-13_dp

contains

  !> Who holds the speed, for the head.
  pure function holder_line(held_by) result(line)
    character(len=*), intent(in) :: held_by
    character(len=:), allocatable :: line

    select case (held_by)
    case ("flywheel")
      line = "  flywheel   holds this speed in space, whatever torque that takes; the frame feels the motor's mean torque alone"
    case ("outside")
      line = "  motor      beside the machine: it holds this speed in space, and its torque does not react on the frame"
    case default
      line = "  motor      on the frame: it holds this speed whatever torque that takes, and the torque reacts on the frame"
    end select
  end function holder_line

  !> Torque over the turn and the balance of power. `speed`: of the crank (rad/s).
  pure function drive_lines(drive, speed, verdict) result(lines)
    type(drive_type), intent(in) :: drive
    real(dp), intent(in) :: speed
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: lines
    type(torque_type) :: rigid

    ! Of a balanced mechanism the torque on a rigid frame is nothing but roundings.
    rigid = drive%rigid
    if (abs(rigid%peak) <= rounding * abs(drive%actual%peak)) rigid = torque_type()
    lines = section("DRIVE, torque on the crank, " // trim(merge("with weights, without process forces", &
      & "without gravity and process forces  ", drive%weighed)) // " (N m, counter-clockwise positive)", &
      & verdict) // &
      & "                              peak    at crank deg         rms        mean" // newline &
      & // torque_line("on the frame as it is", drive%actual, speed) // "   peak's error " // concise(drive%peak_error, 1) &
      & // newline // torque_line("on a rigid frame", rigid, speed) // newline &
      & // "  mean power of the drive " // concise(drive%drive_mean, 5) // " W, of the dampers " // concise(drive%dampers_mean, 5) &
      & // " W, greatest of the drive " // concise(drive%greatest, 4) // " W; the balance is missed by " &
      & // concise(drive%defect(), 1) // " of that" // newline
    if (allocated(drive%fluctuation)) lines = lines // fluctuation_lines(drive%fluctuation, speed)
  end function drive_lines

  !> How evenly the flywheel holds the speed.
  pure function fluctuation_lines(fluctuation, speed) result(lines)
    type(fluctuation_type), intent(in) :: fluctuation
    real(dp), intent(in) :: speed
    character(len=:), allocatable :: lines
    real(dp) :: ends(2)

    ends = (abs(speed) + sign(1.0_dp, speed) * [fluctuation%least, fluctuation%greatest]) * 30 / pi
    lines = "  speed by the flywheel " // concise(minval(ends), 6) // " to " // concise(maxval(ends), 6) &
      & // " rpm, to first order: coefficient of irregularity " // concise(fluctuation%irregularity, 4) // " +- " &
      & // concise(fluctuation%error, 1) // newline
    if (fluctuation%irregularity > uneven) lines = lines // "  note: that is no constant speed; what is told here changes by up " &
      & // "to about " // concise(200 * fluctuation%irregularity, 2) // " %. A flywheel of " &
      & // concise(fluctuation%inertia * fluctuation%irregularity / uneven, 2) // " kg m^2 would hold it to 1 %" // newline
  end function fluctuation_lines

  pure function torque_line(name, told, speed) result(line)
    character(len=*), intent(in) :: name
    type(torque_type), intent(in) :: told
    real(dp), intent(in) :: speed
    character(len=:), allocatable :: line
    line = "  " // name // repeat(" ", max(0, 22 - len(name))) // padded(concise(told%peak, 5), 10) &
      & // padded(fixed(sign(360.0_dp, speed) * told%peak_phase, 1), 16) // padded(concise(told%rms, 5), 12) &
      & // padded(concise(merge(0.0_dp, told%mean, abs(told%mean) < rounding * abs(told%peak)), 5), 12)
  end function torque_line

end module gestell_task_power_report
