!> Writes a gnuplot script for each picture. The script NAME.gp must run in the folder that contains NAME.csv; it needs gnuplot 5.4
!> or newer, and draws NAME.svg and NAME.png.
module gestell_output_picture_script
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_words, only: length_of_character
  use gestell_output_file_output, only: write_file
  use gestell_output_picture_scene, only: scene_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: new_figure, panel_heading, plotted, quoted, span, tic, tics, write_figure

  !> Width of a picture in pixels. At this width the text (14 pixels) is readable in one column of a report, which is about 390
  !> pixels wide, and on the full page, which is about 660 pixels wide
  integer, parameter, public :: picture_width = 640

  !> A picture that shows a table.
  type, public :: figure_type
    !> `name`: name of the picture; the names of its files consist of this name and an ending. `table`: name of the table that it
    !> shows
    character(len=:), allocatable :: name, table
    !> `shown`: what the picture shows. `lines`: gnuplot lines that draw the picture below the text in the gnuplot variable
    !> `heading`
    character(len=:), allocatable :: shown, lines
    !> Width and height of the picture in pixels
    integer :: pixels(2) = [picture_width, 480]
    !> If the picture is an animation: what it shows. The script then draws NAME.gif instead of NAME.svg and NAME.png, and its lines
    !> are composed when it is written
    type(scene_type), allocatable :: scenes(:)
  end type figure_type

  !> Maximum number of characters of a picture's title
  integer, parameter :: longest_title = 84

