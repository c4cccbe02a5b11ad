!> Writes the report on the vibration at the probes, which are points of the frame.
module gestell_task_probes_report
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline
  use gestell_base_verdict, only: verdict_type
  use gestell_output_report_orders, only: order_of
  use gestell_output_report_text_table, only: number_cells, tab, tabulated
  use gestell_output_report_verdict, only: vibration_warning
  use gestell_task_probes_response, only: probe_response_type
  implicit none (type, external)
  private

  public :: limit_sentence, probe_lines

contains

  !> Table of all probes, followed by a line for each probe on its band and on its limit. `period`: the period (s). `turns`: number
  !> of turns that the crank makes in it.
  pure function probe_lines(responses, period, turns, verdict) result(lines)
    !> Vibration at each probe
    type(probe_response_type), intent(in) :: responses(:)
    real(dp), intent(in) :: period
    integer, intent(in) :: turns
    !> Verdict on the stability of the machine
    type(verdict_type), intent(in) :: verdict
    character(len=:), allocatable :: lines
    type(growing_text_type) :: rows, bands
    real(dp), parameter :: factors(3) = [1.0e3_dp, 1.0e3_dp, 1.0_dp]
    integer :: i, k

    do i = 1, size(responses)
      associate (response => responses(i), probe => responses(i)%probe)
        call rows%append(trim(probe%name) // " (" // concise(probe%position(1), 4) // "," // concise(probe%position(2), 4))
        if (size(response%parts) > 9) call rows%append("," // concise(probe%z, 4))
        call rows%append(")" // number_cells([(factors(k) * response%statistics(k * size(response%parts) / 3)%peak, k = 1, 3)], 5) &
          & // tab // concise(1000 * response%maximum, 5) // tab // concise(1000 * response%error, 1) // newline)
      end associate
      call bands%append(band_lines(responses(i), period, turns, verdict))
    end do
    lines = tabulated("lrrrrr", ",peak,peak,peak,rms in band,error" // newline // ",mm,mm/s,m/s^2,mm/s,mm/s", rows%whole()) &
      & // bands%whole()
  end function probe_lines

  !> Lines for one probe: comparison with its limit, and the orders of the crank that lie within its band.
  pure function band_lines(response, period, turns, verdict) result(lines)
    type(probe_response_type), intent(in) :: response
    real(dp), intent(in) :: period
    integer, intent(in) :: turns
    type(verdict_type), intent(in) :: verdict
    character(len=:), allocatable :: lines
    !> Ratio of the rms velocity over all orders to the rms within the band. Above this ratio the report warns that much of the
    !> velocity lies outside the band
    real(dp), parameter :: significant_ratio = 1.5_dp
    real(dp) :: orders(2), whole

    associate (band => response%probe%band, limit => response%probe%limit)
      lines = "  " // trim(response%probe%name) // ": "
      if (limit > 0) lines = lines // limit_comparison(response) // "; "
      lines = lines // concise(band(1)) // " to " // concise(band(2)) // " Hz, "
      orders = min(band * period, 1.0e9_dp)
      orders = [max(1, ceiling(orders(1) * (1 - 1.0e-12_dp))), floor(orders(2) * (1 + 1.0e-12_dp))]
      lines = lines // either("no order of the crank in this band", "orders " // order_of(nint(orders(1)), turns) // " to " &
        & // order_of(nint(orders(2)), turns), orders(2) < orders(1)) // newline
      if (limit > 0 .and. vibration_warning(verdict) /= "") lines = lines // "    " // vibration_warning(verdict) // newline
      whole = response%statistics(2 * size(response%parts) / 3)%rms
      if (whole > significant_ratio * response%maximum .and. orders(1) > 1) lines = lines &
        & // "    note: much of the velocity lies " // &
        & "outside the band; the rms of all orders is " // concise(1000 * whole, 4) // " mm/s" // newline
    end associate
  end function band_lines

  !> Text that compares the velocity at a probe with its limit.
  pure function limit_comparison(response) result(words)
    type(probe_response_type), intent(in) :: response
    character(len=:), allocatable :: words, limit
    real(dp) :: ratio
    !> If the relative difference between the velocity and the limit is smaller than this, the difference is printed instead of the
    !> ratio
    real(dp), parameter :: near = 0.01_dp

    limit = "the limit of " // concise(1000 * response%probe%limit) // " mm/s"
    ratio = response%maximum / response%probe%limit
    select case (response%verdict())
    case ("within")
      words = either(concise(100 * (1 - ratio), 3) // " % below ", concise(100 * ratio, 3) // " % of ", 1 - ratio < near) // limit
    case ("above")
      words = either(concise(100 * (ratio - 1), 3) // " % above ", concise(ratio, 3) // " times ", ratio - 1 < near) // limit
    case default
      words = "UNDECIDED: " // limit // " lies within the error bound"
    end select
  end function limit_comparison

  !> Sentence that compares the velocity at a probe with its limit. `verdict`: verdict on the stability of the machine.
  pure function limit_sentence(response, verdict) result(sentence)
    type(probe_response_type), intent(in) :: response
    type(verdict_type), intent(in) :: verdict
    character(len=:), allocatable :: sentence

    sentence = trim(response%probe%name) // ": " // concise(1000 * response%maximum, 4) // " mm/s, " // limit_comparison(response)
    if (vibration_warning(verdict) /= "") sentence = vibration_warning(verdict) // "; " // sentence
  end function limit_sentence

end module gestell_task_probes_report
