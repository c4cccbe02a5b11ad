!> Writes the report of the task `resonance`: the resonance curves.
module gestell_task_resonance_report
  use gestell_base_verdict, only: failed, impossible, in_resonance, judgement_type, not_judged, operator(/=), operator(==), &
    & operator(>), stable, state_word, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_input_wording, only: counted
  use gestell_output_report_orders, only: order_of
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_output_report_warnings, only: judge_range
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_task_resonance_curve, only: resonance_curve_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  implicit none (type, external)
  private

  public :: report_resonance, curve_verdict

  !> Maximum number of maxima that are listed for each quantity
  integer, parameter :: max_listed = 8

contains

  !> Section of the report on the resonance curves, quantity by quantity.
  pure function report_resonance(quantities, curve, turns, verdict, warning, model) result(report)
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    !> Number of turns that the crank makes in the period
    integer, intent(in) :: turns
    !> `verdict`: verdict on the vibrations. `warning`: warning that some motions are too large for the linearised equations.
    !> `model`: model of the frame
    character(len=*), intent(in) :: warning, model
    type(judgement_type), intent(in) :: verdict
    character(len=:), allocatable :: report
    !> States of those points at which no vibration was computed
    type(verdict_type), parameter :: missing(3) = [in_resonance, impossible, failed]
    character(len=*), parameter :: reasons(3) = [character(len=46) :: "no periodic vibration exists (resonance)", &
      & "the mechanism cannot be assembled", "the computation failed"]
    integer :: i, n, refined

    n = size(curve%points)
    refined = count(curve%points%refined)
    report = newline // "RESONANCE CURVE  " // concise(curve%points(1)%speed, 9) // " to " // concise(curve%points(n)%speed, 9) &
      & // " rpm, " // counted(n - refined, "grid speed") // " and " // text(refined) // " added between them" // newline
    if (verdict%verdict > stable) report = report // "  " // verdict%sentence() // newline
    report = report // warning
    do i = 1, size(missing)
      if (count(curve%points%state == missing(i)) == 0) cycle
      report = report // "  note: at " // counted(count(curve%points%state == missing(i)), "speed") // " " &
        & // trim(reasons(i)) // newline
    end do
    if (.not. curve%complete) report = report // "  note: even with the maximum number of speeds, some details of the curve " // &
      &   "are not resolved; choose a smaller range" // newline
    do i = 1, size(quantities)
      report = report // curve_lines(curve, i, quantities(i), turns, model)
    end do
  end function report_resonance

  !> The worst verdict on the vibrations of the curve. It is printed at the head of the report on the curve and in its files.
  pure type(judgement_type) function curve_verdict(curve) result(judgement)
    type(resonance_curve_type), intent(in) :: curve

    judgement = judge_range((curve%points%speed), merge(curve%points%state, not_judged, curve%has_values()), "speeds", &
      & "disturbances of these vibrations grow")
  end function curve_verdict

  !> Lines of the report on quantity number `q`: its largest maxima, its jumps and its minimum.
  pure function curve_lines(curve, q, quantity, turns, model) result(report)
    type(resonance_curve_type), intent(in) :: curve
    integer, intent(in) :: q, turns
    type(quantity_type), intent(in) :: quantity
    character(len=*), intent(in) :: model
    character(len=:), allocatable :: report, rows, unit
    real(dp) :: peaks(size(curve%points))
    logical :: remaining(size(curve%maxima))
    integer :: i, k, n, jumps, least, most

    report = ""
    unit = trim(quantity%unit)
    if (.not. any(curve%has_values())) return
    remaining = curve%maxima%quantity == q .and. .not. curve%maxima%unbounded
    n = count(remaining)
    jumps = count(remaining .and. curve%maxima%jump)
    report = "  " // trim(quantity%name) // ": " // text(n - jumps) // either(" maximum", " maxima", n - jumps == 1)
    if (jumps > 0) report = report // ", " // counted(jumps, "jump")
    if (n > max_listed) report = report // ", the largest are listed"
    report = report // newline
    rows = ""
    do i = 1, min(max_listed, n)
      k = maxloc(curve%maxima%value, dim=1, mask=remaining)
      remaining(k) = .false.
      associate (maximum => curve%maxima(k))
        rows = rows // concise(maximum%speed, 7) // tab // concise(maximum%value, 6) // tab &
          & // either("-" // tab // "-", concise(maximum%width, 4) // tab // concise(maximum%damping_ratio, 4), &
          & ieee_is_nan(maximum%width)) // tab // order_of(maximum%strongest_order, turns) // tab
        if (maximum%jump) rows = rows // "jump" // either(" at a turning point", "", maximum%fold) // ", beyond it " &
          & // concise(maximum%other_side, 6) // " " // unit // "  "
        if (maximum%state /= stable) rows = rows // trim(state_word(maximum%state)) // "  "
        if (.not. maximum%small .and. model /= "exact") rows = rows // "not small"
      end associate
      rows = rows // newline
    end do
    if (n > 0) report = report // tabulated("rrrrrl", "speed,peak,width,damping,order" // newline // "rpm," // unit &
      & // ",rpm,ratio", rows)
    remaining = curve%maxima%quantity == q .and. curve%maxima%unbounded
    n = count(remaining)
    if (n > 0) report = report // "  unbounded at " // counted(n, "speed") // ":"
    do i = 1, min(max_listed, n)
      k = findloc(remaining, .true., dim=1)
      remaining(k) = .false.
      report = report // either(",", "", i > 1) // " " // concise(curve%maxima(k)%speed, 7)
    end do
    if (n > max_listed) report = report // ", ..."
    if (n > 0) report = report // " rpm" // newline
    peaks = [(curve%points(i)%values(1, q), i = 1, size(peaks))]
    least = minloc(peaks, dim=1, mask=curve%has_values())
    most = maxloc(peaks, dim=1, mask=curve%has_values())
    report = report // "  minimum " // concise(peaks(least), 5) // " " // unit // " at " // concise(curve%points(least)%speed, 5) &
      & // " rpm; maximum " // concise(peaks(most), 5) // " " // unit // " at " // concise(curve%points(most)%speed, 5) // " rpm" &
      & // either(", at an end of the range", "", most == 1 .or. most == size(peaks)) // newline
  end function curve_lines

end module gestell_task_resonance_report
