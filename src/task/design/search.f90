!> Searches for the best design from several starts, and evaluates the result.
module gestell_task_design_search
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_math_optimum_minimax, only: optimum_type
  use gestell_study_design, only: is_convex, bound_gap, prove_conflict, search_from
  use gestell_model_frame, only: frame_type
  use gestell_study_design_goal, only: goal_type
  use gestell_study_design_perturbed_members, only: find_members, joined, members_type
  use gestell_study_design_problem, only: design_options, evaluate_goals, goal_branches_type
  use gestell_study_design_reported_goals, only: report_goals, reported_goals_type
  use gestell_system_family, only: family_type
  use gestell_task_design_improved, only: digits
  use gestell_task_design_plan, only: design_plan_type
  use gestell_task_design_range, only: range_of_lines_type, survey_machine, survey_range, range_survey_type
  use gestell_task_design_starts, only: better, has_machine, set_range_values, search_starts
  use gestell_task_common_executor, only: executor_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  !> A proved conflict of limits counts as rounding error if its relative amount is smaller than this.
  real(dp), parameter :: negligible = 1.0e-9_dp

  public :: find_curve, find_design, objective_at

  !> A point of the trade-off curve between two objectives.
  type, public :: trade_off_point_type
    real(dp) :: values(2) = 0
    real(dp), allocatable :: x(:)
    logical :: converged = .false.
  end type trade_off_point_type

  !> The best design, its goals before and after, and what is known about its optimality.
  type, public :: design_type
    !> Optimum that was reached from each start, shape (starts).
    type(optimum_type), allocatable :: found(:)
    !> Number of the start with the best optimum; 0 if the machine has no vibration at any start.
    integer :: best = 0
    !> Options with the conditions at which the goals are reported. First come the given conditions, then the conditions between
    !> them at which a goal has a maximum.
    type(design_options) :: options
    !> Options with which each goal is evaluated as its worst value over the whole range.
    type(design_options) :: over_range
    !> Parameters of the best design, rounded to the digits that are reported.
    real(dp), allocatable :: x(:)
    !> Upper bound on the difference between the objective and its global minimum, divided by the objective of the machine of the
    !> input.
    real(dp) :: gap = huge(1.0_dp)
    !> If positive, it is proved that every machine within the ranges exceeds some limit by this relative amount or more.
    real(dp) :: conflict = 0
    !> The goals: first the objectives, then the constraints.
    type(goal_type), allocatable :: goals(:)
    !> Values of the goals: `before` for the machine of the input, `after` for the design.
    type(reported_goals_type) :: before, after
    !> Relative increase of the objective if only one parameter is reset to its original value, shape (parameters).
    real(dp), allocatable :: reset_losses(:)
    type(trade_off_point_type), allocatable :: curve(:)
    !> Number of turns that the drive makes in a period.
    integer :: turns = 1
  end type design_type

