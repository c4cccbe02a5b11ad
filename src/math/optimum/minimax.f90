!> Minimise sums of greatest values under limits of greatest values, by sequential quadratic programming.
!>
!> A group's value is phi_g(x) = max over its branches of f_b(x). With the exact penalty (Fletcher, Practical Methods of
!> Optimization, 2nd ed., section 14.3)
!>
!>     Phi(x) = sum over objectives of phi_g + sum over constraints of w_g max(0, phi_g)                             (1)
!>
!> a constraint is a group like others, with one more branch, 0, so every quadratic program has a solution: the step d minimises
!> Phi with the branches linearised about x, plus d' B d / 2, within the bounds. Its multipliers lambda_b >= 0 are those of the
!> branches. w_g grows tenfold until the step brings the violation down almost as far as any could (Byrd, Nocedal, Waltz, Optim.
!> Methods Softw. 23, 2008, 197-213, doi 10.1080/10556780701394169), and falls towards twice the price where limits can be met. B,
!> the Hessian of the Lagrangian L = sum of lambda_b f_b, is learned by damped BFGS (Powell, Lecture Notes in Mathematics 630,
!> 1978, 144-157, doi 10.1007/BFb0067703). A step has to bring Phi down, near an optimum below the greatest of its last three
!> values only, so that curved limits do not cut the full steps that converge superlinearly (Maratos' effect); a correction of
!> second order would need to know which branch is which (Zhou, Tits, J. Optim. Theory Appl. 76, 1993, 455-476, doi
!> 10.1007/BF00939377).
module gestell_math_optimum_minimax
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: unit_matrix
  use gestell_math_optimum_quadratic_program, only: solve_quadratic_program
  use gestell_math_optimum_scaled, only: branches_type, greatest_by_group, minimax_problem, point_type, scaled_type, &
    & sums_by_group
  implicit none (type, external)
  private

  public :: branches_type, minimax_problem, minimise

  type, public :: optimum_type
    !> The point, and the value of each group there.
    real(dp), allocatable :: x(:), groups(:)
    !> Shape (constraints): the sum of the multipliers of the group's branches, >= 0: what the optimum falls by where the limit is
    !> wider by one. Of a limit that cannot be met it is a weight only.
    real(dp), allocatable :: price(:)
    !> Shape (parameters): dL/dx of those at a bound that holds them: > 0 at the lower, < 0 at the upper, 0 in between; of
    !> fixed ones dL/dx of either sign.
    real(dp), allocatable :: bound_price(:)
    !> dL/dx, shape (parameters), zero of fixed ones, and what the objective is above L: by that branches with multipliers miss
    !> their groups' values.
    real(dp), allocatable :: slope(:)
    real(dp) :: slack = 0
    !> The sum of the objectives; the greatest constraint where that is > 0, else 0.
    real(dp) :: objective = 0, violation = 0
    !> How far the conditions of Karush, Kuhn and Tucker are missed, relative to the objective: the larger of
    !> max over i of |s_i - mid(0, s_i - dL/ds_i / S, 1)| with s_i = (x_i - lower_i) / (upper_i - lower_i), and
    !> sum over b of lambda_b (max(phi_g, 0 for constraints) - f_b) / S; S is |objective| + max over b, i of lambda_b |df_b/ds_i|,
    !> and a thousandth of the objective's size at the start at least. No unit and no scale changes it.
    real(dp) :: stationarity = huge(1.0_dp)
    !> Where all branches are convex and all limits are met, no point has an objective below (1 - gap) of this one, or, where that
    !> is small, below it by `gap` thousandths of the objective's size at the start: L is convex and, as lambda >= 0, nowhere in
    !> the limits above the objective; it lies above its tangent, whose least value in the box is known (Boyd, Vandenberghe,
    !> Convex Optimization, 2004, sections 5.1.3 and 5.5.1):
    !> gap = objective - sum of lambda_b f_b + sum over i of max over the box of -dL/dx_i (xi_i - x_i), divided by |objective|.
    real(dp) :: gap = huge(1.0_dp)
    !> Steps; evaluations in all and those with gradients.
    integer :: iterations = 0, evaluations = 0, gradients = 0
    !> Whether stationarity is within the tolerance; whether the limits are met, to the tolerance times their sizes at the start.
    logical :: converged = .false., feasible = .false.
  end type optimum_type

  !> The search: the weights w, 1 of objectives, and B of the parameters that are not fixed.
  type, extends(scaled_type) :: search_type
    real(dp), allocatable :: weight(:), hessian(:, :)
    !> The values of the groups at the last points.
    real(dp), allocatable :: past(:, :)
    !> Whether B is more than a guess; whether the full step is likely to be taken, so that gradients are asked for at once.
    logical :: learned = .false., full = .true.
  end type search_type

  !> The greatest and the least weight; a group's violation, and a part of Phi, that rounding errors may make; the shortest
  !> part of a step; the norm below which a step counts as zero.
  real(dp), parameter :: heaviest = 1.0e6_dp, lightest = 0.01_dp
  real(dp), parameter :: nothing = 1.0e-11_dp, noise = 1.0e-13_dp, shortest = 1.0e-9_dp, standstill = 1.0e-10_dp
  !> The least size of the objective, in parts of that at the start, that numbers are relative to.
  real(dp), parameter :: floor_of_size = 1.0e-3_dp

contains

  !> A local minimum from `start`, which is moved into the bounds. `tolerance`: of the stationarity, 1e-8 is usual; where
  !> rounding errors do not allow that, the best point is returned, not `converged`; nor can an optimum be where a norm is zero,
  !> which has no gradient there (its square has one). Limits that cannot be met: a point where the sum of their violations, each
  !> in parts of its limit's size at the start, is least. Errors: bounds that are not finite or lower > upper; the problem cannot be
  !> evaluated at the start; what `evaluate` reports.
  subroutine minimise(problem, start, tolerance, optimum, error)
    class(minimax_problem), intent(inout) :: problem
    real(dp), intent(in) :: start(:), tolerance
    type(optimum_type), intent(out) :: optimum
    type(error_type), allocatable, intent(out) :: error
    type(search_type) :: search
    type(point_type) :: here, there, best
    type(optimum_type) :: now
    real(dp), allocatable :: d(:), lambda(:)
    real(dp) :: descent, relief, lower, rounding
    integer :: iteration, idle

    call search%begin(problem, start, here, error)
    if (allocated(error)) return
    search%weight = spread(1.0_dp, 1, size(search%unit))
    call guess(search, here)
    best = here
    search%past = reshape(here%greatest, [size(here%greatest), 1])
    idle = 0
    do iteration = 0, 100 + 10 * size(start)
      call find_step(search, here, d, lambda, descent, relief)
      call judge(problem, search, here, lambda, tolerance, now)
      now%iterations = iteration
      now%converged = now%stationarity <= tolerance .and. relief <= tolerance
      lower = phi(search, best%greatest) - phi(search, here%greatest)
      rounding = noise_of(phi(search, best%greatest))
      idle = idle + 1
      if (lower > max(rounding, problem%worth * abs(phi(search, best%greatest))) .and. norm2(here%s - best%s) > standstill) idle = 0
      if (now%stationarity < 0.5_dp * optimum%stationarity .and. .not. problem%worth > 0) idle = 0
      if (now%converged .or. lower > rounding .or. (lower >= -rounding .and. now%stationarity < optimum%stationarity)) then
        optimum = now
        best = here
      end if
      if (now%converged .or. idle > problem%patience) exit
      call walk(problem, search, here, d, descent, there, error)
      if (allocated(error)) return
      if (there%known) then
        call learn(search, here, there, lambda)
        here = there
        search%past = reshape([here%greatest, search%past], [size(best%greatest), min(3, size(search%past, 2) + 1)])
      else if (search%learned) then
        call guess(search, here)
      else
        exit
      end if
    end do
    optimum%evaluations = search%evaluations
    optimum%gradients = search%gradients
  end subroutine minimise

  !> Values of the groups as Phi counts them.
  pure function counted(search, greatest) result(top)
    type(search_type), intent(in) :: search
    real(dp), intent(in) :: greatest(:)
    real(dp) :: top(size(greatest))

    top = greatest
    top(search%objectives + 1:) = max(0.0_dp, greatest(search%objectives + 1:))
  end function counted

  !> Phi of (1).
  pure real(dp) function phi(search, greatest)
    type(search_type), intent(in) :: search
    real(dp), intent(in) :: greatest(:)

    phi = dot_product(search%weight, counted(search, greatest))
  end function phi

  !> What rounding errors may make of Phi.
  pure real(dp) function noise_of(merit)
    real(dp), intent(in) :: merit

    noise_of = noise * max(floor_of_size, abs(merit))
  end function noise_of

  !> B as long as nothing is known of it: a step within the box.
  subroutine guess(search, here)
    type(search_type), intent(inout) :: search
    type(point_type), intent(in) :: here
    real(dp) :: steep

    steep = maxval([0.0_dp, abs(here%slope(search%free, maxloc(here%value, 1, here%group <= search%objectives)))])
    if (.not. steep > 0) steep = 1
    search%hessian = 5 * steep * unit_matrix(size(search%free))
    search%learned = .false.
  end subroutine guess

  !> The step `d`, the multipliers of the branches here, what Phi falls by in the linearised branches (`descent` < 0), and by how
  !> much the violation does (`relief`).
  subroutine find_step(search, here, d, lambda, descent, relief)
    type(search_type), intent(inout) :: search
    type(point_type), intent(in) :: here
    real(dp), allocatable, intent(out) :: d(:), lambda(:)
    real(dp), intent(out) :: descent, relief
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
    before = sum(max(0.0_dp, here%greatest(m + 1:)))
    call solve(search%weight)
    if (allocated(error)) then
      ! Rounding errors have brought B out of use.
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
    descent = dot_product(search%weight, counted(search, model()) - counted(search, here%greatest))
    relief = before - violation()

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

    !> Values of the groups in the linearised branches after the step.
    function model() result(greatest)
      real(dp) :: greatest(size(search%unit))

      greatest = greatest_by_group(here%value + matmul(step, slope(:, :branches)), here%group, size(greatest))
    end function model

    real(dp) function violation()
      real(dp) :: greatest(size(search%unit))

      greatest = model()
      violation = sum(max(0.0_dp, greatest(m + 1:)))
    end function violation

  end subroutine find_step

  !> From here along `d` to a point that is low enough, with gradients; .not. there%known: there is none.
  subroutine walk(problem, search, here, d, descent, there, error)
    class(minimax_problem), intent(inout) :: problem
    type(search_type), intent(inout) :: search
    type(point_type), intent(in) :: here
    real(dp), intent(in) :: d(:), descent
    type(point_type), intent(out) :: there
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: length, reference, rise
    integer :: k

    reference = phi(search, here%greatest)
    if (-descent < 0.01_dp * abs(reference)) reference = maxval([(phi(search, search%past(:, k)), k = 1, size(search%past, 2))])
    length = 1
    do while (length > shortest .and. descent < noise_of(reference))
      call search%look(problem, here%s + length * d, search%full, there, error)
      if (allocated(error)) return
      if (there%known) then
        associate (found => phi(search, there%greatest))
          if (found <= reference + 1.0e-4_dp * length * descent + noise_of(reference)) then
            if (.not. search%full) call search%look(problem, here%s + length * d, .true., there, error)
            search%full = length >= 1
            return
          end if
          ! The least of the parabola through both ends.
          rise = found - phi(search, here%greatest) - length * descent
          length = length * min(0.5_dp, max(0.1_dp, -0.5_dp * length * descent / rise))
        end associate
      else
        length = 0.25_dp * length
      end if
      search%full = .false.
    end do
    there%known = .false.
  end subroutine walk

  !> B by damped BFGS: the change of the gradient of L over the step from here to there, at least a fifth of what B has along it.
  subroutine learn(search, here, there, lambda)
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
  end subroutine learn

  !> The branch there that branch `b` here has become: its gradients at both ends tell its change of value best, and differ least.
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

  !> What is to be told of a point with these multipliers.
  subroutine judge(problem, search, here, lambda, tolerance, now)
    class(minimax_problem), intent(in) :: problem
    type(search_type), intent(in) :: search
    type(point_type), intent(in) :: here
    real(dp), intent(in) :: lambda(:), tolerance
    type(optimum_type), intent(out) :: now
    real(dp) :: top(size(search%unit)), prices(size(search%unit)), objective, slack, scale
    real(dp), dimension(size(here%s)) :: slope
    integer :: m

    m = search%objectives
    top = counted(search, here%greatest)
    objective = sum(top(:m))
    now%x = search%place(problem, here%s)
    now%groups = here%greatest * search%unit
    now%objective = sum(now%groups(:m))
    now%violation = maxval([0.0_dp, now%groups(m + 1:)])
    now%feasible = all(here%greatest(m + 1:) <= tolerance)
    prices = sums_by_group(lambda, here%group, size(search%unit)) * search%unit(1) / search%unit
    now%price = prices(m + 1:)
    ! dL/ds, and what is missing for each branch with a multiplier to be its group's value.
    slope = matmul(here%slope, lambda)
    slack = dot_product(lambda, top(here%group) - here%value)
    ! Where a bound holds a parameter.
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
  end subroutine judge

end module gestell_math_optimum_minimax
