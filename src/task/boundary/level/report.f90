!> The report on crossings of a level for people.
module gestell_task_boundary_level_report
  use gestell_base_verdict, only: operator(/=), stable, state_word
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_input_wording, only: counted
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_study_measure, only: measure_names, measure_type
  use gestell_task_boundary_report, only: axes_lines
  use gestell_task_boundary_level_search, only: level_results_type
  use gestell_task_range_plan, only: sweep_plan_type
  implicit none (type, external)
  private

  public :: level_heading, level_lines, level_name, level_sentence, middle_line

  character, parameter :: newline = new_line("a")
  !> Crossings and open places that are listed, at the most.
  integer, parameter :: most_listed = 40

contains

  !> What is measured, and its level.
  pure function level_name(measure, level) result(words)
    type(measure_type), intent(in) :: measure
    real(dp), intent(in) :: level
    character(len=:), allocatable :: words

    words = trim(measure%quantity) // " " // trim(measure_names(measure%kind)) // " = " // concise(level, 9) // " " &
      & // trim(measure%unit)
  end function level_name

  !> What is sought, to which tolerance relative to the ranges, and where.
  pure function level_heading(measure, level, tolerance, plan) result(report)
    type(measure_type), intent(in) :: measure
    real(dp), intent(in) :: level, tolerance
    type(sweep_plan_type), intent(in) :: plan
    character(len=:), allocatable :: report

    report = newline // "BORDERS OF A LEVEL  " // level_name(measure, level) // ", to " // concise(tolerance, 2) &
      & // trim(merge(" of the range ", " of the ranges", size(plan%grid%axes) == 1)) // newline // axes_lines(plan)
  end function level_heading

  !> What was found.
  pure function level_lines(results) result(report)
    type(level_results_type), intent(in) :: results
    character(len=:), allocatable :: report
    integer :: i

    report = ""
    do i = 1, min(size(results%crossings), most_listed)
      associate (c => results%crossings(i))
        report = report // concise(c%value, 13) // tab // concise(c%error, 2) // tab // trim(c%below) // tab // trim(c%above) // tab
        if (c%jumps) report = report // "a jump  "
        if (c%state /= stable) report = report // "the vibration: " // trim(state_word(c%state))
        report = report // newline
      end associate
    end do
    if (report /= "") report = newline // tabulated("rrlll", "value,error,below,above", report)
    if (report == "") report = newline // "  not crossed in the range" // newline
    do i = 1, min(size(results%places), most_listed)
      report = report // "  open: a crossing could not be excluded at " // concise(results%places(i)%value, 13) // ", within " &
        & // concise(results%places(i)%width, 2) // newline
    end do
    if (max(size(results%crossings), size(results%places)) > most_listed) report = report // "  ... all in boundary.csv" // newline
    if (.not. results%complete) report = report // "  note: the curve was not refined to the end; more search points may show " &
      & // "more" // newline
    report = report // "  from " // counted(size(results%values), "point") // " of the curve, in level.csv" // newline
  end function level_lines

  !> What there is where no curve was found.
  pure function middle_line(side) result(line)
    character(len=*), intent(in) :: side
    character(len=:), allocatable :: line

    line = ""
    if (side /= "") line = "  in the middle of the ranges: " // trim(side) // newline
  end function middle_line

  !> Over what, and where it is crossed.
  pure function level_sentence(path, results) result(line)
    character(len=*), intent(in) :: path
    type(level_results_type), intent(in) :: results
    character(len=:), allocatable :: line
    integer, parameter :: most = 6
    integer :: i

    line = " over " // path // ": "
    if (size(results%crossings) == 0) line = line // "not crossed in the range"
    do i = 1, min(size(results%crossings), most)
      if (i > 1) line = line // ", "
      line = line // concise(results%crossings(i)%value, 7)
    end do
    if (size(results%crossings) > most) line = line // ", ... (" // text(size(results%crossings)) // ")"
  end function level_sentence

end module gestell_task_boundary_level_report
