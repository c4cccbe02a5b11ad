!> Follows the vibrations of a frame in the exact model over the whole range of one parameter. The result is the list of their
!> branches.
module gestell_task_boundary_vibrations
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_series_trigonometric, only: series_type
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_task_boundary_branch, only: branch_type, lies_on_any
  use gestell_task_boundary_line, only: border_options, parameter_at
  use gestell_task_common_executor, only: executor_type, distribute_over, work_type
  use gestell_task_common_record, only: record_type
  use gestell_system_family, only: family_type, create_member
  use gestell_system_periodic, only: periodic_system
  use gestell_study_frame_model, only: settle
  use gestell_study_grid, only: axis_type
  use gestell_study_frame_model_newton, only: first_samples, values_of
  use gestell_study_frame_model_path, only: advance, first_point, furthest_turn, iterate_type, motion_of, next_iterate, &
    & path_family_type, point_type, units_of
  implicit none (type, external)
  private

  public :: bare_frame, trace_branches

  !> Family of machines that depend on one parameter. The parameter lambda of the path is the coordinate u on the parameter's axis
  !> (gestell_task_boundary_line).
  type, extends(path_family_type) :: line_path_type
    !> Family of frames that are not yet linearised about a vibration.
    class(family_type), pointer :: bare => null()
    type(axis_type) :: axis
    !> Distributes the work over threads. The threads may request members of `bare` at the same time.
    class(executor_type), pointer :: executor => null()
  contains
    procedure :: member, solve_both
  end type line_path_type

  !> Parallel work: pieces 1 and 2 each compute a Newton iterate from the motion `q`, at the first and at the second value of
  !> lambda in `ends`.
  type, extends(work_type) :: iterates_type
    type(line_path_type) :: family
    real(dp), allocatable :: q(:, :)
    real(dp) :: ends(2) = 0
    type(iterate_type) :: next(2)
  contains
    procedure :: compute, exchange
  end type iterates_type

  !> Points of a path, in the order in which they were computed.
  type :: trail_type
    integer :: count = 0
    !> Points of the path. Only the first `count` elements are used.
    type(point_type), allocatable :: points(:)
    !> `arcs`: length of the arc that leads to each point. `errors`: errors of lambda at the points that are turning points.
    real(dp), allocatable :: arcs(:), errors(:)
    !> True if the continuation failed, so that the path ends neither at an end of the range nor on a known branch.
    logical :: lost = .true.
  contains
    procedure :: add
  end type trail_type

  !> Lengths of an arc (one step along a path of vibrations): the first length, the maximum and the minimum.
  real(dp), parameter :: short_arc = 1.0e-3_dp, long_arc = 0.05_dp, min_arc = 1.0e-9_dp
  !> Maximum number of steps along a path, and maximum number of linear systems that are solved for it.
  integer, parameter :: max_steps = 3000, max_systems = 20000

  !> Text of the progress display while vibrations are followed.
  character(len=*), parameter :: following = "following vibrations"

