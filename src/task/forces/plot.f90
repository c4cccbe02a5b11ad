!> Pictures of the forces on the ground, reaction by reaction.
module gestell_task_forces_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_output_picture_panels, only: height_of, history_panel, key_line, layout_line, order_axis, order_panel, turn_axis
  use gestell_task_forces_reactions, only: reaction_type
  implicit none (type, external)
  private

  public :: plot_forces

  character, parameter :: newline = new_line("a")
  !> Columns before those of the reactions.
  integer, parameter :: before = 2

contains

  !> supports.gp, supports_history.gp, supports_harmonics.gp.
  function plot_forces(reactions, speed, harmonics) result(figures)
    type(reaction_type), intent(in) :: reactions(:)
    real(dp), intent(in) :: speed
    integer, intent(in) :: harmonics
    type(figure_type) :: figures(3)
    character(len=24) :: names(size(reactions))
    logical :: turns(size(reactions))
    integer :: i

    do i = 1, size(names)
      names(i) = reactions(i)%name
      if (scan(names(i), "0123456789") == 1) names(i) = "support " // reactions(i)%name
      turns(i) = reactions(i)%turns
    end do
    figures(1) = plot_summary(names)
    figures(2) = plot_histories(names, turns, speed)
    figures(3) = plot_orders(names, turns, harmonics)
  end function plot_forces

  !> Bars for every reaction.
  function plot_summary(names) result(figure)
    character(len=*), intent(in) :: names(:)
    type(figure_type) :: figure
    character(len=12), parameter :: columns(4) = [character(len=12) :: "fx_peak_N", "fy_peak_N", "f_peak_N", "f_rms_N"]
    character(len=16), parameter :: titles(4) = [character(len=16) :: "peak along x", "peak along y", "peak", "rms"]
    character(len=12), parameter :: fills(4) = [character(len=12) :: "solid 1", "pattern 2", "solid 0.25", "pattern 5"]
    character(len=:), allocatable :: lines, tics
    integer :: i

    tics = ""
    do i = 1, size(names)
      tics = tics // ", '" // trim(names(i)) // "' " // text(i - 1)
    end do
    lines = "set title heading noenhanced" // newline &
      & // "set xrange [-0.6:" // text(size(names) - 1) // ".6]; set boxwidth 0.2; set xtics (" // tics(3:) // ")" // newline &
      & // "set ylabel 'force (N)'" // newline // "set grid noxtics ytics; set xtics scale 0" // newline &
      & // "set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
      & // "most = 0; set table $unused" // newline &
      & // "plot [0:1] [-1:1] 'supports.csv' using (0):(v = column('f_peak_N'), most = v > most ? v : most, 0)" // newline &
      & // "unset table" // newline // "set yrange [0:(most > 0 ? 1.05 * most : 1)]" // newline // "plot "
    do i = 1, 4
      if (i > 1) lines = lines // ", \" // newline // "  "
      lines = lines // "'supports.csv' using ($0 + " // concise(0.21_dp * (i - 2.5_dp), 3) // "):(column('" // trim(columns(i)) &
        & // "')) with boxes lt " // text(i) // " dt 1 lw 1 fs " // trim(fills(i)) // " border lt -1 title '" &
        & // trim(titles(i)) // "'"
    end do
    figure = new_figure("supports", "Forces on the ground, place by place", lines, width=800, height=480)
  end function plot_summary

  !> Forces along x and y, their size, and the moment where there is one.
  function plot_histories(names, turns, speed) result(figure)
    character(len=*), intent(in) :: names(:)
    logical, intent(in) :: turns(:)
    real(dp), intent(in) :: speed
    type(figure_type) :: figure
    character(len=*), parameter :: labels(4) = [character(len=14) :: "force x (N)", "force y (N)", "force (N)", "moment (N m)"]
    character(len=:), allocatable :: lines
    integer :: first(size(names)), panels, i, k

    first = first_columns(turns, 3, 1)
    panels = 3 + merge(1, 0, any(turns))
    lines = layout_line(panels, 1)
    do k = 1, panels
      lines = lines // turn_axis(speed, k == panels) // key_line(k == 1)
      if (k <= 3) then
        lines = lines // history_panel("supports_history.csv", trim(labels(k)), "1", first + k - 1, names)
      else
        lines = lines // history_panel("supports_history.csv", trim(labels(k)), "1", pack(first + 3, turns), &
          & pack(names, turns), pack([(i, i = 1, size(names))], turns))
      end if
    end do
    figure = new_figure("supports_history", "Forces on the ground over a turn, place by place", lines // "unset multiplot" &
      & // newline, width=800, height=nint(height_of(panels)))
  end function plot_histories

  function plot_orders(names, turns, harmonics) result(figure)
    character(len=*), intent(in) :: names(:)
    logical, intent(in) :: turns(:)
    integer, intent(in) :: harmonics
    type(figure_type) :: figure
    character(len=*), parameter :: labels(2) = [character(len=14) :: "force x (N)", "force y (N)"]
    character(len=:), allocatable :: lines
    integer :: first(size(names)), k

    first = first_columns(turns, 2, 2)
    lines = layout_line(2, 1) &
      & // "set grid noxtics ytics" // newline
    do k = 1, 2
      lines = lines // order_axis(harmonics, k == 2) // key_line(k == 1) // order_panel("supports_harmonics.csv", &
        & trim(labels(k)), "1", first + 2 * (k - 1), names)
    end do
    figure = new_figure("supports_harmonics", "Amplitudes of the forces on the ground, place by place", lines &
      & // "unset multiplot" // newline, width=800, height=nint(height_of(2)))
  end function plot_orders

  !> The first column of each reaction, which has `always` quantities and one more where it turns, in `wide` columns each.
  pure function first_columns(turns, always, wide) result(first)
    logical, intent(in) :: turns(:)
    integer, intent(in) :: always, wide
    integer :: first(size(turns))
    integer :: i

    first = [(before + 1 + wide * (always * (i - 1) + count(turns(:i - 1))), i = 1, size(turns))]
  end function first_columns

end module gestell_task_forces_plot
