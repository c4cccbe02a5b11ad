!> Formats tables of the report. Each column is as wide as its longest cell, and no table is wider than the terminal. Until a table
!> is written it is a block of text, because its numbers may still be converted to other units.
module gestell_output_report_text_table
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline
  use gestell_base_words, only: character_count
  use gestell_output_report_wrapping, only: widest
  implicit none (type, external)
  private

  public :: cut, formatted, listed, number_cells, read_block, tabulated

  !> Character that separates the cells of a row before the table is formatted
  character, parameter, public :: tab = achar(9)
  !> Characters at the start and end of the block of a table, and between its parts
  character, parameter, public :: block_start = achar(1), block_end = achar(3)
  character, parameter :: next_part = achar(2)
  integer, parameter :: indent = 2
  !> A cell of the last column stays in its row if at least this number of characters remains for the first column
  integer, parameter :: name = 16

contains

  !> The block of a table. Its arguments are those of `formatted`.
  pure function tabulated(align, heads, rows) result(block)
    character(len=*), intent(in) :: align, heads, rows
    character(len=:), allocatable :: block

    block = block_start // align // next_part // heads // next_part // rows // block_end
  end function tabulated

  !> The parts of which `tabulated` has composed a block.
  pure subroutine read_block(block, align, heads, rows)
    character(len=*), intent(in) :: block
    character(len=:), allocatable, intent(out) :: align, heads, rows
    integer :: first, second

    first = index(block, next_part)
    second = first + index(block(first + 1:), next_part)
    align = block(2:first - 1)
    heads = block(first + 1:second - 1)
    rows = block(second + 1:len(block) - 1)
  end subroutine read_block

  !> Text of a formatted table. If the table is too wide, long names in the first column and remarks in the last column get lines of
  !> their own; this requires that both columns are flush left. Columns whose cells are all blank are omitted.
  pure function formatted(align, heads, rows) result(text)
    !> `align`: for each column l (flush left) or r (flush right). `heads`: headings, separated by commas, in one or two lines.
    !> `rows`: lines of text whose cells are separated by tabs
    character(len=*), intent(in) :: align, heads, rows
    character(len=:), allocatable :: text, all, kinds, cells(:, :)
    type(growing_text_type) :: lines
    integer, allocatable :: kept(:), widths(:)
    integer :: n, body, gap, first, i, k

    all = rows
    first = 1
    if (heads /= "") then
      all = heads // newline // rows
      first = 1 + count([(all(i:i) == newline, i = 1, len(heads) + 1)])
      do i = 1, len(heads)
        if (all(i:i) == ",") all(i:i) = tab
      end do
    end if
    call cut(all, len(align), cells)
    kept = pack([(k, k = 1, len(align))], [(any(cells(k, first:) /= ""), k = 1, len(align))])
    if (size(kept) == 0) kept = [(k, k = 1, len(align))]
    n = size(kept)
    kinds = ""
    allocate(widths(n), source=0)
    do k = 1, n
      kinds = kinds // align(kept(k):kept(k))
      do i = 1, size(cells, 2)
        widths(k) = max(widths(k), character_count(trim(cells(kept(k), i))))
      end do
    end do
    gap = merge(1, 2, kinds(1:1) == "r")
    body = n
    if (kinds(n:n) == "l" .and. n > 1 .and. indent + sum(widths + gap) - gap > widest) then
      if (kinds(1:1) == "r" .or. indent + min(name, widths(1)) + sum(widths(2:) + gap) > widest) body = n - 1
    end if
    gap = max(gap, min(3, (widest - indent - sum(widths(:body))) / max(1, body - 1)))
    if (kinds(1:1) == "l") widths(1) = min(widths(1), max(0, widest - indent - sum(widths(2:body)) - (body - 1) * gap))
    do i = 1, size(cells, 2)
      call lines%append(row(i) // newline)
    end do
    text = lines%whole()

  contains

    !> Row `i` of the table, with cells padded to the width of their columns. A name or remark that is too long gets a line of its
    !> own.
    pure function row(i) result(line)
      integer, intent(in) :: i
      character(len=:), allocatable :: line, word
      integer :: k, filling

      line = repeat(" ", indent)
      do k = 1, n
        word = trim(cells(kept(k), i))
        if (k == 1 .and. character_count(word) > widths(1)) then
          line = line // word // newline // repeat(" ", indent)
          word = ""
        else if (k > body .and. word /= "" .and. indent + sum(widths(:body) + gap) + character_count(word) > widest) then
          line = trim(line) // newline // repeat(" ", 2 * indent)
        end if
        filling = max(0, widths(k) - character_count(word))
        if (kinds(k:k) == "r") line = line // repeat(" ", filling)
        line = line // word // repeat(" ", gap)
        if (kinds(k:k) == "l") line = line // repeat(" ", filling)
      end do
      line = trim(line)
    end function row

  end function formatted

  !> Cells with one or more numbers for the end of a row: a tab precedes each number.
  pure function number_cells(values, digits) result(cells)
    real(dp), intent(in) :: values(:)
    !> Number of significant digits
    integer, intent(in) :: digits
    character(len=:), allocatable :: cells

    cells = tab // listed(values, digits, tab)
  end function number_cells

  !> Numbers as text, with the text `between` after each number except the last.
  pure function listed(values, digits, between) result(words)
    real(dp), intent(in) :: values(:)
    !> Number of significant digits
    integer, intent(in) :: digits
    character(len=*), intent(in) :: between
    character(len=:), allocatable :: words
    integer :: i

    words = ""
    do i = 1, size(values)
      words = words // either(between, "", i > 1) // concise(values(i), digits)
    end do
  end function listed

  !> Splits lines of text at the tabs into `cells`, shape (columns, lines). The last cell contains the rest of its line. Missing
  !> cells are blank.
  pure subroutine cut(lines, columns, cells)
    character(len=*), intent(in) :: lines
    integer, intent(in) :: columns
    character(len=:), allocatable, intent(out) :: cells(:, :)
    integer, allocatable :: ends(:), starts(:)
    integer :: first, last, i, k

    ends = pack([(i, i = 1, len(lines))], [(lines(i:i) == newline, i = 1, len(lines))])
    starts = [1, ends + 1]
    allocate(character(len=maxval([0, ends - starts(:size(ends))])) :: cells(columns, size(ends)))
    do i = 1, size(ends)
      first = starts(i)
      do k = 1, columns
        last = ends(i) - 1
        if (k < columns) last = first + index(lines(first:last) // tab, tab) - 2
        cells(k, i) = lines(first:last)
        first = min(last + 2, ends(i))
      end do
    end do
  end subroutine cut

end module gestell_output_report_text_table
