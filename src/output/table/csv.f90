!> Result files: comma separated, a preamble of # lines, one header line, numbers with 17 significant digits.
module gestell_output_table_csv
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_output_file_output, only: open_output, output_type
  implicit none (type, external)
  private

  public :: field, row, write_table

  character, parameter :: newline = new_line("a")

contains

  !> Writes `values`, shape (columns, rows), to `folder`/`name`. With `first_index` an integer column leads, which
  !> counts the rows from there; with `labels` the columns that these hold; with `tails` those that follow. `header` holds
  !> the names of all columns.
  !> Error: the file cannot be written.
  subroutine write_table(folder, name, preamble, header, values, error, first_index, labels, tails)
    character(len=*), intent(in) :: folder, name, preamble(:), header
    real(dp), intent(in) :: values(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: first_index
    character(len=*), intent(in), optional :: labels(:), tails(:)
    type(output_type) :: output
    character(len=:), allocatable :: line
    integer :: i, k

    call open_output(output, folder // "/" // name)
    do i = 1, size(preamble)
      call output%append("# " // trim(preamble(i)) // newline)
    end do
    call output%append(header // newline)
    do k = 1, size(values, 2)
      line = row(values(:, k))
      if (present(first_index)) line = text(first_index + k - 1) // "," // line
      if (present(labels)) line = trim(labels(k)) // "," // line
      if (present(tails)) line = line // "," // trim(tails(k))
      call output%append(line // newline)
    end do
    call output%complete(error)
  end subroutine write_table

  !> A text as a field of the file: in quotes if it begins like a comment, or has a comma, the end of a line or quotes itself, which
  !> are doubled then. A text that a spreadsheet would take for a formula, as it begins with one of = + - @ and is no number, gets
  !> an apostrophe before it.
  pure function field(words) result(word)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: word
    character(len=:), allocatable :: safe
    integer :: i

    safe = words
    if (scan(words, "=+-@") == 1 .and. verify(words, "0123456789+-.,*eEdD ") > 0) safe = "'" // words
    word = safe
    if (scan(safe, ",""" // achar(10) // achar(13)) == 0 .and. index(safe, "#") /= 1) return
    word = """"
    do i = 1, len(safe)
      word = word // safe(i:i)
      if (safe(i:i) == """") word = word // """"
    end do
    word = word // """"
  end function field

  !> Numbers with 17 digits between commas: written at once, for that is what most of a run's time goes into.
  pure function row(values) result(line)
    real(dp), intent(in) :: values(:)
    character(len=:), allocatable :: line
    character(len=25 * size(values)) :: wide
    integer :: i, length

    write (wide, "(*(es24.16e3, :, ','))") values
    length = 0
    do i = 1, len(wide)
      if (wide(i:i) == " ") cycle
      length = length + 1
      wide(length:length) = wide(i:i)
    end do
    line = wide(:length)
  end function row

end module gestell_output_table_csv
