!> Draws a machine in space as three views at the same scale, in first-angle projection. In this projection the view from the left
!> is drawn to the right of the front view, and the view from above is drawn below it.
module gestell_task_drawing_views
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: probe_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_diagram, only: diagram_type
  use gestell_model_mounting, only: support_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_script, only: figure_type, new_figure, plotted, quoted
  use gestell_output_table, only: table_type
  use gestell_task_drawing_elements, only: colour => link_colour, column_pair, columns_type, element, new_columns, &
    & original_link, outline_lines, pair, point_columns
  use gestell_task_drawing_mounts, only: append, drawing_type, outline
  use gestell_task_drawing_placed, only: placed_type
  implicit none (type, external)
  private

  public :: plot_views

  !> Rows of mechanism.csv. `bold`: row whose position is drawn bold. Other positions are drawn faint. `step`: number of rows from
  !> one faint position to the next. `last_row`: last row that may be drawn faint
  integer, parameter :: bold = 60, step = 60, last_row = 359
  !> Indices of the coordinate axes that point to the right and upward in each of the three views
  integer, parameter :: right(3) = [1, 3, 1], upward(3) = [2, 2, 3]
  character(len=2), parameter :: axes(3) = ["ξ", "η", "ζ"]
  character(len=*), parameter :: headings(3) = [character(len=16) :: "from the front", "from the left", "from above"]
  !> Sizes in pixels. `wide`: width of the picture. `side`, `between`, `above`, `below`: margins around and between the views.
  !> `tallest`: maximum height of the picture
  real(dp), parameter :: wide = 960, side = 70, between = 75, above = 80, below = 60, tallest = 1100
  !> Maximum number of links that the legend names
  integer, parameter :: longest_key = 12

