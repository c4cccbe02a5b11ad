!> Finds the maxima of a resonance curve: their speeds, heights and widths.
!>
!> Near its maximum P_0, the curve of a resonance is P = P_0 / sqrt(1 + u^2), where u is the distance from the maximum in half
!> widths. Therefore (P_0 / P)^2 is a parabola, and sqrt((P_0 / P)^2 - 1) is a straight line. These two functions are interpolated.
module gestell_task_resonance_maxima
  use gestell_base_verdict, only: has_vibration, in_resonance, operator(/=), operator(==), undamped, undecided, &
    & unstable, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_task_resonance_points, only: curve_points_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_positive_inf, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: find_maxima, half_power_speeds, step_to_top, top_speeds

  !> A maximum of a resonance curve.
  type, public :: maximum_type
    !> Number of the quantity that has the maximum
    integer :: quantity = 0
    !> Number of the point of the curve at which the maximum lies
    integer :: point = 0
    !> Verdict on the vibration at this point of the curve
    type(verdict_type) :: state
    !> Number of the harmonic of the period that has the largest amplitude at this point
    integer :: strongest_order = 0
    !> `speed`: speed of the maximum (1/min). `value`: value P_0 of the quantity's peak at this speed
    real(dp) :: speed = 0, value = 0
    !> `half`: the two half-power speeds, one on each side of the maximum, at which the peak P has fallen to P_0 / sqrt(2).
    !> `width`: difference between them (1/min). `damping_ratio`: half the width divided by the speed, which is correct for a
    !> single resonance. Values are NaN if the curve rises again or ends before it has fallen to P_0 / sqrt(2).
    real(dp) :: half(2) = 0, width = 0, damping_ratio = 0
    !> Depth, in ln(peak), to which the curve falls from the maximum on that side on which it falls less
    real(dp) :: rise = 0
    !> `resolved`: true if the points next to the maximum are close enough to each other to resolve the curve there. `unbounded`:
    !> true if the vibration at this speed is unbounded, for example at a stability boundary
    logical :: resolved = .true., unbounded = .false.
    !> True if the motion is so small that linearised equations describe it
    logical :: small = .true.
    !> `jump`: true if the vibration of the exact frame changes abruptly at this speed; `value` is then the larger one of the two
    !> values. `fold`: true if the vibration on one side of the jump ceases to exist there.
    logical :: jump = .false., fold = .false.
    !> The smaller one of the two values of the quantity at a jump; NaN if there is no jump.
    real(dp) :: other_side = 0
  end type maximum_type

  !> At a jump, a vibration ceases to exist (fold) if one of its multipliers is closer to 1 than this
  real(dp), parameter :: at_fold = 1.0e-3_dp

  !> The search for a maximum ends if its next step is smaller than `position` times the speed, and raises the maximum by less than
  !> the fraction `gain`.
  real(dp), parameter, public :: position = 1.0e-7_dp
  !> `gain`: relative gain in height below which the search for a maximum ends. `half_power`: a half-power speed is accurate if
  !> (P_0 / P)^2 - 1 differs from 1 by no more than this. P is the peak at this speed, and P_0 is the height of the maximum.
  real(dp), parameter :: gain = 1.0e-9_dp, half_power = 1.0e-4_dp

