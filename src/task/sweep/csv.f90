!> The points of a sweep as a table, and the lines of sweep.csv, in pieces of any length, so that no more than a piece is ever in
!> memory.
module gestell_task_sweep_csv
  use gestell_base_kinds, only: dp
  use gestell_model_space, only: is_rotation
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_csv, only: field
  use gestell_output_table_scientific, only: number_width, put_number
  use gestell_output_table_unit, only: new_unit, plain, unit_type
  use gestell_study_grid, only: grid_type
  use gestell_study_point, only: sweep_order_type
  use gestell_study_tile_results, only: column_names, last_peak, rho_error, rho_max, sweep_columns, verdict, &
    & verdict_behind, verdict_column, verdict_names, xi_peak
  implicit none (type, external)
  private

  public :: header, rows, table_of

  character, parameter :: newline = new_line("a")

  !> A parameter's value, written once for many rows.
  type :: text_type
    character(len=number_width) :: word = ""
    integer :: length = 0
  end type text_type

contains

  !> The points in the grid's order, the first parameter slow, over the parameters `paths` in these units; `values` of shape
  !> (numbers, points of the second axis, of the first).
  pure type(table_type) function table_of(paths, units, grid, order, values) result(table)
    character(len=*), intent(in) :: paths(:), units(:)
    type(grid_type), intent(in) :: grid
    type(sweep_order_type), intent(in) :: order
    real(dp), intent(in) :: values(:, :, :)
    type(unit_type) :: unit
    integer :: i, j, k, n

    table = new_table("sweep", "Sweep", "The points of the sweep.", "")
    associate (axes => grid%axes, slow => size(values, 3), fast => size(values, 2))
      call table%add(trim(paths(1)), unit_type(words=units(1)), "in the units of the input", &
        & [((axes(1)%value(i), j = 1, fast), i = 1, slow)])
      if (size(axes) > 1) call table%add(trim(paths(2)), unit_type(words=units(2)), "in the units of the input", &
        & [((axes(2)%value(j), j = 1, fast), i = 1, slow)])
    end associate
    n = 0
    do k = 1, sweep_columns
      if (.not. order%columns(k)) cycle
      n = n + 1
      if (any(k == [verdict, verdict_behind])) then
        call table%add(trim(column_names(k)), "stable, unstable, undecided, impossible or failed", verdict_names(nint(column(n))))
      else
        unit = plain
        if (k >= xi_peak .and. k <= last_peak) unit = unit_type(words=merge("rad", "m  ", is_rotation(k - xi_peak + 1)))
        call table%add(trim(column_names(k)), unit, "of the machine at the point", column(n), &
          & error=trim(merge("rho_error", "         ", k == rho_max .and. order%columns(rho_error))))
      end if
    end do
    do k = 1, order%measured()
      associate (measure => order%measures(k))
        unit = new_unit(trim(measure%unit))
        call table%add(trim(measure%name()), unit, trim(measure%meaning()), column(n + 1), error=trim(measure%name()) // "_error")
        call table%add(trim(measure%name()) // "_error", unit, "bound on its error", column(n + 2))
      end associate
      n = n + 2
    end do

  contains

    !> Number `n` of all points.
    pure function column(n)
      integer, intent(in) :: n
      real(dp) :: column(size(values(1, :, :)))

      column = reshape(values(n, :, :), [size(column)])
    end function column

  end function table_of

  !> The names of the columns.
  pure function header(paths, units, grid, order) result(line)
    character(len=*), intent(in) :: paths(:), units(:)
    type(grid_type), intent(in) :: grid
    type(sweep_order_type), intent(in) :: order
    character(len=:), allocatable :: line
    type(table_type) :: table
    real(dp) :: none(order%numbers(), 0, 0)
    integer :: i

    table = table_of(paths, units, grid, order, none)
    line = field(table%columns(1)%key)
    do i = 2, size(table%columns)
      line = line // "," // field(table%columns(i)%key)
    end do
  end function header

  !> The lines of points, values of shape (numbers, points of the second axis, points of the first), of which the
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
