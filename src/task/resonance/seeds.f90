!> Where resonances lie between the points of a curve: speeds at which a free vibration makes a whole number of swings in the
!> period, so that a multiplier comes nearest to 1. However sharp they are, the multipliers on both sides tell.
module gestell_task_resonance_seeds
  use gestell_base_kinds, only: dp, pi
  use gestell_task_resonance_points, only: curve_points_type
  implicit none (type, external)
  private

  public :: crossing_speeds, swings_of_modes

  !> Orders of the drive that are looked for.
  integer, parameter, public :: most_orders = 60
  !> A crossing is found where the detuning is less than this part of the damping, or this part of the turns.
  real(dp), parameter :: part_of_damping = 0.25_dp, part_of_turns = 1.0e-7_dp

contains

  !> The speeds that should be looked at next: where the frequency, between two neighbours on a straight line over the speed,
  !> is a harmonic of the period's; once that is found, one and three half-widths away from it, or what stands out little
  !> would be missed.
  !> `pairs`: for two frequencies whose sum is a harmonic instead, where tongues of instability lie.
  !> `counts`, shape (points): whether more should be known of a crossing that is found at this point; of all without.
  function crossing_speeds(curve, pairs, counts) result(speeds)
    class(curve_points_type), intent(in) :: curve
    logical, intent(in), optional :: pairs, counts(:)
    real(dp), allocatable :: speeds(:), swings(:, :), damping(:, :)
    logical :: asked(size(curve%points))
    integer :: highest, i, j, k

    allocate(speeds(0))
    asked = .true.
    if (present(counts)) asked = counts
    call swings_of_modes(curve, swings, damping)
    if (present(pairs)) then
      if (pairs) call add_up(swings, damping)
    end if
    highest = most_orders * maxval([1, curve%points%drive_turns])
    do i = 1, size(curve%points) - 1
      do j = 1, size(swings, 1)
        associate (a => swings(j, i), b => swings(j, i + 1), s => curve%points(i)%speed, t => curve%points(i + 1)%speed)
          if (min(a, b) < 0) cycle
          do k = max(1, ceiling(min(a, b))), min(highest, floor(min(max(a, b), real(highest, dp))))
            if (found(a, damping(j, i), k)) then
              if (asked(i)) speeds = [speeds, around(curve, s, damping(j, i) / k)]
            else if (found(b, damping(j, i + 1), k)) then
              if (asked(i + 1)) speeds = [speeds, around(curve, t, damping(j, i + 1) / k)]
            else
              ! a s + (b t - a s) (x - s) / (t - s) = k x
              speeds = [speeds, s + (t - s) * (a - k) * s / ((a - k) * s - (b - k) * t)]
            end if
          end do
        end associate
      end do
    end do
  end function crossing_speeds

  !> The modes' sums in place of the modes.
  pure subroutine add_up(swings, damping)
    real(dp), allocatable, intent(inout) :: swings(:, :), damping(:, :)
    real(dp), dimension(size(swings, 1) * (size(swings, 1) + 1) / 2, size(swings, 2)) :: sums, dampings
    integer :: i, j, k

    k = 0
    do j = 1, size(swings, 1)
      do i = 1, j
        k = k + 1
        sums(k, :) = merge(swings(i, :) + swings(j, :), -1.0_dp, min(swings(i, :), swings(j, :)) >= 0)
        dampings(k, :) = damping(i, :) + damping(j, :)
      end do
    end do
    swings = sums
    damping = dampings
  end subroutine add_up

  !> One and three half-widths away from a resonance at `speed`, where no point is near.
  function around(curve, speed, half_width) result(speeds)
    class(curve_points_type), intent(in) :: curve
    real(dp), intent(in) :: speed, half_width
    real(dp), allocatable :: speeds(:)
    real(dp) :: all(4)
    integer :: i

    all = speed * (1 + half_width * [-3, -1, 1, 3])
    speeds = pack(all, [(minval(abs(curve%points%speed - all(i))) > half_width / 2 * abs(speed), i = 1, 4)])
  end function around

  pure logical function found(swings, damping, k)
    real(dp), intent(in) :: swings, damping
    integer, intent(in) :: k

    found = abs(swings - k) <= max(part_of_damping * damping, part_of_turns * k)
  end function found

  !> Swings of every mode in the period, and its damping in the same measure, |ln |rho|| / 2 pi; shape (modes, points). From
  !> speed to speed, from the fastest on, the whole number is that which changes the frequency least: a fast crank leaves no
  !> doubt. -1: no multipliers.
  subroutine swings_of_modes(curve, swings, damping)
    class(curve_points_type), intent(in) :: curve
    real(dp), allocatable, intent(out) :: swings(:, :), damping(:, :)
    real(dp), allocatable :: frequency(:)
    integer :: modes, n, i, first, last, step

    n = size(curve%points)
    modes = 0
    do i = 1, n
      if (allocated(curve%points(i)%turns)) modes = size(curve%points(i)%turns)
    end do
    allocate(swings(modes, n), damping(modes, n))
    swings = -1
    damping = 0
    first = n
    last = 1
    if (abs(curve%points(1)%speed) > abs(curve%points(n)%speed)) then
      first = 1
      last = n
    end if
    step = sign(1, last - first)
    do i = first, last, step
      associate (point => curve%points(i))
        if (.not. allocated(point%turns)) cycle
        if (.not. allocated(frequency)) allocate(frequency, source=point%averaged_turns * point%crank)
        call assign(point%turns, point%growth, frequency / point%crank, swings(:, i), damping(:, i))
        frequency = swings(:, i) * point%crank
      end associate
    end do
  end subroutine swings_of_modes

  !> Gives every mode the multiplier and the whole number of turns that come nearest to what is expected, the nearest first.
  pure subroutine assign(turns, growth, expected, swings, damping)
    real(dp), intent(in) :: turns(:), growth(:), expected(:)
    real(dp), intent(out) :: swings(:), damping(:)
    real(dp) :: total(size(turns), size(turns)), away(size(turns), size(turns))
    integer :: k, pair(2)

    total = spread(turns, 2, size(turns))
    total = total + anint(spread(expected, 1, size(turns)) - total)
    away = abs(total - spread(expected, 1, size(turns)))
    do k = 1, size(turns)
      pair = minloc(away)
      swings(pair(2)) = max(total(pair(1), pair(2)), 0.0_dp)
      damping(pair(2)) = abs(growth(pair(1))) / (2 * pi)
      away(pair(1), :) = huge(1.0_dp)
      away(:, pair(2)) = huge(1.0_dp)
    end do
  end subroutine assign

end module gestell_task_resonance_seeds
