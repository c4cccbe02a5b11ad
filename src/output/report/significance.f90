!> What is told of numbers that are no more than their errors, and of orders beside the whole.
module gestell_output_report_significance
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_output_report_orders, only: order_of
  implicit none (type, external)
  private

  public :: noise_of, order_words

  !> An error below this part of the greatest number of its kind is what rounding leaves.
  real(dp), parameter :: rounding = 1.0e-9_dp

contains

  !> The factor of a number that is told: 0 where its error is no less and both are what rounding leaves of zero beside the
  !> `greatest` of its kind; else 1, for an error that tells nothing is no zero.
  elemental real(dp) function noise_of(value, error, greatest) result(factor)
    real(dp), intent(in) :: value, error, greatest

    factor = merge(0.0_dp, 1.0_dp, abs(value) <= error .and. error <= rounding * greatest)
  end function noise_of

  !> An order and what it has of the mean square of the whole, by Parseval's theorem never more than all: "2 (91.3 %)". Its
  !> amplitude, of a vector the root of the sum of its components' squares, would not do: it can exceed the peak.
  !> `turns`: in the period, of which the order is a multiple.
  pure function order_words(order, amplitude, rms, turns) result(words)
    integer, intent(in) :: order, turns
    real(dp), intent(in) :: amplitude, rms
    character(len=:), allocatable :: words

    words = order_of(order, turns) // " (" // concise(50 * min(amplitude / max(rms, tiny(rms)), sqrt(2.0_dp))**2, 3) // " %)"
  end function order_words

end module gestell_output_report_significance
