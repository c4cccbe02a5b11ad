!> Positions of the points of a sweep in the file of its table. All rows have the same width. The position of each tile is therefore
!> known before the computation, and each process writes its tiles directly to their positions.
!>
!> Rows are lines of CSV, or rows of a NumPy array (format version 1.0 of numpy.lib.format) of shape (points, columns). The array
!> consists of eight-byte numbers, which also represent verdicts.
module gestell_task_sweep_layout
  use gestell_base_kinds, only: dp
  use gestell_output_table_result_units, only: conversion_type
  use gestell_study_grid, only: grid_type, tile_type
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_columns, only: column_type, columns_of
  use gestell_task_sweep_csv, only: csv_rows, csv_values, header
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: new_layout

  !> Layout of the file that contains a sweep's table.
  type, public :: layout_type
    !> `file`: name of the file. `header`: text before the rows, without comment lines.
    character(len=:), allocatable :: file, header
    !> Length of a row in bytes.
    integer :: width = 0
    logical :: binary = .false.
    type(grid_type) :: grid
    type(column_type), allocatable, private :: columns(:)
    !> Conversion of each result of a point to its unit in the file.
    type(conversion_type), allocatable, private :: conversions(:)
  contains
    procedure :: place, pieces, rows, values
  end type layout_type

  !> A piece of the file: rows that are contiguous. They belong to the points with the indices `first` to `last` on both axes.
  type, public :: piece_type
    integer :: first(2) = 1, last(2) = 1
  end type piece_type

  !> Maximum number of rows of a piece.
  integer, parameter :: max_rows = 4096
  !> `number_bytes`: number of bytes of a number. `head_bytes`: number of bytes of an array's header; the format requires a multiple
  !> of 64, and 128 are sufficient for every shape. `before_text`: number of bytes of the header before its text.
  integer, parameter :: number_bytes = 8, head_bytes = 128, before_text = 10

contains

  !> Layout of the file for a sweep with the given plan.
  pure type(layout_type) function new_layout(plan) result(layout)
    type(sweep_plan_type), intent(in) :: plan

    layout%grid = plan%grid
    layout%columns = columns_of(plan)
    layout%conversions = plan%result_units%conversion(layout%columns(size(plan%grid%axes) + 1:)%unit%words)
    layout%binary = plan%format == "npy"
    layout%file = "sweep." // plan%format
    if (layout%binary) then
      layout%width = number_bytes * size(layout%columns)
      layout%header = npy_head(plan%grid%points(), size(layout%columns))
    else
      layout%width = sum(layout%columns%width) + size(layout%columns)
      layout%header = header(plan) // new_line("a")
    end if
  end function new_layout

  !> Header of a NumPy file: magic string, version, length of the text, and the text padded with blanks.
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

  !> Distance in bytes from the first row to the row of a grid point. `point`: indices of the point on both axes.
  pure integer(int64) function place(self, point)
    class(layout_type), intent(in) :: self
    integer, intent(in) :: point(2)
    integer :: fast

    fast = 1
    if (size(self%grid%axes) > 1) fast = self%grid%axes(2)%count
    place = self%width * ((point(1) - 1_int64) * fast + point(2) - 1)
  end function place

  !> The pieces of a tile, in the order of their positions in the file.
  pure function pieces(self, tile)
    class(layout_type), intent(in) :: self
    type(tile_type), intent(in) :: tile
    type(piece_type), allocatable :: pieces(:)
    integer :: along, i, k

    along = 1
    ! If a tile extends over the whole second axis, all its rows are contiguous.
    if (self%place([2, 1]) == self%width * (tile%last(2) - tile%first(2) + 1_int64)) then
      along = max(1, max_rows / (tile%last(2) - tile%first(2) + 1))
    end if
    allocate(pieces((tile%last(1) - tile%first(1)) / along + 1))
    do k = 1, size(pieces)
      i = tile%first(1) + (k - 1) * along
      pieces(k) = piece_type([i, tile%first(2)], [min(i + along - 1, tile%last(1)), tile%last(2)])
    end do
  end function pieces

  !> The rows of a block of points that begins at the indices `first` on the axes. `values` has the shape (results per point,
  !> points of the second axis, points of the first axis).
  pure function rows(self, first, values)
    class(layout_type), intent(in) :: self
    integer, intent(in) :: first(2)
    real(dp), contiguous, intent(in) :: values(:, :, :)
    character(len=:), allocatable :: rows
    real(dp), allocatable :: numbers(:, :, :)
    integer :: i, j

    if (.not. self%binary) then
      if (any(self%conversions%words /= "")) then
        rows = csv_rows(self%grid, self%columns, first, converted(self, values))
      else
        rows = csv_rows(self%grid, self%columns, first, values)
      end if
      return
    end if
    allocate(numbers(size(self%columns), size(values, 2), size(values, 3)))
    do i = 1, size(values, 3)
      do j = 1, size(values, 2)
        numbers(:, j, i) = [self%grid%parameters(first(1) + i - 1, first(2) + j - 1), self%conversions%converted(values(:, j, i))]
      end do
    end do
    rows = transfer(numbers, repeat(" ", number_bytes * size(numbers)))
  end function rows

  !> The results of points in the units of the file.
  pure function converted(layout, values)
    type(layout_type), intent(in) :: layout
    real(dp), intent(in) :: values(:, :, :)
    real(dp) :: converted(size(values, 1), size(values, 2), size(values, 3))
    integer :: k

    do k = 1, size(values, 1)
      converted(k, :, :) = layout%conversions(k)%converted(values(k, :, :))
    end do
  end function converted

  !> Reads the numbers from rows, point by point. `numbers` has the shape (results per point, points of the second axis, points of
  !> the first axis).
  pure subroutine values(self, rows, numbers)
    class(layout_type), intent(in) :: self
    character(len=*), intent(in) :: rows
    real(dp), intent(out) :: numbers(:, :, :)
    integer :: i, j, at

    at = 0
    do i = 1, size(numbers, 3)
      do j = 1, size(numbers, 2)
        associate (row => rows(at + 1:at + self%width))
          if (self%binary) numbers(:, j, i) = transfer(row(number_bytes * size(self%grid%axes) + 1:), numbers(:, j, i))
          if (.not. self%binary) call csv_values(row, self%columns, numbers(:, j, i))
          numbers(:, j, i) = self%conversions%original(numbers(:, j, i))
        end associate
        at = at + self%width
      end do
    end do
  end subroutine values

end module gestell_task_sweep_layout
