!> The files that several findings have in the same form: histories and harmonics over one turn.
module gestell_task_findings_csv
  use gestell_base_error, only: error_type
  use gestell_math_fourier, only: fourier_type
  use gestell_base_kinds, only: dp
  use gestell_output_table_csv, only: write_table
  implicit none (type, external)
  private

  public :: add_harmonics, write_harmonics, write_turn

contains

  !> `values`, shape (points + 1, columns), with crank angle (deg) and time (s) before them; `header` names them, with a comma
  !> before each.
  subroutine write_turn(folder, name, preamble, header, speed, period, values, error)
    character(len=*), intent(in) :: folder, name, preamble(:), header
    real(dp), intent(in) :: speed, period, values(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: rows(:, :)
    integer :: k, points

    points = size(values, 1) - 1
    allocate(rows(2 + size(values, 2), points + 1))
    rows(1, :) = [(sign(360.0_dp, speed) * k / points, k = 0, points)]
    rows(2, :) = [(period * k / points, k = 0, points)]
    rows(3:, :) = transpose(values)
    call write_table(folder, name, preamble, "crank_deg,t_s" // header, rows, error)
  end subroutine write_turn

  !> Amplitude and phase of a series, orders 0 to `harmonics`, after the first `n` columns. Order 0 is the mean.
  pure subroutine add_harmonics(series, values, n)
    type(fourier_type), intent(in) :: series
    real(dp), intent(inout) :: values(:, 0:)
    integer, intent(inout) :: n
    integer :: last

    last = min(ubound(values, 2), size(series%amplitude))
    values(n + 1, 0) = series%mean
    values(n + 1, 1:last) = series%amplitude(:last)
    values(n + 2, 1:last) = series%phase(:last)
    n = n + 2
  end subroutine add_harmonics

  !> Columns of add_harmonics with order and frequency before them; `header` as in write_turn.
  subroutine write_harmonics(folder, name, preamble, header, period, values, error)
    character(len=*), intent(in) :: folder, name, preamble(:), header
    real(dp), intent(in) :: period, values(:, 0:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: rows(:, :)
    integer :: k

    allocate(rows(1 + size(values, 1), 0:ubound(values, 2)))
    rows(1, :) = [(k / period, k = 0, ubound(values, 2))]
    rows(2:, :) = values
    call write_table(folder, name, preamble, "order,frequency_Hz" // header, rows, error, first_index=0)
  end subroutine write_harmonics

end module gestell_task_findings_csv
