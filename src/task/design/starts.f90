!> Searches for a design from several starts under the given conditions. Then improves the best optima over the whole range, in
!> which each machine is examined along lines (gestell_task_design_range).
module gestell_task_design_starts
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_optimum_minimax, only: optimum_type
  use gestell_study_design, only: halton, feasibility_options, search_from
  use gestell_study_design_evaluation, only: design_options
  use gestell_system_family, only: family_type
  use gestell_task_design_plan, only: design_plan_type
  use gestell_task_design_range, only: range_of_lines_type, survey_range, range_survey_type
  use gestell_task_common_executor, only: executor_type, distribute_over, work_type
  use gestell_task_common_record, only: record_type
  implicit none (type, external)
  private

  public :: better, has_machine, set_range_values, search_starts

  !> Parallel work: each piece is a local search from one start.
  type, extends(work_type) :: search_work_type
    class(family_type), pointer :: family => null()
    type(design_plan_type), pointer :: plan => null()
    real(dp), allocatable :: starts(:, :)
    type(optimum_type), allocatable :: found(:)
  contains
    procedure :: compute, exchange
  end type search_work_type

  !> Parallel work: each piece improves one optimum over the whole range.
  type, extends(search_work_type) :: extension_work_type
  contains
    procedure :: compute => cover
  end type extension_work_type

  !> Number of optima that are improved over the whole range. They are the best ones that differ from each other.
  integer, parameter :: max_extended = 3
  !> Maximum number of rounds in which `cover` improves an optimum.
  integer, parameter :: max_rounds = 4
  !> A search has converged if the residual of the optimality conditions is below this value. Near a sharp resonance, derivatives
  !> are only as accurate as the position of the maximum, so the usual tolerance of a search cannot be reached.
  real(dp), parameter :: converged_stationarity = 1.0e-5_dp
  !> An excess over a limit counts as zero if it is below this fraction of the limit's scale.
  real(dp), parameter :: negligible_excess = 1.0e-9_dp

