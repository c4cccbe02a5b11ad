!> Tables of results. A column has a key, a unit, a meaning, and the key of the column with its error bounds.
module gestell_output_table
  use gestell_base_kinds, only: dp
  use gestell_output_table_unit, only: unit_type
  implicit none (type, external)
  private

  public :: new_table

  !> One column. Exactly one of `numbers`, `integers` and `words` is allocated, with a value for every row.
  type, public :: column_type
    !> `key`: name in files, with the unit; `label`: name for readers, without the unit; `meaning`: explanation
    character(len=:), allocatable :: key, label, meaning
    !> Unit of the values
    type(unit_type) :: unit
    !> Key of the column with the error bound; empty if there is none
    character(len=:), allocatable :: error
    !> Real values; NaN marks a missing value
    real(dp), allocatable :: numbers(:)
    !> Integer values; `nothing` marks a missing value
    integer, allocatable :: integers(:)
    !> All words in one text, each padded with blanks to `width`. An array would not do: gfortran loses the length of its elements.
    character(len=:), allocatable :: words
    !> Number of characters of each word
    integer, private :: width = 0
  contains
    procedure :: word
  end type column_type

  !> A table with its headings and columns.
  type, public :: table_type
    !> The files of the table are NAME.csv and, for its picture, NAME.gp.
    character(len=:), allocatable :: name
    !> `heading`: for reports and pages; `caption`: of the picture
    character(len=:), allocatable :: heading, caption
    !> `remarks`: complete lines before the header. `verdict`: verdict for the head of the file (gestell_output_report_verdict),
    !> empty if there is none. If it is unallocated, the verdict on the machine of the input is used.
    character(len=:), allocatable :: remarks, verdict
    !> Model of the frame if it differs from the model of the run; otherwise empty
    character(len=:), allocatable :: model
    !> True if the page of the report shows the rows
    logical :: shown = .false.
    !> True if the file is already written and the rows are not stored, because the table is too large
    logical :: written = .false.
    !> Number of rows
    integer :: rows = 0
    type(column_type), allocatable :: columns(:)
    !> After a call of `expect`: existing and added columns, until all expected columns are added
    type(column_type), allocatable, private :: reserved(:)
    !> Number of completed columns in `reserved`
    integer, private :: filled = 0
  contains
    procedure, private :: add_numbers
    procedure, private :: add_integers
    procedure, private :: add_words
    procedure, private :: add_flags
    procedure :: expect
    procedure :: join
    procedure :: number_of, key_of => key_of_column
    generic :: add => add_numbers, add_integers, add_words, add_flags
  end type table_type

  !> Marks a missing value in a column of integers
  integer, parameter, public :: nothing = -huge(1)

