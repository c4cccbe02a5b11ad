!> Formats a table of results as text, so that the report and the file of the table show the same values.
module gestell_output_report_table_lines
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, fixed, newline, text
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_output_table, only: column_type, nothing, table_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  implicit none (type, external)
  private

  public :: in_degrees, table_lines

contains

  !> Text of the columns of a table that have a number of `digits`. Missing values are shown as "-", angles in degrees. Rows of
  !> peaks and rms values are blank where they have no value.
  pure function table_lines(table, align, heads, digits, omit_zeros) result(lines)
    type(table_type), intent(in) :: table
    !> Alignment and headings of the shown columns, as for `tabulated`
    character(len=*), intent(in) :: align, heads
    !> For each column: number of significant digits, or 0 if the column is not shown
    integer, intent(in) :: digits(:)
    !> True to omit rows whose shown numbers are all missing or zero; by default all rows are shown
    logical, intent(in), optional :: omit_zeros
    character(len=:), allocatable :: lines
    character(len=:), allocatable :: row, word
    logical :: is_zero, is_summary
    integer :: i, k

    lines = ""
    do i = 1, table%rows
      row = ""
      is_zero = .false.
      if (present(omit_zeros)) is_zero = omit_zeros
      is_summary = .false.
      if (allocated(table%columns(1)%words)) is_summary = any(table%columns(1)%word(i) == ["peak", "rms "])
      do k = 1, size(digits)
        if (digits(k) == 0) cycle
        word = cell(table%columns(k), i, digits(k))
        if (allocated(table%columns(k)%numbers)) is_zero = is_zero .and. (word == "0" .or. word == "-")
        if (word == "-" .and. is_summary) word = ""
        row = row // either(tab, "", k > findloc(digits > 0, .true., dim=1)) // word
      end do
      if (.not. is_zero) lines = lines // row // newline
    end do
    if (lines /= "") lines = tabulated(align, heads, lines)
  end function table_lines

  !> The value in row `i` of a column as text.
  pure function cell(column, i, digits) result(words)
    type(column_type), intent(in) :: column
    integer, intent(in) :: i, digits
    character(len=:), allocatable :: words

    words = "-"
    if (allocated(column%numbers)) then
      associate (value => column%numbers(i))
        if (ieee_is_nan(value)) return
        if (.not. ieee_is_finite(value)) then
          words = "overflow"
        else if (column%unit%words == "rad") then
          words = in_degrees(value)
        else
          words = concise(value, digits)
          if (column%unit%words == "%") words = either("+", "", value > 0) // words // " %"
        end if
      end associate
    else if (allocated(column%integers)) then
      if (column%integers(i) /= nothing) words = text(column%integers(i))
    else
      words = column%word(i)
    end if
  end function cell

  !> An angle (rad) as text in degrees with one decimal, in the range -180 < angle <= 180.
  pure function in_degrees(angle) result(words)
    real(dp), intent(in) :: angle
    character(len=:), allocatable :: words
    real(dp) :: rounded

    rounded = anint(angle * 1800 / pi)
    if (rounded <= -1800) rounded = 1800
    words = fixed(rounded / 10 + 0.0_dp, 1)
    if (words == "-0.0") words = "0.0"
  end function in_degrees

end module gestell_output_report_table_lines
