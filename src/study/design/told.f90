!> The goals of one machine as they are told: solved as every machine is, with bounds on their errors, at the condition that is the
!> worst.
module gestell_study_design_told
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_verdict, only: verdict_length, verdict_named, verdict_type, worst_verdict => worst
  use gestell_base_kinds, only: dp
  use gestell_math_series_fourier, only: fourier_series, fourier_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: accelerations, motion_rows => rows_of
  use gestell_model_quantity_driving, only: drive_power, power_rows, torque
  use gestell_study_design_branches, only: measure_branches
  use gestell_study_design_goal, only: components, goal_type, of_machine, of_motion, of_multipliers, of_shaking, of_torque, &
    & plain_values, shaking_error, take_samples
  use gestell_study_design_neighbours, only: at_condition
  use gestell_study_design_problem, only: design_options
  use gestell_study_design_separation, only: find_branches, separation_type
  use gestell_study_frame_model, only: settle
  use gestell_study_measure, only: peak_measure, rows_of, take_measures
  use gestell_study_vibration, only: solve_vibration, vibration_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: tell_goals

  type, public :: told_type
    !> Of every goal and condition, its value and a bound on its error, shapes (goals, conditions); NaN: it could not be told.
    real(dp), allocatable :: values(:, :), errors(:, :)
    !> The verdict on the machine at every condition.
    character(len=9), allocatable :: verdicts(:)
  contains
    procedure :: worst
    procedure :: verdict
  end type told_type

