!> Finds the values of one parameter at which a measured quantity crosses a level.
!>
!> The curve of the quantity against the parameter is refined like a resonance curve (gestell_task_resonance_curve), including its
!> maxima. Therefore two crossings cannot be missed because a peak lies between two points. Two neighbouring points on different
!> sides of the level enclose one crossing.
module gestell_task_boundary_level_search
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: failed, has_vibration, in_resonance, operator(==), state_word, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_math_root_search, only: root_search_type
  use gestell_study_speed_point, only: speed_point_type
  use gestell_task_boundary_level_line, only: level_line_type
  use gestell_task_boundary_line_borders, only: border_type, open_border_type
  use gestell_task_common_executor, only: distribute_over, work_type
  use gestell_task_common_record, only: record_type
  use gestell_task_resonance_curve, only: resonance_curve_type, round_type, solve_rounds
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: find_levels, side_of

  !> A crossing of a level. The inherited components `below` and `above` state on which side of the level the quantity lies (see
  !> `side_of`): `below` at parameter values just below the crossing, `above` at values just above it.
  type, extends(border_type), public :: level_crossing_type
    !> True if the search converged; false if it reached a point without a vibration.
    logical :: found = .false.
    !> Verdict on the vibration of the machine at the crossing.
    type(verdict_type) :: verdict = failed
    !> `rises`: true if the quantity rises above the level when the line is followed in its direction. `jumps`: true if the quantity
    !> is discontinuous at the crossing. There are two reasons: a limit of a frequency band meets an order of the crank, or the
    !> machine changes to another vibration.
    logical :: rises = .false., jumps = .false.
    !> `x`: the line's variable at the crossing. `ends`: two values of this variable between which the crossing is certain to lie.
    real(dp) :: x = 0, ends(2) = 0
  end type level_crossing_type

  !> Part of the line in which a crossing cannot be excluded. `ends`: limits of this part, as values of the line's variable x. The
  !> inherited components `value` and `width` are the middle and half the width of this part, in the unit of the parameter.
  type, extends(open_border_type), public :: open_level_type
    real(dp) :: ends(2) = 0
  end type open_level_type

  !> Results along a line: crossings of the level, parts in which a crossing cannot be excluded, and the curve of the measured
  !> quantity.
  type, public :: level_results_type
    type(level_crossing_type), allocatable :: crossings(:)
    type(open_level_type), allocatable :: places(:)
    !> The measured quantity along the line. In each point of the curve `values(1, 1)` contains the quantity and `values(2, 1)`
    !> its error.
    type(resonance_curve_type) :: curve
  end type level_results_type

  !> Parallel work: each piece solves the machine at one point of the curve. Its `speeds` are values of the line's variable x.
  type, extends(round_type) :: points_type
    type(level_line_type) :: line
  contains
    procedure :: compute => compute_point
  end type points_type

  !> Parallel work: each piece finds one crossing between two neighbouring points of the curve.
  type, extends(work_type) :: crossings_type
    type(level_line_type) :: line
    type(speed_point_type), allocatable :: points(:, :)
    type(level_crossing_type), allocatable :: crossings(:)
  contains
    procedure :: compute => compute_crossing, exchange => exchange_crossing
  end type crossings_type

