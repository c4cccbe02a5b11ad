!> The product of the affine maps of many steps, x <- A_k x + b_k for k = 1 ... m.
!>
!> The maps are applied one after the other to all columns of Phi and to x_p at once, which lie side by side in lanes
!> (gestell_math_lanes).
module gestell_floquet_period_composition
  use gestell_base_kinds, only: dp
  use gestell_math_lanes_products, only: combine, in_fours
  use gestell_math_lanes, only: lanes
  implicit none (type, external)
  private

  public :: multiply_maps

  !> What a transient growth is measured by: Phi where it was greatest on the way, in the norm of D^-1 Phi D, D = diag(scale),
  !> this norm, and Phi after step `middle`, counted from the first of the maps to come; shapes (n, n).
  type, public :: transient_type
    real(dp), allocatable :: peak(:, :), halfway(:, :)
    real(dp) :: peak_norm = 0
    integer :: middle = 0
  end type transient_type

  !> Beyond this the squares within a norm overflow.
  real(dp), parameter :: greatest = 1.0e150_dp

contains

  !> Applies the maps `a`, shape (n, n, steps), and where forced `b`, shape (n, steps), to `phi`, shape (n, n), and to `xp`,
  !> shape (n). `xp_peak` becomes the greatest size that xp has on the way, in the norm of x / scale, if that is greater.
  !> `fits`: whether all numbers do. `transient`: as known from the maps before, and changed by these; `middle` counts on.
  pure subroutine multiply_maps(a, scale, phi, fits, b, xp, xp_peak, transient)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), contiguous, intent(in) :: scale(:)
    real(dp), intent(inout) :: phi(:, :)
    logical, intent(out) :: fits
    real(dp), contiguous, intent(in), optional :: b(:, :)
    real(dp), intent(inout), optional :: xp(:), xp_peak
    type(transient_type), intent(inout), optional :: transient
    ! [Phi x_p] before the first and after each step, its columns in lanes: column j in lane modulo(j - 1, lanes) + 1 of
    ! a group, x_p in `lane` of the last one, where `forced` is 1. Its rows, and those of A, in fours, those beyond n zero.
    real(dp) :: motion(lanes, in_fours(size(scale)), size(scale) / lanes + 1, 0:size(a, 3)), forced(lanes)
    real(dp) :: rows(size(scale), in_fours(size(scale))), norms(size(a, 3))
    integer :: n, steps, j, k, lane, group

    n = size(scale)
    steps = size(a, 3)
    lane = modulo(n, lanes) + 1
    group = n / lanes + 1
    forced = 0
    forced(lane) = 1
    motion(:, :, :, 0) = 0
    do j = 1, n
      motion(modulo(j - 1, lanes) + 1, :n, (j - 1) / lanes + 1, 0) = phi(:, j)
    end do
    if (present(xp)) motion(lane, :n, group, 0) = xp
    rows(:, n + 1:) = 0

    fits = .true.
    do k = 1, steps
      rows(:, :n) = transpose(a(:, :, k))
      do j = 1, group
        call combine(n, size(rows, 2), motion(:, :, j, k - 1), rows, motion(:, :, j, k))
      end do
      if (present(b)) call add(n, b(:, k), forced, motion(:, :, group, k))
      fits = small(size(rows, 2) * group, motion(:, :, :, k))
      if (.not. fits) return
    end do

    call take_phi(motion(:, :, :, steps), phi)
    if (present(xp)) xp = motion(lane, :n, group, steps)
    if (present(xp_peak)) then
      do k = 1, steps
        xp_peak = max(xp_peak, norm2(motion(lane, :n, group, k) / scale))
      end do
    end if
    if (.not. present(transient)) return
    if (transient%middle >= 1 .and. transient%middle <= steps) call take_phi(motion(:, :, :, transient%middle), transient%halfway)
    transient%middle = transient%middle - steps
    norms = norms_of(n, scale, motion)
    k = maxloc(norms, dim=1)
    if (norms(k) <= transient%peak_norm) return
    transient%peak_norm = norms(k)
    call take_phi(motion(:, :, :, k), transient%peak)
  end subroutine multiply_maps

  !> Phi from its columns in lanes.
  pure subroutine take_phi(motion, phi)
    real(dp), contiguous, intent(in) :: motion(:, :, :)
    real(dp), intent(inout) :: phi(:, :)
    integer :: j

    do j = 1, size(phi, 2)
      phi(:, j) = motion(modulo(j - 1, lanes) + 1, :size(phi, 1), (j - 1) / lanes + 1)
    end do
  end subroutine take_phi

  !> The norms of D^-1 Phi D after every step, x_p left out; shape (steps).
  pure function norms_of(n, scale, motion) result(norms)
    integer, intent(in) :: n
    real(dp), intent(in) :: scale(n)
    real(dp), contiguous, intent(in) :: motion(:, :, :, 0:)
    real(dp) :: norms(ubound(motion, 4))
    real(dp) :: weights(lanes, n, size(motion, 3)), squares(lanes)
    integer :: i, j, k, lane

    weights = 0
    do j = 1, n
      weights(modulo(j - 1, lanes) + 1, :, (j - 1) / lanes + 1) = (scale(j) / scale)**2
    end do
    do k = 1, size(norms)
      squares = 0
      do j = 1, size(motion, 3)
        do i = 1, n
          !GCC$ unroll 1
          do lane = 1, lanes
            squares(lane) = squares(lane) + weights(lane, i, j) * motion(lane, i, j, k)**2
          end do
        end do
      end do
      norms(k) = sqrt(sum(squares))
    end do
  end function norms_of

  !> Adds b where `forced` is 1.
  pure subroutine add(n, b, forced, x)
    integer, intent(in) :: n
    real(dp), intent(in) :: b(n), forced(lanes)
    real(dp), intent(inout) :: x(lanes, n)
    integer :: lane, i

    do i = 1, n
      !GCC$ unroll 1
      do lane = 1, lanes
        x(lane, i) = x(lane, i) + b(i) * forced(lane)
      end do
    end do
  end subroutine add

  !> Whether all of `count` times `lanes` numbers are well within their range, and are numbers: sums keep what is none,
  !> maxima lose it.
  pure logical function small(count, x)
    integer, intent(in) :: count
    real(dp), intent(in) :: x(lanes, count)
    real(dp) :: sums(lanes)
    integer :: lane, i

    sums = 0
    do i = 1, count
      !GCC$ ivdep
      do lane = 1, lanes
        sums(lane) = sums(lane) + abs(x(lane, i))
      end do
    end do
    small = all(sums < greatest)
  end function small

end module gestell_floquet_period_composition
