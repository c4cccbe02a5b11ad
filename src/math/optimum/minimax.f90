!> Minimises a sum of maxima subject to upper limits on other maxima, by sequential quadratic programming.
!>
!> Smooth functions f_b(x), called branches, form groups. The value phi_g(x) of group g is the maximum of its branches. Some groups
!> are objectives, the others are constraints. The search minimises the exact penalty function (Fletcher, Practical Methods of
!> Optimization, 2nd ed., section 14.3)
!>
!>     Phi(x) = sum over objectives of phi_g + sum over constraints of w_g max(0, phi_g).                            (1)
!>
!> In the quadratic program a constraint is a group with an additional branch of value 0, so that a solution always exists. The step
!> d minimises Phi with branches linearised about x, plus d' B d / 2, within the bounds. The multipliers lambda_b >= 0 of this
!> program are the multipliers of the branches.
!>
!> The weight w_g grows tenfold until the step reduces the violation almost as far as possible (Byrd, Nocedal, Waltz, Optim. Methods
!> Softw. 23, 2008, 197-213, doi 10.1080/10556780701394169). If the limits can be met, w_g decreases towards twice the price of the
!> constraint, which is the sum of the multipliers of its branches. B approximates the Hessian of the Lagrangian L = sum of lambda_b
!> f_b by damped BFGS updates (Powell, Lecture Notes in Mathematics 630, 1978, 144-157, doi 10.1007/BFb0067703).
!>
!> A step must reduce Phi. Near an optimum Phi need only be below the maximum of its last three values, so that curved limits do not
!> shorten the full steps, which converge superlinearly (Maratos effect). The alternative, a second-order correction, would have to
!> match the branches of two points (Zhou, Tits, J. Optim. Theory Appl. 76, 1993, 455-476, doi 10.1007/BF00939377).
module gestell_math_optimum_minimax
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: unit_matrix
  use gestell_math_optimum_quadratic_program, only: solve_quadratic_program
  use gestell_math_optimum_scaled, only: branches_type, largest_by_group, minimax_problem, point_type, scaled_type, sums_by_group
  implicit none (type, external)
  private

  public :: branches_type, minimax_problem, minimise

  !> Result of a minimisation
  type, public :: optimum_type
    !> `x`: the best point, shape (parameters). `groups`: value of each group at this point, shape (groups).
    real(dp), allocatable :: x(:), groups(:)
    !> Price of each constraint, shape (constraints): the ratio of the decrease of the minimum to a small relaxation of the limit.
    !> The price is the sum of the multipliers of the group's branches, so it is never negative. For a limit that cannot be met the
    !> number is only a weight.
    real(dp), allocatable :: price(:)
    !> Price of each bound, shape (parameters). If a bound is active, the price is the derivative dL/dx of the Lagrangian, which
    !> is positive at the lower bound and negative at the upper bound. Between the bounds it is 0. For a fixed parameter it is
    !> dL/dx with either sign.
    real(dp), allocatable :: bound_price(:)
    !> Derivative dL/dx of the Lagrangian, shape (parameters); zero for fixed parameters
    real(dp), allocatable :: slope(:)
    !> Objective minus the Lagrangian L; positive if branches with positive multipliers lie below the value of their group
    real(dp) :: slack = 0
    !> `objective`: sum of the values of the objectives. `violation`: largest value of a constraint, or 0 if no constraint is
    !> positive.
    real(dp) :: objective = 0, violation = 0
    !> Residual of the Karush-Kuhn-Tucker conditions relative to the objective (dimensionless): the larger of
    !>
    !>     max over i of |s_i - mid(0, s_i - dL/ds_i / S, 1)|, s_i = (x_i - lower_i) / (upper_i - lower_i), and
    !>     sum over b of lambda_b (max(phi_g, 0 for constraints) - f_b) / S.
    !>
    !> L is the Lagrangian; branch b has the value f_b and the multiplier lambda_b, and phi_g is the value of its group. The scale
    !> S is |objective| + max over b, i of lambda_b |df_b/ds_i|, but at least a thousandth of the objective's size at the start.
    !> The residual does not depend on units or scaling.
    real(dp) :: stationarity = huge(1.0_dp)
    !> Bound on the possible improvement, valid if all branches are convex and all limits are met: no point has an objective below
    !> (1 - gap) times the result. If the objective is small, `gap` is relative to a thousandth of the objective's size at the
    !> start.
    !>
    !> The Lagrangian L = sum of lambda_b f_b is convex, and within the limits it never exceeds the objective, because lambda >=
    !> 0. L lies above its tangent plane at the result x, whose minimum over all points xi between the bounds is known (Boyd,
    !> Vandenberghe, Convex Optimization, 2004, sections 5.1.3 and 5.5.1):
    !>
    !>     gap = (objective - sum of lambda_b f_b + sum over i of max over xi_i of -dL/dx_i (xi_i - x_i)) / |objective|.
    real(dp) :: gap = huge(1.0_dp)
    !> `iterations`: number of steps. `evaluations`: number of all evaluations. `gradients`: number of evaluations with gradients.
    integer :: iterations = 0, evaluations = 0, gradients = 0
    !> `converged`: true if the stationarity is at most the tolerance and no step can reduce the violation by more than the
    !> tolerance. `feasible`: true if no limit is exceeded by more than the tolerance times the size of the limit at the start.
    logical :: converged = .false., feasible = .false.
  end type optimum_type

  !> State of the search: scaling, weights of the groups (1 for objectives), and the approximate Hessian of the Lagrangian for the
  !> parameters that are not fixed
  type, extends(scaled_type) :: search_type
    real(dp), allocatable :: weight(:), hessian(:, :)
    !> Values of the groups at the latest points, at most three points; shape (groups, points)
    real(dp), allocatable :: past(:, :)
    !> `learned`: true if at least one step has contributed to the approximate Hessian. `full`: true if the full step will
    !> probably be accepted; gradients are then requested together with the values.
    logical :: learned = .false., full = .true.
  end type search_type

  !> Maximum and minimum of the weights of constraints
  real(dp), parameter :: heaviest = 1.0e6_dp, lightest = 0.01_dp
  !> `nothing`: rounding error in the violation of a group. `noise`: relative rounding error in the penalty function. `shortest`:
  !> minimum fraction of a step. `standstill`: norm below which a step counts as zero.
  real(dp), parameter :: nothing = 1.0e-11_dp, noise = 1.0e-13_dp, shortest = 1.0e-9_dp, standstill = 1.0e-10_dp
  !> Minimum of the scale S by which optimality residuals are divided, as a fraction of the objective's size at the start
  real(dp), parameter :: floor_of_size = 1.0e-3_dp

