!> Wording of numbers smaller than their errors, and of single orders relative to the whole vibration.
module gestell_output_report_significance
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_output_report_orders, only: order_of
  implicit none (type, external)
  private

  public :: noise_of, order_words

  !> An error below this fraction of the largest number of its kind is rounding error.
  real(dp), parameter :: rounding = 1.0e-9_dp

contains

  !> Factor by which a reported number is multiplied: 0 if the number is rounding error, otherwise 1. It is rounding error if it
  !> does not exceed its error and the error is negligible relative to `greatest`. A larger error does not prove that the number is
  !> zero.
  elemental real(dp) function noise_of(value, error, greatest) result(factor)
    real(dp), intent(in) :: value, error, greatest

    factor = merge(0.0_dp, 1.0_dp, abs(value) <= error .and. error <= rounding * greatest)
  end function noise_of

  !> An order and its share of the mean square, for example "2 (91.3 %)". By Parseval's theorem the share never exceeds 100 %. The
  !> ratio of amplitude to peak would not do: for a vector the amplitude (the root sum of squares of its components) can exceed the
  !> peak. `turns` is the number of turns in the period; `order` counts harmonics of the period.
  pure function order_words(order, amplitude, rms, turns) result(words)
    !> Number of the harmonic of the period; turns of the crank in the period
    integer, intent(in) :: order, turns
    !> Amplitude of this harmonic; rms of the whole vibration, in the same unit
    real(dp), intent(in) :: amplitude, rms
    character(len=:), allocatable :: words

    words = order_of(order, turns) // " (" // concise(50 * min(amplitude / max(rms, tiny(rms)), sqrt(2.0_dp))**2, 3) // " %)"
  end function order_words

end module gestell_output_report_significance
