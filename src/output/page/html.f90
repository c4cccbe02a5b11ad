!> Composes the elements of an HTML page: its beginning, and rows and cells of tables.
module gestell_output_page_html
  use gestell_base_markup, only: escaped
  use gestell_base_text, only: either, newline
  use gestell_output_page_style, only: style_sheet
  implicit none (type, external)
  private

  public :: cell, head, row, scroll_start, section_start, with_squares

  !> End of a page
  character(len=*), parameter, public :: tail = "</body>" // newline // "</html>" // newline

  !> Content security policy: the page loads nothing from elsewhere
  character(len=*), parameter :: policy = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; " &
    & // "img-src data:; base-uri 'none'; form-action 'none'"

contains

  !> Beginning of an HTML page, including the tag <body>.
  pure function head(title) result(page)
    character(len=*), intent(in) :: title
    character(len=:), allocatable :: page

    page = "<!DOCTYPE html>" // newline // "<html lang=""en"">" // newline // "<head>" // newline // &
      & "<meta charset=""utf-8"">" // newline // "<meta name=""viewport"" content=""width=device-width,initial-scale=1"">" // &
      & newline // "<meta http-equiv=""Content-Security-Policy"" content=""" // policy // """>" // newline // &
      & "<title>" // escaped(title) // "</title>" // newline // "<style>" // newline // style_sheet() // "</style>" // &
      & newline // "</head>" // newline // "<body>" // newline
  end function head

  !> Unit in which the character for a square replaces "^2".
  pure recursive function with_squares(unit) result(words)
    character(len=*), intent(in) :: unit
    character(len=:), allocatable :: words
    integer :: i

    words = unit
    i = index(unit, "^2")
    if (i > 0) words = unit(:i - 1) // "²" // with_squares(unit(i + 2:))
  end function with_squares

  !> Row of an HTML table that consists of `cells`, the HTML text of all its cells. `is_detail`: true if only the button for all
  !> columns shows the row
  pure function row(cells, is_detail) result(line)
    character(len=*), intent(in) :: cells
    logical, intent(in), optional :: is_detail
    character(len=:), allocatable :: line

    line = "<tr>"
    if (present(is_detail)) line = either("<tr class=""x"">", "<tr>", is_detail)
    line = line // cells // "</tr>" // newline
  end function row

  !> Cell of an HTML table. `kind` is "th" (heading of a column), "row" (heading of a row), "n" (number) or "td" (text).
  !> `is_detail`: true if only the button for all columns shows the cell. `meaning`: explanation of the cell
  pure function cell(kind, text, is_detail, meaning) result(words)
    character(len=*), intent(in) :: kind, text
    logical, intent(in), optional :: is_detail
    character(len=*), intent(in), optional :: meaning
    character(len=:), allocatable :: words, tag, list

    tag = "td"
    list = ""
    if (kind == "n") list = "n"
    if (present(is_detail)) list = list // trim(merge(" x", "  ", is_detail))
    if (list /= "") list = " class=""" // trim(adjustl(list)) // """"
    if (kind == "th") list = list // " scope=""col"""
    if (kind == "row") list = list // " scope=""row"""
    if (kind == "th" .or. kind == "row") tag = "th"
    if (present(meaning)) then
      if (meaning /= "") list = list // " title=""" // escaped(meaning) // """"
    end if
    words = "<" // tag // list // ">" // escaped(text) // "</" // tag // ">"
  end function cell

  !> HTML element with identifier and heading, in which a section of the page begins; "</section>" ends it.
  pure function section_start(id, heading) result(words)
    character(len=*), intent(in) :: id, heading
    character(len=:), allocatable :: words

    words = "<section id=""" // escaped(id) // """>" // newline // "<h2>" // escaped(heading) // "</h2>" // newline
  end function section_start

  !> HTML element in which wide content scrolls, also by keys; "</div>" ends it.
  pure function scroll_start(label) result(words)
    character(len=*), intent(in) :: label
    character(len=:), allocatable :: words

    words = "<div class=""wide"" tabindex=""0"" role=""region"" aria-label=""" // escaped(label) // """>"
  end function scroll_start

end module gestell_output_page_html
