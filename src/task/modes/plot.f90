!> Plots the mode shapes.
module gestell_task_modes_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_model_frame, only: frame_type
  use gestell_output_picture_panels, only: bar_style => bars
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_model_space, only: is_rotation
  use gestell_task_response_names, only: name_type, names_of
  use gestell_task_response_plot, only: speed_in_words
  implicit none (type, external)
  private

  public :: plot_modes

contains

  !> The picture modes.gp: amplitudes of the displacements in each eigenvector as bars, with one group for each conjugate pair.
  !> Rotations are multiplied by the frame's radius of gyration.
  type(figure_type) function plot_modes(frame, multipliers) result(figure)
    class(frame_type), intent(in) :: frame
    type(multipliers_type), intent(in) :: multipliers
    character(len=:), allocatable :: lines, positions, labels, most, bars, size_of, title
    type(name_type) :: names(3 * frame%dofs())
    real(dp) :: radius
    integer :: i, n, shown

    radius = 1
    if (frame%mass > 0 .and. frame%inertia > 0) radius = sqrt(frame%inertia / frame%mass)
    shown = 0
    positions = ""
    labels = ""
    do i = 1, size(multipliers%rho)
      if (aimag(multipliers%rho(i)) < 0) then
        positions = positions // " -9"
        cycle
      end if
      shown = shown + 1
      positions = positions // " " // text(shown)
      if (shown > 1) labels = labels // ", "
      labels = labels // "'" // text(i)
      if (aimag(multipliers%rho(i)) > 0) labels = labels // ", " // text(i + 1)
      labels = labels // "' " // text(shown)
    end do
    n = frame%dofs()
    names = names_of(n)
    most = "0"
    bars = ""
    do i = 1, n
      size_of = "size_of('" // trim(names(i)%column) // "')"
      title = "|" // trim(names(i)%symbol) // "|"
      if (is_rotation(i)) size_of = "radius * " // size_of
      if (is_rotation(i)) title = "r " // title
      if (i == 3) title = title // ", r = " // concise(radius, 3) // " m"
      most = "greatest(" // most // ", " // size_of // ")"
      if (i > 1) bars = bars // ", "
      bars = bars // either("'modes.csv'", "''", i == 1) // " using (place(column('index')) + " &
        & // concise(0.81_dp / n * (i - (n + 1) / 2.0_dp), 3) // "):(part(" // size_of // ")) with " // bar_style(i, 3) &
        & // " title '" // title // "'"
    end do
    lines = "set title heading noenhanced" // newline &
      & // "# position of a row among the bars, -9 for the second of a pair" // newline &
      & // "place(row) = real(word('" // positions(2:) // "', int(row)))" // newline &
      & // "size_of(name) = sqrt(column(name . '_re')**2 + column(name . '_im')**2)" // newline &
      & // "radius = " // concise(radius, 9) // newline &
      & // "greatest(a, b) = a > b ? a : b" // newline &
      & // "most(row) = " // most // newline &
      & // "part(value) = most(0) > 0 ? value / most(0) : 0" // newline &
      & // "set xrange [0.4:" // text(shown) // ".6]; set yrange [0:1.05]; set boxwidth " // concise(0.72_dp / n, 3) // newline &
      & // "set xtics (" // labels // "); set xlabel 'multipliers (largest first)'" // newline &
      & // "set ylabel 'amplitude relative to the largest'" // newline &
      & // "set grid noxtics ytics; set key outside bottom center horizontal samplen 2" // newline &
      & // "set style fill solid 1 border lt -1" // newline // "plot " // bars // newline
    figure = new_figure("modes", "Mode shapes at " // speed_in_words(frame) // ", crank angle 0", lines, width=720, height=460)
  end function plot_modes

end module gestell_task_modes_plot
