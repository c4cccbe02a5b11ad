!> Evaluates one machine under a condition within a range of conditions. Along a line of conditions, on which one quantity varies,
!> finds the position at which a goal is worst. At a maximum inside the line the derivative with respect to the position vanishes.
!> Therefore the derivatives of the maximum with respect to the parameters are those at a fixed condition (local reduction in
!> semi-infinite programming: R. Hettich, K. O. Kortanek, SIAM Review 35, 1993, 380-429, section 2.2).
module gestell_study_design_range_top
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: failed, operator(/=), operator(==), stable
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_math_sorting, only: ascending
  use gestell_study_design_coordinates, only: coordinates_type, find_coordinates
  use gestell_study_design_evaluation, only: add_condition, goal_branches_type, no_branches
  use gestell_study_design_goal, only: goal_type, multiplier_goal
  use gestell_study_design_motion, only: derivative_tolerance, motion_type, solve_motion
  use gestell_study_design_perturbed_members, only: condition_type, members_type
  use gestell_study_design_range_branch, only: climb_branches
  use gestell_study_design_range_climb, only: climb_type, of_smooth
  use gestell_study_frame_model_newton, only: rough
  use gestell_study_speed_point, only: speed_point_type, compute_turns
  implicit none (type, external)
  private

  public :: climb_from, evaluate_condition, search_near_end

  !> Maximum number of steps of a search for a maximum.
  integer, parameter :: max_steps = 40
  !> Maximum number of halvings of the interval at the end of a line of conditions.
  integer, parameter :: max_halvings = 8

