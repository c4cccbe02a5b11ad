!> Plots the forces on the ground: those of each support, of the foundation and of the guides, and the total.
module gestell_task_forces_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_model_frame, only: frame_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_script, only: figure_type, new_figure, quoted, tics
  use gestell_output_picture_panels, only: bar_style => bars, choose_largest, height_of, history_panel, key_line, layout_line, &
    & legend_height, turn_axis
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, maximum_of, unit_of
  use gestell_output_picture_orders, only: highest_order, order_axis, order_panel
  use gestell_output_table, only: table_type
  use gestell_output_table_turn, only: amplitude_of
  use gestell_output_table_unit, only: newton
  use gestell_task_forces_reactions, only: along_x, along_y, along_z, has_component, component_names, components_of, &
    & force_magnitude, moment, moment_x, moment_y, reaction_type
  implicit none (type, external)
  private

  public :: plot_histories, plot_orders, plot_summary

  !> `longest`: maximum length of a name in the legend. `longest_column`: maximum length of the name of a column
  integer, parameter :: longest = 24, longest_column = 40

contains

  !> Names of the reactions as written in the legend, for example "support 2".
  pure function titles_of(reactions) result(titles)
    type(reaction_type), intent(in) :: reactions(:)
    character(len=longest) :: titles(size(reactions))
    integer :: i

    do i = 1, size(reactions)
      titles(i) = either("support ", "", scan(reactions(i)%name, "0123456789") == 1) // reactions(i)%name
    end do
  end function titles_of

  !> Chooses the reactions of a picture: the total and the largest others.
  pure subroutine choose_reactions(reactions, with_moments, chosen, remark)
    type(reaction_type), intent(in) :: reactions(:)
    !> True if the picture shows moments, too
    logical, intent(in) :: with_moments
    integer, allocatable, intent(out) :: chosen(:)
    !> Text for the heading if some were left out
    character(len=:), allocatable, intent(out) :: remark
    !> Maximum number of reactions besides the total; with the total there are as many as line types
    integer, parameter :: most = 7
    real(dp) :: peaks(size(reactions), 2)
    integer :: i, k

    peaks = 0
    do i = 1, size(reactions)
      peaks(i, 1) = reactions(i)%statistics(force_magnitude)%peak
      do k = 1, size(reactions(i)%statistics)
        if (with_moments .and. any(k == [moment, moment_x, moment_y])) peaks(i, 2) = max(peaks(i, 2), &
          & reactions(i)%statistics(k)%peak)
      end do
    end do
    ! forces and moments relative to the largest
    do k = 1, 2
      peaks(:, k) = peaks(:, k) / max(maxval(peaks(:, k)), tiny(peaks))
    end do
    call choose_largest(maxval(peaks(:size(reactions) - 1, :), dim=2), most, chosen, remark)
    chosen = [chosen, size(reactions)]
  end subroutine choose_reactions

  !> The picture of the table supports.csv: peak and rms of the largest reactions and the total as bars.
  type(figure_type) function plot_summary(table, reactions) result(figure)
    type(table_type), intent(in) :: table
    type(reaction_type), intent(in) :: reactions(:)
    character(len=*), parameter :: columns(5) = [character(len=7) :: "fx_peak", "fy_peak", "f_peak", "f_rms", "fz_peak"]
    character(len=*), parameter :: titles(5) = [character(len=17) :: "peak along x", "peak along y", "peak of magnitude", &
      & "rms of magnitude", "peak along z"]
    character(len=:), allocatable :: lines, remark, positions
    character(len=longest) :: names(size(reactions))
    type(axis_unit_type) :: unit
    real(dp) :: width, most
    integer, allocatable :: shown(:), own(:)
    integer :: i

    call choose_reactions(reactions, .false., own, remark)
    names = titles_of(reactions)
    positions = ""
    do i = 1, own(size(own))
      positions = positions // " " // text(findloc(own, i, dim=1))
    end do
    shown = [1, 2, 3, 4]
    if (size(reactions(1)%position) == 3) shown = [1, 2, 5, 3, 4]
    width = 0.84_dp / size(shown)
    unit = unit_of(table, columns(3:3))
    most = maximum_of(table, columns(3:3))
    lines = "set title heading noenhanced" // newline &
      & // "set xrange [0.4:" // text(size(own)) // ".6]; set boxwidth " // concise(width - 0.01_dp, 3) &
      & // "; set xtics (" // tics(names(own), 1) // ") font ',12'" // newline &
      & // "set ylabel " // quoted(label_with("force", unit)) // "; set grid noxtics ytics; set xtics scale 0" // newline &
      & // "set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
      & // "set yrange [0:" // concise(merge(1.05_dp * unit%factor * most, 1.0_dp, most > 0), 4) // "]" // newline &
      & // "position(row) = real(word('" // positions // "', int(row) + 1))" // newline // "plot "
    do i = 1, size(shown)
      lines = lines // either(", \" // newline // "  ", "", i > 1) // "'supports.csv' using (position($0) > 0 ? position($0) + " &
        & // concise(width * (i - (size(shown) + 1) / 2.0_dp), 3) // " : NaN):(" // trim(unit%words) // " * column('" &
        & // table%key_of(columns(shown(i))) // "')) with boxes" // bar_style(shown(i), 5) &
        & // " border lt -1 title '" // trim(titles(shown(i))) // "'"
    end do
    figure = new_figure(table%name, "Forces on the ground, by support" // remark, lines, height=480)
  end function plot_summary

  !> The picture of the table supports_history.csv. Each component has a panel, with a curve for each of the largest reactions that
  !> has this component.
  type(figure_type) function plot_histories(table, reactions, frame) result(figure)
    type(table_type), intent(in) :: table
    type(reaction_type), intent(in) :: reactions(:)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines, remark
    character(len=longest) :: titles(size(reactions))
    character(len=longest_column) :: columns(size(reactions))
    integer, allocatable :: parts(:), shown(:), own(:)
    integer :: i, k, above

    titles = titles_of(reactions)
    call choose_reactions(reactions, .true., shown, remark)
    above = legend_height(titles(shown), 1)
    ! the total, which is the last element, has all components
    parts = components_of(reactions(size(reactions)))
    lines = layout_line(size(parts), 1, above=above)
    do k = 1, size(parts)
      own = pack([(i, i = 1, size(shown))], [(has_component(reactions(shown(i)), parts(k)), i = 1, size(shown))])
      columns = trim(component_names(parts(k))) // "_" // reactions%name
      lines = lines // turn_axis(frame, k == size(parts)) // key_line(k == 1) // history_panel(table, label_of(parts(k)), &
        & columns(shown(own)), titles(shown(own)), own)
    end do
    figure = new_figure(table%name, "Forces on the ground over " // turns_in_words(frame%mechanism%turns) // ", by support" &
      & // remark, lines // "unset multiplot" // newline, height=nint(height_of(size(parts))) + above)

  contains

    !> Label of the y axis in the panel of the component `part`, without the unit.
    pure function label_of(part) result(label)
      integer, intent(in) :: part
      character(len=:), allocatable :: label

      associate (name => component_names(part))
        label = either("moment", "force", scan(name, "m") > 0)
        if (scan(name, "xyz") > 0) label = label // " " // name(2:2)
        if (name == "m" .and. size(reactions(1)%position) == 3) label = label // " z"
      end associate
    end function label_of

  end function plot_histories

  !> The picture of the table supports_harmonics.csv: amplitudes of the forces along the axes for each order.
  type(figure_type) function plot_orders(table, reactions, turns) result(figure)
    type(table_type), intent(in) :: table
    type(reaction_type), intent(in) :: reactions(:)
    !> Number of turns that the crank makes in the period
    integer, intent(in) :: turns
    integer, parameter :: axes(3) = [along_x, along_y, along_z]
    character(len=:), allocatable :: lines, remark
    character(len=longest_column) :: columns(size(reactions), 3)
    character(len=longest) :: titles(size(reactions))
    integer, allocatable :: shown(:)
    integer :: i, k, n, above

    titles = titles_of(reactions)
    call choose_reactions(reactions, .false., shown, remark)
    above = legend_height(titles(shown), 1)
    n = size(reactions(1)%position)
    do k = 1, n
      do i = 1, size(reactions)
        columns(i, k) = amplitude_of(trim(component_names(axes(k))) // "_" // trim(reactions(i)%name), newton)
      end do
    end do
    lines = layout_line(n, 1, above=above) // "set grid noxtics ytics" // newline
    do k = 1, n
      lines = lines // order_axis(table, highest_order(table, [columns(shown, :n)], turns), k == n, turns) // key_line(k == 1) &
        & // order_panel(table, "force " // component_names(axes(k))(2:2), columns(shown, k), titles(shown), turns)
    end do
    figure = new_figure(table%name, "Amplitudes of the forces on the ground, by support" // remark, lines &
      & // "unset multiplot" // newline, height=nint(height_of(n)) + above)
  end function plot_orders

end module gestell_task_forces_plot
