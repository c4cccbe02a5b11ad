!> sensitivity.csv.
module gestell_task_sensitivity_csv
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_output_table_csv, only: field, write_table
  use gestell_task_sensitivity_plot, only: plot_sensitivity
  use gestell_model_frame_quantity, only: quantity_type
  use gestell_task_sensitivity, only: sensitivity_base_type, sensitivity_type
  implicit none (type, external)
  private

  public :: write_sensitivity

contains

  !> Writes by how much the peaks of `quantities` change with the numbers of `paths` into `folder`, with a script for gnuplot;
  !> `preamble` heads the file. Error: one cannot be written.
  subroutine write_sensitivity(folder, preamble, quantities, paths, base, found, error)
    character(len=*), intent(in) :: folder, preamble(:), paths(:)
    type(quantity_type), intent(in) :: quantities(:)
    type(sensitivity_base_type), intent(in) :: base
    type(sensitivity_type), intent(in) :: found(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: name, path
    character(len=384), allocatable :: labels(:)
    character(len=9), allocatable :: tails(:)
    real(dp), allocatable :: values(:, :)
    integer :: i, k, row

    row = size(quantities) * size(paths)
    allocate(labels(row), tails(row), values(6, row))
    row = 0
    do i = 1, size(quantities)
      name = field(trim(quantities(i)%name))
      do k = 1, size(paths)
        row = row + 1
        path = field(trim(paths(k)))
        labels(row) = name // "," // trim(quantities(i)%unit) // "," // path
        values(:, row) = [base%values(1, i), found(k)%slope(1, i), found(k)%error(1, i), &
          & base%values(2, i), found(k)%slope(2, i), found(k)%error(2, i)]
        tails(row) = found(k)%state(i)
      end do
    end do
    call write_table(folder, "sensitivity.csv", preamble, "quantity,unit,parameter,peak,peak_change_percent_per_percent," &
      & // "peak_change_error,rms,rms_change_percent_per_percent,rms_change_error,state", values, error, labels=labels, tails=tails)
    if (.not. allocated(error)) call plot_sensitivity(folder, preamble, quantities, paths, found, error)
  end subroutine write_sensitivity

end module gestell_task_sensitivity_csv
