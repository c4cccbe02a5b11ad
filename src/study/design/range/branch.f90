!> Finds, for every local maximum over the turn of the crank, its maximum with respect to the speed.
!>
!> A peak is the largest of several local maxima over the turn. Within one resonance each local maximum is highest at a different
!> speed. These speeds lie close together: one half-wave of the resonant vibration is largest at one speed, the next half-wave at
!> a speed that differs by a fraction of the resonance's width. `climb_from` finds one of these maxima. This module finds the
!> others separately, because each is a smooth function of the speed. A local maximum is identified by its phase. If the speed
!> changes by a half width of the resonance, the phase moves by a quarter of the distance to the next local maximum.
module gestell_study_design_range_branch
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_design_branches, only: maxima_over_turn
  use gestell_study_design_goal, only: components, goal_type, sample_goals
  use gestell_study_design_motion, only: motion_type, solve_motion
  use gestell_study_design_perturbed_members, only: condition_type, members_type
  use gestell_study_design_range_climb, only: climb_type, gain, of_smooth
  use gestell_study_measure, only: peak_measure
  implicit none (type, external)
  private

  public :: climb_branches

  !> The local maxima of a goal over the turn under one condition. `places`: their phases (turns). `levels`: their levels (see
  !> `level` of gestell_study_design_goal).
  type :: turn_type
    real(dp), allocatable :: places(:), levels(:)
  end type turn_type

  !> The local maxima over the turn are compared at the speed where the largest of them is highest, and at this distance on both
  !> sides of this speed. Unit: half widths of the resonance.
  real(dp), parameter :: comparison_distance = 0.125_dp
  !> Safety margin on the gain that is predicted by a parabola through three points, relative to this gain.
  real(dp), parameter :: margin = 1

contains

  !> Finds where a peak is highest on a line of conditions. The peak is the largest local maximum over the turn, and each local
  !> maximum over the turn has a highest value on the line. On entry `climb` holds this highest value for one local maximum. Every
  !> other local maximum that may become higher is followed along the line to its own highest value. On return `climb` holds the
  !> largest of these highest values. Fails if the goal is invalid.
  subroutine climb_branches(members, goal, start, bounds, climb, error, motion)
    !> The machine, and its neighbours with one parameter changed each
    type(members_type), intent(in) :: members
    !> The goal whose maxima are sought
    type(goal_type), intent(in) :: goal
    !> Any condition on the line of conditions along which to search
    type(condition_type), intent(in) :: start
    !> First and last position on this line between which to search
    real(dp), intent(in) :: bounds(2)
    !> On entry the maximum that is already known, on return the highest maximum
    type(climb_type), intent(inout) :: climb
    type(error_type), allocatable, intent(out) :: error
    !> See `climb_from`: on entry the motion from which the first search starts, on return the last motion
    type(motion_type), intent(inout), optional :: motion
    type(turn_type) :: at(-1:1)
    type(climb_type) :: other
    real(dp), allocatable :: levels(:, :), expected(:)
    real(dp) :: width, h, places(-1:1)
    integer :: b, k

    if (.not. (climb%smooth .and. goal%is_periodic() .and. goal%measure%kind == peak_measure .and. goal%is_inverted())) return
    width = sqrt(-climb%highest / climb%bend)
    h = comparison_distance * width
    places = climb%top + [-h, 0.0_dp, h]
    do k = -1, 1
      call find_maxima_over_turn(members, goal, start%moved_to(places(k)), at(k), error, motion)
      if (allocated(error) .or. size(at(k)%places) == 0) return
    end do
    levels = reshape([((at(k)%levels(closest(at(k), at(0)%places(b))), k = -1, 1), b = 1, size(at(0)%places))], &
      & [3, size(at(0)%places)])
    expected = [(levels(2, b) + (1 + margin) * parabola_rise(levels(:, b)), b = 1, size(levels, 2))]
    ! the search has already found the maximum for this local maximum
    expected(maxloc(at(0)%levels, dim=1)) = -huge(h)
    do
      b = maxloc(expected, dim=1)
      if (.not. expected(b) > climb%highest + gain * abs(climb%highest)) return
      expected(b) = -huge(h)
      call other%start(places, levels(:, b), [max(bounds(1), places(0) - width), min(bounds(2), places(0) + width)], of_smooth)
      do while (.not. other%done)
        call find_maxima_over_turn(members, goal, start%moved_to(other%next), at(1), error, motion)
        if (allocated(error) .or. size(at(1)%places) == 0) return
        call other%take(at(1)%levels(closest(at(1), at(0)%places(b))))
      end do
      if (other%highest <= climb%highest) cycle
      climb%top = other%top
      climb%highest = other%highest
      climb%smooth = other%smooth
    end do
  end subroutine climb_branches

  !> Computes the local maxima of a goal over the turn under one condition; there are none if there is no vibration. Fails if the
  !> goal is invalid.
  subroutine find_maxima_over_turn(members, goal, condition, turn, error, near)
    type(members_type), intent(in) :: members
    type(goal_type), intent(in) :: goal
    type(condition_type), intent(in) :: condition
    type(turn_type), intent(out) :: turn
    type(error_type), allocatable, intent(out) :: error
    !> On entry the motion under a similar condition, from which the search for the vibration starts. On return the motion under
    !> this condition
    type(motion_type), intent(inout), optional :: near
    type(motion_type) :: motion
    type(error_type), allocatable :: failure
    real(dp), allocatable :: samples(:, :, :), sizes(:), unused(:, :)

    allocate(turn%places(0), turn%levels(0))
    call solve_motion(members, condition, goal%needs_motion(), motion, failure, near)
    if (allocated(failure)) return
    allocate(samples(size(motion%phases), components(motion%frame), 1))
    call sample_goals([goal], motion%frame, members%setting%probes, motion%phases, motion%q, samples, error)
    if (allocated(error)) return
    call maxima_over_turn(samples(:, :, 1), turn%places, sizes, unused)
    turn%levels = goal%level(sizes - goal%limit)
    if (present(near)) near = motion
  end subroutine find_maxima_over_turn

  !> Index of the local maximum whose phase is nearest to `place`.
  pure integer function closest(turn, place)
    type(turn_type), intent(in) :: turn
    real(dp), intent(in) :: place

    closest = minloc(abs(modulo(turn%places - place + 0.5_dp, 1.0_dp) - 0.5_dp), dim=1)
  end function closest

  !> Predicted rise of the maximum above the middle one of three equidistant values: up to the vertex of the parabola through
  !> them, or at least up to the largest of them.
  pure real(dp) function parabola_rise(f)
    real(dp), intent(in) :: f(3)
    real(dp) :: bend

    bend = 2 * f(2) - f(1) - f(3)
    parabola_rise = max(maxval(f) - f(2), 0.0_dp)
    ! height of the vertex: (f(3) - f(1))^2 / (8 bend)
    if (8 * bend * abs(f(2)) > (f(3) - f(1))**2) parabola_rise = max(parabola_rise, (f(3) - f(1))**2 / (8 * bend))
  end function parabola_rise

end module gestell_study_design_range_branch
