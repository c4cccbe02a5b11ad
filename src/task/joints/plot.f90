!> Plots the joint forces: polar load diagrams, forces over the crank angle, orders, and causes.
module gestell_task_joints_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_base_words, only: word_length
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_pairs, only: contact, pin, slot
  use gestell_model_pairs_forces, only: moment
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, unit_of
  use gestell_output_picture_panels, only: bar_style => bars, choose_largest, height_of, history_panel, key_line, layout_line, &
    & legend_height, longest_entry, turn_axis
  use gestell_output_picture_orbits, only: orbit_layout, orbit_panel
  use gestell_output_picture_orders, only: highest_order, order_axis, order_panel
  use gestell_output_picture_script, only: figure_type, new_figure, quoted, tics
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_table, only: table_type
  use gestell_output_table_result_units, only: conversion_type
  use gestell_output_table_turn, only: amplitude_of
  use gestell_output_table_unit, only: newton
  use gestell_task_joints_forces, only: component_names, joint_force_type, magnitude, shown_forces, source_type
  implicit none (type, external)
  private

  public :: plot_histories, plot_loads, plot_orders, plot_sources

  !> Lengths of names of forces, and of columns
  integer, parameter :: name_length = 2 * word_length + 1, column_length = name_length + 24
  !> Maximum number of forces in the pictures, which is the number of line types
  integer, parameter :: most = 8

