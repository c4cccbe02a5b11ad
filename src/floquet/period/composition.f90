!> The product of the affine maps of many steps, x <- A_k x + b_k for k = 1 ... m.
!>
!> The maps are applied one after the other to all columns of Phi and to x_p at once, which lie side by side in lanes
!> (gestell_math_lanes).
module gestell_floquet_period_composition
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_math_lanes_motion, only: apply_in_turn
  implicit none (type, external)
  private

  public :: follow_maps, multiply_maps

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

  !> Applies so many `steps`' maps, [A b] or A alone, shape (steps or more, n, n + 1 or n), to `phi`, shape (n, n), and to `xp`,
  !> shape (n). `xp_peak` becomes the greatest size that xp has on the way, in the norm of x / scale, if that is greater.
  !> `fits`: whether all numbers do. `transient`: as known from the maps before, and changed by these; `middle` counts on.
  pure subroutine multiply_maps(steps, maps, scale, phi, fits, xp, xp_peak, transient)
    integer, intent(in) :: steps
    real(dp), contiguous, intent(in) :: maps(:, :, :), scale(:)
    real(dp), intent(inout) :: phi(:, :)
    logical, intent(out) :: fits
    real(dp), intent(inout), optional :: xp(:), xp_peak
    type(transient_type), intent(inout), optional :: transient
    ! [Phi x_p] before the first and after each step, its columns in lanes: column j in lane modulo(j - 1, lanes) + 1 of
    ! a group, x_p in `lane` of the last one, where `forced` is 1.
    real(dp) :: motion(lanes, size(scale), (size(maps, 3) - 1) / lanes + 1, 0:steps), forced(lanes), norm
    integer :: n, columns, groups, done, k, lane

    n = size(scale)
    columns = size(maps, 3)
    groups = size(motion, 3)
    lane = modulo(n, lanes) + 1
    forced = 0
    if (present(xp)) forced(lane) = 1
    call lay_out(phi, motion(:, :, :, 0))
    if (present(xp)) motion(lane, :, groups, 0) = xp

    call apply_in_turn(n, columns, size(maps, 1), 1, steps, groups, maps, forced, greatest, motion, done)
    fits = done == steps
    if (.not. fits) return

    call take_columns(motion(:, :, :, steps), phi)
    if (present(xp)) xp = motion(lane, :, groups, steps)
    if (present(xp_peak)) then
      do k = 1, steps
        xp_peak = max(xp_peak, norm2(motion(lane, :, groups, k) / scale))
      end do
    end if
    if (.not. present(transient)) return
    if (transient%middle >= 1 .and. transient%middle <= steps) then
      call take_columns(motion(:, :, :, transient%middle), transient%halfway)
    end if
    transient%middle = transient%middle - steps
    call find_greatest(n, scale, motion, k, norm)
    if (norm <= transient%peak_norm) return
    transient%peak_norm = norm
    call take_columns(motion(:, :, :, k), transient%peak)
  end subroutine multiply_maps

  !> Applies the maps of so many steps from `first` on to `now`, [Phi x_p] or Phi alone, shape (n, columns). `fits`: whether all
  !> numbers on the way do.
  pure subroutine follow_maps(first, steps, maps, now, fits)
    integer, intent(in) :: first, steps
    real(dp), contiguous, intent(in) :: maps(:, :, :)
    real(dp), contiguous, intent(inout) :: now(:, :)
    logical, intent(out) :: fits
    real(dp) :: motion(lanes, size(now, 1), (size(now, 2) - 1) / lanes + 1, 0:steps), forced(lanes)
    integer :: n, columns, done

    n = size(now, 1)
    columns = size(now, 2)
    forced = 0
    if (columns > n) forced(modulo(n, lanes) + 1) = 1
    call lay_out(now, motion(:, :, :, 0))
    call apply_in_turn(n, columns, size(maps, 1), first, steps, size(motion, 3), maps, forced, greatest, motion, done)
    call take_columns(motion(:, :, :, done), now)
    fits = done == steps
  end subroutine follow_maps

  !> Columns in lanes, those that are none zero.
  pure subroutine lay_out(columns, motion)
    real(dp), intent(in) :: columns(:, :)
    real(dp), contiguous, intent(out) :: motion(:, :, :)
    integer :: j

    motion = 0
    do j = 1, size(columns, 2)
      motion(modulo(j - 1, lanes) + 1, :, (j - 1) / lanes + 1) = columns(:, j)
    end do
  end subroutine lay_out

  !> Columns from lanes.
  pure subroutine take_columns(motion, columns)
    real(dp), contiguous, intent(in) :: motion(:, :, :)
    real(dp), intent(inout) :: columns(:, :)
    integer :: j

    do j = 1, size(columns, 2)
      columns(:, j) = motion(modulo(j - 1, lanes) + 1, :, (j - 1) / lanes + 1)
    end do
  end subroutine take_columns

  !> The step after which the norm of D^-1 Phi D, x_p left out, is greatest, and that norm.
  pure subroutine find_greatest(n, scale, motion, greatest_of, norm)
    integer, intent(in) :: n
    real(dp), intent(in) :: scale(n)
    real(dp), contiguous, intent(in) :: motion(:, :, :, 0:)
    integer, intent(out) :: greatest_of
    real(dp), intent(out) :: norm
    real(dp) :: weights(lanes, n, size(motion, 3)), squares(lanes)
    integer :: i, j, k, lane

    weights = 0
    do j = 1, n
      weights(modulo(j - 1, lanes) + 1, :, (j - 1) / lanes + 1) = (scale(j) / scale)**2
    end do
    greatest_of = 1
    norm = 0
    do k = 1, ubound(motion, 4)
      squares = 0
      do j = 1, size(motion, 3)
        do i = 1, n
          !GCC$ unroll 1
          do lane = 1, lanes
            squares(lane) = squares(lane) + weights(lane, i, j) * motion(lane, i, j, k)**2
          end do
        end do
      end do
      if (sum(squares) <= norm) cycle
      greatest_of = k
      norm = sum(squares)
    end do
    norm = sqrt(norm)
  end subroutine find_greatest

end module gestell_floquet_period_composition
