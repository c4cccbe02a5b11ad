!> Lines of a report no wider than a terminal.
module gestell_output_report_wrapping
  use gestell_base_growing_text, only: growing_text_type
  implicit none (type, external)
  private

  public :: columns_of, wrapped

  !> Columns of the report.
  integer, parameter, public :: widest = 80
  !> A word that stands apart within so many columns heads its line.
  integer, parameter :: widest_label = 24

contains

  !> Complete lines, those that are too long broken between words; a word that is too long stays whole.
  pure function wrapped(lines) result(text)
    character(len=*), intent(in) :: lines
    character(len=:), allocatable :: text
    character, parameter :: newline = new_line("a")
    type(growing_text_type) :: all
    integer :: first, last

    first = 1
    do while (first <= len(lines))
      last = first + index(lines(first:), newline) - 2
      if (last < first - 1) last = len(lines)
      call all%append(broken(lines(first:last)) // newline)
      first = last + 2
    end do
    text = all%whole()
  end function wrapped

  !> One line: what is over stands below its words, right of a word that heads it.
  pure function broken(line) result(text)
    character(len=*), intent(in) :: line
    character(len=:), allocatable :: text
    integer :: margin, start, column, at, i

    margin = margin_of(line)
    text = ""
    start = 1
    column = 0
    at = 0
    i = 0
    do while (i < len(line))
      i = i + 1
      if (.not. continues(line(i:i))) column = column + 1
      if (column > widest .and. at > 0) then
        text = text // trim(line(start:at)) // new_line("a") // repeat(" ", margin)
        start = at + verify(line(at + 1:), " ")
        column = margin + columns_of(line(start:i))
        at = 0
      end if
      ! a number stays beside its unit
      if (line(i:i) == " " .and. i > max(start, margin)) at = merge(at, i, scan(line(i - 1:i - 1), "0123456789") > 0)
    end do
    text = text // line(start:)
  end function broken

  !> Blanks before the continuation of a line.
  pure integer function margin_of(line) result(margin)
    character(len=*), intent(in) :: line
    integer :: first, gap

    first = max(1, verify(line, " "))
    margin = first + 1
    gap = index(line(first:), "  ")
    if (gap == 0) return
    gap = first + gap - 1
    gap = gap + verify(line(gap:), " ") - 2
    if (gap <= widest_label) margin = gap
  end function margin_of

  !> Characters of a text in UTF-8.
  pure integer function columns_of(text)
    character(len=*), intent(in) :: text
    integer :: i

    columns_of = count([(.not. continues(text(i:i)), i = 1, len(text))])
  end function columns_of

  !> Whether a byte is not the first of its character.
  elemental logical function continues(byte)
    character, intent(in) :: byte

    continues = iand(ichar(byte), 192) == 128
  end function continues

end module gestell_output_report_wrapping
