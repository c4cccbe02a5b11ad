!> The resonance curve of a machine: peaks, rms values and orders of quantities of the vibration over the crank speed,
!> at the speeds of a grid and at those between that make it true.
!>
!> The speeds come in rounds, so that a caller may share those of one round among threads:
!>
!>     call start_curve(curve, order, grid speeds, error)
!>     do
!>       call curve%wanted(speeds)              ! none: done
!>       (solve_speed_point at each of them)
!>       call curve%add(points)
!>     end do
!>
!> `solve_curve` does that by an executor, or on one thread.
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
  use gestell_task_common_executor, only: executor_type, spread_over, work_type
  use gestell_task_common_record, only: record_type
  implicit none (type, external)
  private

  public :: solve_curve, start_curve

  type, public, extends(curve_points_type) :: resonance_curve_type
    type(speed_options) :: options
    !> Speeds of the grid that stand to be computed.
    real(dp), allocatable :: grid(:)
    integer :: rounds = 0
    !> Whether refinement came to its end, and not to its bounds.
    logical :: complete = .true.
    !> The maxima that stand out, by quantity and speed; filled by `finish`.
    type(maximum_type), allocatable :: maxima(:)
  contains
    procedure :: wanted
    procedure :: add
    procedure :: finish
  end type resonance_curve_type

  !> A piece is a speed of a round.
  type, extends(work_type) :: round_type
    class(family_type), pointer :: family => null()
    type(speed_options) :: options
    real(dp), allocatable :: speeds(:)
    type(speed_point_type), allocatable :: points(:)
  contains
    procedure :: compute
    procedure :: exchange
  end type round_type

  !> Speeds that are added to those of the grid, and rounds, at the most.
  integer, parameter, public :: most_refined = 6000, most_rounds = 100
  !> Maxima that are listed stand out of both flanks by this, in the logarithm.
  real(dp), parameter, public :: standing_out = 0.05_dp
  !> Where the state changes it is known to this part of the speed.
  real(dp), parameter :: border = 1.0e-4_dp
  !> Where the vibration may rise without bounds, beside a border of stability or without damping, intervals are not divided
  !> below this part of the speed.
  real(dp), parameter :: coarsest = 1.0e-6_dp

