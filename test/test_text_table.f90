!> Layout of the report's tables and lines within 80 columns.
module test_text_table
  use checks, only: check_that
  use gestell_base_growing_text, only: growing_text_type
  use gestell_output_report_text_table, only: formatted, tab
  use gestell_base_words, only: character_count
  use gestell_output_report_wrapping, only: wrapped
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_text_table

  character, parameter :: newline = new_line("a")

contains

  subroutine collect_text_table(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("columns are as wide as their contents", test_columns), &
      & new_unittest("a table that is too wide is printed as stacked rows", test_stacked), &
      & new_unittest("lines are broken between words", test_wrapped), &
      & new_unittest("tables of any width keep all cells within 80 columns", test_all_widths), &
      & new_unittest("appending many pieces copies each character only a few times", test_growing)]
  end subroutine collect_text_table

  subroutine test_columns(error)
    type(error_type), allocatable, intent(out) :: error

    call check_that(error, formatted("lrl", "foot,peak" // newline // ",N", "Füße" // tab // "12.5" // tab // "<- high" &
      & // newline // "b" // tab // "3" // newline), "==", "  foot   peak" // newline // "            N" // newline &
      & // "  Füße   12.5   <- high" // newline // "  b         3" // newline, "with heads and units")
    call check_that(error, formatted("lr", "", "all" // tab // "3" // newline), "==", "  all   3" // newline, "without heads")
    call check_that(error, formatted("ll", "", "a" // tab // "b" // tab // "c" // newline), "==", "  a   b" // tab // "c" &
      & // newline, "a cell too many")
    call check_that(error, formatted("lrl", "foot,peak,remark" // newline // ",N,", "a" // tab // "12.5" // newline // "b" // tab &
      & // "3" // tab // newline), "==", "  foot   peak" // newline // "            N" // newline // "  a      12.5" // newline &
      & // "  b         3" // newline, "a column without anything")
  end subroutine test_columns

  !> A name and a remark too long for their columns.
  subroutine test_stacked(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: rows

    rows = repeat("n", 50) // tab // repeat("1", 30) // tab // repeat("2", 30) // tab // repeat("r", 20) // newline &
      & // "short" // tab // "1" // tab // "2" // tab // "r" // newline
    call check_that(error, formatted("lrrl", "name,x,y", rows), "==", &
      & "  name" // repeat(" ", 41) // "x" // repeat(" ", 31) // "y" // newline &
      & // "  " // repeat("n", 50) // newline &
      & // repeat(" ", 18) // repeat("1", 30) // "  " // repeat("2", 30) // newline &
      & // "    " // repeat("r", 20) // newline &
      & // "  short" // repeat(" ", 40) // "1" // repeat(" ", 31) // "2" // newline // "    r" // newline)
  end subroutine test_stacked

  !> Continuation lines start below the words; a number stays with its unit, and a long word stays whole; short and empty lines
  !> do not change.
  subroutine test_wrapped(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: words = "it holds this speed whatever torque that takes, and within the turn to 5"

    call check_that(error, wrapped("  motor    " // words // " mm" // newline), "==", &
      & "  motor    it holds this speed whatever torque that takes, and within the turn" // newline &
      & // "           to 5 mm" // newline, "below a label")
    call check_that(error, wrapped("  " // words // words // newline // newline // "  a" // newline), "==", &
      & "  it holds this speed whatever torque that takes, and within the turn to 5it" // newline &
      & // "    holds this speed whatever torque that takes, and within the turn to 5" // newline // newline // "  a" // newline, &
      & "a sentence")
    call check_that(error, wrapped("  abc " // repeat("ä", 90) // " b" // newline), "==", &
      & "  abc" // newline // "    " // repeat("ä", 90) // newline // "    b" // newline, "a long word")
    call check_that(error, wrapped(repeat("ä", 80) // newline), "==", repeat("ä", 80) // newline, "80 characters of two bytes")
  end subroutine test_wrapped

  !> Tables of all widths: every cell is there, no line has more than 80 columns.
  subroutine test_all_widths(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: lines
    integer :: name, remark, number, first, last

    do name = 1, 61, 4
      do remark = 0, 70, 5
        do number = 1, 18
          lines = formatted("lrrrl", "h,h,h,h,h", repeat("n", name) // tab // repeat("1", number) // tab // &
            & repeat("2", number) // tab // repeat("3", number) // tab // repeat("r", remark) // newline)
          call check_that(error, [index(lines, repeat("n", name)), index(lines, repeat("1", number)), &
            & index(lines, repeat("2", number)), index(lines, repeat("3", number)), index(lines, repeat("r", remark))], ">", 0, &
            & "cells")
          first = 1
          do while (first <= len(lines))
            last = first + index(lines(first:), newline) - 2
            call check_that(error, character_count(lines(first:last)), "<=", 80, lines(first:last))
            first = last + 2
          end do
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_all_widths

  !> Appending as internal writes do. Doubling the room moves every character at most twice on average.
  subroutine test_growing(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: pieces = 4000
    type(growing_text_type) :: text
    character(len=pieces * 12) :: expected
    character(len=12) :: piece
    integer :: i

    call check_that(error, text%whole(), "==", "", "empty text")
    call text%append("")
    call check_that(error, text%whole(), "==", "", "empty piece appended")
    do i = 1, pieces
      write (piece, "('piece ', i6)") i
      call text%append(piece(:6))
      call text%append(piece(7:))
      expected(12 * i - 11:12 * i) = piece
    end do
    call check_that(error, text%whole() == expected, "==", .true., "all pieces in their order")
    call check_that(error, text%moved, "<=", 2 * len(expected), "characters moved")
    call text%append(expected)
    call check_that(error, text%whole() == expected // expected, "==", .true., "one piece longer than the room")
  end subroutine test_growing

end module test_text_table
