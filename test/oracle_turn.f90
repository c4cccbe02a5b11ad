!> The exact frame through a period, for the oracle: the motion from a given start, its changes with the start and with the motor's
!> torque, and the dampers' work with its changes. By extrapolation of the modified midpoint rule (W. B. Gragg, SIAM J. Numer.
!> Anal. 2, 1965, 384-403, doi 10.1137/0702030) in steps that end at equidistant times, to roundings of extended precision.
module oracle_turn
  use oracle_frame, only: equations_type, evaluate, frame_type
  use oracle_machine, only: solved, xp
  implicit none (type, external)
  private

  public :: acceleration_of, run_turn, units_of

  !> x = (q, q'/Omega) of the free degrees of freedom, in units of length in which both are alike (`units_of`). The period is
  !> integrated in pieces of equal length, each from a start of its own: a small change, a rounding too, that grows by 1e12 in a
  !> period grows by 33 in an eighth of it. With `changes` there are columns for the piece's start and, last, for the motor's torque
  !> over `unit of torque`.
  type, public :: turn_type
    !> The state after each step, shape (states, 0:steps); where two pieces meet, the start of the later one.
    real(xp), allocatable :: x(:, :)
    !> The ends of the pieces, shape (states, pieces), their changes, shape (states, states + 1, pieces), the changes of the
    !> dampers' work in each piece, shape (states + 1, pieces), and the work in the whole period (J).
    real(xp), allocatable :: ends(:, :), change(:, :, :), work_change(:, :)
    real(xp) :: work = 0
    !> The largest unconverged part of a step, relative to the motion's size.
    real(xp) :: unsettled = 0
    logical :: broken = .false.
  end type turn_type

  integer, parameter :: most_columns = 11
  real(xp), parameter :: enough = 4 * epsilon(1.0_xp)

contains

  !> Lengths by which states are divided: of psi 1 over the frame's radius.
  pure function units_of(frame) result(units)
    type(frame_type), intent(in) :: frame
    real(xp) :: units(3)

    units = 1
    units(3) = 1 / sqrt(frame%machine%frame_inertia / frame%mass + frame%machine%origin(1)**2 + frame%machine%origin(2)**2)
  end function units_of

  !> `start`: x at the start of each piece, shape (states, pieces); `steps` of the period, a multiple of the number of pieces;
  !> `motor`: its torque (N m). With `changes` the derivatives of the pieces' ends are computed too.
  subroutine run_turn(frame, start, motor, steps, changes, turn)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: start(:, :), motor
    integer, intent(in) :: steps
    logical, intent(in) :: changes
    type(turn_type), intent(out) :: turn
    real(xp), allocatable :: y(:)
    real(xp) :: h, size_of_motion
    integer :: n, k, piece, pieces

    n = size(start, 1)
    pieces = size(start, 2)
    allocate(turn%x(n, 0:steps), source=0.0_xp)
    allocate(turn%ends(n, pieces), source=0.0_xp)
    allocate(y(merge(n + n * (n + 1) + n + 2, n, changes)))
    if (changes) allocate(turn%change(n, n + 1, pieces), turn%work_change(n + 1, pieces), source=0.0_xp)
    h = frame%machine%turns * 8 * atan(1.0_xp) / steps
    size_of_motion = maxval(norm2(start, dim=1))
    do piece = 1, pieces
      y = 0
      y(:n) = start(:, piece)
      if (changes) y(n + 1:n + n * n:n + 1) = 1
      do k = (piece - 1) * steps / pieces + 1, piece * steps / pieces
        turn%x(:, k - 1) = y(:n)
        call extrapolate(frame, motor, (k - 1) * h, h, n, size_of_motion, y, turn%unsettled)
        size_of_motion = max(size_of_motion, norm2(y(:n)))
        ! No machine moves farther than that: the iteration has diverged.
        if (.not. size_of_motion < 1.0e6_xp) then
          turn%broken = .true.
          return
        end if
      end do
      turn%ends(:, piece) = y(:n)
      if (.not. changes) cycle
      turn%change(:, :, piece) = reshape(y(n + 1:n + n * (n + 1)), [n, n + 1])
      turn%work = turn%work + y(n + n * (n + 1) + 1)
      turn%work_change(:, piece) = y(n + n * (n + 1) + 2:)
    end do
    turn%x(:, steps) = turn%ends(:, pieces)
  end subroutine run_turn

  !> One step h of the drive's angle.
  subroutine extrapolate(frame, motor, phi, h, n, size_of_motion, y, unsettled)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: motor, phi, h, size_of_motion
    integer, intent(in) :: n
    real(xp), intent(inout) :: y(:), unsettled
    real(xp) :: table(size(y), most_columns), slope(size(y)), before(size(y)), now(size(y)), next(size(y)), f(size(y)), off, last
    integer :: j, k, m

    call flow(frame, motor, phi, n, y, slope)
    last = huge(last)
    off = huge(off)
    do j = 1, most_columns
      before = y
      now = y + h / (2 * j) * slope
      do m = 1, 2 * j - 1
        call flow(frame, motor, phi + m * h / (2 * j), n, now, f)
        next = before + h / j * f
        before = now
        now = next
      end do
      ! Aitken's and Neville's scheme in (1/steps)^2; column k holds the row's entry k.
      next = now
      do k = 1, j - 1
        now = next + (next - table(:, k)) / ((real(j, xp) / (j - k))**2 - 1)
        table(:, k) = next
        next = now
      end do
      if (j > 1) then
        off = apart(next - table(:, j - 1), next, n, size_of_motion)
        if (off <= enough .or. (j > 6 .and. off > last / 2 .and. off < 100 * enough)) exit
        last = off
      end if
      table(:, j) = next
    end do
    unsettled = max(unsettled, off)
    y = next
  end subroutine extrapolate

  !> Distance of two results: of the motion relative to its size, of the derivatives and of the work relative to theirs.
  pure real(xp) function apart(difference, y, n, size_of_motion)
    real(xp), intent(in) :: difference(:), y(:), size_of_motion
    integer, intent(in) :: n
    integer :: k

    apart = norm2(difference(:n)) / max(size_of_motion, norm2(y(:n)), tiny(1.0_xp))
    if (size(y) == n) return
    do k = 1, n + 1
      apart = max(apart, norm2(difference(n * k + 1:n * k + n)) / max(1.0_xp, norm2(y(n + 1:n + n * n))))
    end do
  end function apart

  !> d/dphi of everything.
  subroutine flow(frame, motor, phi, n, y, slope)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: motor, phi, y(:)
    integer, intent(in) :: n
    real(xp), intent(out) :: slope(:)
    real(xp) :: q(3), v(3), a(3), force(n / 2, n + 1), w
    type(equations_type) :: eq
    integer :: f, k

    f = n / 2
    w = abs(frame%speed)
    associate (free => frame%free, units => units_of(frame))
      q = 0
      v = 0
      q(free) = y(:f) * units(free)
      v(free) = y(f + 1:n) * units(free) * w
      call evaluate(frame, sign(phi, frame%speed), q, v, motor, size(y) > n, eq)
      a = 0
      a(free) = solved(eq%m(free, free), -eq%f(free))
      eq%by_place(:, 3) = eq%by_place(:, 3) + matmul(eq%m_turned, a)
      slope(:f) = y(f + 1:n)
      slope(f + 1:n) = a(free) / (w**2 * units(free))
      if (size(y) == n) return
      do k = 1, f
        force(:, k) = -eq%by_place(free, free(k)) * units(free(k))
        force(:, f + k) = -eq%by_speed(free, free(k)) * units(free(k)) * w
      end do
      force(:, n + 1) = merge(-1, 0, free == 3) * torque_unit(frame)
      force = solved(eq%m(free, free), force) / spread(w**2 * units(free), 2, n + 1)
      do k = 1, n + 1
        associate (column => y(n * k + 1:n * k + n))
          slope(n * k + 1:n * k + f) = column(f + 1:)
          slope(n * k + f + 1:n * k + n) = matmul(force(:, :n), column)
          if (k == n + 1) slope(n * k + f + 1:n * k + n) = slope(n * k + f + 1:n * k + n) + force(:, n + 1)
          slope(n * (n + 2) + 1 + k) = (sum(eq%power_by_place(free) * units(free) * column(:f)) &
            & + sum(eq%power_by_speed(free) * units(free) * w * column(f + 1:))) / w
        end associate
      end do
      slope(n * (n + 2) + 1) = eq%power / w
    end associate
  end subroutine flow

  !> In which the motor's torque is varied (N m).
  pure real(xp) function torque_unit(frame)
    type(frame_type), intent(in) :: frame

    torque_unit = frame%machine%frame_inertia * frame%speed**2
  end function torque_unit

  !> q, q' and q'' at the drive's angle `phi`, shapes (3).
  subroutine acceleration_of(frame, phi, x, motor, q, v, a)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: phi, x(:), motor
    real(xp), intent(out) :: q(3), v(3), a(3)
    type(equations_type) :: eq
    integer :: f

    f = size(x) / 2
    q = 0
    v = 0
    a = 0
    associate (free => frame%free, units => units_of(frame))
      q(free) = x(:f) * units(free)
      v(free) = x(f + 1:) * units(free) * abs(frame%speed)
      call evaluate(frame, phi, q, v, motor, .false., eq)
      a(free) = solved(eq%m(free, free), -eq%f(free))
    end associate
  end subroutine acceleration_of

end module oracle_turn
