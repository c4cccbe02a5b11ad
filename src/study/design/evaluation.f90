!> Evaluates the goals of a design under one operating condition. A goal such as a peak is the maximum of several smooth functions,
!> called branches. The module computes the values and derivatives of the branches.
module gestell_study_design_evaluation
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_optimum_minimax, only: branches_type
  use gestell_model_frame, only: frame_type
  use gestell_study_design_branches, only: measure_branches
  use gestell_study_design_coordinates, only: coordinates_type, find_coordinates
  use gestell_study_design_goal, only: components, goal_type, machine_goal, multiplier_goal, plain_values, sample_goals
  use gestell_study_design_motion, only: derivative_tolerance, get_neighbour, motion_type
  use gestell_study_design_perturbed_members, only: at_condition, condition_type, members_type, setting_type, step_type
  use gestell_study_design_separation, only: find_branches, separation_type
  implicit none (type, external)
  private

  public :: add_condition, add_maximum, no_branches

  !> A range of conditions, for example all speeds between a minimum and a maximum speed.
  type, abstract, public :: range_type
    !> If the excess of a goal over its limit is larger than this value, the excess need not be exact; shape (goals). If
    !> unallocated, exact values are always needed
    real(dp), allocatable :: enough(:)
  contains
    procedure(find_tops), deferred :: find_tops
  end type range_type

  !> A maximum of a goal over a range: the condition, and the excess of the goal under this condition.
  type, public :: top_type
    !> The condition under which the goal is worst
    type(condition_type) :: condition
    !> `goal`: number of the goal. `line`: number of the line of conditions on which the maximum lies. Along a line through the
    !> range, one quantity varies
    integer :: goal = 0, line = 0
    !> Excess of the goal over its limit
    real(dp) :: excess = 0
    !> True if the maximum is inside the line of conditions, false if it is at one of the line's ends
    logical :: inside = .false.
    !> The motion under a similar condition, if known. From this motion the search for the motion under `condition` starts
    type(motion_type) :: motion
  end type top_type

  !> Options of a design. The objective is the weighted sum of the `objectives` or, if `largest` is true, the largest of their
  !> weighted values.
  type, extends(setting_type), public :: design_options
    type(goal_type), allocatable :: objectives(:), constraints(:)
    logical :: largest = .false.
    !> Conditions under which each machine is evaluated
    type(condition_type), allocatable :: conditions(:)
    !> The range of conditions. If allocated, it replaces `conditions`
    class(range_type), allocatable :: range
    !> Lower and upper limits of the parameters, shape (parameters)
    real(dp), allocatable :: lower(:), upper(:)
    !> `body`: index of the first parameter that belongs to the same link. `part`: property of the link that the parameter changes.
    !> Both have shape (parameters)
    integer, allocatable :: body(:), part(:)
    !> Index of the link that each parameter changes, shape (parameters); 0 if the parameter does not belong to one link. If
    !> unallocated, a machine with a changed parameter is always built from the input again
    integer, allocatable :: link(:)
    !> Unit of each parameter, as a multiple of the SI unit; shape (parameters)
    real(dp), allocatable :: unit(:)
  contains
    procedure :: steps, goals, combined
  end type design_options

  !> Branches of several goals under several conditions.
  type, extends(branches_type), public :: goal_branches_type
    !> `condition`: number of the condition. `side`: 1 if the branch is compared with an upper limit, -1 if with a lower limit. Both
    !> have shape (branches)
    integer, allocatable :: condition(:), side(:)
  end type goal_branches_type

  !> Branches of one goal under one condition.
  type :: goal_values_type
    !> `values`: values of the branches, shape (values). `changes`: their derivatives, shape (parameters, values)
    real(dp), allocatable :: values(:), changes(:, :)
    !> Column 1: true if the value is compared with an upper limit. Column 2: true if it is compared with a lower limit. Shape
    !> (values, 2)
    logical, allocatable :: sides(:, :)
  end type goal_values_type

  abstract interface
    !> Finds those maxima of each goal over the range that are close to the goal's worst value. Fails if the goals are invalid.
    subroutine find_tops(self, members, goals, tops, known, error)
      import :: error_type, goal_type, members_type, range_type, top_type
      implicit none (type, external)
      !> The range of conditions over which maxima are sought
      class(range_type), intent(in) :: self
      !> The machine whose goals are evaluated
      type(members_type), intent(in) :: members
      type(goal_type), intent(in) :: goals(:)
      !> The maxima that were found
      type(top_type), allocatable, intent(out) :: tops(:)
      !> True if the machine has a vibration under all conditions of the range
      logical, intent(out) :: known
      type(error_type), allocatable, intent(out) :: error
    end subroutine find_tops
  end interface

