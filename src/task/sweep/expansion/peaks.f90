!> Computes the peak displacements of the periodic vibration from the numbers that represent the motion, for eight machines at once.
module gestell_task_sweep_expansion_peaks
  use gestell_base_kinds, only: dp
  use gestell_math_lanes_equations, only: solve_equations
  use gestell_math_lanes_peaks, only: largest_values
  use gestell_math_lanes_products, only: combine
  use gestell_math_lanes, only: lanes
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  implicit none (type, external)
  private

  public :: peaks_of_motion

contains

  !> Computes the peak max |q(t)| of each position q in the periodic motion x(t) = Phi(t) x0 + x_p(t), in the units of the states.
  !> Phi(t) is the transition matrix, x_p the motion forced from rest, and x0 = (E - Phi(T))^-1 x_p(T) the initial state. Digits
  !> are lost near a resonance, where E - Phi(T) is nearly singular (E: unit matrix).
  subroutine peaks_of_motion(sampler, values, motion, filled, perturbation, limit, peaks, known)
    !> Describes how the motions are represented: units of the states, parts of the period, and times at which the vibration is
    !> evaluated
    type(sampler_type), intent(in) :: sampler
    !> `values`: weighted numbers that represent the motions, shape (lanes, numbers). `motion`: [Phi x_p] at the ends of the parts
    !> of the period, shape (lanes, states, columns, 0:parts)
    real(dp), contiguous, intent(in) :: values(:, :), motion(:, :, :, 0:)
    !> Number of machines, at most eight; the remaining vector lanes (first dimension of the arrays) are not used
    integer, intent(in) :: filled
    !> `perturbation`: bound on the error norm of the numbers. `limit`: allowed relative error of the initial state x0
    real(dp), intent(in) :: perturbation, limit
    !> Peaks, shape (lanes, states / 2); 0 where the initial state x0 is not accurate enough
    real(dp), intent(out) :: peaks(:, :)
    !> True for machines whose initial state x0 has a relative error below `limit`
    logical, intent(out) :: known(lanes)
    real(dp) :: q(lanes, sampler%times, sampler%parts%states / 2), harmonics(lanes, size(sampler%transform, 2)), &
      & x0(lanes, sampler%parts%states)
    integer :: i

    call start(sampler, motion, filled, perturbation, limit, x0, known)
    call move(sampler, values, motion, x0, q)
    do i = 1, size(q, 3)
      call combine(sampler%times, size(harmonics, 2), q(:, :, i), sampler%transform, harmonics)
      call largest_values(q(:, :, i), harmonics, peaks(:, i))
      peaks(:, i) = merge(peaks(:, i) * sampler%scale(i) * sampler%unit, 0.0_dp, known)
    end do
  end subroutine peaks_of_motion

  !> Computes the initial state x0 of the periodic motion in the unit of x_p, the motion forced from rest; shape (lanes, states).
  !> It is set to zero for machines that are not `known`.
  pure subroutine start(sampler, motion, filled, perturbation, limit, x0, known)
    type(sampler_type), intent(in) :: sampler
    real(dp), contiguous, intent(in) :: motion(:, :, :, 0:)
    integer, intent(in) :: filled
    real(dp), intent(in) :: perturbation, limit
    real(dp), intent(out) :: x0(:, :)
    logical, intent(out) :: known(lanes)
    real(dp) :: equations(lanes, size(x0, 2), size(x0, 2) + 1), inverse_norm(lanes), norm(lanes)
    integer :: lane, i

    associate (n => size(x0, 2))
      ! Sets up the equations (E - Phi) x0 = x_p.
      equations = motion(:, :, :, sampler%parts%parts)
      equations(:, :, :n) = -equations(:, :, :n)
      do i = 1, n
        equations(:, i, i) = equations(:, i, i) + 1
      end do
      call solve_equations(n, equations, x0, inverse_norm)
      norm = sqrt(sum(x0**2, dim=2))
      known = inverse_norm * perturbation * (norm + 1) < limit * norm .and. [(lane <= filled, lane = 1, lanes)]
      do i = 1, n
        x0(:, i) = merge(x0(:, i), 0.0_dp, known)
      end do
    end associate
  end subroutine start

  !> Computes the positions `q` at all times from the state at the beginning of each part, shape (lanes, times, states / 2).
  pure subroutine move(sampler, values, motion, x0, q)
    type(sampler_type), intent(in) :: sampler
    real(dp), contiguous, intent(in) :: values(:, :), motion(:, :, :, 0:), x0(:, :)
    real(dp), intent(out) :: q(:, :, :)
    real(dp) :: x(lanes, size(x0, 2) + 1), now(lanes, size(x0, 2) / 2)
    integer :: n, f, k, i, j, time, at

    n = size(x0, 2)
    f = n / 2
    associate (parts => sampler%parts)
      do k = 1, parts%parts
        x(:, :n) = motion(:, :, n + 1, k - 1)
        do j = 1, n
          do i = 1, n
            x(:, i) = x(:, i) + motion(:, i, j, k - 1) * x0(:, j)
          end do
        end do
        q(:, (k - 1) * (parts%between + 1) + 1, :) = x(:, :f)
        ! Remove the weights from the numbers that belong to times within the part.
        x(:, :n) = x(:, :n) / parts%of_times(k)
        x(:, n + 1) = 1 / parts%of_times(k)
        do time = 1, parts%between
          at = parts%times_at(k, time)
          call apply(n, values(:, at:), x, now)
          q(:, (k - 1) * (parts%between + 1) + 1 + time, :) = now
        end do
      end do
    end associate
  end subroutine move

  !> Computes the positions q = P x + p from the state x, for the machine in each vector lane. `rows`: [P p], shape (lanes, n + 1,
  !> n / 2). `x`: [x 1], shape (lanes, n + 1). `q`: positions, shape (lanes, n / 2).
  pure subroutine apply(n, rows, x, q)
    integer, intent(in) :: n
    real(dp), intent(in) :: rows(lanes, n + 1, n / 2), x(lanes, n + 1)
    real(dp), intent(out) :: q(lanes, n / 2)
    real(dp) :: s1, s2, s3
    integer :: lane, i, i2, i3, j

    ! Three rows are computed at a time. If fewer remain, the last row is computed repeatedly.
    do i = 1, n / 2, 3
      i2 = min(i + 1, n / 2)
      i3 = min(i + 2, n / 2)
      !GCC$ ivdep
      do lane = 1, lanes
        s1 = 0
        s2 = 0
        s3 = 0
        j = 1
        do
          s1 = s1 + rows(lane, j, i) * x(lane, j)
          s2 = s2 + rows(lane, j, i2) * x(lane, j)
          s3 = s3 + rows(lane, j, i3) * x(lane, j)
          j = j + 1
          if (j > n + 1) exit
        end do
        q(lane, i) = s1
        q(lane, i2) = s2
        q(lane, i3) = s3
      end do
    end do
  end subroutine apply

end module gestell_task_sweep_expansion_peaks