contains

  !> Draws the three views of the machine from the table mechanism.csv.
  type(figure_type) function plot_views(table, frame, linkage, diagram, placed, probes) result(figure)
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame
    class(linkage_type), intent(in) :: linkage
    !> Bars, joints on the frame and sliders. Positions are given in the planes of the mechanisms
    type(diagram_type), intent(in) :: diagram
    !> Positions of joints, centres of mass and guides in the frame's axes (m)
    type(placed_type), intent(in) :: placed
    type(probe_type), intent(in) :: probes(:)
    type(columns_type) :: columns
    character(len=:), allocatable :: lines
    real(dp) :: fixed_points(3, 1 + size(frame%supports) + size(probes))
    real(dp) :: low(3), high(3), extent, scale, height, left, bottom
    integer :: view, i

    columns = new_columns(table, linkage, 3)
    ! F, supports and probes
    fixed_points = reshape([0.0_dp, 0.0_dp, 0.0_dp, (frame%supports(i)%position, i = 1, size(frame%supports)), &
      & (probes(i)%position, probes(i)%z, i = 1, size(probes))], shape(fixed_points))
    ! bounding box of these points and all moving points
    do i = 1, 3
      low(i) = min(minval(fixed_points(i, :)), minval(placed%joints(i, :, :)), minval(placed%centers(i, :, :)), &
        & minval(placed%guides(i, :, :)))
      high(i) = max(maxval(fixed_points(i, :)), maxval(placed%joints(i, :, :)), maxval(placed%centers(i, :, :)), &
        & maxval(placed%guides(i, :, :)))
    end do
    extent = maxval(high - low)
    if (.not. extent > 0) extent = 1
    low = low - 0.16_dp * extent
    high = high + 0.16_dp * extent
    scale = min((wide - 2 * side - between) / (high(1) - low(1) + high(3) - low(3)), &
      & (tallest - above - below - between) / (high(2) - low(2) + high(3) - low(3)))
    height = above + below + between + scale * (high(2) - low(2) + high(3) - low(3))
    lines = "set multiplot title heading noenhanced" // newline // "row = " // text(bold) // newline // "step = " // text(step) &
      & // newline // "last = " // text(last_row) // newline // "set style textbox opaque fillcolor rgb '#FFFFFF' noborder " &
      & // "margins 0.3,0.3" // newline // "unset key" // newline // "set xtics " // concise(tics(extent), 2) // "; set ytics " &
      & // concise(tics(extent), 2) // newline
    do view = 1, 3
      left = merge(side + between + scale * (high(1) - low(1)), side, view == 2)
      bottom = merge(below, below + between + scale * (high(3) - low(3)), view == 3)
      associate (h => right(view), v => upward(view))
        lines = lines // "set lmargin at screen " // concise(left / wide, 6) // "; set rmargin at screen " &
          & // concise((left + scale * (high(h) - low(h))) / wide, 6) // "; set bmargin at screen " // concise(bottom / height, 6) &
          & // "; set tmargin at screen " // concise((bottom + scale * (high(v) - low(v))) / height, 6) // newline
        lines = lines // "set xrange [" // range_of(low(h), high(h), .false.) // "]; set yrange [" &
          & // range_of(low(v), high(v), view == 3) // "]" // newline // "set xlabel '" // trim(axes(h)) // " (m)' offset 0,0.5; " &
          & // "set ylabel '" // trim(axes(v)) // " (m)' offset 1.2,0" // newline
      end associate
      lines = lines // panel(view)
    end do
    lines = lines // key(linkage, (side + between + scale * (high(1) - low(1))) / wide, &
      & (below + scale * (high(3) - low(3))) / height) // "unset multiplot" // newline
    figure = new_figure("mechanism", "The mechanisms during " // turns_in_words(frame%mechanism%turns) &
      & // "; the bold links are at a crank angle of " // text(nint(frame%degrees_per_period() * bold / 360)) &
      & // " deg", lines, width=nint(wide), height=nint(height))

  contains

    !> Gnuplot commands that draw one of the three views.
    function panel(view) result(lines)
      integer, intent(in) :: view
      character(len=:), allocatable :: lines, words, at
      real(dp) :: length
      type(drawing_type) :: body, springs
      real(dp), allocatable :: hull(:, :)
      integer :: view_axes(2), i, k
      logical :: on_the_right

      view_axes = [right(view), upward(view)]
      call append(body, fixed_points(view_axes, :))
      call append(body, placed%joints(view_axes, pack([(i, i = 1, size(diagram%grounded))], diagram%grounded), 1))
      do i = 1, size(diagram%sliders)
        call append(body, placed%guides(view_axes, :, i))
      end do
      do i = 1, size(frame%supports)
        call draw_springs(springs, frame%supports(i), view_axes, 0.10_dp * extent)
      end do
      hull = outline(body%points, 0.025_dp * extent)
      lines = "unset label; unset arrow; unset object" // newline // "set label 1 '" // trim(headings(view)) &
        & // "' at graph 0,1.035 font ',13'" // newline // outline_lines(hull)
      ! draw the axes at F
      length = 0.09_dp * extent
      lines = lines // "set arrow 1 from 0,0 rto " // concise(length, 4) // ",0 size char 0.6,20 filled lt 7 dt 1 lw 1.2 front" &
        & // newline // "set arrow 2 from 0,0 rto 0," // concise(length, 4) // " size char 0.6,20 filled lt 7 dt 1 lw 1.2 front" &
        & // newline // "set label 2 'F' at 0,0 right offset -0.4," // either("0.6", "-0.6", view == 3) // " font ',12' front" &
        & // newline // "set label 3 '" // trim(axes(right(view))) // "' at " // concise(length, 4) &
        & // ",0 left offset 0.4,0 font ',11' front" &
        & // newline // "set label 4 '" // trim(axes(upward(view))) // "' at 0," // concise(length, 4) // " center offset 0," &
        & // either("-0.6", "0.6", view == 3) // " font ',11' front" // newline
      do i = 1, size(frame%supports)
        lines = lines // "set label " // text(10 + i) // " '" // text(i) // "' at " &
          & // pair(frame%supports(i)%position(view_axes)) // " center offset 0,-0.9 font ',11' boxed front" // newline
      end do
      lines = lines // "$springs" // text(view) // " << END" // newline // "x,y" // newline
      if (size(frame%supports) > 0) lines = lines // springs%data_lines()
      lines = lines // "END" // newline
      do i = 1, size(diagram%sliders)
        if (.not. norm2(placed%guides(view_axes, 2, i) - placed%guides(view_axes, 1, i)) > 0) cycle
        lines = lines // "set arrow " // text(10 + i) // " from " // pair(placed%guides(view_axes, 1, i)) // " to " &
          & // pair(placed%guides(view_axes, 2, i)) // " nohead lt 1 dt 1 lw 6 lc rgb '#B5BFC8' back" // newline
      end do
      words = bars(linkage, diagram, columns, view_axes, .false.)
      if (size(frame%supports) > 0) words = words // ", \" // newline // "  $springs" // text(view) &
        & // " using 1:2 with lines lt 7 dt 1 lw 1 notitle"
      do i = 1, size(frame%supports)
        words = words // element("::0::0", point_columns(frame%supports(i)%position(view_axes)), &
          & "points lt 1 pt 5 ps 0.6 lc rgb '#000000' notitle")
      end do
      words = words // bars(linkage, diagram, columns, view_axes, .true.)
      do i = 1, size(linkage%links)
        at = column_pair(columns%links(view_axes, i))
        words = words // element("::row::row", at, "points lt 1 pt " // merge("5 ps 1.5", "7 ps 0.7", linkage%links(i)%to == 0) &
          & // " lc rgb '#" // colour(linkage, i) // "' notitle")
      end do
      do i = 1, size(linkage%joints)
        at = column_pair(columns%joints(view_axes, i))
        words = words // element("::row::row", at, "points lt 1 pt 7 ps 0.5 lc rgb '#" &
          & // merge("000000", "FFFFFF", diagram%grounded(i)) // "' notitle") &
          & // element("::row::row", at, "points lt 1 pt 6 ps 0.5 lw 1 lc rgb '#000000' notitle")
      end do
      do i = 1, size(probes)
        k = 1 + size(frame%supports) + i
        at = point_columns(fixed_points(view_axes, k))
        on_the_right = fixed_points(view_axes(1), k) > sum(hull(1, :)) / size(hull, 2)
        words = words // element("::0::0", at, "points lt 1 pt 12 ps 1.4 lw 2 lc rgb '#CC0000' notitle") &
          & // element("::0::0", at // ":(" // plotted(trim(probes(i)%name)) // ")", "labels " &
          & // merge("right offset -0.8", "left offset 0.8  ", on_the_right) // ",0.8 font ',11' textcolor rgb '#CC0000' " &
          & // "noenhanced notitle")
      end do
      lines = lines // "plot NaN notitle" // words // newline
    end function panel

  end function plot_views

  !> Distance between tic marks: the smallest number of the form 1, 2 or 5 times a power of ten that is not less than a sixth of the
  !> machine's size.
  pure real(dp) function tics(extent)
    real(dp), intent(in) :: extent
    real(dp), parameter :: round(4) = [1.0_dp, 2.0_dp, 5.0_dp, 10.0_dp]
    real(dp) :: power

    power = 10.0_dp**floor(log10(extent / 6))
    tics = power * round(findloc(round * power >= extent / 6, .true., dim=1))
  end function tics

  !> Gnuplot range from `low` to `high` or, if `reversed`, from `high` to `low`.
  pure function range_of(low, high, reversed) result(words)
    real(dp), intent(in) :: low, high
    logical, intent(in) :: reversed
    character(len=:), allocatable :: words

    words = concise(merge(high, low, reversed), 6) // ":" // concise(merge(low, high, reversed), 6)
  end function range_of

  !> Draws the springs of a support as they appear in the view with the axes `view_axes`. `length`: length (m) of a spring that is
  !> parallel to the view.
  subroutine draw_springs(drawing, support, view_axes, length)
    type(drawing_type), intent(inout) :: drawing
    type(support_type), intent(in) :: support
    integer, intent(in) :: view_axes(2)
    real(dp), intent(in) :: length
    !> Springs are not drawn if they appear shorter than this fraction of `length`
    real(dp), parameter :: shortest = 0.25_dp
    integer, parameter :: turns = 7
    real(dp) :: along(2), across(2), points(2, turns + 5)
    integer :: axis, i

    do axis = 1, 3
      along = support%axes(view_axes, axis)
      if (.not. support%stiffness(axis) > 0 .or. norm2(along) < shortest) cycle
      ! a spring points away from F
      if (dot_product(along, support%position(view_axes)) < 0) along = -along
      across = [-along(2), along(1)] / norm2(along)
      points(:, 1) = 0
      points(:, 2) = 0.25_dp * along
      do i = 1, turns
        points(:, i + 2) = (0.25_dp + 0.5_dp * (i - 0.5_dp) / turns) * along + 0.09_dp * (-1)**i * across
      end do
      points(:, turns + 3) = 0.75_dp * along
      points(:, turns + 4:) = spread(along, 2, 2)
      points = spread(support%position(view_axes), 2, turns + 5) + length * points
      call append(drawing, points)
      call append(drawing, reshape([points(:, turns + 4) + 0.18_dp * length * across, points(:, turns + 4) &
        & - 0.18_dp * length * across], [2, 2]))
    end do
  end subroutine draw_springs

  !> Parts of the plot command that draw the bars. If `in_full`: bold in one position. Otherwise: faint in several positions over
  !> the period.
  pure function bars(linkage, diagram, columns, view_axes, in_full) result(words)
    class(linkage_type), intent(in) :: linkage
    type(diagram_type), intent(in) :: diagram
    type(columns_type), intent(in) :: columns
    integer, intent(in) :: view_axes(2)
    logical, intent(in) :: in_full
    character(len=:), allocatable :: words, at
    integer :: i

    words = ""
    do i = 1, size(diagram%bars)
      associate (bar => diagram%bars(i))
        at = columns%between(bar%joints, view_axes)
        if (in_full) then
          words = words // element("::row::row", at, "vectors nohead lt 1 " // merge("dt (6,4) lw 1.2", "dt 1 lw 3.5    ", &
            & bar%slides) // " lc rgb '#" // colour(linkage, bar%link) // "' notitle")
        else if (.not. bar%slides) then
          words = words // element("step::0::last", at, "vectors nohead lt 1 dt 1 lw 0.8 lc rgb '#B0" &
            & // colour(linkage, bar%link) // "' notitle")
        end if
      end associate
    end do
  end function bars

  !> Gnuplot commands that draw a legend with the names and colours of the links. It is placed in the corner that no view occupies.
  pure function key(linkage, left, top) result(lines)
    class(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: left, top
    character(len=:), allocatable :: lines
    integer :: i, n

    lines = "unset label; unset arrow; unset object" // newline
    n = 0
    do i = 1, size(linkage%links)
      if (original_link(linkage, i) < i .or. n >= longest_key) cycle
      n = n + 1
      lines = lines // "set label " // text(2 * n) // " '■' at screen " // concise(left, 5) // "," &
        & // concise(top - 0.028_dp * n, 5) // " font ',16' textcolor rgb '#" // colour(linkage, i) // "'" // newline &
        & // "set label " // text(2 * n + 1) // " " // quoted(linkage%links(i)%name) // " at screen " &
        & // concise(left + 0.025_dp, 5) // "," // concise(top - 0.028_dp * n, 5) // " font ',12' noenhanced" // newline
    end do
    lines = lines // "unset border; unset tics; unset xlabel; unset ylabel; set lmargin at screen 0; set rmargin at screen 0.01" &
      & // newline // "plot NaN notitle" // newline
  end function key

end module gestell_task_drawing_views
