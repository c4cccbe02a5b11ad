!> Finds critical speeds: speeds near the crossings of the Campbell diagram at which the vibration has a maximum.
module gestell_task_critical
  use gestell_base_error, only: error_type, fatal_error, invalid_input, resonance
  use gestell_math_series_fourier, only: largest_value
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: has_vibration, in_resonance, not_judged, operator(/=), operator(==), undamped, undecided, &
    & unstable, verdict_type, worst
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: floquet_type, follow, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_frame_of, only: frame_of
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_rows, only: probe_type, quantity_type
  use gestell_study_speeds, only: check_harmonic_options
  use gestell_task_campbell, only: campbell_options
  use gestell_task_campbell_crossings, only: crossing_type
  use gestell_task_resonance_maxima, only: find_maxima, maximum_type, step_to_top
  use gestell_task_resonance_points, only: curve_point_type, curve_points_type
  use gestell_system_family, only: family_type
  use gestell_study_member, only: member_type
  use gestell_study_speed_point, only: speed_point_type
  use gestell_study_vibration_motion, only: accelerations_type, sample_accelerations, whole_motion
  use gestell_study_vibration_small_motion, only: moved, moved_type
  use gestell_system_second_order, only: second_order_system
  use gestell_task_common_executor, only: executor_type, distribute_over, work_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: find_critical

  !> What is found at a crossing. `peak`: the vibration has a peak. `no_peak`: it has no peak, because the damping is high or the
  !> order hardly excites the mode. `unbounded`: the vibration grows without bound, because the damping is zero within its error.
  !> `self_excited`: the free vibration grows.
  integer, parameter, public :: peak = 1, no_peak = 2, unbounded = 3, self_excited = 4
  character(len=9), parameter, public :: outcomes(4) = [character(len=9) :: "peak", "no_peak", "unbounded", "unstable"]

  !> Quantities whose peaks are sought. `amplitude` (m): the harmonic of the crossing's order in all degrees of freedom, as one
  !> number. It is the norm of the complex amplitudes, weighted with the mean mass matrix and divided by the square root of the
  !> total mass. `force` (N): maximum of the total force on the ground.
  integer, parameter, public :: amplitude = 1, force = 2
  !> Row of a point's values that contains how much the order contributes to the quantity, which is in row 1. For `amplitude` it is
  !> the contribution of the order to the mean square of the vibration. For `force` it is the force amplitude of the order divided
  !> by the maximum force.
  integer, parameter :: part_of_order = 3

  !> Result of the search at a crossing: a critical speed, or the reason why there is none.
  type, public :: critical_type
    type(crossing_type) :: crossing
    !> Outcome of the search: `peak`, `no_peak`, `unbounded` or `self_excited`
    integer :: outcome = no_peak
    !> Half width of the resonance, computed from the damping of the mode (1/min). It is half of the range of speeds in which the
    !> vibration exceeds 1/sqrt(2) of its peak
    real(dp) :: half_width = 0
    !> For each quantity: true if it has a peak near the crossing
    logical :: found(2) = .false.
    !> Results for each of the two quantities; 0 if it has no peak. `speed`: speed of the peak (1/min). `error`: error bound of
    !> this speed (1/min). `height`: value of the quantity at the peak (m, N). `prominence`: height divided by the value at the
    !> higher of the two minima next to the peak
    real(dp), dimension(2) :: speed = 0, error = 0, height = 0, prominence = 0
    !> Contribution of the order to the mean square of the vibration, at the peak of the amplitude
    real(dp) :: share = 0
    !> Worst verdict on the machine at the peaks of amplitude and force. If the vibration is unbounded or self-excited, the verdict
    !> at the crossing
    type(verdict_type) :: verdict
    !> Largest displacement and rotation of the frame at the peaks of amplitude and force
    type(moved_type) :: moved
  end type critical_type

  !> Parallel work: each piece searches for the peaks near one crossing.
  type, extends(work_type) :: searches_type
    class(family_type), pointer :: family => null()
    type(campbell_options) :: options
    type(crossing_type), allocatable :: crossings(:)
    type(critical_type), allocatable :: critical(:)
  contains
    procedure :: compute, exchange
  end type searches_type

  !> The search extends to both sides of a crossing by `reach` half widths of the resonance, but at most by `most_reach` times the
  !> speed. A peak belongs to a crossing if the distance between them is less than about `near` half widths
  real(dp), parameter :: reach = 6, most_reach = 0.3_dp, near = 1
  !> Number of equidistant speeds at which a search computes the vibration first
  integer, parameter :: samples = 37
  !> Minimum prominence of a peak: its height divided by the value at the higher of the two minima next to it
  real(dp), parameter :: least_prominence = 1.02_dp
  !> Accuracy of the speed of a peak, in half widths of the resonance
  real(dp), parameter :: exact = 1.0e-3_dp
  !> Maximum number of rounds in which the speeds of peaks are improved
  integer, parameter :: max_rounds = 40
  !> Two speeds count as equal if their relative difference is smaller than this
  real(dp), parameter :: same = 4 * epsilon(1.0_dp)

