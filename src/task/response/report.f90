!> The periodic vibration for people.
module gestell_task_response_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_model_frame, only: frame_type
  use gestell_output_report_significance, only: noise_of, order_words
  use gestell_output_report_verdict, only: section
  use gestell_study_vibration, only: vibration_type
  implicit none (type, external)
  private

  public :: closing_lines, vibration_lines

  character, parameter :: newline = new_line("a")

contains

  pure function vibration_lines(vibration, frame, verdict) result(lines)
    type(vibration_type), intent(in) :: vibration
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: lines
    character(len=*), parameter :: names(9) = [character(len=22) :: "xi of F", "eta of F", "psi", "xi velocity", &
      & "eta velocity", "psi velocity", "force on ground, x", "force on ground, y", "moment on ground"]
    character(len=*), parameter :: units(9) = [character(len=6) :: "mm", "mm", "mrad", "mm/s", "mm/s", "mrad/s", "N", "N", "N m"]
    real(dp), parameter :: factors(9) = [1.0e3_dp, 1.0e3_dp, 1.0e3_dp, 1.0e3_dp, 1.0e3_dp, 1.0e3_dp, 1.0_dp, 1.0_dp, 1.0_dp]
    real(dp) :: noise
    integer :: i, order

    lines = ""
    do i = 1, 9
      if (.not. any(frame%free == 1 + mod(i - 1, 3))) cycle
      associate (series => vibration%series(i))
        noise = noise_of(vibration%peak(i), vibration%peak_error(i), greatest_beside(vibration, frame, i))
        lines = lines // trim(names(i)) // tab // concise(factors(i) * noise * vibration%peak(i), 5) // tab &
          & // concise(factors(i) * vibration%peak_error(i), 1) // tab // concise(factors(i) * noise * vibration%rms(i), 5) &
          & // tab // trim(units(i)) // tab
        order = maxloc(series%amplitude, dim=1)
        if (vibration%peak(i) > vibration%peak_error(i)) lines = lines // order_words(order, series%amplitude(order), &
          & vibration%rms(i))
        lines = lines // newline
      end associate
    end do
    lines = section("PERIODIC VIBRATION", verdict) // tabulated("lrrrll", ",peak,error,rms,,strongest order" &
      & // newline // ",,,,,(% of rms^2)", lines)
    if (any([(vibration%peak_error(frame%free(i)) >= vibration%peak(frame%free(i)) .and. vibration%peak(frame%free(i)) > 0 &
      & .and. noise_of(vibration%peak(frame%free(i)), vibration%peak_error(frame%free(i)), &
      & greatest_beside(vibration, frame, frame%free(i))) > 0, i = 1, size(frame%free))])) lines = lines // &
      & "  note: an error is as great as its peak, which tells nothing then; more steps, or a smaller tolerance, may" // newline
  end function vibration_lines

  !> How well the vibration closes.
  pure function closing_lines(vibration, averaged) result(line)
    type(vibration_type), intent(in) :: vibration
    logical, intent(in) :: averaged
    character(len=:), allocatable :: line

    line = "condition " // concise(vibration%start%condition, 2) // ", costs " &
      & // concise(max(0.0_dp, log10(vibration%start%condition)), 2) // " digits"
    if (averaged) then
      line = "  harmonic by harmonic: at worst " // line // newline
    else
      line = "  start x0 from (E - Phi) x0 = x_p(T): " // line // "; motion closes after a turn to " &
        & // concise(vibration%closing_defect, 1) // newline
    end if
  end function closing_lines

  !> The greatest peak of the kind of the `i`-th quantity, turns and moments made comparable by the frame's radius of gyration.
  pure real(dp) function greatest_beside(vibration, frame, i) result(greatest)
    type(vibration_type), intent(in) :: vibration
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: i
    real(dp) :: scale(3)
    integer :: first

    first = 3 * ((i - 1) / 3) + 1
    scale = 1
    if (frame%mass > 0 .and. frame%inertia > 0) scale(3) = sqrt(frame%inertia / frame%mass)
    if (first == 7) scale(3) = 1 / scale(3)
    greatest = maxval(vibration%peak(first:first + 2) * scale) / scale(i - first + 1)
  end function greatest_beside

end module gestell_task_response_report
