!> Searches for the best machine of a family from several starts, and proves that optima of convex problems are global.
!>
!> On rigid ground, samples of the shaking forces are linear in the mass m and the first moments m x, m y of each link, where (x,
!> y) is its centre of mass. Samples of the moment are linear in m and the moment of inertia J if the centre of mass of the link
!> is fixed. Norms of linear functions are convex, and so are sums and maxima of such norms.
!>
!> Let L be the Lagrangian of the problem (gestell_math_optimum_minimax). In the coordinates m, m x, m y or m, J it is convex, so
!> it is nowhere below its linearisation at the optimum. Expressed in m, x, y, this linearisation is linear in each variable, so
!> its minimum over their ranges is at a corner. No machine that meets the limits has an objective below this minimum. (J.
!> Verschuure, B. Demeulenaere, J. Swevers, J. De Schutter, J. Mech. Des. 130, 2008, 052301, use the same coordinates.)
!>
!> An optimum under a few operating conditions is also optimal under all conditions if none of the other conditions is worse at
!> this optimum. The search begins with the conditions that are worst at the start. After each optimisation it adds the conditions
!> that have become worse than those used, until there are none (exchange method of semi-infinite programming: R. Hettich, K. O.
!> Kortanek, SIAM Review 35, 1993, 380-429, doi 10.1137/1035089).
module gestell_study_design
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_optimum_minimax, only: minimise, optimum_type
  use gestell_study_design_goal, only: goal_type, machine_goal, shaking_goal
  use gestell_study_design_moments, only: new_moments
  use gestell_study_design_perturbed_members, only: mass_part, other_part, place_parts
  use gestell_study_design_problem, only: design_options, design_problem, evaluate_goals, goal_branches_type, inside, &
    & is_squared, decide_inversion
  use gestell_system_family, only: family_type
  implicit none (type, external)
  private

  public :: halton, is_convex, feasibility_options, bound_gap, prove_conflict, search_from

  !> Default tolerance of a search: it has converged if the remaining slope is smaller than this.
  real(dp), parameter :: default_tolerance = 1.0e-8_dp
  !> In a search over a range of conditions, a step is idle if it improves the objective by less than this fraction. A resonance
  !> at the end of the range makes idle steps frequent.
  real(dp), parameter :: worthwhile_gain = 1.0e-4_dp
  !> A search over a range ends after this number of successive idle steps (see `worthwhile_gain`).
  integer, parameter :: patience = 3
  !> For goals that are exact up to rounding, such as the mass: the limit counts as met if the goal exceeds it by less than this
  !> fraction of the limit.
  real(dp), parameter :: met = 1.0e-9_dp

