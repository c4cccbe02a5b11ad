!> C interface for the tables of a solution (include/gestell.h): returns their names, columns and values.
module gestell_api_c_tables
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_text, only: text
  use gestell_api_c_handle, only: code_of, return_count, return_numbers, return_text, report_null_pointer, report_wrong_size
  use gestell_api_c_solution, only: find_solution, find_solution_and_name
  use gestell_api_solution, only: solution_type
  use gestell_output_table, only: column_type, table_type
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_null_char, c_ptr
  implicit none (type, external)
  private

  public :: count_tables, describe_column, get_integers, get_numbers, get_words, name_table, shape_table

  !> Codes that tell C the kind of a column's values: real numbers, integers or words.
  integer, parameter :: numbers_kind = 0, integers_kind = 1, words_kind = 2

contains

  !> Counts the tables.
  integer(c_int) function count_tables(handle, count, failure) result(code) bind(c, name="gestell_count_tables")
    type(c_ptr), value :: handle, failure
    integer(c_int), intent(out), optional :: count
    type(solution_type), pointer :: solution
    type(error_type), allocatable :: error
    integer :: table_count

    table_count = 0
    call find_solution(handle, solution, error)
    if (.not. allocated(error)) table_count = size(solution%result%tables)
    call return_count(table_count, error, count)
    code = code_of(error, failure)
  end function count_tables

  !> Copies the name of the table with this index to `name`. Indices start at 0.
  integer(c_int) function name_table(handle, index, size, name, failure) result(code) bind(c, name="gestell_name_table")
    type(c_ptr), value :: handle, name, failure
    integer(c_int), value :: index, size
    type(solution_type), pointer :: solution
    integer(c_int) :: count
    type(error_type), allocatable :: error

    code = count_tables(handle, count, failure)
    if (code /= 0) return
    call c_f_pointer(handle, solution)
    if (index < 0 .or. index >= count) then
      call fatal_error(error, "the index of the table must lie between 0 and " // text(int(count) - 1), wrong_usage)
    else
      call return_text(solution%result%tables(index + 1)%name, size, name, error)
    end if
    code = code_of(error, failure)
  end function name_table

  !> Returns the numbers of rows and of columns of the table called `name`.
  integer(c_int) function shape_table(handle, name, rows, columns, failure) result(code) bind(c, name="gestell_shape_table")
    type(c_ptr), value :: handle, name, failure
    integer(c_int), intent(out), optional :: rows, columns
    type(table_type), pointer :: table
    type(error_type), allocatable :: error
    integer :: shape(2)

    shape = 0
    call find_table(handle, name, table, error)
    if (.not. allocated(error)) shape = [table%rows, size(table%columns)]
    call return_count(shape(1), error, rows)
    call return_count(shape(2), error, columns)
    code = code_of(error, failure)
  end function shape_table

  !> Describes the column with this index; indices start at 0. Copies three texts, for which C provides `size` characters each:
  !> the column's `key`, its `unit`, and the key `error_key` of the column with its error bounds. Returns in `kind` the kind of
  !> the column's values and in `width` the length of its longest word.
  integer(c_int) function describe_column(handle, name, index, size, key, unit, error_key, kind, width, failure) result(code) &
    & bind(c, name="gestell_describe_column")
    type(c_ptr), value :: handle, name, key, unit, error_key, failure
    integer(c_int), value :: index, size
    integer(c_int), intent(out), optional :: kind, width
    type(column_type), pointer :: column
    type(error_type), allocatable :: error
    integer :: rows, holds, longest

    holds = numbers_kind
    longest = 0
    call find_column(handle, name, index, column, rows, error)
    if (.not. allocated(error)) then
      if (allocated(column%integers)) holds = integers_kind
      if (allocated(column%words)) then
        holds = words_kind
        longest = longest_word(column, rows)
      end if
      call return_text(column%key, size, key, error)
      if (.not. allocated(error)) call return_text(trim(column%unit%words), size, unit, error)
      if (.not. allocated(error)) call return_text(column%error, size, error_key, error)
    end if
    call return_count(holds, error, kind)
    call return_count(longest, error, width)
    code = code_of(error, failure)
  end function describe_column

  !> Copies the real numbers of a column to `values`, which must have `rows` elements.
  integer(c_int) function get_numbers(handle, name, index, rows, values, failure) result(code) bind(c, name="gestell_get_numbers")
    type(c_ptr), value :: handle, name, values, failure
    integer(c_int), value :: index, rows
    type(column_type), pointer :: column
    type(error_type), allocatable :: error

    call find_values(handle, name, index, rows, values, numbers_kind, column, error)
    if (.not. allocated(error)) call return_numbers(column%numbers(:rows), values)
    code = code_of(error, failure)
  end function get_numbers

  !> Copies the integers of a column to `values`, which must have `rows` elements. The value -huge marks a missing integer.
  integer(c_int) function get_integers(handle, name, index, rows, values, failure) result(code) bind(c, name="gestell_get_integers")
    type(c_ptr), value :: handle, name, values, failure
    integer(c_int), value :: index, rows
    integer(c_int), pointer :: place(:)
    type(column_type), pointer :: column
    type(error_type), allocatable :: error

    call find_values(handle, name, index, rows, values, integers_kind, column, error)
    if (.not. allocated(error)) then
      call c_f_pointer(values, place, [rows])
      place = column%integers
    end if
    code = code_of(error, failure)
  end function get_integers

  !> Copies the words of a column to `values`, which must have room for `rows` words of `width` characters. Shorter words are padded
  !> with zeros. Fails if a word is longer than `width`.
  integer(c_int) function get_words(handle, name, index, rows, width, values, failure) result(code) &
    & bind(c, name="gestell_get_words")
    type(c_ptr), value :: handle, name, values, failure
    integer(c_int), value :: index, rows, width
    character(kind=c_char), pointer :: place(:, :)
    type(column_type), pointer :: column
    type(error_type), allocatable :: error
    character(len=:), allocatable :: word
    integer :: i, k, longest

    call find_values(handle, name, index, rows, values, words_kind, column, error)
    if (.not. allocated(error)) then
      longest = longest_word(column, int(rows))
      if (width < longest) call report_wrong_size("the array for a word", int(width), longest, error)
    end if
    if (.not. allocated(error)) then
      call c_f_pointer(values, place, [width, rows])
      place = c_null_char
      do i = 1, rows
        word = column%word(i)
        do k = 1, min(int(width), len(word))
          place(k, i) = word(k:k)
        end do
      end do
    end if
    code = code_of(error, failure)
  end function get_words

  !> Number of characters of the longest word in the first `rows` rows of a column; at least 1.
  integer function longest_word(column, rows) result(longest)
    type(column_type), intent(in) :: column
    integer, intent(in) :: rows
    integer :: i

    longest = 1
    do i = 1, rows
      longest = max(longest, len(column%word(i)))
    end do
  end function longest_word

  !> Finds the column with this index and checks that its values are of this `kind`. Fails if the column does not exist or holds
  !> values of another kind. Also fails if the pointer `values` is null or the table does not have this number of rows.
  subroutine find_values(handle, name, index, rows, values, kind, column, error)
    type(c_ptr), intent(in) :: handle, name, values
    integer(c_int), intent(in) :: index, rows
    integer, intent(in) :: kind
    type(column_type), pointer, intent(out) :: column
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: kinds(0:2) = [character(len=8) :: "numbers", "integers", "words"]
    logical :: holds(0:2)
    integer :: row_count

    call find_column(handle, name, index, column, row_count, error)
    if (allocated(error)) return
    holds = [allocated(column%numbers), allocated(column%integers), allocated(column%words)]
    if (.not. c_associated(values)) then
      call report_null_pointer("the array for the column", error)
    else if (rows /= row_count) then
      call report_wrong_size("the array for the column", int(rows), row_count, error)
    else if (.not. holds(kind)) then
      call fatal_error(error, "the column does not contain " // trim(kinds(kind)), wrong_usage)
    end if
  end subroutine find_values

  !> Returns the column with this index, and the number of rows of its table. Indices start at 0. Fails if the column does not
  !> exist.
  subroutine find_column(handle, name, index, column, rows, error)
    type(c_ptr), intent(in) :: handle, name
    integer(c_int), intent(in) :: index
    type(column_type), pointer, intent(out) :: column
    integer, intent(out) :: rows
    type(error_type), allocatable, intent(out) :: error
    type(table_type), pointer :: table

    nullify(column)
    rows = 0
    call find_table(handle, name, table, error)
    if (allocated(error)) return
    if (index < 0 .or. index >= size(table%columns)) then
      call fatal_error(error, "the index of the column must lie between 0 and " // text(size(table%columns) - 1), wrong_usage)
      return
    end if
    column => table%columns(index + 1)
    rows = table%rows
  end subroutine find_column

  !> Returns the table whose name is the C text at `pointer`. Fails if the table does not exist.
  subroutine find_table(handle, pointer, table, error)
    type(c_ptr), intent(in) :: handle, pointer
    type(table_type), pointer, intent(out) :: table
    type(error_type), allocatable, intent(out) :: error
    type(solution_type), pointer :: solution
    character(len=:), allocatable :: name
    integer :: i

    nullify(table)
    call find_solution_and_name(handle, pointer, "the name of the table", solution, name, error)
    if (allocated(error)) return
    call solution%find_table(name, i, error)
    if (.not. allocated(error)) table => solution%result%tables(i)
  end subroutine find_table

end module gestell_api_c_tables
