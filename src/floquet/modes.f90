!> The eigenvectors of a periodic matrix along its period, in groups whose eigenvalues stay apart from those of all others.
module gestell_floquet_modes
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_lapack, only: eigensystem, inverse
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: columns_of, follow_modes

  type, public :: modes_type
    !> Group of every column, shape (n); 0: the slow group, whose eigenvalues come near zero.
    integer, allocatable :: group(:)
    !> Column that is the complex conjugate of a column, itself for a real one; shape (n).
    integer, allocatable :: conjugate(:)
    !> Smooth bases of the groups' invariant subspaces at the phases (k - 1) / N, shape (n, n, N).
    complex(dp), allocatable :: basis(:, :, :)
  end type modes_type

  !> A basis that has turned so far against the one at phase 0 is not continued.
  real(dp), parameter :: most_turned = 1.0e3_dp

contains

  !> Groups the eigenvalues of `a`, shape (n, n, N), given at N equidistant phases: the finest groups that keep a
  !> distance of `gap` from each other, and from zero but for group 0, at every phase; with each group goes its
  !> conjugate. Bases are continued from phase to phase by their directions and made smooth and periodic by
  !>
  !>     L_g T_g = E,   L = T^-1 at phase 0.
  !>
  !> Error: a subspace turns so far that this fails.
  subroutine follow_modes(a, gap, modes, error)
    real(dp), intent(in) :: a(:, :, :), gap
    type(modes_type), intent(out) :: modes
    type(error_type), allocatable, intent(out) :: error
    complex(dp) :: values(size(a, 1), size(a, 3)), vectors(size(a, 1), size(a, 1), size(a, 3))
    complex(dp), allocatable :: w(:), right(:, :), left(:, :)
    integer :: clash(2), n, k

    n = size(a, 1)
    do k = 1, size(a, 3)
      call eigensystem(a(:, :, k), w, right, left, error)
      if (allocated(error)) return
      values(:, k) = w
      vectors(:, :, k) = right
    end do

    allocate(modes%conjugate, source=[(k, k = 1, n)])
    do k = 1, n
      if (aimag(values(k, 1)) > 0) modes%conjugate(k:k + 1) = [k + 1, k]
    end do
    allocate(modes%basis(n, n, size(a, 3)))
    allocate(modes%group, source=[(k, k = 1, n)])
    do
      call find_clash(values(:, 1), modes%group, gap, clash)
      if (clash(1) == clash(2)) then
        call continue_bases(values, vectors, gap, modes, clash, error)
        if (allocated(error)) return
        if (clash(1) == clash(2)) exit
      end if
      call unite(modes, clash)
    end do
    modes%conjugate = [(merge(k, modes%conjugate(k), modes%group(k) == modes%group(modes%conjugate(k))), k = 1, n)]
  end subroutine follow_modes

  !> The columns of a group, ascending.
  pure function columns_of(group, number) result(columns)
    integer, intent(in) :: group(:), number
    integer, allocatable :: columns(:)
    integer :: k

    allocate(columns, source=pack([(k, k = 1, size(group))], group == number))
  end function columns_of

  !> Two groups that come closer than `gap`; zero counts as an eigenvalue of group 0. Equal numbers: there are none.
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

  !> One group of two, and one of their conjugates.
  pure subroutine unite(modes, clash)
    type(modes_type), intent(inout) :: modes
    integer, intent(in) :: clash(2)
    integer :: mirrored(2), k

    mirrored = clash
    do k = 1, size(modes%group)
      where (clash == modes%group(k)) mirrored = modes%group(modes%conjugate(k))
    end do
    call join(modes%group, clash)
    ! The first union may have renamed one of them.
    where (mirrored == maxval(clash)) mirrored = minval(clash)
    call join(modes%group, mirrored)
  end subroutine unite

  pure subroutine join(group, pair)
    integer, intent(inout) :: group(:)
    integer, intent(in) :: pair(2)

    where (group == maxval(pair)) group = minval(pair)
  end subroutine join

  !> The bases of `modes%group` at all phases, or the `clash` that was met on the way.
  subroutine continue_bases(values, vectors, gap, modes, clash, error)
    complex(dp), intent(in) :: values(:, :), vectors(:, :, :)
    real(dp), intent(in) :: gap
    type(modes_type), intent(inout) :: modes
    integer, intent(out) :: clash(2)
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: dual(:, :), inverted(:, :), within(:, :), basis(:, :), coordinates(:, :)
    integer :: group(size(values, 1)), j, g
    integer, allocatable :: columns(:), own(:)

    clash = 0
    modes%basis(:, :, 1) = first_basis(vectors(:, :, 1), modes)
    call inverse(modes%basis(:, :, 1), dual, error)
    if (allocated(error)) return
    inverted = dual
    do j = 2, size(values, 2)
      coordinates = matmul(inverted, vectors(:, :, j))
      ! Else groups could clash for ever.
      if (.not. all(ieee_is_finite(abs(coordinates)))) then
        call fatal_error(error, "modes cannot be told from each other", failed_computation)
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
          if (norm2(abs(within)) < most_turned) then
            modes%basis(:, columns, j) = matmul(basis, within)
            cycle
          end if
        end if
        call fatal_error(error, "a mode turns too far within the period", failed_computation)
        return
      end do
      call inverse(modes%basis(:, :, j), inverted, error)
      if (allocated(error)) return
    end do
  end subroutine continue_bases

  !> At phase 0: eigenvectors; in a group that is its own conjugate, an orthonormal basis of their real and imaginary
  !> parts.
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

  !> An orthonormal basis of the space that independent columns span: Gram and Schmidt, twice for the sake of rounding.
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
        ! What a defective eigenvalue leaves of its second vector can be so small that its square vanishes.
        basis(:, k) = basis(:, k) / max(maxval(abs(basis(:, k))), tiny(1.0_dp))
        basis(:, k) = basis(:, k) / max(norm2(abs(basis(:, k))), tiny(1.0_dp))
      end do
    end do
  end function orthonormal

  !> The group of each eigenvector, whose `coordinates` in the basis of the phase before are given: the one in which the
  !> greatest part of it lies. Where the groups' sizes do not come out, two of them clash.
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

end module gestell_floquet_modes
