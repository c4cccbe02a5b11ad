!> Computes the largest multipliers of eight small matrices at once, one matrix in each lane.
module gestell_floquet_multipliers_lane_spectra
  use gestell_math_batch_hessenberg, only: hessenberg_type, max_states, new_hessenberg
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: vector_length
  use gestell_math_lanes, only: lanes
  use gestell_math_batch_characteristic_roots, only: find_roots, guess_roots
  use gestell_floquet_multipliers_gershgorin, only: discs_type, find_discs
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: solve_lanes

  !> Results for eight matrices: the largest multiplier of each, its error bound, and whether the matrix is stable.
  type, public :: lane_spectra_type
    !> `sound`: 1 if the result is reliable, 0 if not. `radius`: modulus of the largest multiplier. `log_radius`: logarithm of
    !> `radius`. `bound`: bound on the error of the largest multiplier, relative to its modulus.
    real(dp), dimension(lanes) :: sound, radius, log_radius, bound
    !> `stable`: true if all multipliers are proved to be below 1 in modulus. `unstable`: true if at least one of them is proved to
    !> be above 1 in modulus.
    logical, dimension(lanes) :: stable, unstable
  end type lane_spectra_type

contains

  !> Computes the largest multipliers of eight matrices at once, and on request their error bounds.
  pure subroutine solve_lanes(a, n, perturbation, bounds, results)
    !> The matrices, stored in the first `n` rows and columns; the procedure overwrites them
    real(dp), intent(inout) :: a(lanes, max_states, max_states)
    !> Number of rows of each matrix
    integer, intent(in) :: n
    !> Bound on the norm of the error of each matrix
    real(dp), intent(in) :: perturbation
    !> If true, also compute error bounds, which include `perturbation`
    logical, intent(in) :: bounds
    type(lane_spectra_type), intent(out) :: results
    type(hessenberg_type) :: h
    type(discs_type) :: discs
    real(dp), parameter :: too_much = 1.0e-10_dp
    real(dp), dimension(lanes) :: unit, converged, certain, relative, rounding, change, modulus, top
    real(dp), dimension(lanes, max_states) :: z_re, z_im, w_re, w_im
    logical :: conjugate(max_states)
    integer :: length, k

    length = vector_length()
    call set_units(a, n, unit, results%sound)
    call new_hessenberg(length, a, n, h)
    call guess_roots(length, h, z_re, z_im, conjugate, converged)
    ! Cap the perturbation at the unit, the size of the largest element: all discs touch there anyway.
    relative = min(perturbation, unit) / unit
    rounding = n * epsilon(1.0_dp) * h%norm
    change = rounding
    if (bounds) change = relative + rounding
    w_re = z_re
    w_im = z_im
    call find_discs(length, h, conjugate, change, w_re, w_im, discs)
    converged = converged * discs%sharp
    if (any(.not. converged > 0)) then
      call find_roots(length, h, conjugate, z_re, z_im, converged)
      w_re = z_re
      w_im = z_im
      call find_discs(length, h, conjugate, change, w_re, w_im, discs)
    end if
    results%radius = 0
    results%bound = 0
    results%stable = .true.
    top = 1
    results%unstable = .false.
    do k = 1, n
      if (conjugate(k)) cycle
      modulus = sqrt(w_re(:, k)**2 + w_im(:, k)**2)
      results%stable = results%stable .and. (modulus + discs%radius(:, k)) * unit < 1
      results%unstable = results%unstable .or. (modulus - discs%radius(:, k)) * unit > 1
      results%bound = merge(discs%radius(:, k), results%bound, modulus > results%radius)
      top = merge(discs%condition(:, k), top, modulus > results%radius)
      results%radius = max(results%radius, modulus)
    end do
    ! If no error bound is requested, roundoff must be small in itself or small against the error of the matrix.
    certain = discs%separate
    if (.not. bounds) certain = merge(1.0_dp, 0.0_dp, results%bound <= max(too_much * results%radius, n * relative * top))
    results%sound = results%sound * h%sound * converged * certain
    results%bound = results%bound / max(results%radius, tiny(1.0_dp))
    results%radius = results%radius * unit
    results%log_radius = log(max(results%radius, tiny(1.0_dp)))
  end subroutine solve_lanes

  !> Divides each matrix by a power of two, `unit`, so that all elements are below 1 in modulus. A matrix that is not finite, too
  !> large or too small gets `sound` = 0 and is replaced by one that causes no overflow.
  pure subroutine set_units(a, n, unit, sound)
    real(dp), intent(inout) :: a(lanes, max_states, max_states)
    integer, intent(in) :: n
    real(dp), intent(out) :: unit(lanes), sound(lanes)
    !> A matrix is accepted if the modulus of its largest element lies between these limits.
    real(dp), parameter :: least = 1.0e-100_dp, most = 1.0e100_dp
    real(dp) :: maximum(lanes), inverse(lanes)
    integer :: i, j, lane

    maximum = 0
    do j = 1, n
      do i = 1, n
        maximum = max(maximum, merge(abs(a(:, i, j)), huge(1.0_dp), ieee_is_finite(a(:, i, j))))
      end do
    end do
    sound = merge(1.0_dp, 0.0_dp, maximum > least .and. maximum < most)
    unit = 1
    do lane = 1, lanes
      if (sound(lane) > 0) then
        unit(lane) = scale(1.0_dp, exponent(maximum(lane)))
      else
        a(lane, :n, :n) = 0
        do i = 1, n
          a(lane, i, i) = real(i, dp) / n
        end do
      end if
    end do
    inverse = 1 / unit
    do j = 1, n
      do i = 1, n
        a(:, i, j) = a(:, i, j) * inverse
      end do
    end do
  end subroutine set_units

end module gestell_floquet_multipliers_lane_spectra
