!> The points of a sweep as a table, and the lines of sweep.csv, in pieces of any length, so that no more than a piece is ever in
!> memory.
module gestell_task_sweep_csv
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: verdict_length, verdict_named, verdict_numbered, verdict_type
  use gestell_base_words, only: word_length
  use gestell_model_space, only: is_rotation
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_csv, only: field
  use gestell_output_table_scientific, only: number_width, put_number
  use gestell_output_table_unit, only: new_unit, plain, unit_type
  use gestell_study_grid, only: axis_type, grid_type
  use gestell_study_point, only: sweep_options
  use gestell_study_tile_results, only: column_names, last_peak, log_rho_max, rho_error, rho_max, sweep_columns, verdict, &
    & verdict_behind, verdict_column, xi_peak
  implicit none (type, external)
  private

  public :: csv_rows, csv_values, csv_width, columns_of, header, table_of

  character, parameter :: newline = new_line("a")

  !> Characters of a number without a sign.
  integer, parameter :: unsigned_width = number_width - 1

  !> A parameter's value, written once for many rows.
  type :: text_type
    character(len=number_width) :: word = ""
    integer :: length = 0
  end type text_type

contains

  !> The points in the grid's order, the first parameter slow, over the parameters `paths` in these units; `values` of shape
  !> (numbers, points of the second axis, of the first).
  pure type(table_type) function table_of(paths, units, grid, options, values) result(table)
    character(len=*), intent(in) :: paths(:), units(:)
    type(grid_type), intent(in) :: grid
    type(sweep_options), intent(in) :: options
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
      if (.not. options%columns(k)) cycle
      n = n + 1
      if (any(k == [verdict, verdict_behind])) then
        call table%add(trim(column_names(k)), "stable, undamped, undecided, unstable, impossible or failed", &
          & words_of(column(n)))
      else
        unit = plain
        if (k >= xi_peak .and. k <= last_peak) unit = unit_type(words=merge("rad", "m  ", is_rotation(k - xi_peak + 1)))
        call table%add(trim(column_names(k)), unit, "of the machine at the point", column(n), &
          & error=trim(merge("rho_error", "         ", k == rho_max .and. options%columns(rho_error))))
      end if
    end do
    do k = 1, options%measured()
      associate (measure => options%measures(k))
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

  !> What the columns of a table without names mean, one row each.
  pure type(table_type) function columns_of(table)
    type(table_type), intent(in) :: table
    character(len=word_length + 16) :: names(size(table%columns))
    character(len=100) :: meanings(size(table%columns))
    character(len=16) :: units(size(table%columns))
    integer :: k

    do k = 1, size(table%columns)
      names(k) = table%columns(k)%key
      units(k) = table%columns(k)%unit%words
      meanings(k) = table%columns(k)%meaning
      if (allocated(table%columns(k)%words)) meanings(k) = "0 stable, 1 unstable, 2 undecided, 3 impossible, 4 failed, 5 undamped"
    end do
    columns_of = new_table("sweep_columns", "Columns of the sweep", "The columns of sweep.npy.", "")
    call columns_of%add("column", "from 1", [(k, k = 1, size(table%columns))])
    call columns_of%add("name", "as in sweep.csv", names)
    call columns_of%add("unit", "of the numbers", units)
    call columns_of%add("meaning", "of the numbers", meanings)
  end function columns_of

  !> The names of the columns.
  pure function header(paths, units, grid, options) result(line)
    character(len=*), intent(in) :: paths(:), units(:)
    type(grid_type), intent(in) :: grid
    type(sweep_options), intent(in) :: options
    character(len=:), allocatable :: line
    type(table_type) :: table
    real(dp) :: none(options%numbers(), 0, 0)
    integer :: i

    table = table_of(paths, units, grid, options, none)
    line = field(table%columns(1)%key)
    do i = 2, size(table%columns)
      line = line // "," // field(table%columns(i)%key)
    end do
  end function header

  !> Characters that a parameter takes, whatever its value on the axis.
  pure integer function width_of(axis)
    type(axis_type), intent(in) :: axis

    width_of = number_width
    if (all(sign(1.0_dp, [axis%from, axis%to]) > 0)) width_of = unsigned_width
  end function width_of

  !> Characters that number `k` behind the parameters takes: moduli and their errors have no sign.
  pure integer function width_of_number(columns, k)
    logical, intent(in) :: columns(sweep_columns)
    integer, intent(in) :: k

    width_of_number = unsigned_width
    if (k > count(columns) .or. columns(log_rho_max) .and. k == count(columns(:log_rho_max))) width_of_number = number_width
  end function width_of_number

  !> Characters of a row with its end.
  pure integer function csv_width(grid, options) result(width)
    type(grid_type), intent(in) :: grid
    type(sweep_options), intent(in) :: options
    integer :: k

    width = size(grid%axes) + options%numbers()
    do k = 1, size(grid%axes)
      width = width + width_of(grid%axes(k))
    end do
    do k = 1, options%numbers()
      if (k == verdict_column(options%columns)) then
        width = width + verdict_length
      else
        width = width + width_of_number(options%columns, k)
      end if
    end do
  end function csv_width

  !> The lines of points, values of shape (numbers, points of the second axis, points of the first), of which the
  !> first is point `first` on the axes. All have the same width, by blanks before numbers: those that a verdict lacks stand before
  !> the number ahead of it, for readers of such files keep the blanks of words.
  pure function csv_rows(grid, columns, width, first, values) result(lines)
    type(grid_type), intent(in) :: grid
    logical, intent(in) :: columns(sweep_columns)
    integer, intent(in) :: width, first(2)
    real(dp), contiguous, intent(in) :: values(:, :, :)
    character(len=:), allocatable :: lines
    type(text_type) :: fast(size(values, 2)), slow
    integer :: i, j, k, n, word, axes
    integer :: room(0:size(values, 1))

    axes = size(grid%axes)
    word = verdict_column(columns)
    room = [width_of(grid%axes(axes)), (width_of_number(columns, k), k = 1, size(values, 1))]
    allocate(character(len=size(values, 3) * size(values, 2) * width) :: lines)
    if (axes > 1) fast = [(text_of(grid%axes(2)%value(first(2) + j - 1)), j = 1, size(fast))]
    n = 0
    do i = 1, size(values, 3)
      slow = text_of(grid%axes(1)%value(first(1) + i - 1))
      do j = 1, size(values, 2)
        if (axes > 1) then
          call put(lines, n, slow, width_of(grid%axes(1)))
          call put(lines, n, fast(j), room(0) + lacking(0))
        else
          call put(lines, n, slow, room(0) + lacking(0))
        end if
        do k = 1, size(values, 1)
          if (k == word) then
            call put(lines, n, text_type(words_of(values(k, j, i)), len_trim(words_of(values(k, j, i)))), 0)
          else
            call put_right(lines, n, values(k, j, i), room(k) + lacking(k))
          end if
        end do
        lines(n:n) = newline
      end do
    end do

  contains

    !> Characters that the verdict behind number `k` has less than the longest.
    pure integer function lacking(k)
      integer, intent(in) :: k

      lacking = 0
      if (k + 1 == word) lacking = verdict_length - len_trim(words_of(values(word, j, i)))
    end function lacking

  end function csv_rows

  !> The numbers of a line behind its first `axes`.
  pure subroutine csv_values(line, axes, columns, values)
    character(len=*), intent(in) :: line
    integer, intent(in) :: axes
    logical, intent(in) :: columns(sweep_columns)
    real(dp), intent(out) :: values(:)
    type(verdict_type) :: judged
    integer :: begin, k, length

    begin = 1
    do k = 1 - axes, size(values)
      length = scan(line(begin:), "," // newline) - 1
      if (k > 0 .and. k == verdict_column(columns)) then
        judged = verdict_named(line(begin:begin + length - 1))
        values(k) = judged%number()
      else if (k > 0) then
        read (line(begin:begin + length - 1), *) values(k)
      end if
      begin = begin + length + 1
    end do
  end subroutine csv_values

  !> The word of a verdict that stands among the numbers of a sweep.
  elemental character(len=verdict_length) function words_of(number) result(words)
    real(dp), intent(in) :: number
    type(verdict_type) :: judged

    judged = verdict_numbered(nint(number))
    words = judged%word()
  end function words_of

  !> The text of a parameter's value.
  pure type(text_type) function text_of(value) result(text)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: line

    allocate(character(len=number_width) :: line)
    call put_number(line, text%length, value)
    text%word = line
  end function text_of

  !> Adds a word on the right of `width` characters, and a comma.
  pure subroutine put(lines, n, text, width)
    character(len=:), allocatable, intent(inout) :: lines
    integer, intent(inout) :: n
    type(text_type), intent(in) :: text
    integer, intent(in) :: width
    integer :: blanks

    blanks = max(0, width - text%length)
    lines(n + 1:n + blanks) = ""
    n = n + blanks + text%length + 1
    lines(n - text%length:n - 1) = text%word(:text%length)
    lines(n:n) = ","
  end subroutine put

  !> The same of a number.
  pure subroutine put_right(lines, n, value, width)
    character(len=:), allocatable, intent(inout) :: lines
    integer, intent(inout) :: n
    real(dp), intent(in) :: value
    integer, intent(in) :: width
    integer :: begin, last

    ! nearly all numbers take these characters: they are written where they stay
    begin = max(n, n + width - merge(number_width, unsigned_width, sign(1.0_dp, value) < 0))
    last = begin
    call put_number(lines, last, value)
    lines(n + 1:begin) = ""
    if (last < n + width) lines(n + 1:n + width) = adjustr(lines(n + 1:last) // repeat(" ", n + width - last))
    n = n + width + 1
    lines(n:n) = ","
  end subroutine put_right

end module gestell_task_sweep_csv
