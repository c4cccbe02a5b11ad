!> Puts a picture that gnuplot has drawn as SVG into a page. The picture takes the page's colours, its identifiers get a prefix, and
!> what a page does not need is left out: prolog, comments, titles, unused symbols, default attributes and superfluous digits.
module gestell_output_page_svg
  use gestell_base_growing_text, only: growing_text_type
  use gestell_output_page_colours, only: themed_colour
  use gestell_base_markup, only: escaped
  use gestell_output_page_path, only: short_path, short_points
  implicit none (type, external)
  private

  public :: inline_svg

  !> Maximum depth of nested elements
  integer, parameter :: deepest = 64
  !> States of an open element: left out; written when it has content; written
  integer, parameter :: left_out = 0, waiting = 1, written = 2

  !> The picture while it is written.
  type :: picture_type
    !> The picture as gnuplot has drawn it, and the prefix of its identifiers on the page
    character(len=:), allocatable :: source, prefix
    !> What has been written
    type(growing_text_type) :: pieces
    !> Tags of open elements that have no content so far
    character(len=:), allocatable :: tags
    !> For each open element: its state, and the position of its tag in `tags`
    integer :: states(deepest) = left_out, starts(deepest) = 0
    integer :: depth = 0
  contains
    procedure :: write
  end type picture_type

