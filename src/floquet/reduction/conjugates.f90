!> Represents conjugate modes of real systems by real numbers. In the real form R of the matrix S of the modes, two conjugate
!> columns u, conj(u) of S are replaced by Re u and Im u. A constant matrix K connects the complex quantities S, D, y with their
!> real forms R, G, w:
!>
!>     S = R K,   D = K^-1 G K,   y = K^-1 w.
!>
!> D and G are the generator, y and w the coordinates of the motion. The procedures convert between the complex quantities and
!> the real forms at all phases. `conjugate` contains the index of the conjugate of each column; a real column is its own
!> conjugate. In a pair the lower index belongs to Re u. Shapes: g (phases, n, n), w (phases, n).
module gestell_floquet_reduction_conjugates
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: add_coordinate, add_entry, complex_columns, coordinate, counts, divide, entry, real_columns, weights

contains

  !> Computes the element D(k, l) from its real form G at all phases.
  pure subroutine entry(g, conjugate, k, l, re, im)
    real(dp), contiguous, intent(in) :: g(:, :, :)
    integer, intent(in) :: conjugate(:), k, l
    !> Real and imaginary part of the element at each phase
    real(dp), contiguous, intent(out) :: re(:), im(:)
    real(dp) :: s, t

    s = side(conjugate, k)
    t = side(conjugate, l)
    associate (k1 => min(k, conjugate(k)), k2 => max(k, conjugate(k)), l1 => min(l, conjugate(l)), l2 => max(l, conjugate(l)), &
      & x => weight(conjugate, k))
      re = x * (g(:, k1, l1) + s * t * g(:, k2, l2))
      im = x * (t * g(:, k1, l2) - s * g(:, k2, l1))
    end associate
  end subroutine entry

  !> Adds re + i im to the element D(k, l), and the conjugate number to the conjugate element, by changing the real form G.
  pure subroutine add_entry(re, im, conjugate, k, l, g)
    !> Real and imaginary part of the added number at each phase
    real(dp), contiguous, intent(in) :: re(:), im(:)
    integer, intent(in) :: conjugate(:), k, l
    real(dp), contiguous, intent(inout) :: g(:, :, :)
    real(dp) :: s, t, x

    s = side(conjugate, k)
    t = side(conjugate, l)
    x = weight(conjugate, l)
    if (conjugate(k) /= k .or. conjugate(l) /= l) x = 2 * x
    associate (k1 => min(k, conjugate(k)), k2 => max(k, conjugate(k)), l1 => min(l, conjugate(l)), l2 => max(l, conjugate(l)))
      g(:, k1, l1) = g(:, k1, l1) + x * re
      if (l1 /= l2) g(:, k1, l2) = g(:, k1, l2) + x * t * im
      if (k1 /= k2) g(:, k2, l1) = g(:, k2, l1) - x * s * im
      if (k1 /= k2 .and. l1 /= l2) g(:, k2, l2) = g(:, k2, l2) + x * s * t * re
    end associate
  end subroutine add_entry

  !> True for exactly one element of each pair of conjugate elements of the generator D, so that loops treat each pair once.
  pure logical function counts(conjugate, k, l)
    integer, intent(in) :: conjugate(:), k, l

    counts = k < conjugate(k) .or. (k == conjugate(k) .and. l <= conjugate(l))
  end function counts

  !> Computes the coordinate y(k) from its real form w at all phases.
  pure subroutine coordinate(w, conjugate, k, re, im)
    real(dp), contiguous, intent(in) :: w(:, :)
    integer, intent(in) :: conjugate(:), k
    !> Real and imaginary part of the coordinate at each phase
    real(dp), contiguous, intent(out) :: re(:), im(:)

    re = weight(conjugate, k) * w(:, min(k, conjugate(k)))
    im = -weight(conjugate, k) * side(conjugate, k) * w(:, max(k, conjugate(k)))
  end subroutine coordinate

  !> Adds re + i im to the coordinate y(k), and the conjugate number to the conjugate coordinate, by changing the real form w.
  pure subroutine add_coordinate(re, im, conjugate, k, w)
    !> Real and imaginary part of the added number at each phase
    real(dp), contiguous, intent(in) :: re(:), im(:)
    integer, intent(in) :: conjugate(:), k
    real(dp), contiguous, intent(inout) :: w(:, :)

    associate (k1 => min(k, conjugate(k)), k2 => max(k, conjugate(k)))
      w(:, k1) = w(:, k1) + re / weight(conjugate, k)
      if (k1 /= k2) w(:, k2) = w(:, k2) - 2 * side(conjugate, k) * im
    end associate
  end subroutine add_coordinate

  !> Replaces re + i im by (re + i im) / (a + i b) at all phases. Fails if a + i b is zero at some phase.
  pure subroutine divide(a, b, re, im, error)
    real(dp), contiguous, intent(in) :: a(:), b(:)
    real(dp), contiguous, intent(inout) :: re(:), im(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: square, kept, least
    integer :: i

    least = huge(least)
    do i = 1, size(a)
      square = a(i)**2 + b(i)**2
      least = min(least, square)
      square = 1 / merge(square, 1.0_dp, square > tiny(1.0_dp))
      kept = re(i)
      re(i) = (kept * a(i) + im(i) * b(i)) * square
      im(i) = (im(i) * a(i) - kept * b(i)) * square
    end do
    if (least <= tiny(1.0_dp)) call fatal_error(error, &
      & "two groups of modes share an eigenvalue, or the mode shapes of a group change too much", failed_computation)
  end subroutine divide

  !> The complex matrix S that corresponds to the real form R; shape (n, n).
  pure function complex_columns(r, conjugate) result(s)
    real(dp), intent(in) :: r(:, :)
    integer, intent(in) :: conjugate(:)
    complex(dp) :: s(size(r, 1), size(r, 2))
    integer :: k

    do k = 1, size(conjugate)
      s(:, k) = cmplx(r(:, min(k, conjugate(k))), side(conjugate, k) * r(:, max(k, conjugate(k))), dp)
    end do
  end function complex_columns

  !> The real form R that corresponds to the complex matrix S; shape (n, n).
  pure function real_columns(s, conjugate) result(r)
    complex(dp), intent(in) :: s(:, :)
    integer, intent(in) :: conjugate(:)
    real(dp) :: r(size(s, 1), size(s, 2))
    integer :: k

    do k = 1, size(conjugate)
      r(:, k) = real(s(:, k))
      if (k > conjugate(k)) r(:, k) = aimag(s(:, conjugate(k)))
    end do
  end function real_columns

  !> Weights of the columns of the real form R, shape (n), from which norms of the complex matrix S follow. |S|^2 is the sum of
  !> the squares of the columns of R times these weights; |S^-1|^2 is the sum of the squares of the rows of R^-1 divided by these
  !> weights.
  pure function weights(conjugate)
    integer, intent(in) :: conjugate(:)
    real(dp) :: weights(size(conjugate))
    integer :: k

    weights = [(1 / weight(conjugate, k), k = 1, size(conjugate))]
  end function weights

  !> Factor of column `k` in the matrix K^-1: 1/2 for a column of a conjugate pair, 1 for a real column.
  pure real(dp) function weight(conjugate, k)
    integer, intent(in) :: conjugate(:), k

    weight = merge(1.0_dp, 0.5_dp, conjugate(k) == k)
  end function weight

  !> Sign of the imaginary part of column `k` of S: 1 for u, -1 for conj(u), 0 for a real column.
  pure real(dp) function side(conjugate, k)
    integer, intent(in) :: conjugate(:), k

    side = sign(min(1, abs(conjugate(k) - k)), conjugate(k) - k)
  end function side

end module gestell_floquet_reduction_conjugates
