!> The pieces of report.html.
module test_html
  use checks, only: check_that
  use gestell_base_base64, only: base64
  use gestell_output_page_html, only: escaped
  use gestell_output_page_table, only: html_table, label
  use gestell_input_machine_frame, only: support_keys
  use gestell_base_key, only: find_key, of_length
  use gestell_task_keys, only: case_keys
  use gestell_input_schema_units, only: unit_symbol, units_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_html

  character, parameter :: newline = new_line("a")

contains

  subroutine collect_html(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("base64 as RFC 4648 has it", test_base64), &
      & new_unittest("user's text is text on the page", test_escaped), &
      & new_unittest("heads of columns have units", test_label), &
      & new_unittest("a file becomes a table", test_table), &
      & new_unittest("a wide file becomes a tall table", test_turned), &
      & new_unittest("of a long file the first rows", test_long), &
      & new_unittest("units of the input's keys", test_units)]
  end subroutine collect_html

  !> The test vectors of RFC 4648, section 10, and bytes above 127.
  subroutine test_base64(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: plain = "foobar"
    character(len=8), parameter :: expected(0:6) = [character(len=8) :: "", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", &
      & "Zm9vYmFy"]
    character(len=:), allocatable :: encoded
    integer :: n

    do n = 0, 6
      call base64(plain(:n), encoded)
      call check(error, encoded, trim(expected(n)))
      if (allocated(error)) return
    end do
    call base64(char(255) // char(128) // char(0), encoded)
    call check(error, encoded, "/4AA")
  end subroutine test_base64

  subroutine test_escaped(error)
    type(error_type), allocatable, intent(out) :: error

    call check(error, escaped("a<b>&""c""" // char(7)), "a&lt;b&gt;&amp;&quot;c&quot; ")
  end subroutine test_escaped

  subroutine test_label(error)
    type(error_type), allocatable, intent(out) :: error

    call check(error, label("exponent_im_rad_per_s"), "exponent im (rad/s)")
    if (.not. allocated(error)) call check(error, label("fx_1_peak_N"), "fx 1 peak (N)")
    if (.not. allocated(error)) call check(error, label("index"), "index")
    if (.not. allocated(error)) call check(error, label("growth_1_per_s"), "growth (1/s)")
  end subroutine test_label

  subroutine test_table(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: table

    table = html_table("a.csv", "# title" // newline // "name,x_m" // newline // """b, """"c""""""," &
      & // "-1.2345678900000000E-003" // newline // "d,NaN" // newline)
    call check_that(error, table, "contains", "<th scope=""col"">x (m)</th>", "head")
    call check_that(error, table, "contains", &
      & "<td>b, &quot;c&quot;</td><td class=""n"">-0.00123457</td>", "quotes and digits: " // table)
    call check_that(error, table, "contains", "<td>NaN</td>", "no number")
    call check_that(error, index(table, "title"), "==", 0, "preamble")
    if (.not. allocated(error)) call check(error, html_table("a.csv", "# title" // newline // "name,x_m" // newline), "")
  end subroutine test_table

  subroutine test_turned(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: table

    table = html_table("a.csv", "a,b,c,d,e,f,g,h,i,j,k" // newline // "1,2,3,4,5,6,7,8,9,10,11" // newline)
    call check_that(error, table, "contains", "<tr><th scope=""row"">k</th><td class=""n"">11</td></tr>")
  end subroutine test_turned

  subroutine test_long(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: table, lines
    integer :: k

    lines = "a" // newline
    do k = 1, 61
      lines = lines // "7" // newline
    end do
    table = html_table("a.csv", lines)
    call check_that(error, table, "contains", "the first 60 of 61 rows", "caption")
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
