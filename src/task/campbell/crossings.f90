!> Finds the crossings in the Campbell diagram: speeds at which the frequency of a mode is a multiple (order) of the crank speed.
module gestell_task_campbell_crossings
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_root_search, only: root_search_type
  use gestell_study_speeds, only: check_harmonic_options
  use gestell_task_campbell, only: base_frequency, campbell_options, campbell_point_type, campbell_type, solve_point
  use gestell_system_family, only: family_type
  use gestell_study_mode_tracking, only: track
  use gestell_study_mode, only: mode_type
  use gestell_task_common_executor, only: executor_type, distribute_over, work_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: find_crossings

  !> A crossing of a mode with an order of the crank.
  type, public :: crossing_type
    !> Number of the mode that crosses the order
    integer :: mode = 0
    !> Ratio of the mode's frequency to the crank speed
    real(dp) :: order = 0
    !> Number of the harmonic of the period that the mode crosses; 0 if the crossing belongs to a half order or to an order that
    !> was not requested. A crossing with number 0 is listed only if the mode is locked and thereby loses at least half of its
    !> damping.
    integer :: harmonic = 0
    !> A mode is locked if its frequency equals the order times the crank speed over a whole interval of speeds. `ends`: ends of
    !> this interval. `speed`: middle of the interval or, if the mode is not locked, speed of the crossing. `error`: error bound of
    !> these speeds. All are in 1/min
    real(dp) :: speed = 0, ends(2) = 0, error = 0
    !> True if the mode is locked to the order over an interval of speeds that is wider than the error of its ends
    logical :: locked = .false.
    !> The mode at the speed of the crossing
    type(mode_type) :: at
  end type crossing_type

  !> Search for the crossings of one mode with one multiple of the frequency of the period. Multiples are 1/2, 1, 3/2, ...
  type :: search_type
    class(family_type), pointer :: family => null()
    type(campbell_options) :: options
    !> Number of the mode whose crossings are sought
    integer :: mode = 0
    !> Frequency of the mode at the crossings, divided by the frequency of the period; a multiple of 1/2
    real(dp) :: multiple = 0
    !> Number of the harmonic, or 0 (see `crossing_type`)
    integer :: harmonic = 0
    !> Crossings that were found
    type(crossing_type), allocatable :: crossings(:)
    !> Number of solutions that were computed
    integer :: solutions = 0
    !> True if the frequency jumps across the multiple between point number `point - 1` and point number `point`
    logical :: jump = .false.
    integer :: point = 0
    !> The last two points of the search, one on each side of the zero or of the jump
    type(campbell_point_type) :: sides(2)
  contains
    procedure :: point_at, is_identified, is_locked, value
  end type search_type

  !> Parallel work: each piece is one search for crossings.
  type, extends(work_type) :: searches_type
    type(campbell_type) :: campbell
    type(search_type), allocatable :: searches(:)
  contains
    procedure :: compute, exchange
  end type searches_type

  !> Relative accuracy to which the speed of a crossing is computed, unless the errors of the frequencies are larger
  real(dp), parameter :: speed_accuracy = 1.0e-11_dp
  integer, parameter :: max_steps = 100
  !> A frequency jumps across a multiple if its distance from the multiple stays larger than this fraction of the frequency of the
  !> period
  real(dp), parameter :: least_jump = 1.0e-6_dp
  !> Maximum number of jumps at which points are inserted
  integer, parameter :: most_jumps = 40
  !> Functions of the speed whose zeros are sought. `detuning`: frequency of the mode minus `multiple` times the frequency of the
  !> period. It is zero wherever the mode is locked. `discriminant`: square of half the difference of the mode's two growth rates
  !> where the mode is locked, and minus the square of the detuning elsewhere. It changes its sign at the ends of the locked
  !> interval.
  integer, parameter :: detuning = 1, discriminant = 2

