!> The periodic vibration of the exact frame by shooting, for the oracle: Newton's method for the start of the period and the
!> motor's mean torque together; its multipliers.
module oracle_vibration
  use oracle_frame, only: frame_type
  use oracle_machine, only: solved, xp
  use oracle_turn, only: run_turn, turn_type, units_of
  use reference_linear, only: eigenvalues, qp
  implicit none (type, external)
  private

  public :: find_vibration, search_vibration, start_of

  type, public :: orbit_type
    logical :: found = .false.
    !> The motion at the steps' ends, both ends of the period included, and what changes with its start.
    type(turn_type) :: turn
    !> Torque of the motor beside a flywheel (N m).
    real(xp) :: motor = 0
    complex(qp), allocatable :: rho(:)
    !> Newton's step from here, of the motion's size: what roundings leave.
    real(xp) :: last_step = 0
  end type orbit_type

contains

  !> x from q and q'.
  pure function start_of(frame, q, v) result(x)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: q(3), v(3)
    real(xp) :: x(2 * size(frame%free)), units(3)

    units = units_of(frame)
    x = [q(frame%free) / units(frame%free), v(frame%free) / (units(frame%free) * abs(frame%speed))]
  end function start_of

  !> The vibration near a `start`. `orbit%motor` is where the torque begins.
  subroutine find_vibration(frame, start, steps, orbit)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: start(:)
    integer, intent(in) :: steps
    type(orbit_type), intent(inout) :: orbit
    integer, parameter :: most = 10
    real(xp) :: x(size(start)), matrix(size(start) + 1, size(start) + 1), right(size(start) + 1), change(size(start) + 1), before
    real(xp) :: torque_unit, motion
    integer :: k, n, step

    n = size(start)
    torque_unit = frame%machine%frame_inertia * frame%speed**2
    x = start
    before = huge(before)
    orbit%found = .false.
    do step = 1, most
      call run_turn(frame, x, orbit%motor, steps, .true., orbit%turn)
      if (orbit%turn%broken) return
      matrix = 0
      matrix(:n, :) = orbit%turn%change
      right(:n) = x - orbit%turn%x(:, steps)
      do k = 1, n
        matrix(k, k) = matrix(k, k) - 1
      end do
      matrix(n + 1, n + 1) = 1
      right(n + 1) = 0
      if (frame%machine%held_by == "flywheel") then
        ! M Omega is the mean power of the dampers.
        associate (angle => frame%speed * frame%period)
          matrix(n + 1, :) = -orbit%turn%work_change / (angle * torque_unit)
          matrix(n + 1, n + 1) = matrix(n + 1, n + 1) + 1
          right(n + 1) = (orbit%turn%work / angle - orbit%motor) / torque_unit
        end associate
      end if
      change = solved(matrix, right)
      motion = max(maxval(norm2(orbit%turn%x, dim=1)), tiny(1.0_xp))
      orbit%last_step = norm2(change) / motion
      if (.not. orbit%last_step < huge(1.0_xp)) return
      ! The next one would be all rounding.
      if (orbit%last_step < 1000 * epsilon(1.0_xp) .or. (orbit%last_step < 1.0e-13_xp .and. orbit%last_step > before / 8)) exit
      ! Where steps grow far away from a vibration there is none to be found from here.
      if (orbit%last_step > max(before, 1.0_xp) .and. step > 4) return
      x = x + change(:n)
      orbit%motor = orbit%motor + change(n + 1) * torque_unit
      before = orbit%last_step
    end do
    orbit%found = orbit%last_step < 1.0e-11_xp
    if (.not. orbit%found) return
    allocate(orbit%rho(n))
    call eigenvalues(real(orbit%turn%change(:, :n), qp), orbit%rho)
  end subroutine find_vibration

  !> A vibration that nobody has told of: from rest with growing parts of the load, at this speed and from others to it.
  subroutine search_vibration(frame, steps, orbit)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: steps
    type(orbit_type), intent(out) :: orbit
    real(xp), parameter :: speeds(5) = [1.0_xp, 0.8_xp, 1.25_xp, 0.6_xp, 1.6_xp]
    type(frame_type) :: near
    type(orbit_type) :: found
    integer :: k

    do k = 1, size(speeds)
      near = at_speed(frame, speeds(k))
      call by_load(near, steps, found)
      if (found%found .and. k > 1) call by_speed(frame, speeds(k), steps, found)
      if (found%found) then
        orbit = found
        return
      end if
    end do
  end subroutine search_vibration

  pure type(frame_type) function at_speed(frame, factor) result(near)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: factor

    near = frame
    near%speed = factor * frame%speed
    near%period = frame%period / factor
  end function at_speed

  !> From rest, with a load that grows.
  subroutine by_load(frame, steps, orbit)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: steps
    type(orbit_type), intent(out) :: orbit
    type(frame_type) :: partly
    type(orbit_type) :: next
    real(xp), allocatable :: x(:)
    real(xp) :: part, step

    partly = frame
    allocate(x(2 * size(frame%free)), source=0.0_xp)
    part = 0
    step = 1
    do
      partly%part = min(1.0_xp, part + step)
      next = orbit_type(motor=orbit%motor)
      call find_vibration(partly, x, steps, next)
      if (next%found) then
        x = next%turn%x(:, 0)
        part = partly%part
        orbit = next
        if (part >= 1) return
        step = 2 * step
      else
        step = step / 2
        orbit%found = .false.
        if (step < 1.0_xp / 16) return
      end if
    end do
  end subroutine by_load

  !> From the vibration at `factor` times the speed to that at the speed itself.
  subroutine by_speed(frame, factor, steps, orbit)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: factor
    integer, intent(in) :: steps
    type(orbit_type), intent(inout) :: orbit
    type(orbit_type) :: next
    real(xp), allocatable :: x(:)
    real(xp) :: at, step

    at = factor
    step = (1 - factor) / 4
    x = orbit%turn%x(:, 0)
    do
      if (abs(1 - at) < abs(step)) step = 1 - at
      next = orbit_type(motor=orbit%motor)
      call find_vibration(at_speed(frame, at + step), x, steps, next)
      if (next%found) then
        at = at + step
        x = next%turn%x(:, 0)
        orbit = next
        if (.not. abs(1 - at) > epsilon(at)) return
      else
        step = step / 2
        orbit%found = .false.
        if (abs(step) < abs(1 - factor) / 32) return
      end if
    end do
  end subroutine by_speed

end module oracle_vibration
