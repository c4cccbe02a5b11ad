!> A first look at a system over its period.
module gestell_floquet_period_survey
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: balancing
  use gestell_math_matrix, only: balanced
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: sample_by_phase
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: survey

  !> What `survey` finds.
  type, public :: survey_type
    !> Units that balance the states, from the size of P over the period; shape (n).
    real(dp), allocatable :: scale(:)
    !> How far the fastest motion turns within the period, w_max T in radians: at most |P| T / sqrt 2, as w comes with -w.
    real(dp) :: phase_advance = 0
    !> (|P^16| / sqrt 2)^(1/16) T where P is greatest, in which of several fast motions little but the fastest counts.
    real(dp) :: fastest = 0
  end type survey_type

contains

  !> Error: the coefficients are not finite, or the mass matrix is singular.
  subroutine survey(system, seen, error)
    class(periodic_system), intent(in) :: system
    type(survey_type), intent(out) :: seen
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 16
    real(dp), allocatable :: p(:, :, :)
    real(dp), dimension(system%states, system%states) :: greatest, power
    real(dp) :: sums(points), squares(points), inverse(system%states), size_of_p, unit, part
    integer :: n, i, j, k

    n = system%states
    allocate(p(points, n, n))
    call sample_by_phase(system, [((k - 0.5_dp) / points, k = 1, points)], p)
    ! A number that is none stays in the sums; these have room for all.
    part = 1.0_dp / n**2
    sums = 0
    do j = 1, n
      do i = 1, n
        sums = sums + part * abs(p(:, i, j))
      end do
    end do
    if (.not. all(ieee_is_finite(sums))) then
      call fatal_error(error, "the coefficients of the system are not finite, or its mass matrix is singular", &
        & failed_computation)
      return
    end if
    do j = 1, n
      do i = 1, n
        greatest(i, j) = greatest_of(p(:, i, j))
      end do
    end do
    seen%scale = balancing(greatest)
    ! In a unit of which no element has more than one, no square overflows, and none vanishes that counts.
    unit = max(maxval(balanced(greatest, seen%scale)), tiny(unit))
    inverse = 1 / seen%scale / unit
    squares = 0
    do j = 1, n
      do i = 1, n
        squares = squares + (p(:, i, j) * seen%scale(j) * inverse(i))**2
      end do
    end do
    k = maxloc(squares, dim=1)
    size_of_p = sqrt(squares(k) / 2) * unit
    seen%phase_advance = size_of_p * system%period
    unit = max(size_of_p, tiny(unit))
    power = balanced(p(k, :, :), seen%scale) / unit
    do i = 1, 4
      power = matmul(power, power)
    end do
    seen%fastest = min(seen%phase_advance, (norm2(power) / sqrt(2.0_dp))**0.0625_dp * unit * system%period)
  end subroutine survey

  !> The greatest size of finite values; in vectors, as maxval is not, which minds NaN.
  pure real(dp) function greatest_of(values) result(greatest)
    real(dp), contiguous, intent(in) :: values(:)
    integer :: k

    greatest = 0
    do k = 1, size(values)
      greatest = max(greatest, abs(values(k)))
    end do
  end function greatest_of

end module gestell_floquet_period_survey
