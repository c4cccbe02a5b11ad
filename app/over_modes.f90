!> The tasks `campbell` and `critical`.
module over_modes
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_task_campbell_csv, only: write_campbell, write_critical, write_crossings
  use gestell_task_configuration, only: configuration_type
  use gestell_task_campbell_plot, only: plot_campbell, plot_critical, plot_crossings
  use gestell_task_campbell_report, only: campbell_verdict, critical_verdict, report_campbell, &
    & report_critical
  use gestell_output_report_verdict, only: with_verdict
  use gestell_task_campbell, only: campbell_order_type, campbell_type, solve_campbell
  use gestell_task_campbell_crossings, only: crossing_type, find_crossings
  use gestell_task_critical, only: critical_type, find_critical
  use locked_family, only: locked_family_type
  implicit none (type, external)
  private

  public :: run_over_modes

  !> Whatever the model of the rest.
  character(len=*), parameter :: model = "rest"

contains

  !> Follows the modes over the speeds, finds crossings and critical speeds as ordered, writes their files to `folder`, and
  !> tells people of them in `report`. `stable`: wherever something is told the machine is stable.
  subroutine run_over_modes(configuration, folder, preamble, report, stable, error)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, preamble(:)
    character(len=:), allocatable, intent(out) :: report
    logical, intent(out) :: stable
    type(error_type), allocatable, intent(out) :: error
    type(campbell_order_type) :: order
    type(locked_family_type) :: family
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: crossings(:)
    type(critical_type), allocatable :: critical(:)
    real(dp), allocatable :: speeds(:)
    character(len=:), allocatable :: verdict
    integer :: i

    report = ""
    stable = .false.
    order%accuracy = configuration%accuracy
    order%averaged = configuration%tasks%averaged
    order%orders = configuration%orders
    allocate(family%inner, source=configuration%plan%family)
    ! Critical speeds are those of small vibrations: in resonance the exact vibration leans away from them, or is not found.
    family%model = model
    family%accuracy = configuration%accuracy
    associate (axis => configuration%plan%grid%axes(1))
      speeds = axis%value([(i, i = 1, axis%count)])
      call solve_campbell(family, speeds, order, campbell, error)
      if (.not. allocated(error)) call find_crossings(family, order, campbell, crossings, error)
      if (.not. allocated(error) .and. configuration%critical) call find_critical(family, order, crossings, critical, error)
    end associate
    if (allocated(error)) return
    verdict = campbell_verdict(campbell)
    stable = verdict == "stable"
    if (configuration%campbell) call tell_campbell(folder, with_verdict(of_model(preamble), verdict), &
      & campbell, crossings, order%orders, error)
    if (configuration%campbell) report = report_campbell(campbell, crossings)
    if (allocated(error) .or. .not. configuration%critical) return
    verdict = critical_verdict(critical, campbell)
    stable = stable .and. verdict == "stable"
    call tell_critical(folder, with_verdict(of_model(preamble), verdict), critical, [speeds(1), speeds(size(speeds))], error)
    report = report // report_critical(critical, configuration%orders, verdict)
  end subroutine run_over_modes

  !> The preamble with the model.
  pure function of_model(preamble) result(lines)
    character(len=*), intent(in) :: preamble(:)
    character(len=len(preamble)) :: lines(size(preamble))
    character(len=*), parameter :: key = "model: "
    integer :: i

    lines = preamble
    do i = 1, size(lines)
      if (index(lines(i), key // "averaged") /= 1 .and. index(lines(i), key) == 1) lines(i) = key // model
    end do
  end function of_model

  !> campbell.csv and crossings.csv with their scripts. Error: one cannot be written.
  subroutine tell_campbell(folder, preamble, campbell, crossings, orders, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(campbell_type), intent(in) :: campbell
    type(crossing_type), intent(in) :: crossings(:)
    integer, intent(in) :: orders
    type(error_type), allocatable, intent(out) :: error

    call write_campbell(folder, preamble, campbell, error)
    if (.not. allocated(error)) call write_crossings(folder, preamble, crossings, error)
    if (.not. allocated(error)) call plot_campbell(folder, preamble, campbell, crossings, orders, error)
    if (.not. allocated(error)) call plot_crossings(folder, preamble, crossings, error)
  end subroutine tell_campbell

  !> critical.csv with its script, over the range `ends` (1/min). Error: one cannot be written.
  subroutine tell_critical(folder, preamble, critical, ends, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(critical_type), intent(in) :: critical(:)
    real(dp), intent(in) :: ends(2)
    type(error_type), allocatable, intent(out) :: error

    call write_critical(folder, preamble, critical, error)
    if (.not. allocated(error)) call plot_critical(folder, preamble, critical, ends, error)
  end subroutine tell_critical

end module over_modes
