!> Computes the resonance curve of a machine: peaks, rms values and amplitudes of the orders as functions of the crank speed, for
!> quantities of the vibration. The curve is computed at the speeds of a grid, and at as many speeds between them as its shape
!> requires.
!>
!> The speeds are chosen in rounds, so that a caller can distribute the speeds of one round over threads:
!>
!>     call start_curve(curve, options, speeds, error)
!>     do
!>       call curve%choose_speeds(speeds)       ! empty: the curve is complete
!>       (solve_speed_point at each of them)
!>       call curve%add(points)
!>     end do
!>     call curve%finish()
!>
!> `solve_rounds` executes all steps but the last, with an executor or on one thread. `solve_curve` executes all steps for a family
!> of machines that depend on the speed.
module gestell_task_resonance_curve
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: operator(/=), operator(==), undamped, undecided
  use gestell_base_kinds, only: dp
  use gestell_task_resonance_points, only: curve_point_type, curve_points_type, exchange_point, same, straight
  use gestell_system_family, only: family_type
  use gestell_task_resonance_maxima, only: find_maxima, half_power_speeds, maximum_type, top_speeds
  use gestell_task_resonance_seeds, only: crossing_speeds
  use gestell_study_speed_point, only: check_speed_options, solve_speed_point, speed_options, speed_point_type
  use gestell_study_speeds, only: check_speeds
  use gestell_task_common_executor, only: executor_type, distribute_over, work_type
  use gestell_task_common_record, only: record_type
  implicit none (type, external)
  private

  public :: solve_curve, solve_rounds, start_curve

  !> A resonance curve with the state of its refinement.
  type, public, extends(curve_points_type) :: resonance_curve_type
    type(speed_options) :: options
    !> Speeds of the grid (1/min). Allocated only before the first round
    real(dp), allocatable :: grid(:)
    !> Number of rounds of refinement that have been made
    integer :: rounds = 0
    !> True if the refinement is complete; false if it ended because of the maximum number of speeds or rounds
    logical :: complete = .true.
    !> Maxima that stand out, sorted by quantity and speed. `finish` sets this list
    type(maximum_type), allocatable :: maxima(:)
  contains
    procedure :: choose_speeds, add, finish
  end type resonance_curve_type

  !> Parallel work: each piece solves the machine at one speed of a round. An extension knows the machine.
  type, abstract, extends(work_type), public :: round_type
    real(dp), allocatable :: speeds(:)
    type(speed_point_type), allocatable :: points(:)
  contains
    procedure :: exchange
  end type round_type

  !> Round of a curve for a family of machines that depend on the speed.
  type, extends(round_type) :: family_round_type
    class(family_type), pointer :: family => null()
    type(speed_options) :: options
  contains
    procedure :: compute
  end type family_round_type

  !> `most_refined`: maximum number of speeds added to the grid. `max_rounds`: maximum number of rounds
  integer, parameter, public :: most_refined = 6000, max_rounds = 100
  !> A maximum is listed if ln(peak) exceeds the lowest value on each side of the maximum by more than this
  real(dp), parameter, public :: standing_out = 0.05_dp
  !> Relative accuracy of the speeds at which the state of the machine (stable, unstable, no vibration, ...) changes
  real(dp), parameter :: border = 1.0e-4_dp
  !> At a stability boundary, or at a resonance without damping, the vibration of the linearised equations may be unbounded.
  !> Intervals there are not divided if they are narrower than this, relative to the speed
  real(dp), parameter :: coarsest = 1.0e-6_dp

