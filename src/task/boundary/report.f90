!> The report on borders of stability for people.
module gestell_task_boundary_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_input_wording, only: counted
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_task_boundary, only: border_rest_type, nearest_type
  use gestell_task_boundary_line_functions, only: flutter, kind_names
  use gestell_task_boundary_map_report, only: curve_lines, curves_over, left_out, most_listed, thin_places, words
  use gestell_task_boundary_solution, only: border_results_type
  implicit none (type, external)
  private

  public :: axes_lines, report_borders, report_search, summary, way_to_stable

  character, parameter :: newline = new_line("a")

contains

  !> Where borders are sought, and to which tolerance relative to the ranges.
  pure function report_search(plan, tolerance) result(report)
    type(sweep_plan_type), intent(in) :: plan
    real(dp), intent(in) :: tolerance
    character(len=:), allocatable :: report

    report = newline // "STABILITY BOUNDARIES  to " // concise(tolerance, 2) // " of the ranges" // newline &
      & // axes_lines(plan)
    if (plan%options%model /= "exact") return
    if (size(plan%grid%axes) == 1) then
      report = report // "  The vibrations found at the search points are followed through the range; at a turning point a " &
        & // "vibration ceases to exist." // newline
    else
      report = report // "  of the vibration found: a jump to another one counts as a boundary, and a tongue beside it can be " &
        & // "missed" // newline
    end if
  end function report_search

  !> The ranges of the parameters.
  pure function axes_lines(plan) result(report)
    type(sweep_plan_type), intent(in) :: plan
    character(len=:), allocatable :: report
    integer :: k

    report = ""
    do k = 1, size(plan%grid%axes)
      associate (axis => plan%grid%axes(k))
        report = report // "  " // trim(plan%paths(k)) // "  " // concise(axis%from, 9) // " to " // concise(axis%to, 9) // ", " &
          & // counted(axis%count, "search point") // ", " // trim(merge("logarithmic", "linear     ", axis%logarithmic)) // newline
      end associate
    end do
  end function axes_lines

  !> What was found.
  pure function report_borders(plan, results, tolerance) result(report)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    real(dp), intent(in) :: tolerance
    character(len=:), allocatable :: report, rows
    integer :: i, k

    report = newline
    if (allocated(results%map)) then
      report = report // curve_lines(results%map, plan%paths)
    else
      if (size(results%values) == 0) report = report // "  no boundary " // where_none(results%rest) // newline
      rows = ""
      do i = 1, size(results%values)
        associate (v => results%values(i))
          rows = rows // concise(v%value, 13) // tab // concise(v%error, 2) // tab // trim(v%below) // tab // trim(v%above) // tab &
            & // words(v%kind)
          if (v%kind == kind_names(flutter)) rows = rows // " at " // concise(v%arg_rad) // " rad"
          if (maxval(results%values%vibration) > 1) rows = rows // ", vibration " // text(v%vibration)
          rows = rows // newline
        end associate
      end do
      if (rows /= "") report = report // tabulated("rrlll", "value,error,below,above,kind", rows)
      report = report // rest_of(results%rest, tolerance)
    end if
    if (.not. allocated(results%nearest)) return
    report = report // newline // "  The machine of the input is " // trim(results%nearest(1)%verdict) &
      & // "; the nearest one that is not unstable" // newline
    do k = 1, size(results%nearest)
      report = report // "    along " // trim(plan%paths(k)) // ": " // way_to(results%nearest(k)) // newline
    end do
  end function report_borders

  !> How many boundaries there are; over one parameter where.
  pure function summary(plan, results) result(line)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    character(len=:), allocatable :: line
    integer, parameter :: most = 6
    integer :: i

    if (allocated(results%map)) then
      line = "Stability boundaries" // curves_over(results%map, plan%paths)
      return
    end if
    line = "Stability boundaries over " // trim(plan%paths(1)) // ": "
    if (size(results%values) == 0) line = line // "none " // where_none(results%rest)
    do i = 1, min(size(results%values), most)
      line = line // trim(merge(", ", "  ", i > 1)) // repeat(" ", merge(1, 0, i > 1)) // concise(results%values(i)%value, 7)
    end do
    if (size(results%values) > most) line = line // ", ... (" // text(size(results%values)) // ")"
  end function summary

  !> The nearest machine that is not unstable along a parameter.
  pure function way_to_stable(path, nearest) result(line)
    character(len=*), intent(in) :: path
    type(nearest_type), intent(in) :: nearest
    character(len=:), allocatable :: line

    line = "The nearest machine that is not unstable along " // path // ": " // way_to(nearest)
  end function way_to_stable

  !> Where there is no boundary: in the whole range only if the search leaves no place open.
  pure function where_none(rest) result(words)
    type(border_rest_type), intent(in) :: rest
    character(len=:), allocatable :: words

    words = "in the range"
    if (.not. allocated(rest%places)) return
    if (size(rest%places) > 0) words = "found, but the search is not complete"
  end function where_none

  !> What the search leaves open.
  pure function rest_of(rest, tolerance) result(report)
    type(border_rest_type), intent(in) :: rest
    real(dp), intent(in) :: tolerance
    character(len=:), allocatable :: report
    integer :: i

    report = thin_places(rest%thin, 2 * tolerance)
    report = report // left_out(rest%left_out)
    if (.not. allocated(rest%places)) return
    do i = 1, min(size(rest%places), most_listed)
      report = report // "  open: a boundary could not be excluded at " // concise(rest%places(i)%value, 13) // ", within " &
        & // concise(rest%places(i)%width, 2) // newline
    end do
    if (size(rest%places) > most_listed) report = report // "  ... all in boundary.csv" // newline
  end function rest_of

  pure function way_to(nearest) result(sentence)
    type(nearest_type), intent(in) :: nearest
    character(len=:), allocatable :: sentence

    if (nearest%found) then
      sentence = concise(nearest%value, 12)
      if (nearest%error > 0) sentence = sentence // " +- " // concise(nearest%error, 2)
      sentence = sentence // " (" // trim(merge("less", "more", nearest%distance < 0)) // " by " &
        & // concise(abs(nearest%distance), 6) // "), " // trim(nearest%there)
      if (nearest%open > 0) sentence = sentence // "; on the way " // counted(nearest%open, "place") // " left open"
    else
      sentence = "none in the range"
    end if
  end function way_to

end module gestell_task_boundary_report
