!> Adds columns to a table and finds them. These procedures form a submodule, so that only this file is compiled again if one of
!> them changes.
submodule (gestell_output_table) gestell_output_table_columns
use gestell_output_table_result_units, only: conversion_type
use gestell_output_table_unit, only: new_unit
implicit none (type, external)

contains

module procedure new_table
  table%name = name
  table%heading = heading
  table%caption = caption
  if (present(verdict)) table%verdict = verdict
  if (present(shown)) table%shown = shown
  table%model = ""
  table%remarks = ""
  allocate(table%columns(0))
end procedure new_table

module procedure add_numbers
  type(column_type) :: column

  column%numbers = values
  column%error = ""
  if (present(error)) column%error = trim(new_key(error, unit))
  if (present(bounds)) column%error = trim(new_key(trim(name) // "_error", unit))
  call append(self, column, name, unit, meaning, size(values))
  if (present(bounds)) call self%add(trim(name) // "_error", unit, "bound on its error", bounds)
end procedure add_numbers

module procedure word
  word = self%words((i - 1) * self%width + 1:i * self%width)
end procedure word

module procedure add_integers
  type(column_type) :: column

  column%integers = values
  call append(self, column, name, unit_type(), meaning, size(values))
end procedure add_integers

module procedure add_words
  type(column_type) :: column
  integer :: i

  allocate(character(len=len(values) * size(values)) :: column%words)
  column%width = len(values)
  do i = 1, size(values)
    column%words((i - 1) * len(values) + 1:i * len(values)) = values(i)
  end do
  call append(self, column, name, unit_type(), meaning, size(values))
end procedure add_words

module procedure add_flags
  integer :: flags(size(values))

  flags = merge(1, 0, values)
  if (present(known)) flags = merge(flags, nothing, known)
  call self%add(name, meaning, flags)
  if (.not. allocated(self%reserved)) self%columns(size(self%columns))%is_flag = .true.
end procedure add_flags

module procedure mark_details
  character(len=:), allocatable :: name
  integer :: i, k

  do k = 1, size(self%columns)
    name = "_" // self%columns(k)%key // "_"
    do i = 1, size(words)
      if (index(name, "_" // trim(words(i)) // "_") > 0) self%columns(k)%is_detail = .true.
    end do
  end do
end procedure mark_details

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
  column%si_key = ""
  if (.not. allocated(column%error)) column%error = ""
  if (.not. allocated(table%reserved)) call table%expect(1)
  table%filled = table%filled + 1
  call move_column(column, table%reserved(table%filled))
  if (table%filled == size(table%reserved)) call move_alloc(table%reserved, table%columns)
  table%rows = rows
end subroutine append

module procedure convert
  integer :: i, k

  if (self%always_si .or. units%are_si() .or. .not. self%units%are_si()) return
  self%units = units
  do k = 1, size(self%columns)
    if (self%columns(k)%unit%by_row) call convert_rows(self, k, units)
  end do
  if (any(self%columns%unit%by_row)) call convert_words(self%columns(self%number_of("unit")), units)
  do k = 1, size(self%columns)
    if (allocated(self%columns(k)%numbers)) call convert_column(self%columns(k), units)
  end do
  do k = 2, size(self%columns)
    if (len(self%columns(k - 1)%si_key) > 0) call rename_phase(self%columns(k - 1), self%columns(k))
  end do
  do k = 1, size(self%columns)
    ! with this index in the assignment gfortran 12 looks for the text that it has just overwritten
    i = 0
    if (len(self%columns(k)%error) > 0) i = self%number_of(self%columns(k)%error)
    if (i > 0) self%columns(k)%error = self%columns(i)%key
  end do
end procedure convert

!> Converts the values of one column, and the unit in its key. Columns whose key does not contain the unit, such as those of
!> parameters in the units of the input, remain as they are.
pure subroutine convert_column(column, units)
  type(column_type), intent(inout) :: column
  type(result_units_type), intent(in) :: units
  type(conversion_type) :: conversion
  type(unit_type) :: old, new
  integer :: at

  conversion = units%conversion(column%unit%words)
  old = column%unit
  if (old%suffix == "") old = new_unit(column%unit%words)
  at = index(column%key // "_", "_" // trim(old%suffix) // "_", back=.true.)
  if (conversion%words == "" .or. at == 0) return
  new = new_unit(trim(conversion%words))
  column%numbers = conversion%converted(column%numbers)
  column%si_key = column%key
  column%key = column%si_key(:at) // trim(new%suffix) // column%si_key(at + 1 + len_trim(old%suffix):)
  ! labels such as "fx N amplitude" contain the unit of the key
  if (at + len_trim(old%suffix) < len(column%si_key)) column%label = column%label(:at - 1) &
    & // column%label(at + 1 + len_trim(old%suffix):)
  if (column%unit%suffix /= "") column%unit%suffix = new%suffix
  column%unit%words = new%words
end subroutine convert_column

!> Converts column `k`, each row of which has the unit in the column "unit".
pure subroutine convert_rows(table, k, units)
  type(table_type), intent(inout) :: table
  integer, intent(in) :: k
  type(result_units_type), intent(in) :: units
  type(conversion_type) :: conversion
  integer :: i, words

  words = table%number_of("unit")
  do i = 1, table%rows
    conversion = units%conversion(table%columns(words)%word(i))
    table%columns(k)%numbers(i) = conversion%converted(table%columns(k)%numbers(i))
  end do
end subroutine convert_rows

!> Replaces the units in a column of words.
pure subroutine convert_words(column, units)
  type(column_type), intent(inout) :: column
  type(result_units_type), intent(in) :: units
  type(conversion_type) :: conversion
  character(len=16) :: words(len(column%words) / max(1, column%width))
  integer :: i

  do i = 1, size(words)
    words(i) = column%word(i)
    conversion = units%conversion(words(i))
    if (conversion%words /= "") words(i) = conversion%words
  end do
  column%width = len(words)
  deallocate(column%words)
  allocate(character(len=len(words) * size(words)) :: column%words)
  do i = 1, size(words)
    column%words((i - 1) * len(words) + 1:i * len(words)) = words(i)
  end do
end subroutine convert_words

!> Renames the column of phases that follows a converted column of amplitudes: the keys of both contain the unit of the amplitudes.
pure subroutine rename_phase(amplitude, phase)
  type(column_type), intent(in) :: amplitude
  type(column_type), intent(inout) :: phase
  character(len=*), parameter :: of_amplitude = "_amplitude", of_phase = "_phase_rad"
  integer :: n

  n = len(amplitude%si_key) - len(of_amplitude)
  if (n < 1 .or. len(amplitude%key) < len(of_amplitude)) return
  if (amplitude%si_key(n + 1:) /= of_amplitude .or. phase%key /= amplitude%si_key(:n) // of_phase) return
  phase%si_key = phase%key
  phase%key = amplitude%key(:len(amplitude%key) - len(of_amplitude)) // of_phase
end subroutine rename_phase

module procedure number_of
  integer :: n

  n = len_trim(name)
  do number = size(self%columns), 1, -1
    associate (column => self%columns(number))
      if (column%si_key == name .and. n > 0) return
      if (len(column%key) < n) cycle
      if (column%key(:n) /= name(:n)) cycle
      if (len(column%key) == n .or. column%key == new_key(name, column%unit)) return
    end associate
  end do
end procedure number_of

module procedure key_of_column
  key = self%columns(self%number_of(name))%key
end procedure key_of_column

module procedure expect
  integer :: k

  if (more < 1) return
  self%filled = size(self%columns)
  allocate(self%reserved(self%filled + more))
  do k = 1, self%filled
    call move_column(self%columns(k), self%reserved(k))
  end do
end procedure expect

module procedure join
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
end procedure join

!> Moves a column from one variable to another without copying its values.
pure subroutine move_column(from, to)
  type(column_type), intent(inout) :: from
  type(column_type), intent(out) :: to

  call move_alloc(from%key, to%key)
  call move_alloc(from%si_key, to%si_key)
  call move_alloc(from%label, to%label)
  call move_alloc(from%meaning, to%meaning)
  call move_alloc(from%error, to%error)
  to%unit = from%unit
  to%is_detail = from%is_detail
  to%is_flag = from%is_flag
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

end submodule gestell_output_table_columns
