!> Optimisation: published optima, exact multipliers, and the conditions of Karush, Kuhn and Tucker, evaluated from the
!> branches.
module test_minimax
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_math_optimum_minimax, only: branches_type, minimise, optimum_type
  use minimax_problems, only: cb2, cb3, chebyshev, cone, edge, hs100, hs43, hs71, hs76, infeasible, problem_of, ring, &
    & test_problem, twenty, valley, wong1
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_minimax

  real(dp), parameter :: usual = 1.0e-8_dp

contains

  subroutine collect_minimax(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("published optima are found with few evaluations", test_published), &
      & new_unittest("Lagrange multipliers of limits and bounds agree with exact values", test_multipliers), &
      & new_unittest("every optimum satisfies the Karush-Kuhn-Tucker conditions", test_conditions), &
      & new_unittest("Lagrange multipliers predict how the optimum changes with a limit", test_prices), &
      & new_unittest("the multiplier of a fixed parameter predicts the change of the optimum", test_fixed), &
      & new_unittest("the optimality gap of a convex problem encloses its optimum", test_gap), &
      & new_unittest("a Chebyshev approximation has an error that alternates", test_chebyshev), &
      & new_unittest("if limits contradict each other, the smallest violation is found and reported", test_infeasible), &
      & new_unittest("the search avoids points where the objective is not defined", test_unknown), &
      & new_unittest("repeated branches in changing order do not affect the optimum", test_equal_branches), &
      & new_unittest("units of parameters and objective do not affect the optimum", test_units), &
      & new_unittest("slightly wrong gradients end the search without convergence", test_wrong_gradients), &
      & new_unittest("the minimum of a norm is approached without reported convergence", test_cone), &
      & new_unittest("failing evaluations, invalid bounds and unusable starting points are errors", test_failures)]
  end subroutine collect_minimax

  subroutine solve(which, problem, optimum, failure)
    integer, intent(in) :: which
    type(test_problem), intent(out) :: problem
    type(optimum_type), intent(out) :: optimum
    type(gestell_error), allocatable, intent(out) :: failure
    real(dp), allocatable :: start(:)

    call problem_of(which, problem, start)
    call minimise(problem, start, usual, optimum, failure)
  end subroutine solve

  !> Optima as the sources print them, with all their digits, or in closed form; that of ring by Nelder-Mead and that of twenty
  !> by SLSQP, to the last digits (SciPy 1.17).
  subroutine test_published(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: which(10) = [hs43, hs71, hs76, hs100, cb2, cb3, wong1, ring, twenty, valley]
    real(dp), parameter :: optima(10) = [-44.0_dp, 17.0140173_dp, -103 / 22.0_dp, 680.6300573_dp, 1.9522245_dp, 2.0_dp, &
      & 680.63006_dp, 0.006803566940174_dp, 1.113912776222_dp, 0.0_dp]
    real(dp), parameter :: digits(10) = [1.0e-9_dp, 5.0e-8_dp, 1.0e-9_dp, 1.0e-7_dp, 5.0e-8_dp, 1.0e-9_dp, 5.0e-6_dp, &
      & 1.0e-12_dp, 1.0e-9_dp, 1.0e-12_dp]
    integer, parameter :: most(10) = [22, 12, 10, 28, 9, 9, 26, 40, 45, 80]
    type(test_problem) :: problem
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    integer :: i

    do i = 1, size(which)
      call solve(which(i), problem, optimum, failure)
      call check_success(error, failure)
      call check_that(error, optimum%objective, ">=", optima(i) - digits(i), "problem " // text(which(i)))
      call check_that(error, optimum%objective, "<=", optima(i) + digits(i), "problem " // text(which(i)))
      call check_that(error, optimum%converged .and. optimum%feasible, "==", .true., "problem " // text(which(i)))
      call check_that(error, optimum%stationarity, "<=", usual)
      call check_that(error, optimum%evaluations, "<=", most(i), "evaluations of problem " // text(which(i)))
      call check_that(error, optimum%evaluations, "==", problem%calls)
      call check_that(error, optimum%gradients, "<=", optimum%evaluations)
    end do
  end subroutine test_published

  !> Rosen-Suzuki has 1, 0, 2. In problem 76 the first limit and x3 = 0 hold: x = (3, 23, 0, 6) / 11, prices 5 / 11, 0, 0, and
  !> dL/dx3 = 2 x3 - x1 + x4 + 1 + 5 / 11 = 19 / 11.
  subroutine test_multipliers(error)
    type(error_type), allocatable, intent(out) :: error
    type(test_problem) :: problem
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: start(:)

    call solve(hs43, problem, optimum, failure)
    call check_success(error, failure)
    call check_that(error, abs(optimum%x - [0, 1, 2, -1]), "<=", 1.0e-6_dp)
    call check_that(error, abs(optimum%price - [1, 0, 2]), "<=", 1.0e-6_dp)
    call check_that(error, abs(optimum%bound_price), "==", 0.0_dp)
    ! Bounds whose difference is rounded: -0.3 + (1.9 + 0.3) is less than 1.9.
    call problem_of(hs43, problem, start)
    problem%lower(3) = -0.3_dp
    problem%upper(3) = 1.9_dp
    call minimise(problem, start, usual, optimum, failure)
    call check_success(error, failure)
    call check_that(error, optimum%x(3), "==", 1.9_dp)
    call check_that(error, optimum%bound_price(3), "<", -0.1_dp)
    call solve(hs76, problem, optimum, failure)
    call check_success(error, failure)
    call check_that(error, abs(11 * optimum%x - [3, 23, 0, 6]), "<=", 1.0e-6_dp)
    call check_that(error, optimum%x(3), "==", 0.0_dp)
    call check_that(error, abs(11 * optimum%price - [5, 0, 0]), "<=", 1.0e-6_dp)
    call check_that(error, abs(11 * optimum%bound_price - [0, 0, 19, 0]), "<=", 1.0e-6_dp)
  end subroutine test_multipliers

  !> df/dx + sum of price dc/dx = price of the bound, price c = 0, c <= 0: each group of these problems has one branch.
  subroutine test_conditions(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: which(5) = [hs43, hs71, hs76, hs100, twenty]
    type(test_problem) :: problem
    type(optimum_type) :: optimum
    type(branches_type) :: at
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: multiplier(:)
    integer :: i

    do i = 1, size(which)
      call solve(which(i), problem, optimum, failure)
      call check_success(error, failure)
      call problem%evaluate(optimum%x, .true., at, failure)
      multiplier = [1.0_dp, optimum%price]
      associate (what => "problem " // text(which(i)))
        call check_that(error, abs(matmul(at%slope, multiplier) - optimum%bound_price), "<=", &
          & 1.0e-6_dp * max(1.0_dp, abs(optimum%objective)), what)
        call check_that(error, abs(optimum%price * at%value(2:)), "<=", 1.0e-7_dp, what)
        call check_that(error, at%value(2:), "<=", 1.0e-7_dp, what)
        call check_that(error, optimum%price, ">=", 0.0_dp, what)
        call check_that(error, sum(optimum%price), ">", 0.0_dp, what)
        call check_that(error, optimum%groups, "==", at%value, what)
        call check_that(error, [optimum%x - problem%lower, problem%upper - optimum%x], ">=", 0.0_dp, what)
        call check_that(error, pack(optimum%bound_price, optimum%x < problem%upper), ">=", 0.0_dp, what)
        call check_that(error, pack(optimum%bound_price, optimum%x > problem%lower), "<=", 0.0_dp, what)
      end associate
    end do
  end subroutine test_conditions

  !> The first limit of problem 100 wider and narrower by a thousandth, central difference: its error is h^2 f''' / 6, about 1e-8.
  subroutine test_prices(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: h = 0.01_dp
    type(test_problem) :: problem
    type(optimum_type) :: optimum, wide, narrow
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: start(:)

    call solve(hs100, problem, optimum, failure)
    call check_success(error, failure)
    call problem_of(hs100, problem, start)
    problem%wider = h
    call minimise(problem, start, usual, wide, failure)
    problem%wider = -h
    call minimise(problem, start, usual, narrow, failure)
    call check_that(error, abs((narrow%objective - wide%objective) / (2 * h) - optimum%price(1)), "<=", 1.0e-6_dp)
    call check_that(error, optimum%price(1), ">", 1.0_dp)
  end subroutine test_prices

  !> Rosen-Suzuki with x1 fixed on either side of its optimum, 0: dL/dx1 is compared with optima with x1 fixed nearby.
  subroutine test_fixed(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: h = 1.0e-3_dp
    type(test_problem) :: problem
    type(optimum_type) :: optimum(3)
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: start(:)
    real(dp) :: at(3)
    integer :: i, side

    do side = -1, 1, 2
      at = 0.5_dp * side + h * [-1, 0, 1]
      do i = 1, 3
        call problem_of(hs43, problem, start)
        problem%lower(1) = at(i)
        problem%upper(1) = at(i)
        call minimise(problem, start, usual, optimum(i), failure)
        call check_success(error, failure)
        call check_that(error, optimum(i)%converged, "==", .true.)
        call check_that(error, optimum(i)%x(1), "==", at(i))
      end do
      call check_that(error, abs((optimum(3)%objective - optimum(1)%objective) / (2 * h) - optimum(2)%bound_price(1)), "<=", &
        & 1.0e-5_dp)
      call check_that(error, side * optimum(2)%bound_price(1), ">", 0.1_dp)
    end do
    problem%lower = [0, 1, 2, -1]
    problem%upper = problem%lower
    call minimise(problem, start, usual, optimum(1), failure)
    call check_success(error, failure)
    call check_that(error, optimum(1)%objective, "==", -44.0_dp)
    call check_that(error, optimum(1)%converged, "==", .true.)
  end subroutine test_fixed

  !> Problem 76, whose optimum is -103/22, stopped early: the bound holds; when converged it is close.
  subroutine test_gap(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: exact = -103 / 22.0_dp, tolerances(5) = [1.0_dp, 1.0e-1_dp, 1.0e-2_dp, 1.0e-4_dp, 1.0e-8_dp]
    type(test_problem) :: problem
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: start(:)
    integer :: i

    do i = 1, size(tolerances)
      call problem_of(hs76, problem, start)
      call minimise(problem, start, tolerances(i), optimum, failure)
      call check_success(error, failure)
      call check_that(error, optimum%objective - optimum%gap * abs(optimum%objective), "<=", exact + 1.0e-14_dp)
      call check_that(error, optimum%objective, ">=", exact - 1.0e-14_dp)
    end do
    call check_that(error, optimum%gap, "<=", 1.0e-7_dp)
  end subroutine test_gap

  !> exp on 200 points by a polynomial of degree 4: an error that takes its largest value six times with alternating sign is the
  !> least (Chebyshev). The linear program has 0.000546632034902015 (HiGHS in SciPy 1.17).
  subroutine test_chebyshev(error)
    type(error_type), allocatable, intent(out) :: error
    type(test_problem) :: problem
    type(optimum_type) :: optimum
    type(branches_type) :: at
    type(gestell_error), allocatable :: failure
    integer :: i, side, changes

    call solve(chebyshev, problem, optimum, failure)
    call check_success(error, failure)
    call problem%evaluate(optimum%x, .false., at, failure)
    side = 0
    changes = 0
    do i = 1, 200
      if (abs(at%value(i)) < optimum%objective * (1 - 1.0e-9_dp)) cycle
      if (nint(sign(1.0_dp, at%value(i))) /= side) changes = changes + 1
      side = nint(sign(1.0_dp, at%value(i)))
    end do
    call check_that(error, changes, "==", 6)
    call check_that(error, abs(optimum%objective - 0.000546632034902015_dp), "<=", 1.0e-12_dp)
    call check_that(error, optimum%converged, "==", .true.)
    call check_that(error, optimum%evaluations, "<=", 8)
  end subroutine test_chebyshev

  !> Two discs of radius 1 about (2, 0) and (-2, 0). Each limit is scaled by its size at the start, so the nearer one is met, at
  !> (1, 0).
  subroutine test_infeasible(error)
    type(error_type), allocatable, intent(out) :: error
    type(test_problem) :: problem
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure

    call solve(infeasible, problem, optimum, failure)
    call check_success(error, failure)
    call check_that(error, optimum%feasible, "==", .false.)
    call check_that(error, abs(optimum%x - [1, 0]), "<=", 1.0e-5_dp)
    call check_that(error, abs(optimum%violation - 8), "<=", 1.0e-4_dp)
    call check_that(error, optimum%evaluations, "<=", 60)
  end subroutine test_infeasible

  !> The objective is undefined outside the unit circle, near which the search begins; values that are not finite are avoided
  !> too.
  subroutine test_unknown(error)
    type(error_type), allocatable, intent(out) :: error
    type(test_problem) :: problem
    type(optimum_type) :: optimum, same
    type(branches_type) :: at
    type(gestell_error), allocatable :: failure

    call solve(ring, problem, optimum, failure)
    call check_success(error, failure)
    call check_that(error, optimum%converged, "==", .true.)
    call problem%evaluate(optimum%x, .true., at, failure)
    call check_that(error, norm2(at%slope), "<=", 1.0e-8_dp)
    call solve(edge, problem, same, failure)
    call check_success(error, failure)
    call check_that(error, same%x, "==", optimum%x)
    call check_that(error, same%evaluations, "==", optimum%evaluations)
  end subroutine test_unknown

  !> Each branch three times, in an order that changes from call to call.
  subroutine test_equal_branches(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: which(4) = [hs43, cb2, wong1, chebyshev]
    type(test_problem) :: problem
    type(optimum_type) :: optimum, single
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: start(:)
    integer :: i

    do i = 1, size(which)
      call solve(which(i), problem, single, failure)
      call problem_of(which(i), problem, start)
      problem%times = 3
      problem%shuffled = .true.
      call minimise(problem, start, usual, optimum, failure)
      call check_success(error, failure)
      call check_that(error, optimum%converged, "==", .true.)
      call check_that(error, abs(optimum%objective - single%objective), "<=", 1.0e-11_dp * max(1.0_dp, abs(single%objective)))
      call check_that(error, abs(optimum%price - single%price), "<=", 1.0e-5_dp)
      call check_that(error, optimum%evaluations, "<=", single%evaluations + 2)
    end do
  end subroutine test_equal_branches

  subroutine test_units(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: which(3) = [hs43, hs71, wong1]
    type(test_problem) :: problem
    type(optimum_type) :: optimum, plain
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: start(:)
    integer :: i

    do i = 1, size(which)
      call solve(which(i), problem, plain, failure)
      call problem_of(which(i), problem, start)
      problem%objective_unit = 1.0e6_dp
      problem%limit_unit = 1.0e-3_dp
      problem%parameter_unit = 1.0e6_dp
      problem%lower = problem%lower * 1.0e6_dp
      problem%upper = problem%upper * 1.0e6_dp
      call minimise(problem, start * 1.0e6_dp, usual, optimum, failure)
      call check_success(error, failure)
      call check_that(error, [optimum%iterations, optimum%evaluations], "==", [plain%iterations, plain%evaluations])
      call check_that(error, abs(optimum%x / 1.0e6_dp - plain%x), "<=", 1.0e-7_dp)
      call check_that(error, abs(optimum%price / 1.0e9_dp - plain%price), "<=", 1.0e-5_dp)
      call check_that(error, abs(optimum%bound_price - plain%bound_price), "<=", 1.0e-5_dp)
    end do
  end subroutine test_units

  !> Gradients with errors of a thousandth, different at each call: the search does not converge, but is not far off.
  subroutine test_wrong_gradients(error)
    type(error_type), allocatable, intent(out) :: error
    type(test_problem) :: problem
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: start(:)

    call problem_of(hs100, problem, start)
    problem%wrong = 1.0e-3_dp
    call minimise(problem, start, 1.0e-14_dp, optimum, failure)
    call check_success(error, failure)
    call check_that(error, optimum%converged, "==", .false.)
    call check_that(error, abs(optimum%objective - 680.6300573_dp), "<=", 0.1_dp)
    call check_that(error, optimum%iterations, "<=", 170)
  end subroutine test_wrong_gradients

  !> |x - (3, 3, 3) / 10| is reduced to rounding errors, and the search reports that it has not converged.
  subroutine test_cone(error)
    type(error_type), allocatable, intent(out) :: error
    type(test_problem) :: problem
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure

    call solve(cone, problem, optimum, failure)
    call check_success(error, failure)
    call check_that(error, optimum%objective, "<=", 1.0e-9_dp)
    call check_that(error, optimum%converged, "==", .false.)
    call check_that(error, optimum%evaluations, "<=", 250)
  end subroutine test_cone

  subroutine test_failures(error)
    type(error_type), allocatable, intent(out) :: error
    type(test_problem) :: problem
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: start(:)

    call problem_of(hs43, problem, start)
    problem%fails_at = 3
    call minimise(problem, start, usual, optimum, failure)
    call check_failure(error, failure, "the call that fails")
    problem%fails_at = 0
    call minimise(problem, start(:3), usual, optimum, failure)
    call check_failure(error, failure, "one lower and one upper bound")
    problem%lower(2) = 11
    call minimise(problem, start, usual, optimum, failure)
    call check_failure(error, failure, "bounds must be finite")
    call problem_of(ring, problem, start)
    call minimise(problem, [2.0_dp, 2.0_dp], usual, optimum, failure)
    call check_failure(error, failure, "cannot be computed at the start")
  end subroutine test_failures

end module test_minimax
