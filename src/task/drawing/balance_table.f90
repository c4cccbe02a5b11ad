!> Writes the balance table: shaking forces and couples of all mechanisms of a frame in space, for each order of the crank.
module gestell_task_drawing_balance_table
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: newline
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_shaking, only: shaking_in_space, space_shaking_type
  use gestell_output_report_orders, only: order_of
  use gestell_output_report_text_table, only: listed, number_cells, tabulated
  use gestell_output_report_wrapping, only: wrapped
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: balance_table

  !> Highest order of the crank speed in the table
  integer, parameter :: highest = 8

contains

  !> The balance table, a section of the report. For each order it lists the amplitudes of forces and couples along the axes. It
  !> also lists the magnitudes of the vectors that rotate with the crank and against it.
  function balance_table(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines, rows, turning, shaft
    type(space_shaking_type) :: forces
    logical :: nothing
    integer :: k, i

    lines = newline // "SHAKING FORCES AND COUPLES of all mechanisms on a frame at rest"
    call shaking_in_space(frame, forces)
    if (.not. all(ieee_is_finite(forces%rms) .and. ieee_is_finite(forces%peak))) then
      lines = lines // ":" // newline // "  they overflow double precision" // newline
      return
    end if
    rows = ""
    turning = ""
    do k = 1, min(highest * frame%mechanism%turns, size(forces%series(1)%amplitude))
      ! fractional orders are listed only if their forces are not zero
      nothing = all([(forces%series(i)%amplitude(k) <= forces%noise(i), i = 1, 6)])
      if (nothing .and. modulo(k, frame%mechanism%turns) > 0) cycle
      rows = rows // order_of(k, frame%mechanism%turns) // cells([(forces%series(i)%amplitude(k), i = 1, 6)], forces%noise) &
        & // newline
      if (all([forces%force(k, :), forces%couple(k, :)] <= forces%noise([1, 1, 4, 4]))) cycle
      turning = turning // order_of(k, frame%mechanism%turns) // cells([forces%force(k, :), forces%couple(k, :)], &
        & forces%noise([1, 1, 4, 4])) // newline
    end do
    rows = rows // "peak" // cells(forces%peak, forces%noise) // newline // "rms" // cells(forces%rms, forces%noise) // newline
    lines = lines // ", amplitudes" // newline // tabulated("rrrrrrr", "order,fx,fy,fz,mx,my,mz" // newline &
      & // ",N,N,N,N m,N m,N m", rows) // "  couples are about the origin O; orders are multiples of the crank speed" // newline
    ! the axis of the shaft is mentioned only if it is not the zeta axis
    shaft = ""
    if (forces%shaft(3) < 1) shaft = " (" // listed(forces%shaft, 3, ", ") // ")"
    if (turning /= "") lines = lines // wrapped("  components normal to the first shaft" // shaft // ", rotating with and " &
      & // "against the crank:" // newline) // tabulated("rrrrr", "order,force with,against,couple with,against" // newline &
      & // ",N,N,N m,N m", turning)
  end function balance_table

  !> The values as table cells. A value that does not exceed `noise`, the limit of its rounding error, is written as 0.
  pure function cells(values, noise) result(words)
    real(dp), intent(in) :: values(:), noise(:)
    character(len=:), allocatable :: words

    words = number_cells(merge(0.0_dp, values, values <= noise), 5)
  end function cells

end module gestell_task_drawing_balance_table
