!> Result files: comma separated, a preamble of # lines, one header line, numbers with 17 significant digits.
module gestell_io_csv
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: field, write_table

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
    character(len=256) :: message
    character(len=:), allocatable :: line
    integer :: unit, status, i, k
    integer(int64) :: bytes, written

    open (newunit=unit, file=folder // "/" // name, action="write", status="replace", iostat=status, iomsg=message)
    bytes = 0
    do i = 1, size(preamble) + 1 + size(values, 2)
      if (status /= 0) exit
      k = i - size(preamble) - 1
      if (k < 0) then
        line = "# " // trim(preamble(i))
      else if (k == 0) then
        line = header
      else
        line = row(values(:, k))
        if (present(first_index)) line = text(first_index + k - 1) // "," // line
        if (present(labels)) line = trim(labels(k)) // "," // line
        if (present(tails)) line = line // "," // trim(tails(k))
      end if
      write (unit, "(a)", iostat=status, iomsg=message) line
      bytes = bytes + len(line) + 1
    end do
    if (status == 0) close (unit, iostat=status, iomsg=message)
    if (status == 0) then
      ! gfortran says nothing of a disk that is full
      inquire (file=folder // "/" // name, size=written)
      if (written /= bytes) then
        status = 1
        message = "it came out too short; is the disk full?"
      end if
    end if
    if (status /= 0) call fatal_error(error, folder // "/" // name // ": cannot be written: " // trim(message), &
      & failed_computation)
  end subroutine write_table

  !> A text as a field of the file: in quotes if it has a comma or quotes itself, which are doubled then.
  pure function field(words) result(word)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: word
    integer :: i

    word = words
    if (scan(words, ",""") == 0) return
    word = """"
    do i = 1, len(words)
      word = word // words(i:i)
      if (words(i:i) == """") word = word // """"
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

end module gestell_io_csv
