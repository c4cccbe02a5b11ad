!> Where the points of a sweep stand in the file of its table: all rows have the same width, so every tile has its places before
!> anything is computed, and whoever computes it writes them.
module gestell_task_sweep_layout
  use gestell_base_kinds, only: dp
  use gestell_study_grid, only: grid_type, tile_type
  use gestell_study_tile_results, only: sweep_columns
  use gestell_task_sweep_csv, only: csv_rows, csv_values, csv_width, header
  use gestell_task_sweep_npy, only: npy_head, npy_rows, npy_values, number_bytes
  use gestell_task_range_plan, only: sweep_plan_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: new_layout

  type, public :: layout_type
    !> The name of the file; what stands before the rows, but for the lines of remarks.
    character(len=:), allocatable :: file, header
    !> Bytes of a row; numbers of a point behind its parameters.
    integer :: width = 0, numbers = 0
    logical :: binary = .false.
    type(grid_type) :: grid
    logical, private :: columns(sweep_columns) = .false.
  contains
    procedure :: head
    procedure :: bytes
    procedure :: place
    procedure :: pieces
    procedure :: rows
    procedure :: values
  end type layout_type

  !> Points (i, j) that stand one behind the other.
  type, public :: piece_type
    integer :: first(2) = 1, last(2) = 1
  end type piece_type

  !> Rows of a piece, at the most.
  integer, parameter :: most_rows = 4096

contains

  pure type(layout_type) function new_layout(plan) result(layout)
    type(sweep_plan_type), intent(in) :: plan

    layout%grid = plan%grid
    layout%columns = plan%options%columns
    layout%numbers = plan%options%numbers()
    layout%binary = plan%format == "npy"
    layout%file = "sweep." // plan%format
    if (layout%binary) then
      layout%width = number_bytes * (size(plan%grid%axes) + layout%numbers)
      layout%header = npy_head(plan%grid%points(), size(plan%grid%axes) + layout%numbers)
    else
      layout%width = csv_width(plan%grid, plan%options)
      layout%header = header(plan%paths, plan%units, plan%grid, plan%options) // new_line("a")
    end if
  end function new_layout

  !> What stands before the rows; `preamble`: complete lines of remarks, for those who can read them.
  pure function head(self, preamble)
    class(layout_type), intent(in) :: self
    character(len=*), intent(in) :: preamble
    character(len=:), allocatable :: head

    head = self%header
    if (.not. self%binary) head = preamble // self%header
  end function head

  !> Bytes of all rows.
  pure integer(int64) function bytes(self)
    class(layout_type), intent(in) :: self

    bytes = self%width * self%grid%points()
  end function bytes

  !> Bytes before the row of point (i, j), among those of all rows.
  pure integer(int64) function place(self, point)
    class(layout_type), intent(in) :: self
    integer, intent(in) :: point(2)
    integer :: fast

    fast = 1
    if (size(self%grid%axes) > 1) fast = self%grid%axes(2)%count
    place = self%width * ((point(1) - 1_int64) * fast + point(2) - 1)
  end function place

  !> A tile as pieces, in the order of their places.
  pure function pieces(self, tile)
    class(layout_type), intent(in) :: self
    type(tile_type), intent(in) :: tile
    type(piece_type), allocatable :: pieces(:)
    integer :: along, i, k

    along = 1
    ! rows that reach from end to end stand one behind the other
    if (self%place([2, 1]) == self%width * (tile%last(2) - tile%first(2) + 1_int64)) then
      along = max(1, most_rows / (tile%last(2) - tile%first(2) + 1))
    end if
    allocate(pieces((tile%last(1) - tile%first(1)) / along + 1))
    do k = 1, size(pieces)
      i = tile%first(1) + (k - 1) * along
      pieces(k) = piece_type([i, tile%first(2)], [min(i + along - 1, tile%last(1)), tile%last(2)])
    end do
  end function pieces

  !> The rows of points of which the first is point `first` on the axes; `values` of shape (numbers, points of the second axis,
  !> points of the first).
  pure function rows(self, first, values)
    class(layout_type), intent(in) :: self
    integer, intent(in) :: first(2)
    real(dp), contiguous, intent(in) :: values(:, :, :)
    character(len=:), allocatable :: rows

    if (self%binary) then
      rows = npy_rows(self%grid, first, values)
    else
      rows = csv_rows(self%grid, self%columns, self%width, first, values)
    end if
  end function rows

  !> The numbers of rows, one point after the other.
  pure subroutine values(self, rows, numbers)
    class(layout_type), intent(in) :: self
    character(len=*), intent(in) :: rows
    real(dp), intent(out) :: numbers(:, :)
    integer :: k

    do k = 1, size(numbers, 2)
      associate (row => rows((k - 1) * self%width + 1:k * self%width), axes => size(self%grid%axes))
        if (self%binary) call npy_values(row, axes, numbers(:, k))
        if (.not. self%binary) call csv_values(row, axes, self%columns, numbers(:, k))
      end associate
    end do
  end subroutine values

end module gestell_task_sweep_layout
