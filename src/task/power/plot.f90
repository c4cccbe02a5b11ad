!> Plots torque, power and energy of the drive over the period.
module gestell_task_power_plot
  use gestell_base_text, only: newline
  use gestell_model_frame, only: frame_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_panels, only: height_of, history_panel, key_line, layout_line, turn_axis
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_output_table, only: table_type
  implicit none (type, external)
  private

  public :: plot_power

contains

  !> The picture of the table power.csv: torque, power and energy against the crank angle.
  type(figure_type) function plot_power(table, frame) result(figure)
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame

    figure = new_figure(table%name, "Driving torque and power over " // turns_in_words(frame%mechanism%turns), &
      & layout_line(3, 1) // turn_axis(frame, .false.) // key_line(.true.) &
      & // history_panel(table, "torque", [character(len=12) :: "torque", "rigid_torque"], &
      & [character(len=32) :: "on the vibrating frame", "on a frame at rest"]) &
      & // history_panel(table, "power", [character(len=7) :: "drive", "dampers"], &
      & [character(len=32) :: "of the drive", "absorbed by the dampers"]) &
      & // turn_axis(frame, .true.) // key_line(.false.) // history_panel(table, "energy", ["energy"], ["energy"]) &
      & // "unset multiplot" // newline, height=nint(height_of(3)))
  end function plot_power

end module gestell_task_power_plot
