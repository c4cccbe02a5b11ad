!> Computes the goals of one machine for the report. Under every condition they are computed by full solutions with error bounds.
module gestell_study_design_reported_goals
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_verdict, only: undecided, verdict_type, worst_verdict => worst
  use gestell_base_kinds, only: dp
  use gestell_math_series_fourier, only: fourier_series, fourier_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: accelerations, motion_rows => rows_of
  use gestell_model_quantity_driving, only: drive_power, power_rows, torque
  use gestell_study_design_branches, only: measure_branches
  use gestell_study_design_goal, only: components, goal_type, machine_goal, motion_goal, multiplier_goal, shaking_goal, &
    & torque_goal, plain_values, shaking_error, sample_goals
  use gestell_study_design_perturbed_members, only: at_condition
  use gestell_study_design_problem, only: design_options
  use gestell_study_design_separation, only: find_branches, separation_type
  use gestell_study_frame_model, only: settle
  use gestell_study_measure, only: peak_measure, solve_measures
  use gestell_study_vibration, only: vibration_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: report_goals

  !> Goals and verdicts of one machine under all conditions.
  type, public :: reported_goals_type
    !> Value of every goal under every condition, and a bound on its error, shapes (goals, conditions); NaN if unknown
    real(dp), allocatable :: values(:, :), errors(:, :)
    !> Verdict on the machine under every condition, shape (conditions)
    type(verdict_type), allocatable :: verdicts(:)
  contains
    procedure :: worst, verdict
  end type reported_goals_type

