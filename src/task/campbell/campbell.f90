!> Computes the Campbell diagram: follows the modes of a machine while its speed varies.
module gestell_task_campbell
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_math_sorting, only: ascending
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_frame_of, only: frame_of
  use gestell_system_family, only: family_type
  use gestell_study_member, only: member_type
  use gestell_study_mode_solution, only: solve_modes
  use gestell_study_mode_tracking, only: track
  use gestell_study_mode, only: mode_type, max_dofs
  use gestell_study_speeds, only: check_harmonic_options, check_speeds, harmonic_options
  use gestell_system_second_order, only: second_order_system
  use gestell_task_common_executor, only: executor_type, distribute_over, work_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: base_frequency, solve_campbell, solve_point

  !> Options of a Campbell diagram: accuracy of the solutions, and the harmonics whose crossings with modes are sought.
  type, extends(harmonic_options), public :: campbell_options
  end type campbell_options

  !> The modes of the machine at one speed.
  type, public :: campbell_point_type
    !> Speed, including its sign (1/min)
    real(dp) :: speed = 0
    !> True if the user requested this speed; false if it was inserted to follow the modes
    logical :: ordered = .true.
    !> True if a machine exists at this speed and at least one mode was identified
    logical :: solved = .false.
    !> Modes in the order of their numbers. Only the first `dofs` elements are used
    type(mode_type) :: modes(max_dofs)
    !> Number of turns that the crank makes in the period
    integer :: turns = 1
    !> `dofs`: number of degrees of freedom, 0 if there is no machine. `free`: degree of freedom (1: xi, 2: eta, 3: psi, ...) to
    !> which each component of the mode shapes belongs
    integer :: dofs = 0, free(max_dofs) = 0
    !> True if each mode could be matched with certainty to one mode of the previous point. Also true for the first point, and for
    !> the first point after a gap
    logical :: unambiguous = .true.
    !> Mean of the mass matrix. Only its first `dofs` rows and columns are used
    real(dp) :: mass(max_dofs, max_dofs) = 0
  end type campbell_point_type

  !> A Campbell diagram.
  type, public :: campbell_type
    !> Number of modes of the machine
    integer :: modes = 0
    !> Degree of freedom to which each component of the mode shapes belongs
    integer, allocatable :: free(:)
    !> Points in the order of the speeds, one for each speed
    type(campbell_point_type), allocatable :: points(:)
    !> Total number of solutions that were computed
    integer :: solutions = 0
  contains
    procedure :: ends
  end type campbell_type

  !> Parallel work: each piece computes the modes at one speed.
  type, extends(work_type) :: speeds_type
    class(family_type), pointer :: family => null()
    type(campbell_options) :: options
    real(dp), allocatable :: speeds(:)
    type(campbell_point_type), allocatable :: points(:)
  contains
    procedure :: compute, exchange
  end type speeds_type

  !> Maximum number of times that an interval between two speeds is halved to match the modes at its ends
  integer, parameter :: max_halvings = 7

