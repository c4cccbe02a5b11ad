!> Writes the report of the task `separation` on the distance of the modes from the orders of the crank speed.
module gestell_task_separation_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, fixed, newline, text
  use gestell_base_verdict, only: judgement_type, operator(/=), operator(==), stable, undecided, unstable, verdict_type
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_model_frame, only: dof_names
  use gestell_task_separation, only: decoupled, is_decoupled, separation_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: report_separation, separation_headline

  !> Maximum number of pairs that the report lists among those that fail or are undecided
  integer, parameter :: max_listed = 30

contains

  !> Table of the modes, each with its nearest order, followed by a table of those pairs of mode and order that do not pass.
  pure function report_separation(separations, speeds, orders, margin, verdict, remark) result(lines)
    type(separation_type), intent(in) :: separations(:)
    !> `speeds`: speeds that are examined (1/min). `margin`: required distance (%)
    real(dp), intent(in) :: speeds(:), margin
    !> `orders`: range of the orders as text. `verdict`: verdict on the machine. `remark`: text below the table of modes, only for a
    !> frame in space
    character(len=*), intent(in) :: orders, remark
    type(judgement_type), intent(in) :: verdict
    character(len=:), allocatable :: lines, rows, heads, parts
    integer :: first, each, i, listed

    each = max(1, count(separations%mode == 1))
    lines = newline // "SEPARATION of the modes from order" // either(" 1", "s " // orders, each == 1) // " at " &
      & // concise(speeds(1), 7)
    if (size(speeds) > 1) lines = lines // " to " // concise(speeds(size(speeds)), 7)
    lines = lines // " rpm, about rest" // newline
    if (verdict%verdict /= stable) lines = lines // "  " // verdict%sentence() // newline
    heads = ""
    parts = ""
    do i = 1, maxval([3, separations%dofs])
      heads = heads // "," // trim(dof_names(i))
      if (.not. any(separations%dofs > 3)) heads = heads // " %"
      parts = parts // ", " // trim(dof_names(i))
    end do
    lines = lines // "  " // parts(3:) // ": shares of the kinetic energy" // either(" (%)", "", any(separations%dofs > 3)) &
      & // "; order: the order nearest to the mode; required distance " // concise(margin, 4) // " %" // newline
    rows = ""
    do first = 1, size(separations), each
      associate (mode => separations(first:first + each - 1))
        rows = rows // mode_row(mode(nearest_row(mode)))
      end associate
    end do
    if (any(separations%dofs > 3)) then
      lines = lines // tabulated(repeat("r", 5 + maxval(separations%dofs)) // "l", "mode,Hz,damping" // heads &
        & // ",order,distance %,", rows) // coupled_line(separations(::each)) // remark
    else
      lines = lines // tabulated("rrrrrrrrrl", "mode,Hz,damping" // heads // ",order,at Hz,distance %,", rows)
    end if
    if (all(separations%state == "pass")) return
    rows = ""
    listed = 0
    do i = 1, size(separations)
      if (separations(i)%state == "pass") cycle
      listed = listed + 1
      if (listed > max_listed) exit
      rows = rows // text(separations(i)%mode) // tab // concise(separations(i)%order, 4) // tab &
        & // number(separations(i)%speed, 6) // tab // number(separations(i)%frequency, 5) // tab &
        & // number(separations(i)%excitation, 5) // tab // number(100 * separations(i)%distance, 3) // tab &
        & // trim(separations(i)%state) // newline
    end do
    lines = lines // newline // tabulated("rrrrrrl", "mode,order,at rpm,mode's Hz,order's Hz,distance %,", rows)
    if (listed > max_listed) lines = lines // "  ... all pairs in separation.csv" // newline
  end function report_separation

  !> Position, in `mode`, of the order that is nearest to a mode. `mode` holds the distances of one mode from all orders. The
  !> result is 1 if the mode was not identified.
  pure integer function nearest_row(mode)
    type(separation_type), intent(in) :: mode(:)

    nearest_row = max(1, minloc(mode%distance, dim=1, mask=ieee_is_finite(mode%distance)))
  end function nearest_row

  !> Row of the table for one mode and its nearest order.
  pure function mode_row(one) result(row)
    type(separation_type), intent(in) :: one
    character(len=:), allocatable :: row
    integer :: k

    row = text(one%mode) // tab // number(one%frequency, 5) // tab // either(number(one%at%damping_ratio(), 3), "0", &
      & abs(one%at%growth) > one%at%error)
    do k = 1, one%dofs
      if (ieee_is_finite(one%energy(k))) row = row // tab // fixed(100 * one%energy(k), 0)
      if (.not. ieee_is_finite(one%energy(k))) row = row // tab // "?"
    end do
    row = row // tab // concise(one%order, 4) // tab
    if (one%dofs == 3) row = row // number(one%excitation, 5) // tab
    row = row // number(100 * one%distance, 3) // tab // trim(one%state) // newline
  end function mode_row

  !> Line that lists the coupled modes of a frame in space. A mode is coupled if no degree of freedom has a sufficient share of the
  !> kinetic energy.
  pure function coupled_line(modes) result(line)
    type(separation_type), intent(in) :: modes(:)
    character(len=:), allocatable :: line
    integer :: i, k

    line = ""
    do i = 1, size(modes)
      if (.not. modes(i)%at%identified) cycle
      k = maxloc(modes(i)%energy, dim=1)
      if (is_decoupled(modes(i)%energy(k))) cycle
      line = line // ", " // text(modes(i)%mode) // " (" // trim(dof_names(k)) // " " // fixed(100 * modes(i)%energy(k), 0) // " %)"
    end do
    if (line == "") line = ", none"
    line = "  coupled modes, largest share below " // text(decoupled) // " %: " // line(3:) // newline
  end function coupled_line

  !> The number as text, or a question mark if the number is not finite.
  pure function number(value, digits) result(words)
    real(dp), intent(in) :: value
    integer, intent(in) :: digits
    character(len=:), allocatable :: words

    words = either(concise(value, digits), "?", ieee_is_finite(value))
  end function number

  !> Writes the headline on the mode that is nearest to an order. `state`: unstable if a mode is too near to an order, otherwise
  !> stable or undecided.
  pure subroutine separation_headline(separations, margin, state, words)
    type(separation_type), intent(in) :: separations(:)
    !> Required distance of a mode from an order (%)
    real(dp), intent(in) :: margin
    type(verdict_type), intent(out) :: state
    character(len=:), allocatable, intent(out) :: words
    integer :: i

    state = stable
    if (any(separations%state == "undecided")) state = undecided
    if (any(separations%state == "fail")) state = unstable
    i = nearest_row(separations)
    words = "Separation: no mode could be identified"
    if (.not. separations(i)%at%identified) return
    words = "Separation: mode " // text(separations(i)%mode) // " (" // concise(separations(i)%frequency, 5) // " Hz) is " &
      & // number(100 * separations(i)%distance, 3) // " % away from order " // concise(separations(i)%order, 4) // " at " &
      & // concise(separations(i)%speed, 6) // " rpm; required: " // concise(margin, 4) // " %"
    if (state == undecided) words = words // "; whether some modes keep this distance is undecided"
  end subroutine separation_headline

end module gestell_task_separation_report