contains

  !> Finds an optimum from each start. If the plan has lines through a range, the optima hold over the whole range. With several
  !> starts, a start whose search fails has no optimum (see `has_machine`). Fails if the search from a single start fails, or if
  !> `survey_range` fails.
  subroutine search_starts(family, plan, found, error, executor)
    class(family_type), intent(in), target :: family
    type(design_plan_type), intent(in), target :: plan
    !> Optimum that was reached from each start, shape (starts)
    type(optimum_type), allocatable, intent(out) :: found(:)
    type(error_type), allocatable, intent(out) :: error
    !> Distributes the searches over threads
    class(executor_type), intent(inout), optional :: executor
    type(search_work_type) :: work
    type(extension_work_type) :: covers
    type(range_survey_type) :: survey
    integer :: first(plan%starts), k, n
    integer, allocatable :: distinct(:)

    work%family => family
    work%plan => plan
    allocate(work%starts(size(plan%start), plan%starts), work%found(plan%starts))
    work%starts(:, 1) = plan%start
    do k = 2, plan%starts
      work%starts(:, k) = plan%options%lower + halton(k - 1, size(plan%start)) * (plan%options%upper - plan%options%lower)
    end do
    call distribute_over(work, plan%starts, error, executor)
    if (allocated(error)) return
    call move_alloc(work%found, found)
    if (.not. plan%covers()) return
    ! Each distinct optimum is improved only once.
    first = [(first_of(k), k = 1, plan%starts)]
    distinct = pack([(k, k = 1, plan%starts)], [(first(k) == k .and. has_machine(found(k)), k = 1, plan%starts)])
    do k = 1, size(distinct)
      call survey_range(family, plan%options, plan%lines, found(distinct(k))%x, .false., survey, error)
      if (allocated(error)) return
      call set_range_values(plan%options, survey, found(distinct(k)))
      found(distinct(k))%converged = .false.
    end do
    do n = 1, min(max_extended, size(distinct))
      do k = n + 1, size(distinct)
        if (better(found(distinct(k)), found(distinct(n)))) distinct([n, k]) = distinct([k, n])
      end do
    end do
    covers%family => family
    covers%plan => plan
    n = min(max_extended, size(distinct))
    allocate(covers%found(n))
    covers%found = found(distinct(:n))
    call distribute_over(covers, n, error, executor)
    if (allocated(error)) return
    found(distinct(:n)) = covers%found
    do k = 1, plan%starts
      if (has_machine(found(k))) found(k) = found(first(k))
    end do

  contains

    !> Number of the first start that led to the same optimum as start number n.
    pure integer function first_of(n) result(f)
      integer, intent(in) :: n
      real(dp), parameter :: same = 1.0e-3_dp

      do f = 1, n - 1
        if (.not. (has_machine(found(f)) .and. has_machine(found(n)))) cycle
        if (all(abs(found(f)%x - found(n)%x) <= same * (plan%options%upper - plan%options%lower))) return
      end do
      f = n
    end function first_of

  end subroutine search_starts

  !> Replaces the objective, the violation of limits and the feasibility of an optimum by the values over the whole range.
  pure subroutine set_range_values(options, survey, optimum)
    type(design_options), intent(in) :: options
    type(range_survey_type), intent(in) :: survey
    type(optimum_type), intent(inout) :: optimum
    integer :: n

    n = size(options%objectives)
    associate (over => survey%excess(n + 1:n + size(options%constraints)))
      optimum%objective = options%combined(survey%excess(:n))
      optimum%violation = maxval([0.0_dp, over])
      optimum%feasible = survey%known .and. all(over <= negligible_excess * options%constraints%scale())
    end associate
  end subroutine set_range_values

  !> True if `one` is better than `other`. An optimum that meets the limits is better than one that does not. If both meet the
  !> limits, the one with the smaller objective is better. If neither meets them, the one with the smaller violation is better.
  !> Differences of rounding errors do not count, so that the choice among equal optima does not depend on the processor.
  pure logical function better(one, other)
    type(optimum_type), intent(in) :: one, other
    real(dp), parameter :: rounding = 1.0e-12_dp

    better = one%feasible .and. .not. other%feasible
    if (one%feasible .eqv. other%feasible) better = merge(other%objective - one%objective > rounding * abs(other%objective), &
      & one%violation < other%violation, one%feasible)
  end function better

  !> True if the machine at the start of the search has a vibration.
  pure logical function has_machine(optimum)
    type(optimum_type), intent(in) :: optimum

    has_machine = allocated(optimum%x)
    if (has_machine) has_machine = size(optimum%x) > 0
  end function has_machine

  !> Searches for an optimum from start number `k`.
  recursive subroutine compute(self, k, error)
    class(search_work_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call search_from(self%family, self%plan%options, self%starts(:, k), self%found(k), error)
    ! It is not an error if there is no machine at this start, provided that there are other starts.
    if (allocated(error) .and. size(self%found) > 1) then
      if (allocated(self%found(k)%x)) deallocate(self%found(k)%x)
      deallocate(error)
    end if
  end subroutine compute

  !> Improves optimum number `k` so that it holds not only for the given conditions but along all lines. Its objective and its
  !> violation of limits then refer to the whole range. Each search considers only those lines on which a goal had its worst value.
  !> If other lines become worst at the new optimum, they are added and the search is repeated (exchange method). If limits are
  !> violated, the largest excess is minimised first until all limits are met. Fails if `survey_range` fails.
  recursive subroutine cover(self, k, error)
    class(extension_work_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    type(design_options) :: own, limits
    type(optimum_type) :: next
    type(range_survey_type) :: survey
    logical :: used(size(self%plan%lines))
    integer :: round, evaluations
    logical :: agrees, feasible

    associate (options => self%plan%options, lines => self%plan%lines, optimum => self%found(k))
      own = options
      used = .false.
      evaluations = optimum%evaluations
      call survey_range(self%family, options, lines, optimum%x, .false., survey, error)
      if (allocated(error)) return
      call set_range_values(options, survey, optimum)
      next = optimum
      do round = 1, max_rounds
        used(survey%line) = .true.
        own%range = range_of_lines_type(lines=pack(lines, used))
        feasible = next%feasible
        if (.not. feasible) then
          call feasibility_options(own, limits)
          call search_from(self%family, limits, (next%x), next, error, converged_stationarity)
          if (.not. allocated(error)) feasible = next%objective <= 0
          evaluations = evaluations + next%evaluations
          next%price = spread(0.0_dp, 1, size(options%constraints))
        end if
        if (feasible .and. .not. allocated(error)) call search_from(self%family, own, (next%x), next, error, converged_stationarity)
        if (allocated(error)) then
          ! There is no vibration under some of the conditions. The best optimum so far is kept.
          deallocate(error)
          exit
        end if
        if (feasible) evaluations = evaluations + next%evaluations
        call survey_range(self%family, options, lines, next%x, .false., survey, error)
        if (allocated(error)) return
        agrees = survey%known .and. all(used(survey%line))
        call set_range_values(options, survey, next)
        next%converged = agrees .and. next%converged
        if (.not. better(optimum, next)) optimum = next
        if (agrees .or. .not. survey%known) exit
      end do
      optimum%evaluations = evaluations
    end associate
  end subroutine cover

  subroutine exchange(self, k, record)
    class(search_work_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    associate (one => self%found(k))
      call record%pass(one%x)
      call record%pass(one%groups)
      call record%pass(one%price)
      call record%pass(one%bound_price)
      call record%pass(one%slope)
      call record%pass(one%objective)
      call record%pass(one%violation)
      call record%pass(one%stationarity)
      call record%pass(one%slack)
      call record%pass(one%gap)
      call record%pass(one%iterations)
      call record%pass(one%evaluations)
      call record%pass(one%gradients)
      call record%pass(one%converged)
      call record%pass(one%feasible)
    end associate
  end subroutine exchange

end module gestell_task_design_starts
