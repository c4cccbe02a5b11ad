!> The measured trade of speed for accuracy, for people.
module gestell_io_report_trade
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_io_text, only: padded
  use gestell_study_trade, only: cheapest, trade_type
  implicit none (type, external)
  private

  public :: report_trade

  character, parameter :: newline = new_line("a")

contains

  !> The cheapest way to some accuracies, and what one more digit costs.
  function report_trade(trade) result(lines)
    type(trade_type), intent(in) :: trade
    character(len=:), allocatable :: lines
    real(dp), parameter :: wanted(4) = [1.0e-3_dp, 1.0e-6_dp, 1.0e-9_dp, 1.0e-12_dp]
    integer :: best(size(wanted)), i

    lines = newline // "SPEED FOR ACCURACY, Phi(T) and x_p(T) of this machine on this computer" // newline &
      & // "  errors of Phi(T) and x0 below      cheapest    steps   evaluations   milliseconds" // newline
    do i = 1, size(wanted)
      best(i) = cheapest(trade%rows, wanted(i))
      lines = lines // "  " // padded(concise(wanted(i), 2), 29)
      if (best(i) == 0) then
        lines = lines // "   out of reach" // newline
        cycle
      end if
      associate (row => trade%rows(best(i)))
        lines = lines // padded(trim(row%method), 14) // padded(text(row%steps), 9) // padded(text(row%evaluations), 14) &
          & // padded(concise(1000 * row%seconds, 3), 15) // newline
      end associate
    end do
    if (all(best([1, 3]) > 0)) lines = lines // "  from 1e-3 to 1e-9 one more digit costs " // concise(100 * &
      & ((trade%rows(best(3))%seconds / trade%rows(best(1))%seconds)**(1.0_dp / 6) - 1), 2) // " % more time" // newline
    lines = lines // "  errors are against a converged solution that claims " // concise(trade%floor_phi, 1) &
      & // " for Phi(T) and " // concise(trade%floor_x0, 1) // " for x0" // newline
  end function report_trade

end module gestell_io_report_trade
