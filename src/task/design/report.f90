!> Writes the section of the report on a design.
module gestell_task_design_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_verdict, only: not_judged, operator(/=), stable, unstable, verdict_type
  use gestell_input_wording, only: counted
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_output_report_verdict, only: section
  use gestell_study_design_goal, only: goal_type, machine_goal
  use gestell_study_design_reported_goals, only: reported_goals_type
  use gestell_task_design_plan, only: design_plan_type
  use gestell_task_design_search, only: design_type
  use gestell_task_design_starts, only: has_machine
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_positive_inf, ieee_value
  implicit none (type, external)
  private

  public :: design_headline, limit_state, relaxation_gain, report_design, worst_of

  !> The report calls the design a global optimum if the proved relative gap does not exceed this value.
  real(dp), parameter :: negligible_gap = 1.0e-6_dp
  !> Relative error of the highest maximum over a range. The refinement of a maximum ends when a step gains less than 1e-12.
  real(dp), parameter :: maximum_tolerance = 1.0e-7_dp
  !> A limit of the kind `equals` counts as met if the relative deviation from it does not exceed this value.
  real(dp), parameter :: equality = 1.0e-6_dp
  !> Relative deviation from a limit that is allowed for a property of the machine, because parameters are written with only nine
  !> digits.
  real(dp), parameter :: written = 1.0e-8_dp