contains

  !> Searches for a local optimum. If the search minimises the square of the objective (see `is_squared`), `optimum%slope` and
  !> `optimum%slack` refer to this square. Fails if the family has no machine with the parameters `start`, or if `minimise` fails.
  subroutine search_from(family, options, start, optimum, error, tolerance)
    !> The family of machines in which the best one is sought
    class(family_type), intent(in), target :: family
    !> Goals, conditions, and ranges of the parameters of the design
    type(design_options), intent(in) :: options
    !> Parameters at which the search starts
    real(dp), intent(in) :: start(:)
    type(optimum_type), intent(out) :: optimum
    type(error_type), allocatable, intent(out) :: error
    !> The search has converged if the remaining slope is below this value. Default: `default_tolerance`
    real(dp), intent(in), optional :: tolerance
    type(design_problem) :: problem
    real(dp), dimension(size(start)) :: corner
    real(dp) :: used_tolerance
    integer :: i

    problem%family => family
    problem%options = options
    problem%moments = new_moments(options%lower, options%upper, options%body, options%part)
    ! the extremes of the products of mass and position are at corners of the ranges
    problem%lower = problem%moments%from(options%lower)
    problem%upper = problem%lower
    do i = 1, 3
      corner = merge(options%upper, options%lower, merge(btest(i, 0), btest(i, 1), options%part == mass_part))
      problem%lower = min(problem%lower, problem%moments%from(corner))
      problem%upper = max(problem%upper, problem%moments%from(corner))
    end do
    problem%objectives = merge(1, size(options%objectives), options%largest)
    problem%constraints = size(options%constraints) + problem%moments%limits()
    problem%squared = is_squared(options)
    call decide_inversion(problem)
    used_tolerance = default_tolerance
    if (present(tolerance)) used_tolerance = tolerance
    if (allocated(options%range)) then
      problem%worth = worthwhile_gain
      problem%patience = patience
    end if
    call minimise_under_all(problem, options, start, used_tolerance, optimum, error)
    if (allocated(error)) return
    ! if a limit is steep at the start, the unit in which the search measures it may be far larger than the limit
    call judge_limits(problem, options%constraints, optimum)
    if (problem%inverted) then
      ! derivative of -1 / f: d(-1 / f) = df / f^2
      optimum%price = optimum%price / optimum%objective**2
      optimum%bound_price = optimum%bound_price / optimum%objective**2
      optimum%objective = -1 / optimum%objective - problem%shift
    end if
    if (.not. problem%squared) return
    ! derivative of the square: d(f^2) = 2 f df
    optimum%objective = sqrt(optimum%objective)
    if (.not. optimum%objective > 0) return
    optimum%price = optimum%price / (2 * optimum%objective)
    optimum%bound_price = optimum%bound_price / (2 * optimum%objective)
  end subroutine search_from

  !> Checks whether the optimum meets the limits. The search keeps a margin to each limit. A goal that is exact up to rounding,
  !> such as the mass, needs no margin and may equal its limit: with a margin, a limit equal to the smallest possible mass could not
  !> be met.
  pure subroutine judge_limits(problem, limits, optimum)
    type(design_problem), intent(in) :: problem
    type(goal_type), intent(in) :: limits(:)
    type(optimum_type), intent(inout) :: optimum
    logical :: exact(size(limits)), kept(size(limits))

    exact = limits%about == machine_goal
    associate (groups => optimum%groups(problem%objectives + 1:problem%objectives + size(limits)), &
      & coordinates => optimum%groups(problem%objectives + size(limits) + 1:))
      kept = groups <= inside * abs(limits%limit) .or. .not. abs(limits%limit) > 0
      where (exact) kept = groups <= inside * abs(limits%limit) + met * limits%scale()
      if (any(exact) .and. all(exact .or. abs(limits%limit) > 0)) optimum%feasible = optimum%feasible &
        & .or. all(coordinates <= met * maxval(abs(problem%upper)))
    end associate
    optimum%feasible = optimum%feasible .and. all(kept)
  end subroutine judge_limits

  !> Finds a local optimum under all conditions of `options`, and converts it from the coordinates of the search to the parameters.
  subroutine minimise_under_all(problem, options, start, tolerance, optimum, error)
    type(design_problem), intent(inout) :: problem
    type(design_options), intent(in) :: options
    real(dp), intent(in) :: start(:), tolerance
    type(optimum_type), intent(out) :: optimum
    type(error_type), allocatable, intent(out) :: error
    logical :: used(size(options%conditions)), more, known
    real(dp) :: x(size(start))
    !> Numbers of evaluations, gradients and iterations of all searches
    integer :: effort(3)

    x = start
    used = size(used) == 1 .or. allocated(options%range)
    if (.not. all(used)) call add_worse_conditions(problem%family, options, x, used, more, known, error)
    effort = [merge(0, 1, size(used) == 1), 0, 0]
    do
      if (allocated(error)) return
      problem%options%conditions = pack(options%conditions, used)
      call minimise(problem, problem%moments%from(x), tolerance, optimum, error)
      if (allocated(error)) return
      call problem%moments%turn_optimum(optimum)
      effort = effort + [optimum%evaluations, optimum%gradients, optimum%iterations]
      if (all(used)) exit
      call add_worse_conditions(problem%family, options, optimum%x, used, more, known, error)
      effort(1) = effort(1) + 1
      if (.not. more) exit
      x = start
      if (known) x = optimum%x
    end do
    optimum%evaluations = effort(1)
    optimum%gradients = effort(2)
    optimum%iterations = effort(3)
  end subroutine minimise_under_all

  !> Adds operating conditions to the set `used`, shape (conditions), according to the goals of the machine at x. If the set is
  !> empty, adds for each goal the condition under which the goal is worst. Otherwise adds the conditions that are worse than all
  !> used conditions and not better than the conditions next to them. `more`: true if conditions were added. `known`: false if no
  !> machine exists at x or it has no vibration; then all conditions are added. Fails if the goals are invalid.
  subroutine add_worse_conditions(family, options, x, used, more, known, error)
    class(family_type), intent(in) :: family
    type(design_options), intent(in) :: options
    real(dp), intent(in) :: x(:)
    logical, intent(inout) :: used(:)
    logical, intent(out) :: more, known
    type(error_type), allocatable, intent(out) :: error
    type(goal_type), allocatable :: goals(:)
    type(goal_branches_type) :: at
    real(dp) :: worst(size(used)), threshold
    logical :: before(size(used))
    integer :: c, g

    before = used
    goals = options%goals()
    call evaluate_goals(family, options, goals, x, .false., at, error)
    known = at%known
    if (.not. known) used = .true.
    do g = 1, size(goals)
      if (.not. known .or. allocated(error)) exit
      worst = [(maxval(at%side * (at%value - goals(g)%limit), mask=at%group == g .and. at%condition == c), c = 1, size(used))]
      if (.not. any(before)) then
        used(maxloc(worst, dim=1)) = .true.
        cycle
      end if
      ! a condition is added if the excess of the goal exceeds this threshold
      threshold = maxval(worst, mask=before) + inside * maxval(abs(at%value), mask=at%group == g) / 1000
      if (g > size(options%objectives)) threshold = max(threshold, 0.0_dp)
      do c = 1, size(worst)
        used(c) = used(c) .or. (worst(c) > threshold .and. worst(c) >= maxval(worst(max(1, c - 1):min(c + 1, size(worst)))))
      end do
    end do
    more = any(used .neqv. before)
  end subroutine add_worse_conditions

  !> True if the problem is convex in the masses and first moments of the links. `limits`: if true, only the constraints are
  !> examined.
  pure logical function is_convex(options, limits)
    type(design_options), intent(in) :: options
    logical, intent(in), optional :: limits
    logical :: places, is_whole_link

    is_whole_link = .true.
    if (present(limits)) is_whole_link = .not. limits
    places = any(options%part == place_parts(1)) .or. any(options%part == place_parts(2))
    is_convex = all(options%part /= other_part) .and. all(goal_is_convex(options%constraints, .false.))
    if (is_convex .and. is_whole_link) is_convex = all(goal_is_convex(options%objectives, .true.))

  contains

    !> True if the goal is convex (as an upper limit or an objective) or concave (as a lower limit). The mass is both convex and
    !> concave.
    elemental logical function goal_is_convex(goal, is_objective)
      type(goal_type), intent(in) :: goal
      logical, intent(in) :: is_objective

      goal_is_convex = (goal%about == machine_goal .and. goal%measure%quantity == "added_mass") .or. (goal%about == shaking_goal &
        & .and. (goal%sense > 0 .or. is_objective) .and. .not. (places .and. index(goal%measure%quantity, "shaking.m") == 1))
    end function goal_is_convex

  end function is_convex

  !> Tries to prove that no machine in the ranges meets all limits. The search begins at `start` and minimises the largest
  !> relative excess over a limit. `excess` is the minimum found, reduced by the bound on its distance from the global minimum
  !> (see `bound_gap`). If `excess` > 0, every machine violates a limit; otherwise nothing is proved. The proof requires that the
  !> limits define a convex set.
  subroutine prove_conflict(family, options, start, excess, error)
    !> The family of machines
    class(family_type), intent(in) :: family
    !> Limits of the goals, and ranges of the parameters
    type(design_options), intent(in) :: options
    !> Parameters at which the search starts
    real(dp), intent(in) :: start(:)
    !> Lower bound on the largest relative excess over a limit, for every machine in the ranges
    real(dp), intent(out) :: excess
    type(error_type), allocatable, intent(out) :: error
    type(design_options) :: limits
    type(optimum_type) :: optimum

    call feasibility_options(options, limits)
    excess = 0
    call search_from(family, limits, start, optimum, error)
    if (.not. allocated(error)) excess = optimum%objective - bound_gap(limits, optimum)
  end subroutine prove_conflict

  !> Creates a design whose only objective is the largest relative excess over the limits of `options`.
  subroutine feasibility_options(options, limits)
    type(design_options), intent(in) :: options
    type(design_options), intent(out) :: limits

    limits = options
    limits%largest = .true.
    limits%objectives = options%constraints
    limits%constraints = options%constraints(:0)
    limits%objectives%weight = 1 / options%constraints%scale()
  end subroutine feasibility_options

  !> Bound on the gap between an optimum and the global optimum of a convex problem: no machine that meets the limits has an
  !> objective that is smaller by more than `gap`.
  pure real(dp) function bound_gap(options, optimum) result(gap)
    type(design_options), intent(in) :: options
    type(optimum_type), intent(in) :: optimum
    integer :: i, j, k, mass, place(2), corner
    real(dp) :: m, x(2), least, slope_m, slope_x(2), there

    gap = max(optimum%slack, 0.0_dp)
    do i = 1, size(options%body)
      ! visit each link only once: at the first of its parameters
      if (any(options%body(:i - 1) == options%body(i))) cycle
      mass = 0
      place = 0
      least = 0
      do k = i, size(options%body)
        if (options%body(k) /= options%body(i)) cycle
        if (options%part(k) == mass_part) then
          mass = k
        else if (any(options%part(k) == place_parts)) then
          j = findloc(place_parts, options%part(k), dim=1)
          place(j) = k
        else
          least = least + min(optimum%slope(k) * (options%lower(k) - optimum%x(k)), &
            & optimum%slope(k) * (options%upper(k) - optimum%x(k)))
        end if
      end do
      m = 1
      x = 0
      slope_m = 0
      slope_x = 0
      if (mass > 0) m = optimum%x(mass)
      do j = 1, 2
        if (place(j) == 0) cycle
        x(j) = optimum%x(place(j))
        if (m > 0) slope_x(j) = optimum%slope(place(j)) / m
      end do
      if (mass > 0) slope_m = optimum%slope(mass) - dot_product(slope_x, x)
      there = minval([(change_at_corner(corner), corner = 0, 7)])
      if (.not. m > 0 .and. any(place > 0)) there = -huge(there)
      gap = gap - min(least + there, 0.0_dp)
    end do
    if (is_squared(options)) gap = optimum%objective - sqrt(max(0.0_dp, optimum%objective**2 - gap))

  contains

    !> Change of the linearised Lagrangian from the optimum to one corner of the ranges of a link's parameters.
    pure real(dp) function change_at_corner(corner) result(change)
      integer, intent(in) :: corner
      real(dp) :: mass_there, place_there(2)
      integer :: c

      mass_there = m
      place_there = x
      if (mass > 0) mass_there = merge(options%upper(mass), options%lower(mass), btest(corner, 0))
      do c = 1, 2
        if (place(c) > 0) place_there(c) = merge(options%upper(place(c)), options%lower(place(c)), btest(corner, c))
      end do
      change = slope_m * (mass_there - m) + dot_product(slope_x, mass_there * place_there - m * x)
    end function change_at_corner

  end function bound_gap

  !> The n-th point of Halton's sequence in the unit cube. Each parameter has its own base (J. H. Halton, Numer. Math. 2, 1960,
  !> 84-90).
  pure function halton(n, parameters) result(point)
    integer, intent(in) :: n, parameters
    real(dp) :: point(parameters)
    integer, parameter :: primes(40) = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, &
      & 89, 97, 101, 103, 107, 109, 113, 127, 131, 137, 139, 149, 151, 157, 163, 167, 173]
    real(dp) :: part
    integer :: i, left

    do i = 1, parameters
      point(i) = 0
      part = 1
      left = n
      do while (left > 0)
        part = part / primes(i)
        point(i) = point(i) + part * modulo(left, primes(i))
        left = left / primes(i)
      end do
    end do
  end function halton

end module gestell_study_design
