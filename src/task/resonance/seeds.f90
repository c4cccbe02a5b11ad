!> Finds resonances between the points of a curve. At a resonance, a free vibration makes a whole number of oscillations in the
!> period, so that its multiplier is closest to 1. The multipliers at the two neighbouring points reveal even the sharpest
!> resonance.
module gestell_task_resonance_seeds
  use gestell_base_kinds, only: dp, pi
  use gestell_task_resonance_points, only: curve_points_type
  implicit none (type, external)
  private

  public :: crossing_speeds, swings_of_modes

  !> Highest order of the crank speed for which resonances are sought
  integer, parameter, public :: max_orders = 60
  !> The detuning is the difference between the number of a mode's oscillations in the period and the nearest harmonic. A point
  !> lies on a resonance if the detuning is below `part_of_damping` times the damping, or below `part_of_turns` times the number of
  !> the harmonic
  real(dp), parameter :: part_of_damping = 0.25_dp, part_of_turns = 1.0e-7_dp

contains

  !> Speeds that are computed next in order to resolve resonances. Between two neighbouring points the frequency of each mode is
  !> interpolated linearly. The speed at which it equals a harmonic of the period is included. If a point already lies on a
  !> resonance, the speeds at one and three half widths on both sides of it are included instead. Otherwise a low maximum could be
  !> missed.
  function crossing_speeds(curve, pairs, counts) result(speeds)
    class(curve_points_type), intent(in) :: curve
    !> `pairs`: true to search for sums of two frequencies, instead of single frequencies, that equal a harmonic (parametric
    !> resonance). `counts`, shape (points): false for points at which the speeds near a resonance are not needed; by default they
    !> are needed at all points
    logical, intent(in), optional :: pairs, counts(:)
    real(dp), allocatable :: speeds(:), swings(:, :), damping(:, :)
    logical :: selected(size(curve%points))
    integer :: highest, i, j, k

    allocate(speeds(0))
    selected = .true.
    if (present(counts)) selected = counts
    call swings_of_modes(curve, swings, damping)
    if (present(pairs)) then
      if (pairs) call add_modes(swings, damping)
    end if
    highest = max_orders * maxval([1, curve%points%drive_turns])
    do i = 1, size(curve%points) - 1
      do j = 1, size(swings, 1)
        associate (a => swings(j, i), b => swings(j, i + 1), s => curve%points(i)%speed, t => curve%points(i + 1)%speed)
          if (min(a, b) < 0) cycle
          do k = max(1, ceiling(min(a, b))), min(highest, floor(min(max(a, b), real(highest, dp))))
            if (found(a, damping(j, i), k)) then
              if (selected(i)) speeds = [speeds, around(curve, s, damping(j, i) / k)]
            else if (found(b, damping(j, i + 1), k)) then
              if (selected(i + 1)) speeds = [speeds, around(curve, t, damping(j, i + 1) / k)]
            else
              ! intersection of the straight line with the harmonic: a s + (b t - a s) (x - s) / (t - s) = k x
              speeds = [speeds, s + (t - s) * (a - k) * s / ((a - k) * s - (b - k) * t)]
            end if
          end do
        end associate
      end do
    end do
  end function crossing_speeds

  !> Replaces the modes by all sums of two modes, including the sum of a mode with itself. Adds the numbers of oscillations of the
  !> two modes, and their dampings.
  pure subroutine add_modes(swings, damping)
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
  end subroutine add_modes

  !> Speeds at one and three half widths on both sides of a resonance at `speed`. A speed is omitted if a point of the curve is
  !> close to it. `half_width`: half width of the resonance, relative to the speed.
  function around(curve, speed, half_width) result(speeds)
    class(curve_points_type), intent(in) :: curve
    real(dp), intent(in) :: speed, half_width
    real(dp), allocatable :: speeds(:)
    real(dp) :: all(4)
    integer :: i

    all = speed * (1 + half_width * [-3, -1, 1, 3])
    speeds = pack(all, [(minval(abs(curve%points%speed - all(i))) > half_width / 2 * abs(speed), i = 1, 4)])
  end function around

  !> True if a point lies on the resonance of a mode with harmonic number `k`. `swings`, `damping`: number of oscillations of the
  !> mode in the period, and its damping, at this point.
  pure logical function found(swings, damping, k)
    real(dp), intent(in) :: swings, damping
    integer, intent(in) :: k

    found = abs(swings - k) <= max(part_of_damping * damping, part_of_turns * k)
  end function found

  !> Computes two numbers for each mode at each point, shape (modes, points). `swings`: number of oscillations in the period.
  !> `damping`: |ln |rho|| / 2 pi with the multiplier rho of the mode, in the unit of `swings`. At points without multipliers
  !> `swings` is -1 and `damping` is 0.
  !>
  !> The multipliers determine the number of oscillations only up to an integer. At the highest speed the integer follows from the
  !> natural frequencies of the averaged frame. From there it is chosen from speed to speed so that the frequency changes least.
  subroutine swings_of_modes(curve, swings, damping)
    class(curve_points_type), intent(in) :: curve
    real(dp), allocatable, intent(out) :: swings(:, :), damping(:, :)
    real(dp), allocatable :: frequency(:)
    integer :: modes, n, i, k

    n = size(curve%points)
    modes = 0
    do i = 1, n
      if (allocated(curve%points(i)%turns)) modes = size(curve%points(i)%turns)
    end do
    allocate(swings(modes, n), damping(modes, n))
    swings = -1
    damping = 0
    do k = 1, n
      i = merge(k, n + 1 - k, abs(curve%points(1)%speed) > abs(curve%points(n)%speed))
      associate (point => curve%points(i))
        if (.not. allocated(point%turns)) cycle
        if (.not. allocated(frequency)) allocate(frequency, source=point%averaged_turns * point%crank)
        call assign(point%turns, point%growth, frequency / point%crank, swings(:, i), damping(:, i))
        frequency = swings(:, i) * point%crank
      end associate
    end do
  end subroutine swings_of_modes

  !> Assigns a multiplier and a whole number of oscillations to each mode. Their sum is as near as possible to the `expected`
  !> number of oscillations of the mode. The best matches are assigned first.
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
