!> The tasks `campbell` and `critical`.
module over_modes
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_io_campbell_csv, only: write_campbell, write_critical, write_crossings
  use gestell_io_configuration, only: configuration_type
  use gestell_io_plot_campbell, only: plot_campbell, plot_critical, plot_crossings
  use gestell_io_report_campbell, only: report_campbell, report_critical
  use gestell_study_campbell, only: campbell_order_type, campbell_type, solve_campbell
  use gestell_study_campbell_crossings, only: crossing_type, find_crossings
  use gestell_study_critical, only: critical_type, find_critical
  implicit none (type, external)
  private

  public :: run_over_modes

contains

  !> Follows the modes over the speeds, finds crossings and critical speeds as ordered, writes their files to `folder`, and
  !> tells people of them in `report`.
  subroutine run_over_modes(configuration, folder, preamble, report, error)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, preamble(:)
    character(len=:), allocatable, intent(out) :: report
    type(error_type), allocatable, intent(out) :: error
    type(campbell_order_type) :: order
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: crossings(:)
    type(critical_type), allocatable :: critical(:)
    real(dp), allocatable :: speeds(:)
    integer :: i

    report = ""
    order%accuracy = configuration%accuracy
    order%averaged = configuration%tasks%averaged
    order%orders = configuration%orders
    associate (axis => configuration%plan%grid%axes(1), family => configuration%plan%family)
      speeds = axis%value([(i, i = 1, axis%count)])
      call solve_campbell(family, speeds, order, campbell, error)
      if (.not. allocated(error)) call find_crossings(family, order, campbell, crossings, error)
      if (.not. allocated(error) .and. configuration%critical) call find_critical(family, order, crossings, critical, error)
    end associate
    if (allocated(error)) return
    if (configuration%campbell) then
      call write_campbell(folder, preamble, campbell, error)
      if (.not. allocated(error)) call write_crossings(folder, preamble, crossings, error)
      if (.not. allocated(error)) call plot_campbell(folder, preamble, campbell, crossings, order%orders, error)
      if (.not. allocated(error)) call plot_crossings(folder, preamble, crossings, error)
      report = report_campbell(campbell, crossings)
    end if
    if (allocated(error) .or. .not. configuration%critical) return
    call write_critical(folder, preamble, critical, error)
    if (.not. allocated(error)) call plot_critical(folder, preamble, critical, [speeds(1), speeds(size(speeds))], error)
    report = report // report_critical(critical, configuration%orders)
  end subroutine run_over_modes

end module over_modes
