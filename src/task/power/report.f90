!> The drive, for people.
module gestell_task_power_report
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, fixed
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_output_report_verdict, only: section
  use gestell_task_power_drive, only: drive_type, torque_type
  use gestell_task_power_flywheel, only: fluctuation_type, uneven
  implicit none (type, external)
  private

  public :: balance_line, drive_lines, holder_line

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
      line = "  flywheel   speed constant in space; frame feels only the motor's mean torque" // newline
    case ("outside")
      line = "  motor      beside the machine: speed constant in space, no torque on the frame" // newline
    case default
      line = "  motor      on the frame: speed held constant, torque reacts on the frame" // newline
    end select
  end function holder_line

  !> Torque over the turn and the balance of power. `speed`: of the crank (rad/s); so many `turns` of the drive are a period.
  pure function drive_lines(drive, speed, turns, verdict) result(lines)
    type(drive_type), intent(in) :: drive
    real(dp), intent(in) :: speed
    integer, intent(in) :: turns
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: lines
    type(torque_type) :: rigid

    ! Of a balanced mechanism the torque on a rigid frame is nothing but roundings.
    rigid = drive%rigid
    if (abs(rigid%peak) <= rounding * abs(drive%actual%peak)) rigid = torque_type()
    lines = section("DRIVE, torque on the crank, " // trim(merge("with weights, without process forces", &
      & "without gravity and process forces  ", drive%weighed)), verdict) &
      & // tabulated("lrrrrr", ",peak,error,at crank,rms,mean" // newline // ",N m,N m,deg,N m,N m", &
      & torque_row("on the frame as it is", drive%actual, concise(drive%peak_error, 1), sign(360.0_dp, speed) * turns) &
      & // torque_row("on a rigid frame", rigid, "", sign(360.0_dp, speed) * turns)) // "  counter-clockwise positive" // newline &
      & // "  mean power: drive " // concise(drive%drive_mean, 5) // " W, dampers " // concise(drive%dampers_mean, 5) &
      & // " W; greatest of the drive " // concise(drive%greatest, 4) // " W" // newline
    if (allocated(drive%fluctuation)) lines = lines // fluctuation_lines(drive%fluctuation, speed * turns)
  end function drive_lines

  !> How evenly the flywheel holds the speed.
  pure function fluctuation_lines(fluctuation, speed) result(lines)
    type(fluctuation_type), intent(in) :: fluctuation
    real(dp), intent(in) :: speed
    character(len=:), allocatable :: lines
    real(dp) :: ends(2)

    ends = (abs(speed) + sign(1.0_dp, speed) * [fluctuation%least, fluctuation%greatest]) * 30 / pi
    lines = "  speed by the flywheel: " // concise(minval(ends), 6) // " to " // concise(maxval(ends), 6) &
      & // " rpm, to first order: coefficient of irregularity " // concise(fluctuation%irregularity, 4) // " +- " &
      & // concise(fluctuation%error, 1) // newline
    if (fluctuation%irregularity > uneven) lines = lines // "  note: that is no constant speed; results may change by up " &
      & // "to about " // concise(200 * fluctuation%irregularity, 2) // " %. A flywheel of " &
      & // concise(fluctuation%inertia * fluctuation%irregularity / uneven, 2) // " kg m^2 would hold it to 1 %" // newline
  end function fluctuation_lines

  !> How well the mean powers agree.
  pure function balance_line(drive) result(line)
    type(drive_type), intent(in) :: drive
    character(len=:), allocatable :: line

    line = "  the balance of power is missed by " // concise(drive%defect(), 1) // " of the drive's greatest power" // newline
  end function balance_line

  !> `whole`: the crank angle through which the drive turns in a period (deg).
  pure function torque_row(name, found, error, whole) result(row)
    character(len=*), intent(in) :: name, error
    type(torque_type), intent(in) :: found
    real(dp), intent(in) :: whole
    character(len=:), allocatable :: row

    row = name // tab // concise(found%peak, 5) // tab // error // tab &
      & // fixed(whole * found%peak_phase, 1) // tab // concise(found%rms, 5) // tab &
      & // concise(merge(0.0_dp, found%mean, abs(found%mean) < rounding * abs(found%peak)), 5) // newline
  end function torque_row

end module gestell_task_power_report