contains

  !> Three numbers for goal number `g`: the value under its worst condition, the error of this value, and the crank speed under
  !> this condition (1/min). The speed is 0 if the machine runs at a speed of its own, because the speed is a design parameter.
  pure function worst_of(reported, design, g) result(numbers)
    type(reported_goals_type), intent(in) :: reported
    type(design_type), intent(in) :: design
    integer, intent(in) :: g
    real(dp) :: numbers(3)
    integer :: c

    c = reported%worst(g, design%goals(g))
    numbers = [reported%values(g, max(c, 1)), reported%errors(g, max(c, 1)), 0.0_dp]
    if (c == 0) return
    numbers(3) = design%options%conditions(c)%drive_rpm(design%turns)
    if (size(design%options%conditions) > 1 .and. design%goals(g)%about /= machine_goal) numbers(2) = numbers(2) &
      & + maximum_tolerance * abs(numbers(1))
    ! The error is infinite if there is no vibration under one of the conditions.
    if (.not. all(ieee_is_finite(reported%values(g, :)))) numbers(2) = ieee_value(1.0_dp, ieee_positive_inf)
  end function worst_of

  !> Text that states whether a limit is met, violated or undecided.
  pure character(len=9) function limit_state(goal, value, error) result(state)
    type(goal_type), intent(in) :: goal
    real(dp), intent(in) :: value, error

    real(dp) :: allowed, unknown

    allowed = 0
    unknown = error
    if (goal%sense == 0) allowed = equality * goal%scale()
    if (goal%about == machine_goal) then
      ! Properties of the machine are exact apart from rounding, but the parameters are written with only nine digits.
      allowed = max(allowed, error + written * goal%scale())
      unknown = 0
    end if
    state = "undecided"
    if (goal%excess(value) + unknown <= allowed) state = "met"
    if (goal%excess(value) - unknown > allowed) state = "violated"
  end function limit_state

  !> Sentence on what is known about the optimum: that it is global, that no machine meets the limits, or that it is the best result
  !> from n starts.
  pure function proof_words(design) result(words)
    type(design_type), intent(in) :: design
    character(len=:), allocatable :: words

    associate (best => design%found(design%best))
      if (.not. best%feasible .and. design%conflict > 0) then
        words = "proved: every machine within these ranges exceeds a limit by at least " // concise(100 * design%conflict, 3) &
          & // " %"
      else if (best%feasible .and. design%gap <= negligible_gap) then
        words = "global optimum: no machine within these ranges improves the objective by more than " &
          & // concise(100 * max(design%gap, 0.0_dp), 2) // " % of the value before"
      else
        words = "best local optimum from " // counted(size(design%found), "start")
        if (.not. best%converged) words = words // "; the search for it has not converged"
      end if
    end associate
  end function proof_words

  !> Writes the headline of a design. `state` becomes `not_judged` if all limits are met and the design is stable.
  subroutine design_headline(design, state, words)
    type(design_type), intent(in) :: design
    type(verdict_type), intent(out) :: state
    character(len=:), allocatable, intent(out) :: words
    real(dp) :: before(3), after(3)
    integer :: g

    before = worst_of(design%before, design, 1)
    after = worst_of(design%after, design, 1)
    words = "DESIGN: " // trim(design%goals(1)%name()) // " from " // concise(before(1), 4) // " to " // concise(after(1), 4) &
      & // " " // trim(design%goals(1)%measure%unit) // change_words(before(1), after(1))
    do g = size(design%options%objectives) + 1, size(design%goals)
      after = worst_of(design%after, design, g)
      if (limit_state(design%goals(g), after(1), after(2)) == "met") cycle
      state = unstable
      words = "DESIGN: limits " // either("cannot be met (proved)", "not met", design%conflict > 0) // " within these ranges: " &
        & // trim(design%goals(g)%name()) // " is " // concise(after(1), 4) // " " // trim(design%goals(g)%measure%unit) &
        & // ", limit " // concise(design%goals(g)%limit, 4)
      return
    end do
    if (design%after%verdict() /= stable) state = design%after%verdict()
    if (state /= not_judged) words = words // ", but this machine is " // trim(state%word())
  end subroutine design_headline

  pure function change_words(before, after) result(words)
    real(dp), intent(in) :: before, after
    character(len=:), allocatable :: words

    words = ""
    if (.not. abs(before) > 0) return
    words = concise(100 * (after / before - 1), 3) // " %)"
    words = trim(merge(" ( ", " (+", words(1:1) == "-")) // words
  end function change_words

  !> The section of the report on a design: optimality, goals, parameters and starts.
  function report_design(plan, design, after) result(report)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    !> Verdict on the machine with the parameters of the design
    type(verdict_type), intent(in) :: after
    character(len=:), allocatable :: report
    type(verdict_type) :: before

    before = design%before%verdict()
    associate (best => design%found(design%best))
      report = section("DESIGN", after) // "  " // proof_words(design) // newline // "  "
      ! If the limits could not be met, the search minimised the largest excess over a limit instead of the objective.
      if (best%feasible) report = report // "residual of the optimality conditions " // concise(best%stationarity, 2) // "; "
      report = report // text(sum(design%found%evaluations)) // " machines solved" // newline // "  verdict: " &
        & // trim(before%word()) // " before, " // trim(after%word()) // " after" // newline
      if (after /= stable) report = report // "  to require stability, add: &constraint quantity='rho_max', at_most=0.999 /" &
        & // newline
      if (size(design%options%conditions) > 1) report = report // "  worst values of " &
        & // counted(size(plan%options%conditions), "condition") // either(" (speeds and scatter)", " (speeds)", plan%robust) &
        & // either(" and of all conditions between them", "", size(plan%lines) > 0) // newline
      report = report // newline // goal_lines(design) // newline // parameter_lines(plan, design)
    end associate
    if (size(design%found) > 1) report = report // newline // start_lines(design)
  end function report_design

  function goal_lines(design) result(lines)
    type(design_type), intent(in) :: design
    character(len=:), allocatable :: lines, heads
    character(len=2), parameter :: signs(-1:1) = [">=", "= ", "<="]
    real(dp) :: before(3), after(3), worth
    logical :: over_range, any_worth
    integer :: g, n

    over_range = size(design%options%conditions) > 1
    any_worth = .false.
    n = size(design%options%objectives)
    lines = ""
    do g = 1, size(design%goals)
      associate (goal => design%goals(g))
        before = worst_of(design%before, design, g)
        after = worst_of(design%after, design, g)
        lines = lines // trim(goal%name()) // tab // concise(before(1), 5) // tab // concise(after(1), 5) // tab &
          & // concise(after(2), 1) // tab // trim(goal%measure%unit) // tab
        if (g <= n) then
          lines = lines // "objective" // tab
        else
          worth = relaxation_gain(design, g - n)
          lines = lines // trim(signs(goal%sense)) // " " // concise(goal%limit, 5) // " " &
            & // trim(limit_state(goal, after(1), after(2))) // tab
          if (worth > 0) lines = lines // concise(worth, 2) // " %"
          any_worth = any_worth .or. worth > 0
        end if
        if (over_range) lines = lines // tab // concise(after(3), 6)
        lines = lines // newline
      end associate
    end do
    ! The second line of headings is written only if it is not empty
    heads = ",before,after,error,,," // either("relaxation", "", any_worth) // either(",at rpm", "", over_range)
    if (any_worth) heads = ",,,,,,gain per 1 %" // either(",", "", over_range) // newline // heads
    lines = tabulated("lrrrllr" // either("r", "", over_range), heads, lines)
  end function goal_lines

  !> Percentage by which the objective decreases if the limit of constraint number `c` is relaxed by 1 %; 0 if the limits are not
  !> met.
  pure real(dp) function relaxation_gain(design, c)
    type(design_type), intent(in) :: design
    integer, intent(in) :: c
    integer :: g

    relaxation_gain = 0
    associate (best => design%found(design%best))
      g = size(design%goals) - size(best%price) + c
      if (best%feasible .and. best%objective > 0) relaxation_gain = best%price(c) * abs(design%goals(g)%limit) / best%objective
    end associate
  end function relaxation_gain

  function parameter_lines(plan, design) result(lines)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    character(len=:), allocatable :: lines
    integer :: k

    lines = ""
    do k = 1, size(design%x)
      associate (order => plan%options, price => design%found(design%best)%bound_price(k))
        lines = lines // trim(plan%paths(k)) // tab // concise(plan%base(k), 5) // tab // concise(design%x(k), 6) // tab &
          & // concise(order%lower(k), 5) // " to " // concise(order%upper(k), 5) // " " // trim(plan%units(k)) // tab
        if (price > 0) lines = lines // "at lower end"
        if (price < 0) lines = lines // "at upper end"
        lines = lines // tab
        if (ieee_is_finite(design%reset_losses(k))) lines = lines // concise(100 * design%reset_losses(k), 3) // " %"
        lines = lines // newline
      end associate
    end do
    lines = tabulated("lrrllr", either(",,,,,loss if" // newline // "parameter,before,after,range,,reset alone", &
      & "parameter,before,after,range,,", any(ieee_is_finite(design%reset_losses))), lines)
  end function parameter_lines

  function start_lines(design) result(lines)
    type(design_type), intent(in) :: design
    character(len=:), allocatable :: lines
    integer :: k

    lines = ""
    do k = 1, size(design%found)
      if (.not. has_machine(design%found(k))) then
        lines = lines // text(k) // tab // tab // "mechanism cannot be assembled, or no periodic vibration" // newline
      else
        associate (one => design%found(k))
          lines = lines // text(k) // tab // concise(one%objective, 6) // tab // trim(merge("limits met    ", "limits not met", &
            & one%feasible)) // trim(merge("               ", ", not converged", one%converged)) &
            & // trim(merge(", chosen", "        ", k == design%best)) // newline
        end associate
      end if
    end do
    lines = tabulated("rrl", "start,objective,", lines)
  end function start_lines

end module gestell_task_design_report
