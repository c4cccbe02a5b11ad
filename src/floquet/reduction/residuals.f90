!> Measures the residuals of a reduction midway between the phases at which the groups were decoupled. The residuals bound the error
!> of the reduction.
module gestell_floquet_reduction_residuals
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_reduction_conjugates, only: weights
  use gestell_floquet_reduction_decoupling, only: motion_type, transform, uncoupled_sizes
  use gestell_floquet_reduction_fast_response, only: fast_sizes
  use gestell_floquet_reduction_modes, only: modes_type
  use gestell_floquet_reduction_phasewise, only: along_phases, multiply, times
  use gestell_floquet_reduction_trigonometric, only: middle_differentiation, middle_interpolation
  implicit none (type, external)
  private

  public :: measure, measure_forcing

  !> Residuals of a reduction, with the phase t / T as the independent variable.
  type, public :: residuals_type
    !> `residual`: mean over the phases of the sum of two maximum row sums, one at the phase and one at the following midpoint;
    !> rounding errors of D are added. A row sum contains the elements of D between groups. At midpoints it also contains, within
    !> groups, the difference between D and its interpolation, in which errors that are equal at all phases cancel.
    !>
    !> `forcing_residual`: mean of the corresponding maxima for g, without rounding. They contain |g| outside the slow group and,
    !> at midpoints, the difference between g and its interpolation in the slow group.
    real(dp) :: residual = 0, forcing_residual = 0
    !> Maxima over the phases of the quantities whose means are `residual` and `forcing_residual`.
    real(dp) :: residual_peak = 0, forcing_peak = 0
    !> `slow_residual`: difference between g and its interpolation in the slow group, averaged over the midpoints. `slow_effort`:
    !> maximum of |g| in the slow group.
    real(dp) :: slow_residual = 0, slow_effort = 0
    !> `condition`: maximum of |S| |S^-1| over the phases. `effort`: maximum size of the terms that add up to g.
    real(dp) :: condition = 1, effort = 0
  end type residuals_type

contains

  !> Measures the residuals of D. Also returns D and S^-1 midway between the phases.
  subroutine measure(a, s, d, modes, start, start_inverse, residuals, between, error)
    !> `a`: coefficients A midway between the phases. `s`, `d`: matrices S and D at the phases. All have the shape (phases, n, n)
    !> and refer to coordinates whose basis is the columns of `start`, shape (n, n). `start_inverse`: inverse of `start`.
    real(dp), contiguous, intent(in) :: a(:, :, :), s(:, :, :), d(:, :, :), start(:, :), start_inverse(:, :)
    type(modes_type), intent(in) :: modes
    type(residuals_type), intent(out) :: residuals
    !> Matrices D and S^-1 of the decoupled equations, midway between the phases
    type(motion_type), intent(out) :: between
    type(error_type), allocatable, intent(out) :: error
    real(dp), dimension(size(s, 1), size(s, 1)) :: operator
    real(dp), dimension(size(s, 1), size(s, 2), size(s, 3)) :: middle, slope, interpolated
    real(dp) :: sizes(size(s, 1)), rounding

    operator = middle_differentiation(size(s, 1))
    call along_phases(operator, s, slope)
    operator = middle_interpolation(size(s, 1))
    call along_phases(operator, s, middle)
    call along_phases(operator, d, interpolated)
    call transform(a, middle, slope, between, error)
    if (allocated(error)) return
    residuals%condition = max(1.0_dp, condition(middle, between%inverted, modes, start, start_inverse))
    sizes = uncoupled_sizes(d, modes) + uncoupled_sizes(between%d, modes, between%d - interpolated)
    rounding = size(d, 2) * epsilon(1.0_dp) * maxval(abs(d))
    residuals%residual = mean(sizes) + rounding
    residuals%residual_peak = maxval(sizes) + rounding
  end subroutine measure

  !> Measures the residuals of the response p and the remainder g.
  subroutine measure_forcing(a, f, p, g, between, modes, start, size_a, residuals)
    !> `a`, shape (phases, n, n), and `f`, shape (phases, n): coefficients A and loads T f midway between the phases. `p`, `g`,
    !> shapes (phases, n): response and remainder at the phases. The basis of all coordinates is the columns of `start`.
    real(dp), contiguous, intent(in) :: a(:, :, :), f(:, :), p(:, :), g(:, :), start(:, :)
    !> Matrices D and S^-1 of the decoupled equations, midway between the phases
    type(motion_type), intent(in) :: between
    type(modes_type), intent(in) :: modes
    !> Maximum of |A|
    real(dp), intent(in) :: size_a
    type(residuals_type), intent(inout) :: residuals
    real(dp), dimension(size(p, 1), size(p, 1)) :: operator
    real(dp), dimension(size(p, 1), size(p, 2)) :: middle, slope, rate, fast_rate, slow
    real(dp), dimension(size(p, 1)) :: unlike
    integer :: k

    operator = middle_differentiation(size(p, 1))
    call times(operator, p, slope)
    operator = middle_interpolation(size(p, 1))
    call times(operator, p, middle)
    call times(operator, g, slow)
    call multiply(a, middle, rate)
    rate = rate + f - slope
    call multiply(between%inverted, rate, fast_rate)
    unlike = 0
    do k = 1, size(g, 2)
      if (modes%group(k) /= 0) cycle
      unlike = max(unlike, abs(fast_rate(:, k) - slow(:, k)))
      residuals%slow_effort = max(residuals%slow_effort, maxval(abs(slow(:, k))))
    end do
    residuals%slow_residual = mean(unlike)
    unlike = fast_sizes(g, modes) + max(unlike, fast_sizes(fast_rate, modes))
    residuals%forcing_residual = mean(unlike)
    residuals%forcing_peak = maxval(unlike)
    call multiply(start, middle, rate)
    call multiply(start, f, slope)
    residuals%effort = maxval(norm2(slope, dim=2) + size_a * norm2(rate, dim=2))
  end subroutine measure_forcing

  !> Condition number of S: maximum over the phases of |S| |S^-1|, in the Frobenius norm.
  pure real(dp) function condition(s, inverted, modes, start, start_inverse)
    real(dp), contiguous, intent(in) :: s(:, :, :), inverted(:, :, :), start(:, :), start_inverse(:, :)
    type(modes_type), intent(in) :: modes
    real(dp), dimension(size(s, 1), size(s, 2), size(s, 3)) :: full
    real(dp), dimension(size(s, 1)) :: squares, inverse_squares
    real(dp) :: weight(size(s, 2))
    integer :: i, k

    weight = weights(modes%conjugate)
    squares = 0
    inverse_squares = 0
    call multiply(start, s, full)
    do k = 1, size(s, 3)
      do i = 1, size(s, 2)
        squares = squares + weight(k) * full(:, i, k)**2
      end do
    end do
    call multiply(inverted, start_inverse, full)
    do k = 1, size(s, 3)
      do i = 1, size(s, 2)
        inverse_squares = inverse_squares + full(:, i, k)**2 / weight(i)
      end do
    end do
    condition = sqrt(maxval(squares * inverse_squares))
  end function condition

  !> Arithmetic mean of `values`.
  pure real(dp) function mean(values)
    real(dp), intent(in) :: values(:)

    mean = sum(values) / size(values)
  end function mean

end module gestell_floquet_reduction_residuals
