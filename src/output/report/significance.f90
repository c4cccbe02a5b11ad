!> Decides which reported numbers are only rounding errors, and states how much an order contributes to a vibration.
module gestell_output_report_significance
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_output_report_orders, only: order_of
  implicit none (type, external)
  private

  public :: zero_if_noise, order_words

  !> An error bound below this fraction of the largest value of the same quantity is attributed to rounding.
  real(dp), parameter :: rounding = 1.0e-9_dp

contains

  !> Factor for a reported number: 0 if the number is only rounding error, otherwise 1. It is only rounding error if two conditions
  !> hold: it does not exceed its error bound, and this bound is negligible compared with `maximum`. If the bound is larger, the
  !> number need not be zero.
  elemental real(dp) function zero_if_noise(value, error, maximum) result(factor)
    real(dp), intent(in) :: value, error, maximum

    factor = merge(0.0_dp, 1.0_dp, abs(value) <= error .and. error <= rounding * maximum)
  end function zero_if_noise

  !> Phrase for an order and its share of the mean square, for example "2 (91.3 %)". By Parseval's theorem this share never exceeds
  !> 100 %. The ratio of amplitude to peak can exceed 100 %, because a vector's amplitude is the root of the sum of the squared
  !> amplitudes of its components.
  pure function order_words(order, amplitude, rms, turns) result(words)
    !> `order`: number of the harmonic of the period. `turns`: number of turns that the crank completes in the period
    integer, intent(in) :: order, turns
    !> `amplitude`: amplitude of this harmonic. `rms`: rms of the whole vibration, in the same unit
    real(dp), intent(in) :: amplitude, rms
    character(len=:), allocatable :: words

    words = order_of(order, turns) // " (" // concise(50 * min(amplitude / max(rms, tiny(rms)), sqrt(2.0_dp))**2, 3) // " %)"
  end function order_words

end module gestell_output_report_significance
