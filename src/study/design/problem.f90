!> Formulates a design as a minimax problem. Under every operating condition each goal is the maximum of its branches.
module gestell_study_design_problem
  use gestell_base_error, only: error_type, invalid_input
  use gestell_base_first_error, only: first_error_type
  use gestell_base_kinds, only: dp
  use gestell_math_optimum_minimax, only: branches_type, minimax_problem
  use gestell_study_design_evaluation, only: add_condition, add_maximum, design_options, goal_branches_type, no_branches, &
    & range_type, top_type
  use gestell_study_design_goal, only: goal_type, torque_goal
  use gestell_study_design_moments, only: moments_type
  use gestell_study_design_motion, only: motion_type, solve_motion, solve_slopes, default_phases
  use gestell_study_design_perturbed_members, only: condition_type, find_members, members_type, remember, step_type
  use gestell_system_family, only: family_type
  use gestell_study_measure, only: rms_measure
  implicit none (type, external)
  private

  public :: design_options, evaluate_goals, goal_branches_type, is_squared, decide_inversion

  !> A step of the search is rejected if its objective exceeds the smallest objective so far by this factor. Objectives above this
  !> limit need not be exact.
  real(dp), parameter :: refused = 1.5_dp
  !> Objectives (plus `shift`) that are smaller than this value are replaced by it before their inverse is computed.
  real(dp), parameter :: tiny_part = 1.0e-100_dp

  !> Relative margin that the search keeps to each limit. With the margin a limit is still met if the search ends within its
  !> tolerance.
  real(dp), parameter, public :: inside = 2.0e-6_dp

  !> The minimax problem of a design. Its groups of branches are the objectives (one group if `options%largest` is true), the
  !> constraints, and the limits of the coordinates. A constraint is met if its branches are not positive.
  type, extends(minimax_problem), public :: design_problem
    class(family_type), pointer :: family => null()
    type(design_options) :: options
    type(moments_type) :: moments
    !> True if the search minimises the square of the single objective, an rms value. The square has derivatives at zero and is
    !> nearly a quadratic function of masses
    logical :: squared = .false.
    !> True if the search minimises -1 / (objective + `shift`). If a resonance approaches the end of a range, the objective rises
    !> like 1 / distance, so its inverse is nearly linear. Upper limits on vibrations over a range are inverted in the same way
    logical :: inverted = .false.
    !> The smallest objective of all machines that were evaluated
    real(dp), private :: least = huge(1.0_dp)
    !> Number added to the objective before it is inverted
    real(dp) :: shift = 0
    !> Parameters of the last machine evaluated over a range. They are kept because an accepted step is evaluated again with
    !> derivatives
    real(dp), allocatable, private :: last_x(:)
    !> Branches of the last machine that was evaluated over a range
    type(goal_branches_type), private :: last
  contains
    procedure :: evaluate
  end type design_problem

