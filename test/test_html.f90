!> The components of report.html.
module test_html
  use checks, only: check_that
  use gestell_base_text, only: text
  use gestell_base_markup, only: escaped
  use gestell_base_kinds, only: dp
  use gestell_output_page_colours, only: themed_colour
  use gestell_output_page_path, only: short_path, short_points
  use gestell_output_page_svg, only: inline_svg
  use gestell_output_page_table, only: html_table
  use gestell_output_page_viewer, only: viewer
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: new_unit
  use gestell_input_machine_frame, only: support_keys
  use gestell_base_key, only: find_key, of_length
  use gestell_base_verdict, only: unjudged
  use gestell_task_common_keys, only: case_keys
  use gestell_input_schema_units, only: unit_symbol, units_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: collect_html

contains

  subroutine collect_html(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("special characters in the user's text are escaped", test_escaped), &
      & new_unittest("column headings show the unit in words", test_label), &
      & new_unittest("a table becomes valid HTML with escaped text", test_table), &
      & new_unittest("a wide table is transposed on the page", test_turned), &
      & new_unittest("error bounds and details are hidden until all columns are shown", test_details), &
      & new_unittest("lines in pictures keep their shape within a tenth of a pixel", test_path), &
      & new_unittest("greys and known colours follow the page", test_colours), &
      & new_unittest("a picture on the page has no background and unique identifiers", test_picture), &
      & new_unittest("no text of a scene ends the script of its viewer", test_viewer), &
      & new_unittest("only the first rows of a long file are shown", test_long), &
      & new_unittest("expected columns follow the existing ones in the order given", test_expected), &
      & new_unittest("each input key shows the unit that the input selects", test_units)]
  end subroutine collect_html

  !> Expected columns follow the existing ones in the given order, with their numbers and errors; further ones come last.
  subroutine test_expected(error)
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    integer :: k

    table = new_table("t", "", "", unjudged)
    call table%add("first", "one by itself", [1, 2])
    call table%expect(0)
    call table%expect(2)
    call table%add("second", new_unit("m"), "expected", [2.0_dp, 4.0_dp], error="third")
    call table%add("third", new_unit("m"), "expected", [0.1_dp, 0.2_dp])
    call table%add("fourth", "again by itself", ["a", "b"])
    call check_that(error, size(table%columns), "==", 4, "columns")
    call check_that(error, table%columns(1)%integers, "==", [1, 2], "the first")
    call check_that(error, abs(table%columns(2)%numbers - [2.0_dp, 4.0_dp]), "<=", 0.0_dp, "the second")
    call check(error, table%columns(2)%error, "third_m")
    if (allocated(error)) return
    call check(error, table%columns(4)%word(2), "b")
    if (allocated(error)) return
    call check_that(error, [(len(table%columns(k)%error), k = 3, 4)], "==", 0, "no errors")
    call check(error, table%columns(3)%key // table%columns(4)%key, "third_mfourth")
  end subroutine test_expected

  subroutine test_escaped(error)
    type(error_type), allocatable, intent(out) :: error

    call check(error, escaped("a<b>&""c""" // char(7)), "a&lt;b&gt;&amp;&quot;c&quot; ")
  end subroutine test_escaped

  !> Column names end in the unit's suffix in files, and show the unit in words for readers.
  subroutine test_label(error)
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table

    table = new_table("a", "", "", unjudged)
    call table%add("exponent_im", new_unit("rad/s"), "", [1.0_dp])
    call table%add("ax_peak", new_unit("m/s^2"), "", [1.0_dp], error="ax_peak_error")
    call table%add("moment", new_unit("N m"), "", [1.0_dp])
    call check(error, table%columns(1)%key, "exponent_im_rad_s")
    if (.not. allocated(error)) call check(error, table%columns(1)%label, "exponent im")
    if (.not. allocated(error)) call check(error, table%columns(2)%key, "ax_peak_m_s2")
    if (.not. allocated(error)) call check(error, table%columns(2)%error, "ax_peak_error_m_s2")
    if (.not. allocated(error)) call check(error, table%columns(3)%key, "moment_Nm")
  end subroutine test_label

  subroutine test_table(error)
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    character(len=:), allocatable :: lines

    table = new_table("a", "", "", unjudged)
    call table%add("name", "", [character(len=6) :: "b, ""c""", "d"])
    call table%add("x", new_unit("m"), "", [-1.23456789e-3_dp, ieee_value(1.0_dp, ieee_quiet_nan)])
    lines = html_table(table)
    call check_that(error, lines, "contains", ">x (mm)</th>", "head")
    call check_that(error, lines, "contains", "<td>b, &quot;c&quot;</td><td class=""n"">-1.2346</td>", "quotes and digits")
    call check_that(error, lines, "contains", "<td class=""n"">–</td>", "no number")
    if (allocated(error)) return
    table = new_table("a", "", "", unjudged)
    call table%add("x", new_unit("m"), "", [real(dp) ::])
    call check(error, html_table(table), "")
  end subroutine test_table

  subroutine test_turned(error)
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    integer :: k

    table = new_table("a", "", "", unjudged)
    do k = 1, 11
      call table%add(achar(96 + k), "", [k])
    end do
    do k = 1, 11
      call check_that(error, html_table(table), "contains", "<tr><th scope=""row"">" // achar(96 + k) // "</th><td class=""n"">" &
        & // text(k) // "</td></tr>", "turned")
      if (allocated(error)) return
    end do
  end subroutine test_turned

  !> Hidden are error bounds, columns that the table marks, columns without values, and flags that are equal in all rows.
  subroutine test_details(error)
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    character(len=:), allocatable :: lines
    character(len=*), parameter :: hidden(6) = [character(len=11) :: "x error", "x crest", "index", "none", "blank", "lost"]
    real(dp) :: missing
    integer :: k

    missing = ieee_value(1.0_dp, ieee_quiet_nan)
    table = new_table("a", "", "", unjudged)
    call table%add("index", "", [1, 2])
    call table%add("x", new_unit("m"), "", [0.5_dp, 0.25_dp], bounds=[1.23e-8_dp, 2.0e-8_dp])
    call table%add("x_crest", new_unit(""), "", [1.5_dp, 2.5_dp])
    call table%add("none", new_unit(""), "", [missing, missing])
    call table%add("blank", "", ["", ""])
    call table%add("lost", "", [.true., .true.])
    call table%add("small", "", [.true., .false.])
    call table%mark_details([character(len=5) :: "crest", "smal"])
    lines = html_table(table)
    call check_that(error, lines, "contains", "aria-pressed=""false"">all columns</button>", "button")
    do k = 1, size(hidden)
      call check_that(error, is_hidden(trim(hidden(k))), "==", .true., trim(hidden(k)) // " is hidden")
    end do
    call check_that(error, is_hidden("small"), "==", .false., "small is hidden")
    call check_that(error, is_hidden("x (mm)"), "==", .false., "x is hidden")
    call check_that(error, lines, "contains", "<td class=""n x"">1.2e-5</td>", "the unit of an error bound is that of its values")

  contains

    !> True if the heading that begins with `label` belongs to a hidden column.
    logical function is_hidden(label)
      character(len=*), intent(in) :: label
      integer :: at, start

      at = index(lines, ">" // label)
      start = index(lines(:at), "<th", back=.true.)
      is_hidden = index(lines(start:at), "class=""x""") > 0
    end function is_hidden

  end subroutine test_details

  subroutine test_path(error)
    type(error_type), allocatable, intent(out) :: error

    call check(error, short_path("M96.80,324.97 L102.05,324.97  "), "M96.8,325h5.3")
    if (.not. allocated(error)) call check(error, short_path("M0,0 L10,0.04 L20,0 L20,9.5 Z"), "M0,0h20v9.5z")
    if (.not. allocated(error)) call check(error, short_path("M0,0 L1,-0.5 M5,5 L5,7"), "M0,0l1-.5M5,5v2")
    if (.not. allocated(error)) call check(error, short_path("M0,0 A5,5 0 0 1 3,4"), "M0,0 A5,5 0 0 1 3,4")
    if (.not. allocated(error)) call check(error, short_points("0,0 5.01,0 10,0 10,10 "), "0,0 10,0 10,10")
    ! A line that returns to its start keeps its farthest point.
    if (.not. allocated(error)) call check(error, short_path("M0,0 L9,0 L0,0"), "M0,0h9h-9")
  end subroutine test_path

  subroutine test_colours(error)
    type(error_type), allocatable, intent(out) :: error

    call check(error, themed_colour("rgb(221, 221, 221)") // themed_colour("black") // themed_colour("#FFFFFF"), &
      & "var(--gd)var(--g0)var(--gf)")
    if (.not. allocated(error)) call check(error, themed_colour("rgb(  0, 114, 178)"), "var(--c1)")
    if (.not. allocated(error)) call check(error, themed_colour("rgb(1,2,255)") // themed_colour("none"), "#0102ffnone")
    if (.not. allocated(error)) call check(error, themed_colour("rgb(1,2,x)") // themed_colour("rgb(1,2,256)"), &
      & "rgb(1,2,x)rgb(1,2,256)")
  end subroutine test_colours

  subroutine test_picture(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: source = "<?xml version=""1.0""?><!-- > --><svg viewBox=""0 0 800 560""><title>t</title>" &
      & // "<desc>d</desc><rect x=""0"" y=""0"" width=""800"" height=""560"" fill=""#ffffff""/><defs><circle id='gpPt5' r='1'/>" &
      & // "<use xlink:href='#gpPt5' id='gpPt6'/><path id='gpPt7' d='M0,0'/></defs><g id=""a_plot_1"" ><title>t</title>" &
      & // "<g fill=""none"" color=""black"" stroke-linecap=""butt""></g><script>alert(1)</script>" &
      & // "<use xlink:href='#gpPt6' onload='alert(1)' color='rgb(213,  94,   0)'/><text>a &lt; b</text></g></svg>"

    call check(error, inline_svg(source, "p-", "a<b"), "<svg class=""plot"" role=""img"" aria-label=""a&lt;b"" " &
      & // "viewBox=""0 0 800 560"" style=""--w:800px""><defs><circle id=""p-gpPt5"" r=""1""/><use href=""#p-gpPt5"" " &
      & // "id=""p-gpPt6""/></defs><use href=""#p-gpPt6"" color=""var(--c2)""/><text>a &lt; b</text></svg>")
    if (.not. allocated(error)) call check(error, inline_svg("no picture", "p-", ""), "")
    if (.not. allocated(error)) call check(error, inline_svg("<svg viewBox=""0"" onload=""x"">", "p-", ""), "")
  end subroutine test_picture

  subroutine test_viewer(error)
    type(error_type), allocatable, intent(out) :: error

    call check_that(error, viewer("{""name"":""</script><b>""}"), "contains", "{""name"":""\u003c/script>\u003cb>""}", "JSON")
  end subroutine test_viewer

  subroutine test_long(error)
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    integer :: k

    table = new_table("a", "", "", unjudged)
    call table%add("a", "", [(k, k = 1, 61)])
    call check_that(error, html_table(table), "contains", "The first 60 of 61 rows", "caption")
  end subroutine test_long

  subroutine test_units(error)
    type(error_type), allocatable, intent(out) :: error
    type(units_type) :: units

    units%of(of_length)%name = "cm"
    call check(error, unit_symbol(support_keys(find_key(support_keys, "position")), 1, units), "cm")
    if (.not. allocated(error)) call check(error, unit_symbol(support_keys(find_key(support_keys, "angle")), 0, units), "deg")
    if (.not. allocated(error)) call check(error, unit_symbol(case_keys(find_key(case_keys, "title")), 0, units), "")
  end subroutine test_units

end module test_html
