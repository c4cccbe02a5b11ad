!> The periodic vibration over the whole turn: the truth in quadruple precision, and how much of its bounds the library uses.
module population_turn
  use gestell_base_kinds, only: dp
  use population_library, only: claim_type, orders, turn_points, turn_rows
  use reference_frame, only: frame_matrices, frame_system
  use reference_linear, only: qp, solve
  use reference_machine, only: pi_qp
  implicit none (type, external)
  private

  public :: compare_turn, quantities_of

  !> The largest part of its bound that the error of a row, a peak, a root of the mean square or an amplitude uses; for each row
  !> that does not rest the largest error and the bound, relative to its peak.
  type, public :: turn_comparison_type
    real(dp) :: rows = 0, peaks = 0, rms = 0, harmonics = 0
    real(dp), allocatable :: error(:), bound(:)
  end type turn_comparison_type

contains

  !> xi, eta, psi, their velocities, forces and moment on the ground, accelerations, shape (turn_rows, turn_points), from the free
  !> states at the times k T / turn_points.
  function quantities_of(frame, period, states) result(all)
    type(frame_system), intent(in) :: frame
    real(qp), intent(in) :: period, states(:, :)
    real(qp) :: all(turn_rows, size(states, 2))
    real(qp), dimension(frame%n / 2, frame%n / 2) :: m, b, c
    real(qp) :: h(frame%n / 2)
    integer :: f, k

    f = frame%n / 2
    all = 0
    do k = 1, size(states, 2)
      associate (q => states(:f, k), v => states(f + 1:, k))
        all(frame%free, k) = q
        all(3 + frame%free, k) = v
        all(7:9, k) = matmul(frame%stiffness(:, frame%free), q) + matmul(frame%damping(:, frame%free), v)
        call frame_matrices(frame, period * k / size(states, 2), m, b, c, h)
        all(9 + frame%free, k) = solve(m, h - matmul(b, v) - matmul(c, q))
      end associate
    end do
  end function quantities_of

  !> Compares a claim with the truth, shape (turn_rows, turn_points).
  function compare_turn(claim, truth) result(found)
    type(claim_type), intent(in) :: claim
    real(qp), intent(in) :: truth(:, :)
    type(turn_comparison_type) :: found
    integer, parameter :: third = (turn_points - mod(turn_points, 3)) / 3
    complex(dp) :: c(0:turn_points / 2 - 1)
    real(dp) :: error, peak, unknown, samples(turn_points)
    integer :: i, k

    allocate(found%error(0), found%bound(0))
    do i = 1, turn_rows
      samples = real(truth(i, :), dp)
      if (.not. maxval(abs(samples)) > 0) cycle
      error = real(maxval(abs(truth(i, :) - claim%turn(i, :))), dp)
      found%rows = max(found%rows, used(error, claim%turn_error(i)))
      found%error = [found%error, error / maxval(abs(samples))]
      found%bound = [found%bound, claim%turn_error(i) / maxval(abs(samples))]
      if (i > size(claim%peak)) cycle
      call transform(samples, c)
      ! Error of this many samples, and rounding errors of this check.
      unknown = 4 * sum(abs(c(third:))) + 4.0e-15_dp * maxval(abs(samples))
      ! A peak is no smaller than any true value.
      peak = maxval(abs(samples))
      found%peaks = max(found%peaks, used(peak - claim%peak(i), claim%peak_error(i)))
      peak = maximum(c)
      found%peaks = max(found%peaks, used(abs(claim%peak(i) - peak) - unknown, claim%peak_error(i)))
      found%rms = max(found%rms, used(abs(claim%rms(i) - sqrt(sum(samples**2) / turn_points)) - unknown, claim%turn_error(i)))
      do k = 1, orders
        ! An error e at every time has harmonics of at most sqrt(2) e, by Parseval's theorem.
        found%harmonics = max(found%harmonics, used(abs(claim%amplitude(k, i) - 2 * abs(c(k))) - unknown, &
          & sqrt(2.0_dp) * claim%turn_error(i)))
      end do
    end do
  end function compare_turn

  elemental real(dp) function used(error, bound)
    real(dp), intent(in) :: error, bound
    real(dp), parameter :: hopeless = 1.0e30_dp

    used = 0
    if (error / hopeless > bound) then
      used = hopeless
    else if (error > 0) then
      used = error / bound
    end if
  end function used

  !> f(k / N) = sum of c_j exp(2 pi i j k / N), k = 1 ... N, over -N / 2 < j < N / 2.
  pure subroutine transform(samples, c)
    real(dp), intent(in) :: samples(:)
    complex(dp), intent(out) :: c(0:)
    integer :: j, k

    do j = 0, size(c) - 1
      c(j) = 0
      do k = 1, size(samples)
        c(j) = c(j) + samples(k) * turned(j * k, size(samples))
      end do
      c(j) = c(j) / size(samples)
    end do
  end subroutine transform

  !> exp(-2 pi i k / n).
  pure complex(dp) function turned(k, n)
    integer, intent(in) :: k, n

    turned = cmplx(cos(2 * pi_qp * modulo(k, n) / n), -sin(2 * pi_qp * modulo(k, n) / n), dp)
  end function turned

  !> max |f|: Newton's iteration for f' = 0 from all high tops among many points; two may be equal but for roundings.
  pure real(dp) function maximum(c)
    complex(dp), intent(in) :: c(0:)
    integer, parameter :: finer = 16
    ! Between points of which 512 make a turn of order 1, a top loses (pi / 512)^2 / 2 of it; more, if its order is higher.
    real(dp), parameter :: high = 0.99_dp
    real(dp) :: f(3), step
    real(dp), allocatable :: sizes(:)
    integer :: k, n

    n = finer * 2 * size(c)
    step = real(2 * pi_qp, dp) / n
    allocate(sizes(n))
    do k = 1, n
      f = value(c, k * step)
      sizes(k) = abs(f(1))
    end do
    maximum = maxval(sizes)
    do k = 1, n
      if (sizes(k) < high * maxval(sizes)) cycle
      if (sizes(k) < sizes(1 + modulo(k - 2, n)) .or. sizes(k) < sizes(1 + modulo(k, n))) cycle
      maximum = max(maximum, top(c, k * step))
    end do
  end function maximum

  !> |f| where f' = 0, near `start`.
  pure real(dp) function top(c, start)
    complex(dp), intent(in) :: c(0:)
    real(dp), intent(in) :: start
    real(dp) :: theta, f(3)
    integer :: k

    top = 0
    theta = start
    do k = 1, 20
      f = value(c, theta)
      top = max(top, abs(f(1)))
      if (.not. f(1) * f(3) < 0) return
      theta = theta - f(2) / f(3)
    end do
  end function top

  !> f and its first two derivatives.
  pure function value(c, theta) result(f)
    complex(dp), intent(in) :: c(0:)
    real(dp), intent(in) :: theta
    real(dp) :: f(3)
    complex(dp) :: term
    integer :: j

    f = [real(c(0), dp), 0.0_dp, 0.0_dp]
    do j = 1, size(c) - 1
      term = 2 * c(j) * exp(cmplx(0, j * theta, dp))
      f = f + [real(term, dp), -j * aimag(term), -j**2 * real(term, dp)]
    end do
  end function value

end module population_turn
