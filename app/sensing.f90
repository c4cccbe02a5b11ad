!> The task `sensitivity`.
module sensing
  use gestell_base_error, only: error_type
  use gestell_task_configuration, only: configuration_type
  use gestell_task_sensitivity_report, only: report_sensitivity
  use gestell_task_sensitivity_csv, only: write_sensitivity
  use gestell_output_report_verdict, only: with_verdict
  use gestell_task_sensitivity, only: sensitivity_base_type, sensitivity_type, solve_base, solve_parameter
  use gestell_study_speed_point, only: speed_order_type, state_names
  use locked_family, only: locked_family_type
  use terminal, only: progress_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: run_sensitivity

contains

  !> Finds how the quantities change with every parameter, and writes sensitivity.csv to `folder`. `report` tells people.
  subroutine run_sensitivity(configuration, folder, preamble, report, error)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, preamble(:)
    character(len=:), allocatable, intent(out) :: report
    type(error_type), allocatable, intent(out) :: error
    type(sensitivity_base_type) :: base
    type(sensitivity_type), allocatable :: found(:)

    call compute(configuration, base, found, error)
    if (allocated(error)) return
    associate (quantities => configuration%sensitive, paths => configuration%sensitivity_plan%paths)
      call write_sensitivity(folder, with_verdict(preamble, trim(state_names(base%state))), quantities, paths, base, found, &
        & error)
      if (.not. allocated(error)) report = report_sensitivity(quantities, paths, base, found, configuration%tasks%model)
    end associate
  end subroutine run_sensitivity

  !> The parameters by threads. Error: that of the machine itself, or of the first parameter that fails.
  subroutine compute(configuration, base, found, error)
    type(configuration_type), intent(in) :: configuration
    type(sensitivity_base_type), intent(out) :: base
    type(sensitivity_type), allocatable, intent(out) :: found(:)
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type) :: family
    type(speed_order_type) :: order
    type(error_type), allocatable :: own
    type(progress_type) :: progress
    integer :: k, n, failed

    allocate(family%inner, source=configuration%sensitivity_plan%family)
    family%model = configuration%tasks%model
    family%accuracy = configuration%accuracy
    order%names = configuration%sensitive%name
    order%probes = configuration%probes
    order%accuracy = configuration%accuracy
    order%averaged = configuration%tasks%averaged
    n = size(configuration%sensitivity_plan%paths)
    call solve_base(family, n, order, base, error)
    if (allocated(error)) return
    allocate(found(n))
    failed = huge(failed)
    call progress%start(int(n, int64))
    !$omp parallel do schedule(dynamic, 1) private(own)
    do k = 1, n
      call solve_parameter(family, base, k, found(k), own)
      !$omp critical (input_and_output)
      if (allocated(own) .and. k < failed) then
        failed = k
        call move_alloc(own, error)
      end if
      call progress%add(1_int64)
      !$omp end critical (input_and_output)
    end do
    !$omp end parallel do
    call progress%clear()
  end subroutine compute

end module sensing
