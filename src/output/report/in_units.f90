!> Converts the numbers in the text of the report to the units of the results. The tasks write the report in SI units; this module
!> recognises the numbers by the unit behind them or, in a table, in the heading of their column or in their row.
module gestell_output_report_in_units
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline
  use gestell_output_report_text_table, only: block_end, block_start, cut, formatted, read_block, tab
  use gestell_output_report_wrapping, only: wrapped
  use gestell_output_table_result_units, only: conversion_type, result_units_type
  implicit none (type, external)
  private

  public :: convert_lines, convert_sentence, lay_out

  !> Units of the report that may be converted. A unit comes before the units with which it begins.
  character(len=6), parameter :: units_of_report(*) = [character(len=6) :: "kg m^2", "kg mm", "kg m", "kg", "kN m", "kN", "N m", &
    & "Nm", "N", "mm/s", "mm", "m/s^2", "m/s", "m"]
  !> Units in headings of columns whose numbers are never converted, whatever unit a cell of the row contains
  character(len=5), parameter :: other_units(*) = [character(len=5) :: "rpm", "Hz", "deg", "%", "ratio"]
  !> Characters of a number
  character(len=*), parameter :: digits = "0123456789", of_number = digits // ".+-e"
  !> Characters that continue a unit, so that a text before them is not the whole unit
  character(len=*), parameter :: of_unit = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ" // digits // "^/*_'"
  !> A number with at most this number of significant digits may be exact, because zeros at its end are not written; its conversion
  !> gets `usual` digits
  integer, parameter :: few = 2, usual = 4

contains

  !> Lines of the report with formatted tables, in these units. Long lines are broken.
  pure subroutine lay_out(lines, units, text)
    character(len=*), intent(in) :: lines
    type(result_units_type), intent(in) :: units
    character(len=:), allocatable, intent(out) :: text
    character(len=:), allocatable :: converted

    call convert_lines(lines, units, converted)
    text = wrapped(converted)
  end subroutine lay_out

  !> Lines of the report with formatted tables, in these units.
  pure subroutine convert_lines(lines, units, text)
    character(len=*), intent(in) :: lines
    type(result_units_type), intent(in) :: units
    character(len=:), allocatable, intent(out) :: text
    type(growing_text_type) :: all
    character(len=:), allocatable :: part
    integer :: first, start, last

    first = 1
    do
      start = first - 1 + index(lines(first:), block_start)
      if (start < first) exit
      last = start - 1 + index(lines(start:), block_end)
      call convert_sentence(lines(first:start - 1), units, part)
      call all%append(part)
      call convert_table(lines(start:last), units, part)
      call all%append(part)
      first = last + 1
    end do
    call convert_sentence(lines(first:), units, part)
    call all%append(part)
    text = all%whole()
  end subroutine convert_lines

  !> Converts every number before a unit, together with the unit.
  pure subroutine convert_sentence(words, units, text)
    character(len=*), intent(in) :: words
    type(result_units_type), intent(in) :: units
    character(len=:), allocatable, intent(out) :: text
    type(conversion_type) :: conversion
    integer :: i, k

    text = words
    if (units%are_si()) return
    text = ""
    i = 1
    do while (i <= len(words))
      if (words(i:i) == " " .and. i > 1 .and. i < len(words)) then
        if (scan(words(i - 1:i - 1), digits // ")") > 0) then
          k = unit_at(words(i + 1:))
          if (k > 0) conversion = units%conversion(trim(units_of_report(k)))
          if (k > 0 .and. conversion%words /= "" .and. .not. units%is_in_name(words, i)) then
            call convert_numbers_before(text, conversion)
            text = text // " " // trim(conversion%words)
            i = i + 1 + len_trim(units_of_report(k))
            cycle
          end if
        end if
      end if
      text = text // words(i:i)
      i = i + 1
    end do
  end subroutine convert_sentence

  !> Index of the unit with which a text begins; 0 if it begins with no unit.
  pure integer function unit_at(words) result(k)
    character(len=*), intent(in) :: words
    integer :: n

    do k = 1, size(units_of_report)
      n = len_trim(units_of_report(k))
      if (index(words, trim(units_of_report(k))) /= 1) cycle
      if (len(words) == n) return
      if (scan(words(n + 1:n + 1), of_unit) == 0) return
    end do
    k = 0
  end function unit_at

  !> Converts the numbers at the end of a text: one number, two numbers of a range such as 1 to 2, or a list in parentheses.
  pure subroutine convert_numbers_before(text, conversion)
    character(len=:), allocatable, intent(inout) :: text
    type(conversion_type), intent(in) :: conversion
    character(len=:), allocatable :: number, rest
    integer :: first, last

    if (text(len(text):) == ")") then
      first = index(text, "(", back=.true.)
      if (first == 0) return
      call convert_numbers(text(first:), conversion, .false., 0, number)
      text = text(:first - 1) // number
      return
    end if
    first = verify(text, of_number, back=.true.) + 1
    call convert_number(text(first:), conversion, .false., 0, number)
    rest = number
    last = first - 1
    if (last > 4) then
      if (text(last - 3:last) == " to ") then
        first = verify(text(:last - 4), of_number, back=.true.) + 1
        call convert_number(text(first:last - 4), conversion, .false., 0, number)
        rest = number // " to " // rest
        last = first - 1
      end if
    end if
    text = text(:last) // rest
  end subroutine convert_numbers_before

  !> Converts every number of a text that stands alone between blanks, commas and parentheses.
  pure subroutine convert_numbers(words, conversion, is_error, least, text)
    character(len=*), intent(in) :: words
    type(conversion_type), intent(in) :: conversion
    !> True if the numbers are error bounds
    logical, intent(in) :: is_error
    !> Least number of significant digits that the numbers are known to have, although zeros at their end are not written
    integer, intent(in) :: least
    character(len=:), allocatable, intent(out) :: text
    character(len=*), parameter :: between = " ,()"
    character(len=:), allocatable :: number
    integer :: i, n

    text = ""
    i = 1
    do while (i <= len(words))
      n = scan(words(i:), between) - 1
      if (n < 0) n = len(words) - i + 1
      if (n == 0) then
        text = text // words(i:i)
        i = i + 1
      else
        call convert_number(words(i:i + n - 1), conversion, is_error, least, number)
        text = text // number
        i = i + n
      end if
    end do
  end subroutine convert_numbers

  !> Converts one number; a text that is no number remains. Error bounds are rounded up to one digit. The conversion of another
  !> number does not pretend to know more than the digits of the number.
  pure subroutine convert_number(word, conversion, is_error, least, text)
    character(len=*), intent(in) :: word
    type(conversion_type), intent(in) :: conversion
    logical, intent(in) :: is_error
    integer, intent(in) :: least
    character(len=:), allocatable, intent(out) :: text
    real(dp) :: value, unit
    integer :: status, significant, n

    text = word
    significant = count_digits(word)
    if (significant == 0) return
    read (word, *, iostat=status) value
    if (status /= 0 .or. .not. abs(value) > 0) return
    significant = max(significant, least)
    ! unit of the last digit
    unit = 10.0_dp**(floor(log10(abs(value)) + 1.0e-9_dp) - significant + 1)
    value = conversion%converted(value)
    if (is_error) then
      unit = 10.0_dp**floor(log10(abs(value)))
      text = concise(ceiling(value / unit * (1 - 1.0e-9_dp)) * unit, 1)
    else if (significant <= few) then
      text = concise(value, usual)
    else
      ! the smallest power of ten that the unit of the last digit does not exceed
      n = ceiling(log10(conversion%converted(unit)) - 1.0e-9_dp)
      text = concise(value, max(1, floor(log10(abs(value))) - n + 1))
    end if
  end subroutine convert_number

  !> Number of significant digits of a number; 0 if the text is no number or zero.
  pure integer function count_digits(word)
    character(len=*), intent(in) :: word
    integer :: first, last, i

    count_digits = 0
    if (len(word) == 0) return
    if (verify(word, of_number) > 0) return
    first = scan(word, "123456789")
    last = index(word // "e", "e") - 1
    if (first == 0) return
    count_digits = count([(scan(word(i:i), digits) > 0, i = first, last)])
  end function count_digits

  !> Formats a table. Numbers are converted by the unit in the last line of the headings or, if their column has no unit there, by
  !> the unit in a cell of their row.
  pure subroutine convert_table(block, units, text)
    character(len=*), intent(in) :: block
    type(result_units_type), intent(in) :: units
    character(len=:), allocatable, intent(out) :: text
    character(len=:), allocatable :: align, heads, rows, cells(:, :), last_heads(:, :), new_heads, word, cell
    type(growing_text_type) :: all
    type(conversion_type), allocatable :: conversions(:)
    type(conversion_type) :: own, of_cell
    logical, allocatable :: named(:), errors(:)
    !> For each column: number of significant digits of its numbers
    integer, allocatable :: known(:)
    integer :: i, k, at, n

    call read_block(block, align, heads, rows)
    if (units%are_si()) then
      text = formatted(align, heads, rows)
      return
    end if
    n = len(align)
    at = index(heads, newline, back=.true.)
    call cut(with_tabs(heads(at + 1:)) // newline, n, last_heads)
    allocate(conversions(n), named(n), errors(n), known(n))
    new_heads = heads(:at)
    do k = 1, n
      word = trim(last_heads(k, 1))
      conversions(k) = units%conversion(word)
      named(k) = conversions(k)%words /= ""
      do i = 1, size(other_units)
        named(k) = named(k) .or. contains_word(heads, n, k, trim(other_units(i)))
      end do
      errors(k) = contains_word(heads, n, k, "error")
      if (conversions(k)%words /= "") word = trim(conversions(k)%words)
      new_heads = new_heads // either(",", "", k > 1) // word
    end do
    if (at == 0 .and. heads == "") new_heads = ""
    call cut(rows, n, cells)
    do k = 1, n
      known(k) = 0
      do i = 1, size(cells, 2)
        known(k) = max(known(k), count_digits(trim(cells(k, i))))
      end do
    end do
    do i = 1, size(cells, 2)
      own = conversion_type()
      ! the first column contains names; m is also the name of a moment
      do k = 2, n
        if (conversions(k)%words == "" .and. own%words == "") own = units%conversion(trim(cells(k, i)))
      end do
      do k = 1, n
        word = trim(cells(k, i))
        if (k > 1) call all%append(tab)
        of_cell = units%conversion(either(word, "", k > 1))
        if (conversions(k)%words /= "") then
          call convert_numbers(word, conversions(k), errors(k), known(k), cell)
        else if (of_cell%words /= "") then
          cell = trim(of_cell%words)
        else if (own%words /= "" .and. .not. named(k) .and. is_amount(word)) then
          call convert_numbers(word, own, errors(k), known(k), cell)
        else
          call convert_sentence(word, units, cell)
          if (k == 1) call convert_position(cell, units)
        end if
        call all%append(cell)
      end do
      call all%append(newline)
    end do
    text = formatted(align, new_heads, all%whole())
  end subroutine convert_table

  !> True if a line of the headings of column `k` contains `word`.
  pure logical function contains_word(heads, columns, k, word)
    character(len=*), intent(in) :: heads, word
    integer, intent(in) :: columns, k
    character(len=:), allocatable :: cells(:, :)

    contains_word = .false.
    if (heads == "") return
    call cut(with_tabs(heads) // newline, columns, cells)
    contains_word = any(index(cells(k, :), word) > 0)
  end function contains_word

  !> True for a cell with a number alone, or with a limit such as "<= 5 met".
  pure logical function is_amount(word)
    character(len=*), intent(in) :: word

    is_amount = verify(word, of_number) == 0 .or. scan(word, "<>=") == 1
  end function is_amount

  !> Converts the coordinates behind a name with a position, such as "support 1 (-0.2,0.1)".
  pure subroutine convert_position(word, units)
    character(len=:), allocatable, intent(inout) :: word
    type(result_units_type), intent(in) :: units
    character(len=:), allocatable :: position
    integer :: first

    first = index(word, "(", back=.true.)
    if (first < 2 .or. len(word) < 4) return
    if (word(len(word):) /= ")" .or. word(first - 1:first - 1) /= " ") return
    if (verify(word(first + 1:len(word) - 1), of_number // ", ") > 0 .or. index(word(first:), ",") == 0) return
    if (units%is_in_name(word, first)) return
    call convert_numbers(word(first:), units%conversion("m"), .false., 0, position)
    word = word(:first - 1) // position
  end subroutine convert_position

  !> Headings in which tabs separate the columns.
  pure function with_tabs(heads) result(words)
    character(len=*), intent(in) :: heads
    character(len=len(heads)) :: words
    integer :: i

    words = heads
    do i = 1, len(heads)
      if (heads(i:i) == ",") words(i:i) = tab
    end do
  end function with_tabs

end module gestell_output_report_in_units
