!> Reports the periodic vibrations of a machine that has several of them at its speed.
module gestell_task_machine_vibrations
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_verdict, only: operator(==), stable
  use gestell_task_stability_report, only: modulus_of
  use gestell_input_wording, only: counted
  use gestell_output_report_text_table, only: number_cells, tab, tabulated
  use gestell_task_response_names, only: peak_heads, peak_units
  use gestell_study_vibration_vibration_list, only: index_sum, listed_vibration_type
  implicit none (type, external)
  private

  public :: mention_others, several_lines

contains

  !> Text that is appended to the sentence on the verdict: the number of vibrations, and whether another one is stable too.
  pure function mention_others(several) result(words)
    type(listed_vibration_type), intent(in), allocatable :: several(:)
    character(len=:), allocatable :: words
    integer :: others, i

    words = ""
    if (.not. allocated(several)) return
    if (size(several) < 2) return
    words = "; one of " // text(size(several)) // " periodic vibrations"
    others = count([(.not. several(i)%is_reported .and. several(i)%multipliers%judge() == stable, i = 1, size(several))])
    if (others == 1) words = words // ", another one is also STABLE"
    if (others > 1) words = words // ", " // text(others) // " others are also STABLE"
  end function mention_others

  !> Table of all known vibrations. `searched_all`: true if the input requested a search for all vibrations.
  pure function several_lines(several, searched_all) result(lines)
    type(listed_vibration_type), intent(in), allocatable :: several(:)
    logical, intent(in) :: searched_all
    character(len=:), allocatable :: lines
    integer :: i, missing

    lines = ""
    if (.not. allocated(several)) return
    do i = 1, size(several)
      associate (v => several(i))
        lines = lines // text(i) // tab // modulus_of(v%multipliers, 1, 9) // tab // concise(v%multipliers%error(1), 1) // tab &
          & // trim(v%multipliers%verdict()) // number_cells(1000 * v%peak, merge(5, 4, size(v%peak) == 3)) // tab
        if (v%vibration_index() < 0) lines = lines // "between turning points, unstable  "
        if (v%is_reported) lines = lines // "<- reported here"
        lines = lines // newline
      end associate
    end do
    associate (dofs => size(several(1)%peak))
      lines = tabulated("lrrl" // repeat("r", dofs) // "l", ",|rho|,error,verdict" // peak_heads(dofs) // newline // ",,," &
        & // peak_units(dofs), lines)
    end associate
    lines = newline // "VIBRATIONS at this speed: " // text(size(several)) &
      & // either(", found by varying the excitation and the speed", "", searched_all) // newline // lines
    missing = abs(1 - index_sum(several))
    if (missing > 0) lines = lines // "  at least " // counted(missing, "vibration") &
      & // either(" was not found", " were not found", missing == 1) &
      & // ": the turning indices of all vibrations (-1 between turning points, otherwise 1) must add up to 1" // newline
    if (.not. searched_all) lines = lines // "  these vibrations were found by chance; &model vibrations='all' searches for " &
      & // "all" // newline
    if (size(several) > 1) lines = lines // "  which of these vibrations the machine settles into depends on its run-up" // newline
  end function several_lines

end module gestell_task_machine_vibrations
