!> Bounds the error of a periodic motion over the whole period by comparison with a second solution whose steps are half as long.
!>
!> The motion x is computed in segments; segment k starts from its own state x_k. From the same starts, steps half as long give
!> the motion y(t) = x(t) + l(t) with the local error l(t). At the end of segment k the motion y differs from the next start by
!> the defect d_k. With the maps A_k of the segments, the periodic motion with the shorter steps is
!>
!>     x^(t) = y(t) + Phi(t, t_k) z_k,   z_{k+1} = A_k z_k + d_k,   z_{K+1} = z_1,
!>
!> where z_k is the correction of the start x_k. So local errors are measured where they arise, with their signs, even if they
!> die out quickly. For a method of order p, x^ still has an error of about 2^-p (x^ - x). Periodicity makes the error smaller
!> with equal steps than with unequal steps. Therefore all steps between equidistant phases are equal. The starts were computed
!> with longer steps; the defects are computed with steps half as long.
!>
!> A motion computed from the same starts with more steps and phases has the same errors due to the starts and smaller local
!> errors. Its error is between two limits: the error of x, and the error of a motion without local errors. Bounds are therefore
!> computed for both limits.
module gestell_floquet_period_turn_errors
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: inverse
  use gestell_math_matrix, only: balanced, unit_matrix
  use gestell_floquet_period_convergence, only: safety
  use gestell_floquet_period_period_map, only: block_length, end_of_block
  use gestell_floquet_integrator_mesh, only: merged, refined
  use gestell_floquet_integrator_method, only: method_type
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: solve_corrections, compare, relative_rounding, rounding_errors, compute_differences

  !> Errors of n quantities over the period. At each phase the error of a quantity is the sum of two parts: the rounding error, and
  !> a factor between -1 and 1 times the difference between the computed motion and a motion computed with shorter steps.
  type, public :: turn_errors_type
    !> `differences`: differences times the safety factor, shape (n, 2 * phases). The first half belongs to the motion that was
    !> compared, the second half to a motion with much shorter steps. `rounding`: bound on the rounding error at any time, shape
    !> (n).
    real(dp), allocatable :: differences(:, :), rounding(:)
  contains
    procedure :: bounds, along
  end type turn_errors_type

  !> Comparison of a motion of K segments with the motion computed in steps half as long
  type, public :: comparison_type
    !> `local`: differences l(t) between the two motions, shape (n, phases). `transition`: matrices Phi(t, t_k) from the start
    !> t_k of the segment to the phase, shape (n, n, phases). `map`: matrices A_k over each segment, shape (n, n, K). `defect`:
    !> differences d_k between the end of each segment and the next start, shape (n, K). `size`: largest |x| in balanced units
    !> within each segment, shape (K).
    real(dp), allocatable :: local(:, :), transition(:, :, :), map(:, :, :), defect(:, :), size(:)
    !> For each phase, the number of the segment to which it belongs, shape (phases)
    integer, allocatable :: segment(:)
    !> Number of steps of the motion whose error is bounded
    integer :: steps = 0
  end type comparison_type

