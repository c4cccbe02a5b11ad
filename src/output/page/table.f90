!> Converts result tables to HTML: words are unchanged, numbers have six digits, error bounds have two, and units stand in the
!> heading row.
module gestell_output_page_table
  use gestell_base_text, only: concise, newline, text
  use gestell_output_page_html, only: cell, escaped, row
  use gestell_output_table, only: column_type, nothing, table_type
  implicit none (type, external)
  private

  public :: html_table

  !> `max_rows`: maximum number of rows shown. `most_columns`: a table with more columns than this is transposed if it has fewer
  !> rows than columns.
  integer, parameter :: max_rows = 60, most_columns = 10
  !> A table with more rows than this is hidden until the reader opens it.
  integer, parameter :: most_open = 12
contains

  !> HTML text of `table`; empty if the table has no rows.
  pure function html_table(table) result(lines)
    type(table_type), intent(in) :: table
    character(len=:), allocatable :: lines, row_cells
    integer :: rows, i, k

    lines = ""
    if (table%rows == 0) return
    rows = min(table%rows, max_rows)
    if (table%rows > most_open) lines = "<details><summary>" // text(table%rows) // " rows</summary>" // newline
    lines = lines // "<div class=""wide""><table>" // newline // "<caption>" // escaped(table%name // ".csv")
    if (table%rows > rows) lines = lines // ": the first " // text(rows) // " of " // text(table%rows) // " rows"
    lines = lines // "</caption>" // newline
    if (size(table%columns) > most_columns .and. rows < size(table%columns)) then
      ! transposed: each column of the table becomes a row, headed by its label
      lines = lines // "<tbody>" // newline
      do k = 1, size(table%columns)
        row_cells = cell("row", head_of(table%columns(k)))
        do i = 1, rows
          row_cells = row_cells // value_cell(table%columns(k), i)
        end do
        lines = lines // row(row_cells)
      end do
    else
      row_cells = ""
      do k = 1, size(table%columns)
        row_cells = row_cells // cell("th", head_of(table%columns(k)))
      end do
      lines = lines // "<thead>" // row(row_cells) // "</thead>" // newline // "<tbody>" // newline
      do i = 1, rows
        row_cells = ""
        do k = 1, size(table%columns)
          row_cells = row_cells // value_cell(table%columns(k), i)
        end do
        lines = lines // row(row_cells)
      end do
    end if
    lines = lines // "</tbody>" // newline // "</table></div>" // newline
    if (table%rows > most_open) lines = lines // "</details>" // newline
  end function html_table

  !> Label of a column with its unit in parentheses.
  pure function head_of(column) result(words)
    type(column_type), intent(in) :: column
    character(len=:), allocatable :: words

    words = column%label
    if (column%unit%words /= "") words = words // " (" // trim(column%unit%words) // ")"
  end function head_of

  !> HTML cell with the value of a column in row `i`.
  pure function value_cell(column, i) result(words)
    type(column_type), intent(in) :: column
    integer, intent(in) :: i
    character(len=:), allocatable :: words

    if (allocated(column%numbers)) then
      words = cell("n", concise(column%numbers(i), merge(2, 6, index(column%label, "error") > 0)))
    else if (allocated(column%words)) then
      words = cell("td", column%word(i))
    else if (column%integers(i) == nothing) then
      words = cell("n", "NaN")
    else
      words = cell("n", text(column%integers(i)))
    end if
  end function value_cell

end module gestell_output_page_table
