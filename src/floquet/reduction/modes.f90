!> Defines groups of eigenvectors, such that eigenvalues of different groups differ, and bases of these groups.
module gestell_floquet_reduction_modes
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: columns_of, find_clash, first_basis, orthonormal, merge_groups

  !> Groups of n modes.
  type, public :: modes_type
    !> Number of the group of each column, shape (n). Group 0 is the slow group, whose eigenvalues come near zero.
    integer, allocatable :: group(:)
    !> Index of the complex conjugate of each column, shape (n). A real column is its own conjugate.
    integer, allocatable :: conjugate(:)
    !> Bases of the groups' invariant subspaces in real form (gestell_floquet_reduction_conjugates), at the phases (k - 1) / N,
    !> shape (N, n, n), or at phase 0 alone, shape (1, n, n).
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

  !> Finds two groups with eigenvalues closer than `gap`, and returns their numbers in `clash`. Group 0 is treated as if zero were
  !> one of its eigenvalues. If no two groups are that close, both elements of `clash` are equal.
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

  !> Unites the two groups in `clash`, and the two groups of their conjugates.
  pure subroutine merge_groups(modes, clash)
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
  end subroutine merge_groups

  !> Bases of the groups at phase 0. They consist of eigenvectors. An exception is a group that is its own conjugate: its basis is
  !> orthonormal and spans the real and imaginary parts of its eigenvectors.
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

  !> Orthonormal basis of the space that the linearly independent `columns` span. Gram-Schmidt orthogonalisation is applied twice,
  !> to reduce rounding errors.
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
