!> Draws the pictures of a sweep: one for each requested column, as a curve against one parameter or as a chart of two parameters.
module gestell_task_sweep_plot
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: either, text
  use gestell_base_words, only: word_length
  use gestell_output_picture_axis, only: parameter_title
  use gestell_output_picture_axis_unit, only: axis_unit_type, label_with, pick_unit
  use gestell_output_picture_script, only: figure_type, new_figure
  use gestell_output_report_orders, only: turns_in_words
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_charts, only: chart_lines
  use gestell_task_sweep_curves, only: curve_lines
  use gestell_task_sweep_shown, only: decades, growth, shown_type, states
  use gestell_task_sweep_summary, only: summary_type
  use gestell_study_measure, only: measure_names
  use gestell_study_tile_results, only: column_records, last_peak, log_rho_max, rho_max, sweep_columns, verdict, xi_peak
  implicit none (type, external)
  private

  public :: picture_name, plot_sweep

  !> Maximum number of pictures of a sweep
  integer, parameter, public :: most_pictures = 12
  !> A value of this size (SI units) is typical; the unit of a picture is chosen for it, because the values may be too many to keep
  !> them in memory
  real(dp), parameter :: typical = 1.0_dp

contains

  !> Name of picture number `i` of a sweep.
  pure function picture_name(i) result(name)
    integer, intent(in) :: i
    character(len=5 + count([i > 1]) * (1 + len(text(i)))) :: name

    name = either("sweep", "sweep_" // text(i), i == 1)
  end function picture_name

  !> The pictures of the requested columns of sweep.csv. `turns`: number of turns that the drive makes in a period.
  function plot_sweep(plan, turns, summary) result(figures)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: turns
    type(summary_type), intent(in) :: summary
    type(figure_type), allocatable :: figures(:)
    type(shown_type), allocatable :: shown(:)
    character(len=:), allocatable :: counts, over
    logical :: is_chart
    integer :: i, varying

    is_chart = size(plan%grid%axes) > 1
    if (is_chart) is_chart = all(plan%grid%axes%count > 1)
    varying = maxloc(plan%grid%axes%count, dim=1)
    shown = shown_columns(plan, turns, is_chart)
    counts = summary%tally()
    if (counts /= "") counts = ": " // counts
    over = parameter_title(trim(plan%paths(varying)))
    if (is_chart) over = parameter_title(trim(plan%paths(1))) // " and " // parameter_title(trim(plan%paths(2)))
    allocate(figures(min(size(shown), most_pictures)))
    do i = 1, size(figures)
      if (is_chart) then
        figures(i) = new_figure(picture_name(i), trim(shown(i)%name) // " over " // over // counts, &
          & chart_lines(plan, shown(i)), height=520, table="sweep")
      else
        figures(i) = new_figure(picture_name(i), trim(shown(i)%name) // " over " // over // counts, &
          & curve_lines(plan, varying, shown(i), summary), height=420, table="sweep")
      end if
    end do
  end function plot_sweep

  !> The columns that have a picture: those that the input requests, without error bounds. If it requests none, they are the growth
  !> and, for curves, the peaks.
  pure function shown_columns(plan, turns, is_chart) result(shown)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: turns
    logical, intent(in) :: is_chart
    type(shown_type), allocatable :: shown(:)
    character(len=:), allocatable :: period
    integer :: column(sweep_columns), ordered(count(plan%options%columns)), k

    ordered = plan%options%ordered()
    ! numbers of the columns in sweep.csv; 0 for each column that was not requested
    column = 0
    column(ordered) = [(size(plan%paths) + k, k = 1, size(ordered))]
    period = turns_in_words(turns)
    if (plan%period_varies()) period = "the period of each point"
    allocate(shown(0))
    if (any(column([rho_max, log_rho_max]) > 0)) then
      shown = [shown_type("ln |ρ|max", "ln |ρ|max (growth in " // period // ")", growth, growth_of(column), column(verdict))]
    end if
    if (column(verdict) > 0 .and. .not. plan%options%verdict_last .and. (size(shown) == 0 .or. is_chart &
      & .and. plan%options%names_columns)) shown = [shown, shown_type("verdict", "", states, "", column(verdict))]
    if (is_chart .and. .not. plan%options%names_columns .and. size(shown) > 0) return
    do k = xi_peak, last_peak
      if (column(k) > 0) call add(trim(column_records(k)%symbol) // " peak", trim(column_records(k)%unit), column(k))
    end do
    do k = 1, plan%options%measured()
      associate (measure => plan%options%measures(k))
        call add(trim(measure%quantity) // " " // trim(measure_names(measure%kind)), trim(measure%unit), &
          & size(plan%paths) + size(ordered) + 2 * k - 1)
      end associate
    end do

  contains

    !> Adds the column with this number, which has a logarithmic scale.
    pure subroutine add(name, si, number)
      character(len=*), intent(in) :: name, si
      integer, intent(in) :: number
      type(axis_unit_type) :: unit

      unit = pick_unit(si, typical, plan%result_units)
      shown = [shown, shown_type(name, label_with(name, unit), decades, trim(unit%words) // " * column(" // text(number) // ")", &
        & column(verdict))]
    end subroutine add

  end function shown_columns

  !> Gnuplot expression for ln |rho|, where rho is the multiplier with the largest modulus.
  pure function growth_of(column) result(expression)
    integer, intent(in) :: column(sweep_columns)
    character(len=:), allocatable :: expression

    expression = "growth(column(" // text(column(rho_max)) // "))"
    if (column(log_rho_max) > 0) expression = "column(" // text(column(log_rho_max)) // ")"
  end function growth_of

end module gestell_task_sweep_plot
