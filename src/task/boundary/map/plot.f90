!> Plots border curves in the plane of two parameters.
module gestell_task_boundary_map_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_output_picture_axis, only: coordinate, parameter_axis, with_unit
  use gestell_output_picture_marks, only: input_point, none_found, shaded_entry, unstable_fill
  use gestell_output_picture_regions, only: left_side
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_study_grid, only: grid_type
  use gestell_task_boundary_map, only: border_map_type
  use gestell_task_range_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  public :: empty_label, count_words, over_chart, plot_curves

contains

  !> The plot boundary.gp. It shows the curves, with a different dash pattern for each kind of border, and the shaded region on
  !> the left of the curves.
  function plot_curves(plan, map, kinds, states, meanings, title, side) result(figure)
    type(sweep_plan_type), intent(in) :: plan
    type(border_map_type), intent(in) :: map
    !> `kinds`, `states`: kinds of borders, each with a state of the machine. `meanings`: their legend entries. `title`: start of
    !> the title. `side`: name of the shaded region
    character(len=*), intent(in) :: kinds(:), states(:), meanings(:), title, side
    type(figure_type) :: figure
    character(len=:), allocatable :: lines, list, condition
    logical :: own(size(map%vertices), size(kinds))
    integer :: i, c

    associate (paths => plan%paths, units => plan%units, grid => plan%grid)
      lines = "set title heading noenhanced" // newline &
        & // parameter_axis("x", grid%axes(1), with_unit(paths(1), units(1)), 0.0_dp) &
        & // parameter_axis("y", grid%axes(2), with_unit(paths(2), units(2)), 0.0_dp) &
        & // "set bmargin 6; set key at screen 0.5,screen 0.01 bottom center horizontal samplen 2" // newline &
        & // region_boxes(grid, map)
      if (size(plan%base) == 2) lines = lines // input_point(grid%axes, plan%base)
      list = empty_label(map%curves) // "plot NaN notitle"
      if (map%curves > 0) list = list // ", $side using 1:3:1:2:3:4 with boxxyerror " // unstable_fill // " notitle" &
        & // shaded_entry // "'" // side // "'"
      do i = 1, size(kinds)
        own(:, i) = map%vertices%kind == kinds(i) .and. map%vertices%state == states(i)
      end do
      do c = 1, map%curves
        do i = 1, size(kinds)
          if (.not. any(map%vertices%curve == c .and. own(:, i))) cycle
          condition = "strcol('kind') eq '" // trim(kinds(i)) // "'"
          if (states(i) /= "") condition = condition // " && strcol('state') eq '" // trim(states(i)) // "'"
          list = list // ", 'boundary.csv' using (column(1) == " // text(c) // " && " // condition // " ? X(column(2)) : NaN):" &
            & // "(Y(column(3))) with lines lt " // text(i) // " lw 2.5 notitle"
        end do
      end do
      do i = 1, size(kinds)
        if (any(own(:, i))) list = list // ", keyentry with lines lt " // text(i) // " lw 2.5 title '" // trim(meanings(i)) // "'"
      end do
    end associate
    figure = new_figure("boundary", title // ": " // count_words(map%curves), lines // list // newline, height=560)
  end function plot_curves

  !> Plot commands that draw the border curves on a chart of the same parameters. Their colour, unlike black, is the same on dark
  !> screens, like the colours of the chart.
  pure function over_chart(map) result(curves)
    type(border_map_type), intent(in) :: map
    character(len=:), allocatable :: curves

    curves = ""
    if (map%curves > 0) curves = ", for [c=1:" // text(map%curves) // "] 'boundary.csv' using (column(1) == c ? X(column(2)) : " &
      & // "NaN):(Y(column(3))) with lines lt 7 dt 1 lw 1.5 lc rgb '#000011'"
  end function over_chart

  !> Gnuplot data block $side: boxes that fill the region on the left of the curves. Columns: lower and upper x, lower and upper y.
  pure function region_boxes(grid, map) result(lines)
    type(grid_type), intent(in) :: grid
    type(border_map_type), intent(in) :: map
    character(len=:), allocatable :: lines
    real(dp) :: points(2, size(map%vertices)), low(2), wide(2), box(4)
    real(dp), allocatable :: boxes(:, :)
    integer, allocatable :: order(:)
    logical :: mirrored
    integer :: i, k

    lines = ""
    if (map%curves == 0) return
    mirrored = .false.
    do k = 1, 2
      associate (ends => coordinate(grid%axes(k), [grid%axes(k)%from, grid%axes(k)%to]))
        low(k) = minval(ends)
        wide(k) = maxval(ends) - low(k)
      end associate
      points(k, :) = (coordinate(grid%axes(k), map%vertices%parameters(k)) - low(k)) / wide(k)
      ! For negative parameters the logarithm of the absolute value decreases when the parameter increases, so left and right are
      ! exchanged.
      mirrored = mirrored .neqv. (grid%axes(k)%logarithmic .and. grid%axes(k)%from < 0)
    end do
    order = [(i, i = 1, size(points, 2))]
    if (mirrored) order = order(size(order):1:-1)
    boxes = left_side(points(:, order), (map%vertices(order)%curve))
    lines = "$side << END" // newline // "from,to,from,to" // newline
    do i = 1, size(boxes, 2)
      box = [low(1) + wide(1) * boxes(:2, i), low(2) + wide(2) * boxes(3:, i)]
      lines = lines // concise(box(1), 6) // "," // concise(box(2), 6) // "," // concise(box(3), 6) // "," // concise(box(4), 6) &
        & // newline
    end do
    lines = lines // "END" // newline
  end function region_boxes

  !> Gnuplot label "none found" if there are no curves; otherwise empty. `number`: number of curves.
  pure function empty_label(number) result(line)
    integer, intent(in) :: number
    character(len=:), allocatable :: line

    line = ""
    if (number == 0) line = none_found
  end function empty_label

  !> Text with the number of borders that were found.
  pure function count_words(number) result(words)
    integer, intent(in) :: number
    character(len=:), allocatable :: words

    words = text(number) // " found"
    if (number == 0) words = "none found"
  end function count_words

end module gestell_task_boundary_map_plot
