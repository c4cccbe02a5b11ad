!> Breaks the lines of the report so that they fit the terminal.
module gestell_output_report_wrapping
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_text, only: newline
  use gestell_base_words, only: character_count, continues
  implicit none (type, external)
  private

  public :: wrapped

  !> Maximum number of characters in a line of the report
  integer, parameter, public :: widest = 80
  !> The beginning of a line counts as its label if it is followed by two blanks and has at most this many characters.
  integer, parameter :: widest_label = 24

contains

  !> Copy of a text whose lines are broken between words, so that each fits the report. A word that is longer than a line is not
  !> broken.
  pure function wrapped(lines) result(text)
    character(len=*), intent(in) :: lines
    character(len=:), allocatable :: text
    type(growing_text_type) :: all
    integer :: first, last

    first = 1
    do while (first <= len(lines))
      last = first + index(lines(first:), newline) - 2
      if (last < first - 1) last = len(lines)
      call append_broken(all, lines(first:last))
      call all%append(newline)
      first = last + 2
    end do
    text = all%whole()
  end function wrapped

  !> Appends one line to a text and breaks the line if necessary. The second and later parts are indented to the right of the line's
  !> label.
  pure subroutine append_broken(text, line)
    type(growing_text_type), intent(inout) :: text
    character(len=*), intent(in) :: line
    integer :: margin, start, column, at, i

    margin = margin_of(line)
    start = 1
    column = 0
    at = 0
    i = 0
    do while (i < len(line))
      i = i + 1
      if (.not. continues(line(i:i))) column = column + 1
      if (column > widest .and. at > 0) then
        call text%append(trim(line(start:at)) // newline // repeat(" ", margin))
        start = at + verify(line(at + 1:), " ")
        column = margin + character_count(line(start:i))
        at = 0
      end if
      ! a number is not separated from its unit
      if (line(i:i) == " " .and. i > max(start, margin)) at = merge(at, i, scan(line(i - 1:i - 1), "0123456789") > 0)
    end do
    call text%append(line(start:))
  end subroutine append_broken

  !> Number of blanks by which the second and later parts of a broken line are indented.
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

end module gestell_output_report_wrapping
