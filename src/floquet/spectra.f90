!> Spectral radii of many small matrices, one by one with LAPACK.
module gestell_floquet_spectra
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_lapack, only: eigensystem
  use gestell_floquet_multipliers, only: multipliers_type, set_multipliers
  implicit none (type, external)
  private
  public :: spectral_radii
contains
  subroutine spectral_radii(phi, perturbation, radius, log_radius, bound, verdict)
    real(dp), intent(in) :: phi(:, :), perturbation
    real(dp), intent(out) :: radius(:), log_radius(:)
    real(dp), intent(out), optional :: bound(:), verdict(:)
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
    type(multipliers_type) :: m
    type(error_type), allocatable :: error
    integer :: n, k, i
    n = nint(sqrt(real(size(phi, 2))))
    do k = 1, size(phi, 1)
      call eigensystem(reshape(phi(k, :), [n, n]), rho, right, left, error)
      call set_multipliers(rho, right, left, perturbation, m)
      i = maxloc(m%log_abs, dim=1)
      radius(k) = abs(rho(i))
      log_radius(k) = m%log_abs(i)
      if (present(bound)) bound(k) = m%error(i)
      if (present(verdict)) then
        select case (m%verdict())
        case ("stable"); verdict(k) = 0
        case ("unstable"); verdict(k) = 1
        case default; verdict(k) = 2
        end select
      end if
    end do
  end subroutine spectral_radii
end module gestell_floquet_spectra
