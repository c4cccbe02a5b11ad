!> Decides which reported numbers are only rounding error, and states the share of an order in a vibration.
module gestell_output_report_significance
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_output_report_orders, only: order_of
  implicit none (type, external)
  private

  public :: zero_if_noise, order_words

  !> An error below this fraction of the largest value of the same quantity is rounding error.
  real(dp), parameter :: rounding = 1.0e-9_dp

contains

  !> Factor to be applied to a reported number: 0 if the number is rounding error, otherwise 1. It is rounding error if it does not
  !> exceed its error bound and this bound is negligible relative to `maximum`. With a larger bound, the number need not be zero.
  elemental real(dp) function zero_if_noise(value, error, maximum) result(factor)
    real(dp), intent(in) :: value, error, maximum

    factor = merge(0.0_dp, 1.0_dp, abs(value) <= error .and. error <= rounding * maximum)
  end function zero_if_noise

  !> An order and its share of the mean square, for example "2 (91.3 %)". By Parseval's theorem the share never exceeds 100 %. The
  !> ratio of amplitude to peak can exceed 100 %: the amplitude of a vector is the root of the sum of squares of its components.
  pure function order_words(order, amplitude, rms, turns) result(words)
    !> `order`: number of the harmonic of the period; `turns`: number of turns of the crank in the period
    integer, intent(in) :: order, turns
    !> `amplitude`: of this harmonic; `rms`: of the whole vibration, in the same unit
    real(dp), intent(in) :: amplitude, rms
    character(len=:), allocatable :: words

    words = order_of(order, turns) // " (" // concise(50 * min(amplitude / max(rms, tiny(rms)), sqrt(2.0_dp))**2, 3) // " %)"
  end function order_words

end module gestell_output_report_significance
