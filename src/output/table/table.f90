!> Defines tables of results. Each column has a key, a unit, a meaning and, if there is one, the key of the column with its error
!> bounds.
module gestell_output_table
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: judgement_type
  use gestell_output_table_result_units, only: result_units_type
  use gestell_output_table_unit, only: unit_type
  implicit none (type, external)
  private

  public :: new_table

  !> One column of a table. One of `numbers`, `integers` and `words` is allocated; it contains a value for every row.
  type, public :: column_type
    !> `key`: name of the column in files, including the unit. `label`: name for readers, without the unit. `meaning`: explanation
    character(len=:), allocatable :: key, label, meaning
    !> Key with the SI unit, if the values have been converted to another unit; otherwise empty
    character(len=:), allocatable :: si_key
    !> Unit of the values
    type(unit_type) :: unit
    !> Key of the column with the error bounds; empty if there is no such column
    character(len=:), allocatable :: error
    !> True if pages show the column only when the reader requests all columns
    logical :: is_detail = .false.
    !> True if the integers are 1 for true and 0 for false
    logical :: is_flag = .false.
    !> Real values; NaN marks a missing value
    real(dp), allocatable :: numbers(:)
    !> Integer values; `nothing` marks a missing value
    integer, allocatable :: integers(:)
    !> All words one after the other in one text, each padded with blanks to `width` characters. An array of words is not used,
    !> because gfortran loses the length of its elements.
    character(len=:), allocatable :: words
    !> Number of characters of each word in `words`
    integer, private :: width = 0
  contains
    procedure :: word
  end type column_type

  !> A table with its headings and columns.
  type, public :: table_type
    !> Name of the table. Its files are NAME.csv and, if it has a picture, NAME.gp
    character(len=:), allocatable :: name
    !> `heading`: heading of the table in reports and pages. `caption`: caption of its picture
    character(len=:), allocatable :: heading, caption
    !> Lines that precede the keys of the columns in the file
    character(len=:), allocatable :: remarks
    !> Verdict that the head of the file states. If it is unallocated, the head states the verdict on the machine of the input
    type(judgement_type), allocatable :: verdict
    !> Model of the frame, if the table uses another model than the run; otherwise empty
    character(len=:), allocatable :: model
    !> Units to which the values have been converted
    type(result_units_type) :: units
    !> True if the values are always in SI units
    logical :: always_si = .false.
    !> True if the HTML page shows the rows of the table
    logical :: shown = .false.
    !> True if the table is so large that it has been written already and its rows are not stored
    logical :: written = .false.
    !> Number of rows
    integer :: rows = 0
    type(column_type), allocatable :: columns(:)
    !> Columns of the table, existing and added, from a call of `expect` until the last expected column has been added; otherwise
    !> unallocated
    type(column_type), allocatable, private :: reserved(:)
    !> Number of columns in `reserved` that are complete
    integer, private :: filled = 0
  contains
    procedure, private :: add_numbers, add_integers, add_words, add_flags
    procedure :: convert, expect, join, mark_details, number_of, key_of => key_of_column
    generic :: add => add_numbers, add_integers, add_words, add_flags
  end type table_type

  !> Value that marks a missing integer in a column of integers
  integer, parameter, public :: nothing = -huge(1)

  interface
    !> A table without columns.
    pure module type(table_type) function new_table(name, heading, caption, verdict, shown) result(table)
      implicit none (type, external)
      !> `name`: name of the table and its files. `heading`: heading in reports and pages. `caption`: caption of the picture
      character(len=*), intent(in) :: name, heading, caption
      !> Verdict on the machines that the table describes; `unjudged` if there is none
      type(judgement_type), intent(in), optional :: verdict
      !> True if the HTML page is to show the rows
      logical, intent(in), optional :: shown
    end function new_table

    !> Adds a column of real numbers. Error bounds are given in one of two ways: `error` names the column that contains them, or
    !> `bounds` contains them and is added as the column NAME_error.
    pure module subroutine add_numbers(self, name, unit, meaning, values, error, bounds)
      implicit none (type, external)
      class(table_type), intent(inout) :: self
      !> `name`: name of the column, without the unit. `meaning`: explanation of the column
      character(len=*), intent(in) :: name, meaning
      type(unit_type), intent(in) :: unit
      !> One value for each row
      real(dp), intent(in) :: values(:)
      !> Name of the column with the error bounds, without the unit; this column has the same unit
      character(len=*), intent(in), optional :: error
      !> Error bound for each row
      real(dp), intent(in), optional :: bounds(:)
    end subroutine add_numbers

    !> Word of this column in row `i`.
    pure module function word(self, i)
      implicit none (type, external)
      class(column_type), intent(in) :: self
      integer, intent(in) :: i
      character(len=len_trim(self%words((i - 1) * self%width + 1:i * self%width))) :: word
    end function word

    !> Adds a column of integers.
    pure module subroutine add_integers(self, name, meaning, values)
      implicit none (type, external)
      class(table_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      integer, intent(in) :: values(:)
    end subroutine add_integers

    !> Adds a column of words.
    pure module subroutine add_words(self, name, meaning, values)
      implicit none (type, external)
      class(table_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning, values(:)
    end subroutine add_words

    !> Adds a column of integers that are 1 for true and 0 for false. Where `known` is false, the value is marked as missing.
    pure module subroutine add_flags(self, name, meaning, values, known)
      implicit none (type, external)
      class(table_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      logical, intent(in) :: values(:)
      logical, intent(in), optional :: known(:)
    end subroutine add_flags

    !> Converts the values to `units`, and the keys of the columns. Does nothing if they have already been converted.
    pure module subroutine convert(self, units)
      implicit none (type, external)
      class(table_type), intent(inout) :: self
      type(result_units_type), intent(in) :: units
    end subroutine convert

    !> Index of the column with this name, which may be given with or without the unit, and also with the SI unit of converted
    !> values; 0 if there is no such column.
    pure module integer function number_of(self, name) result(number)
      implicit none (type, external)
      class(table_type), intent(in) :: self
      character(len=*), intent(in) :: name
    end function number_of

    !> Key of the column called `name`, which must exist.
    pure module function key_of_column(self, name) result(key)
      implicit none (type, external)
      class(table_type), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: key
    end function key_of_column

    !> Marks the columns whose name contains one of `words` as details, which pages show only when the reader requests all columns.
    pure module subroutine mark_details(self, words)
      implicit none (type, external)
      class(table_type), intent(inout) :: self
      !> Parts of names between underscores: "rms" or "peak_crank", not "pea"
      character(len=*), intent(in) :: words(:)
    end subroutine mark_details

    !> Announces that `more` columns will be added. They become visible when the last of them is added. Without this call, all
    !> earlier columns are moved in memory whenever a column is added.
    pure module subroutine expect(self, more)
      implicit none (type, external)
      class(table_type), intent(inout) :: self
      integer, intent(in) :: more
    end subroutine expect

    !> Moves all columns of the table `other`, which must have the same number of rows, to the end of this table.
    pure module subroutine join(self, other)
      implicit none (type, external)
      class(table_type), intent(inout) :: self
      type(table_type), intent(inout) :: other
    end subroutine join
  end interface

end module gestell_output_table
