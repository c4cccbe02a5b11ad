!> Composes gnuplot panels with orbits: one component of a vector over another during the period, on equal scales.
module gestell_output_picture_orbits
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_output_picture_axis, only: tic_step
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, pick_unit
  use gestell_output_picture_script, only: panel_heading, quoted
  use gestell_output_table, only: table_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: inline_orbit_panel, orbit_layout, orbit_panel

  !> Number of points that mark equal parts of the period, and number of those that are labelled with the crank angle
  integer, parameter :: marked = 12, labelled = 4
  !> `room`: room around the orbit, relative to its half width. `noise`: values below this fraction of the largest in the picture
  !> are zero. `constant`: a force whose variation is below this fraction of its magnitude is constant
  real(dp), parameter :: room = 1.3_dp, noise = 1.0e-6_dp, constant = 0.01_dp
  !> Maximum number of characters in the title of a panel
  integer, parameter :: longest_title = 34

contains

  !> Gnuplot line that arranges square panels below the heading, `across` in a row. `height`: height of the picture in pixels that
  !> fits them.
  subroutine orbit_layout(panels, across, line, height)
    integer, intent(in) :: panels, across
    character(len=:), allocatable, intent(out) :: line
    integer, intent(out) :: height
    integer, parameter :: below = 64, above = 76, between = 92
    integer :: rows, side

    rows = (panels + across - 1) / across
    side = 525 / across - between * (across - 1) / across
    height = above + below + rows * side + between * (rows - 1)
    line = "set multiplot layout " // text(rows) // "," // text(across) // " margins 0.155,0.97," &
      & // concise(real(below, dp) / height, 3) // "," // concise(1 - real(above, dp) / height, 3) // " spacing " &
      & // concise(between / 640.0_dp, 3) // "," // concise(real(between, dp) / height, 3) // " title heading noenhanced" &
      & // newline // "set size square" // newline
  end subroutine orbit_layout

  !> Gnuplot lines for the orbit in two columns of a table over the period, whose first column is the crank angle.
  pure function orbit_panel(table, columns, labels, title, round_origin, largest) result(lines)
    type(table_type), intent(in) :: table
    !> `columns`: names of the columns for x and y, which have the same unit. `labels`: labels of the axes, without the unit
    character(len=*), intent(in) :: columns(2), labels(2), title
    !> True if the panel contains the origin; false if it is centred at the orbit
    logical, intent(in) :: round_origin
    !> Largest value in all panels of the picture, which have the same unit
    real(dp), intent(in) :: largest
    character(len=:), allocatable :: lines
    integer :: number(2)

    number = [table%number_of(columns(1)), table%number_of(columns(2))]
    associate (x => table%columns(number(1)), y => table%columns(number(2)), crank => table%columns(1))
      lines = panel("'" // table%name // ".csv'", number, transpose(reshape([x%numbers, y%numbers], [size(x%numbers), 2])), &
        & crank%numbers, trim(x%unit%words), labels, title, round_origin, largest)
    end associate
  end function orbit_panel

  !> Gnuplot lines for an orbit around the origin that is not in a table. The points become a block of data in the script.
  pure function inline_orbit_panel(points, degrees, si, labels, title, largest) result(lines)
    !> Points at equal steps of the crank angle, from the beginning to the end of the period, shape (2, points)
    real(dp), intent(in) :: points(:, :)
    !> `degrees`: crank angle during the period (deg). `largest`: largest value in all panels of the picture
    real(dp), intent(in) :: degrees, largest
    !> `si`: unit of the points. `labels`: labels of the axes, without the unit
    character(len=*), intent(in) :: si, labels(2), title
    character(len=:), allocatable :: lines
    type(growing_text_type) :: block
    integer :: k, n

    n = size(points, 2) - 1
    call block%append("$orbit << EOD" // newline // "crank_deg,x,y" // newline)
    do k = 0, n
      call block%append(concise(degrees * k / n, 6) // "," // concise(points(1, k + 1), 6) // "," // concise(points(2, k + 1), 6) &
        & // newline)
    end do
    lines = block%whole() // "EOD" // newline // panel("$orbit", [2, 3], points, [(degrees * k / n, k = 0, n)], si, labels, title, &
      & .true., largest)
  end function inline_orbit_panel

  !> The panel of an orbit. Points mark twelfths of the period. If the orbit is practically a point, words take its place.
  pure function panel(source, columns, points, crank, si, labels, title, round_origin, largest) result(lines)
    !> `source`: gnuplot name of the data. `si`: unit of the data. `labels`: labels of the axes, without the unit
    character(len=*), intent(in) :: source, si, labels(2), title
    !> Numbers of the columns for x and y
    integer, intent(in) :: columns(2)
    !> Points of the orbit, shape (2, points), their crank angles (deg), and the largest value in all panels of the picture
    real(dp), intent(in) :: points(:, :), crank(:), largest
    logical, intent(in) :: round_origin
    character(len=:), allocatable :: lines, x, y, words
    type(axis_unit_type) :: unit
    real(dp) :: ends(2, 2), middle(2), scale, half
    integer :: k

    unit = pick_unit(si, largest)
    scale = unit%factor * largest
    do k = 1, 2
      associate (values => points(k, :))
        ends(:, k) = [minval(values, mask=ieee_is_finite(values)), maxval(values, mask=ieee_is_finite(values))]
      end associate
    end do
    where (abs(ends) > 0.1_dp * huge(ends)) ends = 0
    ends = unit%factor * ends
    middle = sum(ends, dim=1) / 2
    half = maxval(ends(2, :) - ends(1, :)) / 2
    lines = panel_heading(title, longest_title) // "unset label" // newline
    if (any(half <= [noise * scale, merge(constant, 0.0_dp, round_origin) * norm2(middle)])) then
      words = "zero"
      if (norm2(middle) > noise * scale) words = "constant: " // concise(norm2(middle), 3) // " " // trim(unit%name)
      lines = lines // "unset xtics; unset ytics; unset xlabel; unset ylabel" // newline // "set label 1 '" // words &
        & // "' at graph 0.5,graph 0.5 center" // newline // "plot [1:2] [1:2] NaN notitle" // newline
      return
    end if
    if (round_origin) ends = reshape([min(ends(1, :), 0.0_dp), max(ends(2, :), 0.0_dp)], [2, 2], order=[2, 1])
    half = room * maxval(ends(2, :) - ends(1, :)) / 2
    ends = spread(sum(ends, dim=1) / 2, 1, 2) + reshape([-half, half, -half, half], [2, 2])
    x = "(" // trim(unit%words) // " * column(" // text(columns(1)) // "))"
    y = "(" // trim(unit%words) // " * column(" // text(columns(2)) // "))"
    lines = lines // axis("x", 1) // axis("y", 2) // "set xzeroaxis lt 8 dt 1 lw 0.6; set yzeroaxis lt 8 dt 1 lw 0.6" // newline &
      & // angle_labels(unit%factor * points, crank, middle, ends) // "plot " // source // " using " // x // ":" // y &
      & // " with lines lt 1 notitle, " // source // " every " // text(step(size(points, 2) - 1, marked)) // "::0::" &
      & // text(max(size(points, 2) - 2, 0)) // " using " // x // ":" // y // " with points lt 1 pt 7 ps 0.5 notitle" // newline

  contains

    !> Range, tics and label of an axis.
    pure function axis(letter, k) result(line)
      character, intent(in) :: letter
      integer, intent(in) :: k
      character(len=:), allocatable :: line

      line = "set " // letter // "range [" // concise(ends(1, k), 6) // ":" // concise(ends(2, k), 6) // "]; set " // letter &
        & // "tics nomirror " // concise(tic_step(2 * half, 5), 3) // either(" font ',12'", "", letter == "x") &
        & // "; set " // letter &
        & // "label " // quoted(label_with(labels(k), unit)) // " noenhanced" // newline
    end function axis

  end function panel

  !> Gnuplot lines with the crank angles at quarters of the period, next to the orbit. Angles at nearly equal points share a label.
  !> A label that would cover the orbit or an earlier label is omitted. All labels are omitted if the orbit is smaller than the
  !> labels.
  pure function angle_labels(points, crank, middle, ends) result(lines)
    !> Points of the orbit, shape (2, points), their crank angles, middle of the orbit, and ends of the axes, shape (2, 2)
    real(dp), intent(in) :: points(:, :), crank(:), middle(2), ends(2, 2)
    character(len=:), allocatable :: lines
    !> Width of a character and height of a label, and space around it, as fractions of the axes
    real(dp), parameter :: character_width = 0.031_dp, height = 0.065_dp, space = 0.02_dp
    !> Angles between the direction from the middle to the point, and the direction from the point to its label (deg)
    real(dp), parameter :: turns(8) = [0.0_dp, 45.0_dp, -45.0_dp, 90.0_dp, -90.0_dp, 135.0_dp, -135.0_dp, 180.0_dp]
    character(len=32) :: words(labelled)
    real(dp) :: at(2, labelled), box(2, labelled), centre(2), angle, side
    logical :: shown(labelled)
    integer :: i, k, m, n, first

    side = ends(2, 1) - ends(1, 1)
    lines = ""
    n = 0
    do k = 0, labelled - 1
      i = 1 + k * step(size(points, 2) - 1, labelled)
      if (i > size(points, 2) - merge(1, 0, k > 0)) exit
      if (.not. all(ieee_is_finite(points(:, i)))) cycle
      do first = 1, n
        if (norm2(points(:, i) - at(:, first)) < space * side) exit
      end do
      if (first > n) then
        n = first
        at(:, n) = points(:, i)
        words(n) = ""
      else
        words(first) = trim(words(first)) // "/"
      end if
      words(first) = trim(words(first)) // text(nint(crank(i))) // "°"
    end do
    if (maxval(maxval(points, dim=2) - minval(points, dim=2)) < 4 * character_width * side) return
    shown = .false.
    do k = 1, n
      box(:, k) = side * [character_width * (len_trim(words(k)) - 1), height]
      do m = 1, size(turns)
        angle = atan2(at(2, k) - middle(2), at(1, k) - middle(1)) + turns(m) * acos(-1.0_dp) / 180
        centre = at(:, k) + [cos(angle), sin(angle)] * (box(:, k) / 2 + space * side)
        shown(k) = all(centre - box(:, k) / 2 > ends(1, :) .and. centre + box(:, k) / 2 < ends(2, :)) .and. .not. any([(shown(i) &
          & .and. all(abs(centre - at(:, i)) < (box(:, k) + box(:, i)) / 2), i = 1, k - 1)]) .and. .not. any(abs(points(1, :) &
          & - centre(1)) < box(1, k) / 2 .and. abs(points(2, :) - centre(2)) < box(2, k) / 2)
        if (shown(k)) exit
      end do
      if (.not. shown(k)) cycle
      at(:, k) = centre
      lines = lines // "set label " // text(k) // " '" // trim(words(k)) // "' at " // concise(centre(1), 6) // "," &
        & // concise(centre(2), 6) // " center font ',12' textcolor rgb '#444444'" // newline
    end do
  end function angle_labels

  !> Distance of rows that divides this number of rows into equal parts.
  pure integer function step(rows, parts)
    integer, intent(in) :: rows, parts

    step = max(1, nint(real(rows, dp) / parts))
  end function step

end module gestell_output_picture_orbits
