!> Computes the eigenvectors of all factors of a periodic product from the periodic Schur form.
module gestell_floquet_factors_periodic_eigenvectors
  use gestell_base_kinds, only: dp
  use gestell_floquet_factors_rotations, only: norm, rotate, find_swap
  implicit none (type, external)
  private

  public :: periodic_eigenvectors

  !> Eigenvectors of a product of factors A_k. Right eigenvectors are the unit columns of X_k, left ones the rows of Y_k = X_k^-1,
  !> with
  !>
  !>     A_k X_k = X_{k+1} diag(lambda_k),   X_{K+1} = X_1,   prod_k lambda_k(i) = rho_i.
  type, public :: eigenvectors_type
    !> `x`, `y`: matrices X_k and Y_k of the K factors, shapes (n, n, K). `lambda`: diagonal elements lambda_k, shape (n, K).
    complex(dp), allocatable :: x(:, :, :), y(:, :, :), lambda(:, :)
  end type eigenvectors_type

contains

  !> Computes the eigenvectors from the periodic Schur form `q` and `r`, shapes (n, n, K).
  !>
  !> Each multiplier is swapped to the first position of the Schur form; its Schur vectors there are its right eigenvectors x. It
  !> is also swapped to the last position; its Schur vectors there are the conjugates of its left eigenvectors y. If equal
  !> multipliers share an eigenvector, X_k is singular. Y_k is then large, and only the diagonal elements of Y_k X_k agree with
  !> the unit matrix.
  pure subroutine periodic_eigenvectors(q, r, vectors)
    complex(dp), intent(in) :: q(:, :, :), r(:, :, :)
    type(eigenvectors_type), intent(out) :: vectors
    complex(dp), allocatable :: regular(:, :, :), q_moved(:, :, :), r_moved(:, :, :)
    complex(dp) :: cosine
    integer :: n, i, k

    n = size(r, 1)
    allocate(vectors%x, vectors%y, mold=r)
    allocate(vectors%lambda(n, size(r, 3)))
    allocate(regular, source=r)
    do k = 1, size(r, 3)
      do i = 1, n
        ! Replace zeros by roundoff: the eigenvectors are then defined.
        if (abs(r(i, i, k)) < tiny(1.0_dp)) regular(i, i, k) = epsilon(1.0_dp) * norm(r(:, :, k))
      end do
    end do
    do i = 1, n
      call move_multiplier(i, 1, q, regular, q_moved, r_moved)
      vectors%x(:, i, :) = q_moved(:, 1, :)
      vectors%lambda(i, :) = r_moved(1, 1, :)
      call move_multiplier(i, n, q, regular, q_moved, r_moved)
      do k = 1, size(r, 3)
        cosine = dot_product(q_moved(:, n, k), vectors%x(:, i, k))
        if (abs(cosine) < epsilon(1.0_dp)**2) cosine = epsilon(1.0_dp)**2
        vectors%y(i, :, k) = conjg(q_moved(:, n, k)) / cosine
      end do
    end do
  end subroutine periodic_eigenvectors

  !> Computes the periodic Schur form in which the multiplier at position `from` has moved to position `to`. The other multipliers
  !> keep their order.
  pure subroutine move_multiplier(from, to, q, r, q_moved, r_moved)
    integer, intent(in) :: from, to
    complex(dp), intent(in) :: q(:, :, :), r(:, :, :)
    complex(dp), allocatable, intent(out) :: q_moved(:, :, :), r_moved(:, :, :)
    complex(dp) :: v(2, size(r, 3))
    real(dp) :: gap
    integer :: position, i

    allocate(q_moved, source=q)
    allocate(r_moved, source=r)
    position = from
    do while (position /= to)
      i = merge(position, position - 1, position < to)
      call find_swap(r_moved, i, v, gap)
      call rotate(r_moved, q_moved, i, v, left=i, bottom=i + 1)
      r_moved(i + 1, i, size(r, 3)) = 0
      position = merge(position + 1, position - 1, position < to)
    end do
  end subroutine move_multiplier

end module gestell_floquet_factors_periodic_eigenvectors
