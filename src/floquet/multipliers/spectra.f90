!> The greatest multipliers of very many small matrices.
module gestell_floquet_multipliers_spectra
  use gestell_base_error, only: error_type
  use gestell_math_hessenberg, only: most_states
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_math_lapack, only: eigensystem
  use gestell_floquet_multipliers_lane_spectra, only: found_type, solve_lanes
  use gestell_floquet_multipliers, only: multipliers_type, set_multipliers
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: spectral_radii

contains

  !> radius = max |rho| and its logarithm, shapes (count), of the matrices phi(k, :), shape (count, n n), elements column by column
  !> in units in which norms make sense, whose errors are at most `perturbation` in norm, roundoff in finding eigenvalues not
  !> counted. Where asked for: the bound on the error of that multiplier relative to |rho|, and the verdict, all as set_multipliers
  !> and multipliers_type have it. NaN, with the bound 1e300 and no verdict, for a matrix that is not finite.
  !>
  !> Eight at a time; where eigenvalues do not converge, discs touch, eigenvectors are doubtful, or no bound is there to tell of
  !> roundoff above 1e-10 and above the effect of `perturbation`, one by one with LAPACK, which `singly` counts. The results for a
  !> matrix do not depend on the others.
  subroutine spectral_radii(phi, perturbation, radius, log_radius, error_bound, stable, unstable, singly)
    real(dp), contiguous, intent(in) :: phi(:, :)
    real(dp), intent(in) :: perturbation
    real(dp), intent(out) :: radius(:), log_radius(:)
    real(dp), intent(out), optional :: error_bound(:)
    logical, intent(out), optional :: stable(:), unstable(:)
    integer, intent(out), optional :: singly
    real(dp) :: a(lanes, most_states, most_states)
    type(found_type) :: found
    logical :: bounds
    integer :: first, filled, n, lane, k, alone

    n = nint(sqrt(real(size(phi, 2), dp)))
    bounds = present(error_bound) .or. present(stable) .or. present(unstable)
    alone = 0
    do first = 1, size(phi, 1), lanes
      filled = min(lanes, size(phi, 1) - first + 1)
      found%sound = 0
      if (n <= most_states) then
        call take(phi, first, n, a)
        call solve_lanes(a, n, perturbation, bounds, found)
      end if
      do lane = 1, filled
        k = first + lane - 1
        if (found%sound(lane) > 0) cycle
        alone = alone + 1
        call solve_alone(reshape(phi(k, :), [n, n]), perturbation, found, lane)
      end do
      associate (last => first + filled - 1)
        radius(first:last) = found%radius(:filled)
        log_radius(first:last) = found%log_radius(:filled)
        if (present(error_bound)) error_bound(first:last) = found%bound(:filled)
        if (present(stable)) stable(first:last) = found%stable(:filled)
        if (present(unstable)) unstable(first:last) = found%unstable(:filled)
      end associate
    end do
    if (present(singly)) singly = alone
  end subroutine spectral_radii

  !> Matrices `first` and those that follow, the last one repeated beyond the end.
  pure subroutine take(phi, first, n, a)
    real(dp), contiguous, intent(in) :: phi(:, :)
    integer, intent(in) :: first, n
    real(dp), intent(out) :: a(lanes, most_states, most_states)
    integer :: i, j, lane

    do j = 1, n
      do i = 1, n
        if (first + lanes - 1 <= size(phi, 1)) then
          a(:, i, j) = phi(first:first + lanes - 1, i + n * (j - 1))
        else
          do lane = 1, lanes
            a(lane, i, j) = phi(min(first + lane - 1, size(phi, 1)), i + n * (j - 1))
          end do
        end if
      end do
    end do
  end subroutine take

  !> Matrix `lane` by itself.
  subroutine solve_alone(phi, perturbation, found, lane)
    real(dp), intent(in) :: phi(:, :), perturbation
    type(found_type), intent(inout) :: found
    integer, intent(in) :: lane
    type(multipliers_type) :: multipliers
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
    type(error_type), allocatable :: error
    integer :: k

    found%radius(lane) = ieee_value(1.0_dp, ieee_quiet_nan)
    found%log_radius(lane) = found%radius(lane)
    found%bound(lane) = 1.0e300_dp
    found%stable(lane) = .false.
    found%unstable(lane) = .false.
    if (.not. all(ieee_is_finite(phi))) return
    call eigensystem(phi, rho, right, left, error)
    if (allocated(error)) return
    call set_multipliers(rho, right, left, perturbation + size(rho) * epsilon(1.0_dp) * norm2(phi), multipliers)
    k = maxloc(abs(rho), dim=1)
    found%radius(lane) = abs(rho(k))
    found%log_radius(lane) = multipliers%log_abs(k)
    found%bound(lane) = multipliers%error(k)
    found%stable(lane) = multipliers%verdict() == "stable"
    found%unstable(lane) = multipliers%verdict() == "unstable"
  end subroutine solve_alone

end module gestell_floquet_multipliers_spectra
