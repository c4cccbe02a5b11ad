!> The picture of the drive.
module gestell_task_power_plot
  use gestell_base_kinds, only: dp
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_panels, only: height_of, history_panel, key_line, layout_line, turn_axis
  use gestell_output_picture_script, only: figure_type, new_figure
  implicit none (type, external)
  private

  public :: plot_power

  character, parameter :: newline = new_line("a")

contains

  !> power.gp; so many `turns` of the drive are a period.
  function plot_power(speed, turns) result(figure)
    real(dp), intent(in) :: speed
    integer, intent(in) :: turns
    type(figure_type) :: figure
    character(len=:), allocatable :: lines

    lines = layout_line(3, 1) &
      & // turn_axis(speed, .false., turns) // key_line(.true.) // history_panel("power.csv", "torque (N m)", "1", [3, 4], &
      & [character(len=32) :: "on the vibrating frame", "on a frame at rest"]) &
      & // history_panel("power.csv", "power (W)", "1", [5, 6], [character(len=32) :: "of the drive", "taken by the dampers"]) &
      & // turn_axis(speed, .true., turns) // key_line(.false.) // history_panel("power.csv", "energy (J)", "1", [7], &
      & [character(len=32) :: "energy"])
    figure = new_figure("power", "Driving torque over " // turns_in_words(turns) &
      & // ", and where its power goes", lines // "unset multiplot" // newline, &
      & width=800, height=nint(height_of(3)))
  end function plot_power

end module gestell_task_power_plot
