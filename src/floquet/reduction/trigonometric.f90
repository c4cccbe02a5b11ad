!> Trigonometric interpolation of functions with period 1 on an even number N of equidistant phases (k - 1) / N. Of the
!> highest harmonic, N / 2, there is only the cosine.
module gestell_floquet_reduction_trigonometric
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: differentiation, equidistant, interpolation, middle_interpolation, middle_differentiation

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
    integer :: j

    ! Opposite entries to the last digit: the derivative of a constant is zero.
    associate (half => [(pi * alternating(j) / tan(pi * j / n), j = 1, n / 2 - 1)])
      d = circulant([0.0_dp, half, 0.0_dp, -half(n / 2 - 1:1:-1)])
    end associate
  end function differentiation

  !> W, shape (n, n): what takes the values f at the phases takes W f in the middle between them.
  pure function middle_interpolation(n) result(w)
    integer, intent(in) :: n
    real(dp) :: w(n, n)
    integer :: j

    associate (half => [(alternating(j) / (n * tan(pi * (j + 0.5_dp) / n)), j = 0, n / 2 - 1)])
      w = circulant([half, half(n / 2:1:-1)])
    end associate
  end function middle_interpolation

  !> The same for the derivative.
  pure function middle_differentiation(n) result(d)
    integer, intent(in) :: n
    real(dp) :: d(n, n)
    integer :: j

    associate (half => [(-pi * alternating(j) / (n * sin(pi * (j + 0.5_dp) / n)**2), j = 0, n / 2 - 1)])
      d = circulant([half, -half(n / 2:1:-1)])
    end associate
  end function middle_differentiation

  !> W, shape (size(phases), n): what takes the values f at the n phases takes W f at `phases`. Up to a common factor,
  !> w_k = (-1)^k cot(pi (phase - k / n)).
  pure function interpolation(n, phases) result(w)
    integer, intent(in) :: n
    real(dp), intent(in) :: phases(:)
    real(dp) :: w(size(phases), n)
    real(dp), dimension(size(phases)) :: c, s, total
    real(dp), parameter :: least = sqrt(tiny(1.0_dp))
    real(dp) :: ck, sk
    integer :: k

    c = cos(pi * phases)
    s = sin(pi * phases)
    total = 0
    do k = 1, n
      ck = alternating(k - 1) * cos(pi * (k - 1) / n)
      sk = alternating(k - 1) * sin(pi * (k - 1) / n)
      ! At a phase itself the cotangent becomes so large that nothing else counts.
      associate (sine => alternating(k - 1) * (s * ck - c * sk))
        w(:, k) = (c * ck + s * sk) / merge(sine, least, abs(sine) > least)
      end associate
      total = total + w(:, k)
    end do
    do k = 1, n
      w(:, k) = w(:, k) / total
    end do
  end function interpolation

  !> (-1)^j.
  pure real(dp) function alternating(j)
    integer, intent(in) :: j

    alternating = 1 - 2 * modulo(j, 2)
  end function alternating

  !> The matrix whose entry (i, k) is first(i - k), modulo its size.
  pure function circulant(first) result(matrix)
    real(dp), intent(in) :: first(0:)
    real(dp) :: matrix(size(first), size(first))
    integer :: k, n

    n = size(first)
    do k = 1, n
      matrix(k:, k) = first(:n - k)
      matrix(:k - 1, k) = first(n - k + 1:)
    end do
  end function circulant

end module gestell_floquet_reduction_trigonometric
