!> What is said of several periodic vibrations of one machine: report.
module gestell_task_machine_several
  use gestell_base_text, only: concise, text
  use gestell_task_stability_report, only: told
  use gestell_input_wording, only: counted, padded
  use gestell_study_vibration_several, only: index_sum, several_type
  implicit none (type, external)
  private

  public :: among, several_lines

  character, parameter :: newline = new_line("a")

contains

  !> For the line of the verdict: how many vibrations there are, and whether another one is stable.
  pure function among(several) result(words)
    type(several_type), intent(in), allocatable :: several(:)
    character(len=:), allocatable :: words
    integer :: others, i

    words = ""
    if (.not. allocated(several)) return
    if (size(several) < 2) return
    words = "; one of " // text(size(several)) // " vibrations"
    others = count([(.not. several(i)%told .and. several(i)%multipliers%verdict() == "stable", i = 1, size(several))])
    if (others == 1) words = words // ", another one is STABLE too"
    if (others > 1) words = words // ", " // text(others) // " others are STABLE too"
  end function among

  !> The vibrations one by one; `sought`: whether all were looked for.
  pure function several_lines(several, sought) result(lines)
    type(several_type), intent(in), allocatable :: several(:)
    logical, intent(in) :: sought
    character(len=:), allocatable :: lines
    integer :: i, k, missing

    lines = ""
    if (.not. allocated(several)) return
    lines = newline // "VIBRATIONS at this speed: " // text(size(several))
    if (sought) lines = lines // ", sought on paths over excitation and speed"
    lines = lines // newline &
      & // "          |rho|    error    verdict      rms: xi mm    eta mm  psi mrad    peak: xi mm    eta mm  psi mrad" // newline
    do i = 1, size(several)
      associate (v => several(i))
        lines = lines // padded(text(i), 2) // padded(told(v%multipliers, 1, 9), 13) &
          & // padded(concise(v%multipliers%error(1), 1), 9) // padded(trim(v%multipliers%verdict()), 11)
        do k = 1, 3
          lines = lines // padded(concise(1000 * v%rms(k), 5), merge(16, 10, k == 1))
        end do
        do k = 1, 3
          lines = lines // padded(concise(1000 * v%peak(k), 5), merge(15, 10, k == 1))
        end do
        if (v%vibration_index() < 0) lines = lines // "  between two turning points: no machine keeps to it"
        if (v%told) lines = lines // "  <- told here"
        lines = lines // newline
      end associate
    end do
    missing = abs(1 - index_sum(several))
    if (missing > 0) lines = lines // "  by their indices (between turning points -1, else 1), whose sum is 1, at least " &
      & // counted(missing, "vibration") // trim(merge(" more was not found ", " more were not found", missing == 1)) // newline
    if (.not. sought) lines = lines // "  met on the way; &model vibrations='all' looks for all" // newline
    if (size(several) > 1) lines = lines // "  which one the machine comes to depends on how it " &
      & // "was run up" // newline
  end function several_lines

end module gestell_task_machine_several
