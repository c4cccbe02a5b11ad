!> Tables of a design.
module gestell_task_design_tables
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: new_unit, plain, rpm, unit_type
  use gestell_study_measure, only: measure_names
  use gestell_task_design_keys, only: limit_keys
  use gestell_task_design_plan, only: design_plan_type
  use gestell_task_design_report, only: limit_state, limit_worth, worst_of
  use gestell_task_design_search, only: design_type
  use gestell_task_design_starts, only: is_there
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: curve_table, goal_table, parameter_table, range_table, start_table

  type(unit_type), parameter :: percent = unit_type("percent", "%")

contains

  !> Table design.csv: one row for each parameter.
  type(table_type) function parameter_table(plan, design, verdict) result(table)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    character(len=*), intent(in) :: verdict
    integer :: k, n

    n = size(design%x)
    associate (best => design%found(design%best), order => plan%options)
      table = new_table("design", "Design", "What was changed, and what that is worth.", verdict, shown=.true.)
      call table%add("parameter", "path as in the input", (plan%paths))
      call table%add("unit", "of its values", (plan%units))
      call table%add("before", plain, "of the machine of the file", (plan%base))
      call table%add("after", plain, "of the design", (design%x))
      call table%add("lower", plain, "the least that is allowed", (order%lower))
      call table%add("upper", plain, "the greatest that is allowed", (order%upper))
      call table%add("bound_worth", percent, "of the objective, by which it falls where the bound that holds the parameter is " &
        & // "moved out by 1 % of the range", [(abs(best%bound_price(k)) * (order%upper(k) - order%lower(k)) &
        & / max(abs(best%objective), tiny(1.0_dp)), k = 1, n)])
      call table%add("back_alone", percent, "of the objective, by which it rises where the parameter alone goes back", &
        & 100 * design%shares)
    end associate
  end function parameter_table

  !> Table design_goals.csv: one row for each objective and limit.
  type(table_type) function goal_table(design, verdict) result(table)
    type(design_type), intent(in) :: design
    character(len=*), intent(in) :: verdict
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
        worth(g) = limit_worth(design, g - n)
        state(g) = limit_state(goal, after(1, g), after(2, g))
      end associate
    end do
    table = new_table("design_goals", "Objectives and limits", "Before and after, at the worst condition.", verdict, shown=.true.)
    call table%add("role", "objective, at_most or at_least", role)
    call table%add("quantity", "name as in the input", (design%goals%measure%quantity))
    call table%add("measure", "peak, rms or band; empty: it is a number", measure)
    call table%add("unit", "of the values", (design%goals%measure%unit))
    call table%add("before", plain, "of the machine of the file", before(1, :), error="before_error")
    call table%add("before_error", plain, "bound on its error", before(2, :))
    call table%add("after", plain, "of the design", after(1, :), error="after_error")
    call table%add("after_error", plain, "bound on its error", after(2, :))
    call table%add("limit", plain, "what it is limited to", limit)
    call table%add("state", "met, violated or undecided", state)
    call table%add("limit_worth", percent, "of the objective, by which it falls where the limit is wider by 1 %", worth)
    call table%add("before_speed", rpm, "where it was worst; 0: the speed is a parameter", before(3, :))
    call table%add("after_speed", rpm, "where it is worst", after(3, :))
  end function goal_table

  !> Table design_range.csv: one row for each condition.
  type(table_type) function range_table(plan, design, verdict) result(table)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: name
    integer :: c, g

    associate (conditions => design%options%conditions)
      table = new_table("design_range", "Before and after over the range", "Objectives and limits at every condition.", verdict)
      call table%add("speed", rpm, "crank speed; 0: it is a parameter", conditions%drive_rpm(design%turns))
      call table%add("speed_factor", plain, "by which it differs", (conditions%speed_factor))
      call table%add("stiffness_factor", plain, "by which the mounting differs", (conditions%stiffness_factor))
      call table%add("damping_factor", plain, "by which its damping differs", (conditions%damping_factor))
      do g = 1, size(design%goals)
        associate (unit => new_unit(trim(design%goals(g)%measure%unit)))
          name = design%goals(g)%measure%quantity
          if (design%goals(g)%is_periodic()) name = trim(design%goals(g)%measure%name())
          if (count(design%goals(:g)%measure%quantity == design%goals(g)%measure%quantity) > 1) name = name // "_" // text(g)
          call table%add(trim(name) // "_before", unit, "of the machine of the file", design%before%values(g, :), &
            & error=trim(name) // "_before_error")
          call table%add(trim(name) // "_before_error", unit, "bound on its error", design%before%errors(g, :))
          call table%add(trim(name) // "_after", unit, "of the design", design%after%values(g, :), &
            & error=trim(name) // "_after_error")
          call table%add(trim(name) // "_after_error", unit, "bound on its error", design%after%errors(g, :))
        end associate
      end do
      call table%add("verdict_before", "on the machine of the file", design%before%verdicts%word())
      call table%add("verdict_after", "on the design", design%after%verdicts%word())
      call table%add("between", "1: a maximum between the conditions that were given", [(c > size(plan%options%conditions), c = 1, &
        & size(conditions))])
    end associate
  end function range_table

  !> Table design_starts.csv: one row for each start.
  type(table_type) function start_table(plan, design, verdict) result(table)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    character(len=*), intent(in) :: verdict
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
        if (.not. is_there(one)) cycle
        x(:, k) = one%x
        objective(k) = one%objective
        violation(k) = one%violation
        missed(k) = one%stationarity
        state(k) = merge("converged    ", "not converged", one%converged)
      end associate
    end do
    table = new_table("design_starts", "What was found from all starts", "Local optima.", verdict)
    call table%add("start", "number; 1: from the machine of the file", [(k, k = 1, size(design%found))])
    call table%add("objective", plain, "weighted", objective)
    call table%add("violation", plain, "by which the worst limit is exceeded, in its unit", violation)
    call table%add("optimality", plain, "by how much the conditions of Karush, Kuhn and Tucker are missed, relative", missed)
    call table%add("state", "converged, not converged, no machine", state)
    call table%add("evaluations", "machines solved", (design%found%evaluations))
    do k = 1, size(design%x)
      call table%add("parameter_" // text(k), plain, trim(plan%paths(k)), x(k, :))
    end do
  end function start_table

  !> Table design_trade_off.csv: one row for each point of the curve.
  type(table_type) function curve_table(plan, design) result(table)
    type(design_plan_type), intent(in) :: plan
    type(design_type), intent(in) :: design
    integer :: k, i, g

    table = new_table("design_trade_off", "Trade-off", "The least of one objective for each value of the other.", "", shown=.true.)
    do g = 1, 2
      associate (measure => plan%options%objectives(g)%measure)
        call table%add(trim(merge("first ", "second", g == 1)), new_unit(trim(measure%unit)), plan%options%objectives(g)%name(), &
          & [(design%curve(i)%values(g), i = 1, size(design%curve))])
      end associate
    end do
    call table%add("state", "converged or not", [(merge("converged    ", "not converged", design%curve(i)%converged), i = 1, &
      & size(design%curve))])
    do k = 1, size(plan%paths)
      call table%add("parameter_" // text(k), plain, trim(plan%paths(k)), [(design%curve(i)%x(k), i = 1, size(design%curve))])
    end do
  end function curve_table

end module gestell_task_design_tables
