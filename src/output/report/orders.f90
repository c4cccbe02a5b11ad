!> Orders of the drive's speed in words.
module gestell_output_report_orders
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  implicit none (type, external)
  private

  public :: order_of, turns_in_words

contains

  !> Of the harmonic k of a period of so many turns.
  pure function order_of(k, turns) result(words)
    integer, intent(in) :: k, turns
    character(len=:), allocatable :: words

    if (modulo(k, turns) == 0) then
      words = text(k / turns)
    else
      words = concise(real(k, dp) / turns, 4)
    end if
  end function order_of

  !> "a turn", "2 turns".
  pure function turns_in_words(turns) result(words)
    integer, intent(in) :: turns
    character(len=:), allocatable :: words

    words = "a turn"
    if (turns > 1) words = text(turns) // " turns"
  end function turns_in_words

end module gestell_output_report_orders
