!> Converts result tables to HTML. The tables show the columns that people read; a button shows all columns.
module gestell_output_page_table
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_markup, only: escaped
  use gestell_output_page_html, only: cell, row, scroll_start, with_squares
  use gestell_output_picture_axis, only: unit_words
  use gestell_output_picture_axis_unit, only: axis_unit_type, maximum_in, pick_unit
  use gestell_output_table, only: column_type, nothing, table_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  implicit none (type, external)
  private

  public :: html_table

  !> `max_rows`: maximum number of rows shown. `most_columns`: a table that shows more columns than this is transposed if it
  !> has less than half as many rows.
  integer, parameter :: max_rows = 60, most_columns = 10
  !> A table with more rows than this is hidden until the reader opens it.
  integer, parameter :: most_open = 12
  !> Numbers of significant digits of values and of error bounds
  integer, parameter :: value_digits = 5, error_digits = 2
  !> A number below this fraction of the maximum of all columns with its unit is shown as zero, because it is only rounding error.
  real(dp), parameter :: rounding = 1.0e-12_dp
  !> Angles below this are shown in mrad (rad)
  real(dp), parameter :: small_angle = 0.1_dp
  !> Text of a missing value
  character(len=*), parameter :: no_value = "–"

contains

  !> HTML text of `table`; empty if the table has no rows.
  pure function html_table(table) result(lines)
    type(table_type), intent(in) :: table
    character(len=:), allocatable :: lines, row_cells
    type(axis_unit_type) :: units(size(table%columns))
    logical :: details(size(table%columns))
    real(dp) :: zero(size(table%columns))
    integer :: rows, i, k

    lines = ""
    if (table%rows == 0) return
    rows = min(table%rows, max_rows)
    details = [(is_detail(table, k), k = 1, size(details))]
    if (all(details)) details = .false.
    units = [(shown_unit(table, k), k = 1, size(units))]
    zero = [(zero_limit(table, k), k = 1, size(zero))]
    if (table%rows > most_open) lines = "<details><summary>" // text(table%rows) // " rows</summary>" // newline
    if (any(details)) lines = lines // "<button type=""button"" class=""all"" aria-pressed=""false"">all columns</button>" &
      & // newline
    lines = lines // scroll_start(table%heading // ", table") // "<table>" // newline
    if (table%rows > rows) lines = lines // "<caption>The first " // text(rows) // " of " // text(table%rows) &
      & // " rows; the file " // escaped(table%name) // ".csv contains all rows.</caption>" // newline
    if (count(.not. details) > max(most_columns, 2 * rows)) then
      ! transposed: each column of the table becomes a row, headed by its label
      lines = lines // "<tbody>" // newline
      do k = 1, size(details)
        row_cells = heading_cell("row", table%columns(k), units(k))
        do i = 1, rows
          row_cells = row_cells // value_cell(table, k, i, units(k), zero(k))
        end do
        lines = lines // row(row_cells, details(k))
      end do
    else
      row_cells = ""
      do k = 1, size(details)
        row_cells = row_cells // heading_cell("th", table%columns(k), units(k), details(k))
      end do
      lines = lines // "<thead>" // row(row_cells) // "</thead>" // newline // "<tbody>" // newline
      do i = 1, rows
        row_cells = ""
        do k = 1, size(details)
          row_cells = row_cells // value_cell(table, k, i, units(k), zero(k), details(k))
        end do
        lines = lines // row(row_cells)
      end do
    end if
    lines = lines // "</tbody>" // newline // "</table></div>" // newline
    if (table%rows > most_open) lines = lines // "</details>" // newline
  end function html_table

  !> True if the column is shown only on request: it contains error bounds, numbers of rows, equal flags or no values, or the table
  !> marks it as a detail.
  pure logical function is_detail(table, k)
    type(table_type), intent(in) :: table
    !> Number of the column
    integer, intent(in) :: k

    associate (column => table%columns(k))
      is_detail = column%is_detail .or. value_column(table, k) > 0 .or. column%key == "error" .or. column%key == "index"
      if (allocated(column%numbers)) then
        is_detail = is_detail .or. all(ieee_is_nan(column%numbers))
      else if (allocated(column%integers)) then
        is_detail = is_detail .or. all(column%integers == nothing) .or. column%is_flag &
          & .and. all(column%integers == column%integers(1))
      else
        is_detail = is_detail .or. column%words == ""
      end if
    end associate
  end function is_detail

  !> Number of the column whose error bounds column `k` contains; 0 if it contains no error bounds.
  pure integer function value_column(table, k) result(number)
    type(table_type), intent(in) :: table
    integer, intent(in) :: k

    do number = size(table%columns), 1, -1
      if (table%columns(number)%error == table%columns(k)%key) return
    end do
  end function value_column

  !> Unit in which the page shows a column. It is the same in all columns with the same unit in the files, and chosen by the largest
  !> value in them. Damping ratios are shown in per cent, directions and phases in degrees.
  pure type(axis_unit_type) function shown_unit(table, k) result(unit)
    type(table_type), intent(in) :: table
    integer, intent(in) :: k
    character(len=:), allocatable :: words
    real(dp) :: maximum

    associate (column => table%columns(merge(value_column(table, k), k, value_column(table, k) > 0)))
      words = trim(table%columns(k)%unit%words)
      unit = axis_unit_type(name=words)
      if (.not. allocated(column%numbers) .or. trim(column%unit%words) /= words) return
      if (column%label == "damping ratio") then
        unit = axis_unit_type("100", 100.0_dp, "%")
        return
      else if (words == "rad" .and. (column%label == "angle" .or. index(column%label, "phase") > 0)) then
        unit = axis_unit_type("deg", 180 / pi, "deg")
        return
      end if
    end associate
    maximum = maximum_in(table, words)
    if (words == "m/s" .and. maximum < 1) unit = axis_unit_type("1e3", 1.0e3_dp, "mm/s")
    if (words == "rad/s" .or. words == "rad" .and. .not. (maximum < small_angle .and. maximum > rounding)) return
    if (words /= "m/s" .and. len(words) <= len(unit%name)) unit = pick_unit(words, maximum)
  end function shown_unit

  !> Numbers of column `k` below this limit are rounding errors. They are compared with all columns that have the same unit, because
  !> forces along several axes result from the same terms. Numbers without a unit are compared with their own column, and angles
  !> with 1 rad.
  pure real(dp) function zero_limit(table, k) result(limit)
    type(table_type), intent(in) :: table
    integer, intent(in) :: k

    associate (column => table%columns(k))
      limit = maximum_in(table, trim(column%unit%words))
      if (column%unit%words == "" .and. allocated(column%numbers)) limit = max(0.0_dp, maxval(abs(column%numbers), &
        & mask=ieee_is_finite(column%numbers)))
      if (column%unit%words == "rad") limit = 1
    end associate
    limit = rounding * limit
  end function zero_limit

  !> Heading cell with the label of a column and its unit in parentheses.
  pure function heading_cell(kind, column, unit, is_detail) result(words)
    character(len=*), intent(in) :: kind
    type(column_type), intent(in) :: column
    type(axis_unit_type), intent(in) :: unit
    logical, intent(in), optional :: is_detail
    character(len=:), allocatable :: words, label
    integer :: at

    label = column%label
    ! Names such as fx_N_amplitude contain the unit.
    at = index(label, " " // trim(column%unit%words(:1)) // trim(column%unit%words(3:)) // " amplitude")
    if (at > 0) label = label(:at) // "amplitude"
    if (unit%words /= "1") then
      label = label // " (" // trim(unit%name) // ")"
    else if (column%unit%words /= "") then
      label = label // " (" // with_squares(unit_words(column%unit%words)) // ")"
    end if
    words = cell(kind, label, is_detail, column%meaning)
  end function heading_cell

  !> HTML cell with the value of column `k` in row `i`.
  pure function value_cell(table, k, i, unit, zero, is_detail) result(words)
    type(table_type), intent(in) :: table
    integer, intent(in) :: k, i
    type(axis_unit_type), intent(in) :: unit
    !> A smaller number is shown as zero
    real(dp), intent(in) :: zero
    logical, intent(in), optional :: is_detail
    character(len=:), allocatable :: words

    associate (column => table%columns(k))
      if (allocated(column%numbers)) then
        words = cell("n", number_text(table, k, i, unit%factor, zero), is_detail)
      else if (allocated(column%words)) then
        ! In a transposed table words stand in a line with numbers.
        words = cell(either("td", "n ", present(is_detail)), column%word(i), is_detail)
      else if (column%integers(i) == nothing) then
        words = cell("n", no_value, is_detail)
      else
        words = cell("n", text(column%integers(i)), is_detail)
      end if
    end associate
  end function value_cell

  !> Text of a number, with as many digits as people read.
  pure function number_text(table, k, i, factor, zero) result(words)
    type(table_type), intent(in) :: table
    integer, intent(in) :: k, i
    !> Factor that converts the number to the unit of the page
    real(dp), intent(in) :: factor
    !> A smaller number is shown as zero
    real(dp), intent(in) :: zero
    character(len=:), allocatable :: words

    associate (x => table%columns(k)%numbers)
      if (ieee_is_nan(x(i))) then
        words = no_value
      else if (index(table%columns(k)%label, "error") > 0) then
        words = concise(factor * x(i), error_digits)
      else if (abs(x(i)) < zero) then
        words = "0"
      else
        words = concise(factor * x(i), value_digits)
      end if
    end associate
  end function number_text

end module gestell_output_page_table
