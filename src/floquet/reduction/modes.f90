!> Defines groups of eigenvectors whose eigenvalues stay apart from all others, and their bases.
module gestell_floquet_reduction_modes
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: columns_of, find_clash, first_basis, orthonormal, unite

  !> Groups of n modes.
  type, public :: modes_type
    !> Group of every column, shape (n). Group 0 is the slow group: its eigenvalues come near zero.
    integer, allocatable :: group(:)
    !> Index of the complex conjugate of every column, its own index for a real column; shape (n).
    integer, allocatable :: conjugate(:)
    !> Bases of the groups' invariant subspaces in real form (gestell_floquet_reduction_conjugates). Given at the phases (k - 1) /
    !> N, shape (N, n, n), or at phase 0 alone, shape (1, n, n).
    real(dp), allocatable :: basis(:, :, :)
  end type modes_type

contains

  !> Indices of the columns of a group, ascending.
  pure function columns_of(group, number) result(columns)
    integer, intent(in) :: group(:), number
    integer, allocatable :: columns(:)
    integer :: k

    allocate(columns, source=pack([(k, k = 1, size(group))], group == number))
  end function columns_of

  !> Finds two groups whose eigenvalues come closer than `gap`; zero counts as an eigenvalue of group 0. Both elements of `clash`
  !> are equal if no groups clash.
  pure subroutine find_clash(values, group, gap, clash)
    complex(dp), intent(in) :: values(:)
    integer, intent(in) :: group(:)
    real(dp), intent(in) :: gap
    integer, intent(out) :: clash(2)
    integer :: i, k

    clash = 0
    do i = 1, size(values)
      if (group(i) /= 0 .and. abs(values(i)) < gap) clash = [group(i), 0]
      do k = 1, i - 1
        if (group(i) /= group(k) .and. abs(values(i) - values(k)) < gap) clash = [group(i), group(k)]
      end do
    end do
  end subroutine find_clash

  !> Unites two groups, and the two groups of their conjugates.
  pure subroutine unite(modes, clash)
    type(modes_type), intent(inout) :: modes
    integer, intent(in) :: clash(2)
    integer :: mirrored(2), k

    mirrored = clash
    do k = 1, size(modes%group)
      where (clash == modes%group(k)) mirrored = modes%group(modes%conjugate(k))
    end do
    where (modes%group == maxval(clash)) modes%group = minval(clash)
    ! The first union may have renamed one of the conjugate groups.
    where (mirrored == maxval(clash)) mirrored = minval(clash)
    where (modes%group == maxval(mirrored)) modes%group = minval(mirrored)
  end subroutine unite

  !> Bases at phase 0. They consist of eigenvectors; a group that is its own conjugate gets an orthonormal basis of their real and
  !> imaginary parts.
  pure function first_basis(vectors, modes) result(basis)
    complex(dp), intent(in) :: vectors(:, :)
    type(modes_type), intent(in) :: modes
    complex(dp) :: basis(size(vectors, 1), size(vectors, 2))
    integer :: k, g

    basis = vectors
    do k = 1, size(vectors, 2)
      if (modes%group(k) /= modes%group(modes%conjugate(k))) cycle
      if (modes%conjugate(k) > k) basis(:, k) = real(vectors(:, k))
      if (modes%conjugate(k) < k) basis(:, k) = aimag(vectors(:, modes%conjugate(k)))
    end do
    do g = 0, size(vectors, 2)
      associate (columns => columns_of(modes%group, g))
        basis(:, columns) = orthonormal(basis(:, columns))
      end associate
    end do
  end function first_basis

  !> Orthonormal basis of the space spanned by independent columns, by Gram-Schmidt orthogonalisation, applied twice against
  !> rounding.
  pure function orthonormal(columns) result(basis)
    complex(dp), intent(in) :: columns(:, :)
    complex(dp) :: basis(size(columns, 1), size(columns, 2))
    integer :: i, k, pass

    basis = columns
    do k = 1, size(columns, 2)
      do pass = 1, 2
        do i = 1, k - 1
          basis(:, k) = basis(:, k) - dot_product(basis(:, i), basis(:, k)) * basis(:, i)
        end do
        ! Scale first: the second vector of a defective eigenvalue can be so small that its square underflows.
        basis(:, k) = basis(:, k) / max(maxval(abs(basis(:, k))), tiny(1.0_dp))
        basis(:, k) = basis(:, k) / max(norm2(abs(basis(:, k))), tiny(1.0_dp))
      end do
    end do
  end function orthonormal

end module gestell_floquet_reduction_modes
