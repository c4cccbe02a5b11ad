!> Finds the values of one parameter at which a frame in the exact model has stability borders. The borders are found separately on
!> each branch of its vibrations.
!>
!> A branch and its multipliers are smooth functions of the parameter, so the search of gestell_task_boundary_line_search can be
!> used on each branch. At a turning point a multiplier passes through +1. The branch ends there, because the vibration ceases to
!> exist.
module gestell_task_boundary_branches
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_verdict, only: operator(/=), undecided, verdict_length, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_math_sorting, only: ascending
  use gestell_math_series_trigonometric, only: series_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_task_boundary_branch, only: branch_type, lies_on_any
  use gestell_task_boundary_line_borders, only: add_open_parts, border_rest_type, border_type, borders_on, line_along, &
    & open_border_type
  use gestell_task_boundary_line, only: border_options, coordinate, line_type, parameter_at, sensitivity
  use gestell_task_boundary_line_search_result, only: search_type
  use gestell_task_boundary_line_search, only: merged, range_nodes, search_line
  use gestell_task_boundary_vibrations, only: bare_frame, trace_branches
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type
  use gestell_study_frame_model_newton, only: iterate, values_of
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: find_branch_borders

  !> Family of frames, each linearised about its vibration on the same branch.
  type, extends(family_type) :: branch_family_type
    class(family_type), pointer :: bare => null()
    type(axis_type) :: axis
    type(accuracy_type) :: accuracy
    type(branch_type) :: branch
  contains
    procedure :: member
  end type branch_family_type

  character(len=*), parameter, public :: turning_point = "turning_point"
  character(len=verdict_length), parameter :: no_vibration = "none"
  !> Distance from a turning point, relative to the range of the parameter, within which no borders are searched.
  real(dp), parameter :: turn_clearance = 1.0e-6_dp

