!> Critical speeds: where the periodic vibration of a machine really is greatest about a crossing of the Campbell diagram.
module gestell_task_critical
  use gestell_base_error, only: error_type, fatal_error, invalid_input, resonance
  use gestell_math_fourier, only: greatest
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: floquet_type, follow, solve_multipliers, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_frame_of, only: frame_of
  use gestell_model_frame_quantity, only: exact_rows, find_quantity, guide_forces, probe_type, quantity_type, velocities
  use gestell_model_frame_varied_frame, only: varied_frame_type
  use gestell_task_campbell, only: campbell_order_type, check_campbell_order
  use gestell_task_campbell_crossings, only: crossing_type
  use gestell_study_family, only: family_type
  use gestell_study_member, only: member_type
  use gestell_study_vibration_motion, only: whole_motion
  use gestell_study_vibration_small_motion, only: moved, moved_type
  use gestell_system_second_order, only: second_order_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_positive_inf, ieee_value
  implicit none (type, external)
  private

  public :: find_critical

  !> What happens at a crossing: the vibration has a peak; it has none, for too much damping or as the order hardly excites the
  !> mode; it grows beyond all bounds; the free vibration grows by itself.
  integer, parameter, public :: peak = 1, no_peak = 2, unbounded = 3, self_excited = 4
  character(len=9), parameter, public :: outcomes(4) = [character(len=9) :: "peak", "no_peak", "unbounded", "unstable"]

  !> The two quantities that are looked at: the amplitude of the harmonic of the crossing's order, all positions together in the
  !> norm of the mean mass matrix, over the root of the mass (m); and the greatest total force on the ground (N).
  integer, parameter, public :: amplitude = 1, force = 2

  type, public :: critical_type
    type(crossing_type) :: crossing
    integer :: outcome = no_peak
    !> Half of the speeds' range (1/min) in which the vibration has more than 1 / sqrt(2) of its peak, by the damping.
    real(dp) :: half_width = 0
    !> Of each quantity: speed of its peak (1/min), how exactly that is found, the peak's height, and how many times as high it is
    !> as the higher one of the valleys on both sides. Zero where there is no peak of it.
    logical :: found(2) = .false.
    real(dp), dimension(2) :: speed = 0, error = 0, height = 0, prominence = 0
    !> Part of the order in the mean square of the vibration at the peak of its amplitude.
    real(dp) :: share = 0
    !> The verdict of the machine where the peaks are, the worst one, or at a crossing without a bound; empty where there is none.
    character(len=10) :: verdict = ""
    !> How far the frame moves at the peaks, of both the greatest.
    type(moved_type) :: moved
  end type critical_type

  !> Less than any amplitude or force.
  real(dp), parameter :: nothing = -1

  !> What a machine tells at one speed.
  type :: response_type
    !> The two quantities, infinite at resonance, `nothing` where there is no machine or no solution.
    real(dp) :: values(2) = nothing
    !> What the order has of them: its part in the mean square of the vibration, and its amplitude of the force over the greatest
    !> force.
    real(dp) :: shares(2) = 0
    type(floquet_type) :: floquet
    type(moved_type) :: moved
  end type response_type

  !> The range that is looked at, in half widths, at the most this part of the speed; samples of it. A peak belongs to a crossing
  !> that is no more than about so many half widths away.
  real(dp), parameter :: reach = 6, most_reach = 0.3_dp, near = 1
  integer, parameter :: samples = 37
  !> What stands out by less is no peak.
  real(dp), parameter :: least_prominence = 1.02_dp
  !> Peaks are found as exactly, in half widths.
  real(dp), parameter :: exact = 1.0e-3_dp

