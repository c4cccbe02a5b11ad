!> The rows of sweep.csv, in pieces of any length, so that no more than a piece is ever in memory.
module gestell_task_sweep_csv
  use gestell_base_kinds, only: dp
  use gestell_output_table_csv, only: field
  use gestell_output_table_scientific, only: number_width, put_number
  use gestell_study_grid, only: grid_type
  use gestell_study_tile_results, only: column_names, sweep_columns, verdict_column, verdict_names
  implicit none (type, external)
  private

  public :: header, rows

  character, parameter :: newline = new_line("a")

  !> A parameter's value, written once for many rows.
  type :: text_type
    character(len=number_width) :: word = ""
    integer :: length = 0
  end type text_type

contains

  !> The names of the columns.
  pure function header(paths, columns) result(line)
    character(len=*), intent(in) :: paths(:)
    logical, intent(in) :: columns(sweep_columns)
    character(len=:), allocatable :: line
    integer :: i

    line = ""
    do i = 1, size(paths)
      line = line // field(trim(paths(i))) // ","
    end do
    do i = 1, sweep_columns
      if (columns(i)) line = line // trim(column_names(i)) // ","
    end do
    line = line(:len(line) - 1)
  end function header

  !> The lines of points, values of shape (ordered columns, points of the second axis, points of the first), of which the
  !> first is point `first` on the axes.
  pure function rows(grid, columns, first, values) result(lines)
    type(grid_type), intent(in) :: grid
    logical, intent(in) :: columns(sweep_columns)
    integer, intent(in) :: first(2)
    real(dp), contiguous, intent(in) :: values(:, :, :)
    character(len=:), allocatable :: lines
    type(text_type) :: fast(size(values, 2)), slow
    integer :: i, j, k, n, word

    allocate(character(len=size(values, 3) * size(values, 2) * (number_width + 1) * (size(values, 1) + 2)) :: lines)
    word = verdict_column(columns)
    if (size(grid%axes) > 1) fast = [(text_of(grid%axes(2)%value(first(2) + j - 1)), j = 1, size(fast))]
    n = 0
    do i = 1, size(values, 3)
      slow = text_of(grid%axes(1)%value(first(1) + i - 1))
      do j = 1, size(values, 2)
        call put(lines, n, slow%word(:slow%length))
        if (size(grid%axes) > 1) call put(lines, n, fast(j)%word(:fast(j)%length))
        do k = 1, size(values, 1)
          if (k == word) then
            call put(lines, n, trim(verdict_names(nint(values(k, j, i)))))
          else
            call put_number(lines, n, values(k, j, i))
            n = n + 1
            lines(n:n) = ","
          end if
        end do
        lines(n:n) = newline
      end do
    end do
    lines = lines(:n)
  end function rows

  !> The text of a parameter's value.
  pure type(text_type) function text_of(value) result(text)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: line

    allocate(character(len=number_width) :: line)
    call put_number(line, text%length, value)
    text%word = line
  end function text_of

  !> Adds a word and a comma.
  pure subroutine put(lines, n, word)
    character(len=:), allocatable, intent(inout) :: lines
    integer, intent(inout) :: n
    character(len=*), intent(in) :: word

    lines(n + 1:n + len(word)) = word
    n = n + len(word) + 1
    lines(n:n) = ","
  end subroutine put

end module gestell_task_sweep_csv
