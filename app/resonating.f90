!> The task `resonance`.
module resonating
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_task_configuration, only: configuration_type
  use gestell_task_resonance_report, only: report_resonance, told_of
  use gestell_task_resonance_csv, only: write_resonance
  use gestell_output_report_verdict, only: with_verdict
  use gestell_task_resonance_curve, only: resonance_curve_type, start_curve
  use gestell_study_speed_point, only: reached, solve_speed_point, speed_order_type, speed_point_type
  use locked_family, only: locked_family_type
  use terminal, only: progress_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: run_resonance

contains

  !> Computes the curve over the speeds of the group &sweep and writes its files to `folder`. `report` tells people.
  !> `stable`: the machine is, at all of the speeds.
  subroutine run_resonance(configuration, folder, preamble, report, stable, error)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, preamble(:)
    character(len=:), allocatable, intent(out) :: report
    logical, intent(out) :: stable
    type(error_type), allocatable, intent(out) :: error
    type(resonance_curve_type) :: curve

    call compute_curve(configuration, curve, error)
    stable = .not. allocated(error)
    if (stable) stable = all(curve%points%state == reached)
    if (.not. allocated(error)) call write_resonance(folder, with_verdict(preamble, told_of(curve)), &
      & configuration%quantities, curve, error)
    if (.not. allocated(error)) report = report_resonance(configuration%quantities, curve, configuration%tasks%model)
  end subroutine run_resonance

  !> The resonance curve; the speeds of a round by threads.
  subroutine compute_curve(configuration, curve, error)
    type(configuration_type), intent(in) :: configuration
    type(resonance_curve_type), intent(out) :: curve
    type(error_type), allocatable, intent(out) :: error
    type(locked_family_type) :: family
    type(speed_order_type) :: order
    real(dp), allocatable :: speeds(:)
    integer :: k

    allocate(family%inner, source=configuration%plan%family)
    family%model = configuration%tasks%model
    family%accuracy = configuration%accuracy
    order%names = configuration%quantities%name
    order%probes = configuration%probes
    order%orders = configuration%orders
    order%accuracy = configuration%accuracy
    order%averaged = configuration%tasks%averaged
    associate (axis => configuration%plan%grid%axes(1))
      call start_curve(curve, order, [(axis%value(k), k = 1, axis%count)], error)
    end associate
    if (allocated(error)) return
    do
      call curve%wanted(speeds)
      if (size(speeds) == 0) exit
      call compute_round(family, order, speeds, curve, error)
      if (allocated(error)) return
    end do
    call curve%finish()
  end subroutine compute_curve

  !> Error: that of the first speed that fails.
  subroutine compute_round(family, order, speeds, curve, error)
    type(locked_family_type), intent(in) :: family
    type(speed_order_type), intent(in) :: order
    real(dp), intent(in) :: speeds(:)
    type(resonance_curve_type), intent(inout) :: curve
    type(error_type), allocatable, intent(out) :: error
    type(speed_point_type), allocatable :: points(:)
    type(error_type), allocatable :: own
    type(progress_type) :: progress
    integer :: k, failed

    allocate(points(size(speeds)))
    failed = huge(failed)
    call progress%start(int(size(speeds), int64))
    !$omp parallel do schedule(dynamic, 1) private(own)
    do k = 1, size(speeds)
      call solve_speed_point(family, speeds(k), order, points(k), own)
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
    if (.not. allocated(error)) call curve%add(points)
  end subroutine compute_round

end module resonating
