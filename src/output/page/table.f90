!> A result file as a table of a page: what is short as it is, numbers with six digits, units in the head.
module gestell_output_page_table
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_output_page_html, only: cell, escaped, row
  implicit none (type, external)
  private

  public :: html_table, label

  !> Rows that are shown at the most; a table with more columns than this and fewer rows is turned.
  integer, parameter :: most_rows = 60, most_columns = 10
  character, parameter :: newline = new_line("a")

  type :: word_type
    character(len=:), allocatable :: text
  end type word_type

  !> Ends of the columns' names, the longest first, and the units that they mean.
  character(len=*), parameter :: endings(*) = [character(len=12) :: "_rad_per_s", "_1_per_s", "_per_s", "_mm_s", "_rad_s", &
    & "_m_s2", "_m_s", "_rpm", "_deg", "_rad", "_Nm", "_mm", "_Hz", "_N", "_W", "_J", "_m", "_s"]
  character(len=*), parameter :: units(*) = [character(len=6) :: "rad/s", "1/s", "1/s", "mm/s", "rad/s", "m/s^2", "m/s", "1/min", &
    & "deg", "rad", "N m", "mm", "Hz", "N", "W", "J", "m", "s"]

contains

  !> The table of `lines`, a file's content without its last newline's rest; `name` is the file's. Empty for no rows.
  pure function html_table(name, content) result(table)
    character(len=*), intent(in) :: name, content
    character(len=:), allocatable :: table
    type(word_type), allocatable :: heads(:), words(:), cells(:, :)
    integer :: start, last, rows, columns, k
    logical :: header

    rows = count_rows(content)
    table = ""
    if (rows < 1) return
    header = .true.
    start = 1
    columns = 0
    rows = min(rows, most_rows)
    do while (start <= len(content))
      last = index(content(start:), newline) + start - 2
      if (last < start - 1) last = len(content)
      if (content(start:min(start, last)) /= "#" .and. last >= start) then
        call split(content(start:last), words)
        if (header) then
          call move_alloc(words, heads)
          header = .false.
          allocate(cells(size(heads), rows))
        else if (columns < rows) then
          columns = columns + 1
          do k = 1, min(size(words), size(heads))
            cells(k, columns)%text = words(k)%text
          end do
        end if
      end if
      start = last + 2
    end do
    table = "<div class=""wide""><table>" // newline // "<caption>" // escaped(name)
    if (count_rows(content) > rows) table = table // ": the first " // text(rows) // " of " // text(count_rows(content)) // " rows"
    table = table // "</caption>" // newline
    if (size(heads) > most_columns .and. rows < size(heads)) then
      table = table // turned(heads, cells)
    else
      table = table // upright(heads, cells)
    end if
    table = table // "</table></div>" // newline
  end function html_table

  !> Rows below the header.
  pure integer function count_rows(content) result(rows)
    character(len=*), intent(in) :: content
    integer :: i
    logical :: begins

    rows = -1
    begins = .true.
    do i = 1, len(content)
      if (begins .and. content(i:i) /= "#" .and. content(i:i) /= newline) rows = rows + 1
      begins = content(i:i) == newline
    end do
  end function count_rows

  !> The fields of a line; quotes around a field go, doubled ones within become single.
  pure subroutine split(line, words)
    character(len=*), intent(in) :: line
    type(word_type), allocatable, intent(out) :: words(:)
    integer :: i, n
    logical :: quoted

    n = 1
    quoted = .false.
    do i = 1, len(line)
      if (line(i:i) == """") quoted = .not. quoted
      if (line(i:i) == "," .and. .not. quoted) n = n + 1
    end do
    allocate(words(n))
    n = 1
    quoted = .false.
    words(1)%text = ""
    do i = 1, len(line)
      if (line(i:i) == """") then
        if (i > 1 .and. .not. quoted) then
          if (line(i - 1:i - 1) == """") words(n)%text = words(n)%text // """"
        end if
        quoted = .not. quoted
      else if (line(i:i) == "," .and. .not. quoted) then
        n = n + 1
        words(n)%text = ""
      else
        words(n)%text = words(n)%text // line(i:i)
      end if
    end do
  end subroutine split

  pure function upright(heads, cells) result(lines)
    type(word_type), intent(in) :: heads(:), cells(:, :)
    character(len=:), allocatable :: lines
    character(len=:), allocatable :: one
    integer :: i, k

    one = ""
    do k = 1, size(heads)
      one = one // cell("th", label(heads(k)%text))
    end do
    lines = "<thead>" // row(one) // "</thead>" // newline // "<tbody>" // newline
    do i = 1, size(cells, 2)
      one = ""
      do k = 1, size(heads)
        one = one // value_cell(cells(k, i), digits_of(heads(k)%text))
      end do
      lines = lines // row(one)
    end do
    lines = lines // "</tbody>" // newline
  end function upright

  !> Columns as rows: the first column heads the others.
  pure function turned(heads, cells) result(lines)
    type(word_type), intent(in) :: heads(:), cells(:, :)
    character(len=:), allocatable :: lines
    character(len=:), allocatable :: one
    integer :: i, k

    lines = "<tbody>" // newline
    do k = 1, size(heads)
      one = cell("row", label(heads(k)%text))
      do i = 1, size(cells, 2)
        one = one // value_cell(cells(k, i), digits_of(heads(k)%text))
      end do
      lines = lines // row(one)
    end do
    lines = lines // "</tbody>" // newline
  end function turned

  !> Digits that are shown: two of an error.
  pure integer function digits_of(name)
    character(len=*), intent(in) :: name

    digits_of = merge(2, 6, index(name, "error") > 0)
  end function digits_of

  pure function value_cell(word, digits) result(words)
    type(word_type), intent(in) :: word
    integer, intent(in) :: digits
    character(len=:), allocatable :: words
    real(dp) :: value
    integer :: status

    if (.not. allocated(word%text)) then
      words = cell("td", "")
      return
    end if
    status = 1
    if (len(word%text) > 0 .and. verify(word%text, "+-.0123456789eE") == 0) read (word%text, *, iostat=status) value
    if (status /= 0) then
      words = cell("td", word%text)
    else if (scan(word%text, ".eE") == 0) then
      words = cell("n", word%text)
    else
      words = cell("n", concise(value, digits))
    end if
  end function value_cell

  !> The name of a column for people: its unit in parentheses, blanks for underscores.
  pure function label(name) result(words)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: words
    integer :: i, n

    words = name
    do i = 1, size(endings)
      n = len(name) - len_trim(endings(i))
      if (n < 1) cycle
      if (name(n + 1:) /= trim(endings(i))) cycle
      words = name(:n) // " (" // trim(units(i)) // ")"
      exit
    end do
    do i = 1, len(words)
      if (words(i:i) == "_") words(i:i) = " "
    end do
  end function label

end module gestell_output_page_table
