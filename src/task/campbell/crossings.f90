!> Speeds at which the frequency of a mode is a multiple of the period's: an order of the crank.
module gestell_task_campbell_crossings
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_root_search, only: root_search_type
  use gestell_task_campbell, only: campbell_options, campbell_point_type, campbell_type, check_campbell_options, &
    & base_frequency, solve_point
  use gestell_system_family, only: family_type
  use gestell_study_mode_tracking, only: track
  use gestell_study_mode_type, only: mode_type
  use gestell_task_common_executor, only: executor_type, spread_over, work_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: find_crossings

  type, public :: crossing_type
    integer :: mode = 0
    !> Frequency over crank speed; which harmonic that is of the period, 0: one that was not sought, or half way between two, which
    !> is listed only where locking to it takes at least half of the damping away.
    real(dp) :: order = 0
    integer :: harmonic = 0
    !> 1/min: the crossing, or the middle of the interval in which the mode is locked to the order; that interval; a bound on
    !> the error of the crossing or of the ends.
    real(dp) :: speed = 0, ends(2) = 0, error = 0
    logical :: locked = .false.
    !> The mode at that speed.
    type(mode_type) :: at
  end type crossing_type

  !> The search for the crossings of one mode with one multiple of half the period's frequency.
  type :: search_type
    class(family_type), pointer :: family => null()
    type(campbell_options) :: options
    integer :: mode = 0
    real(dp) :: multiple = 0
    !> As of a crossing.
    integer :: harmonic = 0
    !> What it found; solutions that it took.
    type(crossing_type), allocatable :: crossings(:)
    integer :: solutions = 0
    !> Whether a frequency turned out to jump between the points `point - 1` and `point`; the two sides of the jump.
    logical :: jump = .false.
    integer :: point = 0
    type(campbell_point_type) :: sides(2)
  contains
    procedure :: point_at, knows, locks, value
  end type search_type

  !> A piece is a search.
  type, extends(work_type) :: searches_type
    type(campbell_type) :: campbell
    type(search_type), allocatable :: searches(:)
  contains
    procedure :: compute
    procedure :: exchange
  end type searches_type

  !> Crossings are found as exactly, relative to the speed, if the errors of the frequencies allow it.
  real(dp), parameter :: exact = 1.0e-11_dp
  integer, parameter :: most_steps = 100
  !> A change of a frequency, relative to the period's, that is taken for a jump where the speed all but stays; jumps at the most.
  real(dp), parameter :: jumping = 1.0e-6_dp
  integer, parameter :: most_jumps = 40
  !> What is sought: f = frequency - multiple * that of the period, zero on a whole interval where the mode is locked; there and
  !> near it the square of half the difference of the two exponents, positive where they are real.
  integer, parameter :: detuning = 1, discriminant = 2

