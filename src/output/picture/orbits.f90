!> Composes gnuplot panels with orbits: one component of a vector over another during the period, on equal scales.
module gestell_output_picture_orbits
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, pick_unit
  use gestell_output_picture_script, only: panel_heading, quoted
  use gestell_output_table, only: table_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: inline_orbit_panel, orbit_layout, orbit_panel

  !> Number of points that mark equal parts of the period, and number of those that are labelled with the crank angle
  integer, parameter :: marked = 12, labelled = 4
  !> Room around the orbit, relative to its half width
  real(dp), parameter :: room = 1.3_dp

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
    side = 535 / across - between * (across - 1) / across
    height = above + below + rows * side + between * (rows - 1)
    line = "set multiplot layout " // text(rows) // "," // text(across) // " margins 0.155,0.985," &
      & // concise(real(below, dp) / height, 3) // "," // concise(1 - real(above, dp) / height, 3) // " spacing " &
      & // concise(between / 640.0_dp, 3) // "," // concise(real(between, dp) / height, 3) // " title heading noenhanced" &
      & // newline // "set size square" // newline
  end subroutine orbit_layout

  !> Gnuplot lines for the orbit in two columns of a table over the period, whose first column is the crank angle.
  pure function orbit_panel(table, columns, labels, title, round_origin) result(lines)
    type(table_type), intent(in) :: table
    !> `columns`: names of the columns for x and y, which have the same unit. `labels`: labels of the axes, without the unit
    character(len=*), intent(in) :: columns(2), labels(2), title
    !> True if the panel is centred at the origin; false if it is centred at the orbit
    logical, intent(in) :: round_origin
    character(len=:), allocatable :: lines
    real(dp) :: ends(2, 2)
    integer :: number(2), k

    do k = 1, 2
      number(k) = table%number_of(columns(k))
      associate (values => table%columns(number(k))%numbers)
        ends(:, k) = [minval(values, mask=ieee_is_finite(values)), maxval(values, mask=ieee_is_finite(values))]
      end associate
    end do
    where (abs(ends) > 0.1_dp * huge(ends)) ends = 0
    lines = panel("'" // table%name // ".csv'", number, table%rows - 1, ends, trim(table%columns(number(1))%unit%words), labels, &
      & title, round_origin)
  end function orbit_panel

  !> Gnuplot lines for an orbit around the origin that is not in a table. The points become a block of data in the script.
  pure function inline_orbit_panel(points, degrees, si, labels, title) result(lines)
    !> Points at equal steps of the crank angle, from the beginning to the end of the period, shape (2, points)
    real(dp), intent(in) :: points(:, :)
    !> Crank angle during the period (deg)
    real(dp), intent(in) :: degrees
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
    lines = block%whole() // "EOD" // newline // panel("$orbit", [2, 3], n, reshape([minval(points, dim=2), maxval(points, &
      & dim=2)], [2, 2], order=[2, 1]), si, labels, title, .true.)
  end function inline_orbit_panel

  !> The panel of an orbit. Points mark twelfths of the period; every third is labelled with the crank angle.
  pure function panel(source, columns, rows, ends, si, labels, title, round_origin) result(lines)
    !> `source`: gnuplot name of the data. `si`: unit of the data. `labels`: labels of the axes, without the unit
    character(len=*), intent(in) :: source, si, labels(2), title
    !> `columns`: numbers of the columns for x and y. `rows`: number of rows of the period
    integer, intent(in) :: columns(2), rows
    !> Minimum and maximum of x and y, shape (2, 2)
    real(dp), intent(in) :: ends(2, 2)
    logical, intent(in) :: round_origin
    character(len=:), allocatable :: lines, x, y
    type(axis_unit_type) :: unit
    real(dp) :: centre(2), half

    centre = 0
    if (.not. round_origin) centre = (ends(1, :) + ends(2, :)) / 2
    half = max(maxval(abs(ends(1, :) - centre)), maxval(abs(ends(2, :) - centre)))
    unit = pick_unit(si, maxval(abs(ends)))
    half = room * unit%factor * half
    centre = unit%factor * centre
    ! variations that are only rounding errors are not enlarged
    if (.not. half > 1.0e-9_dp * maxval(abs(centre))) half = max(1.0_dp, maxval(abs(centre)))
    x = "(" // trim(unit%words) // " * column(" // text(columns(1)) // "))"
    y = "(" // trim(unit%words) // " * column(" // text(columns(2)) // "))"
    lines = panel_heading(title) // axis("x", 1) // axis("y", 2) &
      & // "set xzeroaxis lt 8 dt 1 lw 0.6; set yzeroaxis lt 8 dt 1 lw 0.6" // newline &
      & // "outward(v, u, c) = v + " // concise(0.11_dp * half, 4) // " * (v - c) / (u > 0 ? u : 1)" // newline &
      & // "away(v, w) = sqrt((v - " // concise(centre(1), 7) // ")**2 + (w - " // concise(centre(2), 7) // ")**2)" // newline &
      & // "plot " // source // " using " // x // ":" // y // " with lines lt 1 notitle, " // source // every(marked) // " using " &
      & // x // ":" // y // " with points lt 1 pt 7 ps 0.5 notitle, " // source // every(labelled) // " using (outward(" // x &
      & // ", away(" // x // ", " // y // "), " // concise(centre(1), 7) // ")):(outward(" // y // ", away(" // x // ", " // y &
      & // "), " // concise(centre(2), 7) // ")):(sprintf('%.0f°', column(1))) with labels font ',12' textcolor rgb '#444444' " &
      & // "notitle" // newline

  contains

    !> Gnuplot option that selects `parts` rows at equal distances.
    pure function every(parts) result(words)
      integer, intent(in) :: parts
      character(len=:), allocatable :: words

      words = " every " // text(max(1, nint(real(rows, dp) / parts))) // "::0::" // text(max(rows, 1) - 1)
    end function every

    !> Range, tics and label of an axis.
    pure function axis(letter, k) result(line)
      character, intent(in) :: letter
      integer, intent(in) :: k
      character(len=:), allocatable :: line

      line = "set " // letter // "range [" // concise(centre(k) - half, 6) // ":" // concise(centre(k) + half, 6) // "]; set " &
        & // letter // "tics " // concise(tic_step(half), 3) // "; set " // letter // "label " &
        & // quoted(label_with(labels(k), unit)) // " noenhanced" // newline
    end function axis

  end function panel

  !> Distance of tics on an axis with this half width: 1, 2 or 5 times a power of ten, so that three to five tics fit.
  pure real(dp) function tic_step(half) result(step)
    real(dp), intent(in) :: half
    real(dp) :: decade, most

    most = half / 1.25_dp
    decade = 10.0_dp**floor(log10(most))
    step = decade * merge(1.0_dp, merge(2.0_dp, 5.0_dp, most < 5 * decade), most < 2 * decade)
  end function tic_step

end module gestell_output_picture_orbits
