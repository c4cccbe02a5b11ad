!> Converts numbers from the input to fractions.
module gestell_math_rational
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: common_multiple, greatest_divisor, to_rational

  !> Maximum denominator of a fraction that replaces a decimal number
  integer, parameter :: highest = 64
  !> Maximum relative difference between a decimal number and its fraction
  real(dp), parameter :: rounding = 1.0e-9_dp
  !> Largest numerator or denominator that is accepted
  real(dp), parameter :: maximum = 4096

contains

  !> Converts `values` to a fraction in lowest terms. `values` contains either a decimal number, such as [0.5], or numerator and
  !> denominator, such as [1, 2]. `known` is false if a number is zero or above 4096, if no fraction is close enough to the decimal
  !> number, or if numerator or denominator is not an integer.
  pure subroutine to_rational(values, numerator, denominator, known)
    real(dp), intent(in) :: values(:)
    integer, intent(out) :: numerator, denominator
    logical, intent(out) :: known
    integer :: shared

    numerator = 1
    denominator = 1
    known = all(abs(values) > 0 .and. abs(values) <= maximum)
    if (.not. known) return
    if (size(values) == 1) then
      do denominator = 1, highest
        if (abs(values(1) * denominator - anint(values(1) * denominator)) <= rounding * abs(values(1)) * denominator) exit
      end do
      known = denominator <= highest
      numerator = nint(values(1) * denominator)
    else
      known = .not. any(abs(values - anint(values)) > 0)
      denominator = nint(abs(values(2)))
      numerator = nint(sign(values(1), values(1) * values(2)))
    end if
    if (.not. known) return
    shared = greatest_divisor(numerator, denominator)
    numerator = numerator / shared
    denominator = denominator / shared
  end subroutine to_rational

  !> Greatest common divisor of two nonzero integers, by Euclid's algorithm.
  elemental integer function greatest_divisor(a, b) result(divisor)
    integer, intent(in) :: a, b
    integer :: rest, next

    divisor = abs(a)
    rest = abs(b)
    do while (rest > 0)
      next = modulo(divisor, rest)
      divisor = rest
      rest = next
    end do
  end function greatest_divisor

  !> Least common multiple of two nonzero integers.
  elemental integer function common_multiple(a, b) result(multiple)
    integer, intent(in) :: a, b

    multiple = abs(a) / greatest_divisor(a, b) * abs(b)
  end function common_multiple

end module gestell_math_rational
