!> The search for a design from several starts, and what it comes to.
module gestell_task_design_search
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_math_optimum_minimax, only: optimum_type
  use gestell_study_design, only: halton, is_convex, prove, prove_conflict, search_from
  use gestell_model_frame, only: frame_type
  use gestell_study_design_goal, only: goal_type
  use gestell_study_design_neighbours, only: find_neighbours, neighbours_type
  use gestell_study_design_problem, only: design_order_type, evaluate_goals, goal_branches_type
  use gestell_study_design_told, only: tell_goals, told_type
  use gestell_study_family, only: family_type
  use gestell_task_design_improved, only: digits
  use gestell_task_design_plan, only: design_plan_type
  use gestell_task_executor, only: executor_type, spread_over, work_type
  use gestell_task_record, only: record_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  !> A conflict of limits that rounding errors may feign.
  real(dp), parameter :: negligible = 1.0e-9_dp

  public :: find_curve, find_design, is_there, value_of

  !> A point of the curve between two objectives.
  type, public :: trade_type
    real(dp) :: values(2) = 0
    real(dp), allocatable :: x(:)
    logical :: converged = .false.
  end type trade_type

  type, public :: design_type
    !> The optima from all starts, and which is the best; 0: there is no machine at any of them.
    type(optimum_type), allocatable :: found(:)
    integer :: best = 0
    !> The parameters, to the digits that are told.
    real(dp), allocatable :: x(:)
    !> By how much the objective may be above the least, relative to that of the machine of the file.
    real(dp) :: gap = huge(1.0_dp)
    !> The part of it by which every machine is proved to exceed one of the limits; 0: nothing is proved.
    real(dp) :: conflict = 0
    !> Objectives, then constraints, of the machine of the file and of the design.
    type(goal_type), allocatable :: goals(:)
    type(told_type) :: before, after
    !> By what the objective rises where a parameter alone goes back, relative to it.
    real(dp), allocatable :: shares(:)
    type(trade_type), allocatable :: curve(:)
  end type design_type

  !> A piece is a start.
  type, extends(work_type) :: starts_type
    class(family_type), pointer :: family => null()
    type(design_order_type) :: order
    real(dp), allocatable :: starts(:, :)
    type(optimum_type), allocatable :: found(:)
  contains
    procedure :: compute
    procedure :: exchange
  end type starts_type