contains

  !> Finds the branches over the range of `axis`. At each of the ascending coordinates `starts` the vibration is computed. A
  !> vibration on a known branch is skipped. Any other vibration is followed in both directions and around turning points until
  !> the path leaves the range, meets a known branch, or the continuation fails.
  subroutine trace_branches(bare, axis, options, starts, branches)
    !> Family of frames that are not yet linearised about a vibration
    class(family_type), intent(in), target :: bare
    type(axis_type), intent(in) :: axis
    !> Accuracy of the vibrations, and the executor that distributes the work
    type(border_options), intent(in) :: options
    !> Coordinates u of the parameter at which vibrations are computed first, ascending from 0 to 1
    real(dp), intent(in) :: starts(:)
    type(branch_type), allocatable, intent(out) :: branches(:)
    type(line_path_type) :: family
    class(frame_type), allocatable :: frame, settled
    type(error_type), allocatable :: error
    type(trail_type) :: down, up
    real(dp), allocatable :: q(:, :)
    integer :: i, samples

    allocate(branches(0))
    family%bare => bare
    family%axis = axis
    family%accuracy = options%accuracy
    family%executor => options%executor
    family%difference = 1.0e-5_dp
    family%precise = 1.0e-11_dp
    family%multipliers = .true.
    family%close = 1.0e-5_dp
    family%last_lambda = 1
    do i = 1, size(starts)
      call bare_frame(bare, [parameter_at(axis, starts(i))], frame, error)
      if (.not. allocated(error)) call settle(frame, "exact", options%accuracy, settled, error)
      if (allocated(error)) cycle
      family%units = units_of(frame)
      family%left = max_systems
      select type (settled)
      class is (varied_frame_type)
        if (.not. settled%newton) cycle
        if (lies_on_any(branches, starts(i), settled%motion)) cycle
        samples = max(first_samples, 2 * ubound(settled%motion%cosine, 1) + 2)
        q = values_of(settled%motion, samples) / spread(family%units, 1, samples)
      end select
      call follow_path(family, q, starts(i), -1, branches, down)
      call follow_path(family, q, starts(i), 1, branches, up)
      call add_branches(family, down, up, branches)
    end do
    if (associated(options%executor)) call options%executor%show(following, 1.0_dp)
  end subroutine trace_branches

  !> Follows the path of vibrations from the motion `q` at lambda = `start` until it meets one of the `branches`, leaves the range,
  !> or the continuation fails. `direction`: direction of lambda at the start, 1 upward or -1 downward.
  subroutine follow_path(family, q, start, direction, branches, trail)
    type(line_path_type), intent(inout) :: family
    real(dp), intent(in) :: q(:, :), start
    integer, intent(in) :: direction
    type(branch_type), intent(in) :: branches(:)
    type(trail_type), intent(out) :: trail
    type(point_type) :: at, next
    type(error_type), allocatable :: error
    real(dp), allocatable :: angles(:, :), before(:, :)
    real(dp) :: arc, rest, allowed, target
    logical :: easy, refused
    integer :: k

    call first_point(family, q, start, direction, at, error)
    if (allocated(error)) return
    ! Each step adds its end point, and a turning point before it if there is one.
    allocate(trail%points(2 * max_steps + 2), trail%arcs(0), trail%errors(0))
    call trail%add(at, 0.0_dp, 0.0_dp)
    angles = family%angles
    arc = short_arc
    do k = 1, max_steps
      if (associated(family%executor)) call family%executor%show(following, at%lambda)
      target = merge(1.0_dp, 0.0_dp, at%rise > 0)
      if (abs(target - at%lambda) <= short_arc) then
        ! The path is complete if its last point lies exactly at the end of the range.
        trail%lost = abs(target - at%lambda) > 0
        if (.not. trail%lost) return
        arc = (target - at%lambda) / at%rise
        call first_point(family, at%q + arc * at%along, target, merge(1, -1, at%rise > 0), next, error)
        trail%lost = allocated(error)
        if (.not. trail%lost) call trail%add(next, arc, 0.0_dp)
        return
      end if
      arc = min(arc, abs((target - at%lambda) / at%rise))
      call advance(family, at, arc, next, easy, error)
      refused = allocated(error)
      if (.not. refused) refused = next%lambda > 1 .or. next%lambda < 0
      if (refused) then
        arc = arc / 4
        if (arc < min_arc) return
        cycle
      end if
      call move_alloc(angles, before)
      angles = family%angles
      ! No step may jump across a resonance, where the argument of a multiplier passes through zero. The arguments are assumed to
      ! change as on the last arc. Each may change by half of its value or, if the decay is larger, by half of the decay.
      allowed = huge(allowed)
      if (size(before) == size(angles) .and. size(angles) > 0) allowed = max(arc / 4, minval(0.5_dp &
        & * max(angles(:, 1), angles(:, 2)) * arc / max(abs(angles(:, 1) - before(:, 1)), tiny(arc))))
      rest = arc
      if (at%rise * next%rise < 0) call add_turning_point(family, at, next, rest, trail)
      call trail%add(next, rest, 0.0_dp)
      at = next
      trail%lost = .not. lies_on_any(branches, at%lambda, motion_of(family, at%q))
      if (.not. trail%lost) return
      arc = min(merge(2 * arc, arc, easy), long_arc, allowed)
      if (family%turn(at%q) > furthest_turn) return
    end do
  end subroutine follow_path

  !> Adds the turning point on the arc between two points to `trail`, by the secant method for the zero of d(lambda)/ds, where s
  !> is the arc length. `arc`: on entry the length of the whole arc, on return the length of the part after the turning point.
  subroutine add_turning_point(family, from, to, arc, trail)
    type(line_path_type), intent(inout) :: family
    type(point_type), intent(in) :: from, to
    real(dp), intent(inout) :: arc
    type(trail_type), intent(inout) :: trail
    integer, parameter :: max_iterations = 20
    real(dp), parameter :: flat = 1.0e-7_dp, inside = 0.02_dp
    type(point_type) :: middle, best
    type(error_type), allocatable :: error
    real(dp) :: low, high, slope_low, slope_high, x, turn
    logical :: easy
    integer :: k

    low = 0
    high = arc
    slope_low = from%rise
    slope_high = to%rise
    turn = arc / 2
    best%rise = huge(x)
    do k = 1, max_iterations
      x = slope_low / (slope_low - slope_high)
      ! If the system at this point cannot be solved, try a point beside it.
      if (allocated(error)) x = 0.5_dp + 0.3_dp / k
      x = low + min(max(x, inside), 1 - inside) * (high - low)
      call advance(family, from, x, middle, easy, error)
      if (allocated(error)) cycle
      if (abs(middle%rise) < abs(best%rise)) then
        best = middle
        turn = x
      end if
      if (middle%rise * from%rise > 0) then
        low = x
        slope_low = middle%rise
      else
        high = x
        slope_high = middle%rise
      end if
      if (abs(best%rise) < flat) exit
    end do
    if (.not. best%rise < 1) turn = arc
    if (.not. best%rise < 1) best = to
    x = abs(best%rise) * (high - low)
    best%rise = 0
    call trail%add(best, turn, x)
    arc = max(arc - turn, tiny(arc))
  end subroutine add_turning_point

  pure subroutine add(self, point, arc, error)
    class(trail_type), intent(inout) :: self
    type(point_type), intent(in) :: point
    real(dp), intent(in) :: arc, error

    self%count = self%count + 1
    self%points(self%count) = point
    self%arcs = [self%arcs, arc]
    self%errors = [self%errors, error]
  end subroutine add

  !> Joins two paths from the same start, `down` (in reversed order) and `up`. Adds each part between turning points to `branches`.
  subroutine add_branches(family, down, up, branches)
    type(line_path_type), intent(in) :: family
    type(trail_type), intent(in) :: down, up
    type(branch_type), allocatable, intent(inout) :: branches(:)
    type(branch_type), allocatable :: longer(:)
    type(trail_type) :: whole
    type(point_type) :: point
    integer :: first, i, k

    allocate(whole%points(down%count + up%count), whole%arcs(0), whole%errors(0))
    do k = down%count, 2, -1
      point = down%points(k)
      point%along = -point%along
      point%rise = -point%rise
      call whole%add(point, down%arcs(min(k + 1, down%count)), down%errors(k))
    end do
    do k = 1, up%count
      call whole%add(up%points(k), up%arcs(k), up%errors(k))
    end do
    if (min(down%count - 1, up%count) > 0) whole%arcs(down%count) = down%arcs(2)
    first = 1
    do k = 2, whole%count
      if (k < whole%count .and. .not. turns_at(whole, k)) cycle
      allocate(longer(size(branches) + 1))
      do i = 1, size(branches)
        longer(i) = branches(i)
      end do
      longer(size(longer)) = branch_of(family, whole, first, k, [down%lost, up%lost])
      call move_alloc(longer, branches)
      first = k
    end do
  end subroutine add_branches

  !> True if lambda reverses its direction at point number `k` inside a path. If the slope of lambda is zero at a turning point,
  !> the reversal may appear one point earlier or later.
  pure logical function turns_at(whole, k)
    type(trail_type), intent(in) :: whole
    integer, intent(in) :: k
    logical :: reversed(-1:1), flat(-1:1)
    integer :: i

    reversed = .false.
    flat = .false.
    do i = max(k - 1, 2), min(k + 1, whole%count - 1)
      associate (lambda => whole%points(i - 1:i + 1)%lambda)
        reversed(i - k) = (lambda(2) - lambda(1)) * (lambda(3) - lambda(2)) < 0
      end associate
      flat(i - k) = .not. abs(whole%points(i)%rise) > 0
    end do
    turns_at = (flat(0) .and. any(reversed)) .or. (reversed(0) .and. .not. any(flat))
  end function turns_at

  !> Creates a branch from the points `first` to `last` of a path, in ascending order of lambda. `lost`: for each end of the whole
  !> path, true if the continuation failed there.
  pure function branch_of(family, whole, first, last, lost) result(branch)
    type(line_path_type), intent(in) :: family
    type(trail_type), intent(in) :: whole
    integer, intent(in) :: first, last
    logical, intent(in) :: lost(2)
    type(branch_type) :: branch
    integer :: i, k, n
    logical :: reversed

    n = last - first + 1
    reversed = whole%points(last)%lambda < whole%points(first)%lambda
    allocate(branch%points(n), branch%arcs(n - 1))
    do i = 1, n
      k = merge(last + 1 - i, first - 1 + i, reversed)
      branch%points(i) = whole%points(k)
      if (reversed) branch%points(i)%along = -branch%points(i)%along
      if (reversed) branch%points(i)%rise = -branch%points(i)%rise
      if (i < n) branch%arcs(i) = whole%arcs(merge(k, k + 1, reversed))
    end do
    branch%turning_ends = [first > 1, last < whole%count]
    branch%lost = lost .and. .not. branch%turning_ends
    if (reversed) branch%turning_ends = branch%turning_ends([2, 1])
    if (reversed) branch%lost = branch%lost([2, 1])
    branch%errors = merge(whole%errors([last, first]), whole%errors([first, last]), reversed)
    branch%units = family%units
  end function branch_of

  subroutine member(self, lambda, varied, error)
    class(line_path_type), intent(in) :: self
    real(dp), intent(in) :: lambda
    type(varied_frame_type), intent(out) :: varied
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), allocatable :: frame
    type(series_type) :: rest

    call bare_frame(self%bare, [parameter_at(self%axis, lambda)], frame, error)
    if (allocated(error)) return
    allocate(rest%cosine(0:1, frame%dofs()), rest%sine(0:1, frame%dofs()), source=0.0_dp)
    varied = varied_frame(frame, rest)
  end subroutine member

  !> Creates the frame with the given `parameters`. Fails if such a frame is impossible, or if the member of the family is not a
  !> frame.
  subroutine bare_frame(bare, parameters, frame, error)
    class(family_type), intent(in) :: bare
    real(dp), intent(in) :: parameters(:)
    class(frame_type), allocatable, intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    class(periodic_system), allocatable :: system

    call create_member(bare, parameters, system, error)
    if (allocated(error)) return
    select type (system)
    class is (frame_type)
      allocate(frame, source=system)
    class default
      call fatal_error(error, "the members of the family must be frames: only vibrations of frames can be followed through the " &
        & // "range", failed_computation)
    end select
  end subroutine bare_frame

  !> Computes the Newton iterates at the two values of lambda in `ends` in parallel. If the first iterate needed more samples than
  !> the second, the second one is repeated with as many samples.
  subroutine solve_both(self, q, ends, next, error)
    class(line_path_type), intent(in) :: self
    real(dp), intent(in) :: q(:, :), ends(2)
    type(iterate_type), intent(inout) :: next(2)
    type(error_type), allocatable, intent(out) :: error
    type(iterates_type) :: work

    work%family = self
    work%q = q
    work%ends = ends
    call distribute_over(work, 2, error, self%executor)
    if (allocated(error)) return
    next = work%next
    if (size(next(2)%q, 1) < size(next(1)%q, 1)) call next_iterate(self, q, ends(2), size(next(1)%q, 1), next(2), error)
  end subroutine solve_both

  recursive subroutine compute(self, k, error)
    class(iterates_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call next_iterate(self%family, self%q, self%ends(k), size(self%q, 1), self%next(k), error)
  end subroutine compute

  subroutine exchange(self, k, record)
    class(iterates_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call record%pass(self%next(k)%q)
    call record%pass(self%next(k)%angles)
  end subroutine exchange

end module gestell_task_boundary_vibrations
