!> Draws a planar mechanism over the period, together with its frame and mounts, to scale.
module gestell_task_drawing_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_words, only: character_count
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_script, only: figure_type, new_figure, plotted, quoted, span
  use gestell_output_table, only: table_type
  use gestell_task_drawing_elements, only: colour => link_colour, column_pair, columns_type, element, new_columns, &
    & original_link, outline_lines, pair, point_columns
  use gestell_task_drawing_guides, only: body_functions, guides, sliders
  use gestell_task_drawing_mounts, only: append, clear, draw_mount, drawing_type, outline
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_quantity_rows, only: probe_type
  use gestell_model_linkage_diagram, only: diagram_type
  implicit none (type, external)
  private

  public :: plot_mechanism

  !> Rows of mechanism.csv. `bold`: row whose position is drawn bold. Other positions are drawn faint. `usual_step`: number of rows
  !> from one faint position to the next. `wide_step`: number that is used instead if there are many bars
  integer, parameter :: bold = 60, usual_step = 30, wide_step = 60
  !> Indices of the coordinate axes that point to the right and upward in the picture
  integer, parameter :: plane(2) = [1, 2]
  !> Limits that keep the picture readable. With more bars than `many_bars`, fewer positions are drawn. With more joints than
  !> `many_joints`, names are smaller; with more than `too_many_joints`, only joints on the frame are named. With more links than
  !> `longest_key`, not counting copies, there is no legend. With more probes than `most_marks`, probes are not named.
  integer, parameter :: many_bars = 14, many_joints = 16, too_many_joints = 40, longest_key = 12, most_marks = 12
  !> Number of characters after which no further name is added to the label of several joints at the same point
  integer, parameter :: longest_names = 12

