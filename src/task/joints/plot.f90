!> Plots the joint forces: polar load diagrams, forces over the crank angle, orders, and causes.
module gestell_task_joints_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_words, only: word_length
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_pairs, only: pin
  use gestell_model_pairs_forces, only: moment
  use gestell_output_picture_panels, only: bar_style => bars, height_of, history_panel, key_line, layout_line, turn_axis
  use gestell_output_picture_orbits, only: orbit_layout, orbit_panel
  use gestell_output_picture_orders, only: highest_order, order_axis, order_panel
  use gestell_output_picture_script, only: figure_type, new_figure, quoted, tics
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_table, only: table_type
  use gestell_output_table_turn, only: amplitude_of
  use gestell_output_table_unit, only: newton
  use gestell_task_joints_forces, only: component_names, joint_force_type, magnitude, shown_forces, source_type
  implicit none (type, external)
  private

  public :: plot_histories, plot_loads, plot_orders, plot_sources

  !> Lengths of names of forces, and of columns
  integer, parameter :: name_length = 2 * word_length + 1, column_length = name_length + 24

contains

  !> The picture of the table joints.csv: for each force a polar load diagram in the axes of the mechanism, and one in the axes of
  !> the link, which shows the part of the link's bearing that is loaded. Points mark multiples of 30 degrees of the crank angle.
  type(figure_type) function plot_loads(table, histories, forces, ground) result(figure)
    type(table_type), intent(in) :: table, histories
    type(joint_force_type), intent(in) :: forces(:)
    character(len=*), intent(in) :: ground
    !> Maximum number of forces in the picture
    integer, parameter :: most = 8
    character(len=:), allocatable :: lines, title
    character(len=column_length) :: columns(2)
    integer, allocatable :: shown(:)
    integer :: i, height

    shown = pack([(i, i = 1, size(forces))], shown_forces(forces) .and. forces%place%kind == pin)
    shown = shown(:min(most, size(shown)))
    call orbit_layout(2 * max(1, size(shown)), 2, lines, height)
    lines = lines // "set key off" // newline
    do i = 1, size(shown)
      associate (place => forces(shown(i))%place)
        title = trim(place%other) // " on " // trim(place%body) // " at " // trim(place%joint)
        columns = ["fx_" // place%name, "fy_" // place%name]
        lines = lines // orbit_panel(histories, columns, ["fx", "fy"], title, .true.)
        columns(1) = "axial_" // place%name
        columns(2) = "transverse_" // place%name
        lines = lines // orbit_panel(histories, columns, [character(len=6) :: "along", "across"], title // ", axes of " &
          & // trim(place%body), .true.)
      end associate
    end do
    figure = new_figure(table%name, "Load diagrams of the machine " // ground // " (angles: crank)", lines // "unset multiplot" &
      & // newline, height=height)
  end function plot_loads

  !> The picture of the table joints_history.csv: magnitudes of the forces, and moments if there are any.
  type(figure_type) function plot_histories(table, forces, frame, ground) result(figure)
    type(table_type), intent(in) :: table
    type(joint_force_type), intent(in) :: forces(:)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: ground
    character(len=:), allocatable :: lines
    character(len=name_length) :: names(size(forces))
    integer, allocatable :: shown(:), turned(:)
    integer :: i, panels

    names = forces%place%name
    shown = pack([(i, i = 1, size(forces))], shown_forces(forces))
    turned = pack([(i, i = 1, size(forces))], shown_forces(forces) .and. forces%has_moment)
    panels = merge(2, 1, size(turned) > 0)
    lines = layout_line(panels, 1) // turn_axis(frame, panels == 1) // key_line(.true.) // history_panel(table, "force", &
      & "f_" // names(shown), names(shown))
    if (panels == 2) lines = lines // turn_axis(frame, .true.) // history_panel(table, "moment", &
      & "m_" // names(turned), names(turned))
    figure = new_figure(table%name, "Joint forces of the machine " // ground // " over " &
      & // turns_in_words(frame%mechanism%turns), lines // "unset multiplot" // newline, height=nint(height_of(panels)))
  end function plot_histories

  !> The picture of the table joints_harmonics.csv: amplitudes of the two components of the forces.
  type(figure_type) function plot_orders(table, forces, axes, turns) result(figure)
    type(table_type), intent(in) :: table
    type(joint_force_type), intent(in) :: forces(:)
    !> `axes`: the two components. `turns`: number of turns of the crank in the period
    integer, intent(in) :: axes(2), turns
    character(len=:), allocatable :: lines
    character(len=column_length), allocatable :: columns(:, :)
    character(len=name_length) :: names(size(forces))
    integer, allocatable :: shown(:)
    integer :: i, k

    names = forces%place%name
    shown = pack([(i, i = 1, size(forces))], shown_forces(forces))
    allocate(columns(size(shown), 2))
    do k = 1, 2
      do i = 1, size(shown)
        columns(i, k) = amplitude_of(trim(component_names(axes(k))) // "_" // trim(names(shown(i))), newton)
      end do
    end do
    lines = layout_line(2, 1)
    do k = 1, 2
      lines = lines // order_axis(table, highest_order(table, [columns], turns), k == 2, turns) // key_line(k == 1) &
        & // order_panel(table, trim(component_names(axes(k))), columns(:, k), names(shown), turns)
    end do
    figure = new_figure(table%name, "Joint forces by orders of the crank speed", lines // "unset multiplot" // newline, &
      & height=nint(height_of(2)))
  end function plot_orders

  !> The picture of the table joints_sources.csv: the parts of each force at its peak, side by side.
  type(figure_type) function plot_sources(table, forces, sources) result(figure)
    type(table_type), intent(in) :: table
    type(joint_force_type), intent(in) :: forces(:)
    type(source_type), intent(in) :: sources(:)
    character(len=:), allocatable :: lines
    integer :: i

    lines = "set title heading noenhanced" // newline // "set xrange [-0.6:" // text(size(forces) - 1) // ".6]; set boxwidth " &
      & // concise(0.8_dp / size(sources), 3) // "; set xtics (" // tics((forces%place%name), 0) // ") rotate by -40 noenhanced" &
      & // newline // "set ylabel 'part of the peak force (N)'" // newline // "set grid noxtics ytics; set xtics scale 0" &
      & // newline // "set bmargin 8; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline // "plot "
    do i = 1, size(sources)
      lines = lines // either(", \" // newline // "  ", "", i > 1) // "'" // table%name // ".csv' every " // text(size(sources)) &
        & // "::" // text(i - 1) // " using ($0 + " // concise(0.8_dp / size(sources) * (i - (size(sources) + 1) / 2.0_dp), 3) &
        & // "):(column('" // table%key_of("at_peak") // "')) with " // bar_style(i, 5) // " border lt -1 title '" &
        & // trim(sources(i)%name) // "'"
    end do
    figure = new_figure(table%name, "Causes of the joint forces at their peaks", lines // newline, height=480)
  end function plot_sources

end module gestell_task_joints_plot
