!> Reads the course of a load from a CSV file with two columns: crank angle, and force, moment or pressure.
!>
!> The first row names the columns with their units, such as `angle_deg,pressure_bar` or `angle (deg); force (N)`. Empty lines and
!> lines that begin with `#` are skipped.
module gestell_input_machine_load_table
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_files, only: file_exists, read_file
  use gestell_base_key, only: of_force, of_moment, of_pressure
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, text
  use gestell_input_namelist_message, only: location
  use gestell_input_namelist_number, only: read_real
  use gestell_input_schema_units, only: find_unit, unit_names, unit_type
  implicit none (type, external)
  private

  public :: read_load_table

  !> Quantities that a table can give.
  integer, parameter, public :: force_table = 1, moment_table = 2, pressure_table = 3

  !> Course of a load over one cycle. `angles`: ascending angles, 2 pi for the cycle (rad). `values`: N, N m or Pa.
  type, public :: load_table_type
    integer :: quantity = 0
    real(dp), allocatable :: angles(:), values(:)
  end type load_table_type

  !> Codes of the quantities `force_table`, `moment_table` and `pressure_table` among those of the units.
  integer, parameter :: codes(3) = [of_force, of_moment, of_pressure]

contains

  !> Reads the table of a load whose cycle lasts `turns` turns of its crank. Fails if the file is missing or not a table, if a unit
  !> is unknown, a value is not a finite number, the angles do not ascend or do not cover the cycle, or if the values at the ends
  !> of the cycle differ. The message names the file and the line.
  subroutine read_load_table(file, turns, table, error)
    character(len=*), intent(in) :: file
    integer, intent(in) :: turns
    type(load_table_type), intent(out) :: table
    type(error_type), allocatable, intent(out) :: error
    !> Two rows count as one point if their angles differ by this part of a cycle from a whole cycle; their values may differ by
    !> `jump` of the range of values.
    real(dp), parameter :: rounding = 1.0e-6_dp, jump = 0.02_dp
    character(len=:), allocatable :: bytes, row
    integer, allocatable :: lines(:)
    real(dp) :: pair(2), to_rad, factor, whole, gap
    integer :: begin, line, length, n

    if (.not. file_exists(file)) then
      call fatal_error(error, location(file, 0) // "there is no such file", invalid_input)
      return
    end if
    call read_file(file, bytes)
    allocate(table%angles(0), table%values(0), lines(0))
    begin = 1
    line = 0
    do while (begin <= len(bytes))
      line = line + 1
      length = index(bytes(begin:) // new_line("a"), new_line("a")) - 1
      row = trim(adjustl(bytes(begin:begin + length - 1)))
      if (len(row) > 0) then
        if (row(len(row):) == achar(13)) row = row(:len(row) - 1)
      end if
      begin = begin + length + 1
      if (len_trim(row) == 0 .or. index(row, "#") == 1) cycle
      if (table%quantity == 0) then
        call read_header(file, line, row, table%quantity, to_rad, factor, error)
      else
        call read_row(file, line, row, pair, error)
        if (allocated(error)) return
        table%angles = [table%angles, pair(1) * to_rad / turns]
        table%values = [table%values, pair(2) * factor]
        lines = [lines, line]
        n = size(lines)
        if (n > 1) then
          if (.not. table%angles(n) > table%angles(n - 1)) call fatal_error(error, location(file, line) // "the angle must " // &
            & "be greater than that of the row before", invalid_input)
        end if
      end if
      if (allocated(error)) return
    end do
    n = size(lines)
    if (n < 4) then
      call fatal_error(error, location(file, 0) // "a table of a load needs a row of names and at least 4 rows of numbers", &
        & invalid_input)
      return
    end if
    whole = 2 * pi * (1 + rounding)
    associate (x => table%angles, y => table%values)
      gap = x(1) + 2 * pi - x(n)
      if (x(n) - x(1) > whole) then
        call fatal_error(error, location(file, lines(n)) // "the angles span " // concise(degrees(x(n) - x(1))) &
          & // " deg, more than the cycle of " // text(360 * turns) // " deg", invalid_input)
      else if (gap > 2 * maxval(x(2:) - x(:n - 1))) then
        call fatal_error(error, location(file, lines(n)) // "the angles span only " // concise(degrees(x(n) - x(1))) &
          & // " deg of the cycle of " // text(360 * turns) // " deg", invalid_input)
      else if (abs(y(n) - y(1)) > jump * (maxval(y) - minval(y)) .and. abs(y(n) - y(1)) > 2 * maxval(abs(y(2:) - y(:n - 1)) &
        & * merge(gap / (x(2:) - x(:n - 1)), 0.0_dp, gap > 2 * pi * rounding))) then
        call fatal_error(error, location(file, lines(n)) // "the course jumps at the ends: " // concise(y(n) / factor) // " in " &
          & // "the last row, " // concise(y(1) / factor) // " in the first (line " // text(lines(1)) // ")", invalid_input)
      end if
    end associate
    if (allocated(error) .or. gap > 2 * pi * rounding) return
    ! the last row repeats the first
    table%angles = table%angles(:n - 1)
    table%values = table%values(:n - 1)

  contains

    !> Angle in degrees of the crank.
    pure real(dp) function degrees(angle)
      real(dp), intent(in) :: angle

      degrees = angle * turns * 180 / pi
    end function degrees

  end subroutine read_load_table

  !> Reads the units of the two columns from the first row. Fails if a unit is missing or unknown.
  pure subroutine read_header(file, line, row, quantity, to_rad, factor, error)
    character(len=*), intent(in) :: file, row
    integer, intent(in) :: line
    integer, intent(out) :: quantity
    real(dp), intent(out) :: to_rad, factor
    type(error_type), allocatable, intent(out) :: error
    character(len=len(row) + 1) :: words
    character(len=12), allocatable :: names(:)
    type(unit_type) :: unit
    integer :: i, split

    quantity = 0
    factor = 1
    to_rad = 1
    ! units stand in parentheses, in brackets or after an underscore
    words = " " // row
    do i = 1, len(words)
      if (index("_()[]""'/", words(i:i)) > 0) words(i:i) = " "
    end do
    split = scan(words, ",;")
    if (split == 0) split = len(words)
    if (ends_with(words(:split - 1), "deg")) to_rad = pi / 180
    if (.not. (ends_with(words(:split - 1), "deg") .or. ends_with(words(:split - 1), "rad"))) then
      call fatal_error(error, location(file, line) // "the first column must be an angle in deg or rad, such as angle_deg", &
        & invalid_input)
      return
    end if
    do quantity = 1, size(codes)
      names = unit_names(codes(quantity))
      do i = 1, size(names)
        if (.not. any([ends_with(words(split + 1:), without(names(i), "/", " ")), &
          & ends_with(words(split + 1:), without(names(i), " ", ""))])) cycle
        unit = find_unit(codes(quantity), names(i))
        factor = unit%factor / unit%divisor
        return
      end do
    end do
    quantity = 0
    call fatal_error(error, location(file, line) // "the unit of the second column is unknown: use a unit of forces, moments or " &
      & // "pressures as in &units, such as pressure_bar", invalid_input)
  end subroutine read_header

  !> Number of times that a character occurs in a name.
  pure integer function occurrences(name, letter)
    character(len=*), intent(in) :: name
    character, intent(in) :: letter
    integer :: i

    occurrences = count([(name(i:i) == letter, i = 1, len_trim(name))])
  end function occurrences

  !> Copy of a name in which the character `old` is replaced by `new`, which may be empty.
  pure function without(name, old, new) result(words)
    character(len=*), intent(in) :: name, old, new
    character(len=len_trim(name) + (len(new) - 1) * occurrences(name, old)) :: words
    integer :: i, n

    n = 0
    do i = 1, len_trim(name)
      words(n + 1:) = either(new, name(i:i), name(i:i) == old)
      n = n + merge(len(new), 1, name(i:i) == old)
    end do
  end function without

  !> True if the last word or words of `words` are `unit`.
  pure logical function ends_with(words, unit)
    character(len=*), intent(in) :: words, unit

    ends_with = index(" " // trim(words), " " // unit, back=.true.) == max(0, len_trim(words) - len(unit)) + 1 .and. &
      & len_trim(words) >= len(unit)
  end function ends_with

  !> Reads the two numbers of a row.
  pure subroutine read_row(file, line, row, pair, error)
    character(len=*), intent(in) :: file, row
    integer, intent(in) :: line
    real(dp), intent(out) :: pair(2)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: reason
    character(len=len(row)) :: words
    integer :: split, i

    split = scan(row, ",;")
    if (split == 0) split = scan(row, " " // achar(9))
    pair = 0
    if (split == 0 .or. scan(row(split + 1:), ",;") > 0) then
      call fatal_error(error, location(file, line) // "must contain two numbers separated by a comma", invalid_input)
      return
    end if
    do i = 1, 2
      words = adjustl(row(:split - 1))
      if (i == 2) words = adjustl(row(split + 1:))
      call read_real(trim(words), pair(i), reason)
      if (reason == "") cycle
      call fatal_error(error, location(file, line) // "column " // text(i) // " " // reason, invalid_input)
      return
    end do
  end subroutine read_row

end module gestell_input_machine_load_table
