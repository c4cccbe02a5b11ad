!> The groups of modes of y' = D y + g, made as independent of each other as they can be: the numerics of
!> gestell_floquet_reduction, whose terms are used here, in the real form of gestell_floquet_reduction_conjugates.
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

  !> D in its real form and S^-1 at some phases, shape (phases, n, n).
  type, public :: motion_type
    real(dp), allocatable :: d(:, :, :), inverted(:, :, :)
  end type motion_type

  integer, parameter, public :: most_rounds = 60

contains

  !> D and S^-1 of `s`, whose derivative is that of its interpolation, and `left`, the greatest sum over a row of what D has
  !> between groups. Error: S is singular.
  subroutine examine(a, modes, s, motion, left, error)
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
    if (.not. left < huge(left)) call fatal_error(error, "the coefficients leave the range of the numbers", failed_computation)
  end subroutine examine

  !> Improves S by S (E + Z) with D_g Z_gh - Z_gh D_h = -D_gh: what is neglected, Z', is small where the groups are far apart
  !> against the change within a period. Ends where what is `left` is `enough`, or no longer falls. `s`, `motion` and `left`
  !> are the start, as examined, and the best that was found. Error: groups share an eigenvalue.
  subroutine decouple(a, modes, enough, s, motion, left, error)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    type(modes_type), intent(in) :: modes
    real(dp), intent(in) :: enough
    real(dp), contiguous, intent(inout) :: s(:, :, :)
    type(motion_type), intent(inout) :: motion
    real(dp), intent(inout) :: left
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: failure
    real(dp), dimension(size(s, 1), size(s, 2), size(s, 3)) :: tried, z
    type(motion_type) :: found
    real(dp) :: before, coupled
    integer :: round

    do round = 1, most_rounds
      if (left <= enough) return
      call separation(motion%d, modes, z, error)
      if (allocated(error)) return
      call multiply(s, z, tried)
      tried = tried + s
      call normalise(modes, tried, failure)
      if (.not. allocated(failure)) call examine(a, modes, tried, found, coupled, failure)
      if (allocated(failure)) return
      if (coupled >= left) return
      s = tried
      call move_alloc(found%d, motion%d)
      call move_alloc(found%inverted, motion%inverted)
      before = left
      left = coupled
      if (left >= 0.5_dp * before) return
    end do
  end subroutine decouple

  !> Units of the columns of S that make the rows and columns of D within the groups comparable; single modes have none.
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
    ! The same for the columns of a conjugate pair.
    unit = unit([(min(k, modes%conjugate(k)), k = 1, size(unit))])
    do k = 1, size(unit)
      s(:, :, k) = s(:, :, k) * unit(k)
      motion%inverted(:, k, :) = motion%inverted(:, k, :) / unit(k)
      motion%d(:, :, k) = motion%d(:, :, k) * unit(k)
      motion%d(:, k, :) = motion%d(:, k, :) / unit(k)
    end do
  end subroutine balance

  !> D = S^-1 (A S - S') and S^-1 at each phase. Error: S is singular.
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

  !> Columns of every group's S that are E in its rows: of all bases of the same spaces those that do not depend on how they
  !> were found. Error: a group has turned away from where it was at phase 0.
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

  !> The same for the column k and its conjugate: divided by the entry in its own row.
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

  !> Greatest sum over a row of the entries between groups, at each phase; with `departure` also of that within the groups.
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