contains

  !> Finds the critical speeds near all `crossings` that belong to a harmonic of the period. Fails if crossings or orders are
  !> invalid, if the family rejects a speed, or if its members are not frames.
  subroutine find_critical(family, options, crossings, critical, error, executor)
    !> Family of machines that depend on the speed (1/min)
    class(family_type), intent(in), target :: family
    type(campbell_options), intent(in) :: options
    !> Crossings in the Campbell diagram; those with `harmonic` = 0 are skipped
    type(crossing_type), intent(in) :: crossings(:)
    !> Results of the search, one for each crossing that is not skipped
    type(critical_type), allocatable, intent(out) :: critical(:)
    type(error_type), allocatable, intent(out) :: error
    !> Distributes the searches over threads or processes
    class(executor_type), intent(inout), optional :: executor
    type(searches_type) :: work

    call check_harmonic_options(options, error)
    if (allocated(error)) return
    if (.not. all(ieee_is_finite(crossings%speed) .and. abs(crossings%speed) > 0 .and. crossings%order > 0)) then
      call fatal_error(error, "a crossing must have a finite speed other than 0 and a positive order", invalid_input)
      return
    end if
    work%family => family
    work%options = options
    work%crossings = pack(crossings, crossings%harmonic > 0)
    allocate(work%critical(size(work%crossings)))
    call distribute_over(work, size(work%crossings), error, executor)
    if (allocated(error)) return
    call move_alloc(work%critical, critical)
    call remove_duplicates(critical)
  end subroutine find_critical

  !> Searches for the peaks of amplitude and force near crossing number `k`.
  recursive subroutine compute(self, k, error)
    class(searches_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    !> To see whether the order excites an undamped mode, the vibration is computed at this relative distance from the speed of the
    !> crossing
    real(dp), parameter :: aside = 1.0e-3_dp
    type(curve_points_type) :: curve
    type(maximum_type) :: tops(2)
    type(speed_point_type), allocatable :: points(:)
    type(speed_point_type) :: nearby
    real(dp), allocatable :: speeds(:)
    real(dp) :: half, step(2), gain_of_step
    integer :: i, round, quantity

    associate (options => self%options, crossing => self%crossings(k), critical => self%critical(k))
      critical%crossing = crossing
      associate (mode => crossing%at)
        critical%half_width = 60 / (2 * pi) * max(abs(mode%growth), abs(mode%partner_growth)) / crossing%order
        if (mode%growth > mode%error) critical%outcome = self_excited
        if (max(abs(mode%growth), abs(mode%partner_growth)) <= mode%error) critical%outcome = unbounded
        if (critical%outcome == self_excited) critical%verdict = unstable
        if (critical%outcome == unbounded) then
          critical%verdict = merge(undamped, undecided, mode%neutral)
          ! there is no peak if the order does not excite the mode close to an undamped crossing
          call solve_at_speed(self%family, options, crossing%speed * (1 + aside), crossing%harmonic, nearby, error)
          if (.not. allocated(error) .and. has_vibration(nearby%state)) then
            if (nearby%values(part_of_order, amplitude) < options%accuracy%tolerance) critical%outcome = no_peak
          end if
        end if
        if (critical%outcome /= no_peak .or. critical%verdict /= not_judged) return
      end associate
      half = reach * critical%half_width + abs(crossing%ends(2) - crossing%ends(1)) / 2
      half = min(max(half, reach * crossing%error), most_reach * abs(crossing%speed))
      allocate(curve%points(0))
      speeds = [(crossing%speed + half * (2.0_dp * (i - 1) / (samples - 1) - 1), i = 1, samples)]
      do round = 1, max_rounds
        allocate(points(size(speeds)))
        do i = 1, size(speeds)
          call solve_at_speed(self%family, options, speeds(i), crossing%harmonic, points(i), error)
          if (allocated(error)) return
        end do
        call curve%insert(points, refined=.false.)
        deallocate(points)
        if (any(curve%points%state == in_resonance)) then
          critical%outcome = unbounded
          critical%verdict = undecided
          return
        end if
        step = 0
        do quantity = amplitude, force
          call nearest_top(curve, quantity, critical, 2 * half / (samples - 1), tops(quantity))
          associate (i => tops(quantity)%point, enough => exact * critical%half_width)
            if (i == 0) cycle
            if (curve%points(i + 1)%speed - curve%points(i - 1)%speed <= 2 * enough) cycle
            call step_to_top(curve, tops(quantity), step(quantity), gain_of_step)
            ! If the points are far apart, the parabola through them is less accurate than its last step suggests.
            if (abs(step(quantity)) <= enough / 4) step(quantity) = 0
          end associate
        end do
        call curve%select_new(pack(tops%speed + step, abs(step) > 0), same, speeds)
        if (size(speeds) == 0) exit
      end do
      do quantity = amplitude, force
        if (tops(quantity)%point > 0) call record_peak(curve%points(tops(quantity)%point), tops(quantity), options, critical)
      end do
      critical%outcome = merge(peak, no_peak, critical%found(amplitude))
    end associate
  end subroutine compute

  !> Writes the result at a crossing to a record, or reads it from a record.
  subroutine exchange(self, k, record)
    class(searches_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)

    words = transfer(self%critical(k), [0_int64])
    call record%pass_words(words)
    self%critical(k) = transfer(words, self%critical(k))
  end subroutine exchange

  !> Removes duplicate peaks. If two crossings lead to the same peak, it is kept only for the closer crossing. Distances are
  !> measured in half widths of the resonance.
  pure subroutine remove_duplicates(critical)
    type(critical_type), intent(inout) :: critical(:)
    integer :: i, k, quantity

    do i = 1, size(critical)
      do quantity = 1, 2
        do k = 1, size(critical)
          associate (own => critical(i), other => critical(k))
            if (k == i .or. .not. (other%found(quantity) .and. own%found(quantity))) cycle
            if (quantity == amplitude .and. abs(other%crossing%order - own%crossing%order) > 0) cycle
            if (abs(other%speed(quantity) - own%speed(quantity)) > 2 * (other%error(quantity) + own%error(quantity))) cycle
            if (distance(other, quantity) >= distance(own, quantity)) cycle
            own%found(quantity) = .false.
            own%speed(quantity) = 0
            own%error(quantity) = 0
            own%height(quantity) = 0
            own%prominence(quantity) = 0
            if (quantity == force) cycle
            own%outcome = no_peak
            own%share = 0
          end associate
        end do
      end do
    end do

  contains

    !> Distance of a peak from its crossing, in half widths of the resonance.
    pure real(dp) function distance(one, quantity)
      type(critical_type), intent(in) :: one
      integer, intent(in) :: quantity

      distance = abs(one%speed(quantity) - one%crossing%speed) / one%half_width
    end function distance

  end subroutine remove_duplicates

  !> Finds the maximum of a quantity that is nearest to the crossing. `top%point` is 0 if no maximum is near enough. `apart`:
  !> distance between the sampled speeds (1/min).
  subroutine nearest_top(curve, quantity, critical, apart, top)
    type(curve_points_type), intent(in) :: curve
    integer, intent(in) :: quantity
    type(critical_type), intent(in) :: critical
    real(dp), intent(in) :: apart
    type(maximum_type), intent(out) :: top
    type(maximum_type), allocatable :: maxima(:)
    real(dp) :: limit
    integer :: k

    call find_maxima(curve, quantity, spread(.false., 1, size(curve%points) - 1), log(least_prominence), maxima)
    associate (crossing => critical%crossing)
      limit = near * critical%half_width + abs(crossing%ends(2) - crossing%ends(1)) / 2 + apart
      do k = 1, size(maxima)
        if (abs(maxima(k)%speed - crossing%speed) >= limit) cycle
        limit = abs(maxima(k)%speed - crossing%speed)
        top = maxima(k)
      end do
    end associate
  end subroutine nearest_top

  !> Records a peak, and updates the worst verdict and the largest motion. Rejects an amplitude that is zero within the accuracy.
  !> Also rejects a peak of the force that is too high for the contribution of this order, because another order causes it.
  subroutine record_peak(point, top, options, critical)
    type(curve_point_type), intent(in) :: point
    type(maximum_type), intent(in) :: top
    type(campbell_options), intent(in) :: options
    type(critical_type), intent(inout) :: critical

    associate (q => top%quantity, share => point%values(part_of_order, top%quantity))
      if (q == amplitude .and. share < options%accuracy%tolerance) return
      if (q == force .and. 1 - exp(-top%rise) > 2 * share) return
      critical%found(q) = .true.
      critical%speed(q) = top%speed
      critical%error(q) = max(exact * critical%half_width, 4 * spacing(top%speed))
      critical%height(q) = top%value
      critical%prominence(q) = exp(top%rise)
      if (q == amplitude) critical%share = share
    end associate
    if (has_vibration(point%state)) critical%verdict = worst(critical%verdict, point%state)
    critical%moved%turn = max(critical%moved%turn, point%moved%turn)
    critical%moved%displacement = max(critical%moved%displacement, point%moved%displacement)
    critical%moved%size = point%moved%size
  end subroutine record_peak

  !> Computes amplitude, force and verdict at one speed. If the resonance makes the vibration unbounded, the point gets the state
  !> `in_resonance`.
  subroutine solve_at_speed(family, options, speed, multiple, point, error)
    class(family_type), intent(in) :: family
    type(campbell_options), intent(in) :: options
    real(dp), intent(in) :: speed
    integer, intent(in) :: multiple
    type(speed_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error
    type(member_type), target :: member
    type(multipliers_type) :: multipliers
    type(error_type), allocatable :: failure

    point%speed = speed
    allocate(point%values(3, 2), source=0.0_dp)
    allocate(point%strongest(2), source=multiple)
    call member%make(family, [speed], error)
    if (.not. allocated(error)) call member%solve(options%accuracy, .true., error)
    if (.not. allocated(error)) call member%multipliers(.false., multipliers, error)
    if (allocated(error) .or. .not. member%is_sound()) return
    select type (system => member%system)
    class is (second_order_system)
      call measure(system, member%floquet, multiple, point, failure)
    end select
    if (.not. allocated(failure)) then
      point%state = multipliers%judge()
    else if (failure%cause == resonance) then
      point%state = in_resonance
    end if
  end subroutine solve_at_speed

  !> Computes amplitude and force from the periodic vibration of a frame, or of its averaged model.
  subroutine measure(system, floquet, multiple, point, error)
    class(second_order_system), intent(in), target :: system
    type(floquet_type), intent(in) :: floquet
    integer, intent(in) :: multiple
    type(speed_point_type), intent(inout) :: point
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), pointer :: frame
    type(periodic_solution_type) :: start
    type(quantity_type) :: total
    type(probe_type) :: no_probes(0)
    real(dp), allocatable :: x(:, :), motion(:, :), forces(:, :), phases(:)
    type(accelerations_type) :: sampled
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
    complex(dp) :: harmonic(system%states / 2), wave(max(128, 8 * system%least_steps, 16 * multiple))
    real(dp) :: mass(system%states / 2, system%states / 2), peaks(6)
    integer :: count, f, i

    frame => frame_of(system)
    if (.not. associated(frame)) then
      call fatal_error(error, "critical speeds can only be computed for a frame", invalid_input)
      return
    end if
    call solve_periodic(floquet, start, error)
    if (allocated(error)) return
    count = size(wave)
    phases = [(real(i, dp) / count, i = 0, count - 1)]
    call follow(system, floquet, start, phases, x, error)
    if (allocated(error)) return
    f = size(frame%free)
    if (all(maxval(abs(x(:f, :)), dim=2) <= start%error(:f))) return     ! nothing excites the frame
    peaks = 0
    peaks(frame%free) = maxval(abs(x(:f, :)), dim=2)
    point%moved = moved(frame, peaks(:frame%dofs()))
    wave = [(exp(cmplx(0, -2 * pi * multiple * i / count, dp)), i = 0, count - 1)]
    harmonic = 2 * matmul(x(:f, :), wave) / count
    allocate(m(count, f, f), b(count, f, f), c(count, f, f))
    call system%sample_second_order(phases, m, b, c)
    mass = sum(m, dim=1) / count
    associate (size_of => point%values(1, :), share => point%values(part_of_order, :))
      size_of(amplitude) = sqrt(real(dot_product(harmonic, matmul(mass, harmonic))) / (frame%mass + frame%mechanism%mass))
      call find_quantity(frame, no_probes, "f", total, error)
      if (allocated(error)) return
      call sample_accelerations(frame, system, phases, total%rows(), sampled)
      call whole_motion(frame, system, phases, x, total%rows(), sampled, motion)
      forces = matmul(transpose(motion), total%weights(:size(motion, 1), :))
      size_of(force) = sqrt(largest_value(sum(forces**2, dim=2)))
      share(force) = norm2(abs(2 * matmul(transpose(forces), wave) / count)) / max(size_of(force), tiny(mass))
      x(:f, :) = x(:f, :) - spread(sum(x(:f, :), dim=2) / count, 2, count)
      share(amplitude) = real(dot_product(harmonic, matmul(mass, harmonic))) / 2 &
        & / max(sum(x(:f, :) * matmul(mass, x(:f, :))) / count, tiny(mass))
    end associate
  end subroutine measure

end module gestell_task_critical