contains

  !> Steps of the parameters for derivatives by finite differences, shape (parameters).
  pure function steps(self)
    class(design_options), intent(in) :: self
    type(step_type) :: steps(size(self%lower))

    steps%range = self%upper - self%lower
    if (.not. allocated(self%link)) return
    steps%link = self%link
    steps%part = self%part
    steps%unit = self%unit
  end function steps

  !> The goals of the design: first the objectives, then the constraints.
  pure function goals(self)
    class(design_options), intent(in) :: self
    type(goal_type) :: goals(size(self%objectives) + size(self%constraints))

    goals(:size(self%objectives)) = self%objectives
    goals(size(self%objectives) + 1:) = self%constraints
  end function goals

  !> Value of the objective, combined from the values of the goals in `objectives`.
  pure real(dp) function combined(self, values)
    class(design_options), intent(in) :: self
    real(dp), intent(in) :: values(:)

    combined = sum(self%objectives%weight * values)
    if (self%largest) combined = maxval(self%objectives%weight * values)
  end function combined

  !> Creates an empty list of branches for a design with this number of parameters.
  pure function no_branches(parameters) result(branches)
    integer, intent(in) :: parameters
    type(goal_branches_type) :: branches

    allocate(branches%group(0), branches%condition(0), branches%side(0), branches%value(0), branches%slope(parameters, 0))
  end function no_branches

  !> Adds the branches of the goals under one condition to the list `at`. Fails if a goal is invalid or its derivatives cannot be
  !> computed.
  subroutine add_condition(members, motion, goals, condition, at, error)
    !> The machine, and its neighbours with one parameter changed each
    type(members_type), intent(in) :: members
    !> The motion of the machine under the condition
    type(motion_type), intent(in) :: motion
    !> The goals whose branches are added
    type(goal_type), intent(in) :: goals(:)
    !> Number of the condition, which is stored with each branch
    integer, intent(in) :: condition
    !> List to which the branches under this condition are added
    type(goal_branches_type), intent(inout) :: at
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: samples(size(motion%phases), components(motion%frame), size(goals))
    real(dp), allocatable :: slopes(:, :, :, :)
    type(goal_values_type) :: goal_values(size(goals))
    integer :: g

    allocate(slopes(size(samples, 1), size(samples, 2), size(goals), motion%parameters()), source=0.0_dp)
    if (any(goals%is_periodic())) then
      call sample_goals(goals, motion%frame, members%setting%probes, motion%phases, motion%q, samples, error)
      if (.not. allocated(error)) call differentiate_samples(members, motion, goals, samples, slopes, error)
      if (allocated(error)) return
    end if
    do g = 1, size(goals)
      select case (goals(g)%about)
      case (multiplier_goal)
        call differentiate_multipliers(members, motion, goal_values(g)%values, goal_values(g)%changes, error)
      case (machine_goal)
        call differentiate_plain(members, motion, goals(g), goal_values(g)%values, goal_values(g)%changes, error)
      case default
        call measure_branches(goals(g)%measure%kind, goals(g)%measure%band, motion%frame%period, samples(:, :, g), &
          & slopes(:, :, g, :), goal_values(g)%values, goal_values(g)%changes)
      end select
      if (allocated(error)) return
      goal_values(g)%sides = goals(g)%sides(goal_values(g)%values)
    end do
    call append_all(at, condition, goal_values)
  end subroutine add_condition

  !> Adds the branches of a goal at one of its maxima over the range of conditions. For a maximum at the end of a line all
  !> branches are added. For a maximum inside a line only the highest branch is added: near a resonance each branch has its
  !> maximum at a different speed, so the values of the other branches at this speed say little about their maxima. Fails if the
  !> goal is invalid.
  subroutine add_maximum(members, motion, goal, top, number, at, error)
    !> The machine, and its neighbours with one parameter changed each
    type(members_type), intent(in) :: members
    !> The motion of the machine at the maximum
    type(motion_type), intent(in) :: motion
    !> The goal whose maximum is added
    type(goal_type), intent(in) :: goal
    !> The maximum of the goal over the range
    type(top_type), intent(in) :: top
    !> Number of the condition, which is stored with each branch
    integer, intent(in) :: number
    !> List to which the branches are added
    type(goal_branches_type), intent(inout) :: at
    type(error_type), allocatable, intent(out) :: error
    type(goal_branches_type) :: there
    integer, allocatable :: counts(:)
    integer :: i

    there = no_branches(size(at%slope, 1))
    call add_condition(members, motion, [goal], number, there, error)
    if (allocated(error)) return
    counts = [(i, i = 1, size(there%value))]
    if (top%inside) counts = [maxloc(there%side * (there%value - goal%limit), dim=1)]
    call append(at, spread(top%goal, 1, size(counts)), number, there%side(counts), there%value(counts), there%slope(:, counts))
  end subroutine add_maximum

  !> Adds the branches of all goals under a condition at once. Adding them one by one would copy the list each time.
  pure subroutine append_all(at, condition, goal_values)
    type(goal_branches_type), intent(inout) :: at
    integer, intent(in) :: condition
    type(goal_values_type), intent(in) :: goal_values(:)
    integer, allocatable :: group(:), side(:)
    real(dp), allocatable :: value(:), slope(:, :)
    integer :: g, i, k, s

    k = sum([(count(goal_values(g)%sides), g = 1, size(goal_values))])
    allocate(group(k), side(k), value(k))
    allocate(slope(size(at%slope, 1), k), source=0.0_dp)
    k = 0
    do g = 1, size(goal_values)
      do s = 1, 2
        do i = 1, size(goal_values(g)%values)
          if (.not. goal_values(g)%sides(i, s)) cycle
          k = k + 1
          group(k) = g
          side(k) = 3 - 2 * s
          value(k) = goal_values(g)%values(i)
          slope(:size(goal_values(g)%changes, 1), k) = goal_values(g)%changes(:, i)
        end do
      end do
    end do
    call append(at, group, condition, side, value, slope)
  end subroutine append_all

  !> Appends the branches of goals under one condition to the list `at`.
  pure subroutine append(at, group, condition, side, value, slope)
    type(goal_branches_type), intent(inout) :: at
    integer, intent(in) :: group(:), condition, side(:)
    real(dp), intent(in) :: value(:), slope(:, :)

    at%group = [at%group, group]
    at%condition = [at%condition, spread(condition, 1, size(group))]
    at%side = [at%side, side]
    at%value = [at%value, value]
    at%slope = reshape([at%slope, slope], [size(slope, 1), size(at%value)])
  end subroutine append

  !> Computes the derivatives of the samples of the goals with respect to the parameters, shape (phases, components, goals,
  !> parameters). They are differences between the machine and its neighbours, which have one parameter changed each.
  subroutine differentiate_samples(members, motion, goals, samples, slopes, error)
    type(members_type), intent(in) :: members
    type(motion_type), intent(in) :: motion
    type(goal_type), intent(in) :: goals(:)
    real(dp), intent(in) :: samples(:, :, :)
    real(dp), intent(out) :: slopes(:, :, :, :)
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), allocatable :: frame
    real(dp) :: q(size(motion%phases), size(motion%q, 2), 0:2), other(size(samples, 1), size(samples, 2), size(goals))
    integer :: i, k

    do k = 1, size(slopes, 4)
      slopes(:, :, :, k) = members%weight(0, k) * samples
      do i = 1, 2
        call get_neighbour(members, motion%frame, motion, k, i, frame, q)
        call sample_goals(goals, frame, members%setting%probes, motion%phases, q, other, error)
        if (allocated(error)) return
        slopes(:, :, :, k) = slopes(:, :, :, k) + members%weight(i, k) * other
      end do
    end do
  end subroutine differentiate_samples

  !> Computes the moduli of the multipliers, shape (states), and their derivatives, shape (parameters, states). If the motion has
  !> no derivatives, the number of parameters is 0. A change dA of the equations x' = A x changes the i-th multiplier rho_i by
  !>
  !>     d ln rho_i = integral over the period of [W dA P]_ii,
  !>
  !> where the columns of P are the periodic parts of the free vibrations and W = P^-1 (gestell_study_design_coordinates; A. P.
  !> Seyranian, A. A. Mailybaev, Multiparameter Stability Theory with Mechanical Applications, 2003, chapter 9). The integrand is
  !> periodic, so its mean over equidistant phases is exact up to the orders that the phases resolve. Because the period T may
  !> change too, A T is differentiated instead of A. Fails if the free vibrations are too fast for the period or multipliers
  !> coincide.
  subroutine differentiate_multipliers(members, motion, moduli, changes, error)
    type(members_type), intent(in) :: members
    type(motion_type), intent(in) :: motion
    real(dp), allocatable, intent(out) :: moduli(:), changes(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(coordinates_type) :: free
    class(frame_type), allocatable :: frame
    real(dp), dimension(motion%frame%states, motion%frame%states, size(motion%phases)) :: a, other
    real(dp) :: q(size(motion%phases), size(motion%q, 2), 0:2)
    logical :: fits
    integer :: i, j, k, n

    n = motion%frame%states
    call find_coordinates(motion%frame, size(motion%phases), derivative_tolerance(members%setting%accuracy), free, fits, &
      & motion%quick)
    if (.not. fits) then
      call fatal_error(error, "the derivatives of the multipliers cannot be computed", failed_computation)
      return
    end if
    moduli = exp(real(free%lambda) * free%period)
    allocate(changes(motion%parameters(), n), source=0.0_dp)
    do k = 1, size(changes, 1)
      ! d(T A)/dp, where the system is linearised about the motion
      call motion%frame%sample(motion%phases, a)
      a = members%weight(0, k) * motion%frame%period * a
      do i = 1, 2
        call get_neighbour(members, motion%frame, motion, k, i, frame, q)
        call frame%sample(motion%phases, other)
        a = a + members%weight(i, k) * frame%period * other
      end do
      do j = 1, size(a, 3)
        do i = 1, n
          changes(k, i) = changes(k, i) + real(sum(free%w(i, :, j) / free%scale * matmul(a(:, :, j), free%scale * free%p(:, i, j))))
        end do
      end do
      changes(k, :) = moduli * changes(k, :) / size(a, 3)
    end do
  end subroutine differentiate_multipliers

  !> Computes a goal that is a property of the machine, such as the mass, and its derivatives, shape (parameters, values). Fails
  !> if `find_branches` fails.
  subroutine differentiate_plain(members, motion, goal, values, changes, error)
    type(members_type), intent(in) :: members
    type(motion_type), intent(in) :: motion
    type(goal_type), intent(in) :: goal
    real(dp), allocatable, intent(out) :: values(:), changes(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: run
    type(separation_type) :: branches
    real(dp), allocatable :: other(:)
    integer :: i, k

    call at_condition(members%frame, motion%condition, run)
    if (goal%is_minimum()) call find_branches(run, goal%speeds, branches, error)
    if (allocated(error)) return
    call plain_values(goal, run, branches, values)
    allocate(changes(motion%parameters(), size(values)))
    do k = 1, size(changes, 1)
      changes(k, :) = members%weight(0, k) * values
      do i = 1, 2
        call at_condition(members%perturbed(i, k), motion%condition, run)
        call plain_values(goal, run, branches, other)
        changes(k, :) = changes(k, :) + members%weight(i, k) * other
      end do
    end do
  end subroutine differentiate_plain

end module gestell_study_design_evaluation