contains

  !> Finds the stability borders and the turning points on every branch of the vibrations of the frames in `bare`. A branch that
  !> ends at a turning point is unstable throughout if an odd number of real multipliers exceeds 1 at all its points. Such a
  !> branch has no borders and gets no number; its turning points are listed with the neighbouring branches. Fails if
  !> `search_line` fails.
  subroutine find_branch_borders(bare, axis, options, borders, error, rest, followed)
    !> Family of frames that are not yet linearised about a vibration
    class(family_type), intent(in), target :: bare
    !> The parameter and its range. Component `count`: number of values at which the search starts
    type(axis_type), intent(in) :: axis
    !> Accuracy, tolerance of the borders, and the executor that distributes the work
    type(border_options), intent(in) :: options
    !> Borders and turning points, sorted in the direction of the axis. Component `vibration`: number of the branch
    type(border_type), allocatable, intent(out) :: borders(:)
    type(error_type), allocatable, intent(out) :: error
    !> Parts of the range in which a border cannot be excluded
    type(border_rest_type), intent(out) :: rest
    !> False if there is no branch, because nothing excites the frames or no vibration was found
    logical, intent(out) :: followed
    type(branch_family_type), target :: family
    type(branch_type), allocatable :: branches(:)
    type(line_type) :: line
    type(search_type) :: search
    real(dp) :: ends(2)
    integer :: i, side, number

    allocate(borders(0), rest%places(0))
    call trace_branches(bare, axis, options, range_nodes(axis%count), branches)
    followed = size(branches) > 0
    if (.not. followed) return
    call add_gaps(axis, branches, rest)
    family%bare => bare
    family%axis = axis
    family%accuracy = options%accuracy
    number = 0
    do i = 1, size(branches) - 1
      ends = abs(branches(i)%ends() - branches(i + 1)%ends())
      do side = 1, 2
        if (branches(i)%turning_ends(side) .and. .not. ends(side) > 0) call refine_turning_point(family, branches(i:i + 1), side)
      end do
    end do
    do i = 1, size(branches)
      family%branch = branches(i)
      ends = branches(i)%ends() + merge(turn_clearance, 0.0_dp, branches(i)%turning_ends) * [1, -1]
      if (.not. ends(2) > ends(1)) then
        ends = branches(i)%ends()
        call add_open(axis, ends(1), ends(2), rest)
        cycle
      end if
      call line_along(family, [axis], 1, [axis%from], options, line)
      line%start = ends(1)
      line%direction = ends(2) - ends(1)
      call search_line(line, nodes_of(branches(i), line, axis%count), search, error)
      if (allocated(error)) return
      call add_open_parts(line, search, rest)
      if (any(branches(i)%turning_ends) .and. is_always_unstable(search)) cycle
      number = number + 1
      borders = [borders, borders_on(line, search, number)]
      call add_turning_points(family, options%tolerance, number, search, borders)
    end do
    borders = borders(ascending(sign(1.0_dp, axis%to - axis%from) * borders%value))
  end subroutine find_branch_borders

  !> Positions at which the search on a branch starts: the nodes of the range, and a further node wherever the scaled vibration
  !> has changed by 0.25 since the previous one of these.
  pure function nodes_of(branch, line, count) result(nodes)
    type(branch_type), intent(in) :: branch
    type(line_type), intent(in) :: line
    integer, intent(in) :: count
    real(dp), allocatable :: nodes(:)
    real(dp), parameter :: notable = 0.25_dp
    real(dp) :: t(size(branch%points)), changed
    logical :: taken(size(branch%points))
    integer :: i

    t = (branch%points%lambda - line%start(1)) / line%direction(1)
    taken = .false.
    changed = 0
    do i = 2, size(t)
      changed = changed + branch%arcs(i - 1) * sqrt(max(1 - branch%points(i)%rise**2, 0.0_dp))
      if (changed < notable) cycle
      taken(i) = t(i) > 0 .and. t(i) < 1
      changed = 0
    end do
    nodes = merged(range_nodes(count), pack(t, taken))
  end function nodes_of

  !> Adds to `rest` the parts of the range in which a border cannot be excluded: parts that no branch covers, and parts beyond a
  !> failed end (an end at which the continuation failed). A part beyond a failed end extends to the nearest failed end of another
  !> branch or, if there is none, to the end of the range. It is omitted if another branch passes through the failed end.
  subroutine add_gaps(axis, branches, rest)
    type(axis_type), intent(in) :: axis
    type(branch_type), intent(in) :: branches(:)
    type(border_rest_type), intent(inout) :: rest
    !> Gaps between branches that are not wider than this, relative to the range, are ignored: they result from the ends of paths
    !> and from the errors of turning points.
    real(dp), parameter :: narrow = 1.0e-5_dp
    type(series_type) :: motion
    real(dp) :: ends(2, size(branches)), t, next
    logical :: lost(2, size(branches))
    integer :: i, side

    do i = 1, size(branches)
      ends(:, i) = branches(i)%ends()
      lost(:, i) = branches(i)%lost .and. [ends(1, i) > narrow, ends(2, i) < 1 - narrow]
    end do
    t = 0
    do while (t < 1 - narrow)
      next = max(t, maxval(ends(2, :), mask=ends(1, :) <= t + narrow))
      if (.not. next > t) then
        next = min(1.0_dp, minval(ends(1, :), mask=ends(1, :) > t + narrow))
        call add_open(axis, t, next, rest)
        ! The branches that end at this gap need no further part of the range.
        where (abs(ends(2, :) - t) <= narrow) lost(2, :) = .false.
        where (abs(ends(1, :) - next) <= narrow) lost(1, :) = .false.
      end if
      t = next
    end do
    do i = 1, size(branches)
      do side = 1, 2
        if (.not. lost(side, i)) cycle
        ! Another branch passes through this end.
        motion = branches(i)%motion_at(ends(side, i))
        if (any([lies_on_any(branches(:i - 1), ends(side, i), motion), lies_on_any(branches(i + 1:), ends(side, i), motion)])) cycle
        next = max(0.0_dp, maxval(ends(2, :), mask=lost(2, :) .and. ends(2, :) < ends(1, i)))
        if (side == 2) next = min(1.0_dp, minval(ends(1, :), mask=lost(1, :) .and. ends(1, :) > ends(2, i)))
        call add_open(axis, min(next, ends(side, i)), max(next, ends(side, i)), rest)
      end do
    end do
  end subroutine add_gaps

  !> Adds to `rest` the part of the range between the coordinates `from` and `to` (0 to 1 over the range), because a border in
  !> this part cannot be excluded.
  pure subroutine add_open(axis, from, to, rest)
    type(axis_type), intent(in) :: axis
    real(dp), intent(in) :: from, to
    type(border_rest_type), intent(inout) :: rest

    rest%places = [rest%places, open_border_type(parameter_at(axis, (from + to) / 2), &
      & abs(parameter_at(axis, to) - parameter_at(axis, from)))]
  end subroutine add_open

  !> True if an odd number of real multipliers exceeds 1 along the whole branch. One such point is not sufficient, because it may
  !> lie in a tongue (region of instability) at the multiplier +1. An example is 2 w = 2 Omega (w: natural frequency, Omega: crank
  !> speed) in a machine that repeats after half a turn. Points near a turning point, where a multiplier equals 1 within its
  !> error, are ignored.
  pure logical function is_always_unstable(search)
    type(search_type), intent(in) :: search
    integer :: i, known

    known = 0
    is_always_unstable = .true.
    do i = 1, size(search%marks)
      associate (mark => search%marks(i), is_real => .not. abs(aimag(search%marks(i)%z)) > 0)
        if (any(is_real .and. abs(real(mark%z)) <= mark%noise)) cycle
        known = known + 1
        is_always_unstable = is_always_unstable .and. modulo(count(is_real .and. real(mark%z) > 0), 2) == 1
      end associate
    end do
    is_always_unstable = is_always_unstable .and. known > 0
  end function is_always_unstable

  !> Refines the turning point at which the two branches of `pair` meet: their lower ends (`side` 1) or their upper ends (`side`
  !> 2). Near a turning point, the parameter is a smooth function of the mean square difference between the two motions. Neville
  !> extrapolation to zero difference yields the turning point. Cancellation costs digits, so the last change of the extrapolation
  !> is taken as the error.
  subroutine refine_turning_point(family, pair, side)
    type(branch_family_type), intent(inout) :: family
    type(branch_type), intent(inout) :: pair(2)
    integer, intent(in) :: side
    integer, parameter :: levels = 6, fewest = 4
    real(dp), parameter :: first = 0.02_dp, path_error = 1.0e-4_dp
    real(dp) :: t(levels), square(levels), table(levels), ends(2, 2), before, distance
    type(error_type), allocatable :: error
    integer :: i, k, at(2)

    ends(:, 1) = pair(1)%ends()
    ends(:, 2) = pair(2)%ends()
    distance = first * minval(ends(2, :) - ends(1, :))
    at = [size(pair(1)%points), size(pair(2)%points)]
    if (side == 1) at = 1
    table = 0
    ! The error found with the path is kept, unless the error of the extrapolation is smaller.
    pair(1)%errors(side) = max(pair(1)%errors(side), path_error)
    pair(2)%errors(side) = pair(1)%errors(side)
    do k = 1, levels
      t(k) = ends(side, 1) + distance / 2**(k - 1) * merge(1, -1, side == 1)
      call difference_at(family, pair, t(k), square(k), error)
      ! Very close to the turning point Newton's method may confuse the two vibrations.
      if (allocated(error)) exit
      before = table(1)
      table(k) = t(k)
      do i = k - 1, 1, -1
        table(i) = (square(k) * table(i) - square(i) * table(i + 1)) / (square(k) - square(i))
      end do
    end do
    if (k <= fewest .or. .not. abs(table(1) - ends(side, 1)) < distance) return
    do i = 1, 2
      pair(i)%points(at(i))%lambda = table(1)
      pair(i)%errors(side) = abs(table(1) - before)
    end do
  end subroutine refine_turning_point

  !> Computes the mean square difference between the scaled motions of two branches at the scaled parameter lambda = `t`. Fails if
  !> Newton's method does not converge on both branches, or if it finds the same motion on both.
  subroutine difference_at(family, pair, t, square, error)
    type(branch_family_type), intent(inout) :: family
    type(branch_type), intent(in) :: pair(2)
    real(dp), intent(in) :: t
    real(dp), intent(out) :: square
    type(error_type), allocatable, intent(out) :: error
    class(periodic_system), allocatable :: system
    type(series_type) :: motion(2)
    real(dp), allocatable :: q(:, :)
    integer :: i, samples

    square = 0
    do i = 1, 2
      family%branch = pair(i)
      call family%member([parameter_at(family%axis, t)], system, error)
      if (allocated(error)) return
      select type (system)
      class is (varied_frame_type)
        motion(i) = system%motion
      end select
    end do
    samples = 2 * max(ubound(motion(1)%cosine, 1), ubound(motion(2)%cosine, 1)) + 2
    q = (values_of(motion(1), samples) - values_of(motion(2), samples)) / spread(pair(1)%units, 1, samples)
    square = sum(q**2) / samples
    if (.not. square > 0) call fatal_error(error, "the two branches coincide", failed_computation)
  end subroutine difference_at

  !> Adds the turning points at the ends of the current branch of `family` to `borders`. At a turning point no verdict can be
  !> decided, because a multiplier equals 1 within its error. The border therefore gets the verdict of the nearest system on the
  !> branch whose verdict is decided.
  pure subroutine add_turning_points(family, tolerance, number, search, borders)
    type(branch_family_type), intent(in) :: family
    real(dp), intent(in) :: tolerance
    integer, intent(in) :: number
    type(search_type), intent(in) :: search
    type(border_type), allocatable, intent(inout) :: borders(:)
    real(dp) :: ends(2)
    type(verdict_type) :: verdict
    integer :: i, side
    logical :: above

    ends = family%branch%ends()
    do side = 1, 2
      if (.not. family%branch%turning_ends(side)) cycle
      i = findloc(search%marks%verdict /= undecided, .true., dim=1, back=side == 2)
      verdict = undecided
      if (i > 0) verdict = search%marks(i)%verdict
      above = (side == 1) .eqv. (family%axis%to > family%axis%from)
      borders = [borders, border_type(value=parameter_at(family%axis, ends(side)), error=abs(sensitivity(family%axis, ends(side))) &
        & * max(family%branch%errors(side), tolerance), kind=turning_point, below=merge(no_vibration, verdict%word(), above), &
        & above=merge(verdict%word(), no_vibration, above), vibration=number)]
    end do
  end subroutine add_turning_points

  !> Creates the frame with the given `parameters`, linearised about its vibration on the branch. Fails if Newton's method does
  !> not converge to this vibration.
  subroutine member(self, parameters, system, error)
    class(branch_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(varied_frame_type), allocatable :: varied
    class(frame_type), allocatable :: frame
    real(dp), allocatable :: steps(:)
    real(dp), parameter :: max_step = 0.1_dp

    call bare_frame(self%bare, parameters, frame, error)
    if (allocated(error)) return
    allocate(varied)
    varied = varied_frame(frame, self%branch%motion_at(coordinate(self%axis, parameters(1))))
    call iterate(frame, self%accuracy, .false., varied, steps, error)
    if (allocated(error)) return
    if (steps(1) > max_step) then
      call fatal_error(error, "Newton's method has left this branch of periodic vibrations", failed_computation)
      return
    end if
    call move_alloc(varied, system)
  end subroutine member

end module gestell_task_boundary_branches
