!> A design as a minimax problem: goals at all conditions under which the machine is run, each the greatest of its branches.
module gestell_study_design_problem
  use gestell_base_error, only: error_type, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_math_optimum_minimax, only: branches_type, minimax_problem
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_rows, only: probe_type
  use gestell_study_design_branches, only: measure_branches
  use gestell_study_design_exponents, only: solve_exponents
  use gestell_study_design_goal, only: components, goal_type, of_machine, of_multipliers, of_torque, plain_values, &
    & take_samples
  use gestell_study_design_moments, only: moments_type
  use gestell_study_design_motion, only: beside, coarse, motion_type, solve_motion, solve_slopes, usual_phases
  use gestell_study_design_neighbours, only: at_condition, condition_type, find_neighbours, neighbours_type, remember, step_type
  use gestell_study_design_separation, only: find_branches, separation_type
  use gestell_study_family, only: family_type
  use gestell_study_measure, only: rms_measure
  implicit none (type, external)
  private

  public :: evaluate_goals, is_squared

  !> What is asked of a design. The objective is the sum of the `objectives`, each times its weight, or the largest of them.
  type, public :: design_order_type
    type(goal_type), allocatable :: objectives(:), constraints(:)
    logical :: largest = .false.
    type(condition_type), allocatable :: conditions(:)
    type(probe_type), allocatable :: probes(:)
    character(len=11) :: model = "exact"
    type(accuracy_type) :: accuracy
    !> Ranges of the parameters, shape (parameters).
    real(dp), allocatable :: lower(:), upper(:)
    !> Which of them is the first of its link, and what of it each is; shapes (parameters).
    integer, allocatable :: body(:), part(:)
    !> The links that they are of, 0: of none alone, and their units in SI; shapes (parameters). Where they are not allocated, all
    !> neighbours are members of the family.
    integer, allocatable :: link(:)
    real(dp), allocatable :: unit(:)
  contains
    procedure :: steps
  end type design_order_type

  !> By so much, relative to it, the search stays within a limit, so that it is met when the search ends within its tolerance.
  real(dp), parameter, public :: inside = 2.0e-6_dp

  !> Branches of goals, each at a condition, shape (branches); `side`: 1: it keeps below a limit, -1: above.
  type, extends(branches_type), public :: goal_branches_type
    integer, allocatable :: condition(:), side(:)
  end type goal_branches_type

  !> Groups of branches: the objectives, or one where the largest counts, then the constraints, whose zero is their limit, and those
  !> of the coordinates.
  type, extends(minimax_problem), public :: design_problem
    class(family_type), pointer :: family => null()
    type(design_order_type) :: order
    type(moments_type) :: moments
    !> Whether the square of the one objective is taken, an rms: it has derivatives where nothing is left too, and is nearly a
    !> quadratic function of masses.
    logical :: squared = .false.
  contains
    procedure :: evaluate
  end type design_problem