contains

  !> Finds the maxima of quantity number `q`, and the jumps of the exact frame. For linearised equations, the vibration at a
  !> maximum counts as unbounded if the curve is not resolved there and the stability changes or is uncertain. A jump is listed at
  !> the side with the larger value, even if this value is not a maximum.
  subroutine find_maxima(curve, q, bent, least, maxima)
    class(curve_points_type), intent(in) :: curve
    integer, intent(in) :: q
    !> True for intervals between neighbouring points in which the curve is not resolved, shape (points - 1)
    logical, intent(in) :: bent(:)
    !> A maximum is listed if ln(peak) exceeds the lowest value on each side of the maximum by more than `least`. A jump is listed
    !> if ln(peak) changes by more than `least`
    real(dp), intent(in) :: least
    type(maximum_type), allocatable, intent(out) :: maxima(:)
    type(maximum_type) :: found(size(curve%points))
    !> ln(peak) at each point of the curve
    real(dp), allocatable :: level(:)
    !> True for points at which the quantity has a value
    logical, allocatable :: known(:)
    logical :: jump(0:size(curve%points)), listed(size(curve%points))
    integer :: i, n, last

    call curve%levels(q, level, known)
    n = 0
    jump = .false.
    jump(1:size(level) - 1) = curve%jumps(level, known)
    listed = [(is_top(i), i = 1, size(level))]
    do i = 1, size(level) - 1
      if (.not. jump(i) .or. any(listed(i:i + 1))) cycle
      if (abs(level(i + 1) - level(i)) > least) listed(merge(i + 1, i, level(i + 1) > level(i))) = .true.
    end do
    do i = 1, size(level)
      if (known(max(i - 1, 1)) .and. .not. known(i)) then
        ! find the last point of the gap, which extends from the first to the last point without a value
        last = i - 2 + findloc([known(i:), .true.], .true., dim=1)
        if (rises_into(i, last)) then
          n = n + 1
          found(n) = unbounded_maximum(i, last)
        end if
      end if
      if (.not. listed(i)) cycle
      n = n + 1
      associate (point => curve%points(i), maximum => found(n))
        maximum = maximum_type(q, i, point%state, point%strongest(q), point%speed, point%values(1, q))
        maximum%rise = min(descent(i, -1), descent(i, 1))
        maximum%resolved = .not. any(bent(max(i - 1, 1):min(i, size(bent))))
        maximum%half = [half_power_speed(i, -1), half_power_speed(i, 1)]
        if (.not. maximum%resolved) maximum%half = ieee_value(1.0_dp, ieee_quiet_nan)
        maximum%width = abs(maximum%half(2) - maximum%half(1))
        maximum%damping_ratio = maximum%width / (2 * abs(point%speed))
        maximum%unbounded = point%linear .and. .not. maximum%resolved .and. (any(point%state == [undamped, undecided]) &
          & .or. any(curve%points(max(i - 1, 1):min(i + 1, size(level)))%state /= point%state))
        maximum%small = point%moved%small() .and. .not. maximum%unbounded
        if (maximum%unbounded) maximum%value = ieee_value(1.0_dp, ieee_positive_inf)
        call describe_jump(maximum)
      end associate
    end do
    maxima = found(:n)

  contains

    !> True if the curve has a maximum at point number `i`. Its value must be larger than at both neighbours, and exceed the lowest
    !> value on each side by more than `least`. For the exact frame, points at which no vibration was found are skipped.
    pure logical function is_top(i)
      integer, intent(in) :: i
      integer :: l, r

      is_top = .false.
      if (.not. known(i)) return
      l = neighbour(i, -1)
      r = neighbour(i, 1)
      if (l == 0 .or. r == 0) return
      if (any(has_vibration(curve%points(l + 1:i - 1)%state)) .or. any(has_vibration(curve%points(i + 1:r - 1)%state))) return
      if (curve%points(i)%linear .and. r - l > 2) return
      if (.not. (level(i) > level(l) .and. level(i) >= level(r))) return
      is_top = min(descent(i, -1), descent(i, 1)) > least
    end function is_top

    !> Number of the nearest point that has a value, before point `i` (`step` = -1) or after it (`step` = 1); 0 if there is none.
    pure integer function neighbour(i, step) result(k)
      integer, intent(in) :: i, step

      k = i + step
      do while (k >= 1 .and. k <= size(known))
        if (known(k)) return
        k = k + step
      end do
      k = 0
    end function neighbour

    !> Determines whether a maximum of the exact frame lies at a jump, or next to points without a vibration. At a jump, sets the
    !> value on the other side.
    pure subroutine describe_jump(maximum)
      type(maximum_type), intent(inout) :: maximum
      integer :: step, k

      maximum%other_side = ieee_value(1.0_dp, ieee_quiet_nan)
      associate (point => curve%points(maximum%point))
        if (point%linear) return
        do step = -1, 1, 2
          k = neighbour(maximum%point, step)
          if (k == 0) cycle
          if (k == maximum%point + step .and. .not. jump(min(maximum%point, k))) cycle
          if (maximum%jump .and. curve%points(k)%values(1, q) > maximum%other_side) cycle
          maximum%jump = .true.
          maximum%other_side = curve%points(k)%values(1, q)
          maximum%fold = min(point%from_fold, curve%points(k)%from_fold) < at_fold
        end do
      end associate
    end subroutine describe_jump

    !> Creates the maximum for the points `first` to `last`, which have no value because the vibration of the linearised equations
    !> is unbounded.
    type(maximum_type) function unbounded_maximum(first, last) result(maximum)
      integer, intent(in) :: first, last

      associate (point => curve%points((first + last) / 2), nan => ieee_value(1.0_dp, ieee_quiet_nan))
        maximum = maximum_type(q, (first + last) / 2, point%state, curve%points(first - 1)%strongest(q), point%speed, &
          & value=ieee_value(1.0_dp, ieee_positive_inf), half=[nan, nan], width=nan, damping_ratio=nan, resolved=.false., &
          & unbounded=.true., small=.false., other_side=nan)
      end associate
    end function unbounded_maximum

    !> True if the points `first` to `last`, which have no value, lie in a resonance: on both sides the curve rises towards them by
    !> more than `least`.
    pure logical function rises_into(first, last)
      integer, intent(in) :: first, last

      rises_into = .false.
      if (last == size(known) .or. .not. curve%points(first - 1)%linear) return
      associate (states => curve%points(first:last)%state)
        if (.not. all(states == in_resonance .or. states == undamped .or. states == undecided .or. states == unstable)) return
      end associate
      rises_into = min(descent(first - 1, -1), descent(last + 1, 1)) > least
    end function rises_into

    !> Difference, in ln(peak), between point number `i` and the lowest point on one side of it. Points are considered until the
    !> curve rises above point `i` or has no value. For the exact frame, points without a vibration are skipped. `step`: -1 for the
    !> side before the point, 1 for the side after it.
    pure real(dp) function descent(i, step)
      integer, intent(in) :: i, step
      integer :: k

      descent = 0
      k = i + step
      do while (k >= 1 .and. k <= size(level))
        if (.not. known(k) .and. (curve%points(i)%linear .or. has_vibration(curve%points(k)%state))) return
        if (known(k) .and. level(k) > level(i)) return
        if (known(k)) descent = max(descent, level(i) - level(k))
        k = k + step
      end do
    end function descent

    !> Half-power speed on one side of the maximum at point number `i`. NaN if the curve rises again or jumps before this speed is
    !> reached.
    real(dp) function half_power_speed(i, step) result(speed)
      integer, intent(in) :: i, step
      real(dp) :: u(2)
      integer :: k

      speed = ieee_value(1.0_dp, ieee_quiet_nan)
      k = i + step
      u = 0
      do while (k >= 1 .and. k <= size(level))
        if (.not. known(k) .or. jump(min(k, k - step))) return
        if (level(k) > level(k - step)) return
        ! computes sqrt((P_i / P_k)^2 - 1), which is a linear function of the speed at a single resonance
        u = [u(2), sqrt(max(0.0_dp, exp(min(2 * (level(i) - level(k)), 600.0_dp)) - 1))]
        if (u(2) >= 1) then
          associate (s => curve%points(k - step)%speed, t => curve%points(k)%speed)
            speed = s + (t - s) * (1 - u(1)) / (u(2) - u(1))
          end associate
          return
        end if
        k = k + step
      end do
    end function half_power_speed

  end subroutine find_maxima

  !> Interpolated speeds of those maxima whose speed is not accurate yet. Jumps, and maxima at which the curve is not resolved, are
  !> omitted.
  function top_speeds(curve, maxima) result(speeds)
    class(curve_points_type), intent(in) :: curve
    type(maximum_type), intent(in) :: maxima(:)
    real(dp), allocatable :: speeds(:)
    real(dp) :: step, gain_of_step
    integer :: m

    allocate(speeds(0))
    do m = 1, size(maxima)
      if (.not. maxima(m)%resolved .or. maxima(m)%jump) cycle
      call step_to_top(curve, maxima(m), step, gain_of_step)
      associate (errors => curve%points(maxima(m)%point)%values(2, maxima(m)%quantity))
        if (abs(step) <= position * abs(maxima(m)%speed) .and. gain_of_step <= max(gain, errors / maxima(m)%value)) cycle
      end associate
      speeds = [speeds, maxima(m)%speed + step]
    end do
  end function top_speeds

  !> Fits a parabola to (P_0 / P)^2 at the point of a maximum and its two neighbours (P: peak, P_0: peak at the maximum). Returns
  !> the step (1/min) from the point to the vertex of the parabola, and the relative gain in height. Both are zero if the vertex is
  !> not a maximum of P.
  pure subroutine step_to_top(curve, maximum, step, gain_of_step)
    class(curve_points_type), intent(in) :: curve
    !> A maximum at a point that has neighbours on both sides
    type(maximum_type), intent(in) :: maximum
    !> `step`: step to the vertex (1/min). `gain_of_step`: relative gain in height by this step
    real(dp), intent(out) :: step, gain_of_step
    real(dp) :: h(2), rise(2), a, b

    step = 0
    gain_of_step = 0
    associate (i => maximum%point, q => maximum%quantity)
      h = [maximum%speed - curve%points(i - 1)%speed, curve%points(i + 1)%speed - maximum%speed]
      ! (P_0 / P)^2 - 1 at both neighbours is equal to a h^2 +- b h
      rise = [excess_power(curve, q, i, i - 1), excess_power(curve, q, i, i + 1)]
    end associate
    a = (rise(1) / h(1) + rise(2) / h(2)) / (h(1) + h(2))
    b = (rise(2) / h(2) * h(1) - rise(1) / h(1) * h(2)) / (h(1) + h(2))
    if (.not. a > 0) return
    step = -b / (2 * a)
    gain_of_step = b**2 / (8 * a)
  end subroutine step_to_top

  !> The value of (P_i / P_k)^2 - 1 for the peaks P at points number `i` and `k`. It is computed without loss of digits, even if it
  !> is small.
  pure real(dp) function excess_power(curve, q, i, k)
    class(curve_points_type), intent(in) :: curve
    integer, intent(in) :: q, i, k

    associate (p => curve%points(i)%values(1, q), other => curve%points(k)%values(1, q))
      excess_power = (p - other) * (p + other) / max(other**2, tiny(1.0_dp))
    end associate
  end function excess_power

  !> Interpolated half-power speeds of the resolved maxima, at which the peak is 1 / sqrt(2) of the maximum. A speed is omitted if
  !> a point of the curve is close enough to it.
  function half_power_speeds(curve, maxima, bent) result(speeds)
    class(curve_points_type), intent(in) :: curve
    type(maximum_type), intent(in) :: maxima(:)
    logical, intent(in) :: bent(:)
    real(dp), allocatable :: speeds(:), level(:)
    logical, allocatable :: known(:), jump(:)
    integer :: m, side, k

    allocate(speeds(0))
    do m = 1, size(maxima)
      call curve%levels(maxima(m)%quantity, level, known)
      jump = curve%jumps(level, known)
      do side = 1, 2
        associate (half => maxima(m)%half(side), i => maxima(m)%point)
          if (ieee_is_nan(half)) cycle
          k = i
          do while (k > 1 .and. k < size(bent) + 1)
            if (abs(curve%points(k)%speed - maxima(m)%speed) >= abs(half - maxima(m)%speed)) exit
            k = k + merge(-1, 1, side == 1)
          end do
          if (any(bent(min(i, k):max(i, k) - 1) .or. jump(min(i, k):max(i, k) - 1))) cycle
          if (abs(excess_power(curve, maxima(m)%quantity, i, k) - 1) <= half_power) cycle
          if (abs(excess_power(curve, maxima(m)%quantity, i, k - merge(-1, 1, side == 1)) - 1) <= half_power) cycle
          speeds = [speeds, half]
        end associate
      end do
    end do
  end function half_power_speeds

end module gestell_task_resonance_maxima
