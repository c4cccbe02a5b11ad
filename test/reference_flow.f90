!> Reference solutions of x' = P(t) x + f(t) in quadruple precision.
!> Method: the explicit midpoint rule with 2, 4, 6, ... substeps of one long step, extrapolated in the square of the
!> substep (Gragg, Bulirsch, Stoer; Hairer, Norsett, Wanner I, section II.9), with control of the length of the step.
module reference_flow
  use reference_linear, only: qp, solve
  implicit none (type, external)
  private

  public :: flow_system, procedure_system, system_of
  public :: flow_path, flow_map, flow_states, periodic_start

  !> A linear system of n states: evaluate(t, p, f) gives P(t) (n, n) and f(t) (n).
  type, abstract :: flow_system
    integer :: n = 0
  contains
    procedure(evaluate_system), deferred :: evaluate
  end type flow_system

  abstract interface
    subroutine evaluate_system(self, t, p, f)
      import :: flow_system, qp
      implicit none (type, external)
      class(flow_system), intent(in) :: self
      real(qp), intent(in) :: t
      real(qp), intent(out) :: p(:, :), f(:)
    end subroutine evaluate_system

    subroutine plain_system(n, t, p, f)
      import :: qp
      implicit none (type, external)
      integer, intent(in) :: n
      real(qp), intent(in) :: t
      real(qp), intent(out) :: p(n, n), f(n)
    end subroutine plain_system
  end interface

  !> A system given by a plain procedure (n, t, p, f); made by `system_of`.
  type, extends(flow_system) :: procedure_system
    procedure(plain_system), pointer, nopass :: plain => null()
  contains
    procedure :: evaluate => evaluate_plain
  end type procedure_system

  !> Columns of the extrapolation at most; the length of the step is led so that one fewer is needed.
  integer, parameter :: columns = 18

