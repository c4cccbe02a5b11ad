!> Solves M a = r for the accelerations a at many phases together.
module gestell_system_mass
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes, padded_to_block, safe_multiplier, schur_complement
  use gestell_math_lapack, only: factorise, solve_factored
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: solve_mass

contains

  !> Replaces R by M^-1 R; shapes of M and R: (points, f, f) and (points, f, columns). The diagonal of M must be about 1. The result
  !> is NaN where M is singular.
  subroutine solve_mass(m, r)
    real(dp), contiguous, intent(in) :: m(:, :, :)
    real(dp), contiguous, intent(inout) :: r(:, :, :)
    !> Work array, allocated on the heap because threads have small stacks.
    real(dp), allocatable :: w(:, :, :)
    logical :: safe(lanes)
    integer :: first, points, k

    points = size(m, 1)
    allocate(w(lanes, 2 * padded_to_block(size(m, 2)), padded_to_block(size(m, 2)) + padded_to_block(size(r, 3))))
    do first = 1, points - lanes + 1, lanes
      call solve_lanes(first, m, r, w, safe)
      do k = 1, lanes
        if (.not. safe(k)) call solve_point(first + k - 1, m, r)
      end do
    end do
    do k = first, points
      call solve_point(k, m, r)
    end do
  end subroutine solve_mass

  !> Solves M X = R at `lanes` points at once, beginning with point `first`. X is the Schur complement of M in the block matrix [M,
  !> R; -E, 0]. Elimination is done without row exchanges. Where this loses too many digits, `safe` is false and R is unchanged.
  subroutine solve_lanes(first, m, r, w, safe)
    integer, intent(in) :: first
    real(dp), contiguous, intent(in) :: m(:, :, :)
    real(dp), contiguous, intent(inout) :: r(:, :, :), w(:, :, :)
    logical, intent(out) :: safe(lanes)
    real(dp) :: multiplier(lanes)
    integer :: f, n, last, i, k

    f = size(m, 2)
    n = padded_to_block(f)
    last = first + lanes - 1
    w = 0
    do i = f + 1, n
      w(:, i, i) = 1
    end do
    w(:, :f, :f) = m(first:last, :, :)
    w(:, :f, n + 1:n + size(r, 3)) = r(first:last, :, :)
    do i = 1, f
      w(:, n + i, i) = -1
    end do
    call schur_complement(w, n, multiplier)
    safe = multiplier < safe_multiplier
    if (all(safe)) then
      r(first:last, :, :) = w(:, n + 1:n + f, n + 1:n + size(r, 3))
    else
      do k = 1, lanes
        if (safe(k)) r(first + k - 1, :, :) = w(k, n + 1:n + f, n + 1:n + size(r, 3))
      end do
    end if
  end subroutine solve_lanes

  !> Solves M X = R at point `k` alone, with row exchanges.
  subroutine solve_point(k, m, r)
    integer, intent(in) :: k
    real(dp), contiguous, intent(in) :: m(:, :, :)
    real(dp), contiguous, intent(inout) :: r(:, :, :)
    real(dp) :: left(size(m, 2), size(m, 2)), right(size(r, 2), size(r, 3))
    type(error_type), allocatable :: error
    integer :: pivots(size(m, 2))

    left = m(k, :, :)
    right = r(k, :, :)
    call factorise(left, pivots, error)
    if (allocated(error)) then
      right = ieee_value(1.0_dp, ieee_quiet_nan)
    else
      call solve_factored(left, pivots, right)
    end if
    r(k, :, :) = right
  end subroutine solve_point

end module gestell_system_mass