contains

  subroutine evaluate(self, x, gradients, at, error)
    class(design_problem), intent(inout) :: self
    real(dp), intent(in) :: x(:)
    logical, intent(in) :: gradients
    type(branches_type), intent(out) :: at
    type(error_type), allocatable, intent(out) :: error
    type(goal_branches_type) :: own
    type(goal_type) :: goals(size(self%order%objectives) + size(self%order%constraints))
    real(dp) :: parameters(size(x))
    integer :: i, g, n

    parameters = self%moments%to(x)
    n = size(self%order%objectives)
    goals(:n) = self%order%objectives
    goals(n + 1:) = self%order%constraints
    call evaluate_goals(self%family, self%order, goals, parameters, gradients, own, error)
    at%known = own%known
    if (allocated(error) .or. .not. at%known) return
    allocate(at%group, source=own%group)
    allocate(at%value, source=own%value)
    if (gradients) allocate(at%slope, source=own%slope)
    do i = 1, size(own%group)
      g = own%group(i)
      associate (goal => goals(g))
        if (g <= n) then
          at%group(i) = merge(1, g, self%order%largest)
          ! an objective has no limit, unless it stands for what a limit is exceeded by
          at%value(i) = goal%weight * own%side(i) * (own%value(i) - goal%limit)
          if (gradients) at%slope(:, i) = goal%weight * own%side(i) * own%slope(:, i)
          if (.not. self%squared) cycle
          if (gradients) at%slope(:, i) = 2 * at%value(i) * at%slope(:, i)
          at%value(i) = at%value(i)**2
        else
          at%group(i) = g - n + self%objectives
          at%value(i) = own%side(i) * (own%value(i) - goal%limit)
          if (goal%sense /= 0) at%value(i) = at%value(i) + inside * abs(goal%limit)
          if (gradients) at%slope(:, i) = own%side(i) * own%slope(:, i)
        end if
      end associate
    end do
    if (gradients) call self%moments%turn_slopes(parameters, at%slope)
    call self%moments%add_limits(x, self%objectives + size(self%order%constraints) + 1, at)
  end subroutine evaluate

  !> How the parameters are changed for derivatives, shape (parameters).
  pure function steps(self)
    class(design_order_type), intent(in) :: self
    type(step_type) :: steps(size(self%lower))
    integer :: k

    steps%range = self%upper - self%lower
    if (allocated(self%link)) then
      do k = 1, size(steps)
        steps(k)%link = self%link(k)
        steps(k)%part = self%part(k)
        steps(k)%unit = self%unit(k)
      end do
    end if
  end function steps

  !> Whether the objective is one rms.
  pure logical function is_squared(order)
    type(design_order_type), intent(in) :: order

    is_squared = size(order%objectives) == 1
    if (is_squared) is_squared = order%objectives(1)%is_periodic() .and. order%objectives(1)%measure%kind == rms_measure &
      & .and. .not. abs(order%objectives(1)%limit) > 0
  end function is_squared

  !> The branches of `goals`, whose numbers are their groups, at x, over all conditions; not known where there is no such machine,
  !> or no vibration. Errors: x or goals make no sense.
  subroutine evaluate_goals(family, order, goals, x, gradients, at, error)
    class(family_type), intent(in) :: family
    type(design_order_type), intent(in) :: order
    type(goal_type), intent(in) :: goals(:)
    real(dp), intent(in) :: x(:)
    logical, intent(in) :: gradients
    type(goal_branches_type), intent(out) :: at
    type(error_type), allocatable, intent(out) :: error
    type(neighbours_type) :: neighbours
    type(motion_type), allocatable :: motions(:)
    type(goal_branches_type) :: values
    logical :: counts(size(order%conditions))
    integer :: c

    call begin(at)
    call begin(values)
    if (gradients) then
      call find_neighbours(family, x, neighbours, at%known, error, order%steps())
    else
      call find_neighbours(family, x, neighbours, at%known, error)
    end if
    if (allocated(error) .or. .not. at%known) return
    call remember(neighbours, usual_phases(), any(goals%about == of_torque))
    allocate(motions(size(order%conditions)))
    do c = 1, size(motions)
      call solve_motion(neighbours, order%conditions(c), trim(order%model), order%accuracy, any(goals%needs_motion()), motions(c), &
        & error)
      if (.not. allocated(error)) call add_condition(neighbours, motions(c), order, goals, c, values, error)
      if (allocated(error)) exit
    end do
    if (.not. allocated(error) .and. gradients) then
      counts = near_the_greatest(goals, values, size(motions))
      do c = 1, size(motions)
        if (.not. counts(c)) cycle
        call solve_slopes(neighbours, trim(order%model), order%accuracy, any(goals%needs_motion()), motions(c), error)
        if (.not. allocated(error)) call add_condition(neighbours, motions(c), order, goals, c, at, error)
        if (allocated(error)) exit
      end do
    else if (.not. allocated(error)) then
      at = values
    end if
    if (.not. allocated(error)) return
    at%known = .false.
    if (error%code /= invalid_input) deallocate(error)

  contains

    subroutine begin(branches)
      type(goal_branches_type), intent(out) :: branches

      allocate(branches%group(0), branches%condition(0), branches%side(0), branches%value(0), branches%slope(size(x), 0))
    end subroutine begin

  end subroutine evaluate_goals

  !> The conditions where a goal is near the worst of all: at the others it cannot become that within a step that the model of the
  !> problem is good for; should it, the step is shortened.
  pure function near_the_greatest(goals, values, conditions) result(counts)
    type(goal_type), intent(in) :: goals(:)
    type(goal_branches_type), intent(in) :: values
    integer, intent(in) :: conditions
    logical :: counts(conditions)
    real(dp), parameter :: near = 0.25_dp
    real(dp) :: worst, excess(size(values%value))
    integer :: g, i

    counts = .false.
    do g = 1, size(goals)
      excess = values%side * (values%value - goals(g)%limit)
      i = maxloc(excess, dim=1, mask=values%group == g)
      worst = excess(i) - near * abs(values%value(i))
      do i = 1, size(excess)
        if (values%group(i) == g .and. excess(i) >= worst) counts(values%condition(i)) = .true.
      end do
    end do
  end function near_the_greatest

  !> Adds the branches of the goals at one condition.
  subroutine add_condition(neighbours, motion, order, goals, condition, at, error)
    type(neighbours_type), intent(in) :: neighbours
    type(motion_type), intent(in) :: motion
    type(design_order_type), intent(in) :: order
    type(goal_type), intent(in) :: goals(:)
    integer, intent(in) :: condition
    type(goal_branches_type), intent(inout) :: at
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: samples(size(motion%phases), components(motion%frame), size(goals))
    real(dp), allocatable :: slopes(:, :, :, :), values(:), changes(:, :)
    logical, allocatable :: sides(:, :)
    integer :: g, i, s

    allocate(slopes(size(samples, 1), size(samples, 2), size(goals), motion%parameters()), source=0.0_dp)
    if (any(goals%is_periodic())) then
      call take_samples(goals, motion%frame, order%probes, motion%phases, motion%q, samples, error)
      if (.not. allocated(error)) call differentiate_samples(neighbours, motion, order%probes, goals, samples, slopes, error)
      if (allocated(error)) return
    end if
    do g = 1, size(goals)
      select case (goals(g)%about)
      case (of_multipliers)
        call solve_exponents(neighbours, motion, coarse(order%accuracy), values, changes, error)
      case (of_machine)
        call differentiate_plain(neighbours, motion, goals(g), values, changes, error)
      case default
        call measure_branches(goals(g)%measure%kind, goals(g)%measure%band, motion%frame%period, samples(:, :, g), &
          & slopes(:, :, g, :), values, changes)
      end select
      if (allocated(error)) return
      sides = goals(g)%sides(values)
      do s = 1, 2
        call append(at, g, condition, 3 - 2 * s, pack([(i, i = 1, size(values))], sides(:, s)), values, changes)
      end do
    end do
  end subroutine add_condition

  !> Adds the `chosen` ones of a goal's branches at a condition.
  pure subroutine append(at, group, condition, side, chosen, values, changes)
    type(goal_branches_type), intent(inout) :: at
    integer, intent(in) :: group, condition, side, chosen(:)
    real(dp), intent(in) :: values(:), changes(:, :)
    real(dp), allocatable :: slope(:, :)
    integer :: n, i

    n = size(at%value)
    allocate(slope(size(at%slope, 1), n + size(chosen)), source=0.0_dp)
    slope(:, :n) = at%slope
    slope(:size(changes, 1), n + 1:) = changes(:, chosen)
    call move_alloc(slope, at%slope)
    at%group = [at%group, [(group, i = 1, size(chosen))]]
    at%condition = [at%condition, [(condition, i = 1, size(chosen))]]
    at%side = [at%side, [(side, i = 1, size(chosen))]]
    at%value = [at%value, values(chosen)]
  end subroutine append

  !> Derivatives of the goals' samples, shape (phases, components, goals, parameters), by the neighbours with their motions.
  subroutine differentiate_samples(neighbours, motion, probes, goals, samples, slopes, error)
    type(neighbours_type), intent(in) :: neighbours
    type(motion_type), intent(in) :: motion
    type(probe_type), intent(in) :: probes(:)
    type(goal_type), intent(in) :: goals(:)
    real(dp), intent(in) :: samples(:, :, :)
    real(dp), intent(out) :: slopes(:, :, :, :)
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), allocatable :: frame
    real(dp) :: q(size(motion%phases), size(motion%q, 2), 0:2), other(size(samples, 1), size(samples, 2), size(goals))
    integer :: i, k

    do k = 1, size(slopes, 4)
      slopes(:, :, :, k) = neighbours%weight(0, k) * samples
      do i = 1, 2
        q = motion%q + neighbours%distance(i, k) * motion%slope(:, :, :, k)
        call beside(neighbours, motion%frame, motion, q, k, i, frame)
        call take_samples(goals, frame, probes, motion%phases, q, other, error)
        if (allocated(error)) return
        slopes(:, :, :, k) = slopes(:, :, :, k) + neighbours%weight(i, k) * other
      end do
    end do
  end subroutine differentiate_samples

  !> A number of the machine and its derivatives, shape (parameters, values). Error: as of `find_branches`.
  subroutine differentiate_plain(neighbours, motion, goal, values, changes, error)
    type(neighbours_type), intent(in) :: neighbours
    type(motion_type), intent(in) :: motion
    type(goal_type), intent(in) :: goal
    real(dp), allocatable, intent(out) :: values(:), changes(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: run
    type(separation_type) :: branches
    real(dp), allocatable :: other(:)
    integer :: i, k

    call at_condition(neighbours%frame, motion%condition, run)
    if (goal%is_least()) call find_branches(run, goal%speeds, branches, error)
    if (allocated(error)) return
    call plain_values(goal, run, branches, values)
    allocate(changes(motion%parameters(), size(values)))
    do k = 1, size(changes, 1)
      changes(k, :) = neighbours%weight(0, k) * values
      do i = 1, 2
        call at_condition(neighbours%beside(i, k), motion%condition, run)
        call plain_values(goal, run, branches, other)
        changes(k, :) = changes(k, :) + neighbours%weight(i, k) * other
      end do
    end do
  end subroutine differentiate_plain

end module gestell_study_design_problem
