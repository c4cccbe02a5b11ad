!> Which of many conditions a design is searched under: an optimum under a few of them, at which no other is worse, is one under
!> all. So the search begins with those that are the worst at the start, and those that its optimum makes worse are added until
!> there are none (exchange, as in semi-infinite programming: R. Hettich, K. O. Kortanek, SIAM Review 35, 1993, 380-429, doi
!> 10.1137/1035089).
module gestell_study_design_exchange
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_design_goal, only: goal_type
  use gestell_study_design_problem, only: design_options, evaluate_goals, goal_branches_type, inside
  use gestell_system_family, only: family_type
  implicit none (type, external)
  private

  public :: add_worse

contains

  !> Adds to the conditions `used`, shape (conditions), those that are the worst of all at x (where none is used, for every goal) or
  !> that are worse there than all used ones, `more`; all where there is no such machine, or no vibration (.not. known). Error: the
  !> goals make no sense.
  subroutine add_worse(family, options, x, used, more, known, error)
    class(family_type), intent(in) :: family
    type(design_options), intent(in) :: options
    real(dp), intent(in) :: x(:)
    logical, intent(inout) :: used(:)
    logical, intent(out) :: more, known
    type(error_type), allocatable, intent(out) :: error
    type(goal_type) :: goals(size(options%objectives) + size(options%constraints))
    type(goal_branches_type) :: at
    real(dp) :: worst(size(used))
    logical :: before(size(used))
    integer :: c, g, n

    before = used
    n = size(options%objectives)
    goals(:n) = options%objectives
    goals(n + 1:) = options%constraints
    call evaluate_goals(family, options, goals, x, .false., at, error)
    known = at%known
    if (.not. known) used = .true.
    if (known .and. .not. allocated(error)) then
      do g = 1, size(goals)
        worst = -huge(worst)
        do c = 1, size(at%value)
          if (at%group(c) == g) worst(at%condition(c)) = max(worst(at%condition(c)), at%side(c) * (at%value(c) - goals(g)%limit))
        end do
        call add_tops(worst, threshold(g, maxval(abs(at%value), mask=at%group == g)), any(before), used)
      end do
    end if
    more = any(used .neqv. before)

  contains

    !> By how much a goal of this size may exceed its limit at a condition that is not used.
    real(dp) function threshold(g, size_of_goal)
      integer, intent(in) :: g
      real(dp), intent(in) :: size_of_goal

      threshold = maxval(worst, mask=before) + inside * size_of_goal / 1000
      if (g > n) threshold = max(threshold, 0.0_dp)
    end function threshold

  end subroutine add_worse

  !> Adds the greatest values above `threshold` that none beside them exceeds; without `limited` the greatest of all.
  pure subroutine add_tops(values, threshold, limited, used)
    real(dp), intent(in) :: values(:), threshold
    logical, intent(in) :: limited
    logical, intent(inout) :: used(:)
    integer :: c

    if (.not. limited) then
      used(maxloc(values, dim=1)) = .true.
      return
    end if
    do c = 1, size(values)
      if (values(c) > threshold .and. values(c) >= maxval(values(max(1, c - 1):min(c + 1, size(values))))) used(c) = .true.
    end do
  end subroutine add_tops

end module gestell_study_design_exchange
