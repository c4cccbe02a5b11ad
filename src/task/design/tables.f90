!> Creates the tables of a design.
module gestell_task_design_tables
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_base_verdict, only: judgement_type, unjudged
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: new_unit, plain, rpm, unit_type, unit_of_row
  use gestell_study_measure, only: measure_names
  use gestell_task_design_keys, only: limit_keys
  use gestell_task_design_plan, only: design_plan_type
  use gestell_task_design_report, only: limit_state, relaxation_gain, worst_of
  use gestell_task_design_search, only: design_type
  use gestell_task_design_starts, only: has_machine
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: curve_table, goal_table, parameter_table, range_table, start_table

  type(unit_type), parameter :: percent = unit_type("percent", "%")

contains

  !> The table design.csv, which has one row for each parameter.
  type(table_type) function parameter_table(plan, design, verdict) result(table)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    type(judgement_type), intent(in) :: verdict
    integer :: k, n

    n = size(design%x)
    associate (best => design%found(design%best), order => plan%options)
      table = new_table("design", "Design", "Parameters before and after the design, and their influence on the objective.", &
        & verdict, shown=.true.)
      call table%add("parameter", "path of the parameter, as in the input", (plan%paths))
      call table%add("unit", "unit of its values", (plan%units))
      call table%add("before", plain, "value in the input", (plan%base))
      call table%add("after", plain, "value in the design", (design%x))
      call table%add("lower", plain, "smallest permitted value of the parameter", (order%lower))
      call table%add("upper", plain, "largest permitted value of the parameter", (order%upper))
      call table%add("bound_worth", percent, "decrease of the objective if the active bound of this parameter moves outward " // &
        &   "by 1 % of the range; 0 if neither bound is active", [(abs(best%bound_price(k)) * (order%upper(k) - order%lower(k)) &
        & / max(abs(best%objective), tiny(1.0_dp)), k = 1, n)])
      call table%add("back_alone", percent, "increase of the objective if only this parameter returns to its value in the " &
        & // "input; NaN if that machine is impossible", 100 * design%reset_losses)
    end associate
  end function parameter_table

  !> The table design_goals.csv, which has one row for each objective and limit.
  type(table_type) function goal_table(design, verdict) result(table)
    type(design_type), intent(in) :: design
    type(judgement_type), intent(in) :: verdict
    real(dp), dimension(3, size(design%goals)) :: before, after
    real(dp), dimension(size(design%goals)) :: limit, worth
    character(len=10) :: role(size(design%goals))
    character(len=9) :: state(size(design%goals))
    character(len=4) :: measure(size(design%goals))
    integer :: g, n

    n = size(design%options%objectives)
    limit = ieee_value(1.0_dp, ieee_quiet_nan)
    worth = limit
    state = ""
    measure = ""
    do g = 1, size(design%goals)
      associate (goal => design%goals(g))
        before(:, g) = worst_of(design%before, design, g)
        after(:, g) = worst_of(design%after, design, g)
        role(g) = "objective"
        if (goal%is_periodic()) measure(g) = measure_names(goal%measure%kind)
        if (g <= n) cycle
        role(g) = limit_keys(goal%sense)
        limit(g) = goal%limit
        worth(g) = relaxation_gain(design, g - n)
        state(g) = limit_state(goal, after(1, g), after(2, g))
      end associate
    end do
    table = new_table("design_goals", "Objectives and limits", "Values before and after the design, at the worst condition.", &
      & verdict, shown=.true.)
    call table%add("role", "objective, at_most, at_least or equals", role)
    call table%add("quantity", "name as in the input", (design%goals%measure%quantity))
    call table%add("measure", "peak, rms or band; empty if the quantity does not vary over the period", measure)
    call table%add("unit", "unit of the values", (design%goals%measure%unit))
    call table%add("before", unit_of_row, "value for the machine in the input", before(1, :), error="before_error")
    call table%add("before_error", unit_of_row, "error bound of the value before", before(2, :))
    call table%add("after", unit_of_row, "value for the design", after(1, :), error="after_error")
    call table%add("after_error", unit_of_row, "error bound of the value after", after(2, :))
    call table%add("limit", unit_of_row, "limit of the quantity; NaN for an objective", limit)
    call table%add("state", "whether the limit is met, violated or undecided (within the error)", state)
    call table%add("limit_worth", percent, "decrease of the objective if the limit is relaxed by 1 %", worth)
    call table%add("before_speed", rpm, "crank speed at the worst condition before the design; 0 if the speed is a design " // &
      &   "parameter", before(3, :))
    call table%add("after_speed", rpm, "crank speed at the worst condition after the design", after(3, :))
  end function goal_table

  !> The table design_range.csv, which has one row for each operating condition.
  type(table_type) function range_table(plan, design, verdict) result(table)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    type(judgement_type), intent(in) :: verdict
    character(len=:), allocatable :: name
    integer :: c, g

    associate (conditions => design%options%conditions)
      table = new_table("design_range", "Before and after the design, over the range", "Values of the objectives and " // &
        &   "of the limited quantities at every operating condition.", verdict)
      call table%add("speed", rpm, "crank speed; 0 if the speed is a design parameter", conditions%drive_rpm(design%turns))
      call table%add("speed_factor", plain, "factor by which the nominal speed is multiplied", (conditions%speed_factor))
      call table%add("stiffness_factor", plain, "factor by which the stiffness of the mounting is multiplied", &
        & (conditions%stiffness_factor))
      call table%add("damping_factor", plain, "factor by which the damping of the mounting is multiplied", &
        & (conditions%damping_factor))
      do g = 1, size(design%goals)
        associate (unit => new_unit(trim(design%goals(g)%measure%unit)))
          name = design%goals(g)%measure%quantity
          if (design%goals(g)%is_periodic()) name = trim(design%goals(g)%measure%name())
          if (count(design%goals(:g)%measure%quantity == design%goals(g)%measure%quantity) > 1) name = name // "_" // text(g)
          call table%add(trim(name) // "_before", unit, "value for the machine in the input", design%before%values(g, :), &
            & error=trim(name) // "_before_error")
          call table%add(trim(name) // "_before_error", unit, "error bound of the value before", design%before%errors(g, :))
          call table%add(trim(name) // "_after", unit, "value for the design", design%after%values(g, :), &
            & error=trim(name) // "_after_error")
          call table%add(trim(name) // "_after_error", unit, "error bound of the value after", design%after%errors(g, :))
        end associate
      end do
      call table%add("verdict_before", "verdict on the machine in the input", design%before%verdicts%word())
      call table%add("verdict_after", "verdict on the design", design%after%verdicts%word())
      call table%add("between", "1 if the program added this condition, at a maximum between the given conditions", &
        & [(c > size(plan%options%conditions), c = 1, size(conditions))])
    end associate
  end function range_table

  !> The table design_starts.csv, which has one row for each start of the search.
  type(table_type) function start_table(plan, design, verdict) result(table)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    type(judgement_type), intent(in) :: verdict
    real(dp) :: x(size(design%x), size(design%found)), objective(size(design%found)), violation(size(design%found)), &
      & missed(size(design%found))
    character(len=13) :: state(size(design%found))
    integer :: k

    x = ieee_value(1.0_dp, ieee_quiet_nan)
    objective = x(1, :)
    violation = objective
    missed = objective
    state = "no machine"
    do k = 1, size(design%found)
      associate (one => design%found(k))
        if (.not. has_machine(one)) cycle
        x(:, k) = one%x
        objective(k) = one%objective
        violation(k) = one%violation
        missed(k) = one%stationarity
        state(k) = merge("converged    ", "not converged", one%converged)
      end associate
    end do
    table = new_table("design_starts", "Results from all starts", "The local optimum that the search found from each starting " &
      & // "point.", verdict)
    call table%add("start", "number of the starting point; point 1 is the machine in the input", [(k, k = 1, size(design%found))])
    call table%add("objective", plain, "weighted objective", objective)
    call table%add("violation", plain, "excess over the most exceeded limit, in the unit of this limit", violation)
    call table%add("optimality", plain, "relative residual of the optimality conditions (Karush, Kuhn and Tucker)", missed)
    call table%add("state", "converged, not converged, or no machine (impossible, or without periodic vibration)", state)
    call table%add("evaluations", "number of machines solved", (design%found%evaluations))
    do k = 1, size(design%x)
      call table%add("parameter_" // text(k), plain, trim(plan%paths(k)), x(k, :))
    end do
  end function start_table

  !> The table design_trade_off.csv, which has one row for each point of the trade-off curve.
  type(table_type) function curve_table(plan, design) result(table)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    integer :: k, i, g

    table = new_table("design_trade_off", "Trade-off", "Minimum of the first objective for each value of the second.", unjudged, &
      & shown=.true.)
    do g = 1, 2
      associate (measure => plan%options%objectives(g)%measure)
        call table%add(trim(merge("first ", "second", g == 1)), new_unit(trim(measure%unit)), &
          & trim(plan%options%objectives(g)%name()), &
          & [(design%curve(i)%values(g), i = 1, size(design%curve))])
      end associate
    end do
    call table%add("state", "whether the search converged", [(merge("converged    ", "not converged", &
      & design%curve(i)%converged), i = 1, size(design%curve))])
    do k = 1, size(plan%paths)
      call table%add("parameter_" // text(k), plain, trim(plan%paths(k)), [(design%curve(i)%x(k), i = 1, size(design%curve))])
    end do
  end function curve_table

end module gestell_task_design_tables