contains

  !> All crossings of the modes with the harmonics that `options` seeks within the range of `campbell`, and the intervals in which a
  !> mode is locked to any up to the highest of them, or half way between, and loses damping. In the order of modes, orders and
  !> speeds.
  !> Errors: `campbell` was not solved; as of `solve_campbell`.
  subroutine find_crossings(family, options, campbell, crossings, error, executor)
    class(family_type), intent(in), target :: family
    type(campbell_options), intent(in) :: options
    type(campbell_type), intent(inout) :: campbell
    type(crossing_type), allocatable, intent(out) :: crossings(:)
    type(error_type), allocatable, intent(out) :: error
    class(executor_type), intent(inout), optional :: executor
    type(searches_type) :: work
    type(campbell_point_type), allocatable :: points(:)
    type(campbell_point_type) :: sides(2)
    integer, allocatable :: harmonics(:)
    logical :: new(2)
    integer :: round, i, halves

    allocate(crossings(0))
    call check_campbell_options(options, error)
    if (allocated(error)) return
    if (.not. allocated(campbell%points)) then
      call fatal_error(error, "crossings are sought among the modes that solve_campbell found", invalid_input)
      return
    end if
    harmonics = options%sought()
    halves = 2 * maxval([0, harmonics])
    do round = 1, most_jumps
      work%campbell = campbell
      if (allocated(work%searches)) deallocate(work%searches)
      allocate(work%searches(halves * campbell%modes))
      do i = 1, size(work%searches)
        work%searches(i)%family => family
        work%searches(i)%options = options
        work%searches(i)%mode = 1 + (i - 1) / halves
        work%searches(i)%multiple = (1 + mod(i - 1, halves)) / 2.0_dp
        work%searches(i)%harmonic = maxval([0, pack(harmonics, 2 * harmonics == 1 + mod(i - 1, halves))])
      end do
      call spread_over(work, size(work%searches), error, executor)
      if (allocated(error)) return
      crossings = [crossing_type ::]
      do i = 1, size(work%searches)
        associate (search => work%searches(i))
          crossings = [crossings, search%crossings]
          campbell%solutions = campbell%solutions + search%solutions
          ! With the sides of a jump among the points the search begins anew.
          if (search%jump) then
            points = campbell%points
            new = abs(search%sides%speed - points(search%point - 1)%speed) > 0 &
              & .and. abs(search%sides%speed - points(search%point)%speed) > 0
            sides = search%sides
            sides%ordered = .false.
            sides%unambiguous = .false.
            campbell%points = [points(:search%point - 1), pack(sides, new), points(search%point:)]
            exit
          end if
        end associate
      end do
      if (i > size(work%searches)) return
    end do
  end subroutine find_crossings

  recursive subroutine compute(self, k, error)
    class(searches_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    integer :: first

    associate (search => self%searches(k))
      search%crossings = [crossing_type ::]
      first = 1
      do while (first < size(self%campbell%points))
        call next_crossing(self%campbell%points, first, search, error)
        if (allocated(error) .or. search%jump) return
      end do
    end associate
  end subroutine compute

  !> What took no solutions is found again sooner than read.
  subroutine exchange(self, k, record)
    class(searches_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)

    associate (search => self%searches(k))
      if (search%solutions == 0 .and. .not. record%reads) return
      call record%pass(search%solutions)
      call record%pass(search%jump)
      call record%pass(search%point)
      words = transfer(search%sides, [0_int64])
      call record%pass_words(words)
      search%sides = transfer(words, search%sides)
      words = [integer(int64) ::]
      if (allocated(search%crossings)) words = transfer(search%crossings, [0_int64])
      call record%pass_words(words)
      search%crossings = transfer(words, [crossing_type ::])
    end associate
  end subroutine exchange

  !> The modes at another `speed`, numbered as those at `near`. `point` is not solved where there is no machine.
  !> Error: as of `solve_campbell`.
  subroutine point_at(self, speed, near, point, error)
    class(search_type), intent(inout) :: self
    real(dp), intent(in) :: speed
    type(campbell_point_type), intent(in) :: near
    type(campbell_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error

    logical :: like

    call solve_point(self%family, speed, self%options, point, error)
    associate (f => point%dofs)
      if (f > 0) self%solutions = self%solutions + 1
      if (allocated(error) .or. .not. point%solved) return
      call track(near%modes(:f), point%mass(:f, :f), base_frequency(point), point%modes(:f), like, point%unambiguous)
    end associate
  end subroutine point_at

  !> The crossing from point `first` on, if there is one before the next point; `first` moves on. A `jump` of the frequency across
  !> the multiple is no crossing: where modes mix, their numbers change over from branch to branch.
  subroutine next_crossing(points, first, search, error)
    type(campbell_point_type), intent(in) :: points(:)
    integer, intent(inout) :: first
    type(search_type), intent(inout) :: search
    type(error_type), allocatable, intent(out) :: error
    type(campbell_point_type) :: l, r, within
    type(crossing_type) :: crossing
    real(dp) :: f(2), mean
    integer :: last

    l = points(first)
    r = points(first + 1)
    last = first + 1
    first = last
    if (.not. (search%knows(l) .and. search%knows(r))) return
    crossing%mode = search%mode
    crossing%order = search%multiple / l%turns
    crossing%harmonic = search%harmonic
    f = [search%value(l, detuning), search%value(r, detuning)]
    if (search%locks(l)) then
      ! From the start of the range or after a gap; else it was dealt with before.
      within = l
      if (last > 2) then
        if (search%knows(points(last - 2))) return
      end if
    else if (search%locks(r)) then
      within = r
    else if (f(1) * f(2) > 0) then
      return
    else
      if (abs(r%speed - l%speed) <= 4 * exact * abs(l%speed)) return
      call find_root(search, detuning, l, r, within, crossing%error, error)
      if (allocated(error) .or. .not. within%solved) return
      search%jump = abs(search%value(within, detuning)) > jumping * base_frequency(within) &
        & .and. .not. search%locks(within)
      search%point = last
      if (search%jump) return
      if (.not. search%locks(within)) then
        if (crossing%harmonic == 0) return
        crossing%speed = within%speed
        crossing%ends = within%speed
        crossing%at = within%modes(search%mode)
        search%crossings = [search%crossings, crossing]
        return
      end if
    end if

    ! The other end of the interval.
    do while (last < size(points) .and. search%locks(r))
      if (.not. search%knows(points(last + 1))) exit
      last = last + 1
      r = points(last)
    end do
    call find_interval(search, l, within, r, crossing, error)
    if (allocated(error)) return
    ! what was not sought is listed where two real multipliers are so far apart that at least half of the mode's damping is lost
    mean = (crossing%at%growth + crossing%at%partner_growth) / 2
    if (crossing%harmonic == 0 .and. .not. crossing%at%growth - mean > max(abs(mean) / 2, crossing%at%error)) return
    search%crossings = [search%crossings, crossing]
  end subroutine next_crossing

  !> The ends of the interval of speeds about `within`, between l and r, in which a mode is locked, and the mode at its middle.
  subroutine find_interval(search, l, within, r, crossing, error)
    type(search_type), intent(inout) :: search
    type(campbell_point_type), intent(in) :: l, within, r
    type(crossing_type), intent(inout) :: crossing
    type(error_type), allocatable, intent(out) :: error
    type(campbell_point_type) :: edge
    real(dp) :: doubt(2)

    crossing%ends = [l%speed, r%speed]
    doubt = 0
    if (.not. search%locks(l)) then
      call find_root(search, discriminant, l, within, edge, doubt(1), error)
      if (allocated(error)) return
      crossing%ends(1) = edge%speed
    end if
    if (.not. search%locks(r)) then
      call find_root(search, discriminant, within, r, edge, doubt(2), error)
      if (allocated(error)) return
      crossing%ends(2) = edge%speed
    end if
    crossing%speed = sum(crossing%ends) / 2
    crossing%error = maxval(doubt)
    crossing%locked = abs(crossing%ends(2) - crossing%ends(1)) > 2 * crossing%error
    call search%point_at(crossing%speed, within, edge, error)
    crossing%at = edge%modes(search%mode)
  end subroutine find_interval

  !> A zero of `kind` between two points where its signs differ; the points on both sides of it in the end are the search's. A
  !> point where the mode is locked ends the search for a detuning. `root` is not solved where there is no machine on the way;
  !> `doubt`: how far from it the zero can lie.
  subroutine find_root(own, kind, l, r, root, doubt, error)
    type(search_type), intent(inout) :: own
    integer, intent(in) :: kind
    type(campbell_point_type), intent(in) :: l, r
    type(campbell_point_type), intent(out) :: root
    real(dp), intent(out) :: doubt
    type(error_type), allocatable, intent(out) :: error
    type(root_search_type) :: search
    type(campbell_point_type) :: ends(2), new
    real(dp) :: next, noise, f, tolerance
    integer :: k

    ends = [r, l]
    call search%start(r%speed, own%value(r, kind), l%speed, own%value(l, kind))
    doubt = search%width()
    do k = 1, most_steps
      own%sides = ends
      if ((ends(2)%speed - ends(1)%speed) * (r%speed - l%speed) < 0) own%sides = ends([2, 1])
      root = ends(minloc(abs(search%f), dim=1))
      tolerance = exact * abs(root%speed)
      ! What the error of the frequency, or of the difference of the exponents, makes of the zero.
      noise = root%modes(own%mode)%error
      if (kind == discriminant) noise = 2 * noise * sqrt(abs(own%value(root, kind))) + noise**2
      associate (rise => abs(search%f(1) - search%f(2)))
        doubt = max(search%width() * min(1.0_dp, noise / max(rise, tiny(noise))), min(tolerance, search%width()))
        if (search%found(tolerance) .or. noise > rise) return
      end associate
      next = search%next(tolerance)
      associate (nearer => merge(1, 2, abs(next - ends(1)%speed) <= abs(next - ends(2)%speed)))
        call own%point_at(next, ends(nearer), new, error)
      end associate
      if (allocated(error)) return
      if (.not. own%knows(new)) then
        root%solved = .false.
        return
      end if
      if (kind == detuning .and. own%locks(new)) then
        root = new
        return
      end if
      f = own%value(new, kind)
      if (.not. search%replaces(f)) ends(2) = ends(1)
      ends(1) = new
      call search%take(new%speed, f)
    end do
  end subroutine find_root

  !> What is sought to be zero.
  pure real(dp) function value(self, point, kind)
    class(search_type), intent(in) :: self
    type(campbell_point_type), intent(in) :: point
    integer, intent(in) :: kind

    associate (m => point%modes(self%mode))
      value = m%frequency() - self%multiple * base_frequency(point)
      if (kind == detuning) return
      value = -value**2
      if (self%locks(point)) value = ((m%growth - m%partner_growth) / 2)**2
    end associate
  end function value

  !> Whether the mode is identified at a point.
  pure logical function knows(self, point)
    class(search_type), intent(in) :: self
    type(campbell_point_type), intent(in) :: point

    knows = point%solved .and. point%modes(self%mode)%identified
  end function knows

  !> Whether two real multipliers lock the mode to the multiple of the period's frequency. They must differ by more than their
  !> errors: at an ordinary crossing both are equal, and rounding alone can make them real.
  pure logical function locks(self, point)
    class(search_type), intent(in) :: self
    type(campbell_point_type), intent(in) :: point
    real(dp), parameter :: rounding = 1.0e-6_dp

    associate (base => base_frequency(point), m => point%modes(self%mode))
      locks = m%real_pair .and. abs(m%frequency() - self%multiple * base) < rounding * base &
        & .and. abs(m%growth - m%partner_growth) > 2 * m%error
    end associate
  end function locks

end module gestell_task_campbell_crossings