contains

  !> Finds a local minimum. If the start lies outside the bounds, it is moved to them.
  !>
  !> If rounding errors prevent convergence, the best point is returned and `converged` is false. The same happens if the optimum
  !> is at a zero of a norm, where the norm has no gradient; minimise the square of the norm instead. If the limits cannot be met,
  !> the result minimises the sum of their violations, each divided by the size of the limit at the start. Fails if bounds are not
  !> finite or lower > upper, the problem cannot be evaluated at the start, or `evaluate` fails.
  subroutine minimise(problem, start, tolerance, optimum, error)
    !> The problem; its procedure `evaluate` may change it
    class(minimax_problem), intent(inout) :: problem
    !> `start`: starting point, shape (parameters). `tolerance`: tolerance of the stationarity, usually 1e-8.
    real(dp), intent(in) :: start(:), tolerance
    !> The best point, with its values, prices and optimality conditions
    type(optimum_type), intent(out) :: optimum
    type(error_type), allocatable, intent(out) :: error
    type(search_type) :: search
    type(point_type) :: here, there, best
    type(optimum_type) :: now
    real(dp), allocatable :: d(:), lambda(:)
    real(dp) :: descent, violation_decrease, lower, rounding
    integer :: iteration, idle_steps

    call search%begin(problem, start, here, error)
    if (allocated(error)) return
    search%weight = spread(1.0_dp, 1, size(search%unit))
    call guess(search, here)
    best = here
    search%past = reshape(here%maximum, [size(here%maximum), 1])
    idle_steps = 0
    do iteration = 0, 100 + 10 * size(start)
      call find_step(search, here, d, lambda, descent, violation_decrease)
      call assess_point(problem, search, here, lambda, tolerance, now)
      now%iterations = iteration
      now%converged = now%stationarity <= tolerance .and. violation_decrease <= tolerance
      lower = phi(search, best%maximum) - phi(search, here%maximum)
      rounding = rounding_of(phi(search, best%maximum))
      idle_steps = idle_steps + 1
      if (lower > max(rounding, problem%worth * abs(phi(search, best%maximum))) .and. norm2(here%s &
        & - best%s) > standstill) idle_steps = 0
      if (now%stationarity < 0.5_dp * optimum%stationarity .and. .not. problem%worth > 0) idle_steps = 0
      if (now%converged .or. lower > rounding .or. (lower >= -rounding .and. now%stationarity < optimum%stationarity)) then
        optimum = now
        best = here
      end if
      if (now%converged .or. idle_steps > problem%patience) exit
      call line_search(problem, search, here, d, descent, there, error)
      if (allocated(error)) return
      if (there%known) then
        call update_hessian(search, here, there, lambda)
        here = there
        search%past = reshape([here%maximum, search%past], [size(best%maximum), min(3, size(search%past, 2) + 1)])
      else if (search%learned) then
        call guess(search, here)
      else
        exit
      end if
    end do
    optimum%evaluations = search%evaluations
    optimum%gradients = search%gradients
  end subroutine minimise

  !> Values of the groups as they enter the penalty function: negative values of constraints are replaced by 0.
  pure function counted(search, maximum) result(top)
    type(search_type), intent(in) :: search
    real(dp), intent(in) :: maximum(:)
    real(dp) :: top(size(maximum))

    top = maximum
    top(search%objectives + 1:) = max(0.0_dp, maximum(search%objectives + 1:))
  end function counted

  !> Phi of (1).
  pure real(dp) function phi(search, maximum)
    type(search_type), intent(in) :: search
    real(dp), intent(in) :: maximum(:)

    phi = dot_product(search%weight, counted(search, maximum))
  end function phi

  !> Estimated rounding error of the penalty function Phi at a point where Phi has the value `merit`.
  pure real(dp) function rounding_of(merit)
    real(dp), intent(in) :: merit

    rounding_of = noise * max(floor_of_size, abs(merit))
  end function rounding_of

  !> Initialises the approximate Hessian. It is chosen so that the first step changes no parameter by more than a fifth of its
  !> range, for the objective with the steepest gradient.
  subroutine guess(search, here)
    type(search_type), intent(inout) :: search
    type(point_type), intent(in) :: here
    real(dp) :: steep

    steep = maxval([0.0_dp, abs(here%slope(search%free, maxloc(here%value, 1, here%group <= search%objectives)))])
    if (.not. steep > 0) steep = 1
    search%hessian = 5 * steep * unit_matrix(size(search%free))
    search%learned = .false.
  end subroutine guess

  !> Computes the next step `d` by the quadratic program, and adjusts the weights of the constraints.
  subroutine find_step(search, here, d, lambda, descent, violation_decrease)
    type(search_type), intent(inout) :: search
    type(point_type), intent(in) :: here
    !> `d`: step, shape (parameters). `lambda`: multipliers of the branches, shape (branches).
    real(dp), allocatable, intent(out) :: d(:), lambda(:)
    !> `descent`: change of the penalty function that the linearised branches predict; it is negative. `violation_decrease`:
    !> predicted decrease of the violation.
    real(dp), intent(out) :: descent, violation_decrease
    type(error_type), allocatable :: error
    real(dp), allocatable :: slope(:, :), multiplier(:), value(:), prices(:)
    integer, allocatable :: group(:)
    real(dp) :: allowed, before, least, step(size(search%free))
    integer :: branches, constraints, g, i, m, n

    m = search%objectives
    constraints = size(search%unit) - m
    branches = size(here%value)
    n = size(search%free)
    group = [here%group, (m + g, g = 1, constraints), (0, i = 1, 2 * n)]
    value = [here%value, (0.0_dp, g = 1, constraints), -here%s(search%free), here%s(search%free) - 1]
    allocate(slope(n, size(value)), multiplier(size(value)), source=0.0_dp)
    slope(:, :branches) = here%slope(search%free, :)
    do i = 1, n
      slope(i, branches + constraints + i) = -1
      slope(i, branches + constraints + n + i) = 1
    end do
    before = sum(max(0.0_dp, here%maximum(m + 1:)))
    call solve(search%weight)
    if (allocated(error)) then
      ! Rounding errors have made B useless.
      call guess(search, here)
      call solve(search%weight)
    end if
    if (violation() > nothing) then
      call solve([(0.0_dp, g = 1, m), (heaviest, g = 1, constraints)])
      least = violation()
      allowed = nothing
      if (least > nothing) allowed = nothing + least + 0.1_dp * max(0.0_dp, before - least)
      call solve(search%weight)
      do while (violation() > allowed .and. maxval(search%weight) < heaviest)
        search%weight(m + 1:) = 10 * maxval(search%weight(m + 1:))
        call solve(search%weight)
      end do
    end if
    prices = sums_by_group(multiplier(:branches), here%group, m + constraints)
    prices = prices(m + 1:)
    if (violation() <= nothing) search%weight(m + 1:) = min(search%weight(m + 1:), &
      & max(0.5_dp * search%weight(m + 1:), 2 * prices, lightest))
    allocate(d(size(here%s)), source=0.0_dp)
    d(search%free) = step
    lambda = multiplier(:branches)
    descent = dot_product(search%weight, counted(search, model()) - counted(search, here%maximum))
    violation_decrease = before - violation()

  contains

    subroutine solve(weights)
      real(dp), intent(in) :: weights(:)

      call solve_quadratic_program(search%hessian, weights, group, value, slope, step, multiplier, error)
      associate (s => here%s(search%free), first => branches + constraints)
        step = min(max(step, -s), 1 - s)
        where (multiplier(first + 1:first + n) > 0) step = -s
        where (multiplier(first + n + 1:) > 0) step = 1 - s
      end associate
    end subroutine solve

    !> Values of the groups after the step, as predicted by the linearised branches.
    function model() result(maximum)
      real(dp) :: maximum(size(search%unit))

      maximum = largest_by_group(here%value + matmul(step, slope(:, :branches)), here%group, size(maximum))
    end function model

    real(dp) function violation()
      real(dp) :: maximum(size(search%unit))

      maximum = model()
      violation = sum(max(0.0_dp, maximum(m + 1:)))
    end function violation

  end subroutine find_step

  !> Searches along the step `d`, beginning at point `here`, for a point with a sufficiently low value of the penalty function.
  !> `there`: this point, with its gradients. If the search fails, `there%known` is false.
  subroutine line_search(problem, search, here, d, descent, there, error)
    class(minimax_problem), intent(inout) :: problem
    type(search_type), intent(inout) :: search
    type(point_type), intent(in) :: here
    real(dp), intent(in) :: d(:), descent
    type(point_type), intent(out) :: there
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: length, reference, rise
    integer :: k

    reference = phi(search, here%maximum)
    if (-descent < 0.01_dp * abs(reference)) reference = maxval([(phi(search, search%past(:, k)), k = 1, size(search%past, 2))])
    length = 1
    do while (length > shortest .and. descent < rounding_of(reference))
      call search%evaluate_point(problem, here%s + length * d, search%full, there, error)
      if (allocated(error)) return
      if (there%known) then
        associate (found => phi(search, there%maximum))
          if (found <= reference + 1.0e-4_dp * length * descent + rounding_of(reference)) then
            if (.not. search%full) call search%evaluate_point(problem, here%s + length * d, .true., there, error)
            search%full = length >= 1
            return
          end if
          ! Minimum of the parabola through both ends with the slope at the start.
          rise = found - phi(search, here%maximum) - length * descent
          length = length * min(0.5_dp, max(0.1_dp, -0.5_dp * length * descent / rise))
        end associate
      else
        length = 0.25_dp * length
      end if
      search%full = .false.
    end do
    there%known = .false.
  end subroutine line_search

  !> Updates the approximate Hessian by the damped BFGS formula, from the change of the Lagrangian's gradient between `here` and
  !> `there`. The curvature along the step falls to no less than a fifth of its old value.
  subroutine update_hessian(search, here, there, lambda)
    type(search_type), intent(inout) :: search
    type(point_type), intent(in) :: here, there
    real(dp), intent(in) :: lambda(:)
    real(dp), dimension(size(search%free)) :: step, change, bs
    real(dp) :: curvature, sbs, theta, guessed
    integer :: b, n

    n = size(search%free)
    step = there%s(search%free) - here%s(search%free)
    change = 0
    do b = 1, size(lambda)
      if (.not. lambda(b) > 0) cycle
      change = change + lambda(b) * (there%slope(search%free, same_branch(here, b, there)) - here%slope(search%free, b))
    end do
    curvature = dot_product(step, change)
    if (norm2(step) < standstill) return
    if (.not. search%learned .and. curvature > 0) then
      guessed = search%hessian(1, 1)
      search%hessian = min(max(dot_product(change, change) / curvature, 1.0e-4_dp * guessed), 1.0e4_dp * guessed) * unit_matrix(n)
    end if
    search%learned = .true.
    bs = matmul(search%hessian, step)
    sbs = dot_product(step, bs)
    theta = 1
    if (curvature < 0.2_dp * sbs) theta = 0.8_dp * sbs / (sbs - curvature)
    change = theta * change + (1 - theta) * bs
    search%hessian = search%hessian - spread(bs / sbs, 2, n) * spread(bs, 1, n) &
      & + spread(change / dot_product(step, change), 2, n) * spread(change, 1, n)
  end subroutine update_hessian

  !> Index of the branch at `there` that continues branch `b` of `here`. Of all branches in the same group, it is the one with the
  !> smallest sum of two errors: the change of the gradient (times the step), and the error with which the mean of both gradients
  !> predicts the change of the value.
  pure integer function same_branch(here, b, there) result(best)
    type(point_type), intent(in) :: here, there
    integer, intent(in) :: b
    real(dp) :: miss, least, d(size(here%s))
    integer :: c

    d = there%s - here%s
    best = 1
    least = huge(least)
    do c = 1, size(there%value)
      if (there%group(c) /= here%group(b)) cycle
      miss = norm2(there%slope(:, c) - here%slope(:, b)) * norm2(d) &
        & + abs(there%value(c) - here%value(b) - 0.5_dp * dot_product(there%slope(:, c) + here%slope(:, b), d))
      if (miss >= least) cycle
      least = miss
      best = c
    end do
  end function same_branch

  !> Computes properties of a point from the multipliers of its branches: prices, residual of the optimality conditions, and gap.
  subroutine assess_point(problem, search, here, lambda, tolerance, now)
    class(minimax_problem), intent(in) :: problem
    type(search_type), intent(in) :: search
    type(point_type), intent(in) :: here
    real(dp), intent(in) :: lambda(:), tolerance
    type(optimum_type), intent(out) :: now
    real(dp) :: top(size(search%unit)), prices(size(search%unit)), objective, slack, scale
    real(dp), dimension(size(here%s)) :: slope
    integer :: m

    m = search%objectives
    top = counted(search, here%maximum)
    objective = sum(top(:m))
    now%x = search%place(problem, here%s)
    now%groups = here%maximum * search%unit
    now%objective = sum(now%groups(:m))
    now%violation = maxval([0.0_dp, now%groups(m + 1:)])
    now%feasible = all(here%maximum(m + 1:) <= tolerance)
    prices = sums_by_group(lambda, here%group, size(search%unit)) * search%unit(1) / search%unit
    now%price = prices(m + 1:)
    ! dL/ds, and the weighted distance of the branches with multipliers from the value of their group.
    slope = matmul(here%slope, lambda)
    slack = dot_product(lambda, top(here%group) - here%value)
    ! Prices of the bounds that are active.
    now%bound_price = merge(slope, 0.0_dp, (here%s <= 0 .and. slope > 0) .or. (here%s >= 1 .and. slope < 0) &
      & .or. problem%lower >= problem%upper) * search%unit(1) / search%span
    now%slope = spread(0.0_dp, 1, size(slope))
    now%slope(search%free) = slope(search%free) * search%unit(1) / search%span(search%free)
    now%slack = (objective - dot_product(lambda, here%value)) * search%unit(1)
    associate (s => here%s(search%free), sloping => slope(search%free))
      scale = max(floor_of_size, abs(objective) + maxval([0.0_dp, abs(here%slope(search%free, :)) &
        & * spread(lambda, 1, size(search%free))]))
      now%stationarity = max(slack / scale, maxval([0.0_dp, abs(s - min(1.0_dp, max(0.0_dp, s - sloping / scale)))]))
      now%gap = (objective - dot_product(lambda, here%value) + sum(max(s * sloping, -(1 - s) * sloping))) &
        & / max(floor_of_size, abs(objective))
    end associate
  end subroutine assess_point

end module gestell_math_optimum_minimax
