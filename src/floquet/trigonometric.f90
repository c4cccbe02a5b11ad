!> Trigonometric interpolation of functions with period 1 on an odd number N of equidistant phases (k - 1) / N.
module gestell_floquet_trigonometric
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: differentiation, equidistant, interpolation

contains

  !> The phases, shape (n); a `shift` of 1/2 gives those in the middle between them.
  pure function equidistant(n, shift) result(phases)
    integer, intent(in) :: n
    real(dp), intent(in), optional :: shift
    real(dp) :: phases(n)
    integer :: k

    phases = [(real(k, dp) / n, k = 0, n - 1)]
    if (present(shift)) phases = phases + shift / n
  end function equidistant

  !> D, shape (n, n): the derivative with respect to the phase, at the phases, of what takes the values f there is D f.
  pure function differentiation(n) result(d)
    integer, intent(in) :: n
    real(dp) :: d(n, n)
    integer :: i, k

    do k = 1, n
      do i = 1, n
        d(i, k) = 0
        if (i /= k) d(i, k) = pi * (1 - 2 * modulo(i - k, 2)) / sin(pi * (i - k) / n)
      end do
    end do
  end function differentiation

  !> W, shape (size(phases), n): what takes the values f at the n phases takes W f at `phases`.
  pure function interpolation(n, phases) result(w)
    integer, intent(in) :: n
    real(dp), intent(in) :: phases(:)
    real(dp) :: w(size(phases), n)
    real(dp) :: distance
    integer :: i, k

    do k = 1, n
      do i = 1, size(phases)
        distance = phases(i) - real(k - 1, dp) / n
        distance = distance - nint(distance)
        w(i, k) = 1
        if (abs(distance) > epsilon(1.0_dp)) w(i, k) = sin(pi * n * distance) / (n * sin(pi * distance))
      end do
    end do
  end function interpolation

end module gestell_floquet_trigonometric
