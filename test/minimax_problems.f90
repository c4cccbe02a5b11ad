!> Problems of optimisation, most of them with published optima: hs from Hock, Schittkowski, Test Examples for Nonlinear
!> Programming Codes (Springer, 1981); cb2, cb3 from Charalambous, Conn, SIAM J. Numer. Anal. 15, 1978, 162-187; wong1 from Asaadi,
!> Math. Programming 4, 1973, 144-154, all minimax problems as Luksan, Vlcek, Test Problems for Nonsmooth Unconstrained and
!> Linearly Constrained Optimization (report 798, Academy of Sciences of the Czech Republic, 2000) list them.
module minimax_problems
  use gestell_base_error, only: failed_computation, fatal_error, gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_math_optimum_minimax, only: branches_type, minimax_problem
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: problem_of

  integer, parameter, public :: hs43 = 1, hs71 = 2, hs76 = 3, hs100 = 4, cb2 = 5, cb3 = 6, wong1 = 7, chebyshev = 8, &
    & infeasible = 9, ring = 10, valley = 11, twenty = 12, edge = 13, cone = 14

  type, extends(minimax_problem), public :: test_problem
    integer :: which = 0
    !> Factors of the limits, the objective and the parameters; by how much the first limit is relaxed; how often each branch is
    !> repeated.
    real(dp) :: limit_unit = 1, objective_unit = 1, parameter_unit = 1, wider = 0
    integer :: times = 1
    !> True: the order of the branches changes with every call.
    logical :: shuffled = .false.
    !> Calls so far; the call that fails; the largest relative error of gradients.
    integer :: calls = 0, fails_at = 0
    real(dp) :: wrong = 0
  contains
    procedure :: evaluate
  end type test_problem

