!> Discs around the eigenvalues of small matrices, eight side by side: set_multipliers' discs where none touches another.
module gestell_floquet_multipliers_gershgorin
  use gestell_math_batch_hessenberg, only: hessenberg_type, most_states
  use gestell_floquet_multipliers_hyman, only: try_eigenvalue
  use gestell_base_processor, only: has_versions
  use gestell_math_lanes, only: lanes
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: find_discs

  !> Of n eigenvalues, shapes (lanes, most_states) and (lanes).
  type, bind(C), public :: discs_type
    real(dp) :: radius(lanes, most_states), condition(lanes, most_states)
    !> 1, or 0 where discs touch or eigenvectors are too inaccurate to tell; then the radii are those that each would have alone.
    real(dp) :: separate(lanes)
    !> 1, or 0 where the eigenvalues stay as they are, because better ones are to be found.
    real(dp) :: sharp(lanes)
    !> Newton's steps, which are to be taken off, and residuals of unit eigenvectors, right and left ones.
    real(dp), dimension(lanes, most_states) :: step_re, step_im, right, left
  end type discs_type

  !> What inaccurate vectors may add to a disc, relative to it; distances that are none, and beyond all.
  real(dp), parameter :: small = 0.01_dp, nothing = 1.0e-100_dp, beyond = 1.0e100_dp

