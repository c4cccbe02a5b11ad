!> The largest multipliers of any number of small matrices, computed eight at a time as in the library.
module many_spectra
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers_spectra, only: lane_spectra_type, spectra_of_eight
  use gestell_math_lanes, only: lanes
  implicit none (type, external)
  private

  public :: spectral_radii

contains

  !> The results of spectra_of_eight for the matrices phi(k, :), shape (count, n n), elements column by column. `singly` is the
  !> number of matrices that were solved one by one.
  subroutine spectral_radii(phi, perturbation, radius, log_radius, error_bound, stable, unstable, singly)
    real(dp), contiguous, intent(in) :: phi(:, :)
    real(dp), intent(in) :: perturbation
    real(dp), intent(out) :: radius(:), log_radius(:)
    real(dp), intent(out), optional :: error_bound(:)
    logical, intent(out), optional :: stable(:), unstable(:)
    integer, intent(out), optional :: singly
    real(dp), allocatable :: eight(:, :, :)
    type(lane_spectra_type) :: found
    logical :: bounds
    integer :: first, last, n, lane, alone

    n = nint(sqrt(real(size(phi, 2), dp)))
    bounds = present(error_bound) .or. present(stable) .or. present(unstable)
    allocate(eight(lanes, n, n))
    if (present(singly)) singly = 0
    do first = 1, size(phi, 1), lanes
      last = min(first + lanes - 1, size(phi, 1))
      do lane = 1, lanes
        eight(lane, :, :) = reshape(phi(min(first + lane - 1, last), :), [n, n])
      end do
      call spectra_of_eight(n, eight, last - first + 1, perturbation, bounds, found, alone)
      if (present(singly)) singly = singly + alone
      associate (filled => last - first + 1)
        radius(first:last) = found%radius(:filled)
        log_radius(first:last) = found%log_radius(:filled)
        if (present(error_bound)) error_bound(first:last) = found%bound(:filled)
        if (present(stable)) stable(first:last) = found%stable(:filled)
        if (present(unstable)) unstable(first:last) = found%unstable(:filled)
      end associate
    end do
  end subroutine spectral_radii

end module many_spectra