contains

  !> A table without columns.
  pure type(table_type) function new_table(name, heading, caption, verdict, shown) result(table)
    !> `name`: of the files; `heading`: for reports and pages; `caption`: of the picture
    character(len=*), intent(in) :: name, heading, caption
    !> Verdict on the machines of the table
    character(len=*), intent(in), optional :: verdict
    !> True if the page of the report shows the rows
    logical, intent(in), optional :: shown

    table%name = name
    table%heading = heading
    table%caption = caption
    if (present(verdict)) table%verdict = trim(verdict)
    if (present(shown)) table%shown = shown
    table%model = ""
    table%remarks = ""
    allocate(table%columns(0))
  end function new_table

  !> Adds a column of numbers. Error bounds are either in the column `error`, or in `bounds`, which is added as the column
  !> NAME_error.
  pure subroutine add_numbers(self, name, unit, meaning, values, error, bounds)
    class(table_type), intent(inout) :: self
    !> `name`: of the column, without its unit; `meaning`: explanation
    character(len=*), intent(in) :: name, meaning
    type(unit_type), intent(in) :: unit
    !> One value for each row
    real(dp), intent(in) :: values(:)
    !> Name, without unit, of the column with the error bounds; this column has the same unit
    character(len=*), intent(in), optional :: error
    !> Error bounds, one for each row
    real(dp), intent(in), optional :: bounds(:)
    type(column_type) :: column

    column%numbers = values
    column%error = ""
    if (present(error)) column%error = trim(new_key(error, unit))
    if (present(bounds)) column%error = trim(new_key(trim(name) // "_error", unit))
    call append(self, column, name, unit, meaning, size(values))
    if (present(bounds)) call self%add(trim(name) // "_error", unit, "bound on its error", bounds)
  end subroutine add_numbers

  !> The word in row `i`.
  pure function word(self, i)
    class(column_type), intent(in) :: self
    integer, intent(in) :: i
    character(len=:), allocatable :: word

    word = trim(self%words((i - 1) * self%width + 1:i * self%width))
  end function word

  !> Adds a column of integers.
  pure subroutine add_integers(self, name, meaning, values)
    class(table_type), intent(inout) :: self
    character(len=*), intent(in) :: name, meaning
    integer, intent(in) :: values(:)
    type(column_type) :: column

    column%integers = values
    call append(self, column, name, unit_type(), meaning, size(values))
  end subroutine add_integers

  !> Adds a column of words.
  pure subroutine add_words(self, name, meaning, values)
    class(table_type), intent(inout) :: self
    character(len=*), intent(in) :: name, meaning, values(:)
    type(column_type) :: column
    integer :: i

    allocate(character(len=len(values) * size(values)) :: column%words)
    column%width = len(values)
    do i = 1, size(values)
      column%words((i - 1) * len(values) + 1:i * len(values)) = values(i)
    end do
    call append(self, column, name, unit_type(), meaning, size(values))
  end subroutine add_words

  !> Adds a column with 1 for true and 0 for false. A value is marked as missing where `known` is false.
  pure subroutine add_flags(self, name, meaning, values, known)
    class(table_type), intent(inout) :: self
    character(len=*), intent(in) :: name, meaning
    logical, intent(in) :: values(:)
    logical, intent(in), optional :: known(:)
    integer :: flags(size(values))

    flags = merge(1, 0, values)
    if (present(known)) flags = merge(flags, nothing, known)
    call self%add(name, meaning, flags)
  end subroutine add_flags

  !> Completes the column and moves it to the end of the table.
  pure subroutine append(table, column, name, unit, meaning, rows)
    type(table_type), intent(inout) :: table
    type(column_type), intent(inout) :: column
    character(len=*), intent(in) :: name, meaning
    type(unit_type), intent(in) :: unit
    integer, intent(in) :: rows
    integer :: k

    column%key = trim(new_key(name, unit))
    column%label = trim(name)
    do k = 1, len(column%label)
      if (column%label(k:k) == "_") column%label(k:k) = " "
    end do
    column%meaning = meaning
    column%unit = unit
    if (.not. allocated(column%error)) column%error = ""
    if (.not. allocated(table%reserved)) call table%expect(1)
    table%filled = table%filled + 1
    call move_column(column, table%reserved(table%filled))
    if (table%filled == size(table%reserved)) call move_alloc(table%reserved, table%columns)
    table%rows = rows
  end subroutine append

  !> Number of the column with this name, given with or without its unit; 0 if there is none.
  pure integer function number_of(self, name) result(number)
    class(table_type), intent(in) :: self
    character(len=*), intent(in) :: name

    do number = size(self%columns), 1, -1
      associate (column => self%columns(number))
        if (column%key == name .or. column%key == new_key(name, column%unit)) return
      end associate
    end do
  end function number_of

  !> Key of the column with this name. The column must exist.
  pure function key_of_column(self, name) result(key)
    class(table_type), intent(in) :: self
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: key

    key = self%columns(self%number_of(name))%key
  end function key_of_column

  !> Prepares for `more` columns. All become visible when the last one is added. Without this call, adding a column moves all
  !> earlier columns.
  pure subroutine expect(self, more)
    class(table_type), intent(inout) :: self
    integer, intent(in) :: more
    integer :: k

    if (more < 1) return
    self%filled = size(self%columns)
    allocate(self%reserved(self%filled + more))
    do k = 1, self%filled
      call move_column(self%columns(k), self%reserved(k))
    end do
  end subroutine expect

  !> Moves the columns of `other`, which must have as many rows, to the end of the table.
  pure subroutine join(self, other)
    class(table_type), intent(inout) :: self
    type(table_type), intent(inout) :: other
    type(column_type), allocatable :: longer(:)
    integer :: k, n

    n = size(self%columns)
    allocate(longer(n + size(other%columns)))
    do k = 1, size(longer)
      if (k <= n) call move_column(self%columns(k), longer(k))
      if (k > n) call move_column(other%columns(k - n), longer(k))
    end do
    call move_alloc(longer, self%columns)
    self%rows = other%rows
  end subroutine join

  !> Moves a column without copying its values.
  pure subroutine move_column(from, to)
    type(column_type), intent(inout) :: from
    type(column_type), intent(out) :: to

    call move_alloc(from%key, to%key)
    call move_alloc(from%label, to%label)
    call move_alloc(from%meaning, to%meaning)
    call move_alloc(from%error, to%error)
    to%unit = from%unit
    to%width = from%width
    if (allocated(from%numbers)) call move_alloc(from%numbers, to%numbers)
    if (allocated(from%integers)) call move_alloc(from%integers, to%integers)
    if (allocated(from%words)) call move_alloc(from%words, to%words)
  end subroutine move_column

  !> Key of a column: its name and, if it has a unit, the suffix of the unit.
  pure function new_key(name, unit) result(key)
    character(len=*), intent(in) :: name
    type(unit_type), intent(in) :: unit
    character(len=len_trim(name) + len(unit%suffix) + 1) :: key

    key = name
    if (unit%suffix /= "") key = trim(name) // "_" // unit%suffix
  end function new_key

end module gestell_output_table
