!> Result files: comma separated, a preamble of # lines, one header line, numbers with 17 significant digits.
module gestell_io_csv
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: exact, text
  implicit none (type, external)
  private

  public :: write_table

contains

  !> Writes `values`, shape (columns, rows), to `folder`/`name`. With `first_index` an integer column leads, which
  !> counts the rows from there. `header` holds the names of all columns between commas.
  !> Error: the file cannot be written.
  subroutine write_table(folder, name, preamble, header, values, error, first_index)
    character(len=*), intent(in) :: folder, name, preamble(:), header
    real(dp), intent(in) :: values(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: first_index
    character(len=256) :: message
    integer :: unit, status, i, k

    open (newunit=unit, file=folder // "/" // name, action="write", status="replace", iostat=status, iomsg=message)
    do i = 1, size(preamble)
      if (status == 0) write (unit, "(a)", iostat=status, iomsg=message) "# " // trim(preamble(i))
    end do
    if (status == 0) write (unit, "(a)", iostat=status, iomsg=message) header
    do k = 1, size(values, 2)
      if (status /= 0) exit
      if (present(first_index)) then
        write (unit, "(a)", iostat=status, iomsg=message) text(first_index + k - 1) // "," // row(values(:, k))
      else
        write (unit, "(a)", iostat=status, iomsg=message) row(values(:, k))
      end if
    end do
    if (status == 0) close (unit, iostat=status, iomsg=message)
    if (status /= 0) call fatal_error(error, folder // "/" // name // ": cannot be written: " // trim(message), &
      & failed_computation)
  end subroutine write_table

  !> Numbers between commas.
  pure function row(values) result(line)
    real(dp), intent(in) :: values(:)
    character(len=:), allocatable :: line
    integer :: i

    line = exact(values(1))
    do i = 2, size(values)
      line = line // "," // exact(values(i))
    end do
  end function row

end module gestell_io_csv
