!> Writes the report of the task `trade`: measured computing time against accuracy.
module gestell_task_trade_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_report_text_table, only: number_cells, tab, tabulated
  use gestell_task_response_names, only: peak_heads, peak_units, peak_words
  use gestell_task_stability_report, only: modulus
  use gestell_task_trade_model_trade, only: model_finding_type, model_trade_type
  use gestell_task_trade, only: cheapest, trade_type
  implicit none (type, external)
  private

  public :: report_frame_models, report_model, report_trade

contains

  !> Table of the fastest method for each of several accuracies, followed by the additional time for one more digit.
  function report_trade(trade) result(lines)
    type(trade_type), intent(in) :: trade
    character(len=:), allocatable :: lines, rows
    real(dp), parameter :: accuracies(4) = [1.0e-3_dp, 1.0e-6_dp, 1.0e-9_dp, 1.0e-12_dp]
    integer :: best(size(accuracies)), i

    rows = ""
    do i = 1, size(accuracies)
      best(i) = cheapest(trade%rows, accuracies(i))
      rows = rows // concise(accuracies(i), 2) // tab
      if (best(i) == 0) then
        rows = rows // "not reached" // newline
        cycle
      end if
      associate (row => trade%rows(best(i)))
        rows = rows // trim(row%method) // tab // text(row%steps) // tab // text(row%evaluations) // tab &
          & // concise(1000 * row%seconds, 3) // newline
      end associate
    end do
    lines = newline // "SPEED AGAINST ACCURACY: Phi(T) and x_p(T) of this machine on this computer" // newline &
      & // tabulated("rlrrr", "errors of Phi(T),fastest,steps,evaluations,time" // newline // "and x0 below,method,,,ms", rows)
    ! If the same row is the fastest for both accuracies, more digits cost nothing.
    if (all(best([1, 3]) > 0) .and. best(1) /= best(3)) lines = lines // "  between errors of 1e-3 and 1e-9 each further " &
      & // "digit takes " // concise(100 * ((trade%rows(best(3))%seconds / trade%rows(best(1))%seconds)**(1.0_dp / 6) - 1), 2) &
      & // " % more time" // newline
    lines = lines // "  reference: a converged solution with errors of " // concise(trade%floor_phi, 1) &
      & // " (Phi(T)) and " // concise(trade%floor_x0, 1) // " (x0)" // newline
  end function report_trade

  !> Table of the errors caused by averaging, and advice whether the periodic coefficients are needed. `turns`: number of turns that
  !> the crank makes in the period.
  pure function report_model(trade, turns) result(lines)
    type(model_trade_type), intent(in) :: trade
    integer, intent(in) :: turns
    character(len=:), allocatable :: lines, growth, worst
    character(len=24), allocatable :: names(:)
    real(dp), parameter :: most = log(huge(1.0_dp)) - 1, negligible = 0.01_dp, moderate = 0.1_dp
    integer :: i

    growth = "ln |rho| " // either("over " // turns_in_words(turns), "per turn", turns > 1)
    lines = "verdict" // tab // trim(trade%periodic%verdict) // tab // trim(trade%averaged%verdict) // newline &
      & // line("largest |rho|", exp(min(trade%periodic%log_rho, most)), exp(min(trade%averaged%log_rho, most)), &
      & trade%rho_difference()) // line(growth, trade%periodic%log_rho, trade%averaged%log_rho, trade%log_rho_difference())
    if (allocated(trade%averaged%peak)) then
      names = peak_words(size(trade%averaged%peak) / 3)
      do i = 1, size(names)
        if (trade%periodic%peak(i) > 0) lines = lines &
          & // line(names(i), trade%periodic%peak(i), trade%averaged%peak(i), trade%peak_difference(i))
      end do
    end if
    lines = newline // "PERIODIC OR AVERAGED COEFFICIENTS" // newline // tabulated("lrrr", ",periodic,averaged,difference", lines)
    if (.not. allocated(trade%averaged%peak)) lines = lines // "  " // trade%resonance // newline
    worst = concise(100 * trade%worst_difference(), 2) // " %"
    if (trade%periodic%verdict /= trade%averaged%verdict) then
      lines = lines // "  The two verdicts differ: use the periodic coefficients."
    else if (allocated(trade%resonance)) then
      lines = lines // "  The averaged model has no periodic vibration: use the periodic coefficients."
    else if (trade%worst_difference() > moderate) then
      lines = lines // "  The averaged model differs from the periodic one by up to " // worst // ": use the periodic " // &
        &   "coefficients."
    else if (trade%worst_difference() > negligible) then
      lines = lines // "  The averaged model differs from the periodic one by up to " // worst // ": use it for a first " // &
        &   "estimate, but not for final results."
    else
      lines = lines // "  The averaged model differs from the periodic one by at most " // worst // ": it is accurate " // &
        &   "enough for this machine at this speed."
    end if
    lines = lines // newline // "  time: averaged " // concise(1000 * trade%averaged%seconds, 2) &
      & // " ms, periodic " // concise(1000 * trade%periodic%seconds, 2) // " ms. Averaged coefficients never show parametric " &
      & // "resonance." // newline
  end function report_model

  !> Row of the table: a value with periodic coefficients, the value with averaged coefficients, and their relative difference.
  !> `difference` is 0 if the values agree within the error bounds.
  pure function line(name, periodic, averaged, difference) result(row)
    character(len=*), intent(in) :: name
    real(dp), intent(in) :: periodic, averaged, difference
    character(len=:), allocatable :: row

    row = trim(name) // tab // concise(periodic, 6) // tab // concise(averaged, 6) // tab &
      & // either(concise(100 * difference, 2) // " %", "within the error", abs(difference) > 0) // newline
  end function line

  !> Table of the models of the frame: verdict, largest modulus, peaks (mm, mrad) and computing time of each.
  pure function report_frame_models(findings) result(lines)
    type(model_finding_type), intent(in) :: findings(:)
    character(len=:), allocatable :: lines, peaks
    integer :: dofs, i

    lines = ""
    peaks = ""
    dofs = size(findings(1)%peak)
    do i = 1, size(findings)
      associate (found => findings(i))
        lines = lines // trim(found%model) // tab // trim(found%verdict) // tab
        if (len_trim(found%verdict) > 0) lines = lines // modulus(found%log_rho, 10)
        if (allocated(found%reason)) then
          lines = lines // repeat(tab, merge(2 + dofs, 2, dofs == 3)) // found%reason // newline
        else if (dofs == 3) then
          lines = lines // number_cells(1000 * found%peak, 6) // tab // concise(1000 * found%seconds, 2) // newline
        else
          lines = lines // tab // concise(1000 * found%seconds, 2) // newline
          peaks = peaks // trim(found%model) // number_cells(1000 * found%peak, 4) // newline
        end if
      end associate
    end do
    if (dofs == 3) then
      lines = tabulated("llrrrrrl", "model,verdict,|rho|" // peak_heads(dofs) // ",time" // newline // ",," // peak_units(dofs) &
        & // ",ms", lines)
    else
      ! the peaks of six degrees of freedom are written in a separate table
      lines = tabulated("llrrl", "model,verdict,|rho|,time" // newline // ",,,ms", lines)
      if (peaks /= "") lines = lines // "  peaks" // newline // tabulated("l" // repeat("r", dofs), "model" // peak_heads(dofs) &
        & // newline // peak_units(dofs), peaks)
    end if
    lines = newline // "THE FRAME'S MODELS, verdict and vibration" // newline // lines
  end function report_frame_models

end module gestell_task_trade_report