contains

  !> Draws the mechanism from the table mechanism.csv.
  type(figure_type) function plot_mechanism(table, frame, linkage, diagram, probes) result(figure)
    type(table_type), intent(in) :: table
    class(frame_type), intent(in) :: frame
    class(linkage_type), intent(in) :: linkage
    !> Positions of the mechanism in the frame's axes (m)
    type(diagram_type), intent(in) :: diagram
    !> Probes to be marked in the picture
    type(probe_type), intent(in) :: probes(:)
    type(columns_type) :: columns
    type(drawing_type) :: mounts, stiff
    character(len=:), allocatable :: lines, across, upward
    real(dp), allocatable :: hull(:, :)
    real(dp) :: low(2), high(2), extent, pixels, scale
    logical :: at_origin(size(diagram%grounded)), originals(size(linkage%links))
    integer :: i

    originals = [(original_link(linkage, i) == i, i = 1, size(originals))]
    columns = new_columns(table, linkage, 2)
    ! bounding box of all moving points, of F, the supports and the probes
    do i = 1, 2
      low(i) = min(0.0_dp, minval(diagram%joints(i, :, :)), minval(diagram%centers(i, :, :)), &
        & minval(frame%supports%position(i)), minval(probes%position(i)))
      high(i) = max(0.0_dp, maxval(diagram%joints(i, :, :)), maxval(diagram%centers(i, :, :)), &
        & maxval(frame%supports%position(i)), maxval(probes%position(i)))
    end do
    ! reference length for the size of symbols; it is smaller for a long slender machine
    extent = min(maxval(high - low), max(2 * minval(high - low), 0.3_dp * maxval(high - low)))
    if (.not. extent > 0) extent = 1
    at_origin = diagram%grounded .and. [(norm2(diagram%joints(:, i, 1) - frame%origin) < 1.0e-6_dp * extent, &
      & i = 1, size(at_origin))]
    hull = outline(points_of_frame(frame, diagram, probes), 0.025_dp * extent)
    call clear(mounts)
    call clear(stiff)
    do i = 1, size(frame%supports)
      call draw_mount(mounts, stiff, frame%supports(i), (low + high) / 2, 0.12_dp * extent)
    end do
    do i = 1, 2
      low(i) = min(low(i), minval(hull(i, :)), minval(mounts%points(i, :)), minval(stiff%points(i, :)))
      high(i) = max(high(i), maxval(hull(i, :)), maxval(mounts%points(i, :)), maxval(stiff%points(i, :)))
    end do
    across = span([low(1), high(1)])
    upward = span([low(2), high(2) + 0.05_dp * extent])
    lines = "set title heading noenhanced" // newline &
      & // "row = " // text(bold) // newline &
      & // "step = " // text(merge(wide_step, usual_step, size(diagram%bars) > many_bars)) // newline &
      & // "last = 360 - step" // newline &
      & // "set size ratio -1" // newline // "set xrange " // across // newline // "set yrange " // upward // newline &
      & // "set xlabel 'ξ (m)'" // newline // "set ylabel 'η (m)'" // newline &
      & // "set bmargin 6; set key at screen 0.5,screen 0.005 bottom center horizontal samplen 1.5 width 1" // newline &
      & // body_functions() // frame_lines(frame, at_origin, hull, extent)
    lines = lines // "$mounts << END" // newline // "x,y" // newline // mounts%data_lines() // "END" // newline &
      & // "$stiff << END" // newline // "x,y" // newline // stiff%data_lines() // "END" // newline
    lines = lines // "plot NaN notitle" // guides(diagram, columns, frame%origin, extent) &
      & // bars(linkage, diagram, columns, .false.) // traces(linkage, diagram, columns)
    if (size(mounts%ends) > 0) lines = lines // ", \" // newline // "  $mounts using 1:2 with lines lt 7 dt 1 lw 1 notitle"
    if (size(stiff%ends) > 0) lines = lines // ", \" // newline // "  $stiff using 1:2 with lines lt 7 dt 1 lw 2.5 notitle"
    pixels = min(max(680 * (high(2) - low(2)) / (high(1) - low(1)) + 150, 360.0_dp), 950.0_dp)
    scale = min(620 / (high(1) - low(1)), (pixels - 190) / (high(2) - low(2)))
    lines = lines // bars(linkage, diagram, columns, .true.) // sliders(diagram, columns, extent) &
      & // marks_and_pins(linkage, diagram, columns, at_origin, scale) &
      & // probe_marks(probes, [low(1), high(1)], scale * diagram%joints(:, :, bold + 1), scale)
    ! copies of a link have its colour and need no entry of their own
    if (count(originals) <= longest_key) then
      do i = 1, size(linkage%links)
        if (.not. originals(i)) cycle
        lines = lines // ", \" // newline // "  keyentry with linespoints lt 1 dt 1 lw " &
          & // merge("4.5", "1.0", any(diagram%bars%link == i)) // " pt 6 ps 1.1 lc rgb '#" // colour(linkage, i) // "' title " &
          & // quoted(linkage%links(i)%name) // " noenhanced"
      end do
    end if
    lines = lines // newline
    figure = new_figure("mechanism", "The mechanism during " // turns_in_words(frame%mechanism%turns) &
      & // "; the bold links are at a crank angle of " // text(nint(frame%degrees_per_period() * bold / 360)) &
      & // " deg", lines, width=800, height=nint(pixels))
  end function plot_mechanism

  !> Points that belong to the frame (m), shape (2, points): F, supports, probes, joints on the frame, and ends of the guides on the
  !> frame.
  pure function points_of_frame(frame, diagram, probes) result(points)
    class(frame_type), intent(in) :: frame
    type(diagram_type), intent(in) :: diagram
    type(probe_type), intent(in) :: probes(:)
    real(dp), allocatable :: points(:, :)
    type(drawing_type) :: all
    integer :: i, k

    call append(all, reshape([0.0_dp, 0.0_dp, (frame%supports(i)%position(:2), i = 1, size(frame%supports)), &
      & (probes(i)%position, i = 1, size(probes))], [2, 1 + size(frame%supports) + size(probes)]))
    call append(all, diagram%joints(:, pack([(i, i = 1, size(diagram%grounded))], diagram%grounded), 1))
    do i = 1, size(diagram%sliders)
      associate (guide => diagram%sliders(i)%guide, travel => diagram%sliders(i)%travel)
        if (.not. any(guide%carriers > 0)) call append(all, reshape([(frame%origin + guide%point + travel(k) &
          & * [cos(guide%angle), sin(guide%angle)], k = 1, 2)], [2, 2]))
      end associate
    end do
    points = all%points
  end function points_of_frame

  !> Gnuplot commands that draw the frame's outline, the axes at F and O, and the numbers of the supports.
  pure function frame_lines(frame, at_origin, hull, extent) result(lines)
    class(frame_type), intent(in) :: frame
    logical, intent(in) :: at_origin(:)
    real(dp), intent(in) :: hull(:, :), extent
    character(len=:), allocatable :: lines
    real(dp) :: middle
    integer :: i

    middle = (minval(hull(1, :)) + maxval(hull(1, :))) / 2
    lines = "set style textbox opaque fillcolor rgb '#FFFFFF' noborder margins 0.4,0.4" // newline &
      & // outline_lines(hull) // axes([0.0_dp, 0.0_dp], "F", "ξ", "η", extent, 1) &
      & // axes(frame%origin, merge(" ", "O", any(at_origin)), "x", "y", extent, 3)
    do i = 1, size(frame%supports)
      lines = lines // "set label " // text(10 + i) // " '" // text(i) // "' at " // pair(frame%supports(i)%position(:2)) &
        & // " " // merge("left offset 0.5  ", "right offset -0.5", frame%supports(i)%position(1) < middle) // ",0.8 font ',12' " &
        & // "boxed front" // newline
    end do
    if (size(frame%supports) == 0) lines = lines // "set label 9 'no &support: the frame is held by &foundation' " &
      & // "at graph 0.01,graph 0.03 font ',11' noenhanced" // newline
  end function frame_lines

  !> Gnuplot commands that draw two axes at a point as arrows, together with the names of the point and of the axes. At F the name
  !> of the second axis is moved aside, because O may lie above F.
  pure function axes(point, name, first, second, extent, number) result(lines)
    real(dp), intent(in) :: point(2), extent
    character(len=*), intent(in) :: name, first, second
    integer, intent(in) :: number
    character(len=:), allocatable :: lines
    real(dp) :: length

    length = 0.07_dp * extent
    lines = "set arrow " // text(number) // " from " // pair(point) // " rto " // concise(length, 4) // ",0 size char 0.6,20 " &
      & // "filled lt 7 dt 1 lw 1 front" // newline &
      & // "set arrow " // text(number + 1) // " from " // pair(point) // " rto 0," // concise(length, 4) // " size char 0.6,20 " &
      & // "filled lt 7 dt 1 lw 1 front" // newline &
      & // "set label " // text(2 * number) // " '" // name // "' at " // pair(point) &
      & // " right offset -0.4,-0.6 font ',12' front" // newline &
      & // "set label " // text(2 * number + 1) // " '" // first // "' at " // pair(point + [length, 0.0_dp]) &
      & // " left offset 0.3,0 font ',11' front" // newline &
      & // "set label " // text(2 * number + 2) // " '" // second // "' at " // pair(point + [0.0_dp, length]) &
      & // " " // either("left offset 0.5,-0.2", "center offset 0,0.6", name == "F") // " font ',11' front" // newline
  end function axes

  !> Parts of the plot command that draw the bars. If `in_full`: bold in one position, with the links that only translate.
  !> Otherwise: faint in several positions over the period.
  pure function bars(linkage, diagram, columns, in_full) result(words)
    class(linkage_type), intent(in) :: linkage
    type(diagram_type), intent(in) :: diagram
    type(columns_type), intent(in) :: columns
    logical, intent(in) :: in_full
    character(len=:), allocatable :: words, at
    integer :: i

    words = ""
    do i = 1, merge(size(linkage%links), 0, in_full)
      ! a link that only translates is drawn as a line from its joint to its centre of mass
      associate (link => linkage%links(i))
        if (link%to > 0 .or. .not. norm2(link%center) > 0) cycle
        words = words // element("::row::row", column_pair(columns%joints(plane, link%from)) // ":" // point_columns(link%center), &
          & "vectors nohead lt 1 dt 1 lw 3 lc rgb '#" // colour(linkage, i) // "' notitle")
      end associate
    end do
    do i = 1, size(diagram%bars)
      associate (bar => diagram%bars(i))
        at = columns%between(bar%joints, plane)
        if (in_full) then
          words = words // element("::row::row", at, "vectors nohead lt 1 lc rgb '#" // colour(linkage, bar%link) // "' " &
            & // merge("dt (6,4) lw 1.5", "dt 1 lw 4.5    ", bar%slides) // " notitle")
        else if (.not. bar%slides) then
          words = words // element("step::0::last", at, "vectors nohead lt 1 lc rgb '#A0" // colour(linkage, bar%link) &
            & // "' dt 1 lw 1 notitle")
        end if
      end associate
    end do
  end function bars

  !> Parts of the plot command that draw the paths of joints and centres of mass over the period.
  pure function traces(linkage, diagram, columns) result(words)
    class(linkage_type), intent(in) :: linkage
    type(diagram_type), intent(in) :: diagram
    type(columns_type), intent(in) :: columns
    character(len=:), allocatable :: words
    integer :: i

    words = ""
    do i = 1, size(diagram%grounded)
      if (.not. diagram%grounded(i)) words = words // element("1", column_pair(columns%joints(plane, i)), &
        & "lines lt 7 dt 1 lw 0.7 lc rgb '#777777' notitle")
    end do
    do i = 1, size(diagram%centers, 2)
      words = words // element("1", column_pair(columns%links(plane, i)), "lines lt 7 dt (3,3) lw 1 lc rgb '#" &
        & // colour(linkage, i) // "' notitle")
    end do
  end function traces

  !> Parts of the plot command that mark the probes. The name of a probe is placed above the probe, on the side towards the `middle`
  !> of the picture; if a joint is there, on the other side or below.
  pure function probe_marks(probes, ends, joints, scale) result(words)
    type(probe_type), intent(in) :: probes(:)
    !> `ends`: left and right end of the picture (m). `joints`: positions of the joints in pixels, shape (2, joints). `scale`:
    !> pixels per metre
    real(dp), intent(in) :: ends(2), joints(:, :), scale
    character(len=:), allocatable :: words, at
    !> Height of a label, and distance of its middle from the probe, in pixels
    real(dp), parameter :: height = 12, offset = 26
    real(dp) :: centre(2), width
    integer :: i, k, along, upward

    words = ""
    do i = 1, size(probes)
      at = point_columns(probes(i)%position)
      words = words // element("::0::0", at, "points lt 1 pt 12 ps 1.6 lw 2 lc rgb '#CC0000' notitle")
      if (size(probes) > most_marks) cycle
      width = 7 * character_count(trim(probes(i)%name))
      do k = 0, 4
        along = merge(1, -1, 2 * probes(i)%position(1) < sum(ends) .eqv. mod(k, 2) == 0)
        upward = merge(1, -1, k / 2 /= 1)
        centre = scale * probes(i)%position(:2) + [along * (width / 2 + 8), upward * offset]
        if (abs(centre(1) - scale * sum(ends) / 2) > (scale * (ends(2) - ends(1)) - width) / 2) cycle
        if (.not. any(abs(joints(1, :) - centre(1)) < width / 2 + height .and. abs(joints(2, :) - centre(2)) < 2 * height)) exit
      end do
      words = words // element("::0::0", at // ":(" // plotted(trim(probes(i)%name)) // ")", "labels " &
        & // merge("left  offset  0.9", "right offset -0.9", along > 0) // "," // merge(" 1.8", "-1.8", upward > 0) &
        & // " font ',12' textcolor rgb '#CC0000' noenhanced notitle")
    end do
    if (size(probes) > 0) words = words // ", \" // newline &
      & // "  keyentry with points lt 1 pt 12 ps 1.6 lw 2 lc rgb '#CC0000' title 'probe'"
  end function probe_marks

  !> Parts of the plot command that mark the centres of mass and the joints. Joints on the frame are filled circles. A name is
  !> placed on the side away from the other joints. Joints at the same point have one label with all their names; a label that would
  !> cover an earlier one is omitted.
  pure function marks_and_pins(linkage, diagram, columns, at_origin, scale) result(words)
    class(linkage_type), intent(in) :: linkage
    type(diagram_type), intent(in) :: diagram
    type(columns_type), intent(in) :: columns
    logical, intent(in) :: at_origin(:)
    !> Pixels per metre
    real(dp), intent(in) :: scale
    character(len=:), allocatable :: words, name, at
    logical :: here(size(at_origin))
    real(dp) :: middle(2), places(2, size(at_origin)), corners(2, size(at_origin)), length, corner(2)
    real(dp) :: lengths(size(at_origin))
    integer :: i, k, n, labels, side(2), font

    words = ""
    do i = 1, size(diagram%centers, 2)
      at = column_pair(columns%links(plane, i))
      words = words // element("::row::row", at, "points lt 1 pt 7 ps 1.1 lc rgb '#FFFFFF' notitle") &
        & // element("::row::row", at, "points lt 1 pt 6 ps 1.1 lw 1 lc rgb '#" // colour(linkage, i) // "' notitle") &
        & // element("::row::row", at, "points lt 1 pt 1 ps 1.1 lw 1 lc rgb '#" // colour(linkage, i) // "' notitle")
    end do
    n = size(linkage%joints)
    do i = 1, n
      at = column_pair(columns%joints(plane, i))
      words = words // element("::row::row", at, "points lt 1 pt 7 ps 0.9 lc rgb '#" &
        & // merge("000000", "FFFFFF", diagram%grounded(i)) // "' notitle") &
        & // element("::row::row", at, "points lt 1 pt 6 ps 0.9 lw 1.5 lc rgb '#000000' notitle")
    end do
    places = scale * diagram%joints(:, :, bold + 1)
    middle = sum(places, dim=2) / n
    font = merge(10, 13, n > many_joints)
    labels = 0
    do i = 1, n
      if (n > too_many_joints .and. .not. diagram%grounded(i)) cycle
      here = norm2(places - spread(places(:, i), 2, n), dim=1) < 1
      if (any(here(:i - 1))) cycle
      name = trim(linkage%joints(i)%name)
      do k = i + 1, n
        if (.not. here(k)) cycle
        if (len(name) > longest_names) name = name // ", ..."
        if (len(name) > longest_names) exit
        name = name // ", " // trim(linkage%joints(k)%name)
      end do
      if (any(here .and. at_origin .and. [(linkage%joints(k)%name /= "O", k = 1, n)]) .and. index(name // ",", "O,") /= 1) then
        name = name // " = O"
      end if
      ! lower left corner and length of the label in pixels
      side = merge(1, -1, places(:, i) >= middle)
      length = 0.6_dp * font * character_count(name)
      corner = places(:, i) + font * [0.8_dp * side(1), 0.6_dp * side(2)]
      if (side(1) < 0) corner(1) = corner(1) - length
      if (any(corner(1) < corners(1, :labels) + lengths(:labels) .and. corners(1, :labels) < corner(1) + length &
        & .and. abs(corner(2) - corners(2, :labels)) < font)) cycle
      labels = labels + 1
      corners(:, labels) = corner
      lengths(labels) = length
      words = words // element("::row::row", column_pair(columns%joints(plane, i)) // ":(" // plotted(name) // ")", &
        & "labels " // merge("left ", "right", side(1) > 0) // " offset " // merge(" 0.8", "-0.8", side(1) > 0) &
        & // "," // merge(" 0.6", "-0.6", side(2) > 0) // " font '," // text(font) // "' noenhanced notitle")
    end do
  end function marks_and_pins

end module gestell_task_drawing_plot
