!> Expresses orders (multiples of the crank speed) in words for the report.
module gestell_output_report_orders
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, text
  use gestell_math_rational, only: greatest_divisor
  implicit none (type, external)
  private

  public :: order_as_fraction, order_of, range_of, turns_in_words

contains

  !> Order of harmonic `k` of a period in which the crank completes `turns` turns, for example "2" or "0.5".
  pure function order_of(k, turns) result(words)
    integer, intent(in) :: k, turns
    character(len=len(either(text(k / turns), concise(real(k, dp) / turns, 4), modulo(k, turns) == 0))) :: words

    words = either(text(k / turns), concise(real(k, dp) / turns, 4), modulo(k, turns) == 0)
  end function order_of

  !> Order of harmonic `k` as an integer or a reduced fraction, such as "1" or "1/2", for the name of a column.
  pure function order_as_fraction(k, turns) result(words)
    integer, intent(in) :: k, turns
    character(len=:), allocatable :: words
    integer :: shared

    shared = greatest_divisor(k, turns)
    words = text(k / shared)
    if (turns > shared) words = words // "/" // text(turns / shared)
  end function order_as_fraction

  !> Phrase for the orders that do not exceed `highest`: "1 to 4", or "up to 4" if the period has more than one turn.
  pure function range_of(highest, turns) result(words)
    integer, intent(in) :: highest, turns
    character(len=:), allocatable :: words

    words = either("up to ", "1 to ", turns > 1) // text(highest)
  end function range_of

  !> Phrase for a number of turns: "a turn" or "2 turns".
  pure function turns_in_words(turns) result(words)
    integer, intent(in) :: turns
    character(len=6 + merge(len(text(turns)), 0, turns > 1)) :: words

    words = either(text(turns) // " turns", "a turn", turns > 1)
  end function turns_in_words

end module gestell_output_report_orders
