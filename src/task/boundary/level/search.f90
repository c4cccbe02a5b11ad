!> Where a number of the vibration crosses its level along one parameter.
!>
!> The curve of the number is refined as a resonance curve is (gestell_task_resonance_curve), maxima included, so that no peak
!> between two points hides two crossings; between neighbours on different sides of the level there is one.
module gestell_task_boundary_level_search
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: failed, has_vibration, in_resonance, operator(==), verdict_type
  use gestell_base_kinds, only: dp
  use gestell_study_speed_point, only: speed_point_type
  use gestell_task_boundary_level_crossing, only: crossing_type, find_crossing, side_of
  use gestell_task_boundary_level_line, only: level_line_type
  use gestell_task_common_executor, only: spread_over, work_type
  use gestell_task_common_record, only: record_type
  use gestell_task_resonance_record, only: exchange_point
  use gestell_task_resonance_curve, only: resonance_curve_type, start_curve
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: find_levels

  !> A part of the line where a crossing could not be excluded, by its x; its middle, and half of its length.
  type, public :: open_type
    real(dp) :: ends(2) = 0, value = 0, width = 0
  end type open_type

  type, public :: level_results_type
    type(crossing_type), allocatable :: crossings(:)
    type(open_type), allocatable :: places(:)
    !> The curve: the parameter, the number, its error, the state of the machine.
    real(dp), allocatable :: values(:), numbers(:), errors(:)
    type(verdict_type), allocatable :: states(:)
    !> Whether the curve is refined as far as it should be.
    logical :: complete = .true.
  end type level_results_type

  !> A piece is a point of the curve.
  type, extends(work_type) :: points_type
    type(level_line_type) :: line
    real(dp), allocatable :: at(:)
    type(speed_point_type), allocatable :: points(:)
  contains
    procedure :: compute => compute_point
    procedure :: exchange => exchange_point_of
  end type points_type

  !> A piece is a crossing, between a point of the curve and the next.
  type, extends(work_type) :: crossings_type
    type(level_line_type) :: line
    type(speed_point_type), allocatable :: points(:, :)
    type(crossing_type), allocatable :: crossings(:)
  contains
    procedure :: compute => compute_crossing
    procedure :: exchange => exchange_crossing
  end type crossings_type

