!> A table of a report: columns as wide as what stands in them, together no wider than a terminal.
module gestell_output_report_text_table
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_words, only: character_count
  use gestell_output_report_wrapping, only: widest
  implicit none (type, external)
  private

  public :: tabulated

  !> Stands between the cells of a row.
  character, parameter, public :: tab = achar(9)
  character, parameter :: newline = new_line("a")
  integer, parameter :: indent = 2
  !> Columns that names keep.
  integer, parameter :: name = 16

contains

  !> The lines of a table. `align`: l or r for each column; `heads`: with commas between them, perhaps in two lines; `rows`:
  !> complete lines, their cells set apart by tabs. Where it is too wide, long names in the first column and remarks in the last,
  !> if these are flush left, come to stand on lines of their own. A column without anything in its rows is left out.
  pure function tabulated(align, heads, rows) result(text)
    character(len=*), intent(in) :: align, heads, rows
    character(len=:), allocatable :: text
    character(len=:), allocatable :: all, kinds
    logical :: kept(len(align))
    integer :: k

    all = rows
    if (heads /= "") all = with_tabs(heads) // newline // rows
    call find_filled(rows, kept)
    if (all_or_none(kept)) then
      text = laid_out(align, all)
    else
      kinds = ""
      do k = 1, len(align)
        if (kept(k)) kinds = kinds // align(k:k)
      end do
      text = laid_out(kinds, with_columns(all, kept))
    end if
  end function tabulated

  pure logical function all_or_none(flags)
    logical, intent(in) :: flags(:)

    all_or_none = all(flags) .or. .not. any(flags)
  end function all_or_none

  !> Which columns have anything in these lines.
  pure subroutine find_filled(lines, filled)
    character(len=*), intent(in) :: lines
    logical, intent(out) :: filled(:)
    integer :: first, last, k

    filled = .false.
    first = 1
    do while (first <= len(lines) .and. .not. all(filled))
      last = first + index(lines(first:), newline) - 2
      do k = 1, size(filled)
        if (.not. filled(k)) filled(k) = cell(lines(first:last), k, size(filled)) /= ""
      end do
      first = last + 2
    end do
  end subroutine find_filled

  !> The lines with these of their columns.
  pure function with_columns(lines, kept) result(some)
    character(len=*), intent(in) :: lines
    logical, intent(in) :: kept(:)
    character(len=:), allocatable :: some
    type(growing_text_type) :: all
    integer :: first, last, k
    logical :: begun

    first = 1
    do while (first <= len(lines))
      last = first + index(lines(first:), newline) - 2
      begun = .false.
      do k = 1, size(kept)
        if (.not. kept(k)) cycle
        if (begun) call all%append(tab)
        call all%append(cell(lines(first:last), k, size(kept)))
        begun = .true.
      end do
      call all%append(newline)
      first = last + 2
    end do
    some = all%whole()
  end function with_columns

  !> Complete lines of cells, the heads among them, below each other.
  pure function laid_out(align, all) result(text)
    character(len=*), intent(in) :: align, all
    character(len=:), allocatable :: text
    type(growing_text_type) :: lines
    integer :: widths(len(align)), n, body, gap, first, last, k

    n = len(align)
    widths = 0
    first = 1
    do while (first <= len(all))
      last = first + index(all(first:), newline) - 2
      do k = 1, n
        widths(k) = max(widths(k), character_count(cell(all(first:last), k, n)))
      end do
      first = last + 2
    end do
    gap = merge(1, 2, align(1:1) == "r")
    body = n
    if (align(n:n) == "l" .and. n > 1 .and. indent + sum(widths + gap) - gap > widest) then
      if (align(1:1) == "r" .or. indent + min(name, widths(1)) + sum(widths(2:) + gap) > widest) body = n - 1
    end if
    gap = max(gap, min(3, (widest - indent - sum(widths(:body))) / max(1, body - 1)))
    if (align(1:1) == "l") widths(1) = min(widths(1), max(0, widest - indent - sum(widths(2:body)) - (body - 1) * gap))
    first = 1
    do while (first <= len(all))
      last = first + index(all(first:), newline) - 2
      call lines%append(row(all(first:last)) // newline)
      first = last + 2
    end do
    text = lines%whole()

  contains

    pure function row(cells) result(line)
      character(len=*), intent(in) :: cells
      character(len=:), allocatable :: line, word
      integer :: k, filling

      line = repeat(" ", indent)
      do k = 1, n
        word = cell(cells, k, n)
        if (k == 1 .and. character_count(word) > widths(1)) then
          line = line // word // newline // repeat(" ", indent)
          word = ""
        else if (k > body .and. word /= "" .and. indent + sum(widths(:body) + gap) + character_count(word) > widest) then
          line = trim(line) // newline // repeat(" ", 2 * indent)
        end if
        filling = max(0, widths(k) - character_count(word))
        if (align(k:k) == "r") line = line // repeat(" ", filling)
        line = line // word // repeat(" ", gap)
        if (align(k:k) == "l") line = line // repeat(" ", filling)
      end do
      line = trim(line)
    end function row

  end function laid_out

  !> Cell `k` of `n`, the last with all that is left; empty where there is none.
  pure function cell(line, k, n) result(word)
    character(len=*), intent(in) :: line
    integer, intent(in) :: k, n
    character(len=:), allocatable :: word
    integer :: first, i

    first = 1
    do i = 2, k
      first = first + index(line(first:) // tab, tab)
    end do
    word = trim(line(min(first, len(line) + 1):))
    if (k < n) word = word(:index(word // tab, tab) - 1)
  end function cell

  pure function with_tabs(heads) result(line)
    character(len=*), intent(in) :: heads
    character(len=len(heads)) :: line
    integer :: i

    line = heads
    do i = 1, len(line)
      if (line(i:i) == ",") line(i:i) = tab
    end do
  end function with_tabs

end module gestell_output_report_text_table
