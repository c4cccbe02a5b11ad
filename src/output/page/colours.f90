!> Colours of the page and its pictures. On dark screens the page replaces them by colours that are readable on a dark background.
module gestell_output_page_colours
  use gestell_base_text, only: newline
  implicit none (type, external)
  private

  public :: colour_map, colour_rules, themed_colour

  !> A colour of the pictures: on light screens and paper, and on dark screens
  type :: colour_type
    character(len=6) :: light, dark
  end type colour_type

  !> Colours of curves (Okabe and Ito), then those of the machine's drawing and of marks
  type(colour_type), parameter :: palette(*) = [colour_type("0072b2", "5cb3ec"), colour_type("d55e00", "f58a3c"), &
    & colour_type("009e73", "2fc79b"), colour_type("cc79a7", "dd98be"), colour_type("e69f00", "e69f00"), &
    & colour_type("56b4e9", "56b4e9"), colour_type("cc0000", "ff7a7a"), colour_type("8e24aa", "cf86e3"), &
    & colour_type("8c9bab", "8493a3"), colour_type("b5bfc8", "5d6770"), colour_type("e4eef5", "2b3a45"), &
    & colour_type("e9edf0", "2c3135"), colour_type("f9e0c7", "4a3321"), colour_type("f7e2b3", "45391b"), &
    & colour_type("44617a", "8fb3d1")]
  character(len=*), parameter :: digits = "0123456789abcdef"
  !> Grey levels of the page's background and of its text, each from 0 (black) to 255 (white)
  integer, parameter :: dark_back = 24, dark_text = 230

contains

  !> Rules of a style sheet that define the colours as --c1, --c2, ... and the greys from black to white as --g0 to --gf. On dark
  !> screens black and white change places.
  pure function colour_rules() result(rules)
    character(len=:), allocatable :: rules, light, dark
    integer :: i

    light = ""
    dark = ""
    do i = 1, size(palette)
      light = light // variable("c", i) // ":#" // palette(i)%light // ";"
      dark = dark // variable("c", i) // ":#" // palette(i)%dark // ";"
    end do
    do i = 0, 15
      light = light // variable("g", i) // ":#" // repeat(digits(i + 1:i + 1), 3) // ";"
      dark = dark // variable("g", i) // ":#" // repeat(hexadecimal(dark_text + (dark_back - dark_text) * i / 15), 3) // ";"
    end do
    rules = ":root{color-scheme:light dark;" // light // "}" // newline // "@media screen and (prefers-color-scheme:dark){:root{" &
      & // dark // "}}" // newline
  end function colour_rules

  !> JSON object with the variable of each colour of the palette.
  pure function colour_map() result(json)
    character(len=:), allocatable :: json
    integer :: i

    json = "{"
    do i = 1, size(palette)
      if (i > 1) json = json // ","
      json = json // """#" // palette(i)%light // """:""var(" // variable("c", i) // ")"""
    end do
    json = json // "}"
  end function colour_map

  !> Name of a variable of the style sheet.
  pure function variable(kind, number) result(name)
    character(len=*), intent(in) :: kind
    integer, intent(in) :: number
    character(len=4) :: name

    name = "--" // kind // digits(number + 1:number + 1)
  end function variable

  !> Two hexadecimal digits of a number from 0 to 255.
  pure character(len=2) function hexadecimal(number)
    integer, intent(in) :: number

    hexadecimal = digits(number / 16 + 1:number / 16 + 1) // digits(modulo(number, 16) + 1:modulo(number, 16) + 1)
  end function hexadecimal

  !> A colour of a picture as the page writes it: greys and the colours of the palette refer to the variables of the style sheet. A
  !> value that is no colour is returned unchanged.
  pure function themed_colour(value) result(colour)
    !> Colour as gnuplot writes it, such as black, #FFFFFF or rgb( 0, 114, 178)
    character(len=*), intent(in) :: value
    character(len=:), allocatable :: colour
    character(len=6) :: code
    integer :: rgb(3), i, status

    colour = trim(adjustl(value))
    status = 1
    if (colour == "black") then
      rgb = 0
      status = 0
    else if (colour == "lightgrey") then
      rgb = 211
      status = 0
    else if (index(colour, "#") == 1 .and. len(colour) == 7) then
      read (colour(2:), "(3z2)", iostat=status) rgb
    else if (index(colour, "rgb(") == 1 .and. index(colour, ")") == len(colour)) then
      read (colour(5:len(colour) - 1), *, iostat=status) rgb
    end if
    if (status /= 0) return
    if (any(rgb < 0 .or. rgb > 255)) return
    if (all(rgb == rgb(1))) then
      colour = "var(" // variable("g", (rgb(1) + 8) / 17) // ")"
      return
    end if
    code = hexadecimal(rgb(1)) // hexadecimal(rgb(2)) // hexadecimal(rgb(3))
    colour = "#" // code
    do i = 1, size(palette)
      if (code == palette(i)%light) colour = "var(" // variable("c", i) // ")"
    end do
  end function themed_colour

end module gestell_output_page_colours
