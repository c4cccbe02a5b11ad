!> Panels of pictures with a curve or a row of bars for each of several things: columns of a file over the crank angle, or
!> amplitudes over the orders of the crank.
module gestell_output_picture_panels
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_picture_script, only: quoted, span
  use gestell_output_picture_axis, only: extent_lines
  implicit none (type, external)
  private

  public :: height_of, history_panel, key_line, layout_line, order_axis, order_panel, turn_axis, with_rim

  character, parameter :: newline = new_line("a")
  !> More than these are drawn as points in place of bars.
  integer, parameter :: most_bars = 4

contains

  !> Panels one below the other, or in rows of `across`, under the picture's heading; `legend`: with room below for one of so many
  !> pixels.
  pure function layout_line(panels, across, legend) result(line)
    integer, intent(in) :: panels, across
    integer, intent(in), optional :: legend
    character(len=:), allocatable :: line
    real(dp) :: height, below
    integer :: rows

    rows = (panels + across - 1) / across
    height = height_of(rows)
    below = 70
    if (present(legend)) height = height + legend
    if (present(legend)) below = below + legend
    line = "set multiplot layout " // text(rows) // "," // text(across) // " margins " // merge("0.14 ", "0.125", across == 1) &
      & // ",0.975," // concise(below / height, 3) // "," // concise(1 - 86 / height, 3) &
      & // " spacing 0.145," // concise(34 / height, 3) // " title heading noenhanced" // newline
  end function layout_line

  !> A range from one value to another, with room at both for a mark and its name.
  pure function with_rim(from, to) result(range)
    real(dp), intent(in) :: from, to
    character(len=:), allocatable :: range
    real(dp), parameter :: rim = 0.025_dp

    range = span([from, to])
    if (abs(to - from) > 0) range = "[" // concise(from - rim * (to - from), 9) // ":" // concise(to + rim * (to - from), 9) // "]"
  end function with_rim

  !> Pixels of so many rows of panels.
  pure real(dp) function height_of(rows)
    integer, intent(in) :: rows

    height_of = 160 + 190 * rows
  end function height_of

  !> The crank angle from 0 to 360 deg, or to -360, or through so many `turns`; tics have numbers where `named`.
  pure function turn_axis(speed, named, turns) result(lines)
    real(dp), intent(in) :: speed
    logical, intent(in) :: named
    integer, intent(in), optional :: turns
    character(len=:), allocatable :: lines
    integer :: last

    last = 360
    if (present(turns)) last = 360 * turns
    lines = "set xtics " // text(last / 4) // "; set xrange [0:" // text(nint(sign(real(last, dp), speed))) // "]" // newline &
      & // x_names("crank angle (deg)", named)
  end function turn_axis

  !> Orders from 0 to the last of so many `harmonics` of a period of so many `turns`, one where they are missing.
  pure function order_axis(harmonics, named, turns) result(lines)
    integer, intent(in) :: harmonics
    logical, intent(in) :: named
    integer, intent(in), optional :: turns
    character(len=:), allocatable :: lines

    lines = "set xrange [-0.6:" // text(harmonics) // ".6]" // newline
    if (present(turns)) lines = "set xrange [" // concise(-0.6_dp / turns, 6) // ":" // concise((harmonics + 0.6_dp) / turns, 6) &
      & // "]" // newline
    lines = lines &
      & // x_names("order of the crank speed (0: magnitude of the mean)", named)
  end function order_axis

  pure function x_names(label, named) result(line)
    character(len=*), intent(in) :: label
    logical, intent(in) :: named
    character(len=:), allocatable :: line

    line = "set format x ''; unset xlabel" // newline
    if (named) line = "set format x; set xlabel '" // label // "'" // newline
  end function x_names

  !> What the curves are called, above the panel that comes next; `nothing`: no more.
  pure function key_line(shown) result(line)
    logical, intent(in) :: shown
    character(len=:), allocatable :: line

    line = "set key off" // newline
    if (shown) line = "set key on at graph 1,graph 1.01 bottom right horizontal samplen 2 width 1 font ',12'" // newline
  end function key_line

  !> `factor` times the columns of `file` over its first, named by `names`, with the styles of these `numbers` where there is
  !> not one for each.
  pure function history_panel(file, label, factor, columns, names, numbers) result(lines)
    character(len=*), intent(in) :: file, label, factor, names(:)
    integer, intent(in) :: columns(:)
    integer, intent(in), optional :: numbers(:)
    character(len=:), allocatable :: lines
    type(growing_text_type) :: curves
    integer :: styles(size(columns)), i

    styles = [(i, i = 1, size(columns))]
    if (present(numbers)) styles = numbers

    do i = 1, size(columns)
      if (i > 1) call curves%append(", \" // newline // "  ")
      call curves%append("'" // file // "' using 1:(" // factor // " * column(" // text(columns(i)) // ")) with lines lt " &
        & // text(style(styles(i))) // " title " // quoted(trim(names(i))) // " noenhanced")
    end do
    lines = extent_lines(file, values_of(factor, columns)) // "set yrange [low - 0.07 * (high - low):high + 0.07 * (high - low)]" &
      & // newline // "set ylabel " // quoted(label) // " noenhanced" // newline // "plot " // curves%whole() // newline
  end function history_panel

  !> `factor` times the amplitudes in columns of `file` over the order, on six decades.
  pure function order_panel(file, label, factor, columns, names, turns) result(lines)
    character(len=*), intent(in) :: file, label, factor, names(:)
    integer, intent(in) :: columns(:)
    integer, intent(in), optional :: turns
    character(len=:), allocatable :: lines
    type(growing_text_type) :: curves
    character(len=24), parameter :: fills(most_bars) = [character(len=24) :: "solid 1", "pattern 2", "solid 0.25", "pattern 5"]
    real(dp) :: width
    integer :: i

    width = 0.84_dp / size(columns)
    if (present(turns)) width = width / turns
    do i = 1, size(columns)
      if (i > 1) call curves%append(", \" // newline // "  ")
      if (size(columns) <= most_bars) then
        call curves%append("'" // file // "' using (column(1) + " // concise(width * (i - 0.5_dp * (size(columns) + 1)), 3) &
          & // "):(abs(" // factor // " * column(" // text(columns(i)) // "))) with boxes lt " // text(style(i)) &
          & // " dt 1 lw 1 fs " // trim(fills(i)) // " border lt -1 title " // quoted(trim(names(i))) // " noenhanced")
      else
        call curves%append("'" // file // "' using 1:(abs(" // factor // " * column(" // text(columns(i)) // "))) with points lt " &
          & // text(style(i)) // " pt " // text(i) // " title " // quoted(trim(names(i))) // " noenhanced")
      end if
    end do
    lines = extent_lines(file, values_of(factor, columns)) // "most = high > 0 && high > -low ? high : -low" // newline &
      & // "if (high == 1 && low == -1) { unset logscale y; set yrange [0:1]; set format y } else " &
      & // "{ set logscale y; set yrange [most * 1e-6:most * 3]; set format y '10^{%L}' }" // newline &
      & // "set boxwidth " // concise(width, 3) // newline // "set ylabel " // quoted(label) // " noenhanced" // newline &
      & // "plot " // curves%whole() // newline
  end function order_panel

  pure function values_of(factor, columns) result(expressions)
    character(len=*), intent(in) :: factor
    integer, intent(in) :: columns(:)
    character(len=len(factor) + 30) :: expressions(size(columns))
    integer :: i

    do i = 1, size(columns)
      expressions(i) = factor // " * column(" // text(columns(i)) // ")"
    end do
  end function values_of

  pure integer function style(i)
    integer, intent(in) :: i

    style = 1 + mod(i - 1, 8)
  end function style

end module gestell_output_picture_panels
