!> The driving torque and the balance of its power.
module test_drive
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_quantity_driving, only: damper_watts, drive_power, drive_watts, power_rows, rigid_torque, stored_energy, torque
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_quantity_rows, only: accelerations
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_task_power_drive, only: drive_type, find_drive
  use reference_cases, only: random_linkage, random_machine
  use reference_linear, only: qp
  use reference_linkage, only: motion_type, move
  use reference_machine, only: khang_machine, machine_data, pi_qp
  use reference_momentum, only: derivative, exact_torque
  use reference_random, only: random_type
  use shaken_ground, only: make, near
  use systems, only: diagonal
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_drive

contains

  subroutine collect_drive(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the driving torque agrees with Lagrange's equation at random states", test_lagrange), &
      & new_unittest("the torque's error bounds cover errors of the motion, row by row", test_torque_error), &
      & new_unittest("drive power equals energy growth plus damper power at all times", test_balance), &
      & new_unittest("torque and power of a rotating unbalance agree with the closed form", test_unbalance), &
      & new_unittest("mass functions yield the links' torque; without energy it is unknown", test_mass_functions), &
      & new_unittest("power balances even for nonsymmetric stiffness and damping", test_circulation), &
      & new_unittest("error bounds of torque peaks hold; peak, rms and mean agree with a history", test_errors)]
  end subroutine collect_drive

  subroutine solve(frame, points, tolerance, drive, error)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: points
    real(dp), intent(in) :: tolerance
    type(drive_type), intent(out) :: drive
    type(error_type), allocatable, intent(out) :: error
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure
    logical :: known

    call analyse(frame, analysis_options(model="rest", points=points, rows=accelerations), accuracy_type(tolerance=tolerance), &
      & analysis, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call find_drive(frame, analysis%vibration, drive, known, failure)
    call check(error, known, more="known")
  end subroutine solve

  !> Random linkages and states. The difference from the exact kinetic energy is of third order in the frame's motion, so it
  !> falls by a factor of a thousand if the motion falls by ten.
  subroutine test_lagrange(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(random_type) :: random
    real(dp) :: power(power_rows, 1), motion(9, 1), miss(3), phase, rate, rigid
    real(qp) :: exact
    logical :: known
    integer :: number, i, k

    do number = 1, 20
      machine = random_linkage(number, 1.0_dp, 20.0_dp)
      call make(machine, frame, error)
      if (allocated(error)) return
      call random%start(number, 7)
      phase = random%between(0.0_dp, 1.0_dp)
      rate = 2 * pi / frame%period
      motion(:, 1) = [(random%about_zero(1.0_dp), i = 1, 9)]
      motion(4:6, 1) = rate * motion(4:6, 1)
      motion(7:9, 1) = rate**2 * motion(7:9, 1)
      rigid = 0
      do i = 1, 3
        motion = motion / 10
        ! The frame's crank angle does not contain the crank's phase, like the reference's.
        call drive_power(frame, [phase], motion, power, known)
        exact = exact_torque(machine, sign(1.0_qp, real(frame%speed, qp)) * 2 * pi_qp * phase, real(motion(1:3, 1), qp), &
          & real(motion(4:6, 1), qp), real(motion(7:9, 1), qp))
        miss(i) = real(abs(power(torque, 1) - exact), dp)
      end do
      do k = 1, 2
        ! The next order, a tenth of that, may change it considerably.
        call check_that(error, miss(k + 1), "<", max(4.0e-3_dp * miss(k), 1.0e-13_dp * abs(power(torque, 1))), "third order")
        if (allocated(error)) return
      end do
      exact = exact_torque(machine, sign(1.0_qp, real(frame%speed, qp)) * 2 * pi_qp * phase, [0.0_qp, 0.0_qp, 0.0_qp], &
        & [0.0_qp, 0.0_qp, 0.0_qp], [0.0_qp, 0.0_qp, 0.0_qp])
      ! Differences of the reference to 1e-20; accelerations of joints cancel to a few digits.
      call near(error, power(rigid_torque, :), [real(exact, dp)], 1.0e-12_dp * max(abs(real(exact, dp)), &
        & frame%speed**2 * frame%mechanism%mass * 0.01_dp), "rigid")
      if (allocated(error)) return
    end do
  end subroutine test_lagrange

  !> To first order an error of one row of the motion changes the torque by as much as claimed. Rows that the torque does not
  !> depend on contribute nothing; together the claims add up.
  subroutine test_torque_error(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: small = 1.0e-6_dp
    type(frame_type) :: frame
    type(random_type) :: random
    real(dp) :: power(power_rows, 1), changed(power_rows, 1), motion(9, 1), errors(9), claimed, own, sum_of_all, rate
    logical :: known
    integer :: i

    call make(random_linkage(3, 1.0_dp, 20.0_dp), frame, error)
    if (allocated(error)) return
    call random%start(1, 8)
    rate = 2 * pi / frame%period
    motion(:, 1) = [(random%about_zero(0.1_dp), i = 1, 9)]
    motion(4:6, 1) = rate * motion(4:6, 1)
    motion(7:9, 1) = rate**2 * motion(7:9, 1)
    call drive_power(frame, [0.37_dp], motion, power, known)
    ! every error comes with the torque's own rounding
    call drive_power(frame, [0.37_dp], motion, changed, known, spread(0.0_dp, 1, 9), own)
    sum_of_all = 0
    do i = 1, 9
      errors = 0
      errors(i) = small * max(abs(motion(i, 1)), 1.0e-3_dp)
      motion(i, 1) = motion(i, 1) + errors(i)
      call drive_power(frame, [0.37_dp], motion, changed, known, errors, claimed)
      motion(i, 1) = motion(i, 1) - errors(i)
      ! Second order, and roundings of the torque.
      call near(error, [claimed - own], [abs(changed(torque, 1) - power(torque, 1))], 10 * small * claimed + 1.0e-12_dp * &
        & abs(power(torque, 1)), "row")
      if (allocated(error)) return
      sum_of_all = sum_of_all + claimed - own
    end do
    errors = small * max(abs(motion(:, 1)), 1.0e-3_dp)
    call drive_power(frame, [0.37_dp], motion, changed, known, errors, claimed)
    call near(error, [claimed - own], [sum_of_all], 10 * small * claimed, "all")
  end subroutine test_torque_error

  !> d/dt of the energy, from its harmonics, is the drive's power minus that of the dampers; the mean over the turn is zero. For
  !> both directions of rotation, with guides, with a foundation.
  subroutine test_balance(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 512
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(drive_type) :: drive
    integer :: number

    do number = 1, 8
      machine = random_linkage(number, 1.0_dp, 20.0_dp)
      if (number == 1) machine = khang_machine(-360.0_dp, 3.0_dp)
      machine%free(1 + mod(number, 3)) = number < 5
      call make(machine, frame, error)
      if (.not. allocated(error)) call solve(frame, points, 1.0e-12_dp, drive, error)
      if (allocated(error)) return
      associate (h => drive%history(:, :points))
        ! 1e-12 of the motion, times orders up to 100.
        call near(error, derivative(h(stored_energy, :), frame%period), h(drive_watts, :) - h(damper_watts, :), &
          & 1.0e-8_dp * drive%maximum, "at every time")
        call near(error, h(drive_watts, :), frame%speed * h(torque, :), 1.0e-14_dp * drive%maximum, "power")
        call near(error, [drive%defect()], [0.0_dp], 1.0e-10_dp, "over the turn")
        call near(error, [drive%drive_mean, drive%dampers_mean], [sum(h(drive_watts, :)), sum(h(damper_watts, :))] / points, &
          & 1.0e-12_dp * drive%maximum, "means")
        if (allocated(error)) return
        call check_that(error, h(damper_watts, :), ">=", 0.0_dp, "dampers take")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_balance

  !> An unbalance u on a frame free along x: q = Re(Q exp(i omega t)), torque -u sin(phi) q''. On a rigid frame it needs none.
  subroutine test_unbalance(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 60
    real(dp), parameter :: u = 0.05_dp, mass = 20, stiffness = 5.0e4_dp, damping = 80, omega = 45
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(drive_type) :: drive
    type(gestell_error), allocatable :: failure
    complex(dp) :: q, iw
    real(dp) :: speed, t, acceleration, velocity
    integer :: turn, i

    iw = cmplx(0.0_dp, omega, dp)
    q = u * omega**2 / (mass * iw**2 + damping * iw + stiffness)
    call new_harmonic_mechanism(mechanism, 2.0_dp, 0.01_dp, [0.0_dp, u, 0.0_dp], [0.0_dp, 0.0_dp, u], [0.01_dp], [0.02_dp], &
      & failure, energy=[0.02_dp])
    do turn = 1, 2
      speed = merge(omega, -omega, turn == 1)
      call new_frame(frame, mechanism, mass - 2, 1.0_dp, [0.0_dp, 0.0_dp], diagonal([stiffness, 0.0_dp, 0.0_dp]), &
        & diagonal([damping, 0.0_dp, 0.0_dp]), speed, failure, free=[1])
      call check_success(error, failure)
      if (.not. allocated(error)) call solve(frame, points, 1.0e-12_dp, drive, error)
      if (allocated(error)) return
      do i = 0, points
        t = frame%period * i / points
        velocity = real(iw * q * exp(iw * t), dp)
        acceleration = real(iw**2 * q * exp(iw * t), dp)
        ! 1e-12 of the motion, a torque of about 1 N m.
        call near(error, drive%history(torque:rigid_torque, i + 1), [-u * sin(speed * t) * acceleration, 0.0_dp], 1.0e-10_dp, &
          & "torque")
        call near(error, [drive%history(damper_watts, i + 1)], [damping * velocity**2], 1.0e-8_dp, "dampers")
        if (allocated(error)) return
      end do
      ! Half of damping times the square of the amplitude.
      call near(error, [drive%drive_mean, drive%dampers_mean], damping * abs(iw * q)**2 / 2 * [1.0_dp, 1.0_dp], 1.0e-8_dp, "means")
      call near(error, [drive%actual%mean], [damping * abs(iw * q)**2 / 2 / speed], 1.0e-10_dp, "mean torque")
      if (allocated(error)) return
    end do
  end subroutine test_unbalance

  !> The paper's machine by the harmonics of its mass functions, from the reference, has the same torque.
  subroutine test_mass_functions(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: orders = 40, samples = 128, points = 90
    type(machine_data) :: machine
    type(frame_type) :: frame, other
    type(drive_type) :: drive, same
    type(harmonic_mechanism_type) :: mechanism
    type(gestell_error), allocatable :: failure
    type(motion_type) :: motion
    real(dp) :: sums(samples, 5), power(power_rows, 1)
    logical :: known
    integer :: i, k

    machine = khang_machine(360.0_dp)
    call make(machine, frame, error)
    if (allocated(error)) return
    sums = 0
    do k = 1, samples
      motion = move(machine, 2 * pi_qp * (k - 1) / samples)
      do i = 1, size(machine%links)
        associate (m => machine%links(i)%mass, j => machine%links(i)%inertia, r => motion%center(:, 0, i), &
          & rd => motion%center(:, 1, i), turn => motion%turn(1, i))
          sums(k, :) = sums(k, :) + real([m * r(1), m * r(2), m * sum(r**2), m * (r(1) * rd(2) - r(2) * rd(1)) + j * turn, &
            & m * sum(rd**2) + j * turn**2], dp)
        end associate
      end do
    end do
    call new_harmonic_mechanism(mechanism, frame%mechanism%mass, frame%mechanism%inertia, harmonics(sums(:, 1), orders), &
      & harmonics(sums(:, 2), orders), harmonics(sums(:, 3), orders), harmonics(sums(:, 4), orders), failure, &
      & energy=harmonics(sums(:, 5), orders))
    call new_frame(other, mechanism, frame%mass, frame%inertia, frame%origin, frame%stiffness, frame%damping, frame%speed, failure)
    call check_success(error, failure)
    if (.not. allocated(error)) call solve(frame, points, 1.0e-12_dp, drive, error)
    if (.not. allocated(error)) call solve(other, points, 1.0e-12_dp, same, error)
    ! The harmonics fall below 1e-11 before order 40.
    do i = 1, power_rows
      call near(error, same%history(i, :), drive%history(i, :), 1.0e-8_dp * maxval(abs(drive%history(i, :))), "row")
    end do
    if (allocated(error)) return
    deallocate(mechanism%energy)
    call new_frame(other, mechanism, frame%mass, frame%inertia, frame%origin, frame%stiffness, frame%damping, frame%speed, failure)
    call drive_power(other, [0.0_dp], reshape([(0.0_dp, i = 1, 9)], [9, 1]), power, known)
    call check_that(error, known, "==", .false., "unknown")
    call check_that(error, [abs(power)], "<=", 0.0_dp, "unknown")
    if (allocated(error)) return
    call new_harmonic_mechanism(mechanism, 1.0_dp, 0.0_dp, [0.0_dp], [0.0_dp], [0.0_dp], [0.0_dp], failure, &
      & energy=[1.0_dp, 2.0_dp])
    call check_failure(error, failure, what="an even number of coefficients")
  end subroutine test_mass_functions

  !> Mean, factors of cos and sin, from equidistant samples.
  pure function harmonics(samples, orders) result(c)
    real(dp), intent(in) :: samples(:)
    integer, intent(in) :: orders
    real(dp) :: c(1 + 2 * orders), angles(size(samples))
    integer :: i, k

    angles = [(2 * pi * i / size(samples), i = 0, size(samples) - 1)]
    c(1) = sum(samples) / size(samples)
    do k = 1, orders
      c(2 * k) = 2 * sum(samples * cos(k * angles)) / size(samples)
      c(2 * k + 1) = 2 * sum(samples * sin(k * angles)) / size(samples)
    end do
  end function harmonics

  !> A mounting whose stiffness is not symmetric, and whose damping is not: energy and powers still balance.
  subroutine test_circulation(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 256
    type(frame_type) :: frame, other
    type(drive_type) :: drive
    type(gestell_error), allocatable :: failure
    real(dp) :: stiffness(3, 3), damping(3, 3)

    call make(khang_machine(300.0_dp), frame, error)
    if (allocated(error)) return
    stiffness = frame%stiffness
    stiffness(1, 2) = stiffness(1, 2) + 2.0e4_dp
    stiffness(3, 1) = stiffness(3, 1) - 5.0e3_dp
    damping = diagonal([300.0_dp, 200.0_dp, 20.0_dp])
    damping(2, 1) = 60
    call new_frame(other, frame%mechanism, frame%mass, frame%inertia, frame%origin, stiffness, damping, frame%speed, failure)
    call check_success(error, failure)
    if (.not. allocated(error)) call solve(other, points, 1.0e-12_dp, drive, error)
    if (allocated(error)) return
    associate (h => drive%history(:, :points))
      call near(error, derivative(h(stored_energy, :), frame%period), h(drive_watts, :) - h(damper_watts, :), &
        & 1.0e-9_dp * drive%maximum, "at every time")
      call near(error, [drive%defect()], [0.0_dp], 1.0e-12_dp, "over the turn")
    end associate
  end subroutine test_circulation

  !> At loose tolerances, against a solution at 1e-13; peak, place, rms and mean against a fine history.
  subroutine test_errors(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 720
    real(dp), parameter :: tolerances(3) = [1.0e-2_dp, 1.0e-4_dp, 1.0e-7_dp]
    type(frame_type) :: frame
    type(drive_type) :: exact, drive
    real(dp) :: miss, maximum
    integer :: number, i, at

    maximum = 0
    do number = 1, 6
      call make(random_machine(30 + number, 3.0_dp, 30.0_dp), frame, error)
      if (.not. allocated(error)) call solve(frame, points, 1.0e-13_dp, exact, error)
      if (allocated(error)) return
      associate (h => exact%history(torque, :points), claimed => exact%actual)
        at = maxloc(abs(h), dim=1)
        ! Points 0.5 deg apart, orders up to 40.
        call near(error, [claimed%peak], [h(at)], 0.5_dp * (40 * pi / points)**2 * abs(h(at)), "peak")
        call near(error, [abs(modulo(claimed%peak_phase - real(at - 1, dp) / points + 0.5_dp, 1.0_dp) - 0.5_dp)], [0.0_dp], &
          & 0.5_dp / points, "where")
        call near(error, [claimed%rms, claimed%mean], [sqrt(sum(h**2) / points), sum(h) / points], 1.0e-12_dp * abs(h(at)), &
          & "rms and mean")
        if (allocated(error)) return
      end associate
      do i = 1, size(tolerances)
        call solve(frame, 64, tolerances(i), drive, error)
        if (allocated(error)) return
        miss = abs(abs(drive%actual%peak) - abs(exact%actual%peak))
        maximum = max(maximum, miss / drive%peak_error)
        call check_that(error, miss, "<=", drive%peak_error + exact%peak_error, "peak")
        if (allocated(error)) return
      end do
    end do
    call check_that(error, maximum, ">", 1.0e-3_dp, "the claimed errors are not too wide")
  end subroutine test_errors

end module test_drive
