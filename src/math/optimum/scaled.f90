!> Scales a minimax problem: parameters run from 0 to 1 between their bounds, and values are divided by their sizes at the start.
!> The search therefore does not depend on units.
module gestell_math_optimum_scaled
  use gestell_base_error, only: error_type, failed_computation, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: largest_by_group, sums_by_group

  !> Functions of a problem at a point. Each function, called a branch, belongs to a group; the value of a group is the maximum of
  !> its branches.
  type, public :: branches_type
    !> Number of the group to which each branch belongs, shape (branches); every group has at least one branch
    integer, allocatable :: group(:)
    !> `value`: values, shape (branches). `slope`: gradients, shape (parameters, branches), allocated if requested.
    real(dp), allocatable :: value(:), slope(:, :)
    !> False if the functions cannot be evaluated at this point; the search then shortens its step.
    logical :: known = .true.
  end type branches_type

  !> Minimax problem: minimise the sum of the values of groups 1 .. objectives. The values of groups objectives + 1 .. objectives +
  !> constraints must be at most 0, and lower <= x <= upper.
  type, abstract, public :: minimax_problem
    !> `objectives`: number of objectives. `constraints`: number of constraints
    integer :: objectives = 1, constraints = 0
    !> Bounds, shape (parameters), finite. A parameter with equal bounds is fixed.
    real(dp), allocatable :: lower(:), upper(:)
    !> Minimum relative improvement of a useful step; a step with less improvement counts as idle
    real(dp) :: worth = 0
    !> Number of successive idle steps (improvement below `worth`) after which the search ends
    integer :: patience = 15
  contains
    procedure(evaluate_at), deferred :: evaluate
  end type minimax_problem

  abstract interface
    !> Evaluates the branches at `x`, and their gradients if requested. The number and order of the branches may differ from point
    !> to point. If a value is not finite, the point is treated as if it could not be evaluated. An error ends the search.
    subroutine evaluate_at(self, x, gradients, at, error)
      import :: branches_type, dp, error_type, minimax_problem
      implicit none (type, external)
      class(minimax_problem), intent(inout) :: self
      real(dp), intent(in) :: x(:)
      logical, intent(in) :: gradients
      type(branches_type), intent(out) :: at
      type(error_type), allocatable, intent(out) :: error
    end subroutine evaluate_at
  end interface

  !> A point s of the scaled problem, with components between 0 and 1, and the results of evaluating it: values and gradients of all
  !> branches, and the value of each group. All of them are in scaled units
  type, public :: point_type
    !> `s`: the point, shape (parameters). `value`: values, shape (branches). `slope`: gradients, shape (parameters, branches).
    !> `maximum`: value of each group, shape (groups).
    real(dp), allocatable :: s(:), value(:), slope(:, :), maximum(:)
    !> For each branch, the number of the group to which it belongs, shape (branches)
    integer, allocatable :: group(:)
    !> False if the functions cannot be evaluated at this point
    logical :: known = .false.
  end type point_type

  !> Scaling x = lower + span s of the parameters; span is 1 for fixed parameters
  type, public :: scaled_type
    !> Number of objectives
    integer :: objectives = 0
    !> `span`: differences of the bounds, shape (parameters). `unit`: units of the values, shape (groups).
    real(dp), allocatable :: span(:), unit(:)
    !> Indices of the parameters that are not fixed
    integer, allocatable :: free(:)
    !> `evaluations`: number of evaluations so far. `gradients`: number of evaluations with gradients.
    integer :: evaluations = 0, gradients = 0
  contains
    procedure :: begin, evaluate_point, place
  end type scaled_type

