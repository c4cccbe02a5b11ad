!> Finds groups of modes such that eigenvalues of different groups differ over the whole period, and bases of these groups. The
!> bases come from the eigenvectors at phase 0 alone or at every phase. Using every phase is slow, but works even if the modes
!> change greatly.
module gestell_floquet_reduction_continued_modes
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: eigensystem, inverse
  use gestell_floquet_reduction_conjugates, only: real_columns
  use gestell_floquet_reduction_modes, only: columns_of, find_clash, first_basis, modes_type, orthonormal, merge_groups
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: follow_modes

  !> Maximum norm of the matrix that aligns the basis of a group with its basis at phase 0. If the norm is larger, the directions
  !> of the two bases differ too much.
  real(dp), parameter :: max_turned = 1.0e3_dp

contains

  !> Groups the eigenvalues of `a`, shape (N, n, n), at N equidistant phases or at phase 0 alone. Fails if the directions of a
  !> group change too much, or if all modes are slow, so that nothing can be decoupled.
  !>
  !> The groups are as small as possible under two conditions at every phase: groups are at least `gap` apart, and all groups
  !> except group 0 are at least `gap` from zero. The conjugate of a group is a group too. The basis T_g of group g is followed
  !> from phase to phase by its directions. It becomes smooth and periodic by the condition
  !>
  !>     L_g T_g = E,   L = T^-1 at phase 0.
  subroutine follow_modes(a, gap, modes, error)
    !> `a`: matrices A whose eigenvalues are grouped. `gap`: minimum distance between eigenvalues of different groups.
    real(dp), intent(in) :: a(:, :, :), gap
    type(modes_type), intent(out) :: modes
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: values(:, :), vectors(:, :, :), bases(:, :, :), w(:), right(:, :), left(:, :)
    integer :: clash(2), n, k

    n = size(a, 2)
    allocate(values(n, size(a, 1)), vectors(n, n, size(a, 1)), bases(n, n, size(a, 1)))
    do k = 1, size(a, 1)
      call eigensystem(a(k, :, :), w, right, left, error)
      if (allocated(error)) return
      values(:, k) = w
      vectors(:, :, k) = right
    end do

    allocate(modes%conjugate, source=[(k, k = 1, n)])
    do k = 1, n
      if (aimag(values(k, 1)) > 0) modes%conjugate(k:k + 1) = [k + 1, k]
    end do
    allocate(modes%group, source=[(k, k = 1, n)])
    do
      call find_clash(values(:, 1), modes%group, gap, clash)
      if (clash(1) == clash(2)) then
        call continue_bases(values, vectors, gap, modes, bases, clash, error)
        if (allocated(error)) return
        if (clash(1) == clash(2)) exit
      end if
      call merge_groups(modes, clash)
    end do
    if (all(modes%group == 0)) then
      call fatal_error(error, "the free vibrations are too slow compared with the rotation of the crank", failed_computation)
      return
    end if
    modes%conjugate = [(merge(k, modes%conjugate(k), modes%group(k) == modes%group(modes%conjugate(k))), k = 1, n)]
    allocate(modes%basis(size(a, 1), n, n))
    do k = 1, size(a, 1)
      modes%basis(k, :, :) = real_columns(bases(:, :, k), modes%conjugate)
    end do
  end subroutine follow_modes

  !> Computes bases of the groups `modes%group` at all phases. If the distance between two groups is less than `gap`, their numbers
  !> are returned in `clash`; if all distances are large enough, `clash` is zero.
  subroutine continue_bases(values, vectors, gap, modes, bases, clash, error)
    complex(dp), intent(in) :: values(:, :), vectors(:, :, :)
    real(dp), intent(in) :: gap
    type(modes_type), intent(in) :: modes
    complex(dp), intent(out) :: bases(:, :, :)
    integer, intent(out) :: clash(2)
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: dual(:, :), inverted(:, :), within(:, :), basis(:, :), coordinates(:, :)
    integer :: group(size(values, 1)), j, g
    integer, allocatable :: columns(:), own(:)

    bases = 0
    clash = 0
    bases(:, :, 1) = first_basis(vectors(:, :, 1), modes)
    call inverse(bases(:, :, 1), dual, error)
    if (allocated(error)) return
    inverted = dual
    do j = 2, size(values, 2)
      coordinates = matmul(inverted, vectors(:, :, j))
      ! Without this check the loop over clashes might never end.
      if (.not. all(ieee_is_finite(abs(coordinates)))) then
        call fatal_error(error, "the modes cannot be distinguished", failed_computation)
        return
      end if
      call assign_groups(coordinates, modes%group, group, clash)
      if (clash(1) == clash(2)) call find_clash(values(:, j), group, gap, clash)
      if (clash(1) /= clash(2)) return
      do g = 0, size(modes%group)
        columns = columns_of(modes%group, g)
        if (size(columns) == 0) cycle
        own = columns_of(group, g)
        basis = orthonormal(vectors(:, own, j))
        call inverse(matmul(dual(columns, :), basis), within, error)
        if (.not. allocated(error)) then
          if (norm2(abs(within)) < max_turned) then
            bases(:, columns, j) = matmul(basis, within)
            cycle
          end if
        end if
        call fatal_error(error, "a mode shape changes too much within the period", failed_computation)
        return
      end do
      call inverse(bases(:, :, j), inverted, error)
      if (allocated(error)) return
    end do
  end subroutine continue_bases

  !> Assigns each eigenvector to the group in which its largest part lies. `coordinates` holds the eigenvectors in the basis of
  !> the previous phase. If a group gains or loses an eigenvector, it must be merged with another group; `clash` returns the
  !> numbers of both groups.
  pure subroutine assign_groups(coordinates, before, group, clash)
    complex(dp), intent(in) :: coordinates(:, :)
    integer, intent(in) :: before(:)
    integer, intent(out) :: group(:), clash(2)
    real(dp) :: part(0:size(before))
    integer :: i, g, surplus(0:size(before))

    do i = 1, size(before)
      part = [(norm2(abs(pack(coordinates(:, i), before == g))), g = 0, size(before))]
      group(i) = maxloc(part, dim=1) - 1
    end do
    clash = 0
    surplus = [(count(group == g) - count(before == g), g = 0, size(before))]
    if (any(surplus /= 0)) clash = [maxloc(surplus, dim=1), minloc(surplus, dim=1)] - 1
  end subroutine assign_groups

end module gestell_floquet_reduction_continued_modes