contains

  !> Initialises a curve for `speeds` (1/min) that has no points yet. Fails if the speeds differ in sign, if they are neither
  !> ascending nor descending, or if an order is invalid.
  subroutine start_curve(curve, options, speeds, error)
    type(resonance_curve_type), intent(out) :: curve
    type(speed_options), intent(in) :: options
    real(dp), intent(in) :: speeds(:)
    type(error_type), allocatable, intent(out) :: error

    call check_speeds(speeds, error)
    if (.not. allocated(error)) call check_speed_options(options, error)
    if (allocated(error)) return
    curve%options = options
    allocate(curve%grid, source=speeds)
    curve%descends = speeds(size(speeds)) < speeds(1)
    allocate(curve%points(0))
  end subroutine start_curve

  !> Returns the speeds of the next round in the order of the grid. The refinement has ended if there are none.
  subroutine choose_speeds(self, speeds)
    class(resonance_curve_type), intent(inout) :: self
    real(dp), allocatable, intent(out) :: speeds(:)
    type(maximum_type), allocatable :: maxima(:)
    real(dp), allocatable :: more(:)
    logical, allocatable :: bent(:)
    integer :: room, n, q, i

    if (allocated(self%grid)) then
      call move_alloc(self%grid, speeds)
      return
    end if
    n = size(self%points) - 1
    associate (p => self%points)
      ! If neighbouring points have different states, the vibration appears, disappears or changes its stability between them.
      more = [real(dp) :: crossing_speeds(self%curve_points_type), pack([((p(i)%speed + p(i + 1)%speed) / 2, i = 1, n)], &
        & p(:n)%state /= p(2:)%state .and. [(abs(p(i)%speed - p(i + 1)%speed) > border * abs(p(i)%speed), i = 1, n)])]
      do q = 1, size(self%options%names)
        bent = bent_intervals(self, q)
        call find_maxima(self%curve_points_type, q, bent, straight, maxima)
        more = [more, pack([((p(i)%speed + p(i + 1)%speed) / 2, i = 1, n)], bent .and. [(divisible(p(i), p(i + 1)), i = 1, n)]), &
          & top_speeds(self%curve_points_type, maxima), half_power_speeds(self%curve_points_type, maxima, bent)]
      end do
    end associate
    call self%select_new(more, same, speeds)
    room = most_refined - count(self%points%refined)
    self%complete = size(speeds) <= room .and. (size(speeds) == 0 .or. self%rounds < max_rounds)
    if (self%rounds >= max_rounds) room = 0
    self%rounds = self%rounds + 1
    if (size(speeds) > room) speeds = speeds(:room)
  end subroutine choose_speeds

  !> True for each interval between neighbouring points in which the curve of quantity number `q` is not resolved. The straight line
  !> through the two points before an interval is extrapolated to the point at the far end of the interval. There it differs from
  !> the computed value by h times the change of slope, where h is the width of the interval. The straight line through the two
  !> points after the interval gives a second difference.
  !>
  !> If the curve has one bend within the interval, it deviates from a straight line by at most half of the larger difference. Such
  !> a bend occurs where two maxima over the period are equal. A curve of constant curvature deviates by at most a quarter. If only
  !> one of the two differences is known, it counts twice. If neither is known, the interval is not resolved. Straight lines are
  !> not extrapolated across a jump.
  function bent_intervals(self, q) result(bent)
    class(resonance_curve_type), intent(in) :: self
    integer, intent(in) :: q
    logical, dimension(size(self%points) - 1) :: bent, jump
    real(dp), allocatable :: level(:)
    logical, allocatable :: known(:)
    real(dp) :: slope(size(bent)), change(size(self%points)), h(size(bent))
    logical :: defined(size(self%points))
    integer :: i, n

    call self%levels(q, level, known)
    n = size(level)
    jump = self%jumps(level, known)
    bent = .false.
    h = abs(self%points(2:)%speed - self%points(:n - 1)%speed)
    slope = 0
    where (known(2:) .and. known(:n - 1)) slope = (level(2:) - level(:n - 1)) / h
    change = 0
    defined = .false.
    do i = 2, n - 1
      defined(i) = all(known(i - 1:i + 1)) .and. .not. any(jump(i - 1:i))
      if (defined(i)) change(i) = abs(slope(i) - slope(i - 1))
    end do
    do i = 1, n - 1
      if (jump(i) .or. .not. (known(i) .and. known(i + 1))) cycle
      bent(i) = h(i) * maxval(change(i:i + 1)) > merge(2, 1, all(defined(i:i + 1))) * straight .or. .not. any(defined(i:i + 1))
    end do
  end function bent_intervals

  !> True if the interval between the neighbouring points `a` and `b` is wide enough to be divided.
  pure logical function divisible(a, b)
    type(curve_point_type), intent(in) :: a, b
    real(dp) :: least

    least = 4 * same
    if ((a%linear .or. b%linear) .and. (a%state /= b%state .or. any(a%state == [undamped, undecided]))) least = coarsest
    divisible = abs(a%speed - b%speed) > least * abs(a%speed)
  end function divisible

  !> Adds the points of a round to the curve, at the speeds that `choose_speeds` has returned.
  subroutine add(self, points)
    class(resonance_curve_type), intent(inout) :: self
    type(speed_point_type), intent(in) :: points(:)

    call self%insert(points, refined=self%rounds > 0)
  end subroutine add

  !> Completes the curve after the last round: finds the maxima that stand out, for all quantities.
  subroutine finish(self)
    class(resonance_curve_type), intent(inout) :: self
    type(maximum_type), allocatable :: found(:)
    integer :: q

    allocate(self%maxima(0))
    do q = 1, size(self%options%names)
      call find_maxima(self%curve_points_type, q, bent_intervals(self, q), standing_out, found)
      self%maxima = [self%maxima, found]
    end do
  end subroutine finish

  !> Computes a resonance curve with all its rounds. Fails if `start_curve` fails, or if the family rejects a speed.
  subroutine solve_curve(family, options, speeds, curve, error, executor)
    !> Family of machines that depend on the speed (1/min). With an `executor`, several threads may request members at the same time
    class(family_type), intent(in), target :: family
    type(speed_options), intent(in) :: options
    !> Speeds of the grid (1/min), all of one sign, ascending or descending
    real(dp), intent(in) :: speeds(:)
    type(resonance_curve_type), intent(out) :: curve
    type(error_type), allocatable, intent(out) :: error
    class(executor_type), intent(inout), optional :: executor
    type(family_round_type) :: round

    round%family => family
    round%options = options
    call solve_rounds(round, options, speeds, curve, error, executor)
    if (.not. allocated(error)) call curve%finish()
  end subroutine solve_curve

  !> Computes the points of a curve round by round. Fails if `start_curve` fails, or if the machine rejects a speed.
  subroutine solve_rounds(round, options, speeds, curve, error, executor)
    !> Solves the machine at the speeds of a round
    class(round_type), intent(inout) :: round
    type(speed_options), intent(in) :: options
    !> Speeds of the grid (1/min), all of one sign, ascending or descending
    real(dp), intent(in) :: speeds(:)
    !> The curve with all its points; its maxima are not determined yet
    type(resonance_curve_type), intent(out) :: curve
    type(error_type), allocatable, intent(out) :: error
    !> Distributes the speeds of a round over threads or processes
    class(executor_type), intent(inout), optional :: executor

    call start_curve(curve, options, speeds, error)
    do while (.not. allocated(error))
      call curve%choose_speeds(round%speeds)
      if (size(round%speeds) == 0) return
      if (allocated(round%points)) deallocate(round%points)
      allocate(round%points(size(round%speeds)))
      call distribute_over(round, size(round%speeds), error, executor)
      if (.not. allocated(error)) call curve%add(round%points)
    end do
  end subroutine solve_rounds

  recursive subroutine compute(self, k, error)
    class(family_round_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call solve_speed_point(self%family, self%speeds(k), self%options, self%points(k), error)
  end subroutine compute

  !> Writes point number `k` to a record, or reads it from a record.
  subroutine exchange(self, k, record)
    class(round_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call exchange_point(self%points(k), record)
  end subroutine exchange

end module gestell_task_resonance_curve
