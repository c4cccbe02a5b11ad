!> Composes the affine maps of many steps, x <- A_k x + b_k for k = 1 ... m.
!>
!> The map of each step is applied to all columns of the monodromy matrix Phi and to the forced motion x_p together. The columns
!> are stored side by side in the lanes of vector registers (gestell_math_lanes).
module gestell_floquet_period_composition
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_math_lanes_motion, only: apply_in_turn
  implicit none (type, external)
  private

  public :: follow_maps, multiply_maps

  !> Measures the transient growth of Phi while the maps are applied. Norms of Phi are norms of D^-1 Phi D with D = diag(scale).
  type, public :: transient_type
    !> `peak`: Phi after the step at which its norm was largest so far. `halfway`: Phi after step `middle`. Shapes (n, n).
    real(dp), allocatable :: peak(:, :), halfway(:, :)
    !> Norm of `peak`
    real(dp) :: peak_norm = 0
    !> Number of steps still to be applied before Phi is stored in `halfway`
    integer :: middle = 0
  end type transient_type

  !> Upper limit on the modulus of every number: squares of larger numbers may overflow in a norm.
  real(dp), parameter :: maximum = 1.0e150_dp

contains

  !> Applies the maps of `steps` steps to the matrix Phi, and to the forced motion x_p if it is present.
  pure subroutine multiply_maps(steps, maps, scale, phi, fits, xp, xp_peak, transient)
    !> Number of steps
    integer, intent(in) :: steps
    !> `maps`: maps of the steps, [A b] or A alone, shape (steps or more, n, n + 1 or n). `scale`: units of the states, shape (n).
    real(dp), contiguous, intent(in) :: maps(:, :, :), scale(:)
    !> Matrix Phi, shape (n, n): on entry before these steps, on return after them
    real(dp), intent(inout) :: phi(:, :)
    !> False if an element of Phi or x_p exceeds `maximum` in modulus after one of the steps; Phi and x_p are then unchanged.
    logical, intent(out) :: fits
    !> `xp`: forced motion x_p, shape (n), on entry before these steps, on return after them. `xp_peak`: largest norm of x_p / scale
    !> so far.
    real(dp), intent(inout), optional :: xp(:), xp_peak
    !> Transient growth so far, updated by these steps
    type(transient_type), intent(inout), optional :: transient
    ! [Phi x_p] before the first step and after each step. Column j lies in lane modulo(j - 1, lanes) + 1 of its group of columns.
    ! x_p lies in lane `lane` of the last group; `forced` is 1 there and 0 elsewhere.
    real(dp) :: motion(lanes, size(scale), (size(maps, 3) - 1) / lanes + 1, 0:steps), forced(lanes), norm
    integer :: n, columns, groups, done, k, lane

    n = size(scale)
    columns = size(maps, 3)
    groups = size(motion, 3)
    lane = modulo(n, lanes) + 1
    forced = 0
    if (present(xp)) forced(lane) = 1
    call copy_to_lanes(phi, motion(:, :, :, 0))
    if (present(xp)) motion(lane, :, groups, 0) = xp

    call apply_in_turn(n, columns, size(maps, 1), 1, steps, groups, maps, forced, maximum, motion, done)
    fits = done == steps
    if (.not. fits) return

    call copy_from_lanes(motion(:, :, :, steps), phi)
    if (present(xp)) xp = motion(lane, :, groups, steps)
    if (present(xp_peak)) then
      do k = 1, steps
        xp_peak = max(xp_peak, norm2(motion(lane, :, groups, k) / scale))
      end do
    end if
    if (.not. present(transient)) return
    if (transient%middle >= 1 .and. transient%middle <= steps) then
      call copy_from_lanes(motion(:, :, :, transient%middle), transient%halfway)
    end if
    transient%middle = transient%middle - steps
    call find_peak_step(n, scale, motion, k, norm)
    if (norm <= transient%peak_norm) return
    transient%peak_norm = norm
    call copy_from_lanes(motion(:, :, :, k), transient%peak)
  end subroutine multiply_maps

  !> Applies the maps of `steps` steps, beginning with map number `first`, to the matrix `now`.
  pure subroutine follow_maps(first, steps, maps, now, fits)
    !> `first`: number of the first map. `steps`: number of steps.
    integer, intent(in) :: first, steps
    !> Maps, [A b] or A alone, shape (last step or more, n, n + 1 or n)
    real(dp), contiguous, intent(in) :: maps(:, :, :)
    !> [Phi x_p], or Phi alone, shape (n, columns)
    real(dp), contiguous, intent(inout) :: now(:, :)
    !> False if a number exceeds `maximum`
    logical, intent(out) :: fits
    real(dp) :: motion(lanes, size(now, 1), (size(now, 2) - 1) / lanes + 1, 0:steps), forced(lanes)
    integer :: n, columns, done

    n = size(now, 1)
    columns = size(now, 2)
    forced = 0
    if (columns > n) forced(modulo(n, lanes) + 1) = 1
    call copy_to_lanes(now, motion(:, :, :, 0))
    call apply_in_turn(n, columns, size(maps, 1), first, steps, size(motion, 3), maps, forced, maximum, motion, done)
    call copy_from_lanes(motion(:, :, :, done), now)
    fits = done == steps
  end subroutine follow_maps

  !> Stores the columns of a matrix in lanes. Lanes without a column are set to zero.
  pure subroutine copy_to_lanes(columns, motion)
    real(dp), intent(in) :: columns(:, :)
    real(dp), contiguous, intent(out) :: motion(:, :, :)
    integer :: j

    motion = 0
    do j = 1, size(columns, 2)
      motion(modulo(j - 1, lanes) + 1, :, (j - 1) / lanes + 1) = columns(:, j)
    end do
  end subroutine copy_to_lanes

  !> Copies the columns from the lanes to a matrix.
  pure subroutine copy_from_lanes(motion, columns)
    real(dp), contiguous, intent(in) :: motion(:, :, :)
    real(dp), intent(inout) :: columns(:, :)
    integer :: j

    do j = 1, size(columns, 2)
      columns(:, j) = motion(modulo(j - 1, lanes) + 1, :, (j - 1) / lanes + 1)
    end do
  end subroutine copy_from_lanes

  !> Finds `peak_step`, the step after which the norm of D^-1 Phi D is largest, and this norm. The column x_p is not included in the
  !> norm.
  pure subroutine find_peak_step(n, scale, motion, peak_step, norm)
    integer, intent(in) :: n
    real(dp), intent(in) :: scale(n)
    real(dp), contiguous, intent(in) :: motion(:, :, :, 0:)
    integer, intent(out) :: peak_step
    real(dp), intent(out) :: norm
    real(dp) :: weights(lanes, n, size(motion, 3)), squares(lanes)
    integer :: i, j, k, lane

    weights = 0
    do j = 1, n
      weights(modulo(j - 1, lanes) + 1, :, (j - 1) / lanes + 1) = (scale(j) / scale)**2
    end do
    peak_step = 1
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
      peak_step = k
      norm = sum(squares)
    end do
    norm = sqrt(norm)
  end subroutine find_peak_step

end module gestell_floquet_period_composition
