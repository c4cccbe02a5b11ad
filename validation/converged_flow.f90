!> Converged values to measure the original program against, by a method that shares nothing with (18):
!> extrapolation of the modified midpoint rule (Gragg, Bulirsch, Stoer), here of order eight.
module converged_flow
  use original_mechanism, only: dp, pi, four_bar, state_form, inertia_matrix, identity, solve
  implicit none (type, external)
  private

  public :: converged_monodromy, converged_initial_state, converged_motion, multiplier_moduli, liouville_exponent

  !> Half the order; column j of the extrapolation has 2 j substeps
  integer, parameter :: columns = 4

  interface
    subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: jobvl, jobvr
      integer, intent(in) :: n, lda, ldvl, ldvr, lwork
      real(dp), intent(inout) :: a(lda, *)
      real(dp), intent(out) :: wr(*), wi(*), vl(ldvl, *), vr(ldvr, *), work(*)
      integer, intent(out) :: info
    end subroutine dgeev
  end interface

contains

  !> Phi(T), error of order steps^-8.
  function converged_monodromy(machine, omega, steps) result(phi)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega
    integer, intent(in) :: steps
    real(dp) :: phi(6, 6)

    real(dp) :: flow(7, 7)

    flow = augmented_flow(machine, omega, steps)
    phi = flow(1:6, 1:6)
  end function converged_monodromy

  !> x0 of the periodic vibration from (E - Phi) x0 = x_p(T).
  function converged_initial_state(machine, omega, steps) result(x0)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega
    integer, intent(in) :: steps
    real(dp) :: x0(6)

    real(dp) :: flow(7, 7), x(6, 1)

    flow = augmented_flow(machine, omega, steps)
    x = solve(identity(6) - flow(1:6, 1:6), flow(1:6, 7:7))
    x0 = x(:, 1)
  end function converged_initial_state

  !> The periodic vibration at the times 0, T/parts, ..., T, shape (6, parts + 1); `parts` divides `steps`.
  function converged_motion(machine, omega, steps, parts) result(x)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega
    integer, intent(in) :: steps, parts
    real(dp) :: x(6, 0:parts)

    real(dp) :: flow(7, 7)
    integer :: k

    x(:, 0) = converged_initial_state(machine, omega, steps)
    do k = 1, parts
      flow = augmented_flow(machine, omega, steps, k * steps / parts)
      x(:, k) = matmul(flow(1:6, 1:6), x(:, 0)) + flow(1:6, 7)
    end do
  end function converged_motion

  !> The flow over one period, or the first `taken` of its steps, of (x, 1)' = [P f; 0 0] (x, 1): Phi(T) with x_p(T) as its
  !> seventh column.
  function augmented_flow(machine, omega, steps, taken) result(flow)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega
    integer, intent(in) :: steps
    integer, intent(in), optional :: taken
    real(dp) :: flow(7, 7)

    real(dp) :: table(7, 7, columns), coarser(7, 7), finer(7, 7), h
    integer :: last, i, j, k

    h = 2 * pi / abs(omega) / steps
    last = steps
    if (present(taken)) last = taken
    flow = identity(7)
    do i = 1, last
      do j = 1, columns
        finer = modified_midpoint(machine, omega, (i - 1) * h, h, 2 * j, flow)
        do k = 1, j - 1
          coarser = table(:, :, k)
          table(:, :, k) = finer
          finer = finer + (finer - coarser) / ((real(j, dp) / (j - k))**2 - 1)
        end do
        table(:, :, j) = finer
      end do
      flow = finer
    end do
  end function augmented_flow

  !> One step of length h in `substeps` leaps; its error has only even powers of h / substeps.
  function modified_midpoint(machine, omega, t, h, substeps, start) result(y)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega, t, h, start(7, 7)
    integer, intent(in) :: substeps
    real(dp) :: y(7, 7)

    real(dp), dimension(7, 7) :: before, next
    real(dp) :: tau
    integer :: i

    tau = h / substeps
    before = start
    y = start + tau * slope(machine, omega, t, start)
    do i = 1, substeps - 1
      next = before + 2 * tau * slope(machine, omega, t + i * tau, y)
      before = y
      y = next
    end do
  end function modified_midpoint

  function slope(machine, omega, t, y) result(y_dot)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega, t, y(7, 7)
    real(dp) :: y_dot(7, 7)

    real(dp) :: p(6, 6), f(6, 1)

    call state_form(machine, omega, t, p, f(:, 1))
    y_dot(1:6, :) = matmul(p, y(1:6, :)) + matmul(f, y(7:7, :))
    y_dot(7, :) = 0.0_dp
  end function slope

  !> The moduli of the eigenvalues of Phi(T), in no particular order.
  function multiplier_moduli(phi) result(moduli)
    real(dp), intent(in) :: phi(6, 6)
    real(dp) :: moduli(6)

    real(dp) :: a(6, 6), re(6), im(6), left(1, 1), right(1, 1), work(64)
    integer :: info

    a = phi
    call dgeev('N', 'N', 6, a, 6, re, im, left, 1, right, 1, work, size(work), info)
    if (info /= 0) error stop "the eigenvalues of Phi did not converge"
    moduli = hypot(re, im)
  end function multiplier_moduli

  !> The integral of tr(M^-1 diag(b)) over one period, so that det Phi(T) = exp(-integral).
  !>
  !> Liouville: det Phi(T) = exp(integral of tr P), and (22) gives tr P = -tr(M^-1 B). By (9) and (10),
  !>
  !>     B = diag(b) + dM/dt + G,   G = [0 0 -a2'; 0 0 a1'; a2' -a1' 0],
  !>
  !> since dM/dt has -a2' and a1' at (1,3) and (2,3), and at (3,1) and (3,2) too, where B has zero, and all of the
  !> periodic part of b33 at (3,3). G is antisymmetric and M^-1 symmetric: tr(M^-1 G) = 0. Jacobi:
  !> tr(M^-1 dM/dt) = d/dt ln det M, whose integral over a period is zero. So only diag(b) remains; neither the
  !> springs nor the excitation enter.
  !>
  !> The rectangle rule on the crank angle converges exponentially for this smooth periodic function.
  function liouville_exponent(machine, omega, angles) result(integral)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega
    integer, intent(in) :: angles
    real(dp) :: integral

    real(dp) :: rate(3, 3), b(3, 3)
    integer :: i, j

    b = 0.0_dp
    do j = 1, 3
      b(j, j) = machine%damping(j)
    end do
    integral = 0.0_dp
    do i = 1, angles
      rate = solve(inertia_matrix(machine, 2 * pi * i / angles), b)
      integral = integral + rate(1, 1) + rate(2, 2) + rate(3, 3)
    end do
    integral = integral * 2 * pi / abs(omega) / angles
  end function liouville_exponent

end module converged_flow
