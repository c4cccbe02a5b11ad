!> Predicts how many phases resolve a periodic function, from the decay of its harmonics.
module gestell_floquet_reduction_resolution
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_reduction_phasewise, only: along_phases, lanes
  implicit none (type, external)
  private

  public :: phases_needed

contains

  !> Number of phases, a multiple of `lanes`, that resolves a function: all harmonics of an order above half this number are
  !> below `allowed`. `a` contains matrices at N equidistant phases, shape (N, n, n). The logarithms of the harmonics are
  !> extrapolated along a straight line. The result is never below N. It is N if the prediction exceeds `most`.
  pure integer function phases_needed(a, allowed, most) result(phases)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), intent(in) :: allowed
    integer, intent(in) :: most
    real(dp) :: sizes(4), fall, order
    integer :: last

    phases = size(a, 1)
    last = phases / 2 - 1
    ! Compare pairs of neighbouring harmonics: in functions of period 1/2 every other harmonic vanishes.
    sizes = harmonics(a, [last / 2, last / 2 + 1, last - 1, last])
    associate (middle => maxval(sizes(:2)), highest => maxval(sizes(3:)))
      if (highest <= allowed .or. highest >= middle) return
      fall = log(middle / highest) / (last - last / 2 - 1)
      order = last - 0.5_dp + log(highest / allowed) / fall
    end associate
    if (2 * order < most) phases = max(phases, lanes * ceiling(2 * order / lanes))
  end function phases_needed

  !> Amplitude of each harmonic in `orders`: the maximum over all matrix elements.
  pure function harmonics(a, orders) result(sizes)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    integer, intent(in) :: orders(:)
    real(dp) :: sizes(size(orders))
    real(dp) :: waves(2 * size(orders), size(a, 1)), parts(2 * size(orders), size(a, 2), size(a, 3)), wave(0:size(a, 1) - 1)
    integer :: n, j, k, quarter

    n = size(a, 1)
    wave = [(2 * cos(2 * pi * j / n) / n, j = 0, n - 1)]
    quarter = n / 4
    do j = 1, n
      do k = 1, size(orders)
        waves(2 * k - 1, j) = wave(modulo(orders(k) * (j - 1), n))
        waves(2 * k, j) = wave(modulo(orders(k) * (j - 1) - quarter, n))
      end do
    end do
    call along_phases(waves, a, parts)
    sizes = [(sqrt(maxval(parts(2 * k - 1, :, :)**2 + parts(2 * k, :, :)**2)), k = 1, size(orders))]
  end function harmonics

end module gestell_floquet_reduction_resolution