contains

  !> The critical speeds that belong to `crossings` of whole orders. Errors: crossings or an order that make no sense; the family
  !> has no sound machine at some speed (an impossible mechanism is none); it is not of frames.
  subroutine find_critical(family, order, crossings, critical, error)
    class(family_type), intent(in) :: family
    type(campbell_order_type), intent(in) :: order
    type(crossing_type), intent(in) :: crossings(:)
    type(critical_type), allocatable, intent(out) :: critical(:)
    type(error_type), allocatable, intent(out) :: error
    type(critical_type) :: one
    integer :: i

    allocate(critical(0))
    call check_campbell_order(order, error)
    if (allocated(error)) return
    if (.not. all(ieee_is_finite(crossings%speed) .and. abs(crossings%speed) > 0 .and. crossings%order > 0)) then
      call fatal_error(error, "a crossing has a finite speed and a positive order", invalid_input)
      return
    end if
    do i = 1, size(crossings)
      if (abs(crossings(i)%order - anint(crossings(i)%order)) > 0) cycle
      call search(family, order, crossings(i), one, error)
      if (allocated(error)) return
      critical = [critical, one]
    end do
    do i = 1, size(critical)
      call give_away(critical, i)
    end do
  end subroutine find_critical

  !> A peak that another crossing is nearer to, in half widths, is that one's.
  pure subroutine give_away(critical, i)
    type(critical_type), intent(inout) :: critical(:)
    integer, intent(in) :: i
    integer :: k, quantity

    do quantity = 1, 2
      do k = 1, size(critical)
        if (k == i .or. .not. (critical(k)%found(quantity) .and. critical(i)%found(quantity))) cycle
        if (quantity == amplitude .and. abs(critical(k)%crossing%order - critical(i)%crossing%order) > 0) cycle
        if (abs(critical(k)%speed(quantity) - critical(i)%speed(quantity)) &
          & > 2 * (critical(k)%error(quantity) + critical(i)%error(quantity))) cycle
        if (distance(critical(k), quantity) >= distance(critical(i), quantity)) cycle
        critical(i)%found(quantity) = .false.
        critical(i)%speed(quantity) = 0
        critical(i)%error(quantity) = 0
        critical(i)%height(quantity) = 0
        critical(i)%prominence(quantity) = 0
        if (quantity == force) cycle
        critical(i)%outcome = no_peak
        critical(i)%share = 0
      end do
    end do

  contains

    pure real(dp) function distance(one, quantity)
      type(critical_type), intent(in) :: one
      integer, intent(in) :: quantity

      distance = abs(one%speed(quantity) - one%crossing%speed) / one%half_width
    end function distance

  end subroutine give_away

  !> The highest peaks about a crossing.
  subroutine search(family, order, crossing, critical, error)
    class(family_type), intent(in) :: family
    type(campbell_order_type), intent(in) :: order
    type(crossing_type), intent(in) :: crossing
    type(critical_type), intent(out) :: critical
    type(error_type), allocatable, intent(out) :: error
    type(response_type) :: one
    real(dp) :: values(2, samples), speeds(samples), half
    integer :: i, quantity

    critical%crossing = crossing
    associate (mode => crossing%at)
      critical%half_width = 60 / (2 * pi) * max(abs(mode%growth), abs(mode%partner_growth)) / crossing%order
      if (mode%growth > mode%error) critical%outcome = self_excited
      if (max(abs(mode%growth), abs(mode%partner_growth)) <= mode%error) critical%outcome = unbounded
      if (critical%outcome == self_excited) critical%verdict = "unstable"
      if (critical%outcome == unbounded) critical%verdict = "undecided"
      if (critical%outcome /= no_peak) return
    end associate
    half = reach * critical%half_width + abs(crossing%ends(2) - crossing%ends(1)) / 2
    half = min(max(half, reach * crossing%error), most_reach * abs(crossing%speed))
    do i = 1, samples
      speeds(i) = crossing%speed + half * (2.0_dp * (i - 1) / (samples - 1) - 1)
      call respond(family, order, speeds(i), nint(crossing%order), one, error)
      if (allocated(error)) return
      values(:, i) = one%values
    end do
    if (any(values(amplitude, :) > huge(1.0_dp))) then
      critical%outcome = unbounded
      critical%verdict = "undecided"
      return
    end if
    do quantity = 1, 2
      call refine(family, order, speeds, values(quantity, :), quantity, critical, error)
      if (allocated(error)) return
    end do
    critical%outcome = merge(peak, no_peak, critical%found(amplitude))
  end subroutine search

  !> The maximum of a quantity that is nearest to the crossing, by the golden section.
  subroutine refine(family, order, speeds, values, quantity, critical, error)
    class(family_type), intent(in) :: family
    type(campbell_order_type), intent(in) :: order
    real(dp), intent(in) :: speeds(:), values(:)
    integer, intent(in) :: quantity
    type(critical_type), intent(inout) :: critical
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: golden = 0.381966_dp
    type(response_type) :: one
    real(dp) :: x(3), top, side, new, f, foot
    integer :: i

    i = nearest_top(speeds, values, critical%crossing, critical%half_width)
    if (i == 0) return
    x = speeds(i - 1:i + 1)
    top = values(i)
    do while (abs(x(3) - x(1)) > 2 * max(exact * critical%half_width, 4 * spacing(x(2))))
      side = merge(x(3), x(1), abs(x(3) - x(2)) > abs(x(2) - x(1)))
      new = x(2) + golden * (side - x(2))
      call respond(family, order, new, nint(critical%crossing%order), one, error)
      if (allocated(error)) return
      f = one%values(quantity)
      if (f > top) then
        if ((new - x(2)) * (x(3) - x(2)) > 0) then
          x = [x(2), new, x(3)]
        else
          x = [x(1), new, x(2)]
        end if
        top = f
      else if ((new - x(2)) * (x(3) - x(2)) > 0) then
        x(3) = new
      else
        x(1) = new
      end if
    end do
    foot = max(valley(values, i, 1, top), valley(values, i, -1, top), tiny(top))
    if (top < least_prominence * foot) return
    call respond(family, order, x(2), nint(critical%crossing%order), one, error)
    if (allocated(error)) return
    ! An order that the accuracy does not tell from nothing; a force that rises by more than the order has is another's peak.
    if (quantity == amplitude .and. one%shares(amplitude) < order%accuracy%tolerance) return
    if (quantity == force .and. top - foot > 2 * one%shares(force) * top) return
    critical%found(quantity) = .true.
    critical%speed(quantity) = x(2)
    critical%error(quantity) = abs(x(3) - x(1)) / 2
    critical%height(quantity) = top
    critical%prominence(quantity) = top / foot
    if (quantity == amplitude) critical%share = one%shares(amplitude)
    call judge(one, critical, error)
  end subroutine refine

  !> Adds the verdict of a machine at a peak, the worst one counts, and how far it moves there. Error: LAPACK found no eigenvalues.
  subroutine judge(one, critical, error)
    type(response_type), intent(in) :: one
    type(critical_type), intent(inout) :: critical
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: multipliers

    call solve_multipliers(one%floquet, .false., multipliers, error)
    if (allocated(error)) return
    if (any(critical%verdict == [character(len=6) :: "", "stable"]) .or. multipliers%verdict() == "unstable") then
      critical%verdict = multipliers%verdict()
    end if
    critical%moved%turn = max(critical%moved%turn, one%moved%turn)
    critical%moved%displacement = max(critical%moved%displacement, one%moved%displacement)
    critical%moved%size = one%moved%size
  end subroutine judge

  !> The sample that is a maximum, near enough to the crossing and nearest to it; 0: none.
  pure integer function nearest_top(speeds, values, crossing, half_width) result(top)
    real(dp), intent(in) :: speeds(:), values(:), half_width
    type(crossing_type), intent(in) :: crossing
    real(dp) :: limit
    integer :: k

    limit = near * half_width + abs(crossing%ends(2) - crossing%ends(1)) / 2 + abs(speeds(2) - speeds(1))
    top = 0
    do k = 2, size(speeds) - 1
      if (.not. (values(k) >= values(k - 1) .and. values(k) >= values(k + 1))) cycle
      if (abs(speeds(k) - crossing%speed) >= limit) cycle
      limit = abs(speeds(k) - crossing%speed)
      top = k
    end do
  end function nearest_top

  !> The least value on the way from sample `i` in one direction to the end or to what is higher than the top.
  pure real(dp) function valley(values, i, direction, top)
    real(dp), intent(in) :: values(:), top
    integer, intent(in) :: i, direction
    integer :: k

    valley = top
    do k = i + direction, merge(size(values), 1, direction > 0), direction
      if (values(k) > top) return
      valley = min(valley, values(k))
    end do
  end function valley

  !> What the machine tells of the order `multiple` at a speed. Error: the machine is not sound.
  subroutine respond(family, order, speed, multiple, one, error)
    class(family_type), intent(in) :: family
    type(campbell_order_type), intent(in) :: order
    real(dp), intent(in) :: speed
    integer, intent(in) :: multiple
    type(response_type), intent(out) :: one
    type(error_type), allocatable, intent(out) :: error
    type(member_type), target :: member
    class(frame_type), pointer :: frame
    type(error_type), allocatable :: failure

    call member%make(family, [speed], error)
    if (.not. allocated(error)) call member%solve(order%accuracy, .true., error)
    if (allocated(error) .or. .not. member%is_sound()) return
    one%floquet = member%floquet
    frame => frame_of(member%system)
    if (.not. associated(frame)) return
    select type (system => member%system)
    class is (second_order_system)
      call measure(frame, system, multiple, one, failure)
    end select
    if (.not. allocated(failure)) return
    if (failure%cause == resonance) one%values = ieee_value(1.0_dp, ieee_positive_inf)
  end subroutine respond

  !> `system`: the frame itself, or its averaged model.
  subroutine measure(frame, system, multiple, one, error)
    class(frame_type), intent(in) :: frame
    class(second_order_system), intent(in) :: system
    integer, intent(in) :: multiple
    type(response_type), intent(inout) :: one
    type(error_type), allocatable, intent(out) :: error
    type(periodic_solution_type) :: start
    type(quantity_type) :: total
    type(probe_type) :: no_probes(0)
    real(dp), allocatable :: x(:, :), motion(:, :), forces(:, :), phases(:)
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
    complex(dp) :: harmonic(size(frame%free)), wave(max(128, 8 * frame%least_steps, 16 * multiple))
    real(dp) :: mass(size(frame%free), size(frame%free)), reached(3)
    integer :: count, f, i, rows

    call solve_periodic(one%floquet, start, error)
    if (allocated(error)) return
    count = size(wave)
    phases = [(real(i, dp) / count, i = 0, count - 1)]
    call follow(system, one%floquet, start, phases, x, error)
    if (allocated(error)) return
    f = size(frame%free)
    reached = 0
    reached(frame%free) = maxval(abs(x(:f, :)), dim=2)
    one%moved = moved(frame, reached)
    wave = [(exp(cmplx(0, -2 * pi * multiple * i / count, dp)), i = 0, count - 1)]
    harmonic = 2 * matmul(x(:f, :), wave) / count
    allocate(m(count, f, f), b(count, f, f), c(count, f, f))
    call system%sample_second_order(phases, m, b, c)
    mass = sum(m, dim=1) / count
    one%values(amplitude) = sqrt(real(dot_product(harmonic, matmul(mass, harmonic))) / (frame%mass + frame%mechanism%mass))
    call find_quantity(frame, no_probes, "f", total, error)
    if (allocated(error)) return
    rows = merge(velocities, guide_forces, f == 3)
    select type (frame)
    class is (varied_frame_type)
      rows = exact_rows(frame)
    end select
    call whole_motion(frame, system, phases, x, rows, motion)
    forces = matmul(transpose(motion), total%weights(:size(motion, 1), :))
    one%values(force) = sqrt(greatest(sum(forces**2, dim=2)))
    one%shares(force) = norm2(abs(2 * matmul(transpose(forces), wave) / count)) / max(one%values(force), tiny(mass))
    x(:f, :) = x(:f, :) - spread(sum(x(:f, :), dim=2) / count, 2, count)
    one%shares(amplitude) = real(dot_product(harmonic, matmul(mass, harmonic))) / 2 &
      & / max(sum(x(:f, :) * matmul(mass, x(:f, :))) / count, tiny(mass))
  end subroutine measure

end module gestell_task_critical