contains

  !> The condition at which goal number `g` exceeds its limit most; 0: its value is not known at any.
  pure integer function worst(self, g, goal)
    class(told_type), intent(in) :: self
    integer, intent(in) :: g
    type(goal_type), intent(in) :: goal

    worst = maxloc(goal%excess(self%values(g, :)), dim=1, mask=ieee_is_finite(self%values(g, :)))
  end function worst

  !> That on all conditions.
  pure function verdict(self)
    class(told_type), intent(in) :: self
    character(len=verdict_length) :: verdict

    type(verdict_type) :: found
    integer :: c

    do c = 1, size(self%verdicts)
      found = worst_verdict(found, verdict_named(self%verdicts(c)))
    end do
    verdict = found%word()
  end function verdict

  !> Of a machine. Error: the goals make no sense.
  subroutine tell_goals(machine, options, goals, told, error)
    type(frame_type), intent(in) :: machine
    type(design_options), intent(in) :: options
    type(goal_type), intent(in) :: goals(:)
    type(told_type), intent(out) :: told
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: run
    type(error_type), allocatable :: failure
    integer :: c

    associate (conditions => size(options%conditions))
      allocate(told%values(size(goals), conditions), told%errors(size(goals), conditions), source=ieee_value(1.0_dp, &
        & ieee_quiet_nan))
      allocate(told%verdicts(conditions))
      told%verdicts = "undecided"
    end associate
    do c = 1, size(options%conditions)
      call at_condition(machine, options%conditions(c), run)
      call tell_rest(goals, run, options, told%values(:, c), told%errors(:, c), error)
      if (allocated(error)) return
      call tell_motion(goals, run, options, told%values(:, c), told%errors(:, c), told%verdicts(c), failure)
    end do
  end subroutine tell_goals

  !> What needs no solution. The forces are sums that may cancel: they are known to the roundings of their terms.
  subroutine tell_rest(goals, run, options, values, errors, error)
    type(goal_type), intent(in) :: goals(:)
    type(frame_type), intent(in) :: run
    type(design_options), intent(in) :: options
    real(dp), intent(inout) :: values(:), errors(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: roundings = 16
    type(goal_type) :: one(1)
    type(separation_type) :: branches
    real(dp), allocatable :: phases(:), samples(:, :, :), slopes(:, :, :), found(:), unused(:, :)
    integer :: g, k, n

    n = 64 * ceiling(max(128, min(4 * run%least_steps, 8192)) / 64.0_dp)
    do g = 1, size(goals)
      one = goals(g)
      select case (goals(g)%about)
      case (of_machine)
        if (goals(g)%is_least()) call find_branches(run, goals(g)%speeds, branches, error)
        if (allocated(error)) return
        call plain_values(goals(g), run, branches, found)
        values(g) = maxval(found)
        if (goals(g)%is_least()) values(g) = max(minval(found), 0.0_dp)
        errors(g) = roundings * epsilon(1.0_dp) * maxval(abs(found + goals(g)%offset))
      case (of_shaking)
        phases = [(real(k, dp) / n, k = 0, n - 1)]
        allocate(samples(n, components(run), 1), slopes(n, components(run), 0))
        call take_samples(one, run, options%probes, phases, reshape([(0.0_dp, k = 1, 3 * run%dofs() * n)], [n, run%dofs(), 3]), &
          & samples, error)
        if (allocated(error)) return
        call measure_branches(goals(g)%measure%kind, goals(g)%measure%band, run%period, samples(:, :, 1), slopes, found, unused)
        values(g) = maxval(found)
        errors(g) = shaking_error(run, goals(g)%measure%quantity)
        deallocate(samples, slopes)
      case default
        cycle
      end select
    end do
  end subroutine tell_rest

  !> What needs the vibration and the multipliers.
  subroutine tell_motion(goals, run, options, values, errors, verdict, error)
    type(goal_type), intent(in) :: goals(:)
    type(frame_type), intent(in) :: run
    type(design_options), intent(in) :: options
    real(dp), intent(inout) :: values(:), errors(:)
    character(len=9), intent(inout) :: verdict
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 64, harmonics = 20
    class(frame_type), allocatable :: frame
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(vibration_type) :: vibration
    real(dp) :: found(2, 1)
    integer :: g, rows

    call settle(run, trim(options%model), options%accuracy, frame, error)
    if (.not. allocated(error)) call solve_floquet(frame, options%accuracy, .true., floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
    if (allocated(error)) return
    verdict = multipliers%verdict()
    do g = 1, size(goals)
      if (goals(g)%about /= of_multipliers) cycle
      values(g) = abs(multipliers%rho(1))
      errors(g) = multipliers%error(1)
    end do
    if (.not. any(goals%about == of_motion .or. goals%about == of_torque)) return
    call rows_of(frame, options%probes, pack([(goals(g)%measure, g = 1, size(goals))], goals%about == of_motion), rows, error)
    if (.not. allocated(error)) call solve_vibration(frame, floquet, points, harmonics, vibration, error, max(rows, accelerations))
    if (allocated(error)) return
    do g = 1, size(goals)
      if (goals(g)%about == of_motion) then
        call take_measures(frame, options%probes, vibration, [goals(g)%measure], found, error)
      else if (goals(g)%about == of_torque) then
        call take_torque(goals(g), frame, vibration, found(:, 1), error)
      else
        cycle
      end if
      if (allocated(error)) return
      values(g) = found(1, 1)
      errors(g) = found(2, 1)
    end do
  end subroutine tell_motion

  subroutine take_torque(goal, frame, vibration, found, error)
    type(goal_type), intent(in) :: goal
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    real(dp), intent(out) :: found(2)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: power(:, :), values(:), unused(:, :), motion(:, :), slopes(:, :, :)
    type(fourier_type) :: series
    logical :: known
    integer :: k, n

    n = size(vibration%motion, 2)
    allocate(power(power_rows, n), slopes(n, 1, 0))
    motion = vibration%motion(:motion_rows(frame%dofs(), accelerations), :)
    call drive_power(frame, [(real(k, dp) / n, k = 0, n - 1)], motion, power, known, vibration%motion_errors%bounds(), found(2))
    if (.not. known) then
      call fatal_error(error, "the mechanism does not tell its energy", failed_computation)
      return
    end if
    call measure_branches(goal%measure%kind, goal%measure%band, frame%period, reshape(power(torque, :), [n, 1]), slopes, values, &
      & unused)
    series = fourier_series(power(torque, :))
    if (goal%measure%kind == peak_measure) found(2) = found(2) + series%beyond()
    ! of the drive, which turns faster than the linkage's crank angle
    found = [maxval(values), found(2)] / frame%mechanism%turns
  end subroutine take_torque

end module gestell_study_design_told
