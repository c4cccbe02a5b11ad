!> The greatest displacements of the periodic vibration of eight machines side by side, from the numbers of a sampler.
module gestell_task_sweep_expansion_peaks
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_fourier, only: greatest_between
  use gestell_math_lanes_products, only: combine, multiply
  use gestell_math_lanes, only: lanes
  use gestell_math_lapack, only: inverse
  use gestell_math_matrix, only: unit_matrix
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  implicit none (type, external)
  private

  public :: peaks_of_motion, peaks_of_numbers

contains

  !> As `peaks_of_motion`, of weighted numbers alone, shape (lanes, numbers).
  subroutine peaks_of_numbers(sampler, values, filled, perturbation, limit, peaks, known)
    type(sampler_type), intent(in) :: sampler
    real(dp), contiguous, intent(in) :: values(:, :)
    integer, intent(in) :: filled
    real(dp), intent(in) :: perturbation, limit
    real(dp), intent(out) :: peaks(:, :)
    logical, intent(out) :: known(lanes)
    real(dp) :: motion(lanes, sampler%parts%states, sampler%parts%columns(), 0:sampler%parts%parts)

    call sampler%parts%compose(values, motion)
    call peaks_of_motion(sampler, values, motion, filled, perturbation, limit, peaks, known)
  end subroutine peaks_of_numbers

  !> max |q(t)| of the periodic motion x(t) = Phi(t) x0 + x_p(t), x0 = (E - Phi(T))^-1 x_p(T), for each position, in the units
  !> of the states; shape (lanes, states / 2). `motion`: [Phi x_p] at the ends of the parts. The numbers' error is at most
  !> `perturbation` in norm. `known`: so x0 is wrong by less than `limit` of its size; else there are no peaks.
  !> Eight arguments: numbers, motion and what is found of the machines in the first `filled` lanes.
  subroutine peaks_of_motion(sampler, values, motion, filled, perturbation, limit, peaks, known)
    type(sampler_type), intent(in) :: sampler
    real(dp), contiguous, intent(in) :: values(:, :), motion(:, :, :, 0:)
    integer, intent(in) :: filled
    real(dp), intent(in) :: perturbation, limit
    real(dp), intent(out) :: peaks(:, :)
    logical, intent(out) :: known(lanes)
    real(dp) :: q(lanes, sampler%times, sampler%parts%states / 2)
    real(dp) :: harmonics(lanes, size(sampler%transform, 2))
    integer :: lane, i, orders

    peaks = 0
    call move(sampler, values, motion, start(sampler, motion, filled, perturbation, limit, known), q)
    orders = (sampler%times - 1) / 2
    do i = 1, size(q, 3)
      call combine(sampler%times, size(harmonics, 2), q(:, :, i), sampler%transform, harmonics)
      do lane = 1, filled
        if (known(lane)) peaks(lane, i) = greatest_between(q(lane, :, i), harmonics(lane, :orders), &
          & harmonics(lane, orders + 1:2 * orders)) * sampler%scale(i) * sampler%unit
      end do
    end do
  end subroutine peaks_of_motion

  !> x0 in the unit of x_p, shape (lanes, states).
  function start(sampler, motion, filled, perturbation, limit, known) result(x0)
    type(sampler_type), intent(in) :: sampler
    real(dp), contiguous, intent(in) :: motion(:, :, :, 0:)
    integer, intent(in) :: filled
    real(dp), intent(in) :: perturbation, limit
    logical, intent(out) :: known(lanes)
    real(dp) :: x0(lanes, sampler%parts%states)
    type(error_type), allocatable :: error
    real(dp), allocatable :: inverted(:, :)
    integer :: lane

    x0 = 0
    known = .false.
    associate (n => sampler%parts%states, end => sampler%parts%parts)
      do lane = 1, filled
        call inverse(unit_matrix(n) - motion(lane, :, :n, end), inverted, error)
        if (allocated(error)) cycle
        x0(lane, :) = matmul(inverted, motion(lane, :, n + 1, end))
        known(lane) = norm2(inverted) * perturbation * (norm2(x0(lane, :)) + 1) < limit * norm2(x0(lane, :))
      end do
    end associate
  end function start

  !> The positions at all times, shape (lanes, times, states / 2): from the state at the beginning of each part.
  pure subroutine move(sampler, values, motion, x0, q)
    type(sampler_type), intent(in) :: sampler
    real(dp), contiguous, intent(in) :: values(:, :), motion(:, :, :, 0:), x0(:, :)
    real(dp), intent(out) :: q(:, :, :)
    real(dp) :: x(lanes, size(x0, 2)), now(lanes, size(x0, 2) / 2)
    integer :: n, f, k, time, at

    n = size(x0, 2)
    f = n / 2
    associate (parts => sampler%parts)
      do k = 1, parts%parts
        call multiply(n, 1, 1.0_dp, motion(:, :, :n, k - 1), x0, x)
        x = x + motion(:, :, n + 1, k - 1)
        q(:, (k - 1) * (parts%between + 1) + 1, :) = x(:, :f)
        do time = 1, parts%between
          at = parts%times_at(k, time)
          call apply(n, values(:, at:), x, now)
          q(:, (k - 1) * (parts%between + 1) + 1 + time, :) = now / parts%of_times(k)
        end do
      end do
    end associate
  end subroutine move

  !> q = P x + p, for the columns of P, then p; shapes (lanes, n / 2, n + 1), (lanes, n), (lanes, n / 2).
  pure subroutine apply(n, map, x, q)
    integer, intent(in) :: n
    real(dp), intent(in) :: map(lanes, n / 2, n + 1), x(lanes, n)
    real(dp), intent(out) :: q(lanes, n / 2)
    real(dp) :: sum
    integer :: i, j, lane

    do i = 1, n / 2
      !GCC$ ivdep
      do lane = 1, lanes
        sum = map(lane, i, n + 1)
        j = 1
        do
          sum = sum + map(lane, i, j) * x(lane, j)
          j = j + 1
          if (j > n) exit
        end do
        q(lane, i) = sum
      end do
    end do
  end subroutine apply

end module gestell_task_sweep_expansion_peaks
