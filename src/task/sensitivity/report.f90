!> Writes the section of the report on a sensitivity analysis.
module gestell_task_sensitivity_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, fixed, newline
  use gestell_math_sorting, only: ascending
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_output_report_verdict, only: section
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_task_sensitivity, only: sensitivity_base_type, sensitivity_type
  implicit none (type, external)
  private

  public :: report_sensitivity

contains

  !> The section of the report on a sensitivity analysis. `warning`: text on motions too large for the linearised equations;
  !> otherwise empty.
  pure function report_sensitivity(quantities, paths, base, derivatives, warning) result(report)
    type(quantity_type), intent(in) :: quantities(:)
    !> Paths of the parameters, for example "frame.mass"
    character(len=*), intent(in) :: paths(:)
    !> Peaks, rms values and verdict of the unchanged machine
    type(sensitivity_base_type), intent(in) :: base
    !> Derivatives with respect to each parameter, shape (parameters)
    type(sensitivity_type), intent(in) :: derivatives(:)
    character(len=*), intent(in) :: warning
    character(len=:), allocatable :: report
    integer :: i

    report = section("SENSITIVITY: change in % if a parameter grows by 1 %, largest first", base%state) // warning
    do i = 1, size(quantities)
      if (derivatives(1)%zero(i)) then
        report = report // "  " // trim(quantities(i)%name) // ": zero within its error, because nothing excites it" // newline
        cycle
      end if
      report = report // "  " // trim(quantities(i)%name) // ": peak " // concise(base%values(1, i), 6) // " " &
        & // trim(quantities(i)%unit) // ", rms " // concise(base%values(2, i), 6) // " " // trim(quantities(i)%unit) // newline &
        & // tabulated("rrrl", "peak,error,rms,parameter", rows(i, paths, derivatives))
    end do
  end function report_sensitivity

  !> Rows of the table for quantity number `i`, sorted by the change, largest first. Parameters without a result come last.
  pure function rows(i, paths, derivatives) result(report)
    integer, intent(in) :: i
    character(len=*), intent(in) :: paths(:)
    type(sensitivity_type), intent(in) :: derivatives(:)
    character(len=:), allocatable :: report
    real(dp) :: effect(size(derivatives))
    integer :: order(size(derivatives)), k, n

    effect = -1
    do k = 1, size(derivatives)
      if (derivatives(k)%state(i) /= "failed") effect(k) = abs(derivatives(k)%slope(1, i))
    end do
    order = ascending(-effect)
    report = ""
    do n = 1, size(derivatives)
      k = order(n)
      associate (one => derivatives(k))
        if (effect(k) < 0) report = report // "-" // tab // "-" // tab // "-"
        if (.not. effect(k) < 0) report = report // fixed(one%slope(1, i), 4) // tab // concise(one%error(1, i), 1) // tab &
          & // fixed(one%slope(2, i), 4)
        report = report // tab // trim(paths(k))
        if (one%state(i) /= "ok") report = report // "  " // trim(one%state(i))
      end associate
      report = report // newline
    end do
  end function rows

end module gestell_task_sensitivity_report
