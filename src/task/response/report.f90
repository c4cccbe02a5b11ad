!> Writes the report on the periodic vibration.
module gestell_task_response_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_model_frame, only: frame_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_report_significance, only: zero_if_noise, order_words
  use gestell_study_vibration, only: vibration_type
  use gestell_model_space, only: is_rotation
  use gestell_task_response_names, only: name_type, names_of
  implicit none (type, external)
  private

  public :: closing_lines, vibration_lines

contains

  !> Table of the quantities of the vibration: peak, error bound, rms, and the order with the largest amplitude.
  pure function vibration_lines(vibration, frame) result(lines)
    type(vibration_type), intent(in) :: vibration
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    type(name_type) :: names(3 * frame%dofs())
    real(dp) :: noise
    integer :: i, order

    lines = ""
    names = names_of(frame%dofs())
    do i = 1, size(names)
      if (.not. any(frame%free == 1 + mod(i - 1, frame%dofs()))) cycle
      associate (series => vibration%series(i))
        noise = zero_if_noise(vibration%peak(i), vibration%peak_error(i), largest_of_kind(vibration, frame, i))
        lines = lines // trim(names(i)%words) // tab // concise(names(i)%factor * noise * vibration%peak(i), 5) // tab &
          & // concise(names(i)%factor * vibration%peak_error(i), 1) // tab &
          & // concise(names(i)%factor * noise * vibration%rms(i), 5) // tab // trim(names(i)%small_unit) // tab
        order = maxloc(series%amplitude, dim=1)
        if (vibration%peak(i) > vibration%peak_error(i)) lines = lines // order_words(order, series%amplitude(order), &
          & vibration%rms(i), frame%mechanism%turns)
        lines = lines // newline
      end associate
    end do
    lines = tabulated("lrrrll", ",peak,error,rms,,strongest order" // newline // ",,,,,(% of rms^2)", lines)
    if (any([(vibration%peak_error(frame%free(i)) >= vibration%peak(frame%free(i)) .and. vibration%peak(frame%free(i)) > 0 &
      & .and. zero_if_noise(vibration%peak(frame%free(i)), vibration%peak_error(frame%free(i)), &
      & largest_of_kind(vibration, frame, frame%free(i))) > 0, i = 1, size(frame%free))])) lines = lines // &
      & "  note: a peak no larger than its error bound is meaningless; reduce accuracy.tolerance or increase accuracy.steps" &
      & // newline
  end function vibration_lines

  !> Line on the accuracy of the periodic solution: its condition number and, unless the coefficients are `averaged`, the closing
  !> defect. This is the change of the motion from the start to the end of the period of `turns` turns of the crank.
  pure function closing_lines(vibration, turns, averaged) result(line)
    type(vibration_type), intent(in) :: vibration
    integer, intent(in) :: turns
    logical, intent(in) :: averaged
    character(len=:), allocatable :: line

    line = "condition " // concise(vibration%start%condition, 2) // ", loses " &
      & // concise(max(0.0_dp, log10(vibration%start%condition)), 2) // " digits"
    if (averaged) then
      line = "  each harmonic solved separately: worst " // line // newline
    else
      line = "  start x0 from (E - Phi) x0 = x_p(T): " // line // "; motion repeats after " &
        & // turns_in_words(turns) // " within " // concise(vibration%closing_defect, 1) // newline
    end if
  end function closing_lines

  !> Largest peak among the quantities of the same kind as quantity number `i`: displacements, velocities, or forces. It is
  !> converted to the unit of quantity `i`. The frame's radius of gyration converts between displacements and rotations, and
  !> between forces and moments.
  pure real(dp) function largest_of_kind(vibration, frame, i) result(maximum)
    type(vibration_type), intent(in) :: vibration
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: i
    real(dp) :: scale(frame%dofs()), radius
    integer :: first, n, k

    n = frame%dofs()
    first = n * ((i - 1) / n) + 1
    radius = 1
    if (frame%mass > 0 .and. frame%inertia > 0) radius = sqrt(frame%inertia / frame%mass)
    if (first == 2 * n + 1) radius = 1 / radius
    scale = merge(radius, 1.0_dp, is_rotation([(k, k = 1, n)]))
    maximum = maxval(vibration%peak(first:first + n - 1) * scale) / scale(i - first + 1)
  end function largest_of_kind

end module gestell_task_response_report
