!> Pictures of the forces on the ground, reaction by reaction.
module gestell_task_forces_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_script, only: figure_type, new_figure, tic
  use gestell_output_picture_panels, only: height_of, history_panel, key_line, layout_line, order_axis, order_panel, turn_axis
  use gestell_task_forces_reactions, only: reaction_type
  implicit none (type, external)
  private

  public :: plot_forces

  character, parameter :: newline = new_line("a")
  !> Columns before those of the reactions.
  integer, parameter :: before = 2

contains

  !> supports.gp, supports_history.gp, supports_harmonics.gp; so many turns of the drive are a period.
  function plot_forces(reactions, speed, period_turns, harmonics) result(figures)
    type(reaction_type), intent(in) :: reactions(:)
    real(dp), intent(in) :: speed
    integer, intent(in) :: period_turns, harmonics
    type(figure_type) :: figures(3)
    character(len=24) :: names(size(reactions))
    logical :: turns(size(reactions))
    integer :: i

    do i = 1, size(names)
      names(i) = reactions(i)%name
      if (scan(names(i), "0123456789") == 1) names(i) = "support " // reactions(i)%name
      turns(i) = reactions(i)%turns
    end do
    associate (axes => size(reactions(1)%position))
      figures(1) = plot_summary(names, axes)
      figures(2) = plot_histories(names, turns, axes, speed, period_turns)
      figures(3) = plot_orders(names, turns, axes, harmonics, period_turns)
    end associate
  end function plot_forces

  !> Bars for every reaction, whose forces have two or three axes.
  function plot_summary(names, axes) result(figure)
    character(len=*), intent(in) :: names(:)
    integer, intent(in) :: axes
    type(figure_type) :: figure
    character(len=12), parameter :: columns(5) = [character(len=12) :: "fx_peak_N", "fy_peak_N", "f_peak_N", "f_rms_N", "fz_peak_N"]
    character(len=16), parameter :: titles(5) = [character(len=16) :: "peak along x", "peak along y", "peak", "rms", "peak along z"]
    character(len=12), parameter :: fills(5) = [character(len=12) :: "solid 1", "pattern 2", "solid 0.25", "pattern 5", &
      & "pattern 4"]
    character(len=:), allocatable :: lines, tics
    real(dp) :: width
    integer, allocatable :: bars(:)
    integer :: i

    bars = [1, 2, 3, 4]
    if (axes == 3) bars = [1, 2, 5, 3, 4]
    width = 0.84_dp / size(bars)
    tics = ""
    do i = 1, size(names)
      tics = tics // ", " // tic(trim(names(i))) // " " // text(i - 1)
    end do
    lines = "set title heading noenhanced" // newline &
      & // "set xrange [-0.6:" // text(size(names) - 1) // ".6]; set boxwidth " // concise(width - 0.01_dp, 3) // "; set xtics (" &
      & // tics(3:) // ")" // newline &
      & // "set ylabel 'force (N)'" // newline // "set grid noxtics ytics; set xtics scale 0" // newline &
      & // "set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
      & // "most = 0; set table $unused" // newline &
      & // "plot [0:1] [-1:1] 'supports.csv' using (0):(v = column('f_peak_N'), most = v > most ? v : most, 0)" // newline &
      & // "unset table" // newline // "set yrange [0:(most > 0 ? 1.05 * most : 1)]" // newline // "plot "
    do i = 1, size(bars)
      if (i > 1) lines = lines // ", \" // newline // "  "
      associate (k => bars(i))
        lines = lines // "'supports.csv' using ($0 + " // concise(width * (i - (size(bars) + 1) / 2.0_dp), 3) // "):(column('" &
          & // trim(columns(k)) // "')) with boxes lt " // text(k) // " dt 1 lw 1 fs " // trim(fills(k)) &
          & // " border lt -1 title '" // trim(titles(k)) // "'"
      end associate
    end do
    figure = new_figure("supports", "Forces on the ground, place by place", lines, width=800, height=480)
  end function plot_summary

  !> Forces along x and y, their size, and the moment where there is one.
  function plot_histories(names, turns, axes, speed, period_turns) result(figure)
    character(len=*), intent(in) :: names(:)
    logical, intent(in) :: turns(:)
    integer, intent(in) :: axes, period_turns
    real(dp), intent(in) :: speed
    type(figure_type) :: figure
    character(len=16), parameter :: flat(4) = [character(len=16) :: "force x (N)", "force y (N)", "force (N)", "moment (N m)"]
    character(len=16), parameter :: in_space(7) = [character(len=16) :: "force x (N)", "force y (N)", "force z (N)", &
      & "force (N)", "moment x (N m)", "moment y (N m)", "moment z (N m)"]
    character(len=:), allocatable :: lines
    character(len=16), allocatable :: labels(:)
    integer :: first(size(names)), panels, i, k

    labels = flat
    if (axes == 3) labels = in_space
    first = first_columns(turns, axes + 1, size(labels) - axes - 1, 1)
    panels = merge(size(labels), axes + 1, any(turns))
    lines = layout_line(panels, 1)
    do k = 1, panels
      lines = lines // turn_axis(speed, k == panels, period_turns) // key_line(k == 1)
      if (k <= axes + 1) then
        lines = lines // history_panel("supports_history.csv", trim(labels(k)), "1", first + k - 1, names)
      else
        lines = lines // history_panel("supports_history.csv", trim(labels(k)), "1", pack(first + k - 1, turns), &
          & pack(names, turns), pack([(i, i = 1, size(names))], turns))
      end if
    end do
    figure = new_figure("supports_history", "Forces on the ground over " // turns_in_words(period_turns) &
      & // ", place by place", lines // "unset multiplot" &
      & // newline, width=800, height=nint(height_of(panels)))
  end function plot_histories

  function plot_orders(names, turns, axes, harmonics, period_turns) result(figure)
    character(len=*), intent(in) :: names(:)
    logical, intent(in) :: turns(:)
    integer, intent(in) :: axes, harmonics, period_turns
    type(figure_type) :: figure
    character(len=*), parameter :: labels(3) = [character(len=14) :: "force x (N)", "force y (N)", "force z (N)"]
    character(len=:), allocatable :: lines
    integer :: first(size(names)), k

    first = first_columns(turns, axes, merge(3, 1, axes == 3), 2)
    lines = layout_line(axes, 1) &
      & // "set grid noxtics ytics" // newline
    do k = 1, axes
      lines = lines // order_axis(harmonics, k == axes, period_turns) // key_line(k == 1) // order_panel("supports_harmonics.csv", &
        & trim(labels(k)), "1", first + 2 * (k - 1), names)
    end do
    figure = new_figure("supports_harmonics", "Amplitudes of the forces on the ground, place by place", lines &
      & // "unset multiplot" // newline, width=800, height=nint(height_of(axes)))
  end function plot_orders

  !> The first column of each reaction, which has `always` quantities and `more` where it turns, in `wide` columns each.
  pure function first_columns(turns, always, more, wide) result(first)
    logical, intent(in) :: turns(:)
    integer, intent(in) :: always, more, wide
    integer :: first(size(turns))
    integer :: i

    first = [(before + 1 + wide * (always * (i - 1) + more * count(turns(:i - 1))), i = 1, size(turns))]
  end function first_columns

end module gestell_task_forces_plot
