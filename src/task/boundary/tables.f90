!> Tables of the task `boundary`: boundary.csv for one or two parameters, and level.csv for one parameter.
module gestell_task_boundary_tables
  use gestell_base_text, only: either, exact, newline
  use gestell_base_verdict, only: state_word, unjudged
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_result_units, only: conversion_type
  use gestell_output_table_unit, only: new_unit, radian, unit_type
  use gestell_study_speed_point, only: speed_point_type
  use gestell_task_boundary_level_line, only: level_type
  use gestell_task_boundary_solution, only: border_results_type
  use gestell_task_range_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  public :: border_table, curve_table

  character(len=*), parameter :: level_kind = "kind of crossing. 'level': the quantity crosses the level continuously; 'jump': " &
    & // "it jumps across the level", level_state = "state of the machine: ok (stable), undamped, undecided or unstable"

contains

  !> The table boundary.csv, with a remark for each part in which a border cannot be excluded. If `level` is present, the table
  !> lists the crossings of this level.
  pure type(table_type) function border_table(plan, results, level) result(table)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    type(level_type), intent(in), optional :: level

    type(conversion_type) :: conversion

    if (present(level)) then
      associate (measure => level%measure)
        table = new_table("boundary", "Crossings of a level", "Where " // level%subject() // " crosses " &
          & // trim(plan%result_units%amount(level%value, 9, trim(measure%unit))) // ".", unjudged, shown=.true.)
        conversion = plan%result_units%conversion(measure%unit)
        if (conversion%words == "") conversion%words = measure%unit
        table%remarks = "level: " // trim(measure%name()) // " = " // exact(conversion%converted(level%value)) // " " &
          & // trim(conversion%words) // newline
      end associate
    else
      table = new_table("boundary", "Stability boundaries", "Parameters at which the largest multiplier crosses the unit " &
        & // "circle.", unjudged, shown=.true.)
    end if
    if (allocated(results%map)) then
      call add_curves(plan, results, present(level), table)
    else
      call add_values(plan, results, present(level), table)
    end if
  end function border_table

  !> Adds the critical values of one parameter, or its values at the crossings of a level, to the table.
  pure subroutine add_values(plan, results, of_level, table)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    logical, intent(in) :: of_level
    type(table_type), intent(inout) :: table
    character(len=:), allocatable :: path, border
    type(unit_type) :: unit
    integer :: i

    path = trim(plan%paths(1))
    unit = unit_type(words=plan%units(1))
    border = either("crossing", "boundary", of_level)
    associate (values => results%values)
      call table%add("curve", "number of the " // either("crossing", "critical value", of_level), [(i, i = 1, size(values))])
      call table%add(path, unit, either("value of the parameter at the crossing", "critical value of the parameter", of_level) &
        & // ", in the units of the input", (values%value), error=path // "_error")
      if (.not. of_level) call table%add("arg", radian, "argument of the multiplier that crosses the unit circle", (values%arg_rad))
      call table%add("kind", either(level_kind, "divergence, period_doubling, flutter or turning_point", of_level), (values%kind))
      call table%add(path // "_error", unit, "bound on the distance of the " // border // " from the value in this " &
        & // "row", (values%error))
      call table%add("below", either("side of the level on which the quantity lies for smaller values of the parameter: within " &
        & // "(at most the level), above or undecided", "verdict below the critical value", of_level), (values%below))
      call table%add("above", either("side of the level on which the quantity lies for larger values of the parameter", &
        & "verdict above the critical value", of_level), (values%above))
      if (of_level) call table%add("state", level_state, (values%state))
      if (.not. of_level) call table%add("vibration", "number of the periodic vibration to which this boundary belongs", &
        & (values%vibration))
    end associate
    do i = 1, size(results%rest%places)
      associate (place => results%rest%places(i))
        table%remarks = table%remarks // "open: " // path // " = " // exact(place%value) // " within " // exact(place%width) &
          & // ": a " // border // " could not be excluded" // newline
      end associate
    end do
  end subroutine add_values

  !> Adds the curves in the plane of two parameters to the table. For curves of a level, the state of the machine replaces the
  !> argument of the multiplier.
  pure subroutine add_curves(plan, results, of_level, table)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    logical, intent(in) :: of_level
    type(table_type), intent(inout) :: table
    integer :: i, k

    associate (vertices => results%map%vertices, places => results%map%places, paths => plan%paths)
      call table%add("curve", "number of the curve", (vertices%curve))
      do k = 1, 2
        call table%add(trim(paths(k)), unit_type(words=plan%units(k)), "value of the parameter at the vertex of the curve, in " &
          & // "the units of the input", [(vertices(i)%parameters(k), i = 1, size(vertices))], error=trim(paths(k)) // "_error")
      end do
      if (.not. of_level) call table%add("arg", radian, "argument of the multiplier that crosses the unit circle", &
        & (vertices%arg_rad))
      call table%add("kind", either(level_kind, "divergence, period_doubling or flutter", of_level), (vertices%kind))
      do k = 1, 2
        call table%add(trim(paths(k)) // "_error", unit_type(words=plan%units(k)), "bound on the error of the parameter, along " &
          & // "the search line", [(vertices(i)%error(k), i = 1, size(vertices))])
      end do
      if (of_level) call table%add("state", level_state, (vertices%state))
      do i = 1, size(places)
        k = maxloc(places(i)%width, dim=1)
        table%remarks = table%remarks // "open: " // trim(paths(1)) // " = " // exact(places(i)%parameters(1)) // ", " &
          & // trim(paths(2)) // " = " // exact(places(i)%parameters(2)) // " within " // exact(places(i)%width(k)) // " along " &
          & // trim(paths(k)) // ": a boundary could not be excluded" // newline
      end do
    end associate
  end subroutine add_curves

  !> The table level.csv: the measured quantity at each computed value of the parameter.
  pure type(table_type) function curve_table(plan, points, level) result(table)
    type(sweep_plan_type), intent(in) :: plan
    class(speed_point_type), intent(in) :: points(:)
    type(level_type), intent(in) :: level
    character(len=:), allocatable :: name
    integer :: i

    name = trim(level%measure%name())
    table = new_table("level", "Quantity over the parameter", "", unjudged)
    associate (unit => new_unit(trim(level%measure%unit)), n => size(points))
      call table%add(trim(plan%paths(1)), unit_type(words=plan%units(1)), "value of the parameter, in the units of the input", &
        & [(points(i)%speed, i = 1, n)])
      call table%add(name, unit, trim(level%measure%meaning()), [(points(i)%values(1, 1), i = 1, n)], error=name // "_error")
      call table%add(name // "_error", unit, "bound on the error of the quantity", [(points(i)%values(2, 1), i = 1, n)])
    end associate
    call table%add("state", "state of the machine: ok (stable), undamped, undecided, unstable, resonance (a multiplier may " &
      & // "equal 1), impossible (the mechanism cannot be assembled) or failed (no solution)", state_word(points%state))
  end function curve_table

end module gestell_task_boundary_tables