contains

  !> An empty curve over `speeds`, all of one sign, ascending or descending. Errors: they are not; an order that makes no sense.
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

  !> The speeds of the next round, ascending in the direction of the grid; none: the curve is done.
  subroutine wanted(self, speeds)
    class(resonance_curve_type), intent(inout) :: self
    real(dp), allocatable, intent(out) :: speeds(:)
    type(maximum_type), allocatable :: maxima(:)
    real(dp), allocatable :: more(:), level(:)
    logical, allocatable :: known(:), bent(:)
    integer :: room, n, q, i

    if (allocated(self%grid)) then
      call move_alloc(self%grid, speeds)
      return
    end if
    n = size(self%points) - 1
    associate (p => self%points)
      ! Between neighbours in different states the vibration begins or ceases to be stable.
      more = [real(dp) :: crossing_speeds(self%curve_points_type), pack([((p(i)%speed + p(i + 1)%speed) / 2, i = 1, n)], &
        & p(:n)%state /= p(2:)%state .and. [(abs(p(i)%speed - p(i + 1)%speed) > border * abs(p(i)%speed), i = 1, n)])]
      do q = 1, size(self%options%names)
        call self%levels(q, level, known)
        call bent_intervals(self, level, known, bent)
        call find_maxima(self%curve_points_type, q, level, known, bent, straight, maxima)
        more = [more, pack([((p(i)%speed + p(i + 1)%speed) / 2, i = 1, n)], bent .and. [(divisible(p(i), p(i + 1)), i = 1, n)]), &
          & top_speeds(self%curve_points_type, maxima), half_power_speeds(self%curve_points_type, maxima, bent)]
      end do
    end associate
    call self%new_ones(more, same, speeds)
    room = most_refined - count(self%points%refined)
    self%complete = size(speeds) <= room .and. (size(speeds) == 0 .or. self%rounds < most_rounds)
    if (self%rounds >= most_rounds) room = 0
    self%rounds = self%rounds + 1
    if (size(speeds) > room) speeds = speeds(:room)
  end subroutine wanted

  !> The intervals where the curve is not resolved. The straight line through the two points before an interval, continued to
  !> its other end, misses the point that was computed there by h times the change of slope, and so does the line from behind.
  !> Between the ends a bend at any one place, as where two maxima over the turn are equal, misses at most half of the greater
  !> one, a curve of constant curvature a quarter and less. Where one side is not known the other one counts twice; where
  !> neither is the interval is divided. No line goes across a jump.
  subroutine bent_intervals(self, level, known, bent)
    class(resonance_curve_type), intent(in) :: self
    real(dp), intent(in) :: level(:)
    logical, intent(in) :: known(:)
    logical, allocatable, intent(out) :: bent(:)
    real(dp) :: slope(size(level) - 1), change(size(level)), h(size(level) - 1)
    logical :: defined(size(level)), jump(size(level) - 1)
    integer :: i, n

    n = size(level)
    jump = self%jumps(level, known)
    allocate(bent(n - 1), source=.false.)
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
  end subroutine bent_intervals

  !> Whether the interval between neighbours is wide enough to be divided.
  pure logical function divisible(a, b)
    type(curve_point_type), intent(in) :: a, b
    real(dp) :: least

    least = 4 * same
    if ((a%linear .or. b%linear) .and. (a%state /= b%state .or. any(a%state == [undamped, undecided]))) least = coarsest
    divisible = abs(a%speed - b%speed) > least * abs(a%speed)
  end function divisible

  !> Takes the points of a round.
  subroutine add(self, points)
    class(resonance_curve_type), intent(inout) :: self
    type(speed_point_type), intent(in) :: points(:)

    call self%insert(points, refined=self%rounds > 0)
  end subroutine add

  !> Lists the maxima.
  subroutine finish(self)
    class(resonance_curve_type), intent(inout) :: self
    type(maximum_type), allocatable :: found(:)
    real(dp), allocatable :: level(:)
    logical, allocatable :: known(:), bent(:)
    integer :: q

    allocate(self%maxima(0))
    do q = 1, size(self%options%names)
      call self%levels(q, level, known)
      call bent_intervals(self, level, known, bent)
      call find_maxima(self%curve_points_type, q, level, known, bent, standing_out, found)
      self%maxima = [self%maxima, found]
    end do
  end subroutine finish

  !> The whole curve. With an `executor` several threads may ask for members of the family. Errors: as of `start_curve`; that of
  !> the first speed whose parameter makes no sense.
  subroutine solve_curve(family, options, speeds, curve, error, executor)
    class(family_type), intent(in), target :: family
    type(speed_options), intent(in) :: options
    real(dp), intent(in) :: speeds(:)
    type(resonance_curve_type), intent(out) :: curve
    type(error_type), allocatable, intent(out) :: error
    class(executor_type), intent(inout), optional :: executor
    type(round_type) :: round

    call start_curve(curve, options, speeds, error)
    if (allocated(error)) return
    round%family => family
    round%options = options
    do
      call curve%wanted(round%speeds)
      if (size(round%speeds) == 0) exit
      if (allocated(round%points)) deallocate(round%points)
      allocate(round%points(size(round%speeds)))
      call spread_over(round, size(round%speeds), error, executor)
      if (allocated(error)) return
      call curve%add(round%points)
    end do
    call curve%finish()
  end subroutine solve_curve

  recursive subroutine compute(self, k, error)
    class(round_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call solve_speed_point(self%family, self%speeds(k), self%options, self%points(k), error)
  end subroutine compute

  subroutine exchange(self, k, record)
    class(round_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call exchange_point(self%points(k), record)
  end subroutine exchange

end module gestell_task_resonance_curve
