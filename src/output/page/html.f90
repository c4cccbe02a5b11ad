!> Composes the elements of an HTML page: its beginning, escaped texts, and rows and cells of tables.
module gestell_output_page_html
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_text, only: newline
  use gestell_base_words, only: printable
  implicit none (type, external)
  private

  public :: cell, escaped, head, row

  !> End of a page
  character(len=*), parameter, public :: tail = "</body>" // newline // "</html>" // newline
  character(len=*), parameter :: style = &
    & "body{font:16px/1.5 system-ui,sans-serif;color:#222;max-width:62rem;margin:2rem auto;padding:0 1rem}" // newline // &
    & "h1{line-height:1.2;margin-bottom:.2rem}h2{margin-top:2.5rem;border-bottom:1px solid #ccc}" // newline // &
    & ".sub{color:#555;margin-top:0}.verdict{padding:.8rem 1rem;border-left:.5rem solid;background:#f4f4f4;font-size:1.1rem}" &
    & // newline // ".note{border-color:#888}.stable{border-color:#009e73}.unstable{border-color:#d55e00}" // &
    & ".undecided,.undamped{border-color:#e69f00}" &
    & // newline // "summary{cursor:pointer;color:#555;font-size:.9rem}" // newline // &
    & "dl{display:flex;flex-wrap:wrap;gap:.5rem 2.5rem;margin:1rem 0}dt{color:#555;font-size:.9rem}dd{margin:0;font-size:1.3rem}" &
    & // newline // "figure{margin:1rem 0;overflow-x:auto}figure img{max-width:100%;height:auto}" // newline // &
    & "figcaption{color:#555;font-size:.9rem}" // newline // &
    & ".wide{overflow-x:auto}table{border-collapse:collapse;font-size:.9rem;margin:.5rem 0}" // newline // &
    & "caption{text-align:left;color:#555}th,td{padding:.15rem .6rem;border-bottom:1px solid #ddd;text-align:left}" // newline // &
    & "td.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}thead th{border-bottom:2px solid #888}" &
    & // newline // &
    & "pre{background:#f4f4f4;padding:1rem;overflow-x:auto;font-size:.8rem;line-height:1.35}" // newline // &
    & "@media(prefers-color-scheme:dark){body{background:#1b1b1b;color:#ddd}.verdict,pre{background:#2a2a2a}" // newline // &
    & ".sub,figcaption,caption,summary,dt{color:#aaa}h2,th,td{border-color:#444}figure img{background:#fff}}" // newline // &
    & "@media(max-width:40rem){body{margin:1rem auto;font-size:15px}h1{font-size:1.6rem}h2{margin-top:1.5rem}" // newline // &
    & "figure img{max-width:none;width:38rem}figure:first-of-type img{width:100%}" // newline // &
    & ".verdict{padding:.5rem;font-size:1rem}th,td{padding:.15rem .4rem}pre{padding:.5rem;font-size:.7rem}}" // newline // &
    & "@media print{body{margin:0;max-width:none}h2{break-after:avoid}figure,tr{break-inside:avoid}pre{white-space:pre-wrap}}" &
    & // newline

contains

  !> Beginning of an HTML page, including the tag <body>.
  pure function head(title) result(page)
    character(len=*), intent(in) :: title
    character(len=:), allocatable :: page

    page = "<!DOCTYPE html>" // newline // "<html lang=""en"">" // newline // "<head>" // newline // &
      & "<meta charset=""utf-8"">" // newline // "<meta name=""viewport"" content=""width=device-width,initial-scale=1"">" // &
      & newline // "<title>" // escaped(title) // "</title>" // newline // "<style>" // newline // style // "</style>" // &
      & newline // "</head>" // newline // "<body>" // newline
  end function head

  !> Copy of a user's text with escapes for the special characters of HTML. ASCII control characters, which HTML does not permit,
  !> become blanks. Bytes that are not UTF-8 are replaced.
  pure function escaped(words) result(safe)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: safe, text
    type(growing_text_type) :: pieces
    integer :: i

    text = words
    do i = 1, len(text)
      if (text(i:i) < " " .and. text(i:i) /= newline) text(i:i) = " "
    end do
    text = printable(text)
    do i = 1, len(text)
      select case (text(i:i))
      case ("&")
        call pieces%append("&amp;")
      case ("<")
        call pieces%append("&lt;")
      case (">")
        call pieces%append("&gt;")
      case ("""")
        call pieces%append("&quot;")
      case default
        call pieces%append(text(i:i))
      end select
    end do
    safe = pieces%whole()
  end function escaped

  !> Row of an HTML table that consists of `cells`, the HTML text of all its cells.
  pure function row(cells) result(line)
    character(len=*), intent(in) :: cells
    character(len=:), allocatable :: line

    line = "<tr>" // cells // "</tr>" // newline
  end function row

  !> Cell of an HTML table. `kind` is "th" (heading of a column), "row" (heading of a row), "n" (number) or "td" (text).
  pure function cell(kind, text) result(words)
    character(len=*), intent(in) :: kind, text
    character(len=:), allocatable :: words, tag

    tag = "td"
    if (kind == "n") tag = "td class=""n"""
    if (kind == "th") tag = "th scope=""col"""
    if (kind == "row") tag = "th scope=""row"""
    words = "<" // tag // ">" // escaped(text) // "</" // tag(:2) // ">"
  end function cell

end module gestell_output_page_html
