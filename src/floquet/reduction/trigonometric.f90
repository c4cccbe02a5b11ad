!> Provides trigonometric interpolation of functions with period 1 from values at an even number N of equidistant phases (k - 1) /
!> N. The highest harmonic, N / 2, is a pure cosine.
module gestell_floquet_reduction_trigonometric
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: differentiation, equidistant, interpolation, middle_interpolation, middle_differentiation

contains

  !> Equidistant phases, shape (n). With `shift` = 1/2 they lie midway between the phases with `shift` = 0.
  pure function equidistant(n, shift) result(phases)
    integer, intent(in) :: n
    real(dp), intent(in), optional :: shift
    real(dp) :: phases(n)
    integer :: k

    phases = [(real(k, dp) / n, k = 0, n - 1)]
    if (present(shift)) phases = phases + shift / n
  end function equidistant

  !> Differentiation matrix D, shape (n, n). The product D f contains, at the phases, the derivative of the function that
  !> interpolates the values f.
  pure function differentiation(n) result(d)
    integer, intent(in) :: n
    real(dp) :: d(n, n)
    integer :: j

    ! Make opposite elements exactly opposite, so that the derivative of a constant is zero.
    associate (half => [(pi * alternating(j) / tan(pi * j / n), j = 1, n / 2 - 1)])
      d = circulant([0.0_dp, half, 0.0_dp, -half(n / 2 - 1:1:-1)])
    end associate
  end function differentiation

  !> Interpolation matrix W, shape (n, n). The product W f contains, midway between the phases, the function that interpolates the
  !> values f.
  pure function middle_interpolation(n) result(w)
    integer, intent(in) :: n
    real(dp) :: w(n, n)
    integer :: j

    associate (half => [(alternating(j) / (n * tan(pi * (j + 0.5_dp) / n)), j = 0, n / 2 - 1)])
      w = circulant([half, half(n / 2:1:-1)])
    end associate
  end function middle_interpolation

  !> Differentiation matrix D, shape (n, n). The product D f contains, midway between the phases, the derivative of the function
  !> that interpolates the values f.
  pure function middle_differentiation(n) result(d)
    integer, intent(in) :: n
    real(dp) :: d(n, n)
    integer :: j

    associate (half => [(-pi * alternating(j) / (n * sin(pi * (j + 0.5_dp) / n)**2), j = 0, n / 2 - 1)])
      d = circulant([half, -half(n / 2:1:-1)])
    end associate
  end function middle_differentiation

  !> Interpolation matrix W, shape (size(phases), n). The product W f contains, at `phases`, the function that interpolates the
  !> values f at n phases. The weights are w_k = (-1)^k cot(pi (phase - k / n)), up to a common factor.
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
      ! At a node the cotangent is made so large that all other terms become negligible.
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

  !> Circulant matrix: element (i, k) is element i - k of `first`, with this index taken modulo the size.
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