contains

  !> Finds all crossings of the level on the line and lists them in its direction. The line's executor, if there is one, distributes
  !> the work. Fails if the parameters or the options are invalid.
  subroutine find_levels(line, nodes, results, error)
    type(level_line_type), intent(in) :: line
    !> Values of the line's variable x at which the search starts
    real(dp), intent(in) :: nodes(:)
    type(level_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error
    type(points_type) :: work

    work%line = line
    call solve_rounds(work, line%options, nodes, results%curve, error, line%executor)
    if (.not. allocated(error)) call search_crossings(line, results, error)
    if (.not. allocated(error)) call list_open(line, results)
  end subroutine find_levels

  recursive subroutine compute_point(self, k, error)
    class(points_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call self%line%solve(self%speeds(k), self%points(k), error)
  end subroutine compute_point

  recursive subroutine compute_crossing(self, k, error)
    class(crossings_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call find_crossing(self%line, self%points(:, k), self%crossings(k), error)
  end subroutine compute_crossing

  subroutine exchange_crossing(self, k, record)
    class(crossings_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)

    words = transfer(self%crossings(k), [0_int64])
    call record%pass_words(words)
    self%crossings(k) = transfer(words, self%crossings(k))
  end subroutine exchange_crossing

  !> Finds one crossing between each two neighbouring points of the curve that lie on different sides of the level. Fails if a
  !> parameter is invalid.
  subroutine search_crossings(line, results, error)
    type(level_line_type), intent(in) :: line
    type(level_results_type), intent(inout) :: results
    type(error_type), allocatable, intent(out) :: error
    type(crossings_type) :: work
    integer, allocatable :: first(:)
    integer :: i, k

    allocate(first(0))
    associate (points => results%curve%points)
      do i = 1, size(points) - 1
        if (.not. all(has_vibration(points(i:i + 1)%state))) cycle
        if ((points(i)%values(1, 1) > line%level) .neqv. (points(i + 1)%values(1, 1) > line%level)) first = [first, i]
      end do
      work%line = line
      allocate(work%points(2, size(first)), work%crossings(size(first)))
      do k = 1, size(first)
        do i = 1, 2
          work%points(i, k) = points(first(k) + i - 1)%speed_point_type
        end do
      end do
    end associate
    call distribute_over(work, size(first), error, line%executor)
    if (.not. allocated(error)) results%crossings = work%crossings
  end subroutine search_crossings

  !> Lists the parts of the line in which a crossing cannot be excluded. In some of these parts no vibration exists, as in an
  !> undamped resonance, or the search met a point without a vibration. In other parts the quantity equals its level within its
  !> error without crossing it.
  subroutine list_open(line, results)
    type(level_line_type), intent(in) :: line
    type(level_results_type), intent(inout) :: results
    logical :: is_open(0:size(results%curve%points) + 1)
    integer :: i, k

    allocate(results%places(0))
    do k = 1, size(results%crossings)
      if (.not. results%crossings(k)%found) call add(results%crossings(k)%ends)
    end do
    results%crossings = pack(results%crossings, (results%crossings%found))
    is_open = .false.
    associate (points => results%curve%points, crossings => results%crossings)
      do i = 1, size(points)
        is_open(i) = points(i)%state == in_resonance .or. points(i)%state == failed
        if (.not. has_vibration(points(i)%state)) cycle
        if (side_of(points(i)%speed_point_type, line%level) == "undecided") then
          is_open(i) = .not. any((points(i)%speed - crossings%ends(1)) * (points(i)%speed - crossings%ends(2)) <= 0)
        end if
      end do
      do i = 1, size(points)
        if (is_open(i - 1) .or. .not. is_open(i)) cycle
        k = i - 1 + findloc(is_open(i:), .false., dim=1)
        call add([points(max(1, i - 1))%speed, points(min(size(points), k))%speed])
      end do
    end associate

  contains

    subroutine add(ends)
      real(dp), intent(in) :: ends(2)

      associate (values => line%value(ends))
        results%places = [results%places, open_level_type(sum(values) / 2, abs(values(1) - values(2)) / 2, ends)]
      end associate
    end subroutine add

  end subroutine list_open

  !> Finds the crossing between two points of the curve on different sides of the level. Fails if a parameter is invalid.
  subroutine find_crossing(line, points, crossing, error)
    type(level_line_type), intent(in) :: line
    type(speed_point_type), intent(in) :: points(2)
    type(level_crossing_type), intent(out) :: crossing
    type(error_type), allocatable, intent(out) :: error
    !> The quantity counts as discontinuous if it changes by more than this fraction of the level over a distance equal to the
    !> tolerance of the crossing.
    real(dp), parameter :: jump = 1.0e-2_dp
    type(root_search_type) :: search
    type(speed_point_type) :: point
    real(dp) :: x, step

    crossing%ends = points%speed
    crossing%rises = points(2)%values(1, 1) > line%level
    call search%start(points(2)%speed, points(2)%values(1, 1) - line%level, points(1)%speed, points(1)%values(1, 1) - line%level)
    do
      x = search%root()
      step = line%step_at(x)
      if (search%found(step)) exit
      x = search%next(step)
      call line%solve(x, point, error)
      if (allocated(error)) return
      if (.not. has_vibration(point%state)) return
      call search%take(x, point%values(1, 1) - line%level)
    end do
    call line%solve(x, point, error)
    if (allocated(error)) return
    crossing%found = .true.
    crossing%verdict = point%state
    crossing%state = state_word(point%state)
    crossing%x = x
    crossing%value = line%value(x)
    crossing%jumps = abs(search%f(1) - search%f(2)) > jump * line%level .and. minval(abs(search%f)) > 0
    crossing%kind = merge("jump ", "level", crossing%jumps)
    ! If the quantity equals its level at one end of the interval, the interval may be wide.
    if (minval(abs(search%f)) > 0) step = max(step, search%width())
    call enclose(line, points, step, crossing, error)
  end subroutine find_crossing

  !> Finds two points, one on each side of the crossing, that are certain to enclose it. Their distance from the crossing starts at
  !> `distance` and is doubled until the quantity is certainly above the level at one point and certainly below it at the other. On
  !> each side the search ends at the latest at the one of `points` there. Fails if a parameter is invalid.
  subroutine enclose(line, points, distance, crossing, error)
    type(level_line_type), intent(in) :: line
    type(speed_point_type), intent(in) :: points(2)
    real(dp), intent(in) :: distance
    type(level_crossing_type), intent(inout) :: crossing
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most_doublings = 60
    type(speed_point_type) :: here
    character(len=9) :: sides(2)
    real(dp) :: away(2), values(2)
    integer :: k, doubling
    logical :: at_end(2)

    away = sign(distance, points%speed - crossing%x)
    do doubling = 1, most_doublings
      at_end = abs(away) >= abs(points%speed - crossing%x)
      crossing%ends = merge(points%speed, crossing%x + away, at_end)
      do k = 1, 2
        here = points(k)
        if (.not. at_end(k)) call line%solve(crossing%ends(k), here, error)
        if (allocated(error)) return
        sides(k) = side_of(here, line%level)
      end do
      if (all(sides /= "undecided" .or. at_end)) exit
      away = 2 * away
    end do
    values = line%value(crossing%ends)
    crossing%error = maxval(abs(values - crossing%value))
    crossing%below = sides(minloc(values, dim=1))
    crossing%above = sides(maxloc(values, dim=1))
  end subroutine enclose

  !> Side of the level on which the quantity lies: "above" or "within" (not above). The result is "undecided" if the level lies
  !> within the error bound of the quantity, or if no vibration exists.
  pure character(len=9) function side_of(point, level) result(side)
    type(speed_point_type), intent(in) :: point
    real(dp), intent(in) :: level

    side = "undecided"
    if (.not. has_vibration(point%state)) return
    if (point%values(1, 1) + point%values(2, 1) <= level) side = "within"
    if (point%values(1, 1) - point%values(2, 1) > level) side = "above"
  end function side_of

end module gestell_task_boundary_level_search
