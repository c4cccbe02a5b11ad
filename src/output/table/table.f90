!> Defines tables of results. Each column has a key, a unit, a meaning and, if there is one, the key of the column with its error
!> bounds.
module gestell_output_table
  use gestell_base_kinds, only: dp
  use gestell_output_table_unit, only: unit_type
  implicit none (type, external)
  private

  public :: new_table

  !> One column of a table. One of `numbers`, `integers` and `words` is allocated; it contains a value for every row.
  type, public :: column_type
    !> `key`: name of the column in files, including the unit. `label`: name for readers, without the unit. `meaning`: explanation
    character(len=:), allocatable :: key, label, meaning
    !> Unit of the values
    type(unit_type) :: unit
    !> Key of the column with the error bounds; empty if there is no such column
    character(len=:), allocatable :: error
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
    !> `remarks`: lines that precede the keys of the columns in the file. `verdict`: verdict that the head of the file states; empty
    !> if it states none. If unallocated, the verdict on the machine of the input is stated
    character(len=:), allocatable :: remarks, verdict
    !> Model of the frame, if the table uses another model than the run; otherwise empty
    character(len=:), allocatable :: model
    !> True if the HTML page shows the rows of the table
    logical :: shown = .false.
    !> True if the table is so large that it has been written already and its rows are not stored
    logical :: written = .false.
    !> Number of rows
    integer :: rows = 0
    type(column_type), allocatable :: columns(:)
    !> After a call of `expect`: the existing columns and those added since then, until all expected columns have been added
    type(column_type), allocatable, private :: reserved(:)
    !> Number of columns in `reserved` that are complete
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

  !> Value that marks a missing integer in a column of integers
  integer, parameter, public :: nothing = -huge(1)

contains

  !> A table without columns.
  pure type(table_type) function new_table(name, heading, caption, verdict, shown) result(table)
    !> `name`: name of the table and its files. `heading`: heading in reports and pages. `caption`: caption of the picture
    character(len=*), intent(in) :: name, heading, caption
    !> Verdict on the machines that the table describes
    character(len=*), intent(in), optional :: verdict
    !> True if the HTML page is to show the rows
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

  !> Adds a column of real numbers. Error bounds are given in one of two ways: `error` names the column that contains them, or
  !> `bounds` contains them and is added as the column NAME_error.
  pure subroutine add_numbers(self, name, unit, meaning, values, error, bounds)
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
    type(column_type) :: column

    column%numbers = values
    column%error = ""
    if (present(error)) column%error = trim(new_key(error, unit))
    if (present(bounds)) column%error = trim(new_key(trim(name) // "_error", unit))
    call append(self, column, name, unit, meaning, size(values))
    if (present(bounds)) call self%add(trim(name) // "_error", unit, "bound on its error", bounds)
  end subroutine add_numbers

  !> Word of this column in row `i`.
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

  !> Adds a column of integers that are 1 for true and 0 for false. Where `known` is false, the value is marked as missing.
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

  !> Sets key, unit and meaning of a column and moves it to the end of the table.
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

  !> Index of the column with this name, which may be given with or without the unit; 0 if there is no such column.
  pure integer function number_of(self, name) result(number)
    class(table_type), intent(in) :: self
    character(len=*), intent(in) :: name

    do number = size(self%columns), 1, -1
      associate (column => self%columns(number))
        if (column%key == name .or. column%key == new_key(name, column%unit)) return
      end associate
    end do
  end function number_of

  !> Key of the column called `name`, which must exist.
  pure function key_of_column(self, name) result(key)
    class(table_type), intent(in) :: self
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: key

    key = self%columns(self%number_of(name))%key
  end function key_of_column

  !> Announces that `more` columns will be added. They become visible when the last of them is added. Without this call, all earlier
  !> columns are moved in memory whenever a column is added.
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

  !> Moves all columns of the table `other`, which must have the same number of rows, to the end of this table.
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

  !> Moves a column from one variable to another without copying its values.
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

  !> Key of a column: its name, followed by the suffix of its unit if it has a unit.
  pure function new_key(name, unit) result(key)
    character(len=*), intent(in) :: name
    type(unit_type), intent(in) :: unit
    character(len=len_trim(name) + len(unit%suffix) + 1) :: key

    key = name
    if (unit%suffix /= "") key = trim(name) // "_" // unit%suffix
  end function new_key

end module gestell_output_table