contains

  !> Bound on the error of a weighted sum of quantities, valid at all times. `weights`: weights of the first quantities; those of
  !> the others are zero.
  pure real(dp) function along(self, weights)
    class(turn_errors_type), intent(in) :: self
    real(dp), intent(in) :: weights(:)
    real(dp) :: differences(size(self%differences, 2))
    integer :: i, n

    n = size(weights)
    along = dot_product(abs(weights), self%rounding(:n))
    ! Most weights are zero.
    differences = 0
    do i = 1, n
      if (abs(weights(i)) > 0) differences = differences + weights(i) * self%differences(i, :)
    end do
    if (size(differences) > 0) along = along + maxval(abs(differences))
  end function along

  !> Bounds on the error of each quantity, valid at all times; shape (n).
  pure function bounds(self)
    class(turn_errors_type), intent(in) :: self
    real(dp) :: bounds(size(self%rounding))

    bounds = self%rounding
    if (size(self%differences, 2) > 0) bounds = bounds + maxval(abs(self%differences), dim=2)
  end function bounds

  !> Compares a motion with a second motion that has the same starts and steps half as long. Fails if a number overflows.
  subroutine compare(system, method, nodes, scale, ends, starts, phases, x, comparison, error)
    class(periodic_system), intent(in) :: system
    class(method_type), intent(in) :: method
    !> `nodes`: ends of the steps. `scale`: units of the states, shape (n). `ends`: ends of the segments, shape (0:K). `starts`:
    !> states at the starts of the segments, shape (n, K). `phases`: ascending phases, of which the last is 1. `x`: the motion at
    !> the phases, shape (n, phases).
    real(dp), intent(in) :: nodes(:), scale(:), ends(0:), starts(:, :), phases(:), x(:, :)
    !> Comparison with the motion whose steps are half as long
    type(comparison_type), intent(out) :: comparison
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: maps(:, :, :), half(:)
    real(dp) :: now(size(x, 1), size(x, 1) + 1)
    integer :: n, count, k, first, last, next, segment

    n = size(x, 1)
    count = size(starts, 2)
    half = refined(system, nodes, merged(phases, ends))
    comparison%steps = size(half) - 1
    half = merged(half, (half(:size(half) - 1) + half(2:)) / 2)
    allocate(comparison%local(n, size(phases)), comparison%transition(n, n, size(phases)), comparison%map(n, n, count))
    allocate(comparison%defect(n, count), comparison%size(count), source=0.0_dp)
    allocate(comparison%segment(size(phases)))
    allocate(maps(block_length, n, n + 1))
    segment = 0
    next = 1
    call start_segment()
    call keep(half(1))
    last = 0
    do while (last < size(half) - 1)
      first = last + 1
      last = end_of_block(first, size(half) - 1)
      associate (from => half(first:last), to => half(first + 1:last + 1))
        call method%maps(system, from, to, maps, error)
        if (allocated(error)) return
        do k = 1, size(from)
          now = matmul(maps(k, :, :n), now)
          now(:, n + 1) = now(:, n + 1) + maps(k, :, n + 1)
          comparison%size(segment) = max(comparison%size(segment), norm2(now(:, n + 1) / scale))
          if (to(k) >= ends(segment)) then
            comparison%map(:, :, segment) = now(:, :n)
            comparison%defect(:, segment) = now(:, n + 1) - starts(:, modulo(segment, count) + 1)
            if (segment < count) call start_segment()
          end if
          call keep(to(k))
        end do
      end associate
    end do
    if (all(ieee_is_finite(comparison%local)) .and. all(ieee_is_finite(comparison%transition))) return
    call fatal_error(error, "the motion overflows double precision", failed_computation)

  contains

    subroutine start_segment()
      segment = segment + 1
      now(:, :n) = unit_matrix(n)
      now(:, n + 1) = starts(:, segment)
      comparison%size(segment) = norm2(starts(:, segment) / scale)
    end subroutine start_segment

    subroutine keep(phase)
      real(dp), intent(in) :: phase

      do while (next <= size(phases))
        if (phases(next) > phase) return
        comparison%local(:, next) = now(:, n + 1) - x(:, next)
        comparison%transition(:, :, next) = now(:, :n)
        comparison%segment(next) = segment
        next = next + 1
      end do
    end subroutine keep

  end subroutine compare

  !> Computes `z`, the corrections at the starts of K segments, and `due`, the part of these corrections that the correction z_1
  !> at the start of the period causes. z_1 follows from (E - Phi) z_1 = defect of the whole period. Fails if E - Phi is
  !> singular.
  subroutine solve_corrections(turn, comparison, scale, z, due, inverted, error)
    !> `turn`: comparison over the whole period as a single segment. `comparison`: comparison over the K segments.
    type(comparison_type), intent(in) :: turn, comparison
    !> Units of the states, shape (n)
    real(dp), intent(in) :: scale(:)
    !> `z`: corrections at the starts of the segments, shape (n, K). `due`: part of `z` caused by z_1, shape (n, K).
    real(dp), intent(out) :: z(:, :), due(:, :)
    !> (E - Phi)^-1 in balanced units
    real(dp), allocatable, intent(out) :: inverted(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: k

    call inverse(unit_matrix(size(scale)) - balanced(turn%map(:, :, 1), scale), inverted, error)
    if (allocated(error)) return
    z(:, 1) = matmul(inverted, turn%defect(:, 1) / scale) * scale
    due(:, 1) = z(:, 1)
    do k = 1, size(z, 2) - 1
      z(:, k + 1) = matmul(comparison%map(:, :, k), z(:, k)) + comparison%defect(:, k)
      due(:, k + 1) = matmul(comparison%map(:, :, k), due(:, k))
    end do
  end subroutine solve_corrections

  !> Computes the errors over the period: the differences, times the safety factor, and the effect of rounding.
  pure subroutine compute_differences(comparison, scale, z, due, at_starts, own, errors)
    !> Comparison over the K segments
    type(comparison_type), intent(in) :: comparison
    !> `scale`: units of the states, shape (n). `z`, `due`: corrections at the starts of the segments, and the part of these
    !> corrections caused by z_1, shapes (n, K). `at_starts`, `own`: rounding errors at the starts, shape (n, K), and within each
    !> segment, shape (K), in balanced units.
    real(dp), intent(in) :: scale(:), z(:, :), due(:, :), at_starts(:, :), own(:)
    !> Differences and rounding over the period
    type(turn_errors_type), intent(out) :: errors
    integer :: phases, k

    phases = size(comparison%segment)
    allocate(errors%differences(size(scale), 2 * phases))
    allocate(errors%rounding(size(scale)), source=0.0_dp)
    do k = 1, phases
      associate (segment => comparison%segment(k))
        errors%differences(:, k) = safety * (comparison%local(:, k) + matmul(comparison%transition(:, :, k), z(:, segment)))
        errors%differences(:, phases + k) = safety * matmul(comparison%transition(:, :, k), due(:, segment))
        errors%rounding = max(errors%rounding, matmul(abs(comparison%transition(:, :, k)), &
          & (at_starts(:, segment) + own(segment)) * scale))
      end associate
    end do
  end subroutine compute_differences

  !> Rounding error over a period, relative to the motion. It has three parts: the rounding errors of all steps, which have the same
  !> sign if the coefficients are nearly constant; the phase error of the fastest motion; and the rounding errors of the model.
  pure real(dp) function relative_rounding(system, steps, phase_advance) result(rounding)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: steps
    real(dp), intent(in) :: phase_advance

    rounding = epsilon(1.0_dp) * (system%states * steps + 2 * phase_advance) + system%rounding
  end function relative_rounding

  !> Errors at the starts t_i of K segments, shape (n, K), caused by disturbances within the segments, in balanced units. Each
  !> disturbance affects the state at t_i through the Green's function of the periodic motion,
  !>
  !>     G(t_i, t_j) = Phi(t_i, t_j) [t_i > t_j] + Phi(t_i, 0) (E - Phi(T))^-1 Phi(T, t_j).
  pure function rounding_errors(a, inverted, own) result(at_starts)
    !> `a`: maps over the segments, shape (n, n, K). `inverted`: (E - Phi)^-1. `own`: bounds on the norms of the disturbances at the
    !> ends of the segments, each accumulated within its segment, shape (K). All in balanced units.
    real(dp), intent(in) :: a(:, :, :), inverted(:, :), own(:)
    real(dp) :: at_starts(size(a, 1), size(own))
    real(dp), dimension(size(a, 1), size(a, 1), size(own)) :: to_start, to_end
    real(dp), dimension(size(a, 1), size(a, 1)) :: green, direct
    integer :: n, count, i, j

    n = size(a, 1)
    count = size(own)
    ! Phi(t_i, 0) (E - Phi)^-1, and Phi(T, t_{j+1})
    to_start(:, :, 1) = inverted
    to_end(:, :, count) = unit_matrix(n)
    do i = 2, count
      to_start(:, :, i) = matmul(a(:, :, i - 1), to_start(:, :, i - 1))
      to_end(:, :, count + 1 - i) = matmul(to_end(:, :, count + 2 - i), a(:, :, count + 2 - i))
    end do
    at_starts = 0
    do j = 1, count
      direct = unit_matrix(n)
      do i = 1, count
        green = matmul(to_start(:, :, i), to_end(:, :, j))
        if (i > j) green = green + direct
        if (i > j) direct = matmul(a(:, :, i), direct)
        at_starts(:, i) = at_starts(:, i) + norm2(green, dim=2) * own(j)
      end do
    end do
  end function rounding_errors

end module gestell_floquet_period_turn_errors