contains

  !> Computes the modes at all `speeds` and follows them from speed to speed. If the modes at two neighbouring speeds cannot be
  !> matched with certainty, points are inserted between them. Modes are numbered by their frequencies at the lowest speed. A point
  !> at which no machine exists stays unsolved. Fails if speeds or orders are invalid, if the family rejects a speed, or if its
  !> members are not frames.
  subroutine solve_campbell(family, speeds, options, campbell, error, executor)
    !> Family of machines that depend on one parameter, the speed (1/min). With an `executor`, several threads may request members
    !> at the same time
    class(family_type), intent(in), target :: family
    !> Speeds (1/min), all of one sign, ascending or descending
    real(dp), intent(in) :: speeds(:)
    type(campbell_options), intent(in) :: options
    !> The modes at all speeds, including the inserted ones
    type(campbell_type), intent(out) :: campbell
    type(error_type), allocatable, intent(out) :: error
    class(executor_type), intent(inout), optional :: executor
    type(speeds_type) :: work
    type(campbell_point_type), allocatable :: solved_points(:)
    type(campbell_point_type) :: point, last, unsolved
    real(dp), allocatable :: missing_speeds(:)
    integer :: i

    call check_speeds(speeds, error)
    if (.not. allocated(error)) call check_harmonic_options(options, error)
    if (allocated(error)) return
    work%family => family
    work%options = options
    missing_speeds = speeds
    allocate(solved_points(0))
    ! Each round computes all points that the previous round found to be missing.
    do while (size(missing_speeds) > 0)
      work%speeds = missing_speeds
      if (allocated(work%points)) deallocate(work%points)
      allocate(work%points(size(missing_speeds)))
      call distribute_over(work, size(missing_speeds), error, executor)
      if (allocated(error)) return
      solved_points = [solved_points, work%points]
      ! Follow the modes from speed to speed with the points that have been solved, and collect the speeds of the points that are
      ! still missing.
      campbell = campbell_type(points=[campbell_point_type ::], free=[integer ::])
      missing_speeds = [real(dp) ::]
      last = unsolved
      do i = 1, size(speeds)
        point = solved_points(i)
        call record_solution(point, campbell)
        if (point%solved .and. last%solved) call connect(solved_points, last, point, max_halvings, campbell, missing_speeds)
        campbell%points = [campbell%points, point]
        if (point%solved) call update_latest(point, last)
      end do
    end do
    call number_modes(campbell)
  end subroutine solve_campbell

  recursive subroutine compute(self, k, error)
    class(speeds_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call solve_point(self%family, self%speeds(k), self%options, self%points(k), error)
  end subroutine compute

  !> Writes point number `k` to a record, or reads it from a record.
  subroutine exchange(self, k, record)
    class(speeds_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)

    words = transfer(self%points(k), [0_int64])
    call record%pass_words(words)
    self%points(k) = transfer(words, self%points(k))
  end subroutine exchange

  !> Counts a solution: increases the number of solutions in `campbell` by one, and copies the degrees of freedom from `point`. Does
  !> nothing if there is no machine at this point.
  pure subroutine record_solution(point, campbell)
    type(campbell_point_type), intent(in) :: point
    type(campbell_type), intent(inout) :: campbell

    if (point%dofs == 0) return
    campbell%modes = point%dofs
    campbell%free = point%free(:point%dofs)
    campbell%solutions = campbell%solutions + 1
  end subroutine record_solution

  !> Copies the modes of `point` to `last`, which holds the latest known data of each mode. If a mode is not identified at `point`,
  !> its previous data are kept.
  pure subroutine update_latest(point, last)
    type(campbell_point_type), intent(in) :: point
    type(campbell_point_type), intent(inout) :: last
    integer :: k

    last%speed = point%speed
    last%mass = point%mass
    last%solved = .true.
    do k = 1, max_dofs
      if (point%modes(k)%identified .or. .not. last%modes(k)%identified) last%modes(k) = point%modes(k)
    end do
  end subroutine update_latest

  !> Reorders the modes of `point` so that each continues the mode with the same number in `last`. If the modes cannot be matched
  !> with certainty, the interval between the two speeds is halved, at most `halvings` times. If the point in the middle is not
  !> among the `solved_points`, its speed is appended to `missing_speeds`.
  pure recursive subroutine connect(solved_points, last, point, halvings, campbell, missing_speeds)
    type(campbell_point_type), intent(in) :: solved_points(:), last
    type(campbell_point_type), intent(inout) :: point
    integer, intent(in) :: halvings
    type(campbell_type), intent(inout) :: campbell
    real(dp), allocatable, intent(inout) :: missing_speeds(:)
    type(campbell_point_type) :: middle, nearer
    real(dp) :: speed
    logical :: matched
    integer :: f, i

    f = campbell%modes
    call track(last%modes(:f), point%mass(:f, :f), base_frequency(point), point%modes(:f), matched, point%unambiguous)
    if (matched .or. halvings == 0) return
    speed = (last%speed + point%speed) / 2
    i = findloc(abs(solved_points%speed - speed) > 0, .false., dim=1)
    if (i == 0) then
      missing_speeds = [missing_speeds, speed]
      return
    end if
    middle = solved_points(i)
    call record_solution(middle, campbell)
    if (.not. middle%solved) return
    middle%ordered = .false.
    call connect(solved_points, last, middle, halvings - 1, campbell, missing_speeds)
    campbell%points = [campbell%points, middle]
    nearer = last
    call update_latest(middle, nearer)
    call connect(solved_points, nearer, point, halvings - 1, campbell, missing_speeds)
  end subroutine connect

  !> Computes the modes at one speed, in ascending order of their frequencies. `point` stays unsolved if no machine exists at this
  !> speed. Fails if the family rejects the speed, or if its members are not frames.
  subroutine solve_point(family, speed, options, point, error)
    !> Family of machines that depend on the speed (1/min)
    class(family_type), intent(in) :: family
    !> Crank speed (1/min)
    real(dp), intent(in) :: speed
    type(campbell_options), intent(in) :: options
    type(campbell_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error
    type(member_type), target :: member
    class(frame_type), pointer :: frame
    type(mode_type), allocatable :: modes(:)
    real(dp), allocatable :: mass(:, :)

    point%speed = speed
    call member%make(family, [speed], error)
    if (allocated(error) .or. .not. member%is_sound()) return
    frame => frame_of(member%system)
    if (.not. associated(frame)) then
      call fatal_error(error, "the members of the family must be frames: only frames have a Campbell diagram", invalid_input)
      return
    end if
    select type (system => member%system)
    class is (second_order_system)
      call solve_modes(system, options%accuracy, modes, mass, error)
    end select
    if (allocated(error)) return
    point%turns = frame%mechanism%turns
    point%dofs = size(modes)
    point%free(:size(modes)) = frame%free
    point%modes(:size(modes)) = modes
    point%mass(:size(modes), :size(modes)) = mass
    point%solved = any(modes%identified)
  end subroutine solve_point

  !> First and last speed of the diagram (1/min).
  pure function ends(self) result(speeds)
    class(campbell_type), intent(in) :: self
    real(dp) :: speeds(2)

    speeds = self%points([1, size(self%points)])%speed
  end function ends

  !> Numbers the modes in the order of their frequencies, at the lowest speed at which all modes are identified.
  pure subroutine number_modes(campbell)
    type(campbell_type), intent(inout) :: campbell
    type(campbell_point_type) :: lowest
    integer :: order(campbell%modes), i, f

    f = campbell%modes
    lowest%speed = huge(1.0_dp)
    do i = 1, size(campbell%points)
      associate (point => campbell%points(i))
        if (point%solved .and. all(point%modes(:f)%identified) .and. abs(point%speed) < abs(lowest%speed)) lowest = point
      end associate
    end do
    if (.not. lowest%solved) return
    order = ascending(lowest%modes(:f)%frequency())
    do i = 1, size(campbell%points)
      campbell%points(i)%modes(:f) = campbell%points(i)%modes(order)
    end do
  end subroutine number_modes

  !> Angular frequency 2 pi / T of the period T (rad/s). It equals |Omega| if the crank makes one turn in the period.
  elemental real(dp) function base_frequency(point)
    type(campbell_point_type), intent(in) :: point

    base_frequency = 2 * pi / 60 * abs(point%speed) / point%turns
  end function base_frequency

end module gestell_task_campbell
