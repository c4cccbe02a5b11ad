!> The frame with M, B, C averaged over the turn and the full load, in quadruple precision.
module reference_averaged
  use reference_frame, only: frame_matrices, frame_system
  use reference_linear, only: eigenvalues, qp, solve
  use reference_machine, only: period, pi_qp
  implicit none (type, external)
  private

  public :: solve_averaged

contains

  !> Eigenvalues of P, and the periodic motion x at `phases`, shape (n, size(phases)), from `points` samples over the turn
  !> (even); Fourier's real form: q = sum of c_k cos(k w t) + s_k sin(k w t).
  subroutine solve_averaged(frame, points, phases, lambda, x)
    type(frame_system), intent(in) :: frame
    integer, intent(in) :: points
    real(qp), intent(in) :: phases(:)
    complex(qp), intent(out) :: lambda(:)
    real(qp), intent(out) :: x(:, :)
    real(qp), dimension(frame%n / 2, frame%n / 2) :: m, b, c, mean_m, mean_b, mean_c, dynamic
    real(qp), allocatable :: h(:, :), cosine(:), sine(:)
    real(qp) :: p(frame%n, frame%n), both(frame%n, frame%n), load(frame%n), q(frame%n), t, rate, angle
    integer :: f, i, k

    f = frame%n / 2
    t = period(frame%machine)
    allocate(h(f, 0:points - 1), cosine(0:points - 1), sine(0:points - 1))
    mean_m = 0
    mean_b = 0
    mean_c = 0
    do i = 0, points - 1
      call frame_matrices(frame, t * i / points, m, b, c, h(:, i))
      mean_m = mean_m + m / points
      mean_b = mean_b + b / points
      mean_c = mean_c + c / points
      cosine(i) = cos(2 * pi_qp * i / points)
      sine(i) = sin(2 * pi_qp * i / points)
    end do
    p = 0
    do i = 1, f
      p(i, f + i) = 1
    end do
    p(f + 1:, :f) = -solve(mean_m, mean_c)
    p(f + 1:, f + 1:) = -solve(mean_m, mean_b)
    call eigenvalues(p, lambda)

    x = 0
    do k = 0, points / 2 - 1
      rate = 2 * pi_qp * k / t
      dynamic = mean_c - rate**2 * mean_m
      both(:f, :f) = dynamic
      both(:f, f + 1:) = rate * mean_b
      both(f + 1:, :f) = -rate * mean_b
      both(f + 1:, f + 1:) = dynamic
      load = 0
      do i = 0, points - 1
        load(:f) = load(:f) + h(:, i) * cosine(modulo(k * i, points)) * merge(1, 2, k == 0) / points
        load(f + 1:) = load(f + 1:) + h(:, i) * sine(modulo(k * i, points)) * merge(0, 2, k == 0) / points
      end do
      q = solve(both, load)
      do i = 1, size(phases)
        angle = 2 * pi_qp * k * phases(i)
        x(:f, i) = x(:f, i) + q(:f) * cos(angle) + q(f + 1:) * sin(angle)
        x(f + 1:, i) = x(f + 1:, i) + rate * (q(f + 1:) * cos(angle) - q(:f) * sin(angle))
      end do
    end do
  end subroutine solve_averaged

end module reference_averaged
