!> A first look at a system over its period.
module gestell_floquet_period_survey
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: balancing
  use gestell_math_matrix, only: balanced
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: survey

  !> What `survey` finds.
  type, public :: survey_type
    real(dp), allocatable :: scale(:)
    real(dp) :: phase_advance = 0, fastest = 0
  end type survey_type

contains

  !> The units that balance the states, from the size of P over the period, and how far the fastest motion turns
  !> within the period, w_max T in radians: at most |P| T / sqrt 2, as w comes with -w. `fastest`: (|P^8| / sqrt 2)^(1/8) T where P
  !> is greatest, in which of several fast motions little but the fastest counts.
  subroutine survey(system, scale, phase_advance, error, fastest)
    class(periodic_system), intent(in) :: system
    real(dp), allocatable, intent(out) :: scale(:)
    real(dp), intent(out) :: phase_advance
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(out), optional :: fastest
    integer, parameter :: points = 16
    real(dp), parameter :: root = sqrt(2.0_dp)
    real(dp), allocatable :: p(:, :, :)
    real(dp) :: size_of(points), power(system%states, system%states), unit
    integer :: k, i

    allocate(p(system%states, system%states, points))
    call system%sample([((k - 0.5_dp) / points, k = 1, points)], p)
    phase_advance = 0
    if (present(fastest)) fastest = 0
    if (.not. all(ieee_is_finite(p))) then
      call fatal_error(error, "the coefficients of the system are not finite, or its mass matrix is singular", &
        & failed_computation)
      return
    end if
    scale = balancing(maxval(abs(p), dim=3))
    do k = 1, points
      p(:, :, k) = balanced(p(:, :, k), scale)
      size_of(k) = norm2(p(:, :, k)) / root
    end do
    k = maxloc(size_of, dim=1)
    phase_advance = size_of(k) * system%period
    if (.not. present(fastest)) return
    unit = max(size_of(k), tiny(unit))
    power = p(:, :, k) / unit
    do i = 1, 3
      power = matmul(power, power)
    end do
    fastest = min(phase_advance, (norm2(power) / root)**0.125_dp * unit * system%period)
  end subroutine survey

end module gestell_floquet_period_survey
