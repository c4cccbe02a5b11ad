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

  public :: orbit_layout, orbit_panel

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
    integer, parameter :: below = 64, above = 76, between = 84
    integer :: rows, side

    rows = (panels + across - 1) / across
    side = 555 / across - between * (across - 1) / across
    height = above + below + rows * side + between * (rows - 1)
    line = "set multiplot layout " // text(rows) // "," // text(across) // " margins 0.13,0.985," &
      & // concise(real(below, dp) / height, 3) // "," // concise(1 - real(above, dp) / height, 3) // " spacing " &
      & // concise(between / 640.0_dp, 3) // "," // concise(real(between, dp) / height, 3) // " title heading noenhanced" &
      & // newline // "set size square" // newline
  end subroutine orbit_layout

  !> Gnuplot lines for the panel of an orbit. Points mark twelfths of the period; every third is labelled with the crank angle.
  pure function orbit_panel(table, columns, labels, title, round_origin, beside, legend) result(lines)
    !> Table over the period whose first column is the crank angle
    type(table_type), intent(in) :: table
    !> `columns`: names of the columns for x and y, which have the same unit. `labels`: labels of the axes, without the unit
    character(len=*), intent(in) :: columns(2), labels(2), title
    !> True if the panel is centred at the origin; false if it is centred at the orbit
    logical, intent(in) :: round_origin
    !> Points of a second curve in SI units, shape (2, points)
    real(dp), intent(in), optional :: beside(:, :)
    !> Titles of the orbit and of the second curve
    character(len=*), intent(in), optional :: legend(2)
    character(len=:), allocatable :: lines, x, y, step
    type(growing_text_type) :: block
    type(axis_unit_type) :: unit
    real(dp) :: centre(2), half, ends(2, 2)
    integer :: k, rows

    do k = 1, 2
      associate (values => table%columns(table%number_of(columns(k)))%numbers)
        ends(:, k) = [minval(values, mask=ieee_is_finite(values)), maxval(values, mask=ieee_is_finite(values))]
        if (present(beside)) ends(:, k) = [min(ends(1, k), minval(beside(k, :))), max(ends(2, k), maxval(beside(k, :)))]
      end associate
    end do
    where (abs(ends) > 0.1_dp * huge(half)) ends = 0
    centre = 0
    if (.not. round_origin) centre = (ends(1, :) + ends(2, :)) / 2
    half = max(maxval(abs(ends(1, :) - centre)), maxval(abs(ends(2, :) - centre)))
    unit = pick_unit(trim(table%columns(table%number_of(columns(1)))%unit%words), maxval(abs(ends)))
    half = room * unit%factor * half
    ! variations that are only rounding errors are not enlarged
    if (.not. half > 1.0e-9_dp * unit%factor * maxval(abs(centre))) half = max(1.0_dp, unit%factor * maxval(abs(centre)))
    centre = unit%factor * centre
    rows = max(table%rows - 1, 1)
    x = "(" // trim(unit%words) // " * column(" // text(table%number_of(columns(1))) // "))"
    y = "(" // trim(unit%words) // " * column(" // text(table%number_of(columns(2))) // "))"
    lines = panel_heading(title) // axis("x", 1) // axis("y", 2) &
      & // "set xzeroaxis lt 8 dt 1 lw 0.6; set yzeroaxis lt 8 dt 1 lw 0.6" // newline &
      & // "outward(v, u, c) = v + " // concise(0.11_dp * half, 4) // " * (v - c) / (u > 0 ? u : 1)" // newline &
      & // "away(v, w) = sqrt((v - " // concise(centre(1), 7) // ")**2 + (w - " // concise(centre(2), 7) // ")**2)" // newline
    if (present(beside)) then
      call block%append("$beside << EOD" // newline // "x,y" // newline)
      do k = 1, size(beside, 2)
        call block%append(concise(unit%factor * beside(1, k), 6) // "," // concise(unit%factor * beside(2, k), 6) // newline)
      end do
      lines = lines // block%whole() // "EOD" // newline
    end if
    step = " every " // text(max(1, nint(real(rows, dp) / marked))) // "::0::" // text(rows - 1)
    lines = lines // "plot '" // table%name // ".csv' using " // x // ":" // y // " with lines lt 1 " // titled(1) // ", '' " &
      & // step // " using " // x // ":" // y // " with points lt 1 pt 7 ps 0.5 notitle"
    if (present(beside)) lines = lines // ", $beside using 1:2 with lines lt 2 lw 1.5 " // titled(2)
    step = " every " // text(max(1, nint(real(rows, dp) / labelled))) // "::0::" // text(rows - 1)
    lines = lines // ", '" // table%name // ".csv'" // step // " using (outward(" // x // ", away(" // x // ", " // y // "), " &
      & // concise(centre(1), 7) // ")):(outward(" // y // ", away(" // x // ", " // y // "), " // concise(centre(2), 7) &
      & // ")):(sprintf('%.0f°', column(1))) with labels font ',12' textcolor rgb '#444444' notitle" // newline

  contains

    !> Range, tics and label of an axis.
    pure function axis(letter, k) result(line)
      character, intent(in) :: letter
      integer, intent(in) :: k
      character(len=:), allocatable :: line

      line = "set " // letter // "range [" // concise(centre(k) - half, 6) // ":" // concise(centre(k) + half, 6) // "]; set " &
        & // letter // "tics " // concise(tic_step(half), 3) // "; set " // letter // "label " &
        & // quoted(label_with(labels(k), unit)) // " noenhanced" // newline
    end function axis

    !> Title of curve number `i` in the legend.
    pure function titled(i) result(words)
      integer, intent(in) :: i
      character(len=:), allocatable :: words

      words = "notitle"
      if (present(legend)) words = "title '" // trim(legend(i)) // "'"
    end function titled

  end function orbit_panel

  !> Distance of tics that divides a half axis of this length into about two parts: 1, 2 or 5 times a power of ten.
  pure real(dp) function tic_step(half) result(step)
    real(dp), intent(in) :: half
    real(dp) :: decade

    decade = 10.0_dp**floor(log10(half / 2))
    step = decade * merge(1.0_dp, merge(2.0_dp, 5.0_dp, half / 2 < 4.5_dp * decade), half / 2 < 1.8_dp * decade)
  end function tic_step

end module gestell_output_picture_orbits
