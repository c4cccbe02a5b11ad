!> Writes the report on stability borders and on crossings of a level.
module gestell_task_boundary_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_base_verdict, only: stable, state_word
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_input_wording, only: counted
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_task_boundary_level_line, only: level_type
  use gestell_task_boundary_line_borders, only: border_rest_type, nearest_type
  use gestell_task_boundary_line_functions, only: flutter, kind_names
  use gestell_task_boundary_map_report, only: curve_lines, more_listed, max_listed, unsearched_lines, words
  use gestell_task_boundary_solution, only: border_results_type
  implicit none (type, external)
  private

  public :: report_borders, report_search, summary, nearest_words

contains

  !> Name of the measured quantity and its level, for example `f rms = 60 N`.
  pure function level_name(level) result(words)
    type(level_type), intent(in) :: level
    character(len=:), allocatable :: words

    words = level%subject() // " = " // concise(level%value, 9) // " " // trim(level%measure%unit)
  end function level_name

  !> Heading of the report: the task, the tolerance relative to the ranges, and the ranges.
  pure function report_search(plan, tolerance, level) result(report)
    type(sweep_plan_type), intent(in) :: plan
    real(dp), intent(in) :: tolerance
    type(level_type), intent(in), optional :: level
    character(len=:), allocatable :: report
    integer :: k

    report = newline // "STABILITY BOUNDARIES "
    if (present(level)) report = newline // "CROSSINGS OF A LEVEL  " // level_name(level) // ","
    report = report // " tolerance " // concise(tolerance, 2) &
      & // trim(merge(" of the range ", " of the ranges", size(plan%grid%axes) == 1)) // newline
    do k = 1, size(plan%grid%axes)
      associate (axis => plan%grid%axes(k))
        report = report // "  " // trim(plan%paths(k)) // "  " // concise(axis%from, 9) // " to " // concise(axis%to, 9) // ", " &
          & // counted(axis%count, "search point") // ", " // trim(merge("logarithmic", "linear     ", axis%logarithmic)) // newline
      end associate
    end do
    if (present(level) .or. plan%options%model /= "exact") return
    if (size(plan%grid%axes) == 1) then
      report = report // "  The vibrations found at the search points are followed through the range. At a turning point a " &
        & // "vibration ceases to exist." // newline
    else
      report = report // "  The solution at each point starts from rest. A jump to another vibration counts as a boundary; a " &
        & // "narrow unstable region (tongue) next to the jump can be missed." // newline
    end if
  end function report_search

  !> Lines of the report on the borders, on the parts in which a border cannot be excluded, and on the nearest machine that is not
  !> unstable.
  pure function report_borders(plan, results, tolerance, level) result(report)
    type(sweep_plan_type), intent(in) :: plan
    !> Borders, parts in which a border cannot be excluded, and nearest machines that are not unstable
    type(border_results_type), intent(in) :: results
    !> Tolerance of the borders, relative to the range
    real(dp), intent(in) :: tolerance
    !> Measured quantity and its level; present if crossings of a level were sought
    type(level_type), intent(in), optional :: level
    character(len=:), allocatable :: report
    integer :: k

    report = newline
    if (allocated(results%map)) then
      report = report // curve_lines(results%map, plan%paths)
      if (results%side_at_centre /= "") report = report // "  quantity at the centre of the ranges, compared with the level: " &
        & // trim(results%side_at_centre) // newline
    else
      report = report // value_lines(results, present(level)) // open_lines(results%rest, tolerance, present(level))
    end if
    if (allocated(results%curve)) then
      if (max(size(results%values), size(results%rest%places)) > max_listed) report = report // more_listed
      if (.not. results%curve%complete) report = report // "  note: the quantity's curve could not be refined everywhere; more " &
        & // "search points may reveal more crossings" // newline
      report = report // "  based on " // counted(size(results%curve%points), "point") &
        & // " of the quantity's curve, listed in level.csv" // newline
    end if
    if (.not. allocated(results%nearest)) return
    report = report // newline // "  Machine of the input: " // trim(results%nearest(1)%verdict) &
      & // ". Nearest values at which it is not unstable:" // newline
    do k = 1, size(results%nearest)
      report = report // "    " // nearest_words(trim(plan%paths(k)), results%nearest(k)) // newline
    end do
  end function report_borders

  !> Table of the critical values of one parameter, or of its values at the crossings of a level.
  pure function value_lines(results, of_level) result(report)
    type(border_results_type), intent(in) :: results
    logical, intent(in) :: of_level
    character(len=:), allocatable :: report
    integer :: i, listed

    report = ""
    if (size(results%values) == 0) then
      report = "  the quantity does not cross the level within the range" // newline
      if (.not. of_level) report = "  no boundary " // empty_words(results%rest) // newline
      return
    end if
    listed = size(results%values)
    if (of_level) listed = min(listed, max_listed)
    do i = 1, listed
      associate (v => results%values(i))
        report = report // concise(v%value, 13) // tab // concise(v%error, 2) // tab // trim(v%below) // tab // trim(v%above) // tab
        if (of_level) then
          if (v%kind == "jump") report = report // "jump  "
          if (v%state /= state_word(stable)) report = report // "vibration " // trim(v%state)
        else
          report = report // words(v%kind)
          if (v%kind == kind_names(flutter)) report = report // ", argument " // concise(v%arg_rad) // " rad"
          if (maxval(results%values%vibration) > 1) report = report // ", vibration " // text(v%vibration)
        end if
        report = report // newline
      end associate
    end do
    report = tabulated("rrlll", "value,error,below,above" // trim(merge("     ", ",kind", of_level)), report)
  end function value_lines

  !> Summary in one line: the number of curves, or the critical values of one parameter.
  pure function summary(plan, results, level) result(line)
    type(sweep_plan_type), intent(in) :: plan
    type(border_results_type), intent(in) :: results
    type(level_type), intent(in), optional :: level
    character(len=:), allocatable :: line
    integer, parameter :: most = 6
    integer :: i

    line = "Stability boundaries"
    if (present(level)) line = "Crossings of " // level_name(level)
    line = line // " over " // trim(plan%paths(1))
    if (allocated(results%map)) then
      line = line // " and " // trim(plan%paths(2)) // ": " // counted(results%map%curves, "curve")
      return
    end if
    line = line // ": "
    if (size(results%values) == 0) then
      if (present(level)) line = line // "none in the range"
      if (.not. present(level)) line = line // "none " // empty_words(results%rest)
    end if
    do i = 1, min(size(results%values), most)
      if (i > 1) line = line // ", "
      line = line // concise(results%values(i)%value, 7)
    end do
    if (size(results%values) > most) line = line // ", ... (" // text(size(results%values)) // ")"
  end function summary

  !> Text for a result without borders. It says "in the range" only if no part of the range is undecided.
  pure function empty_words(rest) result(words)
    type(border_rest_type), intent(in) :: rest
    character(len=:), allocatable :: words

    words = "in the range"
    if (size(rest%places) > 0) words = "found, but the search is not complete"
  end function empty_words

  !> Lines of the report on the parts in which a border, or a crossing of a level, cannot be excluded.
  pure function open_lines(rest, tolerance, of_level) result(report)
    type(border_rest_type), intent(in) :: rest
    real(dp), intent(in) :: tolerance
    logical, intent(in) :: of_level
    character(len=:), allocatable :: report
    integer :: i

    report = unsearched_lines(rest%thin, 2 * tolerance, rest%left_out)
    do i = 1, min(size(rest%places), max_listed)
      report = report // "  open: there may be a " // trim(merge("crossing", "boundary", of_level)) // " at " &
        & // concise(rest%places(i)%value, 13) // ", within " // concise(rest%places(i)%width, 2) // newline
    end do
    if (size(rest%places) > max_listed .and. .not. of_level) report = report // more_listed
  end function open_lines

  !> Sentence on the nearest machine that is not unstable if only one parameter varies: value of the parameter, difference from
  !> the given value, and verdict.
  pure function nearest_words(path, nearest) result(sentence)
    character(len=*), intent(in) :: path
    type(nearest_type), intent(in) :: nearest
    character(len=:), allocatable :: sentence

    sentence = path // ": none in the range"
    if (.not. nearest%found) return
    sentence = path // " = " // concise(nearest%value, 12)
    if (nearest%error > 0) sentence = sentence // " +- " // concise(nearest%error, 2)
    sentence = sentence // " (" // concise(abs(nearest%distance), 6) // trim(merge(" less", " more", nearest%distance < 0)) &
      & // "), " // trim(nearest%there)
    if (nearest%open > 0) sentence = sentence // "; " // counted(nearest%open, "open place") // " in between"
  end function nearest_words

end module gestell_task_boundary_report