contains

  !> Determines the scaling and evaluates the start. Fails if the number of bounds is wrong, a bound is not finite, lower > upper,
  !> or the problem cannot be evaluated at the start.
  subroutine begin(self, problem, start, here, error)
    class(scaled_type), intent(out) :: self
    class(minimax_problem), intent(inout) :: problem
    real(dp), intent(in) :: start(:)
    !> The starting point with the values and gradients of its branches, in scaled units
    type(point_type), intent(out) :: here
    type(error_type), allocatable, intent(out) :: error
    integer :: first(problem%objectives + problem%constraints), g, b, i

    if (any([size(problem%lower), size(problem%upper)] /= size(start))) then
      call fatal_error(error, "there must be one lower and one upper bound for each parameter", invalid_input)
      return
    end if
    if (.not. (all(ieee_is_finite([problem%lower, problem%upper, start])) .and. all(problem%lower <= problem%upper))) then
      call fatal_error(error, "the bounds must be finite, and no lower bound may exceed its upper bound", invalid_input)
      return
    end if
    self%objectives = problem%objectives
    self%span = problem%upper - problem%lower
    self%free = pack([(i, i = 1, size(start))], self%span > 0)
    where (.not. self%span > 0) self%span = 1
    allocate(self%unit(problem%objectives + problem%constraints), source=1.0_dp)
    call self%evaluate_point(problem, (min(max(start, problem%lower), problem%upper) - problem%lower) / self%span, .true., here, &
      & error)
    if (allocated(error)) return
    if (.not. here%known) then
      call fatal_error(error, "the objectives cannot be computed at the start", failed_computation)
      return
    end if
    first = 0
    do b = size(here%value), 1, -1
      g = here%group(b)
      if (.not. here%value(b) < here%maximum(g)) first(g) = b
    end do
    do g = 1, size(self%unit)
      b = first(g)
      self%unit(g) = max(abs(here%value(b)), maxval(abs(here%slope(self%free, b))))
    end do
    self%unit(:problem%objectives) = maxval(self%unit(:problem%objectives))
    where (.not. self%unit > 0) self%unit = 1
    here%maximum = here%maximum / self%unit
    here%value = here%value / self%unit(here%group)
    here%slope = here%slope / spread(self%unit(here%group), 1, size(start))
  end subroutine begin

  !> Evaluates the branches at the point `s`. The point and the results are in scaled units.
  subroutine evaluate_point(self, problem, s, gradients, there, error)
    class(scaled_type), intent(inout) :: self
    class(minimax_problem), intent(inout) :: problem
    !> Point in scaled units. Components outside [0, 1] are replaced by the nearest bound
    real(dp), intent(in) :: s(:)
    !> If true, also compute gradients
    logical, intent(in) :: gradients
    !> The evaluated point; `known` is false if a value is not finite or a group has no branch
    type(point_type), intent(out) :: there
    type(error_type), allocatable, intent(out) :: error
    type(branches_type) :: at
    logical :: has_branch(size(self%unit))

    there%s = min(max(s, 0.0_dp), 1.0_dp)
    self%evaluations = self%evaluations + 1
    if (gradients) self%gradients = self%gradients + 1
    call problem%evaluate(self%place(problem, there%s), gradients, at, error)
    if (allocated(error) .or. .not. at%known) return
    has_branch = .false.
    has_branch(at%group) = .true.
    there%known = all(ieee_is_finite(at%value)) .and. all(has_branch)
    if (there%known .and. gradients) there%known = all(ieee_is_finite(at%slope))
    if (.not. there%known) return
    there%group = at%group
    there%value = at%value / self%unit(at%group)
    there%maximum = largest_by_group(there%value, at%group, size(self%unit))
    if (gradients) there%slope = at%slope * spread(self%span, 2, size(at%value)) / spread(self%unit(at%group), 1, size(s))
  end subroutine evaluate_point

  !> For each group, the maximum of `number` over its branches; shape (groups).
  pure function largest_by_group(number, group, groups) result(maximum)
    real(dp), intent(in) :: number(:)
    integer, intent(in) :: group(:), groups
    real(dp) :: maximum(groups)
    integer :: b

    maximum = -huge(maximum)
    do b = 1, size(number)
      maximum(group(b)) = max(maximum(group(b)), number(b))
    end do
  end function largest_by_group

  !> For each group, the sum of `number` over its branches; shape (groups).
  pure function sums_by_group(number, group, groups) result(sums)
    real(dp), intent(in) :: number(:)
    integer, intent(in) :: group(:), groups
    real(dp) :: sums(groups)
    integer :: b

    sums = 0
    do b = 1, size(number)
      sums(group(b)) = sums(group(b)) + number(b)
    end do
  end function sums_by_group

  !> Parameters x that belong to the scaled point `s`. Rounding errors never move them outside the bounds.
  pure function place(self, problem, s) result(x)
    class(scaled_type), intent(in) :: self
    class(minimax_problem), intent(in) :: problem
    real(dp), intent(in) :: s(:)
    real(dp) :: x(size(s))

    x = max(problem%lower, min(problem%upper, problem%lower + self%span * s))
    where (s >= 1) x = problem%upper
  end function place

end module gestell_math_optimum_scaled