contains

  !> The picture of the table joints.csv: for each of the largest forces at pins, slots and cams a polar load diagram in the axes of
  !> the mechanism, and one in the axes of the link, which shows the part of the link's bearing that is loaded. Points mark twelfths
  !> of the period.
  type(figure_type) function plot_loads(table, histories, forces, ground) result(figure)
    type(table_type), intent(in) :: table, histories
    type(joint_force_type), intent(in) :: forces(:)
    character(len=*), intent(in) :: ground
    character(len=:), allocatable :: lines, joint, remark
    character(len=column_length) :: columns(2)
    integer, allocatable :: shown(:)
    type(conversion_type) :: conversion
    real(dp) :: largest
    integer :: i, height

    call choose_forces(forces, shown_forces(forces) .and. (forces%place%kind == pin .or. forces%place%kind == slot &
      & .or. forces%place%kind == contact), magnitude, most, shown, remark)
    conversion = histories%units%conversion("N")
    largest = conversion%converted(maxval([0.0_dp, forces(shown)%statistics(magnitude)%peak]))
    call orbit_layout(2 * max(1, size(shown)), 2, lines, height)
    lines = lines // "set key off" // newline
    do i = 1, size(shown)
      associate (place => forces(shown(i))%place)
        joint = trim(place%joint)
        columns = ["fx_" // place%name, "fy_" // place%name]
        lines = lines // orbit_panel(histories, columns, ["fx", "fy"], joint // ": " // trim(place%other) // " on " &
          & // trim(place%body), .true., largest)
        columns(1) = "axial_" // place%name
        columns(2) = "transverse_" // place%name
        lines = lines // orbit_panel(histories, columns, [character(len=6) :: "along", "across"], joint // ": axes of " &
          & // trim(place%body), .true., largest)
      end associate
    end do
    figure = new_figure(table%name, "Load diagrams of the machine " // ground // remark // " (angles: crank)", lines &
      & // "unset multiplot" // newline, height=height)
  end function plot_loads

  !> Chooses the `most` forces with the largest peaks of a component among `candidates`.
  subroutine choose_forces(forces, candidates, component, most, chosen, remark)
    type(joint_force_type), intent(in) :: forces(:)
    logical, intent(in) :: candidates(:)
    integer, intent(in) :: component, most
    integer, allocatable, intent(out) :: chosen(:)
    !> Text for the heading if some were left out
    character(len=:), allocatable, intent(out) :: remark
    real(dp) :: peaks(size(forces))
    integer, allocatable :: numbers(:), own(:)
    integer :: i

    numbers = pack([(i, i = 1, size(forces))], candidates)
    peaks = forces%statistics(component)%peak
    call choose_largest(peaks(numbers), most, own, remark)
    chosen = numbers(own)
  end subroutine choose_forces

  !> The picture of the table joints_history.csv: magnitudes of the forces, and moments if there are any. The largest are shown.
  type(figure_type) function plot_histories(table, forces, frame, ground) result(figure)
    type(table_type), intent(in) :: table
    type(joint_force_type), intent(in) :: forces(:)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: ground
    character(len=:), allocatable :: lines, remark, rest
    character(len=name_length) :: names(size(forces))
    integer, allocatable :: shown(:), turned(:)
    integer :: i, panels, above, between

    names = forces%place%name
    call choose_forces(forces, shown_forces(forces), magnitude, most, shown, remark)
    call choose_forces(forces, shown_forces(forces) .and. forces%has_moment, moment, most, turned, rest)
    panels = merge(2, 1, size(turned) > 0)
    above = legend_height(names(shown), 1)
    between = legend_height(names(turned), 1)
    lines = layout_line(panels, 1, above=above, between=between) // turn_axis(frame, panels == 1) // key_line(.true.) &
      & // history_panel(table, "force", "f_" // names(shown), names(shown))
    ! a force has the same style in both panels
    if (panels == 2) lines = lines // turn_axis(frame, .true.) // history_panel(table, "moment", "m_" // names(turned), &
      & names(turned), [(merge(findloc(shown, turned(i), dim=1), most + i, any(shown == turned(i))), i = 1, size(turned))])
    figure = new_figure(table%name, "Joint forces of the machine " // ground // " over " &
      & // turns_in_words(frame%mechanism%turns) // remark, lines // "unset multiplot" // newline, &
      & height=nint(height_of(panels)) + above + (panels - 1) * between)
  end function plot_histories

  !> The picture of the table joints_harmonics.csv: amplitudes of the two components of the forces. The largest are shown.
  type(figure_type) function plot_orders(table, forces, axes, turns) result(figure)
    type(table_type), intent(in) :: table
    type(joint_force_type), intent(in) :: forces(:)
    !> `axes`: the two components. `turns`: number of turns of the crank in the period
    integer, intent(in) :: axes(2), turns
    character(len=:), allocatable :: lines, remark
    character(len=column_length), allocatable :: columns(:, :)
    character(len=name_length) :: names(size(forces))
    integer, allocatable :: shown(:)
    integer :: i, k, above

    names = forces%place%name
    call choose_forces(forces, shown_forces(forces), magnitude, most, shown, remark)
    above = legend_height(names(shown), 1)
    allocate(columns(size(shown), 2))
    do k = 1, 2
      do i = 1, size(shown)
        columns(i, k) = amplitude_of(trim(component_names(axes(k))) // "_" // trim(names(shown(i))), newton)
      end do
    end do
    lines = layout_line(2, 1, above=above)
    do k = 1, 2
      lines = lines // order_axis(table, highest_order(table, [columns], turns), k == 2, turns) // key_line(k == 1) &
        & // order_panel(table, trim(component_names(axes(k))), columns(:, k), names(shown), turns)
    end do
    figure = new_figure(table%name, "Joint forces by orders of the crank speed" // remark, lines // "unset multiplot" // newline, &
      & height=nint(height_of(2)) + above)
  end function plot_orders

  !> The picture of the table joints_sources.csv: for each of the largest forces its parts at its peak, as horizontal bars.
  type(figure_type) function plot_sources(table, forces, sources) result(figure)
    type(table_type), intent(in) :: table
    type(joint_force_type), intent(in) :: forces(:)
    type(source_type), intent(in) :: sources(:)
    !> `most_forces`: maximum number of forces. `bar`: height of a bar in pixels. `longest`: maximum number of characters of a name
    integer, parameter :: most_forces = 16, bar = 12, longest = 30
    !> Causes whose parts are all below this fraction of the largest force are not shown
    real(dp), parameter :: least = 0.01_dp
    character(len=:), allocatable :: lines, remark, positions, y
    type(axis_unit_type) :: unit
    type(conversion_type) :: conversion
    integer, allocatable :: shown(:), causes(:)
    character(len=name_length) :: names(size(forces))
    character(len=word_length) :: titles(size(sources))
    real(dp) :: ends(2), largest, width
    integer :: i, below, height

    names = forces%place%name
    call choose_forces(forces, shown_forces(forces), magnitude, most_forces, shown, remark)
    largest = maxval([0.0_dp, forces(shown)%statistics(magnitude)%peak])
    causes = pack([(i, i = 1, size(sources))], [(maxval([0.0_dp, abs(sources(i)%at_peak(shown))]) > least * largest, &
      & i = 1, size(sources))])
    unit = unit_of(table, ["at_peak"])
    ends = 0
    do i = 1, size(causes)
      ends(1) = min(ends(1), minval(sources(causes(i))%at_peak(shown)))
      ends(2) = max(ends(2), maxval(sources(causes(i))%at_peak(shown)))
    end do
    conversion = table%units%conversion("N")
    ends = unit%factor * conversion%converted(ends)
    if (.not. ends(2) > ends(1)) ends(2) = 1
    positions = ""
    do i = 1, size(forces)
      positions = positions // " " // text(findloc(shown, i, dim=1))
    end do
    titles = sources%name
    below = 78 + legend_height(titles(causes), 0)
    height = 56 + size(shown) * (size(causes) * bar + 8) + below
    lines = "set multiplot title heading noenhanced" // newline // "set lmargin screen " &
      & // concise((36 + 7 * min(longest, maxval([0, len_trim(names(shown))]))) / 640.0_dp, 3) // "; set rmargin screen 0.97" &
      & // newline // "set tmargin screen " // concise(1 - 56.0_dp / height, 3) // "; set bmargin screen " &
      & // concise(real(below, dp) / height, 3) // newline // "set xrange [" &
      & // concise(ends(1) - merge(0.04_dp, 0.0_dp, ends(1) < 0) * (ends(2) - ends(1)), 4) // ":" &
      & // concise(ends(2) + 0.04_dp * (ends(2) - ends(1)), 4) // "]; set yrange [" // text(size(shown)) // ".6:0.4]" // newline &
      & // "set ytics (" // tics(names(shown), 1, longest) // ") noenhanced font ',12' scale 0" // newline // "set xlabel " &
      & // quoted(label_with("part of the peak force", unit)) // "; set grid xtics noytics; set yzeroaxis lt -1 dt 1" // newline &
      & // "set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2 font ',12'" // newline &
      & // "position(row) = real(word('" // positions // "', int(row) + 1))" // newline // "plot NaN notitle"
    width = 0.8_dp / max(1, size(causes))
    do i = 1, size(causes)
      y = "position($0) + " // concise(width * (i - (size(causes) + 1) / 2.0_dp), 3)
      lines = lines // ", \" // newline // "  '" // table%name // ".csv' every " // text(size(sources)) // "::" &
        & // text(causes(i) - 1) // " using (position($0) > 0 ? 0 : NaN):(" // y // "):(0):(" // trim(unit%words) // " * column('" &
        & // table%key_of("at_peak") // "')):(" // y // " - " // concise(0.46_dp * width, 3) // "):(" // y // " + " &
        & // concise(0.46_dp * width, 3) // ") with boxxyerror" // bar_style(i, 5) // " border lt -1 title " &
        & // quoted(trim(titles(causes(i))), longest_entry) // " noenhanced"
    end do
    figure = new_figure(table%name, "Causes of the joint forces at their peaks" // remark, lines // newline // "unset multiplot" &
      & // newline, height=height)
  end function plot_sources

end module gestell_task_joints_plot
