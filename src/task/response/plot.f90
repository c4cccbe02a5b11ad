!> Plots the periodic vibration over the period, and its harmonics.
module gestell_task_response_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_output_picture_script, only: figure_type, new_figure, panel_heading, span
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, maximum_of, pick_unit
  use gestell_output_picture_orders, only: highest_order, order_axis, order_panel
  use gestell_output_picture_panels, only: height_of, key_line, layout_line, turn_axis
  use gestell_model_space, only: is_rotation
  use gestell_output_report_significance, only: zero_if_noise
  use gestell_output_table, only: table_type
  use gestell_output_table_turn, only: amplitude_of
  use gestell_model_frame, only: frame_type
  use gestell_study_vibration, only: vibration_type
  use gestell_task_response_names, only: name_type, names_of
  implicit none (type, external)
  private

  public :: plot_harmonics, plot_response, speed_in_words

  !> Maximum length of the name of a column
  integer, parameter :: longest_column = 40

contains

  !> The picture of the table response.csv: motion of the frame and forces on the ground against the crank angle.
  type(figure_type) function plot_response(table, frame, vibration) result(figure)
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    character(len=:), allocatable :: lines
    type(axis_unit_type) :: unit
    real(dp) :: scale, noise
    type(name_type) :: names(3 * frame%dofs())
    integer, allocatable :: shown(:)
    integer :: i, k, n, first

    n = frame%dofs()
    names = names_of(n)
    ! a locked coordinate is zero, and often also the force that the mounts exert along it
    shown = pack([(i, i = 1, n)], [(any(frame%free == i) .or. counts(2 * n + i) > 0, i = 1, n)])
    lines = layout_line(2 * size(shown), 2) // turn_axis(frame, .false.)
    do i = 1, 2 * size(shown)
      ! place each coordinate next to the force or moment in its direction
      k = shown((i + 1) / 2) + merge(0, 2 * n, mod(i, 2) == 1)
      first = n * ((k - 1) / n) + 1
      unit = pick_unit(trim(names(k)%unit%words), maxval(vibration%peak, mask=names%unit%words == names(k)%unit%words), &
        & table%units)
      scale = unit%factor * counts(k)
      ! variations are not enlarged if they are below the error bound, or below the rounding error of quantities of the same kind
      noise = 2 * vibration%peak_error(k)
      if (k < first + 2) noise = max(noise, 1.0e-9_dp * maxval(vibration%peak(first:first + 1)))
      if (i == 2 * size(shown) - 1) lines = lines // turn_axis(frame, .true.)
      lines = lines // panel_heading("peak " // concise(scale * vibration%peak(k), 4) // ", rms " &
        & // concise(scale * vibration%rms(k), 4) // " " // trim(unit%name)) &
        & // "set ylabel '" // label_with(trim(names(k)%symbol), unit) // "'" // newline &
        & // "set yrange " // span(unit%factor * vibration%history(k, :), unit%factor * noise) // newline &
        & // "plot 'response.csv' using 'crank_deg':(" // trim(unit%words) // " * column('" // table%key_of(names(k)%column) &
        & // "')) with lines lt " // text(merge(1, 2, mod(i, 2) == 1)) // " dt 1 notitle" // newline
    end do
    figure = new_figure("response", "Periodic vibration and forces on the ground at " // speed_in_words(frame), lines &
      & // "unset multiplot" // newline, height=nint(height_of(size(shown))))

  contains

    !> 0 if the peak of quantity `k` is only rounding error, otherwise 1.
    pure real(dp) function counts(k)
      integer, intent(in) :: k
      integer :: first

      first = n * ((k - 1) / n) + 1
      counts = zero_if_noise(vibration%peak(k), vibration%peak_error(k), maxval(vibration%peak(first:first + n - 1)))
    end function counts

  end function plot_response

  !> The picture of the table harmonics.csv: amplitudes for each order. Four panels show displacements and forces (upper row),
  !> rotations and moments (lower row).
  type(figure_type) function plot_harmonics(table, frame) result(figure)
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame
    character(len=*), parameter :: titles(2, 2) = reshape([character(len=12) :: "displacement", "rotation", "force", "moment"], &
      & [2, 2])
    type(name_type) :: names(3 * frame%dofs())
    character(len=longest_column) :: columns(size(names))
    character(len=:), allocatable :: lines
    integer, allocatable :: own(:)
    integer :: i, k, n, last, below
    logical :: moves(3 * frame%dofs()), kind(3 * frame%dofs()), shown(2)

    n = frame%dofs()
    names = names_of(n)
    do i = 1, size(names)
      columns(i) = amplitude_of(trim(names(i)%column), names(i)%unit)
    end do
    last = highest_order(table, columns([(i, i = 1, n), (i, i = 2 * n + 1, 3 * n)]), frame%mechanism%turns)
    ! without the row of panels in which everything is locked, and without columns that are zero
    moves = [(maximum_of(table, columns(i:i)) > 0, i = 1, size(columns))]
    kind = is_rotation([((i, i = 1, n), k = 1, 3)])
    shown = [any(moves .and. .not. kind), any(moves .and. kind)]
    if (.not. any(shown)) shown = .true.
    below = merge(2, 1, shown(2))
    lines = layout_line(2 * count(shown), 2) // "set grid noxtics ytics" // newline
    do k = 1, 2
      if (.not. shown(k)) cycle
      do i = 1, 2
        own = pack([(i, i = 1, n)], is_rotation([(i, i = 1, n)]) .eqv. k == 2) + 2 * n * (i - 1)
        if (any(moves(own))) own = pack(own, moves(own))
        lines = lines // order_axis(table, last, k == below, frame%mechanism%turns) // key_line(.true.) // order_panel(table, &
          & trim(titles(k, i)), columns(own), axis_of(names(own)%symbol), frame%mechanism%turns)
      end do
    end do
    figure = new_figure("harmonics", "Harmonics of the vibration and of the forces on the ground at " // speed_in_words(frame), &
      & lines // "unset multiplot" // newline, height=nint(height_of(count(shown))))
  end function plot_harmonics

  !> Symbol without the word "force", "moment" or "rot", because the label of the axis says what is shown.
  elemental character(len=10) function axis_of(symbol) result(axis)
    character(len=*), intent(in) :: symbol

    axis = symbol
    if (any([index(symbol, "force "), index(symbol, "moment "), index(symbol, "rot ")] == 1)) axis = symbol(index(symbol, " ") + 1:)
  end function axis_of

  !> The drive speed as text, for example "360 rpm".
  pure function speed_in_words(frame) result(words)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: words

    words = concise(frame%drive_rpm(), 6) // " rpm"
  end function speed_in_words

end module gestell_task_response_plot
