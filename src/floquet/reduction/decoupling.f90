!> Decouples the groups of modes of y' = D y + g by iteration, equation (70) of doc/theory.md. Symbols are those of
!> gestell_floquet_reduction; matrices have the real form of gestell_floquet_reduction_conjugates.
module gestell_floquet_reduction_decoupling
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: balancing
  use gestell_floquet_reduction_conjugates, only: add_entry, counts, divide, entry
  use gestell_floquet_reduction_modes, only: modes_type
  use gestell_floquet_reduction_phasewise, only: along_phases, inverses, multiply
  use gestell_floquet_reduction_separation, only: separation
  use gestell_floquet_reduction_trigonometric, only: differentiation
  implicit none (type, external)
  private

  public :: balance, decouple, examine, transform, uncoupled_sizes

  !> Generator D of the decoupled equations in its real form, and inverse of the matrix S of the modes, at a number of phases;
  !> shapes (phases, n, n).
  type, public :: motion_type
    real(dp), allocatable :: d(:, :, :), inverted(:, :, :)
  end type motion_type

  !> Maximum number of iterations.
  integer, parameter, public :: max_rounds = 60

contains

  !> Computes the generator D = S^-1 (A S - S') and S^-1 for a given matrix S of the modes. The derivative S' is that of the
  !> trigonometric interpolation of S. `left`, the remaining coupling, is the maximum row sum of the elements of D between
  !> groups. Fails if S is singular.
  subroutine examine(a, modes, s, motion, left, error)
    !> Coefficients A and matrix S of the modes at the phases, shapes (phases, n, n)
    real(dp), contiguous, intent(in) :: a(:, :, :), s(:, :, :)
    type(modes_type), intent(in) :: modes
    type(motion_type), intent(inout) :: motion
    real(dp), intent(out) :: left
    type(error_type), allocatable, intent(out) :: error
    real(dp), dimension(size(s, 1), size(s, 2), size(s, 3)) :: slope
    real(dp) :: derivative(size(s, 1), size(s, 1))

    derivative = differentiation(size(s, 1))
    call along_phases(derivative, s, slope)
    call transform(a, s, slope, motion, error)
    if (allocated(error)) return
    left = maxval(uncoupled_sizes(motion%d, modes))
    if (.not. left < huge(left)) call fatal_error(error, "the coefficients overflow double precision", failed_computation)
  end subroutine examine

  !> Replaces S by S (E + Z) until the coupling `left` between groups is at most `enough` or no longer falls. Fails if groups
  !> share an eigenvalue.
  !>
  !> Z solves D_g Z_gh - Z_gh D_h = -D_gh for all pairs of groups g, h. This equation neglects the derivative Z', which is small
  !> if the distances between groups are large compared with 2 pi per period. On entry `s`, `motion` and `left` hold the start of
  !> the iteration, as `examine` returns it; on return they hold the best result.
  subroutine decouple(a, modes, enough, s, motion, left, error)
    !> Coefficients A at the phases, shape (phases, n, n)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    type(modes_type), intent(in) :: modes
    !> The iteration ends when the coupling between groups is at most this value
    real(dp), intent(in) :: enough
    !> Matrix S of the modes at the phases, shape (phases, n, n)
    real(dp), contiguous, intent(inout) :: s(:, :, :)
    type(motion_type), intent(inout) :: motion
    !> Remaining coupling: maximum row sum of the elements of D between groups
    real(dp), intent(inout) :: left
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: failure
    real(dp), dimension(size(s, 1), size(s, 2), size(s, 3)) :: trial, z
    type(motion_type) :: trial_motion
    real(dp) :: before, coupled
    integer :: round

    do round = 1, max_rounds
      if (left <= enough) return
      call separation(motion%d, modes, z, error)
      if (allocated(error)) return
      call multiply(s, z, trial)
      trial = trial + s
      call normalise(modes, trial, failure)
      if (.not. allocated(failure)) call examine(a, modes, trial, trial_motion, coupled, failure)
      if (allocated(failure)) return
      if (coupled >= left) return
      s = trial
      call move_alloc(trial_motion%d, motion%d)
      call move_alloc(trial_motion%inverted, motion%inverted)
      before = left
      left = coupled
      if (left >= 0.5_dp * before) return
    end do
  end subroutine decouple

  !> Scales the columns of S so that in each group the rows and columns of D are of similar size. Changes nothing if every group has
  !> a single mode.
  subroutine balance(modes, s, motion)
    type(modes_type), intent(in) :: modes
    real(dp), contiguous, intent(inout) :: s(:, :, :)
    type(motion_type), intent(inout) :: motion
    real(dp) :: sizes(size(modes%group), size(modes%group)), unit(size(modes%group))
    real(dp), dimension(size(motion%d, 1)) :: re, im
    integer :: k, l

    if (all([(count(modes%group == modes%group(k)), k = 1, size(unit))] == 1)) return
    sizes = 0
    do l = 1, size(unit)
      do k = 1, size(unit)
        if (modes%group(k) /= modes%group(l)) cycle
        call entry(motion%d, modes%conjugate, k, l, re, im)
        sizes(k, l) = maxval(hypot(re, im))
      end do
    end do
    unit = balancing(sizes)
    ! Use one unit for both columns of a conjugate pair.
    unit = unit([(min(k, modes%conjugate(k)), k = 1, size(unit))])
    do k = 1, size(unit)
      s(:, :, k) = s(:, :, k) * unit(k)
      motion%inverted(:, k, :) = motion%inverted(:, k, :) / unit(k)
      motion%d(:, :, k) = motion%d(:, :, k) * unit(k)
      motion%d(:, k, :) = motion%d(:, k, :) / unit(k)
    end do
  end subroutine balance

  !> Computes the generator D = S^-1 (A S - S') and S^-1 at each phase. `slope` contains the derivative S'. Fails if S is
  !> singular.
  subroutine transform(a, s, slope, motion, error)
    real(dp), contiguous, intent(in) :: a(:, :, :), s(:, :, :), slope(:, :, :)
    type(motion_type), intent(inout) :: motion
    type(error_type), allocatable, intent(out) :: error
    real(dp), dimension(size(s, 1), size(s, 2), size(s, 3)) :: rate

    if (.not. allocated(motion%d)) allocate(motion%d, motion%inverted, mold=s)
    call inverses(s, motion%inverted, error)
    if (allocated(error)) return
    call multiply(a, s, rate)
    rate = rate - slope
    call multiply(motion%inverted, rate, motion%d)
  end subroutine transform

  !> Scales S so that the diagonal block of each group (its columns in its own rows) becomes the unit matrix. The bases of the
  !> groups then depend only on the subspaces, not on the iteration. Fails if such a block is singular, because a subspace
  !> differs too much from the subspace at phase 0.
  subroutine normalise(modes, s, error)
    type(modes_type), intent(in) :: modes
    real(dp), contiguous, intent(inout) :: s(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: within(:, :, :), inverted(:, :, :)
    real(dp), dimension(size(s, 1)) :: re, im
    integer :: k, l

    if (all([(count(modes%group == modes%group(k)), k = 1, size(s, 2))] == 1)) then
      do k = 1, size(s, 2)
        if (k <= modes%conjugate(k)) call normalise_mode(modes%conjugate, k, s, error)
        if (allocated(error)) return
      end do
      return
    end if
    allocate(within, source=0 * s)
    allocate(inverted, mold=s)
    do l = 1, size(s, 3)
      do k = 1, size(s, 2)
        if (modes%group(k) /= modes%group(l) .or. .not. counts(modes%conjugate, k, l)) cycle
        call entry(s, modes%conjugate, k, l, re, im)
        call add_entry(re, im, modes%conjugate, k, l, within)
      end do
    end do
    call inverses(within, inverted, error)
    if (allocated(error)) return
    within = s
    call multiply(within, inverted, s)
  end subroutine normalise

  !> Divides column k of S by its element in row k, so that this element becomes 1, and divides the conjugate column by the
  !> conjugate number.
  pure subroutine normalise_mode(conjugate, k, s, error)
    integer, intent(in) :: conjugate(:), k
    real(dp), contiguous, intent(inout) :: s(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), dimension(size(s, 1)) :: a, b, re, im
    integer :: i

    call entry(s, conjugate, k, k, re, im)
    a = 1
    b = 0
    call divide(re, im, a, b, error)
    if (allocated(error)) return
    do i = 1, size(s, 2)
      re = s(:, i, k)
      im = s(:, i, conjugate(k))
      s(:, i, conjugate(k)) = re * b + im * a
      s(:, i, k) = re * a - merge(im * b, 0.0_dp, conjugate(k) /= k)
    end do
  end subroutine normalise_mode

  !> Maximum row sum of the elements of D between groups, at each phase. If `departure` is present, the row sums also include the
  !> elements of `departure` within groups.
  pure function uncoupled_sizes(d, modes, departure) result(sizes)
    real(dp), contiguous, intent(in) :: d(:, :, :)
    type(modes_type), intent(in) :: modes
    real(dp), contiguous, intent(in), optional :: departure(:, :, :)
    real(dp), dimension(size(d, 1)) :: sizes, row, re, im
    integer :: k, l

    sizes = 0
    do k = 1, size(d, 2)
      if (k > modes%conjugate(k)) cycle
      row = 0
      do l = 1, size(d, 2)
        if (modes%group(k) /= modes%group(l)) then
          call entry(d, modes%conjugate, k, l, re, im)
        else if (present(departure)) then
          call entry(departure, modes%conjugate, k, l, re, im)
        else
          cycle
        end if
        row = row + sqrt(re**2 + im**2)
      end do
      sizes = max(sizes, row)
    end do
  end function uncoupled_sizes

end module gestell_floquet_reduction_decoupling