contains

  !> The problem and its starting point. Bounds that the source does not have are wide.
  subroutine problem_of(which, problem, start)
    integer, intent(in) :: which
    type(test_problem), intent(out) :: problem
    real(dp), allocatable, intent(out) :: start(:)
    integer :: i

    problem%which = which
    select case (which)
    case (hs43)
      problem%constraints = 3
      start = [0, 0, 0, 0]
    case (hs71)
      problem%constraints = 3
      start = [1, 5, 5, 1]
      problem%lower = [1, 1, 1, 1]
      problem%upper = [5, 5, 5, 5]
    case (hs76)
      problem%constraints = 3
      start = spread(0.5_dp, 1, 4)
      problem%lower = [0, 0, 0, 0]
    case (hs100)
      problem%constraints = 4
      start = [1, 2, 0, 4, 0, 1, 1]
    case (cb2)
      start = [1.0_dp, -0.1_dp]
    case (cb3)
      start = [2, 2]
    case (wong1)
      start = [1, 2, 0, 4, 0, 1, 1]
    case (chebyshev)
      start = [0, 0, 0, 0, 0]
    case (infeasible)
      problem%constraints = 2
      start = [3, 1]
    case (ring, edge)
      start = [0.9_dp, 0.1_dp]
    case (valley)
      start = [-1.2_dp, 1.0_dp]
    case (cone)
      start = [2.0_dp, -1.0_dp, 1.0_dp]
    case default
      problem%constraints = 1
      start = [(0.0_dp, i = 1, 20)]
    end select
    if (.not. allocated(problem%lower)) problem%lower = spread(-10.0_dp, 1, size(start))
    if (.not. allocated(problem%upper)) problem%upper = spread(10.0_dp, 1, size(start))
  end subroutine problem_of

  subroutine evaluate(self, x, gradients, at, error)
    class(test_problem), intent(inout) :: self
    real(dp), intent(in) :: x(:)
    logical, intent(in) :: gradients
    type(branches_type), intent(out) :: at
    type(gestell_error), allocatable, intent(out) :: error
    real(dp), allocatable :: g(:, :)
    integer :: i, n

    self%calls = self%calls + 1
    associate (y => x / self%parameter_unit)
      at%value = values(self%which, y)
      if (gradients) g = slopes(self%which, y)
      if (self%which == ring) at%known = norm2(y) < 1
      if (self%which == edge .and. norm2(y) >= 1) at%value = ieee_value(y(1), ieee_quiet_nan)
    end associate
    n = size(at%value)
    select case (self%which)
    case (hs43, hs71, hs76, hs100, infeasible, twenty)
      at%group = [(i, i = 1, n)]
    case default
      at%group = [(1, i = 1, n)]
    end select
    if (self%constraints > 0) at%value(2) = at%value(2) - self%wider
    at%value = at%value * merge(self%objective_unit, self%limit_unit, at%group == 1)
    if (gradients) at%slope = g * spread(merge(self%objective_unit, self%limit_unit, at%group == 1), 1, size(x)) &
      & / self%parameter_unit
    do i = 2, self%times
      at%value = [at%value, at%value(:n)]
      at%group = [at%group, at%group(:n)]
      if (gradients) at%slope = reshape([at%slope, at%slope(:, :n)], [size(x), i * n])
    end do
    if (self%shuffled) then
      n = size(at%value)
      i = modulo(self%calls, n)
      at%value = cshift(at%value, i)
      at%group = cshift(at%group, i)
      if (gradients) at%slope = cshift(at%slope, i, 2)
    end if
    if (gradients) then
      do i = 1, size(at%value)
        at%slope(:, i) = at%slope(:, i) * (1 + self%wrong * sin(real([(7 * self%calls + 3 * i + 5 * n, n = 1, size(x))], dp)))
      end do
    end if
    if (self%calls == self%fails_at) call fatal_error(error, "the call that fails", failed_computation)
  end subroutine evaluate

  function values(which, x) result(f)
    integer, intent(in) :: which
    real(dp), intent(in) :: x(:)
    real(dp), allocatable :: f(:)
    real(dp) :: t
    integer :: i

    select case (which)
    case (hs43)
      f = [x(1)**2 + x(2)**2 + 2 * x(3)**2 + x(4)**2 - 5 * x(1) - 5 * x(2) - 21 * x(3) + 7 * x(4), &
        & -8 + sum(x**2) + x(1) - x(2) + x(3) - x(4), &
        & -10 + x(1)**2 + 2 * x(2)**2 + x(3)**2 + 2 * x(4)**2 - x(1) - x(4), &
        & -5 + 2 * x(1)**2 + x(2)**2 + x(3)**2 + 2 * x(1) - x(2) - x(4)]
    case (hs71)
      f = [x(1) * x(4) * (x(1) + x(2) + x(3)) + x(3), 25 - product(x), sum(x**2) - 40, 40 - sum(x**2)]
    case (hs76)
      f = [x(1)**2 + 0.5_dp * x(2)**2 + x(3)**2 + 0.5_dp * x(4)**2 - x(1) * x(3) + x(3) * x(4) - x(1) - 3 * x(2) + x(3) - x(4), &
        & x(1) + 2 * x(2) + x(3) + x(4) - 5, 3 * x(1) + x(2) + 2 * x(3) - x(4) - 4, 1.5_dp - x(2) - 4 * x(3)]
    case (hs100, wong1)
      f = [(x(1) - 10)**2 + 5 * (x(2) - 12)**2 + x(3)**4 + 3 * (x(4) - 11)**2 + 10 * x(5)**6 + 7 * x(6)**2 + x(7)**4 &
        & - 4 * x(6) * x(7) - 10 * x(6) - 8 * x(7), &
        & 2 * x(1)**2 + 3 * x(2)**4 + x(3) + 4 * x(4)**2 + 5 * x(5) - 127, &
        & 7 * x(1) + 3 * x(2) + 10 * x(3)**2 + x(4) - x(5) - 282, &
        & 23 * x(1) + x(2)**2 + 6 * x(6)**2 - 8 * x(7) - 196, &
        & 4 * x(1)**2 + x(2)**2 - 3 * x(1) * x(2) + 2 * x(3)**2 + 5 * x(6) - 11 * x(7)]
      if (which == wong1) f(2:) = f(1) + 10 * f(2:)
    case (cb2)
      f = [x(1)**2 + x(2)**4, (2 - x(1))**2 + (2 - x(2))**2, 2 * exp(x(2) - x(1))]
    case (cb3)
      f = [x(1)**4 + x(2)**2, (2 - x(1))**2 + (2 - x(2))**2, 2 * exp(x(2) - x(1))]
    case (chebyshev)
      allocate(f(400))
      do i = 1, 200
        t = -1 + 2 * (i - 1) / 199.0_dp
        f(i) = exp(t) - (x(1) + t * (x(2) + t * (x(3) + t * (x(4) + t * x(5)))))
        f(i + 200) = -f(i)
      end do
    case (infeasible)
      f = [x(1) + x(2), (x(1) - 2)**2 + x(2)**2 - 1, (x(1) + 2)**2 + x(2)**2 - 1]
    case (ring, edge)
      f = [(x(1) - 0.5_dp)**2 + 3 * (x(2) - 0.5_dp)**2 - 0.01_dp * log(max(tiny(t), 1 - sum(x**2)))]
    case (cone)
      f = [norm2(x - 0.3_dp)]
    case (valley)
      f = [100 * (x(2) - x(1)**2)**2 + (1 - x(1))**2]
    case default
      f = [sum([(i * (x(i) - 1 + 0.1_dp * i)**2, i = 1, 20)]) + sum((x(2:) - x(:19))**4), sum(x) + 3]
    end select
  end function values

  function slopes(which, x) result(g)
    integer, intent(in) :: which
    real(dp), intent(in) :: x(:)
    real(dp), allocatable :: g(:, :)
    integer :: i, n
    real(dp) :: t

    n = size(x)
    select case (which)
    case (hs43)
      g = reshape([2 * x(1) - 5, 2 * x(2) - 5, 4 * x(3) - 21, 2 * x(4) + 7, &
        & 2 * x(1) + 1, 2 * x(2) - 1, 2 * x(3) + 1, 2 * x(4) - 1, &
        & 2 * x(1) - 1, 4 * x(2), 2 * x(3), 4 * x(4) - 1, &
        & 4 * x(1) + 2, 2 * x(2) - 1, 2 * x(3), -1.0_dp], [4, 4])
    case (hs71)
      g = reshape([x(4) * (2 * x(1) + x(2) + x(3)), x(1) * x(4), x(1) * x(4) + 1, x(1) * (x(1) + x(2) + x(3)), &
        & -x(2) * x(3) * x(4), -x(1) * x(3) * x(4), -x(1) * x(2) * x(4), -x(1) * x(2) * x(3), 2 * x, -2 * x], [4, 4])
    case (hs76)
      g = reshape([2 * x(1) - x(3) - 1, x(2) - 3, 2 * x(3) - x(1) + x(4) + 1, x(4) + x(3) - 1, &
        & 1.0_dp, 2.0_dp, 1.0_dp, 1.0_dp, 3.0_dp, 1.0_dp, 2.0_dp, -1.0_dp, 0.0_dp, -1.0_dp, -4.0_dp, 0.0_dp], [4, 4])
    case (hs100, wong1)
      g = reshape([2 * (x(1) - 10), 10 * (x(2) - 12), 4 * x(3)**3, 6 * (x(4) - 11), 60 * x(5)**5, &
        & 14 * x(6) - 4 * x(7) - 10, 4 * x(7)**3 - 4 * x(6) - 8, &
        & 4 * x(1), 12 * x(2)**3, 1.0_dp, 8 * x(4), 5.0_dp, 0.0_dp, 0.0_dp, &
        & 7.0_dp, 3.0_dp, 20 * x(3), 1.0_dp, -1.0_dp, 0.0_dp, 0.0_dp, &
        & 23.0_dp, 2 * x(2), 0.0_dp, 0.0_dp, 0.0_dp, 12 * x(6), -8.0_dp, &
        & 8 * x(1) - 3 * x(2), 2 * x(2) - 3 * x(1), 4 * x(3), 0.0_dp, 0.0_dp, 5.0_dp, -11.0_dp], [7, 5])
      if (which == wong1) g(:, 2:) = spread(g(:, 1), 2, 4) + 10 * g(:, 2:)
    case (cb2)
      g = reshape([2 * x(1), 4 * x(2)**3, 2 * (x(1) - 2), 2 * (x(2) - 2), -2 * exp(x(2) - x(1)), 2 * exp(x(2) - x(1))], [2, 3])
    case (cb3)
      g = reshape([4 * x(1)**3, 2 * x(2), 2 * (x(1) - 2), 2 * (x(2) - 2), -2 * exp(x(2) - x(1)), 2 * exp(x(2) - x(1))], [2, 3])
    case (chebyshev)
      allocate(g(5, 400))
      do i = 1, 200
        t = -1 + 2 * (i - 1) / 199.0_dp
        g(:, i) = -[1.0_dp, t, t**2, t**3, t**4]
        g(:, i + 200) = -g(:, i)
      end do
    case (infeasible)
      g = reshape([1.0_dp, 1.0_dp, 2 * (x(1) - 2), 2 * x(2), 2 * (x(1) + 2), 2 * x(2)], [2, 3])
    case (ring, edge)
      g = reshape([2 * (x(1) - 0.5_dp), 6 * (x(2) - 0.5_dp)] + 0.02_dp * x / max(tiny(t), 1 - sum(x**2)), [2, 1])
    case (cone)
      g = reshape((x - 0.3_dp) / max(tiny(t), norm2(x - 0.3_dp)), [3, 1])
    case (valley)
      g = reshape([-400 * x(1) * (x(2) - x(1)**2) - 2 * (1 - x(1)), 200 * (x(2) - x(1)**2)], [2, 1])
    case default
      g = reshape([[(2 * i * (x(i) - 1 + 0.1_dp * i), i = 1, 20)], spread(1.0_dp, 1, 20)], [20, 2])
      g(2:, 1) = g(2:, 1) + 4 * (x(2:) - x(:19))**3
      g(:19, 1) = g(:19, 1) - 4 * (x(2:) - x(:19))**3
    end select
  end function slopes

end module minimax_problems
