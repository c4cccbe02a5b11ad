!> Computes the largest multipliers of a very large number of small matrices, for stability charts.
module gestell_floquet_multipliers_spectra
  use gestell_base_error, only: error_type
  use gestell_math_batch_hessenberg, only: max_states
  use gestell_base_verdict, only: operator(==), stable, undamped, unstable
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_math_lapack, only: eigensystem
  use gestell_floquet_multipliers_lane_spectra, only: lane_spectra_type, solve_lanes
  use gestell_floquet_multipliers, only: multipliers_type, prove_undamped, set_multipliers
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: lane_spectra_type, is_undamped, spectra_of_eight

contains

  !> Computes the modulus of the largest multiplier and its logarithm for eight matrices at once. With `bounds` it also computes
  !> the bound on the relative error of this multiplier and the verdict on stability, both as defined by
  !> gestell_floquet_multipliers. A matrix that is not finite gives NaN, the bound 1e300 and no verdict.
  !>
  !> Matrices with more than `max_states` rows, and doubtful matrices, are solved one by one with LAPACK. A matrix is doubtful if
  !> its elements are extremely large or small, its eigenvalues do not converge, its discs touch or its eigenvectors are
  !> inaccurate. Without `bounds` it is also doubtful if roundoff exceeds both 1e-10 and the effect of `perturbation`. The
  !> results for a matrix do not depend on the other matrices.
  subroutine spectra_of_eight(n, phi, filled, perturbation, bounds, results, alone)
    !> `n`: number of rows of each matrix. `filled`: number of lanes that hold a matrix to be solved.
    integer, intent(in) :: n, filled
    !> `phi`: the matrices, in units that make the states comparable. `perturbation`: bound on the norms of their errors, without
    !> the roundoff in the eigenvalues.
    real(dp), intent(in) :: phi(lanes, n, n), perturbation
    !> If true, compute error bounds and verdicts
    logical, intent(in) :: bounds
    type(lane_spectra_type), intent(out) :: results
    !> Number of matrices that LAPACK solved one by one
    integer, intent(out) :: alone
    real(dp) :: a(lanes, max_states, max_states)
    integer :: lane

    alone = 0
    results%sound = 0
    if (n <= max_states) then
      a(:, :n, :n) = phi
      call solve_lanes(a, n, perturbation, bounds, results)
    end if
    do lane = 1, filled
      if (results%sound(lane) > 0) cycle
      alone = alone + 1
      call solve_alone(phi(lane, :, :), perturbation, results, lane)
    end do
  end subroutine spectra_of_eight

  !> Solves the matrix of one lane with LAPACK.
  subroutine solve_alone(phi, perturbation, results, lane)
    real(dp), intent(in) :: phi(:, :), perturbation
    type(lane_spectra_type), intent(inout) :: results
    integer, intent(in) :: lane
    type(multipliers_type), allocatable :: multipliers
    integer :: k

    results%radius(lane) = ieee_value(1.0_dp, ieee_quiet_nan)
    results%log_radius(lane) = results%radius(lane)
    results%bound(lane) = 1.0e300_dp
    results%stable(lane) = .false.
    results%unstable(lane) = .false.
    call find_multipliers(phi, perturbation, multipliers)
    if (.not. allocated(multipliers)) return
    k = maxloc(abs(multipliers%rho), dim=1)
    results%radius(lane) = abs(multipliers%rho(k))
    results%log_radius(lane) = multipliers%log_abs(k)
    results%bound(lane) = multipliers%error(k)
    results%stable(lane) = multipliers%judge() == stable
    results%unstable(lane) = multipliers%judge() == unstable
  end subroutine solve_alone

  !> True if the verdict on a matrix is 'undamped'. The matrix must belong to a conservative system (gestell_system_periodic).
  logical function is_undamped(phi, perturbation)
    real(dp), intent(in) :: phi(:, :), perturbation
    type(multipliers_type), allocatable :: multipliers

    is_undamped = .false.
    call find_multipliers(phi, perturbation, multipliers)
    if (.not. allocated(multipliers)) return
    call prove_undamped(multipliers)
    is_undamped = multipliers%judge() == undamped
  end function is_undamped

  !> Computes the multipliers with LAPACK. `multipliers` is unallocated if the matrix is not finite or LAPACK fails.
  subroutine find_multipliers(phi, perturbation, multipliers)
    real(dp), intent(in) :: phi(:, :), perturbation
    type(multipliers_type), allocatable, intent(out) :: multipliers
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
    type(error_type), allocatable :: error

    if (.not. all(ieee_is_finite(phi))) return
    call eigensystem(phi, rho, right, left, error)
    if (allocated(error)) return
    allocate(multipliers)
    call set_multipliers(rho, right, left, perturbation + size(rho) * epsilon(1.0_dp) * norm2(phi), multipliers)
  end subroutine find_multipliers

end module gestell_floquet_multipliers_spectra
