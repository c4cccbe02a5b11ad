!> Tests of the oracle of the exact frame (oracle_...), with which the library is compared: against laws that it does not use, a
!> second kinematics, differences, and results of other programs.
module test_oracle
  use checks, only: check_that
  use exact_specimens, only: exact_specimen, specimen
  use exact_tally, only: exact_tally_type, examine
  use oracle_frame, only: equations_type, evaluate, frame_type, new_frame
  use oracle_kinematics, only: prepare, trace
  use oracle_machine, only: dp, exact_machine, i, pi, solved, xp
  use oracle_signals, only: find_signals, signal_type
  use oracle_turn, only: acceleration_of, run_turn, turn_type
  use oracle_vibration, only: orbit_type, search_vibration
  use reference_linear, only: determinant, qp
  use reference_linkage, only: motion_type, move
  use reference_machine, only: joint_data, khang_machine, link_data, support_data
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_oracle

  !> Numbers of machines of the population that turn, for each law.
  integer, parameter :: machines = 12

contains

  subroutine collect_oracle(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("kinematics by constraints agree with kinematics by chains of dyads", test_kinematics), &
      & new_unittest("the oracle's largest multiplier agrees with outside programs", test_tongue), &
      & new_unittest("the oracle's peak torque agrees with an outside program", test_torque), &
      & new_slow("derivatives of a turn agree with differences", test_changes), &
      & new_slow("the oracle satisfies Liouville's formula and the balances of power and momentum", test_laws), &
      & new_slow("the oracle satisfies these laws even if disturbances grow by 1e12", test_growth), &
      & new_slow("oracle and library agree on strongly unstable machines and large motions", test_unstable)]
  end subroutine collect_oracle

  subroutine test_kinematics(error)
    type(error_type), allocatable, intent(out) :: error
    type(exact_specimen) :: one
    type(motion_type) :: motion
    complex(xp), allocatable :: center(:, :)
    real(xp), allocatable :: spin(:, :)
    real(xp) :: phi, off, size_of_motion
    integer :: k, n

    do n = 1, 60
      one = specimen(n)
      ! The other kinematics knows no gears.
      if (one%machine%turns > 1 .or. any(one%machine%turns_of > 1 .or. one%machine%turns_of < 0)) cycle
      call prepare(one%machine)
      allocate(center(0:3, size(one%machine%links)), spin(3, size(one%machine%links)))
      phi = 0.37_xp * n
      call trace(one%machine, exp(i * phi), center, spin)
      motion = move(one%machine%machine_data, real(phi, qp))
      do k = 1, size(one%machine%links)
        size_of_motion = maxval(abs(center(:2, k)))
        off = real(maxval(abs(cmplx(motion%center(1, :, k), motion%center(2, :, k), qp) - center(:2, k))), xp) / size_of_motion
        ! Roundings of extended precision, at the poorest transmission angles some hundred times.
        call check_that(error, real(off, dp), "<", 1.0e-16_dp, trim(one%linkage) // ": centres of mass")
        off = real(maxval(abs(motion%turn(1:2, k) - spin(:2, k))), xp) / max(maxval(abs(spin(:2, k))), 1.0_xp)
        call check_that(error, real(off, dp), "<", 1.0e-16_dp, trim(one%linkage) // ": turns")
      end do
      deallocate(center, spin)
    end do
  end subroutine test_kinematics

  !> rho_max of the paper's machine by Exudyn and an exact Lagrange model.
  subroutine test_tongue(error)
    type(error_type), allocatable, intent(out) :: error
    type(exact_machine) :: machine
    type(frame_type) :: frame
    type(orbit_type) :: orbit

    machine%machine_data = khang_machine(2426.0_dp)
    machine%turns_of = [0, 0, 1, 0]
    call new_frame(machine, frame)
    call search_vibration(frame, 48, orbit)
    call check_that(error, orbit%found, "==", .true., "found")
    if (.not. allocated(error)) call check(error, real(maxval(abs(orbit%rho)), dp), 1.014767952_dp, thr=1.0e-9_dp)
  end subroutine test_tongue

  !> The peak torque of a press with a flywheel, -7.7419175015231281 N m by a program in quadruple precision.
  subroutine test_torque(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: outside = 7.7419175015231281_dp
    type(exact_machine) :: machine
    type(frame_type) :: frame
    type(orbit_type) :: orbit
    type(signal_type), allocatable :: signals(:)
    integer :: k

    machine = press()
    call new_frame(machine, frame)
    call search_vibration(frame, 48, orbit)
    call check_that(error, orbit%found, "==", .true., "found")
    if (allocated(error)) return
    call find_signals(frame, orbit, 192, signals)
    do k = 1, size(signals)
      if (signals(k)%name /= "torque") cycle
      ! The outside program turned angles into radians in double precision.
      call check(error, real(signals(k)%peak(), dp), outside, thr=4 * outside * epsilon(1.0_dp), more="peak")
    end do
  end subroutine test_torque

  function press() result(machine)
    type(exact_machine) :: machine

    machine%joints = [joint_data("ground"), joint_data("ground", position=[0.03716954258887067_dp, 0.011420479342946202_dp]), &
      & joint_data("crank", ends=[1, 0], radius=0.007474991812574786_dp, phase_deg=73.2816316070913_dp), &
      & joint_data("RRR", ends=[3, 2], lengths=[0.05020618808839413_dp, 0.042935824667383535_dp]), &
      & joint_data("RRP", ends=[4, 0], lengths=[0.07495097486198919_dp, 0.0_dp], guide_point=[-0.008791892816193941_dp, &
      & -0.006405195969456911_dp], guide_angle_deg=58.302199285314174_dp)]
    machine%links = [link_data(1, 3, 0.018591672075686336_dp, 8.656825178060776e-08_dp, [0.0008949900149734449_dp, &
      & 0.0004800507639464402_dp]), link_data(3, 4, 0.01830664957358854_dp, 3.845405293522898e-06_dp, [0.02710364263527239_dp, &
      & -0.00897772420221245_dp]), link_data(2, 4, 0.05270517695642676_dp, 8.09676710356535e-06_dp, [0.019312078368896056_dp, &
      & 0.0_dp]), link_data(4, 5, 0.01802242292456347_dp, 8.436969958436847e-06_dp, [0.037475487430994596_dp, 0.0_dp]), &
      & link_data(5, 0, 0.06879050866522415_dp, 0.0_dp)]
    machine%supports = [support_data([-0.11968826107162774_dp, -0.10899132791380053_dp], [1530747.7652775606_dp, &
      & 1530747.7652775606_dp], [871.2752766794935_dp, 573.9332612632896_dp]), support_data([0.1569200105584469_dp, &
      & -0.10899132791380053_dp], [4484302.061337495_dp, 4484302.061337495_dp], [1534.0571304408813_dp, 1885.9028018246895_dp])]
    machine%frame_mass = 513.8834059534717_dp
    machine%frame_inertia = 1.0222796893772146_dp
    machine%origin = [0.037452692314672895_dp, -0.07977165957655197_dp]
    machine%foundation_stiffness(3, 3) = 18915.543565113057_dp
    machine%foundation_damping = [380.4650283998172_dp, 380.4650283998172_dp, 1.5144141216311258_dp]
    machine%speed_rpm = 9023.360697604465_dp
    machine%held_by = "flywheel"
    machine%acceleration = 9.80665_dp
    machine%turns_of = [0, 0, 1, 0, 0]
  end function press

  !> Derivatives with respect to the start, and to the torque of a flywheel's motor: central differences of turns.
  subroutine test_changes(error)
    type(error_type), allocatable, intent(out) :: error
    real(xp), parameter :: step = 1.0e-5_xp
    type(exact_specimen) :: one
    type(frame_type) :: frame
    type(turn_type) :: turn, ahead, behind
    real(xp), allocatable :: x(:), moved(:)
    real(xp) :: motor, off
    integer :: k, n

    do n = 1, machines
      one = specimen(n)
      call new_frame(one%machine, frame)
      x = 0.01_xp * [(sin(2.3_xp * k + n), k = 1, 2 * size(frame%free))]
      call run_turn(frame, in_one(x), 0.0_xp, 48 * one%machine%turns, .true., turn)
      do k = 1, size(x) + 1
        motor = 0
        moved = x
        if (k <= size(x)) moved(k) = x(k) + step
        if (k > size(x)) motor = step * frame%machine%frame_inertia * frame%speed**2
        call run_turn(frame, in_one(moved), motor, 48 * one%machine%turns, .true., ahead)
        call run_turn(frame, in_one(2 * x - moved), -motor, 48 * one%machine%turns, .true., behind)
        off = norm2((ahead%x(:, ubound(ahead%x, 2)) - behind%x(:, ubound(behind%x, 2))) / (2 * step) - turn%change(:, k, 1)) &
          & / norm2(turn%change)
        ! The step squared times the third derivative, of some hundred on a turn.
        call check_that(error, real(off, dp), "<", 1.0e-6_dp, trim(one%linkage) // ": the end")
        off = abs((ahead%work - behind%work) / (2 * step) - turn%work_change(k, 1)) / max(norm2(turn%work_change), tiny(off))
        call check_that(error, real(off, dp), "<", 1.0e-6_dp, trim(one%linkage) // ": the dampers' work")
      end do
    end do
  end subroutine test_changes

  !> The start of a period that is one piece.
  pure function in_one(x) result(start)
    real(xp), intent(in) :: x(:)
    real(xp) :: start(size(x), 1)

    start(:, 1) = x
  end function in_one

  !> det Phi(T) is the exponential of the integral of the trace. The drive's mean power equals that of the dampers; with a
  !> flywheel its mean torque equals that of the motor. Forces and moment on the ground equal the loss of momentum and angular
  !> momentum.
  subroutine test_laws(error)
    type(error_type), allocatable, intent(out) :: error
    type(exact_specimen) :: one
    type(frame_type) :: frame
    type(orbit_type) :: orbit
    character(len=8), parameter :: holders(3) = [character(len=8) :: "motor", "flywheel", "outside"]
    integer :: found, n

    found = 0
    do n = 1, 3 * machines
      one = specimen(n)
      ! Weights act on the angular momentum, so it is not checked with weights (check_laws).
      one%machine%acceleration = 0
      one%machine%held_by = holders(1 + modulo(n, 3))
      call new_frame(one%machine, frame)
      call search_vibration(frame, 48 * one%machine%turns, orbit)
      if (.not. orbit%found) cycle
      found = found + 1
      call check_laws(frame, orbit, trim(one%linkage), error)
      if (allocated(error) .or. found == machines) exit
    end do
    if (.not. allocated(error)) call check_that(error, found, "==", machines, "machines")
  end subroutine test_laws

  !> The same laws with weights that make the frame fall over. An oracle whose rounding errors grow as disturbances do violates
  !> them by 1e-6.
  subroutine test_growth(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: numbers(3) = [619, 630, 678]
    type(exact_specimen) :: one
    type(frame_type) :: frame
    type(orbit_type) :: orbit
    integer :: n

    do n = 1, size(numbers)
      one = specimen(numbers(n))
      call new_frame(one%machine, frame)
      call search_vibration(frame, 96, orbit)
      call check_that(error, orbit%found, "==", .true., trim(one%linkage) // ": found")
      if (.not. allocated(error)) call check_that(error, real(maxval(abs(orbit%rho)), dp), ">", 1.0e6_dp, trim(one%linkage))
      if (.not. allocated(error)) call check_laws(frame, orbit, trim(one%linkage), error)
      if (allocated(error)) return
    end do
  end subroutine test_growth

  !> Multipliers of 1.5e12 and of 4e-19, and a motor's torque that makes the vibration without it too poor a start.
  subroutine test_unstable(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: numbers(3) = [42, 619, 656]
    type(exact_tally_type) :: tally
    integer :: n

    do n = 1, size(numbers)
      call examine(numbers(n), tally)
    end do
    call check_that(error, size(tally%failures), "==", 0, "failures")
    if (allocated(error)) error%message = error%message // ", the first: " // trim(tally%failures(1))
    if (.not. allocated(error)) call check_that(error, tally%vibrations, "==", size(numbers), "vibrations")
  end subroutine test_unstable

  subroutine check_laws(frame, orbit, name, error)
    type(frame_type), intent(in) :: frame
    type(orbit_type), intent(in) :: orbit
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: samples = 384
    type(signal_type), allocatable :: signals(:)
    type(turn_type) :: turn
    type(equations_type) :: eq
    real(xp) :: momentum(samples, 2), spin(samples)
    real(xp) :: q(3), v(3), a(3), phi, trace_sum, power, off(2)
    complex(xp) :: sums
    integer :: k

    call find_signals(frame, orbit, samples, signals)
    call run_turn(frame, orbit%start, orbit%motor, samples, .false., turn)
    trace_sum = 0
    power = 0
    do k = 1, samples
      phi = frame%speed * frame%period * (k - 1) / samples
      call acceleration_of(frame, phi, turn%x(:, k - 1), orbit%motor, q, v, a)
      call evaluate(frame, phi, q, v, orbit%motor, .true., eq)
      power = power + eq%power / samples
      trace_sum = trace_sum - trace_of(eq%m(frame%free, frame%free), eq%by_speed(frame%free, frame%free)) * frame%period / samples
      call momenta(frame, phi, q, v, sums, spin(k))
      momentum(k, 1) = real(sums)
      momentum(k, 2) = aimag(sums)
    end do
    call check(error, real(log(determinant(orbit%phi)), dp), real(trace_sum, dp), &
      & thr=1.0e-12_dp * max(1.0_dp, real(abs(trace_sum), dp)), more=name // ": Liouville")
    if (allocated(error)) return
    associate (torque => values("torque"))
      call check(error, real(sum(torque) / samples * frame%speed, dp), real(power, dp), thr=1.0e-12_dp * real(maxval(abs(torque)) &
        & * abs(frame%speed), dp), more=name // ": power")
      if (.not. allocated(error) .and. frame%machine%held_by == "flywheel") call check(error, real(sum(torque) / samples, dp), &
        & real(orbit%motor, dp), thr=1.0e-12_dp * real(maxval(abs(torque)), dp), more=name // ": the motor's torque")
      if (allocated(error)) return
      ! A holder outside the machine takes the torque from the ground.
      if (frame%machine%held_by == "outside") spin = spin - integral(torque, frame%period)
      if (frame%machine%held_by == "flywheel") spin = spin - integral(torque - orbit%motor, &
        & frame%period)
    end associate
    off(1) = largest(integral(values("total.fx"), frame%period) + momentum(:, 1)) / largest(momentum(:, 1))
    off(2) = largest(integral(values("total.fy"), frame%period) + momentum(:, 2)) / largest(momentum(:, 2))
    call check_that(error, real(off, dp), "<", 1.0e-12_dp, name // ": momentum")
    ! Static forces move with the heads, which the moment on the ground leaves out.
    if (allocated(error) .or. abs(frame%gravity) > 0) return
    ! The foundation's moment does not contain the arm of its forces due to the displacement of F.
    off(1) = largest(integral(values("total.m") + values("xi") * values("foundation.fy") - values("eta") &
      & * values("foundation.fx"), frame%period) + spin) / largest(spin)
    call check_that(error, real(off(1), dp), "<", 1.0e-12_dp, name // ": angular momentum")

  contains

    function values(quantity)
      character(len=*), intent(in) :: quantity
      real(xp) :: values(samples)
      integer :: m

      do m = 1, size(signals)
        if (signals(m)%name == quantity) values = signals(m)%samples(:, 1)
      end do
    end function values

  end subroutine check_laws

  !> Trace of M^-1 B.
  real(xp) function trace_of(m, b) result(trace_sum)
    real(xp), intent(in) :: m(:, :), b(:, :)
    real(xp) :: column(size(m, 1))
    integer :: k

    trace_sum = 0
    do k = 1, size(m, 1)
      column = solved(m, b(:, k))
      trace_sum = trace_sum + column(k)
    end do
  end function trace_of

  !> Momentum of frame and links, and their angular momentum about F at rest.
  subroutine momenta(frame, phi, q, v, momentum, spin)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: phi, q(3), v(3)
    complex(xp), intent(out) :: momentum
    real(xp), intent(out) :: spin
    complex(xp) :: r(0:3, size(frame%machine%links)), z, z_dot, u, u_dot
    real(xp) :: turns(3, size(frame%machine%links)), w
    integer :: n

    u = cmplx(q(1), q(2), xp)
    u_dot = cmplx(v(1), v(2), xp)
    momentum = frame%machine%frame_mass * u_dot
    spin = frame%machine%frame_mass * aimag(conjg(u) * u_dot) + frame%machine%frame_inertia * v(3)
    w = frame%speed - frame%even * v(3)
    call trace(frame%machine, exp(i * (phi - frame%even * q(3)) / frame%machine%turns), r, turns)
    do n = 1, size(frame%machine%links)
      associate (link => frame%machine%links(n))
        z = exp(i * q(3)) * (r(0, n) + cmplx(frame%machine%origin(1), frame%machine%origin(2), xp))
        z_dot = u_dot + i * v(3) * z + exp(i * q(3)) * r(1, n) * w
        z = u + z
        momentum = momentum + link%mass * z_dot
        spin = spin + link%mass * aimag(conjg(z) * z_dot) + link%inertia * (v(3) + turns(1, n) * w)
      end associate
    end do
  end subroutine momenta

  !> The integral of a periodic function less its mean, but for a constant, by its Fourier series.
  function integral(f, period)
    real(xp), intent(in) :: f(:), period
    real(xp) :: integral(size(f))
    complex(xp) :: c
    integer :: k, m, n

    n = size(f)
    integral = 0
    do k = 1, (n - 1) / 2
      c = 0
      do m = 0, n - 1
        c = c + f(m + 1) * exp(-2 * i * pi * modulo(k * m, n) / n) / n
      end do
      c = c * period / (2 * pi * i * k)
      do m = 0, n - 1
        integral(m + 1) = integral(m + 1) + 2 * real(c * exp(2 * i * pi * modulo(k * m, n) / n))
      end do
    end do
  end function integral

  !> Maximum deviation from the mean.
  pure real(xp) function largest(f)
    real(xp), intent(in) :: f(:)

    largest = maxval(abs(f - sum(f) / size(f)))
  end function largest

end module test_oracle
