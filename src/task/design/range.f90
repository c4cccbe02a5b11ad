!> Finds the worst values of the goals of a design over the whole range of speeds and tolerances, including conditions between the
!> given ones.
!>
!> The range is searched along lines. One line of varying speed belongs to each combination of stiffness and damping factors.
!> Lines of varying stiffness of the mounts lie at the lowest and the highest speed. The speed of a resonance rises with the
!> stiffness, so each resonance in the range meets one of these lines.
!>
!> Points are added along a line as for resonance curves. The multipliers at neighbouring points show where a natural frequency,
!> or an instability tongue, meets an order of the crank. An interval is halved if the straight lines extrapolated from both sides
!> meet above the largest computed value. At the end each maximum close to the largest one is refined.
module gestell_task_design_range
  use gestell_base_error, only: error_type
  use gestell_base_first_error, only: first_error_type
  use gestell_base_verdict, only: operator(/=), operator(==), stable
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_study_design_evaluation, only: design_options, range_type, top_type
  use gestell_study_design_goal, only: goal_type, multiplier_goal, torque_goal
  use gestell_study_design_motion, only: default_phases
  use gestell_study_design_perturbed_members, only: condition_type, find_members, joined, members_type, remember
  use gestell_study_design_range_climb, only: climb_type
  use gestell_study_design_range_top, only: climb_from, evaluate_condition, search_near_end
  use gestell_system_family, only: family_type
  use gestell_study_speed_point, only: speed_point_type
  use gestell_task_resonance_points, only: curve_points_type
  use gestell_task_resonance_seeds, only: crossing_speeds
  implicit none (type, external)
  private

  public :: survey_machine, survey_range

  !> A line through the range of speeds and tolerances. `start`: the condition at the start of the line, which also states whether
  !> the speed or the stiffness varies along the line. `places`: positions on the line at which conditions are given.
  type, public :: range_line_type
    type(condition_type) :: start
    real(dp), allocatable :: places(:)
  end type range_line_type

  !> A range of operating conditions that is searched along lines.
  type, extends(range_type), public :: range_of_lines_type
    type(range_line_type), allocatable :: lines(:)
  contains
    procedure :: find_tops
  end type range_of_lines_type

  !> Worst values of the goals of one machine over the whole range.
  type, public :: range_survey_type
    !> Largest excess of each goal over its limit, shape (goals).
    real(dp), allocatable :: excess(:)
    !> Number of the line on which each goal has its largest excess, shape (goals).
    integer, allocatable :: line(:)
    !> Conditions at all maxima close to the worst value. If a condition without a stable vibration was found, it is the last
    !> element.
    type(condition_type), allocatable :: conditions(:)
    !> True if the machine has a stable vibration at all computed points of all lines
    logical :: known = .true.
  end type range_survey_type

  !> A line through the range of speeds and tolerances, and the points that were computed on it.
  type, extends(curve_points_type) :: curve_type
    type(range_line_type) :: line
  end type curve_type

  !> `near`: a maximum is ignored if it is lower than the largest maximum by more than this fraction of the goal's magnitude.
  !> `min_rise`: an interval is halved if its extrapolated maximum exceeds the values at both ends by more than this fraction of
  !> the goal's magnitude.
  real(dp), parameter :: near = 0.25_dp, min_rise = 0.01_dp
  !> Two points of a line count as equal if the relative difference of their positions is smaller than this.
  real(dp), parameter :: same = 1.0e-9_dp
  !> `max_rounds`: maximum number of rounds in which points are added to a line. `max_points`: maximum number of points on a line.
  integer, parameter :: max_rounds = 16, max_points = 3000
  !> Two computed values of the same maximum agree if their relative difference does not exceed this value.
  real(dp), parameter :: agreement = 1.0e-6_dp

