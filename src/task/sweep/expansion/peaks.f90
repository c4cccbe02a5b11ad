!> The greatest displacements of the periodic vibration, from the numbers of a sampler.
module gestell_task_sweep_expansion_peaks
  use gestell_base_error, only: error_type
  use gestell_math_fourier, only: greatest
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: inverse
  use gestell_math_matrix, only: unit_matrix
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  implicit none (type, external)
  private

  public :: peaks_of_numbers

contains

  !> max |q(t)| of the periodic motion x(t) = Phi(t) x0 + x_p(t), x0 = (E - Phi(T))^-1 x_p(T), for each position, in the units
  !> of the states; shape (states / 2). The numbers' error is at most `perturbation` in norm. `known`: so x0 is wrong by
  !> less than `limit` of its size; else there are no peaks.
  subroutine peaks_of_numbers(sampler, numbers, perturbation, limit, peaks, known)
    type(sampler_type), intent(in) :: sampler
    real(dp), intent(in) :: numbers(:), perturbation, limit
    real(dp), intent(out) :: peaks(:)
    logical, intent(out) :: known
    type(error_type), allocatable :: error
    real(dp), allocatable :: inverted(:, :)
    real(dp) :: phi(sampler%states, sampler%states), x0(sampler%states), q(sampler%times, sampler%states / 2)
    integer :: n, f, k, i, at

    n = sampler%states
    f = n / 2
    peaks = 0
    phi = reshape(numbers(:n**2), [n, n])
    call inverse(unit_matrix(n) - phi, inverted, error)
    known = .not. allocated(error)
    if (.not. known) return
    ! In the unit of x_p.
    x0 = matmul(inverted, numbers(n**2 + 1:n**2 + n))
    known = norm2(inverted) * perturbation * (norm2(x0) + 1) < limit * norm2(x0)
    if (.not. known) return

    q(1, :) = x0(:f)
    at = n**2 + n
    do k = 2, sampler%times
      q(k, :) = numbers(at + f * n + 1:at + f * (n + 1))
      do i = 1, n
        q(k, :) = q(k, :) + numbers(at + f * (i - 1) + 1:at + f * i) * x0(i)
      end do
      q(k, :) = sqrt(real(sampler%times, dp)) * q(k, :)
      at = at + f * (n + 1)
    end do
    do i = 1, f
      peaks(i) = greatest(q(:, i)) * sampler%scale(i) * sampler%unit
    end do
  end subroutine peaks_of_numbers

end module gestell_task_sweep_expansion_peaks