contains

  !> Finds all crossings of the modes with the harmonics that `options` requests, within the range of `campbell`. Also finds
  !> intervals in which a mode is locked to another order or half order, if the mode thereby loses at least half of its damping.
  !> Crossings are sorted by mode, order and speed. Fails if `solve_campbell` fails, or if `campbell` has not been solved.
  subroutine find_crossings(family, options, campbell, crossings, error, executor)
    !> Family of machines that depend on the speed (1/min)
    class(family_type), intent(in), target :: family
    type(campbell_options), intent(in) :: options
    !> The Campbell diagram. Points on both sides of each jump are added to it
    type(campbell_type), intent(inout) :: campbell
    type(crossing_type), allocatable, intent(out) :: crossings(:)
    type(error_type), allocatable, intent(out) :: error
    !> Distributes the searches over threads or processes
    class(executor_type), intent(inout), optional :: executor
    type(searches_type) :: work
    type(campbell_point_type) :: sides(2)
    integer, allocatable :: harmonics(:)
    logical :: new(2)
    integer :: round, i, halves

    allocate(crossings(0))
    call check_harmonic_options(options, error)
    if (allocated(error)) return
    if (.not. allocated(campbell%points)) then
      call fatal_error(error, "the Campbell diagram is empty: call solve_campbell before find_crossings", invalid_input)
      return
    end if
    harmonics = options%requested_harmonics()
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
      call distribute_over(work, size(work%searches), error, executor)
      if (allocated(error)) return
      crossings = [crossing_type ::]
      do i = 1, size(work%searches)
        associate (search => work%searches(i), p => work%searches(i)%point)
          crossings = [crossings, search%crossings]
          campbell%solutions = campbell%solutions + search%solutions
          ! The points on both sides of the jump are inserted in the diagram, and the search starts again.
          if (search%jump) then
            sides = search%sides
            sides%ordered = .false.
            sides%unambiguous = .false.
            new = abs(sides%speed - campbell%points(p - 1)%speed) > 0 .and. abs(sides%speed - campbell%points(p)%speed) > 0
            campbell%points = [campbell%points(:p - 1), pack(sides, new), campbell%points(p:)]
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

  !> Writes the result of a search to a record, or reads it from a record. A search that needed no solution is not recorded, because
  !> repeating it is faster than reading it.
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

  !> Computes the modes at another `speed`, and numbers them like the modes at the point `near`. `point` stays unsolved if no
  !> machine exists at this speed. Fails if `solve_campbell` would fail.
  subroutine point_at(self, speed, near, point, error)
    class(search_type), intent(inout) :: self
    real(dp), intent(in) :: speed
    type(campbell_point_type), intent(in) :: near
    type(campbell_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error
    logical :: matched

    call solve_point(self%family, speed, self%options, point, error)
    associate (f => point%dofs)
      if (f > 0) self%solutions = self%solutions + 1
      if (allocated(error) .or. .not. point%solved) return
      call track(near%modes(:f), point%mass(:f, :f), base_frequency(point), point%modes(:f), matched, point%unambiguous)
    end associate
  end subroutine point_at

  !> Finds the crossing between point number `first` and the next point, if there is one, and moves `first` past it. If the
  !> frequency of the mode jumps across the multiple, sets `search%jump` instead. Such jumps occur where two modes mix and exchange
  !> their numbers.
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
    if (.not. (search%is_identified(l) .and. search%is_identified(r))) return
    crossing%mode = search%mode
    crossing%order = search%multiple / l%turns
    crossing%harmonic = search%harmonic
    f = [search%value(l, detuning), search%value(r, detuning)]
    if (search%is_locked(l)) then
      ! The interval of locking begins here at the start of the range or after a gap. Elsewhere it was found before.
      within = l
      if (last > 2) then
        if (search%is_identified(points(last - 2))) return
      end if
    else if (search%is_locked(r)) then
      within = r
    else if (f(1) * f(2) > 0) then
      return
    else
      if (abs(r%speed - l%speed) <= 4 * speed_accuracy * abs(l%speed)) return
      call find_root(search, detuning, l, r, within, crossing%error, error)
      if (allocated(error) .or. .not. within%solved) return
      search%jump = abs(search%value(within, detuning)) > least_jump * base_frequency(within) .and. .not. search%is_locked(within)
      search%point = last
      if (search%jump) return
      if (.not. search%is_locked(within)) then
        if (crossing%harmonic == 0) return
        crossing%speed = within%speed
        crossing%ends = within%speed
        crossing%at = within%modes(search%mode)
        search%crossings = [search%crossings, crossing]
        return
      end if
    end if

    ! Find the first point after the interval of locking.
    do while (last < size(points) .and. search%is_locked(r))
      if (.not. search%is_identified(points(last + 1))) exit
      last = last + 1
      r = points(last)
    end do
    call find_interval(search, l, within, r, crossing, error)
    if (allocated(error)) return
    ! orders that were not requested are listed only if locking removes at least half of the mode's damping
    mean = (crossing%at%growth + crossing%at%partner_growth) / 2
    if (crossing%harmonic == 0 .and. .not. crossing%at%growth - mean > max(abs(mean) / 2, crossing%at%error)) return
    search%crossings = [search%crossings, crossing]
  end subroutine next_crossing

  !> Finds the ends of the interval of speeds in which a mode is locked, and the mode at the middle of this interval. `within`: a
  !> point inside the interval. `l`, `r`: the points before and after it between which the ends are sought. If the mode is locked
  !> at `l` or `r`, the interval ends there.
  subroutine find_interval(search, l, within, r, crossing, error)
    type(search_type), intent(inout) :: search
    type(campbell_point_type), intent(in) :: l, within, r
    type(crossing_type), intent(inout) :: crossing
    type(error_type), allocatable, intent(out) :: error
    type(campbell_point_type) :: edges(2), middle
    real(dp) :: uncertainty(2)

    edges = [l, r]
    uncertainty = 0
    if (.not. search%is_locked(l)) call find_root(search, discriminant, l, within, edges(1), uncertainty(1), error)
    if (allocated(error)) return
    if (.not. search%is_locked(r)) call find_root(search, discriminant, within, r, edges(2), uncertainty(2), error)
    if (allocated(error)) return
    crossing%ends = edges%speed
    crossing%speed = sum(crossing%ends) / 2
    crossing%error = maxval(uncertainty)
    crossing%locked = abs(crossing%ends(2) - crossing%ends(1)) > 2 * crossing%error
    call search%point_at(crossing%speed, within, middle, error)
    crossing%at = middle%modes(search%mode)
  end subroutine find_interval

  !> Finds a zero of the function `kind` between two points at which its values have different signs. The search for a zero of the
  !> detuning also ends at a point where the mode is locked.
  subroutine find_root(own, kind, l, r, root, uncertainty, error)
    !> The search for one mode and one multiple. On return `sides` holds the last two points, one on each side of the zero
    type(search_type), intent(inout) :: own
    !> The function whose zero is sought: `detuning` or `discriminant`
    integer, intent(in) :: kind
    type(campbell_point_type), intent(in) :: l, r
    !> The point at the zero; not solved if the search reached a speed at which no machine exists
    type(campbell_point_type), intent(out) :: root
    !> Bound on the error of the speed at the zero (1/min)
    real(dp), intent(out) :: uncertainty
    type(error_type), allocatable, intent(out) :: error
    type(root_search_type) :: search
    type(campbell_point_type) :: ends(2), new
    real(dp) :: next, noise, f, tolerance
    integer :: k

    ends = [r, l]
    call search%start(r%speed, own%value(r, kind), l%speed, own%value(l, kind))
    uncertainty = search%width()
    do k = 1, max_steps
      own%sides = ends
      if ((ends(2)%speed - ends(1)%speed) * (r%speed - l%speed) < 0) own%sides = ends([2, 1])
      root = ends(minloc(abs(search%f), dim=1))
      tolerance = speed_accuracy * abs(root%speed)
      ! Error of the function's value. It results from the error of the frequency or of the difference of the exponents
      noise = root%modes(own%mode)%error
      if (kind == discriminant) noise = 2 * noise * sqrt(abs(own%value(root, kind))) + noise**2
      associate (rise => abs(search%f(1) - search%f(2)))
        uncertainty = max(search%width() * min(1.0_dp, noise / max(rise, tiny(noise))), min(tolerance, search%width()))
        if (search%found(tolerance) .or. noise > rise) return
      end associate
      next = search%next(tolerance)
      associate (nearer => merge(1, 2, abs(next - ends(1)%speed) <= abs(next - ends(2)%speed)))
        call own%point_at(next, ends(nearer), new, error)
      end associate
      if (allocated(error)) return
      if (.not. own%is_identified(new)) then
        root%solved = .false.
        return
      end if
      if (kind == detuning .and. own%is_locked(new)) then
        root = new
        return
      end if
      f = own%value(new, kind)
      if (.not. search%replaces(f)) ends(2) = ends(1)
      ends(1) = new
      call search%take(new%speed, f)
    end do
  end subroutine find_root

  !> Value of the function `kind` (`detuning` or `discriminant`) at a point.
  pure real(dp) function value(self, point, kind)
    class(search_type), intent(in) :: self
    type(campbell_point_type), intent(in) :: point
    integer, intent(in) :: kind

    associate (m => point%modes(self%mode))
      value = m%frequency() - self%multiple * base_frequency(point)
      if (kind == detuning) return
      value = -value**2
      if (self%is_locked(point)) value = ((m%growth - m%partner_growth) / 2)**2
    end associate
  end function value

  !> True if the mode is identified at the point.
  pure logical function is_identified(self, point)
    class(search_type), intent(in) :: self
    type(campbell_point_type), intent(in) :: point

    is_identified = point%solved .and. point%modes(self%mode)%identified
  end function is_identified

  !> True if the mode is locked: it has two real multipliers, and its frequency equals the multiple of the period's frequency. The
  !> two multipliers must differ by more than their errors, because at an ordinary crossing they are equal, and rounding alone can
  !> make them real.
  pure logical function is_locked(self, point)
    class(search_type), intent(in) :: self
    type(campbell_point_type), intent(in) :: point
    real(dp), parameter :: rounding = 1.0e-6_dp

    associate (base => base_frequency(point), m => point%modes(self%mode))
      is_locked = m%real_pair .and. abs(m%frequency() - self%multiple * base) < rounding * base &
        & .and. abs(m%growth - m%partner_growth) > 2 * m%error
    end associate
  end function is_locked

end module gestell_task_campbell_crossings
