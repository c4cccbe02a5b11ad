!> Writes the report of the task `sweep`.
module gestell_task_sweep_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, integer_text, newline, text
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_summary, only: summary_type, verdict_count_type
  use gestell_input_wording, only: counted
  use gestell_model_frame, only: dof_names
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_output_report_warnings, only: small_motion_limits
  implicit none (type, external)
  private

  public :: evidence_line, report_grid, report_sweep, sweep_headline

contains

  !> Heading of the report: the axes, the number of points and of tiles, and the solution method (`engine`).
  pure function report_grid(plan) result(report)
    type(sweep_plan_type), intent(in) :: plan
    character(len=:), allocatable :: report
    integer :: k

    report = newline // "SWEEP  " // integer_text(plan%grid%points()) // " points in " // counted(plan%grid%tiles(), "tile") &
      & // ", engine '" // trim(plan%options%engine) // "'" // newline
    do k = 1, size(plan%grid%axes)
      associate (axis => plan%grid%axes(k))
        report = report // "  " // trim(plan%paths(k)) // "  " // concise(axis%from, 9)
        if (axis%count > 1) report = report // " to " // concise(axis%to, 9) // ", " // text(axis%count) // " values, " &
          & // trim(merge("logarithmic", "linear     ", axis%logarithmic))
        report = report // newline
      end associate
    end do
  end function report_grid

  !> Results in the report: number of points with each verdict, range of rho_max, and number of points at which the motion is too
  !> large for the linearised equations.
  pure function report_sweep(plan, summary) result(report)
    type(sweep_plan_type), intent(in) :: plan
    type(summary_type), intent(in) :: summary
    character(len=:), allocatable :: dof, report, rows
    type(verdict_count_type), allocatable :: counts(:)
    integer :: k

    rows = ""
    counts = summary%verdict_counts()
    do k = 1, size(counts)
      rows = rows // trim(counts(k)%verdict%word()) // tab // integer_text(counts(k)%points) // " points" // tab &
        & // concise(100 * real(counts(k)%points, dp) / real(summary%points, dp), 3) // " %" // newline
    end do
    report = newline // tabulated("lrr", "", rows)
    if (summary%least <= summary%most) then
      report = report // "  rho_max from " // modulus_text(summary%least) // " to " // modulus_text(summary%most) // ", maximum at"
      do k = 1, size(plan%paths)
        report = report // trim(merge(",", " ", k > 1)) // " " // trim(plan%paths(k)) // " = " &
          & // concise(plan%grid%axes(k)%value(int(summary%where(k))), 9)
      end do
      report = report // newline
      if (plan%period_varies()) report = report &
        & // "  |rho| refers to one period; the ratio changes the period from point to point" // newline
    end if
    if (summary%turned > 0 .and. plan%options%model /= "exact") then
      dof = trim(dof_names(summary%furthest))
      report = report // "  BEYOND SMALL MOTIONS at " // integer_text(summary%turned) // " points: " // dof // " reaches " &
        & // concise(summary%max_turn, 3) // " rad" // newline // "    the linear equations hold for " // dof // " up to " &
        & // small_motion_limits(0.0_dp) // newline
    end if
  end function report_sweep

  !> Headline of the sweep: number of points with each verdict or, if the input does not request the verdicts, the largest rho_max.
  pure function sweep_headline(summary) result(line)
    type(summary_type), intent(in) :: summary
    character(len=:), allocatable :: line

    line = "Sweep: " // integer_text(summary%points) // " points"
    if (summary%tally() /= "") then
      line = line // ", " // summary%tally()
    else if (summary%least <= summary%most) then
      line = line // ", largest multiplier |rho| = " // modulus_text(summary%most)
    end if
  end function sweep_headline

  !> Line of the report: number of solutions, and number of points that were compared with separate solutions.
  pure function evidence_line(summary) result(line)
    type(summary_type), intent(in) :: summary
    character(len=:), allocatable :: line

    line = "  the sweep was computed from " // integer_text(summary%solutions) // " solutions"
    if (summary%checks > 0) line = line // "; " // integer_text(summary%checks) // " points were checked against separate " &
      & // "solutions, largest deviation of Phi(T) " // concise(summary%deviation, 2)
    line = line // newline
  end function evidence_line

  !> A modulus |rho| as text, or a note that it overflows.
  pure function modulus_text(value) result(words)
    real(dp), intent(in) :: value
    character(len=:), allocatable :: words

    words = "beyond 1.8e308"
    if (value <= huge(value)) words = concise(value, 9)
  end function modulus_text

end module gestell_task_sweep_report
