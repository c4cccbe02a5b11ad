!> Plots torque, power, energy and speed of the drive over the period.
module gestell_task_power_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline
  use gestell_model_frame, only: frame_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_axis_unit, only: maximum_of
  use gestell_output_picture_panels, only: height_of, history_panel, key_line, layout_line, legend_height, turn_axis
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_output_table, only: table_type
  implicit none (type, external)
  private

  public :: plot_power

  !> Powers below this fraction of the largest would be a line at zero
  real(dp), parameter :: least = 1.0e-3_dp
  !> Maximum length of an entry of a legend
  integer, parameter :: longest = 48

contains

  !> The picture of the table power.csv: torque, power, energy and, if it is known, the fluctuation of the speed against the crank
  !> angle. The power of the dampers is omitted if it is too small to be seen.
  type(figure_type) function plot_power(table, frame) result(figure)
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    character(len=longest) :: torque(2), power(2)
    character(len=*), parameter :: columns(2) = [character(len=7) :: "drive", "dampers"]
    integer :: panels, shown, above, between
    logical :: dampers, fluctuates

    dampers = maximum_of(table, ["dampers"]) > least * maximum_of(table, ["drive"])
    fluctuates = any([(table%columns(panels)%label == "speed fluctuation", panels = 1, size(table%columns))])
    panels = merge(4, 3, fluctuates)
    torque = [character(len=longest) :: "", "frame at rest"]
    torque(1) = "vibrating frame, mean " // mean("torque")
    power(1) = "drive, mean " // mean("drive")
    power(2) = "dampers, mean " // mean("dampers")
    shown = merge(2, 1, dampers)
    above = legend_height(torque, 1)
    between = legend_height(power(:shown), 1)
    lines = layout_line(panels, 1, above=above, between=between) // turn_axis(frame, .false.) // key_line(.true.) &
      & // history_panel(table, "torque", [character(len=12) :: "torque", "rigid_torque"], torque) &
      & // history_panel(table, "power", columns(:shown), power(:shown))
    if (.not. fluctuates) lines = lines // turn_axis(frame, .true.)
    lines = lines // history_panel(table, "energy", ["energy"], ["kinetic plus potential energy"])
    if (fluctuates) lines = lines // turn_axis(frame, .true.) // history_panel(table, "crank speed", ["speed_fluctuation"], &
      & ["difference from the mean speed"])
    figure = new_figure(table%name, "Torque, power and energy of the drive over " // turns_in_words(frame%mechanism%turns), &
      & lines // "unset multiplot" // newline, height=nint(height_of(panels)) + above + (panels - 1) * between)

  contains

    !> Mean of a column over the period, with its unit. The last row of the table repeats the first.
    pure function mean(name) result(words)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: words

      associate (column => table%columns(table%number_of(name)))
        words = concise(sum(column%numbers(:table%rows - 1)) / max(1, table%rows - 1), 4) // " " // trim(column%unit%words)
      end associate
    end function mean

  end function plot_power

end module gestell_task_power_plot
