!> The report on borders of stability for people.
module gestell_task_boundary_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_task_sweep_plan, only: sweep_plan_type
  use gestell_input_wording, only: counted
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_task_boundary, only: border_rest_type, nearest_type
  use gestell_task_boundary_line_functions, only: flutter, kind_names
  use gestell_task_boundary_map, only: border_map_type, border_vertex_type
  use gestell_task_boundary_vertex, only: finest_lines
  use gestell_task_boundary_solution, only: border_results_type
  implicit none (type, external)
  private

  public :: report_borders, report_search, summary, way_to_stable

  character, parameter :: newline = new_line("a")
  !> Curves that are listed, at the most.
  integer, parameter :: most_listed = 40

contains

  !> Where borders are sought.
  pure function report_search(plan) result(report)
    type(sweep_plan_type), intent(in) :: plan
    character(len=:), allocatable :: report
    integer :: k

    report = newline // "STABILITY BOUNDARIES  to " // concise(plan%borders%tolerance, 2) // " of the ranges" // newline
    do k = 1, size(plan%grid%axes)
      associate (axis => plan%grid%axes(k))
        report = report // "  " // trim(plan%paths(k)) // "  " // concise(axis%from, 9) // " to " // concise(axis%to, 9) // ", " &
          & // counted(axis%count, "search point") // ", " // trim(merge("logarithmic", "linear     ", axis%logarithmic)) // newline
      end associate
    end do
    if (plan%order%model /= "exact") return
    if (size(plan%grid%axes) == 1) then
      report = report // "  of every vibration met when the one at the start of the range is followed; at a turning point a " &
        & // "vibration ceases to exist" // newline
    else
      report = report // "  of the vibration found: a jump to another one counts as a boundary, and a tongue beside it can be " &
        & // "missed" // newline
    end if
  end function report_search

  !> What was found.
  pure function report_borders(plan, results) result(report)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    character(len=:), allocatable :: report, rows
    integer :: i, k

    report = newline
    if (allocated(results%map)) then
      report = report // curves_of(results%map, plan%paths) // rest_of_map(results%map, plan%paths)
    else
      if (size(results%values) == 0) report = report // "  no boundary in the range" // newline
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
      report = report // rest_of(results%rest, plan%borders%tolerance)
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
      line = "Stability boundaries over " // trim(plan%paths(1)) // " and " // trim(plan%paths(2)) // ": " &
        & // counted(results%map%curves, "curve")
      return
    end if
    line = "Stability boundaries over " // trim(plan%paths(1)) // ": "
    if (size(results%values) == 0) line = line // "none in the range"
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

  !> The same of the lines of a map.
  pure function rest_of_map(map, paths) result(report)
    type(border_map_type), intent(in) :: map
    character(len=*), intent(in) :: paths(:)
    character(len=:), allocatable :: report
    integer :: i

    report = thin_places(map%thin, 2 * finest_lines) // left_out(map%left_out)
    do i = 1, min(size(map%places), most_listed)
      associate (along => maxloc(map%places(i)%width, dim=1))
        report = report // "  open: a boundary could not be excluded at " // place(map%places(i)%parameters) // ", within " &
          & // concise(map%places(i)%width(along), 2) // " along " // trim(paths(along)) // newline
      end associate
    end do
    if (size(map%places) > most_listed) report = report // "  ... all in boundary.csv" // newline
  end function rest_of_map

  pure function left_out(number) result(report)
    integer, intent(in) :: number
    character(len=:), allocatable :: report

    report = ""
    if (number > 0) report = "  note: multipliers meet so often that " // counted(number, "place") // &
      & " were not looked at; they lie in the open ranges below: search these apart" // newline
  end function left_out

  pure function thin_places(number, width) result(report)
    integer, intent(in) :: number
    real(dp), intent(in) :: width
    character(len=:), allocatable :: report

    report = ""
    if (number > 0) report = "  note: without damping, at " // counted(number, "more place") // " multipliers meet; if a " &
      & // "tongue is there, it is narrower than " // concise(width, 2) // " of the range" // newline
  end function thin_places

  pure function way_to(nearest) result(sentence)
    type(nearest_type), intent(in) :: nearest
    character(len=:), allocatable :: sentence

    if (nearest%found) then
      sentence = concise(nearest%value, 12) // " (" // trim(merge("less", "more", nearest%distance < 0)) // " by " &
        & // concise(abs(nearest%distance), 6) // "), " // trim(nearest%there)
    else
      sentence = "none in the range"
    end if
  end function way_to

  pure function curves_of(map, paths) result(report)
    type(border_map_type), intent(in) :: map
    character(len=*), intent(in) :: paths(:)
    character(len=:), allocatable :: report
    integer :: c, first, last

    report = "  " // counted(map%curves, "curve") // ", " // text(size(map%vertices)) // " vertices; (" &
      & // trim(paths(1)) // ", " // trim(paths(2)) // ")" // newline
    do c = 1, min(map%curves, most_listed)
      first = findloc(map%vertices%curve, c, dim=1)
      last = findloc(map%vertices%curve, c, dim=1, back=.true.)
      report = report // "  curve " // text(c) // " from " // place(map%vertices(first)%parameters)
      if (all(abs(map%vertices(first)%parameters - map%vertices(last)%parameters) <= 0)) then
        report = report // " round and back"
      else
        report = report // " to " // place(map%vertices(last)%parameters)
      end if
      report = report // kinds_of(map%vertices(first:last)) // newline
    end do
    if (map%curves > most_listed) report = report // "  ... all in boundary.csv" // newline
    if (map%rough > 0) report = report // "  note: " // counted(map%rough, "way") // " between vertices could " &
      & // "not be refined, as at the tip of a tongue" // newline
  end function curves_of

  !> ": divergence, flutter", in the order in which they follow each other first.
  pure function kinds_of(curve) result(list)
    type(border_vertex_type), intent(in) :: curve(:)
    character(len=:), allocatable :: list
    integer :: i

    list = ": " // words(curve(1)%kind)
    do i = 2, size(curve)
      if (index(list, words(curve(i)%kind)) == 0) list = list // ", " // words(curve(i)%kind)
    end do
  end function kinds_of

  pure function place(parameters)
    real(dp), intent(in) :: parameters(2)
    character(len=:), allocatable :: place

    place = "(" // concise(parameters(1), 6) // ", " // concise(parameters(2), 6) // ")"
  end function place

  !> With blanks in place of underscores.
  pure function words(kind)
    character(len=*), intent(in) :: kind
    character(len=:), allocatable :: words
    integer :: k

    words = trim(kind)
    k = index(words, "_")
    if (k > 0) words(k:k) = " "
  end function words

end module gestell_task_boundary_report