contains

  !> Solves the machine under a condition. `point%values(1, g)` is the excess of goal number g over its limit. Phase advance and
  !> growth of the free vibrations are set if they can be computed. If there is no solution, `point%state` holds the reason. Fails
  !> if the goals are invalid.
  subroutine evaluate_condition(members, goals, condition, multipliers, point, error, near)
    type(members_type), intent(in) :: members
    type(goal_type), intent(in) :: goals(:)
    type(condition_type), intent(in) :: condition
    !> True if the free vibrations must be computed too
    logical, intent(in) :: multipliers
    type(speed_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error
    !> On entry the motion under a similar condition, from which the search for the vibration of the exact frame starts. On return
    !> the computed motion
    type(motion_type), intent(inout), optional :: near
    type(motion_type) :: motion
    type(goal_branches_type) :: at
    type(error_type), allocatable :: failure
    integer :: g

    point%speed = condition%number()
    point%state = failed
    allocate(point%values(1, size(goals)), source=-huge(1.0_dp))
    call solve_motion(members, condition, any(goals%needs_motion()), motion, failure, near)
    if (allocated(failure)) return
    do g = 1, size(goals)
      if (goals(g)%about == multiplier_goal) cycle
      at = no_branches(0)
      call add_condition(members, motion, goals(g:g), 1, at, error)
      if (allocated(error)) return
      point%values(1, g) = maxval(at%side * (at%value - goals(g)%limit))
    end do
    point%state = stable
    if (present(near)) near = motion
    if (.not. (multipliers .or. any(goals%about == multiplier_goal))) return
    call compute_free_vibrations(motion, members%setting%accuracy, point, failure)
    if (allocated(failure)) return
    do g = 1, size(goals)
      if (goals(g)%about == multiplier_goal) point%values(1, g) = goals(g)%excess(exp(maxval(point%growth)))
    end do
  end subroutine evaluate_condition

  !> Computes phase advance and growth of the free vibrations. Fails if `solve_floquet` or `solve_multipliers` fails.
  subroutine compute_free_vibrations(motion, accuracy, point, error)
    type(motion_type), intent(in) :: motion
    type(accuracy_type), intent(in) :: accuracy
    type(speed_point_type), intent(inout) :: point
    type(error_type), allocatable, intent(out) :: error
    type(coordinates_type) :: free
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    logical :: fits
    integer, allocatable :: by_growth(:)

    call find_coordinates(motion%frame, size(motion%phases), derivative_tolerance(accuracy), free, fits, motion%quick)
    if (fits) then
      ! if two multipliers are real, as within a tongue of instability, the one that grows more is used
      by_growth = ascending(-real(free%lambda))
      associate (lambda => free%lambda(by_growth))
        call compute_turns(motion%frame, aimag(lambda) * free%period, real(lambda) * free%period, spread(free%scale, 2, &
          & size(lambda)) * free%p(:, by_growth, 1), point)
      end associate
      return
    end if
    call solve_floquet(motion%frame, accuracy_type(tolerance=rough), .false., floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .true., multipliers, error)
    if (.not. allocated(error)) call compute_turns(motion%frame, multipliers%arg, multipliers%log_abs, multipliers%vectors, point)
  end subroutine compute_free_vibrations

  !> Finds the maximum of a goal along a line of conditions, near three given positions. Fails if the goal is invalid.
  subroutine climb_from(members, goal, start, places, levels, climb, error, motion)
    !> The machine, and its neighbours with one parameter changed each
    type(members_type), intent(in) :: members
    !> The goal whose maximum is sought
    type(goal_type), intent(in) :: goal
    !> Any condition on the line of conditions along which to search
    type(condition_type), intent(in) :: start
    !> Three ascending positions on the line, and the levels of the goal at these positions (see `level` of
    !> gestell_study_design_goal)
    real(dp), intent(in) :: places(3), levels(3)
    !> The maximum of the goal along the line, and how it was found
    type(climb_type), intent(out) :: climb
    type(error_type), allocatable, intent(out) :: error
    !> If present, the search for each motion starts from the motion before it. On return this is the last motion
    type(motion_type), intent(inout), optional :: motion
    type(speed_point_type) :: point
    real(dp) :: level

    ! a start from a known motion shows that this search is part of a larger one: if the maximum is not smooth, a rough position is
    ! enough
    call climb%start(places, levels, places([1, 3]), merge(of_smooth, max_steps, present(motion)))
    do while (.not. climb%done)
      call evaluate_condition(members, [goal], start%moved_to(climb%next), .false., point, error, motion)
      if (allocated(error)) return
      level = -huge(level)
      if (point%state == stable) level = goal%level(point%values(1, 1))
      call climb%take(level)
    end do
    call climb_branches(members, goal, start, places([1, 3]), climb, error, motion)
  end subroutine climb_from

  !> If a goal is larger at the end of a line of conditions than at the point before it, searches for a maximum between the two.
  !> The interval is halved until its middle is higher than the end, or until a parabola has its vertex beyond the end. Fails if
  !> the goal is invalid.
  subroutine search_near_end(members, goal, start, ends, end_levels, places, levels, error)
    !> The machine, and its neighbours with one parameter changed each
    type(members_type), intent(in) :: members
    !> The goal whose maximum is sought
    type(goal_type), intent(in) :: goal
    !> Any condition on the line of conditions along which to search
    type(condition_type), intent(in) :: start
    !> Positions of the last point before the end and of the end itself, and the levels of the goal at both
    real(dp), intent(in) :: ends(2), end_levels(2)
    !> Three ascending positions, and the levels of the goal at these positions. If there is a maximum, the middle level is the
    !> highest
    real(dp), intent(out) :: places(3), levels(3)
    type(error_type), allocatable, intent(out) :: error
    type(speed_point_type) :: point
    integer :: k, beyond

    places = [ends(1), ends(1), ends(2)]
    levels = [end_levels(1), end_levels(1), end_levels(2)]
    beyond = 0
    do k = 1, max_halvings
      places(2) = (places(1) + places(3)) / 2
      call evaluate_condition(members, [goal], start%moved_to(places(2)), .false., point, error)
      if (allocated(error) .or. point%state /= stable) exit
      levels(2) = goal%level(point%values(1, 1))
      if (levels(2) > levels(3)) exit
      ! checks the slope at the end; the parabola may be wrong once, while it is still far from the end
      if (.not. 3 * levels(3) - 4 * levels(2) + levels(1) < 0) beyond = beyond + 1
      if (beyond > 1) exit
      places(1) = places(2)
      levels(1) = levels(2)
    end do
    if (places(1) > places(3)) then
      places = places([3, 2, 1])
      levels = levels([3, 2, 1])
    end if
  end subroutine search_near_end

end module gestell_study_design_range_top