contains

  !> Errors: there is no machine at any of the starts; the goals make no sense.
  subroutine find_design(family, plan, machine, design, error, executor)
    class(family_type), intent(in), target :: family
    type(design_plan_type), intent(in) :: plan
    !> That of the file.
    type(frame_type), intent(in) :: machine
    type(design_type), intent(out) :: design
    type(error_type), allocatable, intent(out) :: error
    class(executor_type), intent(inout), optional :: executor
    type(starts_type) :: work
    type(neighbours_type) :: found
    logical :: known
    integer :: k

    work%family => family
    work%order = plan%order
    allocate(work%starts(size(plan%start), plan%starts), work%found(plan%starts))
    work%starts(:, 1) = plan%start
    do k = 2, plan%starts
      work%starts(:, k) = plan%order%lower + halton(k - 1, size(plan%start)) * (plan%order%upper - plan%order%lower)
    end do
    call spread_over(work, plan%starts, error, executor)
    if (allocated(error)) return
    call move_alloc(work%found, design%found)
    do k = 1, plan%starts
      if (.not. is_there(design%found(k))) cycle
      if (design%best == 0) design%best = k
      if (better(design%found(k), design%found(design%best))) design%best = k
    end do
    if (design%best == 0) return
    design%x = [(rounded(design%found(design%best)%x(k)), k = 1, size(plan%start))]
    allocate(design%goals(size(plan%order%objectives) + size(plan%order%constraints)))
    design%goals(:size(plan%order%objectives)) = plan%order%objectives
    design%goals(size(plan%order%objectives) + 1:) = plan%order%constraints
    call find_neighbours(family, design%x, found, known, error)
    if (.not. allocated(error)) call tell_goals(machine, plan%order, design%goals, design%before, error)
    if (.not. allocated(error)) call tell_goals(found%frame, plan%order, design%goals, design%after, error)
    if (allocated(error)) return
    call find_gap(plan, design)
    if (.not. design%found(design%best)%feasible .and. is_convex(plan%order, limits=.true.)) then
      call prove_conflict(family, plan%order, design%found(design%best)%x, design%conflict, error)
      if (allocated(error)) return
      if (design%conflict < negligible) design%conflict = 0
    end if
    call find_shares(family, plan, design, error)
  end subroutine find_design

  !> What is proved: of a convex problem; and objectives are never below zero.
  subroutine find_gap(plan, design)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(inout) :: design
    real(dp) :: values(size(plan%order%objectives)), before
    integer :: c, g

    do g = 1, size(values)
      c = max(1, design%before%worst(g, plan%order%objectives(g)))
      values(g) = plan%order%objectives(g)%weight * design%before%values(g, c)
    end do
    before = merge(maxval(values), sum(values), plan%order%largest)
    associate (best => design%found(design%best))
      if (.not. before > 0) before = best%objective
      if (.not. before > 0) return
      if (all(plan%order%objectives%measure%quantity /= "added_mass")) design%gap = best%objective / before
      if (plan%convex) design%gap = min(design%gap, prove(plan%order, best) / before)
    end associate
  end subroutine find_gap

  !> Whether there was a machine at the start.
  pure logical function is_there(optimum)
    type(optimum_type), intent(in) :: optimum

    is_there = allocated(optimum%x)
    if (is_there) is_there = size(optimum%x) > 0
  end function is_there

  !> To the digits that are told, so that what is told is what the numbers give.
  real(dp) function rounded(x)
    real(dp), intent(in) :: x
    character(len=:), allocatable :: typed

    typed = concise(x, digits)
    read (typed, *) rounded
  end function rounded

  !> Limits that are met come before the objective.
  pure logical function better(one, other)
    type(optimum_type), intent(in) :: one, other

    better = one%feasible .and. .not. other%feasible
    if (one%feasible .eqv. other%feasible) better = merge(one%objective < other%objective, one%violation < other%violation, &
      & one%feasible)
  end function better

  recursive subroutine compute(self, k, error)
    class(starts_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call search_from(self%family, self%order, self%starts(:, k), self%found(k), error)
    ! there may be no machine at a start: others are to be had
    if (allocated(error) .and. size(self%found) > 1) then
      if (allocated(self%found(k)%x)) deallocate(self%found(k)%x)
      deallocate(error)
    end if
  end subroutine compute

  subroutine exchange(self, k, record)
    class(starts_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    associate (one => self%found(k))
      call record%pass(one%x)
      call record%pass(one%groups)
      call record%pass(one%price)
      call record%pass(one%bound_price)
      call record%pass(one%slope)
      call record%pass(one%objective)
      call record%pass(one%violation)
      call record%pass(one%stationarity)
      call record%pass(one%slack)
      call record%pass(one%gap)
      call record%pass(one%iterations)
      call record%pass(one%evaluations)
      call record%pass(one%gradients)
      call record%pass(one%converged)
      call record%pass(one%feasible)
    end associate
  end subroutine exchange

  !> The objective with each parameter alone where it was; NaN where there is no such machine.
  subroutine find_shares(family, plan, design, error)
    class(family_type), intent(in) :: family
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(inout) :: design
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: x(size(design%x)), best
    integer :: k

    allocate(design%shares(size(design%x)))
    best = value_of(family, plan, design%x, error)
    do k = 1, size(x)
      if (allocated(error)) return
      x = design%x
      x(k) = plan%base(k)
      design%shares(k) = value_of(family, plan, x, error) / best - 1
    end do
  end subroutine find_shares

  !> The objective at x, NaN where there is none. Error: the goals make no sense.
  real(dp) function value_of(family, plan, x, error) result(value)
    class(family_type), intent(in) :: family
    type(design_plan_type), intent(in) :: plan
    real(dp), intent(in) :: x(:)
    type(error_type), allocatable, intent(out) :: error
    type(goal_branches_type) :: at
    real(dp) :: values(size(plan%order%objectives))
    integer :: g

    value = ieee_value(value, ieee_quiet_nan)
    call evaluate_goals(family, plan%order, plan%order%objectives, x, .false., at, error)
    if (allocated(error) .or. .not. at%known) return
    values = [(plan%order%objectives(g)%weight * maxval(at%value, at%group == g), g = 1, size(values))]
    value = merge(maxval(values), sum(values), plan%order%largest)
  end function value_of

  !> The least of the first objective for levels of the second, from its value where the first is least to its own least: the curve
  !> on which one of them only falls where the other rises.
  subroutine find_curve(family, plan, design, error)
    class(family_type), intent(in) :: family
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(inout) :: design
    type(error_type), allocatable, intent(out) :: error
    type(design_order_type) :: order
    type(optimum_type) :: ends(2), found
    type(goal_type), allocatable :: limits(:)
    real(dp), allocatable :: start(:)
    real(dp) :: low, high
    integer :: k, c

    limits = plan%order%constraints
    do k = 1, 2
      order = plan%order
      order%objectives = plan%order%objectives(k:k)
      call search_from(family, order, design%x, ends(k), error)
      if (allocated(error)) return
    end do
    c = size(limits) + 1
    order = plan%order
    order%objectives = plan%order%objectives(1:1)
    deallocate(order%constraints)
    allocate(order%constraints(c))
    order%constraints(:c - 1) = limits
    order%constraints(c) = plan%order%objectives(2)
    order%constraints(c)%sense = 1
    low = ends(2)%objective / plan%order%objectives(2)%weight
    high = second(ends(1)%x)
    allocate(design%curve(plan%curve))
    do k = 1, plan%curve
      if (allocated(error)) return
      order%constraints(c)%limit = high + (low - high) * real(k - 1, dp) / (plan%curve - 1)
      start = design%x
      if (k > 1) start = found%x
      call search_from(family, order, start, found, error)
      if (allocated(error)) return
      design%curve(k)%x = found%x
      design%curve(k)%converged = found%converged .and. found%feasible
      design%curve(k)%values = [found%objective / plan%order%objectives(1)%weight, second(found%x)]
    end do

  contains

    real(dp) function second(x)
      real(dp), intent(in) :: x(:)
      type(goal_branches_type) :: at

      second = ieee_value(second, ieee_quiet_nan)
      call evaluate_goals(family, order, plan%order%objectives(2:2), x, .false., at, error)
      if (.not. allocated(error) .and. at%known) second = maxval(at%value)
    end function second

  end subroutine find_curve

end module gestell_task_design_search
