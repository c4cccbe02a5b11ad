!> Writes tables as comma-separated values: a head whose lines begin with #, a line with the keys of the columns, and the rows.
!> Numbers have 17 significant digits.
module gestell_output_table_csv
  use gestell_base_error, only: error_type
  use gestell_base_text, only: either, newline, text
  use gestell_output_file_output, only: open_output, output_type
  use gestell_output_table, only: column_type, nothing, table_type
  use gestell_output_table_scientific, only: number_width, put_number
  implicit none (type, external)
  private

  public :: append_rows, field, write_csv

  !> Number of rows that are written at once
  integer, parameter :: piece = 100

contains

  !> Writes a table to its file in `folder`. The lines of `preamble` form the head of the file. Fails if the file cannot be written.
  subroutine write_csv(folder, table, preamble, error)
    character(len=*), intent(in) :: folder, preamble
    type(table_type), intent(in) :: table
    type(error_type), allocatable, intent(out) :: error
    type(output_type) :: output

    call open_output(output, folder // "/" // table%name // ".csv")
    call output%append(preamble)
    call append_rows(table, output)
    call output%complete(error)
  end subroutine write_csv

  !> Writes the line with the keys of the columns, and the rows, to `output`.
  subroutine append_rows(table, output)
    type(table_type), intent(in) :: table
    type(output_type), intent(inout) :: output
    integer :: i, k

    do k = 1, size(table%columns)
      call output%append(either(",", "", k > 1) // field(table%columns(k)%key))
    end do
    call output%append(newline)
    do i = 1, table%rows, piece
      call append_piece(table, i, min(i + piece - 1, table%rows), output)
    end do
  end subroutine append_rows

  !> Writes the rows `first` to `last` of a table to `output`, one line for each row.
  subroutine append_piece(table, first, last, output)
    type(table_type), intent(in) :: table
    integer, intent(in) :: first, last
    type(output_type), intent(inout) :: output
    character(len=:), allocatable :: lines
    integer :: i, k, n

    allocate(character(len=(number_width + 1) * size(table%columns) * (last - first + 1)) :: lines)
    n = 0
    do i = first, last
      do k = 1, size(table%columns)
        call put_cell(table%columns(k), i, lines, n)
        lines(n + 1:n + 1) = ","
        n = n + 1
      end do
      lines(n:n) = newline
    end do
    call output%append(lines(:n))
  end subroutine append_piece

  !> Writes the value of a column in row `i` after the first `n` characters of `line`, and increases `n` accordingly. `line` is made
  !> longer if a word does not fit.
  pure subroutine put_cell(column, i, line, n)
    type(column_type), intent(in) :: column
    integer, intent(in) :: i
    character(len=:), allocatable, intent(inout) :: line
    integer, intent(inout) :: n
    character(len=:), allocatable :: word

    if (allocated(column%numbers)) then
      call put_number(line, n, column%numbers(i))
      return
    else if (.not. allocated(column%integers)) then
      word = field(column%word(i))
    else if (column%integers(i) == nothing) then
      word = "NaN"
    else
      word = text(column%integers(i))
    end if
    if (len(word) > number_width) line = line // repeat(" ", len(word) - number_width)
    line(n + 1:n + len(word)) = word
    n = n + len(word)
  end subroutine put_cell

  !> A text as a field of a CSV file. It is put in quotes if it begins with #, or contains a comma, a newline or a quote; quotes in
  !> it are doubled. If it begins with = + - or @ and is not a number, an apostrophe precedes it, so that spreadsheets do not
  !> execute it as a formula.
  pure function field(words) result(word)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: word, safe
    integer :: i

    safe = words
    if (scan(words, "=+-@") == 1 .and. verify(words, "0123456789+-.,*eEdD ") > 0) safe = "'" // words
    word = safe
    if (scan(safe, ",""" // achar(10) // achar(13)) == 0 .and. index(safe, "#") /= 1) return
    word = """"
    do i = 1, len(safe)
      word = word // safe(i:i)
      if (safe(i:i) == """") word = word // """"
    end do
    word = word // """"
  end function field

end module gestell_output_table_csv
