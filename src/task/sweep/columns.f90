!> Defines the columns of a sweep's table: the parameters, the results at each point, and measures with their error bounds.
module gestell_task_sweep_columns
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: unjudged, verdict_length, verdict_numbered, verdict_type
  use gestell_base_words, only: word_length
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_scientific, only: number_width
  use gestell_output_table_unit, only: new_unit, unit_type
  use gestell_study_tile_results, only: column_records, log_rho_max, rho_error, rho_max, verdict
  use gestell_task_range_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  public :: columns_of, column_table, table_of, verdict_word

  !> A column in the table of a sweep.
  type, public :: column_type
    !> `name`: name of the column. `error`: name of the column that contains the error bound
    character(len=word_length + 16) :: name = "", error = ""
    type(unit_type) :: unit
    character(len=64) :: meaning = ""
    logical :: is_verdict = .false.
    !> Width of the column in a CSV file, in characters
    integer :: width = number_width
  end type column_type

  !> Width of a number without a sign, in characters.
  integer, parameter, public :: unsigned_width = number_width - 1

contains

  !> All columns of the table in the order in which they are written: first the parameters, then the results at a point.
  pure function columns_of(plan) result(columns)
    type(sweep_plan_type), intent(in) :: plan
    type(column_type) :: columns(size(plan%grid%axes) + plan%options%numbers())
    integer :: ordered(count(plan%options%columns)), axes, k, n

    axes = size(plan%grid%axes)
    do k = 1, axes
      columns(k)%name = plan%paths(k)
      columns(k)%unit%words = plan%units(k)
      columns(k)%meaning = "value of the parameter, in the units of the input"
      if (all(sign(1.0_dp, [plan%grid%axes(k)%from, plan%grid%axes(k)%to]) > 0)) columns(k)%width = unsigned_width
    end do
    ordered = plan%options%ordered()
    do k = 1, size(ordered)
      associate (column => columns(axes + k), record => column_records(ordered(k)))
        column%name = record%name
        column%unit%words = record%unit
        if (any(column_records(ordered)%name == record%error)) column%error = record%error
        if (.not. record%signed) column%width = unsigned_width
        select case (ordered(k))
        case (rho_max)
          column%meaning = "largest abs(rho)"
        case (log_rho_max)
          column%meaning = "natural logarithm of the largest abs(rho)"
        case (rho_error)
          column%meaning = "bound on the relative error of rho_max"
        case (verdict)
          column%meaning = "stable, undamped, undecided, unstable, impossible or failed"
          column%is_verdict = .true.
          column%width = verdict_length
        case default
          column%meaning = "peak of the vibration"
        end select
      end associate
    end do
    n = axes + size(ordered)
    do k = 1, plan%options%measured()
      associate (measure => plan%options%measures(k), value => columns(n + 2 * k - 1), error => columns(n + 2 * k))
        value%name = measure%name()
        value%meaning = measure%meaning()
        error%name = trim(value%name) // "_error"
        error%meaning = "error bound of the preceding column"
        value%error = error%name
        value%unit = new_unit(trim(measure%unit))
        error%unit = value%unit
      end associate
    end do
  end function columns_of

  !> Creates the table of the points in the order of the grid, in which the first parameter varies slowest. `values` has the shape
  !> (results per point, points of the second axis, points of the first axis). The table is in the units of the results.
  pure type(table_type) function table_of(plan, values) result(table)
    type(sweep_plan_type), intent(in) :: plan
    real(dp), intent(in) :: values(:, :, :)
    type(column_type), allocatable :: columns(:)
    real(dp) :: column(size(values, 2), size(values, 3))
    integer :: i, k

    table = new_table("sweep", "Sweep", "Results at every point of the sweep.", unjudged)
    columns = columns_of(plan)
    do k = 1, size(columns)
      associate (n => k - size(plan%grid%axes))
        if (n > 0) then
          column = values(n, :, :)
        else if (k == 1) then
          column = spread(plan%grid%axes(1)%value([(i, i = 1, size(column, 2))]), 1, size(column, 1))
        else
          column = spread(plan%grid%axes(2)%value([(i, i = 1, size(column, 1))]), 2, size(column, 2))
        end if
      end associate
      associate (c => columns(k), numbers => reshape(column, [size(column)]))
        if (c%is_verdict) call table%add(trim(c%name), trim(c%meaning), verdict_word(numbers))
        if (.not. c%is_verdict) call table%add(trim(c%name), c%unit, trim(c%meaning), numbers, error=trim(c%error))
      end associate
    end do
    call table%convert(plan%result_units)
  end function table_of

  !> Creates a table that explains the columns of `table`, with one row for each column. The file sweep.npy needs this table,
  !> because it contains no names.
  pure type(table_type) function column_table(table)
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
    column_table = new_table("sweep_columns", "Columns of the sweep", "The columns of sweep.npy.", unjudged)
    call column_table%add("column", "number of the column; the first column has the number 1", [(k, k = 1, size(table%columns))])
    call column_table%add("name", "name, as in sweep.csv", names)
    call column_table%add("unit", "unit of the numbers", units)
    call column_table%add("meaning", "meaning of the numbers", meanings)
  end function column_table

  !> Name of a verdict. `number`: the number that represents this verdict in the results of a sweep.
  elemental character(len=verdict_length) function verdict_word(number) result(word)
    real(dp), intent(in) :: number
    type(verdict_type) :: point_verdict

    point_verdict = verdict_numbered(nint(number))
    word = point_verdict%word()
  end function verdict_word

end module gestell_task_sweep_columns