contains

  !> The system of n states that the procedure plain(n, t, p, f) describes.
  function system_of(n, plain) result(system)
    integer, intent(in) :: n
    procedure(plain_system) :: plain
    type(procedure_system) :: system

    system%n = n
    system%plain => plain
  end function system_of

  subroutine evaluate_plain(self, t, p, f)
    class(procedure_system), intent(in) :: self
    real(qp), intent(in) :: t
    real(qp), intent(out) :: p(:, :), f(:)

    call self%plain(self%n, t, p, f)
  end subroutine evaluate_plain

  !> From t0 to each of the times (all on one side of t0, in their order): phi(:, :, k) = Phi(times(k), t0) and
  !> particular(:, k), the solution that starts from zero at t0. tolerance: allowed error of one step, relative to the
  !> sizes of the rows and columns of Phi; 1e-24 is usual, 1e-30 is about the least that rounding permits. The
  !> particular solution counts as not smaller than 1e-8 (else a forcing that cancels to rounding could not be met).
  !> P and f must be smooth in between (take a jump as the end of one call and the start of the next); error stop
  !> when too many steps on the way to one time are refused.
  subroutine flow_path(system, t0, times, tolerance, phi, particular)
    class(flow_system), intent(in) :: system
    real(qp), intent(in) :: t0, times(:), tolerance
    real(qp), intent(out) :: phi(:, :, :), particular(:, :)
    real(qp) :: x(system%n, system%n + 1), size_row(system%n), t, step
    integer :: n, k

    n = system%n
    x = 0
    do k = 1, n
      x(k, k) = 1
    end do
    t = t0
    size_row = 1
    step = (times(size(times)) - t0)/50
    do k = 1, size(times)
      call advance(system, t, times(k), tolerance, step, size_row, x)
      phi(:, :, k) = x(:, :n)
      particular(:, k) = x(:, n + 1)
    end do
  end subroutine flow_path

  !> phi = Phi(t1, t0) and the particular solution at t1 that starts from zero at t0.
  subroutine flow_map(system, t0, t1, tolerance, phi, particular)
    class(flow_system), intent(in) :: system
    real(qp), intent(in) :: t0, t1, tolerance
    real(qp), intent(out) :: phi(:, :), particular(:)
    real(qp) :: path(system%n, system%n, 1), states(system%n, 1)

    call flow_path(system, t0, [t1], tolerance, path, states)
    phi = path(:, :, 1)
    particular = states(:, 1)
  end subroutine flow_map

  !> states(:, k): the solution at times(k) that starts from x0 at t0.
  subroutine flow_states(system, t0, x0, times, tolerance, states)
    class(flow_system), intent(in) :: system
    real(qp), intent(in) :: t0, x0(:), times(:), tolerance
    real(qp), intent(out) :: states(:, :)
    real(qp) :: phi(system%n, system%n, size(times))
    integer :: k

    call flow_path(system, t0, times, tolerance, phi, states)
    do k = 1, size(times)
      states(:, k) = states(:, k) + matmul(phi(:, :, k), x0)
    end do
  end subroutine flow_states

  !> x0 = (E - Phi)^-1 x_p: start of the periodic solution, from the results of `flow_map` over one period.
  function periodic_start(phi, particular) result(x0)
    real(qp), intent(in) :: phi(:, :), particular(:)
    real(qp) :: x0(size(particular)), a(size(particular), size(particular))
    integer :: k

    a = -phi
    do k = 1, size(particular)
      a(k, k) = a(k, k) + 1
    end do
    x0 = solve(a, particular)
  end function periodic_start

  !> Integrates x (the last column with forcing, the others without) from t to t_end, step by step.
  subroutine advance(system, t, t_end, tolerance, step, size_row, x)
    class(flow_system), intent(in) :: system
    real(qp), intent(inout) :: t, step, size_row(:), x(:, :)
    real(qp), intent(in) :: t_end, tolerance
    real(qp) :: candidate(size(x, 1), size(x, 2)), h, error, factor
    integer :: used, refused
    logical :: last

    refused = 0
    do while (abs(t_end - t) > 0)
      last = abs(step) >= abs(t_end - t)
      h = merge(t_end - t, sign(step, t_end - t), last)
      call extrapolate(system, t, h, tolerance, size_row, x, candidate, error, used)
      factor = 0.9_qp*(tolerance/max(error, 1.0e-40_qp))**(1.0_qp/(2*used - 1))
      if (error <= tolerance) then
        size_row = max(size_row/2, maxval(abs(candidate(:, :size(x, 1))), dim=2))
        x = candidate
        t = t + h
        if (last) t = t_end
        factor = min(factor*(1 + 0.1_qp*(columns - 1 - used)), 3.0_qp)
        ! a step shortened to meet t_end does not mean that the next one must be short
        step = merge(max(abs(step), abs(h)*factor), abs(h)*factor, last)
      else
        step = abs(h)*max(0.2_qp, min(0.7_qp, factor))
        refused = refused + 1
        if (refused > 60) error stop "reference_flow: the tolerance cannot be met"
      end if
    end do
  end subroutine advance

  !> One long step h from x. result: the extrapolated value, error: the difference of the last two values on the
  !> diagonal's row relative to size_row(i)*size_column(j), used: columns taken.
  subroutine extrapolate(system, t, h, tolerance, size_row, x, result, error, used)
    class(flow_system), intent(in) :: system
    real(qp), intent(in) :: t, h, tolerance, size_row(:), x(:, :)
    real(qp), intent(out) :: result(:, :), error
    integer, intent(out) :: used
    real(qp), dimension(size(x, 1), size(x, 2), columns) :: row, above
    real(qp) :: p0(size(x, 1), size(x, 1)), f0(size(x, 1)), slope0(size(x, 1), size(x, 2))
    integer :: j, k

    call system%evaluate(t, p0, f0)
    call derivative(p0, f0, x, slope0)
    error = 1
    do j = 1, columns
      used = j
      call midpoint(system, t, h, 2*j, x, slope0, row(:, :, 1))
      do k = 1, j - 1
        row(:, :, k + 1) = row(:, :, k) + (row(:, :, k) - above(:, :, k))/((real(j, qp)/(j - k))**2 - 1)
      end do
      if (j >= 4) then
        error = relative_size(row(:, :, j) - row(:, :, j - 1), row(:, :, j), x, size_row)
        if (error <= tolerance) exit
      end if
      above(:, :, :j) = row(:, :, :j)
    end do
    result = row(:, :, used)
  end subroutine extrapolate

  !> m (even) substeps of the explicit midpoint rule; its error is a series in even powers of h/m.
  subroutine midpoint(system, t, h, m, x, slope0, y)
    class(flow_system), intent(in) :: system
    real(qp), intent(in) :: t, h, x(:, :), slope0(:, :)
    integer, intent(in) :: m
    real(qp), intent(out) :: y(:, :)
    real(qp), dimension(size(x, 1), size(x, 2)) :: before, slope, next
    real(qp) :: p(size(x, 1), size(x, 1)), f(size(x, 1)), substep
    integer :: i

    substep = h/m
    before = x
    y = x + substep*slope0
    do i = 1, m - 1
      call system%evaluate(t + (h*i)/m, p, f)
      call derivative(p, f, y, slope)
      next = before + 2*substep*slope
      before = y
      y = next
    end do
  end subroutine midpoint

  !> slope = P x, plus f in the last column. Zeros of P are skipped: half of the elements are zero in a system of second order.
  subroutine derivative(p, f, x, slope)
    real(qp), intent(in) :: p(:, :), f(:), x(:, :)
    real(qp), intent(out) :: slope(:, :)
    integer :: i, j

    slope = 0
    slope(:, size(slope, 2)) = f
    do j = 1, size(p, 2)
      do i = 1, size(p, 1)
        if (abs(p(i, j)) > 0) slope(i, :) = slope(i, :) + p(i, j)*x(j, :)
      end do
    end do
  end subroutine derivative

  !> Maximum of |difference(i, j)| / (size_row(i)*size_column(j)), with sizes from old and new values, so that displacements,
  !> velocities and compliances are each measured in their own scale.
  function relative_size(difference, new, old, size_row) result(error)
    real(qp), intent(in) :: difference(:, :), new(:, :), old(:, :), size_row(:)
    real(qp) :: error, row(size(new, 1)), column
    integer :: j, n

    n = size(new, 1)
    row = max(size_row, maxval(abs(new(:, :n)), dim=2))
    error = 0
    do j = 1, n + 1
      column = max(maxval(abs(new(:, j))/row), maxval(abs(old(:, j))/row))
      if (j > n) column = max(column, 1.0e-8_qp)
      error = max(error, maxval(abs(difference(:, j))/row)/column)
    end do
  end function relative_size

end module reference_flow
