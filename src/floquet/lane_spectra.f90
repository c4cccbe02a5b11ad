!> The greatest multipliers of eight small matrices side by side.
module gestell_floquet_lane_spectra
  use gestell_base_hessenberg, only: hessenberg_type, most_states, new_hessenberg
  use gestell_base_kinds, only: dp
  use gestell_base_lanes, only: lanes
  use gestell_base_roots, only: find_roots
  use gestell_floquet_discs, only: find_discs
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: solve_lanes

  !> What is found of eight matrices. `sound`: 1, or 0 where something is in doubt.
  type, public :: found_type
    real(dp), dimension(lanes) :: sound, radius, log_radius, bound
    logical, dimension(lanes) :: stable, unstable
  end type found_type

contains

  !> Eight matrices side by side. `a` is used up.
  pure subroutine solve_lanes(a, n, perturbation, bounds, found)
    real(dp), intent(inout) :: a(lanes, most_states, most_states)
    integer, intent(in) :: n
    real(dp), intent(in) :: perturbation
    logical, intent(in) :: bounds
    type(found_type), intent(out) :: found
    type(hessenberg_type) :: h
    real(dp) :: unit(lanes), converged(lanes), separate(lanes), modulus
    real(dp) :: z_re(lanes, most_states), z_im(lanes, most_states), disc(lanes, most_states)
    integer :: k, lane

    call set_units(a, n, unit, found%sound)
    call new_hessenberg(a, n, h)
    call find_roots(h, z_re, z_im, converged)
    found%sound = found%sound * h%sound * converged
    found%radius = 0
    found%bound = 0
    found%stable = .true.
    found%unstable = .false.
    if (bounds) then
      call find_discs(h, z_re, z_im, perturbation / unit + n * epsilon(1.0_dp) * h%norm, disc, separate)
      found%sound = found%sound * separate
    else
      disc = 0
    end if
    do k = 1, n
      do lane = 1, lanes
        modulus = sqrt(z_re(lane, k)**2 + z_im(lane, k)**2)
        if (modulus > found%radius(lane)) then
          found%radius(lane) = modulus
          found%bound(lane) = disc(lane, k)
        end if
        found%stable(lane) = found%stable(lane) .and. (modulus + disc(lane, k)) * unit(lane) < 1
        found%unstable(lane) = found%unstable(lane) .or. (modulus - disc(lane, k)) * unit(lane) > 1
      end do
    end do
    found%bound = found%bound / max(found%radius, tiny(1.0_dp))
    found%radius = found%radius * unit
    found%log_radius = log(max(found%radius, tiny(1.0_dp)))
  end subroutine solve_lanes

  !> The matrices divided by powers of two `unit`, shape (lanes), to elements below 1. Those that are not finite or extreme are
  !> not `sound`; a harmless matrix takes their places.
  pure subroutine set_units(a, n, unit, sound)
    real(dp), intent(inout) :: a(lanes, most_states, most_states)
    integer, intent(in) :: n
    real(dp), intent(out) :: unit(lanes), sound(lanes)
    !> Greatest elements beyond which a matrix is extreme.
    real(dp), parameter :: least = 1.0e-100_dp, most = 1.0e100_dp
    real(dp) :: greatest(lanes), inverse(lanes)
    integer :: i, j, lane

    greatest = 0
    do j = 1, n
      do i = 1, n
        greatest = max(greatest, merge(abs(a(:, i, j)), huge(1.0_dp), ieee_is_finite(a(:, i, j))))
      end do
    end do
    sound = merge(1.0_dp, 0.0_dp, greatest > least .and. greatest < most)
    unit = 1
    do lane = 1, lanes
      if (sound(lane) > 0) then
        unit(lane) = scale(1.0_dp, exponent(greatest(lane)))
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

end module gestell_floquet_lane_spectra