contains

  !> All crossings on the line, from its beginning on; `nodes`: the x where the search begins. By the line's executor, if it has
  !> one. Error: the parameters make no sense, or the order.
  subroutine find_levels(line, nodes, results, error)
    type(level_line_type), intent(in) :: line
    real(dp), intent(in) :: nodes(:)
    type(level_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error
    type(resonance_curve_type) :: curve
    type(points_type) :: work

    work%line = line
    call start_curve(curve, line%options, nodes, error)
    do while (.not. allocated(error))
      call curve%wanted(work%at)
      if (size(work%at) == 0) exit
      if (allocated(work%points)) deallocate(work%points)
      allocate(work%points(size(work%at)))
      call spread_over(work, size(work%at), error, line%line%executor)
      if (.not. allocated(error)) call curve%add(work%points)
    end do
    if (allocated(error)) return
    results%complete = curve%complete
    call take_curve(line, curve, results)
    call search_crossings(line, curve, results, error)
    if (.not. allocated(error)) call list_open(line, curve, results)
  end subroutine find_levels

  recursive subroutine compute_point(self, k, error)
    class(points_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call self%line%solve(self%at(k), self%points(k), error)
  end subroutine compute_point

  subroutine exchange_point_of(self, k, record)
    class(points_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call exchange_point(self%points(k), record)
  end subroutine exchange_point_of

  recursive subroutine compute_crossing(self, k, error)
    class(crossings_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call find_crossing(self%line, self%points(1, k), self%points(2, k), self%crossings(k), error)
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

  subroutine take_curve(line, curve, results)
    type(level_line_type), intent(in) :: line
    type(resonance_curve_type), intent(in) :: curve
    type(level_results_type), intent(inout) :: results
    integer :: i, n

    n = size(curve%points)
    associate (p => curve%points)
      results%values = line%value(p%speed)
      results%numbers = [(p(i)%values(1, 1), i = 1, n)]
      results%errors = [(p(i)%values(2, 1), i = 1, n)]
      results%states = p%state
    end associate
  end subroutine take_curve

  !> One between neighbours on different sides of the level. Error: a parameter makes no sense.
  subroutine search_crossings(line, curve, results, error)
    type(level_line_type), intent(in) :: line
    type(resonance_curve_type), intent(in) :: curve
    type(level_results_type), intent(inout) :: results
    type(error_type), allocatable, intent(out) :: error
    type(crossings_type) :: work
    integer, allocatable :: first(:)
    integer :: i, k, n

    n = size(curve%points)
    first = pack([(i, i = 1, n - 1)], [(differ(i), i = 1, n - 1)])
    work%line = line
    allocate(work%points(2, size(first)), work%crossings(size(first)))
    do k = 1, size(first)
      do i = 1, 2
        work%points(i, k) = curve%points(first(k) + i - 1)%speed_point_type
      end do
    end do
    call spread_over(work, size(first), error, line%line%executor)
    if (.not. allocated(error)) results%crossings = work%crossings

  contains

    !> Whether the numbers of point `i` and the next lie on different sides.
    logical function differ(i)
      integer, intent(in) :: i

      differ = all(has_vibration(curve%points(i:i + 1)%state))
      if (differ) differ = (curve%points(i)%values(1, 1) > line%level) .neqv. (curve%points(i + 1)%values(1, 1) > line%level)
    end function differ

  end subroutine search_crossings

  !> Where there is no vibration, as in a resonance that nothing damps; where none was found on the way to a crossing; and where the
  !> number comes to its level within its error and does not cross it.
  subroutine list_open(line, curve, results)
    type(level_line_type), intent(in) :: line
    type(resonance_curve_type), intent(in) :: curve
    type(level_results_type), intent(inout) :: results
    type(open_type) :: places(size(curve%points) + size(results%crossings))
    logical :: near(size(curve%points)), gap(size(curve%points))
    integer :: i, k, n, places_found

    n = size(curve%points)
    places_found = 0
    do k = 1, size(results%crossings)
      if (.not. results%crossings(k)%found) call add(results%crossings(k)%ends(1), results%crossings(k)%ends(2))
    end do
    results%crossings = pack(results%crossings, (results%crossings%found))
    near = [(has_vibration(curve%points(i)%state) .and. side_of(curve%points(i)%speed_point_type, line%level) == "undecided" &
      & .and. .not. between_ends(curve%points(i)%speed), i = 1, n)]
    gap = curve%points%state == in_resonance .or. curve%points%state == failed
    i = 1
    do while (i <= n)
      k = i
      if (near(i) .or. gap(i)) then
        do while (k < n)
          if (.not. (near(k + 1) .or. gap(k + 1))) exit
          k = k + 1
        end do
        call add(curve%points(max(1, i - 1))%speed, curve%points(min(n, k + 1))%speed)
      end if
      i = k + 1
    end do
    results%places = places(:places_found)

  contains

    !> Whether x lies between the ends of a crossing.
    logical function between_ends(x)
      real(dp), intent(in) :: x
      integer :: c

      between_ends = any([((x - results%crossings(c)%ends(1)) * (x - results%crossings(c)%ends(2)) <= 0, &
        & c = 1, size(results%crossings))])
    end function between_ends

    subroutine add(from, to)
      real(dp), intent(in) :: from, to

      places_found = places_found + 1
      places(places_found)%ends = [from, to]
      places(places_found)%value = (line%value(from) + line%value(to)) / 2
      places(places_found)%width = abs(line%value(from) - line%value(to)) / 2
    end subroutine add

  end subroutine list_open

end module gestell_task_boundary_level_search