contains

  !> Better eigenvalues of `h` from `z`, shapes (lanes, most_states), and the discs around them, where the error of the matrix,
  !> roundoff included, is at most `perturbation` in norm, shape (lanes). `conjugate`: of those that are the conjugate of the one
  !> before the same is known as of that. `length`: of the processor's vectors.
  !>
  !> Hyman's method leaves eigenvectors X of `z`, unit columns, and left ones Y, y_k x_k = 1, |y_k| the condition, with residuals
  !> (H - z_k) x_k = r_k e_1 and y_k (H - z_k) = s_k e_n'; rho_k = |r_k|, sigma_k = |s_k| / |y_k|. For k /= j is
  !> y_k x_j = (s_k x_nj - r_j y_k1) / (z_j - z_k), so that Y X = E + F, where the sums of F's columns are at most
  !> phi = n w (max sigma_k / g_k + max rho_k / g_k), w the worst condition, g_k the distance of the next eigenvalue. With the error
  !> D of the matrix, |D| <= delta,
  !>
  !>   Y (H + D) Y^-1 = Z + (S + Y D) X (E + F)^-1,  S with the rows s_k e_n'.
  !>
  !> s_k x_nk moves z_k to Newton's. All else is in row k at most (delta + sigma_k) |y_k|, times q = phi / (1 - phi) in what F
  !> adds. In Gershgorin's rows
  !>
  !>   f_kk <= (delta + q (delta + sigma_k)) |y_k|,  f_kj <= (1 + q) (delta + sigma_k) |y_k| = f_k,
  !>
  !> Radii and better eigenvalues from residuals, steps and conditions. `pairs`: 1 for those that are the conjugate of the one
  !> before.
  pure subroutine radii_here(n, norm, pairs, perturbation, z_re, z_im, discs, once) bind(C, name="lanes_gestell_radii")
    !$omp declare simd uniform(n, norm, pairs, perturbation, z_re, z_im, discs) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: n, once
    real(dp), intent(in) :: norm(lanes), perturbation(lanes)
    integer(c_int), intent(in) :: pairs(most_states)
    real(dp), intent(inout) :: z_re(lanes, most_states), z_im(lanes, most_states)
    type(discs_type), intent(inout) :: discs
    real(dp), dimension(lanes, most_states) :: nearest, f, x
    real(dp), dimension(lanes) :: worst, right, left, of_right, of_left, by_left, room, q
    real(dp) :: square(lanes, most_states * (most_states - 1) / 2), distance, share, rounding, residual, added
    integer :: i, k, lane, pair

    worst = 1
    ! The second of two: gestell_base_processor.
    if (once > 1) return
    do k = 1, n
      !GCC$ ivdep
      !GCC$ unroll 1
      do lane = 1, lanes
        nearest(lane, k) = huge(1.0_dp)
        x(lane, k) = 0
      end do
    end do
    do k = 2, n
      if (pairs(k) == 0) cycle
      !GCC$ ivdep
      !GCC$ unroll 1
      do lane = 1, lanes
        discs%step_re(lane, k) = discs%step_re(lane, k - 1)
        discs%step_im(lane, k) = -discs%step_im(lane, k - 1)
        discs%condition(lane, k) = discs%condition(lane, k - 1)
        discs%right(lane, k) = discs%right(lane, k - 1)
        discs%left(lane, k) = discs%left(lane, k - 1)
      end do
    end do
    pair = 0
    do k = 2, n
      do i = 1, k - 1
        ! As far apart as their conjugates, where both are of such pairs: what is a pair in some lanes only has none beside it.
        if (pairs(i) == 1 .and. (pairs(k) == 1 .or. pairs(min(k + 1, n)) == 1)) cycle
        pair = pair + 1
        !GCC$ ivdep
        !GCC$ unroll 1
        do lane = 1, lanes
          square(lane, pair) = (z_re(lane, i) - z_re(lane, k))**2 + (z_im(lane, i) - z_im(lane, k))**2
          nearest(lane, i) = min(nearest(lane, i), square(lane, pair))
          nearest(lane, k) = min(nearest(lane, k), square(lane, pair))
        end do
      end do
    end do
    right = 0
    left = 0
    of_right = 0
    of_left = 0
    do k = 1, n
      i = min(k + 1, n)
      if (pairs(k) == 1) cycle
      if (pairs(i) == 0) i = k
      !GCC$ ivdep
      !GCC$ unroll 1
      do lane = 1, lanes
        share = 1 / max(sqrt(min(nearest(lane, k), nearest(lane, i))), nothing)
        worst(lane) = max(worst(lane), min(discs%condition(lane, k), beyond))
        right(lane) = max(right(lane), discs%right(lane, k))
        left(lane) = max(left(lane), discs%left(lane, k))
        of_right(lane) = max(of_right(lane), discs%right(lane, k) * share)
        of_left(lane) = max(of_left(lane), discs%left(lane, k) * share)
      end do
    end do
    !GCC$ ivdep
    !GCC$ unroll 1
    do lane = 1, lanes
      ! From a half on nothing is known by them.
      q(lane) = min(n * worst(lane) * (of_right(lane) + of_left(lane)), 0.5_dp)
      q(lane) = q(lane) / (1 - q(lane))
      by_left(lane) = merge(1.0_dp, 0.0_dp, left(lane) <= right(lane))
      ! What Newton's step leaves of the error of z is no more than roundoff.
      rounding = n * epsilon(1.0_dp) * norm(lane)
      discs%sharp(lane) = merge(1.0_dp, 0.0_dp, q(lane) * max(min(left(lane), right(lane)), rounding / small) <= rounding)
      discs%separate(lane) = 1
      room(lane) = huge(1.0_dp)
    end do
    do k = 1, n
      !GCC$ ivdep
      !GCC$ unroll 1
      do lane = 1, lanes
        z_re(lane, k) = z_re(lane, k) - discs%sharp(lane) * discs%step_re(lane, k)
        z_im(lane, k) = z_im(lane, k) - discs%sharp(lane) * discs%step_im(lane, k)
        residual = merge(discs%left(lane, k), discs%right(lane, k), by_left(lane) > 0)
        f(lane, k) = min((1 + q(lane)) * (perturbation(lane) + residual) * discs%condition(lane, k), beyond)
        ! Newton's step that is not taken counts.
        added = q(lane) * (perturbation(lane) + residual) + (1 - discs%sharp(lane)) * residual
        discs%separate(lane) = min(discs%separate(lane), merge(1.0_dp, 0.0_dp, added <= small * perturbation(lane)))
        discs%radius(lane, k) = (perturbation(lane) + added) * discs%condition(lane, k)
      end do
    end do
    pair = 0
    do k = 2, n
      do i = 1, k - 1
        if (pairs(i) == 1 .and. (pairs(k) == 1 .or. pairs(min(k + 1, n)) == 1)) cycle
        pair = pair + 1
        !GCC$ ivdep
        !GCC$ unroll 1
        do lane = 1, lanes
          distance = sqrt(square(lane, pair)) - n * (f(lane, i) + f(lane, k))
          room(lane) = min(room(lane), distance)
          share = 1 / max(distance, nothing)
          x(lane, i) = max(x(lane, i), f(lane, k) * share)
          x(lane, k) = max(x(lane, k), f(lane, i) * share)
        end do
      end do
    end do
    do k = 1, n
      if (pairs(k) == 1) cycle
      i = min(k + 1, n)
      if (pairs(i) == 0) i = k
      !GCC$ ivdep
      !GCC$ unroll 1
      do lane = 1, lanes
        share = max(x(lane, k), x(lane, i))
        share = discs%radius(lane, k) + (n - 1) * f(lane, k) * (share / (1 + share))
        added = n * (perturbation(lane) + min(discs%left(lane, k), discs%right(lane, k))) * discs%condition(lane, k)
        discs%radius(lane, k) = merge(share, added, discs%separate(lane) > 0 .and. room(lane) > 0)
        discs%radius(lane, i) = discs%radius(lane, k)
      end do
    end do
    !GCC$ ivdep
    !GCC$ unroll 1
    do lane = 1, lanes
      discs%separate(lane) = merge(discs%separate(lane), 0.0_dp, room(lane) > 0)
    end do
  end subroutine radii_here

  !> and what couples an eigenvalue to others counts to second order: `apart` of gestell_floquet_multipliers. With x the greatest
  !> of the others' f_k over the room between the discs n f_k, which have Newton's steps in them, alpha is x / (1 + x). X and Y
  !> change places where rho are smaller.
  pure subroutine find_discs(length, h, conjugate, perturbation, z_re, z_im, discs)
    integer, intent(in) :: length
    type(hessenberg_type), intent(in) :: h
    logical, intent(in) :: conjugate(most_states)
    real(dp), intent(in) :: perturbation(lanes)
    real(dp), intent(inout) :: z_re(lanes, most_states), z_im(lanes, most_states)
    type(discs_type), intent(out) :: discs
    integer(c_int) :: pairs(most_states)
    integer :: k
    procedure(radii_here), bind(C, name="_ZGVeN2uuuuuuul_lanes_gestell_radii") :: radii_512
    procedure(radii_here), bind(C, name="_ZGVdN2uuuuuuul_lanes_gestell_radii") :: radii_256

    pairs = merge(1, 0, conjugate)
    do k = 1, h%n
      if (conjugate(k)) cycle
      call try_eigenvalue(length, h, z_re(:, k), z_im(:, k), discs%step_re(:, k), discs%step_im(:, k), discs%condition(:, k), &
        & discs%right(:, k), discs%left(:, k))
    end do
    if (has_versions .and. length == 8) then
      call radii_512(h%n, h%norm, pairs, perturbation, z_re, z_im, discs, 1)
    else if (has_versions .and. length == 4) then
      call radii_256(h%n, h%norm, pairs, perturbation, z_re, z_im, discs, 1)
    else
      call radii_here(h%n, h%norm, pairs, perturbation, z_re, z_im, discs, 1)
    end if
  end subroutine find_discs

end module gestell_floquet_multipliers_gershgorin