contains

  !> Index of the condition under which goal number `g` exceeds its limit most; 0 if the goal is unknown under all conditions.
  pure integer function worst(self, g, goal)
    class(reported_goals_type), intent(in) :: self
    integer, intent(in) :: g
    type(goal_type), intent(in) :: goal

    worst = maxloc(goal%excess(self%values(g, :)), dim=1, mask=ieee_is_finite(self%values(g, :)))
  end function worst

  !> The worst of the verdicts under all conditions.
  pure type(verdict_type) function verdict(self)
    class(reported_goals_type), intent(in) :: self
    integer :: c

    do c = 1, size(self%verdicts)
      verdict = worst_verdict(verdict, self%verdicts(c))
    end do
  end function verdict

  !> Computes the goals and verdicts of a machine under all conditions of `options`. Fails if the goals are invalid.
  subroutine report_goals(machine, options, goals, reported, error)
    !> The machine, before a model of the frame is applied
    type(frame_type), intent(in) :: machine
    type(design_options), intent(in) :: options
    !> The goals to be computed
    type(goal_type), intent(in) :: goals(:)
    type(reported_goals_type), intent(out) :: reported
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: run
    type(error_type), allocatable :: failure
    integer :: c, n

    n = size(options%conditions)
    allocate(reported%values(size(goals), n), reported%errors(size(goals), n), source=ieee_value(1.0_dp, ieee_quiet_nan))
    allocate(reported%verdicts(n), source=undecided)
    associate (values => reported%values, errors => reported%errors)
      do c = 1, n
        call at_condition(machine, options%conditions(c), run)
        call report_without_motion(goals, run, options, values(:, c), errors(:, c), error)
        if (allocated(error)) return
        call report_with_motion(goals, run, options, values(:, c), errors(:, c), reported%verdicts(c), failure)
      end do
    end associate
  end subroutine report_goals

  !> Computes the goals that are properties of the machine or shaking forces on rigid ground. Shaking forces are sums whose terms
  !> may cancel, so their error is the rounding error of the terms.
  subroutine report_without_motion(goals, run, options, values, errors, error)
    type(goal_type), intent(in) :: goals(:)
    type(frame_type), intent(in) :: run
    type(design_options), intent(in) :: options
    real(dp), intent(inout) :: values(:), errors(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: roundings = 16
    type(separation_type) :: branches
    real(dp), allocatable :: samples(:, :, :), slopes(:, :, :), q(:, :, :), computed(:), unused(:, :)
    integer :: g, k, n

    n = 64 * ceiling(max(128, min(4 * run%least_steps, 8192)) / 64.0_dp)
    allocate(samples(n, components(run), 1), slopes(n, components(run), 0))
    allocate(q(n, run%dofs(), 3), source=0.0_dp)
    do g = 1, size(goals)
      select case (goals(g)%about)
      case (machine_goal)
        if (goals(g)%is_minimum()) call find_branches(run, goals(g)%speeds, branches, error)
        if (allocated(error)) return
        call plain_values(goals(g), run, branches, computed)
        values(g) = maxval(computed)
        if (goals(g)%is_minimum()) values(g) = max(minval(computed), 0.0_dp)
        errors(g) = roundings * epsilon(1.0_dp) * maxval(abs(computed + goals(g)%offset))
      case (shaking_goal)
        call sample_goals(goals(g:g), run, options%probes, [(real(k, dp) / n, k = 0, n - 1)], q, samples, error)
        if (allocated(error)) return
        call measure_branches(goals(g)%measure%kind, goals(g)%measure%band, run%period, samples(:, :, 1), slopes, computed, unused)
        values(g) = maxval(computed)
        errors(g) = shaking_error(run, goals(g)%measure%quantity)
      case default ! other goals need the vibration
      end select
    end do
  end subroutine report_without_motion

  !> Computes the goals that need the vibration or the multipliers.
  subroutine report_with_motion(goals, run, options, values, errors, verdict, error)
    type(goal_type), intent(in) :: goals(:)
    type(frame_type), intent(in) :: run
    type(design_options), intent(in) :: options
    real(dp), intent(inout) :: values(:), errors(:)
    type(verdict_type), intent(inout) :: verdict
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), allocatable :: frame
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(vibration_type) :: vibration
    real(dp), allocatable :: computed(:, :)
    integer, allocatable :: moving(:)
    integer :: g

    call settle(run, options%model, options%accuracy, frame, error)
    if (.not. allocated(error)) call solve_floquet(frame, options%accuracy, .true., floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
    if (allocated(error)) return
    verdict = multipliers%judge()
    where (goals%about == multiplier_goal)
      values = abs(multipliers%rho(1))
      errors = multipliers%error(1)
    end where
    moving = pack([(g, g = 1, size(goals))], goals%about == motion_goal)
    if (size(moving) == 0 .and. all(goals%about /= torque_goal)) return
    allocate(computed(2, size(moving)))
    call solve_measures(frame, floquet, options%probes, (goals(moving)%measure), vibration, computed, error, accelerations)
    if (allocated(error)) return
    values(moving) = computed(1, :)
    errors(moving) = computed(2, :)
    do g = 1, size(goals)
      if (goals(g)%about == torque_goal) call measure_torque(goals(g), frame, vibration, values(g), errors(g), error)
      if (allocated(error)) return
    end do
  end subroutine report_with_motion

  !> Computes a measure of the drive's torque and a bound on its error.
  subroutine measure_torque(goal, frame, vibration, value, bound, error)
    type(goal_type), intent(in) :: goal
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    real(dp), intent(out) :: value, bound
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: power(:, :), values(:), unused(:, :), slopes(:, :, :)
    type(fourier_type) :: series
    logical :: known
    integer :: k, n

    n = size(vibration%motion, 2)
    allocate(power(power_rows, n), slopes(n, 1, 0))
    call drive_power(frame, [(real(k, dp) / n, k = 0, n - 1)], (vibration%motion(:motion_rows(frame%dofs(), accelerations), :)), &
      & power, known, vibration%motion_errors%bounds(), bound)
    if (.not. known) then
      call fatal_error(error, "the mechanism does not provide its kinetic energy", failed_computation)
      return
    end if
    call measure_branches(goal%measure%kind, goal%measure%band, frame%period, reshape(power(torque, :), [n, 1]), slopes, values, &
      & unused)
    series = fourier_series(power(torque, :))
    if (goal%measure%kind == peak_measure) bound = bound + series%beyond()
    ! the value refers to the shaft of the drive, which makes `turns` turns in the period
    value = maxval(values) / frame%mechanism%turns
    bound = bound / frame%mechanism%turns
  end subroutine measure_torque

end module gestell_study_design_reported_goals