contains

  !> Evaluates the branches of all objectives and constraints for the machine with the coordinates x. Computes derivatives if
  !> `gradients` is true. Fails if x or the goals are invalid.
  subroutine evaluate(self, x, gradients, at, error)
    class(design_problem), intent(inout) :: self
    real(dp), intent(in) :: x(:)
    logical, intent(in) :: gradients
    type(branches_type), intent(out) :: at
    type(error_type), allocatable, intent(out) :: error
    type(goal_branches_type) :: own
    type(goal_type), allocatable :: goals(:)
    real(dp) :: parameters(size(x)), worst
    logical :: evaluated_last
    integer :: i, g, n

    parameters = self%moments%to(x)
    worst = -huge(worst)
    n = size(self%options%objectives)
    goals = self%options%goals()
    evaluated_last = allocated(self%last_x)
    if (evaluated_last) evaluated_last = all(abs(self%last_x - parameters) <= 0)
    if (evaluated_last) then
      own = self%last
    else
      if (self%inverted .and. self%constraints == 0 .and. self%least < huge(self%least)) self%options%range%enough &
        & = (refused * (self%least + self%shift) - self%shift) / goals%weight
      call evaluate_goals(self%family, self%options, goals, parameters, gradients .or. allocated(self%options%range), own, error)
    end if
    if (allocated(self%options%range) .and. .not. allocated(error)) then
      self%last_x = parameters
      self%last = own
    end if
    at%known = own%known
    if (allocated(error) .or. .not. at%known) return
    allocate(at%group, source=own%group)
    allocate(at%value, source=own%value)
    if (gradients) allocate(at%slope, source=own%slope)
    do i = 1, size(own%group)
      g = own%group(i)
      associate (goal => goals(g))
        if (g <= n) then
          at%group(i) = merge(1, g, self%options%largest)
          ! an objective has no limit, unless it is the excess over a limit
          at%value(i) = goal%weight * own%side(i) * (own%value(i) - goal%limit)
          if (gradients) at%slope(:, i) = goal%weight * own%side(i) * own%slope(:, i)
          if (self%inverted) then
            worst = max(worst, at%value(i))
            at%value(i) = max(at%value(i) + self%shift, tiny_part)
            if (gradients) at%slope(:, i) = at%slope(:, i) / at%value(i)**2
            at%value(i) = -1 / at%value(i)
          else if (self%squared) then
            if (gradients) at%slope(:, i) = 2 * at%value(i) * at%slope(:, i)
            at%value(i) = at%value(i)**2
          end if
        else
          at%group(i) = g - n + self%objectives
          at%value(i) = own%side(i) * (own%value(i) - goal%limit)
          if (gradients) at%slope(:, i) = own%side(i) * own%slope(:, i)
          if (allocated(self%options%range) .and. goal%sense > 0 .and. goal%is_periodic() .and. own%value(i) > 0) then
            ! the inverted limit equals the original limit to first order where the limit is reached
            if (gradients) at%slope(:, i) = (goal%limit / own%value(i))**2 * at%slope(:, i)
            at%value(i) = goal%limit / own%value(i) * at%value(i)
          end if
          if (goal%sense /= 0) at%value(i) = at%value(i) + inside * abs(goal%limit)
        end if
      end associate
    end do
    if (self%inverted) self%least = min(self%least, worst)
    if (gradients) call self%moments%turn_slopes(parameters, at%slope)
    call self%moments%add_limits(x, self%objectives + size(self%options%constraints) + 1, at)

  end subroutine evaluate

  !> Decides whether the search minimises the inverse of the objective. It does so if the objective is a maximum of vibrations over
  !> a range.
  pure subroutine decide_inversion(problem)
    type(design_problem), intent(inout) :: problem

    associate (goals => problem%options%objectives)
      if (.not. allocated(problem%options%range) .or. problem%objectives > 1) return
      problem%inverted = all(goals%is_periodic() .and. goals%sense > 0)
      ! the inverted objective is the relative excess over a limit, plus 1
      if (any(abs(goals%limit) > 0)) then
        problem%shift = 1
        problem%inverted = problem%inverted .and. all(abs(goals%weight * goals%limit - 1) < 1.0e-9_dp)
      end if
      if (problem%inverted) problem%squared = .false.
    end associate
  end subroutine decide_inversion

  !> True if there is only one objective, an rms value without a limit.
  pure logical function is_squared(options)
    type(design_options), intent(in) :: options

    is_squared = size(options%objectives) == 1
    if (is_squared) is_squared = options%objectives(1)%is_periodic() .and. options%objectives(1)%measure%kind == rms_measure &
      & .and. .not. abs(options%objectives(1)%limit) > 0
  end function is_squared

  !> Evaluates the branches of `goals` for the machine at x, under all conditions or over the range of `options`. Fails if x or the
  !> goals are invalid.
  subroutine evaluate_goals(family, options, goals, x, gradients, at, error)
    !> The family of machines
    class(family_type), intent(in) :: family
    !> Conditions or range of the design, and settings for the computation
    type(design_options), intent(in) :: options
    !> The goals; the branches of goal number g form group g
    type(goal_type), intent(in) :: goals(:)
    !> Parameters of the machine
    real(dp), intent(in) :: x(:)
    !> True if derivatives are requested
    logical, intent(in) :: gradients
    !> The branches; `at%known` is false if the machine does not exist or has no vibration
    type(goal_branches_type), intent(out) :: at
    type(error_type), allocatable, intent(out) :: error
    type(members_type) :: members
    type(step_type), allocatable :: steps(:)

    at = no_branches(size(x))
    if (gradients) steps = options%steps()
    call find_members(family, x, members, at%known, error, steps)
    if (allocated(error) .or. .not. at%known) return
    members%setting = options%setting_type
    call remember(members, default_phases(), any(goals%about == torque_goal))
    if (allocated(options%range)) then
      call evaluate_range(members, options%range, goals, gradients, at, error)
    else
      call evaluate_conditions(members, options%conditions, goals, gradients, at, error)
    end if
    if (.not. allocated(error)) return
    at%known = .false.
    if (error%code /= invalid_input) deallocate(error)
  end subroutine evaluate_goals

  !> Evaluates the branches of `goals` under the given conditions. Fails if there is no vibration under one of these conditions.
  subroutine evaluate_conditions(members, conditions, goals, gradients, at, error)
    type(members_type), intent(in) :: members
    type(condition_type), intent(in) :: conditions(:)
    type(goal_type), intent(in) :: goals(:)
    logical, intent(in) :: gradients
    type(goal_branches_type), intent(inout) :: at
    type(error_type), allocatable, intent(out) :: error
    type(motion_type) :: motions(size(conditions))
    type(goal_branches_type) :: values
    type(first_error_type) :: first
    logical :: counts(size(conditions)), moves
    integer :: c

    moves = any(goals%needs_motion())
    !$omp parallel do schedule(dynamic, 1) private(error)
    do c = 1, size(motions)
      call solve_motion(members, conditions(c), moves, motions(c), error)
      call first%take(c, error)
    end do
    !$omp end parallel do
    call move_alloc(first%error, error)
    values = at
    do c = 1, size(motions)
      if (.not. allocated(error)) call add_condition(members, motions(c), goals, c, values, error)
      if (allocated(error)) return
    end do
    if (.not. gradients) then
      at = values
      return
    end if
    counts = near_worst(goals, values, size(motions))
    !$omp parallel do schedule(dynamic, 1) private(error)
    do c = 1, size(motions)
      if (counts(c)) call solve_slopes(members, motions(c), error)
      call first%take(c, error)
    end do
    !$omp end parallel do
    call move_alloc(first%error, error)
    do c = 1, size(motions)
      if (counts(c) .and. .not. allocated(error)) call add_condition(members, motions(c), goals, c, at, error)
      if (allocated(error)) return
    end do
  end subroutine evaluate_conditions

  !> Evaluates the branches of `goals` over the whole range. Fails if there is no vibration at one of the maxima over the range.
  subroutine evaluate_range(members, range, goals, gradients, at, error)
    type(members_type), intent(in) :: members
    class(range_type), intent(in) :: range
    type(goal_type), intent(in) :: goals(:)
    logical, intent(in) :: gradients
    type(goal_branches_type), intent(inout) :: at
    type(error_type), allocatable, intent(out) :: error
    type(top_type), allocatable :: tops(:)
    type(motion_type), allocatable :: motions(:)
    type(first_error_type) :: first
    logical :: moves
    integer :: k

    call range%find_tops(members, goals, tops, at%known, error)
    if (allocated(error) .or. .not. at%known) return
    if (.not. gradients) then
      at%group = tops%goal
      at%condition = [(k, k = 1, size(tops))]
      at%side = [(1, k = 1, size(tops))]
      at%value = tops%excess + goals(tops%goal)%limit
      return
    end if
    moves = any(goals%needs_motion())
    allocate(motions(size(tops)))
    !$omp parallel do schedule(dynamic, 1) private(error)
    do k = 1, size(tops)
      call solve_motion(members, tops(k)%condition, moves, motions(k), error, tops(k)%motion)
      if (.not. allocated(error)) call solve_slopes(members, motions(k), error)
      call first%take(k, error)
    end do
    !$omp end parallel do
    call move_alloc(first%error, error)
    do k = 1, size(tops)
      if (.not. allocated(error)) call add_maximum(members, motions(k), goals(tops(k)%goal), tops(k), k, at, error)
      if (allocated(error)) return
    end do
  end subroutine evaluate_range

  !> True for the conditions under which a goal is close to its worst value. Only these conditions need derivatives: the others
  !> are not expected to become the worst within one step of the search. If one of them does, the step is shortened.
  pure function near_worst(goals, values, conditions) result(counts)
    type(goal_type), intent(in) :: goals(:)
    type(goal_branches_type), intent(in) :: values
    integer, intent(in) :: conditions
    logical :: counts(conditions)
    real(dp), parameter :: near = 0.25_dp
    real(dp) :: excess(size(values%value)), worst(size(goals))
    integer :: g, i

    excess = values%side * (values%value - goals(values%group)%limit)
    do g = 1, size(goals)
      i = maxloc(excess, dim=1, mask=values%group == g)
      if (i > 0) worst(g) = excess(i) - near * abs(values%value(i))
    end do
    counts = .false.
    do i = 1, size(excess)
      if (excess(i) >= worst(values%group(i))) counts(values%condition(i)) = .true.
    end do
  end function near_worst

end module gestell_study_design_problem
