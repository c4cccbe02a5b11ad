!> Computes Gershgorin discs around the eigenvalues of eight small matrices at once. If no discs touch, they are the discs of
!> gestell_floquet_multipliers, equation (64) of doc/theory.md.
module gestell_floquet_multipliers_gershgorin
  use gestell_math_batch_hessenberg, only: hessenberg_type, max_states
  use gestell_floquet_multipliers_hyman, only: try_eigenvalue
  use gestell_base_processor, only: has_versions
  use gestell_math_lanes, only: lanes
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: find_discs

  !> Gershgorin discs around the n eigenvalues of the matrix in each lane. Components have the shape (lanes, max_states) or
  !> (lanes).
  type, bind(C), public :: discs_type
    !> Radii of the discs, and condition numbers of the eigenvalues
    real(dp) :: radius(lanes, max_states), condition(lanes, max_states)
    !> 1 if the discs are isolated. 0 if discs touch, or if the eigenvectors are too inaccurate to decide this; the radius of
    !> each disc is then computed as if it were the only disc.
    real(dp) :: separate(lanes)
    !> 1 if Newton's step was applied. 0 if the approximations are too inaccurate for Newton's step; the caller must first improve
    !> them.
    real(dp) :: sharp(lanes)
    !> `step_re`, `step_im`: real and imaginary parts of Newton's steps, which are subtracted from the eigenvalues. `right`,
    !> `left`: residuals of the right and left unit eigenvectors.
    real(dp), dimension(lanes, max_states) :: step_re, step_im, right, left
  end type discs_type

  !> `small`: largest part of a disc's radius that may come from inaccurate eigenvectors. `nothing`: lower limit on distances in
  !> denominators. `beyond`: upper limit on condition numbers.
  real(dp), parameter :: small = 0.01_dp, nothing = 1.0e-100_dp, beyond = 1.0e100_dp

contains

  !> Computes improved eigenvalues and the radii of their discs from residuals, Newton steps and condition numbers. `pairs` is 1 for
  !> each eigenvalue that is the conjugate of the preceding one. See `find_discs` for the derivation.
  pure subroutine radii_here(n, norm, pairs, perturbation, z_re, z_im, discs, once) bind(C, name="lanes_gestell_radii")
    !$omp declare simd uniform(n, norm, pairs, perturbation, z_re, z_im, discs) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: n, once
    real(dp), intent(in) :: norm(lanes), perturbation(lanes)
    integer(c_int), intent(in) :: pairs(max_states)
    real(dp), intent(inout) :: z_re(lanes, max_states), z_im(lanes, max_states)
    type(discs_type), intent(inout) :: discs
    real(dp), dimension(lanes, max_states) :: nearest, f, x
    real(dp), dimension(lanes) :: worst, right, left, of_right, of_left, by_left, room, q
    real(dp) :: square(lanes, max_states * (max_states - 1) / 2), distance, share, rounding, residual, added
    integer :: i, k, lane, pair

    worst = 1
    ! The second of two vectorised calls has nothing to do: see gestell_base_processor.
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
        ! Skip this distance: another pair of the loop, of the conjugate eigenvalues, has the same distance.
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
      ! Cap phi at 1/2: beyond it the eigenvectors give no information.
      q(lane) = min(n * worst(lane) * (of_right(lane) + of_left(lane)), 0.5_dp)
      q(lane) = q(lane) / (1 - q(lane))
      by_left(lane) = merge(1.0_dp, 0.0_dp, left(lane) <= right(lane))
      ! Apply Newton's step only if the remaining error of z is at most roundoff.
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
        ! A Newton step that is not applied counts as an error.
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

  !> Improves approximate eigenvalues of `h` by a Newton step and computes Gershgorin discs around them, in all lanes at once.
  !>
  !> Hyman's method gives right eigenvectors of `z`, the unit columns x_k of X, and left ones, the rows y_k of Y, with y_k x_k =
  !> 1. So |y_k| is the condition number. The residuals are (H - z_k) x_k = r_k e_1 and y_k (H - z_k) = s_k e_n', with unit
  !> vectors e_1, e_n. Let rho_k = |r_k|, sigma_k = |s_k| / |y_k|, w the largest condition number and g_k the distance of z_k
  !> from the nearest other eigenvalue. For k /= j
  !>
  !>     y_k x_j = (s_k x_nj - r_j y_k1) / (z_j - z_k).
  !>
  !> Hence Y X = E + F, where E is the unit matrix and the column sums of F are at most phi = n w (max sigma_k / g_k + max rho_k
  !> / g_k). With the error D of the matrix, |D| <= delta, and the diagonal matrix Z of all z_k
  !>
  !>     Y (H + D) Y^-1 = Z + (S + Y D) X (E + F)^-1,  S with the rows s_k e_n'.
  !>
  !> The term s_k x_nk is Newton's step of z_k. All other terms in row k are at most (delta + sigma_k) |y_k|; F increases them by
  !> the fraction q = phi / (1 - phi). The bounds f_kj on the elements of row k in Gershgorin's theorem are therefore
  !>
  !>     f_kk <= (delta + q (delta + sigma_k)) |y_k|,  f_kj <= (1 + q) (delta + sigma_k) |y_k| = f_k.
  !>
  !> The coupling of an eigenvalue to the others is an effect of second order: see `separated_radius` of
  !> gestell_floquet_multipliers. Let x be the maximum over the other eigenvalues of f_k divided by the gap between the discs of
  !> radii n f_k, which include Newton's steps. Then the factor of the similarity transformation is alpha = x / (1 + x). If the
  !> residuals rho_k are smaller than sigma_k, X and Y are exchanged.
  pure subroutine find_discs(length, h, conjugate, perturbation, z_re, z_im, discs)
    !> Number of double precision numbers in a vector register of the processor
    integer, intent(in) :: length
    !> The matrices, in Hessenberg form
    type(hessenberg_type), intent(in) :: h
    !> True for each eigenvalue that is the conjugate of the preceding one; its disc is the mirror image of the disc of the
    !> preceding eigenvalue
    logical, intent(in) :: conjugate(max_states)
    !> Bound on the norm of the error of each matrix, roundoff included
    real(dp), intent(in) :: perturbation(lanes)
    !> Real and imaginary parts of the approximate eigenvalues; improved by Newton's step on return
    real(dp), intent(inout) :: z_re(lanes, max_states), z_im(lanes, max_states)
    type(discs_type), intent(out) :: discs
    integer(c_int) :: pairs(max_states)
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
