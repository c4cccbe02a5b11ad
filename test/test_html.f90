!> The components of report.html.
module test_html
  use checks, only: check_that
  use gestell_base_base64, only: base64
  use gestell_output_page_html, only: escaped
  use gestell_base_kinds, only: dp
  use gestell_output_page_table, only: html_table
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
      & new_unittest("base64 encoding agrees with the test vectors of RFC 4648", test_base64), &
      & new_unittest("special characters in the user's text are escaped", test_escaped), &
      & new_unittest("column headings show the unit in words", test_label), &
      & new_unittest("a table becomes valid HTML with escaped text", test_table), &
      & new_unittest("a wide table is transposed on the page", test_turned), &
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
    call check_that(error, lines, "contains", "<th scope=""col"">x (m)</th>", "head")
    call check_that(error, lines, "contains", "<td>b, &quot;c&quot;</td><td class=""n"">-0.00123457</td>", "quotes and digits")
    call check_that(error, lines, "contains", "<td class=""n"">NaN</td>", "no number")
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
    call check_that(error, html_table(table), "contains", "<tr><th scope=""row"">k</th><td class=""n"">11</td></tr>", "turned")
  end subroutine test_turned

  subroutine test_long(error)
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    integer :: k

    table = new_table("a", "", "", unjudged)
    call table%add("a", "", [(k, k = 1, 61)])
    call check_that(error, html_table(table), "contains", "the first 60 of 61 rows", "caption")
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
