!> Optima under the conditions that are given become optima over the whole range: each machine of these searches is looked at along
!> lines through the range (gestell_task_design_range).
module gestell_task_design_cover
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_optimum_minimax, only: optimum_type
  use gestell_study_design, only: limits_alone, search_from
  use gestell_study_design_evaluation, only: design_options
  use gestell_system_family, only: family_type
  use gestell_task_design_range, only: lines_type, range_line_type, survey_range, survey_type
  implicit none (type, external)
  private

  public :: better, cover_range, judge_by

  !> Searches at the most.
  integer, parameter :: most_rounds = 4
  !> Stationarity that is asked for: beside a sharp resonance the derivatives are known as well as the place of its top, and not to
  !> the tolerance of the search.
  real(dp), parameter :: stationary = 1.0e-5_dp
  !> An excess, relative to the limit, that is none.
  real(dp), parameter :: met = 1.0e-9_dp

contains

  !> From an optimum under the order's own conditions to one over all lines; its objective and violation are those of the range.
  !> Where limits are exceeded a search first brings the greatest excess down. A search looks at the lines that hold the worst of a
  !> goal; lines that an optimum makes the worst join them (exchange). Errors: as of `survey_range`.
  subroutine cover_range(family, options, lines, optimum, error)
    class(family_type), intent(in) :: family
    type(design_options), intent(in) :: options
    type(range_line_type), intent(in) :: lines(:)
    type(optimum_type), intent(inout) :: optimum
    type(error_type), allocatable, intent(out) :: error
    type(design_options) :: own, limits
    type(optimum_type) :: next
    type(survey_type) :: survey
    logical :: used(size(lines))
    integer :: round, evaluations
    logical :: agrees, feasible

    own = options
    used = .false.
    evaluations = optimum%evaluations
    call survey_range(family, options, lines, optimum%x, .false., survey, error)
    if (allocated(error)) return
    call judge_by(options, survey, optimum)
    next = optimum
    do round = 1, most_rounds
      used(survey%line) = .true.
      own%range = lines_type(lines=pack(lines, used))
      feasible = next%feasible
      if (.not. feasible) then
        call limits_alone(own, limits)
        call search_from(family, limits, (next%x), next, error, stationary)
        if (.not. allocated(error)) feasible = next%objective <= 0
        evaluations = evaluations + next%evaluations
        next%price = spread(0.0_dp, 1, size(options%constraints))
      end if
      if (feasible .and. .not. allocated(error)) call search_from(family, own, (next%x), next, error, stationary)
      if (allocated(error)) then
        ! there is no vibration at some of the conditions
        deallocate(error)
        exit
      end if
      if (feasible) evaluations = evaluations + next%evaluations
      call survey_range(family, options, lines, next%x, .false., survey, error)
      if (allocated(error)) return
      agrees = survey%known .and. all(used(survey%line))
      call judge_by(options, survey, next)
      next%converged = agrees .and. next%converged
      if (.not. better(optimum, next)) optimum = next
      if (agrees .or. .not. survey%known) exit
    end do
    optimum%evaluations = evaluations
  end subroutine cover_range

  !> Objective, violation and whether the limits are met, over the range.
  pure subroutine judge_by(options, survey, optimum)
    type(design_options), intent(in) :: options
    type(survey_type), intent(in) :: survey
    type(optimum_type), intent(inout) :: optimum
    integer :: n

    n = size(options%objectives)
    associate (values => options%objectives%weight * survey%excess(:n), over => survey%excess(n + 1:n + size(options%constraints)))
      optimum%objective = merge(maxval(values), sum(values), options%largest)
      optimum%violation = maxval([0.0_dp, over])
      optimum%feasible = survey%known .and. all(over <= met * options%constraints%scale())
    end associate
  end subroutine judge_by

  !> Limits that are met come before the objective.
  pure logical function better(one, other)
    type(optimum_type), intent(in) :: one, other

    better = one%feasible .and. .not. other%feasible
    if (one%feasible .eqv. other%feasible) better = merge(one%objective < other%objective, one%violation < other%violation, &
      & one%feasible)
  end function better

end module gestell_task_design_cover
