!> The points of a sweep as an array of NumPy in a file (format version 1.0 of numpy.lib.format): shape (points, columns), row
!> after row, numbers of eight bytes, verdicts as their numbers.
module gestell_task_sweep_npy
  use gestell_base_kinds, only: dp
  use gestell_study_grid, only: grid_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: npy_head, npy_rows, npy_values

  integer, parameter, public :: number_bytes = 8
  !> Bytes before the numbers: the format wants a multiple of 64, and the text of any shape has room in this one.
  integer, parameter :: head_bytes = 128, before_text = 10

contains

  !> Magic word, version, length of the text that follows, and the text, filled with blanks.
  pure function npy_head(points, columns) result(head)
    integer(int64), intent(in) :: points
    integer, intent(in) :: columns
    character(len=head_bytes) :: head
    character(len=head_bytes - before_text) :: text
    character(len=*), parameter :: order = merge("<", ">", ichar(transfer(1, "a")) == 1)

    write (text, "(3a, i0, a, i0, a)") "{'descr': '", order, "f8', 'fortran_order': False, 'shape': (", points, ", ", &
      & columns, "), }"
    text(len(text):) = new_line("a")
    head = char(147) // "NUMPY" // achar(1) // achar(0) // achar(len(text)) // achar(0) // text
  end function npy_head

  !> The rows of points, as of `csv_rows`.
  pure function npy_rows(grid, first, values) result(bytes)
    type(grid_type), intent(in) :: grid
    integer, intent(in) :: first(2)
    real(dp), contiguous, intent(in) :: values(:, :, :)
    character(len=:), allocatable :: bytes
    real(dp) :: rows(size(grid%axes) + size(values, 1), size(values, 2), size(values, 3))
    integer :: i, j

    do i = 1, size(values, 3)
      do j = 1, size(values, 2)
        rows(:size(grid%axes), j, i) = grid%parameters(first(1) + i - 1, first(2) + j - 1)
      end do
    end do
    rows(size(grid%axes) + 1:, :, :) = values
    bytes = transfer(rows, repeat(" ", number_bytes * size(rows)))
  end function npy_rows

  !> The numbers of a row behind its first `axes`.
  pure subroutine npy_values(row, axes, values)
    character(len=*), intent(in) :: row
    integer, intent(in) :: axes
    real(dp), intent(out) :: values(:)

    values = transfer(row(number_bytes * axes + 1:), values)
  end subroutine npy_values

end module gestell_task_sweep_npy