contains

  !> A picture of `width` by `height` pixels, drawn by the gnuplot commands in `lines`.
  pure type(figure_type) function new_figure(name, shown, lines, width, height, table) result(figure)
    !> `name`: name of the picture. `shown`: what the picture shows. `lines`: gnuplot lines that draw the picture
    character(len=*), intent(in) :: name, shown, lines
    integer, intent(in), optional :: width, height
    !> Name of the table that the picture shows. If absent, the table has the name of the picture
    character(len=*), intent(in), optional :: table

    figure%name = name
    figure%table = name
    if (present(table)) figure%table = table
    figure%shown = shown
    figure%lines = lines
    if (present(width)) figure%pixels(1) = width
    if (present(height)) figure%pixels(2) = height
  end function new_figure

  !> Writes the gnuplot script NAME.gp of a picture into `folder`. Fails if the file cannot be written.
  subroutine write_figure(folder, figure, title, alarm, error)
    !> `folder`: folder of the script. `title`: title of the input. `alarm`: warning that precedes the description of the picture
    character(len=*), intent(in) :: folder, title, alarm
    type(figure_type), intent(in) :: figure
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: heading, start

    heading = quoted(alarm // figure%shown)
    if (title /= "") heading = quoted(title) // " . ""\n"" . " // heading
    if (allocated(figure%scenes)) then
      start = "# Draws " // figure%name // ".gif: run gnuplot " // figure%name // ".gp in this folder." // newline // "reset" &
        & // newline // "set encoding utf8" // newline // "set terminal gif animate delay 8 loop 0 optimize size " &
        & // text(figure%pixels(1)) // "," // text(figure%pixels(2)) // " font 'sans,11'" // newline // "set output '" &
        & // figure%name // ".gif'" // newline // "set datafile separator comma" // newline // "set datafile columnheaders" &
        & // newline
    else
      start = head(figure)
    end if
    call write_file(folder // "/" // figure%name // ".gp", start // "heading = " // heading // newline // figure%lines // newline &
      & // "unset output" // newline, error)
  end subroutine write_figure

  !> Beginning of a gnuplot script: a loop that runs the script once for SVG and once for PNG, and settings common to all pictures.
  !> The colours are those of Okabe and Ito; lines also differ in their dashes and point symbols.
  pure function head(figure) result(lines)
    type(figure_type), intent(in) :: figure
    character(len=:), allocatable :: lines, name
    integer :: pixels(2)

    name = figure%name
    pixels = figure%pixels
    lines = "# Draws " // name // ".svg and " // name // ".png from " // figure%table // ".csv: run gnuplot " // name &
      & // ".gp in this folder." // newline &
      & // "if (!exists(""picture"")) {" // newline &
      & // "  do for [picture in ""svg png""] { load """ // name // ".gp"" }" // newline &
      & // "  undefine picture" // newline &
      & // "  exit" // newline &
      & // "}" // newline &
      & // "reset" // newline &
      & // "set encoding utf8" // newline &
      & // "if (picture eq ""svg"") {" // newline &
      & // "  set terminal svg size " // text(pixels(1)) // "," // text(pixels(2)) &
      & // " font ""sans-serif,14"" background ""white"" name """ // name // """" // newline &
      & // "} else {" // newline &
      & // "  set terminal pngcairo size " // text(2 * pixels(1)) // "," // text(2 * pixels(2)) &
      & // " font ""sans-serif,14"" fontscale 1.5 linewidth 2 pointscale 2 background ""white""" // newline &
      & // "}" // newline &
      & // "set output """ // name // ".""" // " . picture" // newline &
      & // "set datafile separator comma" // newline &
      & // "set datafile columnheaders" // newline &
      & // "set linetype 1 lc rgb ""#0072B2"" lw 2 dt 1 pt 7" // newline &
      & // "set linetype 2 lc rgb ""#D55E00"" lw 2 dt (12,5) pt 5" // newline &
      & // "set linetype 3 lc rgb ""#009E73"" lw 2 dt (3,4) pt 9" // newline &
      & // "set linetype 4 lc rgb ""#CC79A7"" lw 2 dt (12,4,3,4) pt 13" // newline &
      & // "set linetype 5 lc rgb ""#E69F00"" lw 2 dt (18,4) pt 11" // newline &
      & // "set linetype 6 lc rgb ""#56B4E9"" lw 2 dt (6,3) pt 4" // newline &
      & // "set linetype 7 lc rgb ""#000000"" lw 2 dt (12,4,3,4,3,4) pt 6" // newline &
      & // "set linetype 8 lc rgb ""#999999"" lw 2 dt (2,3) pt 8" // newline &
      & // "set grid lt 1 dt 1 lw 0.6 lc rgb ""#DDDDDD""" // newline &
      & // "set border lw 1" // newline &
      & // "set tics nomirror" // newline &
      & // "set style fill solid 1 noborder" // newline
  end function head

  !> Gnuplot line that sets the title of one panel.
  pure function panel_heading(shown, most) result(line)
    character(len=*), intent(in) :: shown
    !> Maximum number of characters
    integer, intent(in), optional :: most
    character(len=:), allocatable :: line

    line = "set title " // quoted(shown, most) // " noenhanced font "",12"" offset 0,-0.6" // newline
  end function panel_heading

  !> A user's text as a gnuplot string in which no character has a special meaning; the string is also valid in XML. Control
  !> characters become blanks, bytes that are not UTF-8 become "?", and "..." replaces the text after `most` characters.
  pure function quoted(words, most) result(string)
    character(len=*), intent(in) :: words
    !> If absent: `longest_title`
    integer, intent(in), optional :: most
    character(len=:), allocatable :: string
    !> Characters that have a special meaning in gnuplot strings, or that gnuplot mistakes for the end of a string
    character(len=*), parameter :: active = "'""\`@${}#%"
    character(len=3) :: octal
    integer :: i, n, characters, last
    logical :: coded

    last = longest_title
    if (present(most)) last = most
    string = """"
    coded = .false.
    i = 1
    characters = 0
    do while (i <= len(words))
      if (characters == last) then
        string = string // "..."
        exit
      end if
      n = length_of_character(words(i:))
      ! "]]>" is forbidden in XML and "&#x" starts a character code; gnuplot escapes neither
      if (words(i:i) == ">" .and. ends_with(string, "]]")) string = string // " "
      if (words(i:i) == "#" .and. ends_with(string, "&")) string = string // " "
      coded = scan(words(i:i), active) > 0 .or. coded .and. scan(words(i:i), "01234567") > 0
      if (coded) then
        write (octal, "(o3.3)") iachar(words(i:i))
        string = string // "\" // octal
      else if (iachar(words(i:i)) < 32 .or. iachar(words(i:i)) == 127) then
        string = string // " "
      else if (n == 0) then
        string = string // "?"
      else
        string = string // words(i:i + n - 1)
      end if
      i = i + max(n, 1)
      characters = characters + 1
    end do
    string = string // """"
  end function quoted

  !> A user's text as the label of a gnuplot tic. Every per cent sign is doubled, because gnuplot reads the label as a format.
  pure function tic(words, most) result(string)
    character(len=*), intent(in) :: words
    !> Maximum number of characters
    integer, intent(in), optional :: most
    character(len=:), allocatable :: string

    string = doubled(quoted(words, most), "\045")
  end function tic

  !> Gnuplot list of tics at the positions `first`, `first` + 1, ... The labels of the tics are `names`.
  pure function tics(names, first, most) result(list)
    character(len=*), intent(in) :: names(:)
    integer, intent(in) :: first
    !> Maximum number of characters of a label
    integer, intent(in), optional :: most
    character(len=:), allocatable :: list
    integer :: i

    list = ""
    do i = 1, size(names)
      list = list // either(", ", "", i > 1) // tic(trim(names(i)), most) // " " // text(first + i - 1)
    end do
  end function tics

  !> A user's text for the gnuplot command plot ... with labels. Every backslash is doubled, because this command interprets escapes
  !> twice.
  pure function plotted(words) result(string)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: string

    string = doubled(quoted(words), "\134")
  end function plotted

  !> Copy of a text in which every occurrence of the character `sign` is doubled.
  pure function doubled(words, sign) result(string)
    character(len=*), intent(in) :: words, sign
    character(len=:), allocatable :: string, rest
    integer :: i

    rest = words
    string = ""
    do
      i = index(rest, sign)
      if (i == 0) exit
      string = string // rest(:i - 1) // sign // sign
      rest = rest(i + len(sign):)
    end do
    string = string // rest
  end function doubled

  !> True if the text ends with `ending`.
  pure logical function ends_with(words, ending)
    character(len=*), intent(in) :: words, ending

    ends_with = len(words) >= len(ending)
    if (ends_with) ends_with = words(len(words) - len(ending) + 1:) == ending
  end function ends_with

  !> Gnuplot range that contains all finite values and a margin. If all values are equal, the range extends by at least `least` on
  !> both sides, so that it is never empty.
  pure function span(values, least) result(range)
    real(dp), intent(in) :: values(:)
    real(dp), intent(in), optional :: least
    character(len=:), allocatable :: range
    real(dp) :: low, high, narrow

    low = 0
    high = 0
    if (any(ieee_is_finite(values))) then
      low = minval(values, mask=ieee_is_finite(values))
      high = maxval(values, mask=ieee_is_finite(values))
    end if
    narrow = 1.0e-6_dp * max(abs(low), abs(high))
    if (present(least)) narrow = max(narrow, least)
    if (high - low > narrow) then
      narrow = 0.07_dp * (high - low)
    else if (.not. narrow > 0) then
      narrow = 1
    end if
    range = "[" // concise(low - narrow, 9) // ":" // concise(high + narrow, 9) // "]"
  end function span

end module gestell_output_picture_script