contains

  !> Finds the best design and evaluates it. Fails if the goals are invalid, or if the machine at the only start has no vibration.
  !> With several starts, `design%best` is 0 if the machine has no vibration at any of them.
  subroutine find_design(family, plan, machine, design, error, executor)
    !> Family of machines that differ in the design parameters
    class(family_type), intent(in), target :: family
    !> Parameters, goals, conditions and number of starts of the design
    type(design_plan_type), intent(in) :: plan
    !> The machine of the input, with which the design is compared
    type(frame_type), intent(in) :: machine
    !> The best design with its goals
    type(design_type), intent(out) :: design
    type(error_type), allocatable, intent(out) :: error
    !> Distributes the local searches over threads
    class(executor_type), intent(inout), optional :: executor
    type(members_type) :: found
    type(range_survey_type) :: before, after
    type(optimum_type) :: base
    logical :: known
    integer :: k

    call search_starts(family, plan, design%found, error, executor)
    if (allocated(error)) return
    design%turns = plan%turns
    design%over_range = plan%options
    if (plan%covers()) design%over_range%range = range_of_lines_type(lines=plan%lines)
    call survey_machine(machine, plan%options, plan%lines, .true., before, error)
    if (allocated(error)) return
    do k = 1, plan%starts
      if (.not. has_machine(design%found(k))) cycle
      if (design%best == 0) design%best = k
      if (better(design%found(k), design%found(design%best))) design%best = k
    end do
    if (design%best == 0) return
    if (size(plan%lines) > 0 .and. all(plan%base >= plan%options%lower .and. plan%base <= plan%options%upper)) then
      ! The design must not be worse than the machine of the input.
      base = design%found(1)
      ! Numbers that one parameter sets together (key `with`) may differ in the input. The survey therefore uses the machine in
      ! which the parameters have set these numbers.
      call survey_range(family, plan%options, plan%lines, plan%base, .false., after, error)
      if (allocated(error)) return
      call set_range_values(plan%options, after, base)
      if (after%known .and. better(base, design%found(design%best))) then
        base%x = plan%base
        base%converged = .false.
        design%found(1) = base
        design%best = 1
      end if
    end if
    design%x = [(rounded(design%found(design%best)%x(k)), k = 1, size(plan%start))]
    design%goals = plan%options%goals()
    call survey_range(family, plan%options, plan%lines, design%x, .true., after, error)
    if (.not. allocated(error)) call find_members(family, design%x, found, known, error)
    if (allocated(error)) return
    design%options = plan%options
    design%options%conditions = joined(joined(plan%options%conditions, after%conditions), before%conditions)
    call report_goals(machine, design%options, design%goals, design%before, error)
    if (.not. allocated(error)) call report_goals(found%frame, design%options, design%goals, design%after, error)
    if (allocated(error)) return
    call find_gap(plan, design)
    if (.not. design%found(design%best)%feasible .and. is_convex(plan%options, limits=.true.)) then
      call prove_conflict(family, plan%options, design%found(design%best)%x, design%conflict, error)
      if (allocated(error)) return
      if (design%conflict < negligible) design%conflict = 0
    end if
    call find_reset_losses(family, plan, design, error)
  end subroutine find_design

  !> Computes the gap of the best design: a proved bound on the distance of its objective from the global minimum. The bound
  !> results from the duality gap of a convex problem, and from the fact that all objectives except `added_mass` cannot be
  !> negative.
  subroutine find_gap(plan, design)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(inout) :: design
    real(dp) :: values(size(plan%options%objectives)), before
    integer :: g

    values = [(design%before%values(g, max(1, design%before%worst(g, plan%options%objectives(g)))), g = 1, size(values))]
    before = plan%options%combined(values)
    associate (best => design%found(design%best))
      if (.not. before > 0) before = best%objective
      if (.not. before > 0) return
      if (all(plan%options%objectives%measure%quantity /= "added_mass")) design%gap = best%objective / before
      if (plan%convex) design%gap = min(design%gap, bound_gap(plan%options, best) / before)
    end associate
  end subroutine find_gap

  !> The number x, rounded to the digits that are reported. With rounded parameters a user can reproduce the reported values.
  real(dp) function rounded(x)
    real(dp), intent(in) :: x
    character(len=:), allocatable :: digits_text

    digits_text = concise(x, digits)
    read (digits_text, *) rounded
  end function rounded

  !> Computes, for each parameter, the relative increase of the objective if only this parameter is reset to its original value;
  !> NaN if the resulting machine does not exist.
  subroutine find_reset_losses(family, plan, design, error)
    class(family_type), intent(in) :: family
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(inout) :: design
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: x(size(design%x)), best
    integer :: k

    allocate(design%reset_losses(size(design%x)))
    best = objective_at(family, design%over_range, design%x, error)
    do k = 1, size(x)
      if (allocated(error)) return
      x = design%x
      x(k) = plan%base(k)
      design%reset_losses(k) = objective_at(family, design%over_range, x, error) / best - 1
    end do
  end subroutine find_reset_losses

  !> Objective of the machine with the parameters `x`; NaN if this machine does not exist or has no vibration. Fails if the goals
  !> are invalid.
  real(dp) function objective_at(family, options, x, error) result(value)
    class(family_type), intent(in) :: family
    type(design_options), intent(in) :: options
    real(dp), intent(in) :: x(:)
    type(error_type), allocatable, intent(out) :: error
    type(goal_branches_type) :: at
    integer :: g

    value = ieee_value(value, ieee_quiet_nan)
    call evaluate_goals(family, options, options%objectives, x, .false., at, error)
    if (allocated(error) .or. .not. at%known) return
    value = options%combined([(maxval(at%value, at%group == g), g = 1, size(options%objectives))])
  end function objective_at

  !> Computes the trade-off curve: the minimum of the first objective for several upper limits on the second objective. The
  !> largest limit is the value of the second objective at the minimum of the first one. The smallest limit is the minimum of the
  !> second objective.
  subroutine find_curve(family, plan, design, error)
    class(family_type), intent(in) :: family
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(inout) :: design
    type(error_type), allocatable, intent(out) :: error
    type(design_options) :: options
    type(optimum_type) :: ends(2), found
    type(goal_type) :: limit
    real(dp) :: low, high
    integer :: k

    options = design%over_range
    do k = 1, 2
      options%objectives = design%over_range%objectives(k:k)
      call search_from(family, options, design%x, ends(k), error)
      if (allocated(error)) return
    end do
    options%objectives = design%over_range%objectives(1:1)
    limit = design%over_range%objectives(2)
    limit%sense = 1
    low = ends(2)%objective / design%over_range%objectives(2)%weight
    high = second(ends(1)%x)
    found%x = design%x
    allocate(design%curve(plan%curve))
    do k = 1, plan%curve
      if (allocated(error)) return
      limit%limit = high + (low - high) * real(k - 1, dp) / (plan%curve - 1)
      options%constraints = [plan%options%constraints, limit]
      call search_from(family, options, (found%x), found, error)
      if (allocated(error)) return
      design%curve(k)%x = found%x
      design%curve(k)%converged = found%converged .and. found%feasible
      design%curve(k)%values = [found%objective / design%over_range%objectives(1)%weight, second(found%x)]
    end do

  contains

    real(dp) function second(x)
      real(dp), intent(in) :: x(:)
      type(goal_branches_type) :: at

      second = ieee_value(second, ieee_quiet_nan)
      call evaluate_goals(family, options, design%over_range%objectives(2:2), x, .false., at, error)
      if (.not. allocated(error) .and. at%known) second = maxval(at%value)
    end function second

  end subroutine find_curve

end module gestell_task_design_search
