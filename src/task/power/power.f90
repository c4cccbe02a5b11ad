!> The task `power`: computes torque and power of the drive over the period.
module gestell_task_power
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline
  use gestell_input_namelist_document, only: group_named
  use gestell_input_namelist_message, only: input_error
  use gestell_model_quantity_driving, only: damper_watts, drive_watts, load_watts, rigid_torque, stored_energy, torque
  use gestell_model_quantity_rows, only: accelerations
  use gestell_model_mechanism, only: drive_columns
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_turn
  use gestell_output_table_unit, only: joule, newton_metre, radian_per_s, watt
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_power_drive, only: drive_type, find_drive
  use gestell_task_power_plot, only: plot_power
  use gestell_task_power_report, only: drive_lines
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  type, extends(task_type), public :: power_task
  contains
    procedure :: describe, read => read_power, run
  end type power_task

contains

  pure subroutine describe(self)
    class(power_task), intent(inout) :: self

    self%name = "power"
    self%meaning = "driving torque, power of the drive, and power absorbed by the dampers"
    self%tables = [character(len=longest_table) :: "power"]
    self%gives_verdict = .true.
    self%brief = .true.
  end subroutine describe

  !> If the task is requested, includes the accelerations in the results to compute. Fails if the kinetic energy of the mechanism is
  !> not given, or if the coefficients are averaged.
  subroutine read_power(self, configuration, error)
    class(power_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: unused(1, drive_columns)
    logical :: known

    if (.not. self%requested) return
    configuration%analysis%rows = max(configuration%analysis%rows, accelerations)
    call configuration%frame%mechanism%tabulate_drive([0.0_dp], unused, known)
    if (.not. known) then
      call input_error(group_named(configuration%document, "mass_functions"), "", "the task 'power' needs the key 'energy', " &
        & // "the harmonics of sum [m (x'^2 + y'^2) + J phi'^2]", error)
    else if (configuration%analysis%averaged) then
      call input_error(group_named(configuration%document, "model"), "coefficients", "must be 'periodic' for the task 'power': " &
        & // "with averaged masses, the powers of drive and dampers do not balance", error)
    end if
  end subroutine read_power

  !> Computes torque and power of the drive, and adds table, picture and report to `result`.
  subroutine run(self, context, result, error)
    class(power_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(drive_type) :: drive
    type(table_type) :: table
    type(error_type), allocatable :: failure
    real(dp) :: peak
    logical :: known
    character(len=:), allocatable :: conditions

    known = .false.
    associate (frame => context%analysis%frame, unused => self)
      if (allocated(context%analysis%vibration)) then
        call find_drive(frame, context%analysis%vibration, drive, known, failure)
        known = known .and. .not. allocated(failure)
        if (known) known = drive%is_finite()
        if (.not. (known .or. allocated(failure))) call fatal_error(failure, "the torque overflows double precision", &
          & failed_computation)
      end if
      peak = ieee_value(peak, ieee_quiet_nan)
      if (known) peak = drive%actual%peak
      call result%brief%add("torque_peak", newton_metre, "peak of the torque on the crank, with its sign", [peak])
      call result%record_failure(failure)
      if (.not. known) return
      table = new_table("power", "Drive", "Driving torque over " // turns_in_words(frame%mechanism%turns) &
        & // ", and the power of drive and dampers.")
      call add_turn(table, frame, size(drive%history, 2) - 1)
      call table%add("torque", newton_metre, "torque on the crank; positive: counter-clockwise", drive%history(torque, :))
      call table%add("rigid_torque", newton_metre, "torque on the crank if the frame were at rest", drive%history(rigid_torque, :))
      call table%add("drive", watt, "power of the drive", drive%history(drive_watts, :))
      call table%add("dampers", watt, "power absorbed by dampers and foundation", drive%history(damper_watts, :))
      call table%add("energy", joule, "kinetic plus potential energy, up to an additive constant", drive%history(stored_energy, :))
      if (allocated(drive%fluctuation)) call table%add("speed_fluctuation", radian_per_s, "crank speed minus its mean", &
        & drive%fluctuation%history)
      if (frame%mechanism%load_order >= 0) call table%add("load_power", watt, "power of the loads on links and frame", &
        & drive%history(load_watts, :))
      call table%convert(result%units)
      call result%add(table)
      if (context%is_presented()) call result%add_figure(plot_power(table, frame))
      if (.not. context%reports) return
      if (frame%mechanism%load_order >= 0) then
        conditions = either("with gravity and loads", "with loads, without gravity", frame%weights%act)
      else
        conditions = either("with gravity, without process forces", "without gravity and process forces", frame%weights%act)
      end if
      call result%write_section("DRIVE, torque on the crank, " // conditions, drive_lines(drive, frame))
      call result%detail("  power balance: the mean powers of drive and dampers differ by " // concise(drive%defect(), 1) &
        & // " of the drive's maximum power" // newline)
    end associate
  end subroutine run

end module gestell_task_power
