!> Rotates a periodic sequence of triangular factors R_k in one plane: the basic step of the periodic Schur form.
!>
!> In the plane (i, i + 1) the rotation G_k = [p, -conj(q); q, conj(p)] has the first column v_k, a unit vector. If R_k v_k is
!> parallel to v_{k+1}, then G_{k+1}^H R_k G_k is also triangular.
module gestell_floquet_factors_rotations
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: unit, propagate_vector, rotate, rotate_rows, rotate_columns, find_swap, normalise, norm

contains

  !> The unit vector w / |w|, accurate even for very small w; (1, 0) if w is zero.
  pure function unit(w)
    complex(dp), intent(in) :: w(2)
    complex(dp) :: unit(2)
    real(dp) :: largest

    largest = max(abs(real(w(1))), abs(aimag(w(1))), abs(real(w(2))), abs(aimag(w(2))))
    if (largest < tiny(1.0_dp)) then
      unit = [(1.0_dp, 0.0_dp), (0.0_dp, 0.0_dp)]
    else
      unit = w / largest
      unit = unit / sqrt(real(unit(1))**2 + aimag(unit(1))**2 + real(unit(2))**2 + aimag(unit(2))**2)
    end if
  end function unit

  !> Divides `values` by the power of two that brings the largest component into [1/2, 1). Adds the exponent of this power to
  !> `exponents`.
  pure subroutine normalise(values, exponents)
    complex(dp), intent(inout) :: values(:)
    integer, intent(inout) :: exponents
    real(dp) :: largest
    integer :: e

    largest = max(maxval(abs(real(values))), maxval(abs(aimag(values))))
    if (largest < tiny(1.0_dp)) return
    e = exponent(largest)
    ! Divide twice: 2^-e itself may overflow.
    values = values * scale(1.0_dp, -e / 2) * scale(1.0_dp, -(e - e / 2))
    exponents = exponents + e
  end subroutine normalise

  !> Frobenius norm of `a`. Scaling prevents underflow of the squares.
  pure real(dp) function norm(a)
    complex(dp), intent(in) :: a(:, :)
    real(dp) :: largest

    largest = max(maxval(abs(a)), tiny(1.0_dp))
    norm = largest * norm2(abs(a) / largest)
  end function norm

  !> Computes the unit vectors v_2, ..., v_K from v_1: v_{k+1} is the direction of R_k v_k, where only rows and columns i, i + 1
  !> of R_k are used. Shapes: r (n, n, K), v (2, K).
  pure subroutine propagate_vector(r, i, v)
    complex(dp), intent(in) :: r(:, :, :)
    integer, intent(in) :: i
    complex(dp), intent(inout) :: v(:, :)
    integer :: k

    do k = 1, size(r, 3) - 1
      v(:, k + 1) = forward(r, i, k, v(:, k))
    end do
  end subroutine propagate_vector

  !> Unit vector in the direction of R_k v, using only rows and columns i, i + 1 of R_k.
  pure function forward(r, i, k, v) result(w)
    complex(dp), intent(in) :: r(:, :, :), v(2)
    integer, intent(in) :: i, k
    complex(dp) :: w(2)

    w = unit([r(i, i, k) * v(1) + r(i, i + 1, k) * v(2), r(i + 1, i + 1, k) * v(2)])
  end function forward

  !> Unit vector in the direction of R_k^-1 v, using only rows and columns i, i + 1 of R_k.
  pure function backward(r, i, k, v) result(w)
    complex(dp), intent(in) :: r(:, :, :), v(2)
    integer, intent(in) :: i, k
    complex(dp) :: w(2)

    w = unit([r(i + 1, i + 1, k) * v(1) - r(i, i + 1, k) * v(2), r(i, i, k) * v(2)])
  end function backward

  !> Replaces R_k by G_{k+1}^H R_k G_k and Q_k by Q_k G_k for all k, where G_k is the rotation with the first column v_k and G_{K+1}
  !> = G_1. Sets the elements (i + 1, i) of R_1, ..., R_{K-1} to zero.
  pure subroutine rotate(r, q, i, v, left, bottom)
    !> Triangular factors and unitary matrices, shapes (n, n, K)
    complex(dp), intent(inout) :: r(:, :, :), q(:, :, :)
    !> `i`: first index of the plane (i, i + 1). `bottom`, `left`: R_K may have elements below its diagonal, in columns i and i +
    !> 1 down to row `bottom`, and in rows i and i + 1 from column `left` on.
    integer, intent(in) :: i, left, bottom
    !> First columns of the rotation matrices G_k, shape (2, K)
    complex(dp), intent(in) :: v(:, :)
    integer :: k, last

    last = size(r, 3)
    do k = 1, last - 1
      call rotate_columns(r(:i + 1, i:i + 1, k), v(:, k))
      call rotate_rows(r(i:i + 1, i:, k), v(:, k + 1))
      r(i + 1, i, k) = 0
      call rotate_columns(q(:, i:i + 1, k), v(:, k))
    end do
    call rotate_columns(r(:bottom, i:i + 1, last), v(:, last))
    call rotate_rows(r(i:i + 1, left:, last), v(:, 1))
    call rotate_columns(q(:, i:i + 1, last), v(:, last))
  end subroutine rotate

  !> Replaces the matrix m, shape (:, 2), by m G, where `v` is the first column of the rotation matrix G.
  pure subroutine rotate_columns(m, v)
    complex(dp), intent(inout) :: m(:, :)
    complex(dp), intent(in) :: v(2)
    complex(dp) :: kept
    integer :: j

    do j = 1, size(m, 1)
      kept = m(j, 1)
      m(j, 1) = kept * v(1) + m(j, 2) * v(2)
      m(j, 2) = m(j, 2) * conjg(v(1)) - kept * conjg(v(2))
    end do
  end subroutine rotate_columns

  !> Replaces the matrix m, shape (2, :), by G^H m, where `v` is the first column of the rotation matrix G.
  pure subroutine rotate_rows(m, v)
    complex(dp), intent(inout) :: m(:, :)
    complex(dp), intent(in) :: v(2)
    complex(dp) :: kept
    integer :: j

    do j = 1, size(m, 2)
      kept = m(1, j)
      m(1, j) = conjg(v(1)) * kept + conjg(v(2)) * m(2, j)
      m(2, j) = v(1) * m(2, j) - v(2) * kept
    end do
  end subroutine rotate_rows

  !> Computes the rotations that swap the multipliers at the positions (i, i) and (i + 1, i + 1) of triangular factors.
  !>
  !> Only the 2 x 2 blocks of the factors in rows and columns i, i + 1 matter. The vectors v_k are the eigenvectors of these
  !> blocks for the multiplier at (i + 1, i + 1). If [A B; 0 D] is the product of the blocks, v_1 is parallel to (B, D - A). The
  !> other vectors are computed forward from v_1 if |D| >= |A| and backward if |D| < |A|, so that errors decay. `gap` is the
  !> component of R_K v_K perpendicular to v_1, relative to the block of R_K. It is about roundoff unless A and D agree to
  !> roundoff.
  pure subroutine find_swap(r, i, v, gap)
    !> Triangular factors, shape (n, n, K)
    complex(dp), intent(in) :: r(:, :, :)
    integer, intent(in) :: i
    !> First columns of the rotation matrices G_k, shape (2, K)
    complex(dp), intent(out) :: v(:, :)
    real(dp), intent(out) :: gap
    integer, parameter :: turns = 3
    complex(dp) :: product(3), start(2), image(2)
    integer :: k, turn, exponents

    product = [(1.0_dp, 0.0_dp), (0.0_dp, 0.0_dp), (1.0_dp, 0.0_dp)]
    exponents = 0
    do k = 1, size(r, 3)
      product = [r(i, i, k) * product(1), r(i, i, k) * product(2) + r(i, i + 1, k) * product(3), r(i + 1, i + 1, k) * product(3)]
      call normalise(product, exponents)
    end do
    associate (a => product(1), b => product(2), d => product(3))
      start = [b, d - a]
      if (abs(start(1)) + abs(start(2)) < tiny(1.0_dp)) start(2) = 1
      start = unit(start)
      do turn = 1, turns
        if (abs(d) >= abs(a)) then
          v(:, 1) = start
          call propagate_vector(r, i, v)
          start = forward(r, i, size(r, 3), v(:, size(r, 3)))
        else
          v(:, size(r, 3)) = backward(r, i, size(r, 3), start)
          do k = size(r, 3) - 1, 1, -1
            v(:, k) = backward(r, i, k, v(:, k + 1))
          end do
          start = v(:, 1)
        end if
        ! Component of R_K v_K perpendicular to v_1, relative to the block of R_K.
        image = matmul(r(i:i + 1, i:i + 1, size(r, 3)), v(:, size(r, 3)))
        gap = abs(image(1) * v(2, 1) - image(2) * v(1, 1)) / max(maxval(abs(r(i:i + 1, i:i + 1, size(r, 3)))), tiny(1.0_dp))
        if (gap < 8 * epsilon(1.0_dp)) exit
      end do
    end associate
  end subroutine find_swap

end module gestell_floquet_factors_rotations
