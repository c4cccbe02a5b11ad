!> Formats the lines of sweep.csv. The lines are written in pieces of any length, so that only one piece is in memory. All lines
!> have the same width, because numbers are padded on the left. If a verdict is short, the number before it is padded instead,
!> because programs that read CSV keep the blanks in words.
module gestell_task_sweep_csv
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: newline
  use gestell_base_verdict, only: verdict_length, verdict_named, verdict_type
  use gestell_output_table, only: table_type
  use gestell_output_table_csv, only: field
  use gestell_output_table_scientific, only: number_width, put_number
  use gestell_study_grid, only: grid_type
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_columns, only: column_type, table_of, unsigned_width, verdict_word
  implicit none (type, external)
  private

  public :: csv_rows, csv_values, header

  !> Text of a field and its length. The text is a verdict, or the value of a parameter, which is formatted once for many rows.
  type :: field_type
    character(len=number_width) :: word = ""
    integer :: length = 0
  end type field_type

contains

  !> The line with the names of the columns.
  pure function header(plan) result(line)
    type(sweep_plan_type), intent(in) :: plan
    character(len=:), allocatable :: line
    type(table_type) :: table
    real(dp) :: no_values(plan%options%numbers(), 0, 0)
    integer :: k

    table = table_of(plan, no_values)
    line = field(table%columns(1)%key)
    do k = 2, size(table%columns)
      line = line // "," // field(table%columns(k)%key)
    end do
  end function header

  !> The lines of a block of points that begins at the indices `first` on the axes. `values` has the shape (results per point,
  !> points of the second axis, points of the first axis).
  pure function csv_rows(grid, columns, first, values) result(lines)
    type(grid_type), intent(in) :: grid
    type(column_type), intent(in) :: columns(:)
    !> Indices of the first point on both axes
    integer, intent(in) :: first(2)
    !> Results, shape (results per point, points of the second axis, points of the first axis)
    real(dp), contiguous, intent(in) :: values(:, :, :)
    character(len=:), allocatable :: lines
    type(field_type) :: parameters(2), fast(size(values, 2)), point_verdict
    integer :: widths(size(columns)), i, j, k, n, axes, verdict, width

    axes = size(grid%axes)
    widths = columns%width
    verdict = findloc(columns%is_verdict, .true., dim=1)
    allocate(character(len=size(values, 3) * size(values, 2) * (sum(widths) + size(columns))) :: lines)
    if (axes > 1) fast = [(parameter_field(grid%axes(2)%value(first(2) + j - 1)), j = 1, size(fast))]
    n = 0
    do i = 1, size(values, 3)
      parameters(1) = parameter_field(grid%axes(1)%value(first(1) + i - 1))
      do j = 1, size(values, 2)
        parameters(2) = fast(j)
        if (verdict > 0) point_verdict%word = verdict_word(values(verdict - axes, j, i))
        point_verdict%length = len_trim(point_verdict%word)
        do k = 1, size(columns)
          width = widths(k)
          if (k + 1 == verdict) width = width + verdict_length - point_verdict%length
          if (k == verdict) then
            call put(lines, n, point_verdict, 0)
          else if (k <= axes) then
            call put(lines, n, parameters(k), width)
          else
            call put_number_right(lines, n, values(k - axes, j, i), width)
          end if
        end do
        lines(n:n) = newline
      end do
    end do
  end function csv_rows

  !> Reads the numbers that follow the parameters in a line of the file.
  pure subroutine csv_values(line, columns, values)
    character(len=*), intent(in) :: line
    type(column_type), intent(in) :: columns(:)
    real(dp), intent(out) :: values(:)
    type(verdict_type) :: point_verdict
    integer :: begin, k, length, n

    begin = 1
    do k = 1, size(columns)
      length = scan(line(begin:), "," // newline) - 1
      n = k - (size(columns) - size(values))
      if (columns(k)%is_verdict) then
        point_verdict = verdict_named(line(begin:begin + length - 1))
        values(n) = point_verdict%number()
      else if (n > 0) then
        read (line(begin:begin + length - 1), *) values(n)
      end if
      begin = begin + length + 1
    end do
  end subroutine csv_values

  !> Text of the value of a parameter.
  pure type(field_type) function parameter_field(value) result(text)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: line

    allocate(character(len=number_width) :: line)
    call put_number(line, text%length, value)
    text%word = line
  end function parameter_field

  !> Appends the word `text` to `lines`, right-aligned in `width` characters, and a comma. `n`: length of the text so far.
  pure subroutine put(lines, n, text, width)
    character(len=:), allocatable, intent(inout) :: lines
    integer, intent(inout) :: n
    type(field_type), intent(in) :: text
    integer, intent(in) :: width
    integer :: blanks

    blanks = max(0, width - text%length)
    lines(n + 1:n + blanks) = ""
    n = n + blanks + text%length + 1
    lines(n - text%length:n - 1) = text%word(:text%length)
    lines(n:n) = ","
  end subroutine put

  !> Appends a number to `lines`, right-aligned in `width` characters, and a comma. `n`: length of the text so far.
  pure subroutine put_number_right(lines, n, value, width)
    character(len=:), allocatable, intent(inout) :: lines
    integer, intent(inout) :: n
    real(dp), intent(in) :: value
    integer, intent(in) :: width
    integer :: begin, last

    ! Nearly all numbers have this many characters, so that they can be written directly to their final position.
    begin = max(n, n + width - merge(number_width, unsigned_width, sign(1.0_dp, value) < 0))
    last = begin
    call put_number(lines, last, value)
    lines(n + 1:begin) = ""
    if (last < n + width) lines(n + 1:n + width) = adjustr(lines(n + 1:last) // repeat(" ", n + width - last))
    n = n + width + 1
    lines(n:n) = ","
  end subroutine put_number_right

end module gestell_task_sweep_csv
