!> The periodic vibration of the exact frame by multiple shooting, for the oracle: Newton's method for the starts of all pieces of
!> the period and the motor's mean torque together; its multipliers.
module oracle_vibration
  use oracle_frame, only: frame_type
  use oracle_machine, only: solved, xp
  use oracle_turn, only: run_turn, turn_type, units_of
  use reference_linear, only: eigenvalues, qp
  implicit none (type, external)
  private

  public :: find_vibration, pieces, search_vibration, start_of

  !> Pieces of the period.
  integer, parameter :: pieces = 8

  type, public :: orbit_type
    logical :: found = .false.
    !> The motion at the steps' ends, both ends of the period included, and what changes with the pieces' starts, which are
    !> `start`, shape (states, pieces).
    type(turn_type) :: turn
    real(xp), allocatable :: start(:, :)
    !> Torque of the motor that drives a flywheel (N m).
    real(xp) :: motor = 0
    !> Phi(T), the product of the pieces' derivatives; its eigenvalues, and their rounding errors.
    real(qp), allocatable :: phi(:, :)
    complex(qp), allocatable :: rho(:)
    real(qp) :: noise = 0
    !> The last Newton step relative to the motion's size, an estimate of rounding errors.
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

  !> Finds the vibration near the starts of the pieces, shape (states, pieces). The motor's torque starts from `orbit%motor`.
  subroutine find_vibration(frame, start, steps, orbit)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: start(:, :)
    integer, intent(in) :: steps
    type(orbit_type), intent(inout) :: orbit
    integer, parameter :: most = 10
    real(xp) :: x(size(start, 1), size(start, 2)), matrix(size(start) + 1, size(start) + 1), right(size(start) + 1)
    real(xp) :: change(size(start) + 1), before, torque_unit, motion
    integer :: at, k, last, n, next, piece, step

    n = size(start, 1)
    last = size(start) + 1
    torque_unit = frame%machine%frame_inertia * frame%speed**2
    x = start
    before = huge(before)
    orbit%found = .false.
    do step = 1, most
      call run_turn(frame, x, orbit%motor, steps, .true., orbit%turn)
      if (orbit%turn%broken) return
      matrix = 0
      ! Where a piece ends the next one starts.
      do piece = 1, size(start, 2)
        at = (piece - 1) * n
        next = modulo(piece * n, last - 1)
        matrix(at + 1:at + n, at + 1:at + n) = orbit%turn%change(:, :n, piece)
        matrix(at + 1:at + n, last) = orbit%turn%change(:, n + 1, piece)
        do k = 1, n
          matrix(at + k, next + k) = matrix(at + k, next + k) - 1
        end do
        right(at + 1:at + n) = x(:, next / n + 1) - orbit%turn%ends(:, piece)
      end do
      matrix(last, last) = 1
      right(last) = 0
      if (frame%machine%held_by == "flywheel") then
        ! M Omega is the mean power of the dampers.
        associate (angle => frame%speed * frame%period)
          matrix(last, :last - 1) = reshape(-orbit%turn%work_change(:n, :) / (angle * torque_unit), [last - 1])
          matrix(last, last) = 1 - sum(orbit%turn%work_change(n + 1, :)) / (angle * torque_unit)
          right(last) = (orbit%turn%work / angle - orbit%motor) / torque_unit
        end associate
      end if
      change = solved(matrix, right)
      motion = max(maxval(norm2(orbit%turn%x, dim=1)), tiny(1.0_xp))
      orbit%last_step = max(maxval(norm2(reshape(change(:last - 1), shape(x)), dim=1)), abs(change(last))) / motion
      if (.not. orbit%last_step < huge(1.0_xp)) return
      ! The next step would consist of rounding errors.
      if (orbit%last_step < 1000 * epsilon(1.0_xp) .or. (orbit%last_step < 1.0e-13_xp .and. orbit%last_step > before / 8)) exit
      ! If the steps grow far away from a vibration, none can be found from here.
      if (orbit%last_step > max(before, 1.0_xp) .and. step > 4) return
      x = x + reshape(change(:last - 1), shape(x))
      orbit%motor = orbit%motor + change(last) * torque_unit
      before = orbit%last_step
    end do
    orbit%found = orbit%last_step < 1.0e-11_xp
    if (.not. orbit%found) return
    orbit%start = x
    call find_multipliers(n, orbit)
  end subroutine find_vibration

  !> Finds the multipliers, and the effect on Phi(T) of rounding errors in each piece, relative to its size or at least that of
  !> its start.
  subroutine find_multipliers(n, orbit)
    integer, intent(in) :: n
    type(orbit_type), intent(inout) :: orbit
    !> Roundings of a piece.
    real(qp), parameter :: roundings = 100 * epsilon(1.0_xp)
    real(qp) :: before(n, n), after(n, n), part(n, n)
    integer :: k, other, piece

    orbit%noise = 0
    do piece = 1, size(orbit%turn%change, 3)
      before = 0
      do k = 1, n
        before(k, k) = 1
      end do
      after = before
      do other = 1, piece - 1
        before = matmul(real(orbit%turn%change(:, :n, other), qp), before)
      end do
      do other = piece + 1, size(orbit%turn%change, 3)
        after = matmul(real(orbit%turn%change(:, :n, other), qp), after)
      end do
      part = real(orbit%turn%change(:, :n, piece), qp)
      orbit%noise = max(orbit%noise, roundings * norm2(after) * max(1.0_qp, norm2(part)) * norm2(before))
    end do
    orbit%phi = matmul(part, before)
    allocate(orbit%rho(n))
    call eigenvalues(orbit%phi, orbit%rho)
  end subroutine find_multipliers

  !> Searches a vibration without a given start: from rest with growing parts of the load, at this speed and from other speeds.
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

  !> Follows the vibration from rest while the load grows.
  subroutine by_load(frame, steps, orbit)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: steps
    type(orbit_type), intent(out) :: orbit
    type(frame_type) :: partly
    type(orbit_type) :: next
    real(xp), allocatable :: x(:, :)
    real(xp) :: part, step

    partly = frame
    allocate(x(2 * size(frame%free), pieces), source=0.0_xp)
    part = 0
    step = 1
    do
      partly%part = min(1.0_xp, part + step)
      next = orbit_type(motor=orbit%motor)
      call find_vibration(partly, x, steps, next)
      if (next%found) then
        x = next%start
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

  !> Follows the vibration from `factor` times the speed to the speed itself.
  subroutine by_speed(frame, factor, steps, orbit)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: factor
    integer, intent(in) :: steps
    type(orbit_type), intent(inout) :: orbit
    type(orbit_type) :: next
    real(xp), allocatable :: x(:, :)
    real(xp) :: at, step

    at = factor
    step = (1 - factor) / 4
    x = orbit%start
    do
      if (abs(1 - at) < abs(step)) step = 1 - at
      next = orbit_type(motor=orbit%motor)
      call find_vibration(at_speed(frame, at + step), x, steps, next)
      if (next%found) then
        at = at + step
        x = next%start
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