contains

  !> The element <svg> of a page. It is empty if `source` is not a picture of gnuplot.
  pure function inline_svg(source, prefix, label) result(html)
    !> `source`: the picture. `prefix`: prefix of its identifiers, different for each picture of a page. `label`: description of the
    !> picture for readers who do not see it
    character(len=*), intent(in) :: source, prefix, label
    character(len=:), allocatable :: html, box
    type(picture_type) :: picture
    integer :: first, last, next

    html = ""
    first = index(source, "<svg")
    if (first == 0) return
    last = end_of_tag(source, first)
    box = attribute(source(first:last), "viewBox")
    if (verify(box, "0123456789. ") > 0 .or. word(box, 4) == "") return
    picture%source = source
    picture%prefix = prefix
    picture%tags = ""
    do
      next = index(source(last + 1:), "<")
      if (next == 0) exit
      next = last + next
      ! Only texts have content other than elements and the space between them.
      if (verify(source(last + 1:next - 1), " " // achar(9) // achar(10)) > 0) call picture%write(source(last + 1:next - 1))
      first = next
      last = end_of_tag(source, first)
      call add_tag(picture, first, last)
    end do
    html = "<svg class=""plot"" role=""img"" aria-label=""" // escaped(label) // """ viewBox=""" // box // """ style=""--w:" &
      & // word(box, 3) // "px"">" // picture%pieces%whole() // "</svg>"
  end function inline_svg

  !> Adds the tag source(first:last). If the element is to be left out, `last` becomes the end of the element.
  pure subroutine add_tag(picture, first, last)
    type(picture_type), intent(inout) :: picture
    integer, intent(in) :: first
    integer, intent(inout) :: last
    character(len=:), allocatable :: tag, name, id, attributes
    integer :: length

    tag = picture%source(first:last)
    if (tag(2:2) == "?" .or. tag(2:2) == "!") return
    name = tag(2:1 + verify(tag(2:) // ">", "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ/") - 1)
    if (index(name, "/") == 1) then
      call close_element(picture, name)
      return
    end if
    id = attribute(tag, "id")
    if (name == "title" .or. name == "desc" .or. name == "script" .or. name == "rect" .and. is_background(tag) .or. &
      & id /= "" .and. name /= "g" .and. .not. is_used(picture%source, id)) then
      if (tag(len(tag) - 1:) /= "/>") then
        length = index(picture%source(last:), "</" // trim(name) // ">")
        last = merge(end_of_tag(picture%source, last + length - 1), len(picture%source), length > 0)
      end if
      return
    end if
    attributes = short_attributes(tag, name, picture%prefix)
    if (tag(len(tag) - 1:) == "/>") then
      call picture%write("<" // name // attributes // "/>")
    else if (picture%depth < deepest) then
      picture%depth = picture%depth + 1
      associate (state => picture%states(picture%depth))
        state = merge(left_out, waiting, attributes == "" .and. (name == "g" .or. name == "tspan"))
        picture%starts(picture%depth) = len(picture%tags) + 1
        if (state == waiting) picture%tags = picture%tags // "<" // name // attributes // ">"
      end associate
    end if
  end subroutine add_tag

  !> Writes content, after the tags of the elements that contain it.
  pure subroutine write(self, content)
    class(picture_type), intent(inout) :: self
    character(len=*), intent(in) :: content

    call self%pieces%append(self%tags // content)
    self%tags = ""
    where (self%states(:self%depth) == waiting) self%states(:self%depth) = written
  end subroutine write

  !> Closes the innermost element. An element without content is left out.
  pure subroutine close_element(picture, name)
    type(picture_type), intent(inout) :: picture
    !> Name of the element after a slash
    character(len=*), intent(in) :: name

    if (picture%depth == 0) return
    select case (picture%states(picture%depth))
    case (written)
      call picture%pieces%append("<" // name // ">")
    case (waiting)
      picture%tags = picture%tags(:picture%starts(picture%depth) - 1)
    case default ! left out
    end select
    picture%depth = picture%depth - 1
  end subroutine close_element

  !> Attributes of a tag that differ from the defaults of the style sheet, each after a blank.
  pure function short_attributes(tag, name, prefix) result(list)
    character(len=*), intent(in) :: tag, name, prefix
    character(len=:), allocatable :: list, key, value
    logical :: sets_pen
    integer :: from

    list = ""
    ! gnuplot opens such a group, within no other one, whenever it changes the pen.
    sets_pen = name == "g" .and. index(tag, "stroke-linecap") > 0
    from = len(name) + 2
    do
      call read_attribute(tag, from, key, value)
      if (key == "") exit
      select case (key)
      case ("class", "font-family")
        cycle
      case ("id")
        if (name == "g") cycle
        value = prefix // value
      case ("d")
        value = short_path(value)
      case ("points")
        value = short_points(value)
      case ("transform")
        value = replaced(replaced(value, ".00,", ","), ".00)", ")")
      case ("xlink:href", "href")
        key = "href"
        if (index(value, "#") == 1) value = "#" // prefix // value(2:)
      case ("fill", "stroke", "color", "flood-color")
        value = replaced(themed_colour(value), "url(#", "url(#" // prefix)
      case ("style")
        value = themed_style(replaced(value, "url(#", "url(#" // prefix))
      case default
        if (index(key, "on") == 1) cycle
      end select
      select case (key // "=" // value)
      case ("fill=none", "stroke=currentColor", "color=var(--g0)", "stroke-width=1.00", "stroke-linecap=butt", &
        & "stroke-linejoin=miter")
        if (sets_pen) cycle
      case ("stroke=none", "fill=var(--g0)", "font-size=14.00")
        if (name == "g" .and. index(tag, "text-anchor") > 0) cycle
      case default ! not a default
      end select
      list = list // " " // key // "=""" // value // """"
    end do
  end function short_attributes

  !> Reads the attribute at or after position `from` of a tag, and moves `from` behind it. `key` is empty if there is none.
  pure subroutine read_attribute(tag, from, key, value)
    character(len=*), intent(in) :: tag
    integer, intent(inout) :: from
    character(len=:), allocatable, intent(out) :: key, value
    integer :: first, equals, quote, last

    key = ""
    value = ""
    first = verify(tag(from:), " />" // achar(9) // achar(10) // achar(13))
    equals = index(tag(from:), "=")
    if (first == 0 .or. equals == 0) return
    quote = scan(tag(from:), "'""")
    if (quote < equals) return
    quote = from - 1 + quote
    last = index(tag(quote + 1:), tag(quote:quote))
    if (last == 0) return
    key = trim(tag(from - 1 + first:from - 2 + equals))
    value = replaced(tag(quote + 1:quote + last - 1), """", "&quot;")
    from = quote + last + 1
  end subroutine read_attribute

  !> Value of an attribute of a tag; empty if the tag does not have it.
  pure function attribute(tag, name) result(value)
    character(len=*), intent(in) :: tag, name
    character(len=:), allocatable :: value, key
    integer :: from

    from = scan(tag // " ", " " // achar(10))
    do
      call read_attribute(tag, from, key, value)
      if (key == "" .or. key == name) return
    end do
  end function attribute

  !> Position of the character > that ends the tag or comment that begins at `first`; the length of the text if there is none.
  pure integer function end_of_tag(source, first) result(last)
    character(len=*), intent(in) :: source
    integer, intent(in) :: first
    character :: quote

    if (index(source(first:), "<!--") == 1) then
      last = index(source(first:), "-->")
      last = merge(first + last + 1, len(source), last > 0)
      return
    end if
    quote = " "
    do last = first, len(source)
      if (quote /= " ") then
        if (source(last:last) == quote) quote = " "
      else if (source(last:last) == "'" .or. source(last:last) == """") then
        quote = source(last:last)
      else if (source(last:last) == ">") then
        return
      end if
    end do
    last = len(source)
  end function end_of_tag

  !> True if the rectangle is the background of the whole picture.
  pure logical function is_background(tag)
    character(len=*), intent(in) :: tag

    is_background = attribute(tag, "x") == "0" .and. attribute(tag, "y") == "0" .and. attribute(tag, "fill") == "#ffffff"
  end function is_background

  !> True if the picture uses the symbol, filter or pattern `id`, directly or by another one.
  pure recursive logical function is_used(source, id) result(used)
    character(len=*), intent(in) :: source, id
    character(len=:), allocatable :: user
    integer :: definitions, at, from

    definitions = index(source, "</defs>")
    used = index(source(definitions + 1:), "#" // id // "'") > 0 .or. index(source(definitions + 1:), "#" // id // ")") > 0
    from = 0
    do while (.not. used)
      at = index(source(from + 1:definitions), "'#" // id // "'")
      if (at == 0) return
      from = from + at
      user = attribute("use " // source(from + len(id) + 3:end_of_tag(source, from + len(id) + 3)), "id")
      if (user /= "" .and. user /= id) used = is_used(source, user)
    end do
  end function is_used

  !> A style attribute with the colours of the page.
  pure function themed_style(style) result(themed)
    character(len=*), intent(in) :: style
    character(len=:), allocatable :: themed
    integer :: colon, first, last

    themed = ""
    first = 1
    do while (first <= len(style))
      last = index(style(first:), ";")
      last = merge(first + last - 2, len(style), last > 0)
      colon = index(style(first:last), ":")
      if (themed /= "") themed = themed // ";"
      themed = themed // trim(adjustl(style(first:first - 1 + colon))) // themed_colour(style(first + colon:last))
      first = last + 2
    end do
  end function themed_style

  !> Copy of `words` in which `new` replaces `old`.
  pure function replaced(words, old, new) result(copy)
    character(len=*), intent(in) :: words, old, new
    character(len=:), allocatable :: copy
    integer :: i, from

    copy = ""
    from = 1
    do
      i = index(words(from:), old)
      if (i == 0) exit
      copy = copy // words(from:from + i - 2) // new
      from = from + i - 1 + len(old)
    end do
    copy = copy // words(from:)
  end function replaced

  !> The word number `n` of a text; empty if the text has fewer words.
  pure function word(words, n) result(found)
    character(len=*), intent(in) :: words
    integer, intent(in) :: n
    character(len=:), allocatable :: found
    integer :: k

    found = trim(adjustl(words))
    do k = 2, n
      found = trim(adjustl(found(scan(found // " ", " "):)))
    end do
    found = found(:scan(found // " ", " ") - 1)
  end function word

end module gestell_output_page_svg