contains

  !> Finds, along each line, those maxima of each goal that are close to the worst value of this goal.
  subroutine find_tops(self, members, goals, tops, known, error)
    class(range_of_lines_type), intent(in) :: self
    !> The machine, and copies of it (neighbours) in each of which one parameter is changed
    type(members_type), intent(in) :: members
    type(goal_type), intent(in) :: goals(:)
    !> Maxima that were found, each with its goal, excess, condition and vibration
    type(top_type), allocatable, intent(out) :: tops(:)
    !> False if the machine has no stable vibration at some point of a line; `tops` is then not allocated
    logical, intent(out) :: known
    type(error_type), allocatable, intent(out) :: error
    type(curve_type) :: curves(size(self%lines))
    integer :: l

    do l = 1, size(curves)
      call sample_line(members, goals, self%lines(l), curves(l), error, self%enough)
      if (allocated(error)) return
    end do
    known = all([(all(curves(l)%points%state == stable), l = 1, size(curves))])
    if (known) call refine_maxima(members, goals, curves, .false., tops, error, self%enough)
  end subroutine find_tops

  !> Computes the worst values of the goals of the machine with the parameters `x` along all lines. Fails if `x` or the goals are
  !> invalid.
  subroutine survey_range(family, options, lines, x, reported, survey, error)
    class(family_type), intent(in) :: family
    !> Goals, accuracy, and model of the frame
    type(design_options), intent(in) :: options
    type(range_line_type), intent(in) :: lines(:)
    !> Parameters of the design, shape (parameters)
    real(dp), intent(in) :: x(:)
    !> True if the survey is for the report. Stability is then added as the last goal. Each maximum is then also checked: its
    !> vibration is computed again without starting from a neighbouring point.
    logical, intent(in) :: reported
    !> Worst values of the goals, and the conditions at which they occur
    type(range_survey_type), intent(out) :: survey
    type(error_type), allocatable, intent(out) :: error
    type(members_type) :: members
    logical :: known

    call find_members(family, x, members, known, error)
    if (allocated(error)) return
    if (known) then
      call survey_machine(members%frame, options, lines, reported, survey, error)
    else
      allocate(survey%conditions(0))
      allocate(survey%excess(size(options%objectives) + size(options%constraints) + merge(1, 0, reported)), source=-huge(1.0_dp))
      allocate(survey%line(size(survey%excess)), source=1)
      survey%known = .false.
    end if
  end subroutine survey_range

  !> Computes the worst values of the goals of `machine` along all lines. The other arguments are those of `survey_range`.
  subroutine survey_machine(machine, options, lines, reported, survey, error)
    type(frame_type), intent(in) :: machine
    type(design_options), intent(in) :: options
    type(range_line_type), intent(in) :: lines(:)
    logical, intent(in) :: reported
    type(range_survey_type), intent(out) :: survey
    type(error_type), allocatable, intent(out) :: error
    type(members_type) :: members
    type(goal_type), allocatable :: goals(:)
    type(curve_type) :: curves(size(lines))
    type(top_type), allocatable :: tops(:)
    type(goal_type) :: stability
    integer :: k, l

    stability%about = multiplier_goal
    stability%measure%quantity = "rho_max"
    stability%limit = 1
    goals = options%goals()
    if (reported) goals = [goals, stability]
    allocate(survey%conditions(0))
    allocate(survey%excess(size(goals)), source=-huge(1.0_dp))
    allocate(survey%line(size(goals)), source=1)
    members%frame = machine
    members%setting = options%setting_type
    call remember(members, default_phases(), any(goals%about == torque_goal))
    do l = 1, size(curves)
      call sample_line(members, goals, lines(l), curves(l), error)
      if (allocated(error)) return
    end do
    call refine_maxima(members, goals, curves, reported, tops, error)
    if (allocated(error)) return
    do k = 1, size(tops)
      associate (g => tops(k)%goal)
        if (tops(k)%excess > survey%excess(g)) survey%line(g) = tops(k)%line
        survey%excess(g) = max(survey%excess(g), tops(k)%excess)
      end associate
      survey%conditions = joined(survey%conditions, [tops(k)%condition])
    end do
    do l = 1, size(curves)
      k = findloc(curves(l)%points%state == stable, .false., dim=1)
      if (k == 0 .or. .not. survey%known) cycle
      survey%known = .false.
      survey%conditions = [survey%conditions, curves(l)%line%start%moved_to(curves(l)%points(k)%speed)]
    end do
  end subroutine survey_machine

  !> Computes points on a line: first the points at the given conditions, then further points until no more are needed.
  subroutine sample_line(members, goals, line, curve, error, enough)
    type(members_type), intent(in) :: members
    type(goal_type), intent(in) :: goals(:)
    type(range_line_type), intent(in) :: line
    type(curve_type), intent(out) :: curve
    type(error_type), allocatable, intent(out) :: error
    !> If the excess of a goal exceeds this value, no more points are added; shape (goals)
    real(dp), intent(in), optional :: enough(:)
    type(speed_point_type), allocatable :: points(:)
    real(dp), allocatable :: requested(:), new(:)
    type(first_error_type) :: first
    integer :: g, i, round

    curve%line = line
    allocate(curve%points(0))
    curve%descends = line%places(size(line%places)) < line%places(1)
    new = line%places
    do round = 1, max_rounds
      allocate(points(size(new)))
      !$omp parallel do schedule(dynamic, 1) private(error)
      do i = 1, size(new)
        call evaluate_condition(members, goals, line%start%moved_to(new(i)), .true., points(i), error)
        call first%take(i, error)
      end do
      !$omp end parallel do
      call move_alloc(first%error, error)
      if (allocated(error)) return
      call curve%insert(points, refined=round > 1)
      deallocate(points)
      if (exceeds_enough(curve, enough)) exit
      requested = crossing_speeds(curve, counts=is_high(curve, goals))
      if (any(goals%about == multiplier_goal)) requested = [requested, crossing_speeds(curve, pairs=.true.)]
      do g = 1, size(goals)
        requested = [requested, refinement_points(curve, goals(g), excesses(curve, g))]
      end do
      call curve%select_new(requested, same, new)
      if (size(new) == 0 .or. size(curve%points) + size(new) > max_points) exit
    end do
  end subroutine sample_line

  !> For each point of the curve: true if the value of a goal is at least half of the worst value of this goal. True at all points
  !> if the multipliers are a goal.
  pure function is_high(curve, goals) result(high)
    type(curve_type), intent(in) :: curve
    type(goal_type), intent(in) :: goals(:)
    logical :: high(size(curve%points))
    real(dp) :: excess(size(high))
    integer :: g

    high = .false.
    do g = 1, size(goals)
      excess = excesses(curve, g)
      if (maxval(excess) <= -huge(1.0_dp)) cycle
      high = high .or. goals(g)%about == multiplier_goal .or. excess >= maxval(excess) - magnitude_of(goals(g), maxval(excess)) / 2
    end do
  end function is_high

  !> True if the excess of some goal exceeds `enough` at some point; false if `enough` is not present.
  pure logical function exceeds_enough(curve, enough)
    type(curve_type), intent(in) :: curve
    real(dp), intent(in), optional :: enough(:)
    integer :: g

    exceeds_enough = present(enough)
    if (exceeds_enough) exceeds_enough = any([(maxval(excesses(curve, g)) > enough(g), g = 1, size(enough))])
  end function exceeds_enough

  !> Excess of goal number `g` over its limit, at all points of the curve.
  pure function excesses(curve, g)
    type(curve_type), intent(in) :: curve
    integer, intent(in) :: g
    real(dp) :: excesses(size(curve%points))
    integer :: i

    excesses = [(curve%points(i)%values(1, g), i = 1, size(excesses))]
  end function excesses

  !> Magnitude of the values of a goal. Differences between values are judged relative to it. `excess`: excess of the goal over
  !> its limit.
  pure real(dp) function magnitude_of(goal, excess)
    type(goal_type), intent(in) :: goal
    real(dp), intent(in) :: excess

    magnitude_of = max(abs(excess + goal%limit), abs(goal%limit))
    ! For the multipliers: distance of the largest modulus from 1, which measures the growth or decay of free vibrations.
    if (goal%about == multiplier_goal) magnitude_of = max(abs(excess), abs(goal%limit - 1), sqrt(epsilon(magnitude_of)))
  end function magnitude_of

  !> Midpoints of the intervals that must be halved. In these intervals the straight lines through the two points on either side
  !> meet above the worst value.
  function refinement_points(curve, goal, excess) result(places)
    type(curve_type), intent(in) :: curve
    type(goal_type), intent(in) :: goal
    real(dp), intent(in) :: excess(:)
    real(dp), allocatable :: places(:)
    real(dp) :: h, rise(2), top, worst
    integer :: i

    allocate(places(0))
    worst = maxval(excess)
    associate (p => curve%points)
      do i = 2, size(p) - 2
        if (any(excess(i - 1:i + 2) <= -huge(worst))) cycle
        h = abs(p(i + 1)%speed - p(i)%speed)
        rise(1) = (excess(i) - excess(i - 1)) / abs(p(i)%speed - p(i - 1)%speed)
        rise(2) = (excess(i + 1) - excess(i + 2)) / abs(p(i + 2)%speed - p(i + 1)%speed)
        if (.not. sum(rise) > 0) cycle
        ! where the straight lines meet: excess(i) + rise(1) t = excess(i + 1) + rise(2) (h - t)
        top = (excess(i + 1) - excess(i) + rise(2) * h) / sum(rise)
        if (top <= 0 .or. top >= h) cycle
        top = excess(i) + rise(1) * top
        if (top <= worst .or. top - maxval(excess(i:i + 1)) <= min_rise * magnitude_of(goal, worst)) cycle
        places = [places, (p(i)%speed + p(i + 1)%speed) / 2]
      end do
    end associate
  end function refinement_points

  !> Refines, for each goal, all maxima that are close to the worst value of this goal. Refines no maximum if the excess of a goal
  !> already exceeds `enough`.
  subroutine refine_maxima(members, goals, curves, reported, tops, error, enough)
    type(members_type), intent(in) :: members
    type(goal_type), intent(in) :: goals(:)
    type(curve_type), intent(in) :: curves(:)
    !> True if the survey is for the report (see `survey_range`)
    logical, intent(in) :: reported
    type(top_type), allocatable, intent(out) :: tops(:)
    type(error_type), allocatable, intent(out) :: error
    !> If the excess of a goal exceeds this value, no maximum needs to be refined; shape (goals)
    real(dp), intent(in), optional :: enough(:)
    integer, allocatable :: place(:), found(:, :)
    real(dp) :: worst, least
    type(first_error_type) :: first
    logical :: skipped
    integer :: g, k, l

    allocate(found(3, 0))
    do g = 1, size(goals)
      worst = maxval([(maxval(excesses(curves(l), g)), l = 1, size(curves))])
      if (worst <= -huge(worst)) cycle
      least = worst - near * magnitude_of(goals(g), worst)
      ! For stability, which has no limit here: the worst point and all unstable points.
      if (reported .and. g == size(goals)) least = min(worst, 0.0_dp)
      do l = 1, size(curves)
        place = local_maxima(excesses(curves(l), g), least)
        found = reshape([found, [(g, l, place(k), k = 1, size(place))]], [3, size(found, 2) + size(place)])
      end do
    end do
    allocate(tops(size(found, 2)))
    skipped = any([(exceeds_enough(curves(l), enough), l = 1, size(curves))])
    !$omp parallel do schedule(dynamic, 1) private(error)
    do k = 1, size(tops)
      tops(k)%goal = found(1, k)
      tops(k)%line = found(2, k)
      call refine_maximum(members, goals(found(1, k)), curves(found(2, k)), found(3, k), reported, tops(k), error, skipped)
      call first%take(k, error)
    end do
    !$omp end parallel do
    call move_alloc(first%error, error)
  end subroutine refine_maxima

  !> Indices of the local maxima among the values along a line; maxima smaller than `least` are omitted.
  pure function local_maxima(values, least) result(places)
    real(dp), intent(in) :: values(:), least
    integer, allocatable :: places(:)
    real(dp), parameter :: nothing = -huge(1.0_dp)
    integer :: i

    associate (before => [nothing, values(:size(values) - 1)], after => [values(2:), nothing])
      places = pack([(i, i = 1, size(values))], values > nothing .and. values >= least .and. values > before .and. values >= after)
    end associate
  end function local_maxima

  !> Refines the maximum near point number `i` of a curve. The values at both neighbours of this point are not larger than the
  !> value at the point.
  subroutine refine_maximum(members, goal, curve, i, reported, top, error, skipped)
    type(members_type), intent(in) :: members
    type(goal_type), intent(in) :: goal
    type(curve_type), intent(in) :: curve
    integer, intent(in) :: i
    logical, intent(in) :: reported
    type(top_type), intent(inout) :: top
    type(error_type), allocatable, intent(out) :: error
    !> True if the maximum is to be taken at the point itself, without refinement
    logical, intent(in) :: skipped
    type(speed_point_type) :: point
    type(climb_type) :: climb
    real(dp) :: places(3), levels(3)
    integer :: three(3), k

    associate (p => curve%points, start => curve%line%start, g => top%goal)
      top%condition = start%moved_to(p(i)%speed)
      top%excess = p(i)%values(1, g)
      top%inside = i > 1 .and. i < size(p)
      if (skipped .or. size(p) == 1) return
      if (top%inside) then
        three = merge([i + 1, i, i - 1], [i - 1, i, i + 1], curve%descends)
        if (any(p(three)%state /= stable)) return
        places = [p(three(1))%speed, p(three(2))%speed, p(three(3))%speed]
        levels = goal%level([p(three(1))%values(1, g), p(three(2))%values(1, g), p(three(3))%values(1, g)])
      else
        k = merge(2, size(p) - 1, i == 1)
        if (p(k)%state /= stable) return
        call search_near_end(members, goal, start, [p(k)%speed, p(i)%speed], goal%level([p(k)%values(1, g), &
          & p(i)%values(1, g)]), places, levels, error)
        if (allocated(error) .or. .not. levels(2) > max(levels(1), levels(3))) return
        top%inside = .true.
      end if
      call climb_from(members, goal, start, places, levels, climb, error, top%motion)
      if (allocated(error)) return
      if (reported) then
        call evaluate_condition(members, [goal], start%moved_to(climb%top), .false., point, error)
        if (allocated(error)) return
        ! A vibration that was found from a neighbouring point may belong to another branch.
        if (.not. climb%smooth .or. abs(point%values(1, 1) - goal%excess_at(climb%highest)) > agreement &
          & * magnitude_of(goal, point%values(1, 1))) call climb_from(members, goal, start, places, levels, climb, error)
        if (allocated(error)) return
      end if
      top%condition = start%moved_to(climb%top)
      top%excess = max(top%excess, goal%excess_at(climb%highest))
    end associate
  end subroutine refine_maximum

end module gestell_task_design_range
